//! Operations that are not compiled: functions over lanes, and oracles.

use super::call::Arguments;
use super::rivals::InPlane;
use crate::eval::compared::MOST_LEVELS;
use crate::eval::rival::Rival;
use crate::eval::tape::{Op, Position, Tape};
use crate::expr::{Binary, Failure, Interest, Oracle, Queries, Unary};
use crate::geom::Axis;
use crate::num::lanes;
use std::sync::Arc;

/// Lanes of a plane of a brick, and of a batch of edges.
pub(super) const PLANE: usize = 256;
/// Lanes of a row of a plane.
pub(super) const ROW: usize = 16;

/// Where the numbers of an operand start.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    /// In the program.
    Constant(f64),
    /// Among the uniform values.
    Uniform(usize),
    /// In the tables of an axis, at the first number plus that of the plane if `per_plane`.
    Table { axis: Axis, first: usize, per_plane: bool },
    /// In the scratch memory, `plane` numbers further on for every plane.
    Scratch { first: usize, plane: usize },
}

/// How the numbers of an operand spread over the lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    /// One number for all.
    One,
    /// One number a lane.
    Lanes,
    /// The same numbers in every row.
    Rows,
    /// One number a row.
    Columns,
}

/// An operand of a call.
#[derive(Clone, Copy, Debug)]
pub(super) struct Operand {
    pub(super) source: Source,
    pub(super) spread: Spread,
}

/// The numbers that the values of an oracle are compared with: a source, or its opposite.
#[derive(Clone, Debug)]
pub(super) struct Levels(pub(super) Vec<(Source, Sense)>);

/// Whether a number is taken as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sense {
    /// As it is.
    Own,
    /// The opposite of it.
    Opposite,
}

/// Some numbers that values are compared with.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Numbers {
    list: [f64; MOST_LEVELS],
    len: usize,
}

impl Numbers {
    pub(super) fn list(&self) -> &[f64] {
        &self.list[..self.len]
    }
}

impl Levels {
    /// The numbers as they are now.
    pub(super) fn numbers(&self, arguments: &Arguments<'_>) -> Numbers {
        let mut numbers = Numbers { len: self.0.len().min(MOST_LEVELS), ..Numbers::default() };
        for (number, &(source, sense)) in numbers.list.iter_mut().zip(&self.0) {
            let out = std::slice::from_mut(number);
            Operand { source, spread: Spread::One }.spread_to(arguments, 0, out);
            *number = if sense == Sense::Opposite { -*number } else { *number };
        }
        numbers
    }
}

/// What is called, and where in the scratch memory the results go.
#[derive(Clone, Debug)]
enum Function {
    Unary(Unary, usize),
    /// The sine and the cosine.
    Wave(usize, usize),
    Binary(Binary, usize),
    /// An oracle by number; value and partial derivatives.
    Oracle(usize, [Option<usize>; 4]),
}

/// A call over lanes.
#[derive(Clone, Debug)]
pub(super) struct Call {
    function: Function,
    operands: Vec<Operand>,
    /// What an oracle's values are compared with, if they are not used otherwise.
    levels: Option<Levels>,
    /// What they lose against, with all that is made of them.
    rival: Option<Rival<Operand, Operand>>,
    /// It is for at most so many lanes.
    lanes: usize,
}

/// Buffers of a call.
pub(super) type Staging = [[f64; PLANE]; 4];

impl Call {
    /// The call for `ops`: outputs of an oracle at one point, or a sine and a cosine of one value,
    /// or one operation.
    pub(super) fn new(
        tape: &Tape,
        ops: &[Position],
        lanes: usize,
        operand: impl Fn(Position) -> Operand,
        result: impl Fn(Position) -> usize,
    ) -> Self {
        let first = tape.op(ops[0]);
        let function = match first {
            Op::Unary(op, _) if ops.len() == 2 => {
                let [own, other] = [result(ops[0]), result(ops[1])];
                if op == Unary::Sin {
                    Function::Wave(own, other)
                } else {
                    Function::Wave(other, own)
                }
            }
            Op::Unary(op, _) => Function::Unary(op, result(ops[0])),
            Op::Binary(op, _, _) => Function::Binary(op, result(ops[0])),
            Op::Oracle(oracle, ..) => {
                let mut outs = [None; 4];
                for &p in ops {
                    if let Op::Oracle(_, output, _) = tape.op(p) {
                        outs[output.index()] = Some(result(p));
                    }
                }
                Function::Oracle(oracle.index(), outs)
            }
            Op::Coordinate(_) | Op::Constant(_) | Op::Parameter(_) | Op::Pick(..) => {
                unreachable!("it is arithmetic or an input")
            }
        };
        let operands = first.operands().iter().map(|&p| operand(p)).collect();
        Self { function, operands, levels: None, rival: None, lanes }
    }

    /// The call, of an oracle, if its values are compared with `levels` and nothing else.
    pub(super) fn beside(self, levels: Option<Levels>) -> Self {
        Self { levels, ..self }
    }

    /// The call, of an oracle, if its answers lose against `rival` or are looked at.
    pub(super) fn against(self, rival: Option<Rival<Operand, Operand>>) -> Self {
        Self { rival, ..self }
    }

    /// Computes `lanes` lanes, or as many as there are, of plane `plane`.
    pub(super) fn run(
        &self,
        arguments: &mut Arguments<'_>,
        staging: &mut Staging,
        oracles: &[Arc<dyn Oracle>],
        plane: usize,
        lanes: usize,
    ) -> Result<(), Failure> {
        let lanes = lanes.min(self.lanes);
        if let [operand] = self.operands[..]
            && let Some(first) = operand.buffer(plane)
            && self.run_in_place(arguments.scratch, first, lanes)
        {
            return Ok(());
        }
        for (operand, out) in self.operands.iter().zip(staging.iter_mut()) {
            operand.spread_to(arguments, plane, &mut out[..lanes]);
        }
        let [a, b, c, unwanted] = staging;
        let (a, b, c) = (&a[..lanes], &b[..lanes], &c[..lanes]);
        match &self.function {
            Function::Unary(op, out) => unary(*op, a, &mut arguments.scratch[*out..][..lanes]),
            Function::Wave(sine, cosine) => {
                let (sines, cosines) = (*sine..sine + lanes, *cosine..cosine + lanes);
                let outs = arguments.scratch.get_disjoint_mut([sines, cosines]);
                let [sines, cosines] = outs.expect("results have buffers of their own");
                lanes::sin_cos(a, sines, cosines);
            }
            Function::Binary(op, out) => binary(*op, a, b, &mut arguments.scratch[*out..][..lanes]),
            Function::Oracle(oracle, outs) => {
                let oracle = &oracles[*oracle];
                let mut answers = [[0.0; PLANE]; 3];
                let value = &mut unwanted[..lanes];
                let wants_gradient = outs[1..].iter().any(Option::is_some);
                let gradient = wants_gradient.then(|| answers.each_mut().map(|a| &mut a[..lanes]));
                let queries = Queries { at: [a, b, c], value, gradient };
                match (&self.levels, &self.rival) {
                    (Some(levels), _) => {
                        let numbers = levels.numbers(arguments);
                        oracle.points_for(queries, Interest::Beside(numbers.list()))?;
                    }
                    (None, Some(rival)) => {
                        let mut room = [[0.0; PLANE]; 2];
                        let room = room.each_mut().map(|numbers| &mut numbers[..lanes]);
                        let values = InPlane { arguments, plane };
                        rival.with_interest(&values, room, |interest| match interest {
                            Some(interest) => oracle.points_for(queries, interest),
                            None => oracle.points(queries),
                        })?;
                    }
                    (None, None) => oracle.points(queries)?,
                }
                let answers = answers.each_ref().map(|a| &a[..lanes]);
                let answers = [&unwanted[..lanes], answers[0], answers[1], answers[2]];
                for (out, answer) in outs.iter().zip(answers) {
                    if let Some(out) = out {
                        arguments.scratch[*out..][..lanes].copy_from_slice(answer);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Call {
    /// Computes functions of the buffer at `first` if no other buffer is needed; else false.
    fn run_in_place(&self, scratch: &mut [f64], first: usize, lanes: usize) -> bool {
        let range = |first: usize| first..first + lanes;
        match self.function {
            Function::Unary(op, out) => {
                let Ok([a, out]) = scratch.get_disjoint_mut([range(first), range(out)]) else {
                    return false;
                };
                unary(op, a, out);
            }
            Function::Wave(sine, cosine) => {
                let ranges = [range(first), range(sine), range(cosine)];
                let Ok([a, sines, cosines]) = scratch.get_disjoint_mut(ranges) else {
                    return false;
                };
                lanes::sin_cos(a, sines, cosines);
            }
            Function::Binary(..) | Function::Oracle(..) => return false,
        }
        true
    }
}

impl Operand {
    /// Where its numbers lie in the scratch memory, if there is one for every lane.
    const fn buffer(self, at: usize) -> Option<usize> {
        match (self.source, self.spread) {
            (Source::Scratch { first, plane }, Spread::Lanes) => Some(first + at * plane),
            _ => None,
        }
    }

    /// Writes the operand's value in each lane to `out`.
    pub(super) fn spread_to(self, arguments: &Arguments<'_>, plane: usize, out: &mut [f64]) {
        let numbers = match &self.source {
            Source::Constant(value) => std::slice::from_ref(value),
            Source::Uniform(number) => &arguments.uniforms[*number..],
            Source::Table { axis, first, per_plane } => {
                let first = if *per_plane { first + plane } else { *first };
                &arguments.tables[axis.index()][first..]
            }
            Source::Scratch { first, plane: stride } => {
                &arguments.scratch[first + plane * stride..]
            }
        };
        match self.spread {
            Spread::One => out.fill(numbers[0]),
            Spread::Lanes => out.copy_from_slice(&numbers[..out.len()]),
            Spread::Rows => {
                for row in out.chunks_mut(ROW) {
                    row.copy_from_slice(&numbers[..row.len()]);
                }
            }
            Spread::Columns => {
                for (row, number) in out.chunks_mut(ROW).zip(numbers) {
                    row.fill(*number);
                }
            }
        }
    }
}

fn unary(op: Unary, a: &[f64], out: &mut [f64]) {
    match op {
        Unary::Sin => lanes::sin(a, out),
        Unary::Cos => lanes::cos(a, out),
        Unary::Exp => lanes::exp(a, out),
        Unary::Log => lanes::log(a, out),
        Unary::Neg
        | Unary::Abs
        | Unary::Sign
        | Unary::Sqrt
        | Unary::Cbrt
        | Unary::Floor
        | Unary::Ceil
        | Unary::Round
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos
        | Unary::Atan
        | Unary::Sinh
        | Unary::Cosh
        | Unary::Tanh
        | Unary::Log10 => lanes::map(|a| op.apply(a), a, out),
    }
}

fn binary(op: Binary, a: &[f64], b: &[f64], out: &mut [f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = op.apply(*a, *b);
    }
}
