//! Rules about the whole of the code that a reader could not keep in view: where files are opened, where
//! code is unsafe, what dependencies may be.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests may, and say what they skip")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The files of `src`, by their path in it, with the text before their tests.
fn sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let (mut pending, mut found) = (vec![root.clone()], Vec::new());
    while let Some(path) = pending.pop() {
        if path.is_dir() {
            pending.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_owned();
            let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
            found.push((name, code));
        }
    }
    found.sort();
    assert!(found.len() > 100);
    found
}

/// Files whose code has one of `words`, comments aside.
fn with_words(words: &[&str]) -> Vec<String> {
    let has = |code: &str| {
        let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
        lines.into_iter().any(|line| words.iter().any(|word| line.contains(word)))
    };
    sources().into_iter().filter(|(_, code)| has(code)).map(|(name, _)| name).collect()
}

/// The files of `src` that open, make, rename or remove files, and why. No reader of a format is among them.
const TOUCHING: [(&str, &str); 9] = [
    (
        "cli/interrupt.rs",
        "removes what `cli/output.rs` and `cli/scratch.rs` have made, when it is interrupted; \
         reads which signals the system ignores",
    ),
    (
        "cli/output.rs",
        "makes the outputs that the user names, beside and then renamed, and removes leftovers of them",
    ),
    (
        "cli/scratch.rs",
        "makes the folder of an experiment's files, in the system's for temporary ones",
    ),
    ("cli/stats.rs", "reads what the system tells about this process"),
    (
        "job/study/passage.rs",
        "makes the files of an experiment in the folder that it is given, and reads them",
    ),
    ("mesh/io/direct.rs", "opens the output that it is given once more, past the page cache"),
    (
        "mesh/io/gather.rs",
        "makes a file without a name in the folder of the output, for a mesh that is large",
    ),
    (
        "mesh/io/open.rs",
        "opens the mesh that `mesh::io::input` and the files that `job::loader` was asked for by name",
    ),
    ("num/memory.rs", "reads what the system tells about this process"),
];

#[test]
fn files_are_opened_in_few_places_by_names_that_the_user_gave() {
    let words = [
        "File::open",
        "File::options",
        "File::create",
        "OpenOptions",
        "fs::read",
        "fs::write",
        "fs::copy",
        "fs::rename",
        "fs::hard_link",
        "remove_file",
        "remove_dir",
        "create_dir",
        "tempfile",
    ];
    assert_eq!(with_words(&words), TOUCHING.map(|(file, _)| file));
    // Who reads by that one place, and who writes by `cli/output.rs`.
    assert_eq!(
        with_words(&["io::open::open", "super::open::open", "open::open}"]),
        ["job/loader.rs", "mesh/io/input.rs"]
    );
    assert_eq!(
        with_words(&["Output::open("]),
        ["cli/mesh.rs", "cli/slice.rs", "cli/stats.rs", "cli/study.rs"]
    );
}

#[test]
fn no_code_reaches_for_the_network_or_other_programs() {
    let words = ["std::net", "TcpStream", "UdpSocket", "process::Command", "Command::new"];
    assert_eq!(with_words(&words), Vec::<String>::new());
}

#[test]
fn unsafe_code_is_in_one_file_and_every_block_is_argued() {
    assert_eq!(with_words(&["unsafe "]), ["eval/jit/call.rs"]);
    assert_eq!(with_words(&["allow(unsafe_code)"]), ["eval/jit/call.rs"]);
    let code = sources().into_iter().find(|(name, _)| name == "eval/jit/call.rs").unwrap().1;
    let lines: Vec<&str> = code.lines().collect();
    let mut blocks = 0;
    for (number, line) in lines.iter().enumerate() {
        if line.split("//").next().unwrap_or_default().contains("unsafe ") {
            let above = lines[..number].iter().rev();
            let comment: Vec<&&str> =
                above.take_while(|line| line.trim_start().starts_with("//")).collect();
            let is_argued = comment.iter().any(|line| line.contains("// SAFETY:"));
            assert!(is_argued, "line {}: {line}", number + 1);
            blocks += 1;
        }
    }
    assert_eq!(blocks, 4, "argue for each in the docs of `promises`, and count it here");
}

/// Licences that may be linked into a program under either of its own.
const LICENCES: [&str; 10] = [
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "ISC",
    "NCSA",
    "Unicode-3.0",
    "Zlib",
];

/// Whether an SPDX expression without parentheses inside parentheses can be met by [`LICENCES`].
fn is_permitted(expression: &str) -> bool {
    let choices = expression.replace('/', " OR ").replace(['(', ')'], "");
    // `A OR B AND C` is read as (A OR B) AND C, the stricter way.
    choices.split(" AND ").all(|part| {
        part.split(" OR ").any(|licence| {
            let licence = licence.trim();
            LICENCES.contains(&licence) || ["Unlicense", "CC0-1.0", "0BSD"].contains(&licence)
        })
    })
}

#[test]
fn dependencies_come_from_the_registry_with_their_checksums() {
    let lock = include_str!("../Cargo.lock");
    let packages: Vec<&str> = lock.split("[[package]]").skip(1).collect();
    assert!(packages.len() > 50);
    for package in packages.iter().filter(|package| !package.contains("name = \"alveole")) {
        let registry = "source = \"registry+https://github.com/rust-lang/crates.io-index\"";
        assert!(package.contains(registry) && package.contains("checksum = \""), "{package}");
    }
}

#[test]
fn dependencies_have_permissive_licences() {
    let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
    let output = Command::new(cargo)
        .args(["metadata", "--offline", "--locked", "--format-version", "1"])
        .args(["--filter-platform", "x86_64-unknown-linux-gnu"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    let Some(output) = output.ok().filter(|output| output.status.success()) else {
        println!("skipped: cargo does not tell of the dependencies offline");
        return;
    };
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    assert!(packages.len() > 50);
    for package in packages {
        let name = package["name"].as_str().unwrap();
        if name.starts_with("alveole") {
            continue;
        }
        let licence = package["license"].as_str();
        assert!(licence.is_some_and(is_permitted), "{name}: {licence:?}");
    }
}

#[test]
fn licences_are_read_as_they_are_written() {
    for good in ["MIT", "MIT/Apache-2.0", "(MIT OR Apache-2.0) AND Unicode-3.0", "GPL-3.0 OR MIT"] {
        assert!(is_permitted(good), "{good}");
    }
    for bad in ["GPL-3.0", "MIT AND GPL-2.0", "LGPL-2.1 OR MPL-2.0", ""] {
        assert!(!is_permitted(bad), "{bad}");
    }
}

/// The text of a file of tests, and of the files in the folder of its name.
fn tests_of(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    let mut text = fs::read_to_string(&path).unwrap_or_else(|_| panic!("no {}", path.display()));
    if let Ok(entries) = fs::read_dir(path.with_extension("")) {
        for entry in entries {
            // Pictures are no code, and may be no text of ours.
            text += &fs::read_to_string(entry.unwrap().path()).unwrap_or_default();
        }
    }
    text
}

#[test]
fn every_test_that_the_promises_name_exists() {
    let rows = include_str!("../src/promises.rs").lines();
    let rows: Vec<&str> = rows.filter_map(|line| line.strip_prefix("//! | ")).collect();
    let mut named = 0;
    for row in rows.iter().filter(|row| !row.starts_with("promise |")) {
        let columns: Vec<&str> = row.trim_end_matches(" |").split(" | ").collect();
        assert_eq!(columns.len(), 3, "{row}");
        let mut file = None;
        for quoted in columns[1].split('`').skip(1).step_by(2) {
            if quoted.ends_with(".rs") {
                file = Some((quoted, tests_of(quoted)));
                continue;
            }
            let (path, text) = file.as_ref().unwrap_or_else(|| panic!("no file: {row}"));
            assert!(text.contains(&format!("fn {quoted}(")), "`{quoted}` is not in {path}");
            named += 1;
        }
    }
    assert!(named > 40, "{named} tests are named");
}
