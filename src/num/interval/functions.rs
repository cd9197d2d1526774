//! Interval versions of the elementary functions.
//!
//! A function that is off by at most e ulp and whose exact value rises is, when computed, no lower
//! than its value at the lower end less 2 e ulp: one e for each of the two. So ends widen by twice
//! the bound of the scalar function: 2 ulp for [`elementary`], 4 ulp for `libm`, whose largest
//! error in tests is below 2.5 ulp.

use super::{Interval, greater, lesser};
use crate::num::elementary;
use std::f64::consts::PI;

/// Twice the error bound of [`elementary`], in ulp.
const OURS: f64 = 4.0;

/// Twice the error bound of `libm`, in ulp.
const LIBM: f64 = 8.0;

/// The least positive number: the last place of every subnormal.
const TINY: f64 = 5e-324;

/// Angles up to this magnitude are assigned to quadrants; beyond, sines are between -1 and 1.
const QUADRANT_LIMIT: f64 = 1_048_576.0;

/// More than the error of an angle in turns: 2^20 / π half-turns times 2^-51 is below 2^-32.
const TURN_SLACK: f64 = 1.0 / 4_294_967_296.0;

impl Interval {
    /// The sine of each value.
    #[must_use]
    #[inline]
    pub fn sin(self) -> Self {
        self.sin_between(elementary::sin(self.lo), elementary::sin(self.hi))
    }

    /// The cosine of each value.
    #[must_use]
    #[inline]
    pub fn cos(self) -> Self {
        self.cos_between(elementary::cos(self.lo), elementary::cos(self.hi))
    }

    /// [`Interval::sin`], given the computed sines of its ends, as lanes or a table have them.
    #[must_use]
    #[inline(always)]
    pub fn sin_between(self, at_lo: f64, at_hi: f64) -> Self {
        // Crests lie a quarter of a turn after the whole turns, troughs a quarter before.
        self.wave(at_lo, at_hi, 0.25)
    }

    /// [`Interval::cos`], given the computed cosines of its ends.
    #[must_use]
    #[inline(always)]
    pub fn cos_between(self, at_lo: f64, at_hi: f64) -> Self {
        self.wave(at_lo, at_hi, 0.0)
    }

    /// A wave of period 2π with crests at `crest` turns and troughs half a turn from them.
    #[inline(always)]
    fn wave(self, at_lo: f64, at_hi: f64, crest: f64) -> Self {
        let nan = self.nan | self.reaches_infinity();
        if !(self.lo >= -QUADRANT_LIMIT && self.hi <= QUADRANT_LIMIT) {
            return Self { lo: -1.0, hi: 1.0, nan };
        }
        let (from, to) = (self.lo * (0.5 / PI) - crest, self.hi * (0.5 / PI) - crest);
        // A crest seen by mistake lies so close to an end that the wave rounds to 1 there.
        let crests = holds_integer(from, to);
        let troughs = holds_integer(from - 0.5, to - 0.5);
        let (least, greatest) = (lesser(at_lo, at_hi), greater(at_lo, at_hi));
        let lo = if troughs { -1.0 } else { greater(below(least, OURS), -1.0) };
        let hi = if crests { 1.0 } else { lesser(above(greatest, OURS), 1.0) };
        Self { lo, hi, nan }.with_signs(!troughs && least >= 0.0, !crests && greatest <= 0.0)
    }

    /// The tangent of each value.
    #[must_use]
    #[inline]
    pub fn tan(self) -> Self {
        let nan = self.nan | self.reaches_infinity();
        let near = self.lo >= -QUADRANT_LIMIT && self.hi <= QUADRANT_LIMIT;
        if !near || holds_integer(self.lo / PI - 0.5, self.hi / PI - 0.5) {
            return Self { nan, ..Self::ANYTHING };
        }
        let (lo, hi) = (libm::tan(self.lo), libm::tan(self.hi));
        Self { lo: below(lo, LIBM), hi: above(hi, LIBM), nan }.with_signs(lo >= 0.0, hi <= 0.0)
    }

    /// The arc sine of each value; NaN beyond ±1.
    #[must_use]
    #[inline]
    pub fn asin(self) -> Self {
        self.within_one().map_or(Self::UNDEFINED, |a| a.odd(libm::asin))
    }

    /// The arc cosine of each value; NaN beyond ±1.
    #[must_use]
    #[inline]
    pub fn acos(self) -> Self {
        self.within_one().map_or(Self::UNDEFINED, |Self { lo, hi, nan }| Self {
            lo: below(libm::acos(hi), LIBM).max(0.0),
            hi: above(libm::acos(lo), LIBM),
            nan,
        })
    }

    /// The values in [-1, 1], NaN standing for the others; `None` if there are none.
    #[inline]
    fn within_one(self) -> Option<Self> {
        let Self { lo, hi, nan } = self;
        let outside = lo < -1.0 || hi > 1.0;
        (lo <= 1.0 && hi >= -1.0).then(|| Self {
            lo: lo.max(-1.0),
            hi: hi.min(1.0),
            nan: nan | outside,
        })
    }

    /// The arc tangent of each value.
    #[must_use]
    #[inline]
    pub fn atan(self) -> Self {
        self.odd(libm::atan)
    }

    /// The cube root of each value.
    #[must_use]
    #[inline]
    pub fn cbrt(self) -> Self {
        self.odd(libm::cbrt)
    }

    /// The hyperbolic sine of each value.
    #[must_use]
    #[inline]
    pub fn sinh(self) -> Self {
        self.odd(libm::sinh)
    }

    /// The hyperbolic cosine of each value.
    #[must_use]
    #[inline]
    pub fn cosh(self) -> Self {
        let Self { lo, hi, nan } = self.abs();
        Self { lo: below(libm::cosh(lo), LIBM).max(1.0), hi: above(libm::cosh(hi), LIBM), nan }
    }

    /// The hyperbolic tangent of each value.
    #[must_use]
    #[inline]
    pub fn tanh(self) -> Self {
        let Self { lo, hi, nan } = self.odd(libm::tanh);
        Self { lo: lo.max(-1.0), hi: hi.min(1.0), nan }
    }

    /// e to the power of each value.
    #[must_use]
    #[inline]
    pub fn exp(self) -> Self {
        Self {
            lo: below(elementary::exp(self.lo), OURS).max(0.0),
            hi: above(elementary::exp(self.hi), OURS),
            nan: self.nan,
        }
    }

    /// The natural logarithm of each value; NaN below zero.
    #[must_use]
    #[inline]
    pub fn log(self) -> Self {
        self.logarithm(elementary::log, OURS)
    }

    /// The decimal logarithm of each value; NaN below zero.
    #[must_use]
    #[inline]
    pub fn log10(self) -> Self {
        self.logarithm(libm::log10, LIBM)
    }

    #[inline]
    fn logarithm(self, f: impl Fn(f64) -> f64, ulps: f64) -> Self {
        if self.hi < 0.0 {
            return Self::UNDEFINED;
        }
        let nan = self.nan | (self.lo < 0.0);
        let mut result =
            Self { lo: below(f(self.lo.max(0.0)), ulps), hi: above(f(self.hi), ulps), nan };
        // The logarithm of 1 is exactly 0, and computed ones have the right sign.
        if self.lo >= 1.0 {
            result.lo = result.lo.max(0.0);
        }
        if self.hi <= 1.0 {
            result.hi = result.hi.min(0.0);
        }
        result
    }

    /// `a` to the power of `b`.
    ///
    /// Tight for positive bases and for constant exponents; a base that may be negative under an
    /// exponent that varies gives anything.
    #[must_use]
    #[inline]
    pub fn pow(self, exponent: Self) -> Self {
        let nan = self.nan | exponent.nan;
        let n = exponent.lo;
        if n == exponent.hi && n.is_finite() && n.fract() == 0.0 {
            return self.integer_power(n).or_nan(nan);
        }
        if self.lo > 0.0 {
            return self.positive_power(exponent).or_nan(nan);
        }
        if self.lo == 0.0 {
            // Adding zero makes both ends positive: the powers of 0.0 are infinite or zero. Those
            // of -0.0 are, too, but odd negative ones are minus infinity.
            let positive = Self { lo: 0.0, hi: self.hi + 0.0, nan };
            let mut result = positive.positive_power(exponent).or_nan(nan);
            if exponent.lo <= -1.0 {
                result.lo = f64::NEG_INFINITY;
            }
            return result;
        }
        if n == exponent.hi && n.is_finite() {
            // A broken power of a negative number is NaN, but that of minus infinity is as that
            // of infinity.
            let hi = if self.lo == f64::NEG_INFINITY { f64::INFINITY } else { self.hi.max(0.0) };
            return Self::new(0.0, hi).positive_power(exponent).or_nan(true);
        }
        Self::ANYTHING
    }

    /// Powers of bases from zero on: extreme at the corners, as `b log(a)` is.
    #[inline]
    fn positive_power(self, exponent: Self) -> Self {
        let at = |a, b| libm::pow(a, b);
        let [a, b] = [exponent.lo, exponent.hi].map(|b| [at(self.lo, b), at(self.hi, b)]);
        let lo = a[0].min(a[1]).min(b[0].min(b[1]));
        let hi = a[0].max(a[1]).max(b[0].max(b[1]));
        Self { lo: below(lo, LIBM).max(0.0), hi: above(hi, LIBM), nan: false }
    }

    /// The power of a whole exponent `n`.
    #[inline]
    fn integer_power(self, n: f64) -> Self {
        let even = n % 2.0 == 0.0;
        let at = |a| libm::pow(a, n);
        let Self { lo, hi, nan } = if even { self.abs() } else { self };
        if n == 0.0 {
            return Self::point(1.0);
        }
        if n < 0.0 && lo <= 0.0 && hi >= 0.0 {
            // A pole: of one sign for even exponents.
            let least = if even { below(at(hi), LIBM).max(0.0) } else { f64::NEG_INFINITY };
            return Self { lo: least, hi: f64::INFINITY, nan };
        }
        let (low, high) = if n < 0.0 { (at(hi), at(lo)) } else { (at(lo), at(hi)) };
        let result = Self { lo: below(low, LIBM), hi: above(high, LIBM), nan };
        result.with_signs(lo >= 0.0, hi <= 0.0)
    }

    /// The angle of the point (`b`, `a`), where this is `a` and `x` is `b`.
    #[must_use]
    #[inline]
    pub fn atan2(self, x: Self) -> Self {
        let nan = self.nan | x.nan;
        if self.holds_zero() && x.lo <= 0.0 {
            // The cut: either zero may be there.
            return Self { lo: below(-PI, LIBM), hi: above(PI, LIBM), nan };
        }
        // A box beside the cut is seen from the origin between two of its corners.
        let [a, b] = [self.lo, self.hi].map(|y| [libm::atan2(y, x.lo), libm::atan2(y, x.hi)]);
        let lo = a[0].min(a[1]).min(b[0].min(b[1]));
        let hi = a[0].max(a[1]).max(b[0].max(b[1]));
        Self { lo: below(lo, LIBM), hi: above(hi, LIBM), nan }
            .with_signs(self.lo >= 0.0, self.hi <= 0.0)
    }

    /// The length of (`a`, `b`).
    #[must_use]
    #[inline]
    pub fn hypot(self, other: Self) -> Self {
        let (a, b) = (self.abs(), other.abs());
        Self {
            lo: below(libm::hypot(a.lo, b.lo), LIBM).max(0.0),
            hi: above(libm::hypot(a.hi, b.hi), LIBM),
            nan: self.nan | other.nan,
        }
    }

    /// `f` of each value, where `f` rises and has the sign of its argument.
    #[inline]
    fn odd(self, f: impl Fn(f64) -> f64) -> Self {
        Self { lo: below(f(self.lo), LIBM), hi: above(f(self.hi), LIBM), nan: self.nan }
            .with_signs(self.lo >= 0.0, self.hi <= 0.0)
    }

    /// Takes back widening across zero where no value is negative, or none positive.
    #[inline(always)]
    fn with_signs(self, no_negative: bool, no_positive: bool) -> Self {
        Self {
            lo: if no_negative { greater(self.lo, 0.0) } else { self.lo },
            hi: if no_positive { lesser(self.hi, 0.0) } else { self.hi },
            nan: self.nan,
        }
    }
}

/// Whether an integer may lie between `from` and `to`, each off by less than [`TURN_SLACK`].
#[inline(always)]
fn holds_integer(from: f64, to: f64) -> bool {
    (from - TURN_SLACK).ceil() <= to + TURN_SLACK
}

/// A number at least `ulps` units in the last place of `value` below it.
///
/// Below plus infinity come the largest numbers: a computed value may overflow where a greater
/// argument's does not.
#[inline(always)]
fn below(value: f64, ulps: f64) -> f64 {
    let value = lesser(value, f64::MAX);
    let step = lesser(value.abs(), f64::MAX) * (ulps * f64::EPSILON) + ulps * TINY;
    value - step
}

/// A number at least `ulps` units in the last place of `value` above it.
#[inline(always)]
fn above(value: f64, ulps: f64) -> f64 {
    -below(-value, ulps)
}
