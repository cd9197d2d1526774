//! Dirty meshes: what is inside of a damaged copy is what was inside of the clean one, whatever is made
//! of it is closed, and the report says what was found.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests may, and say what they skip")]

mod common;

#[path = "dirty/damage.rs"]
mod damage;

#[path = "dirty/real.rs"]
mod real;

#[path = "dirty/sides.rs"]
mod sides;
