//! Reading a mesh from a file in any format.
//!
//! Where the content of a file contradicts its extension, the content is believed. No count in a
//! file is trusted: memory grows with the data that is there. Nothing panics, whatever the bytes.

use super::assembly::ReadReport;
use super::error::{Fault, Flaw, ReadError};
use super::{Format, Refused, obj, off, ply, stl, threemf};
use crate::mesh::Mesh;
use crate::num::Progress;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The longest file read, in bytes: 16 GiB, more than the largest mesh in binary.
const LONGEST: u64 = 1 << 34;

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
    load(path)
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

fn load(path: &Path) -> Result<Vec<u8>, Flaw> {
    let file = File::open(path)?;
    let mut bytes = Vec::new();
    file.take(LONGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST {
        return Err(Fault::TooLarge { what: "the file is longer than 16 GiB" }.into());
    }
    Ok(bytes)
}

fn parse(
    bytes: &[u8],
    declared: Declared,
    progress: &Progress,
) -> Result<(Mesh, ReadReport), Flaw> {
    // Editors of some systems put this mark before text; it would hide the magic word.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match sniff(bytes, declared)? {
        Format::Obj => obj::read(bytes, progress),
        Format::Off => off::read(bytes, progress),
        Format::Ply => ply::read(bytes, progress),
        Format::Stl => stl::read(bytes, progress),
        Format::ThreeMf => threemf::read(bytes, progress),
    }
}

/// What the content is, the strongest evidence first.
fn sniff(bytes: &[u8], declared: Declared) -> Result<Format, Fault> {
    let start = bytes.trim_ascii_start();
    if stl::is_binary(bytes) {
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
            Declared::Read(format @ (Format::Off | Format::Stl | Format::Obj)) => Ok(format),
            Declared::Read(format @ (Format::Ply | Format::ThreeMf)) => Err(Fault::Not(format)),
            Declared::Refused(refused) => Err(Fault::Refused(refused)),
            Declared::Nothing => Err(Fault::Unknown),
        }
    }
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|window| window == word)
}
