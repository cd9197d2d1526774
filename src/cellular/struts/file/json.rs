//! Cells as JSON.
//!
//! ```json
//! {"nodes": [{"id": "a", "at": [0, 0, 0], "radius": 1}, {"id": 2, "at": [1, 0, 0]}],
//!  "edges": [{"between": ["a", 2], "radius": 1}],
//!  "faces": [{"corners": ["a", 2, 3], "thickness": 1}]}
//! ```
//!
//! Radii and thicknesses may be left out, and so may lists. An id is a word or a whole number.

use super::draft::Draft;
use super::{Cause, Fault, Place};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    nodes: List<Node>,
    #[serde(default)]
    edges: List<Edge>,
    #[serde(default)]
    faces: List<Face>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Node {
    id: Id,
    at: [f64; 3],
    radius: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Edge {
    between: [Id; 2],
    radius: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Face {
    corners: Vec<Id>,
    thickness: Option<f64>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a word or a whole number")]
enum Id {
    Number(u64),
    Word(String),
}

/// What is read from an object, and from nothing else.
trait Form {
    /// What it is, with an example, for who wrote something else.
    const EXPECTED: &'static str;
}

impl Form for File {
    const EXPECTED: &'static str = r#"an object such as {"nodes": [...], "edges": [...]}"#;
}

impl Form for Node {
    const EXPECTED: &'static str = r#"a node such as {"id": "a", "at": [0, 0, 0]}"#;
}

impl Form for Edge {
    const EXPECTED: &'static str = r#"an edge such as {"between": ["a", "b"]}"#;
}

impl Form for Face {
    const EXPECTED: &'static str = r#"a face such as {"corners": ["a", "b", "c"]}"#;
}

/// An object; the fields of a bare structure may be a list, too, which nobody means.
struct Object<T>(T);

impl<'de, T: Form + Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Reader<T>(PhantomData<T>);
        impl<'de, T: Form + Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = T;
            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str(T::EXPECTED)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map))
            }
        }
        from.deserialize_map(Reader(PhantomData)).map(Self)
    }
}

/// A list of objects.
struct List<T>(Vec<T>);

impl<T> Default for List<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Form + Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Reader<T>(PhantomData<T>);
        impl<'de, T: Form + Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = Vec<T>;
            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(out, "a list whose entries are each {}", T::EXPECTED)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<Vec<T>, A::Error> {
                let mut list = Vec::new();
                while let Some(Object(entry)) = entries.next_element()? {
                    list.push(entry);
                }
                Ok(list)
            }
        }
        from.deserialize_seq(Reader(PhantomData)).map(Self)
    }
}

impl Id {
    fn into_word(self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Word(word) => word,
        }
    }
}

pub(super) fn read(text: &str) -> Result<Draft, Fault> {
    let Object(file): Object<File> = serde_json::from_str(text).map_err(|error| {
        let place = Place::At { line: error.line(), column: error.column() };
        let message = error.to_string();
        // The place is said before the message.
        let end = message.rfind(" at line ").unwrap_or(message.len());
        Fault { place, cause: Cause::Json { message: message[..end].to_owned() } }
    })?;
    let File { nodes: List(nodes), edges: List(edges), faces: List(faces) } = file;
    let mut draft = Draft::default();
    for (Node { id, at, radius }, place) in nodes.into_iter().zip(places("node")) {
        draft.node(id.into_word(), at, radius, place)?;
    }
    for (Edge { between, radius }, place) in edges.into_iter().zip(places("edge")) {
        let [a, b] = between.map(Id::into_word);
        draft.edge([(&a, place), (&b, place)], radius, place)?;
    }
    for (Face { corners, thickness }, place) in faces.into_iter().zip(places("face")) {
        let words: Vec<String> = corners.into_iter().map(Id::into_word).collect();
        let corners: Vec<_> = words.iter().map(|word| (word.as_str(), place)).collect();
        draft.face(&corners, thickness, place)?;
    }
    Ok(draft)
}

/// The places of the entries of a list of `what`.
fn places(what: &'static str) -> impl Iterator<Item = Place> {
    (1..).map(move |number| Place::Entry { what, number })
}
