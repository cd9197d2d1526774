//! Which side of a surface a point lies on, for any surface.
//!
//! The pseudonormal decides where the surface is closed, oriented and manifold and the winding
//! number agrees at many points; otherwise, and where the pseudonormal is too weak, the winding
//! number decides: inside is where it exceeds one half.
//!
//! Where a surface is open but otherwise as good, the pseudonormal tells the winding number in most
//! places, without summing it up: with its holes capped the number is 1 behind the nearest face and
//! 0 before it, the caps take away no more than their solid angle at the closest point, and on the
//! way to the point it changes no more than [`Rim`] says. Where that leaves no doubt which side of
//! one half it is on, it need not be computed.
//!
//! A winding number is seldom computed at the point itself: in a ball without faces it changes so
//! little ([`Rim`]) that one number in the middle of a cell of a dyadic grid settles the whole
//! cell. Cell and number follow from the point and its distance alone, so remembering them from
//! one query to the next changes no answer.

use super::report::{Reason, SignMethod};
use super::rim::Rim;
use super::search::{Faces, Nearest, Place, Search};
use super::sign::{Pseudonormals, Side};
use super::winding::{ERROR, Winding};
use crate::num::EVEN_STEPS;
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
    /// Where they are to be trusted.
    normals: Option<Pseudonormals>,
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
            normals: None,
            winding: Winding::new(&faces.surface, &faces.tree),
            rim: Rim::new(&faces.surface),
            method: SignMethod::WindingNumbers,
        };
        let reason = if edges.inconsistent > 0 {
            Reason::OneSided { edges: edges.inconsistent }
        } else if edges.crowded > 0 {
            Reason::Crowded { edges: edges.crowded }
        } else {
            let normals = Pseudonormals::new(faces);
            let (wrong, points) = sides.contradictions(faces, &normals);
            if wrong == 0 {
                sides.normals = Some(normals);
            }
            if edges.open > 0 {
                Reason::Open { edges: edges.open }
            } else if wrong == 0 {
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

    /// The side of `place`, whose nearest face is `nearest`, at `distance`.
    #[inline(always)]
    #[must_use]
    pub fn side(
        &self,
        faces: &Faces,
        place: Place,
        (nearest, distance): (&Nearest, f64),
        cells: &mut Cells,
    ) -> Side {
        // No closures: they would be compiled apart, without the host's best instructions.
        let by_normal = match &self.normals {
            Some(normals) => self.told(faces, normals, place, (nearest, distance)),
            None => None,
        };
        match by_normal {
            Some(side) => side,
            None => self.wound(faces, place, distance, cells),
        }
    }

    /// The side of `place` by the pseudonormal, if that settles the winding number.
    #[inline(always)]
    fn told(
        &self,
        faces: &Faces,
        normals: &Pseudonormals,
        place: Place,
        (nearest, distance): (&Nearest, f64),
    ) -> Option<Side> {
        let side = normals.side(faces, nearest)?;
        let foot = place.scaled - nearest.closest.offset;
        let settled = self.rim.is_empty()
            || self.rim.shadow(foot) + self.rim.roughly(place.scaled, distance) < 0.5 - ERROR;
        settled.then_some(side)
    }

    /// Whether all points nearer to `place` than its nearest face `nearest`, at `distance`, are
    /// certainly on `side` of a surface with a boundary, as far as that is known without
    /// computing a winding number. Stricter than what decides a single point, so that it holds for every
    /// answer there.
    #[inline(always)]
    #[must_use]
    pub fn holds(
        &self,
        faces: &Faces,
        place: Place,
        (nearest, distance): (&Nearest, f64),
        side: Side,
    ) -> bool {
        let Some(normals) = &self.normals else { return false };
        let foot = place.scaled - nearest.closest.offset;
        // Once on the way from the foot to the place, once from there to any of the points.
        normals.side(faces, nearest) == Some(side)
            && self.rim.shadow(foot) + 2.0 * self.rim.roughly(place.scaled, distance)
                < 0.5 - 3.0 * ERROR
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
    fn contradictions(&self, faces: &Faces, normals: &Pseudonormals) -> (usize, usize) {
        let count = faces.surface.triangles.len();
        let [near, anywhere] = COMPARED;
        let stride = count.div_ceil(near);
        // Beside faces, alternately on both sides, at distances from small to large.
        let beside = (0..count).step_by(stride).enumerate().map(|(i, face)| {
            let [a, b, c] = faces.surface.corners(face);
            let step = [1e-3, -1e-3, 1e-2, -1e-2, 0.05, -0.05][i % 6];
            let normal = faces.normal(face).unwrap_or(DVec3::ZERO);
            let scaled = a + ((b - a) + (c - a)) / 3.0 + step * normal;
            Place { scaled, local: scaled - faces.at_local(DVec3::ZERO).scaled }
        });
        let step = DVec3::from_array(EVEN_STEPS);
        let inner = (0..anywhere).map(|i| {
            let unit = (0.5 + step * i as f64).fract();
            faces.at_local(2.0 * unit - 1.0)
        });
        let places: Vec<Place> = beside.chain(inner).collect();
        let wrong = |search: &mut Search, place: &Place| {
            let nearest = faces.nearest(*place, search);
            let distance = nearest.closest.offset.length();
            let by_normal = self.told(faces, normals, *place, (&nearest, distance));
            let by_number = || self.wound(faces, *place, distance, &mut Cells::default());
            distance > COMPARABLE && by_normal.is_some_and(|side| side != by_number())
        };
        let wrong = places.par_iter().map_init(Search::default, wrong).filter(|wrong| *wrong);
        (wrong.count(), places.len())
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
