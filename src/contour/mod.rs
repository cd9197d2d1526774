//! From signs to a watertight mesh: cases, placement, flat cuts, streaming assembly.
