//! The report of a run: what can be told of a solid without keeping its mesh.

use super::measures::box_volume;
use super::{Error, Job, Report, Settings};
use crate::contour::{Grid, signs};
use crate::measure::{self, Overhang, Phase, Phases};
use crate::num::Progress;

/// What can be told of a solid without keeping its mesh, lengths in model units.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Survey {
    /// Volume enclosed by the mesh.
    pub volume: f64,
    /// Volume over that of the box that was contoured, 0 to 1.
    pub relative_density: f64,
    /// Area of the mesh, flat cuts included.
    pub area: f64,
    /// Area over volume.
    pub specific_surface: f64,
    /// Euler characteristic of the mesh.
    pub euler: i64,
    /// Handles of the solid: holes through it that a thread could be passed through.
    pub handles: i64,
    /// Area of faces that overhang.
    pub overhang_area: f64,
    /// The angle from straight down within which a face overhangs, in degrees.
    pub overhang_angle_deg: f64,
    /// The direction in which the part is built.
    pub up: [f64; 3],
    /// What hangs together in the solid.
    pub solid: Phase,
    /// What hangs together in the rest of the box.
    pub void: Phase,
    /// What contouring did.
    #[serde(skip)]
    pub report: Report,
}

impl Job {
    /// Surveys the solid, in about the time that its mesh takes and no more memory; `overhang` says
    /// which faces overhang.
    ///
    /// Volume and area are those of [`totals`](Self::totals). Nothing depends on the number of
    /// threads. The walls of shells are not looked at: [`Report::walls`] is `None`.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn survey(
        &self,
        settings: &Settings,
        overhang: &Overhang,
        progress: &Progress,
    ) -> Result<Survey, Error> {
        let grid = self.grid(settings)?;
        let (values, densities) = self.solved(&grid, settings, progress)?;
        let (found, mut report) = self.field_on(&grid, values).run(settings, |bound, chosen| {
            measure::survey(bound, &grid, chosen, overhang, progress)
        })?;
        report.densities = densities;
        let measure::Survey { totals, overhang_area, phases } = found;
        let euler = report.contour.euler();
        Ok(Survey {
            volume: totals.volume,
            relative_density: totals.volume / box_volume(&report),
            area: totals.area,
            specific_surface: totals.area / totals.volume,
            euler,
            handles: phases.handles(euler),
            overhang_area,
            overhang_angle_deg: overhang.angle_deg,
            up: overhang.up.to_array(),
            solid: phases.solid,
            void: phases.void,
            report,
        })
    }

    /// What hangs together on `grid`, for these values of the parameters.
    pub(super) fn phases(
        &self,
        grid: &Grid,
        values: Vec<f64>,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Phases, Error> {
        let field = self.field_on(grid, values);
        let found = field.evaluate(settings, |bound, chosen| {
            signs::survey(bound, grid, chosen, progress, |signs| measure::phases(signs, progress))
        });
        Ok(found?.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey(program: &str, spacing: f64) -> Survey {
        let job = Job::parse(program).unwrap();
        let settings = Settings::with_spacing(spacing);
        job.survey(&settings, &Overhang::default(), &Progress::new()).unwrap()
    }

    #[test]
    fn lattices_have_the_components_that_are_known_of_them() {
        let all = [true; 3];
        let of = |program: &str| {
            let Survey { solid, void, .. } = survey(program, 0.04);
            assert_eq!((solid.enclosed, void.enclosed), (0, 0), "{program}");
            // A component counts if it is no crumb that the box cuts off.
            let main = |phase: Phase| (phase.largest_share, phase.percolates);
            (main(solid), main(void))
        };
        // A network is one labyrinth of two: both hang together along each axis.
        for surface in ["gyroid", "p-surface", "d-surface"] {
            let (solid, void) = of(&format!("{surface} box"));
            assert_eq!((solid.1, void.1), (all, all), "{surface}");
            assert!(solid.0 > 0.98 && void.0 > 0.98, "{surface}: {solid:?} {void:?}");
            // A sheet hangs together and parts the void in two.
            let (sheet, void) = of(&format!("{surface} sheet density 0.2 box"));
            assert_eq!((sheet.1, void.1), (all, all), "{surface}");
            assert!(sheet.0 > 0.98 && (void.0 - 0.5).abs() < 0.02, "{surface}: {sheet:?} {void:?}");
        }
    }

    #[test]
    fn a_survey_tells_what_the_measures_of_the_mesh_tell() {
        for program in ["gyroid shell 0.7 box", "torus", "sphere shell 0.3 box scale 1.5"] {
            let found = survey(program, 0.07);
            let job = Job::parse(program).unwrap();
            let (settings, progress) = (Settings::with_spacing(0.07), Progress::new());
            let (measures, structure) =
                job.structure(&settings, &Overhang::default(), &progress).unwrap();
            let same = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b, "{program}: {a} {b}");
            same(found.volume, measures.mesh.volume);
            same(found.area, measures.mesh.area);
            same(found.relative_density, measures.relative_density);
            same(found.specific_surface, structure.specific_surface);
            same(found.overhang_area, structure.overhang_area);
            assert_eq!(found.euler, measures.check.euler, "{program}");
            assert_eq!(found.handles, structure.handles, "{program}");
            assert_eq!((found.solid, found.void), (structure.solid, structure.void));
            let shells = (Phases { solid: found.solid, void: found.void }).shells();
            assert_eq!(shells, measures.check.components.len() as u64, "{program}");
        }
        assert_eq!(survey("torus", 0.05).handles, 1);
    }
}
