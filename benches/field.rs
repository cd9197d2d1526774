//! The distance to a mesh of seventy thousand triangles: built, at points, in bricks, over boxes.
//!
//! Throughputs are in triangles, points or boxes. All on one thread.
#![allow(clippy::unwrap_used)]

mod models;

use alveole::expr::{Oracle, Queries};
use alveole::field::mesh_distance;
use alveole::job::Settings;
use alveole::num::Interval;
use criterion::{Criterion, Throughput};
use models::{GYROID_BOX, on_one_thread};
use std::time::Duration;

/// Grid spacing of the mesh: it has 71,548 triangles.
const SPACING: f64 = 2.0 / 52.0;
/// Points, or a brick's samples.
const POINTS: usize = 4096;

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .sample_size(10)
        .configure_from_args();
    let mesh = GYROID_BOX.job().mesh(&Settings::with_spacing(SPACING)).unwrap();
    let distance = mesh_distance(&mesh, "bench").unwrap();
    let mut group = criterion.benchmark_group("mesh-distance");

    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    group.bench_function("build", |bencher| {
        on_one_thread(|| bencher.iter(|| mesh_distance(&mesh, "bench").unwrap()));
    });

    // The additive recurrence of the plastic number fills the cube evenly and in no order.
    let coordinate = |ratio: f64| -> Vec<f64> {
        (1..=POINTS).map(|i| 2.4 * (i as f64 * ratio).fract() - 1.2).collect()
    };
    let at =
        [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3].map(coordinate);
    let mut value = vec![0.0; POINTS];
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("scattered points", |bencher| {
        bencher.iter(|| {
            let at = at.each_ref().map(|list| &list[..]);
            distance.points(Queries { at, value: &mut value, gradient: None }).unwrap();
        });
    });
    let line = |from: f64| -> [f64; 16] { std::array::from_fn(|i| from + i as f64 * 0.02) };
    for (name, place) in [("brick at the surface", 0.1), ("brick outside", 1.1)] {
        let [x, y, z] = [line(place), line(place - 0.3), line(-place)];
        group.bench_function(name, |bencher| {
            bencher.iter(|| distance.brick([&x, &y, &z], &mut value).unwrap());
        });
    }

    let side = |lo: f64| Interval::new(lo, lo + 0.3);
    let boxes: Vec<[Interval; 3]> =
        (0..1000).map(|i| [side(at[0][i]), side(at[1][i]), side(at[2][i])]).collect();
    group.throughput(Throughput::Elements(boxes.len() as u64));
    group.bench_function("boxes", |bencher| {
        bencher.iter(|| boxes.iter().map(|sides| distance.range(*sides).lo).sum::<f64>());
    });
    group.finish();
    criterion.final_summary();
}
