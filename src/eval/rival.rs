//! What the values of an oracle lose against.
//!
//! An oracle on one side of an extremum is dear, and in a part filled with a lattice most points of
//! the lattice's surface are deep inside of the part: there the value at the other side decides
//! whatever the oracle would say. So a number is found, from the values of other sides, such that
//! no side that the oracle's answers reach is taken where its value is beyond it; the oracle may
//! pass over those values ([`points_for`](crate::expr::Oracle::points_for)).
//!
//! What the answers reach is followed from the oracle to the outputs. It ends at extrema, and at picks
//! on the same operands, that can be made to take their other side; if it ends everywhere, the
//! answers lose together. A part with a skin is such a case, max(p, min(g, -(p + s))) for the
//! distance p: it is the lattice g where the inner side of the minimum loses, as -(p + s) > g, and
//! then that of the maximum, as p < g.
//!
//! From the operand of the extremum to the oracle lead sums and differences with uniform values,
//! opposites, and products and quotients with positive constants, all of them monotone as they are
//! computed. They are undone in turn. Each step is off by a rounding, in units of its operands, and
//! each time the number is moved away by many times that, so that a value beyond it loses strictly.

use super::tape::{Op, Operations, Position};
use crate::expr::{Binary, Extremum, Interest, Unary};

/// By how much more than the rounding errors of a step the number is moved, in units of the
/// operands.
const SLACK: f64 = 1.0 / (1_u64 << 46) as f64;
/// The same where operands vanish: more than underflow.
const TINY: f64 = 1e-280;

/// A step from an operation to the operand on the way to the oracle, undone on a number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Undo<U> {
    /// Of the sum with a uniform value.
    Subtract(U),
    /// Of the difference from a uniform value.
    Add(U),
    /// Of a uniform value less the operand.
    From(U),
    /// Of the opposite.
    Negate,
    /// Of the product with a positive constant.
    Divide(f64),
    /// Of the quotient by a positive constant.
    Multiply(f64),
}

/// An extremum whose side with the oracle loses against the other: `U` tells where uniform values
/// are, `O` where the other side is.
#[derive(Clone, Debug, PartialEq)]
struct Condition<U, O> {
    extremum: Extremum,
    other: O,
    undo: Vec<Undo<U>>,
    /// The activity bits without which the other side is not computed.
    needed: Vec<u32>,
}

/// What the value of an oracle loses against, all together.
#[derive(Clone, Debug)]
pub(super) struct Rival<U, O> {
    conditions: Vec<Condition<U, O>>,
}

/// Most conditions of a rival: they are computed for every batch.
const MOST_CONDITIONS: usize = 4;

/// What becomes of an operation where the oracle's answers are beyond the number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    /// The answers do not reach it.
    Apart,
    /// It equals that operation, which they do not reach.
    Equal(Position),
    /// It is something that they do not decide.
    Decided,
    /// They may show in it.
    Reached,
}

impl Reach {
    /// The operation that has the value of the one at `p`, of which this is the reach.
    const fn at_hand(self, p: Position) -> Option<Position> {
        match self {
            Self::Apart => Some(p),
            Self::Equal(other) => Some(other),
            Self::Decided | Self::Reached => None,
        }
    }
}

/// When the values of operations are there.
pub(super) trait Order {
    /// Whether the value at `other` is there when the oracle whose value is at `value` is asked.
    fn is_before(&self, other: Position, value: Position) -> bool;

    /// The activity bits without which it is not, where it is compared at the side `side` of the
    /// choice at `p`.
    fn needed(&self, other: Position, value: Position, at: (Position, usize)) -> Vec<u32>;
}

/// What all answers that the oracle gives for the point of its value at `value` lose against.
pub(super) fn rival(
    operations: &impl Operations,
    order: &impl Order,
    value: Position,
) -> Option<Rival<Position, Position>> {
    let Op::Oracle(oracle, _, point) = operations.op(value) else { return None };
    let mut reach = vec![Reach::Apart; operations.count()];
    let mut search = Search { operations, order, value, conditions: Vec::new() };
    for p in (0..operations.count()).map(Position::new) {
        // What is uniform may be no operation of these.
        let of = |p: Position| reach.get(p.index()).copied().unwrap_or(Reach::Apart);
        let op = operations.op(p);
        reach[p.index()] = match op {
            Op::Oracle(other, _, at) if other == oracle && at == point => Reach::Reached,
            Op::Binary(Binary::Min | Binary::Max, a, b) => {
                match search.choice(p, [a, b], [of(a), of(b)]) {
                    Choice::Either => together([a, b].map(of)),
                    Choice::Takes(_, other) => Reach::Equal(other),
                    Choice::Reached => Reach::Reached,
                }
            }
            Op::Pick(_, [a, b, c, d]) => match search.choice(p, [a, b], [of(a), of(b)]) {
                Choice::Either => together([a, b, c, d].map(of)),
                Choice::Takes(side, _) if of([c, d][side]) == Reach::Apart => {
                    Reach::Equal([c, d][side])
                }
                Choice::Takes(side, _) => of([c, d][side]),
                Choice::Reached => Reach::Reached,
            },
            Op::Coordinate(_)
            | Op::Constant(_)
            | Op::Parameter(_)
            | Op::Unary(..)
            | Op::Binary(..)
            | Op::Oracle(..) => together(op.operands().iter().map(|o| of(*o))),
        };
    }
    let conditions = search.conditions;
    let of = |p: Position| reach.get(p.index()).copied().unwrap_or(Reach::Apart);
    let shows = operations.outputs().any(|p| of(p) == Reach::Reached);
    (!shows && (1..=MOST_CONDITIONS).contains(&conditions.len())).then_some(Rival { conditions })
}

/// The reach of what is made from values of these reaches.
fn together(reaches: impl IntoIterator<Item = Reach>) -> Reach {
    let join = |all: Reach, one: Reach| match (all, one) {
        (Reach::Reached, _) | (_, Reach::Reached) => Reach::Reached,
        (Reach::Apart, Reach::Apart) => Reach::Apart,
        (Reach::Equal(_) | Reach::Decided, _) | (_, Reach::Equal(_) | Reach::Decided) => {
            Reach::Decided
        }
    };
    reaches.into_iter().fold(Reach::Apart, join)
}

/// What an extremum takes where the answers are beyond the number.
#[derive(Clone, Copy, Debug)]
enum Choice {
    /// What it would take in any case.
    Either,
    /// That side, 0 or 1, which equals the operation at that position.
    Takes(usize, Position),
    /// The answers may decide.
    Reached,
}

/// The search for what the answers of the oracle whose value is at `value` lose against.
struct Search<'a, O, T> {
    operations: &'a O,
    order: &'a T,
    value: Position,
    conditions: Vec<Condition<Position, Position>>,
}

impl<O: Operations, T: Order> Search<'_, O, T> {
    /// What the choice at `p` between `sides` takes, of which `reach` is known; notes the condition
    /// for that.
    fn choice(&mut self, p: Position, sides: [Position; 2], reach: [Reach; 2]) -> Choice {
        let own = match reach.map(|reach| reach == Reach::Reached) {
            [false, false] => return Choice::Either,
            [true, true] => return Choice::Reached,
            [true, false] => 0,
            [false, true] => 1,
        };
        let Self { operations, order, value, conditions } = self;
        let winner = 1 - own;
        let known = reach[winner].at_hand(sides[winner]);
        let other = known.filter(|other| order.is_before(*other, *value));
        let undo = way(*operations, sides[own], *value);
        let (Some((extremum, ..)), Some(other), Some(undo)) =
            (operations.op(p).choice(), other, undo)
        else {
            return Choice::Reached;
        };
        let needed = order.needed(other, *value, (p, winner));
        let condition = Condition { extremum, other, undo, needed };
        if !conditions.contains(&condition) {
            conditions.push(condition);
        }
        Choice::Takes(winner, other)
    }
}

/// The steps from the operation at `from` to the oracle at `to`, if there are no others.
fn way(operations: &impl Operations, from: Position, to: Position) -> Option<Vec<Undo<Position>>> {
    let is_uniform = |p: Position| operations.is_uniform(p);
    let factor = |p: Position| match operations.op(p) {
        Op::Constant(bits) => Some(f64::from_bits(bits)).filter(|c| c.is_normal() && *c > 0.0),
        Op::Coordinate(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..)
        | Op::Oracle(..) => None,
    };
    let (mut at, mut steps) = (from, Vec::new());
    while at != to {
        let (next, step) = match operations.op(at) {
            Op::Unary(Unary::Neg, a) => (a, Undo::Negate),
            Op::Binary(Binary::Add, a, b) if is_uniform(b) => (a, Undo::Subtract(b)),
            Op::Binary(Binary::Add, a, b) if is_uniform(a) => (b, Undo::Subtract(a)),
            Op::Binary(Binary::Sub, a, b) if is_uniform(b) => (a, Undo::Add(b)),
            Op::Binary(Binary::Sub, a, b) if is_uniform(a) => (b, Undo::From(a)),
            Op::Binary(Binary::Mul, a, b) => match (factor(a), factor(b)) {
                (_, Some(c)) => (a, Undo::Divide(c)),
                (Some(c), None) => (b, Undo::Divide(c)),
                (None, None) => return None,
            },
            Op::Binary(Binary::Div, a, b) => (a, Undo::Multiply(factor(b)?)),
            Op::Coordinate(_)
            | Op::Constant(_)
            | Op::Parameter(_)
            | Op::Unary(..)
            | Op::Binary(..)
            | Op::Pick(..)
            | Op::Oracle(..) => return None,
        };
        steps.push(step);
        at = next;
    }
    Some(steps)
}

impl Rival<Position, Position> {
    /// The same with the places of uniform values and of others in the place of positions.
    pub(super) fn at<U, O>(
        &self,
        uniform: impl Fn(Position) -> U,
        mut other: impl FnMut(Position) -> O,
    ) -> Rival<U, O> {
        let step = |step: &Undo<Position>| match *step {
            Undo::Subtract(p) => Undo::Subtract(uniform(p)),
            Undo::Add(p) => Undo::Add(uniform(p)),
            Undo::From(p) => Undo::From(uniform(p)),
            Undo::Negate => Undo::Negate,
            Undo::Divide(c) => Undo::Divide(c),
            Undo::Multiply(c) => Undo::Multiply(c),
        };
        let condition = |condition: &Condition<Position, Position>| Condition {
            extremum: condition.extremum,
            other: other(condition.other),
            undo: condition.undo.iter().map(step).collect(),
            needed: condition.needed.clone(),
        };
        Rival { conditions: self.conditions.iter().map(condition).collect() }
    }
}

/// Where values are passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beyond {
    /// Where they are less.
    Less,
    /// Where they are greater.
    Greater,
}

impl Beyond {
    const fn flipped(self) -> Self {
        match self {
            Self::Less => Self::Greater,
            Self::Greater => Self::Less,
        }
    }

    /// The number beyond which a value is beyond both; NaN, which none is beyond, if one of them is.
    fn farther(self, a: f64, b: f64) -> f64 {
        let is_first = match self {
            Self::Less => a < b,
            Self::Greater => a > b,
        };
        if a.is_nan() || is_first { a } else { b }
    }

    /// `number`, the result of a step on it and `other`, moved to the safe side.
    fn moved(self, number: f64, other: f64) -> f64 {
        let error = SLACK * (number.abs() + other.abs()) + TINY;
        match self {
            Self::Less => number - error,
            Self::Greater => number + error,
        }
    }
}

/// The values of an engine, where it is about to ask an oracle.
pub(super) trait Values<U, O> {
    /// Whether an activity bit is set.
    fn is_active(&self, bit: u32) -> bool;

    /// A uniform value.
    fn uniform(&self, place: U) -> f64;

    /// Writes other values, one a lane, to `out`.
    fn others(&self, place: O, out: &mut [f64]);
}

impl<U: Copy, O: Copy> Rival<U, O> {
    /// Calls `ask` with what of the oracle's values counts, `None` where all do; `room` has as many
    /// lanes as are asked for.
    pub(super) fn with_interest<R>(
        &self,
        values: &impl Values<U, O>,
        room: [&mut [f64]; 2],
        ask: impl FnOnce(Option<Interest<'_>>) -> R,
    ) -> R {
        let [all, own] = room;
        let mut joint = None;
        for condition in &self.conditions {
            if !condition.needed.iter().all(|bit| values.is_active(*bit)) {
                return ask(None);
            }
            let beyond = condition.number(values, own);
            match joint.replace(beyond) {
                None => all.copy_from_slice(own),
                Some(same) if same == beyond => {
                    for (number, own) in all.iter_mut().zip(&*own) {
                        *number = beyond.farther(*number, *own);
                    }
                }
                Some(_) => return ask(None),
            }
        }
        ask(joint.map(|beyond| match beyond {
            Beyond::Less => Interest::From(all),
            Beyond::Greater => Interest::UpTo(all),
        }))
    }
}

impl<U: Copy, O: Copy> Condition<U, O> {
    /// Writes the number beyond which a value loses in each lane, and returns on which side of it.
    fn number(&self, values: &impl Values<U, O>, numbers: &mut [f64]) -> Beyond {
        values.others(self.other, numbers);
        let mut beyond = match self.extremum {
            Extremum::Max => Beyond::Less,
            Extremum::Min => Beyond::Greater,
        };
        numbers.iter_mut().for_each(|number| *number = beyond.moved(*number, 0.0));
        for step in &self.undo {
            let mut each = |beyond: Beyond, other: f64, undo: &dyn Fn(f64) -> f64| {
                for number in numbers.iter_mut() {
                    *number = beyond.moved(undo(*number), other);
                }
            };
            match *step {
                Undo::Subtract(u) => {
                    let u = values.uniform(u);
                    each(beyond, u, &|number| number - u);
                }
                Undo::Add(u) => {
                    let u = values.uniform(u);
                    each(beyond, u, &|number| number + u);
                }
                Undo::From(u) => {
                    let u = values.uniform(u);
                    beyond = beyond.flipped();
                    each(beyond, u, &|number| u - number);
                }
                Undo::Negate => {
                    beyond = beyond.flipped();
                    each(beyond, 0.0, &|number| -number);
                }
                Undo::Divide(c) => each(beyond, 0.0, &|number| number / c),
                Undo::Multiply(c) => each(beyond, 0.0, &|number| number * c),
            }
        }
        beyond
    }
}
