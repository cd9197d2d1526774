//! Outlines of a solid in planes across an axis: marching squares, without a mesh.
//!
//! In each plane the nodes of the grid's two other axes are sampled, outlines pass through the roots of
//! the field on the edges between nodes of different sign, and a square whose opposite corners are
//! inside joins them, as on the faces of cells ([`tables`](super::tables)). Placement is that of the
//! mesh, and so is the flat cut: the plane ends at the box, where outlines follow its border. So in a plane of
//! grid nodes the outlines are the edges of the mesh that lie in it, to the bit, but for two
//! things: a vertex within [`TAU`](super::grid::TAU) of a node that has several crossed edges in the mesh, and one in the
//! plane, stays where it is; and the outermost planes are those where the field is sampled, less than
//! [`INSET`](super::grid::INSET) spacings further in.
//!
//! Outlines are closed, without a point twice, and do not cross or touch one another; inside is on
//! their left in a frame of the two axes in their order, so outer ones turn counter-clockwise. They do
//! not depend on the number of threads. What lies between two nodes of a plane is not seen.
//!
//! Source: Lorensen & Cline 1987 for cells; squares are their faces.

use super::assemble::{Clocks, Scene, TASK, Worker};
use super::bits::{Rows, Span, Spans, gather};
use super::place::{BrickLines, Roots};
use super::signs::{bricks, sampled};
use super::{Error, Grid, Report, Settings};
use crate::eval::sampler::node_at;
use crate::eval::{BRICK, Sampler};
use crate::geom::Axis;
use crate::num::Progress;
use crate::octree::Pool;
use pulp::Arch;
use rayon::prelude::*;
use std::time::Instant;

/// Most planes of one [`Grid::planes`]: with a ghost before them they fill the nodes of a brick.
pub const MOST_PLANES: usize = BRICK - 1;

/// The two axes of a plane across `axis`, in their order: the first goes to the right.
#[must_use]
pub const fn axes_across(axis: Axis) -> [Axis; 2] {
    match axis {
        Axis::X => [Axis::Y, Axis::Z],
        Axis::Y => [Axis::X, Axis::Z],
        Axis::Z => [Axis::X, Axis::Y],
    }
}

/// The closed outlines in one plane, each a ring of points.
pub type Outlines = Vec<Vec<[f64; 2]>>;

/// The outlines in each of the `planes` planes across `axis` of `grid`, which is a
/// [`Grid::planes`], of the field that `sampler` has bound to [`Grid::tables`].
///
/// The report counts points as vertices, and no triangles.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
pub fn outlines<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    axis: Axis,
    settings: &Settings,
    progress: &Progress,
) -> Result<(Vec<Outlines>, Report), Error> {
    let start = Instant::now();
    let (bricks, mut report) = bricks(sampler, grid, settings, progress)?;
    let clocks = Clocks::default();
    let scene = Scene::new(sampler, grid, &bricks);
    let owners = scene.owners.len();
    let task = (owners / 64).clamp(1, TASK);
    let tasks = |items: usize| items.div_ceil(task) as u64;
    progress.expect(tasks(bricks.active.len()) + tasks(owners));
    let (pool, make) = (Pool::default(), || Worker::new(sampler));
    let (signs, nans) = sampled(&scene, &pool, make, task, progress, &clocks)?;
    let scene = Scene { signs, ..scene };
    let arch = Arch::new();
    let parts = (0..owners.div_ceil(task))
        .into_par_iter()
        .map(|t| {
            let ranks = t * task..owners.min((t + 1) * task);
            let planes = pool.lend(make, |worker| draw(&scene, arch, worker, axis, ranks))?;
            progress.advance(1)?;
            Ok(planes)
        })
        .collect::<Result<Vec<Vec<Pieces>>, Error>>()?;
    let planes = grid.cells()[axis.index()] + 1;
    let found: Vec<Outlines> = (0..planes)
        .into_par_iter()
        .map(|plane| {
            let mut whole = Pieces::default();
            for part in &parts {
                whole.points.extend_from_slice(&part[plane].points);
                whole.sides.extend_from_slice(&part[plane].sides);
            }
            whole.joined()
        })
        .collect();
    report.nans = nans;
    report.vertices = found.iter().flatten().map(|ring| ring.len() as u64).sum();
    clocks.report(&mut report.stages);
    report.stages.total = start.elapsed();
    Ok((found, report))
}

/// The number of a vertex in its plane: that of the node below it, times three, and zero on the edge along
/// the plane's first axis, one on that along the second, two at the node itself.
type Key = u64;

/// What a task finds in a plane.
#[derive(Clone, Debug, Default)]
struct Pieces {
    points: Vec<(Key, [f64; 2])>,
    /// Pieces of outlines, from vertex to vertex, inside on the left.
    sides: Vec<[Key; 2]>,
}

impl Pieces {
    /// The rings that the pieces make, each from its least vertex on.
    fn joined(mut self) -> Outlines {
        self.points.sort_unstable_by_key(|(key, _)| *key);
        let place = |key: Key| {
            let found = self.points.binary_search_by_key(&key, |(key, _)| *key);
            found.expect("each end of a side is a crossing or a node of some brick")
        };
        let mut next = vec![usize::MAX; self.points.len()];
        for [from, to] in &self.sides {
            next[place(*from)] = place(*to);
        }
        let mut rings = Vec::new();
        for first in 0..next.len() {
            let (mut at, mut ring) = (first, Vec::new());
            while next[at] != usize::MAX {
                ring.push(self.points[at].1);
                at = std::mem::replace(&mut next[at], usize::MAX);
            }
            if !ring.is_empty() {
                rings.push(ring);
            }
        }
        rings
    }
}

/// What the owners in `ranks` hold of each plane.
fn draw<S: Sampler>(
    scene: &Scene<'_, S>,
    arch: Arch,
    worker: &mut Worker<S::Workspace>,
    axis: Axis,
    ranks: std::ops::Range<usize>,
) -> Result<Vec<Pieces>, Error> {
    let bricks = scene.bricks;
    let [first, second] = axes_across(axis);
    let planes = scene.grid.cells()[axis.index()] + 1;
    let mut found = vec![Pieces::default(); planes];
    let mut roots = Roots::default();
    for (number, _) in scene.owners.iter_from(ranks.start).zip(ranks) {
        let brick = bricks.position(number);
        let spans = scene.spans(brick);
        let Worker { workspace, activity, made, block, placer, positions, .. } = &mut *worker;
        gather(scene.signs_above(brick, made), &mut block.rows);
        let squares = Squares { rows: &block.rows, spans: &spans, axis, first, second };
        let width = scene.grid.placed(first).len() as u64;
        let key = |node: [usize; 3], kind: u64| {
            let at = |axis: Axis| {
                u64::from(brick[axis.index()]) * BRICK as u64 + node[axis.index()] as u64
            };
            3 * (at(first) + width * at(second)) + kind
        };
        // The planes begin after a ghost.
        let plane =
            |node: [usize; 3]| brick[axis.index()] as usize * BRICK + node[axis.index()] - 1;
        let lines = BrickLines::new(scene.grid, brick, scene.extent);
        if let Some(rank) = bricks.active.rank(number) {
            bricks.activities.expand(bricks.activity(rank), activity);
            let crossed = Axis::ALL.map(|along| squares.crossed(along));
            let numbers = crossed
                .each_ref()
                .map(|nodes| nodes.iter().map(|node| node_at(*node)).collect::<Vec<_>>());
            positions.clear();
            roots.edges.clear();
            roots.rims.clear();
            placer.crossings_of_cells(
                arch,
                scene.sampler,
                workspace,
                brick,
                activity,
                numbers.each_ref().map(Vec::as_slice),
                &block.rows,
                &spans,
                &lines,
                &mut roots,
                positions,
            )?;
            let across = [first, second];
            placer.keep_off(
                &lines,
                |place| scene.is_crowded_along(brick, place, &across),
                positions,
            );
            let nodes = Axis::ALL.into_iter().zip(&crossed).flat_map(|(along, nodes)| {
                nodes.iter().map(move |node| (u64::from(along == second), *node))
            });
            for ((kind, node), position) in nodes.zip(&*positions) {
                let point = [position[first.index()], position[second.index()]];
                found[plane(node)].points.push((key(node, kind), point));
            }
        }
        for node in squares.border() {
            let point = [first, second].map(|a| lines.placed[a.index()][node[a.index()]]);
            found[plane(node)].points.push((key(node, 2), point));
        }
        squares.sides(|low, side| {
            let ends = side.map(|(node, kind)| key(node, kind));
            if ends[0] != ends[1] {
                found[plane(low)].sides.push(ends);
            }
        });
    }
    Ok(found)
}

/// The squares between the nodes of a brick, in its planes.
struct Squares<'a> {
    rows: &'a Rows,
    spans: &'a Spans,
    axis: Axis,
    first: Axis,
    second: Axis,
}

impl Squares<'_> {
    fn is_inside(&self, [x, y, z]: [usize; 3]) -> bool {
        self.rows[z][y] >> x & 1 == 1
    }

    fn span(&self, axis: Axis) -> &Span {
        &self.spans.0[axis.index()]
    }

    fn has(word: u32, node: [usize; 3], axis: Axis) -> bool {
        word >> node[axis.index()] & 1 == 1
    }

    /// Places of the brick's own nodes in its planes.
    fn nodes(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let all =
            (0..BRICK * BRICK * BRICK).map(|n| [n % BRICK, n / BRICK % BRICK, n / BRICK / BRICK]);
        all.filter(|node| Self::has(self.span(self.axis).real, *node, self.axis))
    }

    /// Lower nodes of the crossed edges along an axis of the plane.
    fn crossed(&self, along: Axis) -> Vec<[usize; 3]> {
        if along == self.axis {
            return Vec::new();
        }
        let other = if along == self.first { self.second } else { self.first };
        let is_crossed = |node: &[usize; 3]| {
            Self::has(self.span(along).edge, *node, along)
                && Self::has(self.span(other).real, *node, other)
                && self.is_inside(*node) != self.is_inside(after(*node, along))
        };
        self.nodes().filter(is_crossed).collect()
    }

    /// Inside nodes on the border of the plane.
    fn border(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let is_on = |node: [usize; 3], axis| Self::has(self.span(axis).outer, node, axis);
        self.nodes().filter(move |node| {
            (is_on(*node, self.first) || is_on(*node, self.second)) && self.is_inside(*node)
        })
    }

    /// Calls `found` with the least node and the ends of each side, as a node and the kind of [`Key`].
    fn sides(&self, mut found: impl FnMut([usize; 3], [([usize; 3], u64); 2])) {
        for low in self.nodes() {
            let right = after(low, self.first);
            let corners = [low, right, after(right, self.second), after(low, self.second)];
            let inside = corners.map(|corner| self.is_inside(corner));
            if inside == [inside[0]; 4] {
                continue;
            }
            // Sides of the square, counter-clockwise: the edges from these corners.
            let edges = [(low, 0), (right, 1), (corners[3], 0), (low, 1)];
            let vertex = |side: usize| {
                let ends = [corners[side], corners[(side + 1) % 4]];
                let inner = if inside[side] { ends[0] } else { ends[1] };
                let is_real = |node: &[usize; 3]| {
                    [self.first, self.second]
                        .iter()
                        .all(|axis| Self::has(self.span(*axis).real, *node, *axis))
                };
                // Crossings on edges to ghosts are at the inside node.
                if ends.iter().all(is_real) { edges[side] } else { (inner, 2) }
            };
            for side in 0..4 {
                if inside[side] && !inside[(side + 1) % 4] {
                    let enters = |other: &usize| !inside[other % 4] && inside[(other + 1) % 4];
                    if let Some(other) = (side + 1..side + 4).find(enters) {
                        found(low, [vertex(side), vertex(other % 4)]);
                    }
                }
            }
        }
    }
}

/// The node after `node` along `axis`.
fn after(mut node: [usize; 3], axis: Axis) -> [usize; 3] {
    node[axis.index()] += 1;
    node
}
