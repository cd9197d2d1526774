//! Sliding of vertices along the surface, and along flat cuts.

use super::sheets::{Holds, Sheets, is_along, least_angle_deg, normal};
use super::{Field, GOOD_DEG, TURN};
use crate::mesh::topology::Stars;
use glam::DVec3;
use rayon::prelude::*;

/// Parts of the way to the middle of the neighbours that are tried.
const WAYS: [f64; 3] = [1.0, 0.5, 0.25];
/// Newton steps back to the surface; they converge quadratically but where the slope vanishes.
const STEPS: usize = 8;
/// How far from the surface a vertex may come to lie, in parts of the spacing.
const AWAY: f64 = 1e-9;
/// How far a vertex may move at once, in parts of the spacing.
const FARTHEST: f64 = 0.7;
/// How far contouring holds a vertex off the surface, in parts of the spacing, and some more.
const HELD: f64 = 1.0 / 64.0;
/// The cosine below which the field rises into the solid, by the triangles about a vertex. Where the
/// surface crosses itself the angle may be anything up to there.
pub(super) const OPPOSED: f64 = -0.85;
/// Vertices whose last steps to the surface are taken together.
const AT_ONCE: usize = 1 << 16;
/// Degrees that a small angle may lose by such a step, about a thousandth of the spacing long.
const SETTLING_DEG: f64 = 0.5;

/// Where a vertex is to go.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) at: DVec3,
    /// Whether that is on the vertex's sheet.
    pub(super) is_there: bool,
    /// Where the field rises to there, out of the solid; zero for what did not have to be found.
    pub(super) out: DVec3,
}

impl Place {
    /// A place on a flat cut, or one yet to be found on the surface.
    pub(super) const fn new(at: DVec3, holds: Holds) -> Self {
        Self { at, is_there: !holds.is_on_surface(), out: DVec3::ZERO }
    }
}

/// Slides the vertices of triangles with a small angle to the middle of their neighbours, where
/// that makes the least angle about them larger; returns how many.
///
/// Vertices on the surface slide along it, those inside a flat cut within it, all others stay.
pub(super) fn slide<E>(
    sheets: &mut Sheets,
    spacing: f64,
    field: &mut Field<'_, E>,
) -> Result<usize, E> {
    let stars = sheets.stars();
    let mut waiting: Vec<u32> = (0..sheets.mesh.positions.len() as u32)
        .into_par_iter()
        .filter(|vertex| sheets.holds[*vertex as usize].count() == 1)
        .filter(|vertex| least_about(sheets, &stars, *vertex, sheets.at(*vertex)) < GOOD_DEG)
        .collect();
    let mut count = 0;
    for way in WAYS {
        let mut places: Vec<Place> = (waiting.par_iter())
            .map_init(Vec::new, |ring, &vertex| {
                sheets.ring(&stars, vertex, ring);
                let sum: DVec3 = ring.iter().map(|neighbour| sheets.at(*neighbour)).sum();
                let from = sheets.at(vertex);
                let to = from + way * (sum / ring.len().max(1) as f64 - from);
                let holds = sheets.holds[vertex as usize];
                let at = holds.hold(from, to);
                Place::new(at, holds)
            })
            .collect();
        land(&mut places, spacing, field)?;
        // One after the other: each sees where those before it went.
        let mut places = places.into_iter();
        waiting.retain(|&vertex| {
            let Some(place) = places.next() else { return true };
            let slides = is_better(sheets, &stars, vertex, place, spacing);
            if slides {
                sheets.put(vertex, place.at);
                count += 1;
            }
            !slides
        });
    }
    Ok(count)
}

/// Puts all vertices on the surface that contouring held away from a node of the grid.
pub(super) fn settle<E>(
    sheets: &mut Sheets,
    spacing: f64,
    field: &mut Field<'_, E>,
) -> Result<(), E> {
    let stars = sheets.stars();
    let vertices: Vec<u32> = (0..sheets.mesh.positions.len() as u32)
        .filter(|vertex| sheets.holds[*vertex as usize] == Holds::SURFACE)
        .filter(|vertex| !stars.about(*vertex).is_empty())
        .collect();
    for vertices in vertices.chunks(AT_ONCE) {
        let place = |&vertex: &u32| Place::new(sheets.at(vertex), Holds::SURFACE);
        let mut places: Vec<Place> = vertices.iter().map(place).collect();
        land(&mut places, spacing, field)?;
        for (&vertex, place) in vertices.iter().zip(places) {
            let to = place.at;
            let least = |place: DVec3| least_about(sheets, &stars, vertex, place);
            let from = sheets.at(vertex);
            if to != from
                && to.distance(from) <= HELD * spacing
                && keeps_sides(sheets, &stars, vertex, place)
                && (least(to) > GOOD_DEG || least(to) > least(from) - SETTLING_DEG)
            {
                sheets.put(vertex, to);
            }
        }
    }
    Ok(())
}

/// Takes the places that are not there yet to the surface.
pub(super) fn land<E>(
    places: &mut [Place],
    spacing: f64,
    field: &mut Field<'_, E>,
) -> Result<(), E> {
    let mut open: Vec<usize> = (0..places.len()).filter(|&i| !places[i].is_there).collect();
    let mut found = vec![[0.0; 4]; open.len()];
    for step in 0..=STEPS {
        let points: Vec<[f64; 3]> = open.iter().map(|&i| places[i].at.to_array()).collect();
        let found = &mut found[..points.len()];
        field(&points, found)?;
        let mut still = Vec::new();
        for (&i, &[value, x, y, z]) in open.iter().zip(&*found) {
            let gradient = DVec3::new(x, y, z);
            // Newton's step along the gradient.
            let step_back = gradient * (value / gradient.length_squared());
            if !step_back.is_finite() {
                continue;
            }
            if step_back.length() <= AWAY * spacing {
                places[i].is_there = true;
                places[i].out = gradient;
            } else if step < STEPS {
                places[i].at -= step_back;
                still.push(i);
            }
        }
        open = still;
        if open.is_empty() {
            break;
        }
    }
    Ok(())
}

/// The least angle of the triangles about `vertex`, in degrees, if it were at `place`.
fn least_about(sheets: &Sheets, stars: &Stars, vertex: u32, place: DVec3) -> f64 {
    let angles = sheets.about(stars, vertex).map(|corners| {
        least_angle_deg(corners.map(|c| if c == vertex { place } else { sheets.at(c) }))
    });
    angles.fold(60.0, f64::min)
}

/// Whether `vertex` stays in the box, on its sheet and apart from others, and no triangle about it turns
/// over or loses its area, if it goes to `place`.
///
/// The other side of a wall, and the zero next to a jump of the field, have the solid on the other
/// side.
pub(super) fn keeps_sides(sheets: &Sheets, stars: &Stars, vertex: u32, place: Place) -> bool {
    let Place { at: to, is_there, out } = place;
    let is_own_sheet = || {
        let own = sheets.about(stars, vertex).filter(|corners| sheets.sheet(*corners) == 0);
        let outward: DVec3 = own.map(|corners| normal(sheets.points(corners))).sum();
        is_along(outward, out, OPPOSED)
    };
    is_there
        && sheets.is_free_place(sheets.holds[vertex as usize], to)
        && sheets.is_open_place(vertex, to)
        && (out == DVec3::ZERO || is_own_sheet())
        && sheets.about(stars, vertex).all(|corners| {
            let moved = corners.map(|c| if c == vertex { to } else { sheets.at(c) });
            is_along(normal(sheets.points(corners)), normal(moved), TURN) && sheets.is_wide(moved)
        })
}

/// Whether the least angle about `vertex` is larger at `place`, if it can go there.
fn is_better(sheets: &Sheets, stars: &Stars, vertex: u32, place: Place, spacing: f64) -> bool {
    let (from, to) = (sheets.at(vertex), place.at);
    to.distance(from) <= FARTHEST * spacing
        && keeps_sides(sheets, stars, vertex, place)
        && least_about(sheets, stars, vertex, to) > least_about(sheets, stars, vertex, from) + 1e-9
}
