//! Activity words of many boxes, each distinct row kept once.

use rustc_hash::FxHashMap;

/// Number of a row in [`Activities`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ActivityId(u32);

impl ActivityId {
    /// The row in which every region is active.
    pub const ALL: Self = Self(0);

    /// The row at that position of its table.
    pub(super) const fn new(position: u32) -> Self {
        Self(position)
    }

    /// Position of the row among those of its table.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Distinct rows of activity words.
///
/// Boxes next to one another mostly have the same row; small boxes of a large union have few
/// words that are not zero, and only those are kept: a row is stored as a bit map of its nonzero
/// words, then these words.
#[derive(Clone, Debug)]
pub struct Activities {
    words: usize,
    rows: Vec<Box<[u64]>>,
    numbers: FxHashMap<Box<[u64]>, u32>,
}

impl Activities {
    /// Holds [`ActivityId::ALL`] for rows of `words` words.
    #[must_use]
    pub fn new(words: usize) -> Self {
        let mut table = Self { words, rows: Vec::new(), numbers: FxHashMap::default() };
        table.insert(&vec![u64::MAX; words]);
        table
    }

    /// Words in a row.
    #[must_use]
    pub fn words(&self) -> usize {
        self.words
    }

    /// The number of `row`, a new one if it is new.
    pub fn insert(&mut self, row: &[u64]) -> ActivityId {
        let mut packed = vec![0; self.words.div_ceil(64)];
        for (w, _) in row.iter().enumerate().filter(|(_, word)| **word != 0) {
            packed[w / 64] |= 1 << (w % 64);
        }
        packed.extend(row.iter().filter(|word| **word != 0));
        self.insert_packed(packed.into_boxed_slice())
    }

    /// Adds the rows of `other`; the result maps its numbers to numbers here.
    pub fn absorb(&mut self, other: Self) -> Vec<ActivityId> {
        other.rows.into_iter().map(|row| self.insert_packed(row)).collect()
    }

    /// Writes row `id` to `row`, which has [`words`](Self::words) words.
    pub fn expand(&self, id: ActivityId, row: &mut [u64]) {
        let (map, mut rest) = self.rows[id.0 as usize].split_at(self.words.div_ceil(64));
        for (w, word) in row.iter_mut().enumerate() {
            *word = 0;
            if map[w / 64] >> (w % 64) & 1 == 1
                && let Some((first, others)) = rest.split_first()
            {
                (*word, rest) = (*first, others);
            }
        }
    }

    fn insert_packed(&mut self, packed: Box<[u64]>) -> ActivityId {
        let next = self.rows.len() as u32;
        let number = *self.numbers.entry(packed).or_insert_with_key(|packed| {
            self.rows.push(packed.clone());
            next
        });
        ActivityId(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_are_kept_once() {
        for words in [0, 1, 3, 64, 65, 200] {
            let mut table = Activities::new(words);
            let mut row = vec![0u64; words];
            let mut seen = Vec::new();
            for k in 0..words {
                row[k] = 1 << (k % 64);
                row[words / 2] ^= u64::MAX;
                let id = table.insert(&row);
                assert_eq!(table.insert(&row), id);
                seen.push((id, row.clone()));
            }
            let mut copy = Activities::new(words);
            let map = copy.absorb(table.clone());
            for (id, row) in seen {
                let mut back = vec![7; words];
                table.expand(id, &mut back);
                assert_eq!(back, row);
                copy.expand(map[id.index()], &mut back);
                assert_eq!(back, row);
            }
            let mut all = vec![0; words];
            table.expand(ActivityId::ALL, &mut all);
            assert!(all.iter().all(|w| *w == u64::MAX));
        }
    }
}
