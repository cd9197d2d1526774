//! Inputs of other tools, as programs.
//!
//! What another tool was told is said again in the words of the language, so that its users see what
//! is made, can go on from there, and need nothing but words from then on: `alveole convert` prints
//! the program. Nothing here reads files; what is needed of them is asked for.
//!
//! * [`asli`]: configurations of ASLI, `config.yml`, with its files of points.
//! * [`scaffolder`]: Scaffolder's line, as `scaffolder:gyroid,0.6283,0.61`.

pub mod asli;
mod fits;
mod formula;
pub mod scaffolder;
pub mod yaml;

/// A program, and what is to be said about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Converted {
    /// The program's text, as a file would hold it.
    pub text: String,
    /// What became of what has no counterpart; one line each.
    pub remarks: Vec<String>,
}

/// `word` as a word of a program text and of a shell, in quotes unless they need none; `None` if no
/// quotes go around it.
#[must_use]
pub fn quoted(word: &str) -> Option<String> {
    let is_plain = !word.is_empty()
        && !word.starts_with('@')
        && word.chars().all(|c| c.is_ascii_alphanumeric() || "_-./,:+=%@".contains(c));
    if is_plain {
        return Some(word.to_owned());
    }
    let quote = ['\'', '"'].into_iter().find(|quote| !word.contains(*quote))?;
    Some(format!("{quote}{word}{quote}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::words;

    #[test]
    fn quoted_words_read_back() {
        for word in ["box", "a b.stl", "it's", "#1", "'", "", "\u{feff}x", "@a", "x+[a b.fap]"] {
            assert_eq!(words::of(&quoted(word).unwrap()).unwrap(), [word], "{word}");
        }
        assert_eq!(quoted("'\" "), None);
    }
}
