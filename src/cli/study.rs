//! `alveole study`: what a solid loses on its way through files.

use super::args::{FormatArgument, HierarchyArguments, PassageArguments, RoundtripArguments};
use super::bar::with_bar;
use super::chart::{self, Fill, Labels, Mark, Series};
use super::output::Output;
use super::report::{self, Trouble, ValueFault};
use super::scratch::Scratch;
use super::table::{Table, columns, significant};
use super::{mesh, stats, work};
use crate::job::Files;
use crate::job::study::{Grids, Hierarchy, Numbers, Passage, RoundTrips, Step, Trip};
use crate::measure::Deviation;
use crate::mesh::io::{Format, Precision};
use crate::num::Progress;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

/// What is said of the four errors below a table.
const LEGEND: &str = "errors: L2 and maximum of the program's field at vertices (points) and at centres of \
                      triangles, over the diagonal\n";

/// Prints what round trips do to the program's mesh.
pub(super) fn round_trips(
    name: &str,
    arguments: &RoundtripArguments,
    files: Files,
) -> Result<(), Trouble> {
    let start = Instant::now();
    let RoundtripArguments { times, shift, plot, passage: wanted, work: common } = arguments;
    let outputs = plot.as_deref();
    let work::Work { job, settings } = work::prepare(name, common, files, outputs.as_slice())?;
    // Before the work, so that it is not lost for want of a folder.
    let plot = plot.as_deref().map(open_plot).transpose()?;
    let scratch = Scratch::new()?;
    let passage = passage(wanted, &scratch)?;
    let grids = if *shift { Grids::Shifted } else { Grids::Same };
    let progress = Progress::new();
    let found = with_bar(&progress, !common.quiet, || {
        job.round_trips(*times, grids, &settings, &passage, &progress)
    })?;
    if let Some(output) = plot {
        let text = chart(&found, grids);
        output.file().write_all(text.as_bytes()).map_err(|error| output.failure(error))?;
        output.finish()?;
    }
    if !common.quiet {
        report::warn(name, &found.report);
    }
    report::print(&if wanted.json { stats::json(&found) } else { table(&found, &passage) })?;
    mesh::write_stats(common.stats.as_deref(), &found.report, None, start)
}

/// Prints what becomes of a program in steps, through files and at once.
pub(super) fn hierarchy(name: &str, arguments: &HierarchyArguments) -> Result<(), Trouble> {
    let start = Instant::now();
    let HierarchyArguments { passage: wanted, work: common } = arguments;
    let (settings, parameters) = work::read_options(common)?;
    let hierarchy = Hierarchy::new(&common.program, &parameters)?;
    if let Some(job) = hierarchy.whole() {
        work::remark(name, common, job);
        work::probe_stats(common, job.files(), &[])?;
    }
    let scratch = Scratch::new()?;
    let passage = passage(wanted, &scratch)?;
    let progress = Progress::new();
    let found =
        with_bar(&progress, !common.quiet, || hierarchy.run(&settings, &passage, &progress))?;
    let rows = found.iter().map(|step| WithRatio { step, ratio: step.ratio() });
    report::print(&if wanted.json {
        stats::json(&rows.collect::<Vec<_>>())
    } else {
        steps_table(&found, &passage)
    })?;
    let Some(last) = found.last() else { return Ok(()) };
    if !common.quiet {
        report::warn(name, &last.report);
    }
    mesh::write_stats(common.stats.as_deref(), &last.report, None, start)
}

/// A step and the ratio of its errors in one object.
#[derive(serde::Serialize)]
struct WithRatio<'a> {
    #[serde(flatten)]
    step: &'a Step,
    ratio: Deviation,
}

/// Opens the file of a plot.
fn open_plot(path: &Path) -> Result<Output, Trouble> {
    let is_svg = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg"));
    if !is_svg {
        return Err(work::wrong("--plot", &path.display().to_string(), ValueFault::Plot));
    }
    Ok(Output::open(path)?)
}

fn passage(arguments: &PassageArguments, scratch: &Scratch) -> Result<Passage, Trouble> {
    let PassageArguments { format, precision, json: _ } = arguments;
    let format = match format {
        FormatArgument::Ply => Format::Ply,
        FormatArgument::Stl => Format::Stl,
        FormatArgument::ThreeMf => Format::ThreeMf,
        FormatArgument::Obj => Format::Obj,
        FormatArgument::Off => Format::Off,
    };
    let precision = match work::read_precision(*precision, format)? {
        Some(precision) => precision,
        None if format == Format::Stl => Precision::Single,
        None => Precision::Double,
    };
    Ok(Passage { folder: scratch.path().to_owned(), format, precision })
}

/// A format and a precision in words.
fn files(passage: &Passage) -> String {
    let Passage { folder: _, format, precision } = passage;
    let bits = match precision {
        Precision::Single => 32,
        Precision::Double => 64,
    };
    format!("{} of {bits}-bit coordinates", format.name())
}

/// The heads of the columns of a mesh's numbers.
const HEADS: [&str; 7] =
    ["points L2", "points max", "centres L2", "centres max", "volume", "area", "Euler"];

/// The numbers of a mesh under [`HEADS`].
fn cells(numbers: &Numbers) -> [String; 7] {
    let [a, b, c, d] = numbers.deviations.values.errors().map(|error| format!("{error:.3e}"));
    let [volume, area] = [numbers.volume, numbers.area].map(significant);
    [a, b, c, d, volume, area, numbers.euler.to_string()]
}

/// The trips that a table shows: the first, 1, 2, 5 and so on, the last.
fn is_shown(number: u32, last: u32) -> bool {
    let mut leading = number;
    while leading >= 10 && leading.is_multiple_of(10) {
        leading /= 10;
    }
    number == last || matches!(leading, 0 | 1 | 2 | 5)
}

fn table(found: &RoundTrips, passage: &Passage) -> String {
    let RoundTrips { cells: grid, bounds: _, diagonal, trips, fixed_from, report: _ } = found;
    let last = trips.last().map_or(0, |trip| trip.number);
    let heads = ["trip"].into_iter().chain(HEADS).chain(["moved", "mesh"]).map(str::to_owned);
    let mut lines = vec![heads.collect::<Vec<_>>()];
    for trip in trips.iter().filter(|trip| is_shown(trip.number, last)) {
        let Trip { number, numbers, moved, unchanged } = trip;
        let mesh = match moved {
            _ if *number == 0 => "first",
            _ if *unchanged => "unchanged",
            Some(_) => "same triangles",
            None => "other triangles",
        };
        let moved = moved.map_or_else(|| "-".to_owned(), |moved| format!("{moved:.1e}"));
        let line = std::iter::once(number.to_string()).chain(cells(numbers));
        lines.push(line.chain([moved, mesh.to_owned()]).collect());
    }
    let mut about = Table::default();
    about.text("grid cells", &grid.map(|n| n.to_string()).join(" x "));
    about.number("diagonal", *diagonal);
    about.text("files", &files(passage));
    let unsound = trips.iter().filter(|trip| !trip.numbers.sound).count();
    if unsound > 0 {
        about.text("meshes with defects", &unsound.to_string());
    }
    about.text(
        "fixed point",
        &match fixed_from {
            Some(number) => {
                format!("from trip {number} on every mesh is the one before, to the bit")
            }
            None => "none: the last mesh is not the one before it, to the bit".to_owned(),
        },
    );
    format!(
        "{}\n{LEGEND}moved: farthest way of a vertex from its first place, in spacings\n\n{}",
        columns(&lines),
        about.render()
    )
}

fn steps_table(steps: &[Step], passage: &Passage) -> String {
    let heads = ["step", "made"].into_iter().chain(HEADS).map(str::to_owned);
    let mut lines = vec![heads.collect::<Vec<_>>()];
    let mut about = Table::default();
    for step in steps {
        let Step { number, program, direct, sequential, diagonal: _, report: _ } = step;
        let line = |made: &str, cells: [String; 7]| {
            [number.to_string(), made.to_owned()].into_iter().chain(cells).collect::<Vec<_>>()
        };
        lines.push(line("direct", cells(direct)));
        lines.push(line("sequential", cells(sequential)));
        let [a, b, c, d] = step.ratio().errors();
        let ratios = [a, b, c, d, sequential.volume / direct.volume, sequential.area / direct.area];
        let [a, b, c, d, volume, area] = ratios.map(|ratio| format!("{ratio:.6}"));
        lines.push(line("ratio", [a, b, c, d, volume, area, String::new()]));
        about.text(&format!("step {number}"), program);
        for (made, numbers) in [("direct", direct), ("sequential", sequential)] {
            if !numbers.sound {
                about.text("", &format!("the {made} mesh has defects"));
            }
        }
    }
    about.text("files", &files(passage));
    format!("{}\n{LEGEND}\n{}", columns(&lines), about.render())
}

/// The errors over the trips, as the paper's figure 9 has them.
fn chart(found: &RoundTrips, grids: Grids) -> String {
    let RoundTrips { cells, bounds: _, diagonal, trips, fixed_from: _, report: _ } = found;
    let title = match grids {
        Grids::Same => "Round trips through files on one grid",
        Grids::Shifted => "Round trips through files, each on a grid of its own",
    };
    let cells = cells.map(|n| n.to_string()).join(" × ");
    let labels = Labels {
        title: title.to_owned(),
        subtitle: format!("{cells} cells, diagonal {}", significant(*diagonal)),
        right: "round trip",
        up: "error, relative to the diagonal of the grid",
    };
    let [points, centres] = ["#0b62a4", "#c8501e"];
    let names = [
        ("points, L2", points, Mark::Circle(Fill::Filled)),
        ("points, maximum", points, Mark::Circle(Fill::Hollow)),
        ("centres, L2", centres, Mark::Triangle(Fill::Filled)),
        ("centres, maximum", centres, Mark::Triangle(Fill::Hollow)),
    ];
    let lines = names.into_iter().enumerate().map(|(i, (name, colour, mark))| {
        let errors = |trip: &Trip| trip.numbers.deviations.values.errors();
        let points = trips.iter().map(|trip| [f64::from(trip.number), errors(trip)[i]]).collect();
        Series { name: name.to_owned(), colour, mark, points }
    });
    chart::svg(&labels, &lines.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_shows_few_trips() {
        let shown = |last| (0..=last).filter(|n| is_shown(*n, last)).collect::<Vec<_>>();
        assert_eq!(shown(7), [0, 1, 2, 5, 7]);
        assert_eq!(shown(1000), [0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000]);
        assert_eq!(shown(15), [0, 1, 2, 5, 10, 15]);
    }
}
