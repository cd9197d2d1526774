//! A set of numbers below a bound, with the rank of each member.

/// A bit set that answers "how many members are below this one" in constant time.
///
/// Takes 1.5 bits a number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RankedBits {
    words: Vec<u64>,
    /// Members below each word.
    below: Vec<u32>,
    len: usize,
}

impl RankedBits {
    /// The set whose members are the set bits of `words`, bit `i` of word `w` being `64 w + i`.
    #[must_use]
    pub fn new(words: Vec<u64>) -> Self {
        let mut len = 0;
        let below = words
            .iter()
            .map(|word| {
                let here = len as u32;
                len += word.count_ones() as usize;
                here
            })
            .collect();
        Self { words, below, len }
    }

    /// Number of members.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no member.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether `number` is a member.
    #[must_use]
    #[inline]
    pub fn contains(&self, number: usize) -> bool {
        self.words[number / 64] >> (number % 64) & 1 == 1
    }

    /// How many members are below `number`, if it is one itself.
    #[must_use]
    #[inline]
    pub fn rank(&self, number: usize) -> Option<usize> {
        let (word, bit) = (self.words[number / 64], number % 64);
        let below = (word & ((1 << bit) - 1)).count_ones();
        (word >> bit & 1 == 1).then_some((self.below[number / 64] + below) as usize)
    }

    /// The words of the set.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// The members in order, from the one of rank `first` on.
    pub fn iter_from(&self, first: usize) -> impl Iterator<Item = usize> + '_ {
        let start = self.below.partition_point(|&below| below as usize <= first).saturating_sub(1);
        let skipped = first - self.below.get(start).map_or(0, |&below| below as usize);
        self.words[start..]
            .iter()
            .enumerate()
            .flat_map(move |(w, &word)| Bits(word).map(move |bit| 64 * (start + w) + bit))
            .skip(skipped)
    }
}

/// The positions of the set bits of a word, from the lowest on.
struct Bits(u64);

impl Iterator for Bits {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let bit = self.0.trailing_zeros() as usize;
        (self.0 != 0).then(|| {
            self.0 &= self.0 - 1;
            bit
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_count_the_members_below() {
        let members = [0, 3, 63, 64, 200, 511];
        let mut words = vec![0u64; 8];
        for m in members {
            words[m / 64] |= 1 << (m % 64);
        }
        let set = RankedBits::new(words);
        assert_eq!(set.len(), members.len());
        for number in 0..512 {
            assert_eq!(set.rank(number), members.iter().position(|&m| m == number));
        }
        for first in 0..=members.len() {
            assert!(set.iter_from(first).eq(members[first..].iter().copied()), "{first}");
        }
    }
}
