//! Unit cells as graphs: struts between nodes, and plates, that repeat with the unit cube.
//!
//! A cell holds each strut and plate once *modulo translations by whole cells*: what lies on a face
//! of the cube is not said again on the opposite one. So a cell may be given with all that meets
//! the cube, as unit cells are drawn; what is said twice is dropped. Radii and thicknesses are
//! *factors*: numbers that multiply the radius or thickness that a program gives.

use super::symmetry::{Centring, Operation, Symmetry, operations};
use glam::{DVec3, I64Vec3};
use rustc_hash::FxHashMap;

/// Places that differ by less than this part of a cell are one place: far above rounding errors, far
/// below any strut.
const RESOLUTION: f64 = 1.0 / (1 << 24) as f64;

/// A strut between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strut {
    /// Its ends, in cells.
    pub ends: [DVec3; 2],
    /// The factors of its radius at the ends, between which it tapers.
    pub factors: [f64; 2],
}

/// A plate of uniform thickness.
#[derive(Clone, Debug, PartialEq)]
pub struct Plate {
    /// Its middle.
    pub surface: Surface,
    /// The factor of its thickness.
    pub factor: f64,
}

/// The middle of a plate.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// The planes with normal . x = offset and all their images; the normal's components are whole.
    Plane {
        /// The normal, of any length.
        normal: DVec3,
        /// The offset, in cells.
        offset: f64,
    },
    /// A convex polygon, its corners in order.
    Polygon(Vec<DVec3>),
}

/// A unit cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    struts: Vec<Strut>,
    plates: Vec<Plate>,
}

/// A node of a cell: where struts meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Its place in the cell, from 0 up to 1.
    pub place: DVec3,
    /// The number of struts that end in it, those of neighbouring cells included.
    pub valence: usize,
}

impl Strut {
    /// A strut whose radius is the one that the program gives.
    #[must_use]
    pub fn between(a: DVec3, b: DVec3) -> Self {
        Self { ends: [a, b], factors: [1.0; 2] }
    }

    /// Its length, in cells.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    fn image(&self, by: &Operation) -> Self {
        Self { ends: self.ends.map(|end| by.point(end)), ..*self }
    }
}

impl Plate {
    /// A plate whose thickness is the one that the program gives.
    #[must_use]
    pub const fn of(surface: Surface) -> Self {
        Self { surface, factor: 1.0 }
    }

    fn image(&self, by: &Operation) -> Self {
        let surface = match &self.surface {
            Surface::Plane { normal, offset } => {
                let normal = by.direction(*normal);
                Surface::Plane { normal, offset: offset + normal.dot(by.shift()) }
            }
            Surface::Polygon(corners) => {
                Surface::Polygon(corners.iter().map(|corner| by.point(*corner)).collect())
            }
        };
        Self { surface, factor: self.factor }
    }
}

impl Cell {
    /// The cell of these struts and plates; those that are images of earlier ones are dropped.
    #[must_use]
    pub fn new(struts: Vec<Strut>, plates: Vec<Plate>) -> Self {
        let mut known = FxHashMap::default();
        let struts = struts
            .into_iter()
            .filter(|strut| known.insert(strut_key(strut), ()).is_none())
            .collect();
        let mut known = FxHashMap::default();
        let plates = plates
            .into_iter()
            .filter(|plate| known.insert(plate_key(plate), ()).is_none())
            .collect();
        Self { struts, plates }
    }

    /// The cell that the symmetries make of `struts` and `plates`.
    #[must_use]
    pub fn generated(
        symmetry: Symmetry,
        centring: Centring,
        struts: &[Strut],
        plates: &[Plate],
    ) -> Self {
        let operations = operations(symmetry, centring);
        let all = |strut: &Strut| operations.iter().map(|o| strut.image(o)).collect::<Vec<_>>();
        let every = |plate: &Plate| operations.iter().map(|o| plate.image(o)).collect::<Vec<_>>();
        Self::new(struts.iter().flat_map(all).collect(), plates.iter().flat_map(every).collect())
    }

    /// The struts, each once.
    #[must_use]
    pub fn struts(&self) -> &[Strut] {
        &self.struts
    }

    /// The plates, each once.
    #[must_use]
    pub fn plates(&self) -> &[Plate] {
        &self.plates
    }

    /// The nodes, each once, in the order of the struts that meet them first.
    #[must_use]
    pub fn nodes(&self) -> Vec<Node> {
        let mut numbers = FxHashMap::default();
        let mut nodes: Vec<Node> = Vec::new();
        for end in self.struts.iter().flat_map(|strut| strut.ends) {
            let number = *numbers.entry(place(end)).or_insert_with(|| {
                nodes.push(Node { place: end - end.floor(), valence: 0 });
                nodes.len() - 1
            });
            nodes[number].valence += 1;
        }
        nodes
    }

    /// The length of all struts, in cells.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.struts.iter().map(Strut::length).sum()
    }

    /// Whether the lattice is its own mirror image in the plane through the origin across `axis`.
    #[must_use]
    pub fn is_mirrored(&self, axis: usize) -> bool {
        let mut signs = DVec3::ONE;
        signs[axis] = -1.0;
        let mirror = |p: DVec3| p * signs;
        let struts: FxHashMap<_, _> = self.struts.iter().map(|s| (strut_key(s), s)).collect();
        let plates: FxHashMap<_, _> =
            self.plates.iter().map(|p| (plate_key(p), p.factor)).collect();
        self.struts.iter().all(|strut| {
            let image = Strut { ends: strut.ends.map(mirror), ..*strut };
            struts.get(&strut_key(&image)).is_some_and(|twin| {
                let [a, b] = twin.factors;
                let same = place(twin.ends[0]) == place(image.ends[0]);
                image.factors == if same { [a, b] } else { [b, a] }
            })
        }) && self.plates.iter().all(|plate| {
            let surface = match &plate.surface {
                Surface::Plane { normal, offset } => {
                    Surface::Plane { normal: mirror(*normal), offset: *offset }
                }
                Surface::Polygon(corners) => {
                    Surface::Polygon(corners.iter().map(|corner| mirror(*corner)).collect())
                }
            };
            let image = Plate { surface, factor: plate.factor };
            plates.get(&plate_key(&image)) == Some(&plate.factor)
        })
    }
}

/// The place of `p` in the cell, as a number of [`RESOLUTION`]s.
pub(super) fn place(p: DVec3) -> [i64; 3] {
    let whole = (1.0 / RESOLUTION) as i64;
    rounded(p).map(|c| c.rem_euclid(whole))
}

fn rounded(p: DVec3) -> [i64; 3] {
    let I64Vec3 { x, y, z } = (p / RESOLUTION).round().as_i64vec3();
    [x, y, z]
}

/// What is equal for struts that are images of one another.
fn strut_key(strut: &Strut) -> Vec<[i64; 3]> {
    key_of_points(&strut.ends)
}

/// What is equal for plates that are images of one another.
fn plate_key(plate: &Plate) -> Vec<[i64; 3]> {
    match &plate.surface {
        Surface::Plane { normal, offset } => {
            let direction = rounded(*normal);
            let (direction, offset) = if direction < [0; 3] {
                (direction.map(|c| -c), -offset)
            } else {
                (direction, *offset)
            };
            vec![direction, place(DVec3::new(offset, 0.0, 0.0))]
        }
        Surface::Polygon(corners) => key_of_points(corners),
    }
}

/// The middle of `points` modulo whole cells, and where they lie about it, in order.
fn key_of_points(points: &[DVec3]) -> Vec<[i64; 3]> {
    let middle = points.iter().sum::<DVec3>() / points.len() as f64;
    let mut key: Vec<[i64; 3]> = points.iter().map(|p| rounded(*p - middle)).collect();
    key.sort_unstable();
    key.push(place(middle));
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(p: [f64; 3]) -> DVec3 {
        DVec3::from_array(p)
    }

    #[test]
    fn what_is_said_on_both_faces_of_the_cube_counts_once() {
        let edges = (0..4).map(|i| {
            let at = point([0.0, f64::from(i & 1), f64::from(i >> 1)]);
            Strut::between(at, at + DVec3::X)
        });
        let cell = Cell::new(edges.collect(), Vec::new());
        assert_eq!(cell.struts().len(), 1);
        assert_eq!(cell.nodes(), [Node { place: DVec3::ZERO, valence: 2 }]);
        let back = Strut::between(point([1.0, 0.0, 0.0]), point([0.0, 0.0, 0.0]));
        let both = Cell::new(vec![cell.struts()[0], back], Vec::new());
        assert_eq!(both, cell);
    }

    #[test]
    fn mirrors_are_found_and_radii_count() {
        let slanted = Strut::between(DVec3::ZERO, point([0.5, 0.25, 0.0]));
        let twin = Strut::between(DVec3::ZERO, point([-0.5, 0.25, 0.0]));
        let single = Cell::new(vec![slanted], Vec::new());
        assert_eq!([0, 1, 2].map(|axis| single.is_mirrored(axis)), [false, false, true]);
        let double = Cell::new(vec![slanted, twin], Vec::new());
        assert_eq!([0, 1, 2].map(|axis| double.is_mirrored(axis)), [true, false, true]);
        let thin = Strut { factors: [1.0, 0.5], ..twin };
        let uneven = Cell::new(vec![slanted, thin], Vec::new());
        assert!(!uneven.is_mirrored(0));
    }

    #[test]
    fn planes_are_one_with_their_images() {
        let plane =
            |normal: [f64; 3], offset| Plate::of(Surface::Plane { normal: point(normal), offset });
        let all = vec![
            plane([1.0, 1.0, 0.0], 0.0),
            plane([-1.0, -1.0, 0.0], 1.0),
            plane([1.0, -1.0, 0.0], 0.5),
        ];
        assert_eq!(Cell::new(Vec::new(), all).plates().len(), 2);
    }
}
