//! Stereolithography triangles.
//!
//! Whether a file is text or binary is told by its size and content: titles of binary files may
//! begin with `solid` too.

use super::Format;
use super::assembly::{Assembly, ReadReport};
use super::error::{Fault, Flaw};
use super::output::{Precision, WriteError, single};
use super::runs::Runs;
use super::text::{Lines, number, syntax, words};
use crate::mesh::Mesh;
use crate::mesh::weld::Welder;
use crate::num::Progress;
use std::io::Write;

/// Bytes before the first triangle of a binary file: a title and the number of triangles.
const HEADER: usize = 84;

/// Bytes of a triangle in a binary file: normal, three corners, attribute.
const RECORD: usize = 50;

/// Reads a text or binary file and merges the vertices at equal positions.
///
/// Normals and attributes are ignored. A text file may have several solids, named or not.
pub(super) fn read(bytes: &[u8], progress: &Progress) -> Result<(Mesh, ReadReport), Flaw> {
    let mut assembly = Assembly::new(Format::Stl, bytes.len(), progress);
    let mut welder = Welder::default();
    let mut add = |assembly: &mut Assembly<'_>, corners: [[f64; 3]; 3]| -> Result<(), Fault> {
        let mut triangle = [0; 3];
        for (slot, position) in triangle.iter_mut().zip(corners) {
            let (vertex, is_new) = welder.number(position);
            if is_new {
                assembly.vertex(position)?;
            } else {
                assembly.report.welded += 1;
            }
            *slot = vertex;
        }
        assembly.triangle(triangle);
        Ok(())
    };
    if is_binary(bytes, Some(bytes.len() as u64)) || !is_text(bytes) {
        read_binary(bytes, &mut assembly, &mut add)?;
    } else {
        read_text(bytes, &mut assembly, &mut add)?;
    }
    Ok(assembly.finish()?)
}

/// Whether the content that begins with `bytes` has the `length` that a binary file with its count
/// of triangles has; where it is not known, whether it may have.
pub(super) fn is_binary(bytes: &[u8], length: Option<u64>) -> bool {
    size(bytes).is_some_and(|size| match length {
        Some(length) => length == size,
        None => bytes.len() as u64 <= size && !is_text(bytes),
    })
}

/// The size that a binary file with this count of triangles has.
fn size(bytes: &[u8]) -> Option<u64> {
    announced(bytes).map(|count| HEADER as u64 + RECORD as u64 * u64::from(count))
}

/// Where a file ends that is binary: what follows is no part of it. None for text.
pub(super) fn end(bytes: &[u8]) -> Option<u64> {
    if is_text(bytes) { None } else { size(bytes) }
}

/// Whether the content begins as a text file does.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    // Some binary files have a title that starts with the same word.
    let start = &bytes[..bytes.len().min(1024)];
    words(start).next().is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
        && !start.contains(&0)
}

/// The number of triangles that a binary file claims to have.
fn announced(bytes: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(HEADER - 4..)?.first_chunk()?))
}

fn read_binary(
    bytes: &[u8],
    assembly: &mut Assembly<'_>,
    add: &mut impl FnMut(&mut Assembly<'_>, [[f64; 3]; 3]) -> Result<(), Fault>,
) -> Result<(), Flaw> {
    let count = announced(bytes).ok_or(Fault::Not(Format::Stl))?;
    let records = bytes[HEADER..].as_chunks::<RECORD>().0;
    if records.len() < count as usize {
        let fault = Fault::Overstated { count: u64::from(count), what: "triangles".to_owned() };
        return Err(fault.at_byte(HEADER - 4));
    }
    if bytes.len() > HEADER + RECORD * count as usize {
        assembly.ignore("data after the last triangle");
    }
    for (record, offset) in records[..count as usize].iter().zip((HEADER..).step_by(RECORD)) {
        let (numbers, _) = record.as_chunks::<4>();
        let corner = |first: usize| [0, 1, 2].map(|axis| f32::from_le_bytes(numbers[first + axis]));
        let corners = [3, 6, 9].map(|first| corner(first).map(f64::from));
        add(assembly, corners).map_err(|fault| fault.at_byte(offset))?;
        assembly.reach(offset)?;
    }
    Ok(())
}

fn read_text(
    bytes: &[u8],
    assembly: &mut Assembly<'_>,
    add: &mut impl FnMut(&mut Assembly<'_>, [[f64; 3]; 3]) -> Result<(), Fault>,
) -> Result<(), Flaw> {
    let mut lines = Lines::new(bytes);
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(3);
    let mut is_open = false;
    while let Some(line) = lines.next() {
        let mut rest = words(line);
        let Some(keyword) = rest.next() else { continue };
        let at_line = |fault: Fault| fault.at_line(lines.number);
        match keyword.to_ascii_lowercase().as_slice() {
            b"solid" if rest.any(|word| word.eq_ignore_ascii_case(b"vertex")) => {
                // A name goes on to the end of its line, whatever it says.
                return Err(at_line(syntax("a line for the name of the solid", Some(line))));
            }
            b"solid" => is_open = true,
            b"endsolid" => is_open = false,
            b"facet" | b"outer" | b"endloop" => {}
            b"vertex" => {
                let mut coordinates = rest.map(number);
                let (Some(Some(x)), Some(Some(y)), Some(Some(z)), None) = (
                    coordinates.next(),
                    coordinates.next(),
                    coordinates.next(),
                    coordinates.next(),
                ) else {
                    let bad = words(line).skip(1).find(|word| number(word).is_none());
                    let fault = syntax("vertex and three coordinates", Some(line));
                    return Err(lines.flaw_at(bad, fault));
                };
                corners.push([x, y, z]);
            }
            b"endfacet" => {
                let [a, b, c] = corners[..] else {
                    return Err(at_line(syntax("three vertices before", Some(line))));
                };
                corners.clear();
                add(assembly, [a, b, c]).map_err(at_line)?;
                assembly.reach(lines.offset)?;
            }
            _ => return Err(at_line(syntax("a line of STL text", Some(line)))),
        }
    }
    if is_open || !corners.is_empty() {
        return Err(Fault::Truncated { before: "endsolid" }.at_line(lines.number));
    }
    Ok(())
}

/// The count of triangles as the file stores it.
///
/// # Errors
/// [`WriteError::TooManyTriangles`].
pub(super) fn count(triangles: u64) -> Result<u32, WriteError> {
    u32::try_from(triangles).map_err(|_| WriteError::TooManyTriangles { triangles })
}

/// Writes the binary variant; normals are those of the rounded corners, zero where they have none.
pub(super) fn write(
    mesh: &dyn Runs,
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
    let (_, triangles) = mesh.counts();
    out.write_all(&count(triangles)?.to_le_bytes())?;
    let mut buffer = Vec::new();
    mesh.corners(&mut |run| {
        buffer.resize(run.len() * RECORD, 0);
        let (records, _) = buffer.as_chunks_mut();
        for (record, corners) in records.iter_mut().zip(run) {
            encode(record, corners)?;
        }
        Ok(out.write_all(&buffer)?)
    })
}

fn encode(record: &mut [u8; RECORD], corners: &[[f64; 3]; 3]) -> Result<(), WriteError> {
    let mut points = [[0.0_f32; 3]; 3];
    for (rounded, value) in points.as_flattened_mut().iter_mut().zip(corners.as_flattened()) {
        *rounded = single(*value)?;
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
