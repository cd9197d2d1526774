//! Stereolithography triangles.

use super::output::{Precision, WriteError, single};
use crate::mesh::Mesh;
use std::io::Write;

/// Bytes of a triangle in a binary file: normal, three corners, attribute.
const RECORD: usize = 50;
/// Triangles encoded between two writes: a buffer that stays in cache.
const TRIANGLES_A_PIECE: usize = 1 << 12;

/// The count of triangles as the file stores it.
///
/// # Errors
/// [`WriteError::TooManyTriangles`].
pub(super) fn count(triangles: u64) -> Result<u32, WriteError> {
    u32::try_from(triangles).map_err(|_| WriteError::TooManyTriangles { triangles })
}

/// Writes the binary variant; normals are those of the rounded corners, zero where they have none.
pub(super) fn write(
    mesh: &Mesh,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    if precision == Precision::Double {
        return Err(WriteError::StlIsSingle);
    }
    let mut header = [b' '; 80];
    let title = concat!("alveole ", env!("CARGO_PKG_VERSION"), " binary STL").as_bytes();
    header[..title.len()].copy_from_slice(title);
    out.write_all(&header)?;
    out.write_all(&count(mesh.triangles.len() as u64)?.to_le_bytes())?;
    let mut buffer = vec![0; TRIANGLES_A_PIECE * RECORD];
    for piece in mesh.triangles.chunks(TRIANGLES_A_PIECE) {
        let (records, _) = buffer.as_chunks_mut::<RECORD>();
        for (record, corners) in records.iter_mut().zip(piece) {
            encode(record, mesh, corners)?;
        }
        out.write_all(&buffer[..piece.len() * RECORD])?;
    }
    Ok(())
}

fn encode(record: &mut [u8; RECORD], mesh: &Mesh, corners: &[u32; 3]) -> Result<(), WriteError> {
    let mut points = [[0.0_f32; 3]; 3];
    for (point, &corner) in points.iter_mut().zip(corners) {
        for (rounded, value) in point.iter_mut().zip(mesh.positions[corner as usize]) {
            *rounded = single(value)?;
        }
    }
    let numbers = std::iter::once(normal(&points)).chain(points).flatten();
    let (slots, _) = record.as_chunks_mut::<4>();
    for (slot, number) in slots.iter_mut().zip(numbers) {
        *slot = number.to_le_bytes();
    }
    Ok(())
}

/// The unit normal, or zero where the corners span none.
fn normal(corners: &[[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| glam::DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().to_array().map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_precision_is_refused_with_a_cure() {
        let error = write(&Mesh::default(), Precision::Double, &mut Vec::new()).unwrap_err();
        assert!(error.to_string().contains("PLY"), "{error}");
    }

    #[test]
    fn normals_have_unit_length_or_are_zero() {
        let unit = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
        assert_eq!(normal(&unit), [0.0, 0.0, 1.0]);
        assert_eq!(normal(&[[1.0; 3]; 3]), [0.0; 3]);
    }
}
