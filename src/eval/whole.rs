//! Programs that are made ready as a whole: compiled, or interpreted from fixed instructions.
//!
//! Everything that does not depend on the grid is done once for all boxes: operations are ordered by
//! stage and region, values on one axis get tables. So a query of a box only skips what does not
//! matter there. Huge expressions are served otherwise ([`super::pruned`]).

use super::balance::balance;
use super::enclosing::{Enclosing, EnclosingWorkspace};
use super::focused::Nearness;
use super::interpret::{BoxProgram, UniformRanges};
use super::jit::CompileError;
use super::leaves::Leaves;
use super::levels::Levels;
use super::lower::{Lowered, lower};
use super::machine::{Inputs, Machine, Memory};
use super::program::Engine;
use super::regions::Bits;
use super::sampler::{BRICK, BrickSigns, End, NodeBox, Sampler};
use super::schedule::Schedule;
use super::sign;
use super::tape::Tape;
use crate::expr::{Failure, Graph, NodeId, derive};
use crate::geom::Axis;
use crate::num::Interval;
use std::sync::Arc;

/// A program.
#[derive(Debug)]
pub(super) struct Whole {
    bits: Bits,
    lowered: Lowered,
    box_leaves: Leaves,
    boxes: Enclosing,
    leaves: Leaves,
    machine: Machine,
}

impl Whole {
    /// The program of the expression `root`.
    ///
    /// # Errors
    /// [`CompileError`] if the compiler is asked for and can't run.
    pub(super) fn new(graph: &Graph, root: NodeId, engine: Engine) -> Result<Self, CompileError> {
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
        Ok(Self { bits, lowered, box_leaves, boxes, leaves, machine })
    }

    /// The form that is sampled.
    pub(super) fn lowered(&self) -> &Lowered {
        &self.lowered
    }

    /// The activity bits of the form that is sampled.
    pub(super) fn bits(&self) -> Bits {
        self.bits.through(|id| self.lowered.image(id))
    }

    /// Binds the program; see [`Program::bind`](super::Program::bind).
    pub(super) fn bind(
        self: &Arc<Self>,
        coordinates: &[Vec<f64>; 3],
        parameters: &[f64],
    ) -> BoundWhole {
        let parts = Arc::clone(self);
        let nodes = coordinates.each_ref().map(Vec::len);
        let tables = Tables::new(&parts, coordinates, parameters);
        BoundWhole { parts, nodes, tables }
    }
}

/// A [`Whole`] program bound to a grid and to values of its parameters.
#[derive(Debug)]
pub(super) struct BoundWhole {
    parts: Arc<Whole>,
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
        parts: &Whole,
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

/// Memory of one thread that queries a [`BoundWhole`] program.
#[derive(Debug)]
pub struct WholeWorkspace {
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

impl BoundWhole {
    /// What was made when the program was bound.
    fn tables(&self) -> Result<&Tables, Failure> {
        self.tables.as_ref().map_err(Clone::clone)
    }

    /// Begins the present batch of edges anew with all regions that it was given.
    fn widen(&self, workspace: &mut WholeWorkspace) -> Result<(), Failure> {
        let WholeWorkspace { memory, batch, .. } = workspace;
        batch.limit = f64::INFINITY;
        let Batch { axis, brick, nodes, activity, .. } = &*batch;
        let inputs = &self.tables()?.inputs;
        self.parts.machine.line_begin(memory, inputs, *axis, *brick, nodes, activity)
    }
}

impl Sampler for BoundWhole {
    type Workspace = WholeWorkspace;

    fn workspace(&self) -> WholeWorkspace {
        let batch = Batch {
            axis: Axis::X,
            brick: [0; 3],
            nodes: Vec::new(),
            activity: Vec::new(),
            limit: f64::INFINITY,
        };
        let Whole { boxes, machine, .. } = &*self.parts;
        WholeWorkspace { boxes: boxes.workspace(), memory: machine.memory(), batch }
    }

    fn nodes(&self) -> [usize; 3] {
        self.nodes
    }

    fn activity_words(&self) -> usize {
        self.parts.boxes.activity_words()
    }

    fn ranges(
        &self,
        workspace: &mut WholeWorkspace,
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
        workspace: &mut WholeWorkspace,
        brick: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let Tables { inputs, uniforms, levels } = self.tables()?;
        let WholeWorkspace { boxes, memory, .. } = workspace;
        let (near, leaves) = (Nearness::Sign, (uniforms, levels));
        let focus = self.parts.boxes.focus(boxes, leaves, brick, activity, near);
        let activity = focus.map_or(activity, |(row, _)| row);
        self.parts.machine.signs(memory, inputs, brick, activity, signs)
    }

    fn values(
        &self,
        workspace: &mut WholeWorkspace,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let (memory, inputs) = (&mut workspace.memory, &self.tables()?.inputs);
        self.parts.machine.values(memory, inputs, brick, activity, values)
    }

    fn line_begin(
        &self,
        workspace: &mut WholeWorkspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        let Tables { inputs, uniforms, levels } = self.tables()?;
        let WholeWorkspace { boxes, memory, batch } = workspace;
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
        workspace: &mut WholeWorkspace,
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
        workspace: &mut WholeWorkspace,
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
