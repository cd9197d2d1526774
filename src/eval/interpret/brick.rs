//! Samples of a brick: planes of 16 x 16, one after the other.
//!
//! Values on x and y are made once a brick; values on x and z or y and z are sixteen lanes a plane;
//! the rest is 256 lanes a plane. An oracle on coordinates that each depend on their own axis
//! answers once for the whole brick.

use super::buffers::allocate;
use super::code::{self, Buffers, Call, Frame, Instruction, Layout, PLANE, Shape, Source};
use super::rows::View;
use crate::eval::leaves::{LeafValues, Leaves};
use crate::eval::regions::is_set;
use crate::eval::sampler::{BRICK, BrickSigns};
use crate::eval::schedule::{Schedule, Step, brick};
use crate::eval::tape::{Op, Position};
use crate::expr::{AxisSet, Failure, Oracle, Output, Queries};
use crate::geom::Axis;
use crate::num::lanes as host;
use std::ops::Range;
use std::sync::Arc;

/// A program that samples bricks.
#[derive(Debug)]
pub struct BrickProgram {
    instructions: Vec<Instruction>,
    calls: Vec<Call>,
    volumes: Vec<Volume>,
    /// What runs once a brick, and once a plane.
    once: Vec<Step>,
    plane: Vec<Step>,
    output: Source,
    buffers: usize,
}

/// An oracle that is asked once a brick.
#[derive(Debug)]
struct Volume {
    oracle: Arc<dyn Oracle>,
    at: [Source; 3],
    position: usize,
}

/// Memory of a thread that runs a [`BrickProgram`].
#[derive(Debug, Default)]
pub struct BrickWorkspace {
    buffers: Buffers,
    volumes: Vec<Vec<f64>>,
    once: Vec<Range<usize>>,
    plane: Vec<Range<usize>>,
}

impl BrickProgram {
    /// The program of the first output of `schedule`, which is that of a brick.
    #[must_use]
    pub fn new(schedule: &Schedule, leaves: &Leaves, oracles: &[Arc<dyn Oracle>]) -> Self {
        let tape = schedule.tape();
        let flat = |p: &Position| tape.axes(*p).len() == 2 && !tape.axes(*p).contains(Axis::Z);
        let mut volumes = Vec::new();
        let mut volume_of = vec![None; tape.len()];
        for p in schedule.stage(brick::PLANE) {
            if let Op::Oracle(_, Output::Value, at) = tape.op(p)
                && at.iter().zip(Axis::ALL).all(|(&o, a)| tape.axes(o).is_subset(AxisSet::only(a)))
            {
                volume_of[p.index()] = Some(volumes.len() as u32);
                volumes.push(p);
            }
        }
        let shape = |p: Position| match (tape.axes(p).len(), tape.axes(p).contains(Axis::X)) {
            (2, true) if tape.axes(p).contains(Axis::Z) => Shape::AlongX,
            (2, false) => Shape::AlongY,
            _ => Shape::Plane,
        };
        let pool = |p: Position| {
            let computed = tape.axes(p).len() >= 2 && volume_of[p.index()].is_none();
            computed.then(|| usize::from(shape(p) != Shape::Plane))
        };
        let output = tape.output_flags();
        let allocation = allocate(tape, pool, |p| output[p.index()] || flat(&p));
        let planes = allocation.counts.first().copied().unwrap_or(0);
        let edges = allocation.counts.get(1).copied().unwrap_or(0);
        let sources: Vec<Source> = (tape.positions())
            .map(|p| {
                let axes = tape.axes(p);
                match (axes.iter().next(), axes.len()) {
                    (Some(axis), 1) if leaves.has(tape.node(p)) => {
                        Source::Table(axis, leaves.number(tape.node(p)))
                    }
                    (None, _) if leaves.has(tape.node(p)) => {
                        Source::Uniform(leaves.number(tape.node(p)))
                    }
                    (_, 0 | 1) => Source::Uniform(0),
                    (..) => match (volume_of[p.index()], allocation.of[p.index()]) {
                        (Some(volume), _) => Source::Volume(volume),
                        (None, buffer) => {
                            let first = if shape(p) == Shape::Plane { 0 } else { planes };
                            Source::Buffer(first + buffer.unwrap_or(0), shape(p))
                        }
                    },
                }
            })
            .collect();
        let layout = Layout { schedule, sources };
        let mut calls = Vec::new();
        let instructions: Vec<Instruction> =
            tape.positions().map(|p| layout.instruction(p, oracles, &mut calls)).collect();
        let once = schedule.stage(brick::FLAT).chain(volumes.iter().copied());
        let plane = schedule.stage(brick::EDGE).chain(schedule.stage(brick::PLANE));
        let volumes: Vec<Volume> = (volumes.iter())
            .filter_map(|&p| match tape.op(p) {
                Op::Oracle(oracle, _, at) => Some(Volume {
                    oracle: Arc::clone(&oracles[oracle.index()]),
                    at: at.map(|o| layout.sources[o.index()]),
                    position: p.index(),
                }),
                Op::Coordinate(_)
                | Op::Constant(_)
                | Op::Parameter(_)
                | Op::Unary(..)
                | Op::Binary(..)
                | Op::Pick(..) => None,
            })
            .collect();
        Self {
            once: schedule.steps(once),
            plane: schedule.steps(plane.filter(|p| volume_of[p.index()].is_none())),
            output: layout.sources[tape.outputs()[0].index()],
            instructions,
            calls,
            volumes,
            buffers: (planes + edges) as usize,
        }
    }

    /// Fresh memory for one thread.
    #[must_use]
    pub fn workspace(&self) -> BrickWorkspace {
        BrickWorkspace {
            buffers: vec![Vec::new(); self.buffers],
            volumes: vec![vec![0.0; PLANE * BRICK]; self.volumes.len()],
            ..BrickWorkspace::default()
        }
    }

    /// Signs of the brick whose least node is `first`.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn signs(
        &self,
        workspace: &mut BrickWorkspace,
        leaves: &LeafValues,
        first: [usize; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        self.planes(workspace, leaves, first, activity, |z, view| {
            let words = &mut signs[z * BRICK..][..BRICK];
            host::dispatch(
                #[inline(always)]
                || pack(view, words),
            );
        })
    }

    /// Values of the brick whose least node is `first`, x fastest, then y, then z.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn values(
        &self,
        workspace: &mut BrickWorkspace,
        leaves: &LeafValues,
        first: [usize; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        self.planes(workspace, leaves, first, activity, |z, view| {
            view.copy_to(&mut values[z * PLANE..][..PLANE]);
        })
    }

    /// Hands every plane of the output to `receive`.
    fn planes(
        &self,
        workspace: &mut BrickWorkspace,
        leaves: &LeafValues,
        first: [usize; 3],
        activity: &[u64],
        mut receive: impl FnMut(usize, View<'_>),
    ) -> Result<(), Failure> {
        let BrickWorkspace { buffers, volumes, once, plane } = workspace;
        select(&self.once, activity, once);
        select(&self.plane, activity, plane);
        let frame = Frame {
            leaves,
            origin: first,
            plane: 0,
            volumes: &[],
            nodes: [&[]; 3],
            activity,
            lanes: PLANE,
        };
        code::run(&self.instructions, once, &self.calls, &frame, buffers)?;
        for (volume, values) in self.volumes.iter().zip(volumes.iter_mut()) {
            if once.iter().any(|run| run.contains(&volume.position)) {
                volume.fill(&frame, values)?;
            }
        }
        for z in 0..BRICK {
            let origin = [first[0], first[1], first[2] + z];
            let frame = Frame { origin, plane: z, volumes, ..frame };
            code::run(&self.instructions, plane, &self.calls, &frame, buffers)?;
            receive(z, frame.view(self.output, Shape::Plane, buffers));
        }
        Ok(())
    }
}

/// The runs that `activity` leaves of `steps`.
pub(super) fn select(steps: &[Step], activity: &[u64], runs: &mut Vec<Range<usize>>) {
    runs.clear();
    let mut at = 0;
    while let Some(step) = steps.get(at) {
        at += 1;
        match step {
            Step::Enter { bit, end } => {
                if !is_set(activity, *bit) {
                    at = *end;
                }
            }
            Step::Run(run) => match runs.last_mut() {
                Some(last) if last.end == run.start => last.end = run.end,
                _ => runs.push(run.clone()),
            },
        }
    }
}

impl Volume {
    /// Asks the oracle for a whole brick.
    fn fill(&self, frame: &Frame<'_>, values: &mut [f64]) -> Result<(), Failure> {
        let mut at = [[0.0; BRICK]; 3];
        for ((at, source), axis) in at.iter_mut().zip(self.at).zip(Axis::ALL) {
            match source {
                Source::Uniform(number) => at.fill(frame.leaves.uniforms[number as usize]),
                Source::Table(_, table) => {
                    let table = frame.leaves.table(axis, table, frame.origin[axis.index()]);
                    at.copy_from_slice(&table[..BRICK]);
                }
                Source::Buffer(..) | Source::Volume(_) => {}
            }
        }
        let [x, y, z] = &at;
        if at.iter().all(|at| at.is_sorted() || at.iter().rev().is_sorted()) {
            return self.oracle.brick([x, y, z], values);
        }
        // The coordinates turn back inside the brick, so it is no grid of the oracle's.
        for (plane, z) in values.chunks_exact_mut(PLANE).zip(z) {
            let xs: [f64; PLANE] = std::array::from_fn(|i| x[i % BRICK]);
            let ys: [f64; PLANE] = std::array::from_fn(|i| y[i / BRICK]);
            let zs = [*z; PLANE];
            self.oracle.points(Queries { at: [&xs, &ys, &zs], value: plane, gradient: None })?;
        }
        Ok(())
    }
}

/// Sign bits of a plane, a word a row.
#[inline(always)]
fn pack(view: View<'_>, words: &mut [u16]) {
    let bits = |row: &[f64]| {
        let mut word = 0;
        for (x, value) in row.iter().take(BRICK).enumerate() {
            word |= u16::from(*value < 0.0) << x;
        }
        word
    };
    match view {
        View::Rows { values, stride } => {
            for (y, word) in words.iter_mut().enumerate() {
                *word = bits(&values[y * stride..][..BRICK]);
            }
        }
        View::Splat { values, stride } => {
            for (y, word) in words.iter_mut().enumerate() {
                *word = if values[y * stride] < 0.0 { u16::MAX } else { 0 };
            }
        }
    }
}
