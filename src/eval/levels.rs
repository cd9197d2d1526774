//! Enclosures of the values on one axis over the slabs of each octree level.
//!
//! A box of the octree is a product of three slabs, so what depends on one axis has few different
//! ranges: twice as many as there are bricks along the axis. They are true ranges over the
//! continuous slab, not over its nodes alone.

use super::interpret::enclose;
use super::leaves::Leaves;
use super::sampler::BRICK;
use crate::expr::{Failure, Graph};
use crate::geom::Axis;
use crate::num::Interval;

/// The enclosures of all tables over all slabs.
#[derive(Clone, Debug)]
pub struct Levels {
    axes: [AxisLevels; 3],
}

#[derive(Clone, Debug)]
struct AxisLevels {
    /// The number of the first slab of each level.
    starts: Vec<usize>,
    /// Number of tables.
    tables: usize,
    /// The ranges of all tables over a slab, slab by slab.
    ranges: Vec<Interval>,
}

impl Levels {
    /// Encloses the tables of `leaves`, which are nodes of `graph`, over the slabs of a grid.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn new(
        leaves: &Leaves,
        graph: &Graph,
        coordinates: &[Vec<f64>; 3],
        parameters: &[f64],
    ) -> Result<Self, Failure> {
        let bricks = coordinates.each_ref().map(|table| (table.len() / BRICK).max(1));
        let levels = bricks.iter().map(|n| n.next_power_of_two().ilog2()).max().unwrap_or(0);
        let axis = |axis: Axis| -> Result<AxisLevels, Failure> {
            let table = &coordinates[axis.index()];
            let last = table.len().saturating_sub(1);
            let (mut starts, mut slabs) = (Vec::new(), Vec::new());
            for level in 0..=levels {
                starts.push(slabs.len());
                let side = BRICK << level;
                slabs.extend((0..bricks[axis.index()].div_ceil(1 << level)).map(|i| {
                    Interval::new(table[(i * side).min(last)], table[((i + 1) * side).min(last)])
                }));
            }
            let nodes = leaves.tables(axis);
            let anything = vec![Interval::ANYTHING; slabs.len()];
            let at = Axis::ALL.map(|a| if a == axis { &slabs[..] } else { &anything[..] });
            let mut columns = vec![Interval::ANYTHING; nodes.len() * slabs.len()];
            enclose(graph, nodes, at, parameters, &mut columns)?;
            let ranges = (0..columns.len())
                .map(|i| columns[i % nodes.len() * slabs.len() + i / nodes.len()])
                .collect();
            Ok(AxisLevels { starts, tables: nodes.len(), ranges })
        };
        Ok(Self { axes: [axis(Axis::X)?, axis(Axis::Y)?, axis(Axis::Z)?] })
    }

    /// The ranges of all tables along `axis` over slab `index` of `level`.
    #[must_use]
    #[inline]
    pub fn row(&self, axis: Axis, level: u8, index: u32) -> &[Interval] {
        let own = &self.axes[axis.index()];
        let level = usize::from(level).min(own.starts.len() - 1);
        &own.ranges[(own.starts[level] + index as usize) * own.tables..][..own.tables]
    }
}
