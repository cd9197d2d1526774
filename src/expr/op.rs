//! The closed list of operators, each with its arity, text name and canonical `f64` definition.
//!
//! [`Unary::apply`], [`Binary::apply`] and [`Extremum::picks_first`] are the specification: every
//! engine returns their bits, on every host. Arithmetic is never fused or reassociated, operands
//! of [`Binary::Min`] and [`Binary::Max`] are never exchanged.

use super::{NodeId, OracleId, ParameterId};
use crate::geom::Axis;
use crate::num::elementary;

/// A node of an expression graph; operands are earlier nodes of the same graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A coordinate of the point.
    Coordinate(Axis),
    /// A constant, by its bits: `-0.0` and `0.0` differ, every NaN pattern is its own constant.
    Constant(u64),
    /// A named value that programs read when they run.
    Parameter(ParameterId),
    /// An operator of one operand.
    Unary(Unary, NodeId),
    /// An operator of two operands.
    Binary(Binary, NodeId, NodeId),
    /// `Pick(e, [a, b, c, d])` is `c` where the extremum `e` of `a` and `b` takes `a`, else `d`.
    ///
    /// The derivative of an extremum; it shares the extremum's choice, so it is pruned with it.
    Pick(Extremum, [NodeId; 4]),
    /// An output of an oracle at the point whose coordinates are the three operands.
    Oracle(OracleId, Output, [NodeId; 3]),
}

/// What an oracle yields at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Output {
    /// The value.
    Value,
    /// The partial derivative along an axis of the oracle's own coordinates.
    Partial(Axis),
}

impl Output {
    /// Its place among the value and the three partial derivatives.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::Value => 0,
            Self::Partial(axis) => 1 + axis.index(),
        }
    }
}

/// Which of two values an extremum takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Extremum {
    /// The lesser.
    Min,
    /// The greater.
    Max,
}

impl Extremum {
    /// Whether the extremum of `a` and `b` is `a`: `a < b` for the minimum, `b < a` for the maximum.
    ///
    /// Ties and NaN take `b`.
    #[must_use]
    #[inline]
    pub fn picks_first(self, a: f64, b: f64) -> bool {
        match self {
            Self::Min => a < b,
            Self::Max => b < a,
        }
    }

    /// The value that never wins against a number: `+inf` for the minimum, `-inf` for the maximum.
    #[must_use]
    pub const fn loser(self) -> f64 {
        match self {
            Self::Min => f64::INFINITY,
            Self::Max => f64::NEG_INFINITY,
        }
    }

    /// The binary operator of this extremum.
    #[must_use]
    pub const fn operator(self) -> Binary {
        match self {
            Self::Min => Binary::Min,
            Self::Max => Binary::Max,
        }
    }
}

/// Operators of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are the functions'; `apply` defines each")]
pub enum Unary {
    Neg,
    Abs,
    Sign,
    Sqrt,
    Cbrt,
    Floor,
    Ceil,
    Round,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Log,
    Log10,
}

impl Unary {
    /// Every operator.
    pub const ALL: [Self; 20] = [
        Self::Neg,
        Self::Abs,
        Self::Sign,
        Self::Sqrt,
        Self::Cbrt,
        Self::Floor,
        Self::Ceil,
        Self::Round,
        Self::Sin,
        Self::Cos,
        Self::Tan,
        Self::Asin,
        Self::Acos,
        Self::Atan,
        Self::Sinh,
        Self::Cosh,
        Self::Tanh,
        Self::Exp,
        Self::Log,
        Self::Log10,
    ];

    /// The name in program text.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Neg => "neg",
            Self::Abs => "abs",
            Self::Sign => "sign",
            Self::Sqrt => "sqrt",
            Self::Cbrt => "cbrt",
            Self::Floor => "floor",
            Self::Ceil => "ceil",
            Self::Round => "round",
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Asin => "asin",
            Self::Acos => "acos",
            Self::Atan => "atan",
            Self::Sinh => "sinh",
            Self::Cosh => "cosh",
            Self::Tanh => "tanh",
            Self::Exp => "exp",
            Self::Log => "log",
            Self::Log10 => "log10",
        }
    }

    /// The canonical value at `a`.
    ///
    /// `sign` is -1, 0 or 1, and NaN at NaN; `round` takes ties to the even neighbour.
    #[must_use]
    #[inline]
    pub fn apply(self, a: f64) -> f64 {
        match self {
            Self::Neg => -a,
            Self::Abs => a.abs(),
            Self::Sign => {
                if a > 0.0 {
                    1.0
                } else if a < 0.0 {
                    -1.0
                } else if a.is_nan() {
                    a
                } else {
                    0.0
                }
            }
            Self::Sqrt => a.sqrt(),
            Self::Cbrt => libm::cbrt(a),
            Self::Floor => a.floor(),
            Self::Ceil => a.ceil(),
            Self::Round => a.round_ties_even(),
            Self::Sin => elementary::sin(a),
            Self::Cos => elementary::cos(a),
            Self::Tan => libm::tan(a),
            Self::Asin => libm::asin(a),
            Self::Acos => libm::acos(a),
            Self::Atan => libm::atan(a),
            Self::Sinh => libm::sinh(a),
            Self::Cosh => libm::cosh(a),
            Self::Tanh => libm::tanh(a),
            Self::Exp => elementary::exp(a),
            Self::Log => elementary::log(a),
            Self::Log10 => libm::log10(a),
        }
    }
}

/// Operators of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are the functions'; `apply` defines each")]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Min,
    Max,
    Mod,
    Pow,
    Atan2,
    Hypot,
}

impl Binary {
    /// Every operator.
    pub const ALL: [Self; 10] = [
        Self::Add,
        Self::Sub,
        Self::Mul,
        Self::Div,
        Self::Min,
        Self::Max,
        Self::Mod,
        Self::Pow,
        Self::Atan2,
        Self::Hypot,
    ];

    /// The name in program text; the four arithmetic operators have symbols.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Add => "+",
            Self::Sub => "-",
            Self::Mul => "*",
            Self::Div => "/",
            Self::Min => "min",
            Self::Max => "max",
            Self::Mod => "mod",
            Self::Pow => "pow",
            Self::Atan2 => "atan2",
            Self::Hypot => "hypot",
        }
    }

    /// The canonical value at `a` and `b`.
    ///
    /// `mod` is `a - b * floor(a / b)`, with the sign of `b`; `min` and `max` take `b` on ties and
    /// NaN ([`Extremum::picks_first`]).
    #[must_use]
    #[inline]
    pub fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Sub => a - b,
            Self::Mul => a * b,
            Self::Div => a / b,
            Self::Min => {
                if a < b {
                    a
                } else {
                    b
                }
            }
            Self::Max => {
                if b < a {
                    a
                } else {
                    b
                }
            }
            Self::Mod => a - b * (a / b).floor(),
            Self::Pow => libm::pow(a, b),
            Self::Atan2 => libm::atan2(a, b),
            Self::Hypot => libm::hypot(a, b),
        }
    }

    /// The extremum that this operator takes, if it is `min` or `max`.
    #[must_use]
    pub const fn extremum(self) -> Option<Extremum> {
        match self {
            Self::Min => Some(Extremum::Min),
            Self::Max => Some(Extremum::Max),
            Self::Add
            | Self::Sub
            | Self::Mul
            | Self::Div
            | Self::Mod
            | Self::Pow
            | Self::Atan2
            | Self::Hypot => None,
        }
    }
}
