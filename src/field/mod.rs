//! Oracles: fields that no formula gives, such as the distance to a mesh.

pub mod mesh_distance;
#[cfg(test)]
mod samples;
pub mod sign;
pub mod surface;
pub mod triangle;
pub mod winding;

pub use mesh_distance::{MeshDistance, mesh_distance};
