//! A mesh as it comes out of a file: faces are checked, triangulated and counted.

use super::Format;
use super::error::Fault;
use crate::mesh::Mesh;
use crate::mesh::polygon::Triangulator;
use crate::num::{Cancelled, Progress};
use serde::Serialize;

/// What a file contained besides the mesh it gave.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ReadReport {
    /// The format of the content, whatever the extension.
    #[serde(serialize_with = "serialize_format")]
    pub format: Format,
    /// Faces in the file.
    pub faces: u64,
    /// Those of them with more than three corners, which were divided into triangles.
    pub polygons: u64,
    /// Triangles dropped because they repeat a corner, and faces of fewer than three corners.
    pub dropped: u64,
    /// Vertices that were merged with one at the same position.
    pub welded: u64,
    /// What the file has and a mesh has not: elements, properties, records.
    pub ignored: Vec<String>,
}

fn serialize_format<S: serde::Serializer>(format: &Format, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(format.name())
}

/// Names kept of what is ignored: a header can have any number.
const MOST_IGNORED: usize = 30;

/// A mesh in the making.
pub(super) struct Assembly<'a> {
    pub(super) mesh: Mesh,
    pub(super) report: ReadReport,
    triangulator: Triangulator,
    corners: Vec<u32>,
    meter: Meter<'a>,
}

impl<'a> Assembly<'a> {
    /// An empty mesh from a file of `size` bytes.
    pub(super) fn new(format: Format, size: usize, progress: &'a Progress) -> Self {
        let report = ReadReport {
            format,
            faces: 0,
            polygons: 0,
            dropped: 0,
            welded: 0,
            ignored: Vec::new(),
        };
        Self {
            mesh: Mesh::default(),
            report,
            triangulator: Triangulator::default(),
            corners: Vec::new(),
            meter: Meter::new(size, progress),
        }
    }

    /// Reports that the file has been read up to `offset`.
    pub(super) fn reach(&mut self, offset: usize) -> Result<(), Cancelled> {
        self.meter.reach(offset)
    }

    /// Adds a vertex.
    pub(super) fn vertex(&mut self, position: [f64; 3]) -> Result<(), Fault> {
        if !position.iter().all(|value| value.is_finite()) {
            return Err(Fault::NotFinite);
        }
        if self.mesh.positions.len() >= u32::MAX as usize {
            return Err(Fault::TooLarge { what: "more than 2^32 - 1 vertices" });
        }
        self.mesh.positions.push(position);
        Ok(())
    }

    /// Adds a face by the numbers of its corners, the first vertex being 0.
    pub(super) fn face(&mut self, corners: &[i64]) -> Result<(), Fault> {
        let vertices = self.mesh.positions.len();
        self.corners.clear();
        for &index in corners {
            match u32::try_from(index) {
                Ok(corner) if (corner as usize) < vertices => self.corners.push(corner),
                Ok(_) | Err(_) => {
                    return Err(Fault::IndexOutOfRange { index, vertices: vertices as u64 });
                }
            }
        }
        self.report.faces += 1;
        if self.corners.len() > 3 {
            // Writers of quadrilaterals repeat a corner to make a triangle.
            self.corners.dedup();
            if self.corners.first() == self.corners.last() {
                self.corners.pop();
            }
        }
        match *self.corners.as_slice() {
            [a, b, c] => push(&mut self.mesh, &mut self.report, [a, b, c]),
            [] | [_] | [_, _] => self.report.dropped += 1,
            _ => {
                self.report.polygons += 1;
                for &triangle in self
                    .triangulator
                    .triangulate(&self.corners, &self.mesh.positions)
                    .ok_or(Fault::TooLarge { what: "a concave face has too many corners" })?
                {
                    push(&mut self.mesh, &mut self.report, triangle);
                }
            }
        }
        Ok(())
    }

    /// Adds a triangle of existing vertices.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        self.report.faces += 1;
        push(&mut self.mesh, &mut self.report, corners);
    }

    /// Notes something that is not part of a mesh, once.
    pub(super) fn ignore(&mut self, what: &str) {
        let ignored = &mut self.report.ignored;
        if ignored.len() <= MOST_IGNORED && !ignored.iter().any(|known| known == what) {
            let is_last = ignored.len() == MOST_IGNORED;
            ignored.push(if is_last { "and more".to_owned() } else { what.to_owned() });
        }
    }

    /// The mesh and what was found.
    pub(super) fn finish(mut self) -> Result<(Mesh, ReadReport), Fault> {
        self.meter.finish()?;
        if self.mesh.triangles.is_empty() {
            return Err(Fault::NoFaces { vertices: self.mesh.positions.len() as u64 });
        }
        Ok((self.mesh, self.report))
    }
}

fn push(mesh: &mut Mesh, report: &mut ReadReport, [a, b, c]: [u32; 3]) {
    if a == b || b == c || c == a {
        report.dropped += 1;
    } else {
        mesh.triangles.push([a, b, c]);
    }
}

/// Bytes of input to a step of progress.
const STEP: usize = 1 << 20;

/// Progress by megabytes of input.
struct Meter<'a> {
    progress: &'a Progress,
    steps: u64,
    done: u64,
    /// Offset where the next step ends.
    next: usize,
}

impl<'a> Meter<'a> {
    fn new(size: usize, progress: &'a Progress) -> Self {
        let steps = (size / STEP) as u64 + 1;
        progress.expect(steps);
        Self { progress, steps, done: 0, next: STEP }
    }

    fn reach(&mut self, offset: usize) -> Result<(), Cancelled> {
        while offset >= self.next && self.done < self.steps {
            self.next += STEP;
            self.done += 1;
            self.progress.advance(1)?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Cancelled> {
        let left = self.steps - self.done;
        self.done = self.steps;
        self.progress.advance(left)
    }
}
