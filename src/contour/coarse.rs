//! A patch on every other node: what tells how far a quantity has converged.
//!
//! The coarse cells join the fine cells of a brick two by two along each axis; single ones are left
//! at the outer planes, so that the box stays the same. Where the ends of a coarse edge differ in
//! sign, one of its two fine edges is crossed, and its crossing is the coarse one: nothing is
//! evaluated. The coarse patches make the closed mesh of the grid of twice the spacing (but in the
//! first and perhaps the last layer), whose roots are those of the field itself.

use super::bits::{ROW, SIDE, Spans, spread};
use super::numbering::{Bits, Block};
use super::tables::{TABLES, Tables, corners_of};
use crate::eval::BRICK;

/// The coarse nodes among the positions of the brick at `brick` along an axis of `cells` cells; bit
/// `i` is position `i`.
#[must_use]
pub fn coarse_nodes(brick: u32, cells: usize) -> u32 {
    let first = brick as usize * BRICK;
    let is_node = |i: &usize| {
        let p = first + i;
        // Position 0 and the one after the last node are ghosts.
        p <= cells + 2 && (p.is_multiple_of(2) || p == 1 || p > cells)
    };
    (0..SIDE).filter(is_node).fold(0, |nodes, i| nodes | 1 << i)
}

/// Appends the coarse triangles of a brick to `out`, whose corners are the fine vertices that
/// `block` numbers; `nodes` are the coarse nodes along each axis.
pub fn coarse(block: &Block, spans: &Spans, nodes: [u32; 3], out: &mut Vec<[u32; 3]>) {
    let tables: &Tables = &TABLES;
    let mut places = [[0; SIDE]; 3];
    let counts = [0, 1, 2].map(|a| {
        let list = &mut places[a];
        Bits(u64::from(nodes[a])).zip(list).map(|(i, place)| *place = i).count()
    });
    let rows = &block.rows;
    let fine = Fine { block, spans };
    for k in 1..counts[2] {
        for j in 1..counts[1] {
            let (y, z) = ([places[1][j - 1], places[1][j]], [places[2][k - 1], places[2][k]]);
            let around = [rows[z[0]][y[0]], rows[z[0]][y[1]], rows[z[1]][y[0]], rows[z[1]][y[1]]];
            let around = around.map(|row| row & nodes[0]);
            let any = around.iter().fold(0, |any, row| any | row);
            let all = around.iter().fold(nodes[0], |all, row| all & row);
            if any == 0 || all == nodes[0] {
                continue;
            }
            for i in 1..counts[0] {
                let x = [places[0][i - 1], places[0][i]];
                let case = (around.iter().enumerate()).fold(0, |case, (at, row)| {
                    case | ((row >> x[0] & 1) | (row >> x[1] & 1) << 1) << (2 * at)
                });
                if case == 0 || case == 255 {
                    continue;
                }
                let ends = [x, y, z];
                let digit = |a: usize| {
                    let real = spans.0[a].real;
                    ((!real >> ends[a][0] & 1) + 2 * (!real >> ends[a][1] & 1)) as usize
                };
                let position = digit(0) + 3 * digit(1) + 9 * digit(2);
                let case = &tables.cap(position)[case as usize];
                for slots in case.slots[..3 * usize::from(case.count)].chunks_exact(3) {
                    out.push([0, 1, 2].map(|c| fine.vertex(ends, usize::from(slots[c]))));
                }
            }
        }
    }
}

/// The fine vertices of a patch.
struct Fine<'a> {
    block: &'a Block,
    spans: &'a Spans,
}

impl Fine<'_> {
    /// The vertex in slot `slot` of the coarse cell between `ends` along each axis.
    fn vertex(&self, ends: [[usize; 2]; 3], slot: usize) -> u32 {
        let node = |corner: usize| [0, 1, 2].map(|a| ends[a][corner >> a & 1]);
        if slot >= 12 {
            return self.plane_node(node(slot - 12));
        }
        let axis = slot / 4;
        let mut at = node(corners_of(slot)[0]);
        while at[axis] + 1 < ends[axis][1] && !self.is_crossed(at, axis) {
            at[axis] += 1;
        }
        self.crossing(at, axis)
    }

    fn is_crossed(&self, at: [usize; 3], axis: usize) -> bool {
        let mut next = at;
        next[axis] += 1;
        let inside = |[i, j, k]: [usize; 3]| self.block.rows[k][j] >> i & 1;
        inside(at) != inside(next)
    }

    /// The vertex on the fine edge along `axis` from node `at`.
    fn crossing(&self, [i, j, k]: [usize; 3], axis: usize) -> u32 {
        let Block { rows, crossings: _, x, y, z, planes: _ } = self.block;
        let here = rows[k][j];
        let (word, first) = match axis {
            0 => ((here ^ here >> 1) & self.spans.0[0].edge & ROW, x[k][j]),
            1 => (here ^ rows[k][j + 1], y[k][j]),
            _ => (here ^ rows[k + 1][j], z[k][j]),
        };
        first + (word & ((1 << i) - 1)).count_ones()
    }

    /// The vertex at a node of an outer plane.
    fn plane_node(&self, [i, j, k]: [usize; 3]) -> u32 {
        let [x, y, z] = self.spans.0;
        let outer = x.outer | spread(y.outer, j) | spread(z.outer, k);
        let word = self.block.rows[k][j] & outer;
        self.block.planes[k][j] + (word & ((1 << i) - 1)).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_nodes_are_every_other_one_and_the_ends() {
        // Nodes 1 to 11 of ten cells; ghosts 0 and 12.
        assert_eq!(coarse_nodes(0, 10), 0b1_1101_0101_0111);
        assert_eq!(coarse_nodes(0, 9), 0b1101_0101_0111);
        // In the middle of many.
        assert_eq!(coarse_nodes(3, 1000), 0x1_5555);
        assert_eq!(coarse_nodes(1, 14), 1);
        assert_eq!(coarse_nodes(1, 15), 0b11);
    }
}
