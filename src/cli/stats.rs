//! Machine-readable output: statistics of a run, and JSON in general.

use super::output::Output;
use super::report::Trouble;
use crate::job::{Report, Survey};
use std::io::Write;
use std::path::Path;
use std::time::Duration;

#[derive(serde::Serialize)]
struct Statistics<'a> {
    version: &'static str,
    #[serde(flatten)]
    report: &'a Report,
    /// Euler characteristic of the mesh.
    euler: i64,
    /// Volume, area and what hangs together, if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    survey: Option<&'a Survey>,
    /// Sampled part of the grid's bricks.
    sampled_fraction: f64,
    total_seconds: f64,
    /// Largest resident set of the process so far; absent where the system does not tell.
    peak_memory_bytes: Option<u64>,
    threads: usize,
}

/// Writes the statistics of a run that took `total` to `path`.
pub(super) fn write(
    path: &Path,
    report: &Report,
    survey: Option<&Survey>,
    total: Duration,
) -> Result<(), Trouble> {
    let statistics = Statistics {
        version: env!("CARGO_PKG_VERSION"),
        report,
        euler: report.contour.euler(),
        survey,
        sampled_fraction: report.contour.active_bricks as f64 / report.contour.bricks as f64,
        total_seconds: total.as_secs_f64(),
        peak_memory_bytes: peak_memory(),
        threads: rayon::current_num_threads(),
    };
    let output = Output::open(path)?;
    let mut file = output.file();
    file.write_all(json(&statistics).as_bytes()).map_err(|error| output.failure(error))?;
    Ok(output.finish()?)
}

/// `value` as indented JSON with a line end.
pub(super) fn json(value: &impl serde::Serialize) -> String {
    let mut text = serde_json::to_string_pretty(value).expect("our own structures have text keys");
    text.push('\n');
    text
}

/// The largest resident set so far, as Linux tells it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
