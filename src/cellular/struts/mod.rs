//! Lattices of struts and plates: unit cells as graphs, their fields, and files that hold them.
//!
//! A [`Cell`] is a graph in the unit cube that repeats with it. [`table`] has the cells that have a
//! name, made of few generators by their [`symmetry`]; [`Cell::solid`] makes the field of any cell as a
//! plain expression in folded space, exact distances to capsules and plates. Nothing is evaluated
//! here.

pub mod bubbles;
pub mod cell;
mod element;
mod field;
pub mod file;
mod forms;
pub mod near;
pub mod symmetry;
pub mod table;
pub mod voronoi;

pub use cell::{Cell, Plate, Strut, Surface};
pub use field::Sizes;
