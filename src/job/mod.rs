//! The library's facade: program text to mesh and measures.
