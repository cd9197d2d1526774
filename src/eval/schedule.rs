//! The order in which a program runs its operations.
//!
//! A program has *stages*: operations that are evaluated once for a whole grid, a brick, a plane,
//! a batch of edges. An operation's stage follows from the axes that it depends on. Inside a stage
//! the operations of a region stand together as far as their operands allow, so that a dead region
//! costs one test; otherwise they follow the depth-first order of the expression, which keeps few
//! values alive at a time.

use super::regions::{Bits, RegionId, Regions, TOP};
use super::tape::{Op, Position, Tape};
use crate::expr::AxisSet;
use crate::geom::Axis;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// A tape with its regions, ordered by stage.
#[derive(Clone, Debug)]
pub struct Schedule {
    tape: Tape,
    regions: Regions,
    starts: Vec<usize>,
}

/// Stages of every program: uniform values, once for a set of parameter values.
pub const UNIFORM: usize = 0;
/// Stages of brick and box programs: values on one axis, from tables made once for a grid.
pub const TABLE: usize = 1;

/// Stages of a brick program.
pub mod brick {
    /// Values on x and y: 16 x 16, once a brick.
    pub const FLAT: usize = 2;
    /// Values on x and z or on y and z: 16, once a plane of constant z.
    pub const EDGE: usize = 3;
    /// Values on x, y and z: 16 x 16 a plane.
    pub const PLANE: usize = 4;
}

/// Stages of the line program of an axis.
pub mod line {
    /// Values on one other axis: gathered from tables, once a batch.
    pub const FIXED: usize = 1;
    /// Values on the two other axes: once a batch.
    pub const BATCH: usize = 2;
    /// Values on the axis alone: from tables at nodes, computed elsewhere.
    pub const ALONG: usize = 3;
    /// Values on the axis and others.
    pub const CORE: usize = 4;
}

/// The stage of an interval program that is evaluated for every box.
pub const BOX: usize = 2;

impl Schedule {
    /// The schedule of a brick program; operations on two axes or more have regions.
    #[must_use]
    pub fn brick(tape: &Tape, bits: &Bits) -> Self {
        Self::new(tape, bits, 2, |axes| match axes.len() {
            0 => UNIFORM,
            1 => TABLE,
            2 if !axes.contains(Axis::Z) => brick::FLAT,
            2 => brick::EDGE,
            _ => brick::PLANE,
        })
    }

    /// The schedule of the line program of `axis`; operations on an axis or more have regions.
    #[must_use]
    pub fn line(tape: &Tape, bits: &Bits, axis: Axis) -> Self {
        Self::new(tape, bits, 1, |axes| match (axes.contains(axis), axes.len()) {
            (_, 0) => UNIFORM,
            (false, 1) => line::FIXED,
            (false, _) => line::BATCH,
            (true, 1) => line::ALONG,
            (true, _) => line::CORE,
        })
    }

    /// The schedule of an interval program; operations on an axis or more have regions.
    #[must_use]
    pub fn boxes(tape: &Tape, bits: &Bits) -> Self {
        Self::new(tape, bits, 1, |axes| axes.len().min(BOX))
    }

    /// The schedule of a program with a single stage and no regions.
    #[must_use]
    pub fn plain(tape: &Tape) -> Self {
        Self::new(tape, &Bits::default(), 1, |_| 0)
    }

    /// Orders `tape`, `stage` giving the stage of an operation by its axes.
    ///
    /// `stage` must not decrease when axes are added. Operations on fewer than `axes` axes belong
    /// to no region.
    fn new(tape: &Tape, bits: &Bits, axes: usize, stage: impl Fn(AxisSet) -> usize) -> Self {
        let regions = Regions::new(tape, bits, axes);
        let stages: Vec<usize> = tape.positions().map(|p| stage(tape.axes(p))).collect();
        let count = stages.iter().max().map_or(0, |last| last + 1);
        let ranks = depth_first(tape);
        let mut order = Vec::with_capacity(tape.len());
        let mut starts = vec![0];
        let mut members = vec![Vec::new(); count];
        for p in tape.positions() {
            members[stages[p.index()]].push(p);
        }
        let mut arrangement = Arrangement::new(tape, &regions, &stages);
        for members in members {
            arrangement.place(&members, &ranks, &mut order);
            starts.push(order.len());
        }
        Self { tape: tape.reordered(&order), regions: regions.reordered(&order), starts }
    }

    /// The operations in order of evaluation.
    #[must_use]
    pub fn tape(&self) -> &Tape {
        &self.tape
    }

    /// The regions of the operations.
    #[must_use]
    pub fn regions(&self) -> &Regions {
        &self.regions
    }

    /// The operations of `stage`.
    pub fn stage(&self, stage: usize) -> impl DoubleEndedIterator<Item = Position> + use<> {
        let at = |i: usize| self.starts.get(i).or(self.starts.last()).copied().unwrap_or(0);
        (at(stage)..at(stage + 1)).map(Position::new)
    }

    /// What to run of `operations` (ascending), with the jumps over dead regions.
    #[must_use]
    pub fn steps(&self, operations: impl IntoIterator<Item = Position>) -> Vec<Step> {
        let mut steps: Vec<Step> = Vec::new();
        let mut open: Vec<(RegionId, usize)> = Vec::new();
        let close = |steps: &mut Vec<Step>, entered: usize| {
            let end = steps.len();
            if let Step::Enter { end: target, .. } = &mut steps[entered] {
                *target = end;
            }
        };
        for position in operations {
            let region = self.regions.of(position);
            let mut closed = false;
            while let Some(&(last, entered)) = open.last() {
                if self.regions.common(last, region) == last {
                    break;
                }
                close(&mut steps, entered);
                open.pop();
                closed = true;
            }
            let around = open.last().map_or(TOP, |(last, _)| *last);
            let mut path = Vec::new();
            let mut inner = region;
            while inner != around {
                path.push(inner);
                inner = self.regions.parent(inner);
            }
            for &inner in path.iter().rev() {
                if let Some(bit) = self.regions.bit(inner) {
                    open.push((inner, steps.len()));
                    steps.push(Step::Enter { bit, end: 0 });
                }
            }
            let next = position.index() + 1;
            match steps.last_mut() {
                Some(Step::Run(run)) if run.end == position.index() && !closed => run.end = next,
                _ => steps.push(Step::Run(position.index()..next)),
            }
        }
        while let Some((_, entered)) = open.pop() {
            close(&mut steps, entered);
        }
        steps
    }
}

/// An element of the order of evaluation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Run the operations at these indices, all of one region.
    Run(Range<usize>),
    /// Go on at step `end` if activity bit `bit` is clear: what lies between is in its region.
    Enter {
        /// The bit of the region.
        bit: u32,
        /// The step after the region.
        end: usize,
    },
}

/// The rank of each operation in a depth-first walk from the outputs, operands first, and those of
/// them last that need an oracle, the more so the less there is besides: what else is known by then
/// may spare it.
fn depth_first(tape: &Tape) -> Vec<u32> {
    // The longest way from an oracle; `None`, which is less, where there is none.
    let mut from_oracle: Vec<Option<Reverse<u32>>> = vec![None; tape.len()];
    for p in tape.positions() {
        let longest = tape.op(p).operands().iter().filter_map(|o| from_oracle[o.index()]).min();
        from_oracle[p.index()] = match longest {
            _ if matches!(tape.op(p), Op::Oracle(..)) => Some(Reverse(0)),
            None => None,
            Some(Reverse(length)) => Some(Reverse(length + 1)),
        };
    }
    let mut ranks = vec![u32::MAX; tape.len()];
    let mut entered = vec![false; tape.len()];
    let mut next = 0;
    let mut stack: Vec<(Position, usize)> = tape.outputs().iter().rev().map(|&p| (p, 0)).collect();
    while let Some((p, operand)) = stack.pop() {
        if operand == 0 && std::mem::replace(&mut entered[p.index()], true) {
            continue;
        }
        let mut operands = tape.op(p).operands();
        operands.sort_by_key(|o| from_oracle[o.index()]);
        match operands.get(operand) {
            Some(&o) => {
                stack.push((p, operand + 1));
                stack.push((o, 0));
            }
            None => {
                ranks[p.index()] = next;
                next += 1;
            }
        }
    }
    ranks
}

/// The operations that are ready to be placed.
///
/// Those of the current region come first, the latest to become ready before others; when there
/// are none, the first of all in depth-first order, which oracles always wait for. Outputs of an
/// oracle at the same point follow each other, so that one call answers for them.
struct Arrangement<'a> {
    tape: &'a Tape,
    regions: &'a Regions,
    /// Uses of the operation at `p` by its own stage: `users[starts[p]..starts[p + 1]]`.
    users: Vec<Position>,
    starts: Vec<usize>,
    pending: Vec<u32>,
    ready: BinaryHeap<Reverse<(u32, Position)>>,
    /// By region, the operation that became ready last; by operation, the one before it.
    latest: Vec<Option<Position>>,
    before: Vec<Option<Position>>,
    siblings: FxHashMap<OracleCall, Vec<Position>>,
    done: Vec<bool>,
}

impl<'a> Arrangement<'a> {
    fn new(tape: &'a Tape, regions: &'a Regions, stages: &[usize]) -> Self {
        let mut starts = vec![0; tape.len() + 1];
        let mut pending = vec![0; tape.len()];
        let mut siblings: FxHashMap<OracleCall, Vec<Position>> = FxHashMap::default();
        let inner = |p: Position| {
            let stage = stages[p.index()];
            tape.op(p).operands().to_vec().into_iter().filter(move |o| stages[o.index()] == stage)
        };
        for p in tape.positions() {
            for o in inner(p) {
                starts[o.index() + 1] += 1;
                pending[p.index()] += 1;
            }
            if let Some(call) = call(tape, regions, p) {
                siblings.entry(call).or_default().push(p);
            }
        }
        for i in 0..tape.len() {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut users = vec![Position::new(0); starts[tape.len()]];
        for p in tape.positions() {
            for o in inner(p) {
                users[next[o.index()]] = p;
                next[o.index()] += 1;
            }
        }
        Self {
            tape,
            regions,
            users,
            starts,
            pending,
            ready: BinaryHeap::new(),
            latest: vec![None; regions.inner().len() + 1],
            before: vec![None; tape.len()],
            siblings,
            done: vec![false; tape.len()],
        }
    }

    /// Appends `members`, the operations of a stage, to `order`.
    fn place(&mut self, members: &[Position], ranks: &[u32], order: &mut Vec<Position>) {
        let mut first: Vec<Position> =
            members.iter().copied().filter(|p| self.pending[p.index()] == 0).collect();
        first.sort_unstable_by_key(|p| Reverse(ranks[p.index()]));
        for p in first {
            self.admit(p, ranks);
        }
        let mut region = TOP;
        while let Some(p) = self.take(region) {
            if self.done[p.index()] {
                continue;
            }
            region = self.regions.of(p);
            let call = call(self.tape, self.regions, p);
            let group = call.and_then(|call| self.siblings.remove(&call));
            for p in group.unwrap_or_else(|| vec![p]) {
                self.done[p.index()] = true;
                order.push(p);
                for i in self.starts[p.index()]..self.starts[p.index() + 1] {
                    let user = self.users[i];
                    self.pending[user.index()] -= 1;
                    if self.pending[user.index()] == 0 {
                        self.admit(user, ranks);
                    }
                }
            }
        }
    }

    fn admit(&mut self, p: Position, ranks: &[u32]) {
        self.ready.push(Reverse((ranks[p.index()], p)));
        if matches!(self.tape.op(p), Op::Oracle(..)) {
            return;
        }
        let latest = &mut self.latest[self.regions.of(p).index()];
        self.before[p.index()] = latest.replace(p);
    }

    fn take(&mut self, region: RegionId) -> Option<Position> {
        let latest = &mut self.latest[region.index()];
        match *latest {
            Some(p) => {
                *latest = self.before[p.index()];
                Some(p)
            }
            None => self.ready.pop().map(|Reverse((_, p))| p),
        }
    }
}

/// An oracle, the point it is asked at, and the region of the answers.
type OracleCall = (usize, [Position; 3], RegionId);

/// The oracle call that yields the operation, if it is one: same oracle, operands and region.
fn call(tape: &Tape, regions: &Regions, p: Position) -> Option<(usize, [Position; 3], RegionId)> {
    match tape.op(p) {
        Op::Oracle(oracle, _, at) => Some((oracle.index(), at, regions.of(p))),
        Op::Coordinate(_)
        | Op::Constant(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..) => None,
    }
}
