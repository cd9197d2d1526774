//! The commands `alveole` and `cesogen`: arguments, reports, exit codes.
//!
//! One file a subcommand. Everything printed goes through [`report`]; everything done is done by
//! [`job`](crate::job). Exit codes: 0 done; 1 the work failed; 2 the command line or the program
//! text is wrong; 130 interrupted.

mod args;
mod bar;
mod check;
mod interrupt;
mod list;
mod measure;
mod mesh;
mod output;
mod report;
mod stats;
mod table;
mod work;

use args::{Alveole, Cesogen, Command};
use clap::{CommandFactory, FromArgMatches};
use report::Trouble;
use std::ffi::OsString;
use std::process::ExitCode;

/// Runs `alveole` with `arguments`, the first of which is the program's name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let described = Alveole::command()
        .mut_subcommand("mesh", |mesh| mesh.after_long_help(list::summary()))
        .mut_subcommand("measure", |measure| measure.after_long_help(list::summary()));
    conclude(
        "alveole",
        parse::<Alveole>(described, arguments).and_then(|Alveole { command }| {
            interrupt::install();
            match command {
                Command::Mesh(arguments) => mesh::run("alveole mesh", &arguments),
                Command::List(arguments) => list::run(&arguments),
                Command::Measure(arguments) => measure::run("alveole measure", &arguments),
                Command::Check(arguments) => check::run(&arguments),
                Command::Completions { shell } => list::completions(shell, &mut Alveole::command()),
            }
        }),
    )
}

/// Runs `cesogen` with `arguments`, the first of which is the program's name.
pub fn run_cesogen(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let described = Cesogen::command().after_long_help(list::summary());
    conclude(
        "cesogen",
        parse::<Cesogen>(described, arguments).and_then(|Cesogen { mesh }| {
            interrupt::install();
            mesh::run("cesogen", &mesh)
        }),
    )
}

fn parse<T: FromArgMatches>(
    command: clap::Command,
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<T, Trouble> {
    let matches = command.try_get_matches_from(arguments).map_err(Trouble::Usage)?;
    T::from_arg_matches(&matches).map_err(Trouble::Usage)
}

fn conclude(name: &str, result: Result<(), Trouble>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(trouble) => report::trouble(name, &trouble),
    }
}
