//! Numbers without geometry: intervals, elementary functions, random numbers, lanes, memory, progress.
//!
//! Promises the same bits on every host: no fused multiply-add, no reassociation, no platform
//! mathematics library. Knows no points and no fields, and reads no files but those in which the
//! system tells of its memory.

pub mod elementary;
#[cfg(test)]
mod exact;
pub mod interval;
pub mod lanes;
pub mod memory;
mod pack;
pub mod progress;
pub mod random;

pub use interval::Interval;
pub use progress::{Cancelled, Progress};
pub use random::{EVEN_STEPS, Random};
