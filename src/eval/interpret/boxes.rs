//! Ranges over boxes, eight at a time, and the activity that they leave.
//!
//! The interval program runs the source expression: its enclosures are tighter than those of the
//! lowered form. Where lowering split a sine, the range is widened by the distance between the two
//! forms ([`Split::allowance`]).

use super::brick::select;
use super::buffers::allocate;
use super::chains::{Chains, Lead};
use super::octet::{LANES, Octets};
use super::octets::{Action, Code, Frame, Instruction, Slabs, Source, UniformRanges};
use crate::eval::leaves::Leaves;
use crate::eval::levels::{Levels, Pairs};
use crate::eval::lower::Lowered;
use crate::eval::regions::is_set;
use crate::eval::sampler::NodeBox;
use crate::eval::schedule::{BOX, Schedule, Step, TABLE};
use crate::eval::tape::Position;
use crate::expr::{Graph, NodeId};
use crate::geom::Axis;
use crate::num::Interval;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// A program that encloses an expression over boxes.
#[derive(Debug)]
pub struct BoxProgram {
    code: Code,
    steps: Vec<Step>,
    output: Source,
    buffers: usize,
    /// By bit: the bit of the region around it.
    around: Vec<Option<u32>>,
    /// The bits that have a bit around them.
    nested: Vec<u64>,
    words: usize,
    chains: Chains,
}

/// Memory of a thread that runs a [`BoxProgram`].
#[derive(Debug, Default)]
pub struct BoxWorkspace {
    buffers: Octets,
    leads: Vec<Lead>,
    any: Vec<u64>,
    runs: Vec<Range<usize>>,
}

/// Boxes of one call, each with its lane.
#[derive(Clone, Debug)]
pub struct Lanes<'a> {
    boxes: &'a [NodeBox],
    of: [u8; LANES],
    /// Whether the boxes are eighths of one box, each in the lane of its octant.
    eighths: bool,
}

impl<'a> Lanes<'a> {
    /// Places at most eight boxes of one level, at least one.
    #[must_use]
    pub fn new(boxes: &'a [NodeBox]) -> Self {
        let mut of = [0, 1, 2, 3, 4, 5, 6, 7];
        let parent = |b: &NodeBox| (b.level, b.index.map(|i| i / 2));
        let octant = |b: &NodeBox| {
            let [x, y, z] = b.index.map(|i| (i % 2) as u8);
            x | y << 1 | z << 2
        };
        let eighths = boxes.windows(2).all(|pair| {
            parent(&pair[0]) == parent(&pair[1]) && octant(&pair[0]) < octant(&pair[1])
        });
        if eighths {
            of.iter_mut().zip(boxes).for_each(|(lane, b)| *lane = octant(b));
        }
        Self { boxes, of, eighths }
    }

    /// The ranges of all tables over the halves of the boxes' parent, by axis, if they have one.
    #[must_use]
    pub fn halves<'l>(&self, levels: &'l Levels) -> Option<[Pairs<'l>; 3]> {
        let first = self.boxes.first().filter(|_| self.eighths)?;
        Some(Axis::ALL.map(|axis| levels.pairs(axis, first.level, first.index[axis.index()])))
    }

    /// Where each lane finds the ranges of tables.
    fn slabs<'l>(&self, levels: &'l Levels) -> Slabs<'l> {
        if let Some(halves) = self.halves(levels) {
            return Slabs::Eighths(halves);
        }
        Slabs::Apart(Box::new(Axis::ALL.map(|axis| {
            std::array::from_fn(|i| {
                let NodeBox { level, index } = self.boxes[i.min(self.boxes.len() - 1)];
                let index = index[axis.index()];
                (levels.pairs(axis, level, index), index as usize % 2)
            })
        })))
    }
}

impl BoxProgram {
    /// The program of `schedule`, that of boxes of the source expression that was `lowered`, with
    /// `words` words of activity a box.
    #[must_use]
    pub fn new(
        schedule: &Schedule,
        leaves: &Leaves,
        (graph, lowered): (&Graph, &Lowered),
        words: usize,
    ) -> Self {
        let tape = schedule.tape();
        let gathered = |p: Position| tape.axes(p).len() == 1 && leaves.has(tape.node(p));
        let positions: FxHashMap<NodeId, Position> =
            tape.positions().map(|p| (tape.node(p), p)).collect();
        let mut keep = tape.output_flags();
        for split in tape.positions().filter_map(|p| lowered.split(tape.node(p))) {
            for term in &split.terms {
                keep[positions[&term.leaf].index()] = true;
            }
        }
        let needed = |p: Position| tape.axes(p).len() >= 2 || gathered(p);
        let allocation = allocate(tape, |p| needed(p).then_some(0), |p| keep[p.index()]);
        let sources: Vec<Source> = (tape.positions())
            .map(|p| match allocation.of[p.index()] {
                Some(buffer) => Source::Buffer(buffer),
                None if leaves.has(tape.node(p)) => Source::Uniform(leaves.number(tape.node(p))),
                None => Source::Uniform(0),
            })
            .collect();
        let mut code = Code::new(graph);
        for p in tape.positions() {
            if gathered(p) {
                let axis = tape.axes(p).iter().next().unwrap_or(Axis::X);
                let action = Action::Gather(axis, leaves.number(tape.node(p)));
                code.push(action, &[], sources[p.index()]);
            } else if let Some(split) = lowered.split(tape.node(p)) {
                let at = |id: &NodeId| sources[positions[id].index()];
                code.push_wave(tape, p, &sources, split, at);
            } else {
                code.push_op(schedule, p, &sources);
            }
        }
        let mut around: Vec<Option<u32>> = vec![None; 64 * words];
        let mut nested = vec![0; words];
        let regions = schedule.regions();
        for region in regions.inner() {
            if let Some(bit) = regions.bit(region) {
                around[bit as usize] = regions.bit(regions.parent(region));
                let inner = u64::from(around[bit as usize].is_some());
                nested[bit as usize / 64] |= inner << (bit % 64);
            }
        }
        let chains = Chains::new(schedule, lowered);
        for (instruction, p) in code.instructions.iter_mut().zip(tape.positions()) {
            instruction.link = chains.link(p);
        }
        let run = schedule.stage(TABLE).filter(|&p| gathered(p)).chain(schedule.stage(BOX));
        Self {
            steps: schedule.steps(run),
            output: sources[tape.outputs()[0].index()],
            buffers: allocation.counts.first().copied().unwrap_or(0) as usize,
            code,
            around,
            nested,
            words,
            chains,
        }
    }

    /// Fresh memory for one thread.
    #[must_use]
    pub fn workspace(&self) -> BoxWorkspace {
        BoxWorkspace {
            buffers: Octets::new(self.buffers),
            leads: self.chains.leads(),
            ..BoxWorkspace::default()
        }
    }

    /// Encloses the expression over the boxes in `lanes`.
    ///
    /// `shortcut` may do the work of the [instructions](Self::instructions) from the given one on,
    /// with the same results, and then names the one after.
    pub(in crate::eval) fn ranges(
        &self,
        workspace: &mut BoxWorkspace,
        (uniforms, levels): (&UniformRanges, &Levels),
        lanes: &Lanes<'_>,
        activity: &mut [u64],
        ranges: &mut [Interval],
        shortcut: impl FnMut(usize, &mut Octets) -> Option<usize>,
    ) {
        let words = self.words;
        let BoxWorkspace { buffers, leads, any, runs } = workspace;
        any.clear();
        any.resize(words, 0);
        for own in activity.chunks_exact(words.max(1)) {
            any.iter_mut().zip(own).for_each(|(any, own)| *any |= own);
        }
        select(&self.steps, any, runs);
        let lane_of = &lanes.of[..lanes.boxes.len()];
        let slabs = lanes.slabs(levels);
        let frame = Frame { uniforms, slabs, words, lanes: lane_of };
        self.code.run(runs, &frame, activity, buffers, leads, shortcut);
        for run in runs.iter().rev() {
            for instruction in self.code.instructions[run.clone()].iter().rev() {
                if let Some(link) = instruction.link {
                    self.chains.prune(link, leads, activity, words, lane_of);
                }
            }
        }
        for own in activity.chunks_exact_mut(words.max(1)) {
            self.inherit(own);
        }
        let output = frame.read(self.output, buffers);
        for (range, &lane) in ranges.iter_mut().zip(lane_of) {
            *range = output.lane(usize::from(lane));
        }
    }

    /// Clears the bits of the regions that do not matter within `limit` of zero in box `number` of
    /// those that `workspace` was last asked for, `lanes`, whose activity this is: see [`Chains`].
    pub(in crate::eval) fn focus(
        &self,
        workspace: &BoxWorkspace,
        (lanes, number): (&Lanes<'_>, usize),
        activity: &mut [u64],
        limit: f64,
    ) {
        let lane = usize::from(lanes.of[number]);
        for run in workspace.runs.iter().rev() {
            for instruction in self.code.instructions[run.clone()].iter().rev() {
                if let Some(link) = instruction.link {
                    self.chains.focus(link, &workspace.leads, activity, lane, limit);
                }
            }
        }
        self.inherit(activity);
    }

    /// The instructions; those in [`runs`](Self::runs) are run, in their order.
    pub(in crate::eval) fn instructions(&self) -> &[Instruction] {
        &self.code.instructions
    }

    /// The instructions that are run together or not at all.
    pub(in crate::eval) fn runs(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.steps.iter().filter_map(|step| match step {
            Step::Run(run) => Some(run.clone()),
            Step::Enter { .. } => None,
        })
    }

    /// What instruction `number` reads.
    pub(in crate::eval) fn reads(&self, number: usize) -> impl Iterator<Item = Source> + '_ {
        let operands = self.code.instructions[number].operands;
        operands.into_iter().chain(self.code.parts(number))
    }

    /// Where the range of the expression is.
    pub(in crate::eval) fn output(&self) -> Source {
        self.output
    }

    /// Clears the bits of regions inside dead ones; a region's bit follows that around it.
    fn inherit(&self, activity: &mut [u64]) {
        for word in 0..activity.len() {
            let mut left = activity[word] & self.nested[word];
            while left != 0 {
                let bit = 64 * word + left.trailing_zeros() as usize;
                left &= left - 1;
                if self.around[bit].is_some_and(|around| !is_set(activity, around)) {
                    activity[word] &= !(1 << (bit % 64));
                }
            }
        }
    }
}
