//! Rewrite rules.
use super::{Binary, Extremum, Graph, Node, NodeId, Unary};

pub(super) fn unary(graph: &mut Graph, op: Unary, a: NodeId) -> NodeId {
    match graph.as_constant(a) {
        Some(a) => graph.constant(op.apply(a)),
        None => graph.intern(Node::Unary(op, a)),
    }
}

pub(super) fn binary(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> NodeId {
    match (graph.as_constant(a), graph.as_constant(b)) {
        (Some(a), Some(b)) => graph.constant(op.apply(a, b)),
        _ => graph.intern(Node::Binary(op, a, b)),
    }
}

pub(super) fn pick(graph: &mut Graph, extremum: Extremum, operands: [NodeId; 4]) -> NodeId {
    graph.intern(Node::Pick(extremum, operands))
}
