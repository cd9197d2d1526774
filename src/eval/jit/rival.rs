//! What the values of an oracle lose against.
//!
//! An oracle on one side of an extremum is dear, and in a part filled with a lattice most points of
//! the lattice's surface are deep inside of the part: there the value at the other side decides
//! whatever the oracle would say. All outputs of the oracle that belong to the region of the side
//! ([`crate::eval::regions`]) are looked at where the side is taken, and nowhere else. So a number
//! is found, from the value of the other side, such that the side is not taken where the oracle's
//! value is beyond it; the oracle may pass over those values
//! ([`points_for`](crate::expr::Oracle::points_for)).
//!
//! From the operand of the extremum to the oracle lead sums and differences with uniform values,
//! opposites, and products and quotients with positive constants, all of them monotone as they are
//! computed. They are undone in turn. Each step is off by a rounding, in units of its operands, and
//! each time the number is moved away by many times that, so that a value beyond it loses strictly.

use super::call::Arguments;
use super::calls::{Operand, PLANE};
use crate::eval::regions::RegionId;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position};
use crate::expr::{Binary, Extremum, Interest, Output, Unary};
use rustc_hash::FxHashMap;

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

/// What the value of an oracle is compared with: `U` tells where uniform values are, `O` where the
/// other side is.
#[derive(Clone, Debug)]
pub(super) struct Rival<U, O> {
    extremum: Extremum,
    other: O,
    undo: Vec<Undo<U>>,
}

/// The rivals of oracle values, by position, of which all outputs of the oracle in that region are
/// the losers together.
pub(super) fn rivals(schedule: &Schedule) -> FxHashMap<Position, Rival<Position, Position>> {
    let (tape, regions) = (schedule.tape(), schedule.regions());
    let mut sides: FxHashMap<RegionId, (Extremum, [Position; 2])> = FxHashMap::default();
    for p in tape.positions() {
        let Some((extremum, a, b)) = tape.op(p).choice() else { continue };
        let Some([first, second]) = regions.sides(p) else { continue };
        sides.extend(first.map(|region| (region, (extremum, [a, b]))));
        sides.extend(second.map(|region| (region, (extremum, [b, a]))));
    }
    let mut rivals = FxHashMap::default();
    for p in tape.positions() {
        if let Op::Oracle(_, Output::Value, _) = tape.op(p)
            && let Some(&(extremum, [own, other])) = sides.get(&regions.of(p))
            && other < p
            && let Some(undo) = way(schedule, own, p)
        {
            rivals.insert(p, Rival { extremum, other, undo });
        }
    }
    rivals
}

/// The steps from the operation at `from` to the oracle at `to`, if there are no others.
fn way(schedule: &Schedule, from: Position, to: Position) -> Option<Vec<Undo<Position>>> {
    let tape = schedule.tape();
    let is_uniform = |p: Position| tape.axes(p).is_empty();
    let factor = |p: Position| match tape.op(p) {
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
        let (next, step) = match tape.op(at) {
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
    /// The same with operands in the place of positions.
    pub(super) fn with(&self, operand: impl Fn(Position) -> Operand) -> Rival<Operand, Operand> {
        let step = |step: &Undo<Position>| match *step {
            Undo::Subtract(p) => Undo::Subtract(operand(p)),
            Undo::Add(p) => Undo::Add(operand(p)),
            Undo::From(p) => Undo::From(operand(p)),
            Undo::Negate => Undo::Negate,
            Undo::Divide(c) => Undo::Divide(c),
            Undo::Multiply(c) => Undo::Multiply(c),
        };
        Rival {
            extremum: self.extremum,
            other: operand(self.other),
            undo: self.undo.iter().map(step).collect(),
        }
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

    /// `number`, the result of a step on it and `other`, moved to the safe side.
    fn moved(self, number: f64, other: f64) -> f64 {
        let error = SLACK * (number.abs() + other.abs()) + TINY;
        match self {
            Self::Less => number - error,
            Self::Greater => number + error,
        }
    }
}

impl Rival<Operand, Operand> {
    /// Calls `ask` with what of the oracle's values in plane `plane` counts; `numbers` has the
    /// lanes that are asked for.
    pub(super) fn with_interest<R>(
        &self,
        arguments: &Arguments<'_>,
        plane: usize,
        lanes: usize,
        ask: impl FnOnce(Interest<'_>) -> R,
    ) -> R {
        let mut numbers = [0.0; PLANE];
        let numbers = &mut numbers[..lanes];
        self.other.spread_to(arguments, plane, numbers);
        let mut beyond = match self.extremum {
            Extremum::Max => Beyond::Less,
            Extremum::Min => Beyond::Greater,
        };
        let uniform = |operand: Operand| {
            let mut value = [0.0];
            operand.spread_to(arguments, plane, &mut value);
            value[0]
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
                    let u = uniform(u);
                    each(beyond, u, &|number| number - u);
                }
                Undo::Add(u) => {
                    let u = uniform(u);
                    each(beyond, u, &|number| number + u);
                }
                Undo::From(u) => {
                    let u = uniform(u);
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
        ask(match beyond {
            Beyond::Less => Interest::From(numbers),
            Beyond::Greater => Interest::UpTo(numbers),
        })
    }
}
