//! Mesh files: OBJ, OFF, PLY and STL; one file a format.
//!
//! Writing keeps the order of vertices and triangles. Binary files are little-endian; numbers in
//! text are the shortest that read back to the same bits at the precision asked for.

pub mod format;
mod obj;
mod off;
pub mod output;
pub mod ply;
mod stl;
mod text;

pub use format::{Format, Refused, is_mesh_path};
pub use output::{FileSink, Precision, WriteError, write};
pub use ply::PlySink;
