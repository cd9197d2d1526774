//! Bad requests to `alveole serve`: each gets one reply that says what is wrong, and the next is served.

use super::files;
use super::run::{ALVEOLE, run};
use serde_json::Value;

/// The replies to lines of requests; the server must end well.
fn replies(lines: &[Vec<u8>]) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(ALVEOLE, folder.path(), &["serve"], &lines.join(&b'\n'));
    assert_eq!((outcome.code, outcome.said.as_str()), (Some(0), ""));
    assert!(super::run::names(folder.path()).is_empty());
    let read = |line: &str| serde_json::from_str(line).unwrap();
    outcome.printed.lines().map(read).collect()
}

#[test]
fn whatever_a_line_holds_it_gets_its_reply_and_the_next_is_served() {
    let program = |text: &str| format!("{{\"program\": \"{text}\"}}").into_bytes();
    let with = |rest: &str| format!("{{\"program\": \"box\", {rest}}}").into_bytes();
    let mut hostile = files::garbage(5000);
    hostile.retain(|byte| *byte != b'\n');
    let bad: Vec<(Vec<u8>, &str)> = vec![
        (b"x".repeat(9 << 20), "line"),
        (b"[".repeat(1 << 20), "line"),
        (b"{\"id\":".repeat(1 << 18), "line"),
        (hostile, "line"),
        (b"{\"program\": \"\xff\"}".to_vec(), "line"),
        (files::wide(b"{\"program\": \"box\"}"), "line"),
        (b"{\"program\": \"box\"".to_vec(), "line"),
        (b"[]".to_vec(), "request"),
        (b"3".to_vec(), "request"),
        (b"null".to_vec(), "request"),
        (b"{}".to_vec(), "request"),
        (b"{\"program\": 3}".to_vec(), "request"),
        (b"{\"program\": [1]}".to_vec(), "request"),
        (with("\"foo\": 1"), "request"),
        (with("\"spacing\": \"a\""), "request"),
        (with("\"spacing\": [1, 2]"), "request"),
        (with("\"spacing\": -1"), "request"),
        (with("\"spacing\": 1e-300"), "grid"),
        (with("\"spacing\": 1e999"), "line"),
        (with("\"bounds\": [1, 1, 1, 0, 0, 0]"), "request"),
        (with("\"parameters\": [1]"), "request"),
        (with("\"parameters\": {\"x\": 1}"), "program"),
        (with("\"measure\": [\"foo\"]"), "request"),
        (with("\"spacing\": 1, \"spacing\": 1"), "request"),
        (format!("{{\"{0}\": 1, \"{0}\": 1}}", "k".repeat(1 << 20)).into_bytes(), "request"),
        (with("\"mesh\": 3"), "request"),
        (with("\"mesh\": \"-\""), "output"),
        (with("\"mesh\": \"/dev/full\""), "output"),
        (with("\"mesh\": \"no/such/folder/a.ply\""), "output"),
        (program("@/dev/zero"), "file"),
        (program("@missing"), "file"),
        (program("gyrod"), "program"),
        (program(""), "program"),
        (program("gyroid"), "bounds"),
    ];
    let sound = br#"{"id": 7, "program": "box", "spacing": 1, "measure": ["volume"]}"#;
    let mut lines = Vec::new();
    for (line, _) in &bad {
        lines.extend([line.clone(), sound.to_vec()]);
    }
    let found = replies(&lines);
    assert_eq!(found.len(), lines.len());
    for (pair, (line, kind)) in found.chunks(2).zip(&bad) {
        let line: String = String::from_utf8_lossy(line).chars().take(60).collect();
        let message = pair[0]["error"]["message"].as_str();
        assert_eq!(pair[0]["error"]["kind"], *kind, "{line}: {}", pair[0]);
        assert!(message.is_some_and(|text| text.len() < 1500), "{line}: {}", pair[0]);
        assert_eq!(pair[1]["measures"]["volume"], 8.0, "after {line}");
    }
}

#[test]
fn keys_given_twice_are_refused_by_name() {
    let said = |request: &str| {
        let reply = replies(&[request.as_bytes().to_vec()]).remove(0);
        assert_eq!(reply["error"]["kind"], "request", "{reply}");
        reply["error"]["message"].as_str().unwrap().to_owned()
    };
    for (request, message) in [
        (
            r#"{"program": "box scale t", "parameters": {"t": 1, "t": 2}}"#,
            "`t` is given twice at line 1 column 53",
        ),
        (r#"{"program": "box", "program": "box"}"#, "`program` is given twice at line 1 column 28"),
        // However they are written.
        (
            r#"{"id": 1, "program": "box", "spacing": 1, "sp\u0061cing": 1}"#,
            "`spacing` is given twice at line 1 column 56",
        ),
        (
            r#"{"program": "box", "structure": {"up": [0,0,1], "up": [0,0,1]}}"#,
            "`up` is given twice at line 1 column 52",
        ),
        (r#"{"id": 1, "program": "box", "id": 2}"#, "`id` is given twice at line 1 column 32"),
    ] {
        assert_eq!(said(request), message);
    }
}
