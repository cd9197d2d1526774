//! What the comparison with other programs needs of this one and no command gives.
//!
//! ```text
//! peers program MODEL          the program text of a model, cut to the box of half-side 0.95
//! peers export  MODEL          the same field as the lines that fidget reads
//! peers eval    MODEL          cost of a sample and of what must be known before sampling
//! peers distance MESH POINTS   cost of signed distances at points (f64 triples in a file)
//! peers distance MESH SIDE     the same on a grid of SIDE^3 points around the mesh, in bricks
//! ```
//!
//! Answers are one JSON object. All on one thread, in its CPU seconds; what is short is repeated
//! and the least mean of some rounds counts. `cargo bench -- --test` makes one pass of each.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../models/mod.rs"]
mod models;

use alveole::eval::{BRICK, Bound, Engine, Sampler};
use alveole::expr::depends::reachable;
use alveole::expr::{Binary, Node, NodeId, Oracle, Queries, Unary};
use alveole::field::mesh_distance;
use alveole::geom::Axis;
use alveole::job::Job;
use alveole::mesh::io;
use alveole::num::Progress;
use alveole::octree::{Pruning, subdivide};
use models::{
    GYROID, GYROID_ABOUT_ANY, GYROID_GRADED, HIERARCHICAL_UNIT, Model, NEOVIUS, SPHERES_20,
    csg_10000, on_one_thread, spheres_10000, terms_500,
};
use serde_json::json;
use std::fmt::Write;

/// Half the side of the box that every model is cut to, so that it ends inside of [-1, 1]^3.
const HALF: f64 = 0.95;
/// Cells along a side of the grid on [-1, 1]^3 where samples are counted.
const CELLS: usize = 128;
/// CPU seconds of a round of passes.
const ROUND: f64 = 0.1;
/// Points between two looks at the clock.
const BATCH: usize = 1 << 14;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["program", name] => println!("{}", cut(model(name))),
        ["export", name] => print!("{}", lines(&job(name))),
        ["eval", name] => println!("{}", on_one_thread(|| eval(name, CELLS, 5))),
        ["distance", mesh, points] => println!("{}", on_one_thread(|| distance(mesh, points))),
        _ if words.contains(&"--test") => {
            for model in [GYROID, SPHERES_20] {
                assert!(!lines(&job(model.name)).is_empty());
                on_one_thread(|| eval(model.name, 32, 0));
            }
        }
        _ => println!("models: {}", all().map(|model| model.name).join(" ")),
    }
}

fn all() -> [Model; 9] {
    [
        GYROID,
        NEOVIUS,
        GYROID_ABOUT_ANY,
        GYROID_GRADED,
        HIERARCHICAL_UNIT,
        SPHERES_20,
        spheres_10000(),
        csg_10000(),
        terms_500(),
    ]
}

fn model(name: &str) -> Model {
    all().into_iter().find(|model| model.name == name).unwrap_or_else(|| panic!("no model {name}"))
}

/// The program of a model and of the box around it, which are intersected.
///
/// The box is its simplest formula, as the peer's users write it.
fn cut(model: Model) -> String {
    format!("{} 'max(max(abs(x),abs(y)),abs(z)) - {HALF}'", model.text)
}

fn job(name: &str) -> Job {
    Job::parse(&cut(model(name))).unwrap()
}

/// The field of `job` as `fidget::context::Context::from_text` reads it: a node a line.
fn lines(job: &Job) -> String {
    let (graph, root) = job.field();
    let mut text = String::new();
    for id in reachable(graph, &[root]) {
        let name = |id: NodeId| format!("n{}", id.index());
        let line = match graph.node(id) {
            Node::Coordinate(axis) => format!("var-{}", ["x", "y", "z"][axis.index()]),
            Node::Constant(bits) => format!("const {}", f64::from_bits(bits)),
            Node::Unary(op, a) => format!("{} {}", unary(op), name(a)),
            Node::Binary(op, a, b) => format!("{} {} {}", binary(op), name(a), name(b)),
            Node::Parameter(_) | Node::Pick(..) | Node::Oracle(..) => panic!("no such model"),
        };
        writeln!(text, "{} {line}", name(id)).unwrap();
    }
    text
}

fn unary(op: Unary) -> &'static str {
    use Unary::{Cbrt, Cosh, Log, Log10, Sign, Sinh, Tanh};
    assert!(![Sign, Cbrt, Sinh, Cosh, Tanh, Log10].contains(&op), "fidget has no {}", op.name());
    if op == Log { "ln" } else { op.name() }
}

fn binary(op: Binary) -> &'static str {
    match op {
        Binary::Add => "add",
        Binary::Sub => "sub",
        Binary::Mul => "mul",
        Binary::Div => "div",
        Binary::Pow | Binary::Hypot => panic!("fidget has no {}", op.name()),
        Binary::Min | Binary::Max | Binary::Mod | Binary::Atan2 => op.name(),
    }
}

/// Costs on the bricks that intervals do not settle: of finding them, and of a sample in them.
fn eval(name: &str, cells: usize, rounds: u32) -> serde_json::Value {
    let (job, reading) = timed(|| job(name));
    let (graph, field) = job.field();
    let program = || alveole::eval::Program::new(graph, field, Engine::Automatic).unwrap();
    let (program, compiling) = timed(program);
    let last = cells as f64;
    let table: Vec<f64> = (0..=cells).map(|i| 2.0 * i as f64 / last - 1.0).collect();
    let bound: Bound = program.bind(Axis::ALL.map(|_| table.clone()), &[]);
    let divide = || subdivide(&bound, Pruning::Intervals, u64::MAX, &Progress::new()).unwrap();
    let bricks = divide();
    let bounding = least(rounds, || drop(divide()));

    let mut workspace = bound.workspace();
    let active: Vec<([u32; 3], Vec<u64>)> = (bricks.active.iter_from(0).enumerate())
        .map(|(rank, number)| {
            let mut row = vec![0; bound.activity_words()];
            bricks.activities.expand(bricks.activity(rank), &mut row);
            (bricks.position(number), row)
        })
        .collect();
    let mut signs = [0; BRICK * BRICK];
    let mut inside = 0;
    let sampling = least(rounds, || {
        inside = 0;
        for (brick, activity) in &active {
            bound.signs(&mut workspace, *brick, activity, &mut signs).unwrap();
            inside += signs.iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
        }
    });
    let samples = active.len() * BRICK.pow(3);
    json!({
        "nanoseconds": 1e9 * sampling / samples as f64,
        "nanoseconds_bounded": 1e9 * (sampling + bounding) / samples as f64,
        "compile_seconds": compiling, "read_seconds": reading, "bound_seconds": bounding,
        "bricks": active.len(), "inside": inside, "engine": "automatic, f64 signs",
        "peak": peak(),
    })
}

/// Costs of signed distances, with sums that tell whether they are the peers'.
fn distance(mesh: &str, points: &str) -> serde_json::Value {
    let mesh = io::read(mesh.as_ref()).unwrap();
    let (field, building) = timed(|| mesh_distance(&mesh, "mesh").unwrap());
    let (values, querying) = match points.parse() {
        Ok(side) => grid(&mesh, &field, side),
        Err(_) => scattered(&field, &std::fs::read(points).unwrap()),
    };
    let count = values.len() as f64;
    json!({
        "nanoseconds": 1e9 * querying / count,
        "nanoseconds_built": 1e9 * (querying + building) / count,
        "build_seconds": building, "points": values.len(), "engine": format!("{:?}", field.report().method),
        "inside": values.iter().filter(|d| **d < 0.0).count(),
        "mean": values.iter().map(|d| d.abs()).sum::<f64>() / count,
        "peak": peak(),
    })
}

fn scattered(field: &impl Oracle, bytes: &[u8]) -> (Vec<f64>, f64) {
    let numbers: Vec<f64> =
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let at =
        Axis::ALL.map(|a| numbers.iter().skip(a.index()).step_by(3).copied().collect::<Vec<f64>>());
    let mut values = vec![0.0; at[0].len()];
    let ((), seconds) = timed(|| {
        for (batch, value) in values.chunks_mut(BATCH).enumerate() {
            let from = batch * BATCH;
            let at = at.each_ref().map(|list| &list[from..from + value.len()]);
            field.points(Queries { at, value, gradient: None }).unwrap();
        }
    });
    (values, seconds)
}

/// The nodes of a grid of `side` points along each axis over the mesh's box grown by a tenth.
fn grid(mesh: &alveole::mesh::Mesh, field: &impl Oracle, side: usize) -> (Vec<f64>, f64) {
    let ends = |axis: usize| {
        let along = mesh.positions.iter().map(|p| p[axis]);
        let (lo, hi) = along.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)));
        (lo - 0.1 * (hi - lo), hi + 0.1 * (hi - lo))
    };
    let tables: [Vec<f64>; 3] = std::array::from_fn(|axis| {
        let (lo, hi) = ends(axis);
        (0..side).map(|i| lo + (hi - lo) * i as f64 / (side - 1) as f64).collect()
    });
    let [xs, ys, zs] = tables.each_ref().map(|table| table.chunks(BRICK));
    let mut values = Vec::with_capacity(side.pow(3));
    let mut brick = vec![0.0; BRICK.pow(3)];
    let ((), seconds) = timed(|| {
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    let brick = &mut brick[..x.len() * y.len() * z.len()];
                    field.brick([x, y, z], brick).unwrap();
                    values.extend_from_slice(brick);
                }
            }
        }
    });
    (values, seconds)
}

/// The least CPU seconds of `work` over `rounds`, each the mean of as many passes as fill
/// [`ROUND`]: the clock moves by milliseconds. Fewer rounds where all would take much longer than
/// that; one pass if there are none.
fn least(rounds: u32, mut work: impl FnMut()) -> f64 {
    let mut least = if rounds == 0 { timed(&mut work).1 } else { f64::INFINITY };
    let start = cpu();
    for round in 0..rounds {
        let (begin, mut passes) = (cpu(), 0);
        if round > 0 && begin - start > 2.0 * ROUND * f64::from(rounds) {
            break;
        }
        while cpu() - begin < ROUND {
            work();
            passes += 1;
        }
        least = least.min((cpu() - begin) / f64::from(passes));
    }
    least
}

/// What `work` returns, and the CPU seconds of this thread that it took.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let begin = cpu();
    let result = work();
    (result, cpu() - begin)
}

/// CPU seconds of this thread so far, as Linux tells them.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split_whitespace().next().unwrap().parse::<f64>().unwrap() * 1e-9
}

/// The largest resident set so far, in bytes, as Linux tells it.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}
