//! The numbers of a solid: volume, density, area, topology and quality, from its mesh.

use super::{Error, FieldOn, Job, Report, Settings};
use crate::contour::Grid;
use crate::measure::totals;
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

    /// The volume, area and density of the mesh, without keeping the mesh: those of
    /// [`measure`](Self::measure) but for the rounding of sums (some parts in 1e14), in a fraction
    /// of its time. They do not depend on the number of threads.
    ///
    /// The walls of shells are not looked at: [`Report::walls`] is `None`.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn totals(&self, settings: &Settings, progress: &Progress) -> Result<Totals, Error> {
        let grid = self.grid(settings)?;
        let (values, densities) = self.solved(&grid, settings, progress)?;
        let (found, mut report) = (self.field_on(&grid, values))
            .run(settings, |bound, chosen| totals(bound, &grid, chosen, progress))?;
        report.densities = densities;
        let relative_density = found.volume / box_volume(&report);
        Ok(Totals { volume: found.volume, area: found.area, relative_density, report })
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
            FieldOn { graph, field, program, values, grid, true_walls: &[], meshes: &[], parsing }
                .contour(settings, progress, &mut sink)?;
            Ok(measure::volume(&sink.into_mesh()))
        };
        envelope.volume(grid, &values, measure).map(Some)
    }
}

/// Volume of the box that was contoured.
pub(super) fn box_volume(report: &Report) -> f64 {
    let [lo, hi] = report.bounds;
    (0..3).map(|a| hi[a] - lo[a]).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAMS: [&str; 4] = [
        "gyroid dilate 0.35 box",
        "sphere scale 0.7 translate 1000,0,0",
        "'sqrt(x*y) + mod(z, 0.3) - 0.2' box",
        "box scale 0.9 rotate 0.3 1,2,3 sphere union",
    ];

    #[test]
    fn totals_are_those_of_the_mesh_on_any_number_of_threads() {
        for program in PROGRAMS {
            let job = Job::parse(program).unwrap();
            // The upper outer planes of the first box are the first nodes of its last bricks.
            let settings = Settings::with_spacing(0.043);
            let mesh = job.measure(&settings, &Progress::new()).unwrap();
            let totals = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| job.totals(&settings, &Progress::new())).unwrap()
            };
            let found = totals(1);
            let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b, "{program}: {a} {b}");
            close(found.volume, mesh.mesh.volume);
            close(found.area, mesh.mesh.area);
            close(found.relative_density, mesh.relative_density);
            let counts = |report: &Report| (report.contour.vertices, report.contour.triangles);
            assert_eq!(counts(&found.report), counts(&mesh.report), "{program}");
            for threads in [2, 3] {
                let other = totals(threads);
                assert_eq!((other.volume, other.area), (found.volume, found.area), "{program}");
            }
        }
    }

    #[test]
    fn totals_of_nothing_are_refused() {
        let job = Job::parse("'1 + 0*x' box").unwrap();
        let found = job.totals(&Settings::with_spacing(0.5), &Progress::new());
        assert!(matches!(found, Err(Error::Empty { .. })), "{found:?}");
    }
}
