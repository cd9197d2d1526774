//! Writing a mesh in any format, whole or in pieces.

use super::{Format, PlySink, obj, off, ply, stl, threemf};
use crate::mesh::sink::Collect;
use crate::mesh::{Mesh, Sink};
use std::fs::File;
use std::io::{self, BufWriter, Write};

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
        "STL holds single precision only, which this mesh needs more than: write PLY, OBJ or OFF"
    )]
    StlIsSingle,
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
    match format {
        Format::Obj => obj::write(mesh, precision, out),
        Format::Off => off::write(mesh, precision, out),
        Format::Ply => ply::write(mesh, precision, out),
        Format::Stl => stl::write(mesh, precision, out),
        Format::ThreeMf => threemf::write(mesh, precision, out),
    }
}

/// A sink that ends in a file.
///
/// PLY is written as its pieces come, with memory bounded by a piece; the other formats are kept
/// in memory and written by [`finish`](Self::finish).
#[derive(Debug)]
pub struct FileSink {
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Streamed(PlySink),
    Collected { mesh: Collect, file: File, format: Format, precision: Precision },
}

impl FileSink {
    /// A sink into `file`, which must be an empty regular file open for writing.
    ///
    /// # Errors
    /// [`WriteError::StlIsSingle`].
    pub fn new(file: File, format: Format, precision: Precision) -> Result<Self, WriteError> {
        let stage = match format {
            Format::Ply => Stage::Streamed(PlySink::new(file, precision)),
            Format::Stl if precision == Precision::Double => return Err(WriteError::StlIsSingle),
            Format::Obj | Format::Off | Format::Stl | Format::ThreeMf => {
                Stage::Collected { mesh: Collect::default(), file, format, precision }
            }
        };
        Ok(Self { stage })
    }

    /// Writes what is left and returns the file.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn finish(self) -> Result<File, WriteError> {
        match self.stage {
            Stage::Streamed(sink) => Ok(sink.finish()?),
            Stage::Collected { mesh, file, format, precision } => {
                let mut out = BufWriter::with_capacity(1 << 20, file);
                write(&mesh.into_mesh(), format, precision, &mut out)?;
                out.into_inner().map_err(|error| WriteError::Io(error.into_error()))
            }
        }
    }
}

impl Sink for FileSink {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        match &mut self.stage {
            Stage::Streamed(sink) => sink.begin(vertices, triangles),
            Stage::Collected { mesh, format, .. } => {
                if vertices > 1 << 32 {
                    return Err(WriteError::TooManyVertices { vertices }.into());
                }
                if *format == Format::Stl {
                    stl::count(triangles)?;
                }
                mesh.begin(vertices, triangles).map_err(|error| {
                    let kind = error.kind();
                    if kind == io::ErrorKind::OutOfMemory {
                        let cure = "or write PLY, which is written as it is made";
                        io::Error::new(kind, format!("{error}, {cure}"))
                    } else {
                        error
                    }
                })
            }
        }
    }

    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        match &self.stage {
            Stage::Streamed(sink) => sink.vertices(first, positions),
            Stage::Collected { mesh, .. } => mesh.vertices(first, positions),
        }
    }

    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        match &self.stage {
            Stage::Streamed(sink) => sink.triangles(first, corners),
            Stage::Collected { mesh, .. } => mesh.triangles(first, corners),
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
    use super::*;

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
