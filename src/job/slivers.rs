//! Contouring without slivers: the mesh is made whole, mended and then passed on.

use super::{Error, Job, Report, Settings};
use crate::contour::{self, Grid};
use crate::eval::interpret;
use crate::expr::{Graph, NodeId, depends, derive};
use crate::mesh::sink::Collect;
use crate::mesh::{Mesh, Sink, slivers};
use crate::num::Progress;
use glam::DVec3;
use rayon::prelude::*;

/// Whether triangles with small angles stay as contouring makes them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Slivers {
    /// They do.
    #[default]
    Kept,
    /// They are [removed](slivers::remove()); the mesh is then kept in memory.
    Removed,
}

/// Nodes of an expression up to which vertices slide along its surface: each takes a score of
/// evaluations of the whole and of its slopes.
const LARGEST: usize = 20_000;
/// Points that are evaluated at once.
const POINTS: usize = 1024;
/// Vertices and triangles that are passed on at once.
const PIECE: usize = 1 << 16;

impl Job {
    /// What [`Job::contour`] does where slivers are to be removed.
    pub(super) fn contour_without_slivers(
        &self,
        grid: &Grid,
        settings: &Settings,
        progress: &Progress,
        sink: &mut dyn Sink,
    ) -> Result<Report, Error> {
        let mut whole = Collect::default();
        let kept = Settings { slivers: Slivers::Kept, ..settings.clone() };
        let mut report = self.contour(grid, &kept, progress, &mut whole)?;
        let mut mesh = whole.into_mesh();
        let (values, _) = self.solved(grid, settings, progress)?;
        let (mut graph, field) = (self.graph.clone(), self.solid.field);
        let removal = if depends::reachable(&graph, &[field]).len() > LARGEST {
            slivers::remove::<contour::Error>(&mut mesh, &cut(grid), progress, None)?
        } else {
            let [x, y, z] = derive::gradient(&mut graph, field);
            let mut evaluate = |points: &[[f64; 3]], out: &mut [[f64; 4]]| {
                evaluate(&graph, [field, x, y, z], &values, points, out)
            };
            slivers::remove(&mut mesh, &cut(grid), progress, Some(&mut evaluate))?
        };
        report.slivers = Some(removal);
        report.contour.vertices = mesh.positions.len() as u64;
        report.contour.triangles = mesh.triangles.len() as u64;
        pass_on(&mesh, sink).map_err(contour::Error::Sink)?;
        Ok(report)
    }
}

/// What `outputs` are at `points`.
fn evaluate(
    graph: &Graph,
    outputs: [NodeId; 4],
    parameters: &[f64],
    points: &[[f64; 3]],
    out: &mut [[f64; 4]],
) -> Result<(), contour::Error> {
    let pieces = points.par_chunks(POINTS).zip(out.par_chunks_mut(POINTS));
    pieces.try_for_each(|(points, out)| {
        let at = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<_>>());
        let mut found = [(); 4].map(|()| vec![0.0; points.len()]);
        let mut lists = found.each_mut().map(Vec::as_mut_slice);
        let at = at.each_ref().map(Vec::as_slice);
        interpret::points(graph, &outputs, at, parameters, &mut lists)?;
        for (i, out) in out.iter_mut().enumerate() {
            *out = found.each_ref().map(|list| list[i]);
        }
        Ok(())
    })
}

/// The box of `grid`, the least of its spacings and the precision that its meshes need.
fn cut(grid: &Grid) -> slivers::Cut {
    let bounds = grid.bounds();
    // Not the least gap: the last cell of an axis may be a quarter of the others.
    let steps = bounds.size() / DVec3::from_array(grid.cells().map(|cells| cells as f64));
    slivers::Cut { bounds, spacing: steps.min_element(), precision: grid.precision() }
}

fn pass_on(mesh: &Mesh, sink: &mut dyn Sink) -> std::io::Result<()> {
    sink.begin(mesh.positions.len() as u64, mesh.triangles.len() as u64)?;
    for (number, piece) in mesh.positions.chunks(PIECE).enumerate() {
        sink.vertices((number * PIECE) as u64, piece)?;
    }
    for (number, piece) in mesh.triangles.chunks(PIECE).enumerate() {
        sink.triangles((number * PIECE) as u64, piece)?;
    }
    Ok(())
}
