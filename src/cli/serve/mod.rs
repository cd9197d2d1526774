//! `alveole serve`: requests on standard input, replies on standard output, a line each.
//!
//! Every line gets its reply, whatever it holds: a fault is a reply like any other and ends
//! nothing. The protocol, as `alveole help serve` prints it:
//!
//! ```text
#![doc = include_str!("protocol.md")]
//! ```

mod json;
mod programs;
mod reply;
mod request;

use super::args::ServeArguments;
use super::mesh;
use super::report::{self, Trouble};
use crate::job::{Access, Job, Settings};
use crate::num::Progress;
use programs::Programs;
use reply::{ErrorReply, Made, Reply, Written};
use request::{MeshWanted, Request, Wanted};
use serde_json::{Map, Value};
use std::io::{BufRead, Read, Write, stdin, stdout};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Instant;

/// The protocol, for the help.
pub(super) const PROTOCOL: &str = include_str!("protocol.md");

/// Longest line that is read, in bytes.
const LONGEST_LINE: usize = 4 << 20;

/// Answers requests until the input ends.
pub(super) fn run(arguments: &ServeArguments) -> Result<(), Trouble> {
    super::work::use_threads(arguments.threads)?;
    let most_cells = arguments.most_cells;
    let mut server = Server::new(Limits { access: Access::Regular, most_cells });
    let (mut input, mut output) = (stdin().lock(), stdout().lock());
    let mut line = Vec::new();
    loop {
        let reply = match read_line(&mut input, &mut line).map_err(Trouble::Requests)? {
            Line::End => return Ok(()),
            Line::TooLong => too_long(),
            Line::Whole if line.trim_ascii().is_empty() => continue,
            Line::Whole => server.answer(&line),
        };
        let sent = output.write_all(reply.as_bytes()).and_then(|()| output.flush());
        if let Err(error) = sent {
            // Where nobody listens any more there is nothing left to do.
            return report::heard(Err(error)).map_err(Trouble::Print);
        }
    }
}

/// What was read of the input.
#[derive(Debug, PartialEq, Eq)]
enum Line {
    /// A line, with or without its end.
    Whole,
    /// A line beyond [`LONGEST_LINE`], which was skipped.
    TooLong,
    /// Nothing: the input has ended.
    End,
}

/// Reads the next line into `line`, and of one that is too long only so much.
fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> std::io::Result<Line> {
    line.clear();
    let read = input.take(LONGEST_LINE as u64 + 1).read_until(b'\n', line)?;
    if read == 0 {
        return Ok(Line::End);
    }
    if read <= LONGEST_LINE || line.ends_with(b"\n") {
        return Ok(Line::Whole);
    }
    line.clear();
    input.skip_until(b'\n')?;
    Ok(Line::TooLong)
}

fn too_long() -> String {
    let message = format!("the line is longer than {LONGEST_LINE} bytes");
    let error = ErrorReply::plain("line", message).cure("name a file of words by `@FILE`");
    Reply { id: None, outcome: Err(error) }.line()
}

/// What a server may do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Which files programs may read. None may be written either for [`Access::Nothing`].
    pub access: Access,
    /// Most cells of a grid.
    pub most_cells: Option<u64>,
}

/// Answers lines, keeping the programs of late requests compiled.
#[derive(Debug)]
pub struct Server {
    programs: Programs,
    limits: Limits,
}

impl Server {
    /// A server within `limits`.
    #[must_use]
    pub fn new(limits: Limits) -> Self {
        Self { programs: Programs::new(limits.access), limits }
    }

    /// The reply to a request: one line of JSON, its end included.
    ///
    /// `line` may hold anything at all.
    pub fn answer(&mut self, line: &[u8]) -> String {
        let start = Instant::now();
        let id = json::id(line);
        let value = match json::value(line) {
            Ok(value) => value,
            Err(error) => {
                let error = if error.is_data() {
                    ErrorReply::plain("request", error.to_string())
                } else {
                    ErrorReply::plain("line", format!("the line can't be read as JSON: {error}"))
                };
                return Reply { id, outcome: Err(error) }.line();
            }
        };
        // A defect of this program must not take the other requests with it. The programs kept may
        // be in any state afterwards, so they go.
        let outcome = catch_unwind(AssertUnwindSafe(|| self.outcome(value)));
        let mut outcome = outcome.unwrap_or_else(|_| {
            self.programs = Programs::new(self.limits.access);
            Err(ErrorReply::plain("internal", "a defect of this program".to_owned()))
        });
        if let Ok(made) = &mut outcome {
            made.seconds = start.elapsed().as_secs_f64();
        }
        Reply { id, outcome }.line()
    }

    fn outcome(&mut self, value: Value) -> Result<Made, ErrorReply> {
        let request = Request::read(value)?;
        let words = request.words()?;
        let settings = request.settings();
        let job = self.programs.job(&words, &request.parameters())?;
        let grid = job.grid(&settings)?;
        let cells = grid.cells().iter().map(|&n| n as u64).product::<u64>();
        if let Some(most) = self.limits.most_cells.filter(|&most| cells > most) {
            let message = format!("the grid would have {cells} cells; this server allows {most}");
            return Err(ErrorReply::plain("grid", message).cure("give a larger spacing"));
        }
        let mut made = Made::on(&grid);
        made.warnings.extend(
            (job.unused_parameters().iter())
                .map(|name| format!("the parameter `{name}` is not used")),
        );
        let remarks = job.meshes().iter().flat_map(|note| {
            note.remarks().into_iter().map(|remark| format!("`{}`: {remark}", note.path))
        });
        made.warnings.extend(remarks);
        let remarks = job.conversions().iter().flat_map(|note| {
            note.remarks.iter().map(|remark| format!("`{}`: {remark}", note.word))
        });
        made.warnings.extend(remarks);
        if let Some(wanted) = &request.measure {
            measure(job, &settings, wanted, &mut made)?;
        }
        if request.wants_gradient() {
            let found = job.gradient(&settings, &Progress::new())?;
            made.gradient = Some(without_report(&found));
            made.warnings.extend(super::measure::unresolved(found.unresolved));
        }
        if request.wants_field() {
            let found = job.field_measures(&settings, &Progress::new())?;
            made.field = Some(without_report(&found));
            made.warnings.extend(super::measure::unresolved(found.unresolved));
        }
        if let Some(overhang) = request.overhang() {
            let (measures, found) = job.structure(&settings, &overhang, &Progress::new())?;
            made.structure = Some(found);
            made.warnings.extend(report::remarks(&measures.report));
        }
        if let Some(wanted) = &request.mesh {
            if self.limits.access == Access::Nothing {
                let message = "no files may be written here".to_owned();
                return Err(ErrorReply::plain("output", message));
            }
            write(job, &settings, wanted, &mut made)?;
        }
        made.warnings.sort_unstable();
        made.warnings.dedup();
        Ok(made)
    }
}

/// The fields of `found`, without the report of the work.
fn without_report(found: &impl serde::Serialize) -> Map<String, Value> {
    let Ok(Value::Object(mut fields)) = serde_json::to_value(found) else { return Map::new() };
    fields.remove("report");
    fields
}

/// Adds the measures that are wanted.
fn measure(
    job: &Job,
    settings: &Settings,
    wanted: &Wanted,
    made: &mut Made,
) -> Result<(), ErrorReply> {
    let progress = Progress::new();
    let (all, report) = if wanted.are_quick() {
        let totals = job.totals(settings, &progress)?;
        (serde_json::to_value(&totals), totals.report)
    } else {
        let measures = job.measure(settings, &progress)?;
        (serde_json::to_value(&measures), measures.report)
    };
    if let Ok(Value::Object(all)) = all {
        made.measures = Some(all.into_iter().filter(|(name, _)| wanted.includes(name)).collect());
    }
    made.warnings.extend(report::remarks(&report));
    Ok(())
}

/// Writes the mesh that is wanted.
fn write(
    job: &Job,
    settings: &Settings,
    wanted: &MeshWanted,
    made: &mut Made,
) -> Result<(), ErrorReply> {
    let path = Path::new(wanted.file());
    let special = std::fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir());
    if wanted.file() == "-" || special && path != Path::new("/dev/null") {
        let message = format!("cannot write `{}`: it is not a regular file", wanted.file());
        return Err(ErrorReply::plain("output", message));
    }
    let format = match wanted.format() {
        Some(format) => format,
        None => mesh::format(path)?,
    };
    let progress = Progress::new();
    let target = mesh::Target { path, format, precision: wanted.precision() };
    let settings = Settings { slivers: wanted.slivers(), ..settings.clone() };
    let grid = job.grid(&settings)?;
    let (precision, report) = mesh::write(job, &grid, &settings, &target, &progress)?;
    made.warnings.extend(report::remarks(&report));
    made.mesh = Some(Written::new(wanted.file(), format, precision, &report));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_whole_and_long_ones_are_skipped() {
        let mut input = b"one\n\n".to_vec();
        input.extend(std::iter::repeat_n(b'x', LONGEST_LINE + 1));
        input.extend(b"\ntwo\n");
        input.extend(std::iter::repeat_n(b'y', LONGEST_LINE));
        input.extend(b"\nlast");
        let (mut input, mut line) = (input.as_slice(), Vec::new());
        let mut next = || (read_line(&mut input, &mut line).unwrap(), line.len());
        assert_eq!(next(), (Line::Whole, 4));
        assert_eq!(next(), (Line::Whole, 1));
        assert_eq!(next(), (Line::TooLong, 0));
        assert_eq!(next(), (Line::Whole, 4));
        assert_eq!(next(), (Line::Whole, LONGEST_LINE + 1));
        assert_eq!(next(), (Line::Whole, 4));
        assert_eq!(next(), (Line::End, 0));
    }
}
