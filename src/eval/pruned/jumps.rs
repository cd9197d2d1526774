//! Boxes cut in two where a coordinate jumps.
//!
//! A lattice is folded into one cell by x - floor(x). In a box with a whole number inside the difference
//! takes all values of the cell, and everything in it seems near. On both sides of the jump it takes few.
//! So where a rounded expression of one coordinate jumps inside a box, the box is enclosed in two
//! pieces that meet at neighbouring numbers: no point of it is in neither. Where it
//! jumps more than once the cells are smaller than the box, which is enclosed as it is.

use super::code::Code;
use crate::eval::interpret;
use crate::expr::{AxisSet, Failure, Graph, Node, NodeId, Unary};
use crate::geom::Axis;
use crate::num::Interval;

/// Most rounded expressions that are looked at along an axis.
const MOST: usize = 16;
/// Halvings after which two of all 2^64 numbers are neighbours.
const HALVINGS: usize = 64;

/// A box by its sides along every axis.
pub(super) type Sides = [Interval; 3];

/// By axis: the numbers next to each jump, the last below and the first above it, in order.
#[derive(Debug, Default)]
pub(super) struct Jumps([Vec<[f64; 2]>; 3]);

impl Jumps {
    /// The jumps between the nodes of a grid, at most one between two neighbours.
    pub(super) fn new(
        code: &Code,
        coordinates: &[Vec<f64>; 3],
        parameters: &[f64],
    ) -> Result<Self, Failure> {
        let mut jumps = Self::default();
        for axis in Axis::ALL {
            let rounded = rounded(code, axis);
            if rounded.is_empty() {
                continue;
            }
            let at = |places: &[f64]| values(code.graph(), &rounded, places, parameters);
            let table = &coordinates[axis.index()];
            let known = at(table)?;
            let differ = |a: usize, b: usize, other: &[Vec<f64>]| {
                known.iter().zip(other).any(|(known, other)| known[a] != other[b])
            };
            let gaps = (1..table.len()).filter(|&i| differ(i - 1, i, &known));
            let starts: Vec<usize> = gaps.map(|i| i - 1).collect();
            let place = |start: &usize| [table[*start], table[start + 1]].map(rank);
            let mut ends: Vec<[i64; 2]> = starts.iter().map(place).collect();
            for _ in 0..HALVINGS {
                let middles: Vec<i64> =
                    ends.iter().map(|[a, b]| (a & b) + ((a ^ b) >> 1)).collect();
                let found = at(&middles.iter().map(|&middle| ranked(middle)).collect::<Vec<_>>())?;
                for (k, (end, middle)) in ends.iter_mut().zip(middles).enumerate() {
                    if middle > end[0] {
                        end[usize::from(differ(starts[k], k, &found))] = middle;
                    }
                }
            }
            jumps.0[axis.index()] = ends.iter().map(|end| end.map(ranked)).collect();
        }
        Ok(jumps)
    }

    /// Calls `take` with the pieces of the box with these sides, one to eight.
    pub(super) fn cut(&self, sides: &Sides, mut take: impl FnMut(Sides)) {
        let halves = [0, 1, 2].map(|axis| {
            let side = sides[axis];
            let jumps = &self.0[axis];
            let first = jumps.partition_point(|jump| jump[0] < side.lo);
            let inside = jumps[first..].iter().take_while(|jump| jump[1] <= side.hi);
            let mut inside = inside.take(2);
            match (inside.next(), inside.next()) {
                (Some(&[below, above]), None) => {
                    [Some(Interval::new(side.lo, below)), Some(Interval::new(above, side.hi))]
                }
                _ => [Some(side), None],
            }
        });
        for z in halves[2].into_iter().flatten() {
            for y in halves[1].into_iter().flatten() {
                for x in halves[0].into_iter().flatten() {
                    take([x, y, z]);
                }
            }
        }
    }
}

/// The place of `x` among all numbers in order.
const fn rank(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

/// The number at that place.
const fn ranked(rank: i64) -> f64 {
    let bits = rank ^ (((rank >> 63) as u64) >> 1) as i64;
    f64::from_bits(bits as u64)
}

/// The rounded expressions of `code` that depend on `axis` alone.
fn rounded(code: &Code, axis: Axis) -> Vec<NodeId> {
    let is_rounded = |(id, node): &(NodeId, Node)| {
        matches!(node, Node::Unary(Unary::Floor | Unary::Round | Unary::Ceil, _))
            && code.axes[id.index()] == AxisSet::only(axis)
    };
    code.graph().iter().filter(is_rounded).map(|(id, _)| id).take(MOST).collect()
}

/// The values of `nodes`, which depend on one axis, at `places` on it.
fn values(
    graph: &Graph,
    nodes: &[NodeId],
    places: &[f64],
    parameters: &[f64],
) -> Result<Vec<Vec<f64>>, Failure> {
    let mut found = vec![vec![0.0; places.len()]; nodes.len()];
    let mut out: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
    interpret::points(graph, nodes, [places; 3], parameters, &mut out)?;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::Binary;

    fn jumps(table: &[f64]) -> Jumps {
        let mut graph = Graph::new();
        let [x, y, _] = graph.point();
        let third = graph.constant(3.0);
        let place = graph.div(x, third);
        let floor = graph.unary(Unary::Floor, place);
        let field = graph.binary(Binary::Min, floor, y);
        let code = Code::new(&graph, field);
        Jumps::new(&code, &[(); 3].map(|()| table.to_vec()), &[]).unwrap()
    }

    fn pieces(jumps: &Jumps, lo: f64, hi: f64) -> Vec<Sides> {
        let mut found = Vec::new();
        jumps.cut(&[Interval::new(lo, hi); 3], |piece| found.push(piece));
        found
    }

    #[test]
    fn pieces_meet_at_a_jump() {
        let jumps = jumps(&[-1.0, 0.5, 2.0, 2.5, 3.5, 4.0, 6.0]);
        let found = pieces(&jumps, 2.0, 4.0);
        let below = 3.0_f64.next_down();
        let whole = Interval::new(2.0, 4.0);
        let expected = [[2.0, below], [3.0, 4.0]].map(|[a, b]| [Interval::new(a, b), whole, whole]);
        assert_eq!(found, expected);
        // No jump inside, a jump at the upper end, a jump at the lower one, and two.
        assert_eq!(pieces(&jumps, 0.5, 2.5).len(), 1);
        assert_eq!(pieces(&jumps, 3.5, 6.0).len(), 2);
        assert_eq!(pieces(&jumps, 3.0, 4.0).len(), 1);
        assert_eq!(pieces(&jumps, 2.0, 6.0).len(), 1);
    }

    #[test]
    fn a_jump_at_zero_is_found_to_the_last_number() {
        let jumps = jumps(&[-0.02, 0.0, 0.02]);
        let found = pieces(&jumps, -0.02, 0.02);
        assert_eq!(found.len(), 2);
        // The quotient of a smaller number would be rounded to zero.
        assert_eq!(found[0][0].hi, -2.0 * f64::from_bits(1));
        assert_eq!(found[1][0].lo, -f64::from_bits(1));
    }

    #[test]
    fn nothing_is_cut_where_nothing_jumps() {
        let jumps = jumps(&[0.5, 1.0, 2.0]);
        assert_eq!(pieces(&jumps, 0.5, 2.0), [[Interval::new(0.5, 2.0); 3]]);
    }
}
