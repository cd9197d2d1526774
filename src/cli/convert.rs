//! `alveole convert`: inputs of other tools as programs.

use super::args::ConvertArguments;
use super::report::{self, Trouble};
use crate::job::{self, Files, convert};
use crate::lang::{self, Span, Text, Token};

/// Prints the program that the words stand for, in the lines of their translations.
pub(super) fn run(arguments: &ConvertArguments) -> Result<(), Trouble> {
    let ConvertArguments { program, quiet } = arguments;
    let mut files = Files::default();
    let text = lang::expand(program, &mut files).map_err(job::Error::from)?;
    if !quiet {
        report::conversions("alveole convert", &files.into_notes().conversions);
    }
    report::print(&printed(&text))
}

/// The words, those of different texts and lines on lines of their own.
fn printed(text: &Text) -> String {
    let mut printed = String::new();
    let mut last: Option<Span> = None;
    for Token { text: word, span } in &text.words {
        if let Some(last) = last {
            let between = Span { start: last.end, end: span.start, ..*span };
            let is_same_line =
                last.source == span.source && !text.sources.text(between).contains('\n');
            printed.push(if is_same_line { ' ' } else { '\n' });
        }
        last = Some(*span);
        // A word that no quotes go around came without them: a shell's quotes are not a program's.
        printed.push_str(&convert::quoted(word).unwrap_or_else(|| word.clone()));
    }
    printed.push('\n');
    printed
}
