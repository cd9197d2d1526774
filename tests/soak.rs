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

/// Sends `count` requests; `settled` after which memory must not grow.
fn soak(count: usize, settled: usize) {
    let (mut server, folder, mut random) = (Server::start(), Folder::new(), Random::new(77));
    let (mut late, mut kinds) = (Vec::new(), BTreeMap::<String, usize>::new());
    let (mut before, start) = (None, Instant::now());
    for id in 0..count {
        let request = request(&mut random, &mut late, &folder, id).to_string();
        let reply = server.reply(&request);
        assert_eq!(reply["id"], json!(id), "{request}");
        let kind = reply["error"]["kind"].as_str().unwrap_or("none").to_owned();
        let is_meant = request.contains("unheard-of");
        let expected = ["none", "empty", "bounds", "field"].contains(&&*kind);
        assert!(expected || is_meant && kind == "program", "{request}: {reply}");
        *kinds.entry(kind).or_default() += 1;
        if id == settled {
            before = server.memory();
        }
        if count > 10_000 && (id + 1) % (count / 20) == 0 {
            let memory = server.memory().unwrap_or(f64::NAN);
            eprintln!(
                "{} requests, {:.0} s, {memory:.0} MiB",
                id + 1,
                start.elapsed().as_secs_f64()
            );
        }
    }
    eprintln!("kinds of error: {kinds:?}");
    if let (Some(before), Some(after)) = (before, server.memory()) {
        assert!(after < 1.25 * before + 24.0, "{before:.0} MiB became {after:.0} MiB");
    }
    server.end();
}

#[test]
fn a_server_answers_a_thousand_random_requests_in_steady_memory() {
    soak(1_000, 400);
}

#[test]
#[ignore = "an hour"]
fn a_server_answers_a_hundred_thousand_random_requests_in_steady_memory() {
    soak(100_000, 20_000);
}
