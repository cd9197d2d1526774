//! Stanford polygon format.

mod header;
mod read;
mod source;
mod spool;
mod write;

pub(super) use read::read;
pub use write::PlySink;
pub(super) use write::write;
