//! Values of expressions that do not depend on the point, under given parameter values.

use crate::expr::graph::operands;
use crate::expr::{Graph, Node, NodeId};
use rustc_hash::FxHashMap;

/// Evaluates coordinate-free expressions of one graph, each node once.
#[derive(Debug)]
pub struct Values<'a> {
    graph: &'a Graph,
    parameters: &'a [f64],
    known: FxHashMap<NodeId, Option<f64>>,
}

impl<'a> Values<'a> {
    /// Values where the parameter in slot `i` is `parameters[i]`.
    #[must_use]
    pub fn new(graph: &'a Graph, parameters: &'a [f64]) -> Self {
        Self { graph, parameters, known: FxHashMap::default() }
    }

    pub(super) fn graph(&self) -> &Graph {
        self.graph
    }

    pub(super) fn parameters(&self) -> &[f64] {
        self.parameters
    }

    /// The value of `id`; `None` if it depends on a coordinate, on an oracle, or on a parameter
    /// without a value.
    pub fn of(&mut self, id: NodeId) -> Option<f64> {
        let mut pending = vec![id];
        while let Some(&top) = pending.last() {
            if self.known.contains_key(&top) {
                pending.pop();
                continue;
            }
            let node = self.graph.node(top);
            let before = pending.len();
            pending.extend(operands(&node).iter().filter(|o| !self.known.contains_key(o)));
            if pending.len() == before {
                let value = self.apply(node);
                self.known.insert(top, value);
                pending.pop();
            }
        }
        self.known[&id]
    }

    /// The values of three expressions, NaN where there is none.
    pub fn triple(&mut self, ids: [NodeId; 3]) -> [f64; 3] {
        ids.map(|id| self.of(id).unwrap_or(f64::NAN))
    }

    /// The value of `node`, its operands being known.
    fn apply(&self, node: Node) -> Option<f64> {
        let known = |id: NodeId| self.known[&id];
        match node {
            Node::Coordinate(_) | Node::Oracle(..) => None,
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            Node::Parameter(slot) => self.parameters.get(slot.index()).copied(),
            Node::Unary(op, a) => Some(op.apply(known(a)?)),
            Node::Binary(op, a, b) => Some(op.apply(known(a)?, known(b)?)),
            Node::Pick(extremum, [a, b, c, d]) => {
                if extremum.picks_first(known(a)?, known(b)?) {
                    known(c)
                } else {
                    known(d)
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Axis;

    #[test]
    fn parameters_are_read_from_the_slice() {
        let mut graph = Graph::new();
        let t = graph.parameter("t", 1.0);
        let two = graph.constant(2.0);
        let product = graph.mul(two, t);
        assert_eq!(Values::new(&graph, &[3.0]).of(product), Some(6.0));
        assert_eq!(Values::new(&graph, &[]).of(product), None);
    }

    #[test]
    fn coordinates_have_no_value() {
        let mut graph = Graph::new();
        let x = graph.coordinate(Axis::X);
        let one = graph.constant(1.0);
        let sum = graph.add(x, one);
        assert_eq!(Values::new(&graph, &[]).of(sum), None);
    }

    #[test]
    fn a_long_chain_does_not_exhaust_the_stack() {
        let mut graph = Graph::new();
        let t = graph.parameter("t", 1.0);
        let sum = (0..200_000).fold(t, |sum, _| graph.add(sum, t));
        assert_eq!(Values::new(&graph, &[1.0]).of(sum), Some(200_001.0));
    }
}
