//! Foams: the Voronoi cells of points that repeat with the unit cube, as a cell of struts or plates.
//!
//! The cell of a point holds what is nearer to it than to any other: a cube about it, cut by the
//! bisecting planes towards all others, the nearest first. What two cells share is a plate, what
//! three share is a strut. Struts shorter than a millionth of the cube are left out.
//!
//! The points of a random foam come from a seed. Each is the best of sixteen random places: the
//! one that is farthest from all points before, so that bubbles differ less in size than
//! those of independent points.
//!
//! Source: Mitchell 1991, doi:10.1145/127719.122736, for the points; Rycroft 2009,
//! doi:10.1063/1.3215722, for cells by cutting.

use super::cell::{Cell, Plate, Strut, Surface};
use crate::num::Random;
use glam::DVec3;

/// The most points whose foam is made.
pub const MOST_POINTS: usize = 128;

/// Places that are tried for a point.
const TRIES: u64 = 16;

/// What is shorter, in cells, is left out.
const SHORTEST: f64 = 1e-6;

/// What is no farther beyond a plane, in cells, is not cut off: more than rounding errors.
const TOUCHING: f64 = 1e-12;

/// Which part of a foam is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The edges of the cells.
    Struts,
    /// The faces of the cells.
    Walls,
}

/// A face of a cell: the corners, and the point beyond, as its number and the cells between.
pub(super) struct Facet {
    pub(super) corners: Vec<DVec3>,
    pub(super) beyond: Option<(usize, DVec3)>,
}

/// The points of a random foam, in the unit cube.
#[must_use]
pub fn random_points(seed: u64, count: usize) -> Vec<DVec3> {
    let (planes, heights) = (Random::new(seed, 0), Random::new(seed, 1));
    let mut points: Vec<DVec3> = Vec::new();
    let apart = |a: DVec3, b: DVec3| {
        let d = a - b;
        (d - d.round()).length_squared()
    };
    for number in 0..count as u64 {
        let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
        for index in number * TRIES..(number + 1) * TRIES {
            let ([x, y], [z, _]) = (planes.uniform(index), heights.uniform(index));
            let place = DVec3::new(x, y, z);
            let far = points.iter().map(|p| apart(*p, place)).fold(f64::INFINITY, f64::min);
            if far > best.0 {
                best = (far, place);
            }
        }
        points.push(best.1);
    }
    points
}

/// The foam of the cells of `points` and their images.
#[must_use]
pub fn foam(points: &[DVec3], part: Part) -> Cell {
    let (mut struts, mut plates) = (Vec::new(), Vec::new());
    for number in 0..points.len() {
        for Facet { corners, beyond } in facets(points, number) {
            let Some((other, shift)) = beyond else { continue };
            // A face belongs to two cells; one of them gives it.
            let is_first = (number, [0.0; 3]) < (other, shift.to_array());
            match part {
                Part::Walls if is_first => {
                    plates.push(Plate::of(Surface::Polygon(corners)));
                }
                Part::Walls => {}
                Part::Struts => {
                    let ends =
                        (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]);
                    struts.extend(ends.map(|[a, b]| Strut::between(a, b)));
                }
            }
        }
    }
    Cell::new(struts, plates)
}

/// The faces of the cell of `points[number]`.
pub(super) fn facets(points: &[DVec3], number: usize) -> Vec<Facet> {
    let middle = points[number];
    let mut others: Vec<(f64, usize, DVec3)> = Vec::new();
    for image in 0..125_i32 {
        let shift = DVec3::new(
            f64::from(image % 5 - 2),
            f64::from(image / 5 % 5 - 2),
            f64::from(image / 25 - 2),
        );
        for (other, point) in points.iter().enumerate() {
            let far = middle.distance(*point + shift);
            if far > 0.0 {
                others.push((far, other, shift));
            }
        }
    }
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut faces = cube(middle);
    for (far, other, shift) in others {
        let corners = faces.iter().flat_map(|face| &face.corners);
        let farthest = corners.map(|c| c.distance(middle)).fold(0.0, f64::max);
        if far > 2.0 * farthest {
            break;
        }
        let point = points[other] + shift;
        let normal = (point - middle).normalize();
        let offset = normal.dot(0.5 * (point + middle));
        cut(&mut faces, (normal, offset), (other, shift));
    }
    faces.retain_mut(|face| {
        let count = face.corners.len();
        let is_long = |i: usize| face.corners[i].distance(face.corners[(i + 1) % count]) > SHORTEST;
        let kept: Vec<DVec3> =
            (0..count).filter(|i| is_long(*i)).map(|i| face.corners[i]).collect();
        face.corners = kept;
        face.corners.len() >= 3
    });
    faces
}

/// The cube of side 2 about `middle`: a cell never reaches beyond it, since points repeat.
fn cube(middle: DVec3) -> Vec<Facet> {
    let mut faces = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |a: f64, b: f64| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, a, b);
                middle + DVec3::from_array(p)
            };
            let corners =
                vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            faces.push(Facet { corners, beyond: None });
        }
    }
    faces
}

/// Cuts off what lies beyond the plane, and closes the cut by a face towards `beyond`.
fn cut(faces: &mut Vec<Facet>, (normal, offset): (DVec3, f64), beyond: (usize, DVec3)) {
    let height = |p: DVec3| normal.dot(p) - offset;
    if faces.iter().flat_map(|face| &face.corners).all(|corner| height(*corner) <= TOUCHING) {
        return;
    }
    let mut rim: Vec<DVec3> = Vec::new();
    for face in &mut *faces {
        let count = face.corners.len();
        let mut kept = Vec::new();
        for i in 0..count {
            let (a, b) = (face.corners[i], face.corners[(i + 1) % count]);
            let (below, above) = (height(a), height(b));
            let [stays, goes] = [below <= TOUCHING, above > TOUCHING];
            if stays {
                kept.push(a);
            }
            if stays == goes {
                // From the end that stays, so that both faces of the edge find the same point.
                let (p, q, u, v) = if stays { (a, b, below, above) } else { (b, a, above, below) };
                let crossing = p + (q - p) * (u / (u - v)).clamp(0.0, 1.0);
                kept.push(crossing);
                rim.push(crossing);
            }
        }
        face.corners = kept;
    }
    faces.retain(|face| face.corners.len() >= 3);
    // Each crossing was found from both faces of its edge.
    rim.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    rim.dedup();
    if rim.len() < 3 {
        return;
    }
    let middle = rim.iter().sum::<DVec3>() / rim.len() as f64;
    let right = (rim[0] - middle).normalize();
    let up = normal.cross(right);
    let angle = |p: &DVec3| libm::atan2((*p - middle).dot(up), (*p - middle).dot(right));
    rim.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    faces.push(Facet { corners: rim, beyond: Some(beyond) });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cellular::struts::table::CELLS;

    fn cell(name: &str) -> Cell {
        CELLS.iter().find(|row| row.name == name).unwrap().cell()
    }

    fn points(list: &[[f64; 3]]) -> Vec<DVec3> {
        list.iter().copied().map(DVec3::from_array).collect()
    }

    fn area(cell: &Cell) -> f64 {
        let one = |plate: &Plate| match &plate.surface {
            Surface::Plane { .. } => panic!("foams have polygons"),
            Surface::Polygon(corners) => {
                let twice = (1..corners.len() - 1)
                    .map(|i| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]));
                0.5 * twice.sum::<DVec3>().length()
            }
        };
        cell.plates().iter().map(one).sum()
    }

    #[test]
    fn foams_of_lattices_are_those_of_the_table() {
        let fcc = [[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
        let a15 = [
            [0.0; 3],
            [0.5; 3],
            [0.25, 0.0, 0.5],
            [0.75, 0.0, 0.5],
            [0.5, 0.25, 0.0],
            [0.5, 0.75, 0.0],
            [0.0, 0.5, 0.25],
            [0.0, 0.5, 0.75],
        ];
        for (name, list) in [
            ("kelvin", &[[0.0; 3], [0.5; 3]][..]),
            ("rhombic-dodecahedron", &fcc),
            ("weaire-phelan", &a15),
        ] {
            let struts = foam(&points(list), Part::Struts);
            let walls = foam(&points(list), Part::Walls);
            let (known, plates) = (cell(name), cell(&format!("{name}-plates")));
            assert_eq!(struts.struts().len(), known.struts().len(), "{name}");
            assert!((struts.length() - known.length()).abs() < 1e-9, "{name}");
            assert_eq!(walls.plates().len(), plates.plates().len(), "{name}");
            assert!((area(&walls) - area(&plates)).abs() < 1e-9, "{name}");
        }
    }

    #[test]
    fn random_foams_keep_eulers_rule_and_plateaus() {
        for (seed, count) in [(1, 1), (2, 5), (3, 20), (4, 40)] {
            let sites = random_points(seed, count);
            let struts = foam(&sites, Part::Struts);
            let walls = foam(&sites, Part::Walls);
            let nodes = struts.nodes();
            let euler = nodes.len() as i64 - struts.struts().len() as i64
                + walls.plates().len() as i64
                - count as i64;
            assert_eq!(euler, 0, "seed {seed}: the torus has the characteristic 0");
            let expected = if count == 1 { 6 } else { 4 };
            assert!(nodes.iter().all(|node| node.valence == expected), "seed {seed}");
        }
    }

    #[test]
    fn points_of_a_seed_are_always_the_same() {
        assert_eq!(random_points(5, 9), random_points(5, 9));
        assert_eq!(random_points(5, 9)[..4], random_points(5, 4));
        assert_ne!(random_points(5, 4), random_points(6, 4));
    }
}
