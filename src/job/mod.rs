//! The library's facade: program text to mesh and measures.
//!
//! A [`Job`] holds a parsed program: it can be meshed into memory or into any [`Sink`], measured,
//! and asked for its bounds. It does everything that the commands do, and prints nothing.
//!
//! ```
//! use alveole::job::{Job, Settings};
//!
//! # fn main() -> Result<(), alveole::job::Error> {
//! let job = Job::parse("gyroid dilate 0.35 box")?;
//! let mesh = job.mesh(&Settings::with_spacing(2.0 / 20.0))?;
//! assert!(mesh.triangles.len() > 1000);
//! # Ok(())
//! # }
//! ```

pub mod loader;
mod measures;
mod report;

pub use loader::{Files, MeshNote};
pub use measures::Measures;
pub use report::Report;

use crate::contour::{self, Grid, GridError};
use crate::eval::{Engine, Program, ProgramError};
use crate::expr::{Graph, NodeId};
use crate::geom::{Aabb, Axis};
use crate::lang::{self, Diagnostic, Rejected, Sources};
use crate::measure::walls::{self, Sample};
use crate::mesh::sink::Collect;
use crate::mesh::{Mesh, Sink};
use crate::num::Progress;
use crate::octree::Pruning;
use crate::solid::Solid;
use crate::vocabulary;
use glam::DVec3;
use std::time::Instant;

/// A parsed program.
#[derive(Debug)]
pub struct Job {
    graph: Graph,
    solid: Solid,
    operands: Vec<Solid>,
    sources: Sources,
    meshes: Vec<MeshNote>,
    parsing: std::time::Duration,
}

/// How a solid is contoured.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Distance between grid nodes.
    pub spacing: Spacing,
    /// The box to contour; that of the solid by default.
    pub bounds: Option<Aabb>,
    /// What evaluates the field.
    pub engine: Engine,
    /// Which bricks are sampled; the mesh does not depend on it.
    pub pruning: Pruning,
}

impl Settings {
    /// Default settings with the same spacing along each axis, in model units.
    #[must_use]
    pub fn with_spacing(spacing: f64) -> Self {
        Self { spacing: Spacing::Each(DVec3::splat(spacing)), ..Self::default() }
    }
}

/// Distance between grid nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Spacing {
    /// A hundredth of the longest side of the box.
    #[default]
    Hundredth,
    /// The distance along each axis, in model units, positive.
    Each(DVec3),
}

/// Why a job failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The program text is at fault.
    #[error(transparent)]
    Program(#[from] Rejected),
    /// The solid has no box that a grid could fill.
    #[error("{}", diagnostic.message)]
    Bounds {
        /// Which operand is to blame and what to add.
        diagnostic: Box<Diagnostic>,
        /// The program text.
        sources: Box<Sources>,
    },
    /// Box and spacing make no grid.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The field could not be compiled.
    #[error(transparent)]
    Compile(#[from] ProgramError),
    /// Contouring failed, or writing its result.
    #[error(transparent)]
    Contour(#[from] contour::Error),
    /// No node of the grid lies in the solid.
    #[error(
        "the solid is empty: none of the grid's {} nodes lies inside; \
         check the program, or give a smaller spacing",
        cells.iter().map(|n| n + 1).product::<usize>()
    )]
    Empty {
        /// Cells of the grid along each axis.
        cells: [usize; 3],
    },
}

impl Job {
    /// The job of a program text: words separated by blanks, quoted where they contain blanks.
    ///
    /// # Errors
    /// [`Error::Program`].
    pub fn parse(text: &str) -> Result<Self, Error> {
        Self::new(&lang::words::of(text)?)
    }

    /// The job of a program's words, as a command line gives them.
    ///
    /// # Errors
    /// [`Error::Program`].
    pub fn new(words: &[String]) -> Result<Self, Error> {
        let start = Instant::now();
        let mut files = Files::default();
        let program = lang::parse(words, &vocabulary::Words, &mut files, &[])?;
        Ok(Self {
            graph: program.graph,
            solid: program.solid,
            operands: program.operands,
            sources: program.sources,
            meshes: files.into_notes(),
            parsing: start.elapsed(),
        })
    }

    /// What is to be said about the mesh files that the program names.
    #[must_use]
    pub fn meshes(&self) -> &[MeshNote] {
        &self.meshes
    }

    /// The program text.
    #[must_use]
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// The field and the graph it belongs to.
    #[must_use]
    pub fn field(&self) -> (&Graph, NodeId) {
        (&self.graph, self.solid.field)
    }

    /// The box that holds the solid.
    ///
    /// # Errors
    /// [`Error::Bounds`] if it is unbounded or empty.
    pub fn bounds(&self) -> Result<Aabb, Error> {
        self.solid.finite_bounds(&self.graph, &self.parameters()).map_err(|fault| Error::Bounds {
            diagnostic: Box::new(fault.into()),
            sources: Box::new(self.sources.clone()),
        })
    }

    /// The grid on which the solid is contoured.
    ///
    /// # Errors
    /// [`Error::Bounds`] or [`Error::Grid`].
    pub fn grid(&self, settings: &Settings) -> Result<Grid, Error> {
        let bounds = settings.bounds.map_or_else(|| self.bounds(), Ok)?;
        let spacing = match settings.spacing {
            Spacing::Hundredth => DVec3::splat(bounds.size().max_element() / 100.0),
            Spacing::Each(spacing) => spacing,
        };
        Ok(Grid::new(bounds, spacing)?)
    }

    /// The mesh of the solid, in memory.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn mesh(&self, settings: &Settings) -> Result<Mesh, Error> {
        let mut sink = Collect::default();
        self.contour(&self.grid(settings)?, settings, &Progress::new(), &mut sink)?;
        Ok(sink.into_mesh())
    }

    /// Contours the solid on `grid` (see [`Job::grid`]) into `sink`.
    ///
    /// # Errors
    /// [`Error::Compile`], [`Error::Contour`] or [`Error::Empty`].
    pub fn contour(
        &self,
        grid: &Grid,
        settings: &Settings,
        progress: &Progress,
        sink: &mut dyn Sink,
    ) -> Result<Report, Error> {
        if self.solid.walls.is_empty() {
            return self.contour_graph(
                &self.graph,
                self.solid.field,
                grid,
                settings,
                progress,
                sink,
            );
        }
        let mut sample = Sample::new(sink);
        let mut report = self.contour_graph(
            &self.graph,
            self.solid.field,
            grid,
            settings,
            progress,
            &mut sample,
        )?;
        let positions = sample.into_positions();
        let mut graph = self.graph.clone();
        let parameters = self.parameters();
        let spacing = longest_edge(grid);
        report.walls = (self.solid.walls.iter())
            .filter_map(|wall| {
                let (level, half) = (wall.field, wall.half_thickness);
                walls::walls(&mut graph, level, half, &parameters, &positions, spacing)
            })
            .reduce(walls::Walls::worse);
        Ok(report)
    }

    fn contour_graph(
        &self,
        graph: &Graph,
        field: NodeId,
        grid: &Grid,
        settings: &Settings,
        progress: &Progress,
        sink: &mut dyn Sink,
    ) -> Result<Report, Error> {
        let start = Instant::now();
        let program = Program::new(graph, field, settings.engine)?;
        let compiling = start.elapsed();
        let bound =
            program.bind(Axis::ALL.map(|axis| grid.sampled(axis).to_vec()), &self.parameters());
        let binding = start.elapsed() - compiling;
        let chosen = contour::Settings { pruning: settings.pruning };
        let contour = contour::contour(&bound, grid, &chosen, progress, sink)?;
        if contour.triangles == 0 {
            return Err(Error::Empty { cells: grid.cells() });
        }
        Ok(Report::new(grid, contour, self.parsing, compiling, binding))
    }

    fn parameters(&self) -> Vec<f64> {
        self.graph.parameters().iter().map(|(_, value)| *value).collect()
    }
}

/// The longest distance between neighbouring nodes of `grid` along an axis.
#[must_use]
pub fn longest_edge(grid: &Grid) -> f64 {
    let lines = Axis::ALL.iter().flat_map(|&axis| grid.placed(axis).windows(2));
    lines.map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}
