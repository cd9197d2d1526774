//! Flipping of edges that make small angles.

use super::GOOD_DEG;
use super::sheets::{Sheets, is_along, least_angle_deg, normal};
use crate::mesh::topology::Stars;
use rayon::prelude::*;

/// The normals of the new triangles differ from that of the old ones by less than the angle of this
/// cosine.
const TURN: f64 = 0.8;
/// An angle must grow by this many degrees: flips end.
const GAIN_DEG: f64 = 1e-6;

/// Flips an edge of every triangle with a small angle for which that makes the least angle of both
/// its triangles larger, the smallest angles first, none next to another; returns how many.
pub(super) fn flip(sheets: &mut Sheets) -> usize {
    let stars = sheets.stars();
    let mut poor: Vec<(f64, u32)> = (sheets.mesh.triangles.par_iter().enumerate())
        .map(|(number, corners)| (least_angle_deg(sheets.points(*corners)), number as u32))
        .filter(|(angle, _)| *angle < GOOD_DEG)
        .collect();
    poor.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut is_busy = vec![false; sheets.mesh.positions.len()];
    let mut count = 0;
    for (_, number) in poor {
        let [a, b, c] = sheets.mesh.triangles[number as usize];
        if [a, b, c].iter().any(|corner| is_busy[*corner as usize]) {
            continue;
        }
        let flips = [[a, b, c], [b, c, a], [c, a, b]];
        let flips =
            flips.into_iter().filter_map(|corners| flipped(sheets, &stars, corners, &is_busy));
        let best =
            flips.reduce(|best, next| if next.least_deg > best.least_deg { next } else { best });
        let Some(Flipped { other, triangles, .. }) = best else { continue };
        for (number, corners) in [number, other].into_iter().zip(triangles) {
            sheets.mesh.triangles[number as usize] = corners;
            corners.iter().for_each(|corner| is_busy[*corner as usize] = true);
        }
        count += 1;
    }
    count
}

/// What a flip makes.
struct Flipped {
    /// The triangle on the other side of the edge.
    other: u32,
    triangles: [[u32; 3]; 2],
    least_deg: f64,
}

/// The flip of the edge from `a` to `b` of a triangle, if it is one for the better.
fn flipped(
    sheets: &Sheets,
    stars: &Stars,
    [a, b, c]: [u32; 3],
    is_busy: &[bool],
) -> Option<Flipped> {
    let is_beyond =
        |corners: [u32; 3]| [0, 1, 2].iter().any(|&i| corners[i] == b && corners[(i + 1) % 3] == a);
    let numbers = stars.about(a).iter().copied();
    let other = { numbers }.find(|n| is_beyond(sheets.mesh.triangles[*n as usize]))?;
    let beyond = sheets.mesh.triangles[other as usize];
    let d = *beyond.iter().find(|corner| **corner != a && **corner != b)?;
    let joins = |corners: [u32; 3]| corners.contains(&d);
    if c == d || is_busy[d as usize] || sheets.about(stars, c).any(joins) {
        return None;
    }
    let (old, new) = ([[a, b, c], beyond], [[c, a, d], [d, b, c]]);
    let sheet = sheets.sheet(old[0]);
    if old.into_iter().chain(new).any(|corners| sheets.sheet(corners) != sheet) {
        return None;
    }
    let normals =
        |triangles: [[u32; 3]; 2]| triangles.map(|corners| normal(sheets.points(corners)));
    let [one, two] = normals(old);
    let is_wide = |corners: [u32; 3]| sheets.is_wide(sheets.points(corners));
    let is_flat = normals(new).into_iter().all(|normal| is_along(normal, one + two, TURN));
    if !is_flat || !new.into_iter().all(is_wide) {
        return None;
    }
    let least = |triangles: [[u32; 3]; 2]| {
        let [one, two] = triangles.map(|corners| least_angle_deg(sheets.points(corners)));
        one.min(two)
    };
    let least_deg = least(new);
    (least_deg > least(old) + GAIN_DEG).then_some(Flipped { other, triangles: new, least_deg })
}
