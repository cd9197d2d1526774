//! The dependency direction of `src/`, kept by a test.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

/// Each module, in order, with the earlier modules it may name as `crate::…`.
const LAYERS: &[(&str, &[&str])] = &[
    ("text", &[]),
    ("num", &[]),
    ("geom", &["num"]),
    ("expr", &["num", "geom"]),
    ("solid", &["num", "geom", "expr"]),
    ("lang", &["num", "geom", "expr", "solid"]),
    ("eval", &["num", "geom", "expr"]),
    ("mesh", &["num", "geom"]),
    ("field", &["text", "num", "geom", "expr", "mesh"]),
    ("octree", &["num", "geom", "eval"]),
    ("contour", &["num", "geom", "eval", "mesh", "octree"]),
    ("measure", &["num", "geom", "expr", "eval", "mesh", "octree", "contour"]),
    ("cellular", &["text", "num", "geom", "expr", "solid", "field", "mesh"]),
    ("vocabulary", &["num", "geom", "expr", "solid", "lang", "field", "cellular", "mesh"]),
    (
        "job",
        &[
            "text",
            "num",
            "geom",
            "expr",
            "solid",
            "lang",
            "eval",
            "mesh",
            "field",
            "octree",
            "contour",
            "measure",
            "cellular",
            "vocabulary",
        ],
    ),
    (
        "cli",
        &[
            "num",
            "geom",
            "expr",
            "solid",
            "lang",
            "eval",
            "mesh",
            "field",
            "octree",
            "contour",
            "measure",
            "cellular",
            "vocabulary",
            "job",
        ],
    ),
    // Documentation only.
    ("performance", &[]),
    ("promises", &[]),
];

#[test]
fn every_module_has_a_layer_above_those_it_uses() {
    let root = fs::read_to_string(src().join("lib.rs")).unwrap();
    for module in root.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';')) {
        assert!(LAYERS.iter().any(|(m, _)| *m == module), "`{module}` is in no layer");
    }
    for (i, (module, allowed)) in LAYERS.iter().enumerate() {
        assert!(!sources(module).is_empty(), "`{module}` has no source");
        for dep in *allowed {
            assert!(LAYERS[..i].iter().any(|(m, _)| m == dep), "`{dep}` is not below `{module}`");
        }
    }
}

#[test]
fn modules_use_only_their_layers() {
    let mut faults = Vec::new();
    for (module, allowed) in LAYERS {
        for (file, text) in sources(module) {
            for (n, line) in text.lines().enumerate() {
                let code = line.split("//").next().unwrap_or_default();
                for path in code.split("crate::").skip(1) {
                    let used =
                        path.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap();
                    if used != *module && !allowed.contains(&used) {
                        faults.push(format!("{file}:{}: `{module}` uses `{used}`", n + 1));
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The paths and texts of `src/<module>.rs` and of every file under `src/<module>/`.
fn sources(module: &str) -> Vec<(String, String)> {
    let mut pending = vec![src().join(module), src().join(format!("{module}.rs"))];
    let mut found = Vec::new();
    while let Some(path) = pending.pop() {
        if path.is_dir() {
            pending.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.is_file() && path.extension().is_some_and(|e| e == "rs") {
            found.push((path.display().to_string(), fs::read_to_string(&path).unwrap()));
        }
    }
    found
}
