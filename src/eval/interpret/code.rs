//! Instructions over buffers of lanes, and how they run.
//!
//! Every operation that a program computes has an instruction; instructions read uniform values,
//! tables and buffers ([`Source`]) and write one buffer. Buffers are shared by operations whose
//! values are not alive at the same time.

use super::rows::{self, ROW, View};
use crate::eval::leaves::LeafValues;
use crate::eval::regions::is_set;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position};
use crate::expr::{Binary, Extremum, Failure, Oracle, Output, Queries, Unary};
use crate::geom::Axis;
use crate::num::lanes as host;
use std::ops::Range;
use std::sync::Arc;

/// How the lanes of a buffer are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Rows of sixteen: a plane with x along the rows, or any run of points.
    Plane,
    /// Sixteen values along x, the same in every row of a plane.
    AlongX,
    /// Sixteen values along y, one for each row of a plane.
    AlongY,
}

impl Shape {
    /// Lanes of a buffer.
    const fn lanes(self) -> usize {
        match self {
            Self::Plane => PLANE,
            Self::AlongX | Self::AlongY => ROW,
        }
    }
}

/// Where an operand is read from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// A uniform value, by number.
    Uniform(u32),
    /// A table, by axis and number.
    Table(Axis, u32),
    /// A buffer.
    Buffer(u32, Shape),
    /// A plane of a volume of values made once a brick.
    Volume(u32),
}

/// What an instruction does.
#[derive(Clone, Copy, Debug)]
pub(super) enum Action {
    /// Nothing: the value is a source.
    Read,
    /// An operator of one operand.
    Unary(Unary),
    /// An operator of two operands without a choice.
    Binary(Binary),
    /// An extremum of two operands, whose sides may have activity bits.
    Choose(Extremum, [Option<u32>; 2]),
    /// A pick among four operands, whose sides may have activity bits.
    Pick(Extremum, [Option<u32>; 2]),
    /// Entry of a table at each lane's node, `ahead` of it.
    Gather { axis: Axis, table: u32 },
    /// A call of an oracle, by number.
    Call(u32),
}

/// An operation over lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instruction {
    pub action: Action,
    pub operands: [Source; 4],
    pub out: u32,
    pub shape: Shape,
}

/// A call of an oracle: one point query for all outputs at the same operands.
#[derive(Clone, Debug)]
pub(super) struct Call {
    pub oracle: Arc<dyn Oracle>,
    /// The buffers that receive the value and the three partial derivatives.
    pub outs: [Option<u32>; 4],
}

/// The buffers of one thread, each made when it is first written.
pub(super) type Buffers = Vec<Vec<f64>>;

/// What instructions read besides buffers.
pub(super) struct Frame<'a> {
    pub leaves: &'a LeafValues,
    /// Where the tables start: the first node of the brick and the present plane.
    pub origin: [usize; 3],
    /// The present plane of the brick.
    pub plane: usize,
    pub volumes: &'a [Vec<f64>],
    /// The node of each lane along each axis, for gathering.
    pub nodes: [&'a [u32]; 3],
    pub activity: &'a [u64],
    /// Lanes that matter.
    pub lanes: usize,
}

/// Samples in a plane of a brick.
pub(super) const PLANE: usize = ROW * ROW;

impl Frame<'_> {
    /// The values of `source` for an instruction of shape `shape`.
    #[inline(always)]
    pub(super) fn view<'v>(
        &'v self,
        source: Source,
        shape: Shape,
        buffers: &'v [Vec<f64>],
    ) -> View<'v> {
        let across = shape == Shape::AlongY;
        match source {
            Source::Uniform(number) => View::scalar(&self.leaves.uniforms[number as usize]),
            Source::Table(Axis::X, number) => {
                View::Rows { values: self.leaves.table(Axis::X, number, self.origin[0]), stride: 0 }
            }
            Source::Table(Axis::Y, number) => {
                along_y(self.leaves.table(Axis::Y, number, self.origin[1]), across)
            }
            Source::Table(Axis::Z, number) => View::Splat {
                values: self.leaves.table(Axis::Z, number, self.origin[2]),
                stride: 0,
            },
            Source::Buffer(buffer, Shape::Plane) => {
                View::Rows { values: &buffers[buffer as usize], stride: ROW }
            }
            Source::Buffer(buffer, Shape::AlongX) => {
                View::Rows { values: &buffers[buffer as usize], stride: 0 }
            }
            Source::Buffer(buffer, Shape::AlongY) => along_y(&buffers[buffer as usize], across),
            Source::Volume(volume) => View::Rows {
                values: &self.volumes[volume as usize][self.plane * PLANE..][..PLANE],
                stride: ROW,
            },
        }
    }
}

/// Values along y: lanes of a row for what itself runs along y, else one for each row.
#[inline(always)]
fn along_y(values: &[f64], across: bool) -> View<'_> {
    if across { View::Rows { values, stride: 0 } } else { View::Splat { values, stride: 1 } }
}

/// Runs the instructions in `runs`, in order.
pub(super) fn run(
    instructions: &[Instruction],
    runs: &[Range<usize>],
    calls: &[Call],
    frame: &Frame<'_>,
    buffers: &mut Buffers,
) -> Result<(), Failure> {
    host::dispatch(
        #[inline(always)]
        || {
            for instruction in runs.iter().flat_map(|run| &instructions[run.clone()]) {
                step(instruction, calls, frame, buffers)?;
            }
            Ok(())
        },
    )
}

#[inline(always)]
fn step(
    instruction: &Instruction,
    calls: &[Call],
    frame: &Frame<'_>,
    buffers: &mut Buffers,
) -> Result<(), Failure> {
    let Instruction { action, operands, out, shape } = *instruction;
    if let Action::Call(number) = action {
        return call(&calls[number as usize], operands, shape, frame, buffers);
    }
    if let Action::Read = action {
        return Ok(());
    }
    let mut values = std::mem::take(&mut buffers[out as usize]);
    let lanes = match shape {
        Shape::Plane => frame.lanes.next_multiple_of(ROW),
        Shape::AlongX | Shape::AlongY => ROW,
    };
    if values.is_empty() {
        values.resize(shape.lanes(), 0.0);
    }
    let target = &mut values[..lanes];
    let view = |i: usize| frame.view(operands[i], shape, buffers);
    match action {
        Action::Unary(op) => rows::unary::<ROW>(op, view(0), target),
        Action::Binary(op) => rows::binary::<ROW>(op, view(0), view(1), target),
        Action::Choose(extremum, bits) => match dead(bits, frame.activity) {
            Some(side) => view(1 - side).copy_to(target),
            None => rows::binary::<ROW>(extremum.operator(), view(0), view(1), target),
        },
        Action::Pick(extremum, bits) => match dead(bits, frame.activity) {
            Some(side) => view(3 - side).copy_to(target),
            None => rows::pick::<ROW>(extremum, [0, 1, 2, 3].map(view), target),
        },
        Action::Gather { axis, table } => {
            let table = frame.leaves.table(axis, table, 0);
            for (value, &node) in target.iter_mut().zip(frame.nodes[axis.index()]) {
                *value = table[node as usize];
            }
        }
        Action::Read | Action::Call(_) => {}
    }
    buffers[out as usize] = values;
    Ok(())
}

/// The dead side of a choice, if one is.
#[inline(always)]
fn dead(bits: [Option<u32>; 2], activity: &[u64]) -> Option<usize> {
    (0..2).find(|&side| bits[side].is_some_and(|bit| !is_set(activity, bit)))
}

/// Asks an oracle at the lanes' points.
#[inline(never)]
fn call(
    call: &Call,
    operands: [Source; 4],
    shape: Shape,
    frame: &Frame<'_>,
    buffers: &mut Buffers,
) -> Result<(), Failure> {
    let lanes = match shape {
        Shape::Plane => frame.lanes,
        Shape::AlongX | Shape::AlongY => ROW,
    };
    let mut at = [[0.0; PLANE]; 3];
    for (at, operand) in at.iter_mut().zip(operands) {
        frame.view(operand, shape, buffers).copy_to(&mut at[..lanes]);
    }
    let wants_gradient = call.outs[1..].iter().any(Option::is_some);
    let mut outs: [Vec<f64>; 4] = std::array::from_fn(|i| {
        let mut values =
            call.outs[i].map_or_else(Vec::new, |out| std::mem::take(&mut buffers[out as usize]));
        if i == 0 || wants_gradient {
            values.resize(shape.lanes(), 0.0);
        }
        values
    });
    let [value, gradient @ ..] = &mut outs;
    let gradient = wants_gradient.then(|| gradient.each_mut().map(|g| &mut g[..lanes]));
    let at = at.each_ref().map(|at| &at[..lanes]);
    let answer = call.oracle.points(Queries { at, value: &mut value[..lanes], gradient });
    for (out, values) in call.outs.iter().zip(outs) {
        if let Some(out) = out {
            buffers[*out as usize] = values;
        }
    }
    answer
}

/// Where each operation of a schedule is computed and kept.
pub(super) struct Layout<'a> {
    pub schedule: &'a Schedule,
    /// The source of each operation.
    pub sources: Vec<Source>,
}

impl Layout<'_> {
    /// The instruction of the operation at `p`, writing the buffer it is kept in; calls of oracles
    /// are added to `calls`.
    pub(super) fn instruction(
        &self,
        p: Position,
        oracles: &[Arc<dyn Oracle>],
        calls: &mut Vec<Call>,
    ) -> Instruction {
        let tape = self.schedule.tape();
        let Source::Buffer(out, shape) = self.sources[p.index()] else { return READ };
        let mut operands = [Source::Uniform(0); 4];
        for (source, o) in operands.iter_mut().zip(tape.op(p).operands().iter()) {
            *source = self.sources[o.index()];
        }
        let regions = self.schedule.regions();
        let bits = || {
            let sides = regions.sides(p).unwrap_or_default();
            sides.map(|side| side.and_then(|region| regions.bit(region)))
        };
        let action = match tape.op(p) {
            Op::Coordinate(_) | Op::Constant(_) | Op::Parameter(_) => Action::Read,
            Op::Unary(op, _) => Action::Unary(op),
            Op::Binary(op, _, _) => match op.extremum() {
                Some(extremum) => Action::Choose(extremum, bits()),
                None => Action::Binary(op),
            },
            Op::Pick(extremum, _) => Action::Pick(extremum, bits()),
            Op::Oracle(oracle, _, _) => match self.outs(p) {
                Some(outs) => {
                    calls.push(Call { oracle: Arc::clone(&oracles[oracle.index()]), outs });
                    Action::Call(calls.len() as u32 - 1)
                }
                None => Action::Read,
            },
        };
        Instruction { action, operands, out, shape }
    }

    /// The buffers of all outputs of an oracle that one call answers, if `p` is the first of them.
    ///
    /// A value that is asked for once a brick has no buffer, wherever among them it stands.
    fn outs(&self, p: Position) -> Option<[Option<u32>; 4]> {
        let tape = self.schedule.tape();
        let same = |q: &Position| {
            let regions = self.schedule.regions();
            matches!((tape.op(p), tape.op(*q)),
                (Op::Oracle(a, _, s), Op::Oracle(b, _, t)) if a == b && s == t)
                && regions.of(p) == regions.of(*q)
        };
        let has_buffer = |q: Position| matches!(self.sources[q.index()], Source::Buffer(..));
        let before = (0..p.index()).rev().map(Position::new).take_while(same);
        if { before }.any(has_buffer) {
            return None;
        }
        let mut outs = [None; 4];
        for q in tape.positions().skip(p.index()).take_while(same) {
            if let (Op::Oracle(_, output, _), Source::Buffer(out, _)) =
                (tape.op(q), self.sources[q.index()])
            {
                outs[match output {
                    Output::Value => 0,
                    Output::Partial(axis) => 1 + axis.index(),
                }] = Some(out);
            }
        }
        Some(outs)
    }
}

/// The instruction of a value that is only read.
pub(super) const READ: Instruction = Instruction {
    action: Action::Read,
    operands: [Source::Uniform(0); 4],
    out: 0,
    shape: Shape::Plane,
};
