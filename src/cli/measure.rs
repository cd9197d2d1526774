//! `alveole measure`: the numbers of a solid.

use super::args::MeasureArguments;
use super::bar::with_bar;
use super::report::{self, Trouble};
use super::table::Table;
use super::{mesh, work};
use crate::job::Measures;
use crate::num::Progress;
use std::time::Instant;

/// Prints the measures of the program's solid.
pub(super) fn run(name: &str, arguments: &MeasureArguments) -> Result<(), Trouble> {
    let start = Instant::now();
    let MeasureArguments { json, work: common } = arguments;
    let work::Work { job, settings } = work::prepare(name, common)?;
    let progress = Progress::new();
    let measures = with_bar(&progress, !common.quiet, || job.measure(&settings, &progress))?;
    if !common.quiet {
        report::warn(name, &measures.report);
    }
    report::print(&if *json { super::stats::json(&measures) } else { table(&measures) });
    mesh::write_stats(common.stats.as_deref(), &measures.report, start)
}

fn table(measures: &Measures) -> String {
    let Measures { relative_density, envelope_volume, envelope_density, mesh, check, report } =
        measures;
    let mut table = Table::default();
    table.number("volume", mesh.volume);
    table.number("relative density (of the box)", *relative_density);
    if let Some(volume) = envelope_volume {
        table.number("envelope volume", *volume);
        table.number("relative density (of the envelope)", *envelope_density);
    }
    table.measures(mesh);
    table.check(check);
    table.text("grid cells", &report.cells.map(|n| n.to_string()).join(" x "));
    table.render()
}
