//! What matters near the surface, carried along with what matters at all.
//!
//! In a part filled with a lattice, `max(lattice, part)`, the part decides nothing in a brick where
//! it is well below zero: not the signs of samples, nor where the lattice crosses edges; yet its
//! range is seldom below that of the lattice. A program of few regions ([`Focused::holds`]) says so
//! with every box that it encloses: a box carries a row of words, of which the first are the
//! regions that matter anywhere, the next those that matter to the sign, and those that matter to
//! values within a limit of zero.

use crate::num::Interval;

/// How near to zero the expression is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nearness {
    /// Its sign alone.
    Sign,
    /// Its values next to the surface.
    Surface,
}

/// Of the length of a brick's range, the part to both sides of zero that counts as near the
/// surface. A tight range is at most 28 times as long as the greatest step from node to node, as
/// the diagonal of the brick is; the values on an edge through the surface are up to a step from
/// zero.
pub(super) const NEAR: f64 = 0.125;

/// The limit that is doubled to give others.
const LEAST: f64 = 1.0 / (1u64 << 32) as f64;

/// The activity of a box of a program with one word of regions.
///
/// A box has no bit that the box around it has not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Focused {
    /// The regions that matter.
    bits: u64,
    /// Those that matter to the sign.
    sign: u64,
    /// Those that matter to values within the limit.
    surface: u64,
    /// As many bits as [`LEAST`] is to be doubled to give the limit, none if there is no limit: few
    /// different rows are to be kept, so there are few different limits. All if none is known.
    doublings: u64,
}

impl Focused {
    /// Words of a row.
    pub(super) const WORDS: usize = 4;

    /// Whether a box of a program with so many words of regions carries this.
    pub(super) const fn holds(words: usize) -> bool {
        words == 1
    }

    /// The words of `row`.
    pub(super) fn read(row: &[u64]) -> Self {
        let [bits, sign, surface, doublings] =
            row.first_chunk().copied().unwrap_or([u64::MAX; Self::WORDS]);
        Self { bits, sign, surface, doublings }
    }

    /// Stores the words.
    pub(super) fn write(self, row: &mut [u64]) {
        row.copy_from_slice(&[self.bits, self.sign, self.surface, self.doublings]);
    }

    /// The activity of a box in this one, whose regions are `bits`.
    pub(super) fn unfocused(self, bits: u64) -> Self {
        Self { bits, sign: bits & self.sign, surface: bits & self.surface, ..self }
    }

    /// The activity of a box in this one, whose regions are `bits` and whose range is `range`;
    /// `focus` leaves out of some bits what does not matter within a limit.
    pub(super) fn within(
        self,
        bits: u64,
        range: Interval,
        focus: impl Fn(u64, f64) -> u64,
    ) -> Self {
        let sign = focus(bits & self.sign, f64::MIN_POSITIVE);
        let near = (range.hi - range.lo) * NEAR;
        if !near.is_finite() {
            return Self { sign, ..self.unfocused(bits) };
        }
        let most = self.doublings.count_ones().min(u64::BITS - 1);
        let doublings = (0..most).take_while(|n| limit(n + 1) <= near).count() as u32;
        let mut surface = bits & self.surface;
        if doublings > 0 {
            surface = focus(surface, limit(doublings));
        }
        Self { bits, sign, surface, doublings: (1 << doublings) - 1 }
    }

    /// The row that answers as near to zero as `nearness` says, and how near that is; `None` if
    /// there is none but that of all values.
    pub(super) fn near(row: &[u64], nearness: Nearness) -> Option<(&[u64], f64)> {
        let doublings = row.get(3)?;
        match nearness {
            Nearness::Sign => Some((row.get(1..2)?, f64::MIN_POSITIVE)),
            Nearness::Surface if matches!(doublings, 0 | &u64::MAX) => None,
            Nearness::Surface => Some((row.get(2..3)?, limit(doublings.count_ones()))),
        }
    }
}

/// The limit after so many doublings.
fn limit(doublings: u32) -> f64 {
    LEAST * (1u64 << doublings) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(lo: f64, hi: f64) -> Interval {
        Interval { lo, hi, nan: false }
    }

    #[test]
    fn limits_are_an_eighth_of_the_range_or_up_to_half_of_that() {
        for length in [1e-8, 0.3, 1.0, 7.0, 8.0, 1e8] {
            let all = Focused::read(&[u64::MAX; Focused::WORDS]);
            let own = all.within(0b11, range(-length, 0.0), |bits, _| bits & 0b01);
            let mut row = [0; Focused::WORDS];
            own.write(&mut row);
            assert_eq!(Focused::read(&row), own);
            let (surface, limit) = Focused::near(&row, Nearness::Surface).unwrap();
            assert_eq!(surface, [0b01]);
            assert!(limit <= NEAR * length && 2.0 * limit > NEAR * length, "{length}: {limit}");
            assert_eq!(Focused::near(&row, Nearness::Sign).unwrap().0, [0b01]);
            assert_eq!(row[0], 0b11);
        }
    }

    #[test]
    fn a_box_has_no_bit_that_the_box_around_it_has_not() {
        let all = Focused::read(&[u64::MAX; Focused::WORDS]);
        let ranges = [range(-1.0, 1.0), range(-8.0, 8.0), range(-0.1, 0.1), Interval::ANYTHING];
        for around in ranges {
            for inner in ranges {
                let around = all.within(0b111, around, |bits, _| bits & 0b110);
                let inner = around.within(0b101, inner, |bits, _| bits);
                let (mut a, mut b) = ([0; 4], [0; 4]);
                around.write(&mut a);
                inner.write(&mut b);
                assert!(a.iter().zip(b).all(|(around, inner)| inner & !around == 0));
            }
        }
    }

    #[test]
    fn without_a_range_all_values_are_wanted() {
        assert!(Focused::near(&[u64::MAX; 4], Nearness::Surface).is_none());
        let all = Focused::read(&[u64::MAX; Focused::WORDS]);
        for range in [Interval::ANYTHING, range(0.0, 0.0)] {
            let mut row = [0; 4];
            all.within(0b1, range, |bits, _| bits).write(&mut row);
            assert!(Focused::near(&row, Nearness::Surface).is_none());
        }
    }
}
