//! The operations of an expression in the order in which an engine runs them.
//!
//! A tape holds the nodes that its outputs need and nothing else, operands before users, operands
//! as positions on the tape. It is the common input of both engines.

use crate::expr::graph::operands;
use crate::expr::{AxisSet, Binary, Extremum, Graph, Node, NodeId, OracleId, Output, ParameterId};
use crate::expr::{Unary, depends};
use crate::geom::Axis;
use rustc_hash::FxHashMap;

/// A position on a [`Tape`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Position(u32);

impl Position {
    /// The position as an index.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    pub(super) const fn new(index: usize) -> Self {
        Self(index as u32)
    }
}

/// An operation of a tape: a node of the expression whose operands are earlier positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// A coordinate of the point.
    Coordinate(Axis),
    /// A constant, by its bits.
    Constant(u64),
    /// The value of a parameter.
    Parameter(ParameterId),
    /// An operator of one operand.
    Unary(Unary, Position),
    /// An operator of two operands.
    Binary(Binary, Position, Position),
    /// `c` where the extremum of `a` and `b` takes `a`, else `d`, for operands `[a, b, c, d]`.
    Pick(Extremum, [Position; 4]),
    /// An output of an oracle at the point whose coordinates are the operands.
    Oracle(OracleId, Output, [Position; 3]),
}

impl Op {
    /// The operands, in order.
    #[must_use]
    pub fn operands(&self) -> Operands {
        let none = Position(0);
        let (list, len) = match *self {
            Self::Coordinate(_) | Self::Constant(_) | Self::Parameter(_) => ([none; 4], 0),
            Self::Unary(_, a) => ([a; 4], 1),
            Self::Binary(_, a, b) => ([a, b, b, b], 2),
            Self::Oracle(_, _, [a, b, c]) => ([a, b, c, c], 3),
            Self::Pick(_, list) => (list, 4),
        };
        Operands { list, len }
    }

    /// The operation with each operand replaced.
    fn with(self, at: impl Fn(Position) -> Position) -> Self {
        match self {
            Self::Coordinate(_) | Self::Constant(_) | Self::Parameter(_) => self,
            Self::Unary(op, a) => Self::Unary(op, at(a)),
            Self::Binary(op, a, b) => Self::Binary(op, at(a), at(b)),
            Self::Pick(extremum, list) => Self::Pick(extremum, list.map(at)),
            Self::Oracle(oracle, output, list) => Self::Oracle(oracle, output, list.map(at)),
        }
    }

    /// The extremum whose choice this operation makes, with the two operands compared.
    #[must_use]
    pub fn choice(&self) -> Option<(Extremum, Position, Position)> {
        match *self {
            Self::Binary(op, a, b) => op.extremum().map(|extremum| (extremum, a, b)),
            Self::Pick(extremum, [a, b, _, _]) => Some((extremum, a, b)),
            Self::Coordinate(_)
            | Self::Constant(_)
            | Self::Parameter(_)
            | Self::Unary(..)
            | Self::Oracle(..) => None,
        }
    }
}

/// Up to four operands of an operation; a slice by dereference.
#[derive(Clone, Copy, Debug)]
pub struct Operands {
    list: [Position; 4],
    len: u8,
}

impl std::ops::Deref for Operands {
    type Target = [Position];

    fn deref(&self) -> &[Position] {
        &self.list[..usize::from(self.len)]
    }
}

impl std::ops::DerefMut for Operands {
    fn deref_mut(&mut self) -> &mut [Position] {
        &mut self.list[..usize::from(self.len)]
    }
}

/// Operations, operands before users, as it is seen what becomes of their values.
pub trait Operations {
    /// Number of operations.
    fn count(&self) -> usize;

    /// The operation at `p`.
    fn op(&self, p: Position) -> Op;

    /// Whether the value at `p` is the same everywhere.
    fn is_uniform(&self, p: Position) -> bool;

    /// The operations whose values are wanted, in order.
    fn outputs(&self) -> impl Iterator<Item = Position>;
}

/// The operations that some outputs need, operands before users.
#[derive(Clone, Debug)]
pub struct Tape {
    ops: Vec<Op>,
    axes: Vec<AxisSet>,
    nodes: Vec<NodeId>,
    outputs: Vec<Position>,
}

impl Tape {
    /// The tape of `outputs`, in the order of the graph.
    #[must_use]
    pub fn new(graph: &Graph, outputs: &[NodeId]) -> Self {
        let nodes = depends::reachable(graph, outputs);
        let numbers: FxHashMap<NodeId, Position> =
            nodes.iter().enumerate().map(|(i, &id)| (id, Position::new(i))).collect();
        let mut ops = Vec::with_capacity(nodes.len());
        let mut axes: Vec<AxisSet> = Vec::with_capacity(nodes.len());
        for &id in &nodes {
            let node = graph.node(id);
            let at = |id: NodeId| numbers[&id];
            let (op, own) = match node {
                Node::Coordinate(axis) => (Op::Coordinate(axis), AxisSet::only(axis)),
                Node::Constant(bits) => (Op::Constant(bits), AxisSet::EMPTY),
                Node::Parameter(parameter) => (Op::Parameter(parameter), AxisSet::EMPTY),
                Node::Unary(op, a) => (Op::Unary(op, at(a)), AxisSet::EMPTY),
                Node::Binary(op, a, b) => (Op::Binary(op, at(a), at(b)), AxisSet::EMPTY),
                Node::Pick(extremum, list) => (Op::Pick(extremum, list.map(at)), AxisSet::EMPTY),
                Node::Oracle(oracle, output, list) => {
                    (Op::Oracle(oracle, output, list.map(at)), AxisSet::EMPTY)
                }
            };
            axes.push(operands(&node).iter().fold(own, |set, &o| set.union(axes[at(o).index()])));
            ops.push(op);
        }
        let outputs = outputs.iter().map(|id| numbers[id]).collect();
        Self { ops, axes, nodes, outputs }
    }

    /// Number of operations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ops.len()
    }

    /// Whether there are no operations.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ops.is_empty()
    }

    /// Every position in order.
    pub fn positions(&self) -> impl DoubleEndedIterator<Item = Position> + use<> {
        (0..self.ops.len()).map(Position::new)
    }

    /// The operation at `position`.
    #[must_use]
    pub fn op(&self, position: Position) -> Op {
        self.ops[position.index()]
    }

    /// The axes that the operation at `position` depends on; none for a uniform value, one that is
    /// the same everywhere (made of constants and parameters).
    #[must_use]
    pub fn axes(&self, position: Position) -> AxisSet {
        self.axes[position.index()]
    }

    /// The graph's node at `position`.
    #[must_use]
    pub fn node(&self, position: Position) -> NodeId {
        self.nodes[position.index()]
    }

    /// The outputs, as they were asked for.
    #[must_use]
    pub fn outputs(&self) -> &[Position] {
        &self.outputs
    }

    /// Whether each operation is an output, by index.
    #[must_use]
    pub fn output_flags(&self) -> Vec<bool> {
        let mut flags = vec![false; self.len()];
        for output in &self.outputs {
            flags[output.index()] = true;
        }
        flags
    }

    /// The tape with its operations in the order `order`, which lists each position once and
    /// operands before users.
    #[must_use]
    pub(super) fn reordered(&self, order: &[Position]) -> Self {
        debug_assert_eq!(order.len(), self.len());
        let mut numbers = vec![Position(0); self.len()];
        for (i, position) in order.iter().enumerate() {
            numbers[position.index()] = Position::new(i);
        }
        let at = |position: Position| numbers[position.index()];
        Self {
            ops: order.iter().map(|&p| self.op(p).with(at)).collect(),
            axes: order.iter().map(|&p| self.axes(p)).collect(),
            nodes: order.iter().map(|&p| self.node(p)).collect(),
            outputs: self.outputs.iter().map(|&p| at(p)).collect(),
        }
    }
}

impl Operations for Tape {
    fn count(&self) -> usize {
        self.len()
    }

    fn op(&self, p: Position) -> Op {
        self.ops[p.index()]
    }

    fn is_uniform(&self, p: Position) -> bool {
        self.axes(p).is_empty()
    }

    fn outputs(&self) -> impl Iterator<Item = Position> {
        self.outputs.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tape_holds_what_its_outputs_need_with_axes() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let two = graph.constant(2.0);
        let a = graph.mul(two, x);
        let b = graph.add(a, y);
        let _unused = graph.mul(b, z);
        let tape = Tape::new(&graph, &[b, a]);
        assert_eq!(tape.len(), 5);
        let [b_at, a_at] = tape.outputs() else { panic!("two outputs") };
        assert_eq!((tape.node(*b_at), tape.node(*a_at)), (b, a));
        assert_eq!(tape.axes(*b_at).len(), 2);
        assert_eq!(tape.axes(*a_at), AxisSet::only(Axis::X));
        for p in tape.positions() {
            assert!(tape.op(p).operands().iter().all(|&o| o < p));
        }
    }
}
