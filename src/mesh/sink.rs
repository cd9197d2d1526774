//! Where a mesh goes that is made in pieces.

use super::Mesh;
use std::io;
use std::sync::Mutex;

/// A receiver of a mesh whose size is known before its pieces, which come from many threads.
///
/// After [`begin`](Self::begin) every vertex and every triangle arrives exactly once, in runs, in
/// any order.
pub trait Sink: Sync {
    /// Announces the size of the mesh.
    ///
    /// # Errors
    /// When the destination can't hold a mesh of that size, or any failure of writing.
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()>;

    /// Receives the positions of the vertices from number `first` on.
    ///
    /// # Errors
    /// Any failure of writing.
    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()>;

    /// Receives the corners of the triangles from number `first` on.
    ///
    /// # Errors
    /// Any failure of writing.
    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()>;
}

/// A sink that keeps the mesh in memory.
#[derive(Debug, Default)]
pub struct Collect {
    mesh: Mutex<Mesh>,
}

impl Collect {
    /// The mesh received.
    #[must_use]
    pub fn into_mesh(self) -> Mesh {
        self.mesh.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Sink for Collect {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        let too_large =
            |_| io::Error::new(io::ErrorKind::OutOfMemory, "the mesh does not fit in memory");
        let mesh = self.mesh.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        mesh.positions = vec![[0.0; 3]; usize::try_from(vertices).map_err(too_large)?];
        mesh.triangles = vec![[0; 3]; usize::try_from(triangles).map_err(too_large)?];
        Ok(())
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        let mut mesh = self.mesh.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        mesh.positions[first as usize..][..positions.len()].copy_from_slice(positions);
        Ok(())
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        let mut mesh = self.mesh.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        mesh.triangles[first as usize..][..corners.len()].copy_from_slice(corners);
        Ok(())
    }
}
