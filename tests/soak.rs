//! A server under load for as long as an optimizer runs: thousands of random programs and parameter
//! values to one process. Every request gets its reply, none finds a defect, and memory stays flat:
//! compiled code goes with its program.
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "the long run reports what it found")]

mod common;
#[path = "random/programs.rs"]
mod programs;

use programs::{Folder, Random};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

/// A running server.
struct Server {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Server {
    fn start() -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_alveole"))
            .args(["serve", "--threads", "2"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (to, from) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        Self { child, to, from: BufReader::new(from) }
    }

    fn reply(&mut self, request: &str) -> Value {
        writeln!(self.to, "{request}").unwrap();
        let mut line = String::new();
        let read = self.from.read_line(&mut line).unwrap();
        assert!(read > 0, "no reply to {request}");
        serde_json::from_str(&line).unwrap()
    }

    /// Memory that the process holds, in MiB, where the system tells.
    fn memory(&self) -> Option<f64> {
        let text = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
        Some(line.split_whitespace().nth(1)?.parse::<f64>().unwrap() / 1024.0)
    }

    fn end(self) {
        let Self { mut child, to, from } = self;
        drop((to, from));
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
}

/// A request, of a program of its own or one of late ones with another value of its parameter.
fn request(random: &mut Random, late: &mut Vec<Vec<String>>, folder: &Folder, id: usize) -> Value {
    if late.is_empty() || random.below(4) == 0 {
        let mut words = random.program(folder);
        words.extend(["dilate", "held"].map(str::to_owned));
        if late.len() == 40 {
            late.remove(0);
        }
        late.push(words);
    }
    let program = &late[random.below(late.len())];
    let half = random.between(0.3, 1.5);
    let mut request = json!({
        "id": id,
        "program": program,
        "parameters": {"held": random.between(-0.2, 0.2)},
        "bounds": [-half, -half, -half, half, half, half],
        "spacing": half * random.between(0.1, 0.4),
    });
    match random.below(8) {
        0 => request["measure"] = json!("all"),
        1 => request["gradient"] = json!(true),
        2 => request["field"] = json!(true),
        3 => request["mesh"] = json!({"file": "/dev/null", "format": "ply"}),
        4 if random.below(8) == 0 => request["program"] = json!("box unheard-of"),
        _ => request["measure"] = json!(["volume", "area"]),
    }
    request
}

/// Removes what differs between two replies to one request: the number, and how long the work took.
fn forget(reply: &mut Value) {
    if let Value::Object(entries) = reply {
        entries.retain(|key, _| !["id", "seconds", "report"].contains(&key.as_str()));
        entries.values_mut().for_each(forget);
    }
}

/// Sends the same `count` random requests `passes` times: what they are answered must not depend on
/// what was asked before, and memory not grow from one pass to the next, some MiB of the allocator's
/// apart. After two different thousands of requests it differs, with the largest of them.
fn soak(count: usize, passes: usize) {
    let (mut server, folder) = (Server::start(), Folder::new());
    let (mut kinds, mut answers) = (BTreeMap::<String, usize>::new(), Vec::new());
    let (mut memory, start) = (Vec::new(), Instant::now());
    for pass in 0..passes {
        let (mut random, mut late) = (Random::new(77), Vec::new());
        for number in 0..count {
            let id = pass * count + number;
            let request = request(&mut random, &mut late, &folder, id).to_string();
            let mut reply = server.reply(&request);
            assert_eq!(reply["id"], json!(id), "{request}");
            let kind = reply["error"]["kind"].as_str().unwrap_or("none").to_owned();
            let is_meant = request.contains("unheard-of");
            let expected = ["none", "empty", "bounds", "field"].contains(&&*kind);
            assert!(expected || is_meant && kind == "program", "{request}: {reply}");
            *kinds.entry(kind).or_default() += 1;
            forget(&mut reply);
            let answer = reply.to_string();
            if pass == 0 {
                answers.push(answer);
            } else {
                assert_eq!(answers[number], answer, "{request}");
            }
            if count * passes > 10_000 && (id + 1).is_multiple_of(5_000) {
                let (seconds, memory) = (start.elapsed().as_secs_f64(), server.memory());
                let memory = memory.unwrap_or(f64::NAN);
                eprintln!("{} requests, {seconds:.0} s, {memory:.0} MiB", id + 1);
            }
        }
        memory.extend(server.memory());
    }
    eprintln!("kinds of error: {kinds:?}; MiB after each pass: {memory:.0?}");
    if let [first, .., last] = memory[..] {
        assert!(last < 1.1 * first + 12.0, "{first:.0} MiB became {last:.0} MiB");
    }
    server.end();
}

#[test]
fn a_server_answers_a_thousand_random_requests_in_steady_memory() {
    soak(500, 2);
}

#[test]
#[ignore = "an hour"]
fn a_server_answers_a_hundred_thousand_random_requests_in_steady_memory() {
    soak(10_000, 10);
}
