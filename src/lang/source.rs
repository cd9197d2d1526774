//! The texts of a program: the command line and the files that it names.

use super::Span;
use std::ops::Range;

/// All texts of a program; a [`Span`] says which one by number.
#[derive(Clone, Debug)]
pub struct Sources(Vec<Source>);

/// One text of a program.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file it was read from; `None` for the command line.
    pub file: Option<String>,
    /// The text. The command line is its words joined by blanks, those with blanks in quotes.
    pub text: String,
    /// Where each word of the command line stands in the text; empty for files.
    pub words: Vec<Range<usize>>,
}

/// Where a span begins, as people say it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In a word of the program on the command line, counted from 1.
    Argument(usize),
    /// In a file.
    File {
        /// The file's name as the program gives it.
        name: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
    },
}

impl Source {
    /// The span of word `index` of the command line.
    pub(super) fn word(&self, index: usize) -> Span {
        let Range { start, end } = self.words.get(index).cloned().unwrap_or_default();
        Span { source: 0, start: offset(start), end: offset(end) }
    }
}

/// A position in a source. Positions beyond 4 GiB, which no source reaches that we read, are
/// pinned there: messages would then point to the wrong place, and nothing else depends on them.
pub(super) fn offset(position: usize) -> u32 {
    u32::try_from(position).unwrap_or(u32::MAX)
}

impl Sources {
    /// The text of the command line with the words `arguments`.
    #[must_use]
    pub fn new(arguments: &[String]) -> Self {
        let mut text = String::new();
        let mut words = Vec::with_capacity(arguments.len());
        for argument in arguments {
            if !text.is_empty() {
                text.push(' ');
            }
            // Quotes are for the eye: the span of a word leaves them out, and nothing reads them.
            let quote = match argument {
                word if !word.is_empty() && !word.contains(char::is_whitespace) => "",
                word if word.contains('\'') => "\"",
                _ => "'",
            };
            text.push_str(quote);
            words.push(text.len()..text.len() + argument.len());
            text.push_str(argument);
            text.push_str(quote);
        }
        Self(vec![Source { file: None, text, words }])
    }

    /// Every source, the command line first.
    #[must_use]
    pub fn all(&self) -> &[Source] {
        &self.0
    }

    /// The source that holds `span`; `None` for [`Span::NOWHERE`].
    #[must_use]
    pub fn source(&self, span: Span) -> Option<&Source> {
        self.0.get(span.source as usize)
    }

    /// The text at `span`, empty if there is none.
    #[must_use]
    pub fn text(&self, span: Span) -> &str {
        let range = span.start as usize..span.end as usize;
        self.source(span).and_then(|source| source.text.get(range)).unwrap_or_default()
    }

    /// Where `span` begins.
    #[must_use]
    pub fn place(&self, span: Span) -> Option<Place> {
        let source = self.source(span)?;
        let start = span.start as usize;
        let Some(name) = &source.file else {
            let index = source.words.partition_point(|word| word.end < start);
            return Some(Place::Argument(index + 1));
        };
        let before = source.text.get(..start)?;
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Some(Place::File {
            name: name.clone(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        })
    }

    /// Adds the text of a file and returns its number.
    pub(super) fn add(&mut self, file: &str, text: String) -> u32 {
        self.0.push(Source { file: Some(file.to_owned()), text, words: Vec::new() });
        (self.0.len() - 1) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources(words: &[&str]) -> Sources {
        Sources::new(&words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn words_with_blanks_are_shown_in_quotes_and_spans_leave_them_out() {
        let sources = sources(&["box", "x + 1", "it's x", ""]);
        assert_eq!(sources.all()[0].text, "box 'x + 1' \"it's x\" ''");
        let words = &sources.all()[0].words;
        assert_eq!(&sources.all()[0].text[words[1].clone()], "x + 1");
        assert_eq!(&sources.all()[0].text[words[2].clone()], "it's x");
    }

    #[test]
    fn places_are_arguments_or_lines_and_columns() {
        let mut sources = sources(&["box", "@f"]);
        let span = Span { source: 0, start: 4, end: 6 };
        assert_eq!(sources.place(span), Some(Place::Argument(2)));
        let number = sources.add("f", "box\n  χ sphere".to_owned());
        let span = Span { source: number, start: 9, end: 15 };
        let place = Place::File { name: "f".to_owned(), line: 2, column: 5 };
        assert_eq!(sources.place(span), Some(place));
        assert_eq!(sources.text(span), "sphere");
        assert_eq!(sources.place(Span::NOWHERE), None);
    }
}
