//! Cells in the `.ltcx` form of XML, in which nTop and UnitcellEngine exchange lattices.
//!
//! ```xml
//! <graph units="mm">
//!   <nodegroup><node id="0" x="-0.5" y="-0.5" z="-0.5"/></nodegroup>
//!   <beamgroup><beam id="0" n1="0" n2="1"/></beamgroup>
//! </graph>
//! ```
//!
//! Coordinates are in cells from the middle of the cell, from -0.5 to 0.5; the unit is not looked at. A
//! radius `r` of a node or beam, which the form knows as a length, is taken as a factor. Other elements
//! and attributes are passed over.

use super::draft::Draft;
use super::{Cause, Fault, Place};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

const NODE: &str = "<node id=\"1\" x=\"0\" y=\"0\" z=\"0\"/>";
const BEAM: &str = "<beam id=\"1\" n1=\"1\" n2=\"2\"/>";

/// Elements within elements, at most.
const DEEPEST: usize = 64;

pub(super) fn read(text: &str) -> Result<Draft, Fault> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = Reader::from_str(text);
    let mut draft = Draft::default();
    let mut depth = 0_usize;
    let mut cursor = Cursor { text, offset: 0, line: 1, column: 1 };
    loop {
        let start = reader.buffer_position() as usize;
        let event = reader.read_event();
        let place = cursor.at(start);
        match event {
            Ok(Event::Start(element)) => {
                depth += 1;
                if depth > DEEPEST {
                    let message = format!("elements are nested more than {DEEPEST} deep");
                    return Err(Fault { place, cause: Cause::Xml { message } });
                }
                take(&mut draft, &element, place)?;
            }
            Ok(Event::Empty(element)) => take(&mut draft, &element, place)?,
            Ok(Event::End(_)) => depth = depth.saturating_sub(1),
            Ok(Event::Eof) if depth > 0 => {
                let message = "the file ends within an element".to_owned();
                return Err(Fault { place, cause: Cause::Xml { message } });
            }
            Ok(Event::Eof) => return Ok(draft),
            Ok(
                Event::Text(_)
                | Event::CData(_)
                | Event::Comment(_)
                | Event::Decl(_)
                | Event::PI(_)
                | Event::DocType(_)
                | Event::GeneralRef(_),
            ) => {}
            Err(error) => {
                let place = Place::of_byte(text, reader.error_position() as usize);
                return Err(Fault { place, cause: Cause::Xml { message: error.to_string() } });
            }
        }
    }
}

/// Finds the places of bytes that come one after the other, in one pass over the text.
struct Cursor<'a> {
    text: &'a str,
    offset: usize,
    line: usize,
    column: usize,
}

impl Cursor<'_> {
    fn at(&mut self, offset: usize) -> Place {
        for letter in self.text.get(self.offset..offset).unwrap_or_default().chars() {
            (self.line, self.column) =
                if letter == '\n' { (self.line + 1, 1) } else { (self.line, self.column + 1) };
        }
        self.offset = self.offset.max(offset);
        Place::At { line: self.line, column: self.column }
    }
}

/// Takes in a node or a beam.
fn take(draft: &mut Draft, element: &BytesStart<'_>, place: Place) -> Result<(), Fault> {
    let misused = |usage| Fault { place, cause: Cause::Usage { usage } };
    match element.local_name().as_ref() {
        "node" => {
            let [id, x, y, z, r] = attributes(element, ["id", "x", "y", "z", "r"], place)?;
            let (Some(id), Some(x), Some(y), Some(z)) = (id, x, y, z) else {
                return Err(misused(NODE));
            };
            let at = [number(&x, place)?, number(&y, place)?, number(&z, place)?];
            let radius = r.map(|r| number(&r, place)).transpose()?;
            draft.node(id, at.map(|c| c + 0.5), radius, place)
        }
        "beam" => {
            let [a, b, r] = attributes(element, ["n1", "n2", "r"], place)?;
            let (Some(a), Some(b)) = (a, b) else { return Err(misused(BEAM)) };
            let radius = r.map(|r| number(&r, place)).transpose()?;
            draft.edge([(&a, place), (&b, place)], radius, place)
        }
        _ => Ok(()),
    }
}

/// The values of the attributes called `names`.
fn attributes<const N: usize>(
    element: &BytesStart<'_>,
    names: [&str; N],
    place: Place,
) -> Result<[Option<String>; N], Fault> {
    let mut found = [const { None }; N];
    for attribute in element.attributes() {
        let attribute = attribute
            .map_err(|error| Fault { place, cause: Cause::Xml { message: error.to_string() } })?;
        if let Some(index) = names.iter().position(|n| **n == *attribute.key.as_ref()) {
            found[index] = Some(attribute.value.trim().to_owned());
        }
    }
    Ok(found)
}

fn number(word: &str, place: Place) -> Result<f64, Fault> {
    let value = word.parse().ok().filter(|value: &f64| value.is_finite());
    let cause = || Cause::NotANumber { word: word.chars().take(40).collect() };
    value.ok_or_else(|| Fault { place, cause: cause() })
}
