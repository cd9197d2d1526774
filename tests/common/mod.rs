//! What the acceptance tests share: a program's mesh, held to the promises of every mesh; ranges
//! that hold; random numbers; the folder of real meshes.

#![allow(dead_code, reason = "each test crate uses a part")]
#![allow(clippy::print_stdout, reason = "a test says what it skips")]

use alveole::eval::{BRICK, Engine, NodeBox, Program, Sampler};
use alveole::job::{Job, Settings};
use alveole::mesh::Mesh;
use alveole::mesh::check::check;
use alveole::mesh::measure::volume;
use alveole::num::Interval;
use std::path::PathBuf;

/// The job of a program text.
#[track_caller]
pub fn job(text: &str) -> Job {
    Job::parse(text).unwrap_or_else(|fault| panic!("{text}: {fault}"))
}

/// The mesh of a program text at one spacing: closed, oriented, manifold, without zero areas.
#[track_caller]
pub fn sound_mesh(text: &str, spacing: f64) -> Mesh {
    let made = job(text).mesh(&Settings::with_spacing(spacing));
    let mesh = made.unwrap_or_else(|fault| panic!("{text}: {fault}"));
    assert_sound(text, &mesh);
    mesh
}

/// Holds a mesh to the promises of every mesh.
#[track_caller]
pub fn assert_sound(name: &str, mesh: &Mesh) {
    let found = check(mesh);
    assert!(found.is_sound(), "{name}: {:?}", found.defects);
}

/// The volume of the sound mesh of a program text.
#[track_caller]
pub fn sound_volume(text: &str, spacing: f64) -> f64 {
    volume(&sound_mesh(text, spacing))
}

/// The range of the job's field over a brick of nodes from `start`, `step` apart, holds the values at
/// them, with both engines.
#[track_caller]
pub fn assert_ranges_hold(name: &str, job: &Job, start: [f64; 3], step: f64) {
    let (graph, field) = job.field();
    for engine in [Engine::Interpreter, Engine::Compiled] {
        let program = Program::new(graph, field, engine).unwrap();
        let tables =
            start.map(|lo| (0..=BRICK).map(|i| lo + step * i as f64).collect::<Vec<f64>>());
        let bound = program.bind(tables, &[]);
        let mut workspace = bound.workspace();
        let mut activity = vec![u64::MAX; bound.activity_words()];
        let whole = [NodeBox { level: 0, index: [0; 3] }];
        let mut range = [Interval::ANYTHING];
        bound.ranges(&mut workspace, &whole, &mut activity, &mut range).unwrap();
        let mut found = [0.0; BRICK * BRICK * BRICK];
        bound.values(&mut workspace, [0; 3], &activity, &mut found).unwrap();
        for value in found {
            assert!(range[0].contains(value), "{name}: {value} in {:?}", range[0]);
        }
    }
}

/// Numbers in [0, 1) from a seed.
pub struct Uniform(pub u64);

impl Uniform {
    pub fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[(self.next() * list.len() as f64) as usize]
    }
}

/// The folder of real meshes, or a word on what is skipped.
pub fn real_meshes() -> Option<PathBuf> {
    let folder = std::env::var_os("ALVEOLE_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: ALVEOLE_DATA names no folder of mesh files");
    }
    folder
}
