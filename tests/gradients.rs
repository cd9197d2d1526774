//! Derivatives of the mesh's volume and area by parameters, against differences of the mesh.
//!
//! Where a parameter moves a little without changing the sign of any node, the mesh keeps its
//! triangles and its volume and area are smooth: central differences of step 1e-7 err by rounding
//! (1e-15 / 1e-7, relative) and by nothing else that counts. Steps as small show vertices that are
//! held off nodes at rest: what they add to the derivatives is told apart, and taken off before the
//! rest is compared. A vertex that passes a kink or comes to be held at a node meanwhile shows as two
//! one-sided differences that disagree; such a point proves nothing and is left out, as is a model
//! where edges graze the surface, and few may be.
//! What held vertices add is held to closed forms and to differences of larger steps.
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "a failure names its seed")]

#[path = "gradients/model.rs"]
mod model;

use alveole::contour::grid::TAU;
use alveole::contour::{Settings, contour};
use alveole::eval::rates::Rates;
use alveole::eval::{Engine, Program};
use alveole::expr::{Graph, NodeId, Oracle, Output, Unary};
use alveole::field::mesh_distance;
use alveole::geom::{Aabb, Axis};
use alveole::job::{self, Job, Quantities};
use alveole::measure::{Estimate, Gradient, Totals, gradient, totals};
use alveole::mesh::Mesh;
use alveole::mesh::measure::measure;
use alveole::mesh::sink::Collect;
use alveole::num::Progress;
use alveole::solid::{Solid, primitives};
use glam::DVec3;
use model::{Model, Random, surface};
use std::f64::consts::PI;
use std::sync::Arc;

/// Step of the differences, in units of the parameters, all of size one.
const STEP: f64 = 1e-7;

impl Model {
    fn mesh(&self, values: &[f64]) -> Mesh {
        let grid = self.grid(values);
        let program = Program::new(&self.graph, self.solid.field, Engine::Interpreter).unwrap();
        let mut sink = Collect::default();
        let bound = program.bind(grid.tables(), values);
        contour(&bound, &grid, &Settings::default(), &Progress::new(), &mut sink).unwrap();
        sink.into_mesh()
    }

    fn totals(&self, values: &[f64]) -> Totals {
        let found = measure(&self.mesh(values));
        Totals { volume: found.volume, area: found.area }
    }

    fn gradient(&self, engine: Engine) -> Gradient {
        let grid = self.grid(&self.values);
        let program = Program::new(&self.graph, self.solid.field, engine).unwrap();
        let motions = self.motions();
        let rates = Rates::new(&program, &self.ids, engine).unwrap();
        let rates = rates.bind(&grid.tables(), &self.values);
        let bound = program.bind(grid.tables(), &self.values);
        let settings = Settings::default();
        let (found, report) =
            gradient(&bound, &rates, &motions, &grid, &settings, &Progress::new()).unwrap();
        let (alone, plain) = totals(&bound, &grid, &settings, &Progress::new()).unwrap();
        assert_eq!(alone, found.totals);
        assert_eq!((plain.vertices, plain.triangles), (report.vertices, report.triangles));
        found
    }

    /// Compares the gradient with differences; returns how many parameters proved something.
    fn check(&self, name: &str) -> usize {
        let found = self.gradient(Engine::Interpreter);
        let here = self.mesh(&self.values);
        let direct = measure(&here);
        let close = |a: f64, b: f64, scale: f64| (a - b).abs() <= scale * (1.0 + a.abs());
        assert!(close(found.totals.volume, direct.volume, 1e-13), "{name}: volume");
        assert!(close(found.totals.area, direct.area, 1e-13), "{name}: area");
        if found.unresolved > 0 {
            eprintln!("{name}: edges graze the surface at {} crossings", found.unresolved);
            return 0;
        }
        let mut proved = 0;
        for (k, (by, held)) in found.by.iter().zip(&found.held).enumerate() {
            let moved = |by: f64| {
                let mut values = self.values.clone();
                values[k] += by;
                values
            };
            let ends = [-STEP, STEP].map(|step| self.mesh(&moved(step)));
            if ends.iter().any(|mesh| mesh.triangles != here.triangles) {
                eprintln!("{name}: a sign changes with parameter {k}");
                continue;
            }
            let [below, above] = [-STEP, STEP].map(|step| self.totals(&moved(step)));
            let size = direct.volume / direct.area;
            let mut smooth = true;
            for (what, slope, values, scale) in [
                (
                    "volume",
                    by.volume - held.volume,
                    [below.volume, direct.volume, above.volume],
                    direct.area,
                ),
                (
                    "area",
                    by.area - held.area,
                    [below.area, direct.area, above.area],
                    direct.area / size,
                ),
            ] {
                let [left, right] = [0, 1].map(|i| (values[i + 1] - values[i]) / STEP);
                let difference = 0.5 * (left + right);
                // A part of the whole is what a motion that cancels out is measured against.
                let unit = difference.abs().max(0.1 * scale);
                if (left - right).abs() > 2e-5 * unit {
                    eprintln!("{name}: {what} has a kink at parameter {k}: {left}, {right}");
                    smooth = false;
                    continue;
                }
                let error = (slope - difference).abs() / unit;
                assert!(
                    error < 1e-6,
                    "{name}: {what} by {k}: {slope} is not {difference}, {error:e}"
                );
            }
            proved += usize::from(smooth);
        }
        proved
    }
}

/// Checks a model whose parameters must all prove something.
#[track_caller]
fn check(
    name: &str,
    values: &[f64],
    bounds: Option<f64>,
    spacing: f64,
    build: impl FnOnce(&mut Graph, &[NodeId]) -> Solid,
) {
    let model = Model::new(values, bounds, spacing, build);
    assert_eq!(model.check(name), values.len(), "{name}: all parameters prove something");
}

#[test]
fn offsets_and_shells_of_periodic_surfaces() {
    for name in ["gyroid", "iwp", "p-surface"] {
        check(name, &[0.31, 0.2], None, 0.17, |graph, p| {
            let wall = surface(graph, name).dilate(graph, p[1]).shell(graph, p[0]);
            let cube = primitives::cube(graph);
            wall.intersection(graph, cube)
        });
    }
}

#[test]
fn bounds_that_move_with_a_parameter() {
    check("gyroid box scale", &[1.13], None, 0.17, |graph, p| {
        let cube = primitives::cube(graph);
        surface(graph, "gyroid").intersection(graph, cube).scale(graph, [p[0]; 3])
    });
    check("ball moved", &[0.41, 0.7, 0.3], None, 0.13, |graph, p| {
        let ball = primitives::sphere(graph).scale(graph, [p[0], p[1], p[0]]);
        ball.translate(graph, [p[2], p[1], p[0]]).dilate(graph, p[2])
    });
    check("turned", &[0.52, 0.33], None, 0.137, |graph, p| {
        let zero = graph.constant(0.0);
        let cube = primitives::cube(graph);
        let part = surface(graph, "gyroid").dilate(graph, p[1]).intersection(graph, cube);
        part.rotate(graph, p[0], [p[1], zero, p[0]])
    });
}

#[test]
fn creases_and_flat_faces() {
    check("parts", &[0.43, 0.62, 0.34], Some(1.3), 0.14, |graph, p| {
        let ball = primitives::sphere(graph).scale(graph, [p[1]; 3]);
        let ball = ball.translate(graph, [p[0], p[2], p[0]]);
        let block = primitives::cube(graph).scale(graph, [p[0], p[1], p[1]]);
        let bar = primitives::cylinder(graph).scale(graph, [p[2]; 3]);
        block.union(graph, ball).difference(graph, bar)
    });
    check("frame", &[0.71, 0.27], None, 0.13, |graph, p| {
        let outer = primitives::cube(graph).scale(graph, [p[0]; 3]);
        let inner = primitives::sphere(graph).dilate(graph, p[1]).scale(graph, [p[0]; 3]);
        outer.difference(graph, inner)
    });
}

#[test]
fn equations_with_parameters() {
    check("wave", &[1.21, 0.37, 0.83], Some(1.0), 0.11, |graph, p| {
        let [x, y, z] = graph.point();
        let (u, v) = (graph.mul(p[0], x), graph.mul(p[2], z));
        let wave = graph.unary(Unary::Sin, u);
        let grown = graph.unary(Unary::Exp, v);
        let product = graph.mul(wave, grown);
        let square = graph.mul(y, y);
        let sum = graph.add(product, square);
        let root = graph.unary(Unary::Cbrt, p[1]);
        let field = graph.sub(sum, root);
        Solid::unbounded(graph, field)
    });
}

#[test]
fn meshes_reached_through_motions() {
    let ball = Model::new(&[], None, 0.25, |graph, _| primitives::sphere(graph)).mesh(&[]);
    let distance = mesh_distance(&ball, "ball").unwrap();
    let bounds = distance.bounds();
    let distance: Arc<dyn Oracle> = Arc::new(distance);
    for bounded in [None, Some(1.6)] {
        check("mesh", &[0.31, 0.83, 0.12], bounded, 0.19, |graph, p| {
            let (oracle, point) = (graph.add_oracle(&distance), graph.point());
            let field = graph.oracle(oracle, Output::Value, point);
            let solid = Solid::within(graph, field, bounds, 1.0);
            let one = graph.constant(1.0);
            let solid = solid.dilate(graph, p[2]).scale(graph, [p[1]; 3]);
            solid.rotate(graph, p[0], [one, p[2], p[0]]).translate(graph, [p[2], p[0], p[2]])
        });
    }
}

/// Whether a vertex of the solid's mesh is held off a node.
fn holds_vertices(text: &str, values: &[(&str, f64)], settings: &job::Settings) -> bool {
    let job = Job::parse_with(text, values).unwrap();
    let (grid, mesh) = (job.grid(settings).unwrap(), job.mesh(settings).unwrap());
    mesh.positions.iter().any(|position| {
        Axis::ALL.into_iter().any(|axis| {
            let nodes = grid.placed(axis);
            nodes.windows(2).any(|ends| {
                let fraction = (position[axis.index()] - ends[0]) / (ends[1] - ends[0]);
                let from_end = fraction.min(1.0 - fraction);
                (from_end - TAU).abs() < 1e-9
            })
        })
    })
}

/// Compares the derivatives that a job tells with differences of what it measures, at the first
/// values from `values` on for which no vertex is held, of the solid or of its envelope.
#[track_caller]
fn check_job([text, envelope]: [&str; 2], values: &[(&str, f64)], settings: &job::Settings) {
    let progress = Progress::new();
    let nudged = (0..500).map(|i| {
        let by = f64::from(i) * 1e-3;
        values.iter().map(|(name, value)| (*name, value + by)).collect::<Vec<_>>()
    });
    let holds = |values: &[(&str, f64)]| {
        [text, envelope].iter().any(|text| holds_vertices(text, values, settings))
    };
    let values =
        nudged.into_iter().find(|values| !holds(values)).expect("values without held ones");
    let values = &values[..];
    let found = Job::parse_with(text, values).unwrap().gradient(settings, &progress).unwrap();
    let rows = |q: &Quantities| [q.volume, q.area, q.relative_density, q.envelope_density];
    let measured = |values: &[(&str, f64)]| {
        let found = Job::parse_with(text, values).unwrap().measure(settings, &progress).unwrap();
        let (volume, area) = (found.mesh.volume, found.mesh.area);
        [volume, area, found.relative_density, found.envelope_density]
    };
    for (value, direct) in rows(&found.quantities).into_iter().zip(measured(values)) {
        assert!((value - direct).abs() <= 1e-12 * direct.abs(), "{text}: {value} is not {direct}");
    }
    assert_eq!((found.unresolved, found.by.len()), (0, values.len()));
    for (k, by) in found.by.iter().enumerate() {
        assert_eq!(by.parameter, values[k].0);
        let [below, above] = [-STEP, STEP].map(|step| {
            let mut moved = values.to_vec();
            moved[k].1 += step;
            measured(&moved)
        });
        for (i, slope) in rows(&by.derivatives).into_iter().enumerate() {
            let difference = (above[i] - below[i]) / (2.0 * STEP);
            let close = (slope - difference).abs() < 1e-6 * (0.1 + difference.abs());
            assert!(close, "{text}: {i} by {}: {slope} is not {difference}", by.parameter);
        }
    }
}

#[test]
fn jobs_tell_derivatives_of_densities() {
    let settings = job::Settings::with_spacing(0.17);
    check_job(["gyroid dilate t box", "box"], &[("t", 0.31)], &settings);
    let scaled = ["gyroid dilate t box scale s", "box scale s"];
    check_job(scaled, &[("t", 0.31), ("s", 1.13)], &settings);
    // The envelope is the ball, and depends on one of the two.
    let ball = ["gyroid shell t sphere scale r", "sphere scale r"];
    check_job(ball, &[("r", 0.93), ("t", 0.41)], &settings);
    // The spacing follows the box; no node can change its sign.
    check_job(["box scale s,1,1"; 2], &[("s", 1.13)], &job::Settings::default());
    let bounds = Aabb::new(DVec3::splat(-0.9), DVec3::splat(1.1));
    let fixed = job::Settings { bounds: Some(bounds), ..settings };
    let equation = "'x^2 + k*y^2 + z^2 - 1' gyroid shell k";
    check_job([equation; 2], &[("k", 0.61)], &fixed);
}

/// What a job tells of its derivatives of volume and area by each parameter, and how many crossings
/// were left unresolved.
fn slopes(text: &str, values: &[(&str, f64)], settings: &job::Settings) -> (Vec<[f64; 2]>, u64) {
    let job = Job::parse_with(text, values).unwrap();
    let found = job.gradient(settings, &Progress::new()).unwrap();
    let slopes = found.by.iter().map(|by| [by.derivatives.volume, by.derivatives.area]);
    (slopes.collect(), found.unresolved)
}

#[test]
fn faces_on_nodes_move_with_all_of_their_vertices() {
    let own = job::Settings::default();
    for (text, a, truth) in [
        ("'x-a' box", 0.5, [4.0, 8.0]),
        ("'x-a' box", 0.500_000_1, [4.0, 8.0]),
        ("'abs(x)-a' box", 0.2, [8.0, 16.0]),
    ] {
        let (found, unresolved) = slopes(text, &[("a", a)], &own);
        assert_eq!(unresolved, 0, "{text}");
        for (found, truth) in found[0].into_iter().zip(truth) {
            assert!((found - truth).abs() < 1e-9, "{text}, {a}: {found} is not {truth}");
        }
    }
}

/// Compares derivatives at round values, where edges graze the surface, with central differences of a
/// fifth of the spacing or less, by which nodes change signs as they do for an optimizer.
#[track_caller]
fn check_grazed(text: &str, values: &[(&str, f64)], spacing: f64, step: f64, tolerance: f64) {
    let settings = job::Settings::with_spacing(spacing);
    let (found, unresolved) = slopes(text, values, &settings);
    assert!(unresolved > 0, "{text}");
    for (k, found) in found.iter().enumerate() {
        let [below, above] = [-step, step].map(|step| {
            let mut moved = values.to_vec();
            moved[k].1 += step;
            let job = Job::parse_with(text, &moved).unwrap();
            let found = job.totals(&settings, &Progress::new()).unwrap();
            [found.volume, found.area]
        });
        for i in 0..2 {
            let difference = (above[i] - below[i]) / (2.0 * step);
            let error = (found[i] / difference - 1.0).abs();
            assert!(error < tolerance, "{text}: {} by {k} is not {difference}", found[i]);
        }
    }
}

#[test]
fn edges_that_graze_the_surface_move_its_vertices_along_normals() {
    check_grazed("kelvin radius r box", &[("r", 0.12)], 0.02, 0.004, 0.05);
    let octet = "octet radius r fillet f box";
    check_grazed(octet, &[("r", 0.1), ("f", 0.06)], 0.04, 0.002, 0.05);
    check_grazed("simple-cubic radius r box", &[("r", 0.1)], 0.02, 0.0033, 0.08);
    check_grazed("'a*x^2+b*y^4-z' box", &[("a", 0.3), ("b", 0.4)], 0.02, 0.004, 0.03);
}

#[test]
fn jobs_measure_the_field() {
    let settings = job::Settings::with_spacing(0.1);
    let job = Job::parse_with("sphere scale r", &[("r", 0.8)]).unwrap();
    let found = job.field_measures(&settings, &Progress::new()).unwrap();
    let volume = 4.0 / 3.0 * PI * 0.8_f64.powi(3);
    let near = |found: Estimate, truth: f64| {
        assert!((found.value - truth).abs() <= found.error, "{found:?} is not {truth}");
        assert!(found.error < 0.05 * truth.abs().max(3.0), "{found:?}");
    };
    near(found.volume, volume);
    near(found.area, 4.0 * PI * 0.64);
    near(found.relative_density, PI / 6.0);
    near(found.by[0].derivatives.volume, 4.0 * PI * 0.64);
    near(found.by[0].derivatives.relative_density, 0.0);
    assert_eq!(found.envelope_volume, None);
    let job = Job::parse_with("gyroid dilate t sphere", &[("t", 0.0)]).unwrap();
    let found = job.field_measures(&settings, &Progress::new()).unwrap();
    near(found.envelope_volume.unwrap(), 4.0 / 3.0 * PI);
    near(found.envelope_density, 0.5);
}

#[test]
fn engines_and_threads_give_the_same_bits() {
    let model = Model::new(&[0.31, 1.1], None, 0.1, |graph, p| {
        let cube = primitives::cube(graph);
        let part = surface(graph, "gyroid").shell(graph, p[0]).intersection(graph, cube);
        part.scale(graph, [p[1]; 3])
    });
    let interpreted = model.gradient(Engine::Interpreter);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| model.gradient(Engine::Automatic)), interpreted);
    }
}

#[test]
fn crossings_at_jumps_are_counted() {
    let model = Model::new(&[0.03], Some(1.0), 0.2, |graph, p| {
        let [x, ..] = graph.point();
        let beyond = graph.sub(x, p[0]);
        let field = graph.unary(Unary::Sign, beyond);
        Solid::unbounded(graph, field)
    });
    let found = model.gradient(Engine::Interpreter);
    // A plane through eleven by eleven nodes.
    assert_eq!((found.unresolved, found.by[0].volume), (121, 0.0));
    assert!((found.totals.volume - 4.0 * 1.03).abs() < 1e-9);
}

/// A random solid of the parameters `p`.
fn random_solid(random: &mut Random, graph: &mut Graph, p: &[NodeId], depth: usize) -> Solid {
    let number = |random: &mut Random, graph: &mut Graph| match random.below(3) {
        0 => graph.constant(random.within(0.3, 1.2)),
        _ => p[random.below(p.len())],
    };
    if depth == 0 {
        return match random.below(4) {
            0 => primitives::sphere(graph),
            1 => primitives::cube(graph),
            2 => {
                let (major, quarter) = (graph.constant(0.8), graph.constant(0.25));
                primitives::torus(graph, major, quarter)
            }
            _ => {
                let names = ["gyroid", "iwp", "p-surface", "d-surface"];
                let part = surface(graph, names[random.below(names.len())]);
                let cube = primitives::cube(graph);
                part.intersection(graph, cube)
            }
        };
    }
    let first = random_solid(random, graph, p, depth - 1);
    match random.below(8) {
        0 => {
            let by = number(random, graph);
            let tenth = graph.constant(0.3);
            let by = graph.mul(by, tenth);
            if random.below(2) == 0 { first.dilate(graph, by) } else { first.erode(graph, by) }
        }
        1 => {
            let by = number(random, graph);
            first.shell(graph, by)
        }
        2 => {
            let by = [(); 3].map(|()| number(random, graph));
            first.scale(graph, by)
        }
        3 => {
            let by = [(); 3].map(|()| number(random, graph));
            first.translate(graph, by)
        }
        4 => {
            let (angle, axis) = (number(random, graph), [(); 3].map(|()| number(random, graph)));
            first.rotate(graph, angle, axis)
        }
        op => {
            let second = random_solid(random, graph, p, depth - 1);
            match op {
                5 => first.union(graph, second),
                6 => first.intersection(graph, second),
                _ => first.difference(graph, second),
            }
        }
    }
}

fn check_random(seeds: std::ops::Range<u64>) {
    let (mut proved, mut asked, mut failed) = (0, 0, Vec::new());
    for seed in seeds {
        let mut random = Random(seed);
        let values = [(); 3].map(|()| random.within(0.3, 1.2));
        let bounds = (random.below(2) == 0).then_some(1.4);
        let depth = 1 + random.below(4);
        let mut model = Model::new(&values, bounds, 0.17, |graph, p| {
            random_solid(&mut random, graph, p, depth)
        });
        let Ok(own) = model.solid.finite_bounds(&model.graph, &values) else { continue };
        if model.bounds.is_none() {
            model.spacing = own.size().max_element() / 13.7;
        }
        if model.mesh(&values).triangles.is_empty() {
            continue;
        }
        asked += values.len();
        let held = std::panic::AssertUnwindSafe(|| model.check(&format!("seed {seed}")));
        match std::panic::catch_unwind(held) {
            Ok(some) => proved += some,
            Err(_) => failed.push(seed),
        }
    }
    assert!(failed.is_empty(), "seeds {failed:?} failed");
    eprintln!("{proved} of {asked} parameters proved something");
    assert!(10 * proved > 8 * asked && asked > 0, "{proved} of {asked}");
}

#[test]
fn random_solids_have_the_gradient_of_their_differences() {
    check_random(0..60);
}

#[test]
#[ignore = "a minute"]
fn a_thousand_random_solids_have_the_gradient_of_their_differences() {
    check_random(1000..2000);
}
