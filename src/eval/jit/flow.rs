//! The order of a stage, cut into what is compiled and what is called.

use super::body::{Body, Branch};
use super::ops;
use crate::eval::regions::RegionId;
use crate::eval::schedule::{Schedule, Step};
use crate::eval::tape::{Op, Position, Tape};
use crate::expr::{AxisSet, Binary, Unary};
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::Range;

/// An element of a [`Flow`].
#[derive(Clone, Debug)]
pub(super) enum Item {
    /// Arithmetic of one rate and region.
    Segment(Segment),
    /// Operations that one call of precompiled code answers.
    Call(Vec<Position>),
    /// Go on at item `end` if activity bit `bit` is clear, the values in `losers` standing in for
    /// what is skipped.
    Enter {
        /// The bit.
        bit: u32,
        /// The item after the region.
        end: usize,
        /// Operands of extrema, with the value that never wins.
        losers: Vec<(Position, f64)>,
    },
}

impl Item {
    /// The operations of the item itself.
    pub(super) fn ops(&self) -> &[Position] {
        match self {
            Self::Segment(segment) => &segment.ops,
            Self::Call(ops) => ops,
            Self::Enter { .. } => &[],
        }
    }
}

/// Arithmetic of one rate: a loop.
#[derive(Clone, Debug, Default)]
pub(super) struct Segment {
    /// The axes that every value of the segment depends on.
    pub(super) rate: AxisSet,
    /// The operations in order.
    pub(super) ops: Vec<Position>,
}

/// How an operation is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// In a loop, together with others of the same rate.
    Loop(AxisSet),
    /// By a call.
    Call,
}

/// The operations of a stage in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Flow {
    pub(super) items: Vec<Item>,
    /// Calls before each item, and in all.
    calls: Vec<usize>,
    /// Operations before each item, and in all.
    ops: Vec<usize>,
}

/// Whether the operation is computed by precompiled code.
pub(super) fn is_call(op: Op) -> bool {
    match op {
        Op::Unary(op, _) => !ops::is_arithmetic(op),
        Op::Binary(op, _, _) => !ops::is_arithmetic_binary(op),
        Op::Oracle(..) => true,
        Op::Coordinate(_) | Op::Constant(_) | Op::Parameter(_) | Op::Pick(..) => false,
    }
}

/// Whether one call answers for both.
fn is_joint(tape: &Tape, a: Position, b: Position) -> bool {
    match (tape.op(a), tape.op(b)) {
        (Op::Oracle(a, _, a_at), Op::Oracle(b, _, b_at)) => a == b && a_at == b_at,
        _ => false,
    }
}

impl Flow {
    /// The flow of `operations` (ascending), `kind` telling how each is computed; the regions with
    /// bits in `always` are run even if they are dead.
    pub(super) fn new(
        schedule: &Schedule,
        operations: impl IntoIterator<Item = Position>,
        kind: impl Fn(Position) -> Kind,
        always: &FxHashSet<u32>,
    ) -> Self {
        let (tape, regions) = (schedule.tape(), schedule.regions());
        let losers = losers(schedule);
        let operations: Vec<Position> = operations.into_iter().collect();
        let partners = partners(schedule, &operations);
        let steps = schedule.steps(operations);
        let mut items: Vec<Item> = Vec::new();
        let mut floor = 0;
        // Regions still open, by item and last step.
        let mut open: Vec<(usize, usize)> = Vec::new();
        // What is run whatever regions are dead, up to the next region that may be skipped.
        let mut run: Vec<Position> = Vec::new();
        let flush = |run: &mut Vec<Position>,
                     items: &mut Vec<Item>,
                     open: &[(usize, usize)],
                     floor: usize| {
            // Lesser rates never depend on greater ones.
            run.sort_by_key(|p| tape.axes(*p).len().max(2));
            for p in run.drain(..) {
                let both_called = |q: &&Position| [p, **q].map(&kind) == [Kind::Call; 2];
                let partner = partners.get(&p).filter(both_called).copied();
                // A partner has been appended together with the first of the two.
                if partner.is_some_and(|q| q < p) {
                    continue;
                }
                append(items, floor, tape, p, kind(p));
                if let (Some(q), Some(Item::Call(ops))) = (partner, items.last_mut()) {
                    ops.push(q);
                }
                for p in [Some(p), partner].into_iter().flatten() {
                    let Some((region, loser)) = losers.get(&p) else { continue };
                    let bit = regions.bit(*region);
                    let holder = open.iter().rev().map(|(item, _)| *item).find(|item| {
                        matches!(&items[*item], Item::Enter { bit: b, .. } if Some(*b) == bit)
                    });
                    if let Some(Item::Enter { losers, .. }) = holder.map(|item| &mut items[item]) {
                        losers.push((p, *loser));
                    }
                }
            }
        };
        for (at, step) in steps.iter().enumerate() {
            if open.last().is_some_and(|(_, last)| *last <= at) {
                flush(&mut run, &mut items, &open, floor);
                close(&mut items, &mut open, at);
                // What follows a region is not appended to the region's last item.
                floor = items.len();
            }
            match step {
                Step::Enter { bit, .. } if always.contains(bit) => {}
                Step::Enter { bit, end } => {
                    flush(&mut run, &mut items, &open, floor);
                    open.push((items.len(), *end));
                    items.push(Item::Enter { bit: *bit, end: 0, losers: Vec::new() });
                }
                Step::Run(range) => run.extend(range.clone().map(Position::new)),
            }
        }
        flush(&mut run, &mut items, &open, floor);
        close(&mut items, &mut open, steps.len());
        let (mut calls, mut ops) = (vec![0], vec![0]);
        for (i, item) in items.iter().enumerate() {
            calls.push(calls[i] + usize::from(matches!(item, Item::Call(_))));
            ops.push(ops[i] + item.ops().len());
        }
        Self { items, calls, ops }
    }

    /// Whether the items at `range` contain a call.
    pub(super) fn has_calls(&self, range: Range<usize>) -> bool {
        self.calls[range.start] != self.calls[range.end]
    }

    /// Number of operations in the items at `range`.
    pub(super) fn ops(&self, range: Range<usize>) -> usize {
        self.ops[range.end] - self.ops[range.start]
    }

    /// The item after `item`, with all that belongs to it.
    pub(super) fn after(&self, item: usize) -> usize {
        match &self.items[item] {
            Item::Enter { end, .. } => *end,
            Item::Segment(_) | Item::Call(_) => item + 1,
        }
    }
}

/// Ends the regions whose last step is before `at`.
fn close(items: &mut [Item], open: &mut Vec<(usize, usize)>, at: usize) {
    let len = items.len();
    while let Some((item, _)) = open.pop_if(|(_, last)| *last <= at) {
        if let Item::Enter { end, .. } = &mut items[item] {
            *end = len;
        }
    }
}

/// A loop of more operations than this is divided, though what passes from one part to the next
/// then passes through memory: the time to compile one grows faster than its length.
const LONGEST: usize = 50;

/// Appends an operation, to the last item if that is not before `floor` and can hold it.
fn append(items: &mut Vec<Item>, floor: usize, tape: &Tape, p: Position, kind: Kind) {
    match (items[floor..].last_mut(), kind) {
        (Some(Item::Segment(segment)), Kind::Loop(rate))
            if segment.rate == rate && segment.ops.len() < LONGEST =>
        {
            segment.ops.push(p);
        }
        (Some(Item::Call(ops)), Kind::Call) if is_joint(tape, ops[0], p) => ops.push(p),
        (_, Kind::Loop(rate)) => items.push(Item::Segment(Segment { rate, ops: vec![p] })),
        (_, Kind::Call) => items.push(Item::Call(vec![p])),
    }
}

/// A region that is being emitted.
struct Open<'a> {
    end: usize,
    branch: Branch,
    losers: &'a [(Position, f64)],
}

/// Emits the items at `items`: `segment` their loops, `fill` what stands in for dead values.
pub(super) fn walk(
    body: &mut Body<'_>,
    flow: &Flow,
    items: Range<usize>,
    segment: &mut dyn FnMut(&mut Body<'_>, &Segment),
    fill: &mut dyn FnMut(&mut Body<'_>, Position, f64),
) {
    let mut open: Vec<Open<'_>> = Vec::new();
    for at in items.start..=items.end {
        while let Some(Open { branch, losers, .. }) = open.pop_if(|open| open.end == at) {
            body.if_dead(&branch);
            for &(p, value) in losers {
                fill(body, p, value);
            }
            body.end_if(branch);
        }
        if at == items.end {
            break;
        }
        match &flow.items[at] {
            Item::Segment(content) => segment(body, content),
            Item::Enter { bit, end, losers } => {
                open.push(Open { end: *end, branch: body.if_live(*bit), losers });
            }
            Item::Call(_) => {}
        }
    }
}

/// The bits of the regions whose operations, all together, cost at most `limit` additions.
///
/// To run such a region costs less than to ask whether it is dead; the values of a dead side lose
/// against those of the other whether they are computed or stood in for.
pub(super) fn cheap(schedule: &Schedule, limit: usize) -> FxHashSet<u32> {
    let (tape, regions) = (schedule.tape(), schedule.regions());
    let mut costs: FxHashMap<RegionId, usize> = FxHashMap::default();
    for p in tape.positions() {
        let op = tape.op(p);
        let cost = match op {
            _ if is_call(op) => limit + 1,
            Op::Unary(Unary::Sqrt, _) | Op::Binary(Binary::Div | Binary::Mod, ..) => 5,
            Op::Coordinate(_)
            | Op::Constant(_)
            | Op::Parameter(_)
            | Op::Unary(..)
            | Op::Binary(..)
            | Op::Pick(..)
            | Op::Oracle(..) => 1,
        };
        *costs.entry(regions.of(p)).or_default() += cost;
    }
    let mut cheap = FxHashSet::default();
    for region in regions.inner().rev() {
        let cost = costs.get(&region).copied().unwrap_or(0);
        *costs.entry(regions.parent(region)).or_default() += cost;
        cheap.extend(regions.bit(region).filter(|_| cost <= limit));
    }
    cheap
}

/// Sines and cosines of one value in one region, each with the other.
fn partners(schedule: &Schedule, operations: &[Position]) -> FxHashMap<Position, Position> {
    let (tape, regions) = (schedule.tape(), schedule.regions());
    let mut waves: FxHashMap<(Position, RegionId), Position> = FxHashMap::default();
    let mut partners = FxHashMap::default();
    for &p in operations {
        if let Op::Unary(Unary::Sin | Unary::Cos, a) = tape.op(p)
            && let Some(q) = waves.insert((a, regions.of(p)), p)
        {
            partners.insert(p, q);
            partners.insert(q, p);
        }
    }
    partners
}

/// Operands of extrema that belong to the very region of their side, with that region and the
/// value that never wins there.
pub(super) fn losers(schedule: &Schedule) -> FxHashMap<Position, (RegionId, f64)> {
    let (tape, regions) = (schedule.tape(), schedule.regions());
    let mut losers = FxHashMap::default();
    for p in tape.positions() {
        let Some((extremum, a, b)) = tape.op(p).choice() else { continue };
        let Some(sides) = regions.sides(p) else { continue };
        for (side, operand) in sides.into_iter().zip([a, b]) {
            if let Some(region) = side
                && regions.of(operand) == region
            {
                losers.insert(operand, (region, extremum.loser()));
            }
        }
    }
    losers
}
