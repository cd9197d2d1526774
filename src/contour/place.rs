//! Where vertices lie: roots of the field on grid edges, kept off crowded nodes.
//!
//! A vertex is the root of the field itself on its edge, found between the two sampled signs
//! ([`super::roots`]).
//!
//! At a node with more than one crossed edge (edges to ghosts included) crossings keep
//! [`TAU`] edge lengths from the node; a node's only crossed edge keeps its exact root, so that
//! flat faces on nodes stay exact. Both read signs only. Why this excludes zero areas is told in
//! [`super::tables`].
//!
//! Edges in the outer planes are sampled inside of the planes ([`super::grid`]), by one inset, and
//! once more by half of it: the vertex is placed where the line through both roots meets the plane.
//! Without that a rim would creep outwards by a part of the inset whenever a mesh is read back and
//! contoured again.

use super::bits::{Rows, SIDE, Spans, Words};
use super::grid::{Grid, TAU};
use super::numbering::{Bits, Block};
use super::roots::{BATCH, Lanes, Query};
use crate::eval::sampler::{Failure, place_of};
use crate::eval::{BRICK, Sampler};
use crate::geom::Axis;
use pulp::{Arch, NullaryFnOnce};

/// Coordinates of a brick's nodes along each axis, the first of the next brick included.
#[derive(Clone, Copy, Debug)]
pub struct BrickLines {
    /// Where vertices are placed.
    pub placed: [[f64; SIDE]; 3],
    /// Where the field is sampled.
    pub sampled: [[f64; SIDE]; 3],
    /// Largest magnitude of a coordinate of the grid.
    pub extent: f64,
}

impl BrickLines {
    /// The coordinates of a brick's nodes; `extent` is [`Grid::extent`].
    #[must_use]
    pub fn new(grid: &Grid, brick: [u32; 3], extent: f64) -> Self {
        let mut lines = Self { placed: [[0.0; SIDE]; 3], sampled: [[0.0; SIDE]; 3], extent };
        for (a, axis) in Axis::ALL.into_iter().enumerate() {
            let nodes = brick[a] as usize * BRICK..brick[a] as usize * BRICK + SIDE;
            lines.placed[a].copy_from_slice(&grid.placed(axis)[nodes.clone()]);
            lines.sampled[a].copy_from_slice(&grid.sampled(axis)[nodes]);
        }
        lines
    }
}

/// A vertex that may be too close to a node.
#[derive(Clone, Copy, Debug)]
struct Near {
    vertex: usize,
    axis: Axis,
    node: u16,
}

/// An edge in an outer plane, seen from the ghosts beside it.
#[derive(Clone, Copy, Debug)]
struct Rim {
    /// The brick and the number in it of the ghost beside the edge's lower node.
    brick: [u32; 3],
    ghost: u16,
    /// The edge's lower node and its vertex.
    node: u16,
    vertex: usize,
    /// Whether the lower node is inside.
    rising: bool,
}

/// The roots that vertices were placed from.
#[derive(Debug, Default)]
pub struct Roots {
    /// The root on each edge, at the coordinates where the field is sampled.
    pub edges: Vec<f64>,
    /// The roots nearer to the plane, of edges in outer planes.
    pub rims: Vec<RimRoot>,
}

/// A root on an edge between ghosts, from which a vertex in an outer plane was extrapolated: it lies
/// at twice this root, less the root on the edge in the plane.
#[derive(Clone, Copy, Debug)]
pub struct RimRoot {
    /// The vertex, by its place among those found together.
    pub vertex: u32,
    /// The direction of the edge.
    pub axis: Axis,
    /// The brick and the number in it of the ghost at the lower end.
    pub brick: [u32; 3],
    /// See `brick`.
    pub ghost: u16,
    /// The root.
    pub root: f64,
}

/// Scratch memory for the vertices of a brick.
#[derive(Debug)]
pub struct Placer {
    edges: Box<Edges>,
    solver: Solver,
}

/// Scratch memory for the roots on edges along one axis.
#[derive(Debug, Default)]
struct Solver {
    near: Vec<Near>,
    rims: Vec<Rim>,
    everything: Vec<u64>,
    kept: Vec<usize>,
    lanes: Box<Lanes>,
}

impl Default for Placer {
    fn default() -> Self {
        Self { edges: Box::new([0; BRICK * BRICK * BRICK + WRITTEN]), solver: Solver::default() }
    }
}

impl Placer {
    /// Appends the crossings of a brick to `out`, in the order of their numbers.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    #[expect(clippy::too_many_arguments, reason = "one call site")]
    pub fn crossings<S: Sampler>(
        &mut self,
        arch: Arch,
        sampler: &S,
        workspace: &mut S::Workspace,
        brick: [u32; 3],
        activity: &[u64],
        block: &Block,
        spans: &Spans,
        lines: &BrickLines,
        out: &mut Vec<[f64; 3]>,
    ) -> Result<(), Failure> {
        self.solver.near.clear();
        let rows = &block.rows;
        for axis in Axis::ALL {
            let crossed = &block.crossings.0[axis.index()];
            let count = arch.dispatch(Listing { crossed, edges: &mut self.edges });
            let ask = Query { sampler, workspace: &mut *workspace, brick, activity, axis };
            self.solver.place(arch, ask, &self.edges[..count], rows, spans, lines, None, out)?;
        }
        Ok(())
    }

    /// Appends the crossings on all edges of a brick's cells to `out`, far faces included, in the
    /// order of `edges`, which holds the lower nodes of those along each axis; and their roots to
    /// `found`.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    #[expect(clippy::too_many_arguments, reason = "one call site")]
    pub fn crossings_of_cells<S: Sampler>(
        &mut self,
        arch: Arch,
        sampler: &S,
        workspace: &mut S::Workspace,
        brick: [u32; 3],
        activity: &[u64],
        edges: [&[u16]; 3],
        rows: &Rows,
        spans: &Spans,
        lines: &BrickLines,
        found: &mut Roots,
        out: &mut Vec<[f64; 3]>,
    ) -> Result<(), Failure> {
        self.solver.near.clear();
        for (axis, edges) in Axis::ALL.into_iter().zip(edges) {
            let ask = Query { sampler, workspace: &mut *workspace, brick, activity, axis };
            self.solver.place(arch, ask, edges, rows, spans, lines, Some(found), out)?;
        }
        Ok(())
    }

    /// Moves the last brick's crossings off crowded nodes; `crowded` tells whether the node at that
    /// place in the brick, or in the next ones, has more than one crossed edge.
    pub fn keep_off(
        &self,
        lines: &BrickLines,
        crowded: impl Fn([usize; 3]) -> bool,
        out: &mut [[f64; 3]],
    ) {
        for &Near { vertex, axis, node } in &self.solver.near {
            let a = axis.index();
            let lower = place_of(node);
            let mut upper = lower;
            upper[a] += 1;
            let ends = [lines.placed[a][lower[a]], lines.placed[a][upper[a]]];
            let margin = TAU * (ends[1] - ends[0]);
            let at = &mut out[vertex][a];
            if *at - ends[0] < margin && crowded(lower) {
                *at = at.max(ends[0] + margin);
            }
            if ends[1] - *at < margin && crowded(upper) {
                *at = at.min(ends[1] - margin);
            }
        }
    }
}

impl Solver {
    /// Appends the crossings of the edges along the axis of `ask` to `out`.
    #[expect(clippy::too_many_arguments, reason = "two call sites, next to each other")]
    fn place<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: Query<'_, S>,
        edges: &[u16],
        rows: &Rows,
        spans: &Spans,
        lines: &BrickLines,
        mut found: Option<&mut Roots>,
        out: &mut Vec<[f64; 3]>,
    ) -> Result<(), Failure> {
        let Query { sampler, workspace, brick, activity, axis } = ask;
        let (a, table) = (axis.index(), &lines.sampled[axis.index()]);
        for batch in edges.chunks(BATCH) {
            let mut ask = Query { sampler, workspace: &mut *workspace, brick, activity, axis };
            self.lanes.solve(arch, &mut ask, batch, table, lines.extent)?;
            let (first, roots) = (out.len(), self.lanes.roots(batch.len()));
            put(a, batch, roots, lines, out);
            if let Some(found) = &mut found {
                found.edges.extend_from_slice(roots);
            }
            self.near.extend(self.lanes.near(batch.len()).map(|lane| Near {
                vertex: first + lane,
                axis,
                node: batch[lane],
            }));
            if spans.meet_outer() {
                let outer = [0, 1, 2].map(|b| if b == a { 0 } else { spans.0[b].outer });
                self.rims.clear();
                self.rims.extend(
                    (first..)
                        .zip(batch)
                        .filter_map(|(vertex, &node)| rim(brick, node, vertex, outer, rows)),
                );
                self.everything.resize(activity.len(), u64::MAX);
                self.meet_planes(arch, ask, table, lines.extent, found.as_deref_mut(), out)?;
            }
        }
        Ok(())
    }

    /// Moves the vertices in outer planes to the planes: as far again beyond the roots between
    /// their ghosts, which are sampled halfway, as those are from the roots found.
    ///
    /// A vertex on an edge whose signs are others there stays.
    fn meet_planes<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: Query<'_, S>,
        table: &[f64; SIDE],
        extent: f64,
        mut found: Option<&mut Roots>,
        out: &mut [[f64; 3]],
    ) -> Result<(), Failure> {
        let Query { sampler, workspace, axis, .. } = ask;
        let Self { near, rims, everything, kept, lanes } = self;
        let a = axis.index();
        rims.sort_unstable_by_key(|rim| (rim.brick, rim.vertex));
        for rims in rims.chunk_by(|a, b| a.brick == b.brick) {
            let (workspace, activity, brick) = (&mut *workspace, &everything[..], rims[0].brick);
            let mut ask = Query { sampler, workspace, brick, activity, axis };
            let mut ghosts = [0; BATCH];
            let ghosts = &mut ghosts[..rims.len()];
            for (ghost, rim) in ghosts.iter_mut().zip(rims) {
                *ghost = rim.ghost;
            }
            let rising = |i: usize| rims[i].rising;
            lanes.solve_some(arch, &mut ask, ghosts, rising, kept, table, extent)?;
            for (&i, &root) in kept.iter().zip(lanes.roots(kept.len())) {
                let Rim { ghost, node, vertex, .. } = rims[i];
                if let Some(found) = &mut found {
                    found.rims.push(RimRoot { vertex: vertex as u32, axis, brick, ghost, root });
                }
                let (at, lower) = (&mut out[vertex][a], place_of(ghost)[a]);
                *at = (2.0 * root - *at).clamp(table[lower], table[lower + 1]);
                near.push(Near { vertex, axis, node });
            }
        }
        Ok(())
    }
}

/// Appends the vertices at `roots` on edges along the axis numbered `axis`.
fn put(axis: usize, nodes: &[u16], roots: &[f64], lines: &BrickLines, out: &mut Vec<[f64; 3]>) {
    // As long as a place can be great, so that none needs a test.
    let mut tables = [[0.0; 2 * BRICK]; 3];
    for (table, line) in tables.iter_mut().zip(&lines.placed) {
        table[..SIDE].copy_from_slice(line);
    }
    let first = out.len();
    out.resize(first + nodes.len(), [0.0; 3]);
    for (vertex, (node, root)) in out[first..].iter_mut().zip(nodes.iter().zip(roots)) {
        let place = place_of(*node);
        *vertex = std::array::from_fn(|a| tables[a][place[a] % (2 * BRICK)]);
        vertex[axis] = *root;
    }
}

/// The ghosts beside the edge from `node`, if it lies in an outer plane; `outer` tells which places
/// across the edge are in outer planes.
fn rim(brick: [u32; 3], node: u16, vertex: usize, outer: [u32; 3], rows: &Rows) -> Option<Rim> {
    let at = place_of(node);
    if (outer[0] >> at[0] | outer[1] >> at[1] | outer[2] >> at[2]) & 1 == 0 {
        return None;
    }
    let mut beside = [0, 1, 2].map(|a| brick[a] as usize * BRICK + at[a]);
    for a in (0..3).filter(|&a| outer[a] >> at[a] & 1 == 1) {
        // The first node of all is at position 1; the other outer plane is the upper one.
        beside[a] = if beside[a] == 1 { 0 } else { beside[a] + 1 };
    }
    let ghost = (0..3).map(|a| (beside[a] % BRICK) << (4 * a)).sum::<usize>() as u16;
    let [x, y, z] = at;
    Some(Rim {
        brick: beside.map(|p| (p / BRICK) as u32),
        ghost,
        node,
        vertex,
        rising: rows[z][y] >> x & 1 == 1,
    })
}

/// Writes the lower nodes of crossed edges and returns how many they are.
struct Listing<'a> {
    crossed: &'a Words,
    edges: &'a mut Edges,
}

/// Room for the nodes of a brick, and for those of a word written in vain.
type Edges = [u16; BRICK * BRICK * BRICK + WRITTEN];

/// Nodes that are written for every word: a loop of random short length costs a misprediction.
const WRITTEN: usize = 4;

impl NullaryFnOnce for Listing<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { crossed, edges } = self;
        let mut count = 0;
        for (w, &word) in crossed.as_flattened().iter().enumerate() {
            let mut rest = word;
            let Some(room) = edges[count..].first_chunk_mut::<WRITTEN>() else { break };
            for node in room {
                *node = (64 * w) as u16 + (rest.trailing_zeros() & 63) as u16;
                rest &= rest.wrapping_sub(1);
            }
            if rest != 0 {
                for (node, bit) in edges[count + WRITTEN..].iter_mut().zip(Bits(rest)) {
                    *node = (64 * w + bit) as u16;
                }
            }
            count += word.count_ones() as usize;
        }
        count
    }
}

/// Appends the inside nodes of outer planes that a brick owns.
pub fn planes(block: &Block, spans: &Spans, lines: &BrickLines, out: &mut Vec<[f64; 3]>) {
    for z in 0..BRICK {
        for y in 0..BRICK {
            for x in Bits(u64::from(spans.planes(&block.rows, z, y))) {
                out.push([lines.placed[0][x], lines.placed[1][y], lines.placed[2][z]]);
            }
        }
    }
}
