//! Slivers: triangles with a small angle, and how to be rid of them.
//!
//! Marching cubes cuts slivers wherever the surface passes close by a node of the grid: of a gyroid
//! at 64³, 8 triangles in 100 have an angle below 5°. [`remove`] moves such vertices onto one
//! another, as snapping the node onto the surface would: edges much shorter than the grid's are
//! contracted, then edges are flipped where that makes the least angle larger, then vertices slide
//! along the surface to the middle of their neighbours, and so again until nothing changes.
//!
//! It promises: the mesh stays closed, oriented and manifold, with the same components and Euler
//! characteristic (an edge is contracted only if its ends have exactly two common neighbours; Dey,
//! Edelsbrunner, Guha & Nekhayev 1999, theorem for 2-complexes); flat cuts stay flat, and vertices of
//! their rims stay where they are or vanish; vertices inside the box lie on the surface to a part in
//! 10⁹ of the grid's spacing where Newton's method finds it; no change turns a triangle by more than
//! 60°; the same bytes for any number of threads. Of the 27 periodic surfaces at 64³, cut by a box, 23
//! keep no angle below 5° (their least ones are 8.6° to 35°), the others at most 100 such triangles
//! of 100,000 and more.
//!
//! It does not promise a least angle where the solid itself is sharp, as where a surface leaves the box
//! almost along its side, nor that triangles of far parts do not cross where walls are thinner than
//! a cell. The whole mesh is gone through again and again: 6 µs of processor time a triangle.
//!
//! Sources: grid snapping is that of Raman & Wenger 2008 (SnapMC); contracting, flipping and
//! sliding in turn is the remeshing of Botsch & Kobbelt 2004, section 4, with the grid's spacing in
//! place of a target length and no splitting of edges.

mod contract;
mod flip;
mod sheets;
mod slide;

use super::Mesh;
use crate::geom::Aabb;
use crate::num::progress::{Cancelled, Progress};
use sheets::Sheets;

/// Edges are contracted that are shorter than this part of the spacing: a vertex closer to a node
/// than a quarter of its edge has such an edge to another vertex at that node.
const SHORT: f64 = 0.35;

/// Edges as short as this part of the spacing are contracted whatever the corners at their ends:
/// contouring holds vertices off the nodes by a thousandth, and where a ball of a thousand spacings
/// touches the side of its box, it is cut flat on a twentieth.
const TINY: f64 = 1.0 / 32.0;

/// Triangles are left alone whose least angle, in degrees, is larger than this.
const GOOD_DEG: f64 = 25.0;

/// The larger angle that is called a sliver's, in degrees.
const SLIVER_DEG: f64 = 5.0;

/// Rounds of contracting, flipping and sliding; three to four are enough as a rule.
const ROUNDS: usize = 8;
/// Passes over the mesh, of changes that are not next to one another, that a round takes at most.
const PASSES: usize = 16;

/// The field whose zero is the surface: writes value and gradient at each point.
pub type Field<'a, E> = dyn FnMut(&[[f64; 3]], &mut [[f64; 4]]) -> Result<(), E> + 'a;

/// The grid that the mesh was contoured on.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Its box, by whose sides the solid is cut flat.
    pub bounds: Aabb,
    /// The distance between neighbouring nodes, the least of the axes', in model units.
    pub spacing: f64,
}

/// What was done about slivers.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Removal {
    /// Vertices that became one with another.
    pub merged: usize,
    /// Edges that were flipped.
    pub flipped: usize,
    /// Times that a vertex slid along the surface.
    pub slid: usize,
    /// Triangles with an angle below 5° before.
    pub slivers_before: usize,
    /// Triangles with an angle below 5° that are left.
    pub slivers: usize,
    /// The least angle that is left, in degrees.
    pub least_angle_deg: f64,
}

/// Removes slivers from `mesh`, a sound mesh (see [`check`](super::check())) of `field` on `cut`.
///
/// With no `field` vertices do not slide, and more slivers stay.
///
/// # Errors
/// Whatever `field` fails with, and [`Cancelled`].
pub fn remove<E: From<Cancelled>>(
    mesh: &mut Mesh,
    cut: &Cut,
    progress: &Progress,
    mut field: Option<&mut Field<'_, E>>,
) -> Result<Removal, E> {
    let mut sheets = Sheets::new(std::mem::take(mesh), cut.bounds);
    let (slivers_before, _) = sheets.slivers();
    let (mut merged, mut flipped, mut slid) = (0, 0, 0);
    for round in 0..ROUNDS {
        let mut changed = 0;
        for _ in 0..PASSES {
            progress.advance(0)?;
            let now = contract::contract(&mut sheets, cut.spacing);
            changed += now;
            merged += now;
            if now == 0 {
                break;
            }
        }
        for _ in 0..PASSES {
            progress.advance(0)?;
            let now = flip::flip(&mut sheets);
            changed += now;
            flipped += now;
            if now == 0 {
                break;
            }
        }
        if changed == 0 && round > 0 {
            break;
        }
        if let Some(field) = &mut field {
            progress.advance(0)?;
            slid += slide::slide(&mut sheets, cut.spacing, &mut **field)?;
        }
    }
    if let Some(field) = &mut field {
        slide::settle(&mut sheets, cut.spacing, &mut **field)?;
    }
    let (slivers, least_angle_deg) = sheets.slivers();
    *mesh = sheets.into_mesh();
    Ok(Removal { merged, flipped, slid, slivers_before, slivers, least_angle_deg })
}

#[cfg(test)]
mod tests;
