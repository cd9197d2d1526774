//! Numbers without geometry: intervals, elementary functions, random numbers, lanes, progress.
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
pub mod random;

pub use interval::Interval;
pub use progress::{Cancelled, Progress};
pub use random::Random;
