//! The contract of a graph, checked.
//!
//! Whoever reads a [`Graph`] may rely on this:
//!
//! 1. the operands of a node have lower ids;
//! 2. parameters and oracles that nodes name exist, and no two parameters have one name;
//! 3. no two nodes are equal: equal expressions have one id;
//! 4. no operator has only constants for operands: they are folded.
//!
//! The constructors keep the contract; [`verify`] is for code that calls [`Graph::intern`] with
//! operators, and for tests.

use super::graph::operands;
use super::{Graph, Node, NodeId};
use rustc_hash::FxHashMap;

/// A breach of the contract of a [`Graph`], naming nodes by index.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// An operand does not precede its user.
    #[error("node {node} uses node {operand}, which does not precede it")]
    OperandNotEarlier {
        /// The user.
        node: usize,
        /// The operand.
        operand: usize,
    },
    /// A parameter that the graph does not have.
    #[error("node {node} reads parameter {slot}, but there are {parameters}")]
    UnknownParameter {
        /// The node that names it.
        node: usize,
        /// The slot that it names.
        slot: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// An oracle that the graph does not have.
    #[error("node {node} asks oracle {slot}, but there are {oracles}")]
    UnknownOracle {
        /// The node that names it.
        node: usize,
        /// The oracle that it names.
        slot: usize,
        /// Number of oracles.
        oracles: usize,
    },
    /// Two parameters of one name.
    #[error("parameters {first} and {second} are both named `{name}`")]
    SameName {
        /// Slot of the one.
        first: usize,
        /// Slot of the other.
        second: usize,
        /// Their name.
        name: String,
    },
    /// Two ids of one node.
    #[error("nodes {first} and {second} are equal; intern gives them one id")]
    SameNode {
        /// The earlier id.
        first: usize,
        /// The later id.
        second: usize,
    },
    /// An operator of constants.
    #[error("node {node} has only constants for operands; the constructors fold it")]
    NotFolded {
        /// The operator.
        node: usize,
    },
}

/// Checks the contract of `graph`.
///
/// # Errors
/// The first [`Fault`], in order of nodes, those of parameters before.
pub fn verify(graph: &Graph) -> Result<(), Fault> {
    let names: Vec<&str> = graph.parameters().iter().map(|(name, _)| name.as_str()).collect();
    check(graph.iter(), &names, graph.oracles().len())
}

fn check(
    nodes: impl Iterator<Item = (NodeId, Node)>,
    parameters: &[&str],
    oracles: usize,
) -> Result<(), Fault> {
    let mut slots = FxHashMap::default();
    for (second, &name) in parameters.iter().enumerate() {
        if let Some(first) = slots.insert(name, second) {
            return Err(Fault::SameName { first, second, name: name.to_owned() });
        }
    }
    let mut seen: FxHashMap<Node, usize> = FxHashMap::default();
    let mut constants = Vec::new();
    for (node, (id, content)) in nodes.enumerate() {
        let operands = operands(&content);
        let late = operands.iter().find(|operand| **operand >= id);
        if let Some(operand) = late {
            return Err(Fault::OperandNotEarlier { node, operand: operand.index() });
        }
        named(node, content, parameters.len(), oracles)?;
        if let Some(first) = seen.insert(content, node) {
            return Err(Fault::SameNode { first, second: node });
        }
        // An oracle's answer at a constant point is not known here.
        let foldable = matches!(content, Node::Unary(..) | Node::Binary(..));
        if foldable && operands.iter().all(|operand| constants[operand.index()]) {
            return Err(Fault::NotFolded { node });
        }
        constants.push(matches!(content, Node::Constant(_)));
    }
    Ok(())
}

/// Whether the parameter or oracle that `content` names exists.
fn named(node: usize, content: Node, parameters: usize, oracles: usize) -> Result<(), Fault> {
    match content {
        Node::Parameter(id) if id.index() >= parameters => {
            Err(Fault::UnknownParameter { node, slot: id.index(), parameters })
        }
        Node::Oracle(id, ..) if id.index() >= oracles => {
            Err(Fault::UnknownOracle { node, slot: id.index(), oracles })
        }
        Node::Coordinate(_)
        | Node::Constant(_)
        | Node::Parameter(_)
        | Node::Unary(..)
        | Node::Binary(..)
        | Node::Pick(..)
        | Node::Oracle(..) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::derive::gradient;
    use crate::expr::probe::{Raw, SPECIAL, Simplified, Source, random};
    use crate::expr::{Binary, Failure, Oracle, Output, Queries, Unary};
    use crate::num::Interval;
    use std::sync::Arc;

    #[test]
    fn constructors_and_derivatives_keep_the_contract() {
        for seed in 0..300 {
            let mut graph = Graph::new();
            let root = random::<Simplified>(&mut graph, &mut Source(seed), 40, &SPECIAL);
            gradient(&mut graph, root);
            assert_eq!(verify(&graph), Ok(()), "seed {seed}");
        }
    }

    #[test]
    fn an_operator_of_constants_is_seen() {
        let mut graph = Graph::new();
        let one = graph.constant(1.0);
        graph.intern(Node::Unary(Unary::Sin, one));
        assert_eq!(verify(&graph), Err(Fault::NotFolded { node: 1 }));
        let mut graph = Graph::new();
        random::<Raw>(&mut graph, &mut Source(1), 100, &[1.0]);
        assert!(matches!(verify(&graph), Err(Fault::NotFolded { .. })));
    }

    #[test]
    fn a_parameter_of_another_graph_is_seen() {
        let mut other = Graph::new();
        other.parameter("a", 0.0);
        let b = other.parameter("b", 0.0);
        let mut graph = Graph::new();
        graph.parameter("a", 0.0);
        graph.intern(other.node(b));
        let fault = Fault::UnknownParameter { node: 1, slot: 1, parameters: 1 };
        assert_eq!(verify(&graph), Err(fault));
    }

    #[derive(Debug)]
    struct Nothing;

    impl Oracle for Nothing {
        fn name(&self) -> &str {
            "nothing"
        }

        fn points(&self, _: Queries<'_>) -> Result<(), Failure> {
            Ok(())
        }

        fn range(&self, _: [Interval; 3]) -> Interval {
            Interval::ANYTHING
        }
    }

    #[test]
    fn an_oracle_of_another_graph_is_seen() {
        let nothing: Arc<dyn Oracle> = Arc::new(Nothing);
        let id = Graph::new().add_oracle(&nothing);
        let mut graph = Graph::new();
        let point = graph.point();
        graph.oracle(id, Output::Value, point);
        assert_eq!(verify(&graph), Err(Fault::UnknownOracle { node: 3, slot: 0, oracles: 0 }));
        graph.add_oracle(&nothing);
        assert_eq!(verify(&graph), Ok(()));
    }

    #[test]
    fn an_operand_that_is_not_earlier_is_seen() {
        let mut graph = Graph::new();
        let [x, y, _] = graph.point();
        let nodes = [(x, Node::Unary(Unary::Sin, y)), (y, graph.node(y))];
        let fault = Fault::OperandNotEarlier { node: 0, operand: 1 };
        assert_eq!(check(nodes.into_iter(), &[], 0), Err(fault));
        let itself = [(x, Node::Binary(Binary::Add, x, x))];
        let fault = Fault::OperandNotEarlier { node: 0, operand: 0 };
        assert_eq!(check(itself.into_iter(), &[], 0), Err(fault));
    }

    #[test]
    fn equal_nodes_and_equal_names_are_seen() {
        let mut graph = Graph::new();
        let [x, y, _] = graph.point();
        let twice = [(x, graph.node(x)), (y, graph.node(x))];
        let fault = Fault::SameNode { first: 0, second: 1 };
        assert_eq!(check(twice.into_iter(), &[], 0), Err(fault));
        let fault = Fault::SameName { first: 0, second: 2, name: "a".to_owned() };
        assert_eq!(check([].into_iter(), &["a", "b", "a"], 0), Err(fault));
    }
}
