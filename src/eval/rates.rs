//! How a field changes along grid edges: its gradient and its derivatives by parameters.
//!
//! A companion of a [`Program`]: the same expression, lowered the same way, with the same regions,
//! so that the activity that intervals found for a box holds here too. It is made only where
//! derivatives are wanted. The branch of a kink is the one that the field itself takes at the same
//! coordinates, to the bit.

use super::interpret::{LineProgram, LineWorkspace};
use super::jit::{Lines, LinesWorkspace, Tiles};
use super::leaves::{LeafValues, Leaves};
use super::program::{Engine, Program, ProgramError};
use super::sampler::BRICK;
use super::schedule::Schedule;
use super::tape::Tape;
use crate::expr::{Failure, Graph, NodeId, ParameterId, derive};
use crate::geom::Axis;
use std::sync::Arc;

/// The value of a field on edges with its derivatives, ready to run.
///
/// The outputs are, in this order: the value; the derivative along the edge; those along the two
/// other axes in their order; the derivatives by the parameters.
#[derive(Clone, Debug)]
pub struct Rates(Arc<Parts>);

#[derive(Debug)]
struct Parts {
    machine: Machine,
    leaves: Leaves,
    graph: Graph,
    outputs: usize,
}

#[derive(Debug)]
enum Machine {
    Interpreter(Box<[LineProgram; 3]>),
    Compiled(Box<Lines>),
}

impl Rates {
    /// The derivatives of `program` by `parameters`, of the graph that it was made from.
    ///
    /// # Errors
    /// [`ProgramError::NoCompiler`] if the compiler is asked for and can't run.
    pub fn new(
        program: &Program,
        parameters: &[ParameterId],
        engine: Engine,
    ) -> Result<Self, ProgramError> {
        let (lowered, bits) = program.parts();
        let mut graph = lowered.graph.clone();
        let gradient = derive::gradient(&mut graph, lowered.root);
        let by: Vec<NodeId> = (parameters.iter())
            .map(|parameter| derive::by_parameter(&mut graph, lowered.root, *parameter))
            .collect();
        let lines = Axis::ALL.map(|axis| {
            let mut outputs = vec![lowered.root, gradient[axis.index()]];
            let others = Axis::ALL.into_iter().filter(|other| *other != axis);
            outputs.extend(others.map(|other| gradient[other.index()]));
            outputs.extend(&by);
            Schedule::line(&Tape::new(&graph, &outputs), &bits, axis)
        });
        let leaves = Leaves::of_lines(&lines);
        let interpreted = || {
            let program =
                |axis: Axis| LineProgram::new(&lines[axis.index()], &leaves, graph.oracles(), axis);
            Machine::Interpreter(Box::new(Axis::ALL.map(program)))
        };
        let compiled = || Lines::compile(&lines, &leaves).map(Box::new).map(Machine::Compiled);
        let machine = match engine {
            Engine::Interpreter | Engine::Pruned => interpreted(),
            Engine::Compiled => compiled()?,
            Engine::Automatic if lines[0].tape().len() > super::machine::LARGE => interpreted(),
            Engine::Automatic => compiled().unwrap_or_else(|_| interpreted()),
        };
        let outputs = 4 + parameters.len();
        Ok(Self(Arc::new(Parts { machine, leaves, graph, outputs })))
    }

    /// Binds the derivatives to the tables that the program is bound to, and to values of the
    /// parameters, by slot. If an oracle fails here, every query returns its [`Failure`].
    ///
    /// # Panics
    /// As [`Program::bind`].
    #[must_use]
    pub fn bind(&self, coordinates: &[Vec<f64>; 3], parameters: &[f64]) -> BoundRates {
        for table in coordinates {
            assert!(table.len() % BRICK == 1, "a table has a multiple of sixteen nodes plus one");
        }
        let parts = Arc::clone(&self.0);
        let Parts { machine, leaves, graph, .. } = &*parts;
        let inputs = leaves.evaluate(graph, coordinates, parameters).map(|values| match machine {
            Machine::Interpreter(_) => Inputs::Interpreter(values),
            Machine::Compiled(_) => {
                Inputs::Compiled(Tiles::new(&values, leaves.table_counts(), graph.oracles()))
            }
        });
        BoundRates { inputs, parts }
    }
}

/// Derivatives bound to a grid and to values of the parameters.
#[derive(Debug)]
pub struct BoundRates {
    parts: Arc<Parts>,
    inputs: Result<Inputs, Failure>,
}

#[derive(Debug)]
enum Inputs {
    Interpreter(LeafValues),
    Compiled(Tiles),
}

/// Memory of one thread that queries [`BoundRates`].
#[derive(Debug)]
pub enum RatesWorkspace {
    /// For the interpreter: that of each axis, and the axis of the present batch.
    Interpreter(Box<[LineWorkspace; 3]>, Axis),
    /// For compiled code.
    Compiled(Box<LinesWorkspace>),
}

const MISMATCH: &str = "a workspace is used with the rates that made it";

impl BoundRates {
    /// A fresh workspace.
    #[must_use]
    pub fn workspace(&self) -> RatesWorkspace {
        match &self.parts.machine {
            Machine::Interpreter(lines) => RatesWorkspace::Interpreter(
                Box::new(lines.each_ref().map(LineProgram::workspace)),
                Axis::X,
            ),
            Machine::Compiled(lines) => RatesWorkspace::Compiled(Box::new(lines.workspace())),
        }
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.parts.outputs
    }

    /// Sets up a batch of edges; see [`Sampler::line_begin`](super::Sampler::line_begin).
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    ///
    /// # Panics
    /// If other rates made the workspace.
    pub fn begin(
        &self,
        workspace: &mut RatesWorkspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        let inputs = self.inputs.as_ref().map_err(Clone::clone)?;
        match (&self.parts.machine, workspace, inputs) {
            (
                Machine::Interpreter(lines),
                RatesWorkspace::Interpreter(own, along),
                Inputs::Interpreter(leaves),
            ) => {
                *along = axis;
                let (line, own) = (&lines[axis.index()], &mut own[axis.index()]);
                line.begin(own, leaves, brick.map(|b| b as usize * BRICK), nodes, activity)
            }
            (Machine::Compiled(lines), RatesWorkspace::Compiled(own), Inputs::Compiled(tiles)) => {
                lines.begin(own, tiles, axis, brick, nodes, activity)
            }
            _ => panic!("{MISMATCH}"),
        }
    }

    /// The outputs at coordinate `at[m]` along the axis of the batch on edge `m`, one slice of
    /// `out` an output.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    ///
    /// # Panics
    /// If other rates made the workspace.
    pub fn at(
        &self,
        workspace: &mut RatesWorkspace,
        at: &[f64],
        out: &mut [&mut [f64]],
    ) -> Result<(), Failure> {
        let inputs = self.inputs.as_ref().map_err(Clone::clone)?;
        match (&self.parts.machine, workspace, inputs) {
            (
                Machine::Interpreter(lines),
                RatesWorkspace::Interpreter(own, along),
                Inputs::Interpreter(leaves),
            ) => lines[along.index()].between(&mut own[along.index()], leaves, at, out),
            (Machine::Compiled(lines), RatesWorkspace::Compiled(own), Inputs::Compiled(tiles)) => {
                lines.between(own, tiles, at, out)
            }
            _ => panic!("{MISMATCH}"),
        }
    }
}
