//! Senses of faces: neighbours agree, and bodies are outside in nowhere.

use super::surface::{Edges, NONE};
use super::winding;
use crate::geom::Aabb;
use glam::DVec3;

/// Most closed parts inside out that are looked into: each takes a sum over all faces.
const MOST_PARTS: usize = 16;

/// Signed volume of the cone from `tip` over `triangles`.
pub fn volume<'a>(
    positions: &[DVec3],
    triangles: impl IntoIterator<Item = &'a [u32; 3]>,
    tip: DVec3,
) -> f64 {
    let cone = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| positions[v as usize] - tip);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.into_iter().map(cone).sum()
}

/// Turns faces over so that neighbours agree, in every connected part in which some do not; the
/// number of faces turned. A part follows the sense of two thirds of its area, failing that it
/// turns outward. One-sided parts are left as they are.
pub fn turn_back(positions: &[DVec3], triangles: &mut [[u32; 3]], edges: &Edges) -> usize {
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut part: Vec<u32> = Vec::new();
    let mut count = 0;
    for seed in 0..triangles.len() {
        if turned[seed].is_some() {
            continue;
        }
        part.clear();
        part.push(seed as u32);
        turned[seed] = Some(false);
        let (mut next, mut disagrees, mut one_sided) = (0, false, false);
        while let Some(face) = part.get(next).map(|f| *f as usize) {
            next += 1;
            for i in 0..3 {
                let half = edges.twin[3 * face + i];
                if half == NONE {
                    continue;
                }
                let (other, j) = (half as usize / 3, half as usize % 3);
                let against = triangles[face][i] == triangles[other][j];
                let sense = turned[face].map(|sense| sense != against);
                disagrees |= against;
                if turned[other].is_none() {
                    turned[other] = sense;
                    part.push(other as u32);
                } else {
                    one_sided |= turned[other] != sense;
                }
            }
        }
        if disagrees && !one_sided {
            let (mut kept, mut changed) = (0.0, 0.0);
            let mut oriented = Vec::with_capacity(part.len());
            for face in &part {
                let [a, b, c] = triangles[*face as usize];
                let [p, q, r] = [a, b, c].map(|v| positions[v as usize]);
                let area = (q - p).cross(r - p).length();
                if turned[*face as usize] == Some(true) {
                    changed += area;
                    oriented.push([a, c, b]);
                } else {
                    kept += area;
                    oriented.push([a, b, c]);
                }
            }
            let over = if changed > 2.0 * kept {
                true
            } else if kept > 2.0 * changed {
                false
            } else {
                let tip = Aabb::around(oriented.iter().flatten().map(|v| positions[*v as usize]));
                volume(positions, &oriented, 0.5 * tip.lo + 0.5 * tip.hi) < 0.0
            };
            for (face, [a, b, c]) in part.iter().zip(oriented) {
                let corners = if over { [a, c, b] } else { [a, b, c] };
                let now = &mut triangles[*face as usize];
                // The same sense may be written from another corner.
                count += usize::from(*now != corners);
                *now = corners;
            }
        }
    }
    count
}

/// Turns over every closed part that is inside out and lies in no other part, where it would be a
/// cavity; the number of faces turned.
pub fn turn_outward(positions: &[DVec3], triangles: &mut [[u32; 3]], edges: &Edges) -> usize {
    let mut part_of = vec![NONE; triangles.len()];
    let mut inside_out = Vec::new();
    let mut part: Vec<u32> = Vec::new();
    for seed in 0..triangles.len() {
        if part_of[seed] != NONE {
            continue;
        }
        part.clear();
        part.push(seed as u32);
        part_of[seed] = seed as u32;
        let (mut next, mut closed) = (0, true);
        while let Some(face) = part.get(next).map(|f| *f as usize) {
            next += 1;
            for half in &edges.twin[3 * face..3 * face + 3] {
                let other = *half as usize / 3;
                if *half == NONE {
                    closed = false;
                } else if part_of[other] == NONE {
                    part_of[other] = seed as u32;
                    part.push(other as u32);
                }
            }
        }
        let faces = || part.iter().map(|face| &triangles[*face as usize]);
        let tip = positions[triangles[seed][0] as usize];
        if closed && volume(positions, faces(), tip) < 0.0 {
            inside_out.push(seed);
        }
    }
    if inside_out.len() > MOST_PARTS {
        return 0;
    }
    let alone = |seed: &usize| {
        let others = part_of.iter().zip(triangles.iter());
        let others = others.filter(|(part, _)| **part != *seed as u32).map(|(_, corners)| corners);
        let point = positions[triangles[*seed][0] as usize];
        let corners = others.map(|corners| corners.map(|v| positions[v as usize]));
        winding::exact(corners, point).abs() < 0.5
    };
    let turned: Vec<u32> = inside_out.iter().filter(|s| alone(s)).map(|s| *s as u32).collect();
    let mut count = 0;
    for (corners, part) in triangles.iter_mut().zip(&part_of) {
        if turned.contains(part) {
            corners.swap(1, 2);
            count += 1;
        }
    }
    count
}
