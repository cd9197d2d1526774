//! Programs over batches of grid edges along one axis.
//!
//! In a batch the other two coordinates are fixed: what depends on those alone is gathered from
//! tables, and computed, when the batch begins. What depends on the axis alone is gathered at the
//! ends of the edges and computed in between, by the same operations. Everything is a loop over
//! up to 256 lanes.

use super::action::{Action, Emit, Fill, Run, actions};
use super::assembly::Assembly;
use super::body::{Body, Index, Pointer};
use super::call::{Arguments, Base, Code};
use super::calls::{Call, Operand, PLANE, Source, Spread};
use super::flow::{self, Flow, Kind, Segment};
use super::layout::{self, Home, Users};
use super::rivals::rivals;
use super::segment::{Access, LANES, Lanes};
use super::{CompileError, check_size, tiles};
use crate::eval::leaves::{AtNodes, Leaves, at_nodes};
use crate::eval::rival::Rival;
use crate::eval::schedule::{Schedule, line};
use crate::eval::tape::{Op, Position};
use crate::expr::{AxisSet, Failure};
use crate::geom::Axis;
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::Range;

/// Lanes of a round of a loop: one vector.
const ROUND: usize = LANES;
/// Regions that cost at most so many additions are run in any case: a test is a loop of its own.
const CHEAP: usize = 16;
/// Rounds in a full batch.
const ROUNDS: usize = PLANE / ROUND;
/// Numbers from one buffer to the next: a line of the cache more than a batch, because buffers a
/// power of two apart contend for the same few places in it.
const STRIDE: usize = PLANE + 8;

/// A compiled program over edges along one axis.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) code: Code,
    begin: Vec<Action>,
    ends: Vec<Action>,
    between: Vec<Action>,
    /// Where the coordinates along the axis go.
    coordinate: Option<usize>,
    /// Where the value and its derivative along the axis are at the ends.
    end_outputs: [Home; 2],
    /// Where the value, its derivative along the axis and the other outputs are between the ends.
    outputs: Vec<Home>,
    /// Numbers of scratch memory.
    pub(super) scratch: usize,
}

impl Line {
    /// Compiles the program of `schedule`, whose tape yields the value, its derivative along
    /// `axis`, and whatever else is wanted between the ends.
    pub(super) fn compile(
        schedule: &Schedule,
        leaves: &Leaves,
        axis: Axis,
    ) -> Result<Self, CompileError> {
        let mut assembly = Assembly::new()?;
        let plan = Plan::new(schedule, leaves, axis);
        check_size(plan.scratch)?;
        let Plan { begin, ends, between, .. } = &plan;
        let homes = &plan.homes;
        let mut part =
            Part { plan: &plan, assembly: &mut assembly, flow: begin, homes, at_nodes: false };
        let begin = actions(begin, &mut part, false)?;
        let mut part = Part { flow: ends, homes: &plan.end_homes, at_nodes: true, ..part };
        let ends = actions(ends, &mut part, false)?;
        let mut part = Part { flow: between, homes, at_nodes: false, ..part };
        let between = actions(between, &mut part, false)?;
        let tape = schedule.tape();
        let home = |p: Position| plan.homes[p.index()];
        let coordinate = tape.positions().find(|p| tape.op(*p) == Op::Coordinate(axis));
        Ok(Self {
            code: assembly.finish()?,
            begin,
            ends,
            between,
            coordinate: coordinate.map(home).and_then(Home::buffer),
            end_outputs: [0, 1].map(|k| plan.end_homes[tape.outputs()[k].index()]),
            outputs: tape.outputs().iter().map(|p| home(*p)).collect(),
            scratch: plan.scratch,
        })
    }

    /// Sets up a batch.
    pub(super) fn begin(
        &self,
        run: &mut Run<'_>,
        arguments: &mut Arguments<'_>,
    ) -> Result<(), Failure> {
        run.actions(&self.begin, arguments, rounds(run.lanes))
    }

    /// The value and its derivative along the axis at the nodes that the run looks at.
    pub(super) fn ends(
        &self,
        run: &mut Run<'_>,
        arguments: &mut Arguments<'_>,
        out: [&mut [f64]; 2],
    ) -> Result<(), Failure> {
        run.actions(&self.ends, arguments, rounds(run.lanes))?;
        for (home, out) in self.end_outputs.into_iter().zip(out) {
            read(home, arguments, out);
        }
        Ok(())
    }

    /// The first outputs, as many as `out` has slices, at the coordinates `at`.
    pub(super) fn between(
        &self,
        run: &mut Run<'_>,
        arguments: &mut Arguments<'_>,
        at: &[f64],
        out: &mut [&mut [f64]],
    ) -> Result<(), Failure> {
        if let Some(first) = self.coordinate {
            arguments.scratch[first..][..at.len()].copy_from_slice(at);
        }
        run.actions(&self.between, arguments, rounds(run.lanes))?;
        for (home, out) in self.outputs.iter().zip(out) {
            read(*home, arguments, out);
        }
        Ok(())
    }
}

/// The rounds that cover `lanes` lanes; at least one.
fn rounds(lanes: usize) -> Range<usize> {
    0..lanes.div_ceil(ROUND).max(1)
}

/// Copies a result out.
fn read(home: Home, arguments: &Arguments<'_>, out: &mut [f64]) {
    match home {
        Home::Constant(value) => out.fill(value),
        Home::Uniform(number) => out.fill(arguments.uniforms[number]),
        Home::Buffer(first) => out.copy_from_slice(&arguments.scratch[first..][..out.len()]),
        Home::Register | Home::Table(..) | Home::Volume(_) => {
            unreachable!("results over lanes are kept in buffers")
        }
    }
}

/// What the generation of code needs to know of a program.
struct Plan<'a> {
    schedule: &'a Schedule,
    leaves: &'a Leaves,
    users: Users,
    /// Homes of the values of the flows `begin` and `between`.
    homes: Vec<Home>,
    /// Homes of the values of the flows `begin` and `ends`: loops are cut differently there.
    end_homes: Vec<Home>,
    begin: Flow,
    ends: Flow,
    between: Flow,
    rivals: FxHashMap<Position, Rival<Position, Position>>,
    /// What is read from tables, by position: in every flow, and in that at the ends.
    read: Vec<bool>,
    read_at_nodes: Vec<bool>,
    scratch: usize,
}

impl<'a> Plan<'a> {
    fn new(schedule: &'a Schedule, leaves: &'a Leaves, axis: Axis) -> Self {
        let tape = schedule.tape();
        let users = Users::new(tape);
        let always = flow::cheap(schedule, CHEAP);
        let is_output = |p: Position| tape.outputs().contains(&p);
        // Values on the axis alone are in tables where others, or the result, are made from them.
        let fixed = schedule.stage(line::FIXED).filter(|&p| {
            is_output(p) || users.of(p).iter().any(|user| tape.axes(*user) != tape.axes(p))
        });
        let is_fixed = |p: Position| tape.axes(p).len() == 1 && !tape.axes(p).contains(axis);
        let kind = |p: Position| {
            let calls = flow::is_call(tape.op(p)) && !is_fixed(p);
            if calls { Kind::Call } else { Kind::Loop(AxisSet::ALL) }
        };
        let begin = Flow::new(schedule, fixed.chain(schedule.stage(line::BATCH)), kind, &always);
        let along = schedule.stage(line::ALONG);
        let along = along.filter(|p| !matches!(tape.op(*p), Op::Coordinate(_)));
        let between = Flow::new(schedule, along.chain(schedule.stage(line::CORE)), kind, &always);
        let needed = at_nodes(schedule, leaves);
        let ends = tape.positions().filter(|p| needed[p.index()].is_some());
        let kind_at_nodes = |p: Position| match needed[p.index()] {
            Some(AtNodes::Read) => Kind::Loop(AxisSet::ALL),
            Some(AtNodes::Computed) | None => kind(p),
        };
        let ends = Flow::new(schedule, ends, kind_at_nodes, &always);
        let mut plan = Self {
            schedule,
            leaves,
            users,
            homes: vec![Home::Register; tape.len()],
            end_homes: Vec::new(),
            begin,
            ends,
            between,
            rivals: rivals(schedule),
            read: tape.positions().map(is_fixed).collect(),
            read_at_nodes: needed.iter().map(|how| *how == Some(AtNodes::Read)).collect(),
            scratch: 0,
        };
        plan.house();
        plan
    }

    /// Gives every value its home.
    fn house(&mut self) {
        let tape = self.schedule.tape();
        for p in tape.positions().filter(|p| tape.axes(*p).is_empty()) {
            if let Op::Constant(bits) = tape.op(p) {
                self.homes[p.index()] = Home::Constant(f64::from_bits(bits));
            } else if self.leaves.has(tape.node(p)) {
                self.homes[p.index()] = Home::Uniform(self.leaves.number(tape.node(p)) as usize);
            }
        }
        // What a batch makes lasts as long as the batch.
        let first = self.begin.items.len();
        let no_heirs = FxHashMap::default();
        let kept = |flow: &Flow, wanted: &[Position]| -> (Vec<_>, Vec<_>) {
            let kept = layout::kept(tape, &self.users, &[&self.begin, flow], wanted);
            kept.into_iter().partition(|k| k.item < first)
        };
        let (lasting, passing) = kept(&self.between, tape.outputs());
        let (_, passing_at_ends) = kept(&self.ends, &tape.outputs()[..2]);
        let mut end = layout::place(&lasting, &mut self.homes, 0, STRIDE, false, &no_heirs);
        self.end_homes.clone_from(&self.homes);
        for p in tape.positions() {
            if matches!(tape.op(p), Op::Coordinate(_)) && self.homes[p.index()] == Home::Register {
                self.homes[p.index()] = Home::Buffer(end);
                end += STRIDE;
            }
        }
        self.scratch = [(&passing, &mut self.homes), (&passing_at_ends, &mut self.end_homes)]
            .map(|(passing, homes)| layout::place(passing, homes, end, STRIDE, true, &no_heirs))
            .into_iter()
            .fold(end, usize::max);
    }

    fn access(homes: &[Home], scratch: Pointer, uniforms: Pointer, p: Position) -> Access {
        match homes[p.index()] {
            Home::Constant(value) => Access::Constant(value),
            Home::Uniform(number) => Access::Splat(uniforms, number),
            Home::Buffer(first) => Access::Lanes(scratch, first),
            Home::Register | Home::Table(..) | Home::Volume(_) => {
                unreachable!("values used by several loops are kept in buffers")
            }
        }
    }

    /// Emits a loop over the lanes.
    fn segment(&self, body: &mut Body<'_>, segment: &Segment, (homes, at_nodes): (&[Home], bool)) {
        let tape = self.schedule.tape();
        let own: FxHashSet<Position> = segment.ops.iter().copied().collect();
        let mut stored = segment.ops.clone();
        stored.retain(|p| {
            let is_used = self.users.of(*p).iter().any(|user| !own.contains(user));
            let is_kept = homes[p.index()].buffer().is_some();
            is_kept && (is_used || tape.outputs().contains(p))
        });
        let is_read = |p: Position| {
            own.contains(&p) && (self.read[p.index()] || at_nodes && self.read_at_nodes[p.index()])
        };
        let (reads, ops): (Vec<_>, Vec<_>) = segment.ops.iter().copied().partition(|p| is_read(*p));
        let tables = Axis::ALL.map(|axis| body.base(Base::Table(axis)));
        let places = body.base(Base::Places);
        self.rounds(body, |body, round, scratch, uniforms| {
            let places = body.advance(places, round, ROUND * size_of::<u16>());
            let picked: FxHashMap<Position, Access> = (reads.iter())
                .filter_map(|p| {
                    let axis = tape.axes(*p).iter().next()?;
                    let table = self.leaves.number(tape.node(*p)) as usize;
                    let lanes = body.places(places, axis.index() * PLANE);
                    Some((*p, Access::Picked(tables[axis.index()], lanes, table * tiles::STRIDE)))
                })
                .collect();
            let home = |p| Self::access(homes, scratch, uniforms, p);
            let access = |p| picked.get(&p).copied().unwrap_or_else(|| home(p));
            let mut lanes = Lanes::new(body, tape, &ops, None, &access);
            lanes.compute(body, 0, &access);
            for &p in &stored {
                let value = lanes.value(body, p, 0, &access);
                if let Access::Lanes(pointer, first) = home(p) {
                    body.store(value, pointer, first);
                }
            }
        });
    }

    /// Emits a loop that fills the buffer of `p`.
    fn fill(&self, body: &mut Body<'_>, p: Position, value: f64, homes: &[Home]) {
        let Some(first) = homes[p.index()].buffer() else { return };
        let lanes = super::ops::constant(&mut body.builder, value);
        self.rounds(body, |body, _, scratch, _| body.store(lanes, scratch, first));
    }

    fn rounds(
        &self,
        body: &mut Body<'_>,
        inside: impl FnOnce(&mut Body<'_>, Index, Pointer, Pointer),
    ) {
        let (scratch, uniforms) = (body.base(Base::Scratch), body.base(Base::Uniforms));
        body.steps(|body, round: Index| {
            let scratch = body.advance(scratch, round, ROUND * size_of::<f64>());
            inside(body, round, scratch, uniforms);
        });
    }
}

/// The generation of one of the flows.
struct Part<'a, 'b> {
    plan: &'b Plan<'a>,
    assembly: &'b mut Assembly,
    flow: &'b Flow,
    homes: &'b [Home],
    at_nodes: bool,
}

impl Emit for Part<'_, '_> {
    fn code(&mut self, items: Range<usize>, _: bool) -> Result<usize, CompileError> {
        let Self { plan, assembly, flow, homes, at_nodes } = self;
        let place = (&**homes, *at_nodes);
        assembly.define(ROUNDS, |body| {
            flow::walk(
                body,
                flow,
                items,
                &mut |body, segment| plan.segment(body, segment, place),
                &mut |body, p, value| plan.fill(body, p, value, homes),
            );
        })
    }

    fn call(&self, ops: &[Position]) -> Call {
        let home = |p: Position| self.homes[p.index()];
        let operand = |p: Position| match home(p) {
            Home::Constant(value) => {
                Operand { source: Source::Constant(value), spread: Spread::One }
            }
            Home::Uniform(number) => {
                Operand { source: Source::Uniform(number), spread: Spread::One }
            }
            Home::Buffer(first) => {
                Operand { source: Source::Scratch { first, plane: 0 }, spread: Spread::Lanes }
            }
            Home::Register | Home::Table(..) | Home::Volume(_) => {
                unreachable!("operands of calls are kept in buffers")
            }
        };
        let tape = self.plan.schedule.tape();
        let rival = ops.iter().find_map(|p| self.plan.rivals.get(p));
        let call = Call::new(tape, ops, PLANE, operand, |p| home(p).buffer().unwrap_or_default());
        call.against(rival.map(|rival| rival.at(operand, operand)))
    }

    fn fill(&self, (p, value): (Position, f64)) -> Option<Fill> {
        let first = self.homes[p.index()].buffer()?;
        Some(Fill { first, len: PLANE, value })
    }
}
