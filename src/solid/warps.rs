//! Where a solid can be when the numbers of its operations vary in space.
//!
//! A field f of box B and growth g keeps the promise that {f <= t} lies in B grown by g t. What a
//! varying number does to it follows from its range ([`Values::range`]) over all space, or from its
//! slopes where those are small enough:
//!
//! * **Dilation by o(x)**: {f <= o + t} lies in B grown by g times the supremum of o + t. With L the
//!   sum over the axes of g times the largest slope of o along them, o exceeds its supremum s over B
//!   by no more than L r at the distance r g from B. So r <= (s + t) / (1 - L) if L < 1: B grows by
//!   g s / (1 - L), and the growth becomes g / (1 - L).
//! * **Translation by o(x)**: x = m + o(x) with m in B. Let c be the middle of B, and L the matrix of
//!   the largest slopes of o. Then |x - c| <= |m - c| + |o(c)| + L |x - c| component by component, which
//!   bounds x if the powers of L vanish. A second look takes the range of o over the box so found.
//! * **Scaling by a(x)**: x = a(x) m with m in B: products of ranges; no bound if a may be zero.
//! * **Rotation by M(x)**: x = transposed(M) m. A column of M has length 1, so that a coordinate is no
//!   larger than the part of m that the column takes.
//!
//! What has no bound is unbounded, and blames the operation: the solid has to be intersected with a
//! bounded one, or its bounds to be given.

use super::extent::Extent;
use super::{Span, Values};
use crate::expr::NodeId;
use crate::geom::{Aabb, Axis};
use crate::num::Interval;
use glam::DVec3;

/// Steps after which slopes that bound nothing are given up.
const MOST_STEPS: usize = 200;

/// An operation whose numbers vary in space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Warp {
    /// Dilation by a length with these slopes along the axes.
    Grow { by: NodeId, slopes: [NodeId; 3] },
    /// Translation by a vector; `slopes[i]` are those of component i.
    Translate { by: [NodeId; 3], slopes: [[NodeId; 3]; 3] },
    /// Scaling along the axes.
    Scale([NodeId; 3]),
    /// Pulling back by the orthogonal matrix with these rows.
    Rotate([[NodeId; 3]; 3]),
}

impl Warp {
    /// The expressions that it reads.
    pub(super) fn numbers(&self) -> Vec<NodeId> {
        match self {
            Self::Grow { by, .. } => vec![*by],
            Self::Translate { by, .. } | Self::Scale(by) => by.to_vec(),
            Self::Rotate(rows) => rows.as_flattened().to_vec(),
        }
    }
}

impl Extent {
    /// Where the solid can be after `warp`, the text at `span`.
    pub(super) fn warped(self, warp: &Warp, span: Span, values: &Values<'_>) -> Self {
        let before = self.unbounded;
        let mut warped = match warp {
            Warp::Grow { by, slopes } => self.grown_by(*by, *slopes, values),
            Warp::Translate { by, slopes } => self.moved_by(*by, *slopes, values),
            Warp::Scale(by) => self.scaled_by(*by, values),
            Warp::Rotate(rows) => self.turned_by(*rows, values),
        };
        // An axis that had no end before is not this operation's fault.
        warped.unbounded = before.map(|blame| blame.or(Some(span)));
        warped.period = None;
        warped.with_blame_where_unbounded().said(span, &[])
    }

    fn grown_by(mut self, by: NodeId, slopes: [NodeId; 3], values: &Values<'_>) -> Self {
        let steepest = slopes.map(|slope| values.magnitude(slope, &Aabb::WHOLE));
        self.lipschitz += steepest.iter().map(|s| s * s).sum::<f64>().sqrt();
        let everywhere = values.range(by, &Aabb::WHOLE).hi;
        let inside = values.range(by, &self.bounds).hi;
        // Where the box has no end there is nothing to grow.
        let finite = (0..3).filter(|&a| self.has_end(a));
        let rate: f64 = finite.map(|a| self.growth[a] * steepest[a]).sum();
        let beyond = 1.0 - rate;
        let (most, growth) = if rate < 1.0 && inside.max(0.0) / beyond < everywhere {
            (inside.max(0.0) / beyond, self.growth / beyond)
        } else {
            (everywhere, self.growth)
        };
        if most > 0.0 {
            self.bounds = self.bounds.grown(self.growth * most);
        }
        self.growth = growth;
        self
    }

    fn moved_by(mut self, by: [NodeId; 3], slopes: [[NodeId; 3]; 3], values: &Values<'_>) -> Self {
        self.lipschitz = f64::INFINITY;
        let region = self.reach(by, slopes, values);
        let (domain, growth) = region.unwrap_or((Aabb::WHOLE, self.growth));
        let offsets = by.map(|by| values.range(by, &domain));
        self.bounds = Aabb::new(
            self.bounds.lo + DVec3::from_array(offsets.map(|o| o.lo)),
            self.bounds.hi + DVec3::from_array(offsets.map(|o| o.hi)),
        );
        self.growth = growth;
        self
    }

    /// The box that holds all x with x - o(x) in the bounds, by the slopes of o, and its growth.
    fn reach(
        &self,
        by: [NodeId; 3],
        slopes: [[NodeId; 3]; 3],
        values: &Values<'_>,
    ) -> Option<(Aabb, DVec3)> {
        if !self.bounds.is_finite() || self.bounds.size().cmplt(DVec3::ZERO).any() {
            return None;
        }
        let middle = 0.5 * (self.bounds.lo + self.bounds.hi);
        let there = Aabb::new(middle, middle);
        let offset = DVec3::from_array(by.map(|by| values.magnitude(by, &there)));
        let steepest = slopes
            .map(|row| DVec3::from_array(row.map(|slope| values.magnitude(slope, &Aabb::WHOLE))));
        let apply = |v: DVec3| DVec3::from_array(steepest.map(|row| row.dot(v)));
        let (mut radius, mut growth) = (0.5 * self.bounds.size() + offset, self.growth);
        let (mut more, mut faster) = (radius, growth);
        for _ in 0..MOST_STEPS {
            (more, faster) = (apply(more), apply(faster));
            radius += more;
            growth += faster;
            if !radius.is_finite() || !growth.is_finite() {
                return None;
            }
            // What is left of a geometric series is no more than a part of its last term.
            let small = more.max_element() <= f64::EPSILON * radius.max_element()
                && faster.max_element() <= f64::EPSILON * growth.max_element();
            if small {
                let margin = 1.0 + 1e-9;
                let (radius, growth) = (radius * margin, growth * margin);
                return Some((Aabb::new(middle - radius, middle + radius), growth));
            }
        }
        None
    }

    /// {a0 f(x/a) <= t} is the image of a part of {f <= t / min a0}.
    fn scaled_by(mut self, by: [NodeId; 3], values: &Values<'_>) -> Self {
        self.lipschitz = f64::INFINITY;
        let factors = by.map(|by| values.range(by, &Aabb::WHOLE));
        let sizes = factors.map(Interval::abs);
        let least = sizes.iter().map(|size| size.lo).fold(f64::INFINITY, f64::min);
        for (axis, factor) in factors.into_iter().enumerate() {
            let side = Interval::new(self.bounds.lo[axis], self.bounds.hi[axis]) * factor;
            (self.bounds.lo[axis], self.bounds.hi[axis]) = (side.lo, side.hi);
            self.growth[axis] *= sizes[axis].hi / least;
        }
        if least > 0.0 {
            return self;
        }
        // No growth is known; the box that was found holds {f <= 0} only.
        self.growth = DVec3::INFINITY;
        self
    }

    fn turned_by(mut self, rows: [[NodeId; 3]; 3], values: &Values<'_>) -> Self {
        let Self { bounds, growth, .. } = self;
        for axis in Axis::ALL.map(Axis::index) {
            let (mut sum, mut square, mut wide) = (Interval::point(0.0), 0.0, 0.0);
            for (j, row) in rows.iter().enumerate() {
                let entry = values.range(row[axis], &Aabb::WHOLE);
                // An entry of a rotation lies between -1 and 1, whatever its range says.
                let entry = Interval { lo: entry.lo.max(-1.0), hi: entry.hi.min(1.0), nan: false };
                if entry == Interval::point(0.0) {
                    continue;
                }
                let side = Interval::new(bounds.lo[j], bounds.hi[j]);
                let largest = side.hi.max(-side.lo);
                sum = sum + side * entry;
                square += largest * largest;
                wide += entry.hi.max(-entry.lo) * growth[j];
            }
            let radius = square.sqrt() * (1.0 + 4.0 * f64::EPSILON);
            self.bounds.lo[axis] = sum.lo.max(-radius);
            self.bounds.hi[axis] = sum.hi.min(radius);
            self.growth[axis] = wide;
        }
        self.lipschitz = f64::INFINITY;
        self
    }
}
