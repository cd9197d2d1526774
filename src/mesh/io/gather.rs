//! A sink for writers that need the whole mesh: in memory while it is small, otherwise in a file.
//!
//! The file has no name, or loses it at once, so nothing is left of it whatever ends the process.
//! Its bytes are those of a PLY file at the precision of what is written in the end, which needs
//! room beside it on the disk: 12 or 24 bytes a vertex, 13 a triangle. Memory stays bounded.

use super::output::Precision;
use super::ply::PlySink;
use super::runs::Runs;
use crate::mesh::Sink;
use crate::mesh::sink::Collect;
use std::io;
use std::path::PathBuf;

/// Bytes of a mesh up to which it stays in memory: about what its writers and the contouring before
/// take anyway. Beyond, a file costs no more processor time where text is written.
pub(super) const MOST_IN_MEMORY: u64 = 1 << 25;

/// A mesh that is being gathered.
#[derive(Debug)]
pub(super) struct Gathered {
    /// Where the file is made.
    folder: PathBuf,
    precision: Precision,
    /// Bytes of the largest mesh that stays in memory.
    most_in_memory: u64,
    kept: Kept,
}

#[derive(Debug)]
enum Kept {
    Memory(Collect),
    File(PlySink),
}

impl Gathered {
    pub(super) fn new(folder: PathBuf, precision: Precision, most_in_memory: u64) -> Self {
        Self { folder, precision, most_in_memory, kept: Kept::Memory(Collect::default()) }
    }

    /// The mesh, whole if every announced vertex and triangle has come.
    ///
    /// # Errors
    /// Any failure of writing what came before.
    pub(super) fn into_runs(self) -> io::Result<Box<dyn Runs>> {
        Ok(match self.kept {
            Kept::Memory(mesh) => Box::new(mesh.into_mesh()),
            Kept::File(sink) => Box::new(sink.into_runs()?),
        })
    }

    /// Begins to gather in memory; whether the mesh has room there.
    fn begin_in_memory(&mut self, vertices: u64, triangles: u64) -> io::Result<bool> {
        if Collect::bytes(vertices, triangles) > self.most_in_memory {
            return Ok(false);
        }
        let mut mesh = Collect::default();
        match mesh.begin(vertices, triangles) {
            Ok(()) => {
                self.kept = Kept::Memory(mesh);
                Ok(true)
            }
            Err(error) if error.kind() == io::ErrorKind::OutOfMemory => Ok(false),
            Err(error) => Err(error),
        }
    }
}

impl Sink for Gathered {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        if self.begin_in_memory(vertices, triangles)? {
            return Ok(());
        }
        let file = tempfile::tempfile_in(&self.folder).map_err(|error| {
            let folder = self.folder.display();
            let message = format!("the mesh needs a file in `{folder}` meanwhile: {error}");
            io::Error::new(error.kind(), message)
        })?;
        let mut sink = PlySink::new(file, self.precision);
        sink.begin(vertices, triangles)?;
        self.kept = Kept::File(sink);
        Ok(())
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        match &self.kept {
            Kept::Memory(mesh) => mesh.vertices(first, positions),
            Kept::File(sink) => sink.vertices(first, positions),
        }
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        match &self.kept {
            Kept::Memory(mesh) => mesh.triangles(first, corners),
            Kept::File(sink) => sink.triangles(first, corners),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_mesh_is_in_a_file_without_a_name_and_a_small_one_in_none() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing");
        let begin = |folder: PathBuf, vertices| {
            let mut mesh = Gathered::new(folder, Precision::Single, 2400);
            mesh.begin(vertices, 0).map(|()| matches!(mesh.kept, Kept::File(_)))
        };
        assert!(!begin(missing.clone(), 100).unwrap());
        assert!(begin(folder.path().to_owned(), 101).unwrap());
        #[cfg(unix)]
        {
            let mut mesh = Gathered::new(folder.path().to_owned(), Precision::Single, 0);
            mesh.begin(100, 200).unwrap();
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        }
        let error = begin(missing.clone(), 101).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        assert!(error.to_string().contains(missing.to_str().unwrap()), "{error}");
    }

    #[test]
    fn a_mesh_beyond_memory_goes_to_the_file_however_much_may_be_in_memory() {
        if crate::num::memory::available().is_some() {
            let mut mesh = Gathered::new(std::env::temp_dir(), Precision::Single, u64::MAX);
            assert!(!mesh.begin_in_memory(1 << 60, 1 << 50).unwrap());
        }
    }
}
