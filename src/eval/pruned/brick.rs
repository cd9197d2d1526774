//! Samples of a brick in a pruned program, block by block.

use super::block::{self, SIDE, Yield};
use super::code::Form;
use super::cut::Row;
use super::focus::{Nearness, Whose};
use super::{BoundPruned, PrunedWorkspace, Shared};
use crate::eval::interpret::LANES;
use crate::eval::interpret::rows::View;
use crate::eval::sampler::{BRICK, BrickSigns};
use crate::expr::{Failure, NodeId};

impl BoundPruned {
    /// The coordinates of block `block` of `brick`.
    fn block_at(&self, brick: [u32; 3], block: usize) -> Option<[&[f64; SIDE]; 3]> {
        let along = |axis: usize| {
            let first = brick[axis] as usize * BRICK + (block >> axis & 1) * SIDE;
            self.coordinates[axis].get(first..)?.first_chunk::<SIDE>()
        };
        Some([along(0)?, along(1)?, along(2)?])
    }

    /// Samples the blocks of `brick` with the cut of `form` that `row` leaves.
    fn sample_whole(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        brick: [u32; 3],
        (form, root, row): (Form, NodeId, &[u64]),
        mut receive: impl FnMut(usize, View<'_>),
    ) -> Result<(), Failure> {
        let PrunedWorkspace { cutter, other, blocks, taken, .. } = workspace;
        if !matches!(taken, Some((own, from)) if *own == form && from == row) {
            cutter.cut(shared.code, form, &[root], &Row(row), other);
            let yields = if form == Form::Sign { Yield::Signs } else { Yield::Values };
            blocks.take(shared, other, yields);
            *taken = Some((form, row.to_vec()));
        }
        for block in 0..LANES {
            if let Some(at) = self.block_at(brick, block) {
                blocks.sample(shared.oracles(), at, |view| receive(block, view))?;
            }
        }
        Ok(())
    }

    /// See [`Sampler::signs`](crate::eval::Sampler::signs).
    pub(in crate::eval) fn signs(
        &self,
        workspace: &mut PrunedWorkspace,
        brick: [u32; 3],
        row: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let root = shared.code.sign;
        self.focus(workspace, shared, brick, row, Nearness::Sign);
        if workspace.focus.cut == Whose::Row {
            let of = (Form::Sign, root, row);
            return self.sample_whole(workspace, shared, brick, of, |block, view| {
                pack(block, view, signs);
            });
        }
        let PrunedWorkspace { cutter, other, blocks, taken, near, focus, .. } = workspace;
        *taken = None;
        for block in 0..LANES {
            if focus.cut == Whose::Block {
                let range = focus.ranges[block];
                if range.is_inside() || range.is_outside() && !range.nan {
                    fill(block, range.is_inside(), signs);
                    continue;
                }
                let guide = focus.choices.within(block);
                cutter.cut(shared.code, Form::Sign, &[root], &guide, other);
                blocks.take(shared, other, Yield::Signs);
            } else if block == 0 {
                cutter.cut(shared.code, Form::Sign, &[root], &near.within(0), other);
                blocks.take(shared, other, Yield::Signs);
            }
            if let Some(at) = self.block_at(brick, block) {
                blocks.sample(shared.oracles(), at, |view| pack(block, view, signs))?;
            }
        }
        Ok(())
    }

    /// See [`Sampler::values`](crate::eval::Sampler::values).
    pub(in crate::eval) fn values(
        &self,
        workspace: &mut PrunedWorkspace,
        brick: [u32; 3],
        row: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let of = (Form::Sampled, shared.code.lowered.root, row);
        self.sample_whole(workspace, shared, brick, of, |block, view| {
            let mut own = [0.0; block::FULL];
            view.copy_rows_to::<{ SIDE * SIDE }>(&mut own);
            for (line, from) in own.as_chunks::<SIDE>().0.iter().enumerate() {
                values[BRICK * row_of(block, line) + SIDE * (block & 1)..][..SIDE]
                    .copy_from_slice(from);
            }
        })
    }
}

/// The row of a brick in which line `line` of block `block` lies.
const fn row_of(block: usize, line: usize) -> usize {
    let (y, z) = (line % SIDE + SIDE * (block >> 1 & 1), line / SIDE + SIDE * (block >> 2 & 1));
    z * BRICK + y
}

/// Sets all signs of a block.
fn fill(block: usize, inside: bool, signs: &mut BrickSigns) {
    for line in 0..SIDE * SIDE {
        put(block, line, if inside { u8::MAX } else { 0 }, signs);
    }
}

/// Sets the signs of a block from its values.
fn pack(block: usize, view: View<'_>, signs: &mut BrickSigns) {
    let bits = |values: &[f64]| {
        values.iter().zip(0..).fold(0, |word, (value, x)| word | u8::from(*value < 0.0) << x)
    };
    for line in 0..SIDE * SIDE {
        let (y, z) = (line % SIDE, line / SIDE);
        let word = match view {
            View::Rows { values, stride } => bits(&values[z * stride + y * SIDE..][..SIDE]),
            View::Splat { values, stride } => {
                if values[z * stride] < 0.0 {
                    u8::MAX
                } else {
                    0
                }
            }
        };
        put(block, line, word, signs);
    }
}

fn put(block: usize, line: usize, word: u8, signs: &mut BrickSigns) {
    let own = &mut signs[row_of(block, line)];
    let shift = SIDE * (block & 1);
    *own = *own & !(0xff << shift) | u16::from(word) << shift;
}
