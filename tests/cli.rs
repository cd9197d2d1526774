//! The two binaries, run as a user runs them.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests may, and say what they skip")]

mod common;

use alveole::mesh::check::check;
use alveole::mesh::io::read;
use alveole::mesh::measure::volume;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const CESOGEN: &str = env!("CARGO_BIN_EXE_cesogen");
const ALVEOLE: &str = env!("CARGO_BIN_EXE_alveole");

fn run(binary: &str, folder: &Path, arguments: &[&str]) -> Output {
    Command::new(binary).args(arguments).current_dir(folder).output().unwrap()
}

fn cesogen(folder: &Path, arguments: &[&str]) -> Output {
    run(CESOGEN, folder, arguments)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Runs cesogen, and returns the volume of the sound mesh that it wrote.
fn volume_of(arguments: &[&str]) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    let written = names(folder.path());
    assert_eq!(written.len(), 1, "{written:?}");
    let mesh = read(&folder.path().join(&written[0])).unwrap();
    let report = check(&mesh);
    assert!(report.is_sound(), "{arguments:?}: {:?}", report.defects);
    volume(&mesh)
}

#[track_caller]
fn close(found: f64, expected: f64, relative: f64) {
    assert!(
        (found / expected - 1.0).abs() <= relative,
        "{found} is not {expected} within {relative}"
    );
}

#[test]
fn command_lines_of_the_paper_give_their_solids() {
    let sphere = 4.0 / 3.0 * std::f64::consts::PI;
    close(volume_of(&["sphere"]), sphere, 2e-3);
    close(volume_of(&["sphere", "scale", "2,2,2"]), 8.0 * sphere, 2e-3);
    close(volume_of(&["cylinder", "box"]), 2.0 * std::f64::consts::PI, 2e-3);
    // Volumes of the gyroid: flatcut of f <= 0.35 fills 0.61291 of the box, the shell 0.22584.
    close(volume_of(&["-s", "2/60", "gyroid", "dilate", "0.35", "box"]), 4.9033, 3.5e-3);
    close(
        volume_of(&["-s", "2/60", "gyroid", "complement", "erode", "0.35", "box"]),
        8.0 - 4.9033,
        5e-3,
    );
    close(
        volume_of(&["-s", "2/60", "gyroid", "dilate", "0", "shell", "2*abs(0.35)", "box"]),
        1.8067,
        6e-3,
    );
    close(volume_of(&["-s", "2/60", "box", "gyroid", "shell", "2*0.35"]), 1.8067, 6e-3);
    close(volume_of(&["-s", "2/50", "x+y+z-1", "box"]), 8.0 - 8.0 / 6.0, 1e-3);
}

#[test]
fn every_format_holds_the_same_solid() {
    for extension in ["ply", "stl", "obj", "off", "PLY"] {
        let name = format!("solid.{extension}");
        close(volume_of(&["-s", "0.1", "-o", &name, "box"]), 8.0, 1e-12);
    }
    close(volume_of(&["-s", "0.1", "--precision", "double", "sphere"]), 4.18879, 1e-2);
}

#[test]
fn single_precision_is_refused_where_triangles_would_lose_their_area() {
    let far = ["sphere", "translate", "1e6,0,0"];
    let single = |name| [&["--precision", "single", "-s", "0.1", "-o", name], &far[..]].concat();
    for name in ["o.ply", "o.obj", "o.off", "o.3mf", "-"] {
        fails(&single(name), 1, &["single precision", "this mesh needs", "leave `precision` out"]);
    }
    fails(&single("o.stl"), 1, &["STL holds single precision only", "write PLY"]);
    volume_of(&[&["-s", "0.1"], &far[..]].concat());
    volume_of(&["--precision", "single", "-s", "0.1", "sphere"]);
}

#[test]
fn standard_output_takes_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), &["-s", "0.5", "-o", "-", "box"]);
    assert!(output.status.success());
    assert!(output.stdout.starts_with(b"ply\n"));
    assert!(names(folder.path()).is_empty());
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, threads: &str| {
        let arguments =
            ["-s", "2/70", "--threads", threads, "-o", name, "gyroid", "shell", "0.4", "sphere"];
        assert!(cesogen(folder.path(), &arguments).status.success());
        fs::read(folder.path().join(name)).unwrap()
    };
    let one = write("1.ply", "1");
    assert!(one == write("2.ply", "2") && one == write("5.ply", "5"));
}

#[test]
fn options_end_at_the_first_operand() {
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), &["-s0.2", "box", "-sin(x)"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let output = cesogen(folder.path(), &["-s", "0.2", "--", "-x", "box"]);
    assert!(output.status.success(), "{}", stderr(&output));
}

#[test]
fn a_file_may_hold_options_and_words() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("options.txt", "-s 2/10 -o small.off\n@more.txt gyroid");
    write("more.txt", "--quiet # and a comment\n");
    let output = cesogen(folder.path(), &["@options.txt", "box"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    assert!(folder.path().join("small.off").exists());
    write("self.txt", "-q @self.txt box");
    let output = cesogen(folder.path(), &["@self.txt"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("self.txt"), "{}", stderr(&output));
}

#[test]
fn an_option_that_is_given_twice_counts_as_given_last() {
    let folder = tempfile::tempdir().unwrap();
    let written = |arguments: &[&str]| {
        for binary in [CESOGEN, ALVEOLE] {
            let command = if binary == ALVEOLE { &["mesh"][..] } else { &[] };
            let output = run(binary, folder.path(), &[command, arguments].concat());
            assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
            assert_eq!(stderr(&output), "");
            for name in names(folder.path()).iter().filter(|name| *name != "options") {
                let mesh = folder.path().join(name);
                assert_eq!(name, "-last.off", "{arguments:?}");
                assert_eq!(read(&mesh).unwrap().positions.len(), 26, "{arguments:?}");
                fs::remove_file(mesh).unwrap();
            }
        }
    };
    let last = ["-s", "1", "-o", "-last.off"];
    let first = ["-q", "-s", "0.5", "-o", "a.ply", "--threads", "1", "--precision", "single"];
    written(&[&first[..], &last, &["box"]].concat());
    let again = ["--quiet", "--threads", "2", "--precision=double", "--snap", "--snap", "-s1"];
    written(&[&first[..], &again, &["--output=-last.off", "box"]].concat());
    written(&[
        "-q",
        "--bounds",
        "0,0,0,9,9,9",
        "--bounds",
        "-1,-1,-1,1,1,1",
        "-s",
        "1",
        "-o-last.off",
        "x-9",
    ]);
    fs::write(folder.path().join("options"), "-q -s 0.5 -o a.ply").unwrap();
    written(&[&["@options"], &last[..], &["box"]].concat());
    fs::write(folder.path().join("options"), "-q -s 1 -o -last.off").unwrap();
    written(&["-s", "0.1", "-o", "b.ply", "@options", "box"]);
    fails(&["--param", "t=1", "--param", "t=2", "box"], 2, &["`t`", "twice"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_of_options_or_words_may_be_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let piped = |text: &str, arguments: &[&str]| {
        let mut child = Command::new(CESOGEN)
            .args(arguments)
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{text}: {}", stderr(&output));
        let mesh = folder.path().join("o.off");
        let found = volume(&read(&mesh).unwrap());
        fs::remove_file(mesh).unwrap();
        found
    };
    close(piped("box", &["-q", "-s", "0.2", "-o", "o.off", "@/dev/stdin"]), 8.0, 1e-12);
    close(piped("-q -s 0.2 -o o.off box", &["@/dev/stdin"]), 8.0, 1e-12);
    close(piped("-q -s 0.2 -o o.off", &["@/dev/stdin", "box"]), 8.0, 1e-12);
    close(piped("box", &["-q", "-s", "0.2", "-o", "o.off", "box", "@/dev/stdin"]), 8.0, 1e-12);
    let configuration = "files:\n  internalGeometry: cuboid 2\nlt_type: gyroid\nlt_size: 1\n\
                         lt_feature: isovalue\nlt_feature_val: 0.1\n";
    fs::write(folder.path().join("config.yml"), configuration).unwrap();
    let common = ["-q", "-s", "0.1", "-o", "o.off"];
    let expected = piped("", &[&common[..], &["config.yml"]].concat());
    close(piped("config.yml", &[&common[..], &["@/dev/stdin"]].concat()), expected, 1e-12);
}

#[track_caller]
fn fails(arguments: &[&str], code: i32, words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), arguments);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{arguments:?}: `{word}` is not in: {message}");
    }
    assert!(names(folder.path()).is_empty(), "{arguments:?} left {:?}", names(folder.path()));
}

#[test]
fn wrong_command_lines_are_explained_and_exit_with_2() {
    fails(&["gyrod", "box"], 2, &["gyrod", "gyroid", "argument 1"]);
    fails(&["box", "union"], 2, &["union"]);
    fails(&["box", "dilate"], 2, &["dilate"]);
    fails(&["2", "box"], 2, &["2"]);
    fails(&["-s", "0", "box"], 2, &["-s", "positive"]);
    fails(&["-s", "-0.1", "box"], 2, &["-s -0.1", "positive"]);
    // As getopt has it, what follows an option that takes a value is that value.
    fails(&["-s", "-o", "out.ply", "box"], 2, &["`-s`", "`o`"]);
    fails(&["-s", "--", "box"], 2, &["`-s`"]);
    fails(&["-o"], 2, &["a value is required", "--output"]);
    fails(&["-o", "-q", "box"], 2, &["`-q`", "no mesh format"]);
    fails(&["--precision", "-q", "box"], 2, &["-q", "--precision", "single, double"]);
    fails(&["--threads", "-2", "box"], 2, &["-2", "--threads"]);
    fails(&["-o", "a.stl", "--precision", "double", "box"], 2, &["--precision double", "STL"]);
    fails(&["x=1", "box"], 2, &["`=` has no meaning", "write `a-b`"]);
    fails(&["box", "scale", "1e150"], 2, &["scale the model", "1e70"]);
    fails(&["box", "scale", "1e-110"], 2, &["scale the model", "1e-70"]);
    fails(&["-s", "1,2", "box"], 2, &["-s"]);
    fails(&["-s", "2/", "box"], 2, &["2/"]);
    fails(&["-o", "out.xyz", "box"], 2, &[".ply", "out.xyz"]);
    fails(&["--bounds", "0,0,0,1,1", "gyroid"], 2, &["--bounds"]);
    fails(&["--bounds", "0,0,0,1,0,1", "gyroid"], 2, &["--bounds", "Y"]);
    fails(&["--colour", "box"], 2, &["--colour"]);
    fails(&[], 2, &["PROGRAM"]);
    fails(&["rotate", "1", "0,0,0", "box"], 2, &["rotate"]);
    fails(&["box", "rotate", "1", "0,0,0"], 2, &["zero"]);
    let deep = format!("{}x{}", "(".repeat(60_000), ")".repeat(60_000));
    fails(&[&deep, "box"], 2, &["deep"]);
}

#[test]
fn parameters_take_the_place_of_numbers() {
    close(
        volume_of(&["--param", "r=2", "sphere", "scale", "r"]),
        32.0 / 3.0 * std::f64::consts::PI,
        2e-3,
    );
    let defined =
        ["-s", "h/60", "--param", "h=2", "--param", "t=0.7*h/4", "--bounds", "-h/2,-1,-1,1,1,h-1"];
    close(volume_of(&[&defined[..], &["gyroid", "dilate", "t"]].concat()), 4.9033, 3.5e-3);
    close(volume_of(&["--param", "a=1", "-s", "0.04", "x+y+z-a", "box"]), 8.0 - 8.0 / 6.0, 1e-3);
}

#[test]
fn files_of_programs_and_of_options_may_use_parameters() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("program"), "gyroid # with a level\n dilate t box\n").unwrap();
    fs::write(folder.path().join("options"), "--param t=0.35\n-s 0.1 @program\n").unwrap();
    let bytes = |arguments: &[&str]| {
        let output = run(ALVEOLE, folder.path(), arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(stderr(&output), "");
        output.stdout
    };
    let plain = bytes(&["mesh", "-o", "-", "-s", "0.1", "gyroid", "dilate", "0.35", "box"]);
    assert!(bytes(&["mesh", "-o", "-", "-s", "0.1", "--param", "t=0.35", "@program"]) == plain);
    assert!(bytes(&["mesh", "-o", "-", "@options"]) == plain);
}

#[test]
fn wrong_parameters_are_explained_and_exit_with_2() {
    let refused = |parameter: &str, program: &[&str], words: &[&str]| {
        fails(&[&["--param", parameter], program].concat(), 2, words);
    };
    refused("t", &["box"], &["`t`", "no value", "t=0.3"]);
    refused("2t=1", &["box"], &["`2t`", "name"]);
    refused("x=1", &["box"], &["`x`", "coordinate"]);
    refused("pi=3", &["box"], &["`pi`", "constant"]);
    refused("sin=1", &["box"], &["`sin`", "function"]);
    refused("Gyroid=1", &["box"], &["`gyroid`", "word"]);
    refused("minor=1", &["box"], &["`minor`", "argument"]);
    refused("t=1,2", &["box"], &["one number"]);
    refused("t=1/0", &["box"], &["finite"]);
    refused("t=x", &["box"], &["`t`", "can't depend on `x`"]);
    refused("t=u", &["box"], &["unknown name `u`", "--param u="]);
    refused("s=0", &["box", "scale", "s"], &["must not be zero", "`s` is 0", "argument 3"]);
    refused(
        "breadth=1",
        &["box", "scale", "bredth"],
        &["did you mean `breadth`", "--param bredth="],
    );
    fails(&["--param", "t=1", "--param", "t=2", "box"], 2, &["`t`", "twice"]);
    fails(&["gyroid", "dilate", "t", "box"], 2, &["unknown name `t`", "--param t="]);
}

#[test]
fn what_is_not_a_number_is_outside_in_every_combination() {
    let measured = |program: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let arguments = [&["measure", "-q", "--json", "-s", "0.02"], program].concat();
        let output = run(ALVEOLE, folder.path(), &arguments);
        assert!(output.status.success(), "{program:?}: {}", stderr(&output));
        let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
        found["volume"].as_f64().unwrap()
    };
    // {0 <= x < 1/4} of the box: 1. The border to where it is not a number lies somewhere in a cell.
    let cell = 4.0 * 0.02;
    for order in [["sqrt(x)-1/2", "box"], ["box", "sqrt(x)-1/2"]] {
        let volume = measured(&order);
        assert!((1.0 - 1e-9..1.0 + cell + 1e-9).contains(&volume), "{order:?}: {volume}");
    }
    let rest = measured(&["box", "sqrt(x)-1/2", "difference"]);
    assert!((7.0 - cell - 1e-9..7.0 + 1e-9).contains(&rest), "{rest}");
    let rest = measured(&["box", "sqrt(x)-1/2", "complement"]);
    assert!((7.0 - cell - 1e-9..7.0 + 1e-9).contains(&rest), "{rest}");
    for order in [["sqrt(x)-1/2", "sphere"], ["sphere", "sqrt(x)-1/2"]] {
        let joined = measured(&["--bounds", "-1,-1,-1,1,1,1", order[0], order[1], "union"]);
        assert!(joined > 4.18 && joined < 5.2, "{order:?}: {joined}");
    }
}

#[test]
fn an_unused_parameter_is_worth_a_warning() {
    let warned = |arguments: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let output = cesogen(folder.path(), &[arguments, &["box"]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let said = stderr(&output);
        said.lines().filter(|line| line.contains("warning")).collect::<Vec<_>>().join("\n")
    };
    assert!(warned(&["-s", "1", "--param", "a=1"]).contains("warning: the parameter `a`"));
    assert_eq!(warned(&["-q", "-s", "1", "--param", "a=1"]), "");
    assert_eq!(warned(&["-s", "a", "--param", "a=1"]), "");
    assert_eq!(warned(&["-s", "b", "--param", "a=1", "--param", "b=a"]), "");
}

#[test]
fn work_that_fails_is_explained_and_exits_with_1() {
    fails(&["gyroid"], 1, &["unbounded", "gyroid", "box"]);
    fails(&["box", "box", "translate", "5,0,0"], 1, &["empty"]);
    fails(&["box", "translate", "1e17,0,0"], 1, &["empty", "rounding"]);
    fails(&["sign(x)", "density", "0.3", "box"], 1, &["density 0.3", "jump past the share"]);
    fails(&["-s", "0.1", "x-10", "complement", "box"], 1, &["empty"]);
    fails(&["missing.stl", "box"], 1, &["missing.stl`: No such file; check its name"]);
    let missing = ["no/such/folder/out.ply", "no folder `no/such/folder`; make it"];
    fails(&["-o", "no/such/folder/out.ply", "box"], 1, &missing);
}

#[test]
fn a_damaged_mesh_file_is_named_with_the_place_of_the_damage() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bad.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 zero\n3 0 1 2\n")
        .unwrap();
    let output = cesogen(folder.path(), &["bad.off", "box"]);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("bad.off") && message.contains('5'), "{message}");
    assert_eq!(names(folder.path()), ["bad.off"]);
}

#[test]
fn the_default_spacing_is_said_and_quiet_is_quiet() {
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), &["box"]);
    assert!(stderr(&output).contains("0.02"), "{}", stderr(&output));
    let output = cesogen(folder.path(), &["--quiet", "box"]);
    assert_eq!(stderr(&output), "");
}

#[test]
fn a_failed_run_keeps_the_old_output() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("out.ply");
    fs::write(&target, "old").unwrap();
    assert!(!cesogen(folder.path(), &["gyroid"]).status.success());
    assert_eq!(fs::read_to_string(&target).unwrap(), "old");
    assert_eq!(names(folder.path()), ["out.ply"]);
}

#[cfg(unix)]
#[test]
fn a_full_device_is_an_error() {
    if !Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), &["-o", "/dev/full", "box"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("/dev/full"), "{}", stderr(&output));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(CESOGEN)
        .args(["-s", "2/6000", "--quiet", "gyroid", "box"])
        .current_dir(folder.path())
        .spawn()
        .unwrap();
    while names(folder.path()).is_empty() {
        assert!(child.try_wait().unwrap().is_none(), "the run ended before it began to write");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(
        Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success()
    );
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
}

#[test]
fn statistics_are_json() {
    let folder = tempfile::tempdir().unwrap();
    let output = cesogen(folder.path(), &["--stats", "s.json", "-s", "0.1", "gyroid", "box"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(value["triangles"].as_u64().unwrap() > 100);
    assert!(value["total_seconds"].as_f64().unwrap() > 0.0);
}

#[cfg(target_os = "linux")]
#[test]
fn a_pipe_may_have_the_name_of_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let [named, plain] = ["/dev/stdout", "-"].map(|output| {
        let made = cesogen(folder.path(), &["-q", "-s", "0.5", "-o", output, "box"]);
        assert!(made.status.success(), "{output}: {}", stderr(&made));
        made.stdout
    });
    assert!(named == plain && !plain.is_empty());
    assert!(names(folder.path()).is_empty());
}

#[test]
fn statistics_take_no_other_files_place() {
    let folder = tempfile::tempdir().unwrap();
    let made = cesogen(folder.path(), &["-q", "-s", "0.5", "-o", "in.ply", "box"]);
    assert!(made.status.success(), "{}", stderr(&made));
    let before = fs::read(folder.path().join("in.ply")).unwrap();
    fs::write(folder.path().join("words.txt"), "in.ply").unwrap();
    for arguments in [
        &["-s", "0.5", "-o", "out.ply", "--stats", "./out.ply", "box"][..],
        &["-s", "0.5", "-o", "out.ply", "--stats", "./in.ply", "in.ply"],
        &["-s", "0.5", "-o", "out.ply", "--stats", "in.ply", "@words.txt"],
        &["-s", "0.5", "-o", "out.ply", "--stats", "words.txt", "@words.txt"],
        &["-s", "0.5", "-o", "-", "--stats", "-", "box"],
    ] {
        let output = cesogen(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("name another"), "{}", stderr(&output));
    }
    assert_eq!(fs::read(folder.path().join("in.ply")).unwrap(), before);
    assert_eq!(names(folder.path()), ["in.ply", "words.txt"]);
    let options = ["slice", "-s", "0.5", "--at", "0", "-o", "a.svg", "--stats", "a.svg", "box"];
    let output = run(ALVEOLE, folder.path(), &options);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}

#[test]
fn nothing_is_made_where_the_statistics_can_not_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--stats", "missing/s.json", "-s", "0.1", "-o", "box.ply", "box"];
    let output = cesogen(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("missing/s.json"), "{}", stderr(&output));
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
}

#[test]
fn measures_are_printed_as_a_table_or_json() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        run(ALVEOLE, folder.path(), &["measure", "-s", "0.1", "gyroid", "cylinder", "box"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("Euler characteristic"), "{}", stdout(&output));
    let output = run(ALVEOLE, folder.path(), &["measure", "--json", "-s", "0.1", "x", "box"]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    close(value["volume"].as_f64().unwrap(), 4.0, 1e-9);
    close(value["relative_density"].as_f64().unwrap(), 0.5, 1e-9);
    close(value["envelope_volume"].as_f64().unwrap(), 8.0, 1e-9);
}

#[test]
fn a_short_table_follows_the_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let said = |options: &[&str], program: &[&str]| {
        let output = cesogen(folder.path(), &[&["-s", "0.1"], options, program].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output)
    };
    let table = said(&[], &["torus"]);
    for row in ["grid cells            20 x 20 x 5\n", "Euler characteristic  0\n", "vertices "] {
        assert!(table.contains(row), "{row}: {table}");
    }
    assert!(!table.contains("volume"), "{table}");
    assert_eq!(said(&["-q"], &["torus"]), "");
    let arguments = ["--report", "--stats", "s.json", "--overhang", "60", "--up", "0,0,-1"];
    let table = said(&arguments, &["gyroid", "box"]);
    for row in ["volume", "60°", "percolating along x, y, z", "handles", "relative density"] {
        assert!(table.contains(row), "{row}: {table}");
    }
    let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
    close(stats["survey"]["relative_density"].as_f64().unwrap(), 0.5, 1e-3);
    assert_eq!(stats["survey"]["up"], serde_json::json!([0.0, 0.0, -1.0]));
    assert_eq!(stats["survey"]["euler"], stats["euler"]);
    let output =
        run(ALVEOLE, folder.path(), &["measure", "-q", "--json", "-s", "0.1", "gyroid", "box"]);
    let measured: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(stats["euler"], measured["check"]["euler"]);
    fails(&["--overhang", "30", "box"], 2, &["--overhang", "--report"]);
    fails(&["--report", "--overhang", "0", "box"], 2, &["--overhang", "degrees"]);
    fails(&["--report", "--overhang", "1,2", "box"], 2, &["--overhang", "degrees"]);
    fails(&["--report", "--up", "0,0,0", "box"], 2, &["--up", "direction"]);
}

#[test]
fn the_structure_is_printed_as_a_table_or_json() {
    let folder = tempfile::tempdir().unwrap();
    let measure = |options: &[&str]| {
        let program = ["sphere", "shell", "0.4", "box", "scale", "1.5"];
        let output = run(
            ALVEOLE,
            folder.path(),
            &[&["measure", "-q", "-s", "0.1"], options, &program].concat(),
        );
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    };
    let table = measure(&["--structure"]);
    for row in ["wall thickness", "pore size", "45°", "void", "2 components", "1 enclosed"] {
        assert!(table.contains(row), "{row}: {table}");
    }
    let text = measure(&["--structure", "--json", "--overhang", "30"]);
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let structure = &value["structure"];
    assert_eq!(structure["solid"]["components"], 1);
    assert_eq!(structure["void"]["components"], 2);
    assert_eq!(structure["void"]["enclosed"], 1);
    // One goes around the ball, not through it.
    assert_eq!(structure["void"]["percolates"], serde_json::json!([true, true, true]));
    assert_eq!(structure["handles"], 0);
    // The cap of the outside, and all of the hollow's ceiling that is less steep.
    let cap = std::f64::consts::TAU * (1.0 - 30_f64.to_radians().cos()) * (1.44 + 0.64);
    close(structure["overhang_area"].as_f64().unwrap(), cap, 0.1);
    let wrong = ["measure", "--overhang", "30", "box"];
    assert_eq!(run(ALVEOLE, folder.path(), &wrong).status.code(), Some(2));
}

#[test]
fn slices_are_written_as_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let slice = |arguments: &[&str]| {
        let program = ["box", "cylinder", "scale", "0.5", "difference"];
        run(ALVEOLE, folder.path(), &[&["slice", "-s", "0.05"], arguments, &program].concat())
    };
    let output = slice(&["--at", "-0.5:0.5:0.5", "-o", "part-%03d.svg", "--json", "-q"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["part-000.svg", "part-001.svg", "part-002.svg"]);
    let rows: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    for (k, row) in rows.as_array().unwrap().iter().enumerate() {
        assert_eq!(row["at"], -0.5 + 0.5 * k as f64);
        close(row["area"].as_f64().unwrap(), 4.0 - std::f64::consts::PI / 4.0, 1e-3);
        assert_eq!((&row["outlines"], &row["holes"]), (&2.into(), &1.into()));
    }
    let text = fs::read_to_string(folder.path().join("part-001.svg")).unwrap();
    assert!(text.starts_with("<svg ") && text.contains("evenodd") && text.ends_with("</svg>\n"));
    assert!(text.contains("M-1 -1L1 -1L1 1L-1 1Z"), "{text}");
    let output = slice(&["--at", "0", "--axis", "x", "--pixel", "0.1", "-o", "front.png"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("front.png"), "{}", stderr(&output));
    let picture = fs::read(folder.path().join("front.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG\r\n"));
    // Width and height of the header.
    assert_eq!(picture[16..24], [0, 0, 0, 20, 0, 0, 0, 20]);
    let piped = slice(&["--at", "0", "-o", "-"]);
    assert!(piped.stdout.starts_with(b"<svg "), "{}", stderr(&piped));
    let refused = |arguments: &[&str], words: &[&str]| {
        let output = slice(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
    };
    refused(&["--at", "0,0.5", "-o", "one.svg"], &["one.svg", "%04d", "2 slices"]);
    refused(&["--at", "1.5", "-o", "one.svg"], &["--at", "1.5", "from -1 to 1"]);
    refused(&["--at", "0:1", "-o", "one.svg"], &["--at", "0:1:0.1"]);
    refused(&["--at", "0:1:1e-9", "-o", "%d.svg"], &["--at", " slices; give a longer step"]);
    refused(&["--at", "0", "-o", "-", "--json"], &["-o", "--json"]);
    refused(&["--at", "0", "-o", "one.jpg"], &["one.jpg", ".svg", ".png"]);
    refused(&["--at", "0", "-o", "one.svg", "--pixel", "1"], &["--pixel", ".png"]);
    refused(&["--at", "0", "-o", "one.png", "--pixel", "0"], &["--pixel", "positive"]);
    refused(&["--at", "0", "-o", "one.png", "--pixel", "1e-9"], &["pixels", "larger"]);
    refused(&["-o", "one.png"], &["--at"]);
    assert_eq!(names(folder.path()).len(), 4);
}

#[test]
fn derivatives_and_field_measures_are_printed_as_a_table_or_json() {
    let folder = tempfile::tempdir().unwrap();
    let measure = |options: &[&str]| {
        let program = ["gyroid", "dilate", "t", "box"];
        let common = ["measure", "-q", "-s", "0.1", "--param", "t=0.35"];
        let output = run(ALVEOLE, folder.path(), &[&common, options, &program].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        stdout(&output)
    };
    let json = |options: &[&str]| -> serde_json::Value {
        serde_json::from_str(&measure(options)).unwrap()
    };
    let gradient = json(&["--gradient", "--json"]);
    assert_eq!(gradient["by"][0]["parameter"], "t");
    // The slope of the density of the gyroid at level t, by the coarea formula, is near 0.32.
    close(gradient["by"][0]["relative_density"].as_f64().unwrap(), 0.32, 0.02);
    let field = json(&["--field", "--json"]);
    let [value, error] =
        ["value", "error"].map(|key| field["relative_density"][key].as_f64().unwrap());
    // field.md 6.2: 0.6129 at level 0.35.
    assert!((value - 0.6129).abs() < error + 5e-5, "{value} +- {error}");
    assert!(measure(&["--gradient"]).contains("by t"));
    assert!(measure(&["--field"]).contains("+-"));
    let both = ["measure", "--field", "--gradient", "box"];
    assert_eq!(run(ALVEOLE, folder.path(), &both).status.code(), Some(2));
}

#[test]
fn experiments_print_tables_or_json_and_draw() {
    let folder = tempfile::tempdir().unwrap();
    let study = |arguments: &[&str]| run(ALVEOLE, folder.path(), &[&["study"], arguments].concat());
    let output = study(&["roundtrip", "--times", "12", "-s", "0.2", "--plot", "e.svg", "sphere"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = stdout(&output);
    let numbers =
        table.lines().skip(1).map_while(|line| line.split(' ').next()?.parse::<u32>().ok());
    assert_eq!(numbers.collect::<Vec<_>>(), [0, 1, 2, 5, 10, 12], "{table}");
    for part in
        ["points L2", "centres max", "moved", "fixed point", "PLY of 64-bit", "10 x 10 x 10"]
    {
        assert!(table.contains(part), "{part}: {table}");
    }
    let plot = fs::read_to_string(folder.path().join("e.svg")).unwrap();
    assert!(plot.starts_with("<svg ") && plot.contains("round trip"), "{plot}");
    let arguments =
        ["hierarchy", "--format", "stl", "-s", "r/4", "--param", "r=1", "sphere", "shell r"];
    let output = study(&arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = stdout(&output);
    for part in ["sequential", "ratio", "STL of 32-bit", "step 2  sphere shell r\n"] {
        assert!(table.contains(part), "{part}: {table}");
    }
    assert_eq!(names(folder.path()), ["e.svg"]);
    let refused = |arguments: &[&str], code: i32, words: &[&str]| {
        let output = study(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
    };
    refused(&["roundtrip", "--times", "0", "sphere"], 2, &["--times"]);
    refused(&["roundtrip", "--plot", "e.png", "sphere"], 2, &["--plot", "e.png", ".svg"]);
    refused(&["roundtrip", "--plot", "no/e.svg", "sphere"], 1, &["no/e.svg"]);
    let double = ["roundtrip", "--format", "stl", "--precision", "double", "sphere"];
    refused(&double, 2, &["--precision", "STL", "single"]);
    refused(&["roundtrip", "gyroid"], 1, &["unbounded"]);
    refused(&["roundtrip"], 2, &["PROGRAM"]);
    refused(&["hierarchy"], 2, &["STEP"]);
    refused(&["hierarchy", "sphere", "gyrod"], 2, &["gyrod", "gyroid"]);
    refused(&["hierarchy", "sphere", "union"], 2, &["union"]);
    refused(&["hierarchy", "sphere", "box translate 5,0,0"], 1, &["empty"]);
    assert_eq!(study(&[]).status.code(), Some(2));
    for experiment in ["roundtrip", "hierarchy"] {
        let help = stdout(&study(&[experiment, "--help"]));
        for part in ["section 4.2", "--precision", "--bounds", "gyroid"] {
            assert!(help.contains(part), "{experiment}: {part}: {help}");
        }
    }
    assert_eq!(names(folder.path()), ["e.svg"]);
}

#[test]
fn check_tells_sound_meshes_from_others() {
    let folder = tempfile::tempdir().unwrap();
    assert!(cesogen(folder.path(), &["-s", "0.5", "-o", "good.off", "box"]).status.success());
    let output = run(ALVEOLE, folder.path(), &["check", "--json", "good.off"]);
    assert!(output.status.success());
    let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(value["sound"], true);
    close(value["volume"].as_f64().unwrap(), 8.0, 1e-12);
    fs::write(folder.path().join("open.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        .unwrap();
    let output = run(ALVEOLE, folder.path(), &["check", "open.off"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("boundary"), "{}", stdout(&output));
}

#[test]
fn help_names_the_words_and_list_explains_them() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["--help"][..], &["-h"], &["--version"]] {
        for binary in [CESOGEN, ALVEOLE] {
            assert_eq!(run(binary, folder.path(), arguments).status.code(), Some(0));
        }
    }
    let help = stdout(&cesogen(folder.path(), &["--help"]));
    for word in ["gyroid", "p-surface", "slotted-p", "dilate", "union", "torus"] {
        assert!(help.contains(word), "`{word}` is not in the help");
    }
    let list = stdout(&run(ALVEOLE, folder.path(), &["list"]));
    assert!(list.contains("\noperations on two shapes:\n  union"), "{list}");
    let list = stdout(&run(ALVEOLE, folder.path(), &["list", "torus"]));
    assert!(list.contains("minor"), "{list}");
    let output = run(ALVEOLE, folder.path(), &["list", "tours"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("torus"));
    let completions = run(ALVEOLE, folder.path(), &["completions", "bash"]);
    assert!(stdout(&completions).contains("alveole"));
}

#[test]
fn the_readme_lists_the_words_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let list = stdout(&run(ALVEOLE, folder.path(), &["list", "--markdown"]));
    let readme = include_str!("../README.md");
    let (_, rest) = readme.split_once("<!-- words: alveole list --markdown -->\n").unwrap();
    let (words, _) = rest.split_once("<!-- end of words -->").unwrap();
    assert!(words == list, "put the output of `alveole list --markdown` into the README");
}

#[test]
fn real_parts_are_filled_and_joined() {
    let Some(data) = common::real_meshes() else { return };
    let bunny = data.join("bunny_closed.obj").display().to_string();
    let spot = data.join("spot_low.obj").display().to_string();
    let one = ["-s", "0.03", &bunny, "gyroid", "scale", "0.3", "intersection"];
    assert!(volume_of(&one) > 0.0);
    let two = [
        "-s",
        "0.03",
        &bunny,
        "gyroid",
        "intersection",
        &spot,
        "p-surface",
        "intersection",
        "union",
    ];
    assert!(volume_of(&two) > 0.0);
}
