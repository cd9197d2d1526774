//! Mesh files: 3MF, OBJ, OFF, PLY and STL; one file a format.
//!
//! Reading accepts what real programs write, refuses the rest with place, cause and cure, and
//! never panics. Writing keeps the order of vertices and triangles. Binary files are
//! little-endian; numbers in text are the shortest that read back to the same bits at the
//! precision asked for. Whoever makes a mesh in pieces writes it in bounded memory ([`FileSink`]).
//!
//! ```
//! use alveole::mesh::Mesh;
//! use alveole::mesh::io::{self, Format, Precision};
//!
//! let triangle = Mesh {
//!     positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.1, 0.0]],
//!     triangles: vec![[0, 1, 2]],
//! };
//! let mut file = Vec::new();
//! io::write(&triangle, Format::Ply, Precision::Double, &mut file)?;
//! let (read, report) = io::read_bytes("triangle.ply", &file, Some(Format::Ply))?;
//! assert_eq!(read, triangle);
//! assert_eq!(report.faces, 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assembly;
#[cfg(target_os = "linux")]
mod direct;
pub mod error;
pub mod format;
mod gather;
pub mod input;
mod obj;
mod off;
pub mod open;
pub mod output;
pub mod ply;
mod runs;
mod stl;
mod text;
mod threemf;

pub use assembly::ReadReport;
pub use error::{Fault, Place, ReadError};
pub use format::{Format, Refused, is_mesh_path};
pub use input::{read, read_bytes, read_with};
pub use output::{FileSink, Precision, WriteError, write};
pub use ply::PlySink;
