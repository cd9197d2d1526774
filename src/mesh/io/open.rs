//! Opening what a path names, whatever that is, without waiting or reading for ever.
//!
//! A named pipe is waited for as long as somebody writes to it; one that nobody writes to is given
//! up after [`PATIENCE`]. On systems other than Linux opening such a pipe waits for a writer.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
#[cfg(target_os = "linux")]
use std::time::Duration;

/// How long a pipe is waited for that nobody writes to.
#[cfg(target_os = "linux")]
pub const PATIENCE: Duration = Duration::from_millis(800);

/// A file that is open for reading.
#[derive(Debug)]
pub struct Opened {
    /// What was read to see whether there is anything.
    first: io::Cursor<Vec<u8>>,
    file: File,
    /// The number of its bytes, if it is a regular file.
    pub length: Option<u64>,
}

impl Read for Opened {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        match self.first.read(out)? {
            0 => self.file.read(out),
            count => Ok(count),
        }
    }
}

/// What is said of a file that is not there.
const MISSING: &str =
    "No such file; check its name and its folder (names count from the working directory)";

/// Opens the file at `path` for reading.
///
/// # Errors
/// The system's, also for folders, and [`io::ErrorKind::TimedOut`] for a pipe that nobody writes to.
/// That of a file which is not there says what to look at.
pub fn open(path: &Path) -> io::Result<Opened> {
    let data = std::fs::metadata(path).map_err(|error| {
        let is_missing = error.kind() == io::ErrorKind::NotFound;
        if is_missing { io::Error::new(io::ErrorKind::NotFound, MISSING) } else { error }
    })?;
    if data.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
    }
    #[cfg(target_os = "linux")]
    if std::os::unix::fs::FileTypeExt::is_fifo(&data.file_type()) {
        return open_pipe(path);
    }
    let length = data.is_file().then_some(data.len());
    Ok(Opened { first: io::Cursor::default(), file: File::open(path)?, length })
}

/// Opens a pipe, and waits for its writer.
#[cfg(target_os = "linux")]
fn open_pipe(path: &Path) -> io::Result<Opened> {
    use rustix::fs::{OFlags, fcntl_setfl};
    use std::os::unix::fs::OpenOptionsExt;
    /// How often a pipe is looked at.
    const PAUSE: Duration = Duration::from_millis(5);
    let flags = i32::try_from(OFlags::NONBLOCK.bits()).map_err(io::Error::other)?;
    let mut file = File::options().read(true).custom_flags(flags).open(path)?;
    let (begin, mut first) = (std::time::Instant::now(), vec![0; 1 << 16]);
    let count = loop {
        match file.read(&mut first) {
            // Nobody has the other end open.
            Ok(0) if begin.elapsed() < PATIENCE => std::thread::sleep(PAUSE),
            Ok(0) => {
                let cause = "it is a pipe that nobody writes to";
                return Err(io::Error::new(io::ErrorKind::TimedOut, cause));
            }
            Ok(count) => break count,
            // Somebody has, and has not written yet.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => break 0,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    };
    first.truncate(count);
    fcntl_setfl(&file, OFlags::empty())?;
    Ok(Opened { first: io::Cursor::new(first), file, length: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn content(path: &Path) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        open(path)?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    #[test]
    fn regular_files_have_a_length_and_folders_are_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), b"text").unwrap();
        assert_eq!(open(file.path()).unwrap().length, Some(4));
        assert_eq!(content(file.path()).unwrap(), b"text");
        let folder = tempfile::tempdir().unwrap();
        assert!(open(folder.path()).unwrap_err().to_string().contains("folder"));
        let missing = open(&folder.path().join("missing")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_pipe_is_read_to_the_end_of_its_writer_and_given_up_without_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert_eq!(open(&path).unwrap_err().kind(), io::ErrorKind::TimedOut);
        let writer = path.clone();
        let writer = std::thread::spawn(move || {
            use std::io::Write;
            let mut file = File::options().write(true).open(writer).unwrap();
            for piece in 0..20_u8 {
                file.write_all(&[piece; 10_000]).unwrap();
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        let bytes = content(&path).unwrap();
        writer.join().unwrap();
        let expected: Vec<u8> = (0..20_u8).flat_map(|piece| [piece; 10_000]).collect();
        assert!(bytes == expected, "{} bytes", bytes.len());
    }
}
