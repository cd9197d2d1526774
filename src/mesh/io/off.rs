//! Object File Format of Geomview.
//!
//! Source: Geomview manual, section OFF. Its binary variant and dimensions other than three are
//! refused.

use super::assembly::{Assembly, ReadReport};
use super::error::{Fault, Flaw};
use super::output::{Precision, WriteError};
use super::runs::Runs;
use super::text::{self, Lines, integer, number, syntax, without_comment, words};
use super::{Format, Refused};
use crate::mesh::Mesh;
use crate::num::Progress;
use std::io::Write;

/// Reads OFF and its variants with colours, normals or texture coordinates, which are ignored.
///
/// The counts may stand on the line of the magic word or be glued to it, and the count of edges
/// may be missing. An item is a line; what follows its numbers on the line is colour.
pub(super) fn read(bytes: &[u8], progress: &Progress) -> Result<(Mesh, ReadReport), Flaw> {
    let mut lines = Lines::new(bytes);
    let mut assembly = Assembly::new(Format::Off, bytes.len(), progress);
    let first = content(&mut lines, "its first line")?;
    let (variant, counts) = magic(first).unwrap_or((Variant::Plain, first));
    match variant {
        Variant::Plain => {}
        Variant::Attributed => assembly.ignore("attributes of vertices"),
        Variant::HigherDimension => {
            let fault = syntax("three coordinates (not 4OFF or nOFF)", Some(first));
            return Err(fault.at_line(lines.number));
        }
    }
    if words(counts).next() == Some(b"BINARY") {
        return Err(Fault::Refused(Refused::BinaryOff).into());
    }
    let counts =
        if words(counts).next().is_some() { counts } else { content(&mut lines, "its counts")? };
    let mut numbers = words(counts).map(|word| integer(word).and_then(|n| u64::try_from(n).ok()));
    let (Some(Some(vertices)), Some(Some(faces))) = (numbers.next(), numbers.next()) else {
        let fault = syntax("the numbers of vertices and faces", Some(counts));
        return Err(fault.at_line(lines.number));
    };
    // A vertex takes six bytes, a face two, but the last of them may do without a line end.
    let least = vertices.saturating_mul(6).saturating_add(faces.saturating_mul(2));
    if least > lines.rest().len() as u64 + 1 {
        let count = vertices.saturating_add(faces);
        let fault = Fault::Overstated { count, what: "vertices and faces".to_owned() };
        return Err(fault.at_line(lines.number));
    }
    for _ in 0..vertices {
        let line = content(&mut lines, "its last vertex")?;
        let mut coordinates = words(line).map(number);
        let (Some(Some(x)), Some(Some(y)), Some(Some(z))) =
            (coordinates.next(), coordinates.next(), coordinates.next())
        else {
            let bad = words(line).find(|word| number(word).is_none());
            return Err(lines.flaw_at(bad, syntax("three coordinates", Some(line))));
        };
        assembly.vertex([x, y, z]).map_err(|fault| fault.at_line(lines.number))?;
        assembly.reach(lines.offset)?;
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        let line = content(&mut lines, "its last face")?;
        let mut numbers = words(line).map(integer);
        let count = numbers.next().flatten().and_then(|count| usize::try_from(count).ok());
        corners.clear();
        corners.extend(numbers.by_ref().map_while(|index| index).take(count.unwrap_or(0)));
        if count != Some(corners.len()) {
            let fault = syntax("a number of corners and as many vertices", Some(line));
            let bad = words(line).find(|word| integer(word).is_none());
            return Err(lines.flaw_at(bad, fault));
        }
        if numbers.next().is_some() {
            assembly.ignore("colours of faces");
        }
        assembly.face(&corners).map_err(|fault| fault.at_line(lines.number))?;
        assembly.reach(lines.offset)?;
    }
    if content(&mut lines, "").is_ok() {
        assembly.ignore("data after the last face");
    }
    Ok(assembly.finish()?)
}

/// The next line that is more than a comment, without its comment.
fn content<'a>(lines: &mut Lines<'a>, before: &'static str) -> Result<&'a [u8], Flaw> {
    loop {
        let line = lines.next();
        let line = line.ok_or_else(|| Fault::Truncated { before }.at_line(lines.number))?;
        let line = without_comment(line).trim_ascii();
        if !line.is_empty() {
            return Ok(line);
        }
    }
}

/// What the magic word says of the vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Variant {
    Plain,
    /// Each has texture coordinates, a colour or a normal after its position.
    Attributed,
    /// They have not three coordinates.
    HigherDimension,
}

/// The magic word `[ST][C][N][4][n]OFF` and what follows it on its line.
fn magic(line: &[u8]) -> Option<(Variant, &[u8])> {
    let strip = |rest: &mut &[u8], prefix: &[u8]| {
        let stripped = rest.strip_prefix(prefix);
        *rest = stripped.unwrap_or(rest);
        stripped.is_some()
    };
    let mut rest = line;
    let attributed = [&b"ST"[..], b"C", b"N"].map(|prefix| strip(&mut rest, prefix));
    let higher = [&b"4"[..], b"n"].map(|prefix| strip(&mut rest, prefix));
    let rest = rest.strip_prefix(b"OFF")?;
    if rest.first().is_some_and(|b| !b.is_ascii_whitespace() && !b.is_ascii_digit()) {
        return None;
    }
    let variant = if higher.contains(&true) {
        Variant::HigherDimension
    } else if attributed.contains(&true) {
        Variant::Attributed
    } else {
        Variant::Plain
    };
    Some((variant, rest))
}

/// Whether the content begins with the magic word, comments aside.
pub(super) fn is_off(bytes: &[u8]) -> bool {
    content(&mut Lines::new(bytes), "").is_ok_and(|line| magic(line).is_some())
}

/// Writes plain OFF; the count of edges, which no reader uses, is 0.
pub(super) fn write(
    mesh: &dyn Runs,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    let (vertices, triangles) = mesh.counts();
    writeln!(out, "OFF\n{vertices} {triangles} 0")?;
    mesh.vertices(&mut |run| {
        text::write_rows(run, out, |row, point| text::push_point(row, "", point, precision))
    })?;
    mesh.triangles(&mut |run| {
        text::write_rows(run, out, |row, [a, b, c]| Ok(writeln!(row, "3 {a} {b} {c}")?))
    })
}
