//! 3D Manufacturing Format: an archive with a model in XML.
//!
//! **Reading** takes the mesh of every item that is to be built, moved and scaled to millimetres;
//! items are put together without joining their vertices. Colours, materials, slices and beams
//! are ignored and reported; models in other parts of the archive (the production extension)
//! are not read. **Writing** makes one object in millimetres. Both pass the text of the model on piece
//! by piece, between the archive and the markup, and never hold it whole.
//!
//! Nothing in a file is trusted: parts are unpacked only up to a limit, components that contain
//! themselves are a fault, and a model's copies may not outnumber what memory holds. The same mesh
//! gives the same bytes: times in the archive are fixed.
//!
//! Source: 3MF Core Specification 1.3, sections 3 (model), 4 (objects); Open Packaging Conventions,
//! ECMA-376 part 2.

mod build;
mod model;
mod write;

pub(super) use write::write;

use super::Format;
use super::assembly::{Assembly, ReadReport};
use super::error::{Fault, Flaw};
use super::text::syntax;
use crate::mesh::Mesh;
use crate::num::Progress;
use std::borrow::Cow;
use std::io::{BufReader, Cursor, Read};
use zip::ZipArchive;
use zip::result::ZipError;

/// The longest part that is unpacked, in bytes: some 100 million triangles.
const LONGEST_PART: u64 = 1 << 33;

/// Times by which a part may be larger than the archive: beyond, it is made to exhaust memory.
/// A flat sheet of equal triangles, printed with blanks, is packed to a twelfth.
const MOST_PACKED: u64 = 100;
/// Bytes that are unpacked in any case.
const LITTLE: u64 = 1 << 24;

/// Whether the content begins like an archive.
pub(super) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// Reads the items that a 3MF archive wants built.
pub(super) fn read(bytes: &[u8], progress: &Progress) -> Result<(Mesh, ReadReport), Flaw> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(fault)?;
    let name = root(&mut archive)?;
    let limit = MOST_PACKED.saturating_mul(bytes.len() as u64).clamp(LITTLE, LONGEST_PART);
    let part = archive.by_name(&name).map_err(fault)?;
    // The size that the archive states may be a lie; what is unpacked is counted.
    let part = BufReader::with_capacity(1 << 16, part.take(limit));
    let mut assembly = Assembly::new(Format::ThreeMf, bytes.len(), progress);
    let model = model::read(part, limit, &mut assembly)?;
    build::build(&model, &mut assembly)?;
    Ok(assembly.finish()?)
}

/// The name of the part with the model, which the relations of the archive tell.
fn root(archive: &mut ZipArchive<Cursor<&[u8]>>) -> Result<String, Flaw> {
    const RELATIONS: &str = "_rels/.rels";
    const LONGEST_RELATIONS: u64 = 1 << 20;
    let mut text = String::new();
    if let Ok(part) = archive.by_name(RELATIONS)
        && part.take(LONGEST_RELATIONS).read_to_string(&mut text).is_ok()
        && let Some(target) = model::target_of_relations(&text)
    {
        return Ok(target);
    }
    // Some writers leave the relations out; the model has a customary name.
    let customary = archive.file_names().flatten().map(Cow::into_owned).find(|name| {
        let name = name.to_ascii_lowercase();
        name.starts_with("3d/") && name.ends_with(".model") && name.matches('/').count() == 1
    });
    let other = || archive.file_names().flatten().next().map(Cow::into_owned);
    customary.ok_or_else(|| {
        let found = other().unwrap_or_else(|| "nothing".to_owned());
        syntax("an archive with a 3D model", Some(found.as_bytes())).into()
    })
}

/// What is wrong with an archive.
fn fault(error: ZipError) -> Flaw {
    let ZipError::Io(error) = error else {
        return syntax("a sound ZIP archive", Some(error.to_string().as_bytes())).into();
    };
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        Fault::Truncated { before: "the archive does" }.into()
    } else {
        Fault::Unreadable(error).into()
    }
}
