//! Long unions and intersections as balanced trees.
//!
//! A program text that unites ten thousand parts gives a minimum of a minimum of a minimum, ten
//! thousand deep: each part's region would hold all parts before it. Maximal chains of one extremum
//! are gathered and rebuilt as balanced trees over the same operands in the same order, so that a
//! box discards half of the parts at a stroke.
//!
//! **Grouping changes no bit.** Without NaN, the extremum of a list in any grouping is the last of the
//! operands that are equal to the extreme value (ties take the second operand), so even the sign
//! of a zero stays. NaN is not associative: `min(a, NaN)` is NaN and `min(NaN, b)` is `b`. A
//! grouping can be changed where every operand but the very first is free of NaN: along the left
//! spine a NaN is then forgotten at the first step in every grouping. So a node on the left spine
//! is taken apart only if its second operand is free of NaN, any other node only if both are, as
//! the interval version of the expression proves for all coordinates and parameter values up to
//! [`REACH`] in magnitude. Beyond, only the NaN case may differ from the expression as written.
//!
//! **Order.** The operands free of NaN may also change places, so that the tree is one over space
//! ([`vicinity`]): the extremum of the list is the same number, and where several operands are equal
//! to it, only the sign of a zero and which of them gives the derivative can be another's. That is
//! done where nothing but extrema and negations lie between the chain and the root, so that a zero's
//! sign is seen by nobody: the expression's sign and zeros are those of the expression as written.

use super::images::Images;
use super::vicinity;
use crate::expr::graph::operands;
use crate::expr::{Binary, Graph, Node, NodeId, Output, Unary, depends, enclosure};
use crate::num::Interval;
use rustc_hash::FxHashMap;

/// The magnitude up to which coordinates and parameters are taken to lie: 2^64. It leaves room for
/// polynomials of degree fifteen before anything overflows.
pub const REACH: f64 = 18_446_744_073_709_551_616.0;

/// A chain with fewer operands is left as it is written.
const FEWEST: usize = 8;

/// The expression `root` with its long chains of extrema balanced.
///
/// The graph is left as it is if there are none and most of its nodes are of the expression; else it
/// has only those: what made a long program text leaves many others behind.
#[must_use]
pub fn balance(source: &Graph, root: NodeId) -> (Graph, NodeId) {
    let nodes = depends::reachable(source, &[root]);
    let chains = chains(source, root, &nodes);
    if chains.is_empty() && 2 * nodes.len() > source.len() {
        return (source.clone(), root);
    }
    // Room for derivatives and other forms, too.
    let mut graph = source.emptied(3 * nodes.len());
    let mut image = Images::new(root);
    for &id in &nodes {
        let node = source.node(id);
        let moved = match (chains.get(&id), node) {
            (Some(chain), Node::Binary(op, _, _)) => {
                let mut row: Vec<NodeId> = chain.iter().map(|&id| image.of(id)).collect();
                while row.len() > 1 {
                    let pairs = row.chunks(2).map(|pair| match *pair {
                        [a, b] => graph.intern(Node::Binary(op, a, b)),
                        _ => pair[0],
                    });
                    row = pairs.collect();
                }
                row[0]
            }
            (_, node) => image.moved(&mut graph, node),
        };
        image.set(id, moved);
    }
    (graph, image.of(root))
}

/// The operands, in order, of every chain that is to be rebuilt, by the chain's last node.
fn chains(source: &Graph, root: NodeId, nodes: &[NodeId]) -> FxHashMap<NodeId, Vec<NodeId>> {
    let extrema = nodes.iter().filter(|&&id| extremum(source, id).is_some()).count();
    if extrema + 1 < FEWEST {
        return FxHashMap::default();
    }
    let mut uses = vec![0u32; root.index() + 1];
    for &id in nodes {
        operands(&source.node(id)).iter().for_each(|operand| uses[operand.index()] += 1);
    }
    uses[root.index()] += 1;
    let undefined = may_be_nan(source, nodes);
    let crown = crown(source, root);
    let mut chains = FxHashMap::default();
    let mut gathered: FxHashMap<NodeId, ()> = FxHashMap::default();
    for &last in nodes.iter().rev() {
        let Some(chain) = extremum(source, last).filter(|_| !gathered.contains_key(&last)) else {
            continue;
        };
        let (mut list, mut deepest) = (Vec::new(), 0);
        // Node, its depth in the chain, and whether it lies on the left spine.
        let mut pending = vec![(last, 0, true)];
        while let Some((id, depth, spine)) = pending.pop() {
            let open = id == last || uses[id.index()] == 1;
            match extremum(source, id).filter(|&(op, _, _)| open && op == chain.0) {
                Some((_, a, b)) if !undefined[b.index()] && (spine || !undefined[a.index()]) => {
                    gathered.insert(id, ());
                    pending.push((b, depth + 1, false));
                    pending.push((a, depth + 1, spine));
                }
                _ => {
                    list.push(id);
                    deepest = deepest.max(depth);
                }
            }
        }
        let least = list.len().next_power_of_two().ilog2() as usize;
        if list.len() >= FEWEST && deepest > least + 2 {
            if crown.contains_key(&last) {
                // The very first may be NaN and then stays where it is.
                let fixed = usize::from(undefined[list[0].index()]);
                let moved = vicinity::ordered(source, &list[fixed..]);
                list.splice(fixed.., moved);
            }
            chains.insert(last, list);
        }
    }
    chains
}

/// What the root uses through nothing but extrema and negations.
fn crown(source: &Graph, root: NodeId) -> FxHashMap<NodeId, ()> {
    let mut crown = FxHashMap::default();
    let mut pending = vec![root];
    while let Some(id) = pending.pop() {
        if crown.insert(id, ()).is_some() {
            continue;
        }
        match (extremum(source, id), source.node(id)) {
            (Some((_, a, b)), _) => pending.extend([a, b]),
            (None, Node::Unary(Unary::Neg, a)) => pending.push(a),
            (
                None,
                Node::Coordinate(_)
                | Node::Constant(_)
                | Node::Parameter(_)
                | Node::Unary(..)
                | Node::Binary(..)
                | Node::Pick(..)
                | Node::Oracle(..),
            ) => {}
        }
    }
    crown
}

/// The node as an extremum of two operands.
fn extremum(graph: &Graph, id: NodeId) -> Option<(Binary, NodeId, NodeId)> {
    match graph.node(id) {
        Node::Binary(op @ (Binary::Min | Binary::Max), a, b) => Some((op, a, b)),
        Node::Coordinate(_)
        | Node::Constant(_)
        | Node::Parameter(_)
        | Node::Unary(..)
        | Node::Binary(..)
        | Node::Pick(..)
        | Node::Oracle(..) => None,
    }
}

/// Whether each node, by index, may be NaN for coordinates and parameters within [`REACH`]; `nodes`
/// are those of an expression, which is the last.
fn may_be_nan(graph: &Graph, nodes: &[NodeId]) -> Vec<bool> {
    let reach = Interval::new(-REACH, REACH);
    let count = nodes.last().map_or(0, |last| last.index() + 1);
    let mut ranges = vec![Interval::ANYTHING; count];
    for &id in nodes {
        let at = |id: NodeId| ranges[id.index()];
        ranges[id.index()] = match graph.node(id) {
            Node::Coordinate(_) | Node::Parameter(_) => reach,
            Node::Constant(bits) => Interval::point(f64::from_bits(bits)),
            Node::Unary(op, a) => enclosure::unary(op, at(a)),
            Node::Binary(Binary::Mul, a, b) if a == b => at(a).square(),
            Node::Binary(op, a, b) => enclosure::binary(op, at(a), at(b)),
            Node::Pick(extremum, list) => enclosure::pick(extremum, list.map(at)),
            Node::Oracle(oracle, Output::Value, list) => {
                graph.oracles()[oracle.index()].range(list.map(at))
            }
            Node::Oracle(_, Output::Partial(_), _) => Interval::ANYTHING,
        };
    }
    ranges.into_iter().map(|range| range.nan).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::{BRICK, Engine, Program, Sampler};
    use crate::expr::Unary;
    use crate::expr::probe::{Source, evaluate};

    /// The number of extrema on the longest path below `root`.
    fn depth(graph: &Graph, root: NodeId) -> usize {
        let mut depths: FxHashMap<NodeId, usize> = FxHashMap::default();
        for id in depends::reachable(graph, &[root]) {
            let below = operands(&graph.node(id)).iter().map(|o| depths[o]).max().unwrap_or(0);
            depths.insert(id, below + usize::from(extremum(graph, id).is_some()));
        }
        depths[&root]
    }

    /// A random tree of extrema over `parts`, kept in order.
    fn tree(graph: &mut Graph, source: &mut Source, op: Binary, parts: &[NodeId]) -> NodeId {
        let mut row = parts.to_vec();
        while row.len() > 1 {
            let i = if source.below(2) == 0 { 0 } else { source.below(row.len() - 1) };
            let b = row.remove(i + 1);
            row[i] = graph.intern(Node::Binary(op, row[i], b));
        }
        row[0]
    }

    #[test]
    fn chains_become_balanced_trees() {
        for op in [Binary::Min, Binary::Max] {
            let mut graph = Graph::new();
            let [x, y, _] = graph.point();
            let mut root = x;
            for i in 1..=1000 {
                let c = graph.constant(f64::from(i));
                let xc = graph.mul(x, c);
                let part = graph.sub(xc, y);
                root = if i % 3 == 0 {
                    graph.binary(op, part, root)
                } else {
                    graph.binary(op, root, part)
                };
            }
            assert_eq!(depth(&graph, root), 1000);
            let (balanced, root) = balance(&graph, root);
            assert_eq!(depth(&balanced, root), 10);
        }
    }

    #[test]
    fn short_chains_and_shared_inner_nodes_stay() {
        let mut graph = Graph::new();
        let mut root = graph.point()[0];
        let mut total = root;
        for i in 1..30 {
            let c = graph.constant(f64::from(i));
            root = graph.min(root, c);
            total = graph.add(total, root);
        }
        let (balanced, same) = balance(&graph, total);
        assert_eq!((balanced.len(), same), (graph.len(), total));
    }

    #[test]
    fn balancing_changes_no_bit_even_with_nan_and_signed_zeros() {
        let mut source = Source(21);
        for round in 0..300 {
            let mut graph = Graph::new();
            let [x, y, z] = graph.point();
            let mut parts = Vec::new();
            for i in 0..8 + source.below(30) {
                let c = graph.constant(f64::from(source.below(3) as u8) - 1.0);
                let part = graph.mul(source.of(&[x, y, z]), c);
                let rooted = graph.unary(Unary::Sqrt, part);
                let shifted = graph.sub(part, rooted);
                parts.push(match (round % 3, i) {
                    (0, _) | (1, 1..) => part,
                    (..) => source.of(&[part, part, rooted, shifted]),
                });
            }
            let op = source.of(&[Binary::Min, Binary::Max]);
            let mut root = tree(&mut graph, &mut source, op, &parts);
            if round % 2 == 1 {
                let one = graph.constant(1.0);
                root = graph.div(one, root);
            }
            let (balanced, image) = balance(&graph, root);
            for _ in 0..20 {
                let at = [(); 3].map(|()| source.of(&[0.0, -0.0, 1.0, -1.0]));
                let before = evaluate(&graph, at, &[])[root.index()];
                let after = evaluate(&balanced, at, &[])[image.index()];
                let is_same = match round % 2 {
                    // The root's own chain is put in another order, which may change a zero's sign.
                    0 => before == after,
                    _ => before.to_bits() == after.to_bits(),
                };
                assert!(
                    is_same || before.is_nan() && after.is_nan(),
                    "{before} became {after} at {at:?} in round {round}"
                );
            }
        }
    }

    #[test]
    fn a_union_of_ten_thousand_parts_is_built_and_evaluated() {
        let mut source = Source(22);
        let mut graph = Graph::new();
        let at = graph.point();
        let mut root = None;
        for _ in 0..10_000 {
            let squares = at.map(|u| {
                let c = graph.constant(source.within(-1.0, 1.0));
                let d = graph.sub(u, c);
                graph.mul(d, d)
            });
            let sum = graph.add(squares[0], squares[1]);
            let sum = graph.add(sum, squares[2]);
            let r = graph.constant(0.001);
            let part = graph.sub(sum, r);
            root = Some(root.map_or(part, |root| graph.min(root, part)));
        }
        let root = root.unwrap();
        let program = Program::new(&graph, root, Engine::Interpreter).unwrap();
        let table: Vec<f64> = (0..=BRICK).map(|i| 0.01 * i as f64).collect();
        let bound = program.bind([table.clone(), table.clone(), table.clone()], &[]);
        let mut workspace = bound.workspace();
        let mut activity = vec![u64::MAX; bound.activity_words()];
        let whole = [crate::eval::NodeBox { level: 0, index: [0; 3] }];
        let mut range = [Interval::ANYTHING];
        bound.ranges(&mut workspace, &whole, &mut activity, &mut range).unwrap();
        let alive: u32 = activity.iter().map(|word| word.count_ones()).sum();
        let mut values = [0.0; BRICK * BRICK * BRICK];
        bound.values(&mut workspace, [0; 3], &activity, &mut values).unwrap();
        let expected = evaluate(&graph, [table[3], table[5], table[7]], &[])[root.index()];
        assert_eq!(values[3 + 16 * 5 + 256 * 7], expected);
        assert!(range[0].contains(expected) && alive < 1_500, "{alive} regions are left");
    }
}
