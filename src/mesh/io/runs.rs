//! A mesh as its writers take it: how many vertices and triangles, then runs of them in order.
//!
//! A writer that asks for no more writes a mesh in memory and one in a file by the same code, and
//! needs memory for a run.

use super::output::WriteError;
use crate::mesh::Mesh;
use std::io;

/// The longest run of a mesh that is not in memory, and as many rows of text as are formatted at a
/// time: enough for sixteen threads, in some ten megabytes.
pub(super) const ITEMS_A_RUN: usize = 1 << 17;
/// Triangles whose corners are looked up between two writes: what stays in cache.
const CORNERS_A_RUN: usize = 1 << 10;

/// What takes a run of items; its first failure ends the runs.
pub(super) type Take<'a, T> = dyn FnMut(&[T]) -> Result<(), WriteError> + 'a;

/// A mesh that comes in runs, as often as it is asked for.
pub(super) trait Runs {
    /// The numbers of vertices and of triangles.
    fn counts(&self) -> (u64, u64);

    /// Hands over the positions of all vertices.
    ///
    /// # Errors
    /// That of `take`, or of reading the mesh.
    fn vertices(&self, take: &mut Take<'_, [f64; 3]>) -> Result<(), WriteError>;

    /// Hands over the corners of all triangles, as numbers of vertices.
    ///
    /// # Errors
    /// That of `take`, or of reading the mesh.
    fn triangles(&self, take: &mut Take<'_, [u32; 3]>) -> Result<(), WriteError>;

    /// Hands over the corners of all triangles, as positions.
    ///
    /// # Errors
    /// That of `take`, or of reading the mesh.
    fn corners(&self, take: &mut Take<'_, [[f64; 3]; 3]>) -> Result<(), WriteError>;
}

impl Runs for Mesh {
    fn counts(&self) -> (u64, u64) {
        (self.positions.len() as u64, self.triangles.len() as u64)
    }

    fn vertices(&self, take: &mut Take<'_, [f64; 3]>) -> Result<(), WriteError> {
        take(&self.positions)
    }

    fn triangles(&self, take: &mut Take<'_, [u32; 3]>) -> Result<(), WriteError> {
        take(&self.triangles)
    }

    fn corners(&self, take: &mut Take<'_, [[f64; 3]; 3]>) -> Result<(), WriteError> {
        look_up(&self.triangles, &mut |vertex| Ok(self.positions[vertex as usize]), take)
    }
}

/// Hands over the corners of `triangles`, the vertices of which `position` finds.
///
/// # Errors
/// That of `take` or `position`.
pub(super) fn look_up(
    triangles: &[[u32; 3]],
    position: &mut impl FnMut(u32) -> io::Result<[f64; 3]>,
    take: &mut Take<'_, [[f64; 3]; 3]>,
) -> Result<(), WriteError> {
    let mut corners = [[[0.0; 3]; 3]; CORNERS_A_RUN];
    for run in triangles.chunks(CORNERS_A_RUN) {
        for (points, numbers) in corners.iter_mut().zip(run) {
            for (point, &number) in points.iter_mut().zip(numbers) {
                *point = position(number)?;
            }
        }
        take(&corners[..run.len()])?;
    }
    Ok(())
}
