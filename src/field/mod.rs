//! Oracles: fields that no formula gives, such as the distance to a mesh or numbers between points.

pub mod balls;
pub mod blocks;
pub mod mesh_distance;
pub mod order;
pub mod orientation;
pub mod report;
pub mod rim;
#[cfg(test)]
mod samples;
pub mod scattered;
pub mod search;
pub mod sides;
pub mod sign;
mod stand_ins;
pub mod surface;
pub mod triangle;
pub mod winding;

pub use mesh_distance::{MeshDistance, mesh_distance};
pub use report::{Reason, Report, SignMethod};
pub use surface::{Repairs, Unusable};
