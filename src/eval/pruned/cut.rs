//! An expression cut down to what matters somewhere.
//!
//! A walk from the outputs down the sides of choices that are alive meets what is to be computed and
//! nothing else, so it costs what it finds, however large the expression is. A choice with one side
//! alive passes that side's value on; where nobody asks which choices were met, it is no operation.
//! Values on no axis are read.

use super::code::{Code, Form, NO_CHOICE};
use crate::eval::lower::Factor;
use crate::eval::regions::is_set;
use crate::eval::tape::Position;
use crate::expr::graph::operands;
use crate::expr::{AxisSet, Binary, Extremum, Node, NodeId, OracleId, Output, Unary};
use crate::geom::Axis;

/// An operand or an output of a cut: an operation of it, or a value on no axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Arg(u32);

impl Arg {
    const UNIFORM: u32 = 1 << 31;
    /// Set while a cut is made, where the operation is of a chain with its user.
    const JOINED: u32 = 1 << 30;

    /// The operation at that place of the cut.
    pub(super) const fn item(place: usize) -> Self {
        Self(place as u32)
    }

    fn uniform(id: NodeId) -> Self {
        Self(id.index() as u32 | Self::UNIFORM)
    }

    /// The same as a position in what is made of a cut.
    pub(super) const fn position(self) -> Position {
        Position::new(self.0 as usize)
    }

    /// The operand or output at position `p`.
    pub(super) const fn at(p: Position) -> Self {
        Self(p.index() as u32)
    }

    /// The place of the operation, if it is one; else the index of the uniform value's node.
    #[inline]
    pub(super) const fn place(self) -> Result<usize, usize> {
        if self.0 & Self::UNIFORM == 0 {
            Ok(self.0 as usize)
        } else {
            Err((self.0 & !Self::UNIFORM) as usize)
        }
    }
}

/// What an operation of a cut does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Op {
    /// A coordinate.
    Coordinate(Axis),
    /// The first operand, as a choice with one side alive takes it: the first or the second.
    Pass(u8),
    /// An operator of one operand.
    Unary(Unary),
    /// The product of a value with itself.
    Square,
    /// An operator of two operands that is no extremum.
    Binary(Binary),
    /// An extremum of two operands.
    Choose(Extremum),
    /// A pick among four operands.
    Pick(Extremum),
    /// An output of an oracle.
    Oracle(OracleId, Output),
}

/// An operation of a cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) op: Op,
    /// The operands; those that it has not are the first, or nothing.
    pub(super) args: [Arg; 4],
    /// The axes that it depends on, as far as it is computed here.
    pub(super) axes: AxisSet,
    /// Whether each of its first two operands belongs to the same chain of extrema.
    pub(super) joined: [bool; 2],
    pub(super) node: NodeId,
    /// The number of its choice.
    pub(super) choice: u32,
}

/// A cut: operations in an order in which they can be computed.
#[derive(Clone, Debug, Default)]
pub(super) struct Cut {
    pub(super) items: Vec<Item>,
    pub(super) outputs: Vec<Arg>,
    /// Number of operations that choose among sides.
    pub(super) open: usize,
}

/// Which sides of the choices are alive.
pub(super) trait Guide {
    /// Whether the first and the second side of choice `choice` are alive; at least one is.
    fn sides(&self, choice: u32) -> [bool; 2];
}

/// The activity row of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<'a>(pub(super) &'a [u64]);

impl Guide for Row<'_> {
    #[inline]
    fn sides(&self, choice: u32) -> [bool; 2] {
        match [2 * choice, 2 * choice + 1].map(|bit| is_set(self.0, bit)) {
            // What no one needed is not known.
            [false, false] => [true, true],
            sides => sides,
        }
    }
}

/// What a node is in the cut with that stamp.
#[derive(Clone, Copy, Debug)]
struct Slot {
    stamp: u32,
    /// Its place, and whether it is of a chain with its user.
    arg: Arg,
}

/// Makes cuts: memory of the size of the expression, of which a cut touches what it takes.
#[derive(Debug)]
pub(super) struct Cutter {
    stamp: u32,
    slots: Vec<Slot>,
    stack: Vec<(NodeId, u32)>,
}

impl Cutter {
    /// Room for cuts of `code`.
    pub(super) fn new(code: &Code) -> Self {
        let nodes = code.graph().len();
        let slots = vec![Slot { stamp: 0, arg: Arg(0) }; nodes];
        Self { stamp: 0, slots, stack: Vec::new() }
    }

    /// Cuts `outputs` of form `form` down to what `guide` leaves alive.
    pub(super) fn cut(
        &mut self,
        code: &Code,
        form: Form,
        outputs: &[NodeId],
        guide: &impl Guide,
        cut: &mut Cut,
    ) {
        if self.stamp == u32::MAX {
            self.slots.fill(Slot { stamp: 0, arg: Arg(0) });
            self.stamp = 0;
        }
        self.stamp += 1;
        let Cut { items, outputs: args, open: open_choices } = cut;
        items.clear();
        args.clear();
        *open_choices = 0;
        for &output in outputs {
            if !self.is_known(code, output) {
                self.stack.push((output, 0));
            }
            while let Some(&(id, next)) = self.stack.last() {
                let node = code.graph().node(id);
                let choice = code.choice(form, id, &node);
                let sides = if choice == NO_CHOICE { [true, true] } else { guide.sides(choice) };
                let only = survivor(&node, sides);
                let mut next = next;
                let open = loop {
                    let operand = match only {
                        Some(only) if next == 0 => only,
                        Some(_) => break None,
                        None => match needed(code, form, id, &node, next) {
                            Some(operand) => operand,
                            None => break None,
                        },
                    };
                    next += 1;
                    if !self.is_known(code, operand) {
                        break Some(operand);
                    }
                };
                if let Some(operand) = open {
                    if let Some(top) = self.stack.last_mut() {
                        top.1 = next;
                    }
                    self.stack.push((operand, 0));
                    continue;
                }
                self.stack.pop();
                let joins = choice != NO_CHOICE && code.traits(id).joins;
                let place = (Arg::item(items.len()), joins);
                match only.map(|only| self.place(code, only)) {
                    Some((arg, joined)) if form == Form::Source => {
                        let axes = arg.place().map_or(AxisSet::EMPTY, |at| items[at].axes);
                        let (op, joined) = (Op::Pass(u8::from(sides[1])), [joined, false]);
                        items.push(Item { op, args: [arg; 4], axes, joined, node: id, choice });
                        self.set(id, place);
                    }
                    Some(passed) => self.set(id, passed),
                    None => {
                        let item = self.item(code, id, &node, choice, items);
                        *open_choices += usize::from(choice != NO_CHOICE);
                        items.push(item);
                        self.set(id, place);
                    }
                }
            }
            args.push(self.place(code, output).0);
        }
    }

    /// What node `id` is in the cut that was made last, which holds it.
    pub(super) fn arg(&self, code: &Code, id: NodeId) -> Arg {
        self.place(code, id).0
    }

    /// Whether node `id` is read, or computed already.
    #[inline]
    fn is_known(&self, code: &Code, id: NodeId) -> bool {
        code.axes[id.index()].is_empty() || self.slots[id.index()].stamp == self.stamp
    }

    fn set(&mut self, id: NodeId, place: (Arg, bool)) {
        let (Arg(bits), joins) = place;
        let arg = Arg(bits | if joins { Arg::JOINED } else { 0 });
        self.slots[id.index()] = Slot { stamp: self.stamp, arg };
    }

    fn place(&self, code: &Code, id: NodeId) -> (Arg, bool) {
        if code.axes[id.index()].is_empty() {
            return (Arg::uniform(id), false);
        }
        let Arg(bits) = self.slots[id.index()].arg;
        (Arg(bits & !Arg::JOINED), bits & Arg::JOINED != 0)
    }

    #[inline]
    fn item(&self, code: &Code, id: NodeId, node: &Node, choice: u32, items: &[Item]) -> Item {
        let mut args = [Arg::uniform(id); 4];
        let mut joined = [false; 2];
        let mut axes = AxisSet::EMPTY;
        for (i, &operand) in operands(node).iter().enumerate() {
            let (arg, joins) = self.place(code, operand);
            args[i] = arg;
            if let Some(joined) = joined.get_mut(i) {
                *joined = joins;
            }
            if let Ok(place) = arg.place() {
                axes = axes.union(items[place].axes);
            }
        }
        let op = match *node {
            Node::Coordinate(axis) => {
                axes = AxisSet::only(axis);
                Op::Coordinate(axis)
            }
            Node::Unary(op, _) => Op::Unary(op),
            Node::Binary(Binary::Mul, a, b) if a == b => Op::Square,
            Node::Binary(op, _, _) => op.extremum().map_or(Op::Binary(op), Op::Choose),
            Node::Pick(extremum, _) => Op::Pick(extremum),
            Node::Oracle(oracle, output, _) => Op::Oracle(oracle, output),
            Node::Constant(_) | Node::Parameter(_) => {
                unreachable!("what is on no axis is not computed")
            }
        };
        Item { op, args, axes, joined, node: id, choice }
    }
}

/// The operand of node `id` that is computed after `done` others of it, if there is one.
#[inline]
fn needed(code: &Code, form: Form, id: NodeId, node: &Node, done: u32) -> Option<NodeId> {
    let done = done as usize;
    let operands = operands(node);
    if let Some(&operand) = operands.get(done) {
        return Some(operand);
    }
    if form != Form::Source || !matches!(node, Node::Unary(Unary::Sin | Unary::Cos, _)) {
        return None;
    }
    // The range of a split sine needs those of the terms.
    let split = code.lowered.split(id)?;
    let mut parts = split.terms.iter().flat_map(|term| {
        let factors = term.factors.iter().map(|factor| match factor {
            Factor::Times(id) | Factor::Over(id) => *id,
        });
        std::iter::once(term.leaf).chain(factors)
    });
    parts.nth(done - operands.len())
}

/// What a choice takes if only one of its sides is alive.
#[inline]
fn survivor(node: &Node, sides: [bool; 2]) -> Option<NodeId> {
    match (*node, sides) {
        (Node::Binary(_, a, _), [true, false]) => Some(a),
        (Node::Binary(_, _, b), [false, true]) => Some(b),
        (Node::Pick(_, [_, _, c, _]), [true, false]) => Some(c),
        (Node::Pick(_, [_, _, _, d]), [false, true]) => Some(d),
        (
            Node::Coordinate(_)
            | Node::Constant(_)
            | Node::Parameter(_)
            | Node::Unary(..)
            | Node::Binary(..)
            | Node::Pick(..)
            | Node::Oracle(..),
            _,
        ) => None,
    }
}
