//! Triangles of a brick's cells.

use super::bits::{ROW, Spans};
use super::numbering::{Bits, Block, Quad};
use super::tables::{Case, MAX_TRIANGLES, TABLES, Tables, corners_of};
use crate::eval::BRICK;
use pulp::NullaryFnOnce;
use std::sync::LazyLock;

/// Room for the triangles of any brick; one cell more than there are, because cells write more
/// triangles than they keep.
pub const MOST: usize = MAX_TRIANGLES * (BRICK * BRICK * BRICK + 1);

/// A case for cells that are visited in order along a row.
///
/// Every crossed edge of the four rows around a row of cells belongs to an active cell, so its
/// number is that of the one before plus one: no bits are counted. The vertices of a cell are
/// eight numbers before it (those along x, then those across at its lower end, y before z) and
/// the same eight after it, of which the last four stand for its upper end.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Triangles; slots are positions among the sixteen numbers.
    case: Case,
    /// Which of the first eight are crossed: one or zero.
    crossed: [u8; 8],
}

static STEPS: LazyLock<[Step; 256]> = LazyLock::new(|| {
    // Where the edges of a cell are among the sixteen.
    const PLACES: [u8; 12] = [0, 1, 2, 3, 4, 12, 5, 13, 6, 14, 7, 15];
    std::array::from_fn(|number| {
        let mut case = TABLES.cell[number];
        for slot in &mut case.slots[..3 * usize::from(case.count)] {
            *slot = PLACES[usize::from(*slot)];
        }
        let mut crossed = [0; 8];
        for (edge, place) in PLACES.into_iter().enumerate().filter(|(_, place)| *place < 8) {
            let [low, high] = corners_of(edge);
            crossed[usize::from(place)] = ((number >> low ^ number >> high) & 1) as u8;
        }
        Step { case, crossed }
    })
});

/// Writes the triangles of a brick's cells to the front of `out` and returns how many they are; a
/// task for [`pulp::Arch::dispatch`].
pub struct Facing<'a> {
    /// Signs and numbers of the brick.
    pub block: &'a Block,
    /// Those of the next brick along x, if it owns a vertex.
    pub next: &'a Block,
    /// Spans of the brick.
    pub spans: &'a Spans,
    /// Room for [`MOST`] triangles at least.
    pub out: &'a mut [[u32; 3]],
}

impl NullaryFnOnce for Facing<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        faces(self.block, self.next, self.spans, self.out)
    }
}

#[inline(always)]
fn faces(block: &Block, next: &Block, spans: &Spans, out: &mut [[u32; 3]]) -> usize {
    let (tables, steps): (&Tables, &[Step; 256]) = (&TABLES, &STEPS);
    let plain = spans.is_plain();
    let mut at = 0;
    for z in 0..BRICK {
        for y in 0..BRICK {
            let quad = Quad::new(&block.rows, z, y);
            if quad.active == 0 {
                continue;
            }
            let caps = if plain { 0 } else { quad.active & spans.caps(z, y) };
            let mut before = [
                block.x[z][y],
                block.x[z][y + 1],
                block.x[z + 1][y],
                block.x[z + 1][y + 1],
                block.y[z][y],
                block.y[z + 1][y],
                block.z[z][y],
                block.z[z][y + 1],
            ];
            for x in Bits(u64::from(quad.active & !caps)) {
                let step = &steps[quad.case(x)];
                let mut ids = [0; 16];
                for k in 0..8 {
                    ids[k] = before[k];
                    before[k] = before[k].wrapping_add(u32::from(step.crossed[k]));
                    ids[8 + k] = before[k];
                }
                if x + 1 == BRICK {
                    ids[12] = next.y[z][y];
                    ids[13] = next.y[z + 1][y];
                    ids[14] = next.z[z][y];
                    ids[15] = next.z[z][y + 1];
                }
                let room = &mut out[at..at + MAX_TRIANGLES];
                // Three are written always: a loop of random short length costs a misprediction.
                for (t, triangle) in room.iter_mut().enumerate().take(3) {
                    *triangle = corners(&ids, &step.case, t);
                }
                if step.case.count > 3 {
                    for (t, triangle) in room.iter_mut().enumerate().skip(3) {
                        *triangle = corners(&ids, &step.case, t);
                    }
                }
                at += usize::from(step.case.count);
            }
            if caps == 0 {
                continue;
            }
            let row = Row::new(block, next, spans, &quad, z, y);
            for x in Bits(u64::from(caps)) {
                let case = &tables.cap(spans.position([x, y, z]))[quad.case(x)];
                let ids = row.vertices(x);
                for t in 0..usize::from(case.count) {
                    let slot = |k: usize| ids[usize::from(case.slots[3 * t + k]) % ids.len()];
                    out[at] = [slot(0), slot(1), slot(2)];
                    at += 1;
                }
            }
        }
    }
    at
}

/// Corners of triangle `t` of a cell whose edges have the vertices `ids`.
#[inline(always)]
fn corners(ids: &[u32; 16], case: &Case, t: usize) -> [u32; 3] {
    let [a, b, c] = [case.slots[3 * t], case.slots[3 * t + 1], case.slots[3 * t + 2]];
    [ids[usize::from(a & 15)], ids[usize::from(b & 15)], ids[usize::from(c & 15)]]
}

/// What the cells of one row at ghosts need to number their vertices.
///
/// A word of crossings or nodes, the first vertex of the word, and that of the next brick.
struct Row {
    /// Crossed edges along x at the four rows.
    x: [(u32, u32); 4],
    /// Crossed edges along y at z and z + 1, then along z at y and y + 1.
    across: [(u32, u32, u32); 4],
    /// Inside nodes of outer planes at the four rows.
    nodes: [(u32, u32, u32); 4],
}

impl Row {
    #[inline(always)]
    fn new(block: &Block, next: &Block, spans: &Spans, quad: &Quad, z: usize, y: usize) -> Self {
        let [a, b, c, d] = quad.rows;
        let edges = spans.0[0].edge & ROW;
        let rows = [(z, y), (z, y + 1), (z + 1, y), (z + 1, y + 1)];
        Self {
            x: std::array::from_fn(|n| {
                let ((z, y), row) = (rows[n], quad.rows[n]);
                ((row ^ row >> 1) & edges, block.x[z][y])
            }),
            across: [
                (a ^ b, block.y[z][y], next.y[z][y]),
                (c ^ d, block.y[z + 1][y], next.y[z + 1][y]),
                (a ^ c, block.z[z][y], next.z[z][y]),
                (b ^ d, block.z[z][y + 1], next.z[z][y + 1]),
            ],
            nodes: rows.map(|(z, y)| {
                let word = spans.planes(&block.rows, z, y);
                (word, block.planes[z][y], next.planes[z][y])
            }),
        }
    }

    /// What may stand in each slot of cell `x`: the vertices on its edges, then those at its
    /// corners. What stands for an edge without crossing or a corner without vertex is meaningless.
    #[inline(always)]
    fn vertices(&self, x: usize) -> [u32; 32] {
        let mut ids = [0; 32];
        let below = (1 << x) - 1;
        let first = |word: u32, first: u32| first.wrapping_add((word & below).count_ones());
        let both = |(word, at, beyond): (u32, u32, u32)| {
            let here = first(word, at);
            let after = here.wrapping_add(word >> x & 1);
            [here, if x + 1 == BRICK { beyond } else { after }]
        };
        for (n, (word, at)) in self.x.into_iter().enumerate() {
            ids[n] = first(word, at);
        }
        for (n, across) in self.across.into_iter().enumerate() {
            [ids[4 + 2 * n], ids[5 + 2 * n]] = both(across);
        }
        for (n, nodes) in self.nodes.into_iter().enumerate() {
            [ids[12 + 2 * n], ids[13 + 2 * n]] = both(nodes);
        }
        ids
    }
}
