//! The passes: sample, count, place and write.
//!
//! Pass 1 samples the bricks that intervals do not settle and keeps their signs, 512 bytes each,
//! then counts each brick's vertices and triangles. Prefix sums over the bricks give the size of
//! the mesh and every brick's first number. Pass 2 takes runs of bricks in order, places their
//! vertices, makes their triangles and hands both to the sink in pieces. Nothing is sampled twice
//! and nothing is locked but the pools.
//!
//! Bricks proved inside are not sampled; those that touch an outer plane take part with signs made
//! up, because they carry caps. No other settled brick owns a vertex or a triangle: the signs of
//! its closed box are one.

use super::bits::{INSIDE, OUTSIDE, Span, Spans};
use super::faces::{self, Facing};
use super::grid::Grid;
use super::numbering::{Block, BrickNumbers, Count, Counting, Filling, Neighbours};
use super::place::{BrickLines, Placer, planes};
use super::tables::{TABLES, Tables};
use super::{Error, Report, Stages};
use crate::eval::{BRICK, BrickSigns, Sampler};
use crate::geom::Axis;
use crate::mesh::Sink;
use crate::num::Progress;
use crate::octree::{Bricks, Pool, RankedBits};
use pulp::Arch;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Size of the pieces handed to the sink, in bytes of this program's types: large enough for a
/// write, small enough to stay in the cache of a core.
const PIECE: usize = 1 << 17;

/// Bricks that one task handles, at most.
pub(super) const TASK: usize = 512;

/// Makes the mesh of the bricks.
pub(super) fn assemble<S: Sampler>(
    sampler: &S,
    grid: &Grid,
    bricks: &Bricks,
    progress: &Progress,
    sink: &mut dyn Sink,
    report: &mut Report,
) -> Result<(), Error> {
    let arch = Arch::new();
    let clocks = Clocks::default();
    let scene = Scene::new(sampler, grid, bricks);
    let pool = Pool::default();
    let make = || Worker::new(sampler);
    let owners = scene.owners.len();
    let task = (owners / 64).clamp(16, TASK);
    let tasks = |items: usize| items.div_ceil(task) as u64;
    progress.expect(tasks(bricks.active.len()) + 2 * tasks(owners));

    let mut signs = vec![OUTSIDE; bricks.active.len()];
    let nans = signs
        .par_chunks_mut(task)
        .enumerate()
        .map(|(t, chunk)| {
            let nans =
                pool.lend(make, |worker| sample(&scene, worker, t * task, chunk, &clocks))?;
            progress.advance(1)?;
            Ok(nans)
        })
        .sum::<Result<u64, Error>>()?;
    let scene = Scene { signs, ..scene };

    let mut numbers = vec![BrickNumbers::default(); owners];
    let triangles = numbers
        .par_chunks_mut(task)
        .enumerate()
        .map(|(t, chunk)| {
            let triangles =
                pool.lend(make, |worker| tally(&scene, arch, worker, t * task, chunk, &clocks));
            progress.advance(1)?;
            Ok(triangles)
        })
        .collect::<Result<Vec<u64>, Error>>()?;
    let mut vertices = 0;
    for brick in &mut numbers {
        let owned = u64::from(brick.first);
        brick.first = vertices as u32;
        vertices += owned;
    }
    if vertices > u64::from(u32::MAX) {
        return Err(Error::TooManyVertices { vertices });
    }
    let scene = Scene { numbers, ..scene };
    let mut total = 0;
    let firsts: Vec<u64> = triangles
        .iter()
        .map(|n| {
            total += n;
            total - n
        })
        .collect();

    sink.begin(vertices, total)?;
    let sink = &*sink;
    firsts.par_iter().enumerate().try_for_each(|(t, &first)| {
        let range = t * task..owners.min((t + 1) * task);
        pool.lend(make, |worker| write(&scene, arch, worker, range, first, sink, &clocks))?;
        progress.advance(1)?;
        Ok::<(), Error>(())
    })?;

    report.vertices = vertices;
    report.triangles = total;
    report.nans = nans;
    report.samples = bricks.active.len() as u64 * (BRICK * BRICK * BRICK) as u64;
    clocks.report(&mut report.stages);
    Ok(())
}

/// What every task reads.
pub(super) struct Scene<'a, S> {
    pub(super) sampler: &'a S,
    pub(super) grid: &'a Grid,
    pub(super) bricks: &'a Bricks,
    pub(super) extent: f64,
    pub(super) spans: [Vec<Span>; 3],
    /// Bricks that may own a vertex.
    pub(super) owners: RankedBits,
    /// Signs of the active bricks, in order.
    pub(super) signs: Vec<BrickSigns>,
    /// Numbers of the owners, in order.
    pub(super) numbers: Vec<BrickNumbers>,
}

impl<'a, S: Sampler> Scene<'a, S> {
    pub(super) fn new(sampler: &'a S, grid: &'a Grid, bricks: &'a Bricks) -> Self {
        let spans = [0, 1, 2].map(|a| Span::all(grid.cells()[a], bricks.counts[a]));
        let mut words = bricks.active.words().to_vec();
        for (w, (word, inside)) in words.iter_mut().zip(&bricks.inside).enumerate() {
            let mut rest = *inside;
            while rest != 0 {
                let bit = rest.trailing_zeros() as usize;
                let position = bricks.position(64 * w + bit);
                let plain = (0..3).all(|a| spans[a][position[a] as usize].is_plain());
                *word |= u64::from(!plain) << bit;
                rest &= rest - 1;
            }
        }
        Self {
            sampler,
            grid,
            bricks,
            extent: grid.extent(),
            spans,
            owners: RankedBits::new(words),
            signs: Vec::new(),
            numbers: Vec::new(),
        }
    }
}

impl<S> Scene<'_, S> {
    pub(super) fn spans(&self, brick: [u32; 3]) -> Spans {
        Spans([0, 1, 2].map(|a| self.spans[a][brick[a] as usize]))
    }

    /// The spans of the next brick along y; those of the last brick follow themselves.
    fn spans_beyond(&self, [x, y, z]: [u32; 3]) -> Spans {
        self.spans([x, (y + 1).min(self.bricks.counts[1] - 1), z])
    }

    /// Number of the brick `offset` bricks further; none beyond the grid.
    fn neighbour(&self, brick: [u32; 3], offset: [i64; 3]) -> Option<usize> {
        let mut at = [0; 3];
        for a in 0..3 {
            let moved = i64::from(brick[a]) + offset[a];
            if moved < 0 || moved >= i64::from(self.bricks.counts[a]) {
                return None;
            }
            at[a] = moved as usize;
        }
        let [nx, ny, _] = self.bricks.counts.map(|n| n as usize);
        Some(at[0] + nx * (at[1] + ny * at[2]))
    }

    /// Signs of a brick, which `made` may hold.
    fn signs_of<'s>(&'s self, number: Option<usize>, made: &'s mut BrickSigns) -> &'s BrickSigns {
        let Some(number) = number else { return &OUTSIDE };
        if let Some(rank) = self.bricks.active.rank(number) {
            return &self.signs[rank];
        }
        if self.bricks.inside[number / 64] >> (number % 64) & 1 == 0 {
            return &OUTSIDE;
        }
        if !self.owners.contains(number) {
            return &INSIDE;
        }
        *made = INSIDE;
        self.spans(self.bricks.position(number)).clear_ghosts(made);
        made
    }

    /// Signs of a brick and of the seven above it.
    pub(super) fn signs_above<'s>(
        &'s self,
        brick: [u32; 3],
        made: &'s mut Made,
    ) -> [&'s BrickSigns; 8] {
        let mut signs = [&OUTSIDE; 8];
        for (octant, (signs, made)) in signs.iter_mut().zip(made.iter_mut()).enumerate() {
            let offset = [0, 1, 2].map(|a| (octant >> a & 1) as i64);
            *signs = self.signs_of(self.neighbour(brick, offset), made);
        }
        signs
    }

    fn fill(&self, arch: Arch, brick: [u32; 3], made: &mut Made, block: &mut Block) {
        let neighbours: Neighbours<'_> = std::array::from_fn(|octant| {
            let offset = [0, 1, 2].map(|a| (octant >> a & 1) as i64);
            self.neighbour(brick, offset)
                .and_then(|number| self.owners.rank(number))
                .map(|rank| &self.numbers[rank])
        });
        let (spans, beyond) = (self.spans(brick), self.spans_beyond(brick));
        let signs = self.signs_above(brick, made);
        arch.dispatch(Filling {
            block,
            signs,
            neighbours: &neighbours,
            spans: &spans,
            beyond: &beyond,
        });
    }

    /// Whether a node of the padded grid is inside; nothing else is.
    fn is_inside(&self, node: [i64; 3]) -> bool {
        let (mut brick, mut local) = ([0; 3], [0; 3]);
        for a in 0..3 {
            let Ok(position) = usize::try_from(node[a]) else { return false };
            (brick[a], local[a]) = ((position / BRICK) as u32, position % BRICK);
            let span = self.spans[a].get(position / BRICK);
            if span.is_none_or(|span| span.real >> local[a] & 1 == 0) {
                return false;
            }
        }
        let [x, y, z] = brick.map(|b| b as usize);
        let [nx, ny, _] = self.bricks.counts.map(|n| n as usize);
        let number = x + nx * (y + ny * z);
        match self.bricks.active.rank(number) {
            Some(rank) => self.signs[rank][local[2] * BRICK + local[1]] >> local[0] & 1 == 1,
            None => self.bricks.inside[number / 64] >> (number % 64) & 1 == 1,
        }
    }

    /// Whether a node, given by its place from the least node of `brick` on, has more than one
    /// crossed edge. Edges to ghosts count, because ghosts are outside.
    pub(super) fn is_crowded(&self, brick: [u32; 3], place: [usize; 3]) -> bool {
        self.is_crowded_along(brick, place, &Axis::ALL)
    }

    /// As [`is_crowded`](Self::is_crowded), of edges along some axes only.
    #[inline]
    pub(super) fn is_crowded_along(
        &self,
        brick: [u32; 3],
        place: [usize; 3],
        axes: &[Axis],
    ) -> bool {
        let node = [0, 1, 2].map(|a| (brick[a] as usize * BRICK + place[a]) as i64);
        let here = self.is_inside(node);
        let sides = axes.iter().flat_map(|axis| [(axis.index(), 1), (axis.index(), -1)]);
        let crossed = sides.filter(|&(axis, step)| {
            let mut other = node;
            other[axis] += step;
            self.is_inside(other) != here
        });
        crossed.take(2).count() == 2
    }
}

/// Room for signs of bricks that were not sampled.
pub(super) type Made = [BrickSigns; 8];

/// Scratch memory of a task.
pub(super) struct Worker<W> {
    pub(super) workspace: W,
    pub(super) activity: Vec<u64>,
    pub(super) values: Box<[f64; BRICK * BRICK * BRICK]>,
    pub(super) made: Box<Made>,
    pub(super) block: Box<Block>,
    pub(super) next: Box<Block>,
    pub(super) placer: Placer,
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl<W> Worker<W> {
    pub(super) fn new<S: Sampler<Workspace = W>>(sampler: &S) -> Self {
        Self {
            workspace: sampler.workspace(),
            activity: vec![0; sampler.activity_words()],
            values: Box::new([0.0; BRICK * BRICK * BRICK]),
            made: Box::new([OUTSIDE; 8]),
            block: Box::default(),
            next: Box::default(),
            placer: Placer::default(),
            positions: Vec::new(),
            triangles: Vec::new(),
        }
    }
}

impl<W> AsMut<Self> for Worker<W> {
    fn as_mut(&mut self) -> &mut Self {
        self
    }
}

/// Samples the active bricks from rank `first` on; returns how many samples were NaN.
pub(super) fn sample<S: Sampler>(
    scene: &Scene<'_, S>,
    worker: &mut Worker<S::Workspace>,
    first: usize,
    signs: &mut [BrickSigns],
    clocks: &Clocks,
) -> Result<u64, Error> {
    let bricks = scene.bricks;
    let start = Instant::now();
    let mut nans = 0;
    for (k, (number, signs)) in bricks.active.iter_from(first).zip(signs).enumerate() {
        let rank = first + k;
        let brick = bricks.position(number);
        let spans = scene.spans(brick);
        let Worker { workspace, activity, values, .. } = worker;
        bricks.activities.expand(bricks.activity(rank), activity);
        if bricks.may_be_nan(rank) {
            scene.sampler.values(workspace, brick, activity, values)?;
            for (word, row) in signs.iter_mut().zip(values.chunks(BRICK)) {
                *word = row.iter().enumerate().fold(0, |w, (x, v)| w | u16::from(*v < 0.0) << x);
            }
            let mut real = INSIDE;
            spans.clear_ghosts(&mut real);
            for (word, row) in real.iter().zip(values.chunks(BRICK)) {
                let count =
                    |(x, v): (usize, &f64)| u64::from(v.is_nan()) & u64::from(word >> x & 1);
                nans += row.iter().enumerate().map(count).sum::<u64>();
            }
        } else {
            scene.sampler.signs(workspace, brick, activity, signs)?;
        }
        if !spans.is_plain() {
            spans.clear_ghosts(signs);
        }
    }
    clocks.add(Stage::Sample, start);
    Ok(nans)
}

/// Counts the vertices (in `first` of `numbers`) and triangles of the owners from rank `first` on;
/// returns the number of triangles.
fn tally<S: Sampler>(
    scene: &Scene<'_, S>,
    arch: Arch,
    worker: &mut Worker<S::Workspace>,
    first: usize,
    numbers: &mut [BrickNumbers],
    clocks: &Clocks,
) -> u64 {
    let start = Instant::now();
    let tables: &Tables = &TABLES;
    let mut triangles = 0;
    for (number, numbers) in scene.owners.iter_from(first).zip(numbers) {
        let brick = scene.bricks.position(number);
        let spans = scene.spans(brick);
        let signs = scene.signs_above(brick, &mut worker.made);
        let counted = arch.dispatch(Counting { signs, spans: &spans, tables });
        let (relative, Count { vertices, triangles: here }) = counted;
        *numbers = BrickNumbers { first: vertices, ..relative };
        triangles += u64::from(here);
    }
    clocks.add(Stage::Count, start);
    triangles
}

/// Places and writes the vertices and triangles of the owners in `ranks`.
fn write<S: Sampler>(
    scene: &Scene<'_, S>,
    arch: Arch,
    worker: &mut Worker<S::Workspace>,
    ranks: std::ops::Range<usize>,
    mut first_triangle: u64,
    sink: &dyn Sink,
    clocks: &Clocks,
) -> Result<(), Error> {
    let bricks = scene.bricks;
    let Some(mut first_vertex) = scene.numbers.get(ranks.start).map(|n| u64::from(n.first)) else {
        return Ok(());
    };
    let Worker { workspace, activity, made, block, next, placer, positions, triangles, .. } =
        worker;
    positions.clear();
    let room = PIECE / size_of::<[u32; 3]>() + faces::MOST;
    triangles.resize(room, [0; 3]);
    let mut made_triangles = 0;
    let mut filled = None;
    let mut lap = Lap::new(clocks);
    for (number, _) in scene.owners.iter_from(ranks.start).zip(ranks.clone()) {
        let brick = bricks.position(number);
        let spans = scene.spans(brick);
        if filled == Some(number) {
            std::mem::swap(block, next);
        } else {
            scene.fill(arch, brick, made, block);
        }
        let beside = scene.neighbour(brick, [1, 0, 0]).filter(|&n| scene.owners.contains(n));
        if let Some(beside) = beside {
            scene.fill(arch, bricks.position(beside), made, next);
        }
        filled = beside;
        lap.ends(Stage::Number);

        let lines = BrickLines::new(scene.grid, brick, scene.extent);
        if let Some(rank) = bricks.active.rank(number) {
            bricks.activities.expand(bricks.activity(rank), activity);
            placer.crossings(
                arch,
                scene.sampler,
                workspace,
                brick,
                activity,
                block,
                &spans,
                &lines,
                positions,
            )?;
            placer.keep_off(&lines, |place| scene.is_crowded(brick, place), positions);
        }
        if !spans.is_plain() {
            planes(block, &spans, &lines, positions);
        }
        lap.ends(Stage::Place);

        let out = &mut triangles[made_triangles..];
        made_triangles += arch.dispatch(Facing { block, next, spans: &spans, out });
        lap.ends(Stage::Faces);

        if positions.len() * size_of::<[f64; 3]>() >= PIECE {
            sink.vertices(first_vertex, positions)?;
            first_vertex += positions.len() as u64;
            positions.clear();
        }
        if made_triangles + faces::MOST > room {
            sink.triangles(first_triangle, &triangles[..made_triangles])?;
            first_triangle += made_triangles as u64;
            made_triangles = 0;
        }
        lap.ends(Stage::Write);
    }
    if !positions.is_empty() {
        sink.vertices(first_vertex, positions)?;
    }
    if made_triangles > 0 {
        sink.triangles(first_triangle, &triangles[..made_triangles])?;
    }
    lap.ends(Stage::Write);
    lap.close();
    Ok(())
}

/// A stage whose time is measured.
#[derive(Clone, Copy)]
pub(super) enum Stage {
    Sample,
    Count,
    Number,
    Place,
    Faces,
    Write,
}

/// Nanoseconds spent in the stages, summed over threads.
#[derive(Default)]
pub(super) struct Clocks([AtomicU64; 6]);

impl Clocks {
    fn add(&self, stage: Stage, start: Instant) {
        self.0[stage as usize].fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    }

    pub(super) fn report(&self, stages: &mut Stages) {
        let spent =
            |stage: Stage| Duration::from_nanos(self.0[stage as usize].load(Ordering::Relaxed));
        stages.sample = spent(Stage::Sample);
        stages.count = spent(Stage::Count);
        stages.number = spent(Stage::Number);
        stages.place = spent(Stage::Place);
        stages.faces = spent(Stage::Faces);
        stages.write = spent(Stage::Write);
    }
}

/// Time of one task by stage.
pub(super) struct Lap<'a> {
    clocks: &'a Clocks,
    spent: [u64; 6],
    last: Instant,
}

impl<'a> Lap<'a> {
    pub(super) fn new(clocks: &'a Clocks) -> Self {
        Self { clocks, spent: [0; 6], last: Instant::now() }
    }

    pub(super) fn ends(&mut self, stage: Stage) {
        let now = Instant::now();
        self.spent[stage as usize] += (now - self.last).as_nanos() as u64;
        self.last = now;
    }

    pub(super) fn close(self) {
        for (clock, spent) in self.clocks.0.iter().zip(self.spent) {
            clock.fetch_add(spent, Ordering::Relaxed);
        }
    }
}
