//! Splits a program into words, replacing each `@file` by the words of the file.
//!
//! A file holds words separated by blanks and line ends. A word that begins with `'` or `"` goes to
//! the next such quote, blanks and all; quotes elsewhere are ordinary letters (`g'` is a word). A
//! `#` at the beginning of a word begins a comment to the end of the line. Files may name files.
//!
//! Words that are inputs of other tools are replaced by the words of their translations, which name
//! no further files of words.
//!
//! Source: the Cesogen paper has `@file` without quotes, comments or nesting; those are ours.

use super::source::offset;
use super::{Diagnostic, Loader, Rejected, Sources, Span, Translation};

/// Files within files, at most.
const DEPTH_LIMIT: usize = 16;
/// Bytes of all files together, at most.
const SIZE_LIMIT: usize = 1 << 26;

/// Faults that are told at once.
const FAULT_LIMIT: usize = 20;
/// Words of a program, those of its files included, at most: enough for a hundred thousand parts.
const WORD_LIMIT: usize = 1 << 20;

/// A word of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Token {
    /// The word, without quotes.
    pub text: String,
    /// Where it stands, without quotes.
    pub span: Span,
}

/// A file being read: its name and the words that are still to come, last first.
struct Open {
    name: Option<String>,
    rest: Vec<Token>,
}

/// The words of the command line in `sources`; the files they name are added to `sources`.
///
/// # Errors
/// Diagnostics for files that can't be read, contain themselves, or are too many or too large.
pub fn expand(
    sources: &mut Sources,
    loader: &mut dyn Loader,
) -> Result<Vec<Token>, Vec<Diagnostic>> {
    let command_line = &sources.all()[0];
    let arguments = command_line.words.iter().enumerate().map(|(index, range)| Token {
        text: command_line.text[range.clone()].to_owned(),
        span: command_line.word(index),
    });
    let mut open = vec![Open { name: None, rest: arguments.rev().collect() }];
    let (mut words, mut faults, mut size) = (Vec::new(), Vec::new(), 0);
    while let Some(current) = open.last_mut() {
        let Some(word) = current.rest.pop() else {
            open.pop();
            continue;
        };
        let Some(path) = word.text.strip_prefix('@') else {
            match loader.translation(&word.text, word.span) {
                None => words.push(word),
                Some(translated) => match translated.and_then(|translation| {
                    translated_words(translation, &mut size, sources).map_err(Box::new)
                }) {
                    Ok(rest) => words.extend(rest.into_iter().rev()),
                    Err(fault) => faults.push(*fault),
                },
            }
            continue;
        };
        match included(path, &word, &open, &mut size, sources, loader) {
            Ok(rest) => open.push(Open { name: Some(path.to_owned()), rest }),
            Err(fault) => faults.push(fault),
        }
        let pending: usize = open.iter().map(|file| file.rest.len()).sum();
        if words.len() + pending > WORD_LIMIT {
            let message = format!("the program has more than {WORD_LIMIT} words");
            faults.push(Diagnostic::new(message).at(word.span, "with those of this file"));
        }
        if faults.len() >= FAULT_LIMIT || words.len() + pending > WORD_LIMIT {
            break;
        }
    }
    if faults.is_empty() { Ok(words) } else { Err(faults) }
}

/// The words of `translation`, last first.
fn translated_words(
    translation: Translation,
    size: &mut usize,
    sources: &mut Sources,
) -> Result<Vec<Token>, Diagnostic> {
    let Translation { name, text } = translation;
    *size += text.len();
    if *size > SIZE_LIMIT {
        return Err(too_large());
    }
    let source = sources.add(&name, text);
    split(&sources.all()[source as usize].text, source)
}

fn too_large() -> Diagnostic {
    Diagnostic::new(format!("the files of the program exceed {} MiB", SIZE_LIMIT >> 20))
}

/// The words of the file `path`, last first.
fn included(
    path: &str,
    word: &Token,
    open: &[Open],
    size: &mut usize,
    sources: &mut Sources,
    loader: &mut dyn Loader,
) -> Result<Vec<Token>, Diagnostic> {
    let fault = |message: String, text: &str| Diagnostic::new(message).at(word.span, text);
    if path.is_empty() {
        return Err(fault("`@` names no file".to_owned(), "").cure("write `@file` without a blank"));
    }
    if open.iter().any(|file| file.name.as_deref() == Some(path)) {
        return Err(fault(format!("`{path}` contains itself"), "is being read already"));
    }
    if open.len() > DEPTH_LIMIT {
        return Err(fault(format!("files are nested more than {DEPTH_LIMIT} deep"), ""));
    }
    let text = loader
        .text(path)
        .map_err(|refusal| fault(format!("can't read `{path}`: {refusal}"), "").of_a_file())?;
    *size += text.len();
    if *size > SIZE_LIMIT {
        return Err(too_large().at(word.span, ""));
    }
    let source = sources.add(path, text);
    split(&sources.all()[source as usize].text, source)
}

/// The words of a program that is written as one text, with quotes and comments as in files.
///
/// # Errors
/// [`Rejected`] when a quote is not closed.
pub fn of(text: &str) -> Result<Vec<String>, Rejected> {
    let mut sources = Sources::new(&[]);
    let source = sources.add("program", text.to_owned());
    match split(text, source) {
        Ok(words) => Ok(words.into_iter().rev().map(|word| word.text).collect()),
        Err(fault) => Err(Rejected { diagnostics: vec![fault], sources }),
    }
}

/// The words of `text`, last first.
fn split(text: &str, source: u32) -> Result<Vec<Token>, Diagnostic> {
    let mut words = Vec::new();
    let mut letters = text.char_indices().peekable();
    while let Some((start, letter)) = letters.next() {
        if letter.is_whitespace() || letter == '\u{feff}' {
            continue;
        }
        let end_of = |from: usize, ends: &dyn Fn(char) -> bool| {
            text[from..].find(ends).map(|length| from + length)
        };
        let (start, end, next) = match letter {
            '#' => {
                let end = end_of(start, &|c| c == '\n').unwrap_or(text.len());
                (start, start, end)
            }
            '\'' | '"' => {
                let Some(end) = end_of(start + 1, &|c| c == letter) else {
                    let span = Span { source, start: offset(start), end: offset(start + 1) };
                    let fault = Diagnostic::new("a quote is not closed").at(span, "opens here");
                    return Err(fault.cure(format!("close it by another `{letter}`")));
                };
                (start + 1, end, end + 1)
            }
            _ => {
                let end = end_of(start, &char::is_whitespace).unwrap_or(text.len());
                (start, end, end)
            }
        };
        if letter != '#' {
            let span = Span { source, start: offset(start), end: offset(end) };
            if words.len() == WORD_LIMIT {
                let fault =
                    Diagnostic::new(format!("the program has more than {WORD_LIMIT} words"));
                return Err(fault.at(span, "is one too many"));
            }
            words.push(Token { text: text[start..end].to_owned(), span });
        }
        while letters.next_if(|(at, _)| *at < next).is_some() {}
    }
    words.reverse();
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: &[&str]) {
        let words = split(text, 0).unwrap();
        let found: Vec<_> = words.iter().rev().map(|word| word.text.as_str()).collect();
        assert_eq!(found, expected, "{text}");
        for word in &words {
            assert_eq!(text[word.span.start as usize..word.span.end as usize], word.text);
        }
    }

    #[test]
    fn files_split_at_blanks_outside_quotes() {
        check("", &[]);
        check(" box\n\tsphere ", &["box", "sphere"]);
        check("'x + y' \"z\"", &["x + y", "z"]);
        check("'a\nb'", &["a\nb"]);
        check("'' box", &["", "box"]);
        check("'a''b'", &["a", "b"]);
        check("g' d'", &["g'", "d'"]);
        check("\u{feff}box", &["box"]);
        check("π\u{a0}ξ", &["π", "ξ"]);
    }

    #[test]
    fn comments_begin_with_a_word() {
        check("box # sphere 'not open\ncone", &["box", "cone"]);
        check("#all", &[]);
        check("a#b '#c'", &["a#b", "#c"]);
    }

    #[test]
    fn an_open_quote_is_a_fault() {
        assert_eq!(split("box 'x", 0).unwrap_err().message, "a quote is not closed");
    }
}
