//! Diagnostics as pictures: each case of `pictures/*.txt` is a program and what is said about it.
//!
//! A case is a line `$ program`, perhaps with parameters in front (`$ {t=0} sphere scale t`),
//! and the picture below it. To write the pictures anew, run with `ALVEOLE_BLESS=1` and read the
//! difference.

use crate::support::{Field, parse, shell};
use alveole::lang::{Diagnostic, Place, Sources};
use alveole::solid::Span;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

#[test]
fn faults_of_words() {
    check("words");
}

#[test]
fn faults_of_arguments() {
    check("arguments");
}

#[test]
fn faults_of_equations() {
    check("equations");
}

#[test]
fn faults_of_files() {
    check("files");
}

#[test]
fn faults_of_bounds() {
    check("bounds");
}

#[test]
fn faults_of_parameters() {
    check("parameters");
}

/// Compares every case of `pictures/<name>.txt` with what the language says now.
fn check(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/language/pictures")
        .join(format!("{name}.txt"));
    let expected = fs::read_to_string(&path).unwrap();
    let mut found = String::new();
    for case in expected.lines().filter(|line| line.starts_with("$ ")) {
        if !found.is_empty() {
            found.push('\n');
        }
        writeln!(found, "{case}").unwrap();
        found.push_str(&picture(&case[2..]));
    }
    if std::env::var_os("ALVEOLE_BLESS").is_some() {
        fs::write(&path, &found).unwrap();
    }
    assert_eq!(found, expected, "{name}.txt");
}

/// What the language says about `program`, or the box of its solid.
fn picture(program: &str) -> String {
    let (parameters, line) = match program.strip_prefix('{').and_then(|rest| rest.split_once("} "))
    {
        Some((parameters, line)) => (parameters, line),
        None => ("", program),
    };
    let parameters: Vec<(&str, f64)> = parameters
        .split_whitespace()
        .map(|pair| pair.split_once('=').map(|(name, value)| (name, value.parse().unwrap())))
        .collect::<Option<_>>()
        .unwrap();
    let words = shell(line);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match parse(&words, &parameters) {
        Err(rejected) => {
            assert!(!rejected.diagnostics.is_empty());
            let all = rejected.diagnostics.iter();
            all.map(|diagnostic| render(diagnostic, &rejected.sources)).collect()
        }
        Ok(program) => match program.solid.finite_bounds(&program.graph, &program.values()) {
            Err(fault) => render(&fault.into(), &program.sources),
            Ok(bounds) => format!("{} .. {}\n", bounds.lo, bounds.hi),
        },
    }
}

/// A diagnostic as plain text.
fn render(diagnostic: &Diagnostic, sources: &Sources) -> String {
    let mut text = format!("error: {}\n", diagnostic.message);
    for label in &diagnostic.labels {
        let Some(source) = sources.source(label.span) else { continue };
        match sources.place(label.span).unwrap() {
            Place::Argument(number) => writeln!(text, "  --> argument {number}"),
            Place::File { name, line, column } => writeln!(text, "  --> {name}:{line}:{column}"),
        }
        .unwrap();
        let Span { start, end, .. } = label.span;
        let (start, end) = (start as usize, end as usize);
        let from = source.text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let line = source.text[from..].lines().next().unwrap_or_default();
        let before = source.text[from..start].chars().count();
        let carets = source.text[start..end].chars().count().max(1);
        let shown: String = line.chars().take(100).collect();
        writeln!(text, "   | {shown}").unwrap();
        let marks = format!("{}{}", " ".repeat(before), "^".repeat(carets.min(100)));
        writeln!(text, "   | {}", format!("{marks} {}", label.text).trim_end()).unwrap();
    }
    if let Some(cure) = &diagnostic.cure {
        writeln!(text, "   = help: {cure}").unwrap();
    }
    text
}
