//! The numbers of a solid: volume, density, area, topology and quality, from its mesh.

use super::{Error, Job, Report, Settings};
use crate::mesh::check::{Check, check};
use crate::mesh::measure::{self, measure};
use crate::mesh::sink::Collect;
use crate::num::Progress;

/// The numbers of a solid.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Measures {
    /// Volume over that of the box that was contoured, 0 to 1.
    pub relative_density: f64,
    /// Volume of the envelope, the intersection of the bounded operands of the final
    /// intersection; `None` if there are none, or they are all of the solid's operands.
    pub envelope_volume: Option<f64>,
    /// Volume over that of the envelope, 0 to 1; over the box where there is no envelope.
    pub envelope_density: f64,
    /// Measures of the mesh.
    #[serde(flatten)]
    pub mesh: measure::Measures,
    /// Counts, topology and defects of the mesh.
    pub check: Check,
    /// What contouring did.
    pub report: Report,
}

impl Job {
    /// Meshes the solid in memory and measures it.
    ///
    /// Volume and area have the second-order error of the mesh; they are those of the file that
    /// the same settings write.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn measure(&self, settings: &Settings, progress: &Progress) -> Result<Measures, Error> {
        let grid = self.grid(settings)?;
        let mut sink = Collect::default();
        let report = self.contour(&grid, settings, progress, &mut sink)?;
        let mesh = sink.into_mesh();
        let (check, measures) = (check(&mesh), measure(&mesh));
        drop(mesh);
        let [lo, hi] = report.bounds;
        let box_volume: f64 = (0..3).map(|a| hi[a] - lo[a]).product();
        let envelope_volume = self.envelope_volume(settings, progress)?;
        Ok(Measures {
            relative_density: measures.volume / box_volume,
            envelope_volume,
            envelope_density: measures.volume / envelope_volume.unwrap_or(box_volume),
            mesh: measures,
            check,
            report,
        })
    }

    /// Volume of the intersection of the bounded operands, on the same grid.
    fn envelope_volume(
        &self,
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Option<f64>, Error> {
        let parameters = self.values();
        let bounded: Vec<_> = (self.operands.iter())
            .filter(|operand| operand.extent(&self.graph, &parameters).bounds.is_finite())
            .collect();
        if bounded.is_empty() || bounded.len() == self.operands.len() {
            return Ok(None);
        }
        let mut graph = self.graph.clone();
        let fields = bounded.iter().map(|operand| operand.field);
        let Some(field) = fields.reduce(|a, b| graph.max(a, b)) else { return Ok(None) };
        let mut sink = Collect::default();
        let grid = self.grid(settings)?;
        self.contour_graph(&graph, field, &grid, settings, progress, &mut sink)?;
        Ok(Some(measure::volume(&sink.into_mesh())))
    }
}
