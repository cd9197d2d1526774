//! The same bytes, whatever the number of threads, the engine and the pruning.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::eval::Engine;
use alveole::job::{Job, Settings};
use alveole::mesh::Mesh;
use alveole::mesh::io::{self, Format, Precision};
use alveole::octree::Pruning;
use common::job;
use std::path::Path;
use std::process::Command;

const PROGRAMS: [&str; 5] = [
    "gyroid dilate 0.35 box",
    "box scale 4 sphere scale 5 p-surface scale 4 d-surface scale 3.75 gyroid scale 1.25",
    "gyroid scale 0.4 shell 0.3 torus rotate 1 1,2,3 intersection sphere translate 1,0,0 union",
    "'sin(5*x)*y + floor(3*z)/7 - 0.1/x' box",
    "'sqrt(x*y) + mod(z, 0.3) - 0.2' box",
];

/// The bytes of the mesh that a job makes on some threads.
fn bytes(job: &Job, settings: &Settings, threads: usize) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mesh = pool.install(|| job.mesh(settings)).unwrap();
    common::assert_sound("a mesh", &mesh);
    let mut bytes = Vec::new();
    io::write(&mesh, Format::Ply, Precision::Double, &mut bytes).unwrap();
    bytes
}

/// Checks every way to make the mesh of a job.
fn check(name: &str, job: &Job) {
    let bounds = job.bounds().unwrap();
    let settings = Settings::with_spacing(bounds.size().max_element() / 70.0);
    let how = |engine, pruning| Settings { engine, pruning, ..settings.clone() };
    let expected = bytes(job, &how(Engine::Interpreter, Pruning::None), 1);
    for engine in [Engine::Interpreter, Engine::Pruned, Engine::Automatic] {
        for pruning in [Pruning::Intervals, Pruning::None] {
            for threads in [1, 2, 4] {
                let found = bytes(job, &how(engine, pruning), threads);
                assert!(found == expected, "{name}: {engine:?}, {pruning:?}, {threads} threads");
            }
        }
    }
}

#[test]
fn meshes_do_not_depend_on_threads_engine_or_pruning() {
    for program in PROGRAMS {
        check(program, &job(program));
    }
}

/// Balls, rings and rods in all positions, some cut from others, as many as `count`.
fn many_parts(count: usize) -> String {
    let part = |i: usize| {
        let part = |k: usize| (i * k + i * i) as f64 * 0.618_034 % 1.0;
        let kind = ["sphere", "torus", "capsule", "sphere"][i % 4];
        let join = ["union", "union", "difference", "union"][i % 4];
        let join = if i == 0 { "" } else { join };
        let [x, y, z] = [part(7), part(11), part(13)].map(|at| 2.0 * at - 1.0);
        let size = 0.06 + 0.1 * part(3);
        format!("{kind} scale {size} rotate {i} 1,2,3 translate {x},{y},{z} {join} ")
    };
    (0..count).map(part).collect()
}

#[test]
fn meshes_of_many_parts_do_not_depend_on_threads_engine_or_pruning() {
    check("many parts", &job(&many_parts(160)));
    // With flat cuts through the parts.
    check("many parts in a box", &job(&format!("{} box scale 0.7", many_parts(80))));
}

#[test]
fn meshes_of_meshes_do_not_depend_on_threads_engine_or_pruning() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.ply");
    let part = common::sound_mesh("torus rotate 1 1,2,3 gyroid shell 0.8 scale 0.6", 0.06);
    let write = |path: &Path, mesh: &Mesh| {
        let mut file = std::fs::File::create(path).unwrap();
        io::write(mesh, Format::Ply, Precision::Double, &mut file).unwrap();
    };
    let check_part = |path: &Path, rest: &str| {
        let path = path.to_str().unwrap().to_owned();
        let words: Vec<String> =
            path.split('\n').chain(rest.split_whitespace()).map(str::to_owned).collect();
        check(rest, &Job::new(&words).unwrap());
    };
    write(&path, &part);
    for rest in [
        "",
        "gyroid scale 0.3 difference",
        "rotate 0.7 1,2,3 gyroid scale 0.3 intersection",
        "dilate 0.05 scale 1.3 shell 0.2 gyroid scale 0.3 intersection",
    ] {
        check_part(&path, rest);
    }
    // With a hole, where sides are told by winding numbers.
    let mut open = part;
    let [x, y, z] = open.positions[open.triangles[0][0] as usize];
    open.triangles.retain(|corners| {
        let [a, b, c] = open.positions[corners[0] as usize];
        (a - x).hypot(b - y).hypot(c - z) > 0.15
    });
    let path = folder.path().join("open.ply");
    write(&path, &open);
    for rest in ["", "gyroid scale 0.3 intersection"] {
        check_part(&path, rest);
    }
}

#[test]
fn walls_about_meshes_with_holes_do_not_depend_on_the_engine() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("open.ply");
    let mut open = common::sound_mesh("torus", 0.2);
    open.triangles.drain(..9);
    let mut file = std::fs::File::create(&path).unwrap();
    io::write(&open, Format::Ply, Precision::Double, &mut file).unwrap();
    let path = path.to_str().unwrap();
    for wall in ["thickness 0.3 box", "thickness 0.3 method gradient box"] {
        let words = std::iter::once(path).chain(wall.split_whitespace());
        let job = Job::new(&words.map(str::to_owned).collect::<Vec<_>>()).unwrap();
        let settings = Settings::with_spacing(2.0 / 18.0);
        let how = |engine, pruning| Settings { engine, pruning, ..settings.clone() };
        let expected = bytes(&job, &how(Engine::Interpreter, Pruning::None), 1);
        for engine in [Engine::Interpreter, Engine::Compiled, Engine::Pruned] {
            let found = bytes(&job, &how(engine, Pruning::Intervals), 2);
            assert!(found == expected, "{wall}: {engine:?}");
        }
    }
}

#[test]
fn files_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let write = |threads: &str, name: &str| {
        let file = format!("{threads}{name}");
        let status = Command::new(env!("CARGO_BIN_EXE_alveole"))
            .args(["mesh", "-q", "--threads", threads, "-s", "2/40", "-o", &file])
            .args(["gyroid", "shell", "0.7", "sphere"])
            .current_dir(folder.path())
            .status()
            .unwrap();
        assert!(status.success());
        std::fs::read(Path::new(folder.path()).join(file)).unwrap()
    };
    for name in ["mesh.ply", "mesh.stl", "mesh.obj", "mesh.off"] {
        let expected = write("1", name);
        for threads in ["2", "5"] {
            assert!(write(threads, name) == expected, "{name} by {threads} threads");
        }
    }
}
