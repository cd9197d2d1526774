//! The `cesogen` command: a drop-in for the Cesogen command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    alveole::cli::run_cesogen(std::env::args_os())
}
