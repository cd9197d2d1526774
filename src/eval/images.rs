//! What has become of the nodes of an expression that is rewritten.

use crate::expr::graph::operands;
use crate::expr::{Graph, Node, NodeId};

/// The new node of each old one, by index.
#[derive(Clone, Debug)]
pub(super) struct Images(Vec<Option<NodeId>>);

impl Images {
    /// No images yet of the nodes up to `root`.
    pub(super) fn new(root: NodeId) -> Self {
        Self(vec![None; root.index() + 1])
    }

    /// The image of `id`, if there is one.
    pub(super) fn get(&self, id: NodeId) -> Option<NodeId> {
        self.0.get(id.index()).copied().flatten()
    }

    /// The image of `id`; itself if there is none.
    pub(super) fn of(&self, id: NodeId) -> NodeId {
        self.get(id).unwrap_or(id)
    }

    /// Says what has become of `id`.
    pub(super) fn set(&mut self, id: NodeId, image: NodeId) {
        self.0[id.index()] = Some(image);
    }

    /// The old node `id`, which is `node`, on the images of its operands, in `graph`, which holds
    /// the old nodes too.
    pub(super) fn rebuilt(&self, graph: &mut Graph, id: NodeId, node: Node) -> NodeId {
        if operands(&node).iter().all(|&operand| self.of(operand) == operand) {
            return id;
        }
        self.moved(graph, node)
    }

    /// An old node, `node`, on the images of its operands, in `graph`.
    pub(super) fn moved(&self, graph: &mut Graph, node: Node) -> NodeId {
        let at = |id: NodeId| self.of(id);
        graph.intern(match node {
            Node::Coordinate(_) | Node::Constant(_) | Node::Parameter(_) => node,
            Node::Unary(op, a) => Node::Unary(op, at(a)),
            Node::Binary(op, a, b) => Node::Binary(op, at(a), at(b)),
            Node::Pick(extremum, list) => Node::Pick(extremum, list.map(at)),
            Node::Oracle(oracle, output, list) => Node::Oracle(oracle, output, list.map(at)),
        })
    }
}
