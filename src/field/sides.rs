//! Which side of a surface a point lies on, for any surface.
//!
//! The pseudonormal decides where the surface is closed, oriented and manifold and the winding
//! number agrees at many points; otherwise, and where the pseudonormal is too weak, the winding
//! number decides: inside is where it exceeds one half.
//!
//! A winding number is seldom computed at the point itself: in a ball without faces it changes so
//! little ([`Rim`]) that one number in the middle of a cell of a dyadic grid settles the whole
//! cell. Cell and number follow from the point and its distance alone, so remembering them from
//! one query to the next changes no answer.

use super::report::{Reason, SignMethod};
use super::rim::Rim;
use super::search::{Faces, Place, Search};
use super::sign::{Pseudonormals, Side};
use super::triangle::{Closest, closest};
use super::winding::{ERROR, Winding};
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Side of a cell, in units of the distance from the surface, at most: half the diagonal is then
/// less than half of the distance.
const CELL: f64 = 0.57;
/// Distance from the surface, in units of the coordinates, below which cells are too close to
/// rounding.
const NO_CELL: f64 = 1.0 / (1_u64 << 36) as f64;
/// Pieces of boundary beyond which the bound costs more than the numbers that it saves.
const MOST_PIECES: usize = 256;
/// Points near faces, and points anywhere, at which the methods are compared.
const COMPARED: [usize; 2] = [4096, 1024];
/// Distance from the surface, in units of its size, from which both methods must be right.
const COMPARABLE: f64 = 1e-9;

/// The sides of a surface.
#[derive(Clone, Debug)]
pub struct Sides {
    normals: Pseudonormals,
    winding: Winding,
    rim: Rim,
    method: SignMethod,
}

/// Sides of cells, or that a cell has points on both.
pub type Cells = FxHashMap<[u64; 3], Option<Side>>;

impl Sides {
    /// Prepares the sides of `faces`, and says why in this way.
    #[must_use]
    pub fn new(faces: &Faces) -> (Self, Reason) {
        let edges = &faces.surface.edges;
        let mut sides = Self {
            normals: Pseudonormals::of_faces(&faces.surface),
            winding: Winding::new(&faces.surface, &faces.tree),
            rim: Rim::new(&faces.surface),
            method: SignMethod::WindingNumbers,
        };
        let reason = if edges.inconsistent > 0 {
            Reason::OneSided { edges: edges.inconsistent }
        } else if edges.crowded > 0 {
            Reason::Crowded { edges: edges.crowded }
        } else if edges.open > 0 {
            Reason::Open { edges: edges.open }
        } else {
            sides.normals = sides.normals.completed(&faces.surface);
            let (wrong, points) = sides.contradictions(faces);
            if wrong == 0 {
                sides.method = SignMethod::Pseudonormals;
                Reason::Clean { points }
            } else {
                Reason::Contradiction { wrong, points }
            }
        };
        (sides, reason)
    }

    /// How the sides are told.
    #[must_use]
    pub fn method(&self) -> SignMethod {
        self.method
    }

    /// Whether the signed distance is continuous: it is unless the surface has a boundary.
    #[must_use]
    pub fn is_continuous(&self) -> bool {
        self.rim.is_empty()
    }

    /// The unit normal of a face, if it has area.
    #[inline(always)]
    #[must_use]
    pub fn normal(&self, face: usize) -> Option<DVec3> {
        self.normals.face(face)
    }

    /// The side of `place`, whose closest point is `closest` on `face`, at `distance`.
    #[inline(always)]
    #[must_use]
    pub fn side(
        &self,
        faces: &Faces,
        place: Place,
        (face, closest, distance): (usize, &Closest, f64),
        cells: &mut Cells,
    ) -> Side {
        match self.method {
            SignMethod::Pseudonormals => self
                .normals
                .side(face, faces.surface.triangles[face], closest)
                .unwrap_or_else(|| self.wound(faces, place, distance, cells)),
            SignMethod::WindingNumbers => self.wound(faces, place, distance, cells),
        }
    }

    /// The side that all points within `radius` of `place` are on, if there is one and no face
    /// comes so near. Stricter than what decides a cell, so that it holds for every answer there.
    #[must_use]
    pub fn common(&self, faces: &Faces, place: Place, radius: f64) -> Option<Side> {
        let number = self.winding.number(&faces.surface, &faces.tree, place.scaled);
        decided(number, self.rim.variation(place.scaled, radius) + 2.0 * ERROR)
    }

    /// The side by the winding number.
    fn wound(&self, faces: &Faces, place: Place, distance: f64, cells: &mut Cells) -> Side {
        let number = |place: Place| self.winding.number(&faces.surface, &faces.tree, place.scaled);
        let resolved = NO_CELL * (1.0 + place.scaled.abs().max_element());
        if distance > resolved && self.rim.pieces() <= MOST_PIECES {
            // The power of two below.
            let size = f64::from_bits((CELL * distance).to_bits() & (0x7ff << 52));
            let anchor = ((place.local / size).floor() + 0.5) * size;
            let key = anchor.to_array().map(f64::to_bits);
            let side = *cells.entry(key).or_insert_with(|| {
                let anchor = faces.at_local(anchor);
                // Half the diagonal, rounded up.
                let radius = 0.8661 * size;
                decided(number(anchor), self.rim.variation(anchor.scaled, radius) + ERROR)
            });
            if let Some(side) = side {
                return side;
            }
        }
        if number(place) > 0.5 { Side::Inside } else { Side::Outside }
    }

    /// At how many points pseudonormals and winding numbers disagree, of how many.
    fn contradictions(&self, faces: &Faces) -> (usize, usize) {
        let count = faces.surface.triangles.len();
        let [near, anywhere] = COMPARED;
        let stride = count.div_ceil(near);
        // Beside faces, alternately on both sides, at distances from small to large.
        let beside = (0..count).step_by(stride).enumerate().map(|(i, face)| {
            let [a, b, c] = faces.surface.corners(face);
            let step = [1e-3, -1e-3, 1e-2, -1e-2, 0.05, -0.05][i % 6];
            let normal = self.normals.face(face).unwrap_or(DVec3::ZERO);
            let scaled = a + ((b - a) + (c - a)) / 3.0 + step * normal;
            Place { scaled, local: scaled - faces.at_local(DVec3::ZERO).scaled }
        });
        // The additive sequence of the plastic number's analogue in three dimensions spreads evenly.
        let step =
            DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3);
        let inner = (0..anywhere).map(|i| {
            let unit = (0.5 + step * i as f64).fract();
            faces.at_local(2.0 * unit - 1.0)
        });
        let places: Vec<Place> = beside.chain(inner).collect();
        let wrong = |place: &Place| {
            let face = faces.nearest(*place, &mut Search::default()).number as usize;
            let closest =
                closest(place.scaled, &faces.surface.corners(face), self.normals.face(face));
            let by_normal = self.normals.side(face, faces.surface.triangles[face], &closest);
            let distance = closest.offset.length();
            let by_number = || self.wound(faces, *place, distance, &mut Cells::default());
            distance > COMPARABLE && by_normal.is_some_and(|side| side != by_number())
        };
        (places.par_iter().filter(|place| wrong(place)).count(), places.len())
    }
}

/// The side of a winding number known up to `doubt`, if it is certain.
fn decided(number: f64, doubt: f64) -> Option<Side> {
    if number - 0.5 > doubt {
        Some(Side::Inside)
    } else if 0.5 - number > doubt {
        Some(Side::Outside)
    } else {
        None
    }
}
