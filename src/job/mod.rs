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
//!
//! # Parameters
//!
//! Numbers of the text may be parameters, whose values change without reading the text again:
//!
//! ```
//! use alveole::job::{Job, Settings};
//! use alveole::num::Progress;
//!
//! # fn main() -> Result<(), alveole::job::Error> {
//! let mut job = Job::parse_with("gyroid dilate t box", &[("t", 0.0)])?;
//! let settings = Settings::with_spacing(0.1);
//! let half = job.measure(&settings, &Progress::new())?.relative_density;
//! job.set_parameter("t", 0.35)?;
//! let more = job.measure(&settings, &Progress::new())?.relative_density;
//! assert!((half - 0.5).abs() < 1e-3 && (more - 0.613).abs() < 1e-2);
//! # Ok(())
//! # }
//! ```

pub mod convert;
mod gradient;
mod kept;
mod level_rates;
mod levels;
pub mod loader;
mod measures;
mod points;
mod report;
mod slices;
mod slivers;
pub mod structure;
pub mod study;
mod survey;

pub use gradient::{By, FieldMeasures, FieldSlopes, Gradient, Quantities};
pub use levels::Density;
pub use loader::{Access, ConversionNote, Files, MeshNote, Stamp};
pub use measures::{Measures, Totals};
pub use report::Report;
pub use slivers::Slivers;
pub use structure::{Spread, Structure};
pub use survey::Survey;

use crate::contour::{self, Grid, GridError};
use crate::eval::{Bound, Engine, ProgramError};
use crate::expr::{Graph, NodeId};
use crate::geom::{Aabb, Axis};
use crate::lang::{self, Demand, Diagnostic, Rejected, Sources};
use crate::measure::thickness;
use crate::measure::walls::{self, Sample};
use crate::mesh::sink::Collect;
use crate::mesh::{Mesh, Sink};
use crate::num::Progress;
use crate::octree::Pruning;
use crate::solid::{Side, Solid, Span, TrueWall, Wall};
use crate::vocabulary;
use glam::DVec3;
use kept::{Kept, KeptEnvelope, KeptRates};
use levels::KeptLevels;
use loader::Notes;
use std::time::{Duration, Instant};

/// A parsed program.
///
/// What is compiled for the first evaluation serves all later ones, whatever the values of the
/// parameters, and is freed with the job.
#[derive(Debug)]
pub struct Job {
    graph: Graph,
    solid: Solid,
    operands: Vec<Solid>,
    demands: Vec<Demand>,
    unused: Vec<String>,
    sources: Sources,
    notes: Notes,
    parsing: Duration,
    program: Kept,
    rates: KeptRates,
    envelope: KeptEnvelope,
    levels: KeptLevels,
}

/// How a solid is contoured.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Distance between grid nodes.
    pub spacing: Spacing,
    /// The box to contour; that of the solid by default.
    pub bounds: Option<Aabb>,
    /// What evaluates the field. [`Engine::Automatic`] interprets a job's first evaluation if the
    /// grid is too small to pay for compiling.
    pub engine: Engine,
    /// Which bricks are sampled; the mesh does not depend on it.
    pub pruning: Pruning,
    /// Most bytes of memory for what is kept of the grid; what the system has to spare by default.
    pub memory: Option<u64>,
    /// Whether triangles with small angles stay. What is measured without a mesh is that of the
    /// mesh with them.
    pub slivers: Slivers,
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

impl Spacing {
    /// The distance along each axis, in model units, for a grid of the box `bounds`.
    #[must_use]
    pub fn within(self, bounds: Aabb) -> DVec3 {
        match self {
            Self::Hundredth => DVec3::splat(bounds.size().max_element() / 100.0),
            Self::Each(spacing) => spacing,
        }
    }
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
    /// A density that the program asks for can't be had.
    #[error("{}", diagnostic.message)]
    Density {
        /// Which it is, and why not.
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

impl Error {
    /// The error of a density, at `span` of the text, that can't be had.
    fn density(message: String, span: Span, sources: &Sources) -> Self {
        let diagnostic = Box::new(Diagnostic::new(message).at(span, ""));
        Self::Density { diagnostic, sources: Box::new(sources.clone()) }
    }
}

impl Job {
    /// The job of a program text: words separated by blanks, quoted where they contain blanks.
    ///
    /// # Errors
    /// [`Error::Program`].
    pub fn parse(text: &str) -> Result<Self, Error> {
        Self::parse_with(text, &[])
    }

    /// The job of a program text whose equations may use `parameters`, names with first values.
    ///
    /// # Errors
    /// [`Error::Program`], also for a name that is none, that the language uses otherwise, or that
    /// is given twice, and for a value that an argument refuses.
    pub fn parse_with(text: &str, parameters: &[(&str, f64)]) -> Result<Self, Error> {
        let parameters: Vec<_> =
            parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self::with_parameters(&lang::words::of(text)?, &parameters)
    }

    /// The job of a program's words, as a command line gives them.
    ///
    /// # Errors
    /// [`Error::Program`].
    pub fn new(words: &[String]) -> Result<Self, Error> {
        Self::with_parameters(words, &[])
    }

    /// The job of a program's words and of its parameters, names with first values.
    ///
    /// # Errors
    /// [`Error::Program`], as [`parse_with`](Self::parse_with).
    pub fn with_parameters(words: &[String], parameters: &[(String, f64)]) -> Result<Self, Error> {
        Self::read(words, parameters, Files::default())
    }

    /// The job of a program's words and parameters, whose files are read from `files`.
    ///
    /// # Errors
    /// [`Error::Program`], as [`parse_with`](Self::parse_with).
    pub fn read(
        words: &[String],
        parameters: &[(String, f64)],
        mut files: Files,
    ) -> Result<Self, Error> {
        let start = Instant::now();
        let program = lang::parse(words, &vocabulary::Words, &mut files, parameters)?;
        let unused = program.unused_parameters().into_iter().map(str::to_owned).collect();
        let lang::Program { items: _, graph, solid, operands, demands, sources } = program;
        Ok(Self {
            graph,
            solid,
            operands,
            demands,
            unused,
            sources,
            notes: files.into_notes(),
            parsing: start.elapsed(),
            program: Kept::default(),
            rates: KeptRates::default(),
            envelope: KeptEnvelope::default(),
            levels: KeptLevels::default(),
        })
    }

    /// The parameters, names with present values, in the order in which they were given.
    #[must_use]
    pub fn parameters(&self) -> &[(String, f64)] {
        self.graph.named_parameters()
    }

    /// The names of the parameters that the program text does not use.
    #[must_use]
    pub fn unused_parameters(&self) -> &[String] {
        &self.unused
    }

    /// Changes the value of the parameter `name`; see [`set_parameters`](Self::set_parameters).
    ///
    /// # Errors
    /// [`Error::Program`].
    pub fn set_parameter(&mut self, name: &str, value: f64) -> Result<(), Error> {
        self.set_parameters(&[(name, value)])
    }

    /// Changes the values of parameters, all at once.
    ///
    /// Nothing is read or compiled again; bounds and grid follow the new values.
    ///
    /// # Errors
    /// [`Error::Program`] for a name that is no parameter and for a value that is not finite or
    /// that an argument refuses, such as a scale of zero; then no value has changed.
    pub fn set_parameters(&mut self, changes: &[(&str, f64)]) -> Result<(), Error> {
        let reject = |diagnostics| Rejected { diagnostics, sources: self.sources.clone() };
        let mut values = self.values();
        let (mut slots, mut faults) = (Vec::with_capacity(changes.len()), Vec::new());
        for &(name, value) in changes {
            match self.graph.slot(name) {
                Some(slot) if value.is_finite() => {
                    values[slot.index()] = value;
                    slots.push((slot, value));
                }
                Some(_) => {
                    let message = format!("the parameter `{name}` must be a finite number");
                    faults.push(Diagnostic::new(format!("{message}, not {value}")));
                }
                None => faults.push(self.unknown_parameter(name)),
            }
        }
        if faults.is_empty() {
            let demands = self.demands.iter();
            faults.extend(demands.filter_map(|demand| demand.objection(&self.graph, &values)));
        }
        if !faults.is_empty() {
            return Err(reject(faults).into());
        }
        for (slot, value) in slots {
            self.graph.set_parameter(slot, value);
        }
        Ok(())
    }

    fn unknown_parameter(&self, name: &str) -> Diagnostic {
        let known = || self.parameters().iter().map(|(name, _)| name.as_str());
        let fault = Diagnostic::new(format!("the program has no parameter `{name}`"));
        let near = lang::names::nearest(name, known());
        fault.cure(lang::names::suggestion(&near).unwrap_or_else(|| {
            let all: Vec<_> = known().map(|name| format!("`{name}`")).collect();
            match all.as_slice() {
                [] => "it was read without parameters".to_owned(),
                all => format!("it has {}", all.join(", ")),
            }
        }))
    }

    /// What is to be said about the mesh files that the program names.
    #[must_use]
    pub fn meshes(&self) -> &[MeshNote] {
        &self.notes.meshes
    }

    /// What is to be said about the inputs of other tools that the program names.
    #[must_use]
    pub fn conversions(&self) -> &[ConversionNote] {
        &self.notes.conversions
    }

    /// The files that the program is made of, as it names them.
    #[must_use]
    pub fn files(&self) -> &[String] {
        &self.notes.files
    }

    /// What each of [`files`](Self::files) was before it was read.
    #[must_use]
    pub fn stamps(&self) -> &[Option<Stamp>] {
        &self.notes.stamps
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
        self.solid.finite_bounds(&self.graph, &self.values()).map_err(|fault| Error::Bounds {
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
        Ok(Grid::new(bounds, settings.spacing.within(bounds))?)
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
        if settings.slivers == Slivers::Removed {
            return self.contour_without_slivers(grid, settings, progress, sink);
        }
        let (values, densities) = self.solved(grid, settings, progress)?;
        let field = self.field_on(grid, values.clone());
        if self.solid.walls.is_empty() {
            let report = field.contour(settings, progress, sink)?;
            return Ok(Report { densities, ..report });
        }
        let mut sample = Sample::new(sink);
        let mut report = field.contour(settings, progress, &mut sample)?;
        report.densities = densities;
        let positions = sample.into_positions();
        let mut graph = self.graph.clone();
        let spacing = longest_edge(grid);
        report.walls = (self.solid.walls.iter().take(MOST_WALLS))
            .filter_map(|wall| {
                let &Wall { field, half_thickness: half, side, span: _ } = wall;
                match side {
                    Side::Middle => {
                        walls::walls(&mut graph, field, half, &values, &positions, spacing)
                    }
                    Side::Surface => {
                        walls::of_lengths(&graph, [field, half], &values, &positions, spacing)
                    }
                }
            })
            .reduce(walls::Walls::worse);
        Ok(report)
    }

    /// The field of the solid on `grid`.
    fn field_on<'a>(&'a self, grid: &'a Grid, values: Vec<f64>) -> FieldOn<'a> {
        let Self { graph, solid, program, notes, parsing, .. } = self;
        let (field, meshes) = (solid.field, notes.meshes.as_slice());
        let true_walls = solid.true_walls.as_slice();
        FieldOn { graph, field, program, values, grid, true_walls, meshes, parsing: *parsing }
    }

    /// The present values of the parameters, by slot; NaN for unknown levels.
    fn values(&self) -> Vec<f64> {
        self.graph.parameters().iter().map(|(_, value)| *value).collect()
    }
}

/// Walls whose thickness is looked at, at most: each takes as long as its field is large, and those
/// of shells within shells are as large as all before them.
const MOST_WALLS: usize = 16;

/// A field with what it takes to contour it.
struct FieldOn<'a> {
    graph: &'a Graph,
    field: NodeId,
    program: &'a Kept,
    values: Vec<f64>,
    grid: &'a Grid,
    true_walls: &'a [TrueWall],
    meshes: &'a [MeshNote],
    parsing: Duration,
}

impl FieldOn<'_> {
    fn contour(
        &self,
        settings: &Settings,
        progress: &Progress,
        sink: &mut dyn Sink,
    ) -> Result<Report, Error> {
        let work = |bound: &_, chosen: &_| {
            contour::contour(bound, self.grid, chosen, progress, sink).map(|report| ((), report))
        };
        Ok(self.run(settings, work)?.1)
    }

    /// What `work` makes of the field bound to the grid, if there is a mesh.
    fn run<T>(
        &self,
        settings: &Settings,
        work: impl FnOnce(&Bound, &contour::Settings) -> Result<(T, contour::Report), contour::Error>,
    ) -> Result<(T, Report), Error> {
        let (found, report) = self.evaluate(settings, work)?;
        if report.contour.triangles == 0 {
            return Err(Error::Empty { cells: self.grid.cells() });
        }
        Ok((found, report))
    }

    /// What `work` makes of the field bound to the grid.
    fn evaluate<T>(
        &self,
        settings: &Settings,
        work: impl FnOnce(&Bound, &contour::Settings) -> Result<(T, contour::Report), contour::Error>,
    ) -> Result<(T, Report), Error> {
        let start = Instant::now();
        let program = self.program.program(self.graph, self.field, settings.engine, self.grid)?;
        let compiling = start.elapsed();
        let bound = program.bind(self.grid.tables(), &self.values);
        let binding = start.elapsed() - compiling;
        let chosen = contour::Settings { pruning: settings.pruning, memory: settings.memory };
        let (found, contour) = work(&bound, &chosen)?;
        let report = Report::new(self.grid, contour, self.parsing, compiling, binding);
        let thickness = thickness(self.graph, self.true_walls, &self.values, self.grid);
        Ok((found, Report { thickness, meshes: self.meshes.to_vec(), ..report }))
    }
}

/// How much of `walls` is wrong in the box of `grid`.
fn thickness(
    graph: &Graph,
    walls: &[TrueWall],
    values: &[f64],
    grid: &Grid,
) -> Option<thickness::Thickness> {
    let mut looked_at: Vec<TrueWall> = Vec::new();
    for wall in walls {
        if looked_at.len() < MOST_WALLS && !looked_at.contains(wall) {
            looked_at.push(*wall);
        }
    }
    if looked_at.is_empty() {
        return None;
    }
    let mut graph = graph.clone();
    let of = |wall: TrueWall| {
        let TrueWall { surface, field, half_thickness, lipschitz, place } = wall;
        let asked = thickness::Asked { surface, field, half_thickness, lipschitz, place };
        thickness::thickness(&mut graph, &asked, values, &grid.bounds())
    };
    looked_at.into_iter().filter_map(of).reduce(thickness::Thickness::worse)
}

/// The longest distance between neighbouring nodes of `grid` along an axis.
#[must_use]
pub fn longest_edge(grid: &Grid) -> f64 {
    let lines = Axis::ALL.iter().flat_map(|&axis| grid.placed(axis).windows(2));
    lines.map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}
