//! Tables and uniform values as compiled code reads them.

use super::calls::{PLANE, ROW};
use crate::eval::leaves::LeafValues;
use crate::eval::sampler::{End, place_of};
use crate::expr::Oracle;
use crate::geom::Axis;
use std::sync::Arc;

/// Lanes that are gathered together.
pub(super) const BLOCK: usize = 8;

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

impl Tiles {
    /// The first number of table `table` of the brick after `brick`; the grid's last node, which may
    /// stand alone in a brick, has none after it.
    #[inline]
    fn beyond(&self, axis: Axis, brick: u32, table: usize) -> f64 {
        let len = self.counts[axis.index()] * ROW;
        let at = (brick as usize + 1) * len + table * ROW;
        self.tables[axis.index()].get(at).copied().unwrap_or_default()
    }
}

/// The nodes of a batch of edges, within their brick.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    brick: [u32; 3],
    /// Place of each lane's node in the brick along each axis, 0 to 16.
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
            [*x, *y, *z] = place_of(*node).map(|place| place as u8);
        }
    }

    /// Looks at the nodes at one end of the edges along `axis`.
    pub(super) fn look(&mut self, axis: Axis, end: End) {
        self.ahead = [0; 3];
        self.ahead[axis.index()] = u8::from(end == End::Upper);
    }

    /// The numbers of the `tables` of `axis` at the lanes' nodes, each table's to its own buffer, as
    /// long as which is a multiple of [`BLOCK`].
    ///
    /// Blocks of lanes of all tables together: finding a lane's place is half of the work.
    pub(super) fn gather<const N: usize>(
        &self,
        tiles: &Tiles,
        axis: Axis,
        tables: [usize; N],
        mut out: [&mut [f64]; N],
    ) {
        let a = axis.index();
        let (tile, ahead) = (tiles.tile(axis, self.brick[a]), self.ahead[a]);
        // Twice as long as a tile, for the node on the far face.
        let mut rows = [[0.0; 2 * ROW]; N];
        for (row, table) in rows.iter_mut().zip(tables) {
            let own = &tile[table * ROW..][..ROW];
            if ahead == 0 {
                row[..ROW].copy_from_slice(own);
                row[ROW] = tiles.beyond(axis, self.brick[a], table);
            } else {
                row[..ROW - 1].copy_from_slice(&own[1..]);
                row[ROW - 1] = tiles.tile(axis, self.brick[a] + 1)[table * ROW];
            }
        }
        let blocks = out.first().map_or(0, |out| out.len() / BLOCK);
        for (b, block) in self.places[a].as_chunks::<BLOCK>().0[..blocks].iter().enumerate() {
            // A remainder, so that no lane needs a test.
            let places = block.map(|place| usize::from(place) % (2 * ROW));
            for (out, row) in out.iter_mut().zip(&rows) {
                if let Some(out) = out[BLOCK * b..].first_chunk_mut::<BLOCK>() {
                    for (out, place) in out.iter_mut().zip(places) {
                        *out = row[place];
                    }
                }
            }
        }
    }
}
