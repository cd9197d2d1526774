//! Volume, area and density.
