//! Geometry without fields: axes, axis-aligned boxes, affine maps, bounding-volume trees.

pub mod aabb;
pub mod bvh;

pub use aabb::{Aabb, Axis};
pub use bvh::Bvh;
