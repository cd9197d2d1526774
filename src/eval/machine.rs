//! The engine that a program runs on: one face for the interpreter and the compiler.

use super::interpret::{BrickProgram, BrickWorkspace, LineProgram, LineWorkspace};
use super::jit::{self, CompileError, Compiled, Tiles};
use super::leaves::{LeafValues, Leaves};
use super::program::Engine;
use super::sampler::{BRICK, BrickSigns, End};
use super::schedule::Schedule;
use crate::expr::{Failure, Oracle};
use crate::geom::Axis;
use std::sync::Arc;

/// The programs over bricks and lines of an expression, ready to run.
#[derive(Debug)]
pub(super) enum Machine {
    /// Run by the interpreter.
    Interpreter(Box<Interpreted>),
    /// Run by the host.
    Compiled(Box<Compiled>),
}

/// The programs of the interpreter.
#[derive(Debug)]
pub(super) struct Interpreted {
    brick: BrickProgram,
    lines: [LineProgram; 3],
}

/// What a machine reads of a bound program, arranged for it.
#[derive(Debug)]
pub(super) enum Inputs {
    /// For the interpreter.
    Interpreter(LeafValues),
    /// For compiled code.
    Compiled(Tiles),
}

/// Memory of one thread that runs a machine.
#[derive(Debug)]
pub(super) enum Memory {
    /// For the interpreter.
    Interpreter(Box<InterpretedMemory>),
    /// For compiled code.
    Compiled(Box<jit::Workspace>),
}

/// Memory of the interpreter's programs, and the axis of the present batch.
#[derive(Debug)]
pub(super) struct InterpretedMemory {
    brick: BrickWorkspace,
    lines: [LineWorkspace; 3],
    axis: Axis,
}

/// Programs of more operations are not compiled unasked: it takes longer (some 20 microseconds an
/// operation) than many a job, of which the boxes of the octree then need little.
pub(super) const LARGE: usize = 20_000;

const MISMATCH: &str = "a workspace is used with the sampler that made it";

/// The least node of a brick.
fn first(brick: [u32; 3]) -> [usize; 3] {
    brick.map(|b| b as usize * BRICK)
}

impl Machine {
    /// Readies the programs of the given schedules for `engine`: those of the bricks, values and
    /// [signs](super::sign), and those of the lines.
    pub(super) fn new(
        engine: Engine,
        bricks: [&Schedule; 2],
        lines: &[Schedule; 3],
        leaves: &Leaves,
        oracles: &[Arc<dyn Oracle>],
    ) -> Result<Self, CompileError> {
        let [brick, _] = bricks;
        let compiled = || Compiled::new(bricks, lines, leaves).map(Box::new).map(Self::Compiled);
        let interpreted = || {
            let line = |axis: Axis| LineProgram::new(&lines[axis.index()], leaves, oracles, axis);
            let brick = BrickProgram::new(brick, leaves, oracles);
            Self::Interpreter(Box::new(Interpreted { brick, lines: Axis::ALL.map(line) }))
        };
        match engine {
            Engine::Interpreter | Engine::Pruned => Ok(interpreted()),
            Engine::Compiled => compiled(),
            Engine::Automatic if brick.tape().len() > LARGE => Ok(interpreted()),
            Engine::Automatic => Ok(compiled().unwrap_or_else(|_| interpreted())),
        }
    }

    /// Arranges the values made when a program is bound.
    pub(super) fn inputs(
        &self,
        values: LeafValues,
        leaves: &Leaves,
        oracles: &[Arc<dyn Oracle>],
    ) -> Inputs {
        match self {
            Self::Interpreter(_) => Inputs::Interpreter(values),
            Self::Compiled(_) => {
                Inputs::Compiled(Tiles::new(&values, leaves.table_counts(), oracles))
            }
        }
    }

    /// Fresh memory for one thread.
    pub(super) fn memory(&self) -> Memory {
        match self {
            Self::Interpreter(programs) => Memory::Interpreter(Box::new(InterpretedMemory {
                brick: programs.brick.workspace(),
                lines: programs.lines.each_ref().map(LineProgram::workspace),
                axis: Axis::X,
            })),
            Self::Compiled(compiled) => Memory::Compiled(Box::new(compiled.workspace())),
        }
    }

    /// See [`Sampler::signs`](super::Sampler::signs).
    pub(super) fn signs(
        &self,
        memory: &mut Memory,
        inputs: &Inputs,
        at: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        match (self, memory, inputs) {
            (Self::Interpreter(own), Memory::Interpreter(memory), Inputs::Interpreter(leaves)) => {
                own.brick.signs(&mut memory.brick, leaves, first(at), activity, signs)
            }
            (Self::Compiled(compiled), Memory::Compiled(own), Inputs::Compiled(tiles)) => {
                compiled.signs(own, tiles, at, activity, signs)
            }
            _ => panic!("{MISMATCH}"),
        }
    }

    /// See [`Sampler::values`](super::Sampler::values).
    pub(super) fn values(
        &self,
        memory: &mut Memory,
        inputs: &Inputs,
        at: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        match (self, memory, inputs) {
            (Self::Interpreter(own), Memory::Interpreter(memory), Inputs::Interpreter(leaves)) => {
                own.brick.values(&mut memory.brick, leaves, first(at), activity, values)
            }
            (Self::Compiled(compiled), Memory::Compiled(own), Inputs::Compiled(tiles)) => {
                compiled.values(own, tiles, at, activity, values)
            }
            _ => panic!("{MISMATCH}"),
        }
    }

    /// See [`Sampler::line_begin`](super::Sampler::line_begin).
    pub(super) fn line_begin(
        &self,
        memory: &mut Memory,
        inputs: &Inputs,
        along: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        match (self, memory, inputs) {
            (Self::Interpreter(own), Memory::Interpreter(memory), Inputs::Interpreter(leaves)) => {
                memory.axis = along;
                let lines = &mut memory.lines[along.index()];
                own.lines[along.index()].begin(lines, leaves, first(brick), nodes, activity)
            }
            (Self::Compiled(compiled), Memory::Compiled(own), Inputs::Compiled(tiles)) => {
                let (lines, own) = compiled.lines(own);
                lines.begin(own, tiles, along, brick, nodes, activity)
            }
            _ => panic!("{MISMATCH}"),
        }
    }

    /// See [`Sampler::line_ends`](super::Sampler::line_ends).
    pub(super) fn line_ends(
        &self,
        memory: &mut Memory,
        inputs: &Inputs,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        match (self, memory, inputs) {
            (Self::Interpreter(own), Memory::Interpreter(memory), Inputs::Interpreter(leaves)) => {
                let axis = memory.axis.index();
                own.lines[axis].ends(&mut memory.lines[axis], leaves, end, [values, slopes])
            }
            (Self::Compiled(compiled), Memory::Compiled(own), Inputs::Compiled(tiles)) => {
                let (lines, own) = compiled.lines(own);
                lines.ends(own, tiles, end, values, slopes)
            }
            _ => panic!("{MISMATCH}"),
        }
    }

    /// See [`Sampler::line`](super::Sampler::line).
    pub(super) fn line(
        &self,
        memory: &mut Memory,
        inputs: &Inputs,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        match (self, memory, inputs) {
            (Self::Interpreter(own), Memory::Interpreter(memory), Inputs::Interpreter(leaves)) => {
                let axis = memory.axis.index();
                own.lines[axis].between(&mut memory.lines[axis], leaves, at, &mut [values, slopes])
            }
            (Self::Compiled(compiled), Memory::Compiled(own), Inputs::Compiled(tiles)) => {
                let (lines, own) = compiled.lines(own);
                lines.between(own, tiles, at, &mut [values, slopes])
            }
            _ => panic!("{MISMATCH}"),
        }
    }
}
