//! From a compiled field to a mesh that nobody keeps, on one thread.
//!
//! Throughputs are in grid nodes.
#![allow(clippy::unwrap_used)]

mod models;

use alveole::contour::{Settings, contour};
use alveole::num::Progress;
use criterion::{BenchmarkId, Criterion, Throughput};
use models::{GYROID_BOX, GYROID_SHELL, HIERARCHICAL, Nowhere, on_one_thread};
use std::time::Duration;

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .sample_size(10)
        .configure_from_args();
    let mut group = criterion.benchmark_group("contour");
    for (model, nodes, side) in [
        (GYROID_BOX, 101, 2.0),
        (GYROID_BOX, 201, 2.0),
        (GYROID_SHELL, 101, 2.0),
        (HIERARCHICAL, 101, 8.0),
    ] {
        let (grid, bound) = model.on_grid(side / f64::from(nodes - 1));
        let size = u64::try_from(nodes).unwrap().pow(3);
        group.throughput(Throughput::Elements(size));
        group.bench_function(BenchmarkId::new(model.name, nodes), |bencher| {
            on_one_thread(|| {
                let run =
                    || contour(&bound, &grid, &Settings::default(), &Progress::new(), &mut Nowhere);
                bencher.iter(|| run().unwrap());
            });
        });
    }
    group.finish();
    criterion.final_summary();
}
