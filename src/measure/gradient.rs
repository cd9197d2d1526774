//! Volume and area of the mesh, and their derivatives by parameters, in one pass over bricks.
//!
//! The derivatives are those of the numbers that [`totals`](super::totals()) returns, the volume V and the area A of
//! the very mesh that contouring makes, not of the surface that it approximates: what an optimizer
//! that evaluates V and A needs to be consistent. They are exact but for what lies within
//! [`TAU`] of an edge, a thousandth, which only steps shorter than that tell apart (below).
//!
//! # Derivation
//! Let p be a parameter, and v' the velocity dv/dp of a vertex v. Over the triangles (a, b, c) with
//! area vectors S = (b - a) x (c - a) / 2 and unit normals n = S / |S|,
//!
//! > dV/dp = sum of S . (a' + b' + c') / 3, dA/dp = sum of n . [(b - c) x a' + …] / 2,
//!
//! where the first holds for a closed mesh: V = sum a . (b x c) / 6, and around a vertex v of a
//! closed mesh the sum of b x c is twice that of S. So each vertex has two weights, dV/dv and
//! dA/dv, which do not depend on the parameters.
//!
//! A vertex on a grid edge along x is the root of f(x, y, z; p) = 0 at fixed y and z, so
//!
//! > x' = -(f_p + f_y y' + f_z z') / f_x,
//!
//! with the branch that the field takes there at its kinks. Where the grid does not depend on p,
//! y' = z' = 0; else a node's coordinate lo + i h moves with lo' + i h', the last one with hi'. A
//! vertex on the flat cut at an inside node moves with the node. In an outer plane a vertex is
//! extrapolated from two roots, u an inset from the plane and v half of that, to 2 v - u: it moves
//! with 2 v' - u'.
//!
//! # Where it holds
//! Between the parameter values at which a node changes sign, a root reaches a kink or the number of
//! cells changes: V is continuous at the first two to third order in the spacing, A to second.
//!
//! **At nodes.** A vertex that is held at [`TAU`] of an edge stays there until its root has left that
//! band, and then moves as fast as the root. Here it moves with its root at once, because a face may
//! lie in the nodes of a grid with all of its vertices, and by round values often does: any step
//! longer than the band shows it move. [`Gradient::held`] is what such vertices add; without it the
//! derivatives are those by infinitely small steps.
//!
//! **Where an edge grazes the surface,** at a cosine below [`GRAZING`] between edge and gradient, the
//! quotient above is as large as the cosine is small, and the vertex off its edge after as short a
//! step. Such a vertex moves with the surface instead, along its normal with -f_p / |grad f|.
//!
//! **Where f jumps** or is flat a crossing has no velocity and adds nothing. Those and the ones
//! that edges graze are counted by [`Gradient::unresolved`].
//!
//! Source: the implicit function theorem; for its use on the vertices of marching cubes,
//! Remelli et al. 2020, "MeshSDF: Differentiable iso-surface extraction", section 3.2, who move
//! vertices along normals, which is the derivative of the surface and not of the mesh.

use super::totals::{Adding, Totals, middle};
use crate::contour::grid::TAU;
use crate::contour::sweep::{Patch, Visitor, is_own, sweep};
use crate::contour::{Error, Grid, Report, RimRoot, Settings};
use crate::eval::rates::{BoundRates, RatesWorkspace};
use crate::eval::sampler::{Failure, place_of};
use crate::eval::{BRICK, Sampler};
use crate::geom::Axis;
use crate::num::Progress;
use glam::DVec3;
use pulp::Arch;

/// A crossing whose field is farther than this many edge lengths from zero, by its gradient, is a jump
/// of the field: roots are found to 1e-13 edge lengths or the rounding of the field.
const JUMP: f64 = 1e-6;

/// Least cosine between an edge and the field's gradient at which a vertex moves along the edge.
///
/// A step that moves the surface by d along its normal moves the vertex by d / c, and so off an edge
/// of length h if d > c h: below [`TAU`] no step that leaves the band about a node sees the vertex
/// on its edge. What the vertex adds is right only as far as the normals of its triangles are the
/// field's, which they are to half the angle that the surface turns in a cell, b say; of that the
/// quotient makes b / c. Where nothing but chance places nodes, crossings below a cosine c are a share
/// c² of all, one in a million here, since both their density and the area that has such
/// normals fall with c; b / c squared adds up over them to b² log(1 / c), so that where the line is
/// drawn hardly matters. By round values nodes lie on the surface where it runs along an edge, and c is
/// what rounding leaves, 1e-8.
pub const GRAZING: f64 = TAU;

/// How far beside a crossing derivatives are taken, in edge lengths, where there are none at it:
/// far enough to be another number, near enough to change nothing.
const BESIDE: f64 = 1e-9;

/// Edges in a batch.
pub(super) const BATCH: usize = 256;

/// Volume and area of a mesh with their derivatives by parameters.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Gradient {
    /// The quantities.
    pub totals: Totals,
    /// Their derivatives, one entry a parameter.
    pub by: Vec<Totals>,
    /// What vertices that are held off nodes add to them by moving with their roots, as they do by
    /// steps longer than [`TAU`] of an edge only.
    pub held: Vec<Totals>,
    /// Crossings without a velocity of their own: where the field jumps or is flat, which do not
    /// move, and where an edge grazes the surface, which move with its normal speed.
    pub unresolved: u64,
}

/// How the grid moves with a parameter; nothing moves by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridMotion {
    /// Derivative of the box's least corner.
    pub lo: [f64; 3],
    /// Derivative of its greatest corner.
    pub hi: [f64; 3],
    /// Derivative of the spacing.
    pub spacing: [f64; 3],
}

impl GridMotion {
    /// Whether nothing moves.
    #[must_use]
    pub fn is_still(&self) -> bool {
        *self == Self::default()
    }

    /// Derivative of the coordinate along axis `a` of the node at padded position `p`, where the
    /// grid has `cells` cells along it.
    fn node(&self, a: usize, p: usize, cells: usize) -> f64 {
        let i = p.saturating_sub(1).min(cells);
        if i == cells { self.hi[a] } else { self.lo[a] + i as f64 * self.spacing[a] }
    }
}

/// Volume and area of the mesh, and their derivatives by the parameters of `rates`, which are
/// bound to the same tables and values as `sampler`; `motions` says how each moves the grid.
///
/// The derivatives across the edges must be among the rates.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
///
/// # Panics
/// If the rates have another number of outputs.
pub fn gradient<S: Sampler>(
    sampler: &S,
    rates: &BoundRates,
    motions: &[GridMotion],
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
) -> Result<(Gradient, Report), Error> {
    let moving = !motions.iter().all(GridMotion::is_still);
    assert_eq!(rates.outputs(), 4 + motions.len(), "rates suit the motions");
    let visitor = GradientVisitor {
        origin: middle(grid),
        arch: Arch::new(),
        crossings: Crossings::new(rates, grid),
        motions,
        moving,
        cells: grid.cells(),
    };
    let (sums, report) = sweep(sampler, grid, settings, progress, &visitor)?;
    let zero = Gradient {
        totals: Totals::default(),
        by: vec![Totals::default(); motions.len()],
        held: vec![Totals::default(); motions.len()],
        unresolved: 0,
    };
    let total = sums.into_iter().fold(zero, |mut all, part| {
        all.totals = all.totals.plus(part.totals);
        for (all, part) in [(&mut all.by, part.by), (&mut all.held, part.held)] {
            for (all, part) in all.iter_mut().zip(part) {
                *all = all.plus(part);
            }
        }
        all.unresolved += part.unresolved;
        all
    });
    Ok((total, report))
}

/// Sums volume, area and their derivatives.
struct GradientVisitor<'a> {
    /// The point that tetrahedra share.
    origin: [f64; 3],
    arch: Arch,
    crossings: Crossings<'a>,
    motions: &'a [GridMotion],
    /// Whether any of them moves.
    moving: bool,
    cells: [usize; 3],
}

/// Memory of a [`GradientVisitor`].
struct Memory {
    crossings: CrossingsMemory,
    /// Derivatives of volume and area by the position of each vertex.
    weights: Vec<[DVec3; 2]>,
    /// Velocities along their edges of the vertices that have one, a run of parameters each; NaN
    /// of the others.
    along: Vec<f64>,
}

impl Visitor for GradientVisitor<'_> {
    type Memory = Memory;
    type Sum = Gradient;

    fn memory(&self) -> Memory {
        Memory { crossings: self.crossings.memory(), weights: Vec::new(), along: Vec::new() }
    }

    fn zero(&self) -> Gradient {
        let by = vec![Totals::default(); self.motions.len()];
        Gradient { totals: Totals::default(), held: by.clone(), by, unresolved: 0 }
    }

    fn visit(
        &self,
        memory: &mut Memory,
        patch: &Patch<'_>,
        sum: &mut Gradient,
    ) -> Result<(), Failure> {
        let here = self.arch.dispatch(Adding { patch, origin: self.origin });
        sum.totals = sum.totals.plus(here);
        weigh(patch, &mut memory.weights);
        memory.along.resize(patch.positions.len() * self.motions.len(), 0.0);
        let mut first = 0;
        for axis in Axis::ALL {
            let mut rest = first;
            for nodes in patch.nodes[axis.index()].chunks(BATCH) {
                self.edges(memory, patch, axis, nodes, rest, sum)?;
                rest += nodes.len();
            }
            first = rest;
        }
        self.rims(memory, patch, sum)?;
        if self.moving {
            self.plane_nodes(&memory.weights[first..], patch, sum);
        }
        Ok(())
    }
}

/// The derivatives of the volume and area of a patch by each vertex.
fn weigh(patch: &Patch<'_>, weights: &mut Vec<[DVec3; 2]>) {
    weights.clear();
    weights.resize(patch.positions.len(), [DVec3::ZERO; 2]);
    for corners in patch.triangles {
        let [a, b, c] = corners.map(|v| DVec3::from_array(patch.positions[v as usize]));
        let double = (b - a).cross(c - a);
        let by_volume = double / 6.0;
        // No triangle has zero area.
        let half_normal = double * (0.5 / double.length());
        let sides = [b - c, c - a, a - b];
        for (corner, side) in corners.iter().zip(sides) {
            let [volume, area] = &mut weights[*corner as usize];
            *volume += by_volume;
            *area += side.cross(half_normal);
        }
    }
}

impl Totals {
    /// Adds what a vertex of the weights given contributes by moving.
    fn moves(&mut self, [by_volume, by_area]: [DVec3; 2], velocity: DVec3) {
        self.volume += by_volume.dot(velocity);
        self.area += by_area.dot(velocity);
    }
}

/// A vector with another component along an axis.
trait WithAxis {
    fn with_axis(self, axis: Axis, value: f64) -> Self;
}

impl WithAxis for DVec3 {
    fn with_axis(mut self, axis: Axis, value: f64) -> Self {
        self[axis.index()] = value;
        self
    }
}

/// The fraction of its edge, that from `node` along `axis`, at which a vertex is held, if it is.
fn held_at(patch: &Patch<'_>, axis: Axis, node: u16, vertex: usize) -> Option<f64> {
    let (a, place) = (axis.index(), place_of(node));
    let table = &patch.lines.placed[a];
    let (lower, upper) = (table[place[a]], table[place[a] + 1]);
    let length = upper - lower;
    // The very expressions that hold a vertex.
    let position = patch.positions[vertex][a];
    if position == lower + TAU * length {
        Some(TAU)
    } else if position == upper - TAU * length {
        Some(1.0 - TAU)
    } else {
        None
    }
}

/// The gradient among the outputs of rates in `n` lanes on edges along `axis`.
pub(super) fn gradient_of(outputs: &[f64], n: usize, lane: usize, axis: Axis) -> DVec3 {
    let [along, first, second] = [1, 2, 3].map(|output| outputs[output * n + lane]);
    match axis {
        Axis::X => DVec3::new(along, first, second),
        Axis::Y => DVec3::new(first, along, second),
        Axis::Z => DVec3::new(first, second, along),
    }
}

/// The derivatives of a field at crossings.
pub(super) struct Crossings<'a> {
    rates: &'a BoundRates,
    /// Largest magnitude of a coordinate of the grid.
    extent: f64,
}

/// Memory of [`Crossings`].
pub(super) struct CrossingsMemory {
    workspace: RatesWorkspace,
    /// Outputs of a batch at its crossings.
    outputs: Vec<f64>,
    /// Outputs and coordinates beside the crossings.
    beside: Vec<f64>,
    at: Vec<f64>,
}

impl<'a> Crossings<'a> {
    pub(super) fn new(rates: &'a BoundRates, grid: &Grid) -> Self {
        Self { rates, extent: grid.extent() }
    }

    pub(super) fn memory(&self) -> CrossingsMemory {
        let room = vec![0.0; self.rates.outputs() * BATCH];
        let workspace = self.rates.workspace();
        CrossingsMemory { workspace, outputs: room.clone(), beside: room, at: Vec::new() }
    }

    /// The outputs of the rates at the crossings of the edges from `nodes` along `axis`, at most
    /// [`BATCH`], of which the first is vertex `first` of the patch: one run an output. Outputs of
    /// a crossing without gradient start with NaN.
    ///
    /// Where a derivative is no number at the crossing, as inside of a box that ends there, it is
    /// taken a little beside it.
    pub(super) fn at<'m>(
        &self,
        memory: &'m mut CrossingsMemory,
        patch: &Patch<'_>,
        axis: Axis,
        nodes: &[u16],
        first: usize,
    ) -> Result<&'m [f64], Failure> {
        let roots = &patch.roots.edges[first..first + nodes.len()];
        self.outputs(memory, patch, (axis, patch.brick, patch.activity), nodes, roots)
    }

    /// The same at the roots of edges between ghosts, all along one axis and of one brick.
    fn at_rims<'m>(
        &self,
        memory: &'m mut CrossingsMemory,
        patch: &Patch<'_>,
        rims: &[RimRoot],
    ) -> Result<&'m [f64], Failure> {
        let ghosts: Vec<u16> = rims.iter().map(|rim| rim.ghost).collect();
        let roots: Vec<f64> = rims.iter().map(|rim| rim.root).collect();
        // Ghosts may lie in a brick whose activity is not known here.
        let everything = vec![u64::MAX; patch.activity.len()];
        let at = (rims[0].axis, rims[0].brick, &everything[..]);
        self.outputs(memory, patch, at, &ghosts, &roots)
    }

    fn outputs<'m>(
        &self,
        memory: &'m mut CrossingsMemory,
        patch: &Patch<'_>,
        (axis, brick, activity): (Axis, [u32; 3], &[u64]),
        nodes: &[u16],
        roots: &[f64],
    ) -> Result<&'m [f64], Failure> {
        let CrossingsMemory { workspace, outputs, beside, at } = memory;
        let (a, n, count) = (axis.index(), nodes.len(), self.rates.outputs());
        // Along the axis a ghost has the place of the edge's own node.
        let lengths = |lane: usize| {
            let place = place_of(nodes[lane])[a];
            let line = &patch.lines.placed[a];
            line[place + 1] - line[place]
        };
        let is_settled = |outputs: &[f64], lane: usize| {
            let finite = (0..count).all(|o| outputs[o * n + lane].is_finite());
            let slope = gradient_of(outputs, n, lane, axis).length();
            finite && slope != 0.0 && outputs[lane].abs() <= JUMP * slope * lengths(lane)
        };
        self.rates.begin(workspace, axis, brick, nodes, activity)?;
        let mut slices: Vec<&mut [f64]> = outputs.chunks_exact_mut(n).take(count).collect();
        self.rates.at(workspace, roots, &mut slices)?;
        for side in [1.0, -1.0] {
            if (0..n).all(|lane| is_settled(outputs, lane)) {
                break;
            }
            at.clear();
            at.extend(roots.iter().enumerate().map(|(lane, root)| {
                let step = (BESIDE * lengths(lane)).max(8.0 * f64::EPSILON * self.extent);
                root + side * step
            }));
            let mut slices: Vec<&mut [f64]> = beside.chunks_exact_mut(n).take(count).collect();
            self.rates.at(workspace, at, &mut slices)?;
            for lane in 0..n {
                if !is_settled(outputs, lane) && is_settled(beside, lane) {
                    (0..count).for_each(|o| outputs[o * n + lane] = beside[o * n + lane]);
                }
            }
        }
        for lane in 0..n {
            if !is_settled(outputs, lane) {
                outputs[lane] = f64::NAN;
            }
        }
        Ok(&outputs[..count * n])
    }
}

impl GradientVisitor<'_> {
    /// Adds what the vertices on the edges from `nodes` along `axis` contribute; `first` is the
    /// number of the first in the patch.
    fn edges(
        &self,
        memory: &mut Memory,
        patch: &Patch<'_>,
        axis: Axis,
        nodes: &[u16],
        first: usize,
        sum: &mut Gradient,
    ) -> Result<(), Failure> {
        let Memory { crossings, weights, along: velocities } = memory;
        let (a, n) = (axis.index(), nodes.len());
        let outputs = self.crossings.at(crossings, patch, axis, nodes, first)?;
        let table = &patch.lines.placed[a];
        for (lane, &node) in nodes.iter().enumerate() {
            let (vertex, place) = (first + lane, place_of(node));
            let of = |output: usize| outputs[output * n + lane];
            let gradient = gradient_of(outputs, n, lane, axis);
            let is_root = !of(0).is_nan();
            let normal = self.in_outer_planes(patch.brick, place, axis, gradient);
            let is_grazing = is_root && self.grazes(gradient, normal, axis);
            if !is_root || is_grazing {
                sum.unresolved += u64::from(is_own(node));
            }
            let held = held_at(patch, axis, node, vertex);
            let (lower, upper) = (table[place[a]], table[place[a] + 1]);
            let fraction = (patch.positions[vertex][a] - lower) / (upper - lower);
            for (k, motion) in self.motions.iter().enumerate() {
                let moved = |b: usize, ahead: usize| {
                    let p = patch.brick[b] as usize * BRICK + place[b] + ahead;
                    if self.moving { motion.node(b, p, self.cells[b]) } else { 0.0 }
                };
                let carried = |fraction: f64| {
                    let mut velocity = DVec3::from_array([0, 1, 2].map(|b| moved(b, 0)));
                    velocity[a] = (1.0 - fraction) * moved(a, 0) + fraction * moved(a, 1);
                    velocity
                };
                let rest = match held {
                    Some(fraction) => carried(fraction),
                    None => carried(0.0).with_axis(axis, 0.0),
                };
                let velocity = if is_grazing {
                    let carried = carried(fraction);
                    // A surface that grazes the plane, too, goes nowhere in it.
                    let grazes_plane = normal.length() < GRAZING * gradient.length();
                    let change = of(4 + k) + gradient.dot(carried);
                    let per = if grazes_plane { 0.0 } else { normal.length_squared().recip() };
                    carried - change * per * normal
                } else if is_root {
                    let across = rest.with_axis(axis, 0.0);
                    across.with_axis(axis, -(of(4 + k) + gradient.dot(across)) / of(1))
                } else {
                    rest
                };
                sum.by[k].moves(weights[vertex], velocity);
                if held.is_some() {
                    sum.held[k].moves(weights[vertex], velocity - rest);
                }
                let own = if is_root && !is_grazing { velocity[a] } else { f64::NAN };
                velocities[vertex * self.motions.len() + k] = own;
            }
        }
        Ok(())
    }

    /// Whether edges along `axis` graze a surface of that gradient, of which `rim` lies in the outer
    /// planes.
    ///
    /// A box that moves with the solid may touch its surface; what it cuts off moves with both, so
    /// that only the rim matters there.
    fn grazes(&self, gradient: DVec3, rim: DVec3, axis: Axis) -> bool {
        let normal = if self.moving { rim } else { gradient };
        normal[axis.index()].abs() <= GRAZING * normal.length()
    }

    /// The part of a vector that lies in the outer planes that hold the edge at `place` along `axis`.
    fn in_outer_planes(
        &self,
        brick: [u32; 3],
        place: [usize; 3],
        axis: Axis,
        mut vector: DVec3,
    ) -> DVec3 {
        for other in Axis::ALL.into_iter().filter(|other| *other != axis) {
            let b = other.index();
            let p = brick[b] as usize * BRICK + place[b];
            // Ghosts count as the nodes beside them.
            if p <= 1 || p > self.cells[b] {
                vector[b] = 0.0;
            }
        }
        vector
    }

    /// Mends what [`edges`](Self::edges) took for the velocities of vertices that were extrapolated
    /// from two roots u and v, at 2 v - u: it took u' for 2 v' - u'.
    fn rims(
        &self,
        memory: &mut Memory,
        patch: &Patch<'_>,
        sum: &mut Gradient,
    ) -> Result<(), Failure> {
        let Memory { crossings, weights, along } = memory;
        let count = self.motions.len();
        let alike = |a: &RimRoot, b: &RimRoot| (a.axis, a.brick) == (b.axis, b.brick);
        for rims in patch.roots.rims.chunk_by(alike).flat_map(|rims| rims.chunks(BATCH)) {
            let (axis, brick, n) = (rims[0].axis, rims[0].brick, rims.len());
            let outputs = self.crossings.at_rims(crossings, patch, rims)?;
            for (lane, rim) in rims.iter().enumerate() {
                let of = |output: usize| outputs[output * n + lane];
                let gradient = gradient_of(outputs, n, lane, axis);
                let (a, place) = (axis.index(), place_of(rim.ghost));
                let normal = self.in_outer_planes(brick, place, axis, gradient);
                if of(0).is_nan() || self.grazes(gradient, normal, axis) {
                    continue;
                }
                let line = &patch.lines.placed[a];
                let ends = [line[place[a]], line[place[a] + 1]];
                let vertex = rim.vertex as usize;
                let met = 2.0 * rim.root - patch.roots.edges[vertex];
                let is_held = held_at(patch, axis, rim.ghost, vertex).is_some();
                for (k, motion) in self.motions.iter().enumerate() {
                    let moved = |b: usize, ahead: usize| {
                        let p = brick[b] as usize * BRICK + place[b] + ahead;
                        if self.moving { motion.node(b, p, self.cells[b]) } else { 0.0 }
                    };
                    let taken = along[vertex * count + k];
                    // A vertex without a velocity of its own is none of this.
                    if taken.is_nan() {
                        continue;
                    }
                    let across = DVec3::from_array([0, 1, 2].map(|b| moved(b, 0)));
                    let across = across.with_axis(axis, 0.0);
                    let velocity = -2.0 * (of(4 + k) + gradient.dot(across)) / of(1) - taken;
                    let along = |velocity: f64| DVec3::ZERO.with_axis(axis, velocity);
                    sum.by[k].moves(weights[vertex], along(velocity - taken));
                    // At the end of the edge it stays by small steps, as if it were held there.
                    let rest = if is_held {
                        taken
                    } else if met <= ends[0] {
                        moved(a, 0)
                    } else if met >= ends[1] {
                        moved(a, 1)
                    } else {
                        continue;
                    };
                    sum.held[k].moves(weights[vertex], along(velocity - rest));
                }
            }
        }
        Ok(())
    }

    /// Adds what the vertices at nodes of outer planes contribute, which move with the nodes.
    fn plane_nodes(&self, weights: &[[DVec3; 2]], patch: &Patch<'_>, sum: &mut Gradient) {
        for (&node, weights) in patch.nodes[3].iter().zip(weights) {
            let place = place_of(node);
            for (motion, by) in self.motions.iter().zip(&mut sum.by) {
                let velocity = DVec3::from_array([0, 1, 2].map(|a| {
                    let p = patch.brick[a] as usize * BRICK + place[a];
                    motion.node(a, p, self.cells[a])
                }));
                by.moves(*weights, velocity);
            }
        }
    }
}
