//! What a contouring did: counts, timings, warnings.

use super::{Density, MeshNote};
use crate::contour::{self, Grid};
use crate::geom::Aabb;
use crate::measure::thickness::Thickness;
use crate::measure::walls::Walls;
use crate::mesh::slivers::Removal;
use std::time::Duration;

/// What a contouring did.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Report {
    /// Cells of the grid along each axis.
    pub cells: [usize; 3],
    /// The grid's box, least corner then greatest, in model units.
    pub bounds: [[f64; 3]; 2],
    /// Counts and stages of the contouring.
    #[serde(flatten)]
    pub contour: contour::Report,
    /// Seconds spent reading the program and its files.
    pub parse_seconds: f64,
    /// Seconds spent compiling the field.
    pub compile_seconds: f64,
    /// Seconds spent on the axis tables.
    pub bind_seconds: f64,
    /// Thickness of the thinnest walls and struts whose thickness is known, the first sixteen kinds, if
    /// there are any.
    pub walls: Option<Walls>,
    /// How much of the walls of a true thickness is wrong, the first sixteen of them, if it is much.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness: Option<Thickness>,
    /// The densities that levels were solved for.
    pub densities: Vec<Density>,
    /// The mesh files of the program: what they contained, what was mended and what was assumed.
    pub meshes: Vec<MeshNote>,
    /// What was done about slivers, if anything.
    pub slivers: Option<Removal>,
}

impl Report {
    pub(super) fn new(
        grid: &Grid,
        contour: contour::Report,
        parse: Duration,
        compile: Duration,
        bind: Duration,
    ) -> Self {
        let Aabb { lo, hi } = grid.bounds();
        Self {
            cells: grid.cells(),
            bounds: [lo, hi].map(|end| end.to_array()),
            contour,
            parse_seconds: parse.as_secs_f64(),
            compile_seconds: compile.as_secs_f64(),
            bind_seconds: bind.as_secs_f64(),
            walls: None,
            thickness: None,
            densities: Vec::new(),
            meshes: Vec::new(),
            slivers: None,
        }
    }
}
