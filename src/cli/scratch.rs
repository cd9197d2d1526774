//! A folder for files that pass, removed at the end whatever the end.
//!
//! It is in the system's folder for temporary files. Only a run that is killed leaves it.

use super::interrupt;
use super::report::Trouble;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The folder; one at a time.
#[derive(Debug)]
pub(super) struct Scratch {
    path: PathBuf,
    folder: Option<TempDir>,
}

impl Scratch {
    /// Makes the folder.
    ///
    /// # Errors
    /// [`Trouble::Scratch`].
    pub(super) fn new() -> Result<Self, Trouble> {
        let made = interrupt::guard_folder(|| {
            let folder = tempfile::Builder::new().prefix("alveole-").tempdir()?;
            let path = folder.path().to_owned();
            Ok((Self { path: path.clone(), folder: Some(folder) }, path))
        });
        made.map_err(Trouble::Scratch)
    }

    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        interrupt::forget_folder(|| drop(self.folder.take()));
    }
}
