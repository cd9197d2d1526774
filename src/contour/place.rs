//! Where vertices lie: roots of the field on grid edges, kept off crowded nodes.
//!
//! A vertex is the root of the field itself on its edge, found between the two sampled signs. Two
//! evaluations settle nearly every edge of a smooth field: one at the linear guess, one at the root
//! of the cubic through all that is known by then, whose Newton step ends at rounding
//! ([`Lanes::bend`], [`Lanes::settle`]). The others go on with a bracket, and bisection replaces a
//! step that leaves it or is longer than three quarters of the one before. Each edge is one lane
//! with a state of its own, so its root does not depend on the edges that it is batched with.
//!
//! A value of zero counts as a root only where the slope is not zero: on a plateau of zeros the
//! root is where the solid ends. A root at a node is that node's coordinate exactly.
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
//!
//! Source: Press et al., Numerical Recipes, section 9.4 (`rtsafe`), with the ends of the bracket
//! kept by sign instead of by order.

use super::bits::{Rows, SIDE, Spans, Words};
use super::grid::{Grid, TAU};
use super::numbering::{Bits, Block};
use crate::eval::sampler::{Failure, place_of};
use crate::eval::{BRICK, End, Sampler};
use crate::geom::Axis;
use pulp::{Arch, NullaryFnOnce};

/// Most edges in a batch of a sampler.
const BATCH: usize = 256;

/// Step, in edge lengths, below which a root is settled once the step is taken.
const TOLERANCE: f64 = 1e-13;

/// Step, in edge lengths, below which a Newton step that does not shrink is taken as rounding of
/// the field, not as a failure to converge.
const STAGNATION: f64 = 1e-11;

/// Coordinates are known to this fraction of the largest of them.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Step, in edge lengths, that may be the last where the curvature says that it ends at rounding.
const LAST_STEP: f64 = 1e-7;

/// Most evaluations of an edge that has not settled after two: bisection alone needs 52 for any
/// edge, and no more than half of the steps of an edge that resists are those of Newton's method.
const MOST_ROUNDS: usize = 110;

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
    /// The edge's place in its batch.
    lane: u16,
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
    roots: Vec<f64>,
    rims: Vec<Rim>,
    everything: Vec<u64>,
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
        let table = &lines.sampled[axis.index()];
        for batch in edges.chunks(BATCH) {
            let mut ask = Query { sampler, workspace: &mut *workspace, brick, activity, axis };
            let mut roots = self.lanes.solve(arch, &mut ask, batch, table, lines.extent)?;
            if let Some(found) = &mut found {
                found.edges.extend_from_slice(roots);
            }
            if !spans.is_plain() {
                self.roots.clear();
                self.roots.extend_from_slice(roots);
                self.rims.clear();
                self.rims.extend(
                    (0..)
                        .zip(batch)
                        .filter_map(|(lane, &node)| rim(brick, node, lane, axis, rows, spans)),
                );
                self.rims.sort_unstable_by_key(|rim| (rim.brick, rim.lane));
                self.everything.resize(activity.len(), u64::MAX);
                for rims in self.rims.chunk_by(|a, b| a.brick == b.brick) {
                    let brick = rims[0].brick;
                    let activity = &self.everything;
                    let workspace = &mut *workspace;
                    let mut ask = Query { sampler, workspace, brick, activity, axis };
                    let (lanes, roots) = (&mut self.lanes, &mut self.roots);
                    let each = |lane: usize, ghost: u16, root: f64| {
                        if let Some(found) = &mut found {
                            let vertex = (out.len() + lane) as u32;
                            found.rims.push(RimRoot { vertex, axis, brick, ghost, root });
                        }
                    };
                    lanes.meet_planes(arch, &mut ask, rims, table, lines.extent, roots, each)?;
                }
                roots = &self.roots;
            }
            let near = &mut self.near;
            match axis {
                Axis::X => put::<0>(batch, roots, lines, near, out),
                Axis::Y => put::<1>(batch, roots, lines, near, out),
                Axis::Z => put::<2>(batch, roots, lines, near, out),
            }
        }
        Ok(())
    }
}

/// Appends the vertices at `roots` and notes those that may be near nodes.
fn put<const AXIS: usize>(
    batch: &[u16],
    roots: &[f64],
    lines: &BrickLines,
    near: &mut Vec<Near>,
    out: &mut Vec<[f64; 3]>,
) {
    let first = out.len();
    let [px, py, pz] = &lines.placed;
    out.extend(batch.iter().zip(roots).map(|(node, root)| {
        let [x, y, z] = place_of(*node);
        match AXIS {
            0 => [*root, py[y], pz[z]],
            1 => [px[x], *root, pz[z]],
            _ => [px[x], py[y], *root],
        }
    }));
    // Where an edge is left alone: rather too little of it than too much.
    let placed = &lines.placed[AXIS];
    let alone: [[f64; 2]; BRICK] = std::array::from_fn(|i| {
        let margin = 2.0 * TAU * (placed[i + 1] - placed[i]);
        [placed[i] + margin, placed[i + 1] - margin]
    });
    for (lane, (node, root)) in batch.iter().zip(roots).enumerate() {
        let [low, high] = alone[place_of(*node)[AXIS]];
        if *root < low || *root > high {
            near.push(Near { vertex: first + lane, axis: Axis::ALL[AXIS], node: *node });
        }
    }
}

/// The ghosts beside the edge along `axis` from `node`, if it lies in an outer plane.
fn rim(
    brick: [u32; 3],
    node: u16,
    lane: u16,
    axis: Axis,
    rows: &Rows,
    spans: &Spans,
) -> Option<Rim> {
    let at = place_of(node);
    let mut beside = [0, 1, 2].map(|a| brick[a] as usize * BRICK + at[a]);
    let is_outer = |a: usize| a != axis.index() && spans.0[a].outer >> at[a] & 1 == 1;
    if !(0..3).any(is_outer) {
        return None;
    }
    for a in (0..3).filter(|&a| is_outer(a)) {
        // The first node of all is at position 1; the other outer plane is the upper one.
        beside[a] = if beside[a] == 1 { 0 } else { beside[a] + 1 };
    }
    let ghost = (0..3).map(|a| (beside[a] % BRICK) << (4 * a)).sum::<usize>() as u16;
    let [x, y, z] = at;
    Some(Rim {
        brick: beside.map(|p| (p / BRICK) as u32),
        ghost,
        lane,
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

/// Edges of one brick and axis, asked of a sampler.
struct Query<'a, S: Sampler> {
    sampler: &'a S,
    workspace: &'a mut S::Workspace,
    brick: [u32; 3],
    activity: &'a [u64],
    axis: Axis,
}

impl<S: Sampler> Query<'_, S> {
    fn begin(&mut self, nodes: &[u16]) -> Result<(), Failure> {
        let Self { sampler, workspace, brick, activity, axis } = self;
        sampler.line_begin(workspace, *axis, *brick, nodes, activity)
    }
}

/// One number an edge. A line of the cache longer than a batch, because arrays a power of two
/// apart contend for the same few places in it.
type Numbers = [f64; BATCH + 8];

/// A batch of edges on the way to their roots, one entry an edge.
#[derive(Debug)]
struct Lanes {
    /// The edges, and their places in the result.
    nodes: [u16; BATCH],
    place: [u16; BATCH],
    /// Ends of the bracket: where the field is below zero, and where it is not.
    inner: Numbers,
    outer: Numbers,
    /// Values at the ends of the edge that the bracket began with.
    least: Numbers,
    most: Numbers,
    /// Half the second derivative near the root, over the slope; magnitude.
    curvature: Numbers,
    /// Where to evaluate next; the root of a settled lane.
    at: Numbers,
    /// Length of the last step.
    step: Numbers,
    length: Numbers,
    /// All ones until the lane is settled, then zero.
    open: [u64; BATCH + 8],
    value: Numbers,
    slope: Numbers,
    roots: Numbers,
}

impl Default for Lanes {
    fn default() -> Self {
        let zero = [0.0; BATCH + 8];
        Self {
            nodes: [0; BATCH],
            place: [0; BATCH],
            inner: zero,
            outer: zero,
            least: zero,
            most: zero,
            curvature: zero,
            at: zero,
            step: zero,
            length: zero,
            open: [0; BATCH + 8],
            value: zero,
            slope: zero,
            roots: zero,
        }
    }
}

impl Lanes {
    /// Roots on the edges from `nodes`, at most [`BATCH`], between the coordinates in `table`.
    fn solve<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &[u16],
        table: &[f64; SIDE],
        extent: f64,
    ) -> Result<&[f64], Failure> {
        let rounding = ROUNDING * extent;
        let mut n = nodes.len();
        ask.begin(nodes)?;
        let Query { sampler, workspace, .. } = ask;
        sampler.line_ends(workspace, End::Lower, &mut self.value[..n])?;
        sampler.line_ends(workspace, End::Upper, &mut self.slope[..n])?;
        let shift = 4 * ask.axis.index();
        let edges = nodes.iter().zip(&mut self.inner).zip(&mut self.outer);
        for ((node, lower), upper) in edges {
            let i = usize::from(node >> shift) % BRICK;
            (*lower, *upper) = (table[i], table[i + 1]);
        }
        arch.dispatch(Task { lanes: self, n, rounding, stage: Stage::Start });
        self.evaluate(ask, n)?;
        arch.dispatch(Task { lanes: self, n, rounding, stage: Stage::Bend });
        self.evaluate(ask, n)?;
        let mut open = arch.dispatch(Task { lanes: self, n, rounding, stage: Stage::Settle });
        if open == 0 {
            return Ok(&self.at[..n]);
        }
        self.nodes[..n].copy_from_slice(nodes);
        for (lane, place) in self.place[..n].iter_mut().enumerate() {
            *place = lane as u16;
        }
        open = arch.dispatch(Task { lanes: self, n, rounding, stage: Stage::Restart });
        for _ in 0..MOST_ROUNDS {
            if open == 0 {
                break;
            }
            if 2 * open < n {
                n = self.compact(n);
                ask.begin(&self.nodes[..n])?;
            }
            self.evaluate(ask, n)?;
            open = arch.dispatch(Task { lanes: self, n, rounding, stage: Stage::Advance });
        }
        for lane in 0..n {
            self.roots[usize::from(self.place[lane])] = self.at[lane];
        }
        Ok(&self.roots[..nodes.len()])
    }

    /// Moves the `roots` of edges in outer planes to the planes: as far again beyond the roots
    /// between their ghosts, which are sampled halfway, as those are from them.
    ///
    /// An edge whose signs are others there keeps its root; `each` is told lane, ghost and root of
    /// the others.
    #[expect(clippy::too_many_arguments, reason = "one call site")]
    fn meet_planes<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        rims: &[Rim],
        table: &[f64; SIDE],
        extent: f64,
        roots: &mut [f64],
        mut each: impl FnMut(usize, u16, f64),
    ) -> Result<(), Failure> {
        let mut nodes = [0; BATCH];
        for (node, rim) in nodes.iter_mut().zip(rims) {
            *node = rim.ghost;
        }
        let n = rims.len();
        let (mut below, mut above) = ([0.0; BATCH], [0.0; BATCH]);
        ask.begin(&nodes[..n])?;
        ask.sampler.line_ends(ask.workspace, End::Lower, &mut below[..n])?;
        ask.sampler.line_ends(ask.workspace, End::Upper, &mut above[..n])?;
        let (mut kept, mut lanes) = (0, [0; BATCH]);
        for (i, rim) in rims.iter().enumerate() {
            if (below[i] < 0.0) == rim.rising && (above[i] < 0.0) != rim.rising {
                (nodes[kept], lanes[kept]) = (rim.ghost, usize::from(rim.lane));
                kept += 1;
            }
        }
        if kept == 0 {
            return Ok(());
        }
        let halfway = self.solve(arch, ask, &nodes[..kept], table, extent)?;
        for ((lane, node), halfway) in lanes.iter().zip(&nodes[..kept]).zip(halfway) {
            let i = place_of(*node)[ask.axis.index()];
            let met = 2.0 * halfway - roots[*lane];
            roots[*lane] = met.clamp(table[i], table[i + 1]);
            each(*lane, *node, *halfway);
        }
        Ok(())
    }

    /// Values and slopes of the first `n` lanes where they are.
    fn evaluate<S: Sampler>(&mut self, ask: &mut Query<'_, S>, n: usize) -> Result<(), Failure> {
        let (value, slope) = (&mut self.value[..n], &mut self.slope[..n]);
        ask.sampler.line(ask.workspace, &self.at[..n], value, slope)
    }

    /// Sets the brackets and the linear guesses; `inner` and `outer` hold the lower and upper ends,
    /// `value` and `slope` their values.
    #[inline(always)]
    fn start(&mut self, n: usize) {
        for lane in 0..n.min(BATCH) {
            let (lower, upper) = (self.inner[lane], self.outer[lane]);
            let (below, above) = (self.value[lane], self.slope[lane]);
            let rising = below < 0.0;
            let (inner, outer) = if rising { (lower, upper) } else { (upper, lower) };
            let (least, most) = if rising { (below, above) } else { (above, below) };
            let guess = inner + (outer - inner) * (least / (least - most));
            let middle = 0.5 * (inner + outer);
            let within = (guess > lower) & (guess < upper);
            let guess = if within { guess } else { middle };
            self.inner[lane] = inner;
            self.outer[lane] = outer;
            self.least[lane] = least;
            self.most[lane] = most;
            self.at[lane] = if most == 0.0 { outer } else { guess };
            self.step[lane] = upper - lower;
            self.length[lane] = upper - lower;
        }
    }

    /// Takes each lane to the root of the cubic that has the values at both ends of its edge, and
    /// the value f and the slope s at the guess; no further than the ends of its edge.
    ///
    /// The cubic is f + s d + g d², d being the distance from the guess and g linear along the
    /// edge; the values at the ends give g there. Its root is d = -(f / s) / (1 + e), where
    /// e = d g / s: small where the grid resolves the field, so that two rounds of putting d in and
    /// three terms of the series leave nothing. The cubic misses the field by its fourth
    /// derivative, times d², times both distances to the ends, over 24: of a wave of N edges the
    /// root is off by some 50 N^-5 edges.
    #[inline(always)]
    fn bend(&mut self, n: usize) {
        for lane in 0..n.min(BATCH) {
            let (a, b) = (self.inner[lane], self.outer[lane]);
            let (at, value, slope) = (self.at[lane], self.value[lane], self.slope[lane]);
            let (to_a, to_b) = (a - at, b - at);
            // One division for two: they are dear.
            let (gap, span) = (to_a * to_b, b - a);
            let per_both = 1.0 / (gap * span);
            let (per_slope, per_gap, per_span) = (1.0 / slope, per_both * span, per_both * gap);
            let rise = |end: f64, to_end: f64| (end - value) - slope * to_end;
            let (at_a, at_b) = (to_b * per_gap, to_a * per_gap);
            let g_a = rise(self.least[lane], to_a) * (at_a * at_a);
            let g_b = rise(self.most[lane], to_b) * (at_b * at_b);
            let change = (g_b - g_a) * per_span;
            let here = g_a - change * to_a;
            let straight = -(value * per_slope);
            let bent = |d: f64| (here + change * d) * per_slope * d;
            let e = bent(straight);
            let e = bent(straight * (1.0 - e));
            let next = at + straight * ((1.0 - e) + e * e);
            // Where an end is the guess there is no cubic.
            let newton = at + straight;
            let next = if next.abs() < f64::INFINITY { next } else { newton };
            let (lower, upper) = if a < b { (a, b) } else { (b, a) };
            let next = if next > lower { next } else { lower };
            self.at[lane] = if next < upper { next } else { upper };
            self.curvature[lane] = (here * per_slope).abs();
        }
    }

    /// Closes the lanes whose next Newton step ends within the tolerance of the root, takes that
    /// step, and returns how many lanes are open.
    ///
    /// A step of length s, taken where the curvature is c, ends about c s² from the root. That is
    /// believed of steps below [`LAST_STEP`] only: longer ones say that the cubic, and with it the
    /// curvature, was wrong.
    #[inline(always)]
    fn settle(&mut self, n: usize, rounding: f64) -> usize {
        let mut open = 0;
        for lane in 0..n.min(BATCH) {
            let at = self.at[lane];
            let newton = at - self.value[lane] / self.slope[lane];
            let between = (newton - self.inner[lane]) * (newton - self.outer[lane]) <= 0.0;
            let finite = self.slope[lane].abs() < f64::INFINITY;
            let (step, length) = ((newton - at).abs(), self.length[lane]);
            let tolerance = tolerance(length, rounding);
            let ends_there = (step <= LAST_STEP * length)
                & (4.0 * self.curvature[lane] * (step * step) <= tolerance);
            let settled = between & finite & ((step <= tolerance) | ends_there);
            self.at[lane] = if settled { newton } else { at };
            self.open[lane] = if settled { 0 } else { u64::MAX };
            open += usize::from(!settled);
        }
        open
    }

    /// Takes a step in each open lane and returns how many lanes stay open.
    ///
    /// Where Newton's step is no good the bracket is halved; in the `FIRST` round, though, a lane
    /// that is inside goes to the end outside. The field of a solid that ends in a plane is flat
    /// inside of the plane (an edge in the plane sees the plane's own distance there) and smooth
    /// outside, so that Newton's method leads from that end to the root at once.
    #[inline(always)]
    fn advance<const FIRST: bool>(&mut self, n: usize, rounding: f64) -> usize {
        let mut still = 0;
        for lane in 0..n.min(BATCH) {
            let (at, value) = (self.at[lane], self.value[lane]);
            let inside = value < 0.0;
            let inner = if inside { at } else { self.inner[lane] };
            let outer = if inside { self.outer[lane] } else { at };
            let length = self.length[lane];
            let tolerance = tolerance(length, rounding);

            // An infinite slope makes a step of zero, which would be taken for a root.
            let step = if self.slope[lane].abs() < f64::INFINITY {
                value / self.slope[lane]
            } else {
                f64::NAN
            };
            let newton = at - step;
            let size = step.abs();
            let within = (newton - inner) * (newton - outer) <= 0.0;
            let shrinks = size <= 0.75 * self.step[lane];
            let stagnates = size <= STAGNATION * length;
            let take = within & (shrinks | stagnates);
            let width = (outer - inner).abs();
            let converged = take & ((size <= tolerance) | !shrinks);
            let narrow = width <= tolerance;

            let to_end = FIRST & inside & !take;
            let next = if take { newton } else { 0.5 * (inner + outer) };
            let next = if to_end { outer } else { next };
            let next = if narrow & !converged { outer } else { next };
            let open = self.open[lane] != 0;
            self.inner[lane] = inner;
            self.outer[lane] = outer;
            let reach = if to_end { 2.0 * width } else { 0.5 * width };
            self.step[lane] = if take { size } else { reach };
            self.at[lane] = if open { next } else { at };
            let stays = open & !(converged | narrow);
            self.open[lane] = if stays { u64::MAX } else { 0 };
            still += usize::from(stays);
        }
        still
    }

    /// Delivers the settled lanes and moves the open ones together; returns how many are open.
    fn compact(&mut self, n: usize) -> usize {
        let mut kept = 0;
        for lane in 0..n {
            if self.open[lane] == 0 {
                self.roots[usize::from(self.place[lane])] = self.at[lane];
                continue;
            }
            self.nodes[kept] = self.nodes[lane];
            self.place[kept] = self.place[lane];
            self.inner[kept] = self.inner[lane];
            self.outer[kept] = self.outer[lane];
            self.at[kept] = self.at[lane];
            self.step[kept] = self.step[lane];
            self.length[kept] = self.length[lane];
            self.open[kept] = u64::MAX;
            kept += 1;
        }
        kept
    }
}

/// Step that settles a root on an edge of that length.
#[inline(always)]
fn tolerance(length: f64, rounding: f64) -> f64 {
    if TOLERANCE * length > rounding { TOLERANCE * length } else { rounding }
}

/// A stage of finding roots.
#[derive(Clone, Copy)]
enum Stage {
    Start,
    Bend,
    Settle,
    Restart,
    Advance,
}

/// A stage on the first `n` lanes; returns how many lanes it leaves open.
struct Task<'a> {
    lanes: &'a mut Lanes,
    n: usize,
    rounding: f64,
    stage: Stage,
}

impl NullaryFnOnce for Task<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { lanes, n, rounding, stage } = self;
        match stage {
            Stage::Start => {
                lanes.start(n);
                n
            }
            Stage::Bend => {
                lanes.bend(n);
                n
            }
            Stage::Settle => lanes.settle(n, rounding),
            Stage::Restart => lanes.advance::<true>(n, rounding),
            Stage::Advance => lanes.advance::<false>(n, rounding),
        }
    }
}
