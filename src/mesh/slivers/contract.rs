//! Contraction of short edges.

use super::edges::{self, Edge};
use super::sheets::{Holds, Sheets, is_along, least_angle_deg, normal};
use super::{POOR_DEG, TINY, TURN};
use crate::mesh::topology::Stars;
use glam::DVec3;

/// Small angles may shrink to this part: with the vertex a short edge is gone, and what is left can
/// slide.
const LOSS: f64 = 0.8;

/// Where the surface crosses an edge of the box twice within this part of the spacing, it touches it.
const BRIEF: f64 = 0.125;

/// How the ends of an edge become one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contraction {
    kept: u32,
    gone: u32,
    /// Where they come to lie.
    pub(super) at: DVec3,
    holds: Holds,
}

/// Contracts short edges, the shortest first, none of them next to another; returns how many.
pub(super) fn contract(sheets: &mut Sheets, spacing: f64) -> usize {
    let edges = edges::short(sheets, spacing);
    contract_these(sheets, spacing, &edges)
}

/// Contracts those of `edges` that may be, none of them next to one before it; returns how many.
pub(super) fn contract_these(sheets: &mut Sheets, spacing: f64, edges: &[Edge]) -> usize {
    let stars = sheets.stars();
    let mut is_busy = vec![false; sheets.mesh.positions.len()];
    let mut numbers: Vec<u32> = (0..sheets.mesh.positions.len() as u32).collect();
    let mut rings = [Vec::new(), Vec::new()];
    let mut count = 0;
    for edge in edges {
        let [a, b] = edge.ends;
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
        let Some(way) = contraction(sheets, &stars, *edge, spacing) else { continue };
        let Contraction { kept, gone, at, holds } = way;
        sheets.abandon(gone);
        sheets.put(kept, at);
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

/// How `edge` may be contracted, whatever its ends' neighbours in common.
pub(super) fn contraction(
    sheets: &Sheets,
    stars: &Stars,
    edge: Edge,
    spacing: f64,
) -> Option<Contraction> {
    let [a, b] = edge.ends;
    let [one, other] = sheets.sides(stars, a, b)?;
    let is_feature = one != other;
    let is_tiny = edge.length < TINY * spacing;
    let is_brief = edge.length < BRIEF * spacing;
    let is_pair = is_brief && sheets.holds[a as usize] == sheets.holds[b as usize];
    let ways = [(a, b), (b, a)]
        .map(|(kept, gone)| way(sheets, kept, gone, is_feature, [is_tiny, is_tiny || is_pair]));
    ways.into_iter().flatten().find(|way| is_harmless(sheets, stars, *way, is_tiny))
}

/// How `gone` may become one with `kept`, if what holds it holds that, too.
///
/// A vertex that two sheets hold moves along their common edge alone, and a corner of three stays,
/// but where the edge is so short that both ends are one place (`is_tiny`), or where it may join another
/// of the same three.
fn way(
    sheets: &Sheets,
    kept: u32,
    gone: u32,
    is_feature: bool,
    [is_tiny, may_join]: [bool; 2],
) -> Option<Contraction> {
    let [own, others] = [kept, gone].map(|vertex| sheets.holds[vertex as usize]);
    let is_free = others.count() <= 1 || is_feature || is_tiny;
    let at = sheets.at(kept);
    if own.include(others) && is_free && (others.count() < 3 || may_join) {
        return Some(Contraction { kept, gone, at, holds: own });
    }
    // A corner or an edge of the box that the surface passes this close belongs to the surface, and
    // rims on two sides of the box meet on its edge.
    let [own_all, others_all] = [own, others].map(|holds| holds.union(Holds::SURFACE));
    let meet = is_tiny && (own_all.include(others) || !others_all.include(own));
    meet.then(|| Contraction {
        kept,
        gone,
        at: others.hold(sheets.at(gone), at),
        holds: own.union(others),
    })
}

/// Whether no triangle turns over, leaves its sheet or loses its area, no other vertex is there, and no
/// worse sliver comes of it.
fn is_harmless(sheets: &Sheets, stars: &Stars, way: Contraction, is_tiny: bool) -> bool {
    let Contraction { kept, gone, at, holds } = way;
    if !sheets.is_open_place(kept, at) && !sheets.is_open_place(gone, at) {
        return false;
    }
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
            let is_fine = stays && is_along(normal(before), normal(after), TURN);
            if !is_fine || !sheets.is_wide(after) {
                return false;
            }
        }
    }
    is_tiny || worst_after >= POOR_DEG || worst_after > LOSS * worst_before
}
