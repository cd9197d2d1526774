//! Distance from points to a triangle, for any triangle.
//!
//! [`closest`] finds the closest point and what it lies on, exactly at corners: the faces around
//! a vertex give the same bits there, and so do the two faces of an edge.
//!
//! [`Packet`] holds the triangles of a leaf in single precision, to tell which of them are worth
//! [`closest`]: each in a frame of its own, origin at a corner, first axis along the longest edge,
//! third axis normal. A squared distance is then the height squared plus a distance in the plane,
//! taken as the least over three segments, or zero for points over the inside. Nothing is divided
//! by an area: a triangle without one is its edges, a triangle without edges is a point, and
//! needles lose no accuracy because the frame is orthonormal to rounding whatever the shape.

use crate::geom::bvh::{LEAF, NO_ITEM};
use glam::DVec3;

/// Height over longest edge under which a triangle counts as having no area: its normal would be
/// more rounding than direction.
const FLAT: f64 = 1.0 / (1_u64 << 40) as f64;
/// Height over longest edge that is only rounding: eight units in the last place.
const NO_HEIGHT: f64 = 1.0 / (1_u64 << 49) as f64;
/// Squared lengths below this, in units of the mesh, are no lengths: their inverses overflow.
const NO_LENGTH: f64 = 1e-300;
/// Squared lengths below this are no lengths in single precision.
const NO_SHORT_LENGTH: f64 = 1e-30;
/// What single precision leaves in doubt of a distance, in units of the distance, twice what is
/// derived below.
const DOUBT: f32 = 1.0 / (1 << 16) as f32;
/// The same in units of the longest edge of all triangles.
const DOUBT_OF_EDGES: f32 = 1.0 / (1 << 17) as f32;
/// The same in units of the size of the tree's frame.
const DOUBT_OF_PLACES: f32 = 1.0 / (1 << 18) as f32;

/// Triangles of a leaf, one lane each. Lanes without a triangle are NaN, which is nearer than
/// nothing.
#[derive(Clone, Debug)]
pub struct Packet {
    origin: [[f32; LEAF]; 3],
    along: [[f32; LEAF]; 3],
    across: [[f32; LEAF]; 3],
    normal: [[f32; LEAF]; 3],
    /// Length of the longest edge, from (0, 0) to (length, 0).
    length: [f32; LEAF],
    /// The third corner.
    apex: [[f32; LEAF]; 2],
    /// Inverse squared lengths of the edges from (length, 0) to the apex, and from (0, 0) to it.
    inverse: [[f32; LEAF]; 2],
    /// Numbers of the triangles.
    number: [u32; LEAF],
}

/// One lane of a [`Packet`].
#[derive(Clone, Copy)]
struct Lane {
    origin: [f32; 3],
    along: [f32; 3],
    across: [f32; 3],
    normal: [f32; 3],
    length: f32,
    apex: [f32; 2],
    inverse: [f32; 2],
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `value` limited to [0, `top`].
#[inline(always)]
fn limited(value: f32, top: f32) -> f32 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < top { value } else { top }
}

impl Lane {
    /// Squared distance to a point. Without branches, so that lanes run side by side.
    #[inline(always)]
    fn squared_distance(self, point: [f32; 3]) -> f32 {
        let q = [point[0] - self.origin[0], point[1] - self.origin[1], point[2] - self.origin[2]];
        let (x, y, z) = (dot(q, self.along), dot(q, self.across), dot(q, self.normal));
        let [ax, ay] = self.apex;

        let ex = x - limited(x, self.length);
        let base = ex * ex + y * y;

        let (bx, u) = (ax - self.length, x - self.length);
        let t = limited((u * bx + y * ay) * self.inverse[0], 1.0);
        let (fx, fy) = (u - t * bx, y - t * ay);
        let right = fx * fx + fy * fy;

        let t = limited((x * ax + y * ay) * self.inverse[1], 1.0);
        let (gx, gy) = (x - t * ax, y - t * ay);
        let left = gx * gx + gy * gy;

        let least = if right < base { right } else { base };
        let least = if left < least { left } else { least };
        let inside = (y > 0.0) & (bx * y - ay * u > 0.0) & (ay * x - ax * y > 0.0);
        let planar = if inside { 0.0 } else { least };
        z * z + planar
    }
}

/// What single precision leaves in doubt.
///
/// Coordinates of a point and of a triangle's origin, in [-1, 1] apart from the distance, are
/// rounded by half of 2^-23 of themselves: together 2^-20.7 at worst, and 2^-22.2 of the distance. In
/// the triangle's frame a coordinate is then off by five roundings of the distance from the
/// origin, the three of them by less than 2^-19.5 of it; it is no more than the distance from the
/// triangle and the longest edge. This comes twice, for what is found and for what is sought; that of
/// boxes, 2^-18 of the distance, is added.
#[derive(Clone, Copy, Debug)]
pub struct Doubt {
    /// What does not grow with the distance.
    constant: f32,
}

impl Doubt {
    /// That of triangles in the tree's frame whose longest edge is `longest`.
    #[must_use]
    pub fn new(longest: f64) -> Self {
        Self { constant: DOUBT_OF_EDGES * longest as f32 + DOUBT_OF_PLACES }
    }

    /// The bound on a packet's squared distances, and on those to boxes, that keeps the nearest
    /// triangle if one is at squared distance `squared`. With a `radius`, it keeps the triangle
    /// nearest to any point within that of the point in question.
    #[inline(always)]
    #[must_use]
    pub fn bound(self, squared: f32, radius: f32) -> f32 {
        let bound = (squared.sqrt() + 2.0 * radius) * (1.0 + DOUBT) + self.constant;
        let bound = bound * bound;
        // Finite, so that empty boxes at infinity stay out.
        if bound < f32::MAX { bound } else { f32::MAX }
    }
}

impl Packet {
    /// The triangles `numbers` of those whose corners `corners` gives, in the tree's frame;
    /// [`NO_ITEM`] leaves a lane empty.
    #[must_use]
    pub fn new(numbers: &[u32; LEAF], corners: impl Fn(u32) -> [DVec3; 3]) -> Self {
        let mut packet = Self {
            origin: [[f32::NAN; LEAF]; 3],
            along: [[0.0; LEAF]; 3],
            across: [[0.0; LEAF]; 3],
            normal: [[0.0; LEAF]; 3],
            length: [0.0; LEAF],
            apex: [[0.0; LEAF]; 2],
            inverse: [[0.0; LEAF]; 2],
            number: *numbers,
        };
        for (lane, number) in numbers.iter().enumerate() {
            if *number != NO_ITEM {
                packet.set(lane, corners(*number));
            }
        }
        packet
    }

    fn set(&mut self, lane: usize, corners: [DVec3; 3]) {
        let frame = Frame::of(corners);
        for axis in 0..3 {
            self.origin[axis][lane] = frame.origin[axis] as f32;
            self.along[axis][lane] = frame.along[axis] as f32;
            self.across[axis][lane] = frame.across[axis] as f32;
            self.normal[axis][lane] = frame.normal[axis] as f32;
        }
        let inverse = |x: f64, y: f64| {
            let squared = x * x + y * y;
            if squared > NO_SHORT_LENGTH { (1.0 / squared) as f32 } else { 0.0 }
        };
        let [x, y] = frame.apex;
        self.length[lane] = frame.length as f32;
        self.apex[0][lane] = x as f32;
        self.apex[1][lane] = y as f32;
        self.inverse[0][lane] = inverse(x - frame.length, y);
        self.inverse[1][lane] = inverse(x, y);
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> Lane {
        let triple = |rows: &[[f32; LEAF]; 3]| [rows[0][lane], rows[1][lane], rows[2][lane]];
        Lane {
            origin: triple(&self.origin),
            along: triple(&self.along),
            across: triple(&self.across),
            normal: triple(&self.normal),
            length: self.length[lane],
            apex: [self.apex[0][lane], self.apex[1][lane]],
            inverse: [self.inverse[0][lane], self.inverse[1][lane]],
        }
    }

    /// Numbers of the triangles.
    #[inline(always)]
    #[must_use]
    pub fn numbers(&self) -> &[u32; LEAF] {
        &self.number
    }

    /// Squared distances of `point`, NaN in lanes without a triangle. They may be too small for
    /// triangles with hardly any area, and too large by less than [`Doubt`] allows.
    #[inline(always)]
    #[must_use]
    pub fn squared_distances(&self, point: [f32; 3]) -> [f32; LEAF] {
        let mut squared = [0.0; LEAF];
        for (lane, squared) in squared.iter_mut().enumerate() {
            *squared = self.lane(lane).squared_distance(point);
        }
        squared
    }
}

/// An orthonormal frame in which a triangle is (0, 0), (length, 0), apex, in that sense.
struct Frame {
    origin: DVec3,
    along: DVec3,
    across: DVec3,
    normal: DVec3,
    length: f64,
    apex: [f64; 2],
}

impl Frame {
    fn of(corners: [DVec3; 3]) -> Self {
        let squared = |i: usize| (corners[(i + 1) % 3] - corners[i]).length_squared();
        let first = (0..3).max_by(|a, b| squared(*a).total_cmp(&squared(*b))).unwrap_or(0);
        let origin = corners[first];
        let base = corners[(first + 1) % 3] - origin;
        let side = corners[(first + 2) % 3] - origin;
        let length = base.length();
        let along = if length * length > NO_LENGTH { base / length } else { DVec3::X };
        // Twice: the first pass leaves an error of rounding over height, the second of rounding.
        let across = orthogonal(side, along)
            .filter(|(_, height)| *height > NO_HEIGHT * length)
            .and_then(|(across, _)| orthogonal(across, along));
        let across = across.map_or_else(|| along.any_orthonormal_vector(), |(across, _)| across);
        let normal = along.cross(across);
        let (x, y) = (side.dot(along), side.dot(across));
        // An arbitrary second axis may point away from the apex, by a rounding error.
        let sign = if y < 0.0 { -1.0 } else { 1.0 };
        Self {
            origin,
            along,
            across: sign * across,
            normal: sign * normal,
            length,
            apex: [x, sign * y],
        }
    }
}

/// Direction and length of `vector` less its part along the unit vector `axis`.
fn orthogonal(vector: DVec3, axis: DVec3) -> Option<(DVec3, f64)> {
    let rest = vector - vector.dot(axis) * axis;
    let length = rest.length();
    (length * length > NO_LENGTH).then(|| (rest / length, length))
}

/// The unit normal of a triangle, counter-clockwise; none for a triangle without area.
#[must_use]
pub fn unit_normal(corners: [DVec3; 3]) -> Option<DVec3> {
    let frame = Frame::of(corners);
    (frame.apex[1] > FLAT * frame.length).then_some(frame.normal)
}

/// What of a triangle a point lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// The inside.
    Face,
    /// The inside of the edge from corner `i` to the next.
    Edge(usize),
    /// Corner `i`.
    Vertex(usize),
}

/// The point of a triangle closest to another point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// From the closest point to the other point.
    pub offset: DVec3,
    /// What the closest point lies on.
    pub feature: Feature,
}

/// The closest point of the triangle with these `corners` and [`unit_normal`].
///
/// Points near a corner are measured from that corner, without rounding of edges.
#[inline(always)]
#[must_use]
pub fn closest(point: DVec3, corners: &[DVec3; 3], normal: Option<DVec3>) -> Closest {
    let from = corners.map(|corner| point - corner);
    let edge = |i: usize| corners[(i + 1) % 3] - corners[i];
    if let Some(normal) = normal
        && (0..3).all(|i| normal.cross(edge(i)).dot(from[i]) > 0.0)
    {
        let squared = from.map(|offset| offset.length_squared());
        let i = if squared[1] < squared[0] { 1 } else { 0 };
        let i = if squared[2] < squared[i] { 2 } else { i };
        return Closest { offset: normal.dot(from[i]) * normal, feature: Feature::Face };
    }
    let mut best = Closest { offset: from[0], feature: Feature::Vertex(0) };
    let mut least = from[0].length_squared();
    let mut consider = |candidate: Closest| {
        let squared = candidate.offset.length_squared();
        if squared < least {
            (best, least) = (candidate, squared);
        }
    };
    consider(Closest { offset: from[1], feature: Feature::Vertex(1) });
    consider(Closest { offset: from[2], feature: Feature::Vertex(2) });
    for i in 0..3 {
        let (j, edge) = ((i + 1) % 3, edge(i));
        let squared = edge.length_squared();
        let (ahead, beyond) = (from[i].dot(edge), from[j].dot(edge));
        if ahead > 0.0 && beyond < 0.0 && squared > NO_LENGTH {
            // From the nearer end, for the smaller rounding error.
            let offset = if ahead + beyond < 0.0 {
                from[i] - (ahead / squared) * edge
            } else {
                from[j] - (beyond / squared) * edge
            };
            consider(Closest { offset, feature: Feature::Edge(i) });
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(corners: [DVec3; 3]) -> Packet {
        let mut numbers = [NO_ITEM; LEAF];
        numbers[0] = 0;
        Packet::new(&numbers, |_| corners)
    }

    /// The distance, after checking that the packet's is as near to it as it promises.
    fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
        let exact = closest(point, &corners, unit_normal(corners)).offset.length();
        // In coordinates in which everything is within [-1, 1], as in a tree's frame.
        let far = corners.iter().chain([&point]);
        let scale = far.map(|p| p.distance(corners[0])).fold(0.0, f64::max).recip();
        let local = |p: DVec3| scale * (p - corners[0]);
        let squared = packet(corners.map(local)).squared_distances(local(point).as_vec3().into());
        assert!(squared[1..].iter().all(|s| s.is_nan()));
        let by_packet = f64::from(squared[0].sqrt()) / scale;
        let longest = (0..3).map(|i| corners[i].distance(corners[(i + 1) % 3])).fold(0.0, f64::max);
        let constant = f64::from(Doubt::new(scale * longest).constant) / scale;
        let allowed = f64::from(DOUBT) * exact + constant;
        // Half of it, for it comes twice; a quarter, if the derivation is right.
        assert!((by_packet - exact).abs() <= 0.25 * allowed, "{by_packet} {exact} {corners:?}");
        exact
    }

    fn triangle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [DVec3; 3] {
        [a.into(), b.into(), c.into()]
    }

    #[test]
    fn every_feature_of_a_triangle_is_reached() {
        let corners = triangle([0.0; 3], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
        for (point, expected, feature) in [
            ([1.0, 1.0, 2.0], 2.0, Feature::Face),
            ([1.0, 1.0, -2.0], 2.0, Feature::Face),
            ([2.0, -3.0, 4.0], 5.0, Feature::Edge(0)),
            ([-3.0, 1.0, 4.0], 5.0, Feature::Edge(2)),
            ([2.0 + 3.0, 1.5 + 4.0, 0.0], 5.0, Feature::Edge(1)),
            ([-2.0, -1.0, 2.0], 3.0, Feature::Vertex(0)),
            ([6.0, -1.0, 2.0], 3.0, Feature::Vertex(1)),
            ([-1.0, 5.0, -2.0], 3.0, Feature::Vertex(2)),
        ] {
            let point = DVec3::from_array(point);
            assert!((distance(point, corners) - expected).abs() < 1e-15 * 8.0);
            assert_eq!(closest(point, &corners, unit_normal(corners)).feature, feature);
        }
    }

    #[test]
    fn a_triangle_without_area_is_a_segment_and_without_edges_a_point() {
        let p = DVec3::new(1.0, 2.0, 2.0);
        let (a, b) = ([0.0; 3], [2.0, 0.0, 0.0]);
        let m = [1.0, 0.0, 0.0];
        for corners in [
            triangle(a, b, m),
            triangle(m, a, b),
            triangle(b, m, a),
            triangle(a, b, b),
            triangle(a, a, b),
            triangle(a, b, a),
        ] {
            assert_eq!(unit_normal(corners), None);
            assert!((distance(p, corners) - 8.0_f64.sqrt()).abs() < 1e-15 * 4.0);
        }
        assert_eq!(distance(p, triangle(a, a, a)), 3.0);
    }

    #[test]
    fn needles_keep_their_accuracy() {
        for height in [1e-3, 1e-7, 1e-12, 1e-15, 1e-17, 1e-300] {
            let corners = triangle([0.0; 3], [1.0, 1.0, 1.0], [0.5, 0.5 + height, 0.5]);
            for p in [[0.3, 0.3, 0.3], [0.7, 0.1, 0.4], [3.0, 4.0, 5.0], [-1.0, 0.0, 0.0]] {
                let p = DVec3::from_array(p);
                let t = (p.element_sum() / 3.0).clamp(0.0, 1.0);
                let to_edge = p.distance(DVec3::splat(t));
                assert!((distance(p, corners) - to_edge).abs() <= height + 1e-15, "{height} {p}");
            }
        }
    }

    #[test]
    fn distance_from_the_origin_costs_nothing() {
        let far = DVec3::new(1e7, -3e7, 2e7);
        let corners = triangle([0.0; 3], [0.5, 0.0, 0.125], [0.0, 0.75, 0.25]);
        let p = DVec3::new(0.25, 0.125, 1.0);
        let moved = corners.map(|c| c + far);
        assert_eq!(distance(p, corners), distance(p + far, moved));
    }

    #[test]
    fn a_corner_has_distance_zero_from_itself() {
        let corners = triangle([0.1, 0.2, 0.3], [1.1, 0.7, 0.2], [0.3, 1.7, 0.9]);
        for corner in corners {
            assert_eq!(closest(corner, &corners, unit_normal(corners)).offset, DVec3::ZERO);
        }
    }

    #[test]
    fn the_faces_of_a_vertex_and_of_an_edge_have_the_same_distance_to_the_bit() {
        let seed = 12;
        let mut random = super::super::samples::Uniform(seed);
        for _ in 0..2000 {
            let [a, b, c, d, p] = std::array::from_fn(|_| random.point(-1.0, 1.0));
            // Two faces of an edge, from other corners, in opposite senses.
            let [one, other] = [[a, b, c], [d, b, a]];
            let [found, twin] = [one, other].map(|at| closest(p, &at, unit_normal(at)));
            match (found.feature, twin.feature) {
                (Feature::Edge(0), Feature::Edge(1))
                | (Feature::Vertex(0), Feature::Vertex(2))
                | (Feature::Vertex(1), Feature::Vertex(1)) => {
                    let [s, t] = [found, twin].map(|c| c.offset.length_squared().to_bits());
                    assert_eq!(s, t, "{p} seed {seed}");
                }
                _ => {}
            }
        }
    }

    #[test]
    fn what_is_in_doubt_covers_the_error_of_a_packet() {
        let seed = 13;
        let mut random = super::super::samples::Uniform(seed);
        for round in 0..4000 {
            let size = [1.0, 0.1, 1e-3, 1e-6][round % 4];
            let middle = (1.0 - size) * random.point(-1.0, 1.0);
            let corners = std::array::from_fn(|_| middle + size * random.point(-1.0, 1.0));
            let reach = [1e-6, 1e-3, 1.0, 30.0][round / 4 % 4];
            let point = middle + reach * random.point(-1.0, 1.0);
            let exact = closest(point, &corners, unit_normal(corners)).offset.length_squared();
            let found = packet(corners).squared_distances(point.as_vec3().into())[0];
            let doubt = Doubt::new(2.0 * 3.0_f64.sqrt() * size);
            // Either is within what the other leaves in doubt.
            assert!(found <= doubt.bound(exact as f32, 0.0), "{found} {exact} seed {seed} {round}");
            assert!(exact as f32 <= doubt.bound(found, 0.0), "{found} {exact} seed {seed} {round}");
        }
    }
}
