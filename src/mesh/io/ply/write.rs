//! Writing binary PLY: vertices as `float` or `double`, faces as `uchar int`.
//!
//! A file whose counts are known has every vertex and triangle at a known offset, so its pieces
//! can be written by many threads in any order. Indices are `int`, `uint` beyond 2^31 vertices.

use super::spool::Spooled;
use crate::mesh::Sink;
#[cfg(target_os = "linux")]
use crate::mesh::io::direct::DirectWriter;
use crate::mesh::io::output::{Precision, WriteError, single};
use crate::mesh::io::runs::Runs;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, Write};

/// Bytes of a triangle: its number of corners and three indices.
pub(super) const TRIANGLE: usize = 13;
/// Items encoded between two writes: a buffer that stays in cache.
const ITEMS_A_PIECE: usize = 1 << 14;
/// Bytes beyond which a file is written past the page cache. Memory that takes two gigabytes for
/// the asking costs a quarter of a second a gigabyte; memory that has to be found first, or written
/// back meanwhile, ten times as much.
#[cfg(target_os = "linux")]
const LARGE: u64 = 1 << 31;

thread_local! {
    /// Encoded items, kept so that no run allocates.
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Where things lie in a file.
#[derive(Debug)]
pub(super) struct Layout {
    header: String,
    pub(super) precision: Precision,
    pub(super) vertices: u64,
    pub(super) triangles: u64,
}

impl Layout {
    fn new(precision: Precision, vertices: u64, triangles: u64) -> Result<Self, WriteError> {
        let index = match vertices {
            0..=0x8000_0000 => "int",
            0x8000_0001..=0x1_0000_0000 => "uint",
            _ => return Err(WriteError::TooManyVertices { vertices }),
        };
        let number = match precision {
            Precision::Single => "float",
            Precision::Double => "double",
        };
        let version = env!("CARGO_PKG_VERSION");
        let header = format!(
            "ply\nformat binary_little_endian 1.0\ncomment alveole {version}\n\
             element vertex {vertices}\n\
             property {number} x\nproperty {number} y\nproperty {number} z\n\
             element face {triangles}\nproperty list uchar {index} vertex_indices\nend_header\n"
        );
        Ok(Self { header, precision, vertices, triangles })
    }

    /// Bytes of a vertex.
    pub(super) const fn vertex(&self) -> u64 {
        match self.precision {
            Precision::Single => 12,
            Precision::Double => 24,
        }
    }

    pub(super) const fn vertex_offset(&self, number: u64) -> u64 {
        self.header.len() as u64 + self.vertex() * number
    }

    pub(super) const fn triangle_offset(&self, number: u64) -> u64 {
        self.vertex_offset(self.vertices) + TRIANGLE as u64 * number
    }
}

/// Writes the binary little-endian variant.
pub(in crate::mesh::io) fn write(
    mesh: &dyn Runs,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    let (vertices, triangles) = mesh.counts();
    let layout = Layout::new(precision, vertices, triangles)?;
    out.write_all(layout.header.as_bytes())?;
    let mut buffer = Vec::new();
    mesh.vertices(&mut |run| {
        for piece in run.chunks(ITEMS_A_PIECE) {
            out.write_all(encode_vertices(&mut buffer, piece, precision)?)?;
        }
        Ok(())
    })?;
    mesh.triangles(&mut |run| {
        for piece in run.chunks(ITEMS_A_PIECE) {
            out.write_all(encode_triangles(&mut buffer, piece))?;
        }
        Ok(())
    })
}

/// A sink that writes a binary PLY file by positioned writes, each piece as it comes.
#[derive(Debug)]
pub struct PlySink {
    file: File,
    precision: Precision,
    layout: Option<Layout>,
    #[cfg(target_os = "linux")]
    direct: Option<DirectWriter>,
    #[cfg(not(unix))]
    seek: std::sync::Mutex<()>,
}

impl PlySink {
    /// A sink into `file`, which must be an empty regular file open for writing.
    #[must_use]
    pub const fn new(file: File, precision: Precision) -> Self {
        Self {
            file,
            precision,
            layout: None,
            #[cfg(target_os = "linux")]
            direct: None,
            #[cfg(not(unix))]
            seek: std::sync::Mutex::new(()),
        }
    }

    /// The file, complete if every announced vertex and triangle has come.
    ///
    /// # Errors
    /// Any failure of writing what came before.
    pub fn finish(self) -> io::Result<File> {
        #[cfg(target_os = "linux")]
        if let Some(direct) = self.direct {
            direct.finish()?;
        }
        Ok(self.file)
    }

    /// The mesh in the file, which must be open for reading too.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub(in crate::mesh::io) fn into_runs(mut self) -> io::Result<Spooled> {
        let layout = self.layout.take().ok_or_else(unannounced)?;
        Ok(Spooled::new(self.finish()?, layout))
    }

    fn layout(&self) -> io::Result<&Layout> {
        self.layout.as_ref().ok_or_else(unannounced)
    }

    #[cfg(unix)]
    fn write_all_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        #[cfg(target_os = "linux")]
        if let Some(direct) = &self.direct {
            return direct.write_all_at(bytes, offset);
        }
        std::os::unix::fs::FileExt::write_all_at(&self.file, bytes, offset)
    }

    #[cfg(not(unix))]
    fn write_all_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        use std::io::{Seek, SeekFrom};
        let _one_at_a_time = self.seek.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut file = &self.file;
        file.seek(SeekFrom::Start(offset))?;
        file.write_all(bytes)
    }
}

/// The error of a caller that says nothing before its pieces.
fn unannounced() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "a piece came before the size of the mesh")
}

impl Sink for PlySink {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        let layout = Layout::new(self.precision, vertices, triangles)?;
        // A device has no length to reserve.
        if self.file.metadata()?.is_file() {
            let length = layout.triangle_offset(triangles);
            self.file.set_len(length)?;
            #[cfg(target_os = "linux")]
            if length > LARGE {
                DirectWriter::set_aside(&self.file, length)?;
                self.direct = DirectWriter::new(&self.file, length);
            }
        }
        self.write_all_at(layout.header.as_bytes(), 0)?;
        self.layout = Some(layout);
        Ok(())
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        let layout = self.layout()?;
        debug_assert!(first + positions.len() as u64 <= layout.vertices, "more than announced");
        let mut offset = layout.vertex_offset(first);
        BUFFER.with_borrow_mut(|buffer| {
            for piece in positions.chunks(ITEMS_A_PIECE) {
                let bytes = encode_vertices(buffer, piece, self.precision)?;
                self.write_all_at(bytes, offset)?;
                offset += bytes.len() as u64;
            }
            Ok(())
        })
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        let layout = self.layout()?;
        debug_assert!(first + corners.len() as u64 <= layout.triangles, "more than announced");
        let mut offset = layout.triangle_offset(first);
        BUFFER.with_borrow_mut(|buffer| {
            for piece in corners.chunks(ITEMS_A_PIECE) {
                let bytes = encode_triangles(buffer, piece);
                self.write_all_at(bytes, offset)?;
                offset += bytes.len() as u64;
            }
            Ok(())
        })
    }
}

/// The first `length` bytes of `buffer`, which grows if it must.
fn room(buffer: &mut Vec<u8>, length: usize) -> &mut [u8] {
    if buffer.len() < length {
        buffer.resize(length, 0);
    }
    &mut buffer[..length]
}

fn encode_vertices<'a>(
    buffer: &'a mut Vec<u8>,
    positions: &[[f64; 3]],
    precision: Precision,
) -> Result<&'a [u8], WriteError> {
    match precision {
        Precision::Single => {
            let bytes = room(buffer, 12 * positions.len());
            let mut in_range = true;
            // Number by number, which becomes vector code.
            let values = positions.as_flattened();
            for (item, value) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(values) {
                let single = *value as f32;
                in_range &= single.is_finite();
                *item = single.to_le_bytes();
            }
            if !in_range {
                for &value in positions.iter().flatten() {
                    single(value)?;
                }
            }
            Ok(bytes)
        }
        Precision::Double => {
            let bytes = room(buffer, 24 * positions.len());
            for (item, [x, y, z]) in bytes.as_chunks_mut::<24>().0.iter_mut().zip(positions) {
                item[..8].copy_from_slice(&x.to_le_bytes());
                item[8..16].copy_from_slice(&y.to_le_bytes());
                item[16..].copy_from_slice(&z.to_le_bytes());
            }
            Ok(bytes)
        }
    }
}

fn encode_triangles<'a>(buffer: &'a mut Vec<u8>, corners: &[[u32; 3]]) -> &'a [u8] {
    let bytes = room(buffer, TRIANGLE * corners.len());
    for (item, [a, b, c]) in bytes.as_chunks_mut::<TRIANGLE>().0.iter_mut().zip(corners) {
        item[0] = 3;
        item[1..5].copy_from_slice(&a.to_le_bytes());
        item[5..9].copy_from_slice(&b.to_le_bytes());
        item[9..].copy_from_slice(&c.to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use std::io::Read;

    fn sheet(n: u32) -> Mesh {
        Mesh {
            positions: (0..n + 2).map(|i| [f64::from(i) * 0.1, f64::from(i % 2), 1e9]).collect(),
            triangles: (0..n).map(|i| [i, i + 1, i + 2]).collect(),
        }
    }

    #[test]
    fn pieces_in_any_order_give_the_file_written_at_once() {
        let mesh = sheet(40_000);
        for precision in [Precision::Single, Precision::Double] {
            let mut whole = Vec::new();
            write(&mesh, precision, &mut whole).unwrap();
            let mut sink = PlySink::new(tempfile::tempfile().unwrap(), precision);
            sink.begin(mesh.positions.len() as u64, mesh.triangles.len() as u64).unwrap();
            sink.triangles(20_000, &mesh.triangles[20_000..]).unwrap();
            std::thread::scope(|scope| {
                scope.spawn(|| sink.vertices(7, &mesh.positions[7..]).unwrap());
                scope.spawn(|| sink.triangles(0, &mesh.triangles[..20_000]).unwrap());
                scope.spawn(|| sink.vertices(0, &mesh.positions[..7]).unwrap());
            });
            let mut file = sink.finish().unwrap();
            let mut streamed = Vec::new();
            io::Seek::rewind(&mut file).unwrap();
            file.read_to_end(&mut streamed).unwrap();
            assert!(whole == streamed);
        }
    }

    #[test]
    fn counts_choose_the_index_type_or_are_refused() {
        let header = |vertices| Layout::new(Precision::Single, vertices, 1).map(|l| l.header);
        assert!(header(1 << 31).unwrap().contains("uchar int "));
        assert!(header((1 << 31) + 1).unwrap().contains("uchar uint "));
        assert!(header(1 << 32).unwrap().contains("uchar uint "));
        assert!(header((1 << 32) + 1).unwrap_err().to_string().contains("2^32"));
    }

    #[test]
    fn single_precision_refuses_what_it_would_make_infinite() {
        let mesh = Mesh { positions: vec![[0.0, 1e39, 0.0]], triangles: vec![] };
        assert!(write(&mesh, Precision::Single, &mut Vec::new()).is_err());
        assert!(write(&mesh, Precision::Double, &mut Vec::new()).is_ok());
    }
}
