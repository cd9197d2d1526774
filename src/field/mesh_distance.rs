//! The signed distance to a triangle mesh.
//!
//! The magnitude is the exact distance to the nearest face, whatever the mesh. Value, gradient and
//! sign are functions of the point and its nearest face alone: so all queries agree to the bit.
//!
//! Outside of the mesh's box every point is outside of the solid. That cuts off the bulges that
//! winding numbers of several open sheets can have.
//!
//! What this is not: where bodies overlap, the faces inside of the union still count, so that the
//! magnitude is too small there; the sign is right.

use super::balls::ROUNDING;
use super::order::{serpentine, sorted};
use super::report::Report;
use super::search::{Faces, MARKS, Nearest, Place, Search};
use super::sides::{Cells, Sides};
use super::sign::Side;
use super::stand_ins::{Beside, For};
use super::surface::{Surface, Unusable};
use super::triangle::Feature;
use crate::expr::{Failure, Interest, Oracle, Queries};
use crate::geom::Aabb;
use crate::mesh::Mesh;
use crate::num::Interval;
use glam::DVec3;
use pulp::{Simd, WithSimd};
use std::cell::RefCell;
use std::fmt;

/// Distance from a face, in units of the mesh's size, or from an edge, in units of its length, at which the
/// direction from the closest point is mostly rounding.
const TOUCHING: f64 = 1.0 / (1_u64 << 44) as f64;

/// The signed distance to a triangle mesh, negative inside, in model units.
pub struct MeshDistance {
    name: String,
    pub(super) bounds: Aabb,
    pub(super) faces: Faces,
    pub(super) sides: Sides,
    report: Report,
}

impl fmt::Debug for MeshDistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, report, .. } = self;
        f.debug_struct("MeshDistance").field("name", name).field("report", report).finish()
    }
}

thread_local! {
    /// Scratch memory, kept from one run of queries to the next. Never changes an answer.
    static SEARCH: RefCell<Search> = RefCell::default();
}

/// Scratch memory of a run of queries. Never changes an answer.
pub(super) struct Memory<'a> {
    pub(super) search: &'a mut Search,
    cells: Cells,
}

/// Value and gradient at a point.
pub(super) struct Answer {
    pub(super) value: f64,
    pub(super) gradient: DVec3,
}

/// What there is to know at a point.
pub(super) struct Found {
    pub(super) place: Place,
    pub(super) nearest: Nearest,
    /// In the coordinates of the search.
    pub(super) distance: f64,
    pub(super) side: Side,
}

/// The signed distance to `mesh`, named `name` in messages.
///
/// The mesh need not be closed, oriented or free of overlaps: [`MeshDistance::report`] says what
/// was found and how sides are told.
///
/// # Errors
/// [`Unusable`] if the mesh has no faces, or faces that make no sense.
pub fn mesh_distance(mesh: &Mesh, name: &str) -> Result<MeshDistance, Unusable> {
    let surface = Surface::new(mesh)?;
    let bounds = surface.bounds();
    let faces = Faces::new(surface);
    let (sides, reason) = Sides::new(&faces);
    let report = Report {
        method: sides.method(),
        reason,
        faces: faces.surface.triangles.len(),
        repairs: faces.surface.repairs,
    };
    Ok(MeshDistance { name: name.to_owned(), bounds, faces, sides, report })
}

impl MeshDistance {
    /// A box that contains the solid: that of the mesh.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// What was made of the mesh.
    #[must_use]
    pub fn report(&self) -> &Report {
        &self.report
    }

    #[inline(always)]
    fn answer(&self, point: DVec3, way: Option<usize>, memory: &mut Memory<'_>) -> Answer {
        self.find(point, way, memory).map_or_else(
            #[inline(always)]
            || remote(point, self.faces.tree.frame().middle),
            #[inline(always)]
            |found| self.answer_of(&found),
        )
    }

    /// What there is to know at `point`; none if it is remote.
    #[inline(always)]
    pub(super) fn find(
        &self,
        point: DVec3,
        way: Option<usize>,
        memory: &mut Memory<'_>,
    ) -> Option<Found> {
        let place = self.faces.place(point)?;
        let nearest = match way {
            Some(way) => self.faces.nearest_on(way, place, memory.search),
            None => self.faces.nearest(place, memory.search),
        };
        let distance = nearest.closest.offset.length();
        let side = if distance == 0.0 || !self.bounds.contains(point) {
            Side::Outside
        } else {
            self.sides.side(&self.faces, place, (&nearest, distance), &mut memory.cells)
        };
        Some(Found { place, nearest, distance, side })
    }

    #[inline(always)]
    pub(super) fn answer_of(&self, found: &Found) -> Answer {
        let Found { nearest, distance, side, .. } = found;
        let gradient = if *distance > TOUCHING || !self.is_touching(nearest, *distance) {
            side.sign() * nearest.closest.offset / *distance
        } else {
            self.faces.normal(nearest.face).unwrap_or(DVec3::ZERO)
        };
        // Division by a power of two is exact.
        Answer { value: side.sign() * (distance / self.faces.tree.frame().scale), gradient }
    }

    /// Whether the direction from a closest point so near is mostly rounding.
    ///
    /// Where an edge or a corner is closest, the normal of a face is not the slope of the value: a step of
    /// Newton's method would miss the root by a part of the distance, each time that a mesh is read and contoured again.
    #[cold]
    fn is_touching(&self, nearest: &Nearest, distance: f64) -> bool {
        match nearest.closest.feature {
            // Its normal is the direction.
            Feature::Face => true,
            // The way from a corner nearby is a difference without rounding.
            Feature::Vertex(_) => distance == 0.0,
            // The rounding is that of the way along the edge.
            Feature::Edge(i) => {
                let corners = self.faces.surface.corners(nearest.face);
                distance <= TOUCHING * corners[i].distance(corners[(i + 1) % 3])
            }
        }
    }

    /// Calls `run` with the scratch memory of this thread.
    fn with_memory<R>(&self, run: impl FnOnce(Memory<'_>) -> R) -> R {
        SEARCH.with_borrow_mut(|search| {
            search.balls.keep_for(self.faces.identity);
            run(Memory { search, cells: Cells::default() })
        })
    }

    /// Answers for points.
    fn answer_all(&self, queries: Queries<'_>) {
        self.with_memory(|memory| {
            pulp::Arch::new().dispatch(Points { field: self, queries, memory });
        });
    }

    /// An enclosure of the values in the box with corners `lo` and `hi`, which are finite.
    fn enclosure(&self, lo: DVec3, hi: DVec3) -> Interval {
        let middle = 0.5 * lo + 0.5 * hi;
        let radius = (hi - middle).max(middle - lo).length();
        let mut value = [0.0];
        let at = [&[middle.x][..], &[middle.y], &[middle.z]];
        self.answer_all(Queries { at, value: &mut value, gradient: None });
        let [value] = value;
        let scale = self.faces.tree.frame().scale;
        let margin = radius + ROUNDING * (value.abs() + radius + 2.0 / scale);
        let (least, most) = (value.abs() - margin, value.abs() + margin);
        if self.sides.is_continuous() {
            return Interval::new(value - margin, value + margin);
        }
        // A hole can turn the sign without a face in sight.
        let side = match self.faces.place(middle) {
            _ if least <= 0.0 => None,
            None => Some(Side::Outside),
            Some(place) => self.sides.common(&self.faces, place, margin * scale),
        };
        match side {
            Some(Side::Outside) => Interval::new(least, most),
            Some(Side::Inside) if self.bounds.contains(lo) && self.bounds.contains(hi) => {
                Interval::new(-most, -least)
            }
            Some(Side::Inside) | None => Interval::new(-most, most),
        }
    }
}

/// The answer so far away that the mesh is a point; not finite only where `point` is not.
pub(super) fn remote(point: DVec3, middle: DVec3) -> Answer {
    // Halves, in units of the largest: nothing overflows.
    let half = 0.5 * point - 0.5 * middle;
    let unit = half.abs().max_element();
    let direction = half / unit;
    let length = direction.length();
    let distance = 2.0 * unit * length;
    let value = if point.is_finite() {
        distance.min(f64::MAX)
    } else if point.is_nan() {
        f64::NAN
    } else {
        f64::INFINITY
    };
    Answer { value, gradient: direction / length }
}

/// Point queries to be answered with the host's best instructions. Not closures: those would be
/// compiled apart, without them.
struct Points<'f, 'q> {
    field: &'f MeshDistance,
    queries: Queries<'q>,
    memory: Memory<'q>,
}

impl WithSimd for Points<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { field, queries, mut memory } = self;
        let Queries { at: [x, y, z], value, mut gradient } = queries;
        let point = |i: usize| DVec3::new(x[i], y[i], z[i]);
        let frame = field.faces.tree.frame();
        let order = sorted(value.len(), |i| frame.local(point(i)));
        // Who asks for gradients in small batches looks for roots, a lane for each.
        let roots = gradient.is_some() && value.len() <= MARKS;
        for turn in 0..value.len() {
            let i = order.get(turn).map_or(turn, |i| *i as usize);
            let answer = field.answer(point(i), roots.then_some(i), &mut memory);
            value[i] = answer.value;
            if let Some(rows) = &mut gradient {
                for (row, partial) in rows.iter_mut().zip(answer.gradient.to_array()) {
                    row[i] = partial;
                }
            }
        }
    }
}

/// A brick to be filled likewise.
struct Brick<'f, 'q> {
    field: &'f MeshDistance,
    at: [&'q [f64]; 3],
    value: &'q mut [f64],
    memory: Memory<'q>,
}

impl WithSimd for Brick<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { field, at: [x, y, z], value, mut memory } = self;
        for [i, j, k] in serpentine([x.len(), y.len(), z.len()]) {
            let point = DVec3::new(x[i], y[j], z[k]);
            value[(k * y.len() + j) * x.len() + i] = field.answer(point, None, &mut memory).value;
        }
    }
}

impl Oracle for MeshDistance {
    fn name(&self) -> &str {
        &self.name
    }

    fn points(&self, queries: Queries<'_>) -> Result<(), Failure> {
        self.answer_all(queries);
        Ok(())
    }

    fn is_faceted(&self) -> bool {
        true
    }

    fn brick(&self, at: [&[f64]; 3], value: &mut [f64]) -> Result<(), Failure> {
        self.with_memory(|memory| {
            pulp::Arch::new().dispatch(Brick { field: self, at, value, memory });
        });
        Ok(())
    }

    fn points_for(&self, queries: Queries<'_>, interest: Interest<'_>) -> Result<(), Failure> {
        self.with_memory(|memory| {
            pulp::Arch::new().dispatch(For { field: self, queries, interest, memory });
        });
        Ok(())
    }

    fn brick_beside(
        &self,
        at: [&[f64]; 3],
        levels: &[f64],
        value: &mut [f64],
    ) -> Result<(), Failure> {
        self.with_memory(|memory| {
            pulp::Arch::new().dispatch(Beside { field: self, at, levels, value, memory });
        });
        Ok(())
    }

    fn range(&self, at: [Interval; 3]) -> Interval {
        let nan = at.iter().any(|side| side.nan);
        let lo = DVec3::from_array(at.map(|side| side.lo));
        let hi = DVec3::from_array(at.map(|side| side.hi));
        let enclosure = if lo.is_finite() && hi.is_finite() {
            self.enclosure(lo, hi)
        } else {
            // No point inside is farther from a face than the size of the mesh.
            Interval::new(-4.0 / self.faces.tree.frame().scale, f64::INFINITY)
        };
        // Outside of the bounds the value is a distance, and not less than that of the bounds.
        let outside = (self.bounds.lo - hi).max(lo - self.bounds.hi).max(DVec3::ZERO);
        let gap = outside.length() * (1.0 - ROUNDING);
        let lo = if gap > 0.0 { enclosure.lo.max(gap) } else { enclosure.lo };
        Interval { lo, hi: enclosure.hi.max(lo), nan }
    }

    fn lipschitz(&self) -> f64 {
        if self.sides.is_continuous() { 1.0 } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::super::report::SignMethod;
    use super::super::samples::{Uniform, cube, kinds, mapped, sphere};
    use super::super::triangle::{closest, unit_normal};
    use super::*;

    fn value(field: &MeshDistance, p: DVec3) -> f64 {
        let mut value = [0.0];
        let at = [&[p.x][..], &[p.y], &[p.z]];
        field.points(Queries { at, value: &mut value, gradient: None }).unwrap();
        value[0]
    }

    fn gradient(field: &MeshDistance, p: DVec3) -> DVec3 {
        let (mut value, [mut x, mut y, mut z]) = ([0.0], [[0.0]; 3]);
        let at = [&[p.x][..], &[p.y], &[p.z]];
        let gradient = Some([&mut x[..], &mut y, &mut z]);
        field.points(Queries { at, value: &mut value, gradient }).unwrap();
        DVec3::new(x[0], y[0], z[0])
    }

    /// The distance to the box [0, 1]^3.
    fn to_cube(p: DVec3) -> f64 {
        let q = (p - 0.5).abs() - 0.5;
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
    }

    #[test]
    fn a_cube_has_the_closed_form() {
        let field = mesh_distance(&cube(), "cube").unwrap();
        let mut random = Uniform(1);
        for _ in 0..2000 {
            let p = random.point(-1.0, 2.0);
            assert!((value(&field, p) - to_cube(p)).abs() < 4e-16, "{p}");
        }
        for p in [DVec3::ZERO, DVec3::ONE, DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.5, 1.0, 0.0)] {
            assert_eq!(value(&field, p).to_bits(), 0);
        }
    }

    #[test]
    fn gradients_are_unit_vectors_from_the_closest_point() {
        let field = mesh_distance(&cube(), "cube").unwrap();
        for (p, expected) in [
            ([0.5, 0.5, 0.9], [0.0, 0.0, 1.0]),
            ([0.5, 0.5, 3.0], [0.0, 0.0, 1.0]),
            ([0.25, 0.5, 1.0], [0.0, 0.0, 1.0]),
            ([0.1, 0.5, 0.4], [-1.0, 0.0, 0.0]),
            ([-3.0, 0.5, -4.0], [-0.6, 0.0, -0.8]),
        ] {
            let found = gradient(&field, p.into());
            assert!(found.distance(expected.into()) < 1e-15, "{p:?} {found}");
        }
    }

    #[test]
    fn gradients_are_slopes_however_near_edges_and_corners() {
        let field = mesh_distance(&cube(), "cube").unwrap();
        let check = |foot: DVec3, way: DVec3, off: f64| {
            let p = foot + off * way;
            let found = gradient(&field, p);
            let expected = (p - foot) / (p - foot).length();
            assert!(found.distance(expected) < 1e-2, "{off} {way} {found}");
            assert!((value(&field, p) - (p - foot).length()).abs() < 1e-17, "{off} {way}");
        };
        // The closest point of an edge is rounded in units of its length, which is 1 here.
        for off in [1e-3, 1e-9, 1e-12, 2e-13] {
            check(DVec3::new(0.3, 0.0, 0.0), DVec3::new(0.0, -0.6, -0.8), off);
        }
        for off in [1e-3, 1e-9, 1e-12, 1e-15] {
            check(DVec3::ZERO, DVec3::new(-2.0, -1.0, -2.0) / 3.0, off);
        }
    }

    #[test]
    fn a_tetrahedron_has_the_distance_of_its_planes_inside() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mesh = Mesh {
            positions: corners.iter().map(|p| p.to_array()).collect(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let field = mesh_distance(&mesh, "tetrahedron").unwrap();
        let mut random = Uniform(5);
        for _ in 0..1000 {
            let p = random.point(0.0, 0.6);
            let oblique = (1.0 - p.element_sum()) / 3.0_f64.sqrt();
            let inside = p.min_element().min(oblique);
            if inside > 0.0 {
                assert!((value(&field, p) + inside).abs() < 4e-16);
            } else {
                assert!(value(&field, p) >= -inside - 4e-16);
            }
        }
    }

    #[test]
    fn a_sphere_of_triangles_is_a_sphere_to_second_order() {
        let mut errors = Vec::new();
        for levels in [3, 4, 5] {
            let field = mesh_distance(&sphere(levels), "sphere").unwrap();
            let mut random = Uniform(9);
            let error = (0..500).map(|_| {
                let p = random.point(-1.5, 1.5);
                (value(&field, p) - (p.length() - 1.0)).abs()
            });
            errors.push(error.fold(0.0, f64::max));
        }
        // The octahedron's faces are cut unevenly: the order is reached from above.
        for pair in errors.windows(2) {
            assert!((3.5..4.5).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
    }

    #[test]
    fn the_tree_gives_the_bits_of_trying_every_face() {
        let mut random = Uniform(11);
        let mut positions = Vec::new();
        // Large, small, needle-shaped and flat triangles.
        for i in 0..1200 {
            let size = [0.5, 0.05, 1e-4, 1e-9][i % 4];
            let a = random.point(0.0, 1.0);
            let b = a + size * random.point(-1.0, 1.0);
            let c = match i % 3 {
                0 => a + size * random.point(-1.0, 1.0),
                1 => 0.5 * (a + b),
                _ => a.lerp(b, 0.3) + 1e-9 * random.point(-1.0, 1.0),
            };
            positions.extend([a, b, c].map(|p| p.to_array()));
        }
        let triangles = (0..1200).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let mesh = Mesh { positions, triangles };
        let field = mesh_distance(&mesh, "soup").unwrap();
        let scale = field.faces.tree.frame().scale;
        let mut search = Search::default();
        for i in 0..300 {
            let p = random.point(-0.5, 1.5) * if i % 5 == 0 { 1e5 } else { 1.0 };
            let place = field.faces.place(p).unwrap();
            let squared = |face: usize| {
                let corners = field.faces.surface.corners(face);
                closest(place.scaled, &corners, unit_normal(corners)).offset.length_squared()
            };
            let brute = (0..1200).min_by(|a, b| squared(*a).total_cmp(&squared(*b))).unwrap();
            let found = field.faces.nearest(place, &mut search);
            assert_eq!((found.face, squared(found.face)), (brute, squared(brute)), "{p}");
            let exact = found.closest.offset.length() / scale;
            assert_eq!(value(&field, p).abs(), exact);
        }
    }

    #[test]
    fn parts_far_from_the_origin_keep_their_precision() {
        let shift = DVec3::new(1e7, -2e7, 4e7);
        let field = mesh_distance(&mapped(&cube(), |p| p + shift), "far").unwrap();
        let mut random = Uniform(2);
        for _ in 0..500 {
            // Rounding the coordinates is not the field's error.
            let p = (random.point(-1.0, 2.0) + shift) - shift;
            assert!((value(&field, p + shift) - to_cube(p)).abs() < 4e-16);
        }
    }

    #[test]
    fn sizes_from_tiny_to_huge_and_points_from_near_to_far_are_finite() {
        for size in [1e-300, 1e-9, 1.0, 1e12, 1e300] {
            let field = mesh_distance(&mapped(&cube(), |p| p * size), "sized").unwrap();
            assert!((value(&field, DVec3::splat(0.5 * size)) / size + 0.5).abs() < 1e-15);
            for far in [1.5, 1e6, 1e17, 1e18, 1e19, 1e30, 1e200, 1e307] {
                let p = DVec3::new(far * size, 0.5 * size, 0.5 * size);
                if !p.is_finite() {
                    continue;
                }
                let expected = (far - 1.0) * size;
                assert!((value(&field, p) / expected - 1.0).abs() < 1e-15, "{size} {far}");
                assert!(gradient(&field, p).distance(DVec3::X) < 1e-15);
            }
        }
        let field = mesh_distance(&cube(), "cube").unwrap();
        assert_eq!(value(&field, DVec3::splat(f64::MAX)), f64::MAX);
        assert_eq!(value(&field, DVec3::splat(f64::INFINITY)), f64::INFINITY);
        assert!(value(&field, DVec3::new(f64::NAN, 0.0, 0.0)).is_nan());
    }

    #[test]
    fn ranges_enclose_the_values() {
        let mut random = Uniform(13);
        for (mesh, size) in [(cube(), 1.0), (sphere(2), 1.0), (mapped(&cube(), |p| 1e-6 * p), 1e-6)]
        {
            let field = mesh_distance(&mesh, "any").unwrap();
            for _ in 0..200 {
                let middle = random.point(-1.5, 2.5) * size;
                let half = random.point(0.0, 0.5) * size * random.next();
                let side = |a: usize| Interval::new(middle[a] - half[a], middle[a] + half[a]);
                let range = field.range([side(0), side(1), side(2)]);
                for _ in 0..20 {
                    let p = middle + half * random.point(-1.0, 1.0);
                    let value = value(&field, p);
                    assert!(range.contains(value), "{p} {value} {range:?}");
                }
                assert!(range.hi - range.lo <= 2.0 * half.length() * (1.0 + 1e-9) + 1e-12 * size);
            }
            let all = Interval::new(f64::NEG_INFINITY, f64::INFINITY);
            let whole = field.range([all; 3]);
            assert!(whole.lo < 0.0 && whole.lo.is_finite() && whole.hi == f64::INFINITY);
            assert!(field.range([Interval::ANYTHING; 3]).nan);
        }
    }

    #[test]
    fn crossings_on_a_grid_line_through_a_vertex_lie_at_the_vertex() {
        // Vertices of a marched mesh lie on grid lines: so does every vertex on three of these.
        let mesh = mapped(&sphere(3), |p| p * 1.7);
        let field = mesh_distance(&mesh, "sphere").unwrap();
        for position in &mesh.positions {
            let vertex = DVec3::from_array(*position);
            for axis in 0..3 {
                let slope = vertex[axis] / vertex.length();
                if slope.abs() < 0.1 {
                    continue;
                }
                let step = 1e-13 * if slope > 0.0 { 1.0 } else { -1.0 };
                let mut moved = [vertex; 2];
                moved[0][axis] -= step;
                moved[1][axis] += step;
                assert_eq!(value(&field, vertex), 0.0);
                assert!(value(&field, moved[0]) < 0.0 && value(&field, moved[1]) > 0.0);
            }
        }
    }

    #[test]
    fn bricks_give_the_bits_of_single_points() {
        let mut random = Uniform(17);
        for mesh in kinds() {
            let field = mesh_distance(&mesh, "any").unwrap();
            for (counts, step) in [
                ([16, 16, 16], 0.1),
                ([16, 16, 16], 0.003),
                ([17, 3, 5], 0.2),
                ([1, 1, 40], 0.05),
                ([2, 1, 1], 1e17),
                ([1, 1, 1], 0.0),
            ] {
                let origin = random.point(-1.2, 0.7);
                let axis = |a: usize| -> Vec<f64> {
                    // A regular grid through the origin makes ties.
                    (0..counts[a])
                        .map(|i| (origin[a] / step).round().max(-99.0) * step + i as f64 * step)
                        .map(|x| if x.is_nan() { origin[a] } else { x })
                        .collect()
                };
                let (x, y, z) = (axis(0), axis(1), axis(2));
                let mut values = vec![0.0; x.len() * y.len() * z.len()];
                field.brick([&x, &y, &z], &mut values).unwrap();
                for (n, brick) in values.iter().enumerate() {
                    let p = DVec3::new(
                        x[n % x.len()],
                        y[n / x.len() % y.len()],
                        z[n / (x.len() * y.len())],
                    );
                    assert_eq!(value(&field, p).to_bits(), brick.to_bits(), "{p}");
                }
            }
        }
    }

    #[test]
    fn the_order_of_points_does_not_show() {
        let mut random = Uniform(23);
        for mesh in kinds() {
            let field = mesh_distance(&mesh, "any").unwrap();
            let points: Vec<DVec3> = (0..400).map(|_| random.point(-1.3, 1.3)).collect();
            let [x, y, z] = [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect::<Vec<f64>>());
            let mut values = vec![0.0; points.len()];
            let at = [&x[..], &y, &z];
            field.points(Queries { at, value: &mut values, gradient: None }).unwrap();
            for (p, together) in points.iter().zip(values) {
                assert_eq!(value(&field, *p).to_bits(), together.to_bits());
            }
        }
    }

    #[test]
    fn sides_are_those_of_the_winding_number() {
        let mut random = Uniform(29);
        for mesh in kinds() {
            let field = mesh_distance(&mesh, "any").unwrap();
            for _ in 0..400 {
                let p = random.point(-1.5, 1.5);
                let place = field.faces.place(p).unwrap();
                let number =
                    super::super::winding::exact(field.faces.surface.faces(), place.scaled);
                let found = value(&field, p);
                assert!(
                    (number > 0.5) == (found < 0.0)
                        || (number - 0.5).abs() < 0.01
                        || !field.bounds().contains(p),
                    "{p} {number} {found}"
                );
            }
        }
    }

    #[test]
    fn the_method_fits_the_mesh() {
        let methods: Vec<SignMethod> = kinds()
            .iter()
            .map(|mesh| mesh_distance(mesh, "any").unwrap().report().method)
            .collect();
        use SignMethod::{Pseudonormals, WindingNumbers};
        assert_eq!(
            methods,
            [Pseudonormals, WindingNumbers, WindingNumbers, WindingNumbers, Pseudonormals]
        );
    }

    #[test]
    fn ranges_of_open_meshes_enclose_the_values_and_are_signed_away_from_holes() {
        let mut random = Uniform(31);
        for mesh in kinds() {
            let field = mesh_distance(&mesh, "any").unwrap();
            let mut signed = 0;
            for _ in 0..300 {
                let middle = random.point(-1.5, 1.5);
                let half = random.point(0.0, 0.2) * random.next();
                let side = |a: usize| Interval::new(middle[a] - half[a], middle[a] + half[a]);
                let range = field.range([side(0), side(1), side(2)]);
                signed += usize::from(range.is_inside() || range.is_outside());
                for _ in 0..10 {
                    let p = middle + half * random.point(-1.0, 1.0);
                    let value = value(&field, p);
                    assert!(range.contains(value), "{p} {value} {range:?}");
                }
            }
            assert!(signed > 100, "{signed}");
        }
    }
}
