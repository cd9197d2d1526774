//! Splits an equation into numbers, names and signs.

use super::{Diagnostic, Span};

/// A part of an equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lexeme<'a> {
    /// A number without sign.
    Number(f64),
    /// The name of a coordinate, constant, parameter or function.
    Name(&'a str),
    /// What stands in brackets: a file of points, and what of it is meant.
    Points(&'a str),
    /// One of `+ - * / ^ ( ) ,`; `**` is read as `^`.
    Sign(char),
    /// The end of the text.
    End,
}

/// What brackets are for.
const BRACKETS: &str = "write `[FILE]` for numbers at points of a file, or `(...)` for parentheses";

/// The parts of `text`, whose first byte is at `span`, each with its place; [`Lexeme::End`] last.
///
/// # Errors
/// The first letter or number that no equation has.
pub fn lexemes(text: &str, span: Span) -> Result<Vec<(Lexeme<'_>, Span)>, Diagnostic> {
    let place = |start: usize, end: usize| Span {
        start: span.start.saturating_add(start as u32),
        end: span.start.saturating_add(end as u32),
        ..span
    };
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(letter) = text[at..].chars().next() {
        let rest = &text[at..];
        let (lexeme, length) = match letter {
            _ if letter.is_whitespace() => {
                at += letter.len_utf8();
                continue;
            }
            '*' if rest.starts_with("**") => (Lexeme::Sign('^'), 2),
            '+' | '-' | '*' | '/' | '^' | '(' | ')' | ',' => (Lexeme::Sign(letter), 1),
            '0'..='9' | '.' => {
                let length = number_length(rest);
                let here = place(at, at + length);
                let value: f64 = rest[..length].parse().map_err(|_| {
                    Diagnostic::new(format!("`{}` is not a number", &rest[..length])).at(here, "")
                })?;
                if !value.is_finite() {
                    let fault = Diagnostic::new("a number is too large").at(here, "");
                    return Err(fault.cure("the largest number is about 1.8e308"));
                }
                (Lexeme::Number(value), length)
            }
            '[' => {
                let Some(length) = rest.find(']') else {
                    let fault = Diagnostic::new("a bracket is not closed");
                    let fault = fault.at(place(at, at + 1), "opens here");
                    return Err(fault.cure(BRACKETS));
                };
                let inner = rest[1..length].trim();
                if inner.is_empty() {
                    let fault = Diagnostic::new("the brackets name no file of points");
                    return Err(fault.at(place(at, at + length + 1), "").cure(BRACKETS));
                }
                (Lexeme::Points(inner), length + 1)
            }
            _ if letter.is_ascii_alphabetic() || letter == '_' => {
                let ends = |c: char| !(c.is_ascii_alphanumeric() || c == '_');
                let length = rest.find(ends).unwrap_or(rest.len());
                (Lexeme::Name(&rest[..length]), length)
            }
            _ => {
                let here = place(at, at + letter.len_utf8());
                let fault = Diagnostic::new(format!("`{letter}` has no meaning in an equation"))
                    .at(here, "");
                return Err(match plain_form(letter) {
                    Some(plain) => fault.cure(format!("write `{plain}`")),
                    None if letter == '=' => fault.cure(EQUALITY),
                    None => fault,
                });
            }
        };
        found.push((lexeme, place(at, at + length)));
        at += length;
    }
    found.push((Lexeme::End, place(text.len(), text.len())));
    Ok(found)
}

/// What to write in place of an equality.
const EQUALITY: &str = "an equation is a field, negative inside the solid: for the surface `a = b` \
                        write `a-b`, or `b-a` for its other side";

/// Length of the number at the beginning of `text`: digits, a point, and an exponent if digits
/// follow it, so that the `e` of `2e` stays a name.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    if bytes.get(length) == Some(&b'.') {
        length += 1;
        length += digits(length);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = bytes.get(length + 1 + sign..).map_or(0, |_| digits(length + 1 + sign));
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}

/// What to write for signs of print that papers and word processors put in equations.
fn plain_form(letter: char) -> Option<&'static str> {
    match letter {
        '\u{2212}' | '\u{2013}' | '\u{2014}' => Some("-"),
        '\u{2217}' | '\u{d7}' | '\u{b7}' | '\u{22c5}' => Some("*"),
        '\u{f7}' | '\u{2215}' => Some("/"),
        'π' => Some("pi"),
        'τ' => Some("tau"),
        '²' => Some("^2"),
        '³' => Some("^3"),
        '√' => Some("sqrt(...)"),
        '{' => Some("("),
        ']' | '}' => Some(")"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: &[Lexeme<'_>]) {
        let span = Span { source: 0, start: 0, end: text.len() as u32 };
        let found: Vec<_> = lexemes(text, span).unwrap().into_iter().map(|(l, _)| l).collect();
        let (end, found) = found.split_last().unwrap();
        assert_eq!(*end, Lexeme::End);
        assert_eq!(found, expected, "{text}");
    }

    #[test]
    fn numbers_names_and_signs() {
        use Lexeme::{Name, Number, Points, Sign};
        check("2*[ a b,c (1.fap ]", &[Number(2.0), Sign('*'), Points("a b,c (1.fap")]);
        check("", &[]);
        check("1", &[Number(1.0)]);
        check(" .5 5. 1.25e-3 2E2 ", &[Number(0.5), Number(5.0), Number(1.25e-3), Number(200.0)]);
        check("2e", &[Number(2.0), Name("e")]);
        check("2e+x", &[Number(2.0), Name("e"), Sign('+'), Name("x")]);
        check("x**y^2", &[Name("x"), Sign('^'), Name("y"), Sign('^'), Number(2.0)]);
        check(
            "atan2(_a1,-b)",
            &[Name("atan2"), Sign('('), Name("_a1"), Sign(','), Sign('-'), Name("b"), Sign(')')],
        );
    }

    #[test]
    fn foreign_letters_and_bad_numbers_are_faults() {
        let check = |text: &str, message: &str| {
            let span = Span { source: 0, start: 0, end: text.len() as u32 };
            assert_eq!(lexemes(text, span).unwrap_err().message, message);
        };
        check("[a", "a bracket is not closed");
        check("2*[ ]", "the brackets name no file of points");
        check("2∗x", "`∗` has no meaning in an equation");
        check("x=1", "`=` has no meaning in an equation");
        check(".", "`.` is not a number");
        check("1e999", "a number is too large");
    }
}
