//! Which sides of the choices matter somewhere, and what is kept of that from query to query.

use super::cut::Guide;
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// The sides of choices that are alive in each of up to eight boxes.
///
/// Memory of the size of the expression, of which what is not touched costs nothing.
#[derive(Debug)]
pub(super) struct Choices {
    stamp: u32,
    stamps: Vec<u32>,
    /// By choice: the boxes in which its first and its second side are alive.
    alive: Vec<[u8; 2]>,
}

impl Choices {
    /// Knows nothing of `count` choices.
    pub(super) fn new(count: usize) -> Self {
        Self { stamp: 1, stamps: vec![0; count], alive: vec![[0; 2]; count] }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        if self.stamp == u32::MAX {
            self.stamps.fill(0);
            self.stamp = 0;
        }
        self.stamp += 1;
    }

    /// Adds boxes in which the sides of choice `choice` are alive.
    pub(super) fn add(&mut self, choice: u32, boxes: [u8; 2]) {
        let at = choice as usize;
        // Several operations may make the choice, of which boxes need one or another.
        let before = if self.stamps[at] == self.stamp { self.alive[at] } else { [0, 0] };
        self.stamps[at] = self.stamp;
        self.alive[at] = [before[0] | boxes[0], before[1] | boxes[1]];
    }

    /// Takes the sides in `list` for those of one box.
    pub(super) fn load(&mut self, list: &[(u32, u8)]) {
        self.clear();
        list.iter().for_each(|&(choice, sides)| self.add(choice, [sides & 1, sides >> 1 & 1]));
    }

    /// The choices in box `number`.
    pub(super) fn within(&self, number: usize) -> Within<'_> {
        Within { choices: self, number }
    }
}

/// The choices in one box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Within<'a> {
    choices: &'a Choices,
    number: usize,
}

impl Guide for Within<'_> {
    #[inline]
    fn sides(&self, choice: u32) -> [bool; 2] {
        let Self { choices, number } = *self;
        let at = choice as usize;
        if choices.stamps[at] != choices.stamp {
            return [true, true];
        }
        match choices.alive[at].map(|boxes| boxes >> number & 1 == 1) {
            // What no one needed is not known.
            [false, false] => [true, true],
            sides => sides,
        }
    }
}

/// What matters in a brick near the surface.
#[derive(Debug)]
pub(super) struct Near {
    /// How far from zero the expression is right.
    pub(super) limit: f64,
    /// Choices with their sides that are alive: bit 0 for the first, bit 1 for the second.
    pub(super) sides: Box<[(u32, u8)]>,
}

/// What matters near the surface in bricks that were enclosed.
///
/// It saves looking at all that matters in a brick, most of it far from any surface, again and again.
/// What is known of a brick is the same whoever found it.
#[derive(Debug, Default)]
pub(super) struct Memo(Mutex<FxHashMap<[u32; 3], Arc<Near>>>);

impl Memo {
    /// Keeps what matters in `brick`.
    pub(super) fn insert(&self, brick: [u32; 3], near: Near) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(brick, Arc::new(near));
    }

    /// What matters in `brick`, if it is known.
    pub(super) fn get(&self, brick: [u32; 3]) -> Option<Arc<Near>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&brick).cloned()
    }
}
