//! Boxes in the pieces that they are enclosed in, up to eight of them together.

use super::jumps::{Jumps, Sides};
use crate::eval::interpret::LANES;
use crate::geom::Axis;
use crate::num::Interval;

/// Up to eight pieces of boxes, at least one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    count: usize,
    sides: [Sides; LANES],
    numbers: [usize; LANES],
    /// Whether each piece is in the lane of the number of its box.
    is_in_order: bool,
}

impl Group {
    /// A group without pieces.
    const EMPTY: Self = Self {
        count: 0,
        sides: [[Interval::ANYTHING; 3]; LANES],
        numbers: [0; LANES],
        is_in_order: true,
    };

    fn add(&mut self, piece: Sides, number: usize) {
        (self.sides[self.count], self.numbers[self.count]) = (piece, number);
        self.is_in_order &= number == self.count;
        self.count += 1;
    }

    /// By piece: the number of the box that it is of.
    #[inline]
    pub(super) fn numbers(&self) -> &[usize] {
        &self.numbers[..self.count]
    }

    /// The boxes that have pieces here, a bit each.
    #[inline]
    pub(super) fn boxes(&self) -> u8 {
        self.boxes_of(u8::MAX)
    }

    /// The boxes of the pieces in `lanes`, a bit each.
    #[inline]
    pub(super) fn boxes_of(&self, lanes: u8) -> u8 {
        if self.is_in_order {
            return lanes & (u8::MAX >> (LANES - self.count));
        }
        let numbers = self.numbers().iter().zip(0..);
        numbers.fold(0, |boxes, (&number, lane)| boxes | (lanes >> lane & 1) << number)
    }

    /// By lane what is given by box.
    #[inline]
    pub(super) fn limits(&self, limits: &[f64; LANES]) -> [f64; LANES] {
        if self.is_in_order { *limits } else { self.numbers.map(|number| limits[number]) }
    }

    /// The side along `axis` of the piece in lane `lane`; of the last where there is none.
    pub(super) fn side(&self, axis: Axis, lane: usize) -> Interval {
        self.sides[lane.min(self.count - 1)][axis.index()]
    }
}

/// The pieces of up to eight boxes, in groups.
#[derive(Clone, Debug, Default)]
pub(super) struct Pieces(Vec<Group>);

impl Pieces {
    /// Adds the pieces of box `number`, which has these sides.
    pub(super) fn add(&mut self, jumps: &Jumps, number: usize, sides: &Sides) {
        jumps.cut(sides, |piece| {
            if self.0.last().is_none_or(|group| group.count == LANES) {
                self.0.push(Group::EMPTY);
            }
            if let Some(group) = self.0.last_mut() {
                group.add(piece, number);
            }
        });
    }

    /// The boxes that have pieces, a bit each.
    pub(super) fn boxes(&self) -> u8 {
        self.0.iter().fold(0, |boxes, group| boxes | group.boxes())
    }

    /// The groups, in the order of the boxes.
    pub(super) fn groups(&self) -> &[Group] {
        &self.0
    }
}
