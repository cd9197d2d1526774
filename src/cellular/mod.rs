//! Cellular solids: the catalogue of triply periodic surfaces, and parts filled with lattices.

pub mod fill;
pub mod tpms;
