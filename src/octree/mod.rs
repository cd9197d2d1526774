//! Interval subdivision of the grid down to bricks.
//!
//! [`subdivide`] asks a sampler for enclosures, from one box around the grid down to bricks, and
//! says of each brick whether its closed box is inside the solid, outside, or has to be sampled.
//! The answer takes two bits a brick and, for the bricks to sample, the number of their activity.
//! It does not depend on the number of threads.

mod activity;
mod pool;
mod ranked;
mod subdivide;

pub use activity::{Activities, ActivityId};
pub use pool::Pool;
pub use ranked::RankedBits;
pub use subdivide::{Bricks, Interrupted, Pruning, subdivide};
