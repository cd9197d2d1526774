//! `alveole slice`: planar cuts of a solid, as SVG or PNG, without a mesh.

use super::args::{AxisArgument, SliceArguments};
use super::bar::with_bar;
use super::output::Output;
use super::report::{self, Trouble, ValueFault};
use super::table::{columns, significant};
use super::{mesh, stats, work};
use crate::contour::outlines::MOST_PLANES;
use crate::geom::Axis;
use crate::job::{Files, Job, longest_edge};
use crate::measure::slice::{Picture, Slice, Window, window};
use crate::num::Progress;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Most slices of one run: a number that a slip of a range exceeds.
const MOST_SLICES: f64 = 1e6;

/// A height beyond the box by this part of its side is on its border.
const ROUNDING: f64 = 1e-9;

/// Writes the slices of the program.
pub(super) fn run(name: &str, arguments: &SliceArguments, files: Files) -> Result<(), Trouble> {
    let start = Instant::now();
    let SliceArguments { output, at, axis, pixel, json, work: common } = arguments;
    let format = Format::of(output)?;
    if *json && output == Path::new("-") {
        return Err(work::wrong("-o", "-", ValueFault::Taken));
    }
    let work::Work { job, settings } = work::prepare(name, common, files, &[output])?;
    let axis = match axis {
        AxisArgument::X => Axis::X,
        AxisArgument::Y => Axis::Y,
        AxisArgument::Z => Axis::Z,
    };
    let heights = heights(at, &job)?;
    let names = Names::new(output, heights.len())?;
    let grid = job.grid(&settings)?;
    let line = grid.placed(axis);
    let (lo, hi) = (line[0], line[line.len() - 1]);
    let slack = ROUNDING * (hi - lo);
    if let Some(&height) = heights.iter().find(|u| !(lo - slack..=hi + slack).contains(*u)) {
        return Err(work::wrong("--at", at, ValueFault::Height { height, lo, hi }));
    }
    let window = window(&grid, axis);
    let pixel = match pixel {
        Some(text) => {
            if matches!(format, Format::Svg) {
                return Err(work::wrong("--pixel", text, ValueFault::NoPixels));
            }
            work::read_length("--pixel", text, job.parameters())?
        }
        None => longest_edge(&grid),
    };
    let form = match format {
        Format::Svg => Form::Svg,
        Format::Png => Form::Png(Picture::new(window, pixel)?),
    };
    let progress = Progress::new();
    let mut rows = Vec::with_capacity(heights.len());
    let last = with_bar(&progress, !common.quiet, || {
        let mut last = None;
        for (group, heights) in heights.chunks(MOST_PLANES).enumerate() {
            let (slices, report) = job.slices(&grid, axis, heights, &settings, &progress)?;
            for (k, slice) in slices.iter().enumerate() {
                let file = names.name(group * MOST_PLANES + k);
                write(slice, window, &form, &file)?;
                rows.push(Row::new(slice, &file));
            }
            last = report;
        }
        Ok::<_, Trouble>(last)
    })?;
    if *json {
        report::print(&stats::json(&rows))?;
    } else if !common.quiet && output != Path::new("-") {
        report::say(table(&rows).trim_end());
    }
    let Some(found) = last else { return Ok(()) };
    if !common.quiet {
        report::warn(name, &found);
    }
    mesh::write_stats(common.stats.as_deref(), &found, None, start)
}

/// What a slice is written as.
enum Form {
    Svg,
    Png(Picture),
}

/// What the name of an output asks for.
enum Format {
    Svg,
    Png,
}

impl Format {
    fn of(output: &Path) -> Result<Self, Trouble> {
        let extension = output.extension().map(|text| text.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            None if output == Path::new("-") => Ok(Self::Svg),
            Some(_) | None => Err(Trouble::Picture { name: output.display().to_string() }),
        }
    }
}

/// Writes a slice; the file appears when it is whole.
fn write(slice: &Slice, window: Window, form: &Form, file: &Path) -> Result<(), Trouble> {
    let output = Output::open(file)?;
    let mut to = BufWriter::new(output.file());
    let written = match form {
        Form::Svg => to.write_all(slice.svg(window).as_bytes()),
        Form::Png(picture) => picture.write(slice, &mut to),
    };
    written.and_then(|()| to.flush()).map_err(|error| output.failure(error))?;
    drop(to);
    Ok(output.finish()?)
}

/// The heights that the value of `--at` lists.
fn heights(text: &str, job: &Job) -> Result<Vec<f64>, Trouble> {
    let number = |part: &str| match *work::read_numbers("--at", part, job.parameters())?.as_slice()
    {
        [number] => Ok(number),
        _ => Err(work::wrong("--at", text, ValueFault::Range)),
    };
    let parts: Vec<&str> = text.split(':').collect();
    let [from, to, step] = match parts.as_slice() {
        [list] => return work::read_numbers("--at", list, job.parameters()),
        [from, to, step] => [number(from)?, number(to)?, number(step)?],
        _ => return Err(work::wrong("--at", text, ValueFault::Range)),
    };
    let steps = ((to - from) / step + ROUNDING).floor();
    if !(step != 0.0 && steps >= 0.0) {
        return Err(work::wrong("--at", text, ValueFault::Range));
    }
    if steps >= MOST_SLICES {
        return Err(work::wrong("--at", text, ValueFault::Slices { steps: steps + 1.0 }));
    }
    Ok((0..=steps as u32).map(|k| from + f64::from(k) * step).collect())
}

/// The names of the files.
struct Names {
    before: String,
    /// Digits of the number, and what follows it; `None` where there is no number.
    rest: Option<(usize, String)>,
}

impl Names {
    /// The names that `output` stands for, of `count` files: `%d` is the number of the slice, `%04d` the
    /// same with four digits.
    fn new(output: &Path, count: usize) -> Result<Self, Trouble> {
        let text = output.to_string_lossy().into_owned();
        let numbered = text.split_once('%').and_then(|(before, rest)| {
            let (digits, after) = rest.split_once('d')?;
            let width = if digits.is_empty() { Some(0) } else { digits.parse().ok() };
            let width = width.filter(|width: &usize| *width <= 18)?;
            Some(Self { before: before.to_owned(), rest: Some((width, after.to_owned())) })
        });
        match numbered {
            Some(names) => Ok(names),
            None if count == 1 => Ok(Self { before: text, rest: None }),
            None => Err(Trouble::Names { name: text, count }),
        }
    }

    /// The name of file `number`, from 0 on.
    fn name(&self, number: usize) -> PathBuf {
        match &self.rest {
            Some((width, after)) => format!("{}{number:0width$}{after}", self.before).into(),
            None => self.before.clone().into(),
        }
    }
}

/// What is told of a slice.
#[derive(serde::Serialize)]
struct Row {
    file: String,
    at: f64,
    area: f64,
    perimeter: f64,
    outlines: usize,
    holes: usize,
}

impl Row {
    fn new(slice: &Slice, file: &Path) -> Self {
        Self {
            file: file.display().to_string(),
            at: slice.at,
            area: slice.area(),
            perimeter: slice.perimeter(),
            outlines: slice.outlines.len(),
            holes: slice.holes(),
        }
    }
}

fn table(rows: &[Row]) -> String {
    let heads = ["file", "at", "area", "perimeter", "outlines", "holes"].map(str::to_owned);
    let cells = rows.iter().map(|row| {
        let Row { file, at, area, perimeter, outlines, holes } = row;
        let [at, area, perimeter] = [at, area, perimeter].map(|value| significant(*value));
        [file.clone(), at, area, perimeter, outlines.to_string(), holes.to_string()]
    });
    columns(&std::iter::once(heads).chain(cells).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_numbered_where_they_say_so() {
        let of = |output: &str, count, number| {
            Names::new(Path::new(output), count).map(|names| names.name(number))
        };
        assert_eq!(of("part-%04d.svg", 3, 2).unwrap(), Path::new("part-0002.svg"));
        assert_eq!(of("%d.svg", 1, 0).unwrap(), Path::new("0.svg"));
        assert_eq!(of("100%.svg", 1, 0).unwrap(), Path::new("100%.svg"));
        assert!(matches!(of("part.svg", 2, 0), Err(Trouble::Names { .. })));
        assert!(matches!(of("%x%4.svg", 2, 0), Err(Trouble::Names { .. })));
    }

    #[test]
    fn heights_are_listed_or_a_range() {
        let job = Job::parse_with("box", &[("t", 0.5)]).unwrap();
        let of = |text: &str| heights(text, &job).ok();
        assert_eq!(of("0.1,t"), Some(vec![0.1, 0.5]));
        assert_eq!(of("0:t:1/4"), Some(vec![0.0, 0.25, 0.5]));
        assert_eq!(of("1:0:-t"), Some(vec![1.0, 0.5, 0.0]));
        assert_eq!(of("0:1:0.1").map(|all| all.len()), Some(11));
        for wrong in ["0:1", "0:1:0", "0:1:-1", "0:1:1e-9", "0:1,2:1", "a", "", "0:1:2:3"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
