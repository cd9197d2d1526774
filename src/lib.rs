//! alveole turns a description of a cellular solid into a mesh or a number.
//!
//! Everything is a field, every field is an expression: f(x, y, z) is negative inside.
#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod num;

pub mod geom;

pub mod expr;

pub mod solid;

pub mod lang;

pub mod eval;

pub mod mesh;

pub mod field;

pub mod octree;

pub mod contour;

pub mod measure;

pub mod cellular;

pub mod vocabulary;

pub mod job;

pub mod cli;
