//! Reading PLY: text and both binary byte orders, any elements, properties and lists.
//!
//! The vertices are the element `vertex` with `x`, `y`, `z`, the faces are `face` with the list
//! `vertex_indices` or `vertex_index`; `tristrips` with such a list has strips of triangles, a
//! negative number after each but the last. All else is passed over. No count of the header is trusted:
//! what can't fit into the rest of the file is refused before anything is read.

use super::header::{Element, Encoding, Holds, Scalar, header};
use super::source::{Ascii, Binary, Source};
use crate::mesh::Mesh;
use crate::mesh::io::Format;
use crate::mesh::io::assembly::{Assembly, ReadReport};
use crate::mesh::io::error::{Fault, Flaw};
use crate::mesh::io::text::{Lines, syntax};
use crate::num::Progress;

/// Reads a PLY file.
pub(crate) fn read(bytes: &[u8], progress: &Progress) -> Result<(Mesh, ReadReport), Flaw> {
    let mut lines = Lines::new(bytes);
    let header = header(&mut lines)?;
    let mut assembly = Assembly::new(Format::Ply, bytes.len(), progress);
    match header.encoding {
        Encoding::Ascii => elements(Ascii::new(lines), &header.elements, &mut assembly)?,
        Encoding::LittleEndian => {
            let source = Binary::<false>::new(bytes, lines.offset);
            elements(source, &header.elements, &mut assembly)?;
        }
        Encoding::BigEndian => {
            let source = Binary::<true>::new(bytes, lines.offset);
            elements(source, &header.elements, &mut assembly)?;
        }
    }
    Ok(assembly.finish()?)
}

/// What a property is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Coordinate(usize),
    Corners,
    Ignored,
}

/// What a list of corners is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Polygon,
    Strips,
}

/// Reads all elements: the first `vertex` before the first `face` and the first `tristrips`,
/// whatever their order.
fn elements<S: Source>(
    mut source: S,
    elements: &[Element],
    assembly: &mut Assembly<'_>,
) -> Result<(), Flaw> {
    let first = |name| elements.iter().position(|element| element.name == name);
    let vertex = first("vertex");
    let shapes = [(first("face"), Shape::Polygon), (first("tristrips"), Shape::Strips)];
    let mut early_faces = Vec::new();
    for (number, element) in elements.iter().enumerate() {
        source.announce(element)?;
        let shape = shapes.iter().find(|(first, _)| *first == Some(number)).map(|found| found.1);
        if Some(number) == vertex {
            vertices(&mut source, element, assembly)?;
        } else if let Some(shape) = shape {
            if vertex > Some(number) {
                early_faces.push((source.clone(), element, shape));
                skip(&mut source, element)?;
            } else {
                faces(&mut source, element, shape, assembly)?;
            }
        } else {
            assembly.ignore(&format!("element {}", element.name));
            skip(&mut source, element)?;
        }
    }
    if !source.is_exhausted() {
        assembly.ignore("data after the last element");
    }
    for (mut source, element, shape) in early_faces {
        faces(&mut source, element, shape, assembly)?;
    }
    Ok(())
}

fn vertices<S: Source>(
    source: &mut S,
    element: &Element,
    assembly: &mut Assembly<'_>,
) -> Result<(), Flaw> {
    let roles = roles(element, assembly, |name, holds| match (name, holds) {
        ("x", Holds::One(_)) => Role::Coordinate(0),
        ("y", Holds::One(_)) => Role::Coordinate(1),
        ("z", Holds::One(_)) => Role::Coordinate(2),
        _ => Role::Ignored,
    });
    let has = |axis: usize| roles.contains(&Role::Coordinate(axis));
    if !(0..3).all(has) {
        return Err(syntax(NO_PLACE, Some(found(element).as_bytes())).into());
    }
    rows(source, element, &roles, |source, row| {
        assembly.reach(source.offset())?;
        assembly.vertex(row.position).map_err(|fault| source.flaw(fault))
    })
}

fn faces<S: Source>(
    source: &mut S,
    element: &Element,
    shape: Shape,
    assembly: &mut Assembly<'_>,
) -> Result<(), Flaw> {
    if element.count == 0 {
        return Ok(());
    }
    let roles = roles(element, assembly, |name, holds| match (name, holds) {
        ("vertex_indices" | "vertex_index", Holds::List { item, .. }) if item.is_integer() => {
            Role::Corners
        }
        _ => Role::Ignored,
    });
    if !roles.contains(&Role::Corners) {
        return Err(syntax(NO_CORNERS, Some(found(element).as_bytes())).into());
    }
    rows(source, element, &roles, |source, row| {
        assembly.reach(source.offset())?;
        let done = match shape {
            Shape::Polygon => assembly.face(&row.corners),
            Shape::Strips => strips(&row.corners, assembly),
        };
        done.map_err(|fault| source.flaw(fault))
    })
}

/// The names of the element's properties.
fn found(element: &Element) -> String {
    if element.properties.is_empty() {
        return "no properties".to_owned();
    }
    let names = element.properties.iter().map(|property| property.name.as_str());
    names.collect::<Vec<_>>().join(" ")
}

/// What vertices must have.
const NO_PLACE: &str = "numbers x, y and z in the element vertex";

/// What faces must have.
const NO_CORNERS: &str = "a list of integers vertex_indices in the element of the faces";

/// Adds the triangles of strips: each corner after two makes one with them, turned round every
/// other time.
fn strips(corners: &[i64], assembly: &mut Assembly<'_>) -> Result<(), Fault> {
    for strip in corners.split(|corner| *corner < 0) {
        for (number, window) in strip.windows(3).enumerate() {
            let mut corners = [window[0], window[1], window[2]];
            if number % 2 == 1 {
                corners.swap(0, 1);
            }
            assembly.face(&corners)?;
        }
    }
    Ok(())
}

/// The roles of the element's properties; of several with one role the first has it.
fn roles(
    element: &Element,
    assembly: &mut Assembly<'_>,
    role: impl Fn(&str, Holds) -> Role,
) -> Vec<Role> {
    let mut roles = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let mut role = role(&property.name, property.holds);
        if role == Role::Ignored || roles.contains(&role) {
            role = Role::Ignored;
            assembly.ignore(&format!("property {} of {}", property.name, element.name));
        }
        roles.push(role);
    }
    roles
}

/// The wanted properties of one item.
#[derive(Default)]
struct Row {
    position: [f64; 3],
    corners: Vec<i64>,
}

/// Reads every item of `element` and hands it to `visit`.
fn rows<S: Source>(
    source: &mut S,
    element: &Element,
    roles: &[Role],
    mut visit: impl FnMut(&S, &Row) -> Result<(), Flaw>,
) -> Result<(), Flaw> {
    // An item without properties takes no room, so their number proves nothing.
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut row = Row::default();
    for _ in 0..element.count {
        source.begin_item()?;
        for (property, &role) in element.properties.iter().zip(roles) {
            match (property.holds, role) {
                (Holds::One(scalar), Role::Coordinate(axis)) => {
                    row.position[axis] = source.number(scalar)?;
                }
                (Holds::List { length, item }, Role::Corners) => {
                    let length = list_length(source, length, item)?;
                    row.corners.clear();
                    for _ in 0..length {
                        row.corners.push(source.integer(item)?);
                    }
                }
                (Holds::One(scalar), Role::Corners | Role::Ignored) => source.skip(scalar, 1)?,
                (Holds::List { length, item }, Role::Coordinate(_) | Role::Ignored) => {
                    let length = list_length(source, length, item)?;
                    source.skip(item, length)?;
                }
            }
        }
        source.end_item()?;
        visit(source, &row)?;
    }
    Ok(())
}

fn skip<S: Source>(source: &mut S, element: &Element) -> Result<(), Flaw> {
    rows(source, element, &vec![Role::Ignored; element.properties.len()], |_, _| Ok(()))
}

/// Reads the length of a list whose items are still to come in full.
fn list_length<S: Source>(source: &mut S, length: Scalar, item: Scalar) -> Result<usize, Flaw> {
    let length = source.integer(length)?;
    let fits = usize::try_from(length).ok().filter(|&length| source.has(item, length));
    fits.ok_or_else(|| source.flaw(Fault::Truncated { before: "the end of a list" }))
}
