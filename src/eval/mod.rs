//! Engines: what turns expressions into numbers.
//!
//! A [`Sampler`] is an expression bound to a grid of coordinates; contouring, measuring and
//! rendering see nothing else. Two engines implement it, the interpreter and the compiler, and
//! return the same bits.

pub mod balance;
pub mod compared;
mod enclosing;
mod focused;
mod images;
pub mod interpret;
pub mod jit;
pub mod leaves;
pub mod levels;
pub mod lower;
mod machine;
pub mod program;
pub mod rates;
pub mod regions;
pub mod sampler;
pub mod schedule;
pub mod sign;
pub mod tape;
pub mod vicinity;

pub use program::{Bound, Engine, Program, ProgramError, Workspace};
pub use rates::{BoundRates, Rates};
pub use sampler::{BRICK, BrickSigns, End, NodeBox, Sampler};

#[cfg(test)]
mod suite;
