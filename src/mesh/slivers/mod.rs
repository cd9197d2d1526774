//! Slivers: triangles with a small angle, and how to be rid of them.
//!
//! Marching cubes cuts slivers wherever the surface passes close by a node of the grid: of a gyroid
//! at 64³, 8 triangles in 100 have an angle below 5°. [`remove`] moves such vertices onto one
//! another, as snapping the node onto the surface would: edges much shorter than the grid's are
//! contracted, then edges are flipped where that makes the least angle larger, then vertices slide
//! along the surface to the middle of their neighbours. What is left lies where no edge can be
//! contracted, since three go round a thread, a neck or a wedge: there vertices slide away from one
//! another, so that it widens along the surface, or an edge of the three is split, so that another can
//! go. And so again until nothing changes.
//!
//! It promises: the mesh stays closed, oriented and manifold, with the same components and Euler
//! characteristic (an edge is contracted only if its ends have exactly two common neighbours; Dey,
//! Edelsbrunner, Guha & Nekhayev 1999, theorem for 2-complexes); flat cuts stay flat, corners of the
//! box stay, and vertices of rims stay where they are, vanish, or go to the box's edge or corner if it is
//! closer than a 32nd of the spacing; where the surface crosses an edge of the box twice within an eighth
//! of the spacing, one crossing goes to the other; vertices inside the box lie on the surface to a
//! part in 10⁹ of the grid's spacing where Newton's method finds it, on their own side of walls and
//! jumps, and where that keeps them apart from others; no change turns a triangle by more than 60°, makes
//! two vertices one place in the file or leaves a triangle without area in it; the same bytes for any
//! number of threads. Of the 27 periodic surfaces at 64³, cut by a box, none keeps an
//! angle below 5° (their least ones are 6.6° to 35°).
//!
//! It does not promise a least angle. Of the 27 surfaces on seven other grids of 40 to 72 cells, small
//! ones are left where W crosses itself (at most 14 triangles, at 50³) and where C(Y), Y and C(±Y)
//! leave the box almost along its side (at most 15 triangles, at 55³ and 63³). Nor does it promise
//! that triangles of far parts do not cross where walls are thinner than a cell. The whole mesh is
//! gone through again and again: 6 µs of processor time a triangle.
//!
//! Sources: grid snapping is that of Raman & Wenger 2008 (SnapMC); contracting, flipping and
//! sliding in turn is the remeshing of Botsch & Kobbelt 2004, section 4, with the grid's spacing in
//! place of a target length, and no edges split but those that bar a contraction.

mod contract;
mod edges;
mod flip;
mod part;
mod places;
mod sheets;
mod slide;
mod split;

use super::Mesh;
use crate::geom::Aabb;
use crate::mesh::io::Precision;
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

/// A change that leaves a smaller angle than this, in degrees, must leave none much smaller than
/// there was.
const POOR_DEG: f64 = 8.0;

/// Triangles turn at once by less than the angle of this cosine.
const TURN: f64 = 0.5;

/// The larger angle that is called a sliver's, in degrees.
const SLIVER_DEG: f64 = 5.0;
/// Its tangent.
const SLIVER_TAN: f64 = 0.087_488_663_525_924;

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
    /// The precision that its meshes are written in.
    pub precision: Precision,
}

/// What was done about slivers.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Removal {
    /// Vertices that became one with another.
    pub merged: usize,
    /// Edges that were flipped.
    pub flipped: usize,
    /// Edges that were split, each by a new vertex.
    pub split: usize,
    /// Times that a vertex slid along the surface or was parted from another.
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
    let mut sheets = Sheets::new(std::mem::take(mesh), cut);
    let (slivers_before, _) = sheets.slivers();
    let (mut merged, mut flipped, mut split, mut slid) = (0, 0, 0, 0);
    for round in 0..ROUNDS {
        let contracted =
            until_none(progress, || Ok::<_, E>(contract::contract(&mut sheets, cut.spacing)))?;
        let turned = until_none(progress, || Ok::<_, E>(flip::flip(&mut sheets)))?;
        merged += contracted;
        flipped += turned;
        if contracted + turned == 0 && round > 0 {
            break;
        }
        if let Some(field) = &mut field {
            progress.advance(0)?;
            slid += slide::slide(&mut sheets, cut.spacing, &mut **field)?;
            slid += until_none(progress, || part::part(&mut sheets, cut.spacing, &mut **field))?;
            split += until_none(progress, || {
                let [now, freed] = split::split(&mut sheets, cut.spacing, &mut **field)?;
                merged += freed;
                Ok::<_, E>(now)
            })?;
        }
    }
    if let Some(field) = &mut field {
        slide::settle(&mut sheets, cut.spacing, &mut **field)?;
    }
    let (slivers, least_angle_deg) = sheets.slivers();
    *mesh = sheets.into_mesh();
    Ok(Removal { merged, flipped, split, slid, slivers_before, slivers, least_angle_deg })
}

/// Goes over the mesh until nothing changes, at most [`PASSES`] times; returns how many changes.
fn until_none<E: From<Cancelled>>(
    progress: &Progress,
    mut pass: impl FnMut() -> Result<usize, E>,
) -> Result<usize, E> {
    let mut changes = 0;
    for _ in 0..PASSES {
        progress.advance(0)?;
        let now = pass()?;
        changes += now;
        if now == 0 {
            break;
        }
    }
    Ok(changes)
}

#[cfg(test)]
mod tests;
