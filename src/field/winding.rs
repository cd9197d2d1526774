//! Winding numbers of triangle soups: how often a surface encloses a point.
//!
//! The winding number is the sum of the signed solid angles of all faces over 4 pi: 1 inside and 0
//! outside of a closed surface, something between near holes.
//!
//! [`Winding`] sums near faces exactly and groups of far ones by the first three terms of their
//! Taylor series. The terms left out were measured at less than 0.01 ([`ERROR`] allows tenfold).
//! A number depends on the point alone, never on the query it is part of.
//!
//! Source: solid angle of a triangle after van Oosterom & Strackee 1983,
//! doi:10.1109/TBME.1983.325207; winding numbers as a test for inside after Jacobson, Kavan,
//! Sorkine-Hornung 2013, doi:10.1145/2461912.2461916; groups after Barill et al. 2018,
//! doi:10.1145/3197517.3201337, section 3.

use super::surface::Surface;
use crate::geom::bvh::{Child, LEAF, NO_ITEM, Node, WIDTH};
use crate::geom::{Aabb, Bvh};
use glam::{DMat3, DVec3};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Allowance for the error of [`Winding::number`].
pub const ERROR: f64 = 0.1;
/// Distance, in radii of a group, from which its series is used: the choice of Barill et al.
const FAR: f64 = 2.0;

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

/// Sums over some faces: the series of their winding number about `center`.
#[derive(Clone, Copy, Debug)]
struct Group {
    hull: Aabb,
    center: DVec3,
    /// Greatest distance of the faces from `center`.
    radius: f64,
    area: f64,
    /// Integral of the normal n.
    dipole: DVec3,
    /// Integral of x_i n_j, column j, x from `center`.
    first: DMat3,
    /// Half the integral of x_i x_j n_k: matrix k, in i and j.
    second: [DMat3; 3],
}

/// The matrix of products of `a` and `b`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl Group {
    /// The group of one face.
    fn face(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = 0.5 * (b - a).cross(c - a);
        let hull = Aabb::around(corners);
        // Corners from a corner, so that nothing is lost far from the origin.
        let center = a + ((b - a) + (c - a)) / 3.0;
        let from = corners.map(|corner| corner - center);
        // The integral of x x over a triangle about its centroid is area / 12 times this.
        let spread = from.iter().fold(DMat3::ZERO, |sum, x| sum + outer(*x, *x)) * (1.0 / 24.0);
        Self {
            hull,
            center,
            radius: from.iter().map(|x| x.length()).fold(0.0, f64::max),
            area: normal.length(),
            dipole: normal,
            first: DMat3::ZERO,
            second: normal.to_array().map(|n| spread * n),
        }
    }

    /// The group of the faces of all `parts`.
    fn union(parts: &[Self]) -> Self {
        let hull = parts.iter().fold(Aabb::EMPTY, |hull, part| hull.hull(part.hull));
        let area: f64 = parts.iter().map(|part| part.area).sum();
        let middle = hull.center();
        let moment = |part: &Self| part.area * (part.center - middle);
        let shift = parts.iter().fold(DVec3::ZERO, |sum, part| sum + moment(part)) / area;
        let center = if shift.is_finite() { middle + shift } else { middle };
        let farthest = (hull.hi - center).max(center - hull.lo).length();
        let reach = |part: &Self| part.center.distance(center) + part.radius;
        let mut union = Self {
            hull,
            center,
            radius: parts.iter().map(reach).fold(0.0, f64::max).min(farthest),
            area,
            dipole: DVec3::ZERO,
            first: DMat3::ZERO,
            second: [DMat3::ZERO; 3],
        };
        for part in parts {
            let d = part.center - center;
            union.dipole += part.dipole;
            union.first += part.first + outer(d, part.dipole);
            for k in 0..3 {
                let mixed = outer(d, part.first.col(k));
                union.second[k] += part.second[k]
                    + (mixed + mixed.transpose() + outer(d, d) * part.dipole[k]) * 0.5;
            }
        }
        union
    }
}

/// The groups of a node's children, one lane each, with the series gathered into the fewest
/// coefficients.
#[derive(Clone, Debug)]
struct Groups {
    center: [[f64; WIDTH]; 3],
    /// Squared distance from which the series is used; none for no group.
    far: [f64; WIDTH],
    dipole: [[f64; WIDTH]; 3],
    /// Trace of `first`.
    trace: [f64; WIDTH],
    /// Symmetric part of `first`: xx, yy, zz, xy + yx, yz + zy, zx + xz.
    quadratic: [[f64; WIDTH]; 6],
    /// Contractions of `second`.
    linear: [[f64; WIDTH]; 3],
    /// `second` as a cubic form: xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz.
    cubic: [[f64; WIDTH]; 10],
}

impl Groups {
    const NONE: Self = Self {
        center: [[0.0; WIDTH]; 3],
        far: [f64::NEG_INFINITY; WIDTH],
        dipole: [[0.0; WIDTH]; 3],
        trace: [0.0; WIDTH],
        quadratic: [[0.0; WIDTH]; 6],
        linear: [[0.0; WIDTH]; 3],
        cubic: [[0.0; WIDTH]; 10],
    };

    fn set(&mut self, lane: usize, group: &Group) {
        let m = group.first;
        let t = |i: usize, j: usize, k: usize| group.second[k].col(j)[i];
        let distance = FAR * group.radius;
        self.far[lane] = distance * distance;
        for axis in 0..3 {
            self.center[axis][lane] = group.center[axis];
            self.dipole[axis][lane] = group.dipole[axis];
            let contraction = |i: usize| 2.0 * t(i, axis, i) + t(i, i, axis);
            self.linear[axis][lane] = contraction(0) + contraction(1) + contraction(2);
            self.quadratic[axis][lane] = m.col(axis)[axis];
            let next = (axis + 1) % 3;
            self.quadratic[3 + axis][lane] = m.col(axis)[next] + m.col(next)[axis];
        }
        self.trace[lane] = m.col(0)[0] + m.col(1)[1] + m.col(2)[2];
        let twice = |i: usize, k: usize| t(i, i, k) + 2.0 * t(i, k, i);
        let mixed = 2.0 * (t(0, 1, 2) + t(1, 2, 0) + t(2, 0, 1));
        let cubic = [
            t(0, 0, 0),
            t(1, 1, 1),
            t(2, 2, 2),
            twice(0, 1),
            twice(0, 2),
            twice(1, 0),
            twice(1, 2),
            twice(2, 0),
            twice(2, 1),
            mixed,
        ];
        for (row, value) in self.cubic.iter_mut().zip(cubic) {
            row[lane] = value;
        }
    }

    /// Solid angles of the far groups; for every lane, whether it is near.
    #[inline(always)]
    fn solid_angles(&self, point: [f64; 3]) -> ([f64; WIDTH], [bool; WIDTH]) {
        let (mut angle, mut near) = ([0.0; WIDTH], [false; WIDTH]);
        for lane in 0..WIDTH {
            let [x, y, z] = [0, 1, 2].map(|axis| self.center[axis][lane] - point[axis]);
            let squared = x * x + y * y + z * z;
            let inverse = 1.0 / squared.sqrt();
            let (x, y, z) = (x * inverse, y * inverse, z * inverse);
            let q = |i: usize| self.quadratic[i][lane];
            let c = |i: usize| self.cubic[i][lane];
            let dipole =
                self.dipole[0][lane] * x + self.dipole[1][lane] * y + self.dipole[2][lane] * z;
            let quadratic =
                x * (q(0) * x + q(3) * y) + y * (q(1) * y + q(4) * z) + z * (q(2) * z + q(5) * x);
            let linear =
                self.linear[0][lane] * x + self.linear[1][lane] * y + self.linear[2][lane] * z;
            let cubic = x * x * (c(0) * x + c(3) * y + c(4) * z)
                + y * y * (c(1) * y + c(5) * x + c(6) * z)
                + z * z * (c(2) * z + c(7) * x + c(8) * y)
                + c(9) * x * y * z;
            let third = 15.0 * cubic - 3.0 * linear;
            let second = self.trace[lane] - 3.0 * quadratic + inverse * third;
            let sum = inverse * inverse * (dipole + inverse * second);
            let far = squared > self.far[lane];
            angle[lane] = if far { sum } else { 0.0 };
            near[lane] = !far;
        }
        (angle, near)
    }
}

/// Winding numbers of a surface around points.
#[derive(Clone, Debug)]
pub struct Winding {
    groups: Vec<Groups>,
}

impl Winding {
    /// Prepares the faces of `surface`, which are the items of `tree`. The tree may have been
    /// built from a scaled copy.
    #[must_use]
    pub fn new(surface: &Surface, tree: &Bvh) -> Self {
        let faces = |leaf: &[u32; LEAF]| -> Vec<Group> {
            let used = leaf.iter().filter(|face| **face != NO_ITEM);
            used.map(|face| Group::face(surface.corners(*face as usize))).collect()
        };
        let leaves: Vec<Group> =
            tree.leaves().par_iter().map(|leaf| Group::union(&faces(leaf))).collect();
        let mut groups = vec![Groups::NONE; tree.nodes().len()];
        let mut whole: Vec<Option<Group>> = vec![None; tree.nodes().len()];
        // Children come after their parents.
        for (number, node) in tree.nodes().iter().enumerate().rev() {
            let mut parts = Vec::with_capacity(WIDTH);
            for (lane, child) in node.children().enumerate() {
                let part = match child {
                    Child::Leaf(leaf) => Some(leaves[leaf]),
                    Child::Node(below) => whole[below].take(),
                    Child::Nothing => None,
                };
                if let Some(part) = part {
                    groups[number].set(lane, &part);
                    parts.push(part);
                }
            }
            whole[number] = Some(Group::union(&parts));
        }
        Self { groups }
    }

    /// The winding number around `point`, up to [`ERROR`].
    #[must_use]
    pub fn number(&self, surface: &Surface, tree: &Bvh, point: DVec3) -> f64 {
        pulp::Arch::new().dispatch(Sum { winding: self, surface, tree, point })
    }

    #[inline(always)]
    fn sum(&self, surface: &Surface, tree: &Bvh, point: DVec3) -> f64 {
        let mut near_sum = Turning::NONE;
        let mut far_sum = 0.0;
        let mut stack = vec![0];
        while let Some(number) = stack.pop() {
            let (angle, near) = self.groups[number].solid_angles(point.to_array());
            far_sum += angle.iter().sum::<f64>();
            let node: &Node = &tree.nodes()[number];
            for (child, near) in node.children().zip(near) {
                match child {
                    Child::Leaf(leaf) if near => {
                        add_leaf(surface, &tree.leaves()[leaf], point, &mut near_sum);
                    }
                    Child::Node(below) if near => stack.push(below),
                    Child::Leaf(_) | Child::Node(_) | Child::Nothing => {}
                }
            }
        }
        near_sum.total() + far_sum * (0.25 / std::f64::consts::PI)
    }
}

/// A winding number to be computed with the host's best instructions.
struct Sum<'a> {
    winding: &'a Winding,
    surface: &'a Surface,
    tree: &'a Bvh,
    point: DVec3,
}

impl WithSimd for Sum<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        self.winding.sum(self.surface, self.tree, self.point)
    }
}

/// Adds the angles of a leaf's faces.
#[inline(always)]
fn add_leaf(surface: &Surface, faces: &[u32; LEAF], point: DVec3, sum: &mut Turning) {
    for face in faces.iter().filter(|face| **face != NO_ITEM) {
        let corners = surface.corners(*face as usize);
        let (re, im) = half_angle(corners.map(|corner| corner - point));
        sum.add(re, im);
    }
}

/// The winding number of faces with these `corners` around `point`, face by face.
#[must_use]
pub fn exact(faces: impl IntoIterator<Item = [DVec3; 3]>, point: DVec3) -> f64 {
    let mut sum = Turning::NONE;
    for corners in faces {
        let (re, im) = half_angle(corners.map(|corner| corner - point));
        sum.add(re, im);
    }
    sum.total()
}

#[cfg(test)]
mod tests {
    use super::super::samples::{Uniform, both, cube, mapped, sphere};
    use super::*;
    use crate::mesh::Mesh;

    fn exact(surface: &Surface, point: DVec3) -> f64 {
        super::exact(surface.faces(), point)
    }

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

    fn tree(surface: &Surface) -> Bvh {
        Bvh::build(surface.triangles.len(), |face| surface.corners(face))
    }

    /// Greatest error of the groups around and in `mesh`, which fills about [-1, 1]^3.
    fn error(mesh: &Mesh) -> f64 {
        let surface = Surface::new(mesh).unwrap();
        let tree = tree(&surface);
        let winding = Winding::new(&surface, &tree);
        let mut random = Uniform(3);
        let errors = (0..300).map(|_| {
            let p = random.point(-1.2, 1.2);
            (winding.number(&surface, &tree, p) - exact(&surface, p)).abs()
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn groups_are_as_good_as_faces() {
        // A tenth of the allowance.
        assert!(error(&sphere(5)) < 0.1 * ERROR);
        let shifted = mapped(&sphere(4), |p| 0.7 * p + DVec3::splat(0.3));
        assert!(error(&both(&sphere(4), &shifted)) < 0.1 * ERROR);
        let mut open = sphere(5);
        open.triangles.retain(|t| open.positions[t[0] as usize][0] < 0.4);
        assert!(error(&open) < 0.1 * ERROR);
        let mut torn = sphere(4);
        let mut random = Uniform(8);
        torn.triangles.retain(|_| random.next() < 0.7);
        assert!(error(&torn) < 0.1 * ERROR);
    }

    #[test]
    fn the_series_of_a_group_has_three_terms() {
        // The first term left out falls with the fifth power of the distance.
        let mut random = Uniform(4);
        let faces: Vec<[DVec3; 3]> =
            (0..5).map(|_| std::array::from_fn(|_| random.point(-0.5, 0.5))).collect();
        let parts: Vec<Group> = faces.iter().map(|f| Group::face(*f)).collect();
        let mut groups = Groups::NONE;
        groups.set(0, &Group::union(&parts));
        let mut error = |distance: f64| {
            let errors = (0..50).map(|_| {
                let p = distance * random.point(-1.0, 1.0).normalize();
                let exact: f64 = faces
                    .iter()
                    .map(|f| half_angle(f.map(|corner| corner - p)))
                    .map(|(re, im)| 2.0 * libm::atan2(im, re))
                    .sum();
                (groups.solid_angles(p.to_array()).0[0] - exact).abs()
            });
            errors.fold(0.0, f64::max)
        };
        let order = (error(8.0) / error(16.0)).log2();
        assert!((4.7..5.3).contains(&order), "{order}");
    }
}
