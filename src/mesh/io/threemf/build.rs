//! Puts the items of a model together: objects and their components, moved and scaled.

use super::super::assembly::Assembly;
use super::super::error::{Fault, Flaw};
use super::super::text::syntax;
use super::model::{IDENTITY, Instance, Model, Name, Object, Transform};

/// Components within components, at most.
const DEPTH: usize = 32;

/// Objects placed, and vertices and triangles of them, at most: a small file may ask for any number
/// of copies. What the model has itself is taken fifty times in any case.
const MOST_PLACED: usize = 1 << 18;
const MOST_ITEMS: usize = 1 << 24;
const MOST_COPIES: usize = 50;

/// Adds everything that `model` wants built to `assembly`, in millimetres.
pub(super) fn build(model: &Model, assembly: &mut Assembly<'_>) -> Result<(), Flaw> {
    let mut items = model.items.clone();
    if items.is_empty() && !model.objects.is_empty() {
        assembly.ignore("the lack of build items (all objects are taken)");
        let mut all: Vec<Name> = model.objects.keys().copied().collect();
        all.sort_unstable();
        items.extend(all.into_iter().map(|object| Instance { object, transform: IDENTITY }));
    }
    // Every part measures in its own unit, and moves what it has of others in that.
    let unit = |name: Name| model.parts[name.part as usize].unit;
    let rescaled = |of: Name, by: f64, transform: &Transform| {
        let ratio = unit(of) / by;
        let own = [[ratio, 0.0, 0.0], [0.0, ratio, 0.0], [0.0, 0.0, ratio], [0.0; 3]];
        if ratio == 1.0 { *transform } else { product(&own, transform) }
    };
    let root = model.parts[0].unit;
    let scale = [[root, 0.0, 0.0], [0.0, root, 0.0], [0.0, 0.0, root], [0.0; 3]];
    let placed = |Instance { object, transform }: &Instance| {
        (*object, product(&rescaled(*object, root, transform), &scale), 0)
    };
    let mut pending: Vec<(Name, Transform, usize)> = items.iter().rev().map(placed).collect();
    let size = |object: &Object| object.vertices.len() + object.triangles.len();
    let own: usize = model.objects.values().map(size).sum();
    let most = own.saturating_mul(MOST_COPIES).max(MOST_ITEMS);
    let (mut count, mut items) = (0, 0_usize);
    while let Some((name, transform, depth)) = pending.pop() {
        let Some(object) = model.objects.get(&name) else {
            let text = name.id.to_string();
            return Err(syntax("the number of an object", Some(text.as_bytes())).into());
        };
        if object.is_aside {
            assembly.ignore("supports");
            continue;
        }
        count += 1;
        items = items.saturating_add(size(object));
        if count > MOST_PLACED || items > most {
            return Err(Fault::TooLarge { what: "the model asks for too many copies" }.into());
        }
        if depth >= DEPTH {
            let what = "components contain each other more than 32 deep, or themselves";
            return Err(Fault::TooLarge { what }.into());
        }
        place(object.vertices.as_slice(), &object.triangles, &transform, assembly)?;
        for Instance { object, transform: own } in object.components.iter().rev() {
            let own = rescaled(*object, unit(name), own);
            pending.push((*object, product(&own, &transform), depth + 1));
        }
        if pending.len() > MOST_PLACED {
            return Err(Fault::TooLarge { what: "the model asks for too many copies" }.into());
        }
    }
    Ok(())
}

/// Adds a mesh, moved.
fn place(
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
    transform: &Transform,
    assembly: &mut Assembly<'_>,
) -> Result<(), Flaw> {
    let first = assembly.mesh.positions.len();
    // Sums would lose the sign of a zero.
    let is_still = *transform == IDENTITY;
    for point in vertices {
        assembly.vertex(if is_still { *point } else { moved(point, transform) })?;
    }
    let mirrored = determinant(transform) < 0.0;
    for corners in triangles {
        for corner in corners {
            if *corner as usize >= vertices.len() {
                let (index, vertices) = (i64::from(*corner), vertices.len() as u64);
                return Err(Fault::IndexOutOfRange { index, vertices }.into());
            }
        }
        // Fits: `vertex` has refused more vertices than there are numbers.
        let [a, b, c] = corners.map(|corner| (first + corner as usize) as u32);
        assembly.triangle(if mirrored { [a, c, b] } else { [a, b, c] });
    }
    Ok(())
}

/// (x, y, z, 1) M.
fn moved([x, y, z]: &[f64; 3], m: &Transform) -> [f64; 3] {
    std::array::from_fn(|j| x * m[0][j] + y * m[1][j] + z * m[2][j] + m[3][j])
}

/// First `a`, then `b`.
fn product(a: &Transform, b: &Transform) -> Transform {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let sum = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
            if i == 3 { sum + b[3][j] } else { sum }
        })
    })
}

fn determinant([a, b, c, _]: &Transform) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_act_on_rows_one_after_the_other() {
        let turn = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [5.0, 0.0, 0.0]];
        let double = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.0, 1.0]];
        assert_eq!(moved(&[1.0, 0.0, 0.0], &turn), [5.0, 1.0, 0.0]);
        assert_eq!(moved(&[1.0, 0.0, 0.0], &product(&turn, &double)), [10.0, 2.0, 1.0]);
        assert_eq!(determinant(&turn), 1.0);
        assert_eq!(determinant(&double), 8.0);
    }
}
