//! The files that meshes pass through.

use super::Error;
use crate::mesh::Mesh;
use crate::mesh::io::{self, Format, Precision, WriteError};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Where and how meshes are written on their way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Passage {
    /// The folder of the files, which must exist; who made it removes it.
    pub folder: PathBuf,
    /// The format of the files.
    pub format: Format,
    /// The precision of coordinates in the files.
    pub precision: Precision,
}

impl Passage {
    /// Writes `mesh` under `name` with the extension of the format, over what was there; returns the path.
    pub(super) fn write(&self, name: &str, mesh: &Mesh) -> Result<String, Error> {
        let Self { folder, format, precision } = self;
        let file = folder.join(format!("{name}.{}", format.name().to_lowercase()));
        let written = || -> Result<(), WriteError> {
            let mut out = BufWriter::with_capacity(1 << 20, File::create(&file)?);
            io::write(mesh, *format, *precision, &mut out)?;
            Ok(out.flush()?)
        };
        match written() {
            Ok(()) => Ok(file.display().to_string()),
            Err(source) => Err(Error::Write { file, source }),
        }
    }
}
