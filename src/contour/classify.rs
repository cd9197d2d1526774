//! Which bricks have to be sampled, and whether what is kept of them fits into memory.
//!
//! Signs and numbers of sampled bricks are all that grows with the grid. Their number is foreseen
//! while boxes are still coarse, so that a grid beyond memory is refused in a moment, with the
//! numbers, and not when the memory is gone.

use super::grid::Grid;
use super::numbering::BrickNumbers;
use super::{Error, Settings};
use crate::eval::{BrickSigns, Sampler};
use crate::geom::Axis;
use crate::num::Progress;
use crate::num::memory::{self, Shortage};
use crate::octree::{Bricks, Interrupted, subdivide};

/// Bytes that a brick takes which is sampled: signs and numbers, its box and the one it came from.
const KEPT: u64 = (size_of::<BrickSigns>() + size_of::<BrickNumbers>() + 2 * 24) as u64;
/// Bytes of classes that eight bricks take, whatever they are.
const CLASSES: u64 = 5;

/// Finds the bricks that have to be sampled, if what is kept of them fits into memory.
pub(super) fn classify<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<Bricks, Error> {
    let lengths = Axis::ALL.map(|axis| grid.sampled(axis).len());
    if sampler.nodes() != lengths {
        return Err(Error::OtherGrid { sampler: sampler.nodes(), grid: lengths });
    }
    let total: u64 = grid.bricks().iter().map(|&n| u64::from(n)).product();
    let limit = match settings.memory {
        None => memory::available_for(total.saturating_mul(KEPT)),
        limit @ Some(_) => limit,
    };
    let classes = total / 8 * CLASSES;
    let needed = |bricks: u64| classes.saturating_add(bricks.saturating_mul(KEPT));
    let shortage =
        |bricks, available| Error::Memory(Shortage { needed: needed(bricks), available });
    let most = match limit {
        Some(limit) if classes > limit => return Err(shortage(0, limit)),
        Some(limit) => (limit - classes) / KEPT,
        None => u64::MAX,
    };
    subdivide(sampler, settings.pruning, most, progress).map_err(|cause| match cause {
        Interrupted::Failure(failure) => Error::Failure(failure),
        Interrupted::Cancelled(cancelled) => Error::Cancelled(cancelled),
        Interrupted::TooMany { bricks } => shortage(bricks, limit.unwrap_or(u64::MAX)),
    })
}
