//! Volume and area of the mesh, brick by brick, without the mesh.
//!
//! They are those of the mesh that contouring makes, added up while its triangles are at hand:
//! nothing is numbered for the whole mesh and nothing is kept. They differ from those of the mesh
//! in memory ([`measure`](crate::mesh::measure::measure())) by the rounding of the sums alone, about
//! one part in 1e14, and do not depend on the number of threads.
//!
//! Tetrahedra share the middle of the box, so a box far from the origin loses nothing. Triangles are
//! added up in 32 sums, which are added pairwise at the end of a brick.

use crate::contour::sweep::{Patch, Visitor, sweep};
use crate::contour::{Error, Grid, Report, Settings};
use crate::eval::Sampler;
use crate::eval::sampler::Failure;
use crate::geom::Axis;
use crate::num::Progress;
use pulp::{Arch, NullaryFnOnce};

/// Triangles that are measured side by side: enough for a loop that vectors are made of, few enough
/// that what they read stays in the nearest cache.
const LANES: usize = 32;

/// Volume and area of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Totals {
    /// Volume enclosed, in cubed model units.
    pub volume: f64,
    /// Area of the surface, flat cuts included, in squared model units.
    pub area: f64,
}

impl Totals {
    pub(super) fn plus(self, other: Self) -> Self {
        Self { volume: self.volume + other.volume, area: self.area + other.area }
    }
}

/// Volume and area of the mesh of the field that `sampler` has bound to [`Grid::tables`].
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
pub fn totals<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<(Totals, Report), Error> {
    let visitor = TotalsVisitor { origin: middle(grid), arch: Arch::new() };
    let (sums, report) = sweep(sampler, grid, settings, progress, &visitor)?;
    let total = sums.into_iter().fold(Totals::default(), Totals::plus);
    Ok((total, report))
}

/// The middle of the grid's box, the point that tetrahedra share.
pub(super) fn middle(grid: &Grid) -> [f64; 3] {
    Axis::ALL.map(|axis| {
        let line = grid.placed(axis);
        0.5 * (line[0] + line[line.len() - 1])
    })
}

/// Sums volume and area.
struct TotalsVisitor {
    origin: [f64; 3],
    arch: Arch,
}

impl Visitor for TotalsVisitor {
    type Memory = ();
    type Sum = Totals;

    fn memory(&self) {}

    fn zero(&self) -> Totals {
        Totals::default()
    }

    fn visit(&self, (): &mut (), patch: &Patch<'_>, sum: &mut Totals) -> Result<(), Failure> {
        *sum = sum.plus(self.arch.dispatch(Adding { patch, origin: self.origin }));
        Ok(())
    }
}

/// Adds up the triangles of a patch, with tetrahedra about `origin`; a task for [`Arch::dispatch`].
pub(super) struct Adding<'a> {
    pub(super) patch: &'a Patch<'a>,
    pub(super) origin: [f64; 3],
}

/// One number a triangle.
type Numbers = [f64; LANES];

const ZERO: Numbers = [0.0; LANES];

impl NullaryFnOnce for Adding<'_> {
    type Output = Totals;

    #[inline(always)]
    fn call(self) -> Totals {
        let Self { patch: Patch { positions, triangles, .. }, origin } = self;
        let (mut volume, mut area) = (ZERO, ZERO);
        let mut corners = [[ZERO; 3]; 3];
        let (runs, rest) = triangles.as_chunks::<LANES>();
        for run in runs {
            read(positions, run, &mut corners);
            add(&corners, origin, &mut volume, &mut area);
        }
        if !rest.is_empty() {
            // A triangle whose corners are one has neither volume nor area.
            let mut run = [[0; 3]; LANES];
            run[..rest.len()].copy_from_slice(rest);
            read(positions, &run, &mut corners);
            add(&corners, origin, &mut volume, &mut area);
        }
        Totals { volume: pairwise(volume) / 6.0, area: 0.5 * pairwise(area) }
    }
}

/// Reads the coordinates of corners: `corners[corner][axis][lane]`.
#[inline(always)]
fn read(positions: &[[f64; 3]], triangles: &[[u32; 3]; LANES], corners: &mut [[Numbers; 3]; 3]) {
    for (lane, triangle) in triangles.iter().enumerate() {
        for (corner, vertex) in corners.iter_mut().zip(triangle) {
            let position = &positions[*vertex as usize];
            for (coordinates, coordinate) in corner.iter_mut().zip(position) {
                coordinates[lane] = *coordinate;
            }
        }
    }
}

/// Adds six times the volumes and twice the areas of triangles.
#[inline(always)]
fn add(corners: &[[Numbers; 3]; 3], origin: [f64; 3], volumes: &mut Numbers, areas: &mut Numbers) {
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;
    let [ox, oy, oz] = origin;
    for lane in 0..LANES {
        let (x, y, z) = (ax[lane], ay[lane], az[lane]);
        let (ux, uy, uz) = (bx[lane] - x, by[lane] - y, bz[lane] - z);
        let (vx, vy, vz) = (cx[lane] - x, cy[lane] - y, cz[lane] - z);
        let (nx, ny, nz) = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
        volumes[lane] += (x - ox) * nx + (y - oy) * ny + (z - oz) * nz;
        areas[lane] += (nx * nx + ny * ny + nz * nz).sqrt();
    }
}

/// The sum of all numbers, halves first.
#[inline(always)]
fn pairwise(mut numbers: Numbers) -> f64 {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            numbers[lane] += numbers[lane + half];
        }
        half /= 2;
    }
    numbers[0]
}
