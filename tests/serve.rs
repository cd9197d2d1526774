//! `alveole serve`, run as an optimizer runs it: requests in, replies out, a line each.
#![allow(clippy::unwrap_used, reason = "tests may")]

use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

const ALVEOLE: &str = env!("CARGO_BIN_EXE_alveole");

fn start(folder: &Path) -> Child {
    Command::new(ALVEOLE)
        .arg("serve")
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The replies to `input`.
fn replies(folder: &Path, input: &[u8]) -> Vec<Value> {
    lines(folder, input).iter().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// The replies to `input`, as they are written; the server ends well and says nothing else.
fn lines(folder: &Path, input: &[u8]) -> Vec<String> {
    let mut child = start(folder);
    let mut to = child.stdin.take().unwrap();
    let input = input.to_vec();
    let writer = std::thread::spawn(move || to.write_all(&input).unwrap());
    let Output { status, stdout, stderr } = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert_eq!(status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&stderr), "");
    let text = String::from_utf8(stdout).unwrap();
    assert!(text.is_empty() || text.ends_with('\n'));
    text.lines().map(str::to_owned).collect()
}

/// The reply to one request.
fn reply(request: &Value) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let mut replies = replies(folder.path(), request.to_string().as_bytes());
    assert_eq!(replies.len(), 1);
    replies.remove(0)
}

/// What `alveole` prints for `arguments`.
fn alveole(folder: &Path, arguments: &[&str]) -> Output {
    let output = Command::new(ALVEOLE).args(arguments).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn a_session_of_an_optimizer_gets_its_replies_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let program = "gyroid dilate t box";
    let mut input = String::new();
    for (i, t) in [0.0, 0.35, -0.2, 0.35].into_iter().enumerate() {
        let request = json!({"id": i, "program": program, "parameters": {"t": t}, "spacing": 0.1,
            "measure": ["volume", "area", "relative_density"]});
        input.push_str(&format!("{request}\n\n"));
    }
    // The last line has no end, and other values than before.
    input.push_str(
        &json!({"id": {"last": [true]}, "program": program, "parameters": {"t": 0.1},
            "spacing": 0.1, "measure": "all", "mesh": "out.ply"})
        .to_string(),
    );
    let found = replies(folder.path(), input.as_bytes());
    assert_eq!(found.len(), 5);
    for (i, reply) in found[..4].iter().enumerate() {
        assert_eq!(reply["id"], json!(i));
        assert_eq!(reply["measures"].as_object().unwrap().len(), 3);
        assert_eq!(reply["cells"], json!([20, 20, 20]));
        assert_eq!(reply["bounds"], json!([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]));
    }
    assert_eq!(found[1]["measures"], found[3]["measures"]);
    assert_ne!(found[1]["measures"], found[0]["measures"]);
    assert_eq!(found[4]["id"], json!({"last": [true]}));

    // One process for each gives the same, but for the rounding of sums where no mesh is kept.
    for (reply, level) in [(&found[1], "0.35"), (&found[2], "-0.2"), (&found[4], "0.1")] {
        let words = ["measure", "--json", "-q", "-s", "0.1", "gyroid", "dilate", level, "box"];
        let alone: Value = serde_json::from_slice(&alveole(folder.path(), &words).stdout).unwrap();
        for (name, value) in reply["measures"].as_object().unwrap() {
            if name != "report" {
                let is_rounding = match (value.as_f64(), alone[name].as_f64()) {
                    (Some(a), Some(b)) => (a - b).abs() <= 1e-12 * b.abs(),
                    _ => *value == alone[name],
                };
                assert!(is_rounding, "{name}: {value} {}", alone[name]);
            }
        }
    }
    let words = ["mesh", "-o", "alone.ply", "-s", "0.1", "gyroid", "dilate", "0.1", "box"];
    alveole(folder.path(), &words);
    let [served, alone] =
        ["out.ply", "alone.ply"].map(|f| fs::read(folder.path().join(f)).unwrap());
    assert!(served == alone);
    assert_eq!(found[4]["mesh"]["file"], "out.ply");
    assert_eq!(found[4]["mesh"]["precision"], "single");
    assert!(found[4]["mesh"]["triangles"].as_u64().unwrap() > 1000);
}

#[test]
fn an_id_comes_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    for id in [
        "12345678901234567890123",
        "1.50",
        "-0",
        "1e2",
        "null",
        r#""\u0041 \/ b""#,
        r#"{ "b": [1,  2.0], "a": {} }"#,
    ] {
        let input = format!(
            "{{\"id\":  {id} , \"program\": \"box\"}}\n{{\"program\": \"gyrod\", \"id\":{id}}}\n\
             {{\"id\":{id}}}\n{{\"id\":{id},\"program\":\"box\",\"program\":\"box\"}}\n"
        );
        let lines = lines(folder.path(), input.as_bytes());
        assert_eq!(lines.len(), 4);
        for (line, kind) in lines.iter().zip(["bounds", "error", "error", "error"]) {
            let begin = format!("{{\"id\":{id},\"{kind}\":");
            assert!(line.starts_with(&begin), "{line}");
        }
    }
    // None where it can't be told which it is.
    let input = b"{\"id\":1,\"id\":2}\n{\"id\":1\n[1]\n";
    for line in lines(folder.path(), input) {
        assert!(line.starts_with("{\"id\":null,\"error\":"), "{line}");
    }
}

#[test]
fn a_reply_comes_before_the_next_request() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = start(folder.path());
    let (mut to, from) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
    let mut from = BufReader::new(from).lines();
    for size in [1.0, 2.0, 0.5] {
        let request = json!({"program": "box scale s", "parameters": {"s": size}});
        writeln!(to, "{request}").unwrap();
        let reply: Value = serde_json::from_str(&from.next().unwrap().unwrap()).unwrap();
        assert_eq!(reply["bounds"], json!([[-size, -size, -size], [size, size, size]]));
        assert_eq!(reply["id"], Value::Null);
        assert_eq!(reply.get("measures"), None);
    }
    drop(to);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn bad_lines_are_answered_and_end_nothing() {
    let good = r#"{"id": "good", "program": "box", "spacing": 1}"#;
    let cases: &[(&str, &str, &str)] = &[
        ("not JSON", "line", "can't be read as JSON"),
        ("{\"id\": 1", "line", "can't be read as JSON"),
        ("null", "request", "is an object"),
        (
            r#"["box", null, null, null, null, null, null, null, null, null]"#,
            "request",
            "is an object",
        ),
        ("{}", "request", "program"),
        (r#"{"program": 5}"#, "request", "`program` must be"),
        (r#"{"program": "box", "colour": "red"}"#, "request", "colour"),
        (r#"{"program": "box", "parameters": {"t": "a"}}"#, "request", "`parameters` must be"),
        (r#"{"program": "box", "spacing": "fine"}"#, "request", "`spacing` must be"),
        (r#"{"program": "box", "spacing": [1, 0, 1]}"#, "request", "positive"),
        (r#"{"program": "box", "bounds": [0, 0, 0, 1, 1]}"#, "request", "`bounds` must be"),
        (r#"{"program": "box", "bounds": [0, 0, 0, 1, -1, 1]}"#, "request", "greatest"),
        (r#"{"program": "box", "measure": ["mass"]}"#, "request", "`mass`"),
        (r#"{"program": "box", "measure": "some"}"#, "request", "\"all\""),
        (r#"{"program": "box", "mesh": {"file": "a.ply", "format": "vtk"}}"#, "request", "`mesh`"),
        (r#"{"program": "gyrod box"}"#, "program", "gyrod"),
        (r#"{"program": "box scale t"}"#, "program", "unknown name `t`"),
        (r#"{"program": "box", "parameters": {"x": 1}}"#, "program", "coordinate"),
        (r#"{"program": "box scale t", "parameters": {"t": 0}}"#, "program", "zero"),
        (r#"{"program": "@missing box"}"#, "file", "missing"),
        (r#"{"program": "missing.stl box"}"#, "file", "missing.stl"),
        (r#"{"program": "@/dev/stdin"}"#, "file", "regular"),
        (r#"{"program": "gyroid"}"#, "bounds", "unbounded"),
        (r#"{"program": "box", "spacing": 1e-12}"#, "grid", ""),
        (
            r#"{"program": "x-9 box complement", "bounds": [0,0,0,1,1,1], "measure": ["area"], "spacing": 0.5}"#,
            "empty",
            "empty",
        ),
        (r#"{"program": "box", "mesh": "-"}"#, "output", "regular"),
        (r#"{"program": "box", "mesh": "a.vtk"}"#, "output", ".ply"),
        (r#"{"program": "box", "mesh": "no/such/folder/a.ply"}"#, "output", "no/such/folder"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let input: String = cases.iter().map(|(line, ..)| format!("{line}\n{good}\n")).collect();
    let found = replies(folder.path(), input.as_bytes());
    assert_eq!(found.len(), 2 * cases.len());
    for ((line, kind, words), pair) in cases.iter().zip(found.chunks(2)) {
        let error = &pair[0]["error"];
        assert_eq!(error["kind"], *kind, "{line}: {error}");
        assert!(error["message"].as_str().unwrap().contains(words), "{line}: {error}");
        assert_eq!((&pair[1]["id"], pair[1].get("error")), (&json!("good"), None), "{line}");
    }
    assert!(fs::read_dir(folder.path()).unwrap().next().is_none());
}

#[test]
fn lines_of_garbage_and_of_great_length_are_answered() {
    let mut input = b"\xff\xfe{\"program\"\n{\"program\": \"\xc3\x28\"}\n".to_vec();
    input.extend("[".repeat(1 << 20).bytes().chain(*b"\n"));
    input.extend("{\"a\":".repeat(100_000).bytes().chain(*b"\n"));
    input.extend(std::iter::repeat_n(b'x', 9 << 20));
    input.extend(b"\n{\"id\": 7, \"program\": \"box\"}\n\n");
    let folder = tempfile::tempdir().unwrap();
    let found = replies(folder.path(), &input);
    assert_eq!(found.len(), 6);
    for reply in &found[..5] {
        assert_eq!(reply["error"]["kind"], "line", "{reply}");
    }
    assert!(found[4]["error"]["message"].as_str().unwrap().contains("longer than"));
    assert_eq!(found[5]["id"], 7);
}

#[test]
fn faults_of_a_program_have_place_picture_and_cure() {
    let error = reply(&json!({"program": "gyroid dilat 0.3 box"}))["error"].clone();
    let fault = &error["faults"][0];
    assert_eq!(error["cure"], "did you mean `dilate`?");
    assert_eq!(fault["span"], json!({"start": 7, "end": 12}));
    assert!(fault["picture"].as_str().unwrap().contains("^^^^^"), "{fault}");

    let error =
        reply(&json!({"program": "box scale s-1", "parameters": {"s": 1}}))["error"].clone();
    assert!(error["faults"][0]["picture"].as_str().unwrap().contains("where `s` is 1"), "{error}");
}

#[test]
fn warnings_come_with_the_reply() {
    let found = reply(&json!({"program": "'x' shell t box", "parameters": {"t": 0.1, "u": 1},
        "spacing": 0.09, "measure": "all"}));
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("`u` is not used") && warnings.contains("walls"), "{warnings}");
}

#[test]
fn grids_beyond_the_limit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(ALVEOLE)
        .args(["serve", "--most-cells", "1000"])
        .current_dir(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = child.stdin.take().unwrap();
    to.write_all(b"{\"program\": \"box\", \"spacing\": 0.2}\n{\"program\": \"box\"}\n").unwrap();
    drop(to);
    let output = child.wait_with_output().unwrap();
    let lines: Vec<_> = output.stdout.split(|byte| *byte == b'\n').collect();
    assert!(!String::from_utf8_lossy(lines[0]).contains("error"));
    assert!(String::from_utf8_lossy(lines[1]).contains("1000000 cells; this server allows 1000"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_server_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = start(folder.path());
    let mut to = child.stdin.take().unwrap();
    // Large enough to be under way when the signal comes.
    to.write_all(b"{\"program\": \"gyroid box\", \"spacing\": 0.002, \"mesh\": \"a.ply\"}\n")
        .unwrap();
    while fs::read_dir(folder.path()).unwrap().next().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(fs::read_dir(folder.path()).unwrap().next().is_none());
}

#[test]
fn the_help_shows_the_protocol() {
    let folder = tempfile::tempdir().unwrap();
    let help = String::from_utf8(alveole(folder.path(), &["help", "serve"]).stdout).unwrap();
    for word in ["\"program\"", "\"measure\"", "relative_density", "kind", "reads them"] {
        assert!(help.contains(word), "`{word}` is not in: {help}");
    }
}

#[test]
fn derivatives_and_field_measures_are_replied() {
    let found = reply(&json!({"program": "gyroid dilate t box", "parameters": {"t": 0.35},
        "spacing": 0.1, "gradient": true, "field": true, "measure": ["relative_density"]}));
    let density = found["measures"]["relative_density"].as_f64().unwrap();
    let gradient = &found["gradient"];
    assert!((gradient["relative_density"].as_f64().unwrap() - density).abs() < 1e-12);
    assert_eq!(gradient["by"][0]["parameter"], "t");
    assert!(gradient["by"][0]["relative_density"].as_f64().unwrap() > 0.3);
    let field = &found["field"]["relative_density"];
    let [value, error] = ["value", "error"].map(|key| field[key].as_f64().unwrap());
    assert!((value - density).abs() < error, "{value} +- {error} is not {density}");
    assert!(gradient.get("report").is_none());
    let none = reply(&json!({"program": "box", "gradient": false}));
    assert!(none.get("gradient").is_none() && none.get("error").is_none());
}

#[test]
fn the_structure_is_that_of_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let request = json!({"program": "gyroid shell 0.6 box", "spacing": 0.1,
        "structure": {"overhang": 30, "up": [1, 0, 0]}});
    let served = reply(&request);
    let words = ["measure", "--structure", "--json", "-q", "-s", "0.1", "--overhang", "30", "--up"];
    let words = [&words[..], &["1,0,0", "gyroid", "shell", "0.6", "box"]].concat();
    let alone: Value = serde_json::from_slice(&alveole(folder.path(), &words).stdout).unwrap();
    assert_eq!(served["structure"], alone["structure"]);
    assert_eq!(served["structure"]["solid"]["percolates"], json!([true, true, true]));
    assert_eq!(served["structure"]["overhang_angle_deg"], json!(30.0));
    let plain = reply(&json!({"program": "sphere", "spacing": 0.2, "structure": true}));
    assert_eq!(plain["structure"]["void"]["enclosed"], json!(0));
    for wrong in [json!(1), json!({"overhang": 0}), json!({"up": [0, 0, 0]}), json!({"down": 1})] {
        let refused = reply(&json!({"program": "sphere", "structure": wrong}));
        assert_eq!(refused["error"]["kind"], "request", "{refused}");
    }
}

#[test]
fn a_request_may_ask_for_a_mesh_without_slivers() {
    let folder = tempfile::tempdir().unwrap();
    let request =
        |mesh: Value| json!({"program": "sphere", "spacing": 0.1, "mesh": mesh}).to_string();
    let kept = request(json!({"file": "kept.ply"}));
    let removed = request(json!({"file": "removed.ply", "snap": true}));
    let found = replies(folder.path(), format!("{kept}\n{removed}\n").as_bytes());
    let triangles = |reply: &Value| reply["mesh"]["triangles"].as_u64().unwrap();
    assert!(triangles(&found[1]) < triangles(&found[0]), "{found:?}");
    let checked = alveole(folder.path(), &["check", "--json", "removed.ply"]);
    let checked: Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert!(checked["quality"]["least_angle_deg"].as_f64().unwrap() > 20.0, "{checked}");
}
