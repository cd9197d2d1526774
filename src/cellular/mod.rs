//! Cellular solids: the catalogue of triply periodic surfaces.
