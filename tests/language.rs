//! Program text from words to solids and diagnostics, with the whole vocabulary.
#![allow(clippy::unwrap_used)]

#[path = "language/support.rs"]
mod support;

#[path = "language/programs.rs"]
mod programs;
