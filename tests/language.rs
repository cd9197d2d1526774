//! Program text from words to solids and diagnostics, with the whole vocabulary.
#![allow(clippy::unwrap_used)]

#[path = "language/support.rs"]
mod support;

#[path = "language/programs.rs"]
mod programs;

#[path = "language/pictures.rs"]
mod pictures;

#[path = "language/round_trip.rs"]
mod round_trip;

#[path = "language/holding.rs"]
mod holding;
