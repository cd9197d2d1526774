//! Numbers without geometry: intervals, elementary functions, lanes, progress.
//!
//! Promises the same bits on every host: no fused multiply-add, no reassociation, no platform
//! mathematics library. Knows no points, no fields and no files.

pub mod elementary;
#[cfg(test)]
mod exact;
pub mod interval;
pub mod lanes;
mod pack;
pub mod progress;

pub use interval::Interval;
pub use progress::{Cancelled, Progress};
