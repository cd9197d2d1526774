//! The signs of a field at the nodes of a grid: all that the topology of its mesh depends on.
//!
//! [`survey`] samples them as [`contour`](super::contour()) does and shows them to whoever asks
//! what hangs together. What is settled by intervals is not sampled.

use super::assemble::{Clocks, Scene, TASK, Worker, sample};
use super::bits::OUTSIDE;
use super::classify::classify;
use super::{Error, Grid, Report, Settings};
use crate::eval::{BRICK, BrickSigns, Sampler};
use crate::num::Progress;
use crate::octree::{Bricks, Pool};
use rayon::prelude::*;
use std::time::Instant;

/// Which nodes of a grid are inside.
#[derive(Clone, Copy, Debug)]
pub struct Signs<'a> {
    cells: [usize; 3],
    bricks: &'a Bricks,
    /// Signs of the active bricks, in order.
    signs: &'a [BrickSigns],
}

impl<'a> Signs<'a> {
    pub(super) fn new(grid: &Grid, bricks: &'a Bricks, signs: &'a [BrickSigns]) -> Self {
        Self { cells: grid.cells(), bricks, signs }
    }

    /// Nodes along each axis.
    #[must_use]
    pub fn nodes(&self) -> [usize; 3] {
        self.cells.map(|n| n + 1)
    }

    /// Where the signs change along the row of nodes at `y` and `z`: replaces `ends` by the place
    /// after each run of nodes of one sign, the last being the number of nodes. Returns whether the
    /// first run is inside.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn runs(&self, y: usize, z: usize, ends: &mut Vec<u32>) -> bool {
        let nodes = self.nodes();
        assert!(y < nodes[1] && z < nodes[2], "there is no row {y}, {z}");
        ends.clear();
        // Node i is at position i + 1 of the padded grid.
        let [y, z] = [y + 1, z + 1];
        let counts = self.bricks.counts.map(|n| n as usize);
        let row = counts[0] * (y / BRICK + counts[1] * (z / BRICK));
        let place = z % BRICK * BRICK + y % BRICK;
        let first = self.word(row, place) >> 1 & 1;
        let mut before = first;
        for brick in 0..counts[0] {
            let word = self.word(row + brick, place);
            let mut changes = word ^ (word << 1 | before);
            before = word >> (BRICK - 1);
            while changes != 0 {
                let at = brick * BRICK + changes.trailing_zeros() as usize;
                changes &= changes - 1;
                // The first position is a ghost, and so are those after the last node.
                if at > 1 && at <= nodes[0] {
                    ends.push(at as u32 - 1);
                }
            }
        }
        ends.push(nodes[0] as u32);
        first == 1
    }

    /// Signs of sixteen nodes along x.
    fn word(&self, brick: usize, place: usize) -> u16 {
        match self.bricks.active.rank(brick) {
            Some(rank) => self.signs[rank][place],
            None if self.bricks.inside[brick / 64] >> (brick % 64) & 1 == 1 => u16::MAX,
            None => 0,
        }
    }
}

/// What `work` makes of the signs of the field that `sampler` has bound to [`Grid::tables`].
///
/// The report counts no vertices and no triangles.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
pub fn survey<S: Sampler, T>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
    work: impl FnOnce(&Signs<'_>) -> Result<T, Error>,
) -> Result<(T, Report), Error> {
    let start = Instant::now();
    let (bricks, mut report) = bricks(sampler, grid, settings, progress)?;
    let clocks = Clocks::default();
    let scene = Scene::new(sampler, grid, &bricks);
    let task = (bricks.active.len() / 64).clamp(4, TASK);
    progress.expect(bricks.active.len().div_ceil(task) as u64);
    let (pool, make) = (Pool::default(), || Worker::new(sampler));
    let (signs, nans) = sampled(&scene, &pool, make, task, progress, &clocks)?;
    report.nans = nans;
    let found = work(&Signs::new(grid, &bricks, &signs))?;
    clocks.report(&mut report.stages);
    report.stages.total = start.elapsed();
    Ok((found, report))
}

/// The bricks of the grid, and a report of them.
pub(super) fn bricks<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<(Bricks, Report), Error> {
    let start = Instant::now();
    let bricks = classify(sampler, grid, settings, progress)?;
    let mut report = Report {
        bricks: bricks.total() as u64,
        active_bricks: bricks.active.len() as u64,
        boxes: bricks.boxes,
        samples: bricks.active.len() as u64 * BRICK.pow(3) as u64,
        ..Report::default()
    };
    report.stages.subdivide = start.elapsed();
    Ok((bricks, report))
}

/// The signs of the active bricks, and how many samples were NaN; `pool` lends what `make` makes to
/// tasks of `task` bricks each.
pub(super) fn sampled<S: Sampler, M: AsMut<Worker<S::Workspace>> + Send>(
    scene: &Scene<'_, S>,
    pool: &Pool<M>,
    make: impl Fn() -> M + Sync,
    task: usize,
    progress: &Progress,
    clocks: &Clocks,
) -> Result<(Vec<BrickSigns>, u64), Error> {
    let mut signs = vec![OUTSIDE; scene.bricks.active.len()];
    let nans = signs
        .par_chunks_mut(task)
        .enumerate()
        .map(|(t, chunk)| {
            let work = |own: &mut M| sample(scene, own.as_mut(), t * task, chunk, clocks);
            let nans = pool.lend(&make, work)?;
            progress.advance(1)?;
            Ok(nans)
        })
        .sum::<Result<u64, Error>>()?;
    Ok((signs, nans))
}
