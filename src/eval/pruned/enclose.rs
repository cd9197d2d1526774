//! Ranges of a cut over up to eight pieces of boxes, and which sides of its choices matter in each.
//!
//! Forwards, every operation of the cut is enclosed. Backwards, from users to operands, each choice
//! is decided in each box by the rules of the interval program (`interpret/chains.rs` has the
//! proofs): a side dies where the other is strictly ahead of it, where it is behind the extremum of
//! its whole chain, and, if only what is near zero is wanted, where it is far from zero. What only
//! dead sides need is not alive itself and decides nothing.

use super::Shared;
use super::code::NO_CHOICE;
use super::cut::{Arg, Cut, Cutter, Item, Op};
use super::pieces::{Group, Pieces};
use crate::eval::interpret::{LANES, Octet, octet, split_range};
use crate::eval::lower::{Factor, Split};
use crate::eval::regions::is_set;
use crate::expr::{Extremum, Output};
use crate::geom::Axis;
use crate::num::{Interval, lanes};

/// The activity rows of the boxes of a call.
#[derive(Clone, Copy, Debug)]
pub(super) enum Rows<'a> {
    /// All boxes have the row that the cut was made by.
    One,
    /// One after the other, each of so many words; the cut was made by all of them together.
    Own(&'a [u64], usize),
}

impl Rows<'_> {
    /// In which of `pieces` side `side` of choice `choice` is alive, a bit a piece.
    fn alive(self, choice: u32, side: u32, pieces: &Group) -> u8 {
        let Self::Own(rows, words) = self else { return u8::MAX };
        let is_alive = |number: usize| is_set(&rows[number * words..], 2 * choice + side);
        let lanes = pieces.numbers().iter().zip(0..);
        lanes.fold(0, |mask, (&number, lane)| mask | u8::from(is_alive(number)) << lane)
    }
}

/// How near to zero the expression is looked at, a limit a box; what is no positive number says
/// that everything matters.
pub(super) type Limits = [f64; LANES];

/// Limits that leave everything that matters.
pub(super) const UNLIMITED: Limits = [0.0; LANES];

/// The ranges of a cut's operations in the pieces of up to eight boxes, and what is concluded from
/// them.
#[derive(Debug, Default)]
pub(super) struct Enclosure {
    /// By group of pieces and by operation.
    ranges: Vec<Vec<Octet>>,
    /// By operation: the boxes in which it is alive.
    live: Vec<u8>,
    /// By operation that is an extremum: the last of its chain.
    last: Vec<u32>,
}

/// An operation that is the last of its chain, or of which that is not known.
const ITSELF: u32 = u32::MAX;

impl Enclosure {
    /// Encloses the operations of `cut`, the last that `cutter` made; the results are the ranges of
    /// its output, by box.
    pub(super) fn enclose(
        &mut self,
        shared: Shared<'_>,
        (cut, cutter): (&Cut, &Cutter),
        pieces: &Pieces,
        rows: Rows<'_>,
    ) -> [Interval; LANES] {
        let groups = pieces.groups();
        self.ranges.resize_with(self.ranges.len().max(groups.len()), Vec::new);
        let mut found = [None; LANES];
        for (group, ranges) in groups.iter().zip(&mut self.ranges) {
            enclose_group(shared, (cut, cutter), group, rows, ranges);
            let output = cut.outputs.first();
            let output = output.map_or(Octet::ZERO, |output| read(shared, *output, ranges));
            for (lane, &number) in group.numbers().iter().enumerate() {
                let (range, before) = (output.lane(lane), found[number]);
                found[number] = Some(before.map_or(range, |before: Interval| before.hull(range)));
            }
        }
        found.map(|range| range.unwrap_or(Interval::ANYTHING))
    }

    /// Decides the choices of `cut`, which was just enclosed in `pieces`, as far as they matter
    /// within `limits` of zero; `decide` is told each with the boxes where its first and where its
    /// second side is alive.
    ///
    /// What is alive in one piece of a box is so in all: otherwise it would be computed in a piece
    /// for which its own choices were never decided.
    pub(super) fn decide(
        &mut self,
        shared: Shared<'_>,
        cut: &Cut,
        (pieces, rows): (&Pieces, Rows<'_>),
        limits: &Limits,
        mut decide: impl FnMut(u32, [u8; 2]),
    ) {
        let Self { ranges, live, last } = self;
        live.clear();
        live.resize(cut.items.len(), 0);
        last.clear();
        last.resize(cut.items.len(), ITSELF);
        cut.outputs.iter().for_each(|output| mark(live, *output, pieces.boxes()));
        for (place, item) in cut.items.iter().enumerate().rev() {
            let own = live[place];
            let (extremum, is_pick) = match item.op {
                _ if own == 0 => continue,
                Op::Pass(side) => {
                    if let (true, Ok(operand)) = (item.joined[0], item.args[0].place()) {
                        last[operand] =
                            if last[place] == ITSELF { place as u32 } else { last[place] };
                    }
                    mark(live, item.args[0], own);
                    decide(item.choice, if side == 0 { [own, 0] } else { [0, own] });
                    continue;
                }
                Op::Choose(extremum) if item.choice != NO_CHOICE => (extremum, false),
                Op::Pick(extremum) if item.choice != NO_CHOICE => (extremum, true),
                Op::Coordinate(_)
                | Op::Unary(_)
                | Op::Square
                | Op::Binary(_)
                | Op::Choose(_)
                | Op::Pick(_)
                | Op::Oracle(..) => {
                    item.args.iter().for_each(|arg| mark(live, *arg, own));
                    continue;
                }
            };
            if !is_pick && last[place] == ITSELF {
                last[place] = place as u32;
            }
            let whole = (!is_pick).then_some(last[place]);
            let mut alive = [0; 2];
            for (group, ranges) in pieces.groups().iter().zip(&*ranges) {
                if group.boxes() & own == 0 {
                    continue;
                }
                let choice = Choice { item, extremum, whole };
                let lanes = choice.sides(shared, (group, rows), limits, ranges);
                for (alive, lanes) in alive.iter_mut().zip(lanes) {
                    *alive |= group.boxes_of(lanes) & own;
                }
            }
            for (arg, joined) in item.args.iter().zip(item.joined) {
                if let (Some(whole), true, Ok(operand)) = (whole, joined, arg.place()) {
                    last[operand] = whole;
                }
            }
            decide(item.choice, alive);
            if is_pick {
                let open = alive[0] & alive[1];
                item.args[..2].iter().for_each(|arg| mark(live, *arg, open));
                mark(live, item.args[2], alive[0]);
                mark(live, item.args[3], alive[1]);
            } else {
                mark(live, item.args[0], alive[0]);
                mark(live, item.args[1], alive[1]);
            }
        }
    }
}

/// Encloses the operations of `cut` in the pieces of a group.
fn enclose_group(
    shared: Shared<'_>,
    (cut, cutter): (&Cut, &Cutter),
    group: &Group,
    rows: Rows<'_>,
    ranges: &mut Vec<Octet>,
) {
    ranges.clear();
    ranges.reserve(cut.items.len());
    let coordinates = Axis::ALL.map(|axis| Octet::from_lanes(|lane| group.side(axis, lane)));
    let inputs = Inputs { shared, cutter, coordinates, group, rows };
    lanes::dispatch(
        #[inline(always)]
        || {
            for item in &cut.items {
                let range = inputs.range(item, ranges);
                ranges.push(range);
            }
        },
    );
}

/// An operation that chooses.
struct Choice<'a> {
    item: &'a Item,
    extremum: Extremum,
    /// The last of its chain; none for a pick.
    whole: Option<u32>,
}

impl Choice<'_> {
    /// The pieces of `group`, in which operations have these `ranges`, where each side is alive if
    /// the operation is.
    #[inline]
    fn sides(
        &self,
        shared: Shared<'_>,
        (group, rows): (&Group, Rows<'_>),
        limits: &Limits,
        ranges: &[Octet],
    ) -> [u8; 2] {
        let Self { item, extremum, whole } = *self;
        let [a, b] = [item.args[0], item.args[1]].map(|arg| read(shared, arg, ranges));
        let mut alive = [0, 1].map(|side| rows.alive(item.choice, side, group));
        // Where a side is dead already, the other stays.
        let known = alive[0] & alive[1] & !(a.nan() | b.nan());
        let [a, b] = [a, b].map(|operand| Ends::new(extremum, &operand));
        alive[0] &= !(known & below(&b.upper, &a.lower));
        alive[1] &= !(known & below(&a.upper, &b.lower));
        if let Some(whole) = whole {
            let reach = Ends::new(extremum, &ranges[whole as usize]).upper;
            let crowns = shared.code.traits(item.node).crowns;
            let dies = |own: &Ends, other: &Ends| {
                let far = if crowns { far(own, other, &group.limits(limits)) } else { 0 };
                below(&reach, &own.lower) | far
            };
            // In this order: of two sides one stays.
            alive[0] &= !(known & dies(&a, &b) & alive[1]);
            alive[1] &= !(known & dies(&b, &a) & alive[0]);
        }
        alive
    }
}

/// Marks an operand as alive in the boxes of `mask`.
#[inline]
fn mark(live: &mut [u8], arg: Arg, mask: u8) {
    if let Ok(place) = arg.place() {
        live[place] |= mask;
    }
}

/// The lanes in which `a` is less than `b`, as bits.
#[inline]
fn below(a: &[f64; LANES], b: &[f64; LANES]) -> u8 {
    (0..LANES).fold(0, |mask, i| mask | u8::from(a[i] < b[i]) << i)
}

/// The lanes in which an operand does not matter within the limits of zero.
fn far(own: &Ends, other: &Ends, limits: &Limits) -> u8 {
    let is_far = |i: usize| {
        let limit = limits[i];
        limit > 0.0 && (own.lower[i] >= limit || other.upper[i] <= -limit)
    };
    (0..LANES).fold(0, |mask, i| mask | u8::from(is_far(i)) << i)
}

/// The ends of a range as of an operand of a minimum.
struct Ends {
    lower: [f64; LANES],
    upper: [f64; LANES],
}

impl Ends {
    #[inline]
    fn new(extremum: Extremum, range: &Octet) -> Self {
        match extremum {
            Extremum::Min => Self { lower: *range.lower(), upper: *range.upper() },
            Extremum::Max => {
                Self { lower: range.upper().map(|end| -end), upper: range.lower().map(|end| -end) }
            }
        }
    }
}

/// The range of an operand.
#[inline(always)]
fn read(shared: Shared<'_>, arg: Arg, ranges: &[Octet]) -> Octet {
    match arg.place() {
        Ok(place) => ranges[place],
        Err(node) => Octet::splat(Interval::point(shared.uniforms[node])),
    }
}

/// What the ranges of operations are made from.
struct Inputs<'a> {
    shared: Shared<'a>,
    cutter: &'a Cutter,
    coordinates: [Octet; 3],
    group: &'a Group,
    rows: Rows<'a>,
}

impl Inputs<'_> {
    #[inline(always)]
    fn range(&self, item: &Item, ranges: &[Octet]) -> Octet {
        let read = |i: usize| read(self.shared, item.args[i], ranges);
        match item.op {
            Op::Coordinate(axis) => self.coordinates[axis.index()],
            Op::Pass(_) => read(0),
            Op::Unary(op) => {
                let range = octet::unary(op, &read(0));
                match self.shared.code.lowered.split(item.node) {
                    Some(split) => self.widened(split, &range, ranges),
                    None => range,
                }
            }
            Op::Square => octet::square(&read(0)),
            Op::Binary(op) => octet::binary(op, &read(0), &read(1)),
            Op::Choose(extremum) => {
                let [a, b] = self.losing(extremum, item, [read(0), read(1)]);
                octet::binary(extremum.operator(), &a, &b)
            }
            Op::Pick(extremum) => {
                let [a, b] = self.losing(extremum, item, [read(0), read(1)]);
                octet::pick(extremum, [&a, &b, &read(2), &read(3)])
            }
            Op::Oracle(oracle, Output::Value) => {
                let at = [0, 1, 2].map(read);
                let oracle = &self.shared.code.graph().oracles()[oracle.index()];
                let mut range = Octet::splat(Interval::ANYTHING);
                for lane in 0..self.group.numbers().len() {
                    range.set_lane(lane, oracle.range(at.map(|u| u.lane(lane))));
                }
                range
            }
            Op::Oracle(_, Output::Partial(_)) => Octet::splat(Interval::ANYTHING),
        }
    }

    /// The operands of a choice, the loser in place of what is dead in a box.
    #[inline(always)]
    fn losing(&self, extremum: Extremum, item: &Item, mut operands: [Octet; 2]) -> [Octet; 2] {
        if matches!(self.rows, Rows::Own(..)) && item.choice != NO_CHOICE {
            let loser = Interval::point(extremum.loser());
            for (operand, side) in operands.iter_mut().zip(0..) {
                let alive = self.rows.alive(item.choice, side, self.group);
                let count = self.group.numbers().len();
                for lane in (0..count).filter(|lane| alive >> lane & 1 == 0) {
                    operand.set_lane(lane, loser);
                }
            }
        }
        operands
    }

    /// The range of a sine or cosine that is sampled in its split form.
    #[inline(never)]
    fn widened(&self, split: &Split, source: &Octet, ranges: &[Octet]) -> Octet {
        let read = |id| read(self.shared, self.cutter.arg(self.shared.code, id), ranges);
        let mut sums = [0.0; LANES];
        for term in &split.terms {
            let mut magnitudes = read(term.leaf).magnitude();
            for factor in term.factors.iter().rev() {
                let (id, over) = match *factor {
                    Factor::Times(id) => (id, false),
                    Factor::Over(id) => (id, true),
                };
                let factor = read(id).lane(0).hi.abs();
                for magnitude in &mut magnitudes {
                    *magnitude = if over { *magnitude / factor } else { *magnitude * factor };
                }
            }
            sums.iter_mut().zip(magnitudes).for_each(|(sum, magnitude)| *sum += magnitude);
        }
        split_range(split, &sums, source)
    }
}
