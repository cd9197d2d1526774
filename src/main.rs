//! The `alveole` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    alveole::cli::run(std::env::args_os())
}
