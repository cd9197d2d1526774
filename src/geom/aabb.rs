//! Axes and axis-aligned boxes.

use glam::DVec3;

/// One of the three coordinate axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

impl Axis {
    /// The axes in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Position of the axis in a coordinate triple, 0 to 2.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// A closed axis-aligned box, possibly unbounded; empty when `lo > hi` on some axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner of least coordinates; components may be minus infinity.
    pub lo: DVec3,
    /// Corner of greatest coordinates; components may be plus infinity.
    pub hi: DVec3,
}

impl Aabb {
    /// The box that contains nothing.
    pub const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };
    /// The box that contains everything.
    pub const WHOLE: Self = Self { lo: DVec3::NEG_INFINITY, hi: DVec3::INFINITY };

    /// The box with corners `lo` and `hi`.
    #[must_use]
    pub const fn new(lo: DVec3, hi: DVec3) -> Self {
        Self { lo, hi }
    }

    /// The least box that contains `points`.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |hull, p| Self::new(hull.lo.min(p), hull.hi.max(p)))
    }

    /// Side lengths; negative where the box is empty.
    #[must_use]
    pub fn size(self) -> DVec3 {
        self.hi - self.lo
    }

    /// The middle of the box.
    #[must_use]
    pub fn center(self) -> DVec3 {
        0.5 * (self.lo + self.hi)
    }

    /// Whether no point lies in the box.
    #[must_use]
    pub fn is_empty(self) -> bool {
        !self.lo.cmple(self.hi).all()
    }

    /// Whether every side is finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// The least box that contains both; an empty box adds nothing.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        if self.is_empty() {
            other
        } else if other.is_empty() {
            self
        } else {
            Self::new(self.lo.min(other.lo), self.hi.max(other.hi))
        }
    }

    /// The box of the points in both.
    #[must_use]
    pub fn overlap(self, other: Self) -> Self {
        Self::new(self.lo.max(other.lo), self.hi.min(other.hi))
    }

    /// The box with each side moved outward by `margin` (inward where negative).
    #[must_use]
    pub fn grown(self, margin: DVec3) -> Self {
        Self::new(self.lo - margin, self.hi + margin)
    }

    /// Whether `point` lies in the closed box.
    #[must_use]
    pub fn contains(self, point: DVec3) -> bool {
        point.cmpge(self.lo).all() && point.cmple(self.hi).all()
    }

    /// The eight corners; corner `c` takes `hi` on axis `a` where bit `a` of `c` is set.
    #[must_use]
    pub fn corners(self) -> [DVec3; 8] {
        std::array::from_fn(|c| {
            let pick = |a: usize| if c >> a & 1 == 1 { self.hi[a] } else { self.lo[a] };
            DVec3::new(pick(0), pick(1), pick(2))
        })
    }
}
