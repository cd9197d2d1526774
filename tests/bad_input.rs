//! Bad input of every kind: each is refused with its exit code and one clear message, in bounded time
//! and memory, and leaves nothing behind.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests may, and say what they skip")]

#[path = "bad_input/files.rs"]
mod files;

#[path = "bad_input/commands.rs"]
mod commands;

#[path = "bad_input/readers.rs"]
mod readers;

#[path = "bad_input/requests.rs"]
mod requests;

#[path = "bad_input/run.rs"]
mod run;

#[path = "bad_input/special.rs"]
mod special;
