//! The instructions of interval programs, interpreted on eight boxes at a time.

use super::chains::Lead;
use super::octet::{self, LANES, Octet, Octets};
use crate::eval::levels::Pairs;
use crate::eval::lower::{Factor, Split};
use crate::eval::regions::is_set;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position, Tape};
use crate::expr::enclosure::dead_sides;
use crate::expr::{Binary, Extremum, Graph, NodeId, Oracle, Output, Unary};
use crate::geom::Axis;
use crate::num::{Interval, lanes};
use std::ops::Range;
use std::sync::Arc;

/// Where an operand is read from.
#[derive(Clone, Copy, Debug)]
pub(in crate::eval) enum Source {
    /// A uniform value, by number.
    Uniform(u32),
    /// A buffer, by number.
    Buffer(u32),
}

/// What an instruction does.
#[derive(Clone, Copy, Debug)]
pub(in crate::eval) enum Action {
    /// Nothing: the value is a uniform one.
    Read,
    /// Reads a table along an axis, by number.
    Gather(Axis, u32),
    /// An operator of one operand.
    Unary(Unary),
    /// The product of a value with itself.
    Square,
    /// An operator of two operands.
    Binary(Binary),
    /// An extremum, with the bits of its sides.
    Choose(Extremum, [Option<u32>; 2]),
    /// A pick, with the bits of its choice's sides.
    Pick(Extremum, [Option<u32>; 2]),
    /// A split sine or cosine, with the number of its split.
    Wave(Unary, u32),
    /// The value of an oracle, with the number of the oracle and the bit of its region.
    Oracle(u32, Option<u32>),
    /// What has no enclosure.
    Anything,
}

/// An operation of an interval program; its number is the operation's position on the tape.
#[derive(Clone, Copy, Debug)]
pub(in crate::eval) struct Instruction {
    pub(in crate::eval) action: Action,
    /// The operands, then uniform values that nobody looks at.
    pub(in crate::eval) operands: [Source; 4],
    /// The buffer of the result.
    pub(in crate::eval) out: u32,
    /// The number of the extremum among those in chains.
    pub(in crate::eval) link: Option<u32>,
}

/// A split sum, its terms as sources.
#[derive(Clone, Debug)]
struct Wave {
    split: Split,
    terms: Vec<(Source, Vec<(Source, bool)>)>,
}

/// What is run, whatever the boxes.
#[derive(Debug)]
pub(super) struct Code {
    pub(super) instructions: Vec<Instruction>,
    waves: Vec<Wave>,
    oracles: Vec<Arc<dyn Oracle>>,
}

/// The uniform values of an interval program.
#[derive(Clone, Debug, Default)]
pub struct UniformRanges {
    octets: Vec<Octet>,
    values: Vec<f64>,
    is_finite: bool,
}

impl UniformRanges {
    /// The values as enclosures.
    #[must_use]
    pub fn new(values: &[f64]) -> Self {
        let octets = values.iter().map(|&value| Octet::splat(Interval::point(value))).collect();
        let is_finite = values.iter().all(|value| value.is_finite());
        Self { octets, values: values.to_vec(), is_finite }
    }

    /// The values themselves.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Whether all values are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.is_finite
    }
}

/// What instructions read besides buffers.
pub(super) struct Frame<'a> {
    pub(super) uniforms: &'a UniformRanges,
    /// The enclosures of all tables over the boxes' sides.
    pub(super) slabs: Slabs<'a>,
    /// Words of activity a box.
    pub(super) words: usize,
    /// The lane of each box.
    pub(super) lanes: &'a [u8],
}

/// The slabs that the boxes of a call lie in, by axis.
pub(super) enum Slabs<'a> {
    /// The boxes are eighths of one: bit `a` of a lane's number says which half along axis `a`.
    Eighths([Pairs<'a>; 3]),
    /// By lane: a pair of slabs, and which of the two.
    Apart(Box<[[(Pairs<'a>, usize); LANES]; 3]>),
    /// There are no tables.
    None,
}

impl Slabs<'_> {
    #[inline(always)]
    fn gather(&self, axis: Axis, table: usize) -> Octet {
        match self {
            Self::Eighths(pairs) => {
                let pairs = &pairs[axis.index()];
                let halves = [pairs.range(table, 0), pairs.range(table, 1)];
                match axis {
                    Axis::X => Octet::from_lanes(|i| halves[i & 1]),
                    Axis::Y => Octet::from_lanes(|i| halves[i >> 1 & 1]),
                    Axis::Z => Octet::from_lanes(|i| halves[i >> 2]),
                }
            }
            Self::Apart(slabs) => {
                let slabs = &slabs[axis.index()];
                Octet::from_lanes(|i| slabs[i].0.range(table, slabs[i].1))
            }
            Self::None => Octet::splat(Interval::ANYTHING),
        }
    }
}

impl Frame<'_> {
    #[inline(always)]
    pub(super) fn read(&self, source: Source, buffers: &Octets) -> Octet {
        match source {
            Source::Uniform(number) => self.uniforms.octets[number as usize],
            Source::Buffer(buffer) => buffers.get(buffer),
        }
    }
}

impl Code {
    pub(super) fn new(graph: &Graph) -> Self {
        let oracles = graph.oracles().to_vec();
        Self { instructions: Vec::new(), waves: Vec::new(), oracles }
    }

    pub(super) fn push(&mut self, action: Action, operands: &[Source], out: Source) {
        let mut list = [Source::Uniform(0); 4];
        list[..operands.len()].copy_from_slice(operands);
        let (action, out) = match out {
            Source::Buffer(out) => (action, out),
            Source::Uniform(_) => (Action::Read, 0),
        };
        self.instructions.push(Instruction { action, operands: list, out, link: None });
    }

    pub(super) fn push_wave(
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

    pub(super) fn push_op(&mut self, schedule: &Schedule, p: Position, sources: &[Source]) {
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

    /// What instruction `number` reads besides its operands: the parts of a split sum.
    pub(super) fn parts(&self, number: usize) -> impl Iterator<Item = Source> + '_ {
        let wave = match self.instructions[number].action {
            Action::Wave(_, wave) => Some(&self.waves[wave as usize]),
            Action::Read
            | Action::Gather(..)
            | Action::Unary(_)
            | Action::Square
            | Action::Binary(_)
            | Action::Choose(..)
            | Action::Pick(..)
            | Action::Oracle(..)
            | Action::Anything => None,
        };
        let terms = wave.into_iter().flat_map(|wave| &wave.terms);
        terms.flat_map(|(leaf, factors)| {
            std::iter::once(*leaf).chain(factors.iter().map(|(factor, _)| *factor))
        })
    }

    /// Runs the instructions in `runs`. `shortcut` may do the work of those from the given one on
    /// and then names the one after.
    pub(super) fn run(
        &self,
        runs: &[Range<usize>],
        frame: &Frame<'_>,
        activity: &mut [u64],
        buffers: &mut Octets,
        leads: &mut [Lead],
        mut shortcut: impl FnMut(usize, &mut Octets) -> Option<usize>,
    ) {
        lanes::dispatch(
            #[inline(always)]
            || {
                for run in runs {
                    let mut at = run.start;
                    while at < run.end {
                        at = match shortcut(at, buffers) {
                            Some(next) => next,
                            None => {
                                let instruction = &self.instructions[at];
                                self.step(instruction, frame, activity, buffers, leads);
                                at + 1
                            }
                        };
                    }
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
        buffers: &mut Octets,
        leads: &mut [Lead],
    ) {
        let Instruction { action, operands, out, link } = *instruction;
        let read = |i: usize| frame.read(operands[i], buffers);
        let value = match action {
            Action::Read => return,
            Action::Gather(axis, table) => frame.slabs.gather(axis, table as usize),
            Action::Unary(op) => octet::unary(op, &read(0)),
            Action::Square => octet::square(&read(0)),
            Action::Binary(op) => octet::binary(op, &read(0), &read(1)),
            Action::Choose(extremum, bits) => {
                let (mut a, mut b) = (read(0), read(1));
                if bits != [None, None] {
                    choose(extremum, bits, frame, activity, &mut a, &mut b);
                }
                let value = octet::binary(extremum.operator(), &a, &b);
                if let Some(link) = link {
                    leads[link as usize] = Lead::new(extremum, &a, &b, &value);
                }
                value
            }
            Action::Pick(extremum, bits) => {
                let (mut a, mut b) = (read(0), read(1));
                choose(extremum, bits, frame, activity, &mut a, &mut b);
                octet::pick(extremum, [&a, &b, &read(2), &read(3)])
            }
            Action::Wave(op, number) => {
                let wave = &self.waves[number as usize];
                wave.widened(&octet::unary(op, &read(0)), frame, buffers)
            }
            Action::Oracle(oracle, bit) => {
                let at = [0, 1, 2].map(read);
                let oracle = &self.oracles[oracle as usize];
                let mut value = Octet::splat(Interval::ANYTHING);
                for (&lane, own) in frame.lanes.iter().zip(0..) {
                    let own: usize = own;
                    let is_live =
                        |bit| activity.get(own * frame.words..).is_some_and(|own| is_set(own, bit));
                    if bit.is_none_or(is_live) {
                        let lane = usize::from(lane);
                        value.set_lane(lane, oracle.range(at.map(|u| u.lane(lane))));
                    }
                }
                value
            }
            Action::Anything => Octet::splat(Interval::ANYTHING),
        };
        buffers.set(out, &value);
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
    for (i, &lane) in frame.lanes.iter().enumerate() {
        let lane = usize::from(lane);
        let own = &mut activity[i * frame.words..][..frame.words];
        for (bit, operand) in bits.into_iter().zip([&mut *a, &mut *b]) {
            if bit.is_some_and(|bit| !is_set(own, bit)) {
                operand.set_lane(lane, loser);
            }
        }
        let dead = dead_sides(extremum, a.lane(lane), b.lane(lane));
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
    fn widened(&self, source: &Octet, frame: &Frame<'_>, buffers: &Octets) -> Octet {
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
        split_range(&self.split, &sums, source)
    }
}

/// The range of the split form of a sine or cosine whose source form has the range `source`, the
/// magnitudes of the terms summing up to at most `magnitudes`.
pub(in crate::eval) fn split_range(
    split: &Split,
    magnitudes: &[f64; LANES],
    source: &Octet,
) -> Octet {
    Octet::from_lanes(|i| {
        if magnitudes[i].is_nan() || magnitudes[i] > LARGEST_SUM {
            return Interval::ANYTHING;
        }
        let (allowance, range) = (split.allowance(magnitudes[i]), source.lane(i));
        Interval {
            lo: (range.lo - allowance).max(-Split::LARGEST),
            hi: (range.hi + allowance).min(Split::LARGEST),
            nan: range.nan,
        }
    })
}
