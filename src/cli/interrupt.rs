//! Leaving nothing behind when the program is interrupted.
//!
//! On Ctrl-C, and on the termination and hang-up signals, the unfinished output and the folder for passing files
//! are removed and the process ends with code 130. The handler runs on a thread of its own.

use std::path::PathBuf;
use std::process;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The exit code of an interrupted run, as shells report it.
pub(super) const INTERRUPTED: i32 = 130;

/// The file to remove on interruption. Holding the lock keeps the handler waiting.
static UNFINISHED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// The folder to remove on interruption, likewise.
static SCRATCH: Mutex<Option<PathBuf>> = Mutex::new(None);

fn unfinished() -> MutexGuard<'static, Option<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

fn scratch() -> MutexGuard<'static, Option<PathBuf>> {
    SCRATCH.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How often removing a folder is tried that others still fill.
const MOST_REMOVALS: usize = 8;

/// Installs the handler; without one (a second call, an exotic system) interruption ends the
/// process as the system does.
#[allow(clippy::exit, reason = "a signal handler has no caller to return to")]
pub(super) fn install() {
    fail_without_memory();
    fail_beyond_the_size_limit();
    let _ = ctrlc::set_handler(|| {
        if let Some(path) = unfinished().take() {
            let _ = std::fs::remove_file(path);
        }
        // Held to the end, so that work that fails for want of its folder waits here and says nothing.
        let scratch = scratch();
        if let Some(folder) = scratch.as_deref() {
            // A file that is made in it meanwhile is one that was not removed.
            let _ = (0..MOST_REMOVALS).find(|_| std::fs::remove_dir_all(folder).is_ok());
        }
        process::exit(INTERRUPTED);
    });
}

/// Makes the process end with code 1 where memory that it needs is refused.
///
/// The standard library then says how much was asked for and raises the abort signal, which would
/// look like a crash. Large needs are refused before ([`crate::num::memory`]); this is for the
/// small ones that follow. An unfinished output is left, and removed by a later run as after a kill.
fn fail_without_memory() {
    #[cfg(unix)]
    {
        let always = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
        let abort = signal_hook::consts::SIGABRT;
        // Where the system refuses the handler the exit code is its own.
        let _ = signal_hook::flag::register_conditional_shutdown(abort, 1, always);
    }
}

/// Makes a write beyond the limit of a file's size fail, in place of the process.
fn fail_beyond_the_size_limit() {
    #[cfg(unix)]
    {
        // Whether the signal has arrived is of no interest: the write says so.
        let flag = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, flag);
    }
}

/// Runs `create`, which makes a file and tells its path, with interruption held back until the
/// path is known.
pub(super) fn guard<T, E>(create: impl FnOnce() -> Result<(T, PathBuf), E>) -> Result<T, E> {
    let mut unfinished = unfinished();
    let (made, path) = create()?;
    *unfinished = Some(path);
    Ok(made)
}

/// Runs `create`, which makes the folder for passing files and tells its path, as [`guard`] does.
pub(super) fn guard_folder<T, E>(create: impl FnOnce() -> Result<(T, PathBuf), E>) -> Result<T, E> {
    let mut scratch = scratch();
    let (made, path) = create()?;
    *scratch = Some(path);
    Ok(made)
}

/// Runs `remove`, which removes the folder; an interruption waits for it.
pub(super) fn forget_folder(remove: impl FnOnce()) {
    let mut scratch = scratch();
    remove();
    *scratch = None;
}

/// The file is finished or gone: nothing is left to remove.
pub(super) fn forget() {
    *unfinished() = None;
}
