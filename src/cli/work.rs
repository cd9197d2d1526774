//! From the arguments of a command that contours to a job and its settings.

use super::args::WorkArguments;
use super::report::{self, Trouble, ValueFault};
use crate::geom::{Aabb, Axis};
use crate::job::{Job, Settings, Spacing};
use crate::lang;
use glam::DVec3;

/// A job and how to do it.
pub(super) struct Work {
    pub(super) job: Job,
    pub(super) settings: Settings,
}

/// Reads the options and the program, and says what is to be said about its meshes.
pub(super) fn prepare(name: &str, arguments: &WorkArguments) -> Result<Work, Trouble> {
    let WorkArguments { spacing, bounds, threads, quiet, stats: _, program } = arguments;
    if let Some(threads) = threads {
        // Fails only where a pool exists already; then its threads serve.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global();
    }
    let spacing = spacing.as_deref().map_or(Ok(Spacing::Hundredth), read_spacing)?;
    let bounds = bounds.as_deref().map(read_bounds).transpose()?;
    let job = Job::new(program)?;
    if !quiet {
        for note in job.meshes() {
            report::mesh_note(name, note);
        }
    }
    Ok(Work { job, settings: Settings { spacing, bounds, ..Settings::default() } })
}

fn read_spacing(text: &str) -> Result<Spacing, Trouble> {
    let numbers = read_numbers("-s", text)?;
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

fn read_bounds(text: &str) -> Result<Aabb, Trouble> {
    let numbers = read_numbers("--bounds", text)?;
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

fn read_numbers(option: &'static str, text: &str) -> Result<Vec<f64>, Trouble> {
    lang::numbers(text, &format!("the value of `{option}`"), &[]).map_err(Trouble::Number)
}

fn wrong(option: &'static str, text: &str, fault: ValueFault) -> Trouble {
    Trouble::Value { option, text: text.to_owned(), fault }
}
