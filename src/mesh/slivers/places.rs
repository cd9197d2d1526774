//! What files tell apart: the places of vertices, and triangles from lines.
//!
//! Contouring leaves vertices on edges of the grid, which keeps them apart in the precision that the file
//! is written in. Where vertices move freely each move is looked at: no two of them may get one place, and
//! each triangle that changes stays so wide that rounding can't flatten it. Where a surface crosses
//! itself, two sheets would otherwise meet in a point.

use super::sheets::normal;
use crate::geom::Aabb;
use crate::mesh::io::Precision;
use glam::DVec3;
use rustc_hash::FxHashSet;

/// The width below which a triangle may lose its area, in units of the last place of the largest
/// coordinate: rounding moves each corner by at most half of one along each axis, by less than one in all.
const NARROWEST: f64 = 2.0;

/// The places that vertices have, as files hold them.
#[derive(Debug)]
pub(super) struct Places {
    precision: Precision,
    narrowest: f64,
    taken: FxHashSet<[u64; 3]>,
}

impl Places {
    /// Those of `positions`, which lie in `bounds`, in files of that precision.
    pub(super) fn new(positions: &[[f64; 3]], bounds: Aabb, precision: Precision) -> Self {
        let largest = bounds.lo.abs().max(bounds.hi.abs()).max_element();
        let digits = match precision {
            Precision::Single => 23,
            Precision::Double => 52,
        };
        let unit = libm::ldexp(1.0, libm::ilogb(largest) - digits);
        let mut places =
            Self { precision, narrowest: NARROWEST * unit, taken: FxHashSet::default() };
        places.taken.reserve(positions.len());
        for position in positions {
            places.take(DVec3::from_array(*position));
        }
        places
    }

    /// Whether no vertex has the place of `at`.
    pub(super) fn is_open(&self, at: DVec3) -> bool {
        !self.taken.contains(&self.stored(at))
    }

    /// Whether `one` and `other` are one place.
    pub(super) fn are_one(&self, one: DVec3, other: DVec3) -> bool {
        self.stored(one) == self.stored(other)
    }

    /// A vertex is at `at` from now on.
    pub(super) fn take(&mut self, at: DVec3) {
        self.taken.insert(self.stored(at));
    }

    /// The vertex at `at` is gone.
    pub(super) fn leave(&mut self, at: DVec3) {
        self.taken.remove(&self.stored(at));
    }

    /// Whether a triangle keeps its area in the file.
    pub(super) fn is_wide(&self, points: [DVec3; 3]) -> bool {
        let [a, b, c] = points;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        normal(points).length() >= self.narrowest * longest && longest > 0.0
    }

    /// The coordinates that a file holds, 0 and -0 being one.
    fn stored(&self, at: DVec3) -> [u64; 3] {
        at.to_array().map(|coordinate| {
            let stored = match self.precision {
                Precision::Single => f64::from(coordinate as f32),
                Precision::Double => coordinate,
            };
            // The hash is blind to where short fractions have their bits.
            (stored + 0.0).to_bits().rotate_left(32)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_one_where_files_round_them_to_one() {
        let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
        let (at, near) = (DVec3::new(0.5, 0.0, 1.0), DVec3::new(0.5 + 1e-11, -0.0, 1.0));
        for (precision, is_one) in [(Precision::Single, true), (Precision::Double, false)] {
            let mut places = Places::new(&[at.to_array()], bounds, precision);
            assert!(!places.is_open(at));
            assert_eq!(places.is_open(near), !is_one);
            assert_eq!(places.are_one(at, near), is_one);
            places.leave(at);
            assert!(places.is_open(at) && places.is_open(near));
            let thin = |height: f64| [DVec3::ZERO, DVec3::X, DVec3::new(0.5, height, 0.0)];
            assert_eq!(places.is_wide(thin(1e-8)), !is_one);
            assert!(places.is_wide(thin(1e-6)) && !places.is_wide(thin(0.0)));
            assert!(!places.is_wide([at; 3]));
        }
    }
}
