//! Mesh files: OBJ, OFF, PLY and STL; one file a format.
//!
//! Reading accepts what real programs write, refuses the rest with place, cause and cure, and
//! never panics. Writing keeps the order of vertices and triangles. Binary files are
//! little-endian; numbers in text are the shortest that read back to the same bits at the
//! precision asked for.

mod assembly;
pub mod error;
pub mod format;
pub mod input;
mod obj;
mod off;
pub mod output;
pub mod ply;
mod stl;
mod text;

pub use assembly::ReadReport;
pub use error::{Fault, Place, ReadError};
pub use format::{Format, Refused, is_mesh_path};
pub use input::{read, read_bytes, read_with};
pub use output::{FileSink, Precision, WriteError, write};
pub use ply::PlySink;
