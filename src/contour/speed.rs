//! Stages of contouring, timed on a gyroid cut by a box whose sampler costs next to nothing.
//!
//! `cargo test --release --lib contour::speed -- --ignored --nocapture` prints them; the variables
//! `ALVEOLE_CELLS` and `ALVEOLE_THREADS` change the grid and the threads.
#![allow(clippy::print_stdout, reason = "the stages are what the test is for")]

use super::testing::cube;
use super::*;
use crate::eval::{BRICK, BrickSigns, End, NodeBox};
use crate::num::Interval;
use pulp::{Arch, NullaryFnOnce};
use std::f64::consts::TAU;

/// Sine and cosine of `turns` turns, branch-free; polynomials of fdlibm on an eighth of a turn.
#[inline(always)]
fn wave(turns: f64) -> (f64, f64) {
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    let quarters = turns * 4.0 + MAGIC;
    let q = quarters.to_bits();
    let x = ((quarters - MAGIC) * -0.25 + turns) * TAU;
    let z = x * x;
    let s = z * 1.589_623_015_765_465_7e-10 - 2.505_074_776_285_780_7e-8;
    let s = z * s + 2.755_731_362_138_572_5e-6;
    let s = z * s - 1.984_126_982_958_954e-4;
    let s = z * s + 8.333_333_333_322_118e-3;
    let s = z * s - 1.666_666_666_666_663e-1;
    let s = x * z * s + x;
    let c = z * -1.135_853_652_138_768_2e-11 + 2.087_570_084_197_473e-9;
    let c = z * c - 2.755_731_417_929_674e-7;
    let c = z * c + 2.480_158_728_885_170_5e-5;
    let c = z * c - 1.388_888_888_887_305_6e-3;
    let c = z * c + 4.166_666_666_666_659e-2;
    let c = z * z * c + (z * -0.5 + 1.0);
    let swap = 0u64.wrapping_sub(q & 1);
    let (sb, cb) = (s.to_bits(), c.to_bits());
    let a = (sb & !swap | cb & swap) ^ (q & 2) << 62;
    let b = (cb & !swap | sb & swap) ^ (q.wrapping_add(1) & 2) << 62;
    (f64::from_bits(a), f64::from_bits(b))
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if b < a { a } else { b }
}

/// Everything that depends on one coordinate.
struct Table {
    u: Vec<f64>,
    sin: Vec<f64>,
    cos: Vec<f64>,
    wall: Vec<f64>,
}

struct Hoisted {
    tables: [Table; 3],
    arch: Arch,
}

/// Coefficients of `p sin + q cos + r` and the walls across, by edge.
struct Lines {
    axis: usize,
    nodes: Vec<[usize; 3]>,
    p: Vec<f64>,
    q: Vec<f64>,
    r: Vec<f64>,
    wall: Vec<f64>,
}

impl Hoisted {
    fn new(grid: &Grid) -> Self {
        let table = |axis: Axis| {
            let u = grid.sampled(axis).to_vec();
            let (sin, cos) = u.iter().map(|u| wave(*u)).unzip();
            Table { sin, cos, wall: u.iter().map(|u| u.abs() - 1.0).collect(), u }
        };
        Self { tables: Axis::ALL.map(table), arch: Arch::new() }
    }

    #[inline(always)]
    fn row(&self, x: usize, y: usize, z: usize) -> [f64; BRICK] {
        let [tx, ty, tz] = &self.tables;
        let (cy, r, b) = (ty.cos[y], ty.sin[y] * tz.cos[z], greater(ty.wall[y], tz.wall[z]));
        let sz = tz.sin[z];
        let (s, c, w) = (&tx.sin[x..x + BRICK], &tx.cos[x..x + BRICK], &tx.wall[x..x + BRICK]);
        let mut row = [0.0; BRICK];
        for i in 0..BRICK {
            row[i] = greater(s[i] * cy + (c[i] * sz + r), greater(w[i], b));
        }
        row
    }
}

impl Sampler for Hoisted {
    type Workspace = Lines;

    fn workspace(&self) -> Lines {
        let empty = Vec::new;
        Lines { axis: 0, nodes: Vec::new(), p: empty(), q: empty(), r: empty(), wall: empty() }
    }

    fn nodes(&self) -> [usize; 3] {
        self.tables.each_ref().map(|table| table.u.len())
    }

    fn activity_words(&self) -> usize {
        1
    }

    fn ranges(
        &self,
        _: &mut Lines,
        boxes: &[NodeBox],
        _: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure> {
        for (node, range) in boxes.iter().zip(ranges) {
            let span = |a: usize, values: &[f64]| {
                let from = (node.index[a] as usize * BRICK) << node.level;
                let to = (from + (BRICK << node.level)).min(values.len() - 1);
                values[from..=to]
                    .iter()
                    .fold([f64::INFINITY, -f64::INFINITY], |[l, h], v| [l.min(*v), h.max(*v)])
            };
            let times = |a: [f64; 2], b: [f64; 2]| {
                let p = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
                [p[0].min(p[1]).min(p[2].min(p[3])), p[0].max(p[1]).max(p[2].max(p[3]))]
            };
            let s = [0, 1, 2].map(|a| span(a, &self.tables[a].sin));
            let c = [0, 1, 2].map(|a| span(a, &self.tables[a].cos));
            let w = [0, 1, 2].map(|a| span(a, &self.tables[a].wall));
            let terms = [times(s[0], c[1]), times(c[0], s[2]), times(s[1], c[2])];
            let end = |e: usize| {
                let sum = terms[0][e] + (terms[1][e] + terms[2][e]);
                greater(sum, greater(w[0][e], greater(w[1][e], w[2][e])))
            };
            *range = Interval::new(end(0), end(1));
        }
        Ok(())
    }

    fn signs(
        &self,
        _: &mut Lines,
        brick: [u32; 3],
        _: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let [x, y, z] = brick.map(|b| b as usize * BRICK);
        self.arch.dispatch(Signs { field: self, from: [x, y, z], signs });
        Ok(())
    }

    fn values(
        &self,
        _: &mut Lines,
        brick: [u32; 3],
        _: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let [x, y, z] = brick.map(|b| b as usize * BRICK);
        for (n, row) in values.chunks_mut(BRICK).enumerate() {
            row.copy_from_slice(&self.row(x, y + n % BRICK, z + n / BRICK));
        }
        Ok(())
    }

    fn line_begin(
        &self,
        lines: &mut Lines,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        _: &[u64],
    ) -> Result<(), Failure> {
        lines.axis = axis.index();
        let from = brick.map(|b| b as usize * BRICK);
        let n = nodes.len();
        lines.nodes.resize(n, [0; 3]);
        for v in [&mut lines.p, &mut lines.q, &mut lines.r, &mut lines.wall] {
            v.resize(n, 0.0);
        }
        let [tx, ty, tz] = &self.tables;
        for (m, node) in nodes.iter().enumerate() {
            let node = usize::from(*node);
            let [x, y, z] = [from[0] + node % 16, from[1] + node / 16 % 16, from[2] + node / 256];
            lines.nodes[m] = [x, y, z];
            let (p, q, r, wall) = match axis {
                Axis::X => {
                    (ty.cos[y], tz.sin[z], ty.sin[y] * tz.cos[z], greater(ty.wall[y], tz.wall[z]))
                }
                Axis::Y => {
                    (tz.cos[z], tx.sin[x], tx.cos[x] * tz.sin[z], greater(tx.wall[x], tz.wall[z]))
                }
                Axis::Z => {
                    (tx.cos[x], ty.sin[y], tx.sin[x] * ty.cos[y], greater(tx.wall[x], ty.wall[y]))
                }
            };
            (lines.p[m], lines.q[m], lines.r[m], lines.wall[m]) = (p, q, r, wall);
        }
        Ok(())
    }

    fn line_ends(&self, lines: &mut Lines, end: End, values: &mut [f64]) -> Result<(), Failure> {
        let table = &self.tables[lines.axis];
        for (m, value) in values.iter_mut().enumerate() {
            let i = lines.nodes[m][lines.axis] + usize::from(end == End::Upper);
            let sum = lines.p[m] * table.sin[i] + (lines.q[m] * table.cos[i] + lines.r[m]);
            *value = greater(sum, greater(table.wall[i], lines.wall[m]));
        }
        Ok(())
    }

    fn line(
        &self,
        lines: &mut Lines,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        self.arch.dispatch(Values { lines, at, values, slopes });
        Ok(())
    }
}

struct Signs<'a> {
    field: &'a Hoisted,
    from: [usize; 3],
    signs: &'a mut BrickSigns,
}

impl NullaryFnOnce for Signs<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let [x, y, z] = self.from;
        for (n, word) in self.signs.iter_mut().enumerate() {
            let row = self.field.row(x, y + n % BRICK, z + n / BRICK);
            // Sixteen bytes of zero or one, gathered to bits by multiplications.
            let mut bytes = [0u8; BRICK];
            for i in 0..BRICK {
                bytes[i] = u8::from(row[i] < 0.0);
            }
            let whole = u128::from_le_bytes(bytes);
            const GATHER: u64 = 0x0102_0408_1020_4080;
            let low = (whole as u64).wrapping_mul(GATHER) >> 56;
            let high = ((whole >> 64) as u64).wrapping_mul(GATHER) >> 56;
            *word = (low | high << 8) as u16;
        }
    }
}

struct Values<'a> {
    lines: &'a Lines,
    at: &'a [f64],
    values: &'a mut [f64],
    slopes: &'a mut [f64],
}

impl NullaryFnOnce for Values<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { lines, at, values, slopes } = self;
        let n = at.len();
        let (p, q, r, w) = (&lines.p[..n], &lines.q[..n], &lines.r[..n], &lines.wall[..n]);
        let (values, slopes) = (&mut values[..n], &mut slopes[..n]);
        for m in 0..n {
            let (s, c) = wave(at[m]);
            let sum = p[m] * s + (q[m] * c + r[m]);
            let steep = (p[m] * c - q[m] * s) * TAU;
            let wall = at[m].abs() - 1.0;
            let (v, d) = if sum < wall { (wall, 1f64.copysign(at[m])) } else { (sum, steep) };
            values[m] = if v < w[m] { w[m] } else { v };
            slopes[m] = if v < w[m] { 0.0 } else { d };
        }
    }
}

/// Takes everything and keeps nothing.
struct Nowhere;

impl Sink for Nowhere {
    fn begin(&mut self, _: u64, _: u64) -> std::io::Result<()> {
        Ok(())
    }
    fn vertices(&self, _: u64, positions: &[[f64; 3]]) -> std::io::Result<()> {
        std::hint::black_box(positions);
        Ok(())
    }
    fn triangles(&self, _: u64, corners: &[[u32; 3]]) -> std::io::Result<()> {
        std::hint::black_box(corners);
        Ok(())
    }
}

fn peak_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

#[test]
#[ignore = "a measurement"]
fn stages_of_the_gyroid_box() {
    let number =
        |name: &str, or: usize| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(or);
    let cells = number("ALVEOLE_CELLS", 400);
    let grid = cube(-1.0, 1.0, 2.0 / cells as f64);
    let sampler = Hoisted::new(&grid);
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(number("ALVEOLE_THREADS", 1)).build().unwrap();
    // The least of each stage: other work on the host only ever adds to it.
    let mut best: Option<Report> = None;
    for _ in 0..number("ALVEOLE_RUNS", 5) {
        let run = || {
            let settings = Settings::default();
            contour(&sampler, &grid, &settings, &Progress::new(), &mut Nowhere).unwrap()
        };
        let mut report = pool.install(run);
        if let Some(best) = &best {
            let (new, old) = (&mut report.stages, &best.stages);
            new.subdivide = new.subdivide.min(old.subdivide);
            new.sample = new.sample.min(old.sample);
            new.count = new.count.min(old.count);
            new.number = new.number.min(old.number);
            new.place = new.place.min(old.place);
            new.faces = new.faces.min(old.faces);
            new.write = new.write.min(old.write);
            new.total = new.total.min(old.total);
        }
        best = Some(report);
    }
    let report = best.unwrap();
    let Stages { subdivide, sample, count, number, place, faces, write, total } = report.stages;
    let per = |d: Duration, n: u64| d.as_nanos() as f64 / n as f64;
    println!(
        "{cells}: {} vertices, {} triangles, {}/{} bricks, {} boxes, {total:?}, {:.1} MiB",
        report.vertices,
        report.triangles,
        report.active_bricks,
        report.bricks,
        report.boxes,
        peak_mib()
    );
    println!("  subdivide {subdivide:?} {:.1} ns/box", per(subdivide, report.boxes));
    println!("  sample {sample:?} {:.2} ns/sample", per(sample, report.samples));
    println!("  count {count:?} {:.0} ns/brick", per(count, report.active_bricks));
    println!("  number {number:?} {:.0} ns/brick", per(number, report.active_bricks));
    println!("  place {place:?} {:.1} ns/vertex", per(place, report.vertices));
    println!("  faces {faces:?} {:.1} ns/triangle", per(faces, report.triangles));
    println!("  write {write:?}");
}
