//! What matters in the blocks of a brick: found once a brick, for its samples and for its edges.
//!
//! Near the surface less matters: sides of extrema that are alive far from zero alone are left out
//! where values are asked for next to zero, and a value beyond the limit says that it is wrong.

use super::block::SIDE;
use super::choices::{Choices, Near};
use super::code::{Code, Form};
use super::cut::Row;
use super::enclose::Rows;
use super::pieces::Pieces;
use super::{BoundPruned, PrunedWorkspace, Shared};
use crate::eval::interpret::LANES;
use crate::eval::sampler::{BRICK, NodeBox};
use crate::geom::Axis;
use crate::num::Interval;

/// Operations that make it worth the while to look at each block of a brick for itself.
const WORTHWHILE: usize = 100;
/// Of the length of a brick's range, the part to both sides of zero that counts as near the
/// surface; see `enclosing`.
const NEAR: f64 = 0.125;

/// The ends of edges are looked for so many times farther from zero than they ever were. A closer
/// look costs less; one that was too close is taken again, which costs much, but happens only
/// where an edge is longer, or the field steeper, than anywhere before.
const FARTHER: f64 = 1.25;

/// What matters in the blocks of a brick, and the blocks' ranges.
#[derive(Debug)]
pub(super) struct Focus {
    key: Option<([u32; 3], Nearness, Vec<u64>)>,
    pub(super) cut: Whose,
    /// Values this far from zero are not what the expression is; infinite if all are.
    pub(super) limit: f64,
    pub(super) ranges: [Interval; LANES],
    pub(super) choices: Choices,
}

/// What tells the sides of choices that matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Whose {
    /// The row of the brick.
    Row,
    /// What is known of the brick near the surface.
    Brick,
    /// Each block for itself.
    Block,
}

/// How near to zero the expression is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nearness {
    /// Its sign alone.
    Sign,
    /// Its values next to the surface.
    Surface,
    /// Everywhere.
    Nowhere,
}

impl Focus {
    /// On nothing, for `code`.
    pub(super) fn new(code: &Code) -> Self {
        Self {
            key: None,
            cut: Whose::Row,
            limit: f64::INFINITY,
            ranges: [Interval::ANYTHING; LANES],
            choices: Choices::new(code.count),
        }
    }
}

impl BoundPruned {
    /// Keeps what matters near the surface in each brick of `boxes` that is not settled; all were
    /// just enclosed.
    pub(super) fn remember(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        pieces: &Pieces,
        boxes: &[NodeBox],
        ranges: &[Interval],
    ) {
        let PrunedWorkspace { source, enclosure, .. } = workspace;
        let limits = std::array::from_fn(|lane| ranges.get(lane).map_or(0.0, near));
        let mut found: [Vec<(u32, u8)>; LANES] = Default::default();
        let count = boxes.len();
        enclosure.decide(shared, source, (pieces, Rows::One), &limits, |choice, alive| {
            for (lane, found) in found.iter_mut().enumerate().take(count) {
                let sides = alive[0] >> lane & 1 | (alive[1] >> lane & 1) << 1;
                if sides != 0 {
                    found.push((choice, sides));
                }
            }
        });
        for (((node, range), limit), list) in boxes.iter().zip(ranges).zip(limits).zip(found) {
            let is_open = range.nan || !(range.is_inside() || range.is_outside());
            if is_open && limit > 0.0 {
                self.memo.insert(node.index, Near { limit, sides: list.into_boxed_slice() });
            }
        }
    }

    /// Looks at the blocks of `brick`, whose row is `row`: see [`Focus`].
    pub(super) fn focus(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        brick: [u32; 3],
        row: &[u64],
        nearness: Nearness,
    ) {
        let PrunedWorkspace {
            cutter, source, enclosure, near: of_brick, focus, whole, reach, ..
        } = workspace;
        let focus = if nearness == Nearness::Nowhere { whole } else { focus };
        let is_known = matches!(&focus.key, Some((at, near, from))
            if *at == brick && *near == nearness && from == row);
        if is_known {
            return;
        }
        focus.key = Some((brick, nearness, row.to_vec()));
        let is_everything = row.iter().all(|word| *word == u64::MAX);
        let is_near = nearness != Nearness::Nowhere && !is_everything;
        let known = is_near.then(|| self.memo.get(brick)).flatten();
        let outputs = [shared.code.source];
        match &known {
            Some(known) => {
                of_brick.load(&known.sides);
                cutter.cut(shared.code, Form::Source, &outputs, &of_brick.within(0), source);
            }
            None => cutter.cut(shared.code, Form::Source, &outputs, &Row(row), source),
        }
        focus.cut = if known.is_some() { Whose::Brick } else { Whose::Row };
        focus.limit = known.as_ref().map_or(f64::INFINITY, |known| known.limit);
        if source.open == 0 || source.items.len() < WORTHWHILE {
            return;
        }
        focus.cut = Whose::Block;
        let mut pieces = Pieces::default();
        for block in 0..LANES {
            let side = |axis: Axis| {
                let half = block >> axis.index() & 1;
                let first = brick[axis.index()] as usize * BRICK + half * SIDE;
                self.side(axis, first, SIDE)
            };
            pieces.add(shared.jumps, block, &Axis::ALL.map(side));
        }
        focus.ranges = enclosure.enclose(shared, (source, cutter), &pieces, Rows::One);
        let limit = match nearness {
            Nearness::Sign => f64::MIN_POSITIVE,
            Nearness::Surface => {
                let brick = || focus.ranges.into_iter().fold(focus.ranges[0], Interval::hull);
                let limit = if known.is_some() { focus.limit } else { near(&brick()) };
                if *reach > 0.0 { limit.min(FARTHER * *reach) } else { limit }
            }
            Nearness::Nowhere => 0.0,
        };
        focus.limit = if limit > 0.0 { limit } else { f64::INFINITY };
        let choices = &mut focus.choices;
        choices.clear();
        let limits = [limit; LANES];
        enclosure.decide(shared, source, (&pieces, Rows::One), &limits, |choice, sides| {
            choices.add(choice, sides);
        });
    }
}

/// How near to zero a box whose range is `range` is looked at for its surface; zero if not at all.
fn near(range: &Interval) -> f64 {
    let limit = (range.hi - range.lo) * NEAR;
    if limit.is_finite() && limit > 0.0 { limit } else { 0.0 }
}
