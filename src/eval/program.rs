//! Programs: expressions ready to be evaluated, and bound to coordinates.
//!
//! A [`Program`] is made once for an expression and serves every grid and all values of its
//! parameters. Binding it makes the tables of a grid; the [`Bound`] program answers the queries of
//! [`Sampler`], from as many threads as ask, each with a workspace of its own.

use super::balance::balance;
use super::interpret::{BoxProgram, BoxWorkspace, BrickProgram, BrickWorkspace};
use super::interpret::{LineProgram, LineWorkspace, UniformRanges};
use super::leaves::{LeafValues, Leaves};
use super::levels::Levels;
use super::lower::{Lowered, lower};
use super::regions::Bits;
use super::sampler::{BRICK, BrickSigns, End, NodeBox, Sampler};
use super::schedule::Schedule;
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
    /// The compiler where the host has one, else the interpreter.
    #[default]
    Automatic,
}

/// Why a program could not be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ProgramError {
    /// The compiler can't run here.
    #[error("this host has no compiled engine ({cause}); use the interpreter")]
    NoCompiler {
        /// What the compiler lacks.
        cause: String,
    },
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
    boxes: BoxProgram,
    leaves: Leaves,
    brick: BrickProgram,
    lines: [LineProgram; 3],
}

impl Program {
    /// The program of the expression `root`.
    ///
    /// # Errors
    /// [`ProgramError::NoCompiler`] if the compiler is asked for and can't run.
    pub fn new(graph: &Graph, root: NodeId, engine: Engine) -> Result<Self, ProgramError> {
        match engine {
            Engine::Interpreter | Engine::Automatic => {}
            Engine::Compiled => {
                return Err(ProgramError::NoCompiler { cause: "it is not built in".to_owned() });
            }
        }
        let (graph, root) = balance(graph, root);
        let source = Tape::new(&graph, &[root]);
        let bits = Bits::number(&source);
        let mut lowered = lower(&graph, root);
        let boxes = Schedule::boxes(&source, &bits);
        let box_leaves = Leaves::of_boxes(&boxes);
        let boxes = BoxProgram::new(&boxes, &box_leaves, (&graph, &lowered), bits.words());
        let slopes = Axis::ALL.map(|axis| derive::partial(&mut lowered.graph, lowered.root, axis));
        let lowered_bits = bits.through(|id| lowered.image(id));
        let tape = Tape::new(&lowered.graph, &[lowered.root]);
        let brick = Schedule::brick(&tape, &lowered_bits);
        let lines = Axis::ALL.map(|axis| {
            let tape = Tape::new(&lowered.graph, &[lowered.root, slopes[axis.index()]]);
            Schedule::line(&tape, &lowered_bits, axis)
        });
        let leaves = Leaves::new(&brick, &lines);
        let oracles = lowered.graph.oracles();
        let brick = BrickProgram::new(&brick, &leaves, oracles);
        let lines =
            Axis::ALL.map(|axis| LineProgram::new(&lines[axis.index()], &leaves, oracles, axis));
        Ok(Self(Arc::new(Parts { bits, lowered, box_leaves, boxes, leaves, brick, lines })))
    }

    /// The expression that is sampled, in its graph: the lowered form of the program's own.
    #[must_use]
    pub fn sampled(&self) -> (&Graph, NodeId) {
        (&self.0.lowered.graph, self.0.lowered.root)
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
    leaves: LeafValues,
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
        Ok(Self {
            leaves: parts.leaves.evaluate(graph, coordinates, parameters)?,
            uniforms: UniformRanges::new(&uniforms),
            levels: Levels::new(&parts.box_leaves, graph, coordinates, parameters)?,
        })
    }
}

/// Memory of one thread that queries a [`Bound`] program.
#[derive(Debug)]
pub struct Workspace {
    boxes: BoxWorkspace,
    brick: BrickWorkspace,
    lines: [LineWorkspace; 3],
    axis: Axis,
}

impl Bound {
    /// What was made when the program was bound.
    fn tables(&self) -> Result<&Tables, Failure> {
        self.tables.as_ref().map_err(Clone::clone)
    }
}

/// The least node of a brick.
fn first(brick: [u32; 3]) -> [usize; 3] {
    brick.map(|b| b as usize * BRICK)
}

impl Sampler for Bound {
    type Workspace = Workspace;

    fn workspace(&self) -> Workspace {
        Workspace {
            boxes: self.parts.boxes.workspace(),
            brick: self.parts.brick.workspace(),
            lines: self.parts.lines.each_ref().map(LineProgram::workspace),
            axis: Axis::X,
        }
    }

    fn nodes(&self) -> [usize; 3] {
        self.nodes
    }

    fn activity_words(&self) -> usize {
        self.parts.bits.words()
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
        let leaves = &self.tables()?.leaves;
        self.parts.brick.signs(&mut workspace.brick, leaves, first(brick), activity, signs)
    }

    fn values(
        &self,
        workspace: &mut Workspace,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let leaves = &self.tables()?.leaves;
        self.parts.brick.values(&mut workspace.brick, leaves, first(brick), activity, values)
    }

    fn line_begin(
        &self,
        workspace: &mut Workspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        workspace.axis = axis;
        let own = &mut workspace.lines[axis.index()];
        self.parts.lines[axis.index()].begin(
            own,
            &self.tables()?.leaves,
            first(brick),
            nodes,
            activity,
        )
    }

    fn line_ends(
        &self,
        workspace: &mut Workspace,
        end: End,
        values: &mut [f64],
    ) -> Result<(), Failure> {
        let axis = workspace.axis.index();
        self.parts.lines[axis].ends(&mut workspace.lines[axis], &self.tables()?.leaves, end, values)
    }

    fn line(
        &self,
        workspace: &mut Workspace,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        let axis = workspace.axis.index();
        let own = &mut workspace.lines[axis];
        self.parts.lines[axis].between(own, &self.tables()?.leaves, at, values, slopes)
    }
}
