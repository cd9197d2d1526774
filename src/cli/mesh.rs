//! `alveole mesh`, and all of `cesogen`: program text to mesh file.

use super::args::MeshArguments;
use super::bar::with_bar;
use super::output::Output;
use super::report::{self, Trouble};
use super::summary::summary;
use super::table::significant;
use super::{stats, work};
use crate::contour::{self, Grid};
use crate::job::{self, Files, Job, Report, Settings, Slivers, Spacing, Survey, longest_edge};
use crate::mesh::io::{FileSink, Format, Precision, WriteError};
use crate::num::Progress;
use std::path::Path;
use std::time::Instant;

/// Writes the mesh of the program.
pub(super) fn run(name: &str, arguments: &MeshArguments, files: Files) -> Result<(), Trouble> {
    let start = Instant::now();
    let MeshArguments { output, precision, report: wanted, overhang, snap, work: common } =
        arguments;
    let format = format(output)?;
    let precision = work::read_precision(*precision, format)?;
    let work::Work { job, settings } = work::prepare(name, common, files, &[output])?;
    let slivers = if *snap { Slivers::Removed } else { Slivers::Kept };
    let settings = Settings { slivers, ..settings };
    let needed = if *wanted { None } else { Some("--report") };
    let overhang = work::read_overhang(overhang, needed, &job)?;
    let grid = job.grid(&settings)?;
    if settings.spacing == Spacing::Hundredth && !common.quiet {
        report::say(&format!(
            "{name}: grid spacing {} (choose with -s)",
            significant(longest_edge(&grid))
        ));
    }
    let target = Target { path: output, format, precision };
    let progress = Progress::new();
    let (_, report) =
        with_bar(&progress, !common.quiet, || write(&job, &grid, &settings, &target, &progress))?;
    let look = || job.survey(&settings, &overhang, &progress);
    let survey = wanted.then(|| with_bar(&progress, !common.quiet, look)).transpose()?;
    if !common.quiet {
        // Whoever takes the mesh from a pipe asks for the table.
        if *wanted || output != Path::new("-") {
            let seconds = start.elapsed().as_secs_f64();
            report::say(summary(&report, survey.as_ref(), seconds).trim_end());
        }
        report::warn(name, &report);
    }
    write_stats(common.stats.as_deref(), &report, survey.as_ref(), start)
}

/// A file to write a mesh to.
pub(super) struct Target<'a> {
    pub(super) path: &'a Path,
    pub(super) format: Format,
    /// The precision of coordinates; by default single where it is exact enough, and refused if it is not.
    pub(super) precision: Option<Precision>,
}

/// Writes the mesh of `job` on `grid`; returns the precision of its coordinates, and what was done.
///
/// # Errors
/// [`WriteError::TooCoarse`] where single precision is asked for and would leave triangles without area.
pub(super) fn write(
    job: &Job,
    grid: &Grid,
    settings: &Settings,
    target: &Target<'_>,
    progress: &Progress,
) -> Result<(Precision, Report), Trouble> {
    let Target { path, format, precision } = *target;
    let needed = grid.precision();
    let precision = match precision {
        // STL, which has no other, says by itself what to do.
        Some(Precision::Single) if needed == Precision::Double && format != Format::Stl => {
            return Err(WriteError::TooCoarse.into());
        }
        Some(Precision::Double) => Precision::Double,
        Some(Precision::Single) | None => needed,
    };
    let output = Output::open(path)?;
    let file = output.file().try_clone().map_err(|error| output.failure(error))?;
    let new = if output.is_seekable() { FileSink::new } else { FileSink::in_order };
    let mut sink = new(file, format, precision, output.folder())?;
    let report =
        job.contour(grid, settings, progress, &mut sink).map_err(|error| blame(error, &output))?;
    sink.finish().map_err(|error| output.refusal(error))?;
    output.finish()?;
    Ok((precision, report))
}

/// Writes the statistics of a run, if they are wanted.
pub(super) fn write_stats(
    path: Option<&Path>,
    report: &Report,
    survey: Option<&Survey>,
    start: Instant,
) -> Result<(), Trouble> {
    path.map_or(Ok(()), |path| stats::write(path, report, survey, start.elapsed()))
}

/// The format of an output: by extension; PLY where there is none on what is no regular file.
pub(super) fn format(output: &Path) -> Result<Format, Trouble> {
    let named = Format::from_path(output);
    let is_stream = output == Path::new("-")
        || std::fs::metadata(output).is_ok_and(|data| !data.is_file() && !data.is_dir());
    named
        .or(is_stream.then_some(Format::Ply))
        .ok_or_else(|| Trouble::Format { name: output.display().to_string() })
}

/// An error of the sink is an error of the output.
fn blame(error: job::Error, output: &Output) -> Trouble {
    if let job::Error::Contour(contour::Error::Sink(error)) = error {
        output.failure(error).into()
    } else {
        error.into()
    }
}
