//! The hash-consed expression graph.
//!
//! Nodes are numbered in the order of their creation, so operands come before their users and a
//! walk in index order is a topological walk: nothing here recurses. Equal nodes are one node.
//! The constructors fold constants and normalise on the spot by the rules of
//! [`simplify`].

use super::oracle::Oracle;
use super::{Binary, Extremum, Node, Output, Unary, simplify};
use crate::geom::Axis;
use hashbrown::HashTable;
use hashbrown::hash_table::Entry;
use rustc_hash::{FxBuildHasher, FxHashSet};
use std::hash::BuildHasher;
use std::sync::Arc;

/// A node of a [`Graph`], meaningful only with the graph that made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(u32);

impl NodeId {
    /// Position of the node in its graph.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A parameter of a [`Graph`]: the slot of its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParameterId(u32);

impl ParameterId {
    /// Position of the parameter's value in a slice of parameter values.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// An oracle of a [`Graph`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OracleId(u32);

impl OracleId {
    /// Position of the oracle in [`Graph::oracles`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// How the names of unknowns begin; no text can say it.
const UNKNOWN: &str = "unknown ";

/// A set of expressions that share their common parts.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    /// By hash of the node; the nodes themselves are above, so that a large graph stays small.
    numbers: HashTable<NodeId>,
    parameters: Vec<(String, f64)>,
    oracles: Vec<Arc<dyn Oracle>>,
    /// Operations asked for, those that are known already included.
    asked: u64,
    /// The most that may be asked for, if that is limited.
    most: Option<u64>,
}

impl Graph {
    /// A graph without nodes.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A graph without nodes whose constructors may be asked for `most` operations, so that what a
    /// short text makes of an expression takes neither time nor memory without end.
    ///
    /// Beyond, the answer is not-a-number: whoever limits a graph looks at
    /// [`is_exhausted`](Self::is_exhausted) before using what was made.
    #[must_use]
    pub fn limited(most: u64) -> Self {
        Self { most: Some(most), ..Self::default() }
    }

    /// Whether more operations were asked for than allowed.
    #[must_use]
    pub fn is_exhausted(&self) -> bool {
        self.most.is_some_and(|most| self.asked > most)
    }

    /// The graph without its limit.
    #[must_use]
    pub fn without_limit(self) -> Self {
        Self { most: None, ..self }
    }

    /// A graph without nodes, with room for so many, and with the parameters and oracles of this one.
    #[must_use]
    pub fn emptied(&self, nodes: usize) -> Self {
        let Self { nodes: _, numbers: _, parameters, oracles, asked: _, most: _ } = self;
        Self {
            nodes: Vec::with_capacity(nodes),
            numbers: HashTable::with_capacity(nodes),
            parameters: parameters.clone(),
            oracles: oracles.clone(),
            asked: 0,
            most: None,
        }
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether the graph has no nodes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The node `id`.
    ///
    /// # Panics
    /// If `id` belongs to a larger graph.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// Every node with its id, operands before users.
    pub fn iter(&self) -> impl Iterator<Item = (NodeId, Node)> + '_ {
        self.nodes.iter().enumerate().map(|(i, node)| (NodeId(i as u32), *node))
    }

    /// The id of `node` as it stands, without simplification.
    ///
    /// # Panics
    /// If an operand is not a node of this graph, or after 2^32 nodes.
    pub fn intern(&mut self, node: Node) -> NodeId {
        let is_leaf = matches!(node, Node::Coordinate(_) | Node::Constant(_) | Node::Parameter(_));
        self.asked += u64::from(!is_leaf);
        if !is_leaf && self.is_exhausted() {
            return self.constant(f64::NAN);
        }
        let Self { nodes, numbers, .. } = self;
        let is_it = |id: &NodeId| nodes[id.index()] == node;
        let place = numbers.entry(hash(&node), is_it, |id| hash(&nodes[id.index()]));
        let place = match place {
            Entry::Occupied(known) => return *known.get(),
            Entry::Vacant(place) => place,
        };
        assert!(
            operands(&node).iter().all(|o| o.index() < nodes.len()),
            "an operand is not in this graph"
        );
        let id = u32::try_from(nodes.len()).expect("a graph has fewer than 2^32 nodes");
        nodes.push(node);
        place.insert(NodeId(id));
        NodeId(id)
    }

    /// The coordinate along `axis`.
    pub fn coordinate(&mut self, axis: Axis) -> NodeId {
        self.intern(Node::Coordinate(axis))
    }

    /// The three coordinates.
    pub fn point(&mut self) -> [NodeId; 3] {
        Axis::ALL.map(|axis| self.coordinate(axis))
    }

    /// The constant `value`.
    pub fn constant(&mut self, value: f64) -> NodeId {
        self.intern(Node::Constant(value.to_bits()))
    }

    /// The value of `id` if it is a constant.
    #[must_use]
    pub fn as_constant(&self, id: NodeId) -> Option<f64> {
        if let Node::Constant(bits) = self.node(id) { Some(f64::from_bits(bits)) } else { None }
    }

    /// The parameter `name`, made with value `value` if the graph does not have it yet.
    pub fn parameter(&mut self, name: &str, value: f64) -> NodeId {
        let slot = self.parameters.iter().position(|(n, _)| n == name).unwrap_or_else(|| {
            self.parameters.push((name.to_owned(), value));
            self.parameters.len() - 1
        });
        self.intern(Node::Parameter(ParameterId(slot as u32)))
    }

    /// A new parameter that no text names: an unknown that is to be solved for. Its value is NaN.
    pub fn unknown(&mut self) -> ParameterId {
        let slot = self.parameters.len();
        self.parameters.push((format!("{UNKNOWN}{slot}"), f64::NAN));
        ParameterId(slot as u32)
    }

    /// The parameters that are not [unknowns](Self::unknown), if those came after all others.
    #[must_use]
    pub fn named_parameters(&self) -> &[(String, f64)] {
        let named = self.parameters.iter().take_while(|(name, _)| !name.starts_with(UNKNOWN));
        &self.parameters[..named.count()]
    }

    /// Names and present values of the parameters, by slot.
    #[must_use]
    pub fn parameters(&self) -> &[(String, f64)] {
        &self.parameters
    }

    /// The slot of the parameter called `name`.
    #[must_use]
    pub fn slot(&self, name: &str) -> Option<ParameterId> {
        let position = self.parameters.iter().position(|(known, _)| known == name)?;
        Some(ParameterId(position as u32))
    }

    /// The parameters that `roots` depend on, by slot.
    #[must_use]
    pub fn parameters_of(&self, roots: &[NodeId]) -> Vec<ParameterId> {
        let (mut seen, mut slots) = (FxHashSet::default(), Vec::new());
        let mut pending = roots.to_vec();
        while let Some(id) = pending.pop() {
            if seen.insert(id) {
                let node = self.node(id);
                if let Node::Parameter(slot) = node {
                    slots.push(slot);
                }
                pending.extend_from_slice(&operands(&node));
            }
        }
        slots.sort_unstable();
        slots
    }

    /// Changes the value of the parameter in `slot`.
    pub fn set_parameter(&mut self, slot: ParameterId, value: f64) {
        self.parameters[slot.index()].1 = value;
    }

    /// The oracles, by id.
    #[must_use]
    pub fn oracles(&self) -> &[Arc<dyn Oracle>] {
        &self.oracles
    }

    /// Adds an oracle; the same `Arc` is added once.
    pub fn add_oracle(&mut self, oracle: &Arc<dyn Oracle>) -> OracleId {
        let slot = self.oracles.iter().position(|o| Arc::ptr_eq(o, oracle)).unwrap_or_else(|| {
            self.oracles.push(Arc::clone(oracle));
            self.oracles.len() - 1
        });
        OracleId(slot as u32)
    }

    /// An output of `oracle` at the point `at`.
    pub fn oracle(&mut self, oracle: OracleId, output: Output, at: [NodeId; 3]) -> NodeId {
        self.intern(Node::Oracle(oracle, output, at))
    }

    /// The operator `op` applied to `a`, simplified.
    pub fn unary(&mut self, op: Unary, a: NodeId) -> NodeId {
        simplify::unary(self, op, a)
    }

    /// The operator `op` applied to `a` and `b`, simplified.
    ///
    /// A power with a constant whole exponent up to 16 in magnitude is a product
    /// ([`simplify`]).
    pub fn binary(&mut self, op: Binary, a: NodeId, b: NodeId) -> NodeId {
        simplify::binary(self, op, a, b)
    }

    /// `c` where the extremum of `a` and `b` takes `a`, else `d`; simplified.
    pub fn pick(&mut self, extremum: Extremum, [a, b, c, d]: [NodeId; 4]) -> NodeId {
        simplify::pick(self, extremum, [a, b, c, d])
    }

    /// `a + b`.
    pub fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.binary(Binary::Add, a, b)
    }

    /// `a - b`.
    pub fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.binary(Binary::Sub, a, b)
    }

    /// `a * b`.
    pub fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.binary(Binary::Mul, a, b)
    }

    /// `a / b`.
    pub fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.binary(Binary::Div, a, b)
    }

    /// The lesser of `a` and `b`; `b` on ties and NaN.
    pub fn min(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.binary(Binary::Min, a, b)
    }

    /// The greater of `a` and `b`; `b` on ties and NaN.
    pub fn max(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.binary(Binary::Max, a, b)
    }

    /// `-a`.
    pub fn neg(&mut self, a: NodeId) -> NodeId {
        self.unary(Unary::Neg, a)
    }
}

fn hash(node: &Node) -> u64 {
    FxBuildHasher.hash_one(node)
}

/// The operands of `node`, in order.
#[must_use]
pub fn operands(node: &Node) -> Operands {
    let (list, len) = match *node {
        Node::Coordinate(_) | Node::Constant(_) | Node::Parameter(_) => ([NodeId(0); 4], 0),
        Node::Unary(_, a) => ([a; 4], 1),
        Node::Binary(_, a, b) => ([a, b, b, b], 2),
        Node::Oracle(_, _, [a, b, c]) => ([a, b, c, c], 3),
        Node::Pick(_, list) => (list, 4),
    };
    Operands { list, len }
}

/// Up to four operands of a node; a slice by dereference.
#[derive(Clone, Copy, Debug)]
pub struct Operands {
    list: [NodeId; 4],
    len: u8,
}

impl std::ops::Deref for Operands {
    type Target = [NodeId];

    fn deref(&self) -> &[NodeId] {
        &self.list[..usize::from(self.len)]
    }
}
