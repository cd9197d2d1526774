//! A file of a [`PlySink`](super::PlySink) as the store of a mesh: it is read back in runs.

use super::write::{Layout, TRIANGLE};
use crate::mesh::io::output::{Precision, WriteError};
use crate::mesh::io::runs::{ITEMS_A_RUN, Runs, Take, look_up};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// Vertices that are read for the sake of one: a brick of the grid has some hundreds.
const VERTICES_A_BLOCK: u64 = 1 << 10;
/// Blocks of vertices in memory, twelve megabytes in single precision. Triangles have their
/// corners in their own brick and in the next along each axis, so a layer of bricks is used at a
/// time: of a gyroid in a box at 4000 cells an axis, 0.8 million vertices.
const BLOCKS: u64 = 1 << 10;

/// A mesh in a file.
#[derive(Debug)]
pub(in crate::mesh::io) struct Spooled {
    file: File,
    layout: Layout,
}

impl Spooled {
    /// The mesh in `file`, which is open for reading too.
    pub(super) const fn new(file: File, layout: Layout) -> Self {
        Self { file, layout }
    }

    fn read(&self, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        let mut file = &self.file;
        file.seek(SeekFrom::Start(offset))?;
        file.read_exact(bytes)
    }

    /// Hands over `count` items of `size` bytes from `offset` on.
    fn runs<T>(
        &self,
        (mut offset, count, size): (u64, u64, usize),
        decode: impl Fn(&[u8]) -> T,
        take: &mut Take<'_, T>,
    ) -> Result<(), WriteError> {
        let longest = count.min(ITEMS_A_RUN as u64) as usize;
        let (mut bytes, mut items) = (vec![0; longest * size], Vec::with_capacity(longest));
        let mut left = count;
        while left > 0 {
            let length = left.min(ITEMS_A_RUN as u64);
            let bytes = &mut bytes[..length as usize * size];
            self.read(offset, bytes)?;
            items.clear();
            items.extend(bytes.chunks_exact(size).map(&decode));
            take(&items)?;
            offset += bytes.len() as u64;
            left -= length;
        }
        Ok(())
    }
}

impl Runs for Spooled {
    fn counts(&self) -> (u64, u64) {
        (self.layout.vertices, self.layout.triangles)
    }

    fn vertices(&self, take: &mut Take<'_, [f64; 3]>) -> Result<(), WriteError> {
        let Layout { vertices, precision, .. } = self.layout;
        let place = (self.layout.vertex_offset(0), vertices, self.layout.vertex() as usize);
        self.runs(place, |bytes| vertex(bytes, precision), take)
    }

    fn triangles(&self, take: &mut Take<'_, [u32; 3]>) -> Result<(), WriteError> {
        let place = (self.layout.triangle_offset(0), self.layout.triangles, TRIANGLE);
        self.runs(place, triangle, take)
    }

    fn corners(&self, take: &mut Take<'_, [[f64; 3]; 3]>) -> Result<(), WriteError> {
        let mut recent = Recent::new(self);
        self.triangles(&mut |run| look_up(run, &mut |number| recent.position(number), take))
    }
}

/// Vertices by number, the blocks used of late being in memory.
///
/// A block has one place, by its number, where it takes that of another: neighbouring blocks never
/// drive each other out.
struct Recent<'a> {
    spooled: &'a Spooled,
    bytes: Vec<u8>,
    /// The number of the block in each place.
    held: Vec<Option<u64>>,
}

impl<'a> Recent<'a> {
    fn new(spooled: &'a Spooled) -> Self {
        let Layout { vertices, .. } = spooled.layout;
        let blocks = vertices.div_ceil(VERTICES_A_BLOCK).min(BLOCKS);
        let bytes = vec![0; (blocks * VERTICES_A_BLOCK * spooled.layout.vertex()) as usize];
        Self { spooled, bytes, held: vec![None; blocks as usize] }
    }

    #[inline]
    fn position(&mut self, number: u32) -> io::Result<[f64; 3]> {
        let number = u64::from(number);
        let block = number / VERTICES_A_BLOCK;
        if self.held[(block % BLOCKS) as usize] != Some(block) {
            self.load(block)?;
        }
        let Layout { precision, .. } = self.spooled.layout;
        let size = self.spooled.layout.vertex() as usize;
        let place = (number % (BLOCKS * VERTICES_A_BLOCK)) as usize;
        Ok(vertex(&self.bytes[place * size..][..size], precision))
    }

    #[cold]
    fn load(&mut self, block: u64) -> io::Result<()> {
        let layout = &self.spooled.layout;
        let size = layout.vertex();
        let (first, place) = (block * VERTICES_A_BLOCK, block % BLOCKS);
        let length = (layout.vertices - first).min(VERTICES_A_BLOCK) * size;
        let start = place * VERTICES_A_BLOCK * size;
        let bytes = &mut self.bytes[start as usize..][..length as usize];
        self.held[place as usize] = None;
        self.spooled.read(layout.vertex_offset(first), bytes)?;
        self.held[place as usize] = Some(block);
        Ok(())
    }
}

#[inline]
fn vertex(bytes: &[u8], precision: Precision) -> [f64; 3] {
    [0, 1, 2].map(|axis| match precision {
        Precision::Single => f64::from(f32::from_le_bytes(bytes.as_chunks().0[axis])),
        Precision::Double => f64::from_le_bytes(bytes.as_chunks().0[axis]),
    })
}

fn triangle(bytes: &[u8]) -> [u32; 3] {
    let (numbers, _) = bytes[1..].as_chunks();
    [0, 1, 2].map(|corner| u32::from_le_bytes(numbers[corner]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::io::PlySink;
    use crate::mesh::{Mesh, Sink};

    /// What is read back of `mesh` must be `mesh`.
    fn check(mesh: &Mesh, precision: Precision) {
        let mut sink = PlySink::new(tempfile::tempfile().unwrap(), precision);
        let (vertices, triangles) = mesh.counts();
        sink.begin(vertices, triangles).unwrap();
        sink.vertices(0, &mesh.positions).unwrap();
        sink.triangles(0, &mesh.triangles).unwrap();
        let spooled = sink.into_runs().unwrap();
        assert_eq!(spooled.counts(), mesh.counts());
        let gathered = |runs: &dyn Runs| {
            let (mut there, mut corners) = (Mesh::default(), Vec::new());
            let mut longest = 0;
            runs.vertices(&mut |run| {
                longest = longest.max(run.len());
                there.positions.extend(run);
                Ok(())
            })
            .unwrap();
            runs.triangles(&mut |run| {
                longest = longest.max(run.len());
                there.triangles.extend(run);
                Ok(())
            })
            .unwrap();
            runs.corners(&mut |run| {
                longest = longest.max(run.len());
                corners.extend_from_slice(run);
                Ok(())
            })
            .unwrap();
            (there, corners, longest)
        };
        let (there, corners, longest) = gathered(&spooled);
        let (_, expected, _) = gathered(mesh);
        assert!(there == *mesh && corners == expected);
        assert!(longest <= ITEMS_A_RUN, "{longest}");
    }

    #[test]
    fn a_mesh_comes_back_in_bounded_runs_whichever_vertices_its_triangles_have() {
        // One block more than there are places, and the last of them not whole.
        let vertices = (BLOCKS * VERTICES_A_BLOCK) as u32 + 77;
        // Steps over more than half of all take turns in the places.
        let step = |n: u32, by: u64| (u64::from(n) * by % u64::from(vertices)) as u32;
        let mesh = Mesh {
            positions: (0..vertices).map(|n| [f64::from(n), -0.5, f64::from(n % 7)]).collect(),
            triangles: (0..200_000)
                .map(|n| [n, step(n, 700_001), vertices - 1 - step(n, 13)])
                .collect(),
        };
        check(&mesh, Precision::Single);
        check(&mesh, Precision::Double);
    }

    #[test]
    fn a_mesh_of_nothing_comes_back() {
        check(&Mesh::default(), Precision::Single);
    }
}
