//! Engines: what turns expressions into numbers.
//!
//! A [`Sampler`] is an expression bound to a grid of coordinates; contouring, measuring and
//! rendering see nothing else. Three engines implement it and return the same bits: the interpreter,
//! the compiler, and, for huge expressions, the interpreter of what each box needs.

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
mod pruned;
pub mod rates;
pub mod regions;
mod rival;
pub mod sampler;
pub mod schedule;
pub mod sign;
pub mod tape;
pub mod vicinity;
mod whole;

pub use program::{Bound, Engine, Program, ProgramError, Workspace};
pub use rates::{BoundRates, Rates};
pub use sampler::{BRICK, BrickSigns, End, NodeBox, Sampler};

#[cfg(test)]
mod suite;
