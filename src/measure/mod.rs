//! Quantities of a solid: densities and wall thickness.
//!
//! Measures of a mesh by itself (volume, area, topology, quality) are in
//! [`Measures`](crate::mesh::Measures); here is what also needs the field or the box.

pub mod walls;
