//! Tables and uniform values as compiled code reads them.

use super::calls::{PLANE, ROW};
use crate::eval::leaves::LeafValues;
use crate::eval::sampler::End;
use crate::expr::Oracle;
use crate::geom::Axis;
use std::sync::Arc;

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
            let mut tiles = Vec::with_capacity(len.div_ceil(ROW) * count * ROW);
            for first in (0..len).step_by(ROW) {
                for number in 0..count {
                    let table = values.table(axis, number as u32, first);
                    let tile = &table[..table.len().min(ROW)];
                    tiles.extend_from_slice(tile);
                    // The last node of the grid stands alone in its tile.
                    tiles.resize(tiles.len() + ROW - tile.len(), 0.0);
                }
            }
            tiles
        });
        Self { tables, counts, uniforms: values.uniforms.clone(), oracles: oracles.to_vec() }
    }

    /// The tables along `axis` in the brick at `brick` along it, sixteen numbers each.
    #[inline]
    pub(super) fn tile(&self, axis: Axis, brick: u32) -> &[f64] {
        let len = self.counts[axis.index()] * ROW;
        &self.tables[axis.index()][brick as usize * len..][..len]
    }
}

/// The nodes of a batch of edges, within their brick.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    brick: [u32; 3],
    /// Place of each lane's node in the brick along each axis.
    places: [[u8; PLANE]; 3],
    /// How far the gathered node is beyond the lane's along each axis: nought or one.
    ahead: [u8; 3],
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
            *x = (node % 16) as u8;
            *y = (node / 16 % 16) as u8;
            *z = (node / 256 % 16) as u8;
        }
    }

    /// Looks at the nodes at one end of the edges along `axis`.
    pub(super) fn look(&mut self, axis: Axis, end: End) {
        self.ahead = [0; 3];
        self.ahead[axis.index()] = u8::from(end == End::Upper);
    }

    /// The numbers of table `table` of `axis` at the lanes' nodes.
    pub(super) fn gather(&self, tiles: &Tiles, axis: Axis, table: usize, out: &mut [f64]) {
        let (a, ahead) = (axis.index(), self.ahead[axis.index()]);
        // A power of two, so that no lane needs a test.
        let mut row = [0.0; 2 * ROW];
        let tile = &tiles.tile(axis, self.brick[a])[table * ROW..][..ROW];
        if ahead == 0 {
            row[..ROW].copy_from_slice(tile);
        } else {
            row[..ROW - 1].copy_from_slice(&tile[1..]);
            row[ROW - 1] = tiles.tile(axis, self.brick[a] + 1)[table * ROW];
        }
        for (out, place) in out.iter_mut().zip(&self.places[a]) {
            *out = row[usize::from(*place) % (2 * ROW)];
        }
    }
}
