//! Thickness of walls at the vertices of their mesh: of shells, whose thickness follows from the slope
//! of a field, and of walls and struts that were asked for by a length.
//!
//! A shell of half thickness xi about the field g is the set |g| <= xi. Where g is no distance, the
//! wall's thickness in length is 2 xi / |grad g| to first order. A wall thinner than two grid
//! spacings is resolved badly: its two sides may fall between the same nodes.
//!
//! The mesh is not kept: a [`Sample`] of its vertices is taken while it streams by. Every vertex is
//! the crossing of a grid edge, and a plane of unit normal n crosses (|n_x| + |n_y| + |n_z|) edges
//! per squared spacing, so a vertex stands for an area in proportion to 1 / |n|_1.

use crate::eval::interpret;
use crate::expr::{Graph, NodeId, derive};
use crate::mesh::Sink;
use std::io;
use std::sync::{Mutex, PoisonError};

/// Most vertices that a [`Sample`] keeps: enough for a thousandth of the area to be seen.
const KEPT: u64 = 1 << 16;

/// A vertex lies on a wall if the shell's value there is below this fraction of the change of the
/// field over one spacing: vertices are roots to far better, other surfaces are hardly ever closer.
const ON_WALL: f64 = 1e-6;

/// A sink that passes a mesh on and keeps evenly numbered vertices of it.
pub struct Sample<'a> {
    inner: &'a mut dyn Sink,
    stride: u64,
    kept: Mutex<Vec<(u64, [f64; 3])>>,
}

impl<'a> Sample<'a> {
    /// Keeps vertices of the mesh that goes to `inner`.
    pub fn new(inner: &'a mut dyn Sink) -> Self {
        Self { inner, stride: 1, kept: Mutex::default() }
    }

    /// The vertices kept, in the order of their numbers.
    #[must_use]
    pub fn into_positions(self) -> Vec<[f64; 3]> {
        let mut kept = self.kept.into_inner().unwrap_or_else(PoisonError::into_inner);
        kept.sort_unstable_by_key(|(number, _)| *number);
        kept.into_iter().map(|(_, position)| position).collect()
    }
}

impl std::fmt::Debug for Sample<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sample").field("stride", &self.stride).finish_non_exhaustive()
    }
}

impl Sink for Sample<'_> {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        self.stride = vertices.div_ceil(KEPT).max(1);
        self.inner.begin(vertices, triangles)
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        let start = first.next_multiple_of(self.stride) - first;
        let chosen = (start..positions.len() as u64).step_by(self.stride as usize);
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend(chosen.map(|i| (first + i, positions[i as usize])));
        drop(kept);
        self.inner.vertices(first, positions)
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        self.inner.triangles(first, corners)
    }
}

/// Thickness of the walls of a solid.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Walls {
    /// Least thickness found, in model units, to first order.
    pub minimum: f64,
    /// Fraction of the walls' area where the wall is thinner than `limit`, 0 to 1.
    pub thin_fraction: f64,
    /// The thickness below which a wall counts as thin, in model units.
    pub limit: f64,
}

impl Walls {
    /// The thinner of two reports of walls.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        Self {
            minimum: self.minimum.min(other.minimum),
            thin_fraction: self.thin_fraction.max(other.thin_fraction),
            limit: self.limit.max(other.limit),
        }
    }
}

/// Most vertices at which a length is looked up: a field of struts may be large.
const LOOKED_UP: usize = 1 << 12;

/// Twice the lengths `half` at those of `positions` where `field` is zero, to a part of `spacing`.
///
/// A vertex counts for as much area as any other; otherwise as [`walls`].
#[must_use]
pub fn of_lengths(
    graph: &Graph,
    [field, half]: [NodeId; 2],
    parameters: &[f64],
    positions: &[[f64; 3]],
    spacing: f64,
) -> Option<Walls> {
    let stride = positions.len().div_ceil(LOOKED_UP).max(1);
    let chosen = positions.iter().step_by(stride);
    let at: [Vec<f64>; 3] = std::array::from_fn(|a| chosen.clone().map(|p| p[a]).collect());
    let [mut fields, mut halves] = [vec![0.0; at[0].len()], vec![0.0; at[0].len()]];
    let mut out = [fields.as_mut_slice(), halves.as_mut_slice()];
    let coordinates = [&*at[0], &*at[1], &*at[2]];
    interpret::points(graph, &[field, half], coordinates, parameters, &mut out).ok()?;
    let limit = 2.0 * spacing;
    let on_wall = fields.iter().zip(&halves).filter(|(f, _)| f.abs() <= ON_WALL * spacing);
    let thicknesses: Vec<f64> = on_wall.map(|(_, half)| 2.0 * half).collect();
    let minimum = thicknesses.iter().copied().reduce(f64::min)?;
    let thin = thicknesses.iter().filter(|thickness| **thickness < limit).count();
    Some(Walls { minimum, thin_fraction: thin as f64 / thicknesses.len() as f64, limit })
}

/// Thickness of the walls |`level`| <= `half` at those of `positions` that lie on them.
///
/// `spacing` is the grid's largest spacing, in model units; a wall is thin below two spacings.
/// `None` if no position lies on a wall, or a value can't be had.
#[must_use]
pub fn walls(
    graph: &mut Graph,
    level: NodeId,
    half: NodeId,
    parameters: &[f64],
    positions: &[[f64; 3]],
    spacing: f64,
) -> Option<Walls> {
    let gradient = derive::gradient(graph, level);
    let outputs = [level, half, gradient[0], gradient[1], gradient[2]];
    let at: [Vec<f64>; 3] = std::array::from_fn(|a| positions.iter().map(|p| p[a]).collect());
    let mut values = vec![0.0; outputs.len() * positions.len()];
    if positions.is_empty() {
        return None;
    }
    let mut out: Vec<&mut [f64]> = values.chunks_exact_mut(positions.len()).collect();
    interpret::points(graph, &outputs, [&at[0], &at[1], &at[2]], parameters, &mut out).ok()?;
    let [g, xi, gx, gy, gz] = out.as_slice() else { return None };
    let limit = 2.0 * spacing;
    let (mut minimum, mut thin, mut total) = (f64::INFINITY, 0.0, 0.0);
    for i in 0..positions.len() {
        let n = [gx[i], gy[i], gz[i]];
        let slope = n.iter().map(|c| c * c).sum::<f64>().sqrt();
        // False where any of them is NaN.
        let on_wall = (g[i].abs() - xi[i]).abs() <= ON_WALL * slope * spacing;
        if !on_wall || slope == 0.0 {
            continue;
        }
        let thickness = 2.0 * xi[i] / slope;
        let weight = slope / n.iter().map(|c| c.abs()).sum::<f64>();
        minimum = minimum.min(thickness);
        total += weight;
        if thickness < limit {
            thin += weight;
        }
    }
    (total > 0.0).then(|| Walls { minimum, thin_fraction: thin / total, limit })
}
