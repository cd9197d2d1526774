//! From the arguments of a command that contours to a job and its settings.

use super::args::{OverhangArguments, PrecisionArgument, WorkArguments};
use super::output::Output;
use super::report::{self, Trouble, ValueFault};
use crate::geom::{Aabb, Axis};
use crate::job::{Files, Job, Settings, Spacing};
use crate::lang;
use crate::measure::Overhang;
use crate::mesh::io::{Format, Precision};
use crate::num::memory;
use crate::vocabulary::Words;
use glam::DVec3;
use rayon::ThreadPoolBuilder;
use std::collections::HashSet;
use std::num::NonZeroUsize;
use std::path::Path;

/// A job and how to do it.
pub(super) struct Work {
    pub(super) job: Job,
    pub(super) settings: Settings,
}

/// Reads the options and the program, whose files are read from `files`, and says what is to be said
/// about its meshes; `outputs` are the files that the command writes besides the statistics.
pub(super) fn prepare(
    name: &str,
    arguments: &WorkArguments,
    files: Files,
    outputs: &[&Path],
) -> Result<Work, Trouble> {
    let (settings, defined) = read_options(arguments)?;
    let job = Job::read(&arguments.program, &defined, files)?;
    remark(name, arguments, &job);
    probe_stats(arguments, job.files(), outputs)?;
    Ok(Work { job, settings })
}

/// Tries whether the statistics can be written, so that the work is not lost for want of it, to a
/// file that is neither among `inputs` nor among `outputs`.
pub(super) fn probe_stats(
    arguments: &WorkArguments,
    inputs: &[String],
    outputs: &[&Path],
) -> Result<(), Trouble> {
    let Some(stats) = arguments.stats.as_deref() else { return Ok(()) };
    // A file that is not there yet has no canonical name.
    let whole = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).ok();
    let is_stats =
        |other: &Path| stats == other || whole(stats).is_some_and(|s| Some(s) == whole(other));
    let is_device = stats.metadata().is_ok_and(|data| !data.is_file());
    let mut others = inputs.iter().map(Path::new).chain(outputs.iter().copied());
    if !is_device && others.any(is_stats) {
        return Err(wrong("--stats", &stats.display().to_string(), ValueFault::InUse));
    }
    Ok(Output::probe(stats)?)
}

/// Reads the options: how to contour, and the parameters.
pub(super) fn read_options(
    arguments: &WorkArguments,
) -> Result<(Settings, Vec<(String, f64)>), Trouble> {
    let WorkArguments { spacing, bounds, parameters, threads, quiet: _, stats: _, program: _ } =
        arguments;
    use_threads(*threads)?;
    let defined = lang::parameters::define(parameters, &Words)
        .map_err(|rejected| Trouble::Number { option: "--param", rejected })?;
    let read = |text| read_spacing(text, &defined);
    let spacing = spacing.as_deref().map_or(Ok(Spacing::Hundredth), read)?;
    let read = |text| read_bounds(text, &defined);
    let bounds = bounds.as_deref().map(read).transpose()?;
    Ok((Settings { spacing, bounds, ..Settings::default() }, defined))
}

/// Says what is to be said about the meshes of `job`, and about parameters that are not used.
pub(super) fn remark(name: &str, arguments: &WorkArguments, job: &Job) {
    let WorkArguments { spacing, bounds, parameters, threads: _, quiet, stats: _, program: _ } =
        arguments;
    if *quiet {
        return;
    }
    report::conversions(name, job.conversions());
    for note in job.meshes() {
        report::mesh_note(name, note);
    }
    let options = parameters.iter().chain(spacing).chain(bounds);
    let used: HashSet<&str> = options.flat_map(|text| used_in(text)).collect();
    for unused in job.unused_parameters().iter().filter(|name| !used.contains(name.as_str())) {
        report::say(&format!("{name}: warning: the parameter `{unused}` is not used"));
    }
}

/// Reads the precision of coordinates in a file of that format, if it is given.
pub(super) fn read_precision(
    argument: Option<PrecisionArgument>,
    format: Format,
) -> Result<Option<Precision>, Trouble> {
    match argument {
        Some(PrecisionArgument::Double) if format == Format::Stl => {
            Err(wrong("--precision", "double", ValueFault::SingleOnly))
        }
        Some(PrecisionArgument::Double) => Ok(Some(Precision::Double)),
        Some(PrecisionArgument::Single) => Ok(Some(Precision::Single)),
        None => Ok(None),
    }
}

/// Reads which faces overhang, if `wanted` says that anything depends on it.
pub(super) fn read_overhang(
    arguments: &OverhangArguments,
    wanted: Option<&'static str>,
    job: &Job,
) -> Result<Overhang, Trouble> {
    let OverhangArguments { angle, up } = arguments;
    let mut overhang = Overhang::default();
    for (option, text) in [("--overhang", angle), ("--up", up)] {
        let Some(text) = text else { continue };
        if let Some(needed) = wanted {
            return Err(wrong(option, text, ValueFault::Needless { needed }));
        }
        let numbers = read_numbers(option, text, job.parameters())?;
        match *numbers.as_slice() {
            [angle] if option == "--overhang" && angle > 0.0 && angle <= 90.0 => {
                overhang.angle_deg = angle;
            }
            [x, y, z] if option == "--up" => {
                overhang.up = DVec3::new(x, y, z);
                if !overhang.up.normalize_or_zero().is_normalized() {
                    return Err(wrong(option, text, ValueFault::Direction));
                }
            }
            _ if option == "--up" => return Err(wrong(option, text, ValueFault::Direction)),
            _ => return Err(wrong(option, text, ValueFault::Angle)),
        }
    }
    Ok(overhang)
}

/// Uses so many threads from now on; all processors by default, but no more than the memory of a
/// limited process has room for. The result does not depend on it.
///
/// # Errors
/// [`Trouble::Threads`].
pub(super) fn use_threads(threads: Option<NonZeroUsize>) -> Result<(), Trouble> {
    /// Addresses that a thread takes: its stack, and what the allocator sets aside for it.
    const ADDRESSES: u64 = 72 << 20;
    let mut builder = ThreadPoolBuilder::new().num_threads(threads.map_or(0, NonZeroUsize::get));
    if memory::is_limited()
        && let Some(available) = memory::available()
    {
        let wanted = threads.or_else(|| std::thread::available_parallelism().ok());
        let room = (available / ADDRESSES) as usize;
        builder = builder.num_threads(wanted.map_or(1, NonZeroUsize::get).min(room.max(1)));
        if room < 2 {
            builder = builder.use_current_thread();
        }
    }
    builder.build_global().map_err(Trouble::Threads)
}

/// The names that the value of an option uses; in a definition, right of its `=`.
fn used_in(text: &str) -> impl Iterator<Item = &str> {
    let value = text.split_once('=').map_or(text, |(_, value)| value);
    lang::parameters::mentioned(value)
}

fn read_spacing(text: &str, parameters: &[(String, f64)]) -> Result<Spacing, Trouble> {
    let numbers = read_numbers("-s", text, parameters)?;
    let spacing = match *numbers.as_slice() {
        [s] => DVec3::splat(s),
        [x, y, z] => DVec3::new(x, y, z),
        _ => return Err(wrong("-s", text, ValueFault::SpacingCount)),
    };
    if spacing.cmpgt(DVec3::ZERO).all() && spacing.is_finite() {
        Ok(Spacing::Each(spacing))
    } else {
        Err(wrong("-s", text, ValueFault::SpacingSign))
    }
}

fn read_bounds(text: &str, parameters: &[(String, f64)]) -> Result<Aabb, Trouble> {
    let numbers = read_numbers("--bounds", text, parameters)?;
    let &[x0, y0, z0, x1, y1, z1] = numbers.as_slice() else {
        return Err(wrong("--bounds", text, ValueFault::BoundsCount));
    };
    let bounds = Aabb::new(DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
    for axis in Axis::ALL {
        let (lo, hi) = (bounds.lo[axis.index()], bounds.hi[axis.index()]);
        if !(lo < hi && lo.is_finite() && hi.is_finite()) {
            return Err(wrong("--bounds", text, ValueFault::BoundsOrder { axis, lo, hi }));
        }
    }
    Ok(bounds)
}

/// Reads one positive length.
pub(super) fn read_length(
    option: &'static str,
    text: &str,
    parameters: &[(String, f64)],
) -> Result<f64, Trouble> {
    match *read_numbers(option, text, parameters)?.as_slice() {
        [length] if length > 0.0 && length.is_finite() => Ok(length),
        _ => Err(wrong(option, text, ValueFault::Length)),
    }
}

pub(super) fn read_numbers(
    option: &'static str,
    text: &str,
    parameters: &[(String, f64)],
) -> Result<Vec<f64>, Trouble> {
    lang::numbers(text, &format!("the value of `{option}`"), parameters)
        .map_err(|rejected| Trouble::Number { option, rejected })
}

pub(super) fn wrong(option: &'static str, text: &str, fault: ValueFault) -> Trouble {
    Trouble::Value { option, text: text.to_owned(), fault }
}
