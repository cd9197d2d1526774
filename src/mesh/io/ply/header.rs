//! The header of a PLY file: which elements follow, with which properties, in which encoding.
//!
//! Source: Turk 1994, The PLY Polygon File Format; the sized type names of later writers.

use crate::mesh::io::error::{Fault, Flaw};
use crate::mesh::io::text::{Lines, integer, syntax, words};

/// How the elements are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &[u8]) -> Option<Self> {
        match name {
            b"char" | b"int8" => Some(Self::I8),
            b"uchar" | b"uint8" => Some(Self::U8),
            b"short" | b"int16" => Some(Self::I16),
            b"ushort" | b"uint16" => Some(Self::U16),
            b"int" | b"int32" => Some(Self::I32),
            b"uint" | b"uint32" => Some(Self::U32),
            b"float" | b"float32" => Some(Self::F32),
            b"double" | b"float64" => Some(Self::F64),
            _ => None,
        }
    }

    /// Bytes in a binary file.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) const fn is_integer(self) -> bool {
        match self {
            Self::I8 | Self::U8 | Self::I16 | Self::U16 | Self::I32 | Self::U32 => true,
            Self::F32 | Self::F64 => false,
        }
    }
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holds {
    One(Scalar),
    List { length: Scalar, item: Scalar },
}

impl Holds {
    /// The fewest bytes that it takes in a binary file.
    pub(super) const fn least_size(self) -> usize {
        match self {
            Self::One(scalar) | Self::List { length: scalar, .. } => scalar.size(),
        }
    }
}

/// A property of every item of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) holds: Holds,
}

/// A table of the file: so many items with the same properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The fault that its items can't all be there.
    pub(super) fn overstated(&self) -> Fault {
        let name: String = self.name.chars().take(40).collect();
        Fault::Overstated { count: self.count, what: format!("items of element `{name}`") }
    }
}

/// A parsed header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

/// Reads the header from the start of a file; `lines` is left at the first byte after it.
pub(super) fn header(lines: &mut Lines<'_>) -> Result<Header, Flaw> {
    let magic = lines.next().unwrap_or_default();
    if !words(magic).eq([b"ply"]) {
        return Err(syntax("`ply`", Some(magic)).at_line(1));
    }
    let bare_returns = lines.ends_in_bare_return();
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let Some(line) = lines.next() else {
            return Err(Fault::Truncated { before: "the end of its header" }.at_line(lines.number));
        };
        let fault = |expected| syntax(expected, Some(line)).at_line(lines.number);
        let mut rest = words(line);
        match rest.next() {
            None | Some(b"comment" | b"obj_info") => {}
            Some(b"format") => {
                encoding = Some(match rest.next() {
                    Some(b"ascii") => Encoding::Ascii,
                    Some(b"binary_little_endian") => Encoding::LittleEndian,
                    Some(b"binary_big_endian") => Encoding::BigEndian,
                    Some(_) | None => {
                        return Err(fault("ascii, binary_little_endian or binary_big_endian"));
                    }
                });
            }
            Some(b"element") => {
                let name = rest.next().ok_or_else(|| fault("the name of an element"))?;
                let count = rest.next().and_then(integer).and_then(|n| u64::try_from(n).ok());
                elements.push(Element {
                    name: String::from_utf8_lossy(name).into_owned(),
                    count: count.ok_or_else(|| fault("the number of items"))?,
                    properties: Vec::new(),
                });
            }
            Some(b"property") => {
                let element = elements.last_mut().ok_or_else(|| fault("an element first"))?;
                let property = property(rest).ok_or_else(|| fault("a type and a name"))?;
                element.properties.push(property);
            }
            Some(b"end_header") => break,
            Some(_) => return Err(fault("a line of a PLY header")),
        }
    }
    // Where lines end in a bare return, a line feed after the last is data.
    if bare_returns && !lines.ends_in_bare_return() {
        lines.offset -= 1;
    }
    let no_format = || syntax("a format line", Some(b"end_header")).at_line(lines.number);
    Ok(Header { encoding: encoding.ok_or_else(no_format)?, elements })
}

/// `type name` or `list type type name`.
fn property<'a>(mut rest: impl Iterator<Item = &'a [u8]>) -> Option<Property> {
    let holds = match rest.next()? {
        b"list" => {
            let length = Scalar::from_name(rest.next()?).filter(|length| length.is_integer())?;
            Holds::List { length, item: Scalar::from_name(rest.next()?)? }
        }
        name => Holds::One(Scalar::from_name(name)?),
    };
    Some(Property { name: String::from_utf8_lossy(rest.next()?).into_owned(), holds })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Header, Flaw> {
        header(&mut Lines::new(text.as_bytes()))
    }

    #[test]
    fn elements_keep_their_properties_in_order() {
        let header = parse(
            "ply\r\nformat binary_big_endian 1.0\r\ncomment element x\r\nelement vertex 4\r\n\
             property float32 x\r\nproperty list uint8 uint y\r\nelement face 0\r\nend_header\r\n",
        )
        .unwrap();
        assert_eq!(header.encoding, Encoding::BigEndian);
        assert_eq!(header.elements.len(), 2);
        let holds: Vec<Holds> = header.elements[0].properties.iter().map(|p| p.holds).collect();
        let list = Holds::List { length: Scalar::U8, item: Scalar::U32 };
        assert_eq!(holds, [Holds::One(Scalar::F32), list]);
    }

    #[test]
    fn faults_name_their_line() {
        for (text, line) in [
            ("plyx\n", 1),
            ("ply\nformat text 1.0\n", 2),
            ("ply\nproperty float x\n", 2),
            ("ply\nelement vertex -3\n", 2),
            ("ply\nelement vertex 3\nproperty real x\n", 3),
            ("ply\nelement vertex 3\nproperty list float int x\n", 3),
            ("ply\ncomment\nend_header\n", 3),
            ("ply\nformat ascii 1.0\n", 2),
        ] {
            let flaw = parse(text).unwrap_err();
            assert_eq!(flaw.place, Fault::NotFinite.at_line(line).place, "{text}");
        }
    }

    #[test]
    fn a_line_feed_after_bare_returns_is_data() {
        let mut lines = Lines::new(b"ply\rformat ascii 1.0\rend_header\r\n\x01");
        header(&mut lines).unwrap();
        assert_eq!(lines.rest(), b"\n\x01");
        let mut lines = Lines::new(b"ply\nformat ascii 1.0\nend_header\r\n\x01");
        header(&mut lines).unwrap();
        assert_eq!(lines.rest(), b"\x01");
    }
}
