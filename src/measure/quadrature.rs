//! Volume, area and derivatives of the solid itself, straight from the field, with an error.
//!
//! The solid {f < 0} in the grid's box is cut cell by cell: where a cell's corners differ in sign, the
//! crossings of its edges, roots of the field to rounding, span flat pieces. No vertex is numbered
//! and no triangle kept. Let h be the spacing. On a smooth surface the pieces miss the surface by a
//! part of h² that depends on its curvature, so a quantity Q has Q_h = Q + c h² + …; the same sum
//! over cells of twice the size, with a quarter of the same crossings, has four times the error, and
//!
//! > Q = Q_h + (Q_h - Q_2h) / 3
//!
//! is what is returned (Richardson's extrapolation). c is not quite constant: it depends on how the
//! surface meets the cells, evenly spread where the surface is curved.
//!
//! **Order.** Volume and area are of second order at least for smooth surfaces, and close to fourth
//! where they do not meet the box. At creases cells are cut off: the volume stays of second order,
//! the area and the derivatives become of first. A part thinner than a cell is not seen.
//!
//! **Error.** [`Estimate::error`] has two parts. One is |Q_h - Q_2h|, three times the correction. The
//! other adds up over the pieces what a crease may hide, where nothing cancels: with t the angle
//! between a piece and the field's gradient at its corners, area A and longest side s, it is
//!
//! > A s tan(t) / 4 of volume and A (1 / cos(t) - 1) of area:
//!
//! what a piece cuts off a right-angled crease, and more than the bulge of a surface of that slope.
//! Without it faces along the grid would deceive, which cut off the same at both sizes. On smooth
//! surfaces both parts fall with h². The sum is an estimate and no bound: tests hold it to closed
//! forms over many sizes and places. It knows nothing of parts that no node sees.
//!
//! **Derivatives.** The volume changes with a parameter p as
//!
//! > dV/dp = ∮ -f_p / |grad f| dA + (flat cuts) ∮ (normal velocity of the plane) dA,
//!
//! since a point of {f = 0} moves along grad f / |grad f| with -f_p / |grad f|. The integrand is taken
//! at the crossings and averaged over each flat piece. Unlike [`gradient`](super::gradient()) this is
//! the derivative of the solid's volume, not of a sum over the grid: the two differ by the sum's error.
//!
//! Source: Richardson 1911, doi:10.1098/rsta.1911.0009; the surface integral is Reynolds' transport
//! theorem.

use super::gradient::{BATCH, Crossings, CrossingsMemory, GridMotion};
use crate::contour::sweep::{Patch, Visitor, is_own, sweep};
use crate::contour::{Error, Grid, Report, Settings};
use crate::eval::Sampler;
use crate::eval::rates::BoundRates;
use crate::eval::sampler::Failure;
use crate::geom::Axis;
use crate::num::Progress;
use glam::DVec3;

/// Least cosine between a piece and the gradient at its corners that is told apart: a steeper
/// crease is a part thinner than the cell.
const LEAST_COSINE: f64 = 0.2;

/// A number with its likely error.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// How far it may be from the truth; an estimate and no bound.
    pub error: f64,
}

/// Volume and area of a solid, and derivatives of its volume.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FieldMeasures {
    /// Volume in the grid's box, in cubed model units.
    pub volume: Estimate,
    /// Area of the surface, flat cuts by the box included, in squared model units.
    pub area: Estimate,
    /// Derivatives of the volume, one entry a parameter asked for.
    pub volume_by: Vec<Estimate>,
    /// Crossings without a velocity, where the field jumps or is flat.
    pub unresolved: u64,
}

/// Volume and area of the solid whose field `sampler` has bound to [`Grid::tables`], and the
/// derivatives of the volume by the parameters of `rates`, perhaps none.
///
/// `rates` have the derivatives across the edges too and are bound to the same tables and values as
/// the sampler; `motions` say how each parameter moves the box.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
///
/// # Panics
/// If the rates have another number of outputs than the motions ask for.
pub fn quadrature<S: Sampler>(
    sampler: &S,
    rates: &BoundRates,
    motions: &[GridMotion],
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<(FieldMeasures, Report), Error> {
    let (total, report) =
        summed(sampler, (rates, motions), Errors::Estimated, grid, settings, progress)?;
    let Sums { levels: [fine, coarse], hidden, .. } = &total;
    let measures = FieldMeasures {
        volume: extrapolated(fine.volume, coarse.volume, hidden.volume),
        area: extrapolated(fine.area, coarse.area, hidden.area),
        volume_by: (fine.volume_by.iter().zip(&coarse.volume_by).zip(&hidden.volume_by))
            .map(|((fine, coarse), hidden)| extrapolated(*fine, *coarse, *hidden))
            .collect(),
        unresolved: total.unresolved,
    };
    Ok((measures, report))
}

/// The volume as [`quadrature`] finds it, and its derivatives, without saying how far they are from the
/// truth: for those who solve for a volume.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
///
/// # Panics
/// If the rates have another number of outputs than the motions ask for.
pub fn volume<S: Sampler>(
    sampler: &S,
    rates: &BoundRates,
    motions: &[GridMotion],
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<((f64, Vec<f64>), Report), Error> {
    let (total, report) =
        summed(sampler, (rates, motions), Errors::Ignored, grid, settings, progress)?;
    let Sums { levels: [fine, coarse], .. } = &total;
    let value = |fine: f64, coarse: f64| extrapolated(fine, coarse, 0.0).value;
    let by = fine.volume_by.iter().zip(&coarse.volume_by);
    let by = by.map(|(fine, coarse)| value(*fine, *coarse)).collect();
    Ok(((value(fine.volume, coarse.volume), by), report))
}

/// What is added up over all bricks.
fn summed<S: Sampler>(
    sampler: &S,
    (rates, motions): (&BoundRates, &[GridMotion]),
    errors: Errors,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<(Sums, Report), Error> {
    assert_eq!(rates.outputs(), 4 + motions.len(), "rates suit the motions");
    let ends = Axis::ALL.map(|axis| {
        let line = grid.placed(axis);
        [line[0], line[line.len() - 1]]
    });
    let origin = DVec3::from_array(ends.map(|[lo, hi]| 0.5 * (lo + hi)));
    let crossings = Crossings::new(rates, grid);
    let visitor = Cutter { crossings, motions, errors, ends, origin };
    let (sums, report) = sweep(sampler, grid, settings, progress, &visitor)?;
    let mut total = visitor.zero();
    for part in sums {
        total.unresolved += part.unresolved;
        for (all, part) in total.levels.iter_mut().zip(part.levels) {
            all.add(&part);
        }
        total.hidden.add(&part.hidden);
    }
    Ok((total, report))
}

/// The limit of a sequence of second order, from its terms at h and 2 h and what creases may hide.
fn extrapolated(fine: f64, coarse: f64, hidden: f64) -> Estimate {
    let change = fine - coarse;
    Estimate { value: fine + change / 3.0, error: change.abs() + hidden }
}

/// What the pieces of one size add up to.
#[derive(Clone, Debug)]
struct Level {
    volume: f64,
    area: f64,
    volume_by: Vec<f64>,
}

impl Level {
    fn add(&mut self, other: &Self) {
        self.volume += other.volume;
        self.area += other.area;
        for (all, part) in self.volume_by.iter_mut().zip(&other.volume_by) {
            *all += part;
        }
    }
}

/// Sums of the fine and the coarse pieces.
#[derive(Clone, Debug)]
struct Sums {
    levels: [Level; 2],
    /// What creases may hide.
    hidden: Level,
    unresolved: u64,
}

/// Whether it is found out how far sums are from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Errors {
    Estimated,
    Ignored,
}

struct Cutter<'a> {
    crossings: Crossings<'a>,
    motions: &'a [GridMotion],
    errors: Errors,
    /// Ends of the box along each axis.
    ends: [[f64; 2]; 3],
    /// The point that tetrahedra share.
    origin: DVec3,
}

/// Memory of a [`Cutter`].
struct Memory {
    crossings: CrossingsMemory,
    /// Outward unit normals of the vertices; zero where they have none.
    normals: Vec<DVec3>,
    /// Normal velocities of the vertices, one run of them a parameter.
    velocities: Vec<f64>,
}

impl Visitor for Cutter<'_> {
    type Memory = Memory;
    type Sum = Sums;
    const COARSE: bool = true;

    fn memory(&self) -> Memory {
        let crossings = self.crossings.memory();
        Memory { crossings, normals: Vec::new(), velocities: Vec::new() }
    }

    fn zero(&self) -> Sums {
        let volume_by = vec![0.0; self.motions.len()];
        let level = Level { volume: 0.0, area: 0.0, volume_by };
        Sums { levels: [level.clone(), level.clone()], hidden: level, unresolved: 0 }
    }

    fn visit(&self, memory: &mut Memory, patch: &Patch<'_>, sum: &mut Sums) -> Result<(), Failure> {
        if self.errors == Errors::Estimated || !self.motions.is_empty() {
            sum.unresolved += velocities(&self.crossings, self.motions.len(), memory, patch)?;
        }
        let pieces = [patch.triangles, patch.coarse];
        for (level, triangles) in sum.levels.iter_mut().zip(pieces) {
            self.include(patch, triangles, &memory.velocities, level);
        }
        if self.errors == Errors::Estimated {
            self.suspect(patch, memory, &mut sum.hidden);
        }
        Ok(())
    }
}

impl Cutter<'_> {
    /// Adds the pieces `triangles` of a patch.
    fn include(
        &self,
        patch: &Patch<'_>,
        triangles: &[[u32; 3]],
        velocities: &[f64],
        level: &mut Level,
    ) {
        let (mut volume, mut area) = (0.0, 0.0);
        for corners in triangles {
            let [a, b, c] = corners.map(|v| DVec3::from_array(patch.positions[v as usize]));
            let double = (b - a).cross(c - a);
            let doubled_area = double.length();
            volume += (a - self.origin).dot(double);
            area += doubled_area;
            if self.motions.is_empty() {
                continue;
            }
            let cut = self.cut([a, b, c]);
            for (k, (motion, by)) in self.motions.iter().zip(&mut level.volume_by).enumerate() {
                let speed = match cut {
                    Some((axis, End::Lower)) => -motion.lo[axis],
                    Some((axis, End::Upper)) => motion.hi[axis],
                    None => {
                        let own = &velocities[k * patch.positions.len()..];
                        corners.iter().map(|v| own[*v as usize]).sum::<f64>() / 3.0
                    }
                };
                *by += 0.5 * doubled_area * speed;
            }
        }
        level.volume += volume / 6.0;
        level.area += 0.5 * area;
    }

    /// Adds what creases under the fine pieces of a patch may hide.
    fn suspect(&self, patch: &Patch<'_>, memory: &Memory, hidden: &mut Level) {
        let stride = patch.positions.len();
        for corners in patch.triangles {
            let [a, b, c] = corners.map(|v| DVec3::from_array(patch.positions[v as usize]));
            if self.cut([a, b, c]).is_some() {
                continue;
            }
            let double = (b - a).cross(c - a);
            let area = 0.5 * double.length();
            let normal = double.normalize_or_zero();
            let side = (b - a).length().max((c - b).length()).max((a - c).length());
            let (mut tangent, mut excess, mut sine) = (0.0, 0.0, 0.0);
            for v in corners {
                let own = memory.normals[*v as usize];
                // A vertex without normal says nothing; no angle counts as more than this.
                let cosine = if own == DVec3::ZERO { 1.0 } else { normal.dot(own) };
                let cosine = cosine.clamp(LEAST_COSINE, 1.0);
                let own_sine = (1.0 - cosine * cosine).sqrt();
                sine += own_sine / 3.0;
                tangent += own_sine / cosine / 3.0;
                excess += (1.0 / cosine - 1.0) / 3.0;
            }
            hidden.volume += 0.25 * area * side * tangent;
            hidden.area += area * excess;
            for (k, by) in hidden.volume_by.iter_mut().enumerate() {
                let speeds = corners.map(|v| memory.velocities[k * stride + v as usize]);
                let [least, most] =
                    [f64::min, f64::max].map(|pick| pick(pick(speeds[0], speeds[1]), speeds[2]));
                let mean = speeds.iter().map(|speed| speed.abs()).sum::<f64>() / 3.0;
                *by += area * (mean * excess + 0.5 * (most - least) * sine);
            }
        }
    }

    /// The outer plane that a piece lies in: its axis and end.
    fn cut(&self, [a, b, c]: [DVec3; 3]) -> Option<(usize, End)> {
        (0..3).find_map(|axis| {
            let [lo, hi] = self.ends[axis];
            let all = |end: f64| a[axis] == end && b[axis] == end && c[axis] == end;
            if all(lo) {
                Some((axis, End::Lower))
            } else if all(hi) {
                Some((axis, End::Upper))
            } else {
                None
            }
        })
    }
}

/// An end of the box along an axis.
#[derive(Clone, Copy)]
enum End {
    Lower,
    Upper,
}

/// Finds normals and normal velocities of a patch's vertices; returns how many of the brick's own have none.
fn velocities(
    crossings: &Crossings<'_>,
    count: usize,
    memory: &mut Memory,
    patch: &Patch<'_>,
) -> Result<u64, Failure> {
    let Memory { crossings: own, normals, velocities } = memory;
    let stride = patch.positions.len();
    velocities.clear();
    velocities.resize(stride * count, 0.0);
    normals.clear();
    normals.resize(stride, DVec3::ZERO);
    let (mut first, mut unresolved) = (0, 0);
    for axis in Axis::ALL {
        for nodes in patch.nodes[axis.index()].chunks(BATCH) {
            let n = nodes.len();
            let outputs = crossings.at(own, patch, axis, nodes, first)?;
            for (lane, &node) in nodes.iter().enumerate() {
                let of = |output: usize| outputs[output * n + lane];
                if of(0).is_nan() {
                    unresolved += u64::from(is_own(node));
                    continue;
                }
                let gradient = match axis {
                    Axis::X => DVec3::new(of(1), of(2), of(3)),
                    Axis::Y => DVec3::new(of(2), of(1), of(3)),
                    Axis::Z => DVec3::new(of(2), of(3), of(1)),
                };
                let slope = gradient.length();
                normals[first + lane] = gradient / slope;
                for k in 0..count {
                    velocities[k * stride + first + lane] = -of(4 + k) / slope;
                }
            }
            first += n;
        }
    }
    Ok(unresolved)
}
