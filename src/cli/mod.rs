//! The commands `alveole` and `cesogen`: arguments, reports, exit codes.
//!
//! One file a subcommand. Everything printed goes through `report`; everything done is done by
//! [`job`]. Exit codes: 0 done; 1 the work failed; 2 the command line or the program
//! text is wrong; 130 interrupted.

mod args;
mod bar;
mod chart;
mod check;
mod convert;
mod interrupt;
mod list;
mod measure;
mod mesh;
mod output;
mod report;
mod scratch;
pub mod serve;
mod slice;
mod stats;
mod study;
mod summary;
mod table;
mod work;

use crate::job::{self, Files};
use crate::lang;
use args::{Alveole, Cesogen, Command, Programmed, Study};
use clap::{CommandFactory, FromArgMatches};
use report::Trouble;
use std::any::Any;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::process::ExitCode;

/// Runs `alveole` with `arguments`, the first of which is the program's name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let described = Alveole::command()
        .mut_subcommand("mesh", |mesh| mesh.after_long_help(list::summary()))
        .mut_subcommand("measure", |measure| measure.after_long_help(list::summary()))
        .mut_subcommand("slice", |slice| slice.after_long_help(list::summary()))
        .mut_subcommand("study", |study| {
            study
                .mut_subcommand("roundtrip", |trips| trips.after_long_help(list::summary()))
                .mut_subcommand("hierarchy", |steps| steps.after_long_help(list::summary()))
        })
        .mut_subcommand("serve", |serve| serve.after_long_help(serve::PROTOCOL));
    conclude("alveole", || {
        parse(&described, arguments).and_then(|(Alveole { command }, files)| {
            interrupt::install();
            match command {
                Command::Mesh(arguments) => mesh::run("alveole mesh", &arguments, files),
                Command::List(arguments) => list::run(&arguments),
                Command::Measure(arguments) => measure::run("alveole measure", &arguments, files),
                Command::Slice(arguments) => slice::run("alveole slice", &arguments, files),
                Command::Check(arguments) => check::run(&arguments),
                Command::Study { study: Study::Roundtrip(arguments) } => {
                    study::round_trips("alveole study roundtrip", &arguments, files)
                }
                Command::Study { study: Study::Hierarchy(arguments) } => {
                    study::hierarchy("alveole study hierarchy", &arguments)
                }
                Command::Convert(arguments) => convert::run(&arguments),
                Command::Serve(arguments) => serve::run(&arguments),
                Command::Completions { shell } => list::completions(shell, &mut Alveole::command()),
            }
        })
    })
}

/// Runs `cesogen` with `arguments`, the first of which is the program's name.
pub fn run_cesogen(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let described = Cesogen::command().after_long_help(list::summary());
    conclude("cesogen", || {
        parse(&described, arguments).and_then(|(Cesogen { mesh }, files)| {
            interrupt::install();
            mesh::run("cesogen", &mesh, files)
        })
    })
}

/// Reads `arguments` as `command` describes them; the files are those to read the program from.
///
/// An `@file` before the first operand may hold options, as in the original: its words then
/// take its place and the arguments are read again. Otherwise the files have its text.
fn parse<T: FromArgMatches + Programmed>(
    command: &clap::Command,
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<(T, Files), Trouble> {
    /// Files of options that name files of options, at most.
    const DEPTH_LIMIT: usize = 16;
    let mut arguments: Vec<OsString> = arguments.into_iter().collect();
    let mut files = Files::default();
    for _ in 0..DEPTH_LIMIT {
        let matches = command.clone().try_get_matches_from(&arguments).map_err(Trouble::Usage)?;
        let read = T::from_arg_matches(&matches).map_err(Trouble::Usage)?;
        let words = read.program();
        let first = arguments.len() - words.len();
        let is_after_options = first > 0 && arguments[first - 1] != "--";
        let options = match words.first() {
            Some(word) if is_after_options && word.starts_with('@') => {
                options_of(word, &mut files)?
            }
            Some(_) | None => None,
        };
        match options {
            Some(options) => drop(arguments.splice(first..=first, options)),
            None => return Ok((read, files.again())),
        }
    }
    let first = arguments.len().saturating_sub(1);
    Err(Trouble::Options { file: arguments[first].to_string_lossy().into_owned() })
}

/// The words of the file that `word` names, if they begin with an option.
fn options_of(word: &str, files: &mut Files) -> Result<Option<Vec<OsString>>, Trouble> {
    let text = lang::expand(&[word.to_owned()], files).map_err(job::Error::from)?;
    let begins = text.words.first().is_some_and(|first| first.text.starts_with('-'));
    Ok(begins.then(|| text.words.into_iter().map(|token| token.text.into()).collect()))
}

/// Does the work and says what became of it.
///
/// An allocation that fails ends the process with exit code 1 and a message; that the code generator
/// makes a panic of some is no reason to end otherwise.
fn conclude(name: &str, work: impl FnOnce() -> Result<(), Trouble>) -> ExitCode {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(trouble)) => report::trouble(name, &trouble),
        Err(panic) if is_shortage(&*panic) => {
            report::say(&format!(
                "{name}: memory ran out; allow for more, or give a larger spacing or smaller bounds"
            ));
            ExitCode::FAILURE
        }
        Err(panic) => resume_unwind(panic),
    }
}

/// Whether a panic says that memory has run out.
fn is_shortage(panic: &(dyn Any + Send)) -> bool {
    panic.downcast_ref::<String>().is_some_and(|text| text.contains("out-of-memory"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_runs_out_in_a_library_is_a_failure_and_no_defect() {
        let panics = |text: &str| conclude("alveole", || std::panic::panic_any(text.to_owned()));
        let text = "unhandled out-of-memory error: out of memory (failed to allocate 1025 bytes)";
        assert_eq!(panics(text), ExitCode::FAILURE);
        assert!(catch_unwind(|| panics("no such index")).is_err());
    }
}
