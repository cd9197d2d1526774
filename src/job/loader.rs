//! The files that programs name, read from the file system.

use crate::cellular::struts::file::{self, Format};
use crate::field::{self, mesh_distance};
use crate::lang::{Loaded, Loader, MakeShape, Refusal};
use crate::mesh::io;
use crate::num::Progress;
use crate::vocabulary;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Longest program file that is read, in bytes: far more than any program, far less than memory.
const LONGEST_TEXT: u64 = 16 << 20;

/// What is to be said about a mesh file that was read.
#[derive(Clone, Debug)]
pub struct MeshNote {
    /// The file, as the program names it.
    pub path: String,
    /// What reading it met: polygons, welded vertices, faces dropped.
    pub reading: io::ReadReport,
    /// How its inside is told from its outside, and what was mended.
    pub distance: field::Report,
}

impl MeshNote {
    /// Remarks for the user, one a line.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let Self { path: _, reading, distance } = self;
        let mut remarks = vec![distance.to_string()];
        if reading.dropped > 0 {
            let (dropped, faces) = (reading.dropped, reading.faces);
            remarks.push(format!("{dropped} of {faces} faces have no area and were dropped"));
        }
        remarks
    }
}

/// Which files a program may name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Access {
    /// Any, pipes and devices included.
    #[default]
    Everything,
    /// Regular files only: reading ends, and takes nothing from another reader.
    Regular,
    /// None.
    Nothing,
}

impl Access {
    /// Refuses `path` unless it may be read.
    fn check(self, path: &str) -> Result<(), Refusal> {
        match self {
            Self::Everything => Ok(()),
            Self::Regular if std::fs::metadata(path).is_ok_and(|data| !data.is_file()) => {
                Err(Refusal { cause: "it is not a regular file".to_owned() })
            }
            Self::Regular => Ok(()),
            Self::Nothing => Err(Refusal { cause: "no files may be read here".to_owned() }),
        }
    }
}

/// Reads files of the file system, each mesh once.
#[derive(Debug, Default)]
pub struct Files {
    access: Access,
    meshes: HashMap<String, Loaded>,
    notes: Vec<MeshNote>,
}

impl Files {
    /// Reads the files that `access` allows.
    #[must_use]
    pub fn with(access: Access) -> Self {
        Self { access, ..Self::default() }
    }

    /// What is to be said about the meshes read, in the order of their reading.
    #[must_use]
    pub fn into_notes(self) -> Vec<MeshNote> {
        self.notes
    }
}

impl Loader for Files {
    fn text(&mut self, path: &str) -> Result<String, Refusal> {
        self.access.check(path)?;
        let refuse = |cause: std::io::Error| Refusal { cause: cause.to_string() };
        let mut text = String::new();
        let file = File::open(path).map_err(refuse)?;
        file.take(LONGEST_TEXT + 1).read_to_string(&mut text).map_err(refuse)?;
        if text.len() as u64 > LONGEST_TEXT {
            return Err(Refusal { cause: format!("it is longer than {LONGEST_TEXT} bytes") });
        }
        Ok(text)
    }

    fn is_mesh(&self, word: &str) -> bool {
        io::is_mesh_path(Path::new(word))
    }

    fn mesh(&mut self, path: &str) -> Result<Loaded, Refusal> {
        if let Some(loaded) = self.meshes.get(path) {
            return Ok(loaded.clone());
        }
        self.access.check(path)?;
        let (mesh, reading) = io::read_with(Path::new(path), &Progress::new())
            .map_err(|error| Refusal { cause: error.without_file() })?;
        let distance =
            mesh_distance(&mesh, path).map_err(|error| Refusal { cause: error.to_string() })?;
        self.notes.push(MeshNote { path: path.to_owned(), reading, distance: *distance.report() });
        let bounds = distance.bounds();
        let loaded = Loaded { distance: Arc::new(distance), bounds };
        self.meshes.insert(path.to_owned(), loaded.clone());
        Ok(loaded)
    }

    fn is_lattice(&self, word: &str) -> bool {
        Format::of(word).is_some()
    }

    fn lattice(&mut self, path: &str) -> Result<Arc<MakeShape>, Refusal> {
        let format = Format::of(path).ok_or_else(|| Refusal {
            cause: "lattice files end in .cell, .cell.json or .ltcx".to_owned(),
        })?;
        let text = self.text(path)?;
        let cell =
            file::read(&text, format).map_err(|fault| Refusal { cause: fault.to_string() })?;
        Ok(vocabulary::lattice(cell))
    }
}
