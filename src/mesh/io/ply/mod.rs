//! Stanford polygon format.

mod write;

pub use write::PlySink;
pub(super) use write::write;
