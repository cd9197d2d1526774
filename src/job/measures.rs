//! The numbers of a solid: volume, density, area, topology and quality, from its mesh.

use super::{Error, FieldOn, Job, Report, Settings};
use crate::contour::Grid;
use crate::mesh::Mesh;
use crate::mesh::check::{Check, check};
use crate::mesh::measure::{self, measure};
use crate::mesh::sink::Collect;
use crate::num::Progress;
use std::time::Duration;

/// The numbers of a solid.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Measures {
    /// Volume over that of the box that was contoured, 0 to 1.
    pub relative_density: f64,
    /// Volume of the envelope, the intersection of the bounded operands of the final
    /// intersection; `None` if there are none, or they are all of the solid's operands.
    pub envelope_volume: Option<f64>,
    /// Volume over that of the envelope, 0 to 1; over the box where there is no envelope.
    pub envelope_density: f64,
    /// Measures of the mesh.
    #[serde(flatten)]
    pub mesh: measure::Measures,
    /// Counts, topology and defects of the mesh.
    pub check: Check,
    /// What contouring did.
    pub report: Report,
}

/// The numbers that optimizers ask for most.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Totals {
    /// Volume enclosed by the mesh.
    pub volume: f64,
    /// Area of the mesh.
    pub area: f64,
    /// Volume over that of the box that was contoured, 0 to 1.
    pub relative_density: f64,
    /// What contouring did.
    pub report: Report,
}

impl Job {
    /// Meshes the solid in memory and measures it.
    ///
    /// Volume and area have the second-order error of the mesh; they are those of the file that
    /// the same settings write.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn measure(&self, settings: &Settings, progress: &Progress) -> Result<Measures, Error> {
        self.measured(settings, progress).map(|(_, measures)| measures)
    }

    /// The mesh of the solid and its measures.
    pub(super) fn measured(
        &self,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<(Mesh, Measures), Error> {
        let grid = self.grid(settings)?;
        let mut sink = Collect::default();
        let report = self.contour(&grid, settings, progress, &mut sink)?;
        let mesh = sink.into_mesh();
        let (check, measures) = (check(&mesh), measure(&mesh));
        let envelope_volume = self.envelope_volume(&grid, settings, progress)?;
        let measures = Measures {
            relative_density: measures.volume / box_volume(&report),
            envelope_volume,
            envelope_density: measures.volume / envelope_volume.unwrap_or(box_volume(&report)),
            mesh: measures,
            check,
            report,
        };
        Ok((mesh, measures))
    }

    /// Meshes the solid in memory and returns its volume, area and density: those of
    /// [`measure`](Self::measure), in a fraction of its time.
    ///
    /// The walls of shells are not looked at: [`Report::walls`] is `None`.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn totals(&self, settings: &Settings, progress: &Progress) -> Result<Totals, Error> {
        let grid = self.grid(settings)?;
        let (values, densities) = self.solved(&grid, settings, progress)?;
        let mut sink = Collect::reusing(self.spare.take());
        let mut report = self.field_on(&grid, values).contour(settings, progress, &mut sink)?;
        report.densities = densities;
        let mesh = sink.into_mesh();
        let (volume, area) = measure::volume_and_area(&mesh);
        self.spare.keep(mesh);
        Ok(Totals { volume, area, relative_density: volume / box_volume(&report), report })
    }

    /// Volume of the intersection of the bounded operands, on the same grid.
    fn envelope_volume(
        &self,
        grid: &Grid,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Option<f64>, Error> {
        let (values, _) = self.solved(grid, settings, progress)?;
        let found = self.envelope.envelope(&self.graph, &self.operands, &values);
        let Some(envelope) = found else { return Ok(None) };
        let measure = || {
            let (graph, field, program) = (&envelope.graph, envelope.field, &envelope.program);
            let values = values.clone();
            let parsing = Duration::ZERO;
            let mut sink = Collect::default();
            FieldOn { graph, field, program, values, grid, parsing }
                .contour(settings, progress, &mut sink)?;
            Ok(measure::volume(&sink.into_mesh()))
        };
        envelope.volume(grid, &values, measure).map(Some)
    }
}

/// Volume of the box that was contoured.
fn box_volume(report: &Report) -> f64 {
    let [lo, hi] = report.bounds;
    (0..3).map(|a| hi[a] - lo[a]).product()
}
