//! Samples of a block of eight nodes a side.
//!
//! Values on one axis are eight numbers, those on x and y 64, all others 512: what does not change
//! along z is made once a block. Everything runs in one pass, in buffers that stay in the cache.

use super::Shared;
use super::asked;
use super::cut::{Cut, Item, Op};
use super::tape::{Place, Shape, Step, Tape, apply, ask};
use crate::eval::interpret::rows::View;
use crate::expr::{AxisSet, Failure, Interest, Oracle, Output, Queries};
use crate::geom::Axis;
use crate::num::lanes;
use std::sync::Arc;

/// Nodes along a side of a block.
pub(super) const SIDE: usize = 8;
/// Columns of a block.
const FLAT: usize = SIDE * SIDE;
/// Nodes of a block.
pub(super) const FULL: usize = SIDE * SIDE * SIDE;

/// What is wanted of the nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Yield {
    /// Whether the value is below zero.
    Signs,
    /// The value.
    Values,
}

/// The sampling of blocks.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    tape: Tape,
    /// By step that asks an oracle: what the value is compared with, if that is all.
    levels: Vec<(usize, Vec<f64>)>,
    buffers: Buffers,
    copies: Copies,
}

/// Values of a block, by shape and number.
#[derive(Debug, Default)]
struct Buffers {
    lines: [Vec<[f64; SIDE]>; 3],
    flats: Vec<Vec<f64>>,
    fulls: Vec<Vec<f64>>,
}

/// Room for operands on one axis, written out.
#[derive(Debug)]
struct Copies([[f64; FLAT]; 4]);

impl Default for Copies {
    fn default() -> Self {
        Self([[0.0; FLAT]; 4])
    }
}

/// The shape of what depends on `axes`.
fn shape(axes: AxisSet) -> Shape {
    let [x, y, z] = Axis::ALL.map(|axis| axes.contains(axis));
    match (x, y, z) {
        (true, false, false) => Shape::X,
        (false, true, false) => Shape::Y,
        (false, false, _) => Shape::Z,
        (true, true, false) => Shape::Flat,
        (_, _, true) => Shape::Full,
    }
}

/// Lanes of a buffer.
const fn lanes_of(shape: Shape) -> usize {
    match shape {
        Shape::X | Shape::Y | Shape::Z => SIDE,
        Shape::Flat => FLAT,
        Shape::Full => FULL,
    }
}

impl Blocks {
    /// Takes `cut`, whose output, or the sign of it, is sampled from now on.
    pub(super) fn take(&mut self, shared: Shared<'_>, cut: &Cut, yields: Yield) {
        let Self { tape, buffers, levels, .. } = self;
        levels.clear();
        if yields == Yield::Signs {
            let is_step = |item: &Item| !matches!(item.op, Op::Coordinate(_));
            let of = |(at, own): (usize, Vec<f64>)| {
                (cut.items[..at].iter().filter(|item| is_step(item)).count(), own)
            };
            levels.extend(asked::levels(cut, shared.uniforms).into_iter().map(of));
        }
        let Buffers { lines, flats, fulls } = buffers;
        let order = 0..cut.items.len();
        let shape_at = |at: usize| shape(cut.items[at].axes);
        tape.arrange((cut, shared.uniforms), order, shape_at, |_| false, |_| false);
        for (lines, shape) in lines.iter_mut().zip([Shape::X, Shape::Y, Shape::Z]) {
            lines.resize(tape.counts[shape as usize] as usize, [0.0; SIDE]);
        }
        for (buffers, shape) in [(flats, Shape::Flat), (fulls, Shape::Full)] {
            let count = tape.counts[shape as usize] as usize;
            buffers.resize_with(buffers.len().max(count), || vec![0.0; lanes_of(shape)]);
        }
    }

    /// Samples the block at the coordinates `at` and hands over the result, rows of 64 lanes.
    ///
    /// # Errors
    /// [`Failure`] of one of `oracles`.
    pub(super) fn sample(
        &mut self,
        oracles: &[Arc<dyn Oracle>],
        at: [&[f64; SIDE]; 3],
        receive: impl FnOnce(View<'_>),
    ) -> Result<(), Failure> {
        let Self { tape, levels, buffers, copies } = self;
        for (axis, at) in Axis::ALL.into_iter().zip(at) {
            if let Some(buffer) = tape.coordinates[axis.index()] {
                buffers.lines[axis.index()][buffer as usize] = *at;
            }
        }
        lanes::dispatch(
            #[inline(always)]
            || {
                tape.steps.iter().enumerate().try_for_each(
                    #[inline(always)]
                    |(number, step)| {
                        if let Op::Oracle(oracle, output) = step.op {
                            let own = levels.iter().find(|(at, _)| *at == number);
                            let levels = own.map(|(_, levels)| &levels[..]);
                            let oracle = &oracles[oracle.index()];
                            return buffers.ask(step, (oracle, output), levels);
                        }
                        buffers.run(step, copies);
                        Ok(())
                    },
                )
            },
        )?;
        let output = tape.outputs.first().unwrap_or(&Place::Scalar(0.0));
        receive(buffers.view(output, &mut copies.0[0]));
        Ok(())
    }
}

impl Buffers {
    /// Runs a step that asks no oracle.
    #[inline(always)]
    fn run(&mut self, step: &Step, copies: &mut Copies) {
        let buffer = step.out as usize;
        match step.shape {
            Shape::X | Shape::Y | Shape::Z => {
                let mut out = [0.0; SIDE];
                let [a, b, c, d] = &step.args;
                let args = [self.line(a), self.line(b), self.line(c), self.line(d)];
                apply::<SIDE>(step.op, args, &mut out);
                self.lines[step.shape as usize][buffer] = out;
            }
            Shape::Flat => {
                let mut out = std::mem::take(&mut self.flats[buffer]);
                self.apply(step, copies, &mut out);
                self.flats[buffer] = out;
            }
            Shape::Full => {
                let mut out = std::mem::take(&mut self.fulls[buffer]);
                self.apply(step, copies, &mut out);
                self.fulls[buffer] = out;
            }
        }
    }

    /// Runs a step on rows of 64 lanes.
    #[inline(always)]
    fn apply(&self, step: &Step, copies: &mut Copies, out: &mut [f64]) {
        let [first, second, third, fourth] = &mut copies.0;
        let [a, b, c, d] = &step.args;
        let (a, b) = (self.view(a, first), self.view(b, second));
        let (c, d) = match step.op {
            Op::Pick(_) => (self.view(c, third), self.view(d, fourth)),
            Op::Coordinate(_)
            | Op::Pass(_)
            | Op::Unary(_)
            | Op::Square
            | Op::Binary(_)
            | Op::Choose(_)
            | Op::Oracle(..) => (a, a),
        };
        apply::<FLAT>(step.op, [a, b, c, d], out);
    }

    /// A value on one axis, or on none, in a row of eight lanes.
    #[inline(always)]
    fn line<'v>(&'v self, place: &'v Place) -> View<'v> {
        match place {
            Place::Scalar(value) => View::scalar(value),
            Place::Buffer(Shape::X, buffer) => row(&self.lines[0][*buffer as usize]),
            Place::Buffer(Shape::Y, buffer) => row(&self.lines[1][*buffer as usize]),
            Place::Buffer(Shape::Z, buffer) => row(&self.lines[2][*buffer as usize]),
            Place::Buffer(Shape::Flat | Shape::Full, _) => {
                unreachable!("what is on one axis is made from values on it")
            }
        }
    }

    /// A value in rows of 64 lanes, written out to `copy` if need be.
    #[inline(always)]
    fn view<'v>(&'v self, place: &'v Place, copy: &'v mut [f64; FLAT]) -> View<'v> {
        match place {
            Place::Scalar(value) => View::scalar(value),
            Place::Buffer(Shape::X, buffer) => {
                let line = &self.lines[0][*buffer as usize];
                copy.as_chunks_mut::<SIDE>().0.iter_mut().for_each(|row| *row = *line);
                View::Rows { values: copy, stride: 0 }
            }
            Place::Buffer(Shape::Y, buffer) => {
                let line = &self.lines[1][*buffer as usize];
                let rows = copy.as_chunks_mut::<SIDE>().0.iter_mut();
                rows.zip(line).for_each(|(row, value)| *row = [*value; SIDE]);
                View::Rows { values: copy, stride: 0 }
            }
            Place::Buffer(Shape::Z, buffer) => {
                View::Splat { values: &self.lines[2][*buffer as usize], stride: 1 }
            }
            Place::Buffer(Shape::Flat, buffer) => {
                View::Rows { values: &self.flats[*buffer as usize], stride: 0 }
            }
            Place::Buffer(Shape::Full, buffer) => {
                View::Rows { values: &self.fulls[*buffer as usize], stride: FLAT }
            }
        }
    }

    /// Asks an oracle, once for the whole block where its coordinates are those of a grid; for values
    /// that compare with `levels` as its own do, if there are any.
    #[inline(never)]
    fn ask(
        &mut self,
        step: &Step,
        (oracle, output): (&Arc<dyn Oracle>, Output),
        levels: Option<&[f64]>,
    ) -> Result<(), Failure> {
        let mut values = vec![0.0; lanes_of(step.shape)];
        let along = |place: &Place, shape: Shape| match *place {
            Place::Buffer(own, buffer) if own == shape => {
                let line = &self.lines[shape as usize][buffer as usize];
                (line.is_sorted() || line.iter().rev().is_sorted()).then_some(line)
            }
            Place::Scalar(_) | Place::Buffer(..) => None,
        };
        let [x, y, z, _] = &step.args;
        let grid = (along(x, Shape::X), along(y, Shape::Y), along(z, Shape::Z));
        if let ((Some(x), Some(y), Some(z)), Output::Value) = (grid, output) {
            match levels {
                Some(levels) => oracle.brick_beside([x, y, z], levels, &mut values)?,
                None => oracle.brick([x, y, z], &mut values)?,
            }
        } else {
            let points = [x, y, z].map(|place| {
                let mut points = vec![0.0; values.len()];
                match step.shape {
                    Shape::X | Shape::Y | Shape::Z => {
                        self.line(place).copy_rows_to::<SIDE>(&mut points);
                    }
                    Shape::Flat | Shape::Full => {
                        self.view(place, &mut [0.0; FLAT]).copy_rows_to::<FLAT>(&mut points);
                    }
                }
                points
            });
            let at = points.each_ref().map(|points| &points[..]);
            match levels {
                Some(levels) => {
                    let queries = Queries { at, value: &mut values, gradient: None };
                    oracle.points_for(queries, Interest::Beside(levels))?;
                }
                None => ask(oracle, output, at, &mut values)?,
            }
        }
        let buffer = step.out as usize;
        match step.shape {
            Shape::X | Shape::Y | Shape::Z => {
                self.lines[step.shape as usize][buffer].copy_from_slice(&values);
            }
            Shape::Flat => self.flats[buffer] = values,
            Shape::Full => self.fulls[buffer] = values,
        }
        Ok(())
    }
}

/// Eight numbers as a row.
#[inline(always)]
fn row(line: &[f64; SIDE]) -> View<'_> {
    View::Rows { values: line, stride: SIDE }
}
