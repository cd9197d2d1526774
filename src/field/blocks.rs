//! A grid of samples cut into blocks, each of which one exact value may settle.
//!
//! Who only compares distances with levels needs few of them: a block is settled by the value in its
//! middle if the levels are farther from it than the block's corners, else it is cut in eight. Near
//! a level that leaves two or three values for every cell of the level's surface, where a brick of
//! sixteen samples a side has sixteen.

use std::ops::Range;

/// Samples along a side of the blocks that are not cut further.
pub const SMALLEST: usize = 2;

/// A block: the numbers of its samples along each axis.
pub type Block = [Range<usize>; 3];

/// Puts the parts of `block` on `stack`: each axis halved that has more than [`SMALLEST`] samples.
#[inline(always)]
pub fn cut(block: &Block, stack: &mut Vec<Block>) {
    let halves = block.each_ref().map(|range| {
        if range.len() > SMALLEST {
            // An even number of samples to the first, so that the last blocks are full.
            let middle = range.start + (range.len().div_ceil(2)).next_multiple_of(SMALLEST);
            let middle = middle.min(range.end - 1);
            [range.start..middle, middle..range.end]
        } else {
            [range.clone(), 0..0]
        }
    });
    let [x, y, z] = &halves;
    for z in z.iter().filter(|range| !range.is_empty()) {
        for y in y.iter().filter(|range| !range.is_empty()) {
            for x in x.iter().filter(|range| !range.is_empty()) {
                stack.push([x.clone(), y.clone(), z.clone()]);
            }
        }
    }
}

/// Whether `block` is not cut further.
#[inline(always)]
#[must_use]
pub fn is_smallest(block: &Block) -> bool {
    block.iter().all(|range| range.len() <= SMALLEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_cut_into_parts_that_hold_every_sample_once() {
        for counts in [[16, 16, 16], [17, 3, 5], [1, 1, 40], [2, 1, 1], [3, 3, 3]] {
            let mut seen = vec![0; counts.iter().product()];
            let mut stack = vec![counts.map(|count| 0..count)];
            while let Some(block) = stack.pop() {
                if !is_smallest(&block) {
                    let before = stack.len();
                    cut(&block, &mut stack);
                    assert!(stack.len() > before + 1);
                    continue;
                }
                let [x, y, z] = block;
                for k in z {
                    for j in y.clone() {
                        for i in x.clone() {
                            seen[(k * counts[1] + j) * counts[0] + i] += 1;
                        }
                    }
                }
            }
            assert!(seen.iter().all(|times| *times == 1), "{counts:?}");
        }
    }
}
