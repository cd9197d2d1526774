//! What can be told of a solid without keeping its mesh: volume, area, overhangs, what hangs together.
//!
//! One sweep over the bricks, so memory is that of contouring. The numbers are those of the mesh, to
//! the rounding of sums, and do not depend on the number of threads.

use super::overhang::{Overhang, Overhanging};
use super::phases::{Phases, phases};
use super::totals::{Adding, Totals, middle};
use crate::contour::sweep::{Patch, Visitor, sweep_and};
use crate::contour::{Error, Grid, Report, Settings, Signs};
use crate::eval::Sampler;
use crate::eval::sampler::Failure;
use crate::num::Progress;
use glam::DVec3;
use pulp::Arch;

/// What can be told of a solid without keeping its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey {
    /// Volume and area.
    pub totals: Totals,
    /// Area that overhangs, in squared model units.
    pub overhang_area: f64,
    /// What hangs together.
    pub phases: Phases,
}

/// Surveys the field that `sampler` has bound to [`Grid::tables`].
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
pub fn survey<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    overhang: &Overhang,
    progress: &Progress,
) -> Result<(Survey, Report), Error> {
    let nothing = Overhanging::new(overhang, grid.extent());
    let surveyor = Surveyor { origin: middle(grid), arch: Arch::new(), nothing };
    let look = |signs: &Signs<'_>| phases(signs, progress);
    let (phases, sums, report) = sweep_and(sampler, grid, settings, progress, &surveyor, look)?;
    let (mut totals, mut overhanging) = surveyor.zero();
    for (more, other) in sums {
        totals = totals.plus(more);
        overhanging.add(other);
    }
    Ok((Survey { totals, overhang_area: overhanging.area(), phases }, report))
}

struct Surveyor {
    origin: [f64; 3],
    arch: Arch,
    nothing: Overhanging,
}

impl Visitor for Surveyor {
    type Memory = ();
    type Sum = (Totals, Overhanging);

    fn memory(&self) {}

    fn zero(&self) -> Self::Sum {
        (Totals::default(), self.nothing)
    }

    fn visit(&self, (): &mut (), patch: &Patch<'_>, sum: &mut Self::Sum) -> Result<(), Failure> {
        let (totals, overhanging) = sum;
        *totals = totals.plus(self.arch.dispatch(Adding { patch, origin: self.origin }));
        for triangle in patch.triangles {
            let corner = |v: u32| DVec3::from_array(patch.positions[v as usize]);
            overhanging.include(triangle.map(corner));
        }
        Ok(())
    }
}
