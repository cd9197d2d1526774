//! Indexed triangle meshes: topology, checks, measures and files.
//!
//! Triangles are counter-clockwise seen from outside. This module does not know where they come
//! from.

pub mod check;
pub mod io;
pub mod measure;
pub mod polygon;
#[cfg(test)]
mod shapes;
pub mod sink;
pub mod slivers;
pub mod topology;
pub mod weld;

pub use check::{Check, check};
pub use measure::{Measures, measure};
pub use sink::Sink;
pub use weld::weld;

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in model units.
    pub positions: Vec<[f64; 3]>,
    /// Corners of the triangles, counter-clockwise from outside, as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
}
