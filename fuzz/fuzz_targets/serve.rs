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
        check_id(&reply, line);
        match reply.get("error") {
            Some(error) => check_error(error),
            None => assert!(reply["cells"].is_array() && reply["bounds"].is_array(), "{reply}"),
        }
    }
});

/// The id is that of the request; none if the request has several. A line that is no JSON, by its
/// encoding for one, may still tell it.
fn check_id(reply: &Value, line: &[u8]) {
    let Ok(request) = serde_json::from_slice::<Value>(line) else { return };
    let is_key = |text: &&[u8]| *text == b"\"id\"" || text.starts_with(b"\\u");
    let may_have_several = line.windows(4).filter(is_key).count() > 1;
    let found = reply.get("id").expect("a reply has an id");
    let is_none = may_have_several && found.is_null() && reply.get("error").is_some();
    assert!(is_none || found == request.get("id").unwrap_or(&Value::Null), "{reply}");
}

/// The error says what is wrong, and where in a text.
fn check_error(error: &Value) {
    let message = error["message"].as_str().expect("an error has a message");
    assert!(!message.is_empty());
    assert_ne!(error["kind"], "internal", "{error}");
    for fault in error["faults"].as_array().into_iter().flatten() {
        assert!(fault["picture"].as_str().is_some_and(|picture| picture.contains("error")));
    }
}
