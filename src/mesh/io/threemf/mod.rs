//! 3D Manufacturing Format: an archive with a model in XML.
//!
//! **Reading** takes the mesh of every item that is to be built, moved and scaled to millimetres;
//! items are put together without joining their vertices. Objects may be in other parts of the
//! archive (the production extension). Colours, materials, slices and beams are ignored and
//! reported, but a model that *requires* an extension which is not read is refused: its meshes are
//! not all there is. **Writing** makes one object in millimetres. Both pass the text of the model on piece
//! by piece, between the archive and the markup, and never hold it whole.
//!
//! Nothing in a file is trusted: parts are unpacked only up to a limit, components that contain
//! themselves are a fault, and a model's copies may not outnumber what memory holds. The same mesh
//! gives the same bytes: times in the archive are fixed.
//!
//! Source: 3MF Core Specification 1.3, sections 3 (model), 4 (objects); Production Extension 1.1,
//! section 3 (paths); Open Packaging Conventions, ECMA-376 part 2.

mod build;
mod model;
mod write;

pub(super) use write::write;

use super::Format;
use super::assembly::{Assembly, ReadReport};
use super::error::{Fault, Flaw};
use super::text::{shown, syntax};
use crate::mesh::Mesh;
use crate::num::Progress;
use model::Model;
use std::borrow::Cow;
use std::io::{BufReader, Cursor, Read};
use zip::ZipArchive;
use zip::result::ZipError;

/// The longest model that is unpacked, all parts together, in bytes: some 100 million triangles.
const LONGEST_PARTS: u64 = 1 << 33;

/// Times by which a model may be larger than the archive: beyond, it is made to exhaust memory.
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
    let mut model = Model::new(root(&mut archive)?);
    let mut assembly = Assembly::new(Format::ThreeMf, bytes.len(), progress);
    let mut left = MOST_PACKED.saturating_mul(bytes.len() as u64).clamp(LITTLE, LONGEST_PARTS);
    let mut number = 0;
    // The root names the other parts.
    while let Some(part) = model.parts.get(number as usize) {
        let name = part.name.clone();
        if archive.index_for_name(&name).is_none() {
            return Err(syntax("a part that is in the archive", Some(name.as_bytes())).into());
        }
        let read = read_part(&mut archive, left, number, &mut model, &mut assembly);
        let within = |flaw| if number > 0 { within(&name, flaw) } else { flaw };
        left -= read.map_err(within)?;
        number += 1;
    }
    build::build(&model, &mut assembly)?;
    Ok(assembly.finish()?)
}

/// Reads the part of `model` with that number, of which no more than `limit` bytes are unpacked, and
/// returns how many were.
fn read_part(
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    limit: u64,
    number: u32,
    model: &mut Model,
    assembly: &mut Assembly<'_>,
) -> Result<u64, Flaw> {
    let part = archive.by_name(&model.parts[number as usize].name).map_err(fault)?;
    // The size that the archive states may be a lie; what is unpacked is counted.
    let text = BufReader::with_capacity(1 << 16, part.take(limit));
    model::read(text, limit, number, model, assembly)
}

/// What is wrong in a part of the archive.
fn within(part: &str, Flaw { place, fault }: Flaw) -> Flaw {
    Flaw { place, fault: Fault::Part { part: shown(part), fault: Box::new(fault) } }
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
