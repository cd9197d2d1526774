//! Edges that are short against the grid's.

use super::SHORT;
use super::sheets::{Sheets, is_sliver};
use rayon::prelude::*;

/// An edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) length: f64,
    /// The lower number first.
    pub(super) ends: [u32; 2],
}

/// All edges shorter than [`SHORT`] of `spacing`, the shortest first.
pub(super) fn short(sheets: &Sheets, spacing: f64) -> Vec<Edge> {
    // Each edge is seen from both its sides.
    let edges = sheets.mesh.triangles.par_iter().flat_map_iter(|corners| {
        sides(sheets, *corners, spacing).filter(|(edge, [from, _])| edge.ends[0] == *from)
    });
    sorted(edges.map(|(edge, _)| edge).collect())
}

/// Those that a triangle with an angle below 5° has.
pub(super) fn of_slivers(sheets: &Sheets, spacing: f64) -> Vec<Edge> {
    let slivers = sheets.mesh.triangles.par_iter().filter(|c| is_sliver(sheets.points(**c)));
    let edges = slivers.flat_map_iter(|corners| sides(sheets, *corners, spacing));
    let mut edges = sorted(edges.map(|(edge, _)| edge).collect());
    edges.dedup();
    edges
}

/// The short sides of a triangle, with the way that it runs along them.
fn sides(
    sheets: &Sheets,
    [a, b, c]: [u32; 3],
    spacing: f64,
) -> impl Iterator<Item = (Edge, [u32; 2])> {
    [[a, b], [b, c], [c, a]].into_iter().filter_map(move |[from, to]| {
        let length = sheets.at(from).distance(sheets.at(to));
        let ends = [from.min(to), from.max(to)];
        (length < SHORT * spacing).then_some((Edge { length, ends }, [from, to]))
    })
}

fn sorted(mut edges: Vec<Edge>) -> Vec<Edge> {
    edges.par_sort_unstable_by(|a, b| a.length.total_cmp(&b.length).then(a.ends.cmp(&b.ends)));
    edges
}
