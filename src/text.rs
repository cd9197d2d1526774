//! Places in small text files, and what messages show of their words.
//!
//! For readers of lattices, points and configurations, whose files are text of a few megabytes at
//! most. Meshes have places of their own ([`crate::mesh::io`]), programs have spans ([`crate::lang`]).

use std::fmt;

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A letter, both numbers from 1.
    At {
        /// The line.
        line: usize,
        /// The letter of the line.
        column: usize,
    },
    /// An entry of a list, from 1.
    Entry {
        /// What the list holds.
        what: &'static str,
        /// Its number.
        number: usize,
    },
}

impl Place {
    /// The place of the byte `offset` of `text`.
    #[must_use]
    pub fn of_byte(text: &str, offset: usize) -> Self {
        let before = text.get(..offset.min(text.len())).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        Self::At {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::At { line, column } => write!(f, "line {line}, column {column}: "),
            Self::Entry { what, number } => write!(f, "{what} {number}: "),
        }
    }
}

/// The beginning of `word`, which may be a whole file, as a message shows it.
#[must_use]
pub fn shortened(word: &str) -> String {
    const LENGTH: usize = 40;
    match word.char_indices().nth(LENGTH) {
        Some((end, _)) => format!("{}...", &word[..end]),
        None => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_lines_and_letters_from_one() {
        let text = "a\nbé c\n";
        let place = |offset| Place::of_byte(text, offset).to_string();
        assert_eq!(place(0), "line 1, column 1: ");
        assert_eq!(place(6), "line 2, column 4: ");
        assert_eq!(place(100), "line 3, column 1: ");
        assert_eq!(Place::Whole.to_string(), "");
        assert_eq!(Place::Entry { what: "node", number: 3 }.to_string(), "node 3: ");
    }

    #[test]
    fn words_are_shown_up_to_forty_letters() {
        assert_eq!(shortened("short"), "short");
        assert_eq!(shortened(&"é".repeat(40)), "é".repeat(40));
        assert_eq!(shortened(&"é".repeat(41)), format!("{}...", "é".repeat(40)));
    }
}
