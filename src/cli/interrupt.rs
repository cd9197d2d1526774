//! Leaving nothing behind when the program is interrupted.
//!
//! On Ctrl-C, and on the termination and hang-up signals, the unfinished output and the folder for passing files
//! are removed and the process ends with code 130. The handler runs on a thread of its own. On Linux a signal that
//! is ignored when the process starts, as under `nohup`, stays ignored; elsewhere nothing tells us that
//! without unsafe code.

use std::path::PathBuf;
use std::process;
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

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

/// Installs the handlers, once; without them (an exotic system, no room for a thread) interruption ends
/// the process as the system does.
pub(super) fn install() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        fail_without_memory();
        fail_beyond_the_size_limit();
        #[cfg(unix)]
        let _ = signals::catch(end);
        #[cfg(not(unix))]
        let _ = ctrlc::set_handler(end);
    });
}

/// Removes what is unfinished and ends the process.
#[allow(clippy::exit, reason = "a signal handler has no caller to return to")]
fn end() {
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
}

/// Signals of Unix, each by itself.
#[cfg(unix)]
mod signals {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::low_level::pipe;
    use std::io::{self, Read};
    use std::os::unix::net::UnixStream;

    /// Calls `end` on a thread of its own when one of the signals that ask for the end arrives.
    pub(super) fn catch(end: impl FnOnce() + Send + 'static) -> io::Result<()> {
        let (mut arriving, sending) = UnixStream::pair()?;
        // The thread first: a signal that is caught without one would be lost.
        std::thread::Builder::new().name("interruption".to_owned()).spawn(move || {
            // It fails where every signal is ignored, for then nobody holds the other end.
            if arriving.read_exact(&mut [0]).is_ok() {
                end();
            }
        })?;
        let ignored = ignored();
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            if !holds(ignored, signal) {
                pipe::register(signal, sending.try_clone()?)?;
            }
        }
        Ok(())
    }

    /// The signals that are ignored, signal n by bit n - 1.
    fn ignored() -> u64 {
        if !cfg!(target_os = "linux") {
            return 0;
        }
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok()).unwrap_or_default()
    }

    /// Whether `signal` is in the set `signals`.
    fn holds(signals: u64, signal: i32) -> bool {
        signals >> (signal - 1) & 1 == 1
    }
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
