//! Operands that no longer matter to the extremum of a whole chain.
//!
//! Two operands of a minimum may be close to each other and yet both be far above the minimum of
//! the tree of minima that they are part of. So after the extremum of a whole chain is known to be
//! at most H in a box, the tree is walked from its root: an operand that is always above H is dead,
//! if neither it nor its sibling may be NaN and its sibling stays.
//!
//! *The root's value keeps its bits.* Call a value of the tree changed if it differs from what it
//! would be with every operand alive; the claim is that a changed value was above H and is above H
//! now. It holds where an operand dies: the operand is above H, so if it was the lesser, both it and
//! its sibling are above H. A minimum of a changed value and an unchanged one is unchanged if the
//! latter is at most H, and if it is NaN and comes second; else the minimum is above H before and
//! after. The root is at most H or NaN, so it is unchanged. Picks on the same choices, in
//! derivatives, decide as before wherever the root's value comes from.
//!
//! A chain consists of extrema of one kind, each used once and by the next, without picks on their
//! choices; the lowered expression has the same chains because no two extrema of the source become
//! one (otherwise there are no chains). Maxima are minima of the negated values.
//!
//! **Near zero.** Where only the sign of the expression is asked for, or its value next to its
//! surface, far fewer operands matter. Call two values alike if they are one, or both at least T, or
//! both at most -T, for a T > 0. The *crown* of an expression is its root and what it uses through
//! extrema of chains and negations, each used once. Minimum, maximum and negation of alike values
//! are alike, so the root stays like what it was if in the crown
//!
//! * an operand of a minimum dies that is always at least T, or whose sibling is always at most -T,
//! * an operand of a maximum dies that is always at most -T, or whose sibling is always at least T,
//!
//! neither it nor its sibling may be NaN, and its sibling stays. Then the sign is right, and a value
//! found between -T and T is the value to the bit: it comes from the same operand, past extrema
//! that decide as before, for what is alike to another value is on the same side of it. So are
//! derivatives.

use super::octet::{LANES, Octet};
use crate::eval::lower::Lowered;
use crate::eval::regions::is_set;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position};
use crate::expr::{Extremum, NodeId, Unary};
use rustc_hash::FxHashSet;

/// The extrema of an interval program that are in chains, numbered.
#[derive(Clone, Debug, Default)]
pub(super) struct Chains {
    links: Vec<Link>,
    numbers: Vec<Option<u32>>,
}

/// An extremum of a chain.
#[derive(Clone, Copy, Debug)]
struct Link {
    /// The number of the chain's root.
    root: u32,
    /// The bit of the region that the extremum lies in, and those of its sides.
    own: Option<u32>,
    sides: [Option<u32>; 2],
    /// Whether the extremum is in the crown.
    is_crown: bool,
}

/// The operands of an extremum in eight boxes and the upper end of its value, as of a minimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead {
    lower: [[f64; LANES]; 2],
    upper: [[f64; LANES]; 2],
    value: [f64; LANES],
    nan: u8,
}

impl Lead {
    pub(super) fn new(extremum: Extremum, a: &Octet, b: &Octet, value: &Octet) -> Self {
        let nan = a.nan() | b.nan();
        match extremum {
            Extremum::Min => Self {
                lower: [*a.lower(), *b.lower()],
                upper: [*a.upper(), *b.upper()],
                value: *value.upper(),
                nan,
            },
            Extremum::Max => {
                let minus = |ends: &[f64; LANES]| ends.map(|end| -end);
                Self {
                    lower: [minus(a.upper()), minus(b.upper())],
                    upper: [minus(a.lower()), minus(b.lower())],
                    value: minus(value.lower()),
                    nan,
                }
            }
        }
    }
}

impl Chains {
    /// The chains of a schedule of boxes.
    pub(super) fn new(schedule: &Schedule, lowered: &Lowered) -> Self {
        let (tape, regions) = (schedule.tape(), schedule.regions());
        let extremum = |p: Position| match tape.op(p) {
            Op::Binary(op, a, b) => op.extremum().map(|extremum| (extremum, a, b)),
            Op::Coordinate(_)
            | Op::Constant(_)
            | Op::Parameter(_)
            | Op::Unary(..)
            | Op::Pick(..)
            | Op::Oracle(..) => None,
        };
        let images: Vec<NodeId> = (tape.positions().filter(|&p| extremum(p).is_some()))
            .filter_map(|p| lowered.image(tape.node(p)))
            .collect();
        let mut numbers = vec![None; tape.len()];
        if images.iter().copied().collect::<FxHashSet<_>>().len() < images.len() {
            return Self { links: Vec::new(), numbers };
        }
        let picked: FxHashSet<_> = (tape.positions().filter(|&p| extremum(p).is_none()))
            .filter_map(|p| tape.op(p).choice())
            .collect();
        let chained = |p: Position| extremum(p).filter(|choice| !picked.contains(choice));
        let mut uses: Vec<u32> = tape.output_flags().into_iter().map(u32::from).collect();
        for p in tape.positions() {
            for o in tape.op(p).operands().iter() {
                uses[o.index()] += 1;
            }
        }
        let mut crown = vec![false; tape.len()];
        let mut pending = vec![tape.outputs()[0]];
        while let Some(p) = pending.pop() {
            if uses[p.index()] != 1 {
                continue;
            }
            match (tape.op(p), chained(p)) {
                (Op::Unary(Unary::Neg, a), _) => pending.push(a),
                (_, Some((_, a, b))) => {
                    crown[p.index()] = true;
                    pending.extend([a, b]);
                }
                (_, None) => {}
            }
        }
        let mut links: Vec<Link> = Vec::new();
        let bit = |side: Option<_>| side.and_then(|region| regions.bit(region));
        for p in tape.positions().rev() {
            let Some((kind, a, b)) = chained(p) else { continue };
            let joins = |o: Position| {
                uses[o.index()] == 1 && chained(o).is_some_and(|(other, _, _)| other == kind)
            };
            let number = *numbers[p.index()].get_or_insert_with(|| {
                let (root, own) = (links.len() as u32, regions.bit(regions.of(p)));
                let sides = regions.sides(p).unwrap_or_default().map(bit);
                links.push(Link { root, own, sides, is_crown: crown[p.index()] });
                root
            });
            for o in [a, b].into_iter().filter(|&o| joins(o)) {
                numbers[o.index()] = Some(links.len() as u32);
                let (root, own) = (links[number as usize].root, regions.bit(regions.of(o)));
                let sides = regions.sides(o).unwrap_or_default().map(bit);
                links.push(Link { root, own, sides, is_crown: crown[o.index()] });
            }
        }
        Self { links, numbers }
    }

    /// The number of the extremum at `p`.
    pub(super) fn link(&self, p: Position) -> Option<u32> {
        self.numbers[p.index()]
    }

    /// Room for what the extrema of all chains report.
    pub(super) fn leads(&self) -> Vec<Lead> {
        let ends = [[0.0; LANES]; 2];
        let lead = Lead { lower: ends, upper: ends, value: [0.0; LANES], nan: 0 };
        vec![lead; self.links.len()]
    }

    /// Clears the bits of operands of extremum `link` that are behind its whole chain; the extrema
    /// that use it come first. `lanes` names the lane of each box.
    pub(super) fn prune(
        &self,
        link: u32,
        leads: &[Lead],
        activity: &mut [u64],
        words: usize,
        lanes: &[u8],
    ) {
        let Link { root, own, sides, .. } = self.links[link as usize];
        let (lead, upper) = (&leads[link as usize], &leads[root as usize].value);
        for (i, &lane) in lanes.iter().enumerate().filter(|(_, lane)| lead.nan >> **lane & 1 == 0) {
            let lane = usize::from(lane);
            let activity = &mut activity[i * words..][..words];
            let alive =
                |bit: Option<u32>, activity: &[u64]| bit.is_none_or(|bit| is_set(activity, bit));
            if !alive(own, activity) {
                continue;
            }
            for side in 0..2 {
                if let Some(bit) = sides[side]
                    && lead.lower[side][lane] > upper[lane]
                    && alive(sides[1 - side], activity)
                {
                    activity[bit as usize / 64] &= !(1 << (bit % 64));
                }
            }
        }
    }

    /// Clears the bits of operands of extremum `link` that do not matter within `limit` of zero in
    /// the box of lane `lane`, whose activity this is; the extrema that use it come first.
    pub(super) fn focus(
        &self,
        link: u32,
        leads: &[Lead],
        activity: &mut [u64],
        lane: usize,
        limit: f64,
    ) {
        let Link { own, sides, is_crown, .. } = self.links[link as usize];
        let lead = &leads[link as usize];
        let alive =
            |bit: Option<u32>, activity: &[u64]| bit.is_none_or(|bit| is_set(activity, bit));
        if !is_crown || lead.nan >> lane & 1 == 1 || !alive(own, activity) {
            return;
        }
        for side in 0..2 {
            if let Some(bit) = sides[side]
                && (lead.lower[side][lane] >= limit || lead.upper[1 - side][lane] <= -limit)
                && alive(sides[1 - side], activity)
            {
                activity[bit as usize / 64] &= !(1 << (bit % 64));
            }
        }
    }
}
