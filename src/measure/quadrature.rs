//! Volume, area and derivatives of the solid itself, straight from the field, with an error.
//!
//! The solid {f < 0} in the grid's box is cut cell by cell: where a cell's corners differ in sign, the
//! crossings of its edges, roots of the field to rounding, span flat pieces. No vertex is numbered
//! and no triangle kept; nor is a vertex kept off nodes as in a mesh, since a piece without area adds
//! nothing here and harms nothing. What lies between a piece and the smooth surface is known from the
//! gradients at its corners (`measure/bulge.rs`), so volume and area are wrong by a part h⁴ of the
//! spacing h where the surface is smooth. Creases are cut off: there the pieces stay as they are, and
//! miss a part h² of volume. The same sum over cells of twice the size, with a quarter of the same
//! crossings, is wrong by 16 or 4 times as much, and
//!
//! > Q = Q_h + (Q_h - Q_2h) / 15, at creases Q = Q_h + (Q_h - Q_2h) / 3
//!
//! is what is returned (Richardson's extrapolation); in between as far as creases explain the
//! difference, and wholly where the field has no gradients to go by. [`volume`] and derivatives of the
//! volume are of flat pieces, and take a third.
//!
//! **Order.** Volume and area are of fourth order, about, on smooth surfaces, however the box cuts
//! them. At creases the volume is of second order, the area and the derivatives of first. A part
//! thinner than a cell is not seen.
//!
//! **Error.** [`Estimate::error`] has two parts. One is |Q_h - Q_2h|, half of it on smooth surfaces:
//! three and seven times what the extrapolation changes. The other adds up over the pieces what may
//! be hidden, where nothing cancels: on smooth surfaces what the gradients at two ends of a side
//! say of the bulge between them and do not agree on, a part h³; at creases, with t the angle
//! between a piece and the gradient at its corners, area A and longest side s,
//!
//! > A s tan(t) / 4 of volume and A (1 / cos(t) - 1) of area:
//!
//! what a piece cuts off a right-angled crease. Without it faces along the grid would deceive, which
//! cut off the same at both sizes. The sum is an estimate and no bound: tests hold it to closed
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

use super::bulge::{Bulge, Found, LANES, Looking, Pieces, sliver};
use super::gradient::{BATCH, Crossings, CrossingsMemory, GridMotion, gradient_of};
use crate::contour::sweep::{Patch, Vertices, Visitor, is_own, sweep};
use crate::contour::{Error, Grid, Report, Settings};
use crate::eval::Sampler;
use crate::eval::rates::BoundRates;
use crate::eval::sampler::Failure;
use crate::geom::Axis;
use crate::num::Progress;
use glam::DVec3;
use pulp::Arch;

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
        summed(sampler, (rates, motions), Beyond::Found, grid, settings, progress)?;
    let Sums { levels: [fine, coarse], hidden, creased, unresolved } = &total;
    let creased = if *unresolved == 0 {
        *creased
    } else {
        Bulge { volume: f64::INFINITY, area: f64::INFINITY }
    };
    let measures = FieldMeasures {
        volume: refined(fine.volume, coarse.volume, hidden.volume, creased.volume),
        area: refined(fine.area, coarse.area, hidden.area, creased.area),
        volume_by: (fine.volume_by.iter().zip(&coarse.volume_by).zip(&hidden.volume_by))
            .map(|((fine, coarse), hidden)| extrapolated(*fine, *coarse, *hidden))
            .collect(),
        unresolved: *unresolved,
    };
    Ok((measures, report))
}

/// The volume of flat pieces, extrapolated, and its derivatives, without saying how far they are from
/// the truth: for those who solve for a volume. No gradients are asked for; where the box cuts the
/// surface it is of second order.
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
        summed(sampler, (rates, motions), Beyond::Ignored, grid, settings, progress)?;
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
    beyond: Beyond,
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
    let visitor = Cutter { crossings, motions, beyond, ends, origin, arch: Arch::new() };
    let (sums, report) = sweep(sampler, grid, settings, progress, &visitor)?;
    let mut total = visitor.zero();
    for part in sums {
        total.unresolved += part.unresolved;
        for (all, part) in total.levels.iter_mut().zip(part.levels) {
            all.add(&part);
        }
        total.hidden.add(&part.hidden);
        total.creased.add(part.creased);
    }
    Ok((total, report))
}

/// The limit of a sequence of second order, from its terms at h and 2 h and what creases may hide.
fn extrapolated(fine: f64, coarse: f64, hidden: f64) -> Estimate {
    let change = fine - coarse;
    Estimate { value: fine + change / 3.0, error: change.abs() + hidden }
}

/// The limit of a sequence of fourth order, or of second as far as `creased`, which is a part of what is
/// hidden, explains the change; all of it where crossings have no gradients.
fn refined(fine: f64, coarse: f64, hidden: f64, creased: f64) -> Estimate {
    let change = fine - coarse;
    let share = if creased < change.abs() { creased / change.abs() } else { 1.0 };
    let correction = change * (1.0 / 15.0 + share * (1.0 / 3.0 - 1.0 / 15.0));
    Estimate { value: fine + correction, error: 0.5 * (1.0 + share) * change.abs() + hidden }
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
    /// What the pieces may hide; and of volume and area, what creases may.
    hidden: Level,
    creased: Bulge,
    unresolved: u64,
}

/// Whether it is found out what lies beyond flat pieces, and how far sums are from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beyond {
    Found,
    Ignored,
}

struct Cutter<'a> {
    crossings: Crossings<'a>,
    motions: &'a [GridMotion],
    beyond: Beyond,
    /// Ends of the box along each axis.
    ends: [[f64; 2]; 3],
    /// The point that tetrahedra share.
    origin: DVec3,
    arch: Arch,
}

/// Memory of a [`Cutter`].
struct Memory {
    crossings: CrossingsMemory,
    /// Outward unit normals of the vertices; zero where they have none.
    normals: Vec<DVec3>,
    /// Normal velocities of the vertices, one run of them a parameter.
    velocities: Vec<f64>,
    /// The outer planes that vertices lie in; see [`Cutter::planes`].
    planes: Vec<u8>,
}

impl Visitor for Cutter<'_> {
    type Memory = Memory;
    type Sum = Sums;
    const COARSE: bool = true;
    const VERTICES: Vertices = Vertices::AtRoots;

    fn memory(&self) -> Memory {
        let crossings = self.crossings.memory();
        let (normals, velocities, planes) = (Vec::new(), Vec::new(), Vec::new());
        Memory { crossings, normals, velocities, planes }
    }

    fn zero(&self) -> Sums {
        let volume_by = vec![0.0; self.motions.len()];
        let level = Level { volume: 0.0, area: 0.0, volume_by };
        let (levels, creased) = ([level.clone(), level.clone()], Bulge::default());
        Sums { levels, hidden: level, creased, unresolved: 0 }
    }

    fn visit(&self, memory: &mut Memory, patch: &Patch<'_>, sum: &mut Sums) -> Result<(), Failure> {
        if self.beyond == Beyond::Found || !self.motions.is_empty() {
            sum.unresolved += velocities(&self.crossings, self.motions.len(), memory, patch)?;
        }
        let Sums { levels: [fine, coarse], hidden, creased, unresolved: _ } = sum;
        memory.planes.clear();
        memory.planes.extend(patch.positions.iter().map(|point| self.planes(point)));
        self.include(patch, patch.triangles, memory, fine);
        self.include(patch, patch.coarse, memory, coarse);
        if self.beyond == Beyond::Found {
            self.bend(patch, patch.triangles, memory, fine, Some((hidden, creased)));
            self.bend(patch, patch.coarse, memory, coarse, None);
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
        memory: &Memory,
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
            let planes = corners.iter().fold(!0, |all, v| all & memory.planes[*v as usize]);
            for (k, (motion, by)) in self.motions.iter().zip(&mut level.volume_by).enumerate() {
                let speed = if planes == 0 {
                    let own = &memory.velocities[k * patch.positions.len()..];
                    corners.iter().map(|v| own[*v as usize]).sum::<f64>() / 3.0
                } else {
                    let (axis, is_upper) = plane(planes);
                    if is_upper { motion.hi[axis] } else { -motion.lo[axis] }
                };
                *by += 0.5 * doubled_area * speed;
            }
        }
        level.volume += volume / 6.0;
        level.area += 0.5 * area;
    }

    /// Adds to `level` what the smooth surface has beyond the pieces `triangles` of a patch, and to
    /// `hidden` what is in doubt about them; to the bulge beside it the part that creases may hide.
    fn bend(
        &self,
        patch: &Patch<'_>,
        triangles: &[[u32; 3]],
        memory: &Memory,
        level: &mut Level,
        mut hidden: Option<(&mut Level, &mut Bulge)>,
    ) {
        let stride = patch.positions.len();
        let mut pieces: Pieces = [[[[0.0; LANES]; 3]; 3]; 2];
        let mut found = Found::default();
        for run in triangles.chunks(LANES) {
            for (lane, corners) in run.iter().enumerate() {
                for (i, v) in corners.iter().enumerate() {
                    let (position, normal) =
                        (patch.positions[*v as usize], memory.normals[*v as usize].to_array());
                    for axis in 0..3 {
                        pieces[0][i][axis][lane] = position[axis];
                        pieces[1][i][axis][lane] = normal[axis];
                    }
                }
            }
            self.arch.dispatch(Looking { pieces: &pieces, found: &mut found });
            for (lane, corners) in run.iter().enumerate() {
                let over = found.over(lane);
                let planes = corners.map(|v| memory.planes[v as usize]);
                if planes[0] & planes[1] & planes[2] != 0 {
                    continue;
                }
                level.volume += over.bulge.volume;
                level.area += over.bulge.area;
                if over.is_smooth && planes.iter().filter(|planes| **planes != 0).count() > 1 {
                    level.area += slivers(patch, memory, *corners);
                }
                let Some((hidden, creased)) = &mut hidden else { continue };
                hidden.volume += over.doubt.volume;
                hidden.area += over.doubt.area;
                if !over.is_smooth {
                    creased.add(over.doubt);
                }
                for (k, by) in hidden.volume_by.iter_mut().enumerate() {
                    let speeds = corners.map(|v| memory.velocities[k * stride + v as usize]);
                    let [least, most] = [f64::min, f64::max]
                        .map(|pick| pick(pick(speeds[0], speeds[1]), speeds[2]));
                    let mean = speeds.iter().map(|speed| speed.abs()).sum::<f64>() / 3.0;
                    *by += over.area * (mean * over.excess + 0.5 * (most - least) * over.sine);
                }
            }
        }
    }

    /// The outer planes that a point lies in, a bit each: the lower and the upper of x, y and z.
    fn planes(&self, point: &[f64; 3]) -> u8 {
        (0..6)
            .map(|plane| u8::from(point[plane / 2] == self.ends[plane / 2][plane % 2]) << plane)
            .sum()
    }
}

/// What the rim of a flat cut has beyond the sides of a triangle of `patch`.
fn slivers(patch: &Patch<'_>, memory: &Memory, corners: [u32; 3]) -> f64 {
    let points = corners.map(|v| DVec3::from_array(patch.positions[v as usize]));
    let normals = corners.map(|v| memory.normals[v as usize]);
    let [a, b, c] = points;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let mut area = 0.0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        let shared = memory.planes[corners[i] as usize] & memory.planes[corners[j] as usize];
        if shared != 0 {
            let (axis, is_upper) = plane(shared);
            let outward = if is_upper { DVec3::AXES[axis] } else { -DVec3::AXES[axis] };
            area += sliver(normal, [points[i], points[j]], [normals[i], normals[j]], outward);
        }
    }
    area
}

/// The first of some planes: its axis, and whether it is the upper one.
const fn plane(planes: u8) -> (usize, bool) {
    let number = planes.trailing_zeros() as usize;
    (number / 2, number % 2 == 1)
}

/// Finds normals and normal velocities of a patch's vertices; returns how many of the brick's own have none.
fn velocities(
    crossings: &Crossings<'_>,
    count: usize,
    memory: &mut Memory,
    patch: &Patch<'_>,
) -> Result<u64, Failure> {
    let Memory { crossings: own, normals, velocities, planes: _ } = memory;
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
                let gradient = gradient_of(outputs, n, lane, axis);
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
