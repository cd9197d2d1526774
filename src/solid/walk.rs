//! A plain evaluator for tests: one point, nodes in index order.

use crate::expr::{Graph, Node, NodeId, Queries};

/// The value of `root` at `point`, parameters taking their present values.
pub fn value(graph: &Graph, root: NodeId, point: [f64; 3]) -> f64 {
    let mut values: Vec<f64> = Vec::with_capacity(root.index() + 1);
    for (id, node) in graph.iter().take(root.index() + 1) {
        let at = |id: NodeId| values[id.index()];
        let value = match node {
            Node::Coordinate(axis) => point[axis.index()],
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Parameter(slot) => graph.parameters()[slot.index()].1,
            Node::Unary(op, a) => op.apply(at(a)),
            Node::Binary(op, a, b) => op.apply(at(a), at(b)),
            Node::Pick(extremum, [a, b, c, d]) => {
                if extremum.picks_first(at(a), at(b)) {
                    at(c)
                } else {
                    at(d)
                }
            }
            Node::Oracle(oracle, _, p) => {
                let [x, y, z] = p.map(|o| [at(o)]);
                let mut value = [0.0];
                let queries = Queries { at: [&x, &y, &z], value: &mut value, gradient: None };
                graph.oracles()[oracle.index()].points(queries).unwrap();
                value[0]
            }
        };
        debug_assert_eq!(id.index(), values.len());
        values.push(value);
    }
    values[root.index()]
}
