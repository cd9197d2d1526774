//! Edges of the grid: values at their ends, values and slopes in between.
//!
//! In a batch of edges along one axis the other two coordinates are fixed. What depends on those
//! alone is made once, when the batch begins. What depends on the axis alone is read from tables
//! at the ends and computed in between, by the same operations, so both give the same bits.

use super::brick::select;
use super::buffers::allocate;
use super::code::{self, Action, Buffers, Call, Frame, Instruction, Layout, PLANE, READ};
use super::code::{Shape, Source};
use crate::eval::leaves::{AtNodes, LeafValues, Leaves, at_nodes};
use crate::eval::sampler::{End, place_of};
use crate::eval::schedule::{Schedule, Step, UNIFORM, line};
use crate::eval::tape::{Op, Position};
use crate::expr::{Failure, Oracle};
use crate::geom::Axis;
use std::ops::Range;
use std::sync::Arc;

/// A program for the grid edges along one axis.
#[derive(Debug)]
pub struct LineProgram {
    axis: Axis,
    /// By operation: what computes it between nodes, and what reads or computes it at nodes.
    between: Vec<Instruction>,
    at_nodes: Vec<Instruction>,
    calls: Vec<Call>,
    begin: Vec<Step>,
    ends: Vec<Step>,
    inner: Vec<Step>,
    coordinate: Option<u32>,
    /// The value, its derivative along the axis, and what else the schedule yields.
    outputs: Vec<Source>,
    buffers: usize,
}

/// Memory of a thread that runs a [`LineProgram`], and its present batch.
#[derive(Debug, Default)]
pub struct LineWorkspace {
    buffers: Buffers,
    nodes: [Vec<u32>; 3],
    activity: Vec<u64>,
    begin: Vec<Range<usize>>,
    ends: Vec<Range<usize>>,
    inner: Vec<Range<usize>>,
}

impl LineProgram {
    /// The program of `schedule`, which is that of lines along `axis` and whose outputs are the
    /// value, its derivative along the axis, and whatever else is wanted between nodes.
    #[must_use]
    pub fn new(
        schedule: &Schedule,
        leaves: &Leaves,
        oracles: &[Arc<dyn Oracle>],
        axis: Axis,
    ) -> Self {
        let tape = schedule.tape();
        let computed = |p: Position| !tape.axes(p).is_empty();
        let mut stage = vec![UNIFORM; tape.len()];
        for number in [line::FIXED, line::BATCH, line::ALONG, line::CORE] {
            for p in schedule.stage(number) {
                stage[p.index()] = number;
            }
        }
        // What a batch makes lasts while the batch does; so does the coordinate, which is written
        // before anything runs.
        let mut keep = tape.output_flags();
        let mut wanted = keep.clone();
        for p in tape.positions() {
            for &o in tape.op(p).operands().iter() {
                let early = stage[o.index()] <= line::BATCH;
                keep[o.index()] |= early && stage[p.index()] > line::BATCH;
                wanted[o.index()] |= stage[o.index()] != stage[p.index()];
            }
            keep[p.index()] |= matches!(tape.op(p), Op::Coordinate(_));
        }
        let allocation = allocate(tape, |p| computed(p).then_some(0), |p| keep[p.index()]);
        let sources: Vec<Source> = (tape.positions())
            .map(|p| match allocation.of[p.index()] {
                Some(buffer) => Source::Buffer(buffer, Shape::Plane),
                None if leaves.has(tape.node(p)) => Source::Uniform(leaves.number(tape.node(p))),
                None => Source::Uniform(0),
            })
            .collect();
        let layout = Layout { schedule, sources };
        let mut calls = Vec::new();
        let gather = |p: Position| match (tape.axes(p).iter().next(), layout.sources[p.index()]) {
            (Some(axis), Source::Buffer(out, shape)) => Instruction {
                action: Action::Gather { axis, table: leaves.number(tape.node(p)) },
                out,
                shape,
                ..READ
            },
            _ => READ,
        };
        let between: Vec<Instruction> = (tape.positions())
            .map(|p| match stage[p.index()] {
                line::FIXED if wanted[p.index()] => gather(p),
                line::FIXED => READ,
                _ => layout.instruction(p, oracles, &mut calls),
            })
            .collect();
        let needed = at_nodes(schedule, leaves);
        let at_nodes: Vec<Instruction> = (tape.positions())
            .map(|p| match needed[p.index()] {
                Some(AtNodes::Read) => gather(p),
                Some(AtNodes::Computed) | None => between[p.index()],
            })
            .collect();
        let begin = schedule.stage(line::FIXED).filter(|p| wanted[p.index()]);
        let begin = begin.chain(schedule.stage(line::BATCH));
        let inner = || schedule.stage(line::ALONG).chain(schedule.stage(line::CORE));
        let ends = inner().filter(|p| needed[p.index()].is_some());
        let coordinate = tape.positions().find(|&p| tape.op(p) == Op::Coordinate(axis));
        Self {
            axis,
            begin: schedule.steps(begin),
            ends: schedule.steps(ends),
            inner: schedule.steps(inner()),
            coordinate: coordinate.and_then(|p| allocation.of[p.index()]),
            outputs: tape.outputs().iter().map(|p| layout.sources[p.index()]).collect(),
            buffers: allocation.counts.first().copied().unwrap_or(0) as usize,
            between,
            at_nodes,
            calls,
        }
    }

    /// Fresh memory for one thread.
    #[must_use]
    pub fn workspace(&self) -> LineWorkspace {
        LineWorkspace { buffers: vec![Vec::new(); self.buffers], ..LineWorkspace::default() }
    }

    /// Sets up a batch of edges whose lower nodes are `nodes` of the brick whose least node is
    /// `first`.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn begin(
        &self,
        workspace: &mut LineWorkspace,
        leaves: &LeafValues,
        first: [usize; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        let LineWorkspace { buffers, nodes: lanes, activity: own, begin, ends, inner } = workspace;
        for ((list, first), axis) in lanes.iter_mut().zip(first).zip(0..) {
            list.clear();
            list.extend(nodes.iter().map(|&node| (first + place_of(node)[axis]) as u32));
        }
        own.clear();
        own.extend_from_slice(activity);
        select(&self.begin, own, begin);
        select(&self.ends, own, ends);
        select(&self.inner, own, inner);
        let frame = frame(leaves, lanes, own);
        code::run(&self.between, begin, &self.calls, &frame, buffers)
    }

    /// Values at one end of each edge of the batch, and derivatives along its axis.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn ends(
        &self,
        workspace: &mut LineWorkspace,
        leaves: &LeafValues,
        end: End,
        out: [&mut [f64]; 2],
    ) -> Result<(), Failure> {
        let LineWorkspace { buffers, nodes, activity, ends, .. } = workspace;
        let along = &mut nodes[self.axis.index()];
        if end == End::Upper {
            along.iter_mut().for_each(|node| *node += 1);
        }
        let frame = frame(leaves, nodes, activity);
        let answer = code::run(&self.at_nodes, ends, &self.calls, &frame, buffers);
        for (source, out) in self.outputs.iter().zip(out) {
            frame.view(*source, Shape::Plane, buffers).copy_to(out);
        }
        if end == End::Upper {
            nodes[self.axis.index()].iter_mut().for_each(|node| *node -= 1);
        }
        answer
    }

    /// The first outputs, as many as `out` has slices, at coordinate `at[m]` of edge `m`.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn between(
        &self,
        workspace: &mut LineWorkspace,
        leaves: &LeafValues,
        at: &[f64],
        out: &mut [&mut [f64]],
    ) -> Result<(), Failure> {
        let LineWorkspace { buffers, nodes, activity, inner, .. } = workspace;
        if let Some(buffer) = self.coordinate {
            let buffer = &mut buffers[buffer as usize];
            buffer.resize(PLANE, 0.0);
            buffer[..at.len()].copy_from_slice(at);
        }
        let frame = frame(leaves, nodes, activity);
        code::run(&self.between, inner, &self.calls, &frame, buffers)?;
        for (source, out) in self.outputs.iter().zip(out) {
            frame.view(*source, Shape::Plane, buffers).copy_to(out);
        }
        Ok(())
    }
}

/// The frame of a batch.
fn frame<'a>(leaves: &'a LeafValues, nodes: &'a [Vec<u32>; 3], activity: &'a [u64]) -> Frame<'a> {
    Frame {
        leaves,
        origin: [0; 3],
        plane: 0,
        volumes: &[],
        nodes: nodes.each_ref().map(|list| &list[..]),
        activity,
        lanes: nodes[0].len(),
    }
}
