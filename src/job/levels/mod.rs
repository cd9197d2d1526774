//! Solves for the levels at which solids have the densities asked for.
//!
//! Every [`Fraction`] of the solid asks that its level t give
//!
//! > V(t) - V(-∞) = r (V(∞) - V(-∞)),
//!
//! where V is the volume of the whole solid: V(∞) - V(-∞) is the part that the lattice is put in. It is
//! solved in two stages.
//!
//! * **Points.** The box is divided into cells, of which each lies in the part by a share that is found
//!   with the part's field and its slopes in the eighths of those that faces pass through ([`part`]).
//!   The values of the lattice's field at one point a cell, weighted by that, are sorted; the level is
//!   their r-quantile. Where no quadrature follows, as in programs with oracles, the cells that the
//!   level's surface may pass through get 8 to 216 points ([`shares`]), and twice the standard
//!   deviation of the share is stated as its error: 6e-5 for three to eight cells across a part, 1e-4
//!   for twenty, and 1e-3 where an expression is so long that one point a cell has to do. Levels of
//!   densities that vary in space take their curves from the same values, and their r from the mean
//!   over the part.
//! * **Quadrature.** Without oracles the level is improved by Newton's method, V and dV/dt being the
//!   quadrature of the field ([`quadrature`](crate::measure::quadrature)) on a grid that is refined until the
//!   fraction stays: to 2e-5, but only where the grid resolves walls and pores. How wide these are the
//!   points tell ([`Found::width`]), and quadrature that contradicts them is not believed. In lattices of many
//!   cells, of thin walls or of sharp creases the error is above 1e-4, or not known; there the level
//!   is found from many points as well, and the better of the two is taken.
//!
//! Several levels are solved for one after the other until no share changes; levels that do not settle are
//! an error. What is found is kept for the last parameter values and box; other values are solved for
//! from nothing, so that an answer does not depend on those before.

mod part;
mod shares;

use super::gradient::Field;
use super::{Error, Job, Settings};
use crate::contour::{self, Grid};
use crate::eval::interpret;
use crate::expr::depends::reachable;
use crate::expr::{Failure, Graph, NodeId, ParameterId};
use crate::geom::Aabb;
use crate::num::Progress;
use crate::solid::density::coefficients;
use crate::solid::motions::replace;
use crate::solid::{Fraction, Values};
use glam::DVec3;
use part::{Cells, Part, Points};
use rayon::prelude::*;
use shares::{Found, Shares};
use std::sync::{Mutex, PoisonError};

/// How many times the largest value of a field, or one, a level is that leaves everything in, and
/// minus it one that leaves nothing in: their sums keep nine digits.
const FAR: f64 = 1e6;

/// Why a density can't be had where a higher level does not leave more in.
const NO_PART: &str = "raising its level adds nothing to the whole. A skin may fill the part; \
    or a word after it turns it round, as `complement` and `difference` do, or takes its surface \
    alone, as `shell` and `thickness` do: ask for the share that remains";

/// Why a density can't be had where the level nearest to it leaves nothing in.
const NOTHING: &str = "at the level nearest to it nothing is left in. The field may jump past the \
    share, or the solid be thinner than the grid sees: give a smaller spacing";

/// Why densities can't be had together.
const UNSETTLED: &str = "its level and those of the other densities do not settle. Two densities \
    of the same lattice contradict each other: ask for one of them";

/// Cells in which that value is looked for, and the most that is made of it.
const PROBES: usize = 512;
const FARTHEST: f64 = 1e300;

/// Shares on two successive grids may differ by this; so may those before and after the other levels were
/// solved for, where their own errors are not larger.
const TOLERANCE: f64 = 2e-5;

/// A share this small is nothing asked for: a mean of zero, but for rounding.
const NONE: f64 = 1e-12;

/// An error of a share with which no better way is looked for.
const SUFFICIENT: f64 = 1e-4;

/// An excess of which one step of Newton's method leaves some 1e-8, so that levels follow
/// parameters smoothly: its slope is right to a thousandth.
const EXCESS: f64 = 1e-5;

/// Cells of the box where quadrature follows, and where it does not.
const CELLS: [usize; 2] = [1 << 15, 1 << 20];

/// Points evaluated together.
const BATCH: usize = 4096;

/// Cells along the longest side of the first grid of the quadrature, and how much finer the next is.
const FIRST: f64 = 40.0;
const FINER: f64 = 1.5;

/// Cells along the longest side of the last grid, unless the job's own is finer.
const LAST: f64 = 100.0;

/// By how much the range of the densities at the points is widened, of its length: more than a varying
/// density changes within a cell of [`CELLS`], of which there are 32 along a side.
const MARGIN: f64 = 1.0 / 16.0;

/// Widths of walls and pores, in distances between points, from which points tell them: scattered
/// over both alike, points would see widths of up to one distance in whatever is thinner.
const VISIBLE: f64 = 1.25;

/// The same in spacings of a grid, from which quadrature on the grid can be trusted.
const RESOLVED: f64 = 4.0;

/// By how many of their errors, which are two standard deviations, shares at points may differ from
/// those by quadrature.
const DEVIATIONS: f64 = 2.0;

/// Steps of the search on one grid, and passes over several levels.
const MOST_STEPS: usize = 48;
const MOST_PASSES: usize = 40;

/// A bracket so narrow, in units of the larger of its ends, that the share must jump in it.
const NARROW: f64 = 1e-9;

/// A quarter of the first step where there is no bracket and no slope, in units of the largest value.
const REACH: f64 = 1e-4;

/// A density that was solved for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Density {
    /// The share of the part that was asked for; the mean over the part where it varies.
    pub asked: f64,
    /// The share that the solid has, as it was measured.
    pub found: f64,
    /// How far the share may be from the truth.
    pub error: f64,
    /// The level, in units of the field: of the lattice, or what was added to its varying level.
    pub level: f64,
}

/// The levels found last, and what for.
#[derive(Debug, Default)]
pub(super) struct KeptLevels(Mutex<Option<Levels>>);

#[derive(Clone, Debug)]
struct Levels {
    /// The values of the named parameters, the box and the finest spacing.
    asked: (Vec<f64>, Aabb, f64),
    values: Vec<f64>,
    densities: Vec<Density>,
}

impl Job {
    /// The values of all parameters on `grid`, unknown levels included, and the densities reached.
    ///
    /// # Errors
    /// [`Error::Density`] where a density can't be had, or what [`Job::field_measures`] fails with.
    pub(super) fn solved(
        &self,
        grid: &Grid,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<(Vec<f64>, Vec<Density>), Error> {
        let values = self.values();
        let fractions = &self.solid.fractions;
        if fractions.is_empty() {
            return Ok((values, Vec::new()));
        }
        let named = values[..self.parameters().len()].to_vec();
        let (bounds, finest) = (grid.bounds(), super::longest_edge(grid));
        let asked = (named, bounds, finest);
        let kept = || self.levels.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept().as_ref().filter(|found| found.asked == asked) {
            return Ok((found.values.clone(), found.densities.clone()));
        }
        let far = self.far(bounds, &values)?;
        let mut search = Search { job: self, settings, progress, values, far };
        let densities = search.run(bounds, finest)?;
        let values = search.values;
        *kept() = Some(Levels { asked, values: values.clone(), densities: densities.clone() });
        Ok((values, densities))
    }
}

/// The search for the levels of one solid.
struct Search<'a> {
    job: &'a Job,
    settings: &'a Settings,
    progress: &'a Progress,
    /// The values of all parameters so far.
    values: Vec<f64>,
    /// A level that leaves everything in.
    far: f64,
}

/// What values at points are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Aim {
    /// A level to begin with: one point a cell.
    Start,
    /// The level itself: as many points as that takes.
    Answer,
}

/// What is known of one fraction at the points.
struct Seen {
    /// The share asked for: its mean over the part.
    asked: f64,
    /// The share at the level found, and how far it may be from the truth.
    found: f64,
    error: f64,
    /// How far the share at the level before is from that.
    moved: f64,
    /// Twice the volume over the area of the thinner of solid and void: how thick it is.
    width: f64,
}

impl Search<'_> {
    /// Finds the levels, which leave something in.
    fn run(&mut self, bounds: Aabb, finest: f64) -> Result<Vec<Density>, Error> {
        let found = self.search(bounds, finest)?;
        let nothing = self.job.solid.fractions.iter().zip(&found).find(|(_, d)| d.found <= 0.0);
        match nothing {
            Some((fraction, _)) => Err(self.job.no_density(fraction, NOTHING)),
            None => Ok(found),
        }
    }

    /// Finds the levels, from nothing: what was found for other values does not show.
    fn search(&mut self, bounds: Aabb, finest: f64) -> Result<Vec<Density>, Error> {
        let named = self.job.parameters().len();
        self.values[named..].fill(0.0);
        let [rough, fine] = CELLS.map(|count| Cells::new(bounds, count));
        if !self.job.graph.oracles().is_empty() {
            return self.by_points(fine, Aim::Answer).map(|seen| self.densities(&seen));
        }
        let seen = self.by_points(rough, Aim::Start)?;
        let by_quadrature = self.by_quadrature(bounds, finest, rough.longest(), &seen)?;
        let by_quadrature = match by_quadrature {
            Some(found) if self.is_seen(rough)? => Some(found),
            Some(_) | None => None,
        };
        let error = |found: &[Density]| found.iter().map(|d| d.error).fold(0.0, f64::max);
        if let Some(found) = by_quadrature.as_ref().filter(|found| error(found) <= SUFFICIENT) {
            return Ok(found.clone());
        }
        let before = self.values.clone();
        let seen = self.by_points(fine, Aim::Answer)?;
        let by_points = self.densities(&seen);
        match by_quadrature {
            Some(found) if error(&found) <= error(&by_points) => {
                self.values = before;
                Ok(found)
            }
            Some(_) | None => Ok(by_points),
        }
    }

    /// The densities at the levels that points gave.
    fn densities(&self, seen: &[Seen]) -> Vec<Density> {
        let density = |(fraction, seen): (&Fraction, &Seen)| Density {
            asked: seen.asked,
            found: seen.found,
            error: seen.error,
            level: self.values[fraction.level.index()],
        };
        self.job.solid.fractions.iter().zip(seen).map(density).collect()
    }

    /// Finds the levels from values in `cells`.
    fn by_points(&mut self, cells: Cells, aim: Aim) -> Result<Vec<Seen>, Error> {
        let fractions = &self.job.solid.fractions;
        if aim == Aim::Answer && fractions.len() > 1 {
            // Few points bring several levels together, and many are left with a step or two.
            self.by_points(cells, Aim::Start)?;
        }
        let mut pass = 0;
        loop {
            let seen: Vec<Seen> =
                fractions.iter().map(|f| self.look(f, cells, aim)).collect::<Result<_, _>>()?;
            pass += 1;
            let stays = |seen: &Seen| seen.moved <= seen.error.max(TOLERANCE);
            let is_settled = fractions.len() == 1 || pass > 1 && seen.iter().all(stays);
            if is_settled || aim == Aim::Start && pass == MOST_PASSES {
                return Ok(seen);
            }
            if pass == MOST_PASSES {
                return Err(self.unsettled(seen.iter().map(|seen| seen.moved)));
            }
        }
    }

    /// Whether the levels that quadrature found are those of points in `cells`, as far as these tell.
    fn is_seen(&mut self, cells: Cells) -> Result<bool, Error> {
        let found = self.values.clone();
        for fraction in &self.job.solid.fractions {
            let seen = self.look(fraction, cells, Aim::Start)?;
            self.values.clone_from(&found);
            if seen.moved > DEVIATIONS * seen.error {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The error of levels of which one still moves, `moved` telling by how much each does.
    fn unsettled(&self, moved: impl Iterator<Item = f64>) -> Error {
        let pairs = self.job.solid.fractions.iter().zip(moved);
        let (fraction, _) = pairs
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("levels are searched for where there are fractions");
        self.job.no_density(fraction, UNSETTLED)
    }

    /// The values with `level` in place of what is known of `slot`.
    fn with(&self, slot: ParameterId, level: f64) -> Vec<f64> {
        let mut values = self.values.clone();
        values[slot.index()] = level;
        values
    }

    /// Finds the level, and the curve, of `fraction` from its values in `cells`.
    fn look(&mut self, fraction: &Fraction, cells: Cells, aim: Aim) -> Result<Seen, Error> {
        let Fraction { level, family, target, curve, .. } = *fraction;
        let graph = &self.job.graph;
        let part = self.part(fraction, cells).map_err(failed)?;
        let at = part.scattered();
        let found = values_at(graph, &at, &[family, target], &self.values).map_err(failed)?;
        let [values, targets] = &found[..] else {
            return Err(self.job.no_density(fraction, "its field has no values"));
        };
        let Some(asked) = part.mean(targets) else {
            return Err(self.job.no_density(fraction, NO_PART));
        };
        if !(asked > NONE && asked < 1.0 - NONE) {
            let cause = format!("the share asked for is {asked} on average");
            return Err(self.job.no_density(fraction, &cause));
        }
        let shares = Shares::new(&part, values);
        let (shares, found) = if let Some(curve) = curve {
            let ends = ends_of(part.own(targets));
            let [least, greatest] = ends;
            let middle = 0.5 * (least + greatest);
            let coefficients =
                coefficients(|u| shares.level(middle + 0.5 * (greatest - least) * u));
            for (slot, end) in curve.ends.iter().zip(ends) {
                self.values[slot.index()] = end;
            }
            for (slot, value) in curve.coefficients.iter().zip(coefficients) {
                self.values[slot.index()] = value;
            }
            // How far values are above the level of a uniform lattice there.
            let above = |values: &[f64], targets: &[f64]| -> Vec<f64> {
                let level = |share: f64| {
                    let u = (2.0 * share - least - greatest) / (greatest - least);
                    polynomial(&coefficients, u.clamp(-1.0, 1.0))
                };
                values.iter().zip(targets).map(|(value, share)| value - level(*share)).collect()
            };
            let shares = Shares::new(&part, &above(values, targets));
            let found = self.level_of(&shares, asked, &[family, target], aim, |at| {
                let found = values_at(graph, at, &[family, target], &self.values)?;
                Ok(above(&found[0], &found[1]))
            });
            (shares, found)
        } else {
            let found = self.level_of(&shares, asked, &[family], aim, |at| {
                Ok(values_at(graph, at, &[family], &self.values)?.swap_remove(0))
            });
            (shares, found)
        };
        let Found { level: value, share: found, error, width } = found.map_err(failed)?;
        let moved = shares.between(self.values[level.index()], value);
        self.values[level.index()] = value;
        Ok(Seen { asked, found, error, moved, width })
    }

    /// The level below which `asked` lies. The values `sampled` are made of `outputs`.
    fn level_of(
        &self,
        shares: &Shares<'_>,
        asked: f64,
        outputs: &[NodeId],
        aim: Aim,
        sampled: impl Fn(&Points) -> Result<Vec<f64>, Failure> + Sync,
    ) -> Result<Found, Failure> {
        match aim {
            Aim::Start => Ok(shares.first(asked)),
            Aim::Answer => {
                let operations = reachable(&self.job.graph, outputs).len();
                shares.refined(asked, operations, sampled)
            }
        }
    }

    /// The part that the lattice of `fraction` is put in.
    fn part(&self, fraction: &Fraction, cells: Cells) -> Result<Part, Failure> {
        let mut graph = self.job.graph.clone();
        // Without the lattice little is left to evaluate.
        let [empty, full] = [self.far, -self.far].map(|value| {
            let far = graph.constant(value);
            replace(&mut graph, self.job.solid.field, fraction.field, far)
        });
        Part::new(graph, [empty, full], &self.values, cells)
    }

    /// Improves the levels by Newton's method on finer and finer grids. None if the last of them is too
    /// coarse for what was `seen` at points that are `apart`, or these for the solid.
    fn by_quadrature(
        &mut self,
        bounds: Aabb,
        finest: f64,
        apart: f64,
        seen: &[Seen],
    ) -> Result<Option<Vec<Density>>, Error> {
        let fractions = &self.job.solid.fractions;
        let longest = bounds.size().max_element();
        let last = (longest / finest).max(LAST);
        let width = seen.iter().map(|seen| seen.width).fold(f64::INFINITY, f64::min);
        // False for what is not a number.
        if !(width >= VISIBLE * apart && width * last >= RESOLVED * longest) {
            return Ok(None);
        }
        let mut cells = FIRST.min(last);
        let mut is_first = true;
        loop {
            let grid = Grid::new(bounds, DVec3::splat(longest / cells))?;
            let mut densities = Vec::new();
            let mut change = 0.0_f64;
            let mut pass = 0;
            loop {
                densities.clear();
                let mut moves = Vec::new();
                for (fraction, Seen { asked, .. }) in fractions.iter().zip(seen) {
                    let (density, before) = self.settle(fraction, *asked, &grid)?;
                    moves.push((before - density.found).abs());
                    densities.push(density);
                }
                let moved = moves.iter().copied().fold(0.0, f64::max);
                if pass == 0 {
                    change = moved;
                }
                pass += 1;
                if fractions.len() == 1 || pass > 1 && moved <= TOLERANCE {
                    break;
                }
                if pass == MOST_PASSES {
                    return Err(self.unsettled(moves.into_iter()));
                }
            }
            let is_finest = cells >= last;
            if !is_first && change <= TOLERANCE || is_finest {
                for density in &mut densities {
                    density.error = change.max(TOLERANCE);
                }
                return Ok(Some(densities));
            }
            is_first = false;
            cells = (cells * FINER).min(last);
        }
    }

    /// Solves for the level of one fraction on `grid`; also returns the share before that.
    ///
    /// Newton's method within a bracket; where the share jumps past the one asked for, the nearer side
    /// of the jump.
    fn settle(
        &mut self,
        fraction: &Fraction,
        asked: f64,
        grid: &Grid,
    ) -> Result<(Density, f64), Error> {
        let slot = fraction.level;
        let [low, high] = [-self.far, self.far].map(|far| self.with(slot, far));
        let [empty, _] = self.volume(low, &[], grid)?;
        let [full, _] = self.volume(high, &[], grid)?;
        let part = full - empty;
        if part <= 0.0 || part.is_nan() {
            return Err(self.job.no_density(fraction, NO_PART));
        }
        let mut level = self.values[slot.index()];
        let (mut below, mut above) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut reach = REACH * self.far / FAR;
        let mut first = None;
        // The level nearest to the one wanted so far, and the share there.
        let mut best: Option<(f64, f64)> = None;
        for _ in 0..MOST_STEPS {
            let [volume, rate] = self.volume(self.with(slot, level), &[slot], grid)?;
            let found = (volume - empty) / part;
            let excess = found - asked;
            first = first.or(Some(found));
            if excess.abs() <= EXCESS && rate > 0.0 {
                best = Some((level - excess * part / rate, asked));
                break;
            }
            if best.is_none_or(|(_, other)| excess.abs() < (other - asked).abs()) {
                best = Some((level, found));
            }
            if excess > 0.0 {
                above = level
            } else {
                below = level
            }
            let is_closed = below.is_finite() && above.is_finite();
            if is_closed && above - below <= NARROW * above.abs().max(below.abs()) {
                break;
            }
            let newton = level - excess * part / rate;
            level = if newton > below && newton < above {
                newton
            } else if is_closed {
                0.5 * (below + above)
            } else {
                reach *= 4.0;
                level - reach.copysign(excess)
            };
        }
        let (level, found) = best.unwrap_or((level, f64::NAN));
        self.values[slot.index()] = level;
        let density = Density { asked, found, error: TOLERANCE, level };
        Ok((density, first.unwrap_or(found)))
    }

    /// The volume of the solid, and its derivative by the first of `slots`.
    fn volume(
        &self,
        values: Vec<f64>,
        slots: &[ParameterId],
        grid: &Grid,
    ) -> Result<[f64; 2], Error> {
        let Job { graph, solid, program, rates, .. } = self.job;
        let field =
            Field { job: self.job, graph, field: solid.field, program, rates, grid, values };
        match field.volume(slots, self.settings, self.progress) {
            Ok((volume, by)) => Ok([volume, by.first().copied().unwrap_or(0.0)]),
            Err(Error::Empty { .. }) => Ok([0.0; 2]),
            Err(fault) => Err(fault),
        }
    }
}

impl Job {
    /// The means of `outputs`, nodes of `graph`, over the part that the lattice of `fraction` is put
    /// in, where parameters have these `values`: those over the points that its target is averaged over.
    ///
    /// # Errors
    /// [`Error::Contour`] if they can't be evaluated.
    pub(super) fn means_over_part(
        &self,
        fraction: &Fraction,
        grid: &Grid,
        values: &[f64],
        (graph, outputs): (&Graph, &[NodeId]),
        (settings, progress): (&Settings, &Progress),
    ) -> Result<Vec<f64>, Error> {
        let (bounds, values) = (grid.bounds(), values.to_vec());
        let far = self.far(bounds, &values)?;
        let search = Search { job: self, settings, progress, values, far };
        let means = || {
            let part = search.part(fraction, self.cells(bounds))?;
            let found = values_at(graph, &part.scattered(), outputs, &search.values)?;
            Ok(found.iter().map(|values| part.mean(values).unwrap_or(f64::NAN)).collect())
        };
        means().map_err(failed)
    }

    /// A level that leaves everything in of every lattice in `bounds`; minus it leaves nothing in.
    ///
    /// # Errors
    /// [`Error::Contour`] if a lattice can't be evaluated.
    pub(super) fn far(&self, bounds: Aabb, values: &[f64]) -> Result<f64, Error> {
        let families: Vec<NodeId> = self.solid.fractions.iter().map(|f| f.family).collect();
        let probes = Cells::new(bounds, PROBES).scattered();
        let found = values_at(&self.graph, &probes, &families, values).map_err(failed)?;
        let sizes = found.iter().flatten().map(|value| value.abs());
        let largest = sizes.filter(|size| size.is_finite()).fold(1.0, f64::max);
        Ok((FAR * largest).min(FARTHEST))
    }

    /// The cells in which the part that a lattice is put in is looked at.
    fn cells(&self, bounds: Aabb) -> Cells {
        Cells::new(bounds, CELLS[usize::from(!self.graph.oracles().is_empty())])
    }

    /// The error of a density that can't be had, and why.
    fn no_density(&self, fraction: &Fraction, cause: &str) -> Error {
        let mut values = Values::new(&self.graph, &[]);
        let share =
            values.of(fraction.target).map_or_else(String::new, |share| format!(" {share}"));
        let message = format!("the density{share} can't be had: {cause}");
        Error::density(message, fraction.span, &self.sources)
    }
}

/// The error of an oracle that fails.
fn failed(failure: Failure) -> Error {
    Error::Contour(contour::Error::Failure(failure))
}

/// The least and the greatest of the densities `values` at points, widened by [`MARGIN`] and kept apart:
/// between the points and the part's faces densities are beyond those of the points.
fn ends_of(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let least = values.clone().fold(f64::INFINITY, f64::min);
    let greatest = values.fold(f64::NEG_INFINITY, f64::max);
    let margin = MARGIN * (greatest - least);
    let least = (least - margin).clamp(0.0, 1.0);
    [least, (greatest + margin).clamp(0.0, 1.0).max(least + TOLERANCE)]
}

/// The sum of Chebyshev polynomials with `coefficients` at `u`.
fn polynomial(coefficients: &[f64], u: f64) -> f64 {
    let (mut next, mut after) = (0.0, 0.0);
    for c in coefficients.iter().skip(1).rev() {
        (next, after) = (c + 2.0 * u * next - after, next);
    }
    coefficients[0] + u * next - after
}

/// The values of `outputs`, nodes of `graph`, at `points`: one list an output.
fn values_at(
    graph: &Graph,
    points: &Points,
    outputs: &[NodeId],
    values: &[f64],
) -> Result<Vec<Vec<f64>>, Failure> {
    let starts: Vec<usize> = (0..points[0].len()).step_by(BATCH).collect();
    let batch = |start: usize| -> Result<Vec<Vec<f64>>, Failure> {
        let end = points[0].len().min(start + BATCH);
        let at = points.each_ref().map(|line| &line[start..end]);
        let mut found = vec![vec![0.0; end - start]; outputs.len()];
        let mut out: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        interpret::points(graph, outputs, at, values, &mut out)?;
        Ok(found)
    };
    let batches = starts.into_par_iter().map(batch).collect::<Result<Vec<_>, _>>()?;
    let joined = |k: usize| batches.iter().flat_map(|batch| &batch[k]).copied().collect();
    Ok((0..outputs.len()).map(joined).collect())
}
