//! Output files that appear complete or not at all.
//!
//! A regular target is written beside under a unique, locked name, which becomes the target's when it
//! is whole; symbolic links are resolved first, so that the link stays and its target changes.
//! Leftovers of runs that were killed are recognised by their released lock and removed. A target
//! that is no regular file (a device, a pipe, standard output) is written to directly. Nothing is
//! promised for a loss of power: nobody waits for the disk.

use super::interrupt;
use crate::mesh::io::WriteError;
use std::fs::{self, File, TryLockError};
use std::io::{self, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// Ends the name of an output that is still being written.
const UNFINISHED: &str = ".alveole-part";

/// Why an output could not be opened or finished.
#[derive(Debug, thiserror::Error)]
pub(super) enum OutputError {
    /// The folder or file can't be written.
    #[error("cannot write `{}`: {source}", path.display())]
    Write {
        /// The output as named by the user.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// There is no folder to write the output to.
    #[error(
        "cannot write `{}`: there is no folder `{}`; make it, or name another",
        path.display(), folder.display()
    )]
    NoFolder {
        /// The output as named by the user.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
    /// The output is a folder.
    #[error("cannot write `{}`: it is a folder; name a file in it", path.display())]
    Folder {
        /// The output as named by the user.
        path: PathBuf,
    },
}

/// An output being written.
#[derive(Debug)]
pub(super) struct Output {
    named: PathBuf,
    file: File,
    replacement: Option<(TempPath, PathBuf)>,
    /// Where it is, or for what is no regular file the system's for temporary files.
    folder: PathBuf,
    seekable: bool,
}

impl Output {
    /// Opens `path` for writing; `-` is standard output.
    ///
    /// One output is open at a time: an interruption removes the last one opened.
    pub(super) fn open(path: &Path) -> Result<Self, OutputError> {
        let named = path.to_owned();
        let failed = |source| OutputError::Write { path: named.clone(), source };
        if path == Path::new("-") {
            let file = standard_output().map_err(failed)?;
            let folder = std::env::temp_dir();
            return Ok(Self { named, file, replacement: None, folder, seekable: false });
        }
        let target = resolve(path).map_err(failed)?;
        match fs::metadata(&target) {
            Ok(data) if data.is_dir() => Err(OutputError::Folder { path: named }),
            Ok(data) if !data.is_file() => {
                let mut file = File::options().write(true).open(&target).map_err(failed)?;
                let seekable = file.seek(SeekFrom::Start(0)).is_ok();
                let folder = std::env::temp_dir();
                Ok(Self { named, file, replacement: None, folder, seekable })
            }
            existing => {
                let permissions = existing.ok().map(|data| data.permissions());
                let folder = folder(&target).to_owned();
                if fs::metadata(&folder).is_err_and(|e| e.kind() == io::ErrorKind::NotFound) {
                    return Err(OutputError::NoFolder { path: named, folder });
                }
                let (file, temporary) = beside(&target, permissions).map_err(failed)?;
                let replacement = Some((temporary, target));
                Ok(Self { named, file, replacement, folder, seekable: true })
            }
        }
    }

    /// Whether `path` could be opened for writing now, so that long work is not done in vain.
    ///
    /// What is no regular file is not touched: whoever reads from it would take notice.
    pub(super) fn probe(path: &Path) -> Result<(), OutputError> {
        let touches = |data: fs::Metadata| data.is_file() || data.is_dir();
        let is_safe = |target: PathBuf| fs::metadata(target).map_or(true, touches);
        if path != Path::new("-") && resolve(path).map_or(true, is_safe) {
            Self::open(path)?;
        }
        Ok(())
    }

    /// The open file.
    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Whether the file takes writes at positions; otherwise it is written front to back.
    pub(super) fn is_seekable(&self) -> bool {
        self.seekable
    }

    /// A folder for large files that are needed until the output is written.
    ///
    /// Not every disk has room for them, but that of the output must have.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Makes the output visible under its name.
    pub(super) fn finish(mut self) -> Result<(), OutputError> {
        match self.replacement.take() {
            Some((temporary, target)) => {
                let result = put_in_place(temporary, &target);
                interrupt::forget();
                result.map_err(|source| self.failure(source))
            }
            None => Ok(()),
        }
    }

    /// The error of a format that failed to write to this output, or can't hold the mesh.
    pub(super) fn refusal(&self, error: WriteError) -> OutputError {
        self.failure(error.into())
    }

    /// The error of a failed write to this output.
    pub(super) fn failure(&self, source: io::Error) -> OutputError {
        OutputError::Write { path: self.named.clone(), source }
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        if self.replacement.is_some() {
            interrupt::forget();
        }
    }
}

/// Gives the file `temporary` the name `target`, in place of a file that has it.
///
/// File systems that allocate late hand a file to the disk before it is renamed over another. They
/// don't when two files exchange their names.
fn put_in_place(temporary: TempPath, target: &Path) -> io::Result<()> {
    let replaces = fs::symlink_metadata(target).is_ok_and(|data| data.is_file());
    if replaces && exchange(&temporary, target).is_ok() {
        // What has the temporary name now is the old file, unlocked as any leftover: should it be
        // gone already, another run has removed it.
        drop(temporary);
        return Ok(());
    }
    temporary.persist(target).map_err(|error| error.error)
}

/// Exchanges the names of two files at once, where the system can.
#[cfg(target_os = "linux")]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

/// Exchanges the names of two files at once, where the system can.
#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The folder that `target` is in.
fn folder(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        Some(_) | None => Path::new("."),
    }
}

/// A new locked file in the folder of `target`, removed if the program is interrupted.
fn beside(target: &Path, permissions: Option<fs::Permissions>) -> io::Result<(File, TempPath)> {
    let folder = folder(target);
    let name =
        target.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let prefix = format!(".{}.", shortened(&name));
    remove_leftovers(folder, &prefix);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(UNFINISHED);
    // What the library opens itself is for its owner alone, and its errors name the temporary file.
    let open = |path: &Path| File::options().read(true).write(true).create_new(true).open(path);
    interrupt::guard(|| {
        let (file, path) = locked(|| Ok(builder.make_in(folder, open)?.into_parts()))?;
        let name = path.to_path_buf();
        if let Some(permissions) = permissions {
            fs::set_permissions(&path, permissions)?;
        }
        Ok(((file, path), name))
    })
}

/// A file from `make` that is locked and in its place.
///
/// Between its making and its locking another run may have taken it for a leftover. That run then
/// holds the lock, or the file is gone, and another one is made. Once it is locked nobody takes it.
fn locked(mut make: impl FnMut() -> io::Result<(File, TempPath)>) -> io::Result<(File, TempPath)> {
    /// More runs than will ever begin at one moment.
    const MOST_ATTEMPTS: usize = 64;
    for _ in 0..MOST_ATTEMPTS {
        let (file, path) = make()?;
        // A file system without locks only loses the recognition of leftovers.
        let is_ours = !matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        if is_ours && is_at(&file, &path) {
            return Ok((file, path));
        }
    }
    Err(io::Error::other("other runs take every temporary file away"))
}

/// Whether `path` names `file`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |data: io::Result<fs::Metadata>| data.ok().map(|data| (data.dev(), data.ino()));
    number(file.metadata()) == number(fs::metadata(path))
}

/// Whether `path` names `file`.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// The beginning of `name`, short enough for what a temporary file adds to it.
fn shortened(name: &str) -> &str {
    /// File systems take names of 255 bytes; two dots, the ending and six letters are added.
    const LONGEST: usize = 255 - 2 - UNFINISHED.len() - 6;
    let end = (0..=LONGEST.min(name.len())).rev().find(|&at| name.is_char_boundary(at));
    &name[..end.unwrap_or(0)]
}

/// Removes unfinished files of the same output whose writer is gone.
fn remove_leftovers(folder: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        if name.starts_with(prefix) && name.ends_with(UNFINISHED) {
            let path = entry.path();
            let abandoned =
                File::options().write(true).open(&path).is_ok_and(|file| file.try_lock().is_ok());
            if abandoned {
                // Whoever else finds it first removes it as well.
                let _ = fs::remove_file(&path);
            }
        }
    }
}

/// `path` with symbolic links at its end followed, also to a file that does not exist yet.
fn resolve(path: &Path) -> io::Result<PathBuf> {
    /// As many links as common systems follow.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_owned();
    // The link of an open pipe, as `/dev/stdout` may be, leads to no name; the system follows it.
    if fs::metadata(&path).is_ok_and(|data| !data.is_file() && !data.is_dir()) {
        return Ok(path);
    }
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(next) => {
                path = path.parent().map_or_else(|| next.clone(), |folder| folder.join(&next))
            }
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many levels of symbolic links"))
}

/// Standard output as a file of its own, without the line buffer.
#[cfg(unix)]
fn standard_output() -> io::Result<File> {
    use std::os::fd::AsFd;
    Ok(io::stdout().as_fd().try_clone_to_owned()?.into())
}

/// Standard output as a file of its own, without the line buffer.
#[cfg(windows)]
fn standard_output() -> io::Result<File> {
    use std::os::windows::io::AsHandle;
    Ok(io::stdout().as_handle().try_clone_to_owned()?.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn an_output_appears_only_when_it_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.ply");
        let output = Output::open(&target).unwrap();
        output.file().write_all(b"whole").unwrap();
        assert!(!target.exists());
        output.finish().unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"whole");
        assert_eq!(names(folder.path()), ["out.ply"]);
    }

    #[test]
    fn an_abandoned_output_leaves_the_old_one_alone() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.ply");
        fs::write(&target, b"old").unwrap();
        let output = Output::open(&target).unwrap();
        output.file().write_all(b"half").unwrap();
        drop(output);
        assert_eq!(fs::read(&target).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["out.ply"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_finished_output_takes_the_place_of_the_old_one_at_once() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.ply");
        fs::write(&target, b"old").unwrap();
        fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
        let mut old = File::open(&target).unwrap();
        let output = Output::open(&target).unwrap();
        output.file().write_all(b"whole").unwrap();
        output.finish().unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"whole");
        assert_eq!(fs::metadata(&target).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(names(folder.path()), ["out.ply"]);
        // Whoever has the old file open reads on in it.
        assert_eq!(io::read_to_string(&mut old).unwrap(), "old");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn files_exchange_their_names_or_stay() {
        let folder = tempfile::tempdir().unwrap();
        let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
        fs::write(&one, b"1").unwrap();
        assert!(exchange(&one, &other).is_err() && one.exists());
        fs::write(&other, b"2").unwrap();
        exchange(&one, &other).unwrap();
        assert_eq!(
            (fs::read(&one).unwrap(), fs::read(&other).unwrap()),
            (b"2".into(), b"1".into())
        );
    }

    #[test]
    fn a_name_may_be_as_long_as_the_file_system_takes() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["n".repeat(251), "\u{3c0}".repeat(125)] {
            let target = folder.path().join(format!("{name}.ply"));
            let output = Output::open(&target).unwrap();
            output.file().write_all(b"whole").unwrap();
            output.finish().unwrap();
            assert_eq!(fs::read(&target).unwrap(), b"whole");
        }
        assert_eq!(names(folder.path()).len(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_its_target_changes() {
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("real.ply"), folder.path().join("link.ply"));
        std::os::unix::fs::symlink("real.ply", &link).unwrap();
        let output = Output::open(&link).unwrap();
        output.file().write_all(b"new").unwrap();
        output.finish().unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
    }

    #[test]
    fn leftovers_of_killed_runs_are_removed_and_live_ones_kept() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out.ply");
        fs::write(folder.path().join(".out.ply.dead.alveole-part"), b"half").unwrap();
        let live = File::create(folder.path().join(".out.ply.live.alveole-part")).unwrap();
        live.lock().unwrap();
        Output::open(&target).unwrap().finish().unwrap();
        assert_eq!(names(folder.path()), [".out.ply.live.alveole-part", "out.ply"]);
    }

    #[test]
    fn a_file_that_another_run_took_for_a_leftover_is_made_again() {
        let folder = tempfile::tempdir().unwrap();
        let mut thieves = Vec::new();
        let mut attempts = 0;
        let (file, path) = locked(|| {
            let (file, path) = tempfile::NamedTempFile::new_in(folder.path())?.into_parts();
            attempts += 1;
            match attempts {
                // It is locked by the other run, which is about to remove it.
                1 => {
                    let thief = File::open(&path)?;
                    thief.lock()?;
                    thieves.push(thief);
                }
                // It has been removed.
                2 => fs::remove_file(&path)?,
                _ => {}
            }
            Ok((file, path))
        })
        .unwrap();
        assert_eq!(attempts, 3);
        assert!(is_at(&file, &path) && File::open(&path).unwrap().try_lock().is_err());
        assert_eq!(names(folder.path()).len(), 1);
    }

    #[test]
    fn what_can_not_be_made_is_refused_without_a_word_of_temporary_files() {
        let folder = tempfile::tempdir().unwrap();
        let said = |path: &Path| Output::open(path).unwrap_err().to_string();
        let missing = folder.path().join("missing");
        let message = said(&missing.join("out.ply"));
        assert!(message.contains(&format!("no folder `{}`", missing.display())), "{message}");
        fs::write(folder.path().join("file"), b"").unwrap();
        let message = said(&folder.path().join("file/out.ply"));
        assert!(message.contains("directory") && !message.contains(UNFINISHED), "{message}");
    }

    #[test]
    fn a_folder_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let error = Output::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("it is a folder"), "{error}");
    }
}
