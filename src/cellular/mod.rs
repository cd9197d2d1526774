//! Cellular solids: the catalogue of triply periodic surfaces.

pub mod tpms;
