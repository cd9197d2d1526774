//! Parts of a union in an order in which those near one another stand together.
//!
//! A tree of extrema over parts in such an order is one over space: what a box needs lies in few of
//! its branches. Where a part stands is guessed from the numbers that are subtracted from the
//! coordinates in it, as a translation does. The guess steers and is not relied on.

use crate::expr::graph::operands;
use crate::expr::{Binary, Graph, Node, NodeId};

/// Nodes of a part that are looked at for its place.
const LOOKED_AT: usize = 64;

/// The parts `parts` in order, for a tree whose first branch at every fork is a full one.
///
/// Parts without a place count as at the origin; parts at one place keep their order.
#[must_use]
pub fn ordered(graph: &Graph, parts: &[NodeId]) -> Vec<NodeId> {
    let mut placed: Vec<Placed> = (parts.iter().enumerate())
        .map(|(number, &part)| Placed { number, part, place: place(graph, part) })
        .collect();
    let mut pending = vec![(0, placed.len())];
    while let Some((start, end)) = pending.pop() {
        if end - start < 2 {
            continue;
        }
        let slice = &mut placed[start..end];
        let axis = longest(slice);
        let middle = start + (end - start).next_power_of_two() / 2;
        let order = |a: &Placed, b: &Placed| {
            a.place[axis].total_cmp(&b.place[axis]).then(a.number.cmp(&b.number))
        };
        slice.sort_unstable_by(order);
        pending.extend([(start, middle), (middle, end)]);
    }
    placed.into_iter().map(|placed| placed.part).collect()
}

/// A part with its number among all and its place.
#[derive(Clone, Copy, Debug)]
struct Placed {
    number: usize,
    part: NodeId,
    place: [f64; 3],
}

/// The axis along which places differ most.
fn longest(placed: &[Placed]) -> usize {
    let extent = |axis: usize| {
        let along = placed.iter().map(|p| p.place[axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        high - low
    };
    (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b)).then(b.cmp(&a))).unwrap_or(0)
}

/// The middle of the numbers that are subtracted from each coordinate.
fn place(graph: &Graph, part: NodeId) -> [f64; 3] {
    let (mut sums, mut counts) = ([0.0; 3], [0.0; 3]);
    let mut seen = vec![part];
    let mut next = 0;
    while next < seen.len() && seen.len() <= LOOKED_AT {
        let node = graph.node(seen[next]);
        next += 1;
        if let Node::Binary(Binary::Sub, a, b) = node
            && let (Node::Coordinate(axis), Some(at)) = (graph.node(a), graph.as_constant(b))
            && at.is_finite()
        {
            sums[axis.index()] += at;
            counts[axis.index()] += 1.0;
        }
        for operand in operands(&node).iter() {
            if !seen.contains(operand) {
                seen.push(*operand);
            }
        }
    }
    std::array::from_fn(|axis| if counts[axis] > 0.0 { sums[axis] / counts[axis] } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::probe::Source;

    #[test]
    fn halves_of_the_order_are_halves_of_space() {
        let mut source = Source(5);
        let mut graph = Graph::new();
        let point = graph.point();
        let mut places = Vec::new();
        let parts: Vec<NodeId> = (0..512)
            .map(|_| {
                let place = [4.0, 1.0, 1.0].map(|size| source.within(-size, size));
                let squares = [0, 1, 2].map(|axis| {
                    let c = graph.constant(place[axis]);
                    let from = graph.sub(point[axis], c);
                    graph.mul(from, from)
                });
                let sum = graph.add(squares[0], squares[1]);
                let part = graph.add(sum, squares[2]);
                places.push((part, place));
                part
            })
            .collect();
        let order = ordered(&graph, &parts);
        let at = |part: &NodeId| places.iter().find(|(p, _)| p == part).unwrap().1;
        let (low, high) = order.split_at(256);
        let last = low.iter().map(|p| at(p)[0]).fold(f64::NEG_INFINITY, f64::max);
        assert!(high.iter().all(|p| at(p)[0] >= last));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        let mut expected = parts;
        expected.sort_unstable();
        assert_eq!(sorted, expected, "the order has every part once");
    }

    #[test]
    fn parts_without_a_place_keep_their_order() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let parts: Vec<NodeId> =
            [(x, y), (z, y), (y, x), (x, z), (z, x)].map(|(a, b)| graph.div(a, b)).to_vec();
        assert_eq!(ordered(&graph, &parts), parts);
    }
}
