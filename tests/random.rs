//! Random programs, from text to mesh: what must hold of every program.
//!
//! Programs are made of shapes, periodic surfaces, struts, set operations, offsets, motions, maps,
//! walls, fills and blends, and of every function of the language, with no regard to sense
//! (densities are left out):
//! fields have NaN, infinities, jumps and kinks, shapes are tiny, thin or missing. A failure prints
//! its seed and its program; seeds that once failed are kept in [`ONCE_FAILED`].
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "a failure names its seed")]

mod common;
#[path = "random/programs.rs"]
mod programs;

use alveole::eval::{BRICK, Bound, Engine, NodeBox, Program, Sampler, interpret};
use alveole::expr::{Graph, NodeId, derive};
use alveole::geom::{Aabb, Axis};
use alveole::job::{Error, Files, Job, Settings};
use alveole::lang;
use alveole::mesh::Mesh;
use alveole::mesh::check::check;
use alveole::mesh::io::{self, Format, Precision};
use alveole::num::Interval;
use alveole::octree::Pruning;
use alveole::vocabulary::Words;
use glam::DVec3;
use programs::{Folder, Random};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, Mutex};

/// Seeds of programs that once failed.
const ONCE_FAILED: &[u64] = &[96, 104];

/// Runs `holds` on the programs of the seeds, and of those that once failed.
fn each(seeds: std::ops::Range<u64>, holds: impl Fn(&mut Random, &[String]) + Sync) {
    let folder = Folder::new();
    let check = |seed: u64, mut random: Random| {
        let words = random.program(&folder);
        let held = std::panic::AssertUnwindSafe(|| holds(&mut random, &words));
        if let Err(panic) = std::panic::catch_unwind(held) {
            let shown: Vec<_> = words.iter().map(|word| format!("'{word}'")).collect();
            eprintln!("seed {seed}: {}", shown.join(" "));
            std::panic::resume_unwind(panic);
        }
    };
    let next = AtomicU64::new(seeds.start);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().unwrap().get() {
            scope.spawn(|| {
                while let Some(seed) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).filter(|seed| *seed < seeds.end)
                {
                    check(seed, Random::new(seed));
                }
            });
        }
        ONCE_FAILED.iter().for_each(|&seed| check(seed, Random::classic(seed)));
    });
}

/// Pools of one thread and of four.
static POOLS: LazyLock<[ThreadPool; 2]> = LazyLock::new(|| {
    [1, 4].map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().unwrap())
});

fn job(words: &[String]) -> Job {
    Job::new(words).unwrap_or_else(|fault| panic!("{fault}"))
}

/// Settings of a grid of a few bricks; `None` if the solid has no box.
fn settings(random: &mut Random, job: &Job) -> Option<Settings> {
    let bounds = match job.bounds() {
        Ok(bounds) => bounds,
        Err(Error::Bounds { .. }) => return None,
        Err(fault) => panic!("{fault}"),
    };
    let most = if random.below(8) == 0 { 33 } else { 14 };
    let cells = 1.0 + random.below(most) as f64 + random.between(0.0, 1.0);
    Some(Settings::with_spacing(bounds.size().max_element() / cells))
}

#[test]
fn programs_survive_printing_and_reading() {
    each(0..1500, |random, words| {
        let read = |words: &[String]| {
            lang::parse(words, &Words, &mut Files::default(), &[])
                .unwrap_or_else(|fault| panic!("{:?}", fault.diagnostics))
        };
        let first = read(words);
        let printed = lang::format(&first.items, &Words);
        let second = read(&printed);
        assert_eq!(first.items, second.items, "{printed:?}");
        let points: Vec<_> = (0..20).map(|_| random.point(3.0)).collect();
        let [a, b] = [&first, &second].map(|p| values(&p.graph, p.solid.field, &points));
        assert!(a.iter().zip(&b).all(|(a, b)| same(*a, *b)), "{printed:?}: {a:?} {b:?}");
    });
}

/// Same bits, whatever NaN.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

fn values(graph: &Graph, root: NodeId, points: &[DVec3]) -> Vec<f64> {
    let at: [Vec<f64>; 3] = [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect());
    let mut values = vec![0.0; points.len()];
    let at = at.each_ref().map(|list| &list[..]);
    interpret::points(graph, &[root], at, &[], &mut [&mut values]).unwrap();
    values
}

/// The bytes of a mesh file, or none if the solid is empty.
fn bytes(job: &Job, settings: &Settings, pool: &ThreadPool) -> Option<Vec<u8>> {
    let mesh = match pool.install(|| job.mesh(settings)) {
        Ok(mesh) => mesh,
        Err(Error::Empty { .. }) => return None,
        Err(fault) => panic!("{fault}"),
    };
    let mut bytes = Vec::new();
    io::write(&mesh, Format::Ply, Precision::Double, &mut bytes).unwrap();
    Some(bytes)
}

/// A mesh is the same, and sound, whoever makes it.
fn check_mesh(random: &mut Random, words: &[String]) {
    let job = job(words);
    let Some(settings) = settings(random, &job) else { return };
    let how = |engine, pruning| Settings { engine, pruning, ..settings.clone() };
    let [one, four] = &*POOLS;
    let sparse = bytes(&job, &how(Engine::Automatic, Pruning::Intervals), one);
    let together = bytes(&job, &how(Engine::Automatic, Pruning::Intervals), four);
    assert!(sparse == together, "four threads differ from one");
    let dense = bytes(&job, &how(Engine::Interpreter, Pruning::None), one);
    assert!(sparse == dense, "the sparse mesh differs from the dense one");
    let pruned = bytes(&job, &how(Engine::Pruned, Pruning::Intervals), four);
    assert!(sparse == pruned, "the mesh of a pruned program differs");
    if let Some(bytes) = sparse {
        let (mesh, _) = io::read_bytes("mesh", &bytes, Some(Format::Ply)).unwrap();
        let found = check(&mesh);
        assert!(found.is_sound(), "{:?}", found.defects);
        let grid = job.grid(&settings).unwrap();
        if grid.precision() == Precision::Single {
            let found = check(&single(&mesh));
            assert!(found.is_sound(), "in single precision: {:?}", found.defects);
        }
    }
}

/// The mesh as single precision keeps it.
fn single(mesh: &Mesh) -> Mesh {
    let positions = mesh.positions.iter().map(|p| p.map(|value| f64::from(value as f32))).collect();
    Mesh { positions, triangles: mesh.triangles.clone() }
}

#[test]
fn meshes_are_sound_and_depend_on_neither_engine_nor_pruning_nor_threads() {
    each(0..400, check_mesh);
}

#[test]
#[ignore = "600 seconds"]
fn meshes_of_many_more_programs_are_sound_and_the_same() {
    each(1_000_000..1_020_000, check_mesh);
}

/// A program bound to the grid that would be contoured.
fn bound(job: &Job, settings: &Settings, engine: Engine) -> Bound {
    let (graph, field) = job.field();
    let grid = job.grid(settings).unwrap();
    let tables = Axis::ALL.map(|axis| grid.sampled(axis).to_vec());
    Program::new(graph, field, engine).unwrap().bind(tables, &[])
}

/// Values of all bricks, by brick.
fn brick_values(bound: &Bound) -> Vec<([u32; 3], Vec<f64>)> {
    let everything = vec![u64::MAX; bound.activity_words()];
    let mut workspace = bound.workspace();
    let mut values = [0.0; BRICK * BRICK * BRICK];
    let [nx, ny, nz] = bound.nodes().map(|n| ((n - 1) / BRICK) as u32);
    let all = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / nx / ny]);
    all.map(|brick| {
        bound.values(&mut workspace, brick, &everything, &mut values).unwrap();
        (brick, values.to_vec())
    })
    .collect()
}

/// Engines agree to the bit, and intervals hold what they enclose.
fn check_values(random: &mut Random, words: &[String]) {
    let job = job(words);
    let Some(settings) = settings(random, &job) else { return };
    let [interpreted, compiled] =
        [Engine::Interpreter, Engine::Automatic].map(|engine| bound(&job, &settings, engine));
    let bricks = brick_values(&interpreted);
    for ((brick, a), (_, b)) in bricks.iter().zip(&brick_values(&compiled)) {
        let at = a.iter().zip(b).position(|(a, b)| !same(*a, *b));
        assert!(at.is_none(), "node {at:?} of brick {brick:?}: {:?}", at.map(|i| (a[i], b[i])));
    }
    let top = bricks.iter().flat_map(|(brick, _)| brick).fold(1, |most, b| most.max(b + 1));
    let mut workspace = compiled.workspace();
    for (brick, values) in &bricks {
        let mut activity = vec![u64::MAX; compiled.activity_words()];
        for level in (0..=top.next_power_of_two().ilog2() as u8).rev() {
            let own = NodeBox { level, index: brick.map(|b| b >> level) };
            let mut range = [Interval::point(0.0)];
            compiled.ranges(&mut workspace, &[own], &mut activity, &mut range).unwrap();
            let missed = values.iter().find(|value| !range[0].contains(**value));
            assert!(missed.is_none(), "{missed:?} is not in {range:?} of {own:?}");
        }
    }
}

#[test]
fn engines_agree_to_the_bit_and_intervals_enclose_their_values() {
    each(0..400, check_values);
}

/// The gradient is that of differences, where these tell: how many slopes were NaN or the same.
///
/// A slope may be NaN where a part's is infinite and its operand's zero, as in `acos(-z/z)`.
fn check_gradient(random: &mut Random, words: &[String]) -> [usize; 2] {
    // Differences vanish where a huge number absorbs a coordinate, and slopes do not.
    if words.iter().any(|word| word.contains("1e300")) {
        return [0, 0];
    }
    let job = job(words);
    let (graph, field) = job.field();
    let mut graph = graph.clone();
    let gradient = derive::gradient(&mut graph, field);
    let points: Vec<_> = (0..20).map(|_| random.point(1.5)).collect();
    let mut told = [0, 0];
    for (axis, partial) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(gradient) {
        let slopes = values(&graph, partial, &points);
        let along = |step: f64| {
            let moved: Vec<_> = points.iter().map(|p| *p + axis * step).collect();
            values(&graph, field, &moved)
        };
        let steps = [-2e-5, -1e-5, -5e-6, 0.0, 5e-6, 1e-5, 2e-5].map(|step| (step, along(step)));
        for (i, slope) in slopes.iter().enumerate() {
            // Slopes between neighbours agree where the field is smooth at the scale of the steps.
            let pieces: Vec<f64> = (steps.windows(2))
                .map(|pair| (pair[1].1[i] - pair[0].1[i]) / (pair[1].0 - pair[0].0))
                .collect();
            let (lo, hi) = pieces
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
            let size = lo.abs().max(hi.abs()) + steps[3].1[i].abs();
            let smooth = pieces.iter().all(|p| p.is_finite()) && hi - lo <= 1e-3 * size;
            if smooth && size < 1e6 && slope.is_nan() {
                told[0] += 1;
            } else if smooth && size < 1e6 {
                told[1] += 1;
                let margin = (hi - lo) + 1e-4 * size + 1e-6;
                assert!(
                    lo - margin <= *slope && *slope <= hi + margin,
                    "the slope along {axis} at {} is {slope}, not {lo} to {hi}",
                    points[i]
                );
            }
        }
    }
    told
}

#[test]
fn gradients_are_those_of_differences() {
    let counts = Mutex::new([0, 0]);
    each(0..400, |random, words| {
        let told = check_gradient(random, words);
        let mut counts = counts.lock().unwrap();
        *counts = [counts[0] + told[0], counts[1] + told[1]];
    });
    let [undefined, same] = counts.into_inner().unwrap();
    assert!(same > 12_000, "only {same} slopes of 24000 could be told");
    assert!(undefined * 50 < same, "{undefined} slopes are NaN, {same} are right");
}

/// Nothing of the solid lies outside its bounds, where no part of its field is NaN: an extremum may
/// discard NaN, and with it the bounds of an operand.
fn check_bounds(random: &mut Random, words: &[String]) {
    let job = job(words);
    let (graph, field) = job.field();
    let Ok(Aabb { lo, hi }) = job.bounds() else { return };
    let (centre, half) = (lo.midpoint(hi), 0.5 * (hi - lo));
    let points: Vec<_> = (0..100)
        .map(|_| centre + random.point(3.0) * half.max(DVec3::splat(0.1)))
        // A margin for rounding of field and box, both of order 10.
        .filter(|p| (*p - centre).abs().cmpgt(half + DVec3::splat(1e-9)).any())
        .collect();
    let parts: Vec<_> = graph.iter().map(|(id, _)| values(graph, id, &points)).collect();
    for (i, point) in points.iter().enumerate() {
        let value = parts[field.index()][i];
        let defined = parts.iter().all(|part| !part[i].is_nan());
        assert!(!(defined && value < -1e-9), "{value} at {point}, outside {lo} to {hi}");
    }
}

#[test]
fn no_solid_reaches_outside_its_bounds() {
    each(0..3000, check_bounds);
}
