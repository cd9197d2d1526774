//! Splitting of edges that bar a contraction.
//!
//! Where three edges go round a neck, the ends of one of them have a third neighbour in common, and with
//! that edge the neck would be gone. One of the other two edges is split, so that there are four, and
//! three when the short one is contracted.

use super::contract::{contract_these, contraction};
use super::edges::{self, Edge};
use super::sheets::{Holds, Sheet, Sheets, is_along, is_sliver, normal};
use super::slide::{OPPOSED, Place, land};
use super::{Field, TURN};
use crate::mesh::topology::Stars;
use glam::DVec3;
use std::ops::Range;

/// Edges longer than this part of the spacing may be split.
const LONG: f64 = 0.2;
/// How far from the middle of an edge a vertex starts for the surface, in parts of the way to the
/// corner across: where the surface crosses itself along the edge, it has no slope in the middle.
const ASIDE: f64 = 0.125;

/// An edge to be contracted, and what bars that.
struct Barred {
    edge: Edge,
    /// Where its ends come to lie.
    at: DVec3,
    /// For each third neighbour in common the splits that are tried.
    bars: Vec<Range<usize>>,
}

/// An edge that may be split.
#[derive(Clone, Copy)]
struct Split {
    ends: [u32; 2],
    /// The sheet on both its sides.
    sheet: Sheet,
}

/// A triangle's number and what two triangles it becomes.
type Halved = (u32, [[u32; 3]; 2]);

/// Contracts short edges of slivers after splitting the edges that bar it; returns how many edges
/// were split, and how many contracted.
///
/// No triangle of the split edges is a sliver in the end.
pub(super) fn split<E>(
    sheets: &mut Sheets,
    spacing: f64,
    field: &mut Field<'_, E>,
) -> Result<[usize; 2], E> {
    let edges = edges::of_slivers(sheets, spacing);
    if edges.is_empty() {
        return Ok([0, 0]);
    }
    let stars = sheets.stars();
    let (mut splits, mut places) = (Vec::new(), Vec::new());
    let mut all = Vec::new();
    let mut is_busy = vec![false; sheets.mesh.positions.len()];
    let mut rings = [Vec::new(), Vec::new()];
    for edge in edges {
        let [a, b] = edge.ends;
        let [of_a, of_b] = &mut rings;
        sheets.ring(&stars, a, of_a);
        sheets.ring(&stars, b, of_b);
        let about = || [a, b].into_iter().chain(of_a.iter().copied()).chain(of_b.iter().copied());
        if about().any(|vertex| is_busy[vertex as usize]) {
            continue;
        }
        let Some(contraction) = contraction(sheets, &stars, edge, spacing) else { continue };
        let is_side = |c: u32| {
            sheets.about(&stars, a).any(|corners| corners.contains(&b) && corners.contains(&c))
        };
        let thirds = of_a.iter().copied().filter(|c| of_b.contains(c) && !is_side(*c));
        let bars: Vec<Range<usize>> = thirds
            .map(|third| {
                let first = splits.len();
                for (split, place) in tries(sheets, &stars, edge, third, spacing) {
                    splits.push(split);
                    places.push(place);
                }
                first..splits.len()
            })
            .collect();
        if !bars.is_empty() {
            about().for_each(|vertex| is_busy[vertex as usize] = true);
            all.push(Barred { edge, at: contraction.at, bars });
        }
    }
    land(&mut places, spacing, field)?;
    let old = sheets.mesh.triangles.len();
    let mut count = 0;
    let mut freed = Vec::new();
    for barred in all {
        if free(sheets, &stars, &barred, &splits, &places, old) {
            count += barred.bars.len();
            freed.push(barred.edge);
        }
    }
    Ok([count, contract_these(sheets, spacing, &freed)])
}

/// The splits that are tried of the edges from the ends of `edge` to `third`, the longer first, and
/// where the new vertex starts for the surface.
fn tries(
    sheets: &Sheets,
    stars: &Stars,
    edge: Edge,
    third: u32,
    spacing: f64,
) -> Vec<(Split, Place)> {
    let to = sheets.at(third);
    let mut ends = edge.ends;
    if sheets.at(ends[0]).distance(to) < sheets.at(ends[1]).distance(to) {
        ends.swap(0, 1);
    }
    let mut tries = Vec::new();
    for end in ends {
        let from = sheets.at(end);
        let Some([sheet, other]) = sheets.sides(stars, end, third) else { continue };
        // A rim stays what it is.
        if sheet != other || from.distance(to) < LONG * spacing {
            continue;
        }
        let middle = 0.5 * (from + to);
        let across = sheets.about(stars, end).filter(|corners| corners.contains(&third));
        let across = across.flatten().filter(|corner| *corner != end && *corner != third);
        let aside = across.map(|corner| middle + ASIDE * (sheets.at(corner) - middle));
        let split = Split { ends: [end, third], sheet };
        let place = |at: DVec3| (split, Place::new(at, Holds::of(sheet)));
        tries.extend([middle].into_iter().chain(aside).map(place));
    }
    tries
}

/// Splits an edge for each bar of `barred`, or none; returns whether it did.
fn free(
    sheets: &mut Sheets,
    stars: &Stars,
    barred: &Barred,
    splits: &[Split],
    places: &[Place],
    old: usize,
) -> bool {
    let (vertices, triangles) = (sheets.mesh.positions.len(), sheets.mesh.triangles.len());
    let mut replaced = Vec::new();
    for bar in &barred.bars {
        let found = bar.clone().find_map(|i| {
            let halved = halves(sheets, stars, barred, splits[i], places[i], old)?;
            Some((halved, places[i].at, Holds::of(splits[i].sheet)))
        });
        let Some((halved, at, holds)) = found else {
            for (number, corners) in replaced.into_iter().rev() {
                sheets.mesh.triangles[number as usize] = corners;
            }
            sheets.mesh.triangles.truncate(triangles);
            sheets.take_back(vertices);
            return false;
        };
        for (number, [one, other]) in halved {
            replaced.push((number, sheets.mesh.triangles[number as usize]));
            sheets.mesh.triangles[number as usize] = one;
            sheets.mesh.triangles.push(other);
        }
        sheets.add(at, holds);
    }
    true
}

/// What becomes of the two triangles at a split edge, if none of the four is a sliver or turned over
/// once `barred` is contracted; triangles from `old` on are none of `stars`.
fn halves(
    sheets: &Sheets,
    stars: &Stars,
    barred: &Barred,
    Split { ends, sheet }: Split,
    Place { at, is_there, out }: Place,
    old: usize,
) -> Option<[Halved; 2]> {
    if !is_there || !sheets.is_free_place(Holds::of(sheet), at) || !sheets.is_new_place(at) {
        return None;
    }
    let vertex = sheets.mesh.positions.len() as u32;
    let before = |corner: u32| if corner == vertex { at } else { sheets.at(corner) };
    let place = |corner: u32| match corner {
        _ if corner == vertex => at,
        _ if barred.edge.ends.contains(&corner) => barred.at,
        _ => sheets.at(corner),
    };
    let new = old as u32..sheets.mesh.triangles.len() as u32;
    let mut halved = (stars.about(ends[0]).iter().copied().chain(new))
        .map(|number| (number, sheets.mesh.triangles[number as usize]))
        .filter(|(_, corners)| ends.iter().all(|end| corners.contains(end)))
        .map(|(number, corners)| {
            let half =
                |gone: u32| corners.map(|corner| if corner == gone { vertex } else { corner });
            let halves = ends.map(half);
            let whole = normal(corners.map(place));
            let is_own_sheet = out == DVec3::ZERO || is_along(whole, out, OPPOSED);
            let is_fine = is_own_sheet
                && halves.iter().all(|half| sheets.is_wide(half.map(before)))
                && halves
                    .iter()
                    .map(|half| half.map(place))
                    .all(|points| is_along(whole, normal(points), TURN) && !is_sliver(points));
            is_fine.then_some((number, halves))
        });
    Some([halved.next()??, halved.next()??])
}
