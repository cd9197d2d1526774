//! Planar cuts of a solid: outlines with area and perimeter, as SVG and PNG.
//!
//! Outlines are those of [`contour::outlines`](crate::contour::outlines), of the field itself. A picture has
//! the plane's first axis to the right and the second one up: cuts across z are seen from above (x, y),
//! across y from the front (x, z), across x from the right (y, z).
//!
//! **Error.** Area and perimeter are those of polygons whose corners are on the true outline: they are of
//! second order in the spacing where the outline is smooth. What lies between nodes is not seen.

mod png;
mod svg;

pub use png::{MOST_PIXELS, Picture, RasterError};

use crate::contour::Grid;
use crate::contour::outlines::{Outlines, axes_across};
use crate::geom::Axis;

/// A planar cut of a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The axis that the plane is across.
    pub axis: Axis,
    /// Where it cuts the axis, in model units.
    pub at: f64,
    /// Closed outlines, in the plane's axes as [`axes_across`] has them; inside is on their left.
    pub outlines: Outlines,
}

/// A rectangle in a plane: its least corner, then its greatest, in model units.
pub type Window = [[f64; 2]; 2];

/// The rectangle that the box of `grid` cuts out of planes across `axis`.
#[must_use]
pub fn window(grid: &Grid, axis: Axis) -> Window {
    let ends = axes_across(axis).map(|axis| {
        let line = grid.placed(axis);
        [line[0], line[line.len() - 1]]
    });
    [0, 1].map(|end| ends.map(|axis| axis[end]))
}

impl Slice {
    /// Area of the cut, in squared model units.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.outlines.iter().map(|ring| area(ring)).sum()
    }

    /// Length of all outlines, in model units.
    #[must_use]
    pub fn perimeter(&self) -> f64 {
        self.outlines.iter().map(|ring| sides(ring).map(|[p, q]| distance(p, q)).sum::<f64>()).sum()
    }

    /// How many outlines are holes.
    #[must_use]
    pub fn holes(&self) -> usize {
        self.outlines.iter().filter(|ring| area(ring) < 0.0).count()
    }
}

/// The area on the left of a ring: negative if it turns clockwise.
fn area(ring: &[[f64; 2]]) -> f64 {
    let Some(&[x, y]) = ring.first() else { return 0.0 };
    let cross = |[p, q]: [[f64; 2]; 2]| (p[0] - x) * (q[1] - y) - (q[0] - x) * (p[1] - y);
    0.5 * sides(ring).map(cross).sum::<f64>()
}

/// The sides of a ring, from point to point.
fn sides(ring: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    let following = ring.iter().cycle().skip(1);
    ring.iter().zip(following).map(|(p, q)| [*p, *q])
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    libm::hypot(p[0] - q[0], p[1] - q[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::Settings;
    use crate::contour::outlines::outlines;
    use crate::contour::testing::{Sampled, cube, unknown};
    use crate::num::Progress;
    use std::f64::consts::{PI, TAU};

    fn of(field: impl Fn([f64; 3]) -> f64 + Sync, grid: &Grid, axis: Axis, at: f64) -> Slice {
        let planes = grid.planes(axis, &[at]);
        let sampler = Sampled::new(&planes, field, unknown);
        let (settings, progress) = (Settings::default(), Progress::new());
        let (mut found, _) = outlines(&sampler, &planes, axis, &settings, &progress).unwrap();
        Slice { axis, at, outlines: found.remove(0) }
    }

    fn ring(p: [f64; 3]) -> f64 {
        let r = p[0].hypot(p[1]);
        (r - 0.8).max(0.3 - r)
    }

    /// The slope of errors over spacings, by the straight line through all of them on logarithmic scales.
    fn order(errors: &[(f64, f64)]) -> f64 {
        let logs: Vec<_> = errors.iter().map(|(h, error)| (h.ln(), error.abs().ln())).collect();
        let n = logs.len() as f64;
        let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
        let covariance: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
        covariance / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
    }

    #[test]
    fn the_circle_converges_with_second_order() {
        let disc = |p: [f64; 3]| p[0].hypot(p[1]) - 0.8;
        let slices = [32.0, 48.0, 64.0, 96.0, 128.0, 192.0].map(|n| {
            let spacing = 2.0 / n;
            (spacing, of(disc, &cube(-1.0, 1.0, spacing), Axis::Z, 0.123))
        });
        let areas = slices.each_ref().map(|(h, slice)| (*h, slice.area() - PI * 0.64));
        let lengths = slices.each_ref().map(|(h, slice)| (*h, slice.perimeter() - TAU * 0.8));
        for errors in [areas, lengths] {
            let order = order(&errors);
            assert!((1.85..2.15).contains(&order), "order {order}: {errors:?}");
        }
    }

    #[test]
    fn a_ring_has_a_hole() {
        let found = of(ring, &cube(-1.0, 1.0, 0.02), Axis::Z, 0.123);
        assert_eq!((found.outlines.len(), found.holes()), (2, 1));
        assert!((found.area() / (PI * 0.55) - 1.0).abs() < 1e-4, "{}", found.area());
        assert!((found.perimeter() / (TAU * 1.1) - 1.0).abs() < 1e-3, "{}", found.perimeter());
    }

    #[test]
    fn a_box_has_its_area_and_corners() {
        let grid = cube(-1.0, 1.0, 0.3);
        for axis in Axis::ALL {
            for at in [-1.0, -0.4, 0.7, 1.0] {
                let found =
                    of(|p| p[0].abs().max(p[1].abs()).max(p[2].abs()) - 1.0, &grid, axis, at);
                assert!((found.area() - 4.0).abs() < 1e-14, "{axis:?} {at}: {}", found.area());
                assert!((found.perimeter() - 8.0).abs() < 1e-14);
                assert_eq!((found.outlines.len(), found.holes()), (1, 0));
            }
        }
        let nothing = of(|p| p[2].abs() - 0.5, &grid, Axis::Z, 0.6);
        assert_eq!((nothing.area(), nothing.outlines.len()), (0.0, 0));
    }

    #[test]
    fn pictures_have_their_axes_in_order() {
        // Only where y > 0 and z > 0.
        let field = |p: [f64; 3]| -(p[1].min(p[2]));
        let grid = cube(-1.0, 1.0, 0.1);
        let quarter = of(field, &grid, Axis::X, 0.0);
        // The corner is cut off, as at any kink off the border.
        assert!((quarter.area() - 0.995).abs() < 1e-9, "{}", quarter.area());
        assert!(quarter.outlines[0].iter().all(|[y, z]| *y >= 0.0 && *z >= 0.0));
        let right = |p: [f64; 3]| -p[0];
        let half = of(right, &grid, Axis::Y, 0.0);
        assert!(half.outlines[0].iter().all(|[x, _]| *x >= 0.0));
        assert_eq!(window(&grid, Axis::Y), [[-1.0; 2], [1.0; 2]]);
    }
}
