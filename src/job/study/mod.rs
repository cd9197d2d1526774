//! Experiments on solids that pass through files: what is lost on the way.
//!
//! * [Round trips](Job::round_trips): a mesh is written, read back as a program and contoured, many times.
//! * [Hierarchies](Hierarchy): a program in steps, each on the file of the step before, against all at once.
//!
//! Both tell the four [errors](crate::measure::deviation) of each mesh to the field of the program that began
//! it all, cut by the box of the grid. That field is computed from its formulas, not read from any file, and
//! so is exact where its program names no mesh.
//!
//! What this is not: a judgement. Numbers are returned, whatever they are.
//!
//! Source: the Cesogen paper, section 4.2, figures 5 to 10.

mod hierarchy;
mod passage;
mod round_trips;

pub use hierarchy::{Hierarchy, Step};
pub use passage::Passage;
pub use round_trips::{Grids, RoundTrips, Trip};

use super::{Job, Report, Settings};
use crate::contour::{self, Grid};
use crate::geom::Axis;
use crate::measure::{Deviations, Reference};
use crate::mesh::Mesh;
use crate::mesh::check::check;
use crate::mesh::io::WriteError;
use crate::mesh::measure::measure;
use crate::mesh::sink::Collect;
use crate::num::Progress;
use std::path::PathBuf;

/// Why an experiment ended early.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A mesh could not be made, or not read back.
    #[error(transparent)]
    Job(#[from] super::Error),
    /// A file to pass through could not be written.
    #[error("cannot write `{}`: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Why not.
        source: WriteError,
    },
}

/// The numbers of a mesh, made before its coordinates were rounded to those of a file.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Numbers {
    /// The four errors, relative to the diagonal of the grid.
    #[serde(flatten)]
    pub deviations: Deviations,
    /// Volume enclosed, in cubed model units.
    pub volume: f64,
    /// Area, in squared model units.
    pub area: f64,
    /// Euler characteristic.
    pub euler: i64,
    /// How many vertices it has.
    pub vertices: u64,
    /// How many triangles it has.
    pub triangles: u64,
    /// Whether it has none of the [defects](crate::mesh::check::check) of meshes.
    pub sound: bool,
}

impl Numbers {
    fn new(mesh: &Mesh, reference: &Reference) -> Result<Self, Error> {
        let deviations = reference.deviations(mesh).map_err(contour::Error::from);
        let (found, measures) = (check(mesh), measure(mesh));
        Ok(Self {
            deviations: deviations.map_err(super::Error::from)?,
            volume: measures.volume,
            area: measures.area,
            euler: found.euler,
            vertices: found.vertices,
            triangles: found.triangles,
            sound: found.is_sound(),
        })
    }
}

/// The length of the diagonal of the grid's box, in model units.
fn diagonal(grid: &Grid) -> f64 {
    grid.bounds().size().length()
}

impl Job {
    /// The mesh of the solid on `grid`, in memory.
    fn mesh_on(&self, grid: &Grid, settings: &Settings) -> Result<(Mesh, Report), Error> {
        let mut sink = Collect::default();
        let report = self.contour(grid, settings, &Progress::new(), &mut sink)?;
        Ok((sink.into_mesh(), report))
    }

    /// The surface of the solid as the box of `grid` cuts it, distances being relative to its diagonal.
    fn reference(&self, grid: &Grid, settings: &Settings) -> Result<Reference, Error> {
        let (values, _) = self.solved(grid, settings, &Progress::new())?;
        let mut graph = self.graph.clone();
        let bounds = grid.bounds();
        let mut field = self.solid.field;
        for axis in Axis::ALL {
            let u = graph.coordinate(axis);
            let [lo, hi] = [bounds.lo, bounds.hi].map(|end| graph.constant(end[axis.index()]));
            for beyond in [graph.sub(lo, u), graph.sub(u, hi)] {
                field = graph.max(field, beyond);
            }
        }
        Ok(Reference::new(graph, field, values, diagonal(grid)))
    }
}
