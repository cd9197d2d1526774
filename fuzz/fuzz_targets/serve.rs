//! Requests: whatever the lines, each gets one line of JSON with its id, and none finds a defect.
//!
//! The server may touch no files and contours small grids only.
#![no_main]

use alveole::cli::serve::{Limits, Server};
use alveole::job::Access;
use libfuzzer_sys::fuzz_target;
use serde_json::Value;

/// Most requests of an input.
const MOST_LINES: usize = 8;

fuzz_target!(|bytes: &[u8]| {
    let mut server = Server::new(Limits { access: Access::Nothing, most_cells: Some(4096) });
    for line in bytes.split(|byte| *byte == b'\n').take(MOST_LINES) {
        let text = server.answer(line);
        let reply = text.strip_suffix('\n').expect("a reply is a line");
        assert!(!reply.contains('\n'), "{reply}");
        let reply: Value = serde_json::from_str(reply).expect("a reply is JSON");
        let request = serde_json::from_slice::<Value>(line).unwrap_or_default();
        assert_eq!(reply.get("id"), Some(request.get("id").unwrap_or(&Value::Null)));
        match reply.get("error") {
            Some(error) => check_error(error),
            None => assert!(reply["cells"].is_array() && reply["bounds"].is_array(), "{reply}"),
        }
    }
});

/// The error says what is wrong, and where in a text.
fn check_error(error: &Value) {
    let message = error["message"].as_str().expect("an error has a message");
    assert!(!message.is_empty());
    assert_ne!(error["kind"], "internal", "{error}");
    for fault in error["faults"].as_array().into_iter().flatten() {
        assert!(fault["picture"].as_str().is_some_and(|picture| picture.contains("error")));
    }
}
