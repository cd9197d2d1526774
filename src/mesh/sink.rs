//! Where a mesh goes that is made in pieces.

use super::Mesh;
use crate::num::memory;
use std::io;
use std::sync::{Mutex, PoisonError};

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
    // A lock each, so that one thread may bring vertices while another brings triangles.
    positions: Mutex<Vec<[f64; 3]>>,
    triangles: Mutex<Vec<[u32; 3]>>,
}

impl Collect {
    /// Bytes of memory that a mesh of this size takes.
    #[must_use]
    pub const fn bytes(vertices: u64, triangles: u64) -> u64 {
        let positions = vertices.saturating_mul(size_of::<[f64; 3]>() as u64);
        positions.saturating_add(triangles.saturating_mul(size_of::<[u32; 3]>() as u64))
    }

    /// The mesh received.
    #[must_use]
    pub fn into_mesh(self) -> Mesh {
        let Self { positions, triangles } = self;
        Mesh {
            positions: positions.into_inner().unwrap_or_else(PoisonError::into_inner),
            triangles: triangles.into_inner().unwrap_or_else(PoisonError::into_inner),
        }
    }
}

impl Sink for Collect {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        memory::ask(Self::bytes(vertices, triangles)).map_err(|shortage| {
            let message = format!("{shortage}; give a larger spacing");
            io::Error::new(io::ErrorKind::OutOfMemory, message)
        })?;
        resize(&mut self.positions, vertices, [0.0; 3])?;
        resize(&mut self.triangles, triangles, [0; 3])
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        put(&self.positions, first, positions);
        Ok(())
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        put(&self.triangles, first, corners);
        Ok(())
    }
}

/// Gives `list` the length `length`; what it holds does not matter.
fn resize<T: Copy>(list: &mut Mutex<Vec<T>>, length: u64, filler: T) -> io::Result<()> {
    let too_large =
        |_| io::Error::new(io::ErrorKind::OutOfMemory, "the mesh does not fit in memory");
    let length = usize::try_from(length).map_err(too_large)?;
    let list = list.get_mut().unwrap_or_else(PoisonError::into_inner);
    if list.capacity() >= length {
        list.resize(length, filler);
    } else {
        // New memory comes zeroed from the system and is touched where it is written.
        *list = vec![filler; length];
    }
    Ok(())
}

fn put<T: Copy>(list: &Mutex<Vec<T>>, first: u64, items: &[T]) {
    let mut list = list.lock().unwrap_or_else(PoisonError::into_inner);
    list[first as usize..][..items.len()].copy_from_slice(items);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_beyond_memory_is_refused_before_it_is_made() {
        if memory::available().is_some() {
            let error = Collect::default().begin(1 << 60, 1 << 50).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::OutOfMemory);
            assert!(error.to_string().contains("GiB of memory"), "{error}");
        }
    }
}
