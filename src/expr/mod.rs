//! Expressions: one hash-consed graph that describes every field.
//!
//! A field is an expression in x, y and z, negative inside. Formulas, surfaces, set operations and
//! motions are nodes of the closed list in [`op`]; what has no formula enters as an [`Oracle`].
//! This module builds, simplifies and differentiates expressions; it evaluates nothing but
//! constants.

pub mod constant;
pub mod defined;
pub mod depends;
pub mod derive;
pub mod enclosure;
pub mod graph;
pub mod op;
pub mod oracle;
#[cfg(test)]
pub(crate) mod probe;
pub mod simplify;
pub mod text;
pub mod verify;

pub use depends::AxisSet;
pub use graph::{Graph, NodeId, OracleId, ParameterId};
pub use op::{Binary, Extremum, Node, Output, Unary};
pub use oracle::{Failure, Interest, Oracle, Queries};
