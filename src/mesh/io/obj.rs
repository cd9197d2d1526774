//! Wavefront OBJ: positions and faces, nothing else.

use super::Format;
use super::assembly::{Assembly, ReadReport};
use super::error::{Fault, Flaw};
use super::output::{Precision, WriteError};
use super::runs::Runs;
use super::text::{self, Lines, integer, syntax, without_comment, words};
use crate::mesh::Mesh;
use crate::num::{Cancelled, Progress};
use std::io::{self, BufRead, Read, Write};
use tobj::{LoadError, LoadOptions};

/// Reads positions and faces; faces may have any number of corners and negative indices.
///
/// `tobj` parses what [`Records`] leaves of the file. It numbers vertices by first use in a face,
/// so the first face it gets is one of our own that has every vertex in order: the numbers stay
/// those of the file, and unused vertices stay.
pub(super) fn read<'a>(
    bytes: &'a [u8],
    progress: &'a Progress,
) -> Result<(Mesh, ReadReport), Flaw> {
    let mut assembly = Assembly::new(Format::Obj, bytes.len(), progress);
    let vertices = survey(bytes, &mut assembly)?;
    let mut records = Records::new(bytes, vertices, &mut assembly);
    let options = LoadOptions {
        single_index: false,
        triangulate: false,
        ignore_points: false,
        ignore_lines: false,
    };
    let (models, _) =
        tobj::load_obj_buf(&mut records, &options, |_| Err(LoadError::GenericFailure))
            .map_err(|error| flaw(error, &records, bytes, vertices))?;
    for model in models {
        let mesh = model.mesh;
        for (position, number) in mesh.positions.as_chunks().0.iter().zip(1..) {
            assembly.vertex(*position).map_err(|fault| at_vertex(fault, bytes, number))?;
        }
        let mut indices = mesh.indices.iter().map(|&index| i64::from(index));
        // tobj leaves the list of sizes empty when all faces are triangles.
        let triangles = std::iter::repeat_n(3, mesh.indices.len() / 3);
        let all_triangles = mesh.face_arities.is_empty().then_some(triangles);
        let sizes = mesh.face_arities.iter().copied().chain(all_triangles.into_iter().flatten());
        let mut corners = Vec::new();
        for (number, size) in sizes.enumerate() {
            corners.clear();
            corners.extend(indices.by_ref().take(size as usize));
            if number > 0 {
                assembly.face(&corners)?;
            }
        }
    }
    Ok(assembly.finish()?)
}

/// Counts the vertices and notes what is ignored.
///
/// # Errors
/// [`Fault::Not`] when nothing is a vertex or a face.
fn survey(bytes: &[u8], assembly: &mut Assembly<'_>) -> Result<u64, Flaw> {
    let mut lines = LogicalLines::new(bytes);
    let (mut vertices, mut faces) = (0, 0_u64);
    while lines.advance() {
        match words(lines.line()).next() {
            None => {}
            Some(b"v") => vertices += 1,
            Some(b"f" | b"fo") => faces += 1,
            Some(word) => {
                let known = IGNORED.iter().find(|record| record.as_bytes() == word);
                assembly.ignore(known.unwrap_or(&"other records"));
            }
        }
        assembly.reach(lines.lines.offset / 2)?;
    }
    if vertices == 0 && faces == 0 {
        return Err(Fault::Not(Format::Obj).into());
    }
    if vertices > u64::from(u32::MAX) {
        return Err(Fault::TooLarge { what: "more than 2^32 - 1 vertices" }.into());
    }
    Ok(vertices)
}

/// Records that are expected and ignored.
const IGNORED: [&str; 12] =
    ["vt", "vn", "vp", "p", "l", "g", "o", "s", "mg", "usemtl", "mtllib", "lod"];

/// What `tobj` complains of, with its place in the file.
fn flaw(error: LoadError, records: &Records<'_, '_>, bytes: &[u8], vertices: u64) -> Flaw {
    if let Some(cancelled) = records.cancelled {
        return cancelled.into();
    }
    let expected = match error {
        LoadError::FaceVertexOutOfBounds => return first_bad_index(bytes, vertices),
        LoadError::PositionParseError => "three coordinates after v",
        LoadError::FaceParseError => "vertex numbers after f",
        LoadError::ReadError => "plain text",
        LoadError::OpenFileFailed
        | LoadError::UnrecognizedCharacter
        | LoadError::ScalingByZeroError
        | LoadError::ColorParseError
        | LoadError::NormalParseError
        | LoadError::TexcoordParseError
        | LoadError::MaterialParseError
        | LoadError::InvalidObjectName
        | LoadError::InvalidPolygon
        | LoadError::FaceTexCoordOutOfBounds
        | LoadError::FaceNormalOutOfBounds
        | LoadError::FaceColorOutOfBounds
        | LoadError::InvalidLoadOptionConfig
        | LoadError::GenericFailure => "a vertex or a face",
    };
    let (line, lines) = (records.lines.line(), &records.lines.lines);
    let fault = syntax(expected, Some(line));
    if records.lines.is_joined {
        return fault.at_line(records.lines.first);
    }
    let bad = words(line).skip(1).find(|word| text::number(position(word)).is_none());
    lines.flaw_at(bad, fault)
}

/// The first face with a vertex that does not exist.
fn first_bad_index(bytes: &[u8], vertices: u64) -> Flaw {
    let mut lines = LogicalLines::new(bytes);
    let mut before = 0_i64;
    let total = vertices as i64;
    while lines.advance() {
        let mut rest = words(lines.line());
        match rest.next() {
            Some(b"v") => before += 1,
            Some(b"f" | b"fo") => {
                let exists = |i: i64| (1..=total).contains(&i) || (-before..0).contains(&i);
                let bad = rest.filter_map(|word| integer(position(word))).find(|&i| !exists(i));
                if let Some(index) = bad {
                    return Fault::IndexOutOfRange { index, vertices }.at_line(lines.first);
                }
            }
            Some(_) | None => {}
        }
    }
    Fault::IndexOutOfRange { index: 0, vertices }.into()
}

/// The fault at the line of vertex `number`, the first being 1.
fn at_vertex(fault: Fault, bytes: &[u8], number: u64) -> Flaw {
    let mut lines = LogicalLines::new(bytes);
    let mut before = 0;
    while lines.advance() {
        if words(lines.line()).next() == Some(b"v") {
            before += 1;
            if before == number {
                return fault.at_line(lines.first);
            }
        }
    }
    fault.into()
}

/// The first of the numbers `position/texture/normal`.
fn position(word: &[u8]) -> &[u8] {
    word.split(|&b| b == b'/').next().unwrap_or_default()
}

/// Lines without comments, joined where one ends in a backslash.
struct LogicalLines<'a> {
    lines: Lines<'a>,
    line: &'a [u8],
    joined: Vec<u8>,
    is_joined: bool,
    /// The number of the first line joined.
    first: u64,
}

impl<'a> LogicalLines<'a> {
    const fn new(bytes: &'a [u8]) -> Self {
        let lines = Lines::new(bytes);
        Self { lines, line: &[], joined: Vec::new(), is_joined: false, first: 0 }
    }

    /// Goes to the next line; whether there is one.
    fn advance(&mut self) -> bool {
        let Some(line) = self.lines.next() else { return false };
        self.first = self.lines.number;
        self.line = without_comment(line);
        self.is_joined = false;
        let mut start = self.line;
        while let Some(open) = start.trim_ascii_end().strip_suffix(b"\\") {
            if !self.is_joined {
                self.joined.clear();
                self.is_joined = true;
            }
            self.joined.extend_from_slice(open);
            self.joined.push(b' ');
            start = self.lines.next().map_or(&[], without_comment);
        }
        if self.is_joined {
            self.joined.extend_from_slice(start);
        }
        true
    }

    fn line(&self) -> &[u8] {
        if self.is_joined { &self.joined } else { self.line }
    }
}

/// The vertices and faces of a file, one to a line, as `tobj` can't mistake them.
///
/// Weights and colours of vertices, texture and normal indices of faces and all other records are
/// gone. The buffer holds one line; after each, `tobj` parses before it asks for the next.
struct Records<'a, 'b> {
    lines: LogicalLines<'a>,
    buffer: Vec<u8>,
    taken: usize,
    assembly: &'b mut Assembly<'a>,
    cancelled: Option<Cancelled>,
}

impl<'a, 'b> Records<'a, 'b> {
    /// The records of `bytes` after a face of all its `vertices`.
    fn new(bytes: &'a [u8], vertices: u64, assembly: &'b mut Assembly<'a>) -> Self {
        let mut buffer = b"f".to_vec();
        for vertex in 1..=vertices {
            buffer.push(b' ');
            buffer.extend_from_slice(vertex.to_string().as_bytes());
        }
        buffer.push(b'\n');
        Self { lines: LogicalLines::new(bytes), buffer, taken: 0, assembly, cancelled: None }
    }

    /// Fills the buffer with the next record, if there is one.
    fn next_record(&mut self) {
        self.buffer.clear();
        self.taken = 0;
        while self.buffer.is_empty() && self.lines.advance() {
            let mut rest = words(self.lines.line());
            match rest.next() {
                Some(b"v") => {
                    self.buffer.push(b'v');
                    rest.take(3).for_each(|word| append(&mut self.buffer, word));
                }
                Some(b"f" | b"fo") => {
                    self.buffer.push(b'f');
                    rest.for_each(|word| append(&mut self.buffer, position(word)));
                }
                Some(_) | None => continue,
            }
            self.buffer.push(b'\n');
        }
    }
}

fn append(buffer: &mut Vec<u8>, word: &[u8]) {
    buffer.push(b' ');
    buffer.extend_from_slice(word);
}

impl BufRead for Records<'_, '_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.buffer.len() {
            // The survey before was the first half of the work.
            let offset = self.lines.lines.size() / 2 + self.lines.lines.offset / 2;
            if let Err(cancelled) = self.assembly.reach(offset) {
                self.cancelled = Some(cancelled);
                return Err(io::Error::other(cancelled));
            }
            self.next_record();
        }
        Ok(&self.buffer[self.taken..])
    }

    fn consume(&mut self, amount: usize) {
        self.taken += amount;
    }
}

impl Read for Records<'_, '_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

/// How many bytes are looked at for a vertex.
const SNIFFED: usize = 1 << 16;

/// Whether there is a vertex among the first lines; OBJ has no magic word.
pub(super) fn is_obj(bytes: &[u8]) -> bool {
    let mut lines = LogicalLines::new(&bytes[..bytes.len().min(SNIFFED)]);
    while lines.advance() {
        let mut rest = words(lines.line());
        if rest.next() == Some(b"v") && rest.take(3).filter_map(text::number).count() == 3 {
            return true;
        }
    }
    false
}

/// Writes positions and triangles, numbered from 1.
pub(super) fn write(
    mesh: &dyn Runs,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    writeln!(out, "# alveole {}", env!("CARGO_PKG_VERSION"))?;
    mesh.vertices(&mut |run| {
        text::write_rows(run, out, |row, point| text::push_point(row, "v ", point, precision))
    })?;
    mesh.triangles(&mut |run| {
        text::write_rows(run, out, |row, corners| {
            let [a, b, c] = corners.map(|corner| u64::from(corner) + 1);
            Ok(writeln!(row, "f {a} {b} {c}")?)
        })
    })
}
