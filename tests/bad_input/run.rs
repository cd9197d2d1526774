//! Runs a command on bad input, within limits of time and memory, and looks at what it leaves.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

pub const CESOGEN: &str = env!("CARGO_BIN_EXE_cesogen");
pub const ALVEOLE: &str = env!("CARGO_BIN_EXE_alveole");

/// What a run did.
pub struct Outcome {
    pub code: Option<i32>,
    pub said: String,
    pub printed: String,
}

/// Runs `binary` in `folder` with `input`. It may take twenty seconds of processor time and two gigabytes
/// of addresses: a run that wants more is killed, or ends with another message than the right one.
pub fn run(binary: &str, folder: &Path, arguments: &[&str], input: &[u8]) -> Outcome {
    let mut command = if cfg!(unix) {
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -t 20 && ulimit -v 2000000 && exec \"$0\" \"$@\"", binary]);
        command
    } else {
        Command::new(binary)
    };
    let mut child = command
        .args(arguments)
        .current_dir(folder)
        .env_remove("RUST_BACKTRACE")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // The run may end without reading all of it.
    let feeder = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Outcome {
        code: output.status.code(),
        said: text(&output.stderr),
        printed: text(&output.stdout),
    }
}

/// The names in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Runs cesogen in `folder` and holds it to its promises about bad input: the exit code, one message
/// that begins with the name of the program and has all of `words`, nothing left behind.
#[track_caller]
pub fn refused_in(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let before = names(folder);
    let shown: Vec<String> = arguments.iter().map(|a| a.chars().take(60).collect()).collect();
    let Outcome { code: found, said, printed } = run(CESOGEN, folder, arguments, b"");
    assert_eq!(found, Some(code), "{shown:?}: {said}");
    assert_eq!(printed, "", "{shown:?}");
    assert!(said.starts_with("cesogen: ") || said.starts_with("error: "), "{shown:?}: {said}");
    for sign in ["panicked", "memory allocation", "overflowed", "RUST_BACKTRACE"] {
        assert!(!said.contains(sign), "{shown:?}: {said}");
    }
    assert!(said.len() < 8000, "{shown:?}: {} bytes", said.len());
    for word in words {
        assert!(said.contains(word), "{shown:?}: `{word}` is not in: {said}");
    }
    assert_eq!(names(folder), before, "{shown:?} left something");
}

/// As [`refused_in`], in a folder with these files.
#[track_caller]
pub fn refused(files: &[(&str, &[u8])], arguments: &[&str], code: i32, words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(folder.path().join(name), content).unwrap();
    }
    refused_in(folder.path(), arguments, code, words);
}
