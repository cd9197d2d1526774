//! Ranges over boxes, eight at a time, and the activity that they leave.
//!
//! The interval program runs the source expression: its enclosures are tighter than those of the
//! lowered form. Where lowering split a sine, the range is widened by the distance between the two
//! forms ([`Split::allowance`]).

use super::brick::select;
use super::buffers::allocate;
use super::chains::{Chains, Lead};
use super::octet::{self, LANES, Octet};
use super::points;
use crate::eval::enclosure::dead_sides;
use crate::eval::leaves::Leaves;
use crate::eval::levels::Levels;
use crate::eval::lower::{Factor, Lowered, Split};
use crate::eval::regions::is_set;
use crate::eval::sampler::NodeBox;
use crate::eval::schedule::{BOX, Schedule, Step, TABLE};
use crate::eval::tape::{Op, Position, Tape};
use crate::expr::{Binary, Extremum, Failure, Graph, NodeId, Oracle, Output, Unary};
use crate::geom::Axis;
use crate::num::{Interval, lanes};
use rustc_hash::FxHashMap;
use std::ops::Range;
use std::sync::Arc;

/// Where an operand is read from.
#[derive(Clone, Copy, Debug)]
enum Source {
    Uniform(u32),
    Buffer(u32),
}

/// What an instruction does.
#[derive(Clone, Copy, Debug)]
enum Action {
    Read,
    Gather(Axis, u32),
    Unary(Unary),
    Square,
    Binary(Binary),
    Choose(Extremum, [Option<u32>; 2]),
    Pick(Extremum, [Option<u32>; 2]),
    /// A split sine or cosine, with the number of its split.
    Wave(Unary, u32),
    /// The value of an oracle, with the number of the oracle and the bit of its region.
    Oracle(u32, Option<u32>),
    Anything,
}

#[derive(Clone, Copy, Debug)]
struct Instruction {
    action: Action,
    operands: [Source; 4],
    out: u32,
    /// The number of the extremum among those in chains.
    link: Option<u32>,
}

/// A split sum, its terms as sources.
#[derive(Clone, Debug)]
struct Wave {
    split: Split,
    terms: Vec<(Source, Vec<(Source, bool)>)>,
}

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

/// What is run, whatever the boxes.
#[derive(Debug)]
struct Code {
    instructions: Vec<Instruction>,
    waves: Vec<Wave>,
    oracles: Vec<Arc<dyn Oracle>>,
}

/// Memory of a thread that runs a [`BoxProgram`].
#[derive(Debug, Default)]
pub struct BoxWorkspace {
    buffers: Vec<Octet>,
    leads: Vec<Lead>,
    any: Vec<u64>,
    runs: Vec<Range<usize>>,
}

/// The uniform values of an interval program.
#[derive(Clone, Debug, Default)]
pub struct UniformRanges(Vec<Octet>);

impl UniformRanges {
    /// The values as enclosures.
    #[must_use]
    pub fn new(values: &[f64]) -> Self {
        Self(values.iter().map(|&value| Octet::splat(Interval::point(value))).collect())
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
            buffers: vec![Octet::ZERO; self.buffers],
            leads: self.chains.leads(),
            ..BoxWorkspace::default()
        }
    }

    /// Encloses the expression over at most eight boxes.
    pub fn ranges(
        &self,
        workspace: &mut BoxWorkspace,
        (uniforms, levels): (&UniformRanges, &Levels),
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) {
        let words = self.words;
        let BoxWorkspace { buffers, leads, any, runs } = workspace;
        any.clear();
        any.resize(words, 0);
        for own in activity.chunks_exact(words.max(1)) {
            any.iter_mut().zip(own).for_each(|(any, own)| *any |= own);
        }
        select(&self.steps, any, runs);
        let mut rows: [[&[Interval]; LANES]; 3] = [[&[]; LANES]; 3];
        for (axis, rows) in Axis::ALL.into_iter().zip(&mut rows) {
            for (i, row) in rows.iter_mut().enumerate() {
                let own = boxes[i.min(boxes.len() - 1)];
                *row = levels.row(axis, own.level, own.index[axis.index()]);
            }
        }
        let frame = Frame { uniforms, rows, words, boxes: boxes.len() };
        self.code.run(runs, &frame, activity, buffers, leads);
        for run in runs.iter().rev() {
            for instruction in self.code.instructions[run.clone()].iter().rev() {
                if let Some(link) = instruction.link {
                    self.chains.prune(link, leads, activity, words, boxes.len());
                }
            }
        }
        for own in activity.chunks_exact_mut(words.max(1)) {
            self.inherit(own);
        }
        let output = frame.read(self.output, buffers);
        for (i, range) in ranges.iter_mut().enumerate() {
            *range = output.lane(i);
        }
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

/// What instructions read besides buffers.
struct Frame<'a> {
    uniforms: &'a UniformRanges,
    /// By axis and box: the enclosures of all tables over the box's side.
    rows: [[&'a [Interval]; LANES]; 3],
    words: usize,
    boxes: usize,
}

impl Frame<'_> {
    #[inline(always)]
    fn read<'v>(&'v self, source: Source, buffers: &'v [Octet]) -> &'v Octet {
        match source {
            Source::Uniform(number) => &self.uniforms.0[number as usize],
            Source::Buffer(buffer) => &buffers[buffer as usize],
        }
    }
}

impl Code {
    fn new(graph: &Graph) -> Self {
        let oracles = graph.oracles().to_vec();
        Self { instructions: Vec::new(), waves: Vec::new(), oracles }
    }

    fn push(&mut self, action: Action, operands: &[Source], out: Source) {
        let mut list = [Source::Uniform(0); 4];
        list[..operands.len()].copy_from_slice(operands);
        let (action, out) = match out {
            Source::Buffer(out) => (action, out),
            Source::Uniform(_) => (Action::Read, 0),
        };
        self.instructions.push(Instruction { action, operands: list, out, link: None });
    }

    fn push_wave(
        &mut self,
        tape: &Tape,
        p: Position,
        sources: &[Source],
        split: &Split,
        at: impl Fn(&NodeId) -> Source,
    ) {
        let Op::Unary(op, a) = tape.op(p) else { return };
        let action = Action::Wave(op, self.waves.len() as u32);
        self.push(action, &[sources[a.index()]], sources[p.index()]);
        let factor = |factor: &Factor| match factor {
            Factor::Times(id) => (at(id), false),
            Factor::Over(id) => (at(id), true),
        };
        let terms = split.terms.iter();
        let terms = terms.map(|t| (at(&t.leaf), t.factors.iter().map(factor).collect())).collect();
        self.waves.push(Wave { split: split.clone(), terms });
    }

    fn push_op(&mut self, schedule: &Schedule, p: Position, sources: &[Source]) {
        let (tape, regions) = (schedule.tape(), schedule.regions());
        let bits = || {
            let sides = regions.sides(p).unwrap_or_default();
            sides.map(|side| side.and_then(|region| regions.bit(region)))
        };
        let action = match tape.op(p) {
            Op::Coordinate(_) | Op::Constant(_) | Op::Parameter(_) => Action::Read,
            Op::Unary(op, _) => Action::Unary(op),
            Op::Binary(Binary::Mul, a, b) if a == b => Action::Square,
            Op::Binary(op, _, _) => match op.extremum() {
                Some(extremum) => Action::Choose(extremum, bits()),
                None => Action::Binary(op),
            },
            Op::Pick(extremum, _) => Action::Pick(extremum, bits()),
            Op::Oracle(oracle, Output::Value, _) => {
                Action::Oracle(oracle.index() as u32, regions.bit(regions.of(p)))
            }
            Op::Oracle(_, Output::Partial(_), _) => Action::Anything,
        };
        let operands: Vec<Source> =
            tape.op(p).operands().iter().map(|o| sources[o.index()]).collect();
        self.push(action, &operands, sources[p.index()]);
    }

    fn run(
        &self,
        runs: &[Range<usize>],
        frame: &Frame<'_>,
        activity: &mut [u64],
        buffers: &mut [Octet],
        leads: &mut [Lead],
    ) {
        lanes::dispatch(
            #[inline(always)]
            || {
                for instruction in runs.iter().flat_map(|run| &self.instructions[run.clone()]) {
                    self.step(instruction, frame, activity, buffers, leads);
                }
            },
        );
    }

    #[inline(always)]
    fn step(
        &self,
        instruction: &Instruction,
        frame: &Frame<'_>,
        activity: &mut [u64],
        buffers: &mut [Octet],
        leads: &mut [Lead],
    ) {
        let Instruction { action, operands, out, link } = *instruction;
        let read = |i: usize| frame.read(operands[i], buffers);
        let value = match action {
            Action::Read => return,
            Action::Gather(axis, table) => {
                let rows = &frame.rows[axis.index()];
                Octet::from_lanes(|i| rows[i][table as usize])
            }
            Action::Unary(op) => octet::unary(op, read(0)),
            Action::Square => octet::square(read(0)),
            Action::Binary(op) => octet::binary(op, read(0), read(1)),
            Action::Choose(extremum, bits) => {
                let (mut first, mut second);
                let (mut a, mut b) = (read(0), read(1));
                if bits != [None, None] {
                    (first, second) = (*a, *b);
                    choose(extremum, bits, frame, activity, &mut first, &mut second);
                    (a, b) = (&first, &second);
                }
                let value = octet::binary(extremum.operator(), a, b);
                if let Some(link) = link {
                    leads[link as usize] = Lead::new(extremum, a, b, &value);
                }
                value
            }
            Action::Pick(extremum, bits) => {
                let (mut a, mut b) = (*read(0), *read(1));
                choose(extremum, bits, frame, activity, &mut a, &mut b);
                octet::pick(extremum, [&a, &b, read(2), read(3)])
            }
            Action::Wave(op, number) => {
                let wave = &self.waves[number as usize];
                wave.widened(&octet::unary(op, read(0)), frame, buffers)
            }
            Action::Oracle(oracle, bit) => {
                let at = [0, 1, 2].map(read);
                let oracle = &self.oracles[oracle as usize];
                Octet::from_lanes(|i| {
                    let own = activity.get(i * frame.words..).filter(|_| i < frame.boxes);
                    let live = own.is_some_and(|own| bit.is_none_or(|bit| is_set(own, bit)));
                    if live { oracle.range(at.map(|u| u.lane(i))) } else { Interval::ANYTHING }
                })
            }
            Action::Anything => Octet::splat(Interval::ANYTHING),
        };
        buffers[out as usize] = value;
    }
}

/// Puts the loser in place of what dead sides left, then clears the bits of sides that die here.
#[inline(never)]
fn choose(
    extremum: Extremum,
    bits: [Option<u32>; 2],
    frame: &Frame<'_>,
    activity: &mut [u64],
    a: &mut Octet,
    b: &mut Octet,
) {
    let loser = Interval::point(extremum.loser());
    for i in 0..frame.boxes {
        let own = &mut activity[i * frame.words..][..frame.words];
        for (bit, operand) in bits.into_iter().zip([&mut *a, &mut *b]) {
            if bit.is_some_and(|bit| !is_set(own, bit)) {
                operand.set_lane(i, loser);
            }
        }
        let dead = dead_sides(extremum, a.lane(i), b.lane(i));
        for (bit, dead) in bits.into_iter().zip(dead) {
            if let Some(bit) = bit.filter(|_| dead) {
                own[bit as usize / 64] &= !(1 << (bit % 64));
            }
        }
    }
}

/// Terms up to this magnitude are finite whatever is multiplied out.
const LARGEST_SUM: f64 = 1e300;

impl Wave {
    /// The range of the split form, given that of the source form.
    #[inline(never)]
    fn widened(&self, source: &Octet, frame: &Frame<'_>, buffers: &[Octet]) -> Octet {
        let mut sums = [0.0; LANES];
        for (leaf, factors) in &self.terms {
            let mut magnitudes = frame.read(*leaf, buffers).magnitude();
            for (factor, over) in factors.iter().rev() {
                let factor = frame.read(*factor, buffers).lane(0).hi.abs();
                for magnitude in &mut magnitudes {
                    *magnitude = if *over { *magnitude / factor } else { *magnitude * factor };
                }
            }
            for (sum, magnitude) in sums.iter_mut().zip(magnitudes) {
                *sum += magnitude;
            }
        }
        Octet::from_lanes(|i| {
            if sums[i].is_nan() || sums[i] > LARGEST_SUM {
                return Interval::ANYTHING;
            }
            let (allowance, range) = (self.split.allowance(sums[i]), source.lane(i));
            Interval {
                lo: (range.lo - allowance).max(-Split::LARGEST),
                hi: (range.hi + allowance).min(Split::LARGEST),
                nan: range.nan,
            }
        })
    }
}

/// Encloses `outputs`, none of them split, over boxes with the sides `at`, `out` having the ranges
/// of each output one after the other.
///
/// # Errors
/// [`Failure`] of an oracle on no axis.
pub fn enclose(
    graph: &Graph,
    outputs: &[NodeId],
    at: [&[Interval]; 3],
    parameters: &[f64],
    out: &mut [Interval],
) -> Result<(), Failure> {
    let schedule = Schedule::plain(&Tape::new(graph, outputs));
    let tape = schedule.tape();
    let keep = tape.output_flags();
    let varies = |p: Position| !tape.axes(p).is_empty();
    let allocation = allocate(tape, |p| varies(p).then_some(0), |p| keep[p.index()]);
    let uniform: Vec<Position> = tape.positions().filter(|&p| !varies(p)).collect();
    let nodes: Vec<NodeId> = uniform.iter().map(|&p| tape.node(p)).collect();
    let mut values = vec![0.0; nodes.len()];
    let mut slices: Vec<&mut [f64]> = values.chunks_mut(1).collect();
    points(graph, &nodes, [&[0.0]; 3], parameters, &mut slices)?;
    let uniforms = UniformRanges::new(&values);
    let mut sources: Vec<Source> =
        (allocation.of.iter()).map(|buffer| Source::Buffer(buffer.unwrap_or_default())).collect();
    for (number, p) in uniform.iter().enumerate() {
        sources[p.index()] = Source::Uniform(number as u32);
    }
    let mut code = Code::new(graph);
    tape.positions().for_each(|p| code.push_op(&schedule, p, &sources));
    let count = allocation.counts.first().copied().unwrap_or(0) as usize;
    let mut buffers = vec![Octet::ZERO; count];
    let total = at[0].len();
    for start in (0..total).step_by(LANES) {
        let boxes = LANES.min(total - start);
        let frame = Frame { uniforms: &uniforms, rows: [[&[]; LANES]; 3], words: 0, boxes };
        for p in tape.positions() {
            if let (Op::Coordinate(axis), Source::Buffer(buffer)) = (tape.op(p), sources[p.index()])
            {
                let side = &at[axis.index()][start..start + boxes];
                buffers[buffer as usize] = Octet::from_lanes(|i| side[i.min(boxes - 1)]);
            } else {
                let run = p.index()..p.index() + 1;
                code.run(&[run], &frame, &mut [], &mut buffers, &mut []);
            }
        }
        for (k, &p) in tape.outputs().iter().enumerate() {
            let range = frame.read(sources[p.index()], &buffers);
            for i in 0..boxes {
                out[k * total + start + i] = range.lane(i);
            }
        }
    }
    Ok(())
}
