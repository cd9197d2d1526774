//! Volume, area, bounds, centroid and the quality of triangles.
//!
//! Volumes are sums of tetrahedra about the middle of the bounds, so a part far from the origin
//! loses nothing; sums are pairwise, with an error that grows with the logarithm of the number of
//! triangles. The result does not depend on the number of threads. Triangles with a corner that is
//! no vertex are left out.

use super::Mesh;
use crate::geom::Aabb;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Bars of the histogram of least angles, 5 degrees each, from 0 to 60 degrees.
pub const ANGLE_BARS: usize = 12;

/// Triangles summed in order before sums are added pairwise; each part has the same error bound
/// whatever the number of threads.
const TRIANGLES_A_PIECE: usize = 1 << 10;

/// What [`measure`] finds; lengths in model units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measures {
    /// Volume enclosed: positive where triangles are counter-clockwise from outside. Meaningful
    /// for closed meshes only.
    pub volume: f64,
    /// Sum of the areas of the triangles.
    pub area: f64,
    /// Corner of least coordinates of all vertices; infinite if there are none.
    pub lo: [f64; 3],
    /// Corner of greatest coordinates of all vertices; minus infinite if there are none.
    pub hi: [f64; 3],
    /// Centre of mass of the solid enclosed; `None` where the volume is zero.
    pub centroid: Option<[f64; 3]>,
    /// How good the triangles are.
    pub quality: Quality,
    /// Sides of the triangles; a side that two triangles share counts twice.
    pub sides: Sides,
}

/// The quality of the triangles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// Least angle of all triangles, in degrees; 60 if there are none.
    pub least_angle_deg: f64,
    /// Mean of the triangles' least angles, in degrees; 0 if there are no triangles.
    pub mean_least_angle_deg: f64,
    /// How many triangles have their least angle in each 5 degrees from 0 to 60.
    pub least_angles: [u64; ANGLE_BARS],
    /// Least area relative to the mean area; 0 if there are no triangles or they have no area.
    pub least_relative_area: f64,
    /// Greatest ratio of longest side to inscribed diameter over that of the equilateral triangle,
    /// so 1 at best; infinite for a triangle of zero area, 1 if there are no triangles.
    pub greatest_aspect: f64,
}

/// Lengths of the triangles' sides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sides {
    /// The shortest; infinite if there are none.
    pub least: f64,
    /// The mean; 0 if there are none.
    pub mean: f64,
    /// The longest; 0 if there are none.
    pub greatest: f64,
}

/// The measures of `mesh`.
#[must_use]
pub fn measure(mesh: &Mesh) -> Measures {
    let bounds = bounds(mesh);
    let origin = origin(bounds);
    let tally = total(mesh, |tally: &mut Tally, corners| tally.include(corners, origin));
    let count = tally.triangles as f64;
    let mean = |sum: f64, count: f64| if count > 0.0 { sum / count } else { 0.0 };
    let mean_area = mean(tally.sums.area, count);
    let least_relative_area = if mean_area > 0.0 { tally.least_area / mean_area } else { 0.0 };
    let centroid = origin + tally.sums.moment / (4.0 * tally.sums.volume);
    Measures {
        volume: tally.sums.volume / 6.0,
        area: tally.sums.area,
        lo: bounds.lo.to_array(),
        hi: bounds.hi.to_array(),
        centroid: centroid.is_finite().then(|| centroid.to_array()),
        quality: Quality {
            least_angle_deg: tally.least_angle.to_degrees(),
            mean_least_angle_deg: mean(tally.sums.least_angle, count).to_degrees(),
            least_angles: tally.least_angles,
            least_relative_area,
            greatest_aspect: tally.greatest_aspect,
        },
        sides: Sides {
            least: tally.shortest,
            mean: mean(tally.sums.length, 3.0 * count),
            greatest: tally.longest,
        },
    }
}

/// The volume enclosed, negative where the mesh is inside out.
#[must_use]
pub fn volume(mesh: &Mesh) -> f64 {
    let origin = origin(bounds(mesh));
    let include = |sum: &mut Volume, [a, b, c]: [DVec3; 3]| {
        sum.0 += (a - origin).dot((b - origin).cross(c - origin));
    };
    total(mesh, include).0 / 6.0
}

/// The least box that contains every vertex.
#[must_use]
pub fn bounds(mesh: &Mesh) -> Aabb {
    Aabb::around(mesh.positions.iter().map(|&p| DVec3::from_array(p)))
}

/// The point that tetrahedra share.
fn origin(bounds: Aabb) -> DVec3 {
    if bounds.is_finite() { bounds.center() } else { DVec3::ZERO }
}

/// A quantity that adds up over triangles.
trait Sum: Default + Send {
    fn add(&mut self, other: Self);
}

/// Lets a sum include every triangle of `mesh`; the sums of pieces are added pairwise.
fn total<S: Sum>(mesh: &Mesh, include: impl Fn(&mut S, [DVec3; 3]) + Sync) -> S {
    let vertex = |number: u32| mesh.positions.get(number as usize).map(|&p| DVec3::from_array(p));
    let piece = |triangles: &[[u32; 3]]| {
        let mut sum = S::default();
        for &[a, b, c] in triangles {
            if let (Some(a), Some(b), Some(c)) = (vertex(a), vertex(b), vertex(c)) {
                include(&mut sum, [a, b, c]);
            }
        }
        sum
    };
    let mut sums: Vec<S> = mesh.triangles.par_chunks(TRIANGLES_A_PIECE).map(piece).collect();
    while sums.len() > 1 {
        let mut rest = sums.into_iter();
        let mut halved = Vec::with_capacity(rest.len().div_ceil(2));
        while let Some(mut sum) = rest.next() {
            if let Some(other) = rest.next() {
                sum.add(other);
            }
            halved.push(sum);
        }
        sums = halved;
    }
    sums.pop().unwrap_or_default()
}

/// Six times a volume.
#[derive(Default)]
struct Volume(f64);

impl Sum for Volume {
    fn add(&mut self, other: Self) {
        self.0 += other.0;
    }
}

/// Quantities that are added.
#[derive(Default)]
struct Sums {
    /// Six times the volume.
    volume: f64,
    /// Volume times centroid, times twenty-four.
    moment: DVec3,
    area: f64,
    length: f64,
    least_angle: f64,
}

/// Everything that one pass over the triangles collects.
struct Tally {
    triangles: u64,
    sums: Sums,
    least_area: f64,
    least_angle: f64,
    least_angles: [u64; ANGLE_BARS],
    greatest_aspect: f64,
    shortest: f64,
    longest: f64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            triangles: 0,
            sums: Sums::default(),
            least_area: f64::INFINITY,
            least_angle: std::f64::consts::FRAC_PI_3,
            least_angles: [0; ANGLE_BARS],
            greatest_aspect: 1.0,
            shortest: f64::INFINITY,
            longest: 0.0,
        }
    }
}

impl Tally {
    fn include(&mut self, [a, b, c]: [DVec3; 3], origin: DVec3) {
        let [p, q, r] = [a - origin, b - origin, c - origin];
        let volume = p.dot(q.cross(r));
        let doubled_area = (b - a).cross(c - a).length();
        self.triangles += 1;
        self.sums.volume += volume;
        self.sums.moment += volume * (p + q + r);
        self.sums.area += 0.5 * doubled_area;
        self.least_area = self.least_area.min(0.5 * doubled_area);

        let lengths = [(b - a).length(), (c - b).length(), (a - c).length()];
        let perimeter = lengths[0] + lengths[1] + lengths[2];
        let longest = lengths[0].max(lengths[1]).max(lengths[2]);
        let shortest = lengths[0].min(lengths[1]).min(lengths[2]);
        self.sums.length += perimeter;
        self.shortest = self.shortest.min(shortest);
        self.longest = self.longest.max(longest);
        // The inscribed radius is twice the area over the perimeter.
        let aspect = longest * perimeter / (2.0 * 3.0_f64.sqrt() * doubled_area);
        let aspect = if doubled_area > 0.0 { aspect } else { f64::INFINITY };
        self.greatest_aspect = self.greatest_aspect.max(aspect);

        let least_angle = least_angle([a, b, c], lengths, doubled_area);
        self.sums.least_angle += least_angle;
        self.least_angle = self.least_angle.min(least_angle);
        let bar = (least_angle.to_degrees() / 5.0) as usize;
        self.least_angles[bar.min(ANGLE_BARS - 1)] += 1;
    }
}

/// The angle opposite the shortest side, in radians: 0 for a triangle of zero area.
fn least_angle([a, b, c]: [DVec3; 3], lengths: [f64; 3], doubled_area: f64) -> f64 {
    let [ab, bc, ca] = lengths;
    let cosine_scaled = if ab <= bc && ab <= ca {
        (a - c).dot(b - c)
    } else if bc <= ca {
        (b - a).dot(c - a)
    } else {
        (c - b).dot(a - b)
    };
    if doubled_area > 0.0 { libm::atan2(doubled_area, cosine_scaled) } else { 0.0 }
}

impl Sum for Tally {
    fn add(&mut self, other: Self) {
        self.triangles += other.triangles;
        self.sums.volume += other.sums.volume;
        self.sums.moment += other.sums.moment;
        self.sums.area += other.sums.area;
        self.sums.length += other.sums.length;
        self.sums.least_angle += other.sums.least_angle;
        self.least_area = self.least_area.min(other.least_area);
        self.least_angle = self.least_angle.min(other.least_angle);
        for (bar, more) in self.least_angles.iter_mut().zip(other.least_angles) {
            *bar += more;
        }
        self.greatest_aspect = self.greatest_aspect.max(other.greatest_aspect);
        self.shortest = self.shortest.min(other.shortest);
        self.longest = self.longest.max(other.longest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{both, cube, sphere, tetrahedron};
    use std::f64::consts::PI;

    fn close(value: f64, expected: f64, relative: f64) {
        assert!((value - expected).abs() <= relative * expected.abs(), "{value} for {expected}");
    }

    #[test]
    fn the_cube_measures_as_it_should() {
        let found = measure(&cube());
        assert_eq!((found.volume, found.area), (1.0, 6.0));
        assert_eq!((found.lo, found.hi), ([0.0; 3], [1.0; 3]));
        assert_eq!(found.centroid, Some([0.5; 3]));
        close(found.quality.least_angle_deg, 45.0, 1e-15);
        close(found.quality.least_relative_area, 1.0, 1e-15);
        close(found.sides.greatest, 2.0_f64.sqrt(), 1e-15);
        assert_eq!(found.sides.least, 1.0);
        close(found.sides.mean, (2.0 + 2.0_f64.sqrt()) / 3.0, 1e-15);
        assert_eq!(found.quality.least_angles.iter().sum::<u64>(), 12);
        // A right isosceles triangle: longest side over inscribed diameter, over that of the
        // equilateral triangle.
        let aspect = 2.0_f64.sqrt() / (2.0 - 2.0_f64.sqrt()) / 3.0_f64.sqrt();
        close(found.quality.greatest_aspect, aspect, 1e-14);
    }

    #[test]
    fn the_volume_is_the_same_alone() {
        for mesh in [cube(), tetrahedron(), sphere(5), Mesh::default()] {
            let found = measure(&mesh);
            assert_eq!(volume(&mesh), found.volume);
        }
    }

    #[test]
    fn the_tetrahedron_measures_as_it_should() {
        let found = measure(&tetrahedron());
        close(found.volume, 1.0 / 6.0, 1e-15);
        close(found.area, 1.5 + 3.0_f64.sqrt() / 2.0, 1e-15);
        for value in found.centroid.unwrap() {
            close(value, 0.25, 1e-15);
        }
    }

    #[test]
    fn volume_and_area_of_the_sphere_converge_with_second_order() {
        let error = |times| {
            let found = measure(&sphere(times));
            (4.0 / 3.0 * PI - found.volume, 4.0 * PI - found.area)
        };
        let (coarse, fine) = (error(5), error(6));
        close(coarse.0 / fine.0, 4.0, 0.01);
        close(coarse.1 / fine.1, 4.0, 0.01);
    }

    #[test]
    fn measures_do_not_suffer_from_distance_to_the_origin() {
        let mut far = sphere(5);
        let near = measure(&far);
        // A shift by a power of two after rounding to multiples of 2^-20 is exact.
        for value in far.positions.iter_mut().flatten() {
            *value = (*value * 1_048_576.0).round() / 1_048_576.0;
        }
        let exact = measure(&far);
        for value in far.positions.iter_mut().flatten() {
            *value += 4_294_967_296.0;
        }
        let shifted = measure(&far);
        close(exact.volume, near.volume, 1e-5);
        assert_eq!(shifted.volume, exact.volume);
        assert_eq!(shifted.area, exact.area);
        assert_eq!(shifted.quality, exact.quality);
    }

    #[test]
    fn the_volume_of_a_large_mesh_is_exact_to_many_digits() {
        // A block whose top is a range of integer heights: every tetrahedron's volume is an
        // integer, and so is their exact sum.
        let n = 300_u32;
        let height = |x: u32, y: u32| 1 + x.wrapping_mul(2_654_435_761) % 97 + y * 7 % 13;
        let mut mesh = Mesh::default();
        for top in [1, 0] {
            for y in 0..=n {
                for x in 0..=n {
                    let z = f64::from(top * height(x, y));
                    mesh.positions.push([f64::from(x), f64::from(y), z]);
                }
            }
        }
        let at = |x: u32, y: u32, bottom: u32| (bottom * (n + 1) + y) * (n + 1) + x;
        let mut quad = |a, b, c, d| mesh.triangles.extend([[a, b, c], [a, c, d]]);
        for i in 0..n {
            for j in 0..n {
                quad(at(i, j, 0), at(i + 1, j, 0), at(i + 1, j + 1, 0), at(i, j + 1, 0));
                quad(at(i, j, 1), at(i, j + 1, 1), at(i + 1, j + 1, 1), at(i + 1, j, 1));
            }
            quad(at(i, 0, 1), at(i + 1, 0, 1), at(i + 1, 0, 0), at(i, 0, 0));
            quad(at(i + 1, n, 1), at(i, n, 1), at(i, n, 0), at(i + 1, n, 0));
            quad(at(0, i + 1, 1), at(0, i, 1), at(0, i, 0), at(0, i + 1, 0));
            quad(at(n, i, 1), at(n, i + 1, 1), at(n, i + 1, 0), at(n, i, 0));
        }
        let exact: i128 = mesh
            .triangles
            .iter()
            .map(|corners| {
                let [a, b, c] =
                    corners.map(|v| mesh.positions[v as usize].map(|value| value as i128));
                a[0] * (b[1] * c[2] - b[2] * c[1])
                    + a[1] * (b[2] * c[0] - b[0] * c[2])
                    + a[2] * (b[0] * c[1] - b[1] * c[0])
            })
            .sum();
        assert!(crate::mesh::check(&mesh).is_sound());
        // Irrational steps, so that every product rounds; the scale is undone exactly enough.
        let scale = 1.0 / 3.0;
        for value in mesh.positions.iter_mut().flatten() {
            *value = *value * scale + 1000.0;
        }
        let expected = exact as f64 / 6.0 * scale * scale * scale;
        close(volume(&mesh), expected, 1e-12);
    }

    #[test]
    fn parts_add_up_and_inversion_changes_the_sign() {
        let mut two = both(cube(), &cube());
        for position in &mut two.positions[8..] {
            position[0] += 9.0;
        }
        close(volume(&two), 2.0, 1e-15);
        let mut inverted = cube();
        for corners in &mut inverted.triangles {
            corners.swap(0, 1);
        }
        assert_eq!(volume(&inverted), -1.0);
        assert_eq!(measure(&inverted).centroid, Some([0.5; 3]));
    }

    #[test]
    fn flat_and_empty_meshes_have_measures() {
        let flat = Mesh {
            positions: vec![[0.0; 3], [1.0; 3], [2.0; 3]],
            triangles: vec![[0, 1, 2], [0, 1, 9]],
        };
        let found = measure(&flat);
        assert_eq!((found.volume, found.area, found.centroid), (0.0, 0.0, None));
        assert_eq!(found.quality.least_angle_deg, 0.0);
        assert_eq!(found.quality.least_angles[0], 1);
        assert_eq!(found.quality.greatest_aspect, f64::INFINITY);
        let empty = measure(&Mesh::default());
        assert_eq!((empty.volume, empty.area, empty.sides.mean), (0.0, 0.0, 0.0));
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let mesh = sphere(6);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| measure(&mesh))
        };
        assert_eq!(on(1), on(3));
    }
}
