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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    edges: Vec<Edge>,
    #[serde(default)]
    faces: Vec<Face>,
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

impl Id {
    fn into_word(self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Word(word) => word,
        }
    }
}

pub(super) fn read(text: &str) -> Result<Draft, Fault> {
    let file: File = serde_json::from_str(text).map_err(|error| {
        let place = Place::At { line: error.line(), column: error.column() };
        let message = error.to_string();
        // The place is said before the message.
        let end = message.rfind(" at line ").unwrap_or(message.len());
        Fault { place, cause: Cause::Json { message: message[..end].to_owned() } }
    })?;
    let File { nodes, edges, faces } = file;
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
