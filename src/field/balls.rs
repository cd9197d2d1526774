//! What an exact distance tells of the points around it.
//!
//! A distance changes by no more than the way between two points. So one exact value settles how
//! the values all around compare with any level that it is not near, and where a level is all that
//! is asked for ([`Interest`]) that value can stand in for theirs. Points come in lines and blocks:
//! a few balls settle most of them.
//!
//! The sign takes part in this where the surface has no boundary: it then turns at faces only. Where
//! the surface has holes a ball ends where the sign is no longer certain
//! ([`Sides::holds`](super::sides::Sides::holds)).
//!
//! All lengths are in the coordinates of the search.

use crate::expr::Interest;
use glam::DVec3;

/// Balls that are kept: to look at them all costs a fiftieth of a search.
const KEPT: usize = 16;
/// Bound on the rounding error of a value and of the way to a point, in units of the distances
/// involved plus the size of the mesh: some tens of roundings.
pub const ROUNDING: f64 = 1.0 / (1_u64 << 46) as f64;

/// An exact value, and how far around it the values differ from it by no more than the way.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// The point.
    pub at: DVec3,
    /// The value there.
    pub value: f64,
    /// The radius of the ball, infinite if it has none; negative if nothing is known but the value.
    pub radius: f64,
}

impl Ball {
    /// How much values in the ball, computed ones, may differ from its own at points `way` away.
    #[inline(always)]
    fn margin(&self, way: f64) -> f64 {
        if way > self.radius {
            return f64::INFINITY;
        }
        way + ROUNDING * (self.value.abs() + way + 2.0)
    }

    /// Whether values `way` away are certainly on the same side of all `levels`.
    #[inline(always)]
    #[must_use]
    pub fn settles(&self, way: f64, levels: &[f64]) -> bool {
        let margin = self.margin(way);
        levels.iter().all(|level| (self.value - level).abs() > margin)
    }

    /// Whether who has the interest `of` in point number `i`, `way` away, can't tell the value
    /// there from that of the ball.
    #[inline(always)]
    #[must_use]
    pub fn stands_in(&self, way: f64, of: Interest<'_>, i: usize) -> bool {
        match of {
            Interest::Beside(levels) => self.settles(way, levels),
            Interest::From(least) => self.value + self.margin(way) < least[i],
            Interest::UpTo(most) => self.value - self.margin(way) > most[i],
        }
    }
}

/// The latest balls of one surface.
#[derive(Clone, Debug, Default)]
pub struct Balls {
    surface: u64,
    at: [[f64; KEPT]; 3],
    value: [f64; KEPT],
    radius: [f64; KEPT],
    len: usize,
    next: usize,
    /// The last point that was asked for exactly.
    last: DVec3,
}

impl Balls {
    /// Forgets the balls unless they are those of the surface with this number.
    pub fn keep_for(&mut self, surface: u64) {
        if self.surface != surface {
            *self = Self { surface, ..Self::default() };
        }
    }

    /// The value that can stand in for that at `at`, point number `i`.
    #[inline(always)]
    #[must_use]
    pub fn stand_in(&self, at: DVec3, of: Interest<'_>, i: usize) -> Option<f64> {
        // No closures: they would be compiled apart, without the host's best instructions.
        let [x, y, z] = at.to_array();
        let mut way = [0.0; KEPT];
        for (k, way) in way.iter_mut().enumerate() {
            let (dx, dy, dz) = (self.at[0][k] - x, self.at[1][k] - y, self.at[2][k] - z);
            *way = (dx * dx + dy * dy + dz * dz).sqrt();
        }
        for (k, way) in way.iter().enumerate().take(self.len) {
            let ball = Ball { at, value: self.value[k], radius: self.radius[k] };
            if ball.stands_in(*way, of, i) {
                return Some(ball.value);
            }
        }
        None
    }

    /// Keeps `ball`, found for point number `i`, if it settles points a fourth as far away as the
    /// last one that was found.
    #[inline(always)]
    pub fn add(&mut self, ball: Ball, of: Interest<'_>, i: usize) {
        let way = 0.25 * ball.at.distance(self.last);
        self.last = ball.at;
        if ball.stands_in(way, of, i) {
            let k = self.next;
            for a in 0..3 {
                self.at[a][k] = ball.at[a];
            }
            (self.value[k], self.radius[k]) = (ball.value, ball.radius);
            self.next = (k + 1) % KEPT;
            self.len = (self.len + 1).min(KEPT);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_settles_levels_farther_from_its_value_than_the_way() {
        let ball = Ball { at: DVec3::ZERO, value: -0.5, radius: f64::INFINITY };
        assert!(ball.settles(0.4, &[0.0]) && !ball.settles(0.5, &[0.0]));
        assert!(!ball.settles(0.4, &[0.0, -0.75]));
        assert!(ball.settles(0.4, &[f64::INFINITY]) && !ball.settles(0.0, &[f64::NAN]));
        assert!(ball.stands_in(0.4, Interest::From(&[0.0]), 0));
        assert!(!ball.stands_in(0.4, Interest::From(&[f64::NEG_INFINITY]), 0));
        assert!(ball.stands_in(0.4, Interest::UpTo(&[-1.0]), 0));
        assert!(!ball.stands_in(0.4, Interest::UpTo(&[0.0]), 0));
        let less = Ball { radius: 0.3, ..ball };
        assert!(less.settles(0.3, &[0.0]) && !less.settles(0.31, &[0.0]));
        assert!(!Ball { radius: -1.0, ..ball }.settles(0.0, &[0.0]));
    }

    #[test]
    fn balls_are_those_of_one_surface() {
        let mut balls = Balls::default();
        balls.keep_for(1);
        let interest = Interest::Beside(&[0.0]);
        let ball = Ball { at: DVec3::X, value: 0.6, radius: f64::INFINITY };
        balls.add(ball, interest, 0);
        assert_eq!(balls.stand_in(1.2 * DVec3::X, interest, 0), Some(0.6));
        assert_eq!(balls.stand_in(1.7 * DVec3::X, interest, 0), None);
        balls.keep_for(2);
        assert_eq!(balls.stand_in(1.2 * DVec3::X, interest, 0), None);
    }
}
