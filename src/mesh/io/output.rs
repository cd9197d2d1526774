//! Writing a mesh in any format, whole or in pieces.

use super::gather::{Gathered, MOST_IN_MEMORY};
use super::runs::Runs;
use super::{Format, PlySink, obj, off, ply, stl, threemf};
use crate::mesh::{Mesh, Sink};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// How coordinates are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Precision {
    /// As `f32`, 24 bits of significand.
    Single,
    /// As `f64`, without loss.
    Double,
}

impl Precision {
    /// The least precision that tells points apart at a distance of `length` and at coordinates up
    /// to `largest`: single where that is at least four units in its last place.
    #[must_use]
    pub fn to_resolve(length: f64, largest: f64) -> Self {
        let unit = libm::ldexp(1.0, libm::ilogb(largest).clamp(-126, 1000) - 23);
        // The comparison fails on NaN, and then nothing is known to suffice.
        if largest.abs() <= f64::from(f32::MAX) && length >= 4.0 * unit {
            Self::Single
        } else {
            Self::Double
        }
    }
}

/// Why a mesh can't be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The destination failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Double precision was asked of STL.
    #[error(
        "STL holds single precision only, which this mesh needs more than: write PLY, 3MF, OBJ or OFF"
    )]
    StlIsSingle,
    /// Single precision was asked for where triangles would lose their area in it.
    #[error("single precision holds less than this mesh needs: leave `precision` out")]
    TooCoarse,
    /// A coordinate is too large for single precision.
    #[error("coordinate {value:e} is beyond single precision: write PLY with double precision")]
    BeyondSingle {
        /// The coordinate.
        value: f64,
    },
    /// The vertices outnumber the indices of the format.
    #[error(
        "{vertices} vertices are more than the 2^32 that a mesh file can number: use a coarser grid"
    )]
    TooManyVertices {
        /// How many there are.
        vertices: u64,
    },
    /// The triangles outnumber the counter of STL.
    #[error("{triangles} triangles are more than STL can count (2^32 - 1): write PLY")]
    TooManyTriangles {
        /// How many there are.
        triangles: u64,
    },
}

impl From<WriteError> for io::Error {
    fn from(error: WriteError) -> Self {
        match error {
            WriteError::Io(error) => error,
            error @ (WriteError::StlIsSingle
            | WriteError::TooCoarse
            | WriteError::BeyondSingle { .. }
            | WriteError::TooManyVertices { .. }
            | WriteError::TooManyTriangles { .. }) => Self::new(io::ErrorKind::InvalidInput, error),
        }
    }
}

/// Writes `mesh` to `out` in `format`.
///
/// # Errors
/// [`WriteError`] when `out` fails or `format` can't hold the mesh at `precision`.
pub fn write(
    mesh: &Mesh,
    format: Format,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    write_runs(mesh, format, precision, out)
}

fn write_runs(
    mesh: &dyn Runs,
    format: Format,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    match format {
        Format::Obj => obj::write(mesh, precision, out),
        Format::Off => off::write(mesh, precision, out),
        Format::Ply => ply::write(mesh, precision, out),
        Format::Stl => stl::write(mesh, precision, out),
        Format::ThreeMf => threemf::write(mesh, precision, out),
    }
}

/// A sink that ends in a file, with memory that is bounded whatever the size of the mesh.
///
/// PLY is written as its pieces come. The other formats, and PLY that is written front to back, are
/// gathered and written by [`finish`](Self::finish): a mesh beyond 32 MiB in a file without a name,
/// which is gone when the process is, however it ends.
#[derive(Debug)]
pub struct FileSink {
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Placed(PlySink),
    Gathered { mesh: Gathered, file: File, format: Format, precision: Precision },
}

impl FileSink {
    /// A sink into `file`, which must be an empty regular file open for writing, or a device that
    /// takes writes at positions.
    ///
    /// A large mesh is gathered in a file in `folder`, which had better be that of `file`: folders
    /// for temporary files are in memory on some systems.
    ///
    /// # Errors
    /// [`WriteError::StlIsSingle`].
    pub fn new(
        file: File,
        format: Format,
        precision: Precision,
        folder: &Path,
    ) -> Result<Self, WriteError> {
        match format {
            Format::Ply => Ok(Self { stage: Stage::Placed(PlySink::new(file, precision)) }),
            Format::Obj | Format::Off | Format::Stl | Format::ThreeMf => {
                Self::in_order(file, format, precision, folder)
            }
        }
    }

    /// As [`new`](Self::new) into what is written front to back, such as a pipe.
    ///
    /// # Errors
    /// [`WriteError::StlIsSingle`].
    pub fn in_order(
        file: File,
        format: Format,
        precision: Precision,
        folder: &Path,
    ) -> Result<Self, WriteError> {
        let mesh = Gathered::new(folder.to_owned(), precision, MOST_IN_MEMORY);
        Self::gathering(mesh, file, format, precision)
    }

    /// A sink that gathers in `mesh`, which must be at the same precision.
    fn gathering(
        mesh: Gathered,
        file: File,
        format: Format,
        precision: Precision,
    ) -> Result<Self, WriteError> {
        if format == Format::Stl && precision == Precision::Double {
            return Err(WriteError::StlIsSingle);
        }
        Ok(Self { stage: Stage::Gathered { mesh, file, format, precision } })
    }

    /// Writes what is left and returns the file.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn finish(self) -> Result<File, WriteError> {
        match self.stage {
            Stage::Placed(sink) => Ok(sink.finish()?),
            Stage::Gathered { mesh, file, format, precision } => {
                let mut out = BufWriter::with_capacity(1 << 20, file);
                write_runs(&*mesh.into_runs()?, format, precision, &mut out)?;
                out.into_inner().map_err(|error| WriteError::Io(error.into_error()))
            }
        }
    }
}

impl Sink for FileSink {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        match &mut self.stage {
            Stage::Placed(sink) => sink.begin(vertices, triangles),
            Stage::Gathered { mesh, format, .. } => {
                if *format == Format::Stl {
                    stl::count(triangles)?;
                }
                mesh.begin(vertices, triangles)
            }
        }
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        match &self.stage {
            Stage::Placed(sink) => sink.vertices(first, positions),
            Stage::Gathered { mesh, .. } => mesh.vertices(first, positions),
        }
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        match &self.stage {
            Stage::Placed(sink) => sink.triangles(first, corners),
            Stage::Gathered { mesh, .. } => mesh.triangles(first, corners),
        }
    }
}

/// The coordinate as `f32`.
///
/// # Errors
/// [`WriteError::BeyondSingle`] when a finite value becomes infinite.
pub(super) fn single(value: f64) -> Result<f32, WriteError> {
    let rounded = value as f32;
    if rounded.is_finite() || !value.is_finite() {
        Ok(rounded)
    } else {
        Err(WriteError::BeyondSingle { value })
    }
}

#[cfg(test)]
mod tests {
    use super::super::runs::ITEMS_A_RUN;
    use super::*;
    use std::io::{Read, Seek};

    /// Hands `mesh` to `sink` in short runs, from three threads, each from the back to the front.
    fn scatter(mesh: &Mesh, sink: &mut FileSink) {
        const RUN: usize = 9_973;
        let (vertices, triangles) = mesh.counts();
        sink.begin(vertices, triangles).unwrap();
        let sink = &*sink;
        std::thread::scope(|scope| {
            for thread in 0..3 {
                scope.spawn(move || {
                    let runs: Vec<_> = mesh.triangles.chunks(RUN).enumerate().collect();
                    for (number, run) in runs.into_iter().rev().filter(|(n, _)| n % 3 == thread) {
                        sink.triangles((number * RUN) as u64, run).unwrap();
                    }
                    let runs: Vec<_> = mesh.positions.chunks(RUN).enumerate().collect();
                    for (number, run) in runs.into_iter().rev().filter(|(n, _)| n % 3 == thread) {
                        sink.vertices((number * RUN) as u64, run).unwrap();
                    }
                });
            }
        });
    }

    #[test]
    fn runs_in_any_order_give_the_file_written_at_once_from_memory_and_from_a_file() {
        // More than a run of what is read back, and coordinates that single precision rounds.
        let last = ITEMS_A_RUN as u32 + 20_000;
        let mesh = Mesh {
            positions: (0..last).map(|n| [f64::from(n) / 3.0, -0.1, 1e9 / f64::from(n)]).collect(),
            triangles: (0..last - 2).map(|n| [n, n + 1, (n * 31 + 7) % last]).collect(),
        };
        let folder = std::env::temp_dir();
        for (format, precision) in Format::ALL
            .into_iter()
            .flat_map(|format| [(format, Precision::Single), (format, Precision::Double)])
            .filter(|choice| *choice != (Format::Stl, Precision::Double))
        {
            let mut whole = Vec::new();
            write(&mesh, format, precision, &mut whole).unwrap();
            for most_in_memory in [0, u64::MAX] {
                let gathered = Gathered::new(folder.clone(), precision, most_in_memory);
                let file = tempfile::tempfile().unwrap();
                let mut sink = FileSink::gathering(gathered, file, format, precision).unwrap();
                scatter(&mesh, &mut sink);
                let mut file = sink.finish().unwrap();
                let mut there = Vec::new();
                file.rewind().unwrap();
                file.read_to_end(&mut there).unwrap();
                assert!(there == whole, "{format:?}, {precision:?}, {most_in_memory}");
            }
        }
    }

    #[test]
    fn what_the_format_can_not_hold_is_refused_in_a_file_as_in_memory() {
        let sink = |format, folder: &Path, most_in_memory| {
            let gathered = Gathered::new(folder.to_owned(), Precision::Single, most_in_memory);
            let file = tempfile::tempfile().unwrap();
            FileSink::gathering(gathered, file, format, Precision::Single).unwrap()
        };
        let folder = std::env::temp_dir();
        for most_in_memory in [0, u64::MAX] {
            let mut beyond = sink(Format::Obj, &folder, most_in_memory);
            beyond.begin(1, 0).unwrap();
            let error = beyond.vertices(0, &[[1e39, 0.0, 0.0]]).map_err(WriteError::from);
            let error = error.and_then(|()| beyond.finish()).unwrap_err();
            assert!(error.to_string().contains("beyond single precision"), "{error}");
        }
        // Were it not refused, it would want fifty gigabytes: in a folder that does not exist.
        let mut beyond = sink(Format::Stl, &folder.join("no such folder"), 0);
        let error = beyond.begin(1, 1 << 32).unwrap_err().to_string();
        assert!(error.contains("write PLY"), "{error}");
    }

    #[test]
    fn precision_follows_the_length_to_resolve() {
        // The unit in the last place of 1.5 is 2^-23, of 0.75 half of it.
        let unit = 2.0_f64.powi(-23);
        assert_eq!(Precision::to_resolve(4.0 * unit, 1.5), Precision::Single);
        assert_eq!(Precision::to_resolve(3.9 * unit, 1.5), Precision::Double);
        assert_eq!(Precision::to_resolve(2.0 * unit, 0.75), Precision::Single);
        assert_eq!(Precision::to_resolve(1.0, 1e7), Precision::Double);
        assert_eq!(Precision::to_resolve(1e300, 1e39), Precision::Double);
        assert_eq!(Precision::to_resolve(f64::NAN, 1.0), Precision::Double);
        assert_eq!(Precision::to_resolve(1.0, f64::NAN), Precision::Double);
        assert_eq!(Precision::to_resolve(1e-9, 0.0), Precision::Single);
    }
}
