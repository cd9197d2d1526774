//! `alveole list`: the words of the language, and the completions that know them.

use super::args::ListArguments;
use super::report::{self, Trouble};
use crate::lang::{Argument, names, word};
use crate::vocabulary::{self, Exactness, Family, Kind, Row};
use clap_complete::Shell;
use std::fmt::Write;

#[derive(serde::Serialize)]
struct Entry {
    name: &'static str,
    aliases: &'static [&'static str],
    kind: &'static str,
    field: Option<&'static str>,
    formula: Option<&'static str>,
    arguments: Vec<ArgumentEntry>,
    help: &'static str,
    source: &'static str,
}

#[derive(serde::Serialize)]
struct ArgumentEntry {
    name: &'static str,
    default: Option<&'static str>,
    meaning: &'static str,
}

/// Lists all words, or explains some.
pub(super) fn run(arguments: &ListArguments) -> Result<(), Trouble> {
    let ListArguments { words, json, markdown } = arguments;
    let mut rows = Vec::new();
    for word in words {
        rows.push(find(word)?);
    }
    let explain = !rows.is_empty();
    if !explain {
        rows.extend(vocabulary::rows());
    }
    let text = if *json {
        super::stats::json(&rows.into_iter().map(entry).collect::<Vec<_>>())
    } else if *markdown {
        reference(&rows)
    } else if explain {
        rows.into_iter().map(explanation).collect::<Vec<_>>().join("\n")
    } else {
        overview(&rows)
    };
    report::print(&text)
}

/// Prints the completion script of `shell`.
pub(super) fn completions(shell: Shell, command: &mut clap::Command) -> Result<(), Trouble> {
    let words: Vec<_> = vocabulary::rows().iter().map(|row| row.name).collect();
    // The program may also name files, so the words are possible values only in the script.
    let known = clap::builder::PossibleValuesParser::new(words);
    let described = ["mesh", "measure"].into_iter().fold(command.clone(), |command, name| {
        let known = known.clone();
        command.mut_subcommand(name, |sub| sub.mut_arg("program", |arg| arg.value_parser(known)))
    });
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut described.clone(), "alveole", &mut script);
    report::print(&String::from_utf8_lossy(&script))
}

/// The words in short, for the end of the help.
pub(super) fn summary() -> String {
    let names = |wanted: fn(&Kind) -> bool| {
        let names: Vec<_> = (vocabulary::rows().iter())
            .filter(|row| wanted(&row.kind))
            .map(|row| match row.arguments {
                [] => row.name.to_owned(),
                list if matches!(row.kind, Kind::Shape { .. }) => {
                    format!("{} [{}]", row.name, keys(list))
                }
                list => format!("{} {}", row.name, keys(list).to_uppercase()),
            })
            .collect();
        names.join(", ")
    };
    format!(
        "A program is a list of words in postfix order; what is left on the stack is intersected.\n\n\
         Shapes: {}.\n\nPeriodic surfaces: {}.\n\nCells of struts and plates: {}.\n\nRandom solids: {}.\n\nOperations on the last shape: {}.\n\n\
         Operations on the last two shapes: {}.\n\nAnything else is a mesh file (.ply .stl .3mf .obj .off), \
         a lattice file (.cell .cell.json .ltcx), an equation in x, y and z with the functions {}, or @FILE, which stands for the words in a file. \
         In equations, [FILE.fap] and [FILE.sap] are numbers and sizes between the points of a file of lines x,y,z,value.\n\n\
         Inputs of other tools stand for programs, which `alveole convert` prints: CONFIG.yml of ASLI, and a line of Scaffolder as \
         scaffolder:gyroid,6.28,0.3.\n\n\
         `alveole list WORD` explains a word and says whether its field is a distance. Exit codes: 0 done, \
         1 the work failed, 2 the command line or the program is wrong, 130 interrupted.",
        names(|kind| matches!(kind, Kind::Shape { family: Family::Primitive, .. })),
        names(|kind| matches!(kind, Kind::Shape { family: Family::Surface { .. }, .. })),
        names(|kind| matches!(kind, Kind::Shape { family: Family::Cell, .. })),
        names(|kind| matches!(kind, Kind::Shape { family: Family::Random, .. })),
        names(|kind| matches!(kind, Kind::Motion(_) | Kind::Unary(_))),
        names(|kind| matches!(kind, Kind::Binary(_))),
        names::Function::all().map(names::Function::name).collect::<Vec<_>>().join(" "),
    )
}

fn keys(arguments: &[Argument]) -> String {
    arguments.iter().map(|argument| argument.name).collect::<Vec<_>>().join(" ")
}

fn find(word: &str) -> Result<&'static Row, Trouble> {
    vocabulary::row(&word::normalized(word)).ok_or_else(|| {
        let known = vocabulary::rows().iter().flat_map(Row::spellings);
        let near = names::nearest(word, known).into_iter().map(str::to_owned).collect();
        Trouble::Word { word: word.to_owned(), near }
    })
}

/// The heading of the words of a kind.
fn heading(kind: &Kind) -> &'static str {
    match kind {
        Kind::Shape { family: Family::Primitive, .. } => "shapes",
        Kind::Shape { family: Family::Surface { .. }, .. } => "periodic surfaces",
        Kind::Shape { family: Family::Cell, .. } => "cells of struts and plates",
        Kind::Shape { family: Family::Random, .. } => "random solids",
        Kind::Motion(_) | Kind::Unary(_) => "operations on one shape",
        Kind::Binary(_) => "operations on two shapes",
    }
}

fn kind(kind: &Kind) -> &'static str {
    match kind {
        Kind::Shape { family: Family::Primitive, .. } => "shape",
        Kind::Shape { family: Family::Surface { .. }, .. } => "periodic surface",
        Kind::Shape { family: Family::Cell, .. } => "cell of struts or plates",
        Kind::Shape { family: Family::Random, .. } => "random solid",
        Kind::Motion(_) | Kind::Unary(_) => "operation on one shape",
        Kind::Binary(_) => "operation on two shapes",
    }
}

fn field(kind: &Kind) -> Option<&'static str> {
    match kind {
        Kind::Shape { exactness, .. } => Some(match exactness {
            Exactness::Distance => "distance",
            Exactness::Bound => "bound of the distance",
            Exactness::LevelSet => "level set",
        }),
        Kind::Motion(_) | Kind::Unary(_) | Kind::Binary(_) => None,
    }
}

fn formula(kind: &Kind) -> Option<&'static str> {
    match kind {
        Kind::Shape { family: Family::Surface { formula }, .. } => Some(formula),
        Kind::Shape { family: Family::Primitive | Family::Cell | Family::Random, .. } => None,
        Kind::Motion(_) | Kind::Unary(_) | Kind::Binary(_) => None,
    }
}

fn entry(row: &Row) -> Entry {
    let argument =
        |a: &Argument| ArgumentEntry { name: a.name, default: a.default(), meaning: a.meaning };
    Entry {
        name: row.name,
        aliases: row.aliases,
        kind: kind(&row.kind),
        field: field(&row.kind),
        formula: formula(&row.kind),
        arguments: row.arguments.iter().map(argument).collect(),
        help: row.help,
        source: row.source,
    }
}

/// One line a word, grouped by kind.
fn overview(rows: &[&Row]) -> String {
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    let mut last = "";
    for row in rows {
        let heading = heading(&row.kind);
        if heading != last {
            let gap = if text.is_empty() { "" } else { "\n" };
            // Writing to a string can't fail, here and below.
            let _ = writeln!(text, "{gap}{heading}:");
            last = heading;
        }
        let field = field(&row.kind).map_or_else(String::new, |field| format!(" [{field}]"));
        let _ = writeln!(text, "  {:width$}  {}{field}", row.name, row.help);
    }
    text
}

/// Everything about a word.
fn explanation(row: &Row) -> String {
    let mut text = format!("{}: {}\n", row.name, row.help);
    let mut line = |name: &str, value: &str| {
        let _ = writeln!(text, "  {name:9} {value}");
    };
    line("kind", kind(&row.kind));
    if !row.aliases.is_empty() {
        line("also", &row.aliases.join(", "));
    }
    if let Some(field) = field(&row.kind) {
        line("field", field);
    }
    if let Some(formula) = formula(&row.kind) {
        line("formula", formula);
    }
    for argument in row.arguments {
        let default =
            argument.default().map_or_else(String::new, |default| format!(" (default {default})"));
        line("argument", &format!("{}: {}{default}", argument.name, argument.meaning));
    }
    line("source", row.source);
    text
}

/// The reference of all words as a Markdown table.
fn reference(rows: &[&Row]) -> String {
    let mut text = String::from(
        "| word | also | arguments | field | what it is |\n| --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        let quoted =
            |names: &[&str]| names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(" ");
        let arguments: Vec<_> = (row.arguments.iter())
            .map(|a| {
                a.default().map_or_else(|| format!("`{}`", a.name), |d| format!("`{} {d}`", a.name))
            })
            .collect();
        let what = row.help.replace('|', "\\|");
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} | {what} |",
            row.name,
            quoted(row.aliases),
            arguments.join(" "),
            field(&row.kind).unwrap_or("")
        );
    }
    text
}
