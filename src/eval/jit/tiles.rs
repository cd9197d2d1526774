//! Tables and uniform values as compiled code reads them.

use super::calls::{PLANE, ROW};
use crate::eval::leaves::LeafValues;
use crate::eval::sampler::{End, place_of};
use crate::expr::Oracle;
use crate::geom::Axis;
use std::sync::Arc;

/// Numbers from one row of a tile to the next: those of the brick's nodes, that of the first node of
/// the next brick, and one more so that rows begin at whole vectors.
pub(super) const STRIDE: usize = ROW + 2;

/// Numbers that may be read beyond the end of a tile.
const SLACK: usize = ROW;

/// What a bound program reads: the tables of each axis cut into bricks, so that all numbers that a
/// brick needs lie together and at fixed distances; the uniform values; the oracles.
#[derive(Clone, Debug)]
pub struct Tiles {
    tables: [Vec<f64>; 3],
    counts: [usize; 3],
    pub(super) uniforms: Vec<f64>,
    pub(super) oracles: Vec<Arc<dyn Oracle>>,
}

impl Tiles {
    /// The values of the leaves, rearranged.
    #[must_use]
    pub fn new(values: &LeafValues, counts: [usize; 3], oracles: &[Arc<dyn Oracle>]) -> Self {
        let tables = Axis::ALL.map(|axis| {
            let (len, count) = (values.lengths[axis.index()], counts[axis.index()]);
            let mut tiles = Vec::with_capacity(len.div_ceil(ROW) * count * STRIDE + SLACK);
            for first in (0..len).step_by(ROW) {
                for number in 0..count {
                    let table = values.table(axis, number as u32, first);
                    let row = &table[..table.len().min(ROW + 1)];
                    tiles.extend_from_slice(row);
                    // The last node of the grid stands alone in its tile.
                    tiles.resize(tiles.len() + STRIDE - row.len(), 0.0);
                }
            }
            tiles.resize(tiles.len() + SLACK, 0.0);
            tiles
        });
        Self { tables, counts, uniforms: values.uniforms.clone(), oracles: oracles.to_vec() }
    }

    /// The rows of the tables along `axis` in the brick at `brick` along it, [`STRIDE`] numbers
    /// apart, and what may be read beyond them.
    #[inline]
    pub(super) fn tile(&self, axis: Axis, brick: u32) -> &[f64] {
        let len = self.counts[axis.index()] * STRIDE;
        &self.tables[axis.index()][brick as usize * len..][..len + SLACK]
    }
}

/// The nodes of a batch of edges, within their brick.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    brick: [u32; 3],
    /// Place of each lane's node in the brick along each axis, 0 to 16.
    pub(super) places: [[u16; PLANE]; 3],
    /// How far the node that is looked at is beyond the lane's along each axis: nought or one.
    ahead: [usize; 3],
}

impl Default for Nodes {
    fn default() -> Self {
        Self { brick: [0; 3], places: [[0; PLANE]; 3], ahead: [0; 3] }
    }
}

impl Nodes {
    /// Takes the nodes `nodes` of the brick at `brick`.
    pub(super) fn set(&mut self, brick: [u32; 3], nodes: &[u16]) {
        let Self { brick: own, places: [x, y, z], .. } = self;
        *own = brick;
        for (((x, y), z), node) in x.iter_mut().zip(y).zip(z).zip(nodes) {
            [*x, *y, *z] = place_of(*node).map(|place| place as u16);
        }
    }

    /// Looks at the nodes at one end of the edges along `axis`.
    pub(super) fn look(&mut self, axis: Axis, end: End) {
        self.ahead = [0; 3];
        self.ahead[axis.index()] = usize::from(end == End::Upper);
    }

    /// The tables in which the numbers at the nodes are found by the places of their lanes.
    pub(super) fn tables<'a>(&self, tiles: &'a Tiles) -> [&'a [f64]; 3] {
        Axis::ALL.map(|axis| {
            let a = axis.index();
            &tiles.tile(axis, self.brick[a])[self.ahead[a]..]
        })
    }
}
