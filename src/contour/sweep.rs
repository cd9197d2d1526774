//! The mesh one brick at a time, for those who want its measures and not the mesh.
//!
//! [`sweep`] shows the part of the mesh in the cells of each brick, its *patch*: the triangles that
//! [`contour`](super::contour) makes there, with the same positions to the bit; or the same triangles
//! between the roots themselves, for those who measure the field ([`Vertices`]). Each patch is whole
//! by itself: crossings on the far faces of a brick's cells are found again for the next brick,
//! about one in eight, which costs less than numbers that hold for the whole mesh, and nothing
//! outlives its brick. Every triangle is in one patch.

use super::assemble::{Clocks, Lap, Scene, Stage, TASK, Worker};
use super::bits::{ROW, Rows, SIDE, Spans, gather, spread};
use super::coarse::{self, coarse_nodes};
use super::faces::{self, Facing};
use super::grid::Grid;
use super::numbering::{Bits, Block};
use super::place::{BrickLines, Roots};
use super::signs::{Signs, bricks, sampled};
use super::{Error, Report, Settings};
use crate::eval::sampler::{Failure, node_at, place_of};
use crate::eval::{BRICK, Sampler};
use crate::num::Progress;
use crate::octree::Pool;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::time::Instant;

/// The part of the mesh in the cells of one brick.
#[derive(Debug)]
pub struct Patch<'a> {
    /// Position of the brick.
    pub brick: [u32; 3],
    /// Its activity; empty where the brick was proved inside.
    pub activity: &'a [u64],
    /// Lower nodes of the crossed edges along x, y and z; then inside nodes of outer planes.
    pub nodes: [&'a [u16]; 4],
    /// Positions of the vertices: those on the edges, then the nodes, in the order of `nodes`.
    pub positions: &'a [[f64; 3]],
    /// The roots that the vertices on edges were placed from.
    pub roots: &'a Roots,
    /// Triangles, counter-clockwise from outside; corners are places in `positions`.
    pub triangles: &'a [[u32; 3]],
    /// Triangles on every other node, if the visitor asks for them; they share the vertices.
    pub coarse: &'a [[u32; 3]],
    /// Coordinates of the brick's nodes.
    pub lines: &'a BrickLines,
}

/// Where the vertices of patches lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertices {
    /// Where those of the mesh do, off crowded nodes: every triangle has an area.
    OffNodes,
    /// At the roots of the field: triangles at a node may have no area, or next to none.
    AtRoots,
}

/// What looks at patches.
pub trait Visitor: Sync {
    /// Scratch memory of one thread.
    type Memory: Send;
    /// What a task gathers from its bricks, which are the same whatever the number of threads.
    type Sum: Send;
    /// Whether patches come with their triangles on every other node.
    const COARSE: bool = false;
    /// Where vertices lie.
    const VERTICES: Vertices = Vertices::OffNodes;

    /// Fresh memory.
    fn memory(&self) -> Self::Memory;

    /// The sum of no patches.
    fn zero(&self) -> Self::Sum;

    /// Adds what `patch` has.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn visit(
        &self,
        memory: &mut Self::Memory,
        patch: &Patch<'_>,
        sum: &mut Self::Sum,
    ) -> Result<(), Failure>;
}

/// Shows `visitor` the mesh of the field that `sampler` has bound to [`Grid::tables`], and returns
/// the sums of its tasks, in the order of the bricks.
///
/// The report is that of contouring; nothing is numbered or written.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled.
pub fn sweep<S: Sampler, V: Visitor>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
    visitor: &V,
) -> Result<(Vec<V::Sum>, Report), Error> {
    let unseen = |_: &Signs<'_>| Ok(());
    sweep_and(sampler, grid, settings, progress, visitor, unseen).map(|((), sums, r)| (sums, r))
}

/// As [`sweep`], and shows `survey` the signs before.
///
/// # Errors
/// [`Error`] when the field can't be evaluated or the work is cancelled, and that of `survey`.
pub fn sweep_and<S: Sampler, V: Visitor, T>(
    sampler: &S,
    grid: &Grid,
    settings: &Settings,
    progress: &Progress,
    visitor: &V,
    survey: impl FnOnce(&Signs<'_>) -> Result<T, Error>,
) -> Result<(T, Vec<V::Sum>, Report), Error> {
    let start = Instant::now();
    let (bricks, mut report) = bricks(sampler, grid, settings, progress)?;
    let clocks = Clocks::default();
    let scene = Scene::new(sampler, grid, &bricks);
    let (pool, memories) = (Pool::default(), Pool::default());
    let make = || Sweeper::new(sampler);
    let owners = scene.owners.len();
    let task = (owners / 64).clamp(4, TASK);
    let tasks = |items: usize| items.div_ceil(task) as u64;
    progress.expect(tasks(bricks.active.len()) + tasks(owners));

    let (signs, nans) = sampled(&scene, &pool, make, task, progress, &clocks)?;
    report.nans = nans;
    let found = survey(&Signs::new(grid, &bricks, &signs))?;
    let scene = Scene { signs, ..scene };

    let arch = Arch::new();
    let sums = (0..owners.div_ceil(task))
        .into_par_iter()
        .map(|t| {
            let ranks = t * task..owners.min((t + 1) * task);
            let (sum, counts) = pool.lend(make, |own| {
                memories.lend(
                    || visitor.memory(),
                    |memory| visit(&scene, arch, own, ranks, visitor, memory, &clocks),
                )
            })?;
            progress.advance(1)?;
            Ok((sum, counts))
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let mut gathered = Vec::with_capacity(sums.len());
    for (sum, [vertices, triangles]) in sums {
        report.vertices += vertices;
        report.triangles += triangles;
        gathered.push(sum);
    }
    clocks.report(&mut report.stages);
    report.stages.total = start.elapsed();
    Ok((found, gathered, report))
}

/// Scratch memory of a task.
struct Sweeper<W> {
    worker: Worker<W>,
    lists: Lists,
    roots: Roots,
    coarse: Vec<[u32; 3]>,
}

impl<W> Sweeper<W> {
    fn new<S: Sampler<Workspace = W>>(sampler: &S) -> Self {
        let (lists, roots, coarse) = (Lists::default(), Roots::default(), Vec::new());
        Self { worker: Worker::new(sampler), lists, roots, coarse }
    }
}

impl<W> AsMut<Worker<W>> for Sweeper<W> {
    fn as_mut(&mut self) -> &mut Worker<W> {
        &mut self.worker
    }
}

/// Lower nodes of crossed edges along each axis, and nodes of outer planes.
type Lists = [List; 4];

/// Nodes that are written for every row that has any: a loop of random short length costs a
/// misprediction.
const WRITTEN: usize = 4;

/// A list of nodes of a brick's cells.
#[derive(Debug)]
struct List {
    /// Room for all of them, and for those written in vain.
    nodes: Box<[u16; SIDE * SIDE * SIDE + WRITTEN]>,
    len: usize,
}

impl Default for List {
    fn default() -> Self {
        Self { nodes: Box::new([0; SIDE * SIDE * SIDE + WRITTEN]), len: 0 }
    }
}

impl List {
    fn nodes(&self) -> &[u16] {
        &self.nodes[..self.len]
    }

    /// Adds the nodes of a row that starts at node `start`, where bits of `word` are set.
    #[inline(always)]
    fn extend(&mut self, word: u32, start: u16) {
        if word == 0 {
            return;
        }
        let node = |i: u32| start + node_at([i as usize, 0, 0]);
        let mut rest = word;
        if let Some(room) = self.nodes[self.len..].first_chunk_mut::<WRITTEN>() {
            for to in room {
                *to = node(rest.trailing_zeros() & 31);
                rest &= rest.wrapping_sub(1);
            }
        }
        if rest != 0 {
            let room = &mut self.nodes[self.len + WRITTEN..];
            for (to, i) in room.iter_mut().zip(Bits(u64::from(rest))) {
                *to = node(i as u32);
            }
        }
        self.len += word.count_ones() as usize;
    }
}

/// Visits the patches of the owners in `ranks`; returns the sum, and the numbers of vertices that
/// the bricks own and of triangles.
fn visit<S: Sampler, V: Visitor>(
    scene: &Scene<'_, S>,
    arch: Arch,
    sweeper: &mut Sweeper<S::Workspace>,
    ranks: std::ops::Range<usize>,
    visitor: &V,
    memory: &mut V::Memory,
    clocks: &Clocks,
) -> Result<(V::Sum, [u64; 2]), Error> {
    let bricks = scene.bricks;
    let Sweeper { worker, lists, roots, coarse } = sweeper;
    let Worker { workspace, activity, made, block, next, placer, positions, triangles, .. } =
        worker;
    triangles.resize(faces::MOST, [0; 3]);
    let mut sum = visitor.zero();
    let mut counts = [0; 2];
    let mut lap = Lap::new(clocks);
    for (number, _) in scene.owners.iter_from(ranks.start).zip(ranks) {
        let brick = bricks.position(number);
        let spans = scene.spans(brick);
        gather(scene.signs_above(brick, made), &mut block.rows);
        arch.dispatch(Numbering { spans: &spans, block, next, lists });
        lap.ends(Stage::Number);

        positions.clear();
        roots.edges.clear();
        roots.rims.clear();
        let lines = BrickLines::new(scene.grid, brick, scene.extent);
        let rank = bricks.active.rank(number);
        if let Some(rank) = rank {
            bricks.activities.expand(bricks.activity(rank), activity);
            let edges = [0, 1, 2].map(|a| lists[a].nodes());
            placer.crossings_of_cells(
                arch,
                scene.sampler,
                workspace,
                brick,
                activity,
                edges,
                &block.rows,
                &spans,
                &lines,
                roots,
                positions,
            )?;
            match V::VERTICES {
                Vertices::OffNodes => {
                    placer.keep_off(&lines, |place| scene.is_crowded(brick, place), positions);
                }
                Vertices::AtRoots => {}
            }
        }
        positions.extend(lists[3].nodes().iter().map(|&node| {
            let place = place_of(node);
            [0, 1, 2].map(|a| lines.placed[a][place[a]])
        }));
        lap.ends(Stage::Place);

        let count = arch.dispatch(Facing { block, next, spans: &spans, out: triangles });
        coarse.clear();
        if V::COARSE {
            let cells = scene.grid.cells();
            let nodes = [0, 1, 2].map(|a| coarse_nodes(brick[a], cells[a]));
            coarse::coarse(block, &spans, nodes, coarse);
        }
        lap.ends(Stage::Faces);

        let patch = Patch {
            brick,
            activity: if rank.is_some() { activity } else { &[] },
            nodes: lists.each_ref().map(List::nodes),
            positions,
            roots,
            triangles: &triangles[..count],
            coarse,
            lines: &lines,
        };
        visitor.visit(memory, &patch, &mut sum)?;
        let own = lists.iter().flat_map(List::nodes).filter(|node| is_own(**node)).count();
        counts = [counts[0] + own as u64, counts[1] + count as u64];
        lap.ends(Stage::Write);
    }
    lap.close();
    Ok((sum, counts))
}

/// Whether a vertex at the edge or node of that number is the brick's own, not the next one's.
#[must_use]
pub const fn is_own(node: u16) -> bool {
    node < (BRICK * BRICK * BRICK) as u16
}

/// Lists the vertices of a brick's cells and numbers them in their order, for [`Facing`]; a task for
/// [`Arch::dispatch`].
struct Numbering<'a> {
    spans: &'a Spans,
    /// Holds the signs, and receives the first number of each row.
    block: &'a mut Block,
    /// Receives the first numbers at the far end along x.
    next: &'a mut Block,
    lists: &'a mut Lists,
}

impl NullaryFnOnce for Numbering<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { spans, block, next, lists } = self;
        let [xs, ys, zs] = spans.0;
        let Block { rows, crossings: _, x, y, z, planes } = block;
        let rows: &Rows = rows;
        lists.iter_mut().for_each(|list| list.len = 0);
        let [along_x, along_y, along_z, nodes] = lists;
        let mut at = 0;
        for k in 0..SIDE {
            for j in 0..SIDE {
                let word = (rows[k][j] ^ rows[k][j] >> 1) & xs.edge & ROW;
                number(along_x, &mut at, &mut x[k][j], word, [j, k]);
            }
        }
        for k in 0..SIDE {
            for j in 0..BRICK {
                let word = (rows[k][j] ^ rows[k][j + 1]) & spread(ys.edge, j);
                number(along_y, &mut at, &mut y[k][j], word, [j, k]);
                next.y[k][j] = y[k][j] + (word & ROW).count_ones();
            }
        }
        for k in 0..BRICK {
            for j in 0..SIDE {
                let word = (rows[k][j] ^ rows[k + 1][j]) & spread(zs.edge, k);
                number(along_z, &mut at, &mut z[k][j], word, [j, k]);
                next.z[k][j] = z[k][j] + (word & ROW).count_ones();
            }
        }
        if !spans.meet_outer() {
            return;
        }
        for k in 0..SIDE {
            for j in 0..SIDE {
                let word = rows[k][j] & (xs.outer | spread(ys.outer, j) | spread(zs.outer, k));
                number(nodes, &mut at, &mut planes[k][j], word, [j, k]);
                next.planes[k][j] = planes[k][j] + (word & ROW).count_ones();
            }
        }
    }
}

/// Adds the vertices of row `[j, k]`, where bits of `word` are set, to `list`; they are numbered from
/// `at` on, which becomes `first`.
#[inline(always)]
fn number(list: &mut List, at: &mut u32, first: &mut u32, word: u32, [j, k]: [usize; 2]) {
    *first = *at;
    *at += word.count_ones();
    list.extend(word, node_at([0, j, k]));
}
