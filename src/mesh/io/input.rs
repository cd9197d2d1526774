//! Reading a mesh from a file in any format.
//!
//! Where the content of a file contradicts its extension, the content is believed. No count in a
//! file is trusted: memory grows with the data that is there. Nothing panics, whatever the bytes.
//! A file that is no mesh by its first bytes is not read on, however long it is, and a file beyond
//! memory is not begun.

use super::assembly::ReadReport;
use super::error::{Fault, Flaw, ReadError};
use super::open::open;
use super::{Format, Refused, obj, off, ply, stl, threemf};
use crate::mesh::Mesh;
use crate::num::Progress;
use crate::num::memory::{self, Shortage};
use std::io::Read;
use std::path::Path;

/// The longest file read, in bytes: 16 GiB, more than the largest mesh in binary.
const LONGEST: u64 = 1 << 34;

/// Bytes that tell the format: enough for the comments before the first vertex.
const FIRST: u64 = 1 << 16;

/// Reads the mesh in the file at `path`.
///
/// Polygons are divided into triangles, triangles that repeat a corner are dropped, and the
/// vertices of STL at equal positions are merged; those of other formats are not
/// ([`weld`](crate::mesh::weld())).
///
/// # Errors
/// [`ReadError`] says what is wrong and where.
pub fn read(path: &Path) -> Result<Mesh, ReadError> {
    read_with(path, &Progress::new()).map(|(mesh, _)| mesh)
}

/// As [`read`], with progress by megabytes and a report of what the file contained.
///
/// # Errors
/// As [`read`], and [`Fault::Cancelled`].
pub fn read_with(path: &Path, progress: &Progress) -> Result<(Mesh, ReadReport), ReadError> {
    let name = path.display().to_string();
    let declared = Declared::from_path(path);
    load(path, declared)
        .and_then(|bytes| parse(&bytes, declared, progress))
        .map_err(|flaw| flaw.in_file(&name))
}

/// Reads a mesh from the content of a file; `name` is for messages, `declared` is what its name
/// says it is.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(
    name: &str,
    bytes: &[u8],
    declared: Option<Format>,
) -> Result<(Mesh, ReadReport), ReadError> {
    let declared = declared.map_or(Declared::Nothing, Declared::Read);
    parse(bytes, declared, &Progress::new()).map_err(|flaw| flaw.in_file(name))
}

/// What the extension of a file says.
#[derive(Clone, Copy, Debug)]
enum Declared {
    Read(Format),
    Refused(Refused),
    Nothing,
}

impl Declared {
    fn from_path(path: &Path) -> Self {
        match (Format::from_path(path), Refused::from_path(path)) {
            (Some(format), _) => Self::Read(format),
            (None, Some(refused)) => Self::Refused(refused),
            (None, None) => Self::Nothing,
        }
    }
}

/// The content of the file at `path`.
fn load(path: &Path, declared: Declared) -> Result<Vec<u8>, Flaw> {
    let mut file = open(path)?;
    let mut bytes = Vec::new();
    file.by_ref().take(FIRST).read_to_end(&mut bytes)?;
    if (bytes.len() as u64) < FIRST {
        return Ok(bytes);
    }
    let end = match sniff(without_mark(&bytes), declared, file.length) {
        // A binary file of triangles ends where it says; a byte more, and the mark, tell of more.
        Ok(Format::Stl) => stl::end(without_mark(&bytes)).map(|end| end + 4),
        // Blanks at the beginning say nothing.
        Ok(Format::Obj | Format::Off | Format::Ply | Format::ThreeMf) | Err(Fault::Empty) => None,
        Err(fault) => return Err(fault.into()),
    };
    let end = end.unwrap_or(u64::MAX);
    let expected = file.length.unwrap_or(FIRST).min(end);
    if expected > LONGEST {
        return Err(Fault::TooLarge { what: TOO_LONG }.into());
    }
    memory::ask(expected.saturating_mul(SHARE))?;
    bytes.try_reserve(expected.saturating_sub(FIRST) as usize).map_err(std::io::Error::other)?;
    // What is no regular file may go on for ever.
    let spare = if file.length.is_some() { None } else { memory::available() };
    let most = spare.map_or(LONGEST, |spare| LONGEST.min(spare / SHARE)).max(FIRST);
    let mut rest = file.take(most.min(end).saturating_sub(FIRST) + 1);
    if rest.read_to_end(&mut bytes)? as u64 > most - FIRST {
        return Err(match spare {
            Some(available) if most < LONGEST => {
                Fault::from(Shortage { needed: most * SHARE, available })
            }
            Some(_) | None => Fault::TooLarge { what: TOO_LONG },
        }
        .into());
    }
    Ok(bytes)
}

/// Memory for each byte of a file: its own, and twice that for the mesh.
const SHARE: u64 = 3;

const TOO_LONG: &str = "the file is longer than 16 GiB";

/// Editors of some systems put a mark before text; it would hide the magic word.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

fn parse(
    bytes: &[u8],
    declared: Declared,
    progress: &Progress,
) -> Result<(Mesh, ReadReport), Flaw> {
    let bytes = without_mark(bytes);
    match sniff(bytes, declared, Some(bytes.len() as u64))? {
        Format::Obj => obj::read(bytes, progress),
        Format::Off => off::read(bytes, progress),
        Format::Ply => ply::read(bytes, progress),
        Format::Stl => stl::read(bytes, progress),
        Format::ThreeMf => threemf::read(bytes, progress),
    }
}

/// What the content is that begins with `bytes`, the strongest evidence first.
///
/// `length` is that of the whole, if it is known.
fn sniff(bytes: &[u8], declared: Declared, length: Option<u64>) -> Result<Format, Fault> {
    let start = bytes.trim_ascii_start();
    if start.is_empty() {
        Err(Fault::Empty)
    } else if is_wide(bytes) {
        Err(Fault::Wide)
    } else if stl::is_binary(bytes, length) {
        Ok(Format::Stl)
    } else if threemf::is_archive(bytes) {
        Ok(Format::ThreeMf)
    } else if bytes.starts_with(b"glTF") {
        Err(Fault::Refused(Refused::Glb))
    } else if start.starts_with(b"<") && contains(&start[..start.len().min(1024)], b"VTKFile") {
        Err(Fault::Refused(Refused::Vtu))
    } else if [&b"ply\n"[..], b"ply\r", b"ply "].iter().any(|magic| bytes.starts_with(magic)) {
        Ok(Format::Ply)
    } else if stl::is_text(bytes) {
        Ok(Format::Stl)
    } else if off::is_off(bytes) {
        Ok(Format::Off)
    } else if obj::is_obj(bytes) {
        Ok(Format::Obj)
    } else {
        match declared {
            // The magic word of OFF is optional, STL has none when binary and cut short, and an
            // OBJ file may begin with a long comment.
            Declared::Read(format @ (Format::Off | Format::Obj))
                if !bytes.iter().take(FIRST as usize).any(|byte| *byte == 0) =>
            {
                Ok(format)
            }
            Declared::Read(Format::Stl) if !is_prose(bytes) => Ok(Format::Stl),
            Declared::Read(format) => Err(Fault::Not(format)),
            Declared::Refused(refused) => Err(Fault::Refused(refused)),
            Declared::Nothing => Err(Fault::Unknown),
        }
    }
}

/// Whether the content begins with so much text that it is no binary file of triangles: there, a
/// title of eighty bytes is followed by numbers.
fn is_prose(bytes: &[u8]) -> bool {
    let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    bytes.len() > 120 && bytes[..120].iter().all(is_text)
}

/// Whether the content is text of two or four bytes a letter: it begins with their mark, or every
/// other byte of what looks like text is zero.
pub(super) fn is_wide(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(64)];
    let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
    let is_plain = |first: usize| {
        let mut letters = start.iter().skip(first).step_by(2);
        let mut between = start.iter().skip(1 - first).step_by(2);
        start.len() >= 16 && letters.all(is_text) && between.all(|byte| *byte == 0)
    };
    [&b"\xFF\xFE"[..], b"\xFE\xFF"].iter().any(|mark| bytes.starts_with(mark))
        || bytes.starts_with(b"\0\0\xFE\xFF")
        || is_plain(0)
        || is_plain(1)
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|window| window == word)
}
