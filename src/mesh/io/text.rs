//! Numbers and rows of text, shared by the text formats.

use super::output::{Precision, WriteError, single};
use rayon::prelude::*;
use std::io::Write;

/// Rows that one thread formats at a time: some hundred kilobytes of text.
const ROWS_A_PIECE: usize = 1 << 13;
/// Pieces held in memory at a time.
const PIECES_A_BATCH: usize = 64;

/// Writes one row of text for each of `rows`, in order, formatting on all threads.
///
/// # Errors
/// The first failure of `format` in its piece, or of `out`.
pub(super) fn write_rows<T: Sync>(
    rows: &[T],
    out: &mut dyn Write,
    format: impl Fn(&mut Vec<u8>, &T) -> Result<(), WriteError> + Sync,
) -> Result<(), WriteError> {
    for batch in rows.chunks(ROWS_A_PIECE * PIECES_A_BATCH) {
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
        match precision {
            Precision::Single => push_single(text, single(value)?)?,
            Precision::Double => push_double(text, value)?,
        }
    }
    text.push(b'\n');
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
