//! The compiled programs over edges along the three axes, and the batch that a thread works on.

use super::action::Run;
use super::call::Arguments;
use super::calls::{PLANE, ROW, Staging};
use super::line::Line;
use super::tiles::{Nodes, Tiles};
use super::{CompileError, check_size};
use crate::eval::leaves::Leaves;
use crate::eval::sampler::End;
use crate::eval::schedule::Schedule;
use crate::expr::Failure;
use crate::geom::Axis;

/// Compiled programs over edges, one an axis.
#[derive(Debug)]
pub struct Lines([Line; 3]);

/// Memory of one thread that runs [`Lines`], and its present batch of edges.
#[derive(Debug)]
pub struct LinesWorkspace {
    staging: Box<Staging>,
    scratch: [Vec<f64>; 3],
    axis: Axis,
    nodes: Box<Nodes>,
    activity: Vec<u64>,
}

impl Lines {
    /// Compiles the programs of the schedules of lines along each axis, whose first outputs are
    /// the value and its derivative along the axis.
    ///
    /// # Errors
    /// [`CompileError`]; the interpreter needs no compiler.
    pub fn compile(schedules: &[Schedule; 3], leaves: &Leaves) -> Result<Self, CompileError> {
        let tables = leaves.table_counts().into_iter().max().unwrap_or(0);
        check_size(leaves.uniform_count().max(tables.saturating_mul(ROW)))?;
        let line = |axis: Axis| Line::compile(&schedules[axis.index()], leaves, axis);
        let (x, (y, z)) =
            rayon::join(|| line(Axis::X), || rayon::join(|| line(Axis::Y), || line(Axis::Z)));
        Ok(Self([x?, y?, z?]))
    }

    /// Fresh memory for one thread.
    #[must_use]
    pub fn workspace(&self) -> LinesWorkspace {
        LinesWorkspace {
            staging: Box::new([[0.0; PLANE]; 4]),
            scratch: self.0.each_ref().map(|line| vec![0.0; line.scratch]),
            axis: Axis::X,
            nodes: Box::default(),
            activity: Vec::new(),
        }
    }

    /// See [`Sampler::line_begin`](crate::eval::Sampler::line_begin).
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn begin(
        &self,
        workspace: &mut LinesWorkspace,
        tiles: &Tiles,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        workspace.axis = axis;
        workspace.nodes.set(brick, nodes);
        workspace.nodes.look(axis, End::Lower);
        workspace.activity.clear();
        workspace.activity.extend_from_slice(activity);
        self.run(workspace, tiles, nodes.len(), |line, run, arguments| line.begin(run, arguments))
    }

    /// See [`Sampler::line_ends`](crate::eval::Sampler::line_ends).
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn ends(
        &self,
        workspace: &mut LinesWorkspace,
        tiles: &Tiles,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        workspace.nodes.look(workspace.axis, end);
        self.run(workspace, tiles, values.len(), |line, run, arguments| {
            line.ends(run, arguments, [values, slopes])
        })
    }

    /// The first outputs of the present batch's program, as many as `out` has slices, at the
    /// coordinates `at` along its axis.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn between(
        &self,
        workspace: &mut LinesWorkspace,
        tiles: &Tiles,
        at: &[f64],
        out: &mut [&mut [f64]],
    ) -> Result<(), Failure> {
        self.run(workspace, tiles, at.len(), |line, run, arguments| {
            line.between(run, arguments, at, out)
        })
    }

    /// Runs a part of the present batch's program.
    fn run(
        &self,
        workspace: &mut LinesWorkspace,
        tiles: &Tiles,
        lanes: usize,
        part: impl FnOnce(&Line, &mut Run<'_>, &mut Arguments<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let LinesWorkspace { staging, scratch, axis, nodes, activity } = workspace;
        let line = &self.0[axis.index()];
        let mut arguments = Arguments {
            uniforms: &tiles.uniforms,
            activity,
            scratch: &mut scratch[axis.index()],
            tables: nodes.tables(tiles),
            places: nodes.places.as_flattened(),
            ..Arguments::default()
        };
        let mut run = Run { code: &line.code, staging, lanes, oracles: &tiles.oracles };
        part(line, &mut run, &mut arguments)
    }
}
