//! Wavefront OBJ.

use super::output::{Precision, WriteError};
use super::text;
use crate::mesh::Mesh;
use std::io::Write;

/// Writes positions and triangles, numbered from 1.
pub(super) fn write(
    mesh: &Mesh,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    writeln!(out, "# alveole {}", env!("CARGO_PKG_VERSION"))?;
    text::write_rows(&mesh.positions, out, |row, point| {
        text::push_point(row, "v ", point, precision)
    })?;
    text::write_rows(&mesh.triangles, out, |row, corners| {
        let [a, b, c] = corners.map(|corner| u64::from(corner) + 1);
        Ok(writeln!(row, "f {a} {b} {c}")?)
    })
}
