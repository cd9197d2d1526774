//! alveole turns a description of a cellular solid (a lattice, a foam, a part filled with either)
//! into a mesh or a number, fast enough to sit inside an optimizer.
//!
//! # One idea
//!
//! A **field** is a function f(x, y, z) that is negative inside the solid. Every field here is an
//! **expression**: formulas, periodic surfaces, set operations, motions and offsets are nodes of
//! one hash-consed [graph](expr::Graph). What has no formula, such as the distance to a mesh,
//! takes part as an [oracle](expr::Oracle). So bounding, pruning, derivatives and set operations
//! work on everything, and contouring has one kind of input.
//!
//! ```text
//! text --lang--> solid (expression + bounds) --eval--> program --octree--> bricks with surface
//!                                                                 --contour--> mesh
//! ```
//!
//! A **program** is an expression made ready to run: compiled by Cranelift, or interpreted with
//! the same bits. Bound to a grid it answers signs of **bricks** of 16³ samples, **ranges** over
//! boxes, and values along grid edges. The **octree** asks for ranges until only bricks that may
//! hold surface are left; **contouring** asks for their signs, places a vertex on every crossed
//! edge at the root of the exact field, and hands vertices and triangles to a
//! [sink](mesh::Sink) as they are made.
//!
//! # In five lines
//!
//! ```
//! use alveole::job::{Job, Settings};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let job = Job::parse("gyroid dilate 0.35 box")?;
//! let mesh = job.mesh(&Settings::with_spacing(2.0 / 60.0))?;
//! println!("{} triangles", mesh.triangles.len());
//! # Ok(())
//! # }
//! ```
//!
//! # Conventions
//!
//! Negative inside; zero and NaN are outside. Model units, right-handed axes, triangles
//! counter-clockwise from outside, angles in radians. Periodic surfaces have period 1. Everything
//! is `f64`; no engine fuses or reassociates, so results are the same bits on every host, with
//! every engine and any number of threads.
//!
//! # Map
//!
//! The modules in order; each uses only those above it.
//!
//! | module | holds |
//! |---|---|
//! | [`text`] | places in small text files, for their readers |
//! | [`num`] | intervals, elementary functions, random numbers, lanes, memory, progress |
//! | [`geom`] | axes, boxes, bounding-volume trees |
//! | [`expr`] | operators, the graph, simplification, derivatives, oracles |
//! | [`solid`] | a field with its bounds; primitives, set operations, offsets, motions |
//! | [`lang`] | program text: words, equations, diagnostics |
//! | [`eval`] | the interpreter and the compiler, behind one [`Sampler`](eval::Sampler) |
//! | [`mesh`] | triangle meshes: topology, checks, measures, files |
//! | [`field`] | oracles: the signed distance to a mesh, numbers between points |
//! | [`octree`] | interval subdivision down to bricks |
//! | [`contour`] | grid, cases, placement, streaming assembly |
//! | [`measure`] | quantities that need the field as well as the mesh; planar cuts |
//! | [`cellular`] | catalogues of periodic surfaces and of unit cells, foams, filled parts |
//! | [`vocabulary`] | the one table of words |
//! | [`job`] | the facade: program text to mesh and measures |
//! | [`cli`] | the commands |
//! | [`performance`] | no code: where the time goes and what was tried |
//! | [`promises`] | no code: what is promised and how it is tested |
//!
//! # I want to add …
//!
//! | … | touch | what reminds you |
//! |---|---|---|
//! | an operator | [`expr::op`] | exhaustive matches in `expr` and `eval`; the cases of `eval/suite` |
//! | a rewrite rule | [`expr::simplify`] | its named test |
//! | a periodic surface | [`cellular::tpms`] | the catalogue's tests; a golden volume in `tests/surfaces.rs` |
//! | a unit cell | a row of [`cellular::struts::table`] | the table's tests: struts, length, valences |
//! | a shape or an operation | [`solid`], a row of [`vocabulary`] | the table's tests: help, source, bounds |
//! | a field without a formula | a file in [`field`] | the contract of [`expr::Oracle`] |
//! | a mesh format | a file in [`mesh::io`] | `tests/formats.rs` |
//! | the input of another tool | a file in [`job::convert`], a line in [`job::loader`] | `tests/convert.rs` |
//! | a subcommand | a file in [`cli`] | help is required; `tests/cli.rs` |
#![cfg_attr(test, allow(clippy::unwrap_used))]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod text;

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

pub mod performance;

pub mod promises;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
