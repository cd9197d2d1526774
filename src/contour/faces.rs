//! Triangles of a brick's cells.

use super::bits::{ROW, Spans};
use super::numbering::{Bits, Block, Quad};
use super::tables::{MAX_TRIANGLES, TABLES, Tables};
use crate::eval::BRICK;

/// Most triangles that a brick's cells can have.
pub const MOST: usize = MAX_TRIANGLES * BRICK * BRICK * BRICK;

/// Writes the triangles of a brick's cells to the front of `out` and returns how many they are.
///
/// `next` is the block of the next brick along x, if it owns a vertex; `out` holds [`MOST`]
/// triangles at least.
#[inline(always)]
pub fn faces(block: &Block, next: &Block, spans: &Spans, out: &mut [[u32; 3]]) -> usize {
    let tables: &Tables = &TABLES;
    let plain = spans.is_plain();
    let mut at = 0;
    for z in 0..BRICK {
        for y in 0..BRICK {
            let quad = Quad::new(&block.rows, z, y);
            if quad.active == 0 {
                continue;
            }
            let caps = if plain { 0 } else { quad.active & spans.caps(z, y) };
            let row = Row::new(block, next, spans, &quad, z, y);
            for x in Bits(quad.active & !caps) {
                let ids = row.edges(x);
                let case = &tables.cell[quad.case(x)];
                let corner = |k: usize| ids[usize::from(case.slots[k] & 15)];
                let Some(room) = out.get_mut(at..at + MAX_TRIANGLES) else { return at };
                // Three are written always: a loop of random short length costs a misprediction.
                for (t, triangle) in room.iter_mut().take(3).enumerate() {
                    *triangle = [corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)];
                }
                if case.count > 3 {
                    for (t, triangle) in room.iter_mut().enumerate().skip(3) {
                        *triangle = [corner(3 * t), corner(3 * t + 1), corner(3 * t + 2)];
                    }
                }
                at += usize::from(case.count);
            }
            for x in Bits(caps) {
                let case = &tables.cap(spans.position([x, y, z]))[quad.case(x)];
                for t in 0..usize::from(case.count) {
                    let corner = |k: usize| {
                        cap_vertex(&row, block, next, spans, [x, y, z], case.slots[3 * t + k])
                    };
                    out[at] = [corner(0), corner(1), corner(2)];
                    at += 1;
                }
            }
        }
    }
    at
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
        let along = |row: u32| (row ^ row >> 1) & edges;
        Self {
            x: [
                (along(a), block.x[z][y]),
                (along(b), block.x[z][y + 1]),
                (along(c), block.x[z + 1][y]),
                (along(d), block.x[z + 1][y + 1]),
            ],
            y: [(a ^ b, block.y[z][y], next.y[z][y]), (c ^ d, block.y[z + 1][y], next.y[z + 1][y])],
            z: [(a ^ c, block.z[z][y], next.z[z][y]), (b ^ d, block.z[z][y + 1], next.z[z][y + 1])],
        }
    }

    /// Vertices on the edges of cell `x`; what stands for an edge without crossing is meaningless.
    #[inline(always)]
    fn edges(&self, x: usize) -> [u32; 16] {
        let below = (1u32 << x) - 1;
        let rank = |word: u32| (word & below).count_ones();
        let along = |(word, first): (u32, u32)| first.wrapping_add(rank(word));
        let across = |(word, first, beyond): (u32, u32, u32)| {
            let here = first.wrapping_add(rank(word));
            let after = here.wrapping_add(word >> x & 1);
            [here, if x + 1 == BRICK { beyond } else { after }]
        };
        let [x0, x1, x2, x3] = self.x.map(along);
        let [[y0, y1], [y2, y3]] = self.y.map(across);
        let [[z0, z1], [z2, z3]] = self.z.map(across);
        [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, 0, 0, 0, 0]
    }
}

/// The vertex that stands in `slot` of a cell at ghosts.
#[inline(always)]
fn cap_vertex(
    row: &Row,
    block: &Block,
    next: &Block,
    spans: &Spans,
    [x, y, z]: [usize; 3],
    slot: u8,
) -> u32 {
    let slot = usize::from(slot);
    if slot < 12 {
        return row.edges(x)[slot];
    }
    let corner = slot - 12;
    let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
    if x == BRICK {
        return next.planes[z][y];
    }
    let below = (1u32 << x) - 1;
    block.planes[z][y] + (spans.planes(&block.rows, z, y) & below).count_ones()
}
