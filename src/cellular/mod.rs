//! Cellular solids: the catalogue of triply periodic surfaces, lattices of struts and plates,
//! random foams and spinodoids, and parts filled with any of them.

pub mod fill;
pub mod spinodoid;
pub mod struts;
pub mod tpms;
