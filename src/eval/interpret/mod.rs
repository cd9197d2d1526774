//! The interpreter: one loop over lanes for every operation.
//!
//! It is the specification, the engine of hosts without a compiler and of jobs too small to pay
//! for compiling. Programs hoist what they can: values on one axis come from tables made once for
//! a grid, values on two axes are made once a brick or once a plane.

mod boxes;
mod brick;
mod buffers;
mod chains;
mod code;
mod enclose;
mod line;
pub(in crate::eval) mod octet;
mod octets;
mod points;
pub(in crate::eval) mod rows;

pub use boxes::{BoxProgram, BoxWorkspace, Lanes};
pub use brick::{BrickProgram, BrickWorkspace};
pub use enclose::enclose;
pub use line::{LineProgram, LineWorkspace};
pub(in crate::eval) use octet::{LANES, NUMBERS, Octet, Octets};
pub use octets::UniformRanges;
pub(in crate::eval) use octets::{Action, Instruction, Source, split_range};
pub use points::points;
