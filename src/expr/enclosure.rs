//! The interval version of every operator.

use super::{Binary, Extremum, Unary};
use crate::num::Interval;

/// Encloses `op` of the values in `a`.
#[must_use]
#[inline]
pub fn unary(op: Unary, a: Interval) -> Interval {
    match op {
        Unary::Neg => -a,
        Unary::Abs => a.abs(),
        Unary::Sign => a.sign(),
        Unary::Sqrt => a.sqrt(),
        Unary::Cbrt => a.cbrt(),
        Unary::Floor => a.floor(),
        Unary::Ceil => a.ceil(),
        Unary::Round => a.round(),
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Tan => a.tan(),
        Unary::Asin => a.asin(),
        Unary::Acos => a.acos(),
        Unary::Atan => a.atan(),
        Unary::Sinh => a.sinh(),
        Unary::Cosh => a.cosh(),
        Unary::Tanh => a.tanh(),
        Unary::Exp => a.exp(),
        Unary::Log => a.log(),
        Unary::Log10 => a.log10(),
    }
}

/// Encloses `op` of the values in `a` and `b`, which vary on their own; the product of a value with
/// itself is [`Interval::square`].
#[must_use]
#[inline]
pub fn binary(op: Binary, a: Interval, b: Interval) -> Interval {
    match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::Min => a.min(b),
        Binary::Max => a.max(b),
        Binary::Mod => a.modulo(b),
        Binary::Pow => a.pow(b),
        Binary::Atan2 => a.atan2(b),
        Binary::Hypot => a.hypot(b),
    }
}

/// Encloses `c` or `d`, as the extremum of `a` and `b` decides.
#[must_use]
#[inline]
pub fn pick(extremum: Extremum, [a, b, c, d]: [Interval; 4]) -> Interval {
    match extremum {
        Extremum::Min => a.pick_below(b, c, d),
        Extremum::Max => b.pick_below(a, c, d),
    }
}

/// Which sides of the choice between `a` and `b` are dead: the other side is strictly ahead, and
/// neither operand may be NaN.
#[must_use]
#[inline]
pub fn dead_sides(extremum: Extremum, a: Interval, b: Interval) -> [bool; 2] {
    match extremum {
        Extremum::Min => [b.always_below(a), a.always_below(b)],
        Extremum::Max => [a.always_below(b), b.always_below(a)],
    }
}
