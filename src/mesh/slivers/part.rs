//! Parting of vertices that lie close together but can't become one.

use super::sheets::{Sheets, is_sliver, least_angle_deg};
use super::slide::{Place, keeps_sides, land};
use super::{Field, POOR_DEG, SHORT};
use crate::mesh::topology::Stars;
use glam::DVec3;
use rayon::prelude::*;

/// How far vertices move that are tried, in parts of the spacing; towards what is close where negative.
const WAYS: [f64; 6] = [0.5, 0.35, 0.25, 0.125, -0.125, -0.25];
/// Degrees up to which an angle counts: a sliver next to others gains by what it is not alone.
const ENOUGH_DEG: f64 = 10.0;
/// Degrees that the angles about a vertex must gain together: partings end.
const GAIN_DEG: f64 = 0.1;

/// Moves vertices of slivers away from those close to them, along the surface or within a flat cut,
/// where the small angles about them grow together and none becomes small; returns how many.
///
/// A vertex in the middle of its neighbours stays there as long as these stay close together: where the
/// surface is a thread, or a wedge next to a flat cut, sliding there makes it thinner.
pub(super) fn part<E>(
    sheets: &mut Sheets,
    spacing: f64,
    field: &mut Field<'_, E>,
) -> Result<usize, E> {
    let slivers = sheets.mesh.triangles.par_iter().filter(|c| is_sliver(sheets.points(**c)));
    let mut vertices: Vec<u32> = (slivers.flat_map_iter(|corners| *corners))
        .filter(|vertex| sheets.holds[*vertex as usize].count() == 1)
        .collect();
    if vertices.is_empty() {
        return Ok(0);
    }
    let stars = sheets.stars();
    vertices.sort_unstable();
    vertices.dedup();
    let mut ring = Vec::new();
    let mut places = Vec::new();
    for vertex in &vertices {
        sheets.ring(&stars, *vertex, &mut ring);
        let from = sheets.at(*vertex);
        let holds = sheets.holds[*vertex as usize];
        for close in [middle(sheets, from, &ring, spacing), closest(sheets, &stars, *vertex)] {
            let away = (from - close).normalize_or_zero();
            let to = |way: f64| holds.hold(from, from + way * spacing * away);
            places.extend(WAYS.map(|way| Place::new(to(way), holds)));
        }
    }
    land(&mut places, spacing, field)?;
    let mut count = 0;
    // One after the other: each sees where those before it went.
    for (vertex, places) in vertices.into_iter().zip(places.chunks(2 * WAYS.len())) {
        if let Some(to) = best(sheets, &stars, vertex, places, spacing) {
            sheets.put(vertex, to);
            count += 1;
        }
    }
    Ok(count)
}

/// The middle of those of `ring` that are close to `from`; `from`, if none is.
fn middle(sheets: &Sheets, from: DVec3, ring: &[u32], spacing: f64) -> DVec3 {
    let ways = ring.iter().map(|vertex| sheets.at(*vertex) - from);
    let close = ways.filter(|way| way.length() < SHORT * spacing);
    let (sum, number) = close.fold((DVec3::ZERO, 0.0), |(sum, n), way| (sum + way, n + 1.0));
    from + sum / f64::max(number, 1.0)
}

/// The point closest to `vertex` on the sides across from it.
fn closest(sheets: &Sheets, stars: &Stars, vertex: u32) -> DVec3 {
    let from = sheets.at(vertex);
    let feet = sheets.about(stars, vertex).map(|[a, b, c]| {
        let [a, b] = if a == vertex {
            [b, c]
        } else if b == vertex {
            [c, a]
        } else {
            [a, b]
        };
        let (a, side) = (sheets.at(a), sheets.at(b) - sheets.at(a));
        a + side * ((from - a).dot(side) / side.length_squared()).clamp(0.0, 1.0)
    });
    let closer = |a: DVec3, b: DVec3| if from.distance(b) < from.distance(a) { b } else { a };
    feet.fold(DVec3::INFINITY, closer)
}

/// The best of `places` for `vertex`, if one is better than where it is.
fn best(
    sheets: &Sheets,
    stars: &Stars,
    vertex: u32,
    places: &[Place],
    spacing: f64,
) -> Option<DVec3> {
    let angles = |place: DVec3| {
        sheets.about(stars, vertex).map(move |corners| {
            least_angle_deg(corners.map(|c| if c == vertex { place } else { sheets.at(c) }))
        })
    };
    let together = |place: DVec3| angles(place).map(|angle| angle.min(ENOUGH_DEG)).sum::<f64>();
    let from = sheets.at(vertex);
    let (mut most, mut best) = (together(from) + GAIN_DEG, None);
    for place in places.iter().copied() {
        let to = place.at;
        let keeps_angles =
            || angles(to).zip(angles(from)).all(|(after, before)| after >= before.min(POOR_DEG));
        if to.distance(from) <= spacing
            && together(to) > most
            && keeps_angles()
            && keeps_sides(sheets, stars, vertex, place)
        {
            (most, best) = (together(to), Some(to));
        }
    }
    best
}
