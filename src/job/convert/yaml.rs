//! The part of YAML that configurations of ASLI are written in: `key: value` lines, and one level of
//! such lines below a key.
//!
//! Comments, quotes and blank lines are as in YAML; nothing is ever copied or built, so a text takes
//! no more than its own size. What else YAML has (lists, aliases, texts over several lines, documents)
//! is refused where it stands, not misread.
//!
//! Source: YAML 1.2, sections 6 to 8.

use crate::text::shortened;
use std::fmt;

/// The longest text that is read, in bytes.
pub const LONGEST: usize = 1 << 20;

/// The most lines `key: value`.
pub const MOST: usize = 1000;

/// A place in a text, both numbers from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The line.
    pub line: usize,
    /// The letter of the line.
    pub column: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column {}", self.line, self.column)
    }
}

/// A line `key: value`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The key above it, if there is one.
    pub above: Option<String>,
    /// The key.
    pub key: String,
    /// Where the key is.
    pub key_at: Place,
    /// The value, without quotes; empty if there is none.
    pub value: String,
    /// Where the value is.
    pub value_at: Place,
}

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {cause}")]
pub struct Fault {
    /// Where.
    pub place: Place,
    /// What.
    pub cause: Cause,
}

/// Why a text is not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Cause {
    /// It is too long.
    #[error("the text is longer than {LONGEST} bytes")]
    TooLong,
    /// It has too many entries.
    #[error("the text has more than {MOST} keys")]
    TooMany,
    /// A line is no `key: value`.
    #[error("`{line}` is no `key: value`; put a blank after the colon")]
    NoKey {
        /// The line.
        line: String,
    },
    /// A line is indented by tabs.
    #[error("a tab indents the line; YAML takes blanks only")]
    Tab,
    /// A line is indented and belongs to no key above it, or not as those before it are.
    #[error("the line is not indented as those before it are")]
    Indent,
    /// A form of YAML that is not read.
    #[error("{form} are not read here; write `key: value` lines")]
    Form {
        /// What it is.
        form: &'static str,
    },
    /// A quote is not closed.
    #[error("the quote is not closed on its line")]
    Quote,
    /// Something follows a quote.
    #[error("`{rest}` follows the quote; only a comment may")]
    AfterQuote {
        /// What follows.
        rest: String,
    },
    /// A key is given twice.
    #[error("`{key}` is given twice, first in line {earlier}")]
    Twice {
        /// The key.
        key: String,
        /// The line that gave it first.
        earlier: usize,
    },
}

/// The entries of `text`, in order; a key with lines below it is no entry of its own.
///
/// # Errors
/// [`Fault`], with its place.
pub fn entries(text: &str) -> Result<Vec<Entry>, Fault> {
    if text.len() > LONGEST {
        let place = Place { line: 1, column: 1 };
        return Err(Fault { place, cause: Cause::TooLong });
    }
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut found: Vec<Entry> = Vec::new();
    // How far keys of the first level are indented, and those below the last of them.
    let (mut outer, mut inner): (Option<usize>, Option<usize>) = (None, None);
    let mut above: Option<String> = None;
    for (line, row) in text.split('\n').enumerate().map(|(i, row)| (i + 1, row)) {
        let row = row.strip_suffix('\r').unwrap_or(row);
        let content = row.trim_start_matches(' ');
        let indent = row.len() - content.len();
        let place = |part: &str| {
            let start = part.as_ptr() as usize - row.as_ptr() as usize;
            Place { line, column: row[..start].chars().count() + 1 }
        };
        let fault = |part: &str, cause: Cause| Fault { place: place(part), cause };
        let bare = content.trim();
        if bare.is_empty() || bare.starts_with('#') {
            continue;
        }
        if content.starts_with('\t') {
            return Err(fault(content, Cause::Tab));
        }
        if bare == "---" && found.is_empty() && above.is_none() {
            continue;
        }
        if let Some(form) = other_form(bare) {
            return Err(fault(content, Cause::Form { form }));
        }
        let (key, rest) = key_of(content)
            .ok_or_else(|| fault(content, Cause::NoKey { line: shortened(bare) }))?;
        let value = scalar(rest).map_err(|(part, cause)| fault(part, cause))?;
        let level = *outer.get_or_insert(indent);
        let is_below = indent > level;
        if is_below {
            if above.is_none() || *inner.get_or_insert(indent) != indent {
                return Err(fault(content, Cause::Indent));
            }
        } else if indent == level {
            (above, inner) = (None, None);
        } else {
            return Err(fault(content, Cause::Indent));
        }
        let entry = Entry {
            above: above.clone(),
            key: key.to_owned(),
            key_at: place(content),
            value,
            value_at: place(rest.trim_start()),
        };
        let is_same = |other: &&Entry| other.above == entry.above && other.key == entry.key;
        if let Some(Entry { key_at, .. }) = found.iter().find(is_same) {
            let cause = Cause::Twice { key: shortened(key), earlier: key_at.line };
            return Err(fault(content, cause));
        }
        if found.len() == MOST {
            return Err(fault(content, Cause::TooMany));
        }
        if !is_below && entry.value.is_empty() {
            above = Some(entry.key.clone());
        }
        found.push(entry);
    }
    let heads: Vec<String> = found.iter().filter_map(|entry| entry.above.clone()).collect();
    found.retain(|entry| entry.above.is_some() || !heads.contains(&entry.key));
    Ok(found)
}

/// The key and the rest of a line `key: value`.
fn key_of(content: &str) -> Option<(&str, &str)> {
    let (key, rest) = content.split_once(':')?;
    let key = key.trim_end();
    let is_key = !key.is_empty()
        && key.chars().all(|c| c.is_alphanumeric() || "_-. ".contains(c))
        && (rest.is_empty() || rest.starts_with([' ', '\t']));
    is_key.then_some((key, rest))
}

/// The value that `rest` of a line says, without comment and quotes.
fn scalar(rest: &str) -> Result<String, (&str, Cause)> {
    let text = rest.trim_start();
    if text.starts_with('#') {
        return Ok(String::new());
    }
    let forms = [
        (['[', '{'].as_slice(), "lists and maps in brackets"),
        (&['&', '*'], "anchors and aliases"),
        (&['|', '>'], "texts over several lines"),
        (&['!'], "tags"),
        (&['%', '@', '`'], "words that begin so"),
    ];
    if let Some((_, form)) = forms.iter().find(|(letters, _)| text.starts_with(*letters)) {
        return Err((text, Cause::Form { form }));
    }
    let Some(quote) = text.chars().next().filter(|first| ['\'', '"'].contains(first)) else {
        let end = [" #", "\t#"].iter().filter_map(|mark| text.find(mark)).min();
        return Ok(text[..end.unwrap_or(text.len())].trim_end().to_owned());
    };
    let (mut value, mut letters) = (String::new(), text.char_indices().skip(1).peekable());
    while let Some((at, letter)) = letters.next() {
        let next = letters.peek().map(|(_, next)| *next);
        match letter {
            '\'' if quote == '\'' && next == Some('\'') => {
                value.push('\'');
                letters.next();
            }
            '\\' if quote == '"' => match next {
                Some(escaped @ ('\\' | '"')) => {
                    value.push(escaped);
                    letters.next();
                }
                _ => return Err((&text[at..], Cause::Form { form: "such escapes" })),
            },
            _ if letter == quote => {
                let rest = text[at + 1..].trim_start();
                return if rest.is_empty() || rest.starts_with('#') {
                    Ok(value)
                } else {
                    Err((rest, Cause::AfterQuote { rest: shortened(rest) }))
                };
            }
            _ => value.push(letter),
        }
    }
    Err((text, Cause::Quote))
}

/// What a line is that no entry begins with.
fn other_form(line: &str) -> Option<&'static str> {
    if line.starts_with("- ") || line == "-" {
        Some("lists")
    } else if line.starts_with("---") || line.starts_with("...") || line.starts_with('%') {
        Some("several documents")
    } else if line.starts_with("? ") || line.starts_with(['\'', '"', '[', '{', '&', '*', '!']) {
        Some("such keys")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_keys_and_values_and_some_stand_below_others() {
        let text = "---\n # top\na: 1 # one\nfiles:   # below\n  stl: a b#c.stl\n  q: 'it''s' # q\n\
                    \n  d: \"a\\\"b\"\r\nnone:\nurl: http://x\nlast key: -2.5e3\t# end";
        let found: Vec<_> = entries(text)
            .unwrap()
            .into_iter()
            .map(|entry| (entry.above.unwrap_or_default(), entry.key, entry.value))
            .collect();
        let expected = [
            ("", "a", "1"),
            ("files", "stl", "a b#c.stl"),
            ("files", "q", "it's"),
            ("files", "d", "a\"b"),
            ("", "none", ""),
            ("", "url", "http://x"),
            ("", "last key", "-2.5e3"),
        ];
        let expected = expected.map(|(a, k, v)| (a.to_owned(), k.to_owned(), v.to_owned()));
        assert_eq!(found, expected);
        let places = entries("ä: 1\nb:  2").unwrap();
        assert_eq!(places[0].value_at, Place { line: 1, column: 4 });
        assert_eq!(places[1].value_at, Place { line: 2, column: 5 });
    }

    #[track_caller]
    fn check(text: &str, expected: &str) {
        assert_eq!(entries(text).unwrap_err().to_string(), expected);
    }

    #[test]
    fn other_forms_are_refused_where_they_stand() {
        check("a", "line 1, column 1: `a` is no `key: value`; put a blank after the colon");
        check("a:1", "line 1, column 1: `a:1` is no `key: value`; put a blank after the colon");
        check("\n\ta: 1", "line 2, column 1: a tab indents the line; YAML takes blanks only");
        check("a: 1\n b: 2", "line 2, column 2: the line is not indented as those before it are");
        check(
            "a:\n  b: 2\n   c: 3",
            "line 3, column 4: the line is not indented as those before it are",
        );
        check("  a: 1\nb: 2", "line 2, column 1: the line is not indented as those before it are");
        check("- a", "line 1, column 1: lists are not read here; write `key: value` lines");
        check(
            "a: &b 1",
            "line 1, column 4: anchors and aliases are not read here; write `key: value` lines",
        );
        check(
            "a: [1, 2]",
            "line 1, column 4: lists and maps in brackets are not read here; write `key: value` \
             lines",
        );
        check("a: 'b", "line 1, column 4: the quote is not closed on its line");
        check("a: 'b' c", "line 1, column 8: `c` follows the quote; only a comment may");
        check("a: 1\na: 2", "line 2, column 1: `a` is given twice, first in line 1");
        check(
            "a: 1\n---",
            "line 2, column 1: several documents are not read here; write `key: value` lines",
        );
        let many: String = (0..=MOST).map(|i| format!("a{i}: 1\n")).collect();
        check(&many, "line 1001, column 1: the text has more than 1000 keys");
        check(&"#".repeat(LONGEST + 1), "line 1, column 1: the text is longer than 1048576 bytes");
    }
}
