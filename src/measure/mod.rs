//! Quantities of a solid: volume and area, their derivatives by parameters, wall thickness, overhangs,
//! what hangs together, planar cuts, how far a mesh is from a surface.
//!
//! Measures of a mesh by itself (quality, topology) are in [`Measures`](crate::mesh::Measures);
//! here is what also needs the field or the box, or what needs no mesh to be kept.

mod bulge;
pub mod deviation;
pub mod gradient;
pub mod overhang;
pub mod phases;
pub mod quadrature;
pub mod slice;
pub mod survey;
pub mod thickness;
pub mod totals;
pub mod walls;

pub use deviation::{Deviation, Deviations, Norms, Reference};
pub use gradient::{Gradient, GridMotion, gradient};
pub use overhang::Overhang;
pub use phases::{Phase, Phases, phases};
pub use quadrature::{Estimate, FieldMeasures, quadrature};
pub use survey::{Survey, survey};
pub use totals::{Totals, totals};
