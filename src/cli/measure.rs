//! `alveole measure`: the numbers of a solid.

use super::args::MeasureArguments;
use super::bar::with_bar;
use super::report::{self, Trouble};
use super::table::Table;
use super::{mesh, stats, work};
use crate::job::{By, FieldMeasures, Files, Gradient, Measures, Quantities, Spread, Structure};
use crate::num::Progress;
use std::time::Instant;

/// Prints the measures of the program's solid.
pub(super) fn run(name: &str, arguments: &MeasureArguments, files: Files) -> Result<(), Trouble> {
    let start = Instant::now();
    let MeasureArguments { json, gradient, field, structure, overhang, work: common } = arguments;
    let work::Work { job, settings } = work::prepare(name, common, files, &[])?;
    let needed = if *structure { None } else { Some("--structure") };
    let overhang = work::read_overhang(overhang, needed, &job)?;
    let progress = Progress::new();
    let (text, report) = if *gradient {
        let found = with_bar(&progress, !common.quiet, || job.gradient(&settings, &progress))?;
        warn_of_unresolved(name, found.unresolved);
        (if *json { stats::json(&found) } else { gradient_table(&found) }, found.report)
    } else if *field {
        let found =
            with_bar(&progress, !common.quiet, || job.field_measures(&settings, &progress))?;
        warn_of_unresolved(name, found.unresolved);
        (if *json { stats::json(&found) } else { field_table(&found) }, found.report)
    } else if *structure {
        let work = || job.structure(&settings, &overhang, &progress);
        let (measures, structure) = with_bar(&progress, !common.quiet, work)?;
        let text = if *json {
            stats::json(&WithStructure { measures: &measures, structure: &structure })
        } else {
            table(&measures) + &structure_table(&structure)
        };
        (text, measures.report)
    } else {
        let found = with_bar(&progress, !common.quiet, || job.measure(&settings, &progress))?;
        (if *json { stats::json(&found) } else { table(&found) }, found.report)
    };
    if !common.quiet {
        report::warn(name, &report);
    }
    report::print(&text)?;
    mesh::write_stats(common.stats.as_deref(), &report, None, start)
}

/// Says that derivatives leave something out or estimate it. Never quietly: they are wrong by it.
fn warn_of_unresolved(name: &str, count: u64) {
    if let Some(remark) = unresolved(count) {
        report::say(&format!("{name}: warning: {remark}"));
    }
}

/// What is to be said about derivatives at whose `count` crossings vertices have no velocity.
pub(super) fn unresolved(count: u64) -> Option<String> {
    (count > 0).then(|| {
        format!(
            "at {count} crossings the field jumps or is flat, or a grid edge grazes the surface: the \
             derivatives take them as fixed, or as moving with the surface"
        )
    })
}

fn gradient_table(found: &Gradient) -> String {
    let Gradient { quantities, by, unresolved: _, report } = found;
    let rows = |quantities: &Quantities| {
        let Quantities { volume, area, relative_density, envelope_density } = *quantities;
        [volume, area, relative_density, envelope_density]
    };
    let names = ["volume", "area", "relative density", "density in the envelope"];
    let mut table = Table::default();
    for (i, name) in names.into_iter().enumerate() {
        table.number(name, rows(quantities)[i]);
        for By { parameter, derivatives } in by {
            table.number(&format!("  by {parameter}"), rows(derivatives)[i]);
        }
    }
    table.densities(&report.densities);
    table.text("grid cells", &report.cells.map(|n| n.to_string()).join(" x "));
    table.render()
}

fn field_table(found: &FieldMeasures) -> String {
    let FieldMeasures {
        volume,
        area,
        relative_density,
        envelope_volume,
        envelope_density,
        by,
        unresolved: _,
        report,
    } = found;
    let mut table = Table::default();
    table.estimate("volume", *volume);
    for By { parameter, derivatives } in by {
        table.estimate(&format!("  by {parameter}"), derivatives.volume);
    }
    table.estimate("area", *area);
    table.estimate("relative density (of the box)", *relative_density);
    for By { parameter, derivatives } in by {
        table.estimate(&format!("  by {parameter}"), derivatives.relative_density);
    }
    if let Some(volume) = envelope_volume {
        table.estimate("envelope volume", *volume);
        table.estimate("relative density (of the envelope)", *envelope_density);
    }
    table.densities(&report.densities);
    table.text("grid cells", &report.cells.map(|n| n.to_string()).join(" x "));
    table.render()
}

/// Measures and structure in one object.
#[derive(serde::Serialize)]
struct WithStructure<'a> {
    #[serde(flatten)]
    measures: &'a Measures,
    structure: &'a Structure,
}

fn structure_table(found: &Structure) -> String {
    let Structure {
        wall_thickness,
        pore_size,
        samples,
        specific_surface,
        overhang_area,
        overhang_angle_deg,
        up: _,
        handles,
        solid,
        void,
    } = found;
    let mut table = Table::default();
    for (name, spread) in [("wall thickness", wall_thickness), ("pore size", pore_size)] {
        let Some(spread) = spread else { continue };
        let Spread { minimum, fifth_percentile, mean, mean_error, maximum } = spread;
        let [least, low, mean, most] =
            [minimum, fifth_percentile, mean, maximum].map(|v| format!("{v:.4}"));
        let mean = format!("mean {mean} +- {mean_error:.0e}");
        table.text(name, &format!("{least} to {most}, {mean}, a twentieth below {low}"));
    }
    table.text("inscribed balls", &samples.to_string());
    table.number("area over volume", *specific_surface);
    table.overhang(*overhang_area, *overhang_angle_deg);
    table.phases(solid, void, *handles);
    table.render()
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
    table.densities(&report.densities);
    table.text("grid cells", &report.cells.map(|n| n.to_string()).join(" x "));
    table.render()
}
