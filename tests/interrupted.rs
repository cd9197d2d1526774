//! Interrupted runs: whatever the moment and the signal, the output is the old one or the new one, whole,
//! and nothing else stays but what a later run clears away.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests may, and tell what they saw")]

use alveole::num::Random;
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

const CESOGEN: &str = env!("CARGO_BIN_EXE_cesogen");
const OLD: &[u8] = b"what was there before";
const SIGNALS: [(&str, i32); 3] = [("INT", 2), ("TERM", 15), ("KILL", 9)];

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(CESOGEN)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Whether this process was started to ignore a signal, as `nohup` does and scripts that run it in the
/// background; then so are its children.
fn is_ignored(signal: &str) -> bool {
    let bit = match signal {
        "HUP" => 0,
        "INT" => 1,
        _ => return false,
    };
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() >> bit & 1 == 1)
}

/// Sends a signal, or TERM in place of one that runs were started to ignore.
fn send(child: &Child, signal: &str) {
    send_itself(child, if is_ignored(signal) { "TERM" } else { signal });
}

fn send_itself(child: &Child, signal: &str) {
    // A run that has ended meanwhile takes no signal.
    let mut kill = Command::new("kill");
    kill.args(["-s", signal, &child.id().to_string()]).stderr(Stdio::null());
    let _ = kill.status().unwrap();
}

/// The names in a folder but for `known`, sorted.
fn others(folder: &Path, known: &str) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut others: Vec<PathBuf> = paths.filter(|path| !path.ends_with(known)).collect();
    others.sort();
    others
}

fn is_unfinished(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(".alveole-part"))
}

/// Waits until the run has begun to write its output.
fn wait_for_part(folder: &Path, known: &[PathBuf], child: &mut Child) -> PathBuf {
    loop {
        let parts = others(folder, "out.ply").into_iter();
        if let Some(part) = parts.filter(|p| is_unfinished(p)).find(|p| !known.contains(p)) {
            return part;
        }
        assert!(child.try_wait().unwrap().is_none(), "the run ended before it began to write");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// What became of rounds of interruption.
#[derive(Debug, Default)]
struct Tally {
    finished: usize,
    interrupted: usize,
    killed: usize,
    left: usize,
}

/// Interrupts as many runs as `rounds` says, at random moments.
fn interrupt(rounds: u64, spacing: &str, name: &str, tally: &mut Tally) {
    let job = ["-q", "-s", spacing, "-o", name, "gyroid", "shell", "0.4", "sphere"];
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join(name);
    let begin = Instant::now();
    assert!(start(folder.path(), &job).wait().unwrap().success());
    let (whole, duration) = (fs::read(&target).unwrap(), begin.elapsed());
    let random = Random::new(rounds, name.len() as u32 + u32::from(name.as_bytes()[4]));
    for round in 0..rounds {
        let [[a, b], [c, _]] = [random.uniform(2 * round), random.uniform(2 * round + 1)];
        let (signal, number) = SIGNALS[(3.0 * a) as usize];
        let moment = duration.mul_f64(1.3 * b);
        let says = format!("round {round} of {name}: {signal} after {moment:?}");
        let has_old = c < 0.5;
        if has_old {
            fs::write(&target, OLD).unwrap();
        } else {
            fs::remove_file(&target).unwrap();
        }
        let mut child = start(folder.path(), &job);
        std::thread::sleep(moment);
        send(&child, signal);
        let status = child.wait().unwrap();
        assert!(is_possible(status, number), "{says}: {status:?}");
        let found = fs::read(&target).ok();
        let is_new = found.as_ref() == Some(&whole);
        let is_as_before = found.as_deref() == has_old.then_some(OLD);
        assert!(is_new || is_as_before, "{says}: {:?} bytes", found.map(|bytes| bytes.len()));
        assert!(is_new || !status.success(), "{says}: {status:?} without the output");
        let left = others(folder.path(), name);
        if number != 9 {
            assert!(left.is_empty(), "{says} left {left:?}");
        }
        for part in &left {
            assert!(is_unfinished(part), "{says} left {part:?}");
            let file = File::options().write(true).open(part).unwrap();
            file.try_lock().unwrap_or_else(|error| panic!("{says}: {part:?} is locked: {error}"));
        }
        tally.left += left.len();
        match status.code() {
            Some(0) => tally.finished += 1,
            Some(_) => tally.interrupted += 1,
            None => tally.killed += 1,
        }
        if !left.is_empty() {
            assert!(
                start(folder.path(), &["-q", "-s", "1", "-o", name, "box"])
                    .wait()
                    .unwrap()
                    .success()
            );
            assert_eq!(others(folder.path(), name), Vec::<PathBuf>::new(), "{says}");
        }
        fs::write(&target, OLD).unwrap();
    }
}

/// Whether a run may end so that was sent the signal of that number.
fn is_possible(status: ExitStatus, number: i32) -> bool {
    match status.code() {
        Some(0) => true,
        Some(130) => number != 9,
        Some(_) => false,
        // Before the handler is there the signal itself ends the run.
        None => status.signal() == Some(number),
    }
}

#[test]
fn an_output_is_the_old_one_or_the_new_one_whenever_it_is_interrupted() {
    let mut tally = Tally::default();
    for name in ["out.ply", "out.stl"] {
        interrupt(6, "2/160", name, &mut tally);
    }
    // A mesh of 50 MiB in memory, which waits in a file.
    interrupt(6, "2/300", "out.stl", &mut tally);
    println!("{tally:?}");
}

#[test]
#[ignore = "a minute"]
fn two_hundred_interruptions_leave_the_old_output_or_the_new_one() {
    let mut tally = Tally::default();
    for name in ["out.ply", "out.stl", "out.3mf", "out.obj"] {
        interrupt(50, "2/160", name, &mut tally);
    }
    println!("{tally:?}");
    // Moments are drawn beyond the end of a run: each outcome must have been seen.
    let Tally { finished, interrupted, killed, left } = tally;
    assert!(finished > 0 && interrupted > 0 && killed > 0 && left > 0);
}

/// A run that takes minutes.
const LONG: [&str; 7] = ["-q", "-s", "2/3000", "-o", "out.ply", "gyroid", "box"];
/// A run that takes no time.
const SHORT: [&str; 6] = ["-q", "-s", "1", "-o", "out.ply", "box"];

#[test]
fn leftovers_of_a_killed_run_are_removed_and_those_of_a_live_one_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let mut live = start(folder.path(), &LONG);
    let living = wait_for_part(folder.path(), &[], &mut live);
    let mut dead = start(folder.path(), &LONG);
    let left = wait_for_part(folder.path(), std::slice::from_ref(&living), &mut dead);
    send(&dead, "KILL");
    assert_eq!(dead.wait().unwrap().signal(), Some(9));
    assert!(left.exists());
    assert!(start(folder.path(), &SHORT).wait().unwrap().success());
    assert_eq!(others(folder.path(), "out.ply"), std::slice::from_ref(&living));
    assert!(File::options().write(true).open(&living).unwrap().try_lock().is_err());
    let new = fs::read(folder.path().join("out.ply")).unwrap();
    send(&live, "INT");
    assert_eq!(live.wait().unwrap().code(), Some(130));
    assert_eq!(others(folder.path(), "out.ply"), Vec::<PathBuf>::new());
    assert_eq!(fs::read(folder.path().join("out.ply")).unwrap(), new);
}

#[test]
fn runs_into_one_output_at_a_time_leave_a_whole_one() {
    let folder = tempfile::tempdir().unwrap();
    let job = |spacing| ["-q", "-s", spacing, "-o", "out.ply", "gyroid", "box"];
    let spacings = ["0.04", "0.05", "0.06", "0.07"];
    let wholes: Vec<Vec<u8>> = spacings
        .iter()
        .map(|spacing| {
            assert!(start(folder.path(), &job(spacing)).wait().unwrap().success());
            fs::read(folder.path().join("out.ply")).unwrap()
        })
        .collect();
    for _ in 0..5 {
        let runs: Vec<Child> = spacings.iter().map(|s| start(folder.path(), &job(s))).collect();
        for mut run in runs {
            assert!(run.wait().unwrap().success());
        }
        let found = fs::read(folder.path().join("out.ply")).unwrap();
        assert!(wholes.contains(&found), "{} bytes", found.len());
        assert_eq!(others(folder.path(), "out.ply"), Vec::<PathBuf>::new());
    }
}

#[test]
fn what_the_output_is_it_stays() {
    let folder = tempfile::tempdir().unwrap();
    let to = |name: &str| {
        let job = ["-q", "-s", "0.1", "-o", name, "gyroid", "box"];
        assert!(start(folder.path(), &job).wait().unwrap().success(), "{name}");
    };
    to("plain.ply");
    let whole = fs::read(folder.path().join("plain.ply")).unwrap();
    to("/dev/null");
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());

    let link = folder.path().join("link.ply");
    symlink("target.ply", &link).unwrap();
    to("link.ply");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(fs::read(folder.path().join("target.ply")).unwrap() == whole);

    let pipe = folder.path().join("pipe.ply");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    to("pipe.ply");
    assert!(reader.join().unwrap() == whole);
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());

    let mut printing = Command::new(CESOGEN)
        .args(["-q", "-s", "0.1", "-o", "-", "gyroid", "box"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut printed = Vec::new();
    printing.stdout.take().unwrap().read_to_end(&mut printed).unwrap();
    assert!(printing.wait().unwrap().success() && printed == whole);
    assert_eq!(others(folder.path(), "none").len(), 4);
}

#[test]
fn an_interruption_behind_a_link_keeps_link_and_target() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = folder.path().join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    fs::write(elsewhere.join("real.ply"), OLD).unwrap();
    let link = folder.path().join("out.ply");
    symlink("elsewhere/real.ply", &link).unwrap();
    let mut run = start(folder.path(), &LONG);
    // It is written beside the target, not beside the link.
    while others(&elsewhere, "real.ply").is_empty() {
        assert!(run.try_wait().unwrap().is_none(), "the run ended before it began to write");
        std::thread::sleep(Duration::from_millis(2));
    }
    send(&run, "TERM");
    assert_eq!(run.wait().unwrap().code(), Some(130));
    assert_eq!(others(&elsewhere, "real.ply"), Vec::<PathBuf>::new());
    assert_eq!(fs::read(&link).unwrap(), OLD);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}

#[test]
fn an_interrupted_experiment_leaves_no_files_that_passed() {
    let (folder, temporary) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for (signal, milliseconds) in [("INT", 0), ("TERM", 30), ("HUP", 250)] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_alveole"))
            .args(["study", "roundtrip", "-q", "--times", "1000000", "-s", "0.1"])
            .args(["--plot", "errors.svg", "sphere"])
            .current_dir(folder.path())
            .env("TMPDIR", temporary.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        while others(temporary.path(), "nothing").is_empty() {
            assert!(child.try_wait().unwrap().is_none(), "the run ended before it began");
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_millis(milliseconds));
        send(&child, signal);
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), &*said), (Some(130), ""), "{signal}");
        for place in [temporary.path(), folder.path()] {
            let left = others(place, "nothing");
            assert!(left.is_empty(), "{signal} left {left:?}");
        }
    }
}

/// A run of `job` that a shell starts after `before`.
fn start_after(folder: &Path, before: &str, job: &[&str]) -> Command {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("{before}; exec \"$0\" \"$@\""), CESOGEN]).args(job);
    shell.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null());
    shell
}

#[cfg(target_os = "linux")]
#[test]
fn a_signal_that_is_ignored_at_the_start_stays_ignored() {
    let job = ["-q", "-s", "2/400", "-o", "out.ply", "gyroid", "shell", "0.4", "sphere"];
    for (ignored, other) in [("HUP", "TERM"), ("INT", "HUP"), ("TERM", "INT")] {
        let folder = tempfile::tempdir().unwrap();
        let start = || start_after(folder.path(), &format!("trap '' {ignored}"), &job);
        let mut child = start().spawn().unwrap();
        let part = wait_for_part(folder.path(), &[], &mut child);
        for _ in 0..3 {
            send_itself(&child, ignored);
        }
        assert!(child.wait().unwrap().success(), "{ignored}");
        assert!(!part.exists() && folder.path().join("out.ply").exists());
        if is_ignored(other) {
            continue;
        }
        let mut child = start().spawn().unwrap();
        let part = wait_for_part(folder.path(), &[], &mut child);
        send(&child, other);
        assert_eq!(child.wait().unwrap().code(), Some(130), "{other}");
        assert!(!part.exists());
    }
}

#[test]
fn a_file_beyond_the_size_limit_is_an_error_and_leaves_nothing() {
    for name in ["out.ply", "out.stl", "out.obj"] {
        let folder = tempfile::tempdir().unwrap();
        let job = ["-q", "-s", "0.01", "-o", name, "gyroid", "box"];
        let mut limited = start_after(folder.path(), "ulimit -f 100", &job);
        let output = limited.stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {:?} {said}", output.status);
        assert!(said.contains(name) && said.contains("File too large"), "{said}");
        assert_eq!(others(folder.path(), "none"), Vec::<PathBuf>::new());
    }
}
