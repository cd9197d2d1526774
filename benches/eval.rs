//! What a sample, an enclosure, an edge and a compilation cost, by model and engine.
//!
//! Throughputs are in samples, boxes or edges: their inverse is the time of one.
#![allow(clippy::unwrap_used)]

mod models;

use alveole::eval::{BRICK, Bound, Engine, NodeBox, Program, Sampler};
use alveole::geom::Axis;
use alveole::num::Interval;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput};
use models::{FIELDS, HIERARCHICAL, Model};
use std::time::Duration;

/// Bricks along a side of the grid.
const BRICKS: u32 = 4;
/// The engines with their names in records.
const ENGINES: [(&str, Engine); 2] =
    [("interpreter", Engine::Interpreter), ("compiled", Engine::Compiled)];

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .sample_size(20)
        .configure_from_args();
    signs(&mut criterion);
    edges(&mut criterion);
    ranges(&mut criterion);
    compilation(&mut criterion);
    criterion.final_summary();
}

/// The model's field on the nodes of [-1, 1]^3.
fn bound(model: Model, engine: Engine) -> Bound {
    let last = f64::from(BRICKS) * BRICK as f64;
    let table: Vec<f64> =
        (0..=BRICKS as usize * BRICK).map(|i| 2.0 * i as f64 / last - 1.0).collect();
    model.program(engine).bind([table.clone(), table.clone(), table], &[])
}

fn bricks() -> impl Iterator<Item = [u32; 3]> {
    (0..BRICKS.pow(3)).map(|i| [i % BRICKS, i / BRICKS % BRICKS, i / BRICKS.pow(2)])
}

fn for_each_engine(
    group: &mut BenchmarkGroup<'_, WallTime>,
    mut run: impl FnMut(&mut BenchmarkGroup<'_, WallTime>, BenchmarkId, Model, Engine),
) {
    for model in FIELDS.into_iter().chain([HIERARCHICAL]) {
        for (name, engine) in ENGINES {
            run(group, BenchmarkId::new(model.name, name), model, engine);
        }
    }
}

/// Signs of every brick, with the activity that its enclosure leaves.
fn signs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("signs");
    group.throughput(Throughput::Elements(u64::from(BRICKS.pow(3)) * BRICK.pow(3) as u64));
    for_each_engine(&mut group, |group, id, model, engine| {
        let bound = bound(model, engine);
        let mut workspace = bound.workspace();
        let active: Vec<_> = bricks()
            .map(|index| {
                let mut activity = vec![u64::MAX; bound.activity_words()];
                let own = [NodeBox { level: 0, index }];
                let mut range = [Interval::point(0.0)];
                bound.ranges(&mut workspace, &own, &mut activity, &mut range).unwrap();
                (index, activity)
            })
            .collect();
        let mut signs = [0; BRICK * BRICK];
        group.bench_function(id, |bencher| {
            bencher.iter(|| {
                for (brick, activity) in &active {
                    bound.signs(&mut workspace, *brick, activity, &mut signs).unwrap();
                }
            });
        });
    });
}

/// Full batches of edges along x: set up, one end, four values with slopes.
fn edges(criterion: &mut Criterion) {
    const EDGES: usize = 256;
    let mut group = criterion.benchmark_group("edges");
    group.throughput(Throughput::Elements(EDGES as u64));
    let nodes: Vec<u16> = (0..EDGES).map(|i| (i * 2503 % BRICK.pow(3)) as u16).collect();
    for_each_engine(&mut group, |group, id, model, engine| {
        let bound = bound(model, engine);
        let mut workspace = bound.workspace();
        let activity = vec![u64::MAX; bound.activity_words()];
        let at: Vec<f64> = (0..EDGES).map(|i| -0.2 + 1e-3 * i as f64).collect();
        let (mut values, mut slopes) = ([0.0; EDGES], [0.0; EDGES]);
        group.bench_function(id, |bencher| {
            bencher.iter(|| {
                let workspace = &mut workspace;
                bound.line_begin(workspace, Axis::X, [1, 1, 2], &nodes, &activity).unwrap();
                let lower = alveole::eval::End::Lower;
                bound.line_ends(workspace, lower, &mut values, &mut slopes).unwrap();
                for _ in 0..4 {
                    bound.line(workspace, &at, &mut values, &mut slopes).unwrap();
                }
            });
        });
    });
}

/// Enclosures of the bricks, eight at a time as the octree asks for them.
fn ranges(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("ranges");
    group.throughput(Throughput::Elements(u64::from(BRICKS.pow(3))));
    for_each_engine(&mut group, |group, id, model, engine| {
        let bound = bound(model, engine);
        let mut workspace = bound.workspace();
        let eighths = |parent: [u32; 3]| {
            let octants = (0..8u32).map(|o| [o & 1, o >> 1 & 1, o >> 2]);
            octants
                .map(move |o| NodeBox { level: 0, index: [0, 1, 2].map(|a| 2 * parent[a] + o[a]) })
        };
        let parents = bricks().filter(|index| index.iter().all(|&i| i < BRICKS / 2));
        let boxes: Vec<NodeBox> = parents.flat_map(eighths).collect();
        let mut activity = vec![u64::MAX; 8 * bound.activity_words()];
        let mut ranges = [Interval::point(0.0); 8];
        group.bench_function(id, |bencher| {
            bencher.iter(|| {
                for octet in boxes.chunks(8) {
                    activity.fill(u64::MAX);
                    bound.ranges(&mut workspace, octet, &mut activity, &mut ranges).unwrap();
                }
            });
        });
    });
}

/// From an expression to a program.
fn compilation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("compilation");
    for_each_engine(&mut group, |group, id, model, engine| {
        let job = model.job();
        let (graph, field) = job.field();
        group.bench_function(id, |bencher| {
            bencher.iter(|| Program::new(graph, field, engine).unwrap());
        });
    });
}
