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
        for stage in 0..count {
            arrange(tape, &regions, &ranks, |p| stages[p.index()] == stage, &mut order);
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

/// The rank of each operation in a depth-first walk from the outputs, operands first.
fn depth_first(tape: &Tape) -> Vec<u32> {
    let mut ranks = vec![u32::MAX; tape.len()];
    let mut entered = vec![false; tape.len()];
    let mut next = 0;
    let mut stack: Vec<(Position, usize)> = tape.outputs().iter().rev().map(|&p| (p, 0)).collect();
    while let Some((p, operand)) = stack.pop() {
        if operand == 0 && std::mem::replace(&mut entered[p.index()], true) {
            continue;
        }
        match tape.op(p).operands().get(operand) {
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

/// Appends the operations that `belongs` selects: those of the current region while some are
/// ready, else the first ready one in depth-first order. Outputs of an oracle at the same point
/// follow each other, so that one call answers for them.
fn arrange(
    tape: &Tape,
    regions: &Regions,
    ranks: &[u32],
    belongs: impl Fn(Position) -> bool,
    order: &mut Vec<Position>,
) {
    let members: Vec<Position> = tape.positions().filter(|&p| belongs(p)).collect();
    let mut pending = vec![0u32; tape.len()];
    let mut users: FxHashMap<Position, Vec<Position>> = FxHashMap::default();
    let mut siblings: FxHashMap<_, Vec<Position>> = FxHashMap::default();
    for &p in &members {
        for &o in tape.op(p).operands().iter().filter(|&&o| belongs(o)) {
            pending[p.index()] += 1;
            users.entry(o).or_default().push(p);
        }
        if let Some(call) = call(tape, regions, p) {
            siblings.entry(call).or_default().push(p);
        }
    }
    let mut ready = BinaryHeap::new();
    let mut local: FxHashMap<RegionId, BinaryHeap<_>> = FxHashMap::default();
    let mut done = vec![false; tape.len()];
    let admit = |p: Position, ready: &mut BinaryHeap<_>, local: &mut FxHashMap<_, _>| {
        let entry = Reverse((ranks[p.index()], p));
        ready.push(entry);
        let heap: &mut BinaryHeap<_> = local.entry(regions.of(p)).or_default();
        heap.push(entry);
    };
    for &p in members.iter().filter(|p| pending[p.index()] == 0) {
        admit(p, &mut ready, &mut local);
    }
    let mut region = TOP;
    loop {
        let here = local.get_mut(&region).and_then(BinaryHeap::pop);
        let Some(Reverse((_, p))) = here.or_else(|| ready.pop()) else { break };
        if done[p.index()] {
            continue;
        }
        region = regions.of(p);
        let group = call(tape, regions, p).and_then(|call| siblings.remove(&call));
        for p in group.unwrap_or_else(|| vec![p]) {
            done[p.index()] = true;
            order.push(p);
            for &user in users.get(&p).into_iter().flatten() {
                pending[user.index()] -= 1;
                if pending[user.index()] == 0 {
                    admit(user, &mut ready, &mut local);
                }
            }
        }
    }
}

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
