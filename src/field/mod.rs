//! Oracles: fields that no formula gives, such as the distance to a mesh.

pub mod triangle;
