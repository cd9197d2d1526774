//! Contraction of short edges.

use super::sheets::{Holds, Sheets, is_along, least_angle_deg, normal};
use super::{SHORT, TINY};
use crate::mesh::topology::Stars;
use glam::DVec3;
use rayon::prelude::*;

/// A contraction that leaves a smaller angle than this, in degrees, must leave none much smaller
/// than there was.
const POOR_DEG: f64 = 8.0;

/// Small angles may shrink to this part: with the vertex a short edge is gone, and what is left can
/// slide.
const LOSS: f64 = 0.8;

/// Triangles turn by less than the angle of this cosine.
const TURN: f64 = 0.5;

/// How the ends of an edge become one.
#[derive(Clone, Copy)]
struct Contraction {
    kept: u32,
    gone: u32,
    at: DVec3,
    holds: Holds,
}

/// Contracts edges shorter than [`SHORT`] of `spacing`, the shortest first, none of them next to
/// another; returns how many.
pub(super) fn contract(sheets: &mut Sheets, spacing: f64) -> usize {
    let stars = sheets.stars();
    let mut edges: Vec<(f64, u32, u32)> = (sheets.mesh.triangles.par_iter())
        .flat_map_iter(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| a < b)
        .map(|[a, b]| (sheets.at(a).distance(sheets.at(b)), a, b))
        .filter(|(length, ..)| *length < SHORT * spacing)
        .collect();
    edges.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut is_busy = vec![false; sheets.mesh.positions.len()];
    let mut numbers: Vec<u32> = (0..sheets.mesh.positions.len() as u32).collect();
    let mut rings = [Vec::new(), Vec::new()];
    let mut count = 0;
    for (length, a, b) in edges {
        if is_busy[a as usize] || is_busy[b as usize] {
            continue;
        }
        let [of_a, of_b] = &mut rings;
        sheets.ring(&stars, a, of_a);
        sheets.ring(&stars, b, of_b);
        if of_a.iter().chain(&*of_b).any(|vertex| is_busy[*vertex as usize]) {
            continue;
        }
        // The link condition: the mesh stays a manifold of the same kind. Of a tetrahedron, whose ends
        // share an edge too, two triangles would be left, back to back.
        let is_tetrahedron = of_a.len() == 3 && of_b.len() == 3;
        let shared = of_a.iter().filter(|vertex| of_b.contains(vertex)).count();
        if shared != 2 || is_tetrahedron {
            continue;
        }
        let Some([one, other]) = sheets.sides(&stars, a, b) else { continue };
        let is_feature = one != other;
        let is_tiny = length < TINY * spacing;
        let ways =
            [(a, b), (b, a)].map(|(kept, gone)| way(sheets, kept, gone, is_feature, is_tiny));
        let way = ways.into_iter().flatten().find(|way| is_harmless(sheets, &stars, *way, is_tiny));
        let Some(Contraction { kept, gone, at, holds }) = way else { continue };
        sheets.mesh.positions[kept as usize] = at.to_array();
        sheets.holds[kept as usize] = holds;
        numbers[gone as usize] = kept;
        for vertex in [a, b].iter().chain(&*of_a).chain(&*of_b) {
            is_busy[*vertex as usize] = true;
        }
        count += 1;
    }
    if count > 0 {
        sheets.mesh.triangles.retain_mut(|corners| {
            *corners = corners.map(|corner| numbers[corner as usize]);
            let [a, b, c] = *corners;
            a != b && b != c && c != a
        });
    }
    count
}

/// How `gone` may become one with `kept`, if what holds it holds that, too.
///
/// A vertex that two sheets hold moves along their common edge alone, and a corner of three stays,
/// but where the edge is so short that both ends are one place.
fn way(
    sheets: &Sheets,
    kept: u32,
    gone: u32,
    is_feature: bool,
    is_tiny: bool,
) -> Option<Contraction> {
    let [own, others] = [kept, gone].map(|vertex| sheets.holds[vertex as usize]);
    let is_free = others.count() <= 1 || is_feature || is_tiny;
    let at = sheets.at(kept);
    if own.include(others) && is_free && (others.count() < 3 || is_tiny) {
        return Some(Contraction { kept, gone, at, holds: own });
    }
    // A corner or an edge of the box that the surface passes this close belongs to the surface.
    (is_tiny && own.union(Holds::SURFACE).include(others)).then(|| Contraction {
        kept,
        gone,
        at,
        holds: own.union(others),
    })
}

/// Whether no triangle turns over or leaves its sheet, and no worse sliver comes of it.
fn is_harmless(sheets: &Sheets, stars: &Stars, way: Contraction, is_tiny: bool) -> bool {
    let Contraction { kept, gone, at, holds } = way;
    let (mut worst_before, mut worst_after) = (60.0_f64, 60.0_f64);
    for (vertex, other) in [(gone, kept), (kept, gone)] {
        for corners in sheets.about(stars, vertex) {
            let before = sheets.points(corners);
            worst_before = worst_before.min(least_angle_deg(before));
            let place = corners.iter().position(|corner| *corner == vertex);
            let (Some(place), false) = (place, corners.contains(&other)) else { continue };
            let mut after = before;
            after[place] = at;
            worst_after = worst_after.min(least_angle_deg(after));
            let stays = sheets.sheet_with(corners, place, holds) == sheets.sheet(corners);
            if !stays || !is_along(normal(before), normal(after), TURN) {
                return false;
            }
        }
    }
    is_tiny || worst_after >= POOR_DEG || worst_after > LOSS * worst_before
}
