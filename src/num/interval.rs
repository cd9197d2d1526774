//! Enclosures of computed numbers.
//!
//! An [`Interval`] holds every value that the *computed* (rounded) operation can take for
//! arguments in the operand intervals, and says whether the result may be NaN. Round-to-nearest is
//! monotone, so evaluating an operation at the ends of its operands, in the association of the
//! scalar operation, already encloses its computed values; only elementary functions widen.

/// A closed interval `[lo, hi]` of extended real numbers, with a bit for "or NaN".
///
/// `lo <= hi` always. An operand that may be NaN makes every result that depends on it `nan`.
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

    /// The interval `[lo, hi]` without NaN.
    ///
    /// An end that is NaN, or ends out of order, give [`Interval::ANYTHING`].
    #[must_use]
    pub fn new(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi, nan: false } } else { Self::ANYTHING }
    }

    /// The interval that holds `value` alone; [`Interval::ANYTHING`] for NaN.
    #[must_use]
    pub fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// Whether every value is below zero: the box lies inside the solid.
    #[must_use]
    pub fn is_inside(self) -> bool {
        !self.nan && self.hi < 0.0
    }

    /// Whether no value is below zero: NaN counts as outside.
    #[must_use]
    pub fn is_outside(self) -> bool {
        self.lo >= 0.0
    }

    /// Whether `value` lies in the interval.
    #[must_use]
    pub fn contains(self, value: f64) -> bool {
        if value.is_nan() { self.nan } else { self.lo <= value && value <= self.hi }
    }
}
