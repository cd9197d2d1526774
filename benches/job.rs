//! The whole job: from program text to a PLY file on disk, 101 nodes a side, on one thread; and the
//! evaluations of an optimizer, which changes a parameter of a job that is compiled.
#![allow(clippy::unwrap_used)]

mod models;

use alveole::job::{Job, Settings};
use alveole::mesh::io::{FileSink, Format, Precision};
use alveole::num::Progress;
use criterion::Criterion;
use models::{GYROID_BOX, GYROID_SHELL, Model, on_one_thread};
use std::time::Duration;

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .sample_size(20)
        .configure_from_args();
    let mut group = criterion.benchmark_group("job");
    for model in [GYROID_BOX, GYROID_SHELL] {
        group.bench_function(model.name, |bencher| {
            on_one_thread(|| bencher.iter(|| text_to_file(model)));
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("again");
    let mut job = Job::parse_with("gyroid dilate t box", &[("t", 0.35)]).unwrap();
    let settings = Settings::with_spacing(2.0 / 100.0);
    let mut levels = [0.35, 0.3, 0.25, 0.2].into_iter().cycle();
    let mut change = |job: &mut Job| job.set_parameter("t", levels.next().unwrap_or(0.0)).unwrap();
    group.bench_function("totals", |bencher| {
        bencher.iter(|| {
            change(&mut job);
            job.totals(&settings, &Progress::new()).unwrap().relative_density
        });
    });
    // As near to the solid as the totals are, and nearer, on a third of the nodes.
    let coarse = Settings::with_spacing(2.0 / 32.0);
    group.bench_function("field", |bencher| {
        bencher.iter(|| {
            change(&mut job);
            job.field_measures(&coarse, &Progress::new()).unwrap().volume.value
        });
    });
    group.bench_function("mesh", |bencher| {
        bencher.iter(|| {
            change(&mut job);
            job.mesh(&settings).unwrap()
        });
    });
    group.finish();
    criterion.final_summary();
}

fn text_to_file(model: Model) {
    let job = Job::parse(model.text).unwrap();
    let settings = Settings::with_spacing(2.0 / 100.0);
    let grid = job.grid(&settings).unwrap();
    let file = tempfile::tempfile().unwrap();
    let folder = std::env::temp_dir();
    let mut sink = FileSink::new(file, Format::Ply, Precision::Single, &folder).unwrap();
    job.contour(&grid, &settings, &Progress::new(), &mut sink).unwrap();
    sink.finish().unwrap();
}
