//! Enclosures of the values on one axis over the slabs of each octree level.
//!
//! A box of the octree is a product of three slabs, so what depends on one axis has few different
//! ranges: twice as many as there are bricks along the axis. They are true ranges over the
//! continuous slab, not over its nodes alone. The halves of a slab lie side by side, because boxes
//! are enclosed eight halves at a time.

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
    /// The number of the first pair of slabs of each level.
    starts: Vec<usize>,
    /// Number of tables.
    tables: usize,
    /// The ranges of all tables over a pair of slabs, pair by pair.
    ends: Vec<[f64; 4]>,
    nans: Vec<[bool; 2]>,
    /// Of each pair: whether all its ranges are finite and free of NaN.
    plain: Vec<bool>,
}

/// The ranges of all tables over two slabs that are halves of one.
#[derive(Clone, Copy, Debug)]
pub struct Pairs<'a> {
    /// By table: the lower ends in both halves, then the upper ends.
    pub ends: &'a [[f64; 4]],
    nans: &'a [[bool; 2]],
    /// Whether all ranges are finite and free of NaN.
    pub plain: bool,
}

impl Pairs<'_> {
    /// The range of table `table` over half `half`, 0 or 1.
    #[must_use]
    #[inline(always)]
    pub fn range(&self, table: usize, half: usize) -> Interval {
        let ends = &self.ends[table];
        Interval { lo: ends[half & 1], hi: ends[2 + (half & 1)], nan: self.nans[table][half & 1] }
    }
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
                starts.push(slabs.len() / 2);
                let side = BRICK << level;
                let slab = |i: usize| {
                    Interval::new(table[(i * side).min(last)], table[((i + 1) * side).min(last)])
                };
                let count = bricks[axis.index()].div_ceil(1 << level);
                // A last slab without a sibling stands for that, too.
                slabs.extend((0..count.next_multiple_of(2)).map(|i| slab(i.min(count - 1))));
            }
            let nodes = leaves.tables(axis);
            let anything = vec![Interval::ANYTHING; slabs.len()];
            let at = Axis::ALL.map(|a| if a == axis { &slabs[..] } else { &anything[..] });
            let mut columns = vec![Interval::ANYTHING; nodes.len() * slabs.len()];
            enclose(graph, nodes, at, parameters, &mut columns)?;
            let pairs = slabs.len() / 2;
            let (mut ends, mut nans) = (Vec::new(), Vec::new());
            let mut plain = vec![true; pairs];
            for (pair, plain) in plain.iter_mut().enumerate() {
                for table in 0..nodes.len() {
                    let [a, b] = [0, 1].map(|half| columns[table * slabs.len() + 2 * pair + half]);
                    ends.push([a.lo, b.lo, a.hi, b.hi]);
                    nans.push([a.nan, b.nan]);
                    *plain &= [a, b].iter().all(|r| !r.nan && r.lo.is_finite() && r.hi.is_finite());
                }
            }
            Ok(AxisLevels { starts, tables: nodes.len(), ends, nans, plain })
        };
        Ok(Self { axes: [axis(Axis::X)?, axis(Axis::Y)?, axis(Axis::Z)?] })
    }

    /// The ranges of all tables along `axis` over slab `index` of `level` and its sibling.
    #[must_use]
    #[inline]
    pub fn pairs(&self, axis: Axis, level: u8, index: u32) -> Pairs<'_> {
        let own = &self.axes[axis.index()];
        let level = usize::from(level).min(own.starts.len() - 1);
        let pair = own.starts[level] + index as usize / 2;
        let tables = pair * own.tables..(pair + 1) * own.tables;
        Pairs { ends: &own.ends[tables.clone()], nans: &own.nans[tables], plain: own.plain[pair] }
    }
}
