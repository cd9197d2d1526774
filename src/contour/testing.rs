//! Samplers and checks for tests.

use super::{Grid, Report, Settings, contour};
use crate::eval::sampler::{Failure, place_of};
use crate::eval::{BRICK, BrickSigns, End, NodeBox, Sampler};
use crate::geom::{Aabb, Axis};
use crate::mesh::Mesh;
use crate::mesh::sink::Collect;
use crate::num::{Interval, Progress};
use crate::octree::Pruning;
use glam::DVec3;
use std::collections::HashMap;

/// A small deterministic generator.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// A field given by a function, and its enclosures by another.
pub struct Sampled<F, R> {
    tables: [Vec<f64>; 3],
    field: F,
    range: R,
}

/// A box of coordinates, by axis.
pub type Span = [[f64; 2]; 3];

/// Encloses nothing in particular.
pub fn unknown(_: Span) -> Interval {
    Interval::new(f64::NEG_INFINITY, f64::INFINITY)
}

impl<F, R> Sampled<F, R>
where
    F: Fn([f64; 3]) -> f64 + Sync,
    R: Fn(Span) -> Interval + Sync,
{
    pub fn new(grid: &Grid, field: F, range: R) -> Self {
        Self { tables: grid.tables(), field, range }
    }

    fn at(&self, node: [usize; 3]) -> [f64; 3] {
        [0, 1, 2].map(|a| self.tables[a][node[a]])
    }
}

/// The edges of a batch by their lower nodes, and their axis.
type Batch = (Axis, Vec<[usize; 3]>);

impl<F, R> Sampler for Sampled<F, R>
where
    F: Fn([f64; 3]) -> f64 + Sync,
    R: Fn(Span) -> Interval + Sync,
{
    type Workspace = Batch;

    fn workspace(&self) -> Batch {
        (Axis::X, Vec::new())
    }

    fn nodes(&self) -> [usize; 3] {
        self.tables.each_ref().map(Vec::len)
    }

    fn activity_words(&self) -> usize {
        1
    }

    fn ranges(
        &self,
        _: &mut Batch,
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure> {
        for ((node, activity), range) in boxes.iter().zip(activity).zip(ranges) {
            let span = [0, 1, 2].map(|a| {
                let end = |i: u32| {
                    self.tables[a][((i as usize) << node.level)
                        .saturating_mul(BRICK)
                        .min(self.tables[a].len() - 1)]
                };
                [end(node.index[a]), end(node.index[a] + 1)]
            });
            *range = (self.range)(span);
            // Something to inherit: which boxes of which level lie above.
            *activity &= !(1 << node.level);
        }
        Ok(())
    }

    fn signs(
        &self,
        workspace: &mut Batch,
        brick: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let mut values = [0.0; BRICK * BRICK * BRICK];
        self.values(workspace, brick, activity, &mut values)?;
        for (word, row) in signs.iter_mut().zip(values.chunks(BRICK)) {
            *word = (0..BRICK).filter(|&x| row[x] < 0.0).fold(0, |w, x| w | 1 << x);
        }
        Ok(())
    }

    fn values(
        &self,
        _: &mut Batch,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        assert!(activity[0] & 1 == 0 || activity[0] == u64::MAX);
        for (n, value) in values.iter_mut().enumerate() {
            let local = [n % BRICK, n / BRICK % BRICK, n / BRICK / BRICK];
            let node = [0, 1, 2].map(|a| local[a] + BRICK * brick[a] as usize);
            *value = (self.field)(self.at(node));
        }
        Ok(())
    }

    fn line_begin(
        &self,
        workspace: &mut Batch,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        _: &[u64],
    ) -> Result<(), Failure> {
        assert!(nodes.len() <= 256);
        let node = |n: u16| [0, 1, 2].map(|a| place_of(n)[a] + BRICK * brick[a] as usize);
        *workspace = (axis, nodes.iter().map(|&n| node(n)).collect());
        Ok(())
    }

    fn line_ends(
        &self,
        batch: &mut Batch,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        let a = batch.0.index();
        let ahead = usize::from(end == End::Upper);
        let at: Vec<f64> = batch.1.iter().map(|node| self.tables[a][node[a] + ahead]).collect();
        self.line(batch, &at, values, slopes)
    }

    fn line(
        &self,
        (axis, nodes): &mut Batch,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        assert_eq!((nodes.len(), nodes.len(), nodes.len()), (at.len(), values.len(), slopes.len()));
        let a = axis.index();
        for (lane, node) in nodes.iter().enumerate() {
            let value = |u: f64| {
                let mut point = self.at(*node);
                point[a] = u;
                (self.field)(point)
            };
            let [lower, upper] = [0, 1].map(|d| self.tables[a][node[a] + d]);
            let reach = 1e-6 * (upper - lower);
            let here = value(at[lane]);
            let slope = |u: f64| (value(u) - here) / (u - at[lane]);
            let below = slope((at[lane] - reach).max(lower));
            let above = slope((at[lane] + reach).min(upper));
            values[lane] = here;
            // At a node one of them is NaN; at an edge of a plateau it is flat.
            let flatter = below.abs() < above.abs() || above.is_nan();
            slopes[lane] = if flatter { below } else { above };
        }
        Ok(())
    }
}

/// A field with chosen values at the nodes of the grid, x fastest, linear along edges.
pub fn at_nodes(grid: &Grid, values: Vec<f64>) -> impl Fn([f64; 3]) -> f64 + Sync {
    let nodes = grid.cells().map(|n| n + 1);
    let tables = Axis::ALL.map(|axis| grid.sampled(axis)[1..=nodes[axis.index()]].to_vec());
    move |point| {
        let mut low = [0; 3];
        let mut along = None;
        for a in 0..3 {
            // Ghosts have the value of the node beside them.
            let i = tables[a].partition_point(|&u| u <= point[a]).saturating_sub(1);
            if i + 1 == tables[a].len() {
                low[a] = i;
                continue;
            }
            low[a] = i;
            if point[a] > tables[a][i] {
                along = Some((a, (point[a] - tables[a][i]) / (tables[a][i + 1] - tables[a][i])));
            }
        }
        let value = |n: [usize; 3]| values[n[0] + nodes[0] * (n[1] + nodes[1] * n[2])];
        let Some((a, t)) = along else { return value(low) };
        let mut high = low;
        high[a] += 1;
        let (f, g) = (value(low), value(high));
        // A crossing lies where the magnitudes say, also where they are infinite.
        let bounded = |v: f64| if v.is_nan() { 1.0 } else { v.clamp(-1.0, 1.0) };
        bounded(f) + (bounded(g) - bounded(f)) * t
    }
}

/// The mesh of a sampler, and the report.
pub fn mesh_of<S: Sampler>(sampler: &S, grid: &Grid, pruning: Pruning) -> (Mesh, Report) {
    let mut sink = Collect::default();
    let settings = Settings { pruning, ..Settings::default() };
    let report = contour(sampler, grid, &settings, &Progress::new(), &mut sink).unwrap();
    (sink.into_mesh(), report)
}

/// A cubic grid.
pub fn cube(lo: f64, hi: f64, spacing: f64) -> Grid {
    Grid::new(Aabb::new(DVec3::splat(lo), DVec3::splat(hi)), DVec3::splat(spacing)).unwrap()
}

/// What a mesh measures.
#[derive(Debug)]
pub struct Measures {
    pub volume: f64,
    pub area: f64,
    pub smallest: f64,
    pub euler: i64,
}

/// Asserts that a mesh is closed, oriented, edge- and vertex-manifold, without unused vertices or
/// doubled triangles, and measures it.
pub fn check(mesh: &Mesh) -> Measures {
    let mut edges = HashMap::new();
    for (t, [a, b, c]) in mesh.triangles.iter().copied().enumerate() {
        assert!(a != b && b != c && c != a, "triangle {t} repeats a vertex");
        for (from, to, across) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert!(edges.insert((from, to), across).is_none(), "edge {from} {to} is used twice");
        }
    }
    let mut corners = vec![0; mesh.positions.len()];
    let mut start = vec![None; mesh.positions.len()];
    for &(from, to) in edges.keys() {
        assert!(edges.contains_key(&(to, from)), "edge {from} {to} is open");
        corners[from as usize] += 1;
        start[from as usize] = Some(to);
    }
    for (v, start) in start.iter().enumerate() {
        let Some(start) = *start else { panic!("vertex {v} is unused") };
        let (mut at, mut ring) = (start, 0);
        loop {
            at = edges[&(v as u32, at)];
            ring += 1;
            if at == start {
                break;
            }
        }
        assert_eq!(ring, corners[v], "vertex {v} has several fans");
    }
    let mut sorted: Vec<[u32; 3]> = mesh.triangles.clone();
    sorted.iter_mut().for_each(|t| t.sort_unstable());
    sorted.sort_unstable();
    assert!(sorted.windows(2).all(|w| w[0] != w[1]), "a triangle is doubled");

    // Summed with the rounding errors carried along, so that the sum is as good as its terms.
    let mut carried = 0.0;
    let mut measures = Measures { volume: 0.0, area: 0.0, smallest: f64::INFINITY, euler: 0 };
    for triangle in &mesh.triangles {
        let [p, q, r] = triangle.map(|v| DVec3::from_array(mesh.positions[v as usize]));
        let area = 0.5 * (q - p).cross(r - p).length();
        measures.area += area;
        measures.smallest = measures.smallest.min(area);
        let term = p.dot(q.cross(r)) / 6.0 + carried;
        let sum = measures.volume + term;
        carried = term - (sum - measures.volume);
        measures.volume = sum;
    }
    let count = |n: usize| n as i64;
    measures.euler =
        count(mesh.positions.len()) - count(edges.len() / 2) + count(mesh.triangles.len());
    measures
}

/// Smallest area once positions are rounded to single precision.
pub fn smallest_in_single(mesh: &Mesh) -> f64 {
    let area = |triangle: &[u32; 3]| {
        let [p, q, r] = triangle
            .map(|v| DVec3::from_array(mesh.positions[v as usize].map(|u| f64::from(u as f32))));
        0.5 * (q - p).cross(r - p).length()
    };
    mesh.triangles.iter().map(area).fold(f64::INFINITY, f64::min)
}
