//! The compiling engine: programs as machine code, by Cranelift.
//!
//! Returns the bits of the interpreter, on every host. A module of machine code is compiled for
//! each program and freed with it. Arithmetic is compiled (`ops`); functions and oracles are called
//! between compiled functions (`calls`), by Rust: compiled code itself calls nothing (but rounding
//! functions on x86-64 without SSE 4.1), so nothing unwinds into it.

mod action;
mod assembly;
mod body;
mod brick;
mod call;
mod calls;
mod flow;
mod host;
mod layout;
mod line;
mod lines;
mod ops;
mod ranges;
mod rivals;
mod segment;
mod tiles;
mod volume;
mod window;

pub use lines::{Lines, LinesWorkspace};
pub use ranges::{Leaves as RangeLeaves, Ranges};
pub use tiles::Tiles;

use super::leaves::Leaves;
use super::sampler::{BRICK, BrickSigns};
use super::schedule::Schedule;
use crate::expr::Failure;
use crate::geom::Axis;
use action::Run;
use brick::{Brick, Yield};
use call::Arguments;
use calls::{PLANE, Staging};
use cranelift_module::ModuleError;
use std::sync::{Arc, OnceLock};

/// Why a program could not be compiled; the interpreter runs it all the same.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CompileError {
    /// There is no machine code for this host.
    #[error("this host runs no compiled programs: {0}")]
    Host(&'static str),
    /// The program needs more memory than offsets in machine code reach.
    #[error("the program is too large to be compiled ({0} bytes of buffers)")]
    TooLarge(usize),
    /// The code generator refused the program.
    #[error("the program could not be compiled")]
    Generator(#[source] Arc<ModuleError>),
}

impl From<ModuleError> for CompileError {
    fn from(error: ModuleError) -> Self {
        Self::Generator(Arc::new(error))
    }
}

/// Refuses buffers of so many numbers if offsets in instructions don't reach their ends.
fn check_size(numbers: usize) -> Result<(), CompileError> {
    let bytes = numbers.saturating_mul(size_of::<f64>());
    if bytes < i32::MAX as usize { Ok(()) } else { Err(CompileError::TooLarge(bytes)) }
}

/// The compiled programs of an expression.
#[derive(Debug)]
pub struct Compiled {
    signs: Brick,
    lines: Lines,
    /// Compiled when values are asked for first; few callers do.
    values: OnceLock<Result<Brick, CompileError>>,
    schedule: Schedule,
    leaves: Leaves,
}

/// Memory of one thread that runs a [`Compiled`] program, and its present batch of edges.
#[derive(Debug)]
pub struct Workspace {
    scratch: Vec<f64>,
    staging: Box<Staging>,
    lines: LinesWorkspace,
}

impl Compiled {
    /// Compiles the programs of the given schedules: those of the bricks, whose outputs are the
    /// value and [what has its sign](super::sign), and those of the lines along each axis, whose
    /// outputs are the value and its derivative along the axis.
    ///
    /// # Errors
    /// [`CompileError`]; the interpreter needs no compiler.
    pub fn new(
        [brick, signs]: [&Schedule; 2],
        lines: &[Schedule; 3],
        leaves: &Leaves,
    ) -> Result<Self, CompileError> {
        // Compiling is most of the time of a small job.
        let (signs, lines) = rayon::join(
            || Brick::compile(signs, leaves, Yield::Signs),
            || Lines::compile(lines, leaves),
        );
        Ok(Self {
            signs: signs?,
            lines: lines?,
            values: OnceLock::new(),
            schedule: brick.clone(),
            leaves: leaves.clone(),
        })
    }

    /// Fresh memory for one thread.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        Workspace {
            scratch: vec![0.0; self.signs.scratch],
            staging: Box::new([[0.0; PLANE]; 4]),
            lines: self.lines.workspace(),
        }
    }

    /// See [`Sampler::signs`](super::Sampler::signs).
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn signs(
        &self,
        workspace: &mut Workspace,
        tiles: &Tiles,
        brick: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let Workspace { scratch, staging, .. } = workspace;
        let mut arguments = Arguments {
            tables: Axis::ALL.map(|axis| tiles.tile(axis, brick[axis.index()])),
            uniforms: &tiles.uniforms,
            activity,
            scratch,
            signs,
            ..Arguments::default()
        };
        let mut run =
            Run { code: &self.signs.code, staging, lanes: PLANE, oracles: &tiles.oracles };
        self.signs.run(&mut run, &mut arguments)
    }

    /// See [`Sampler::values`](super::Sampler::values).
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    ///
    /// # Panics
    /// If the code generator, which has compiled the same operations for the lines, now fails.
    pub fn values(
        &self,
        workspace: &mut Workspace,
        tiles: &Tiles,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let compile = || Brick::compile(&self.schedule, &self.leaves, Yield::Values);
        let program = self.values.get_or_init(compile).as_ref();
        let program = program.expect("the lines of the same expression were compiled");
        let Workspace { scratch, staging, .. } = workspace;
        if scratch.len() < program.scratch {
            scratch.resize(program.scratch, 0.0);
        }
        let mut arguments = Arguments {
            tables: Axis::ALL.map(|axis| tiles.tile(axis, brick[axis.index()])),
            uniforms: &tiles.uniforms,
            activity,
            scratch,
            values,
            ..Arguments::default()
        };
        let mut run = Run { code: &program.code, staging, lanes: PLANE, oracles: &tiles.oracles };
        program.run(&mut run, &mut arguments)
    }

    /// The programs over edges, and the memory for them.
    pub(in crate::eval) fn lines<'a>(
        &'a self,
        workspace: &'a mut Workspace,
    ) -> (&'a Lines, &'a mut LinesWorkspace) {
        (&self.lines, &mut workspace.lines)
    }
}

#[cfg(test)]
mod tests;
