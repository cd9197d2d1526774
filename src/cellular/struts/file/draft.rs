//! What a file says, with places for faults, and what it means.

use super::super::cell::{Cell, Plate, Strut, Surface};
use super::super::element::normal;
use super::{Cause, Fault, LARGEST_FACTOR, MOST, MOST_CORNERS, Place, RANGE};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// The largest distance of a corner from the plane of its face, in cells.
const FLAT: f64 = 1e-6;

/// The least length of an edge, in cells.
const SHORTEST: f64 = 1e-6;

/// What a file says so far.
#[derive(Default)]
pub(super) struct Draft {
    nodes: FxHashMap<String, Node>,
    struts: Vec<Strut>,
    plates: Vec<Plate>,
    /// Edges and corners of faces so far.
    size: usize,
}

#[derive(Clone, Copy)]
struct Node {
    at: DVec3,
    factor: f64,
}

impl Draft {
    /// Adds a node; `place` is that of its name.
    pub(super) fn node(
        &mut self,
        id: String,
        at: [f64; 3],
        factor: Option<f64>,
        place: Place,
    ) -> Result<(), Fault> {
        let fault = |cause| Err(Fault { place, cause });
        let factor = factor.unwrap_or(1.0);
        check_coordinates(at, [place; 3])?;
        check_factor(factor, place)?;
        if self.nodes.len() == MOST {
            return fault(Cause::TooMany { what: "nodes" });
        }
        if self.nodes.contains_key(&id) {
            return fault(Cause::Repeated { id });
        }
        self.nodes.insert(id, Node { at: DVec3::from_array(at), factor });
        Ok(())
    }

    /// Adds an edge; its own factor takes the place of those of its nodes.
    pub(super) fn edge(
        &mut self,
        ends: [(&str, Place); 2],
        factor: Option<f64>,
        place: Place,
    ) -> Result<(), Fault> {
        self.make_room(1, place)?;
        let [a, b] = [self.find(ends[0])?, self.find(ends[1])?];
        if a.at.distance(b.at) < SHORTEST {
            return Err(Fault { place, cause: Cause::NoLength });
        }
        let factors = factor.map_or([a.factor, b.factor], |factor| [factor; 2]);
        check_factor(factors[0], place)?;
        self.struts.push(Strut { ends: [a.at, b.at], factors });
        Ok(())
    }

    /// Adds a face.
    pub(super) fn face(
        &mut self,
        corners: &[(&str, Place)],
        factor: Option<f64>,
        place: Place,
    ) -> Result<(), Fault> {
        self.make_room(corners.len(), place)?;
        let fault = |cause| Err(Fault { place, cause });
        let factor = factor.unwrap_or(1.0);
        check_factor(factor, place)?;
        let count = corners.len();
        if !(3..=MOST_CORNERS).contains(&count) {
            return fault(Cause::Corners { count });
        }
        let corners = corners.iter().map(|corner| Ok(self.find(*corner)?.at));
        let corners = corners.collect::<Result<Vec<DVec3>, Fault>>()?;
        let up = normal(&corners);
        if !up.is_finite() {
            return fault(Cause::NotConvex);
        }
        if corners.iter().any(|corner| (*corner - corners[0]).dot(up).abs() > FLAT) {
            return fault(Cause::NotFlat);
        }
        if !is_convex(&corners, up) {
            return fault(Cause::NotConvex);
        }
        self.plates.push(Plate { surface: Surface::Polygon(corners), factor });
        Ok(())
    }

    /// The cell, if there is anything in it.
    pub(super) fn cell(self) -> Result<Cell, Fault> {
        let Self { nodes: _, struts, plates, size: _ } = self;
        if struts.is_empty() && plates.is_empty() {
            return Err(Fault { place: Place::Whole, cause: Cause::Empty });
        }
        Ok(Cell::new(struts, plates))
    }

    fn find(&self, (id, place): (&str, Place)) -> Result<Node, Fault> {
        let unknown = || Fault { place, cause: Cause::UnknownNode { id: id.to_owned() } };
        self.nodes.get(id).copied().ok_or_else(unknown)
    }

    /// Counts `more` edges or corners.
    fn make_room(&mut self, more: usize, place: Place) -> Result<(), Fault> {
        self.size = self.size.saturating_add(more);
        if self.size <= MOST {
            return Ok(());
        }
        Err(Fault { place, cause: Cause::TooMany { what: "edges and corners of faces" } })
    }
}

/// Refuses coordinates that are out of range; `places` are theirs.
pub(super) fn check_coordinates(at: [f64; 3], places: [Place; 3]) -> Result<(), Fault> {
    for (value, place) in at.into_iter().zip(places) {
        if !(RANGE[0]..=RANGE[1]).contains(&value) {
            return Err(Fault { place, cause: Cause::OutOfRange { value } });
        }
    }
    Ok(())
}

/// Refuses a factor that is out of range.
pub(super) fn check_factor(value: f64, place: Place) -> Result<(), Fault> {
    if value > 0.0 && value <= LARGEST_FACTOR {
        return Ok(());
    }
    Err(Fault { place, cause: Cause::Factor { value } })
}

/// Whether the polygon turns left about `up` at every corner, and once in all.
fn is_convex(corners: &[DVec3], up: DVec3) -> bool {
    let count = corners.len();
    let edge = |i: usize| corners[(i + 1) % count] - corners[i % count];
    let mut turn = 0.0;
    for i in 0..count {
        let (before, after) = (edge(i), edge(i + 1));
        let sine = before.cross(after).dot(up);
        if before.length() < SHORTEST || sine < -FLAT * before.length() * after.length() {
            return false;
        }
        turn += libm::atan2(sine, before.dot(after));
    }
    turn < 1.5 * std::f64::consts::TAU
}
