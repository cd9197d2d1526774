//! Edges of a batch: values and slopes at their ends and in between.
//!
//! The edges in one box of a brick make a *group* with a cut of its own. Values on one axis are made
//! at the brick's nodes, few as they are, and gathered: those across the edges when the batch begins,
//! those along them at the ends. In between, what depends on the axis of the edges is made from the
//! coordinates, by the same operations.
//!
//! Edges run in rows, each through all steps before the next: the values of a row are few enough for
//! the nearest caches, and a step is a few instructions. Many edges run in wide rows, because there are
//! so many fewer steps.

use super::Shared;
use super::asked::{self, Calls};
use super::cut::{Cut, Op};
use super::tape::{Place, Shape, Step, Tape, apply, ask};
use crate::eval::BRICK;
use crate::eval::interpret::rows::{ROW, View};
use crate::expr::{Failure, Oracle};
use crate::geom::Axis;
use crate::num::lanes;
use std::ops::Range;
use std::sync::Arc;

/// Nodes of a brick along an axis, those on the far face included.
pub(super) const NODES: usize = BRICK + 1;
/// Lanes of a row of values at nodes, and of all.
const NODE_ROW: usize = 8;
const NODE_LANES: usize = NODES.next_multiple_of(NODE_ROW);

/// The edges of a batch that run together.
#[derive(Debug, Default)]
pub(super) struct Group {
    /// The edges, by their places in the batch.
    pub(super) edges: Vec<u16>,
    /// Values this far from zero are not trusted; infinite if all are.
    pub(super) limit: f64,
    /// Values on one axis, at the nodes.
    lines: Tape,
    line_buffers: Vec<Vec<f64>>,
    /// The brick that they are of.
    brick: Option<[u32; 3]>,
    /// Values of the edges.
    tape: Tape,
    /// The steps of that, in short.
    steps: Vec<Short>,
    /// Numbers that steps read.
    scalars: Vec<f64>,
    /// What steps ask; oracles have the number of their call for a fourth operand.
    calls: Calls,
    /// Steps of the beginning.
    begin: usize,
    /// Whether rows are wide.
    is_wide: bool,
    /// The buffers of each row of edges, one row after the other.
    values: Vec<f64>,
    /// The nodes of the edges within the brick, one list an axis.
    nodes: [Vec<u8>; 3],
}

/// Edges in a wide row.
const WIDE: usize = 64;

/// A step: what it does, how, and where.
#[derive(Clone, Copy, Debug)]
struct Short {
    op: Op,
    way: Way,
    args: [u32; 4],
    out: u32,
}

/// The bit that says that an operand is a scalar, not a buffer.
const SCALAR: u32 = 1 << 31;

/// How a value of the edges is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// From others.
    Computed,
    /// It is a value across the edges, to be gathered from that buffer of values at nodes.
    Gathered(Axis, u32),
    /// It is a value along the edges; at the ends it is gathered, if others need it.
    Along(Axis, Option<u32>),
}

/// Where the edges of a group are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// So many nodes ahead of the lower ones.
    End(usize),
    /// In between.
    Between,
}

impl Group {
    /// Takes `cut`, whose outputs are the value and its derivative along `axis`.
    pub(super) fn take(&mut self, shared: Shared<'_>, cut: &Cut, axis: Axis) {
        self.brick = None;
        let Self { lines, line_buffers, tape, steps, scalars, calls, begin, .. } = self;
        let count = cut.items.len();
        let axes = |at: usize| cut.items[at].axes;
        let varies = |at: usize| axes(at).contains(axis);
        // By operation: whether one on several axes, or the result, uses it; whether one along the
        // edges does.
        let mut used = vec![Uses::default(); count];
        for output in &cut.outputs {
            if let Ok(place) = output.place() {
                used[place].by_many = true;
            }
        }
        for (user, item) in cut.items.iter().enumerate().rev() {
            let is_many = axes(user).len() != 1;
            for operand in item.args.iter().filter_map(|arg| arg.place().ok()) {
                used[operand].by_many |= is_many;
                used[operand].along |= varies(user);
            }
        }
        let is_line = |at: usize| axes(at).len() == 1;
        let inputs = (cut, shared.uniforms);
        let order = (0..count).filter(|at| axes(*at).len() <= 1);
        lines.arrange(inputs, order, |_| Shape::Full, |at| used[at].by_many, |_| false);
        let line_of = |at: usize| match lines.place(at) {
            Place::Buffer(_, buffer) => Some(buffer),
            Place::Scalar(_) => None,
        };

        // Across the edges values on one axis are gathered, if others than such need them.
        let across = (0..count).filter(|at| !varies(*at) && (!is_line(*at) || used[*at].by_many));
        let along = (0..count).filter(|at| varies(*at));
        let mut order: Vec<usize> = across.chain(along).collect();
        asked::put_off(cut, &mut order, varies);
        calls.begin(cut, &order);
        let is_kept = |at: usize| used[at].along && !varies(at);
        let is_read = |at: usize| is_line(at) && !varies(at);
        tape.arrange(inputs, order.iter().copied(), |_| Shape::Full, is_kept, is_read);
        steps.clear();
        scalars.clear();
        *begin = 0;
        let mut long = tape.steps.iter();
        let mut scalar = |value: f64| {
            scalars.push(value);
            SCALAR | (scalars.len() as u32 - 1)
        };
        // The oracle that was asked in the step before.
        let mut asked: Option<usize> = None;
        for &at in &order {
            let own = axes(at).iter().next().filter(|_| is_line(at));
            let way = match (own, line_of(at)) {
                // Coordinates are located, not made.
                (Some(_), _) if matches!(cut.items[at].op, Op::Coordinate(_)) => continue,
                (Some(own), Some(line)) if !varies(at) => Way::Gathered(own, line),
                (Some(own), line) => Way::Along(own, line.filter(|_| used[at].by_many)),
                (None, _) => Way::Computed,
            };
            let Some(step) = long.next() else { break };
            let before = asked.take();
            let mut args = [0; 4];
            if let Op::Oracle(oracle, output) = step.op {
                let is_computed = way == Way::Computed;
                let is_joint = before.is_some_and(|before| asked::is_joint(cut, before, at));
                if !(is_computed && is_joint) {
                    let [x, y, z, _] = step.args.map(|place| place.short(&mut scalar));
                    args = [x, y, z, calls.add(oracle, [x, y, z])];
                }
                calls.answer(inputs, (at, output), step.out, |other| {
                    let place = other.place().map_or_else(
                        |node| Place::Scalar(shared.uniforms[node]),
                        |at| tape.place(at),
                    );
                    place.short(&mut scalar)
                });
                asked = is_computed.then_some(at);
                if is_computed && is_joint {
                    continue;
                }
            } else {
                args = step.args.map(|place| place.short(&mut scalar));
            }
            steps.push(Short { op: step.op, way, args, out: step.out });
            *begin += usize::from(!varies(at));
        }
        let needed = lines.counts[Shape::Full as usize] as usize;
        line_buffers.resize_with(line_buffers.len().max(needed), Vec::new);
    }

    /// Sets the edges' lower nodes, by their places in `brick`, whose nodes are at `at`.
    ///
    /// # Errors
    /// [`Failure`] of one of `oracles`.
    pub(super) fn place(
        &mut self,
        oracles: &[Arc<dyn Oracle>],
        brick: [u32; 3],
        at: &[[f64; NODES]; 3],
        nodes: impl Iterator<Item = [usize; 3]> + Clone,
    ) -> Result<(), Failure> {
        for (axis, own) in self.nodes.iter_mut().enumerate() {
            own.clear();
            own.extend(nodes.clone().map(|node| node[axis] as u8));
        }
        if self.brick == Some(brick) {
            return Ok(());
        }
        self.brick = Some(brick);
        let Self { lines, line_buffers, .. } = self;
        for (axis, at) in Axis::ALL.into_iter().zip(at) {
            if let Some(buffer) = lines.coordinates[axis.index()] {
                let buffer = &mut line_buffers[buffer as usize];
                buffer.resize(NODE_LANES, 0.0);
                buffer[..NODES].copy_from_slice(at);
                // Lanes without a node do what the last node does.
                buffer[NODES..].fill(at[NODES - 1]);
            }
        }
        lanes::dispatch(
            #[inline(always)]
            || {
                let lanes = (NODE_LANES, NODES);
                lines.steps.iter().try_for_each(
                    #[inline(always)]
                    |one| step(one, lanes, line_buffers, oracles),
                )
            },
        )
    }

    /// Sets the coordinates along `axis` of the edges of the group, in order.
    pub(super) fn locate(&mut self, axis: Axis, at: impl Iterator<Item = f64>) {
        self.is_wide = 2 * self.edges.len() > WIDE;
        let numbers = self.edges.len().div_ceil(self.width()) * self.stride();
        self.values.resize(numbers, 0.0);
        if let Some(buffer) = self.tape.coordinates[axis.index()] {
            for (edge, at) in at.enumerate() {
                let place = self.place_of(edge, buffer);
                self.values[place] = at;
            }
        }
    }

    /// Sets the coordinates along `axis`, which `at` has for all edges of the batch.
    pub(super) fn locate_along(&mut self, axis: Axis, at: &[f64]) {
        if let Some(buffer) = self.tape.coordinates[axis.index()] {
            for edge in 0..self.edges.len() {
                let place = self.place_of(edge, buffer);
                self.values[place] = at[usize::from(self.edges[edge])];
            }
        }
    }

    /// Edges in a row.
    const fn width(&self) -> usize {
        if self.is_wide { WIDE } else { ROW }
    }

    /// Numbers of a row.
    fn stride(&self) -> usize {
        self.tape.counts[Shape::Full as usize] as usize * self.width()
    }

    /// Where a value of the group's edge `edge` is.
    #[inline]
    fn place_of(&self, edge: usize, buffer: u32) -> usize {
        let width = self.width();
        edge / width * self.stride() + buffer as usize * width + edge % width
    }

    /// Makes what does not depend on the axis of the edges, which are placed and located.
    ///
    /// # Errors
    /// [`Failure`] of one of `oracles`.
    pub(super) fn begin(&mut self, oracles: &[Arc<dyn Oracle>]) -> Result<(), Failure> {
        self.run(oracles, 0..self.begin, Wanted::Between)
    }

    /// Makes the value and the derivative where they are `wanted`; the edges are located along their
    /// axis.
    ///
    /// # Errors
    /// [`Failure`] of one of `oracles`.
    pub(super) fn evaluate(
        &mut self,
        oracles: &[Arc<dyn Oracle>],
        wanted: Wanted,
    ) -> Result<(), Failure> {
        self.run(oracles, self.begin..self.steps.len(), wanted)
    }

    /// Writes output `number` to `out`, by the places of the edges in the batch; true if all can be
    /// trusted.
    pub(super) fn deliver(&self, number: usize, out: &mut [f64]) -> bool {
        let mut is_trusted = true;
        let mut put = |edge: u16, value: f64| {
            is_trusted &= self.limit == f64::INFINITY || value.abs() < self.limit;
            out[usize::from(edge)] = value;
        };
        match self.tape.outputs[number] {
            Place::Scalar(value) => self.edges.iter().for_each(|edge| put(*edge, value)),
            Place::Buffer(_, buffer) => {
                let rows = self.values.chunks_exact(self.stride());
                for (edges, row) in self.edges.chunks(self.width()).zip(rows) {
                    let values = &row[buffer as usize * self.width()..];
                    edges.iter().zip(values).for_each(|(edge, value)| put(*edge, *value));
                }
            }
        }
        is_trusted
    }

    fn run(
        &mut self,
        oracles: &[Arc<dyn Oracle>],
        steps: Range<usize>,
        wanted: Wanted,
    ) -> Result<(), Failure> {
        lanes::dispatch(
            #[inline(always)]
            || {
                if self.is_wide {
                    self.rows::<WIDE>(oracles, steps, wanted)
                } else {
                    self.rows::<ROW>(oracles, steps, wanted)
                }
            },
        )
    }

    /// Runs steps on rows of `W` edges.
    #[inline(always)]
    fn rows<const W: usize>(
        &mut self,
        oracles: &[Arc<dyn Oracle>],
        steps: Range<usize>,
        wanted: Wanted,
    ) -> Result<(), Failure> {
        let stride = self.stride().max(1);
        let Self { steps: all, scalars, calls, values, line_buffers, nodes, edges, .. } = self;
        let rows = values.chunks_exact_mut(stride).take(edges.len().div_ceil(W));
        for (row, values) in rows.enumerate() {
            let (values, _) = values.as_chunks_mut::<W>();
            let edges = row * W..edges.len().min((row + 1) * W);
            let nodes = nodes.each_ref().map(|nodes| &nodes[edges.clone()]);
            for step in &all[steps.clone()] {
                let line = |line: u32| &line_buffers[line as usize][..];
                match (step.way, wanted) {
                    (Way::Computed, _) | (Way::Along(..), Wanted::Between) => {
                        if let Op::Oracle(..) = step.op {
                            let [.., call] = step.args;
                            calls.run(call, oracles, edges.len(), (scalars, values))?;
                        } else {
                            compute(step, scalars, values);
                        }
                    }
                    (Way::Along(_, None), Wanted::End(_)) => {}
                    (Way::Gathered(axis, number), _) => {
                        let out = &mut values[step.out as usize];
                        gather(nodes[axis.index()], 0, line(number), out);
                    }
                    (Way::Along(axis, Some(number)), Wanted::End(ahead)) => {
                        let out = &mut values[step.out as usize];
                        gather(nodes[axis.index()], ahead, line(number), out);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Place {
    /// The same as an operand of edges, `scalar` giving those of scalars.
    fn short(self, scalar: impl FnOnce(f64) -> u32) -> u32 {
        match self {
            Self::Buffer(_, buffer) => buffer,
            Self::Scalar(value) => scalar(value),
        }
    }
}

/// An operand of a row of edges.
#[inline(always)]
pub(super) fn operand<'v, const W: usize>(
    arg: u32,
    scalars: &'v [f64],
    values: &'v [[f64; W]],
) -> View<'v> {
    if arg & SCALAR == 0 {
        View::Rows { values: &values[arg as usize], stride: W }
    } else {
        View::scalar(&scalars[(arg & !SCALAR) as usize])
    }
}

/// Runs a step that asks no oracle on a row of edges.
#[inline(always)]
fn compute<const W: usize>(step: &Short, scalars: &[f64], values: &mut [[f64; W]]) {
    let mut out = [0.0; W];
    let [a, b, c, d] = step.args;
    let (a, b) = (operand(a, scalars, values), operand(b, scalars, values));
    let args = match step.op {
        Op::Pick(_) => [a, b, operand(c, scalars, values), operand(d, scalars, values)],
        Op::Coordinate(_)
        | Op::Pass(_)
        | Op::Unary(_)
        | Op::Square
        | Op::Binary(_)
        | Op::Choose(_)
        | Op::Oracle(..) => [a, b, a, b],
    };
    apply::<W>(step.op, args, &mut out);
    values[step.out as usize] = out;
}

/// Who uses an operation.
#[derive(Clone, Copy, Debug, Default)]
struct Uses {
    by_many: bool,
    along: bool,
}

/// The values of `line` at the nodes `ahead` of `nodes`.
#[inline(always)]
fn gather(nodes: &[u8], ahead: usize, line: &[f64], out: &mut [f64]) {
    if let Some(line) = line.first_chunk::<NODE_LANES>() {
        for (out, node) in out.iter_mut().zip(nodes) {
            // A remainder, so that no lane needs a test.
            *out = line[(usize::from(*node) + ahead) % NODE_LANES];
        }
    }
}

/// Runs a step on values at nodes, so many lanes of which so many are nodes.
#[inline(always)]
fn step(
    step: &Step,
    (lanes, nodes): (usize, usize),
    buffers: &mut [Vec<f64>],
    oracles: &[Arc<dyn Oracle>],
) -> Result<(), Failure> {
    let mut out = std::mem::take(&mut buffers[step.out as usize]);
    out.resize(lanes, 0.0);
    let args = step.args.each_ref().map(|place| match place {
        Place::Scalar(value) => View::scalar(value),
        Place::Buffer(_, buffer) => {
            View::Rows { values: &buffers[*buffer as usize], stride: NODE_ROW }
        }
    });
    let answer = match step.op {
        Op::Oracle(oracle, output) => {
            let at = [args[0], args[1], args[2]].map(|view| {
                let mut at = vec![0.0; nodes];
                view.copy_rows_to::<NODE_ROW>(&mut at);
                at
            });
            let at = at.each_ref().map(|at| &at[..]);
            ask(&oracles[oracle.index()], output, at, &mut out[..nodes])
        }
        Op::Coordinate(_)
        | Op::Pass(_)
        | Op::Unary(_)
        | Op::Square
        | Op::Binary(_)
        | Op::Choose(_)
        | Op::Pick(_) => {
            apply::<NODE_ROW>(step.op, args, &mut out);
            Ok(())
        }
    };
    buffers[step.out as usize] = out;
    answer
}
