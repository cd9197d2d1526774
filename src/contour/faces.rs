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
                let cap = Cap { edges: row.edges(x), block, next, spans, cell: [x, y, z] };
                for t in 0..usize::from(case.count) {
                    let [a, b, c] =
                        [case.slots[3 * t], case.slots[3 * t + 1], case.slots[3 * t + 2]];
                    out[at] = [cap.vertex(a), cap.vertex(b), cap.vertex(c)];
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

/// What the cells of one row need to number their vertices.
struct Row {
    /// Crossed edges along x at the four rows, and the first vertex of each.
    x: [(u32, u32); 4],
    /// Crossed edges along y at z and z + 1, their first vertices, and that of the next brick.
    y: [(u32, u32, u32); 2],
    /// Crossed edges along z at y and y + 1, their first vertices, and that of the next brick.
    z: [(u32, u32, u32); 2],
}

impl Row {
    #[inline(always)]
    fn new(block: &Block, next: &Block, spans: &Spans, quad: &Quad, z: usize, y: usize) -> Self {
        let [a, b, c, d] = quad.rows;
        let edges = spans.0[0].edge & ROW;
        Self {
            x: [
                ((a ^ a >> 1) & edges, block.x[z][y]),
                ((b ^ b >> 1) & edges, block.x[z][y + 1]),
                ((c ^ c >> 1) & edges, block.x[z + 1][y]),
                ((d ^ d >> 1) & edges, block.x[z + 1][y + 1]),
            ],
            y: [(a ^ b, block.y[z][y], next.y[z][y]), (c ^ d, block.y[z + 1][y], next.y[z + 1][y])],
            z: [(a ^ c, block.z[z][y], next.z[z][y]), (b ^ d, block.z[z][y + 1], next.z[z][y + 1])],
        }
    }

    /// Vertices on the edges of cell `x`; what stands for an edge without crossing is meaningless.
    #[inline(always)]
    fn edges(&self, x: usize) -> [u32; 16] {
        let [x0, x1, x2, x3] = self.x;
        let [y0, y1] = [across(self.y[0], x), across(self.y[1], x)];
        let [z0, z1] = [across(self.z[0], x), across(self.z[1], x)];
        [
            along(x0, x),
            along(x1, x),
            along(x2, x),
            along(x3, x),
            y0[0],
            y0[1],
            y1[0],
            y1[1],
            z0[0],
            z0[1],
            z1[0],
            z1[1],
            0,
            0,
            0,
            0,
        ]
    }
}

/// The vertex on the edge of a row that starts at `x`.
#[inline(always)]
fn along((word, first): (u32, u32), x: usize) -> u32 {
    first.wrapping_add((word & ((1 << x) - 1)).count_ones())
}

/// The vertices on the edges across a row at `x` and `x + 1`.
#[inline(always)]
fn across((word, first, beyond): (u32, u32, u32), x: usize) -> [u32; 2] {
    let here = along((word, first), x);
    let after = here.wrapping_add(word >> x & 1);
    [here, if x + 1 == BRICK { beyond } else { after }]
}

/// A cell at ghosts.
struct Cap<'a> {
    edges: [u32; 16],
    block: &'a Block,
    next: &'a Block,
    spans: &'a Spans,
    cell: [usize; 3],
}

impl Cap<'_> {
    /// The vertex that stands in a slot.
    #[inline(always)]
    fn vertex(&self, slot: u8) -> u32 {
        let slot = usize::from(slot);
        if slot < 12 {
            return self.edges[slot];
        }
        let corner = slot - 12;
        let [x, y, z] = self.cell;
        let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
        if x == BRICK {
            return self.next.planes[z][y];
        }
        let word = self.spans.planes(&self.block.rows, z, y);
        along((word, self.block.planes[z][y]), x)
    }
}
