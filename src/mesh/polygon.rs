//! Polygons into triangles.
//!
//! A polygon is projected along the axis nearest its normal. Where the triangles from its first
//! corner all have positive area they are taken; otherwise ears are clipped. The corners need not
//! be in a plane nor different. A simple polygon gives triangles that cover it without overlap,
//! none of zero area unless three neighbouring corners lie on a line to the end; any other gives
//! n − 2 triangles of some kind.
//!
//! Source: Meisters 1975, doi:10.2307/2319703 (two ears theorem).

use glam::{DVec2, DVec3};

/// Tests of a point against a triangle granted for each corner of a polygon, so that no polygon
/// takes much longer to clip than to read: some 10 microseconds a corner. Enough for most polygons of
/// ten thousand corners.
const TESTS_A_CORNER: usize = 1 << 12;
/// Corners that such tests are granted for at most, so that one polygon takes no second.
const GRANTED: usize = 1 << 16;

/// Divides polygons into triangles; scratch memory to be used again for the next.
#[derive(Debug, Default)]
pub struct Triangulator {
    triangles: Vec<[u32; 3]>,
    points: Vec<DVec2>,
    /// The corners left, in order round the polygon.
    next: Vec<usize>,
    previous: Vec<usize>,
    /// The corners that do not turn left, and others that once did not.
    reflex: Vec<usize>,
    is_reflex: Vec<bool>,
}

impl Triangulator {
    /// The triangles of the polygon with the given `corners`, in the same orientation.
    ///
    /// `None` if the polygon has so many corners in such an order that clipping takes too long.
    ///
    /// # Panics
    /// If a corner is no index into `positions`.
    pub fn triangulate(&mut self, corners: &[u32], positions: &[[f64; 3]]) -> Option<&[[u32; 3]]> {
        self.triangles.clear();
        if corners.len() >= 3 {
            self.project(corners, positions);
            if !self.fan(corners) {
                self.triangles.clear();
                self.clip(corners)?;
            }
        }
        Some(&self.triangles)
    }

    /// Projects the corners to a plane in which the polygon turns left.
    fn project(&mut self, corners: &[u32], positions: &[[f64; 3]]) {
        let at = |corner: u32| DVec3::from_array(positions[corner as usize]);
        // Relative to the first corner, so that a far polygon loses nothing.
        let origin = at(corners[0]);
        let mut normal = DVec3::ZERO;
        for pair in corners.windows(2) {
            normal += (at(pair[0]) - origin).cross(at(pair[1]) - origin);
        }
        let size = normal.abs();
        let (axes, along) = if size.z >= size.x && size.z >= size.y {
            ([0, 1], normal.z)
        } else if size.y >= size.x {
            ([2, 0], normal.y)
        } else {
            ([1, 2], normal.x)
        };
        let side = if along < 0.0 { -1.0 } else { 1.0 };
        self.points.clear();
        self.points.extend(corners.iter().map(|&corner| {
            let offset = at(corner) - origin;
            DVec2::new(offset[axes[0]], side * offset[axes[1]])
        }));
    }

    /// Takes the triangles from the first corner; whether all have positive area.
    fn fan(&mut self, corners: &[u32]) -> bool {
        for i in 1..corners.len() - 1 {
            if turn(self.points[0], self.points[i], self.points[i + 1]) <= 0.0 {
                return false;
            }
            self.triangles.push([corners[0], corners[i], corners[i + 1]]);
        }
        true
    }

    /// Cuts off ear after ear; `None` when that takes too long.
    fn clip(&mut self, corners: &[u32]) -> Option<()> {
        let count = corners.len();
        self.next.clear();
        self.next.extend((1..count).chain([0]));
        self.previous.clear();
        self.previous.extend([count - 1].into_iter().chain(0..count - 1));
        self.is_reflex.clear();
        self.is_reflex.resize(count, false);
        self.reflex.clear();
        for corner in 0..count {
            self.is_reflex[corner] = !self.turns_left(corner);
            if self.is_reflex[corner] {
                self.reflex.push(corner);
            }
        }
        let mut tests = TESTS_A_CORNER * count.min(GRANTED);
        let mut corner = 0;
        let mut left = count;
        // Corners looked at since the last cut.
        let mut refused = 0;
        while left > 2 {
            tests = tests.checked_sub(1)?;
            let (before, after) = (self.previous[corner], self.next[corner]);
            // A polygon without an ear is not simple, or what is left of it is a line: any cut.
            if refused >= left || self.is_ear(corner, &mut tests)? {
                self.triangles.push([corners[before], corners[corner], corners[after]]);
                self.next[before] = after;
                self.previous[after] = before;
                self.is_reflex[corner] = false;
                for neighbour in [before, after] {
                    self.is_reflex[neighbour] &= !self.turns_left(neighbour);
                }
                left -= 1;
                refused = 0;
                // Ears that alternate give better triangles than a fan.
                corner = self.next[after];
            } else {
                refused += 1;
                corner = after;
            }
        }
        Some(())
    }

    /// Whether the triangle at `corner` has positive area and holds no other corner.
    fn is_ear(&mut self, corner: usize, tests: &mut usize) -> Option<bool> {
        if !self.turns_left(corner) {
            return Some(false);
        }
        let ends = [self.previous[corner], self.next[corner]];
        let ear = [ends[0], corner, ends[1]].map(|c| self.points[c]);
        let mut stale = 0;
        let mut is_ear = true;
        // If any corner lies in the triangle, one that turns right does.
        for (tested, &other) in self.reflex.iter().enumerate() {
            if !self.is_reflex[other] {
                stale += 1;
            } else if !ends.contains(&other) && holds(&ear, self.points[other]) {
                *tests = tests.checked_sub(tested)?;
                is_ear = false;
                break;
            }
        }
        if is_ear {
            *tests = tests.checked_sub(self.reflex.len())?;
        }
        if 2 * stale > self.reflex.len() {
            self.reflex.retain(|&other| self.is_reflex[other]);
        }
        Some(is_ear)
    }

    fn turns_left(&self, corner: usize) -> bool {
        let [a, b, c] = [self.previous[corner], corner, self.next[corner]].map(|c| self.points[c]);
        turn(a, b, c) > 0.0
    }
}

/// Whether the triangle holds `point`, inside or on a side but not at a corner.
///
/// Bridges to holes visit a position twice; the second visit must not block an ear.
fn holds(triangle: &[DVec2; 3], point: DVec2) -> bool {
    let [a, b, c] = *triangle;
    !triangle.contains(&point)
        && turn(a, b, point) >= 0.0
        && turn(b, c, point) >= 0.0
        && turn(c, a, point) >= 0.0
}

/// Twice the area of the triangle, positive where it turns left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn divide(positions: &[[f64; 3]]) -> Vec<[u32; 3]> {
        let corners: Vec<u32> = (0..positions.len() as u32).collect();
        Triangulator::default().triangulate(&corners, positions).unwrap().to_vec()
    }

    fn area_vector(points: &[[f64; 3]], triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|i| DVec3::from_array(points[i as usize]));
        0.5 * (b - a).cross(c - a)
    }

    /// A polygon seen from a direction, by exact rational coordinates.
    fn flat(points: &[[f64; 2]], axis: usize, side: f64) -> Vec<[f64; 3]> {
        let place = |p: &[f64; 2]| {
            let mut q = [7.0; 3];
            q[(axis + 1) % 3] = p[0] + 1024.0;
            q[(axis + 2) % 3] = side * p[1];
            q
        };
        points.iter().map(place).collect()
    }

    /// All triangles face as the polygon does, and their areas add up to its own.
    fn check(points: &[[f64; 2]], area: f64) {
        for axis in 0..3 {
            for side in [1.0, -1.0] {
                for turn in 0..points.len() {
                    let mut turned = points.to_vec();
                    turned.rotate_left(turn);
                    let positions = flat(&turned, axis, side);
                    let triangles = divide(&positions);
                    assert_eq!(triangles.len(), points.len() - 2);
                    let areas: Vec<f64> = triangles
                        .iter()
                        .map(|&t| side * area_vector(&positions, t)[axis])
                        .collect();
                    assert!(areas.iter().all(|&a| a > 0.0), "{areas:?} from {turn}");
                    assert_eq!(areas.iter().sum::<f64>(), area);
                }
            }
        }
    }

    #[test]
    fn concave_polygons_are_covered_without_overlap() {
        check(&[[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]], 4.0);
        check(
            &[
                [0.0, 0.0],
                [6.0, 0.0],
                [6.0, 6.0],
                [4.0, 6.0],
                [4.0, 2.0],
                [2.0, 2.0],
                [2.0, 6.0],
                [0.0, 6.0],
            ],
            28.0,
        );
        let star: Vec<[f64; 2]> = vec![
            [8.0, 0.0],
            [2.0, 2.0],
            [0.0, 8.0],
            [-2.0, 2.0],
            [-8.0, 0.0],
            [-2.0, -2.0],
            [0.0, -8.0],
            [2.0, -2.0],
        ];
        check(&star, 64.0);
    }

    #[test]
    fn corners_in_the_middle_of_a_side_make_no_flat_triangle() {
        check(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]], 4.0);
        check(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 2.0]], 2.0);
    }

    #[test]
    fn a_hole_reached_by_a_bridge_stays_open() {
        let ring = [
            [0.0, 0.0],
            [6.0, 0.0],
            [6.0, 6.0],
            [0.0, 6.0],
            [0.0, 0.0],
            [2.0, 2.0],
            [2.0, 4.0],
            [4.0, 4.0],
            [4.0, 2.0],
            [2.0, 2.0],
        ];
        let triangles = divide(&flat(&ring, 2, 1.0));
        let positions = flat(&ring, 2, 1.0);
        let areas: Vec<f64> = triangles.iter().map(|&t| area_vector(&positions, t).z).collect();
        assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
        assert_eq!(areas.iter().sum::<f64>(), 32.0);
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = [[0.0; 3], [1.0, 0.0, 0.1], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
        assert_eq!(divide(&square), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn degenerate_polygons_do_not_hang_or_panic() {
        assert_eq!(divide(&[[1.0; 3]; 6]).len(), 4);
        assert_eq!(divide(&[[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3], [1.5; 3]]).len(), 3);
        assert_eq!(divide(&[[0.0; 3]; 2]).len(), 0);
        let crossing = [[0.0; 3], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(divide(&crossing).len(), 2);
    }

    /// A star-shaped outline whose every other corner is concave.
    fn saw(corners: u32) -> Vec<[f64; 3]> {
        let place = |i: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(corners);
            let radius = 1.0 + 0.5 * f64::from(i % 2);
            [radius * angle.cos(), radius * angle.sin(), 0.0]
        };
        (0..corners).map(place).collect()
    }

    #[test]
    fn thousands_of_corners_are_clipped_and_many_more_are_given_up() {
        assert_eq!(divide(&saw(10_000)).len(), 9_998);
        let positions = saw(30_000);
        let corners: Vec<u32> = (0..30_000).collect();
        assert_eq!(Triangulator::default().triangulate(&corners, &positions), None);
    }

    proptest! {
        #[test]
        fn star_shaped_polygons_keep_their_area(
            radii in prop::collection::vec(1_u32..9, 3..30),
        ) {
            let n = radii.len() as f64;
            let positions: Vec<[f64; 3]> = radii
                .iter()
                .enumerate()
                .map(|(i, &r)| {
                    let angle = std::f64::consts::TAU * i as f64 / n;
                    [f64::from(r) * angle.cos(), f64::from(r) * angle.sin(), 0.25]
                })
                .collect();
            let triangles = divide(&positions);
            let areas: Vec<f64> =
                triangles.iter().map(|&t| area_vector(&positions, t).z).collect();
            let outline: f64 = (0..positions.len())
                .map(|i| {
                    let (p, q) = (positions[i], positions[(i + 1) % positions.len()]);
                    0.5 * (p[0] * q[1] - p[1] * q[0])
                })
                .sum();
            // Rounding of the corners may make a turn of 180 degrees slightly negative.
            prop_assert!(areas.iter().all(|&a| a > -1e-12), "{:?}", areas);
            prop_assert!((areas.iter().sum::<f64>() - outline).abs() < 1e-9);
        }
    }
}
