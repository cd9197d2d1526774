//! Enclosures of computed numbers.
//!
//! An [`Interval`] holds every value that the *computed* (rounded) operation can take for
//! arguments in the operand intervals, and says whether the result may be NaN. Round-to-nearest is
//! monotone, so evaluating an operation at the ends of its operands, in the association of the
//! scalar operation, already encloses its computed values; only elementary functions widen.
//!
//! Both zeros are one number here: an interval that holds one holds the other, so a quotient by an
//! interval that ends at zero is unbounded on both sides.

mod arithmetic;
#[cfg(test)]
mod containment;
mod functions;

/// A closed interval `[lo, hi]` of extended real numbers, with a bit for "or NaN".
///
/// `lo <= hi` always. An operand that may be NaN makes a result `nan` unless the operation
/// discards it, as the minimum of NaN and a number does. What is NaN for certain has any ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end; may be minus infinity.
    pub lo: f64,
    /// Upper end; may be plus infinity.
    pub hi: f64,
    /// Whether the value may also be NaN.
    pub nan: bool,
}

impl Interval {
    /// Every value, NaN included.
    pub const ANYTHING: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY, nan: true };

    /// No number at all, only NaN; placed outside every solid.
    pub const UNDEFINED: Self = Self { lo: f64::INFINITY, hi: f64::INFINITY, nan: true };

    /// The interval `[lo, hi]` without NaN.
    ///
    /// An end that is NaN, or ends out of order, give [`Interval::ANYTHING`].
    #[must_use]
    #[inline]
    pub fn new(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi, nan: false } } else { Self::ANYTHING }
    }

    /// The interval that holds `value` alone; [`Interval::ANYTHING`] for NaN.
    #[must_use]
    #[inline]
    pub fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// The least interval that holds the values of both.
    #[must_use]
    #[inline(always)]
    pub fn hull(self, other: Self) -> Self {
        Self {
            lo: lesser(self.lo, other.lo),
            hi: greater(self.hi, other.hi),
            nan: self.nan | other.nan,
        }
    }

    /// What two enclosures of the same values agree on; the first where they share no number.
    #[must_use]
    #[inline(always)]
    pub fn intersection(self, other: Self) -> Self {
        let (lo, hi) = (greater(self.lo, other.lo), lesser(self.hi, other.hi));
        let nan = self.nan & other.nan;
        if lo <= hi { Self { lo, hi, nan } } else { Self { nan, ..self } }
    }

    /// Whether `a < b` for all values `a` of this and `b` of `other`: neither may be NaN.
    #[must_use]
    #[inline(always)]
    pub fn always_below(self, other: Self) -> bool {
        self.hi < other.lo && !self.nan && !other.nan
    }

    /// Whether `a < b` for no values `a` of this and `b` of `other`, NaN included.
    #[must_use]
    #[inline(always)]
    pub fn never_below(self, other: Self) -> bool {
        self.lo >= other.hi
    }

    /// `then` where this is below `other`, else `otherwise`: the choice made by a minimum.
    #[must_use]
    #[inline(always)]
    pub fn pick_below(self, other: Self, then: Self, otherwise: Self) -> Self {
        if self.always_below(other) {
            then
        } else if self.never_below(other) {
            otherwise
        } else {
            then.hull(otherwise)
        }
    }

    /// The same numbers, and NaN if `nan`.
    #[must_use]
    #[inline(always)]
    pub(crate) fn or_nan(self, nan: bool) -> Self {
        Self { nan: self.nan | nan, ..self }
    }

    /// Whether an end is infinite.
    #[inline(always)]
    fn reaches_infinity(self) -> bool {
        (self.lo == f64::NEG_INFINITY) | (self.hi == f64::INFINITY)
    }

    /// Whether zero lies in the interval.
    #[inline(always)]
    fn holds_zero(self) -> bool {
        (self.lo <= 0.0) & (self.hi >= 0.0)
    }

    /// Whether every value is below zero: the box lies inside the solid.
    #[must_use]
    #[inline]
    pub fn is_inside(self) -> bool {
        !self.nan && self.hi < 0.0
    }

    /// Whether no value is below zero: NaN counts as outside.
    #[must_use]
    #[inline]
    pub fn is_outside(self) -> bool {
        self.lo >= 0.0
    }

    /// Whether `value` lies in the interval.
    #[must_use]
    #[inline]
    pub fn contains(self, value: f64) -> bool {
        if value.is_nan() { self.nan } else { self.lo <= value && value <= self.hi }
    }
}

/// The lesser of two numbers, neither NaN: one instruction, unlike [`f64::min`].
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers, neither NaN.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
