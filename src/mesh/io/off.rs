//! Object File Format of Geomview.

use super::output::{Precision, WriteError};
use super::text;
use crate::mesh::Mesh;
use std::io::Write;

/// Writes plain OFF; the count of edges, which no reader uses, is 0.
pub(super) fn write(
    mesh: &Mesh,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    writeln!(out, "OFF\n{} {} 0", mesh.positions.len(), mesh.triangles.len())?;
    text::write_rows(&mesh.positions, out, |row, point| {
        text::push_point(row, "", point, precision)
    })?;
    text::write_rows(&mesh.triangles, out, |row, [a, b, c]| Ok(writeln!(row, "3 {a} {b} {c}")?))
}
