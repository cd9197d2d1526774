//! A cut in the form in which it runs over lanes: steps that read and write buffers.
//!
//! A value lies in a buffer of its shape until its last use. A step never writes a buffer that it
//! reads.

use super::cut::{Arg, Cut, Op};
use crate::eval::interpret::rows::{self, View};
use crate::expr::{Binary, Failure, Oracle, Output, Queries};
use std::sync::Arc;

/// Lanes of a value, by what it varies along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// Along x, along y, along z, or not at all: a number for each of eight coordinates.
    X,
    /// See `X`.
    Y,
    /// See `X`.
    Z,
    /// Along x and y: a number for each of 64 columns of a block.
    Flat,
    /// Along everything.
    Full,
}

/// Where a value is.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    /// Here, the same for all lanes.
    Scalar(f64),
    /// In a buffer of its shape, by number.
    Buffer(Shape, u32),
}

/// An operation with the places of its operands and of its result.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) op: Op,
    pub(super) args: [Place; 4],
    pub(super) shape: Shape,
    pub(super) out: u32,
}

/// The steps of a cut.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    pub(super) steps: Vec<Step>,
    pub(super) outputs: Vec<Place>,
    /// The buffers of the coordinates, which are filled from outside.
    pub(super) coordinates: [Option<u32>; 3],
    /// Number of buffers of each shape.
    pub(super) counts: [u32; 5],
    memory: Memory,
}

impl Tape {
    /// Where the operation at `at` of the cut that was arranged last is, if it was in the order.
    pub(super) fn place(&self, at: usize) -> Place {
        self.memory.places[at]
    }
}

/// What is needed while a tape is made.
#[derive(Clone, Debug, Default)]
struct Memory {
    last: Vec<u32>,
    places: Vec<Place>,
    free: [Vec<u32>; 5],
}

/// A value that is used after everything.
const KEPT: u32 = u32::MAX;

impl Tape {
    /// Makes the steps of the operations of `cut` that `order` lists, operands before users; the
    /// outputs are those of the cut that are among them.
    ///
    /// `shape` gives the shape of an operation, `is_kept` says whether its value is to last,
    /// `is_read` whether it comes from elsewhere: a step of it needs no operands.
    pub(super) fn arrange(
        &mut self,
        (cut, uniforms): (&Cut, &[f64]),
        order: impl DoubleEndedIterator<Item = usize> + Clone,
        shape: impl Fn(usize) -> Shape,
        is_kept: impl Fn(usize) -> bool,
        is_read: impl Fn(usize) -> bool,
    ) {
        let Self { steps, outputs, coordinates, counts, memory } = self;
        let Memory { last, places, free } = memory;
        steps.clear();
        outputs.clear();
        *coordinates = [None; 3];
        *counts = [0; 5];
        free.iter_mut().for_each(Vec::clear);
        last.clear();
        last.resize(cut.items.len(), 0);
        for output in &cut.outputs {
            if let Ok(place) = output.place() {
                last[place] = KEPT;
            }
        }
        // Users come later in the order, so the first that is met from behind is the last use.
        for user in order.clone().rev() {
            let item = &cut.items[user];
            if matches!(item.op, Op::Coordinate(_)) || is_kept(user) {
                last[user] = KEPT;
            }
            if is_read(user) {
                continue;
            }
            for arg in item.args {
                if let Ok(operand) = arg.place()
                    && last[operand] == 0
                {
                    last[operand] = user as u32 + 1;
                }
            }
        }
        places.clear();
        places.resize(cut.items.len(), Place::Scalar(0.0));
        let place_of = |arg: Arg, places: &[Place]| match arg.place() {
            Ok(place) => places[place],
            Err(node) => Place::Scalar(uniforms[node]),
        };
        // Coordinates are there before anything runs.
        for at in order.clone() {
            if let Op::Coordinate(axis) = cut.items[at].op {
                let (shape, out) = (shape(at), counts[shape(at) as usize]);
                counts[shape as usize] += 1;
                places[at] = Place::Buffer(shape, out);
                coordinates[axis.index()] = Some(out);
            }
        }
        for at in order {
            let item = &cut.items[at];
            if let Op::Coordinate(_) = item.op {
                continue;
            }
            let shape = shape(at);
            let out = free[shape as usize].pop().unwrap_or_else(|| {
                counts[shape as usize] += 1;
                counts[shape as usize] - 1
            });
            places[at] = Place::Buffer(shape, out);
            if is_read(at) {
                steps.push(Step { op: item.op, args: [Place::Scalar(0.0); 4], shape, out });
                continue;
            }
            let [a, b, c, d] = item.args;
            let args = match item.op {
                Op::Pick(_) | Op::Oracle(..) => [a, b, c, d].map(|arg| place_of(arg, places)),
                Op::Coordinate(_)
                | Op::Pass(_)
                | Op::Unary(_)
                | Op::Square
                | Op::Binary(_)
                | Op::Choose(_) => {
                    let (a, b) = (place_of(a, places), place_of(b, places));
                    [a, b, a, b]
                }
            };
            steps.push(Step { op: item.op, args, shape, out });
            for arg in item.args {
                if let Ok(operand) = arg.place()
                    && last[operand] == at as u32 + 1
                    && let Place::Buffer(shape, buffer) = places[operand]
                {
                    // Once, though it may be several operands.
                    last[operand] = 0;
                    free[shape as usize].push(buffer);
                }
            }
        }
        outputs.extend(cut.outputs.iter().map(|output| place_of(*output, places)));
    }
}

/// Runs an operation that is no oracle on rows of `W` lanes.
#[inline(always)]
pub(super) fn apply<const W: usize>(op: Op, args: [View<'_>; 4], out: &mut [f64]) {
    match op {
        Op::Unary(op) => rows::unary::<W>(op, args[0], out),
        Op::Square => rows::binary::<W>(Binary::Mul, args[0], args[0], out),
        Op::Binary(op) => rows::binary::<W>(op, args[0], args[1], out),
        Op::Choose(extremum) => rows::binary::<W>(extremum.operator(), args[0], args[1], out),
        Op::Pick(extremum) => rows::pick::<W>(extremum, args, out),
        Op::Coordinate(_) | Op::Pass(_) | Op::Oracle(..) => {}
    }
}

/// Asks an oracle for one of its outputs at points.
pub(super) fn ask(
    oracle: &Arc<dyn Oracle>,
    output: Output,
    at: [&[f64]; 3],
    out: &mut [f64],
) -> Result<(), Failure> {
    let Output::Partial(axis) = output else {
        return oracle.points(Queries { at, value: out, gradient: None });
    };
    let mut spare = [const { Vec::new() }; 3];
    spare.iter_mut().for_each(|spare: &mut Vec<f64>| spare.resize(out.len(), 0.0));
    let [value, b, c] = spare.each_mut().map(|spare| &mut spare[..]);
    let gradient = match axis.index() {
        0 => [out, b, c],
        1 => [b, out, c],
        _ => [b, c, out],
    };
    oracle.points(Queries { at, value, gradient: Some(gradient) })
}
