//! Overhangs: how much of a surface looks down.
//!
//! A face *overhangs* if the angle between its outward normal and straight down is less than a
//! threshold: 0° is a ceiling, 90° a wall. This is how printers count: a face that rises less than the
//! threshold from the plate needs support. What lies flat on the plate, the plane through the
//! lowest point, is no overhang.
//!
//! **Error.** A triangle counts whole or not at all, by its own normal. On a surface whose slope
//! passes the threshold the triangles along that line are counted one way or the other, an error of
//! first order in the spacing at most; flat faces have none but that of the mesh.

use crate::num::elementary;
use glam::DVec3;

/// Which faces overhang.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overhang {
    /// The greatest angle between an overhanging face's normal and straight down, in degrees, above 0
    /// and at most 180.
    pub angle_deg: f64,
    /// The direction in which the part is built; of any length but zero.
    pub up: DVec3,
}

impl Default for Overhang {
    /// Within 45 degrees of straight down, along -z.
    fn default() -> Self {
        Self { angle_deg: 45.0, up: DVec3::Z }
    }
}

/// Corners as far above the lowest as this part of the largest coordinate lie on the plate too: where
/// the direction is along no axis, the heights of points of one plane are rounded.
const ON_PLATE: f64 = 1e-12;

/// Adds up what overhangs, a triangle at a time.
#[derive(Clone, Copy, Debug)]
pub struct Overhanging {
    up: DVec3,
    /// Cosine of the angle.
    least: f64,
    slack: f64,
    /// The lowest height so far.
    floor: f64,
    /// Area that overhangs on the floor, and above it.
    on_floor: f64,
    above: f64,
}

impl Overhanging {
    /// Nothing yet, of a mesh whose coordinates are `extent` in magnitude at most.
    #[must_use]
    pub fn new(overhang: &Overhang, extent: f64) -> Self {
        Self {
            up: overhang.up.normalize_or_zero(),
            least: elementary::cos(overhang.angle_deg.to_radians()),
            slack: ON_PLATE * extent,
            floor: f64::INFINITY,
            on_floor: 0.0,
            above: 0.0,
        }
    }

    /// Adds a triangle, its corners counter-clockwise from outside.
    #[inline]
    pub fn include(&mut self, [a, b, c]: [DVec3; 3]) {
        let heights = [a, b, c].map(|corner| self.up.dot(corner));
        let lowest = heights[0].min(heights[1]).min(heights[2]);
        self.lower(lowest);
        let double = (b - a).cross(c - a);
        let length = double.length();
        if -self.up.dot(double) > self.least * length {
            let is_on_floor = heights.iter().all(|height| *height <= self.floor + self.slack);
            let area = if is_on_floor { &mut self.on_floor } else { &mut self.above };
            *area += 0.5 * length;
        }
    }

    /// Adds what `other` has of the same mesh.
    pub fn add(&mut self, mut other: Self) {
        self.lower(other.floor);
        other.lower(self.floor);
        self.on_floor += other.on_floor;
        self.above += other.above;
    }

    /// Finds that the floor is no higher than `height`.
    fn lower(&mut self, height: f64) {
        if height < self.floor {
            if height < self.floor - self.slack {
                self.above += std::mem::take(&mut self.on_floor);
            }
            self.floor = height;
        }
    }

    /// The area that overhangs, in squared model units.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.above
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// The area that overhangs of triangles, given by their corners, as part of a larger body.
    fn of(triangles: &[[DVec3; 3]], angle_deg: f64, up: DVec3) -> f64 {
        let nothing = Overhanging::new(&Overhang { angle_deg, up }, 10.0);
        // In two sums, either of which may have the floor.
        let (mut even, mut odd) = (nothing, nothing);
        for (t, triangle) in triangles.iter().enumerate() {
            if t % 2 == 0 { even.include(*triangle) } else { odd.include(*triangle) }
        }
        even.add(odd);
        even.area()
    }

    /// The triangles of a patch of `n` by `n` squares over the unit square; u by v is outward.
    fn patch(n: usize, at: impl Fn(f64, f64) -> DVec3) -> Vec<[DVec3; 3]> {
        let place = |i: usize, j: usize| at(i as f64 / n as f64, j as f64 / n as f64);
        let square = |k: usize| {
            let (i, j) = (k % n, k / n);
            let [a, b] = [place(i, j), place(i + 1, j)];
            let [c, d] = [place(i, j + 1), place(i + 1, j + 1)];
            [[a, b, d], [a, d, c]]
        };
        (0..n * n).flat_map(square).collect()
    }

    /// A ceiling of one unit square at height `z`, facing down.
    fn ceiling(z: f64) -> Vec<[DVec3; 3]> {
        patch(3, |u, v| DVec3::new(v, u, z))
    }

    #[test]
    fn what_lies_on_the_plate_does_not_overhang() {
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found}");
        near(of(&ceiling(0.5), 45.0, DVec3::Z), 0.0);
        let both = [ceiling(0.5), ceiling(0.25)].concat();
        near(of(&both, 45.0, DVec3::Z), 1.0);
        let both = [ceiling(0.25), ceiling(0.5)].concat();
        near(of(&both, 0.1, 3.0 * DVec3::Z), 1.0);
        // Built the other way round, these are floors.
        near(of(&both, 89.9, -DVec3::Z), 0.0);
        // The plate may be a plane in any direction, as rounded as it is.
        let up = DVec3::new(0.3, -0.5, 0.7).normalize();
        let turn = glam::DQuat::from_rotation_arc(DVec3::Z, up);
        let turned: Vec<_> = both.iter().map(|t| t.map(|corner| turn * corner)).collect();
        near(of(&turned, 45.0, up), 1.0);
    }

    #[test]
    fn a_cap_of_a_sphere_overhangs_by_its_area() {
        let sphere = patch(400, |u, v| {
            let (longitude, latitude) = (TAU * u, PI * (v - 0.5));
            let ring = latitude.cos();
            DVec3::new(ring * longitude.cos(), ring * longitude.sin(), latitude.sin())
        });
        for angle in [20.0_f64, 45.0, 60.0, 90.0] {
            let cap = TAU * (1.0 - angle.to_radians().cos());
            let found = of(&sphere, angle, DVec3::Z);
            assert!((found / cap - 1.0).abs() < 0.02, "{angle}: {found} {cap}");
        }
        let all = of(&sphere, 180.0, DVec3::Y);
        assert!((all / (2.0 * TAU) - 1.0).abs() < 1e-3, "{all}");
    }
}
