//! Cells as plain text: a line a node, an edge or a face.
//!
//! ```text
//! # what follows is a comment
//! node ID x y z [radius]
//! edge ID ID [radius]
//! face ID ID ID ... [thickness FACTOR]
//! ```
//!
//! Places are in cells, from a corner of the cube; an ID is any word. Radii and thicknesses are factors of
//! what the program gives: 1 where nothing is said. The radius of an edge takes the place of those of
//! its nodes, between which it would taper.

use super::draft::{Draft, check_coordinates, check_factor};
use super::{Cause, Fault, Place};
use crate::text::shortened;

const NODE: &str = "node ID x y z [radius]";
const EDGE: &str = "edge ID ID [radius]";
const FACE: &str = "face ID ID ID ... [thickness FACTOR]";

pub(super) fn read(text: &str) -> Result<Draft, Fault> {
    let mut draft = Draft::default();
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in text.lines().enumerate() {
        let words = words(line, number + 1);
        let Some(((first, place), rest)) = words.split_first() else { continue };
        let misused = |usage| Err(Fault { place: *place, cause: Cause::Usage { usage } });
        match *first {
            "node" => match rest {
                [(id, at), x, y, z] => node(&mut draft, (id, *at), [*x, *y, *z], None)?,
                [(id, at), x, y, z, radius] => {
                    node(&mut draft, (id, *at), [*x, *y, *z], Some(*radius))?;
                }
                _ => return misused(NODE),
            },
            "edge" => match rest {
                [a, b] => draft.edge([*a, *b], None, *place)?,
                [a, b, radius] => draft.edge([*a, *b], Some(factor(*radius)?), *place)?,
                _ => return misused(EDGE),
            },
            "face" => match rest {
                [] => return misused(FACE),
                [corners @ .., ("thickness", _), thickness] => {
                    draft.face(corners, Some(factor(*thickness)?), *place)?;
                }
                corners => draft.face(corners, None, *place)?,
            },
            word => {
                let cause = Cause::UnknownLine { word: shortened(word) };
                return Err(Fault { place: *place, cause });
            }
        }
    }
    Ok(draft)
}

fn node(
    draft: &mut Draft,
    (id, place): (&str, Place),
    at: [(&str, Place); 3],
    radius: Option<(&str, Place)>,
) -> Result<(), Fault> {
    let [x, y, z] = at;
    let values = [number(x)?, number(y)?, number(z)?];
    check_coordinates(values, at.map(|(_, place)| place))?;
    let radius = radius.map(factor).transpose()?;
    draft.node(id.to_owned(), values, radius, place)
}

/// The words of `line` before a comment, with their places.
fn words(line: &str, number: usize) -> Vec<(&str, Place)> {
    let code = line.split('#').next().unwrap_or_default();
    let start = |word: &str| word.as_ptr() as usize - code.as_ptr() as usize;
    let place =
        |word: &str| Place::At { line: number, column: code[..start(word)].chars().count() + 1 };
    code.split_whitespace().map(|word| (word, place(word))).collect()
}

fn number((word, place): (&str, Place)) -> Result<f64, Fault> {
    let value = word.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| Fault { place, cause: Cause::NotANumber { word: shortened(word) } })
}

fn factor(word: (&str, Place)) -> Result<f64, Fault> {
    let value = number(word)?;
    check_factor(value, word.1)?;
    Ok(value)
}
