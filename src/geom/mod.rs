//! Geometry without fields: axes, axis-aligned boxes, affine maps, bounding-volume trees.

pub mod aabb;

pub use aabb::{Aabb, Axis};
