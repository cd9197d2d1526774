//! Reads the XML of a model as a stream: meshes, components and what is to be built.

use super::super::assembly::Assembly;
use super::super::error::{Fault, Flaw};
use super::super::text::syntax;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use rustc_hash::FxHashMap;
use std::io::{self, BufRead, Read};

/// The longest piece of markup, in bytes: a vertex takes a hundred.
const LONGEST_TAG: usize = 1 << 20;

/// The most objects of a model, each of which takes some memory however little it holds.
const MOST_OBJECTS: usize = 1 << 16;

/// A model as it is written.
#[derive(Debug)]
pub(super) struct Model {
    /// Millimetres in a unit.
    pub(super) unit: f64,
    pub(super) objects: FxHashMap<u32, Object>,
    pub(super) items: Vec<Instance>,
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
    pub(super) object: u32,
    pub(super) transform: Transform,
}

/// Rows of a 4 by 3 matrix; a point is the row (x, y, z, 1) to its left (section 3.3).
pub(super) type Transform = [[f64; 3]; 4];

pub(super) const IDENTITY: Transform =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];

/// Reads the model in `part`, of which no more than `limit` bytes come.
pub(super) fn read(
    part: impl BufRead,
    limit: u64,
    assembly: &mut Assembly<'_>,
) -> Result<Model, Flaw> {
    let mut reader = Reader::from_reader(Rationed { inner: part, taken: 0, total: 0 });
    let mut parser = Parser::new(assembly);
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
                parser.close(tag.local_name().as_ref());
            }
            Event::End(tag) => parser.close(tag.local_name().as_ref()),
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
    Ok(parser.model)
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
            return Some(target.trim_start_matches('/').to_owned());
        }
    }
}

struct Parser<'a, 'p> {
    assembly: &'a mut Assembly<'p>,
    model: Model,
    /// The object that is open, and its number.
    object: Option<(u32, Object)>,
    is_closed: bool,
}

impl<'a, 'p> Parser<'a, 'p> {
    fn new(assembly: &'a mut Assembly<'p>) -> Self {
        let model = Model { unit: 1.0, objects: FxHashMap::default(), items: Vec::new() };
        Self { assembly, model, object: None, is_closed: false }
    }

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
            "model" => self.model.unit = unit(tag)?,
            "object" => {
                if self.model.objects.len() >= MOST_OBJECTS {
                    return Err(Fault::TooLarge { what: "the model has too many objects" });
                }
                let kind = attribute(tag, "type")?;
                let is_aside = matches!(kind.as_deref(), Some("support" | "other"));
                self.object = Some((index(tag, "id")?, Object { is_aside, ..Object::default() }));
            }
            "component" => {
                let instance = self.instance(tag)?;
                if let Some(instance) = instance {
                    self.object()?.components.push(instance);
                }
            }
            "item" => {
                let instance = self.instance(tag)?;
                self.model.items.extend(instance);
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

    fn close(&mut self, name: &str) {
        match name {
            "object" => {
                if let Some((id, object)) = self.object.take() {
                    self.model.objects.insert(id, object);
                }
            }
            "model" => self.is_closed = true,
            _ => {}
        }
    }

    fn object(&mut self) -> Result<&mut Object, Fault> {
        match &mut self.object {
            Some((_, object)) => Ok(object),
            None => Err(syntax("an object around meshes and components", None)),
        }
    }

    /// The object that `tag` names, moved; `None` if it is in another part.
    fn instance(&mut self, tag: &BytesStart<'_>) -> Result<Option<Instance>, Fault> {
        if tag.attributes().flatten().any(|a| a.key.local_name().as_ref() == "path") {
            self.assembly.ignore("objects in other parts of the archive");
            return Ok(None);
        }
        let transform = match attribute(tag, "transform")? {
            Some(text) => transform(&text)?,
            None => IDENTITY,
        };
        Ok(Some(Instance { object: index(tag, "objectid")?, transform }))
    }
}

/// The value of the attribute `name` of `tag`.
fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, Fault> {
    let found = tag.try_get_attribute(name);
    let found = found.map_err(|error| syntax("attributes", Some(error.to_string().as_bytes())))?;
    Ok(found.map(|attribute| attribute.value.trim().to_owned()))
}

fn required(tag: &BytesStart<'_>, name: &'static str) -> Result<String, Fault> {
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
    Ok(match name.as_str() {
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
