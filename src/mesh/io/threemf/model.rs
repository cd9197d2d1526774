//! Reads the XML of a model as a stream: meshes, components and what is to be built.
//!
//! A model may have further parts, files of the archive whose objects it names. They are read one
//! after the other into the same [`Model`], the root first.

use super::super::assembly::Assembly;
use super::super::error::{Fault, Flaw};
use super::super::input::is_wide;
use super::super::text::{shown, syntax};
use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use rustc_hash::FxHashMap;
use std::borrow::Cow;
use std::io::{self, BufRead, Read};

/// The longest piece of markup, in bytes: a vertex takes a hundred.
const LONGEST_TAG: usize = 1 << 20;

/// The most objects of a model, each of which takes some memory however little it holds.
const MOST_OBJECTS: usize = 1 << 16;

/// Parts of a model, at most: each is looked up in the archive.
const MOST_PARTS: usize = 1 << 14;

/// Extensions that a model may require: of the production extension parts and paths are read; what
/// the others add leaves meshes as they are.
const EXTENSIONS: [&str; 3] = [
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
];

/// A model as it is written.
#[derive(Debug)]
pub(super) struct Model {
    /// The parts it consists of, the root first.
    pub(super) parts: Vec<Part>,
    /// Their numbers, by name.
    numbers: FxHashMap<String, u32>,
    pub(super) objects: FxHashMap<Name, Object>,
    pub(super) items: Vec<Instance>,
}

impl Model {
    /// A model whose root is the part `name`, of which nothing is read yet.
    pub(super) fn new(name: String) -> Self {
        let numbers = FxHashMap::from_iter([(name.clone(), 0)]);
        let parts = vec![Part { name, unit: 1.0 }];
        Self { parts, numbers, objects: FxHashMap::default(), items: Vec::new() }
    }
}

/// A file of the archive with objects.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) name: String,
    /// Millimetres in a unit.
    pub(super) unit: f64,
}

/// What an object is known by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Name {
    /// The number of its part, the root being 0.
    pub(super) part: u32,
    /// Its number there.
    pub(super) id: u32,
}

/// What an object consists of.
#[derive(Debug, Default)]
pub(super) struct Object {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) components: Vec<Instance>,
    /// Whether it is a support or other help, and no part of the solid.
    pub(super) is_aside: bool,
}

/// An object, moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    pub(super) object: Name,
    pub(super) transform: Transform,
}

/// Rows of a 4 by 3 matrix; a point is the row (x, y, z, 1) to its left (section 3.3).
pub(super) type Transform = [[f64; 3]; 4];

pub(super) const IDENTITY: Transform =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];

/// Reads the part of `model` with that `number` from `text`, of which no more than `limit` bytes come,
/// and returns how many came.
pub(super) fn read(
    mut text: impl BufRead,
    limit: u64,
    number: u32,
    model: &mut Model,
    assembly: &mut Assembly<'_>,
) -> Result<u64, Flaw> {
    if text.fill_buf().is_ok_and(is_wide) {
        return Err(Fault::Wide.into());
    }
    let mut reader = Reader::from_reader(Rationed { inner: text, taken: 0, total: 0 });
    let mut parser = Parser { assembly, model, part: number, object: None, is_closed: false };
    let mut buffer = Vec::new();
    loop {
        let at = reader.buffer_position() as usize;
        let event = reader.read_event_into(&mut buffer);
        // What ends there is cut off, wherever that is.
        if reader.get_ref().total >= limit {
            return Err(Fault::TooLarge { what: "the model is packed too densely" }.into());
        }
        match event.map_err(|error| xml_fault(&error).at_byte(at))? {
            Event::Start(tag) => parser.open(&tag).map_err(|fault| fault.at_byte(at))?,
            Event::Empty(tag) => {
                parser.open(&tag).map_err(|fault| fault.at_byte(at))?;
                parser.close(tag.local_name().as_ref()).map_err(|fault| fault.at_byte(at))?;
            }
            Event::End(tag) => {
                parser.close(tag.local_name().as_ref()).map_err(|fault| fault.at_byte(at))?;
            }
            Event::Eof => break,
            Event::Text(_)
            | Event::CData(_)
            | Event::Comment(_)
            | Event::Decl(_)
            | Event::PI(_)
            | Event::DocType(_)
            | Event::GeneralRef(_) => {}
        }
        buffer.clear();
        reader.get_mut().taken = 0;
    }
    if !parser.is_closed {
        return Err(Fault::Truncated { before: "its model does" }.into());
    }
    Ok(reader.get_ref().total)
}

/// A reader that fails when one piece of markup takes too much: the whole of it is kept in memory.
struct Rationed<R> {
    inner: R,
    /// Bytes taken since the piece began.
    taken: usize,
    /// Bytes taken since the model began.
    total: u64,
}

impl<R: BufRead> Read for Rationed<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Rationed<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken > LONGEST_TAG {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        self.inner.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.taken += count;
        self.total += count as u64;
        self.inner.consume(count);
    }
}

/// The name of the part that is the model, from the text of the archive's relations.
pub(super) fn target_of_relations(text: &str) -> Option<String> {
    const KIND: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
    let mut reader = Reader::from_str(text);
    loop {
        let event = reader.read_event().ok()?;
        if event == Event::Eof {
            return None;
        }
        let (Event::Start(tag) | Event::Empty(tag)) = event else { continue };
        if attribute(&tag, "Type").ok()?.as_deref() == Some(KIND) {
            let target = attribute(&tag, "Target").ok()??;
            return Some(in_archive(&target).to_owned());
        }
    }
}

/// The name in the archive of the part at `path`, which is absolute.
fn in_archive(path: &str) -> &str {
    path.trim_start_matches('/')
}

struct Parser<'a, 'p> {
    assembly: &'a mut Assembly<'p>,
    model: &'a mut Model,
    /// The number of the part that is read.
    part: u32,
    /// The object that is open, and its number.
    object: Option<(u32, Object)>,
    is_closed: bool,
}

impl Parser<'_, '_> {
    fn open(&mut self, tag: &BytesStart<'_>) -> Result<(), Fault> {
        match tag.local_name().as_ref() {
            "vertex" => {
                let point = [number(tag, "x")?, number(tag, "y")?, number(tag, "z")?];
                self.object()?.vertices.push(point);
            }
            "triangle" => {
                let corners = [index(tag, "v1")?, index(tag, "v2")?, index(tag, "v3")?];
                self.object()?.triangles.push(corners);
            }
            "model" => {
                meet_requirements(tag)?;
                self.model.parts[self.part as usize].unit = unit(tag)?;
            }
            "object" => {
                if let Some((id, _)) = &self.object {
                    let expected = "the end of an object before the next one";
                    let found = format!("an object in the object {id}");
                    return Err(syntax(expected, Some(found.as_bytes())));
                }
                if self.model.objects.len() >= MOST_OBJECTS {
                    return Err(Fault::TooLarge { what: "the model has too many objects" });
                }
                let kind = attribute(tag, "type")?;
                let is_aside = matches!(kind.as_deref(), Some("support" | "other"));
                self.object = Some((index(tag, "id")?, Object { is_aside, ..Object::default() }));
            }
            "component" => {
                let instance = self.instance(tag)?;
                self.object()?.components.push(instance);
            }
            // Only what the root wants built is built.
            "item" if self.part == 0 => {
                let instance = self.instance(tag)?;
                self.model.items.push(instance);
            }
            "beamlattice" => self.assembly.ignore("beam lattices"),
            "slicestack" => self.assembly.ignore("slices"),
            "colorgroup" | "basematerials" | "texture2dgroup" | "compositematerials" => {
                self.assembly.ignore("colours and materials");
            }
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self, name: &str) -> Result<(), Fault> {
        match name {
            "object" => {
                if let Some((id, object)) = self.object.take() {
                    let name = Name { part: self.part, id };
                    if self.model.objects.insert(name, object).is_some() {
                        let expected = "a number of its own for each object";
                        return Err(syntax(expected, Some(id.to_string().as_bytes())));
                    }
                }
            }
            "model" => self.is_closed = true,
            _ => {}
        }
        Ok(())
    }

    fn object(&mut self) -> Result<&mut Object, Fault> {
        match &mut self.object {
            Some((_, object)) => Ok(object),
            None => Err(syntax("an object around meshes and components", None)),
        }
    }

    /// The object that `tag` names, moved.
    fn instance(&mut self, tag: &BytesStart<'_>) -> Result<Instance, Fault> {
        let is_path = |a: &Attribute<'_>| a.key.local_name().as_ref() == "path";
        let part = match tag.attributes().flatten().find(is_path) {
            Some(path) => self.part_at(in_archive(&plain(path)?))?,
            None => self.part,
        };
        let transform = match attribute(tag, "transform")? {
            Some(text) => transform(&text)?,
            None => IDENTITY,
        };
        Ok(Instance { object: Name { part, id: index(tag, "objectid")? }, transform })
    }

    /// The number of the part with that name, which is read in its turn.
    fn part_at(&mut self, name: &str) -> Result<u32, Fault> {
        if self.part > 0 {
            return Err(syntax("no path outside of the root model", Some(name.as_bytes())));
        }
        let Model { parts, numbers, .. } = &mut *self.model;
        if let Some(number) = numbers.get(name) {
            return Ok(*number);
        }
        if parts.len() >= MOST_PARTS {
            return Err(Fault::TooLarge { what: "the model has too many parts" });
        }
        let number = parts.len() as u32;
        parts.push(Part { name: name.to_owned(), unit: 1.0 });
        numbers.insert(name.to_owned(), number);
        Ok(number)
    }
}

/// Refuses a model that requires an extension which is not read.
fn meet_requirements(model: &BytesStart<'_>) -> Result<(), Fault> {
    let Some(prefixes) = attribute(model, "requiredextensions")? else { return Ok(()) };
    for prefix in prefixes.split_ascii_whitespace() {
        let namespace = attribute(model, &format!("xmlns:{prefix}"))?;
        if !namespace.as_deref().is_some_and(|namespace| EXTENSIONS.contains(&namespace)) {
            let name = namespace.unwrap_or_else(|| prefix.into());
            return Err(Fault::Extension { name: shown(&name) });
        }
    }
    Ok(())
}

/// The value of the attribute `name` of `tag`.
fn attribute<'a>(tag: &'a BytesStart<'_>, name: &str) -> Result<Option<Cow<'a, str>>, Fault> {
    let found = tag.try_get_attribute(name);
    let found = found.map_err(|error| syntax("attributes", Some(error.to_string().as_bytes())))?;
    found.map(plain).transpose()
}

/// The value of an attribute, without references and blanks around it.
fn plain(attribute: Attribute<'_>) -> Result<Cow<'_, str>, Fault> {
    let value = if attribute.value.contains('&') {
        let value = attribute.normalized_value(XmlVersion::Implicit1_0);
        value.map_err(|error| xml_fault(&error))?.into_owned().into()
    } else {
        attribute.value
    };
    Ok(match value {
        Cow::Borrowed(value) => value.trim().into(),
        Cow::Owned(value) => value.trim().to_owned().into(),
    })
}

fn required<'a>(tag: &'a BytesStart<'_>, name: &'static str) -> Result<Cow<'a, str>, Fault> {
    attribute(tag, name)?.ok_or_else(|| syntax(name, Some(tag.name().as_ref().as_bytes())))
}

fn number(tag: &BytesStart<'_>, name: &'static str) -> Result<f64, Fault> {
    let text = required(tag, name)?;
    text.parse().map_err(|_| syntax("a number", Some(text.as_bytes())))
}

fn index(tag: &BytesStart<'_>, name: &'static str) -> Result<u32, Fault> {
    let text = required(tag, name)?;
    text.parse().map_err(|_| syntax("a whole number below 2^32", Some(text.as_bytes())))
}

/// Millimetres in the unit of a model.
fn unit(tag: &BytesStart<'_>) -> Result<f64, Fault> {
    let Some(name) = attribute(tag, "unit")? else { return Ok(1.0) };
    Ok(match &*name {
        "micron" => 0.001,
        "millimeter" => 1.0,
        "centimeter" => 10.0,
        "inch" => 25.4,
        "foot" => 304.8,
        "meter" => 1000.0,
        _ => return Err(syntax("a unit of length", Some(name.as_bytes()))),
    })
}

fn transform(text: &str) -> Result<Transform, Fault> {
    let fault = || syntax("twelve numbers", Some(text.as_bytes()));
    let mut entries = text.split_ascii_whitespace().map(str::parse::<f64>);
    let mut transform = IDENTITY;
    for entry in transform.as_flattened_mut() {
        *entry = entries.next().ok_or_else(fault)?.map_err(|_| fault())?;
    }
    if entries.next().is_some() { Err(fault()) } else { Ok(transform) }
}

fn xml_fault(error: &quick_xml::Error) -> Fault {
    let quick_xml::Error::Io(error) = error else {
        return syntax("well-formed XML", Some(error.to_string().as_bytes()));
    };
    if error.kind() == io::ErrorKind::FileTooLarge {
        Fault::TooLarge { what: "a piece of markup has over a megabyte" }
    } else {
        syntax("a sound ZIP archive", Some(error.to_string().as_bytes()))
    }
}
