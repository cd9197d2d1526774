//! The level below which a share of a part lies, from values at scattered points.

use super::part::{Part, Points, scattered};
use super::{BATCH, TOLERANCE, VISIBLE};
use crate::expr::Failure;
use glam::DVec3;
use rayon::prelude::*;

/// What the error of a share should be at most, if the next three allow for it.
const AIM: f64 = 7e-5;

/// Most points a side of a cell.
const FINEST: usize = 6;

/// Most points in all, and most operations at all of them: a second or two.
const MOST: usize = 1 << 25;
const WORK: usize = 1 << 30;

/// How many times its error the share is looked for on both sides of the first one, at first and at
/// last.
const REACH: f64 = 4.0;
const FARTHEST: f64 = 1000.0;

/// Values in the cells of a part, one a cell.
pub(super) struct Shares<'a> {
    part: &'a Part,
    /// The value in each cell; NaN in those that are not near the part.
    values: Vec<f64>,
    /// The values in cells of the part, rising, with the weight of each and those below.
    sorted: Vec<(f64, f64)>,
    /// All weights together.
    whole: f64,
}

/// The level that leaves a share of a part below it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub level: f64,
    /// The share below it: not the one asked for where values jump.
    pub share: f64,
    /// How far that may be from the truth.
    pub error: f64,
    /// Twice the volume over the area of what lies below the level, or above it if that is less: how wide
    /// the walls or the pores are, by one value a cell.
    pub width: f64,
}

impl<'a> Shares<'a> {
    /// Orders the values in the cells near the part, `near` as [`Part::near`] lists them.
    pub fn new(part: &'a Part, near: &[f64]) -> Self {
        let own = part.near.iter().zip(near).map(|(&cell, &value)| (value, part.weights[cell]));
        let mut sorted: Vec<(f64, f64)> = own.filter(|(_, weight)| *weight > 0.0).collect();
        let whole = accumulate(&mut sorted);
        let mut values = vec![f64::NAN; part.weights.len()];
        for (&cell, &value) in part.near.iter().zip(near) {
            values[cell] = value;
        }
        Self { part, values, sorted, whole }
    }

    /// The level below which the share `share` lies, by one value a cell.
    pub fn level(&self, share: f64) -> f64 {
        level_at(&self.sorted, share * self.whole).unwrap_or(f64::NAN)
    }

    /// The same level, twice the standard deviation of the share, and the width.
    ///
    /// Whether the point of a cell that a face passes through lies below the level is chance, with a
    /// variance of 1/6 if the face may be anywhere. Those cells are as many as pairs of neighbours,
    /// along all axes, have a face between them.
    ///
    /// Pairs along an axis are also as many as the shadow of the faces along it covers sides of cells. The
    /// shadows along all three axes of a surface without direction are 3/2 of its area.
    pub fn first(&self, share: f64) -> Found {
        let level = self.level(share);
        let Part { cells, near, weights, .. } = self.part;
        let (mut crossed, mut shadows) = (0.0, 0.0);
        for axis in 0..3 {
            let has_face = |cell: &&usize| {
                let other = cells.next(**cell, axis);
                other
                    .is_some_and(|other| is_between(level, self.values[**cell], self.values[other]))
            };
            let mut weight = 0.0;
            for &cell in near.iter().filter(has_face) {
                weight += weights[cell];
                crossed += weights[cell] * weights[cell];
            }
            shadows += weight * cells.side(axis);
        }
        let below = weight_below(&self.sorted, level);
        let thinner = below.min(self.whole - below) * cells.volume();
        Found {
            level,
            share: below / self.whole,
            error: 2.0 * (crossed / 6.0).sqrt() / self.whole,
            width: 2.0 * thinner / (shadows / 1.5) * cells.longest(),
        }
    }

    /// The share between two levels, by one value a cell.
    pub fn between(&self, a: f64, b: f64) -> f64 {
        let [a, b] = [a, b].map(|level| weight_below(&self.sorted, level));
        (a - b).abs() / self.whole
    }

    /// The level with many more points in all cells that the surface of a level near it may pass
    /// through, if that is not too much work: `sampled` gives values by so many `operations` a point.
    ///
    /// A surface passes through a cell only if the level is no farther from its value than its
    /// neighbours' are: these are twice as far away as its corners. Where walls or pores are narrower
    /// than the cells can tell it may pass through any.
    ///
    /// # Errors
    /// What `sampled` fails with.
    pub fn refined(
        &self,
        share: f64,
        operations: usize,
        sampled: impl Fn(&Points) -> Result<Vec<f64>, Failure> + Sync,
    ) -> Result<Found, Failure> {
        let first = self.first(share);
        let mut own = self.own_with_changes();
        // What is not a number can't be seen either.
        let is_seen = first.width >= VISIBLE * self.part.cells.longest();
        if !is_seen {
            own.iter_mut().for_each(|(_, change)| *change = f64::INFINITY);
        }
        let mut reach = REACH;
        loop {
            let [lo, hi] = [-1.0, 1.0].map(|side| {
                let moved = share + side * reach * first.error.max(TOLERANCE);
                if moved <= 0.0 || moved >= 1.0 { side * f64::INFINITY } else { self.level(moved) }
            });
            let mut below = 0.0;
            let mut crossed = Vec::new();
            for &(cell, change) in &own {
                let value = self.values[cell];
                if value - change <= hi && value + change >= lo {
                    crossed.push(cell);
                } else if value < lo {
                    below += self.part.weights[cell];
                }
            }
            let most = MOST.min(WORK / operations.max(1));
            let Some(side) = side(first.error, crossed.len(), most) else { return Ok(first) };
            let batch = (BATCH / (side * side * side)).max(1);
            let some = |cells: &[usize]| self.scatter(cells, side, [lo, hi, first.level], &sampled);
            let batches = crossed.par_chunks(batch).map(some).collect::<Result<Vec<_>, _>>()?;
            let mut between = Vec::new();
            let mut variance = 0.0;
            for found in batches {
                below += found.below;
                variance += found.variance;
                between.extend(found.between);
            }
            let inner = accumulate(&mut between);
            let wanted = share * self.whole - below;
            if wanted >= 0.0 && wanted <= inner && !between.is_empty() || reach >= FARTHEST {
                let Some(level) = level_at(&between, wanted) else { return Ok(first) };
                let share = (below + weight_below(&between, level)) / self.whole;
                let error = 2.0 * variance.sqrt() / self.whole;
                return Ok(Found { level, share, error, width: first.width });
            }
            reach *= 4.0;
        }
    }

    /// The cells of the part, and how far the value of each is from those of its neighbours, at most.
    fn own_with_changes(&self) -> Vec<(usize, f64)> {
        let Part { cells, near, weights, .. } = self.part;
        // The maximum passes over NaN.
        let change = |cell: usize| {
            let others = cells.around(cell);
            others.map(|other| (self.values[other] - self.values[cell]).abs()).fold(0.0, f64::max)
        };
        let own = near.par_iter().filter(|cell| weights[**cell] > 0.0);
        own.map(|&cell| (cell, change(cell))).collect()
    }

    /// Sums over `cells`, each with `side` points a side.
    fn scatter(
        &self,
        cells: &[usize],
        side: usize,
        [lo, hi, middle]: [f64; 3],
        sampled: &impl Fn(&Points) -> Result<Vec<f64>, Failure>,
    ) -> Result<Scattered, Failure> {
        let count = side.pow(3);
        let corners: Vec<DVec3> = (0..count)
            .map(|k| [k % side, k / side % side, k / (side * side)].map(|i| i as f64))
            .map(DVec3::from_array)
            .collect();
        let mut shares = Vec::with_capacity(cells.len() * count);
        for cell in cells {
            let points = corners.iter().zip(scattered(cell * count));
            shares.extend(points.map(|(corner, share)| (*corner + share) / side as f64));
        }
        let of_cells = cells.iter().zip(shares.chunks(count));
        let points = of_cells
            .clone()
            .flat_map(|(&cell, shares)| shares.iter().map(move |share| (cell, *share)));
        let values = sampled(&self.part.cells.points(points))?;
        let mut sums = Scattered::default();
        let mut inside = Vec::with_capacity(count);
        for ((&cell, shares), values) in of_cells.zip(values.chunks(count)) {
            inside.clear();
            if let Some(eighths) = self.part.eighths(cell) {
                let is_in = |(_, share): &(_, &DVec3)| eighths.has(**share);
                inside.extend(values.iter().zip(shares).filter(is_in).map(|(value, _)| *value));
            } else {
                inside.extend_from_slice(values);
            }
            if inside.is_empty() {
                inside.push(self.values[cell]);
            }
            let weight = self.part.weights[cell] / inside.len() as f64;
            let crossed = crossings(values, side, middle) as f64 * side as f64 / (side - 1) as f64;
            sums.variance += crossed.min(count as f64) * weight * weight / 6.0;
            sums.below += weight * inside.iter().filter(|value| **value < lo).count() as f64;
            let between = inside.iter().filter(|value| (lo..=hi).contains(*value));
            sums.between.extend(between.map(|value| (*value, weight)));
        }
        Ok(sums)
    }
}

/// Points a side of each of `crossed` cells for the error aimed at, which is `error` with one, if two
/// a side are not more than `most` points.
fn side(error: f64, crossed: usize, most: usize) -> Option<usize> {
    let suits = |side: usize| error <= AIM * (side * side) as f64;
    let wanted = (2..FINEST).find(|&side| suits(side)).unwrap_or(FINEST);
    (2..=wanted).rev().find(|side| crossed * side.pow(3) <= most)
}

/// Whether the level lies between two values.
fn is_between(level: f64, a: f64, b: f64) -> bool {
    a < level && b >= level || b < level && a >= level
}

/// How many pairs of neighbours, `side` values a side of a cube, have the level between them.
fn crossings(values: &[f64], side: usize, level: f64) -> usize {
    let along = |step: usize| {
        let is_pair = move |i: &usize| i / step % side + 1 < side;
        let pairs = (0..values.len()).filter(is_pair);
        pairs.filter(|i| is_between(level, values[*i], values[i + step])).count()
    };
    along(1) + along(side) + along(side * side)
}

/// What the points of some cells add up to.
#[derive(Default)]
struct Scattered {
    /// The weight of the values below the range searched, and those within it with theirs.
    below: f64,
    between: Vec<(f64, f64)>,
    /// The variance of the weight below a level.
    variance: f64,
}

/// Sorts values with their weights, replaces weights by what lies below and the own together, and
/// returns all weights together.
fn accumulate(values: &mut [(f64, f64)]) -> f64 {
    values.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut sum = 0.0;
    for (_, weight) in values {
        sum += *weight;
        *weight = sum;
    }
    sum
}

/// The value below which the weight `below` lies, of at least one value: between neighbours, each of
/// which has half of its weight on either side.
fn level_at(sorted: &[(f64, f64)], below: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let own = sorted.partition_point(|(_, sum)| *sum < below).min(last);
    let before = if own == 0 { 0.0 } else { sorted[own - 1].1 };
    let (value, sum) = sorted[own];
    let part = ((below - before) / (sum - before)).clamp(0.0, 1.0) - 0.5;
    let next = sorted[if part < 0.0 { own.saturating_sub(1) } else { (own + 1).min(last) }].0;
    Some(value + part.abs() * (next - value))
}

/// The weight of the values less than `level`.
fn weight_below(sorted: &[(f64, f64)], level: f64) -> f64 {
    let count = sorted.partition_point(|(value, _)| *value < level);
    count.checked_sub(1).map_or(0.0, |last| sorted[last].1)
}
