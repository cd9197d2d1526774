//! A mesh with the sheets that its triangles belong to: the surface, or one of the six flat cuts.

use super::places::Places;
use super::{Cut, SLIVER_DEG, SLIVER_TAN};
use crate::geom::Aabb;
use crate::mesh::Mesh;
use crate::mesh::topology::Stars;
use glam::DVec3;
use rayon::prelude::*;

/// What holds a vertex, as bits: the sides of the box that it lies on, and the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Holds(u8);

/// The bit of the surface, above those of the sides.
const SURFACE: u8 = 1 << 6;

impl Holds {
    /// Only the surface.
    pub(super) const SURFACE: Self = Self(SURFACE);

    /// What holds a vertex inside of `sheet`.
    pub(super) const fn of(sheet: Sheet) -> Self {
        if sheet == 0 { Self::SURFACE } else { Self(sheet) }
    }

    /// Whether all of `other`'s hold this vertex, too.
    pub(super) const fn include(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    pub(super) const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// How many there are.
    pub(super) const fn count(self) -> u32 {
        self.0.count_ones()
    }

    pub(super) const fn is_on_surface(self) -> bool {
        self.0 & SURFACE != 0
    }

    /// Whether a side across `axis` (0 to 2) is among them.
    const fn is_held_along(self, axis: usize) -> bool {
        self.0 >> (2 * axis) & 0b11 != 0
    }

    /// `to` with the coordinates of `at` across the sides that hold it there: those keep their bits.
    pub(super) fn hold(self, at: DVec3, to: DVec3) -> DVec3 {
        let held = |axis: usize| if self.is_held_along(axis) { at[axis] } else { to[axis] };
        DVec3::new(held(0), held(1), held(2))
    }
}

/// A sheet: the bits of the sides that a triangle lies in, none for the surface.
pub(super) type Sheet = u8;

/// A mesh whose vertices know what holds them.
#[derive(Debug)]
pub(super) struct Sheets {
    pub(super) mesh: Mesh,
    pub(super) holds: Vec<Holds>,
    bounds: Aabb,
    places: Places,
}

impl Sheets {
    /// The sheets of `mesh`, the surface in the box of `cut` with its flat cuts.
    pub(super) fn new(mesh: Mesh, cut: &Cut) -> Self {
        let Cut { bounds, spacing: _, precision } = *cut;
        let (lo, hi) = (bounds.lo.to_array(), bounds.hi.to_array());
        let sides = |position: &[f64; 3]| {
            (0..3).fold(0_u8, |bits, axis| {
                let at = position[axis];
                bits | u8::from(at == lo[axis]) << (2 * axis)
                    | u8::from(at == hi[axis]) << (2 * axis + 1)
            })
        };
        let holds = mesh.positions.iter().map(|position| Holds(sides(position))).collect();
        let places = Places::new(&mesh.positions, bounds, precision);
        let mut sheets = Self { mesh, holds, bounds, places };
        for number in 0..sheets.mesh.triangles.len() {
            let corners = sheets.mesh.triangles[number];
            if sheets.sheet(corners) == 0 {
                for corner in corners {
                    let holds = &mut sheets.holds[corner as usize];
                    *holds = holds.union(Holds::SURFACE);
                }
            }
        }
        sheets
    }

    /// The sheet of a triangle.
    pub(super) fn sheet(&self, corners: [u32; 3]) -> Sheet {
        corners.iter().fold(SURFACE - 1, |bits, corner| bits & self.holds[*corner as usize].0)
    }

    /// The sheet that a triangle would be in if its corner at `place` were held by `holds`.
    pub(super) fn sheet_with(&self, corners: [u32; 3], place: usize, holds: Holds) -> Sheet {
        let others = corners.iter().enumerate().filter(|(i, _)| *i != place);
        others.fold((SURFACE - 1) & holds.0, |bits, (_, corner)| {
            bits & self.holds[*corner as usize].0
        })
    }

    pub(super) fn at(&self, vertex: u32) -> DVec3 {
        DVec3::from_array(self.mesh.positions[vertex as usize])
    }

    pub(super) fn points(&self, corners: [u32; 3]) -> [DVec3; 3] {
        corners.map(|corner| self.at(corner))
    }

    pub(super) fn stars(&self) -> Stars {
        Stars::new(&self.mesh)
    }

    /// Whether `place` is off the sides of the box that are not among `holds`, and inside of them.
    pub(super) fn is_free_place(&self, holds: Holds, place: DVec3) -> bool {
        let Aabb { lo, hi } = self.bounds;
        (0..3).all(|axis| {
            holds.is_held_along(axis) || lo[axis] < place[axis] && place[axis] < hi[axis]
        })
    }

    /// Whether a file tells `place` from where the vertices are, `vertex` itself left out.
    pub(super) fn is_open_place(&self, vertex: u32, place: DVec3) -> bool {
        self.places.is_open(place) || self.places.are_one(self.at(vertex), place)
    }

    /// Whether a new vertex at `place` is told from all others.
    pub(super) fn is_new_place(&self, place: DVec3) -> bool {
        self.places.is_open(place)
    }

    /// Whether a triangle of these corners keeps its area in a file.
    pub(super) fn is_wide(&self, points: [DVec3; 3]) -> bool {
        self.places.is_wide(points)
    }

    /// Moves `vertex` to `place`.
    pub(super) fn put(&mut self, vertex: u32, place: DVec3) {
        self.places.leave(self.at(vertex));
        self.places.take(place);
        self.mesh.positions[vertex as usize] = place.to_array();
    }

    /// Notes that no triangle has `vertex` any more.
    pub(super) fn abandon(&mut self, vertex: u32) {
        self.places.leave(self.at(vertex));
    }

    /// Adds a vertex at `place`.
    pub(super) fn add(&mut self, place: DVec3, holds: Holds) {
        self.places.take(place);
        self.mesh.positions.push(place.to_array());
        self.holds.push(holds);
    }

    /// Takes back the vertices that were added from number `first` on.
    pub(super) fn take_back(&mut self, first: usize) {
        for position in self.mesh.positions.drain(first..) {
            self.places.leave(DVec3::from_array(position));
        }
        self.holds.truncate(first);
    }

    /// The triangles about `vertex`.
    pub(super) fn about<'a>(
        &'a self,
        stars: &'a Stars,
        vertex: u32,
    ) -> impl Iterator<Item = [u32; 3]> + 'a {
        stars.about(vertex).iter().map(|number| self.mesh.triangles[*number as usize])
    }

    /// Puts the neighbours of `vertex` into `ring`, each once.
    pub(super) fn ring(&self, stars: &Stars, vertex: u32, ring: &mut Vec<u32>) {
        ring.clear();
        for corner in self.about(stars, vertex).flatten() {
            if corner != vertex && !ring.contains(&corner) {
                ring.push(corner);
            }
        }
    }

    /// The sheets on both sides of the edge from `a` to `b`; none if it has not two triangles.
    pub(super) fn sides(&self, stars: &Stars, a: u32, b: u32) -> Option<[Sheet; 2]> {
        let mut at = self.about(stars, a).filter(|corners| corners.contains(&b));
        let sides = [self.sheet(at.next()?), self.sheet(at.next()?)];
        at.next().is_none().then_some(sides)
    }

    /// How many triangles have an angle below 5°, and the least angle, in degrees.
    pub(super) fn slivers(&self) -> (usize, f64) {
        (self.mesh.triangles.par_iter())
            .map(|corners| {
                let angle = least_angle_deg(self.points(*corners));
                (usize::from(angle < SLIVER_DEG), angle)
            })
            .reduce(|| (0, 60.0), |a, b| (a.0 + b.0, a.1.min(b.1)))
    }

    /// The mesh without the vertices that no triangle has.
    pub(super) fn into_mesh(self) -> Mesh {
        let Mesh { mut positions, mut triangles } = self.mesh;
        let mut numbers = vec![u32::MAX; positions.len()];
        triangles.iter().flatten().for_each(|corner| numbers[*corner as usize] = 0);
        let mut kept = 0;
        for (vertex, number) in numbers.iter_mut().enumerate() {
            if *number == 0 {
                positions[kept] = positions[vertex];
                *number = kept as u32;
                kept += 1;
            }
        }
        positions.truncate(kept);
        for corner in triangles.iter_mut().flatten() {
            *corner = numbers[*corner as usize];
        }
        Mesh { positions, triangles }
    }
}

/// Twice the area of a triangle, along its normal.
pub(super) fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The least angle of a triangle, in degrees; zero if it has no area.
pub(super) fn least_angle_deg(points: [DVec3; 3]) -> f64 {
    let [a, b, c] = points;
    let area = normal(points).length();
    let angle = |at: DVec3, p: DVec3, q: DVec3| libm::atan2(area, (p - at).dot(q - at));
    angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b)).to_degrees()
}

/// Whether a triangle has an angle below 5°; rounding apart, what [`least_angle_deg`] says.
pub(super) fn is_sliver(points: [DVec3; 3]) -> bool {
    let [a, b, c] = points;
    let area = normal(points).length();
    let is_small = |at: DVec3, p: DVec3, q: DVec3| area < SLIVER_TAN * (p - at).dot(q - at);
    area == 0.0 || is_small(a, b, c) || is_small(b, c, a) || is_small(c, a, b)
}

/// Whether the directions of `a` and `b` differ by an angle of a cosine greater than `cosine`.
///
/// Vectors of no length have no direction.
pub(super) fn is_along(a: DVec3, b: DVec3, cosine: f64) -> bool {
    a.dot(b) > cosine * a.length() * b.length()
}
