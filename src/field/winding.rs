//! Winding numbers of triangle soups: how often a surface encloses a point.
//!
//! The winding number is the sum of the signed solid angles of all faces over 4 pi: 1 inside and 0
//! outside of a closed surface, something between near holes.
//!
//! Source: solid angle of a triangle after van Oosterom & Strackee 1983,
//! doi:10.1109/TBME.1983.325207; winding numbers as a test for inside after Jacobson, Kavan,
//! Sorkine-Hornung 2013, doi:10.1145/2461912.2461916.

use super::surface::Surface;
use glam::DVec3;

/// Tangent of half the solid angle of a triangle seen from the origin, as (denominator,
/// numerator): positive from the inside of a surface whose faces are counter-clockwise outside.
#[inline(always)]
fn half_angle([a, b, c]: [DVec3; 3]) -> (f64, f64) {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    (la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb, a.dot(b.cross(c)))
}

/// A sum of angles in (-pi, pi], kept as a complex number and full turns: one arctangent serves
/// for all of them.
#[derive(Clone, Copy, Debug)]
struct Turning {
    re: f64,
    im: f64,
    turns: i32,
}

impl Turning {
    const NONE: Self = Self { re: 1.0, im: 0.0, turns: 0 };

    /// Adds the angle of `re` + i `im`; that of zero is none.
    #[inline(always)]
    fn add(&mut self, re: f64, im: f64) {
        let size = re.abs() + im.abs();
        if size == 0.0 {
            return;
        }
        let (re, im) = (re / size, im / size);
        let product = (self.re * re - self.im * im, self.re * im + self.im * re);
        // Two angles of one sense whose sum leaves (-pi, pi] come back from the other side.
        let wide = self.re < 0.0 && re < 0.0;
        if self.im >= 0.0 && im >= 0.0 && (product.1 < 0.0 || wide) {
            self.turns += 1;
        } else if self.im < 0.0 && im < 0.0 && (product.1 >= 0.0 || wide) {
            self.turns -= 1;
        }
        // Each factor is at least 1/sqrt 2 long: keep the product from vanishing.
        let size = product.0.abs() + product.1.abs();
        (self.re, self.im) = (product.0 / size, product.1 / size);
    }

    /// The sum in full turns.
    fn total(self) -> f64 {
        f64::from(self.turns) + libm::atan2(self.im, self.re) / std::f64::consts::TAU
    }
}

/// The winding number of `surface` around `point`, face by face.
#[must_use]
pub fn exact(surface: &Surface, point: DVec3) -> f64 {
    let mut sum = Turning::NONE;
    for face in 0..surface.triangles.len() {
        let (re, im) = half_angle(surface.corners(face).map(|corner| corner - point));
        sum.add(re, im);
    }
    sum.total()
}

#[cfg(test)]
mod tests {
    use super::super::surface::tests::{both, cube, mapped};
    use super::*;

    #[test]
    fn a_cube_is_wound_once_inside_and_not_outside() {
        let surface = Surface::new(&cube()).unwrap();
        for (point, expected) in [
            ([0.5, 0.5, 0.5], 1.0),
            ([0.01, 0.99, 0.5], 1.0),
            ([1e-9, 0.3, 0.3], 1.0),
            ([-1e-9, 0.3, 0.3], 0.0),
            ([1.5, 0.5, 0.5], 0.0),
            ([100.0, -50.0, 3.0], 0.0),
        ] {
            // Roundings, in units of the distance from the surface.
            let distance = (DVec3::from_array(point) - 0.5).abs().max_element() - 0.5;
            let tolerance = 1e-14 + 1e-15 / distance.abs();
            assert!((exact(&surface, point.into()) - expected).abs() < tolerance);
        }
    }

    #[test]
    fn overlapping_bodies_add_up() {
        let mut bodies = cube();
        for i in 1..8 {
            let shift = DVec3::new(0.05, 0.03, 0.02) * f64::from(i);
            bodies = both(&bodies, &mapped(&cube(), |p| p + shift));
        }
        let surface = Surface::new(&bodies).unwrap();
        assert!((exact(&surface, DVec3::splat(0.6)) - 8.0).abs() < 1e-13);
        assert!(exact(&surface, DVec3::splat(-0.1)).abs() < 1e-13);
    }

    #[test]
    fn half_a_sphere_of_directions_is_half_a_turn() {
        let mut bowl = cube();
        // Without the top, seen from the middle of the top.
        bowl.triangles.retain(|t| t.iter().any(|v| bowl.positions[*v as usize][2] == 0.0));
        let surface = Surface::new(&bowl).unwrap();
        assert!((exact(&surface, DVec3::new(0.5, 0.5, 1.0)) - 0.5).abs() < 1e-15);
    }
}
