//! Programs: expressions ready to be evaluated, and bound to coordinates.
//!
//! A [`Program`] is made once for an expression and serves every grid and all values of its
//! parameters. Binding it makes the tables of a grid; the [`Bound`] program answers the queries of
//! [`Sampler`], from as many threads as ask, each with a workspace of its own.

use super::balance::balance;
use super::enclosing::{Enclosing, EnclosingWorkspace};
use super::focused::Nearness;
use super::interpret::{BoxProgram, UniformRanges};
use super::jit::CompileError;
use super::leaves::Leaves;
use super::levels::Levels;
use super::lower::{Lowered, lower};
use super::machine::{Inputs, Machine, Memory};
use super::regions::Bits;
use super::sampler::{BRICK, BrickSigns, End, NodeBox, Sampler};
use super::schedule::Schedule;
use super::sign;
use super::tape::Tape;
use crate::expr::{Failure, Graph, NodeId, derive};
use crate::geom::Axis;
use crate::num::Interval;
use std::sync::Arc;

/// What runs a program; the results are the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Engine {
    /// The interpreter: nothing to compile, runs on every host.
    Interpreter,
    /// The compiler.
    Compiled,
    /// The compiler where the host has one and the expression is not huge, else the interpreter.
    #[default]
    Automatic,
}

/// Why a program could not be made.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ProgramError {
    /// The compiler can't run here.
    #[error("the compiled engine can't run this; use the interpreter")]
    NoCompiler(#[from] CompileError),
}

/// An expression ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Program(Arc<Parts>);

/// The parts of a program, shared with what is bound to it.
#[derive(Debug)]
struct Parts {
    bits: Bits,
    lowered: Lowered,
    box_leaves: Leaves,
    boxes: Enclosing,
    leaves: Leaves,
    machine: Machine,
}

impl Program {
    /// The program of the expression `root`.
    ///
    /// # Errors
    /// [`ProgramError::NoCompiler`] if the compiler is asked for and can't run.
    pub fn new(graph: &Graph, root: NodeId, engine: Engine) -> Result<Self, ProgramError> {
        let (graph, root) = balance(graph, root);
        let source = Tape::new(&graph, &[root]);
        let bits = Bits::number(&source);
        let mut lowered = lower(&graph, root);
        let boxes = Schedule::boxes(&source, &bits);
        let box_leaves = Leaves::of_boxes(&boxes);
        let boxes = BoxProgram::new(&boxes, &box_leaves, (&graph, &lowered), bits.words());
        let boxes = Enclosing::new(boxes, engine, bits.len());
        let slopes = Axis::ALL.map(|axis| derive::partial(&mut lowered.graph, lowered.root, axis));
        let lowered_bits = bits.through(|id| lowered.image(id));
        let tape = Tape::new(&lowered.graph, &[lowered.root]);
        let brick = Schedule::brick(&tape, &lowered_bits);
        let signs = sign::form(&mut lowered.graph, lowered.root);
        let tape = Tape::new(&lowered.graph, &[signs.root]);
        let signs = Schedule::brick(&tape, &lowered_bits.onto(&signs.choices));
        let lines = Axis::ALL.map(|axis| {
            let tape = Tape::new(&lowered.graph, &[lowered.root, slopes[axis.index()]]);
            Schedule::line(&tape, &lowered_bits, axis)
        });
        let leaves = Leaves::new(&[&brick, &signs], &lines);
        let oracles = lowered.graph.oracles();
        let machine = Machine::new(engine, [&brick, &signs], &lines, &leaves, oracles)?;
        Ok(Self(Arc::new(Parts { bits, lowered, box_leaves, boxes, leaves, machine })))
    }

    /// The expression that is sampled, in its graph: the lowered form of the program's own.
    #[must_use]
    pub fn sampled(&self) -> (&Graph, NodeId) {
        (&self.0.lowered.graph, self.0.lowered.root)
    }

    /// The lowered form and the bits of its regions.
    pub(super) fn parts(&self) -> (&Lowered, Bits) {
        let Parts { lowered, bits, .. } = &*self.0;
        (lowered, bits.through(|id| lowered.image(id)))
    }

    /// Binds the program to a grid and to values of the parameters, by slot.
    ///
    /// `coordinates` holds the coordinate table of each axis: finite, non-decreasing numbers, a
    /// multiple of [`BRICK`] of them plus one. If an oracle fails while the tables are made, every
    /// query returns its [`Failure`].
    ///
    /// # Panics
    /// If a table has another length, or there are fewer values than the expression's parameters.
    #[must_use]
    pub fn bind(&self, coordinates: [Vec<f64>; 3], parameters: &[f64]) -> Bound {
        for table in &coordinates {
            assert!(table.len() % BRICK == 1, "a table has a multiple of sixteen nodes plus one");
        }
        let parts = Arc::clone(&self.0);
        let nodes = coordinates.each_ref().map(Vec::len);
        let tables = Tables::new(&parts, &coordinates, parameters);
        Bound { parts, nodes, tables }
    }
}

/// A program bound to a grid and to values of its parameters.
#[derive(Debug)]
pub struct Bound {
    parts: Arc<Parts>,
    nodes: [usize; 3],
    tables: Result<Tables, Failure>,
}

/// What is made when a program is bound.
#[derive(Debug)]
struct Tables {
    inputs: Inputs,
    uniforms: UniformRanges,
    levels: Levels,
}

impl Tables {
    fn new(
        parts: &Parts,
        coordinates: &[Vec<f64>; 3],
        parameters: &[f64],
    ) -> Result<Self, Failure> {
        // The lowered graph holds the source's nodes too.
        let graph = &parts.lowered.graph;
        let uniforms = parts.box_leaves.uniform_values(graph, parameters)?;
        let leaves = parts.leaves.evaluate(graph, coordinates, parameters)?;
        Ok(Self {
            inputs: parts.machine.inputs(leaves, &parts.leaves, graph.oracles()),
            uniforms: UniformRanges::new(&uniforms),
            levels: Levels::new(&parts.box_leaves, graph, coordinates, parameters)?,
        })
    }
}

/// Memory of one thread that queries a [`Bound`] program.
#[derive(Debug)]
pub struct Workspace {
    boxes: EnclosingWorkspace,
    memory: Memory,
    batch: Batch,
}

/// The present batch of edges, if it runs with fewer regions than it was given.
#[derive(Debug)]
struct Batch {
    axis: Axis,
    brick: [u32; 3],
    nodes: Vec<u16>,
    activity: Vec<u64>,
    /// Values this far from zero are not trusted; infinite if all are.
    limit: f64,
}

impl Batch {
    /// Whether all of `values` can be trusted.
    fn trusts(&self, values: &[f64]) -> bool {
        let trusted = |all: bool, value: &f64| all & (value.abs() < self.limit);
        self.limit == f64::INFINITY || values.iter().fold(true, trusted)
    }
}

impl Bound {
    /// What was made when the program was bound.
    fn tables(&self) -> Result<&Tables, Failure> {
        self.tables.as_ref().map_err(Clone::clone)
    }

    /// Begins the present batch of edges anew with all regions that it was given.
    fn widen(&self, workspace: &mut Workspace) -> Result<(), Failure> {
        let Workspace { memory, batch, .. } = workspace;
        batch.limit = f64::INFINITY;
        let Batch { axis, brick, nodes, activity, .. } = &*batch;
        let inputs = &self.tables()?.inputs;
        self.parts.machine.line_begin(memory, inputs, *axis, *brick, nodes, activity)
    }
}

impl Sampler for Bound {
    type Workspace = Workspace;

    fn workspace(&self) -> Workspace {
        let batch = Batch {
            axis: Axis::X,
            brick: [0; 3],
            nodes: Vec::new(),
            activity: Vec::new(),
            limit: f64::INFINITY,
        };
        let Parts { boxes, machine, .. } = &*self.parts;
        Workspace { boxes: boxes.workspace(), memory: machine.memory(), batch }
    }

    fn nodes(&self) -> [usize; 3] {
        self.nodes
    }

    fn activity_words(&self) -> usize {
        self.parts.boxes.activity_words()
    }

    fn ranges(
        &self,
        workspace: &mut Workspace,
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure> {
        let Tables { uniforms, levels, .. } = self.tables()?;
        let own = &mut workspace.boxes;
        self.parts.boxes.ranges(own, (uniforms, levels), boxes, activity, ranges);
        Ok(())
    }

    fn signs(
        &self,
        workspace: &mut Workspace,
        brick: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let Tables { inputs, uniforms, levels } = self.tables()?;
        let Workspace { boxes, memory, .. } = workspace;
        let (near, leaves) = (Nearness::Sign, (uniforms, levels));
        let focus = self.parts.boxes.focus(boxes, leaves, brick, activity, near);
        let activity = focus.map_or(activity, |(row, _)| row);
        self.parts.machine.signs(memory, inputs, brick, activity, signs)
    }

    fn values(
        &self,
        workspace: &mut Workspace,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let (memory, inputs) = (&mut workspace.memory, &self.tables()?.inputs);
        self.parts.machine.values(memory, inputs, brick, activity, values)
    }

    fn line_begin(
        &self,
        workspace: &mut Workspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        let Tables { inputs, uniforms, levels } = self.tables()?;
        let Workspace { boxes, memory, batch } = workspace;
        let (near, leaves) = (Nearness::Surface, (uniforms, levels));
        batch.limit = f64::INFINITY;
        let mut row = activity;
        if let Some((focused, limit)) = self.parts.boxes.focus(boxes, leaves, brick, activity, near)
        {
            (batch.axis, batch.brick, batch.limit, row) = (axis, brick, limit, focused);
            batch.nodes.clear();
            batch.nodes.extend_from_slice(nodes);
            batch.activity.clear();
            batch.activity.extend_from_slice(activity);
        }
        self.parts.machine.line_begin(memory, inputs, axis, brick, nodes, row)
    }

    fn line_ends(
        &self,
        workspace: &mut Workspace,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        let inputs = &self.tables()?.inputs;
        let machine = &self.parts.machine;
        machine.line_ends(&mut workspace.memory, inputs, end, values, slopes)?;
        if !workspace.batch.trusts(values) {
            self.widen(workspace)?;
            machine.line_ends(&mut workspace.memory, inputs, end, values, slopes)?;
        }
        Ok(())
    }

    fn line(
        &self,
        workspace: &mut Workspace,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        let inputs = &self.tables()?.inputs;
        let machine = &self.parts.machine;
        machine.line(&mut workspace.memory, inputs, at, values, slopes)?;
        if !workspace.batch.trusts(values) {
            self.widen(workspace)?;
            machine.line(&mut workspace.memory, inputs, at, values, slopes)?;
        }
        Ok(())
    }
}
