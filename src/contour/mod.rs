//! From signs to a watertight mesh: cases, placement, flat cuts, streaming assembly.
//!
//! [`contour`] makes the mesh of `f < 0` on a [`Grid`] by marching cubes. It promises, for every
//! field whatsoever (zeros, NaN and infinities included):
//!
//! * The mesh is closed, oriented, edge-manifold and vertex-manifold, and cut flat by the grid's
//!   outer planes ([`tables`] has the proof).
//! * No triangle has zero area, in double precision or, where [`Grid::precision`] says so, in single.
//! * Vertices are roots of the field on grid edges to rounding (`place`, `roots`), but within
//!   [`grid::TAU`] of a node with several crossed edges.
//! * The bytes handed to the sink depend on neither the number of threads nor on what the octree
//!   settled: sparse equals dense (`numbering`).
//!
//! It does not promise features finer than a cell, nor triangles of good shape.

mod assemble;
mod bits;
mod classify;
mod coarse;
mod faces;
pub mod grid;
mod guess;
mod numbering;
pub mod outlines;
mod place;
mod roots;
pub mod signs;
pub mod sweep;
pub mod tables;

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use grid::{Grid, GridError};
pub use place::{BrickLines, RimRoot, Roots};
pub use signs::Signs;

use crate::eval::Sampler;
use crate::eval::sampler::Failure;
use crate::mesh::Sink;
use crate::num::memory::Shortage;
use crate::num::{Cancelled, Progress};
use crate::octree::Pruning;
use serde::{Serialize, Serializer};
use std::time::{Duration, Instant};

/// What the caller of [`contour`] chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// Whether intervals may settle boxes.
    pub pruning: Pruning,
    /// Most bytes of memory for what is kept of the bricks until the mesh is made; what the system
    /// has to spare by default. What the sink takes is not counted.
    pub memory: Option<u64>,
}

/// What [`contour`] did.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Report {
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh; none when no node is inside.
    pub triangles: u64,
    /// Bricks in the grid.
    pub bricks: u64,
    /// Bricks that were sampled.
    pub active_bricks: u64,
    /// Samples taken.
    pub samples: u64,
    /// Samples at nodes that were NaN, which count as outside.
    pub nans: u64,
    /// Boxes that were enclosed by intervals.
    pub boxes: u64,
    /// Time spent.
    pub stages: Stages,
}

impl Report {
    /// Euler characteristic of the mesh: vertices less edges plus triangles, of which each has half of
    /// three edges.
    #[must_use]
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - (self.triangles / 2) as i64
    }
}

/// Time spent in each stage: by the clock in `subdivide` and `total`, summed over threads
/// elsewhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Stages {
    /// Interval subdivision.
    #[serde(serialize_with = "seconds")]
    pub subdivide: Duration,
    /// Sampling signs.
    #[serde(serialize_with = "seconds")]
    pub sample: Duration,
    /// Counting vertices and triangles.
    #[serde(serialize_with = "seconds")]
    pub count: Duration,
    /// Numbering the vertices of bricks.
    #[serde(serialize_with = "seconds")]
    pub number: Duration,
    /// Placing vertices.
    #[serde(serialize_with = "seconds")]
    pub place: Duration,
    /// Making triangles.
    #[serde(serialize_with = "seconds")]
    pub faces: Duration,
    /// Handing pieces to the sink.
    #[serde(serialize_with = "seconds")]
    pub write: Duration,
    /// Everything.
    #[serde(serialize_with = "seconds")]
    pub total: Duration,
}

/// Times are numbers of seconds for machines.
fn seconds<S: Serializer>(time: &Duration, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_f64(time.as_secs_f64())
}

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The sampler is bound to other tables than the grid's.
    #[error("the field is bound to {sampler:?} nodes but the grid has {grid:?}")]
    OtherGrid {
        /// Lengths of the sampler's tables.
        sampler: [usize; 3],
        /// Lengths of the grid's tables.
        grid: [usize; 3],
    },
    /// A field without a formula could not be evaluated.
    #[error(transparent)]
    Failure(#[from] Failure),
    /// The caller cancelled the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Vertices can't be numbered with 32 bits.
    #[error("the mesh would have {vertices} vertices, more than 2^32 - 1; give a larger spacing")]
    TooManyVertices {
        /// Vertices of the mesh.
        vertices: u64,
    },
    /// What is kept of the bricks that have to be sampled would not fit into memory.
    #[error("{0}; give a larger spacing or smaller bounds")]
    Memory(Shortage),
    /// The sink failed.
    #[error(transparent)]
    Sink(#[from] std::io::Error),
}

/// Makes the mesh of the field that `sampler` has bound to the tables [`Grid::sampled`].
///
/// # Errors
/// [`Error`] when the field can't be evaluated, the work is cancelled, the mesh is too large or
/// the sink fails; the sink may then have received a part of the mesh.
pub fn contour<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
    sink: &mut dyn Sink,
) -> Result<Report, Error> {
    let start = Instant::now();
    let (bricks, mut report) = signs::bricks(sampler, grid, settings, progress)?;
    assemble::assemble(sampler, grid, &bricks, progress, sink, &mut report)?;
    report.stages.total = start.elapsed();
    Ok(report)
}
