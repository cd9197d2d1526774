//! What is no regular file, what may not be read or written, disks without room, readers that go, and
//! work that needs more memory than there is.
#![cfg(unix)]

use super::files;
use super::run::{ALVEOLE, CESOGEN, Outcome, names, refused, refused_in, run};
use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

const NAMES: [&str; 10] = [
    "a.ply",
    "a.stl",
    "a.obj",
    "a.off",
    "a.3mf",
    "a.vtu",
    "a.glb",
    "a.cell",
    "a.cell.json",
    "a.ltcx",
];

/// Refuses each kind of file that `make` makes at its name.
fn refused_at_every_name(make: impl Fn(&Path), words: &[&str]) {
    for name in NAMES {
        let folder = tempfile::tempdir().unwrap();
        make(&folder.path().join(name));
        let arguments = match name.rsplit('.').next() {
            Some("cell" | "json" | "ltcx") => vec!["-s", "1", name, "radius", "0.1", "box"],
            _ => vec!["-s", "1", name, "box"],
        };
        refused_in(folder.path(), &arguments, 1, &[&[name], words].concat());
    }
}

#[test]
fn folders_and_links_to_nothing_are_refused() {
    refused_at_every_name(|path| fs::create_dir(path).unwrap(), &["folder"]);
    refused_at_every_name(|path| symlink("nowhere", path).unwrap(), &["No such file"]);
    refused_at_every_name(|path| symlink(path, path).unwrap(), &["symbolic links"]);
}

#[test]
fn devices_that_never_end_are_refused_by_their_first_bytes() {
    refused_at_every_name(|path| symlink("/dev/zero", path).unwrap(), &[]);
    for device in ["/dev/zero", "/dev/urandom"] {
        refused(&[], &[&format!("@{device}")], 1, &[device]);
    }
}

#[test]
fn files_of_gigabytes_without_content_are_refused_by_their_first_bytes() {
    let sparse = |path: &Path| File::create(path).unwrap().set_len(12 << 30).unwrap();
    refused_at_every_name(sparse, &[]);
}

fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[cfg(target_os = "linux")]
#[test]
fn a_pipe_that_nobody_writes_to_is_given_up() {
    refused_at_every_name(make_pipe, &["it is a pipe that nobody writes to"]);
    let folder = tempfile::tempdir().unwrap();
    make_pipe(&folder.path().join("pipe"));
    refused_in(folder.path(), &["@pipe", "box"], 1, &["it is a pipe that nobody writes to"]);
}

#[test]
fn a_pipe_with_a_writer_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("a.ply");
    make_pipe(&pipe);
    fs::write(folder.path().join("mesh"), files::sound("ply")).unwrap();
    let mut writer = Command::new("sh")
        .args(["-c", "cat mesh > a.ply"])
        .current_dir(folder.path())
        .spawn()
        .unwrap();
    let outcome = run(CESOGEN, folder.path(), &["-s", "0.1", "-o", "out.ply", "a.ply"], b"");
    // A writer without a reader would wait for ever.
    let _ = writer.kill();
    writer.wait().unwrap();
    assert_eq!(outcome.code, Some(0), "{}", outcome.said);
}

#[test]
fn what_may_not_be_read_or_written_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let forbid = |name: &str, mode| {
        let permissions = fs::Permissions::from_mode(mode);
        fs::set_permissions(folder.path().join(name), permissions).unwrap();
    };
    fs::write(folder.path().join("a.off"), files::sound("off")).unwrap();
    fs::write(folder.path().join("program"), "box").unwrap();
    fs::create_dir(folder.path().join("closed")).unwrap();
    forbid("a.off", 0);
    forbid("program", 0);
    forbid("closed", 0o500);
    if fs::read(folder.path().join("a.off")).is_ok() {
        println!("skipped: this user may read everything");
    } else {
        refused_in(folder.path(), &["a.off", "box"], 1, &["a.off", "ermission"]);
        refused_in(folder.path(), &["@program", "box"], 1, &["program", "ermission"]);
        refused_in(folder.path(), &["-o", "closed/a.ply", "box"], 1, &["closed", "ermission"]);
    }
    forbid("closed", 0o700);
    // Nobody may make files here, whoever it is.
    refused(&[], &["-o", "/proc/a.ply", "box"], 1, &["cannot write `/proc/a.ply`"]);
}

#[test]
fn outputs_that_are_no_files_are_refused() {
    refused(&[], &["-o", ".", "box"], 2, &["extension"]);
    refused(&[], &["-o", "", "box"], 2, &["--output"]);
    refused(&[], &["-o", "a.xyz", "box"], 2, &["extension"]);
    refused(&[], &["-o", "no/a.ply", "box"], 1, &["no/a.ply"]);
    refused(&[("f", b"")], &["-o", "f/a.ply", "box"], 1, &["f/a.ply"]);
    refused(&[], &["-o", &format!("{}.ply", "n".repeat(300)), "box"], 1, &["too long"]);
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("a.ply")).unwrap();
    refused_in(folder.path(), &["-o", "a.ply", "box"], 1, &["it is a folder"]);
    symlink("b.ply", folder.path().join("b.ply")).unwrap();
    refused_in(folder.path(), &["-o", "b.ply", "box"], 1, &["symbolic links"]);
    for format in files::TEXTS {
        let target = folder.path().join(format!("full.{format}"));
        symlink("/dev/full", &target).unwrap();
        let name = format!("full.{format}");
        refused_in(folder.path(), &["-s", "0.1", "-o", &name, "box"], 1, &["o space left"]);
    }
}

#[test]
fn a_disk_without_room_is_an_error_and_leaves_nothing() {
    // A limit of the size of files stands in for a small disk, where none can be made.
    let folder = tempfile::tempdir().unwrap();
    // The finer mesh does not stay in memory until it is written.
    for (format, spacing) in files::TEXTS.into_iter().flat_map(|f| [(f, "0.02"), (f, "2/300")]) {
        let script = "trap '' XFSZ; ulimit -f 100; exec \"$0\" -q -s $2 -o \"$1\" gyroid box";
        let name = format!("a.{format}");
        let output = Command::new("sh")
            .args(["-c", script, CESOGEN, &name, spacing])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(&format!("cannot write `{name}`: File too large")), "{said}");
        assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_on_standard_output_is_an_error_of_whatever_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.ply"), files::sound("ply")).unwrap();
    fs::write(folder.path().join("a.svg"), "").unwrap();
    let trips = ["study", "roundtrip", "-q", "--times", "1", "-s", "0.5", "sphere"];
    for arguments in [
        &["measure", "-q", "-s", "1", "box"][..],
        &["measure", "-q", "-s", "1", "--json", "box"],
        &["measure", "-q", "-s", "1", "--structure", "box"],
        &["list"],
        &["list", "--json"],
        &["list", "box"],
        &["check", "a.ply"],
        &["convert", "-q", "box"],
        &["slice", "-q", "-s", "1", "--at", "0", "-o", "a.svg", "--json", "box"],
        &trips,
        &["study", "hierarchy", "-q", "-s", "0.5", "box", "sphere"],
        &["completions", "bash"],
        &["serve"],
        &["--help"],
        &["help", "measure"],
        &["--version"],
    ] {
        let mut child = Command::new(ALVEOLE)
            .args(arguments)
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(File::options().write(true).open("/dev/full").unwrap())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let request = b"{\"program\": \"box\", \"spacing\": 1}\n";
        // A command that reads nothing may have ended.
        let _ = child.stdin.take().unwrap().write_all(request);
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(
            said.starts_with("alveole") && said.contains("cannot write standard output: No space"),
            "{arguments:?}: {said}"
        );
        assert_eq!(said.lines().count(), 1, "{arguments:?}: {said}");
        assert_eq!(names(folder.path()), ["a.ply", "a.svg"], "{arguments:?}");
    }
}

#[test]
fn a_reader_that_goes_ends_the_work_with_1_and_a_listing_with_0() {
    let folder = tempfile::tempdir().unwrap();
    for (binary, arguments, code) in [
        (CESOGEN, &["-q", "-s", "0.02", "-o", "-", "gyroid", "box"][..], 1),
        (ALVEOLE, &["list"], 0),
        (ALVEOLE, &["list", "--json"], 0),
        (ALVEOLE, &["--help"], 0),
        (ALVEOLE, &["measure", "-q", "-s", "0.5", "box"], 0),
    ] {
        let mut child = Command::new(binary)
            .args(arguments)
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert_eq!(said.contains("cannot write `-`: Broken pipe"), code == 1, "{said}");
        assert!(names(folder.path()).is_empty());
    }
}

/// Runs with so many mebibytes of addresses.
fn limited(mebibytes: u32, arguments: &[&str]) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let script = format!("ulimit -v {} && exec \"$0\" \"$@\"", mebibytes * 1024);
    let output = Command::new("sh")
        .args(["-c", &script, CESOGEN])
        .args(arguments)
        .current_dir(folder.path())
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Outcome {
        code: output.status.code(),
        said: text(&output.stderr),
        printed: text(&output.stdout),
    }
}

#[cfg(target_os = "linux")]
#[test]
fn work_beyond_memory_is_refused_before_it_is_done_with_the_numbers() {
    let grid = ["-q", "-s", "2/2000", "sin(9999*x)*cos(9998*y)+sin(9997*z)", "box"];
    let outcome = limited(400, &grid);
    assert_eq!(outcome.code, Some(1), "{}", outcome.said);
    for word in ["this needs about", "GiB of memory, and", "MiB are available", "larger spacing"] {
        assert!(outcome.said.contains(word), "{}", outcome.said);
    }
    // Slivers are removed from the whole mesh.
    let mesh = ["-q", "-s", "2/400", "--snap", "-o", "a.stl", "gyroid", "box"];
    let outcome = limited(250, &mesh);
    assert_eq!(outcome.code, Some(1), "{}", outcome.said);
    assert!(outcome.said.contains("this needs about 93.3 MiB of memory"), "{}", outcome.said);
    assert!(outcome.said.contains("larger spacing"), "{}", outcome.said);
}

#[cfg(target_os = "linux")]
#[test]
fn large_meshes_are_written_in_every_format_in_little_memory() {
    // The mesh takes 93 MiB, which so many addresses have no room for beside the program's threads.
    for format in files::TEXTS {
        let name = format!("a.{format}");
        let outcome = limited(250, &["-q", "-s", "2/400", "-o", &name, "gyroid", "box"]);
        assert_eq!((outcome.code, outcome.said.as_str()), (Some(0), ""), "{format}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_takes_a_large_mesh_in_little_memory() {
    let folder = tempfile::tempdir().unwrap();
    let run = |script: &str, temporary: &str| {
        let script = format!("ulimit -v 256000 && exec \"$0\" -q -s 2/400 {script} gyroid box");
        let output = Command::new("sh")
            .args(["-c", &script, CESOGEN])
            .current_dir(folder.path())
            .env("TMPDIR", folder.path().join(temporary))
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let done = (Some(0), String::new());
    assert_eq!(run("-o a.ply", ""), done);
    assert_eq!(run("-o - > b.ply", ""), done);
    assert_eq!(names(folder.path()), ["a.ply", "b.ply"]);
    let file = |name| fs::read(folder.path().join(name)).unwrap();
    assert!(file("a.ply") == file("b.ply"));
    let (code, said) = run("-o - > b.ply", "missing");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot write `-`: the mesh needs a file in `"), "{said}");
    assert!(said.contains("/missing` meanwhile: No such file"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn whatever_the_limit_of_memory_the_work_is_done_or_ends_with_1_and_a_message() {
    for mebibytes in (20..400).step_by(20) {
        for arguments in [
            &["-q", "-s", "2/100", "-o", "a.ply", "gyroid", "box"][..],
            &["-q", "-s", "2/100", "-o", "a.3mf", "gyroid", "box"],
            &["-q", "-s", "2/50", "-o", "a.ply", "kelvin", "radius", "0.1", "box"],
        ] {
            let outcome = limited(mebibytes, arguments);
            let is_done = outcome.code == Some(0) && outcome.said.is_empty();
            let is_refused = outcome.code == Some(1) && outcome.said.contains("memory");
            assert!(is_done || is_refused, "{mebibytes} MiB: {:?} {}", outcome.code, outcome.said);
        }
    }
}
