//! Interval versions of the operators that IEEE 754 rounds to nearest.
//!
//! Nothing widens here: the scalar operations are monotone in each operand, rounding included.

use super::{Interval, greater, lesser};
use std::ops::{Add, Div, Mul, Neg, Sub};

impl Neg for Interval {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo, nan: self.nan }
    }
}

impl Add for Interval {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let opposed = ((self.hi == f64::INFINITY) & (other.lo == f64::NEG_INFINITY))
            | ((self.lo == f64::NEG_INFINITY) & (other.hi == f64::INFINITY));
        let (lo, hi) = (self.lo + other.lo, self.hi + other.hi);
        Self {
            lo: if lo.is_nan() { f64::NEG_INFINITY } else { lo },
            hi: if hi.is_nan() { f64::INFINITY } else { hi },
            nan: self.nan | other.nan | opposed,
        }
    }
}

impl Sub for Interval {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;

    /// Use [`Interval::square`] for the product of a value with itself.
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let undefined = (self.holds_zero() & other.reaches_infinity())
            | (self.reaches_infinity() & other.holds_zero());
        around([self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi])
            .or_nan(self.nan | other.nan | undefined)
    }
}

impl Div for Interval {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let undefined = (self.holds_zero() & other.holds_zero())
            | (self.reaches_infinity() & other.reaches_infinity());
        let nan = self.nan | other.nan | undefined;
        if other.holds_zero() {
            return Self { nan, ..Self::ANYTHING };
        }
        around([self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi])
            .or_nan(nan)
    }
}

/// The hull of four results at the ends of the operands.
///
/// A result that is NaN stands for zero: of zero times infinity or of infinity by infinity, the
/// numbers nearby that are not seen at the other ends are zeros.
#[inline(always)]
fn around(ends: [f64; 4]) -> Interval {
    let [a, b, c, d] = ends.map(|end| if end.is_nan() { 0.0 } else { end });
    Interval {
        lo: lesser(lesser(a, b), lesser(c, d)),
        hi: greater(greater(a, b), greater(c, d)),
        nan: false,
    }
}

impl Interval {
    /// `a * a` for each `a`.
    #[must_use]
    #[inline(always)]
    pub fn square(self) -> Self {
        let Self { lo, hi, nan } = self.abs();
        Self { lo: lo * lo, hi: hi * hi, nan }
    }

    /// `|a|` for each `a`.
    #[must_use]
    #[inline(always)]
    pub fn abs(self) -> Self {
        let Self { lo, hi, nan } = self;
        Self { lo: greater(greater(lo, -hi), 0.0), hi: greater(hi, -lo), nan }
    }

    /// -1, 0 or 1 for each value.
    #[must_use]
    #[inline(always)]
    pub fn sign(self) -> Self {
        let sign = |a: f64| f64::from(i8::from(a > 0.0) - i8::from(a < 0.0));
        self.increasing(sign)
    }

    /// The square root of each value; NaN below zero.
    #[must_use]
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        if self.hi < 0.0 {
            return Self::UNDEFINED;
        }
        let nan = self.nan | (self.lo < 0.0);
        Self { lo: greater(self.lo, 0.0).sqrt(), hi: self.hi.sqrt(), nan }
    }

    /// The greatest integer up to each value.
    #[must_use]
    #[inline(always)]
    pub fn floor(self) -> Self {
        self.increasing(f64::floor)
    }

    /// The least integer from each value on.
    #[must_use]
    #[inline(always)]
    pub fn ceil(self) -> Self {
        self.increasing(f64::ceil)
    }

    /// The integer next to each value, ties to the even one.
    #[must_use]
    #[inline(always)]
    pub fn round(self) -> Self {
        self.increasing(f64::round_ties_even)
    }

    /// `a < b ? a : b`: `b` where `a` is NaN.
    #[must_use]
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        let hi = if self.nan { other.hi } else { lesser(self.hi, other.hi) };
        Self { lo: lesser(self.lo, other.lo), hi, nan: other.nan }
    }

    /// `b < a ? a : b`: `b` where `a` is NaN.
    #[must_use]
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        let lo = if self.nan { other.lo } else { greater(self.lo, other.lo) };
        Self { lo, hi: greater(self.hi, other.hi), nan: other.nan }
    }

    /// `a - b * floor(a / b)`.
    ///
    /// Tight where the quotient's floor is one integer; else it still knows that the result lies
    /// between zero and `b`, but for rounding.
    #[must_use]
    #[inline(always)]
    pub fn modulo(self, other: Self) -> Self {
        let quotient = self / other;
        let natural = self - other * quotient.floor();
        // With q = a / b off by half an ulp, b * floor(q) and the difference by another each, the
        // result leaves [0, b] by at most 2^-51 |b| (|q| + 1).
        let steps = quotient.lo.abs().max(quotient.hi.abs()) + 1.0;
        let widest = other.lo.abs().max(other.hi.abs());
        let slack = widest * steps * 4.0 * f64::EPSILON + f64::MIN_POSITIVE;
        if other.holds_zero() || !slack.is_finite() {
            return natural;
        }
        natural.intersection(Self {
            lo: other.lo.min(0.0) - slack,
            hi: other.hi.max(0.0) + slack,
            nan: natural.nan,
        })
    }

    /// `f` of each value, where `f` never falls.
    #[inline(always)]
    fn increasing(self, f: impl Fn(f64) -> f64) -> Self {
        Self { lo: f(self.lo), hi: f(self.hi), nan: self.nan }
    }
}
