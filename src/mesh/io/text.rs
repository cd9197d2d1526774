//! Lines, words, numbers and rows of text, shared by the text formats.

use super::error::{Fault, Flaw, Place};
use super::output::{Precision, WriteError, single};
use super::runs::ITEMS_A_RUN;
use rayon::prelude::*;
use std::io::Write;

/// The lines of a text, which may end in `\n`, `\r\n` or `\r`.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    /// Where the next line starts.
    pub(super) offset: usize,
    /// The number of the last line given, the first being 1.
    pub(super) number: u64,
}

impl<'a> Lines<'a> {
    pub(super) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, offset: 0, number: 0 }
    }

    /// What has not been given yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.offset..]
    }

    /// Bytes of the whole text.
    pub(super) const fn size(&self) -> usize {
        self.bytes.len()
    }

    /// The fault at `word`, which is a piece of the last line given; at the whole line if it is not.
    pub(super) fn flaw_at(&self, word: Option<&[u8]>, fault: Fault) -> Flaw {
        let place = word.and_then(|word| self.place(word)).unwrap_or(Place::Line(self.number));
        Flaw { place: Some(place), fault }
    }

    /// Where `word` is, if it is a piece of the text.
    fn place(&self, word: &[u8]) -> Option<Place> {
        let offset = (word.as_ptr() as usize).checked_sub(self.bytes.as_ptr() as usize)?;
        let before = self.bytes.get(..offset).filter(|_| offset <= self.offset)?;
        let is_end = |byte: &u8| *byte == b'\n' || *byte == b'\r';
        let start = before.iter().rposition(is_end).map_or(0, |end| end + 1);
        let column = String::from_utf8_lossy(&before[start..]).chars().count() as u64 + 1;
        Some(Place::Word { line: self.number, column })
    }

    /// Whether the last line given ended in `\r` alone.
    pub(super) fn ends_in_bare_return(&self) -> bool {
        self.bytes[..self.offset].ends_with(b"\r")
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        self.number += 1;
        let length = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
        let end = match rest[length..] {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            [..] => 1,
        };
        self.offset += length + end;
        Some(&rest[..length])
    }
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The line without a comment that starts with `#`.
pub(super) fn without_comment(line: &[u8]) -> &[u8] {
    line.iter().position(|&b| b == b'#').map_or(line, |start| &line[..start])
}

/// The word as a number, which may be infinite or NaN.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The word as an integer; `3.0` is one.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    let text = std::str::from_utf8(word).ok()?;
    // 2^53 bounds the integers that every float holds.
    let whole = |value: &f64| value.fract() == 0.0 && value.abs() < 9_007_199_254_740_992.0;
    text.parse().ok().or_else(|| text.parse().ok().filter(whole).map(|value| value as i64))
}

/// The complaint that something else was found; `found` is cut short.
pub(super) fn syntax(expected: &'static str, found: Option<&[u8]>) -> Fault {
    let found = found.map_or_else(
        || "the end of the line".into(),
        |found| shown(&String::from_utf8_lossy(&found[..found.len().min(40)])),
    );
    Fault::Syntax { expected, found }
}

/// A piece of a file as messages show it: a line of no more than a hundred letters.
pub(super) fn shown(text: &str) -> String {
    text.chars().take(100).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// Rows that one thread formats at a time: some hundred kilobytes of text. What compresses the text
/// makes other bytes of other pieces.
const ROWS_A_PIECE: usize = 1 << 13;

/// Writes one row of text for each of `rows`, in order, formatting on all threads.
///
/// # Errors
/// The first failure of `format` in its piece, or of `out`.
pub(super) fn write_rows<T: Sync>(
    rows: &[T],
    out: &mut dyn Write,
    format: impl Fn(&mut Vec<u8>, &T) -> Result<(), WriteError> + Sync,
) -> Result<(), WriteError> {
    for batch in rows.chunks(ITEMS_A_RUN) {
        let pieces: Vec<Result<Vec<u8>, WriteError>> = batch
            .par_chunks(ROWS_A_PIECE)
            .map(|piece| {
                let mut text = Vec::with_capacity(piece.len() * 40);
                piece.iter().try_for_each(|row| format(&mut text, row))?;
                Ok(text)
            })
            .collect();
        for piece in pieces {
            out.write_all(&piece?)?;
        }
    }
    Ok(())
}

/// Appends `prefix` and the three coordinates, separated by blanks, with a line end.
///
/// # Errors
/// [`WriteError::BeyondSingle`].
pub(super) fn push_point(
    text: &mut Vec<u8>,
    prefix: &str,
    point: &[f64; 3],
    precision: Precision,
) -> Result<(), WriteError> {
    text.extend_from_slice(prefix.as_bytes());
    for (axis, &value) in point.iter().enumerate() {
        if axis > 0 {
            text.push(b' ');
        }
        push_number(text, value, precision)?;
    }
    text.push(b'\n');
    Ok(())
}

/// Appends the coordinate.
///
/// # Errors
/// [`WriteError::BeyondSingle`].
pub(super) fn push_number(
    text: &mut Vec<u8>,
    value: f64,
    precision: Precision,
) -> Result<(), WriteError> {
    match precision {
        Precision::Single => push_single(text, single(value)?)?,
        Precision::Double => push_double(text, value)?,
    }
    Ok(())
}

/// Whether plain decimals are no longer than scientific notation, about.
fn is_plain(magnitude: f64) -> bool {
    magnitude == 0.0 || (1e-5..1e16).contains(&magnitude)
}

fn push_double(text: &mut Vec<u8>, value: f64) -> std::io::Result<()> {
    if is_plain(value.abs()) { write!(text, "{value}") } else { write!(text, "{value:e}") }
}

fn push_single(text: &mut Vec<u8>, value: f32) -> std::io::Result<()> {
    if is_plain(f64::from(value).abs()) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_in_any_of_three_ways() {
        let mut lines = Lines::new(b"a\nb\r\n\rc d");
        assert_eq!(lines.by_ref().collect::<Vec<_>>(), [&b"a"[..], b"b", b"", b"c d"]);
        assert_eq!((lines.number, lines.rest()), (4, &b""[..]));
        assert_eq!(words(b"  c\td ").collect::<Vec<_>>(), [b"c", b"d"]);
    }

    #[test]
    fn words_are_found_in_their_lines() {
        let mut lines = Lines::new("a\r\n  \u{3c0} b".as_bytes());
        let line = lines.by_ref().nth(1).unwrap();
        let word = words(line).nth(1);
        let place = lines.flaw_at(word, Fault::Empty).place;
        assert_eq!(place, Some(Place::Word { line: 2, column: 5 }));
        assert_eq!(lines.flaw_at(None, Fault::Empty).place, Some(Place::Line(2)));
        assert_eq!(lines.flaw_at(Some(b"b"), Fault::Empty).place, Some(Place::Line(2)));
    }

    #[test]
    fn integers_may_be_written_as_floats() {
        assert_eq!(integer(b"-7"), Some(-7));
        assert_eq!(integer(b"3.0"), Some(3));
        for word in ["3.5", "1e300", "nan", "x", ""] {
            assert_eq!(integer(word.as_bytes()), None);
        }
    }

    #[test]
    fn numbers_are_shortest_and_read_back_to_the_same_bits() {
        for value in [0.0, -0.0, 1.0, 0.1, 1e-5, 9.9e-6, 1e300, -5e-324, f64::MAX, 1e16, 2.5e15] {
            let mut text = Vec::new();
            push_double(&mut text, value).unwrap();
            let text = String::from_utf8(text).unwrap();
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            assert!(text.len() <= 24, "{text}");
        }
        let mut text = Vec::new();
        push_point(&mut text, "v ", &[0.1, 1e-7, 1e20], Precision::Single).unwrap();
        assert_eq!(text, b"v 0.1 1e-7 1e20\n");
        assert!(push_point(&mut text, "", &[1e39, 0.0, 0.0], Precision::Single).is_err());
    }
}
