//! The numbers of a PLY file, whatever their encoding.

use super::header::{Element, Holds, Scalar};
use crate::mesh::io::error::{Fault, Flaw};
use crate::mesh::io::text::{self, Lines, syntax};

/// Numbers one after the other, in items.
///
/// A clone goes on from the same place.
pub(super) trait Source: Clone {
    /// Refuses an element that can't fit into what is left.
    fn announce(&self, element: &Element) -> Result<(), Flaw>;
    /// Goes to the next item.
    fn begin_item(&mut self) -> Result<(), Flaw>;
    /// The next number.
    fn number(&mut self, scalar: Scalar) -> Result<f64, Flaw>;
    /// The next number, which must be an integer.
    fn integer(&mut self, scalar: Scalar) -> Result<i64, Flaw>;
    /// Passes over `count` numbers.
    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), Flaw>;
    /// Whether there may be `count` more numbers in this item.
    fn has(&self, scalar: Scalar, count: usize) -> bool;
    /// Checks that the item is over.
    fn end_item(&mut self) -> Result<(), Flaw>;
    /// Whether nothing is left.
    fn is_exhausted(&self) -> bool;
    /// Bytes from the start of the file.
    fn offset(&self) -> usize;
    /// The fault at this place.
    fn flaw(&self, fault: Fault) -> Flaw;
}

const ITEM: Fault = Fault::Truncated { before: "the last item of its header" };

/// Text: an item to a line.
#[derive(Clone)]
pub(super) struct Ascii<'a> {
    lines: Lines<'a>,
    /// What is left of the item's line.
    line: &'a [u8],
}

impl<'a> Ascii<'a> {
    pub(super) const fn new(lines: Lines<'a>) -> Self {
        Self { lines, line: &[] }
    }

    fn word(&mut self) -> Option<&'a [u8]> {
        let line = self.line.trim_ascii_start();
        let length = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (word, rest) = line.split_at(length);
        self.line = rest;
        (!word.is_empty()).then_some(word)
    }
}

impl Source for Ascii<'_> {
    fn announce(&self, element: &Element) -> Result<(), Flaw> {
        // Every number takes a digit and a separator, but the last may do without.
        let least = element.count.saturating_mul(2 * element.properties.len() as u64);
        if least > self.lines.rest().len() as u64 + 1 {
            Err(self.flaw(element.overstated()))
        } else {
            Ok(())
        }
    }

    fn begin_item(&mut self) -> Result<(), Flaw> {
        loop {
            self.line = self.lines.next().ok_or_else(|| self.flaw(ITEM))?.trim_ascii();
            if !self.line.is_empty() {
                return Ok(());
            }
        }
    }

    fn number(&mut self, _: Scalar) -> Result<f64, Flaw> {
        let word = self.word();
        let fault = || self.lines.flaw_at(word, syntax("a number", word));
        word.and_then(text::number).ok_or_else(fault)
    }

    fn integer(&mut self, _: Scalar) -> Result<i64, Flaw> {
        let word = self.word();
        let fault = || self.lines.flaw_at(word, syntax("an integer", word));
        word.and_then(text::integer).ok_or_else(fault)
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), Flaw> {
        (0..count).try_for_each(|_| self.number(scalar).map(drop))
    }

    fn has(&self, _: Scalar, count: usize) -> bool {
        count.saturating_mul(2) <= self.line.len() + 1
    }

    fn end_item(&mut self) -> Result<(), Flaw> {
        match self.word() {
            None => Ok(()),
            word @ Some(_) => Err(self.lines.flaw_at(word, syntax("the end of the line", word))),
        }
    }

    fn is_exhausted(&self) -> bool {
        self.lines.rest().trim_ascii().is_empty()
    }

    fn offset(&self) -> usize {
        self.lines.offset
    }

    fn flaw(&self, fault: Fault) -> Flaw {
        fault.at_line(self.lines.number)
    }
}

/// Binary numbers, the most significant byte first if `BIG`.
#[derive(Clone)]
pub(super) struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    offset: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub(super) const fn new(bytes: &'a [u8], offset: usize) -> Self {
        Self { bytes, offset }
    }

    /// The next `N` bytes, the least significant first.
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Flaw> {
        let mut bytes = *self
            .bytes
            .get(self.offset..)
            .and_then(|rest| rest.first_chunk())
            .ok_or_else(|| self.flaw(ITEM))?;
        self.offset += N;
        if BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG: bool> Source for Binary<'_, BIG> {
    fn announce(&self, element: &Element) -> Result<(), Flaw> {
        let size = |holds: Holds| holds.least_size() as u64;
        let item: u64 = element.properties.iter().map(|property| size(property.holds)).sum();
        let left = (self.bytes.len() - self.offset) as u64;
        if element.count.saturating_mul(item) > left {
            Err(self.flaw(element.overstated()))
        } else {
            Ok(())
        }
    }

    fn begin_item(&mut self) -> Result<(), Flaw> {
        Ok(())
    }

    fn number(&mut self, scalar: Scalar) -> Result<f64, Flaw> {
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn integer(&mut self, scalar: Scalar) -> Result<i64, Flaw> {
        Ok(match scalar {
            Scalar::I8 => i64::from(i8::from_le_bytes(self.take()?)),
            Scalar::U8 => i64::from(u8::from_le_bytes(self.take()?)),
            Scalar::I16 => i64::from(i16::from_le_bytes(self.take()?)),
            Scalar::U16 => i64::from(u16::from_le_bytes(self.take()?)),
            Scalar::I32 => i64::from(i32::from_le_bytes(self.take()?)),
            Scalar::U32 => i64::from(u32::from_le_bytes(self.take()?)),
            Scalar::F32 | Scalar::F64 => {
                return Err(self.flaw(syntax("an integer type", Some(b"float"))));
            }
        })
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), Flaw> {
        if !self.has(scalar, count) {
            return Err(self.flaw(ITEM));
        }
        self.offset += scalar.size() * count;
        Ok(())
    }

    fn has(&self, scalar: Scalar, count: usize) -> bool {
        count <= (self.bytes.len() - self.offset) / scalar.size()
    }

    fn end_item(&mut self) -> Result<(), Flaw> {
        Ok(())
    }

    fn is_exhausted(&self) -> bool {
        self.offset == self.bytes.len()
    }

    fn offset(&self) -> usize {
        self.offset
    }

    fn flaw(&self, fault: Fault) -> Flaw {
        fault.at_byte(self.offset)
    }
}
