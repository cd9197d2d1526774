//! The files that programs name, read from the file system.

use super::convert::{Converted, asli, scaffolder};
use super::points::{self, Points};
use crate::cellular::struts::file::{self, Format};
use crate::expr::Oracle;
use crate::field::scattered::file::types;
use crate::field::{self, mesh_distance};
use crate::geom::Aabb;
use crate::lang::{Diagnostic, Loaded, Loader, MakeShape, Refusal, Span, Translation};
use crate::mesh::io::{self, open::open};
use crate::num::Progress;
use crate::vocabulary;
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

/// Longest program file that is read, in bytes: far more than any program, far less than memory.
const LONGEST_TEXT: u64 = 16 << 20;

/// What is to be said about a mesh file that was read.
#[derive(Clone, Debug, serde::Serialize)]
pub struct MeshNote {
    /// The file, as the program names it.
    #[serde(rename = "file")]
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

/// What is to be said about an input of another tool that was translated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConversionNote {
    /// The word that it was.
    pub word: String,
    /// Remarks for the user, one a line.
    pub remarks: Vec<String>,
}

/// What reading the files of a program met.
#[derive(Debug, Default)]
pub struct Notes {
    /// What is to be said about the meshes, in the order of their reading.
    pub meshes: Vec<MeshNote>,
    /// What is to be said about inputs of other tools, in their order.
    pub conversions: Vec<ConversionNote>,
    /// Every file that was read, each once, in order.
    pub files: Vec<String>,
    /// What each of them was before it was read for the first time.
    pub stamps: Vec<Option<Stamp>>,
}

/// By what a change of a file is noticed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stamp {
    length: u64,
    modified: Option<SystemTime>,
}

impl Stamp {
    /// That of `file` now; `None` if the system does not tell.
    #[must_use]
    pub fn of(file: &str) -> Option<Self> {
        let data = std::fs::metadata(file).ok()?;
        Some(Self { length: data.len(), modified: data.modified().ok() })
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

/// Reads files of the file system, each text, each mesh and each set of points once.
#[derive(Debug, Default)]
pub struct Files {
    access: Access,
    texts: HashMap<String, String>,
    meshes: HashMap<String, Loaded>,
    points: Points,
    notes: Notes,
}

impl Files {
    /// Reads the files that `access` allows.
    #[must_use]
    pub fn with(access: Access) -> Self {
        Self { access, ..Self::default() }
    }

    /// The same files for a program that is read anew: texts are not read again, as those of pipes
    /// can't be; all else is.
    #[must_use]
    pub fn again(self) -> Self {
        let Self { access, texts, meshes: _, points: _, notes: _ } = self;
        Self { access, texts, ..Self::default() }
    }

    /// What reading met.
    #[must_use]
    pub fn into_notes(self) -> Notes {
        self.notes
    }

    /// Refuses `path` unless it may be read, and notes it as it is before it is read: what takes its
    /// place meanwhile is then another file.
    fn admit(&mut self, path: &str) -> Result<(), Refusal> {
        self.access.check(path)?;
        if !self.notes.files.iter().any(|file| file == path) {
            self.notes.stamps.push(Stamp::of(path));
            self.notes.files.push(path.to_owned());
        }
        Ok(())
    }

    /// The program for `word`, if it is an input of another tool.
    fn converted(&mut self, word: &str, span: Span) -> Option<Result<Converted, Diagnostic>> {
        if let Some(line) = word.strip_prefix(scaffolder::PREFIX) {
            return Some(scaffolder::convert(line).map_err(|fault| {
                let start = scaffolder::PREFIX.len();
                let place = |at: usize| span.start.saturating_add((start + at) as u32);
                let (start, end) = (place(fault.place.start), place(fault.place.end));
                Diagnostic::new(fault.message).at(Span { start, end, ..span }, "").cure(fault.cure)
            }));
        }
        let name = word.to_ascii_lowercase();
        let ends = |ending: &str| name.len() > ending.len() && name.ends_with(ending);
        (ends(".yml") || ends(".yaml")).then(|| {
            let text = self.text(word);
            let converted = text
                .map_err(|refusal| refusal.to_string())
                .and_then(|text| asli::convert(&text, self).map_err(|fault| fault.to_string()));
            converted.map_err(|cause| {
                let message = format!("can't read the configuration `{word}`: {cause}");
                Diagnostic::new(message).at(span, "").of_a_file()
            })
        })
    }
}

impl asli::Answers for Files {
    fn bounds(&mut self, path: &str) -> Result<Aabb, Refusal> {
        Ok(self.mesh(path)?.bounds)
    }

    fn types(&mut self, path: &str) -> Result<Vec<String>, Refusal> {
        let text = self.text(path)?;
        let found = types(&text).map_err(|fault| Refusal { cause: fault.to_string() })?;
        Ok(found.names)
    }
}

impl Loader for Files {
    fn text(&mut self, path: &str) -> Result<String, Refusal> {
        self.admit(path)?;
        if let Some(text) = self.texts.get(path) {
            return Ok(text.clone());
        }
        let refuse = |cause: std::io::Error| Refusal { cause: cause.to_string() };
        let mut bytes = Vec::new();
        let file = open(Path::new(path)).map_err(refuse)?;
        file.take(LONGEST_TEXT + 1).read_to_end(&mut bytes).map_err(refuse)?;
        if bytes.len() as u64 > LONGEST_TEXT {
            return Err(Refusal { cause: format!("it is longer than {LONGEST_TEXT} bytes") });
        }
        let text = String::from_utf8(bytes).map_err(|error| {
            let offset = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..offset].iter().filter(|byte| **byte == b'\n').count() + 1;
            let cure = "save it as UTF-8";
            Refusal { cause: format!("line {line}, byte {offset}: it is no UTF-8 text; {cure}") }
        })?;
        self.texts.insert(path.to_owned(), text.clone());
        Ok(text)
    }

    fn is_mesh(&self, word: &str) -> bool {
        io::is_mesh_path(Path::new(word))
    }

    fn mesh(&mut self, path: &str) -> Result<Loaded, Refusal> {
        if let Some(loaded) = self.meshes.get(path) {
            return Ok(loaded.clone());
        }
        self.admit(path)?;
        let (mesh, reading) = io::read_with(Path::new(path), &Progress::new())
            .map_err(|error| Refusal { cause: error.without_file() })?;
        let distance =
            mesh_distance(&mesh, path).map_err(|error| Refusal { cause: error.to_string() })?;
        self.notes.meshes.push(MeshNote {
            path: path.to_owned(),
            reading,
            distance: *distance.report(),
        });
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

    fn check_points(&self, text: &str) -> Result<(), Refusal> {
        points::Wanted::of(text).map(|_| ())
    }

    fn points(&mut self, text: &str) -> Result<Arc<dyn Oracle>, Refusal> {
        if let Some(known) = self.points.known(text) {
            return Ok(known);
        }
        let wanted = points::Wanted::of(text)?;
        let texts = wanted.files().map(|file| file.map(|path| self.text(path)).transpose());
        let [main, sizes] = texts;
        self.points.read(text, &wanted, &main?.unwrap_or_default(), sizes?.as_deref())
    }

    fn translation(
        &mut self,
        word: &str,
        span: Span,
    ) -> Option<Result<Translation, Box<Diagnostic>>> {
        let converted = self.converted(word, span)?;
        Some(converted.map_err(Box::new).map(|Converted { text, remarks }| {
            if !remarks.is_empty() {
                self.notes.conversions.push(ConversionNote { word: word.to_owned(), remarks });
            }
            Translation { name: format!("{word} as a program"), text }
        }))
    }
}
