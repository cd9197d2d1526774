//! The number that an expression without coordinates stands for.

use super::depends::reachable;
use super::{Graph, Node, NodeId};
use rustc_hash::FxHashMap;

/// The value of `id` under the values `parameters`, by slot, of the graph's parameters.
///
/// `None` if `id` is computed from a coordinate, an oracle, or a parameter that `parameters` has
/// no value for. The bits are those that every engine returns. Takes time in proportion to the
/// nodes below `id`.
#[must_use]
pub fn value(graph: &Graph, id: NodeId, parameters: &[f64]) -> Option<f64> {
    if let Some(constant) = graph.as_constant(id) {
        return Some(constant);
    }
    let mut values: FxHashMap<NodeId, f64> = FxHashMap::default();
    for node in reachable(graph, &[id]) {
        let value = match graph.node(node) {
            Node::Coordinate(_) | Node::Oracle(..) => return None,
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Parameter(slot) => *parameters.get(slot.index())?,
            Node::Unary(op, a) => op.apply(values[&a]),
            Node::Binary(op, a, b) => op.apply(values[&a], values[&b]),
            Node::Pick(extremum, [a, b, c, d]) => {
                values[if extremum.picks_first(values[&a], values[&b]) { &c } else { &d }]
            }
        };
        values.insert(node, value);
    }
    values.get(&id).copied()
}

/// The value of `id` under the present values of the graph's parameters; else as [`value`].
#[must_use]
pub fn present_value(graph: &Graph, id: NodeId) -> Option<f64> {
    let parameters: Vec<f64> = graph.parameters().iter().map(|(_, value)| *value).collect();
    value(graph, id, &parameters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{Extremum, Unary};

    #[test]
    fn an_expression_of_parameters_has_a_value_that_follows_them() {
        let mut graph = Graph::new();
        let (a, b) = (graph.parameter("a", 2.0), graph.parameter("b", 3.0));
        let sum = graph.add(a, b);
        let root = graph.unary(Unary::Sqrt, sum);
        let picked = graph.pick(Extremum::Min, [a, b, sum, root]);
        assert_eq!(value(&graph, root, &[4.0, 5.0]), Some(3.0));
        assert_eq!(value(&graph, picked, &[4.0, 5.0]), Some(9.0));
        assert_eq!(value(&graph, picked, &[5.0, 4.0]), Some(3.0));
        assert_eq!(present_value(&graph, sum), Some(5.0));
        assert_eq!(value(&graph, b, &[1.0]), None);
    }

    #[test]
    fn an_expression_of_coordinates_has_no_value() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        let one = graph.constant(1.0);
        let root = graph.add(x, one);
        assert_eq!(value(&graph, root, &[]), None);
        assert_eq!(value(&graph, one, &[]), Some(1.0));
    }

    #[test]
    fn a_deep_expression_is_valued_without_recursion() {
        let mut graph = Graph::new();
        let a = graph.parameter("a", 1.0);
        let mut root = a;
        for _ in 0..100_000 {
            root = graph.add(root, a);
        }
        assert_eq!(present_value(&graph, root), Some(100_001.0));
    }
}
