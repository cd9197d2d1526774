//! Volume, area and derivatives straight from the field, against closed forms.
//!
//! Errors must be enclosed by their estimates at random sizes and places, and fall with the order
//! that the module promises.
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "a failure names its seed")]

#[path = "gradients/model.rs"]
mod model;

use alveole::contour::Settings;
use alveole::eval::{Engine, Program};
use alveole::expr::{Graph, NodeId};
use alveole::geom::Aabb;
use alveole::job::{Job, Settings as JobSettings};
use alveole::measure::quadrature::{Estimate, FieldMeasures, quadrature};
use alveole::num::Progress;
use alveole::solid::{Solid, primitives};
use glam::DVec3;
use model::{Model, Random, surface};
use std::f64::consts::PI;

fn measures(model: &Model) -> FieldMeasures {
    let program = Program::new(&model.graph, model.solid.field, Engine::Interpreter).unwrap();
    let grid = model.grid(&model.values);
    let bound = program.bind(grid.tables(), &model.values);
    let (rates, motions) = (model.rates(&program), model.motions());
    let (settings, progress) = (Settings::default(), Progress::new());
    quadrature(&bound, &rates, &motions, &grid, &settings, &progress).unwrap().0
}

fn error(found: Estimate, truth: f64) -> f64 {
    (found.value - truth).abs()
}

/// A solid of known volume, area and derivatives of the volume.
struct Known {
    model: Model,
    volume: f64,
    area: f64,
    volume_by: Vec<f64>,
}

/// A ball of radius r at a place; by r, and by its place.
fn ball(random: &mut Random, spacing: f64) -> Known {
    let r = random.within(0.5, 0.9);
    let at = [(); 3].map(|()| random.within(-0.1, 0.1));
    let values = [r, at[0]];
    let model = Model::new(&values, Some(1.1), spacing, |graph, p| {
        let [_, y, z] = at.map(|u| graph.constant(u));
        primitives::sphere(graph).scale(graph, [p[0]; 3]).translate(graph, [p[1], y, z])
    });
    let (volume, area) = (4.0 / 3.0 * PI * r.powi(3), 4.0 * PI * r * r);
    Known { model, volume, area, volume_by: vec![area, 0.0] }
}

/// A torus in general position, by both radii.
fn torus(random: &mut Random, spacing: f64) -> Known {
    let (major, minor) = (random.within(0.5, 0.7), random.within(0.25, 0.4));
    let angle = random.within(0.0, 1.5);
    let model = Model::new(&[major, minor], Some(1.2), spacing, |graph, p| {
        let [angle, one, two] = [angle, 1.0, 2.0].map(|u| graph.constant(u));
        primitives::torus(graph, p[0], p[1]).rotate(graph, angle, [one, two, one])
    });
    let volume = 2.0 * PI * PI * major * minor * minor;
    let area = 4.0 * PI * PI * major * minor;
    Known { model, volume, area, volume_by: vec![volume / major, area] }
}

/// A cylinder cut flat by the box, by its radius.
fn cylinder(random: &mut Random, spacing: f64) -> Known {
    let r = random.within(0.4, 0.9);
    let model = Model::new(&[r], Some(1.0), spacing, |graph, p| {
        primitives::cylinder(graph).scale(graph, [p[0]; 3])
    });
    let (volume, around) = (2.0 * PI * r * r, 4.0 * PI * r);
    Known { model, volume, area: around + 2.0 * PI * r * r, volume_by: vec![around] }
}

/// A block with six creased faces inside of the box, by its half height.
fn block(random: &mut Random, spacing: f64) -> Known {
    let sides = [(); 3].map(|()| random.within(0.5, 0.9));
    let at = [(); 3].map(|()| random.within(-0.1, 0.1));
    let model = Model::new(&[sides[2]], Some(1.1), spacing, |graph, p| {
        let [x, y, _] = sides.map(|u| graph.constant(u));
        let at = at.map(|u| graph.constant(u));
        primitives::cube(graph).scale(graph, [x, y, p[0]]).translate(graph, at)
    });
    let [x, y, z] = sides;
    let (volume, area) = (8.0 * x * y * z, 8.0 * (x * y + y * z + z * x));
    Known { model, volume, area, volume_by: vec![8.0 * x * y] }
}

/// A ball with a slanted cut through it, by the height of the cut.
fn cap(random: &mut Random, spacing: f64) -> Known {
    let height = random.within(-0.5, 0.5);
    let normal = [(); 3].map(|()| random.within(0.2, 1.0));
    let model = Model::new(&[height], Some(1.1), spacing, |graph, p| {
        let normal = normal.map(|u| graph.constant(u));
        let cut = primitives::half_space(graph, normal, p[0]);
        primitives::sphere(graph).intersection(graph, cut)
    });
    let h = 1.0 + height;
    let cut = PI * (1.0 - height * height);
    let (volume, area) = (PI * h * h * (3.0 - h) / 3.0, 2.0 * PI * h + cut);
    Known { model, volume, area, volume_by: vec![cut] }
}

/// A shape of known measures at random, by the spacing.
type Shape = fn(&mut Random, f64) -> Known;

/// Compares estimates with the truth over many sizes; at most `misses` may lie outside.
fn check_enclosure(name: &str, shape: Shape, misses: [usize; 3]) {
    let mut missed = [0; 3];
    let mut worst = [0.0_f64; 3];
    for seed in 0..40 {
        let mut random = Random(seed);
        let spacing = random.within(0.03, 0.12);
        let known = shape(&mut random, spacing);
        let found = measures(&known.model);
        assert_eq!(found.unresolved, 0);
        let mut compare = |what: usize, found: Estimate, truth: f64| {
            let ratio = error(found, truth) / found.error.max(1e-12 * (1.0 + truth.abs()));
            worst[what] = worst[what].max(ratio);
            if ratio > 1.0 {
                missed[what] += 1;
                eprintln!("{name}, seed {seed}: {found:?} misses {truth} ({what})");
            }
        };
        compare(0, found.volume, known.volume);
        compare(1, found.area, known.area);
        for (found, truth) in found.volume_by.iter().zip(&known.volume_by) {
            compare(2, *found, *truth);
        }
    }
    eprintln!("{name}: worst {worst:?}, missed {missed:?} of 40");
    assert!((0..3).all(|i| missed[i] <= misses[i]), "{name}: {missed:?} of 40 missed");
}

/// Root mean squares of relative errors of volume and area at three spacings, each half the last;
/// `orders` are asked of volume and area from the first to the last.
fn check_order(name: &str, shape: Shape, orders: [f64; 2]) {
    let mean = |spacing: f64| {
        let mut squares = [0.0; 2];
        for seed in 0..8 {
            let known = shape(&mut Random(seed), spacing);
            let found = measures(&known.model);
            squares[0] += (error(found.volume, known.volume) / known.volume).powi(2) / 8.0;
            squares[1] += (error(found.area, known.area) / known.area).powi(2) / 8.0;
        }
        squares.map(f64::sqrt)
    };
    let errors = [0.12, 0.06, 0.03].map(mean);
    let order = [0, 1].map(|i| 0.5 * (errors[0][i] / errors[2][i]).log2());
    eprintln!("{name}: {errors:?}, orders {order:?}");
    assert!(order[0] >= orders[0] && order[1] >= orders[1], "{name}: {order:?}");
}

#[test]
fn errors_of_smooth_solids_are_enclosed() {
    check_enclosure("ball", ball, [0; 3]);
    check_enclosure("torus", torus, [0; 3]);
    check_enclosure("cylinder", cylinder, [0; 3]);
}

#[test]
fn errors_at_creases_are_enclosed_nearly_always() {
    check_enclosure("block", block, [2; 3]);
    check_enclosure("cap", cap, [2; 3]);
}

#[test]
fn the_order_is_the_fourth_on_smooth_surfaces_and_the_second_at_creases() {
    // The finest has the area of the ball to 1e-7, which is no longer a power of the spacing.
    check_order("ball", ball, [3.2, 2.4]);
    check_order("torus", torus, [4.0, 4.0]);
    check_order("cylinder", cylinder, [4.0, 4.0]);
    check_order("block", block, [1.8, 0.8]);
    check_order("cap", cap, [1.8, 0.8]);
}

#[test]
fn half_of_a_period_is_inside_the_gyroid() {
    for spacing in [0.1, 0.05, 0.043] {
        let model = Model::new(&[1.0, 0.0], None, spacing, |graph, p| {
            let cube = primitives::cube(graph);
            let part = surface(graph, "gyroid").dilate(graph, p[1]);
            part.intersection(graph, cube).scale(graph, [p[0]; 3])
        });
        let found = measures(&model);
        assert!(error(found.volume, 4.0) <= found.volume.error.max(1e-9), "{found:?}");
        // Twice the size holds eight times the volume, the surface with it.
        let by_scale = found.volume_by[0];
        assert!(error(by_scale, 12.0) <= by_scale.error.max(1e-3), "{found:?}");
    }
}

/// Compares what a job of one parameter measures of its field with its volume and area and the
/// derivative of the volume: to `tolerance`, and within the errors stated, which right-angled creases
/// exhaust, or rounding.
#[track_caller]
fn check_job(text: &str, value: f64, truths: [f64; 3], tolerance: f64) {
    let job = Job::parse_with(text, &[("a", value)]).unwrap();
    let bounds = Some(Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0)));
    let settings = JobSettings { bounds, ..JobSettings::with_spacing(0.1) };
    let found = job.field_measures(&settings, &Progress::new()).unwrap();
    let measures = [found.volume, found.area, found.by[0].derivatives.volume];
    for (found, truth) in measures.into_iter().zip(truths) {
        let off = error(found, truth);
        assert!(off < tolerance, "{text}, {value}: {found:?} is {off:e} off {truth}");
        assert!(
            off < 1.001 * found.error + 1e-12 * truth,
            "{text}, {value}: {found:?} misses {truth} by {off:e}"
        );
    }
}

#[test]
fn faces_just_beyond_nodes_are_where_they_are() {
    for beyond in [1e-12, 1e-9, 1e-6, 3e-5] {
        for a in [0.5 - beyond, 0.5 + beyond] {
            check_job("'x-a' box", a, [4.0 * (1.0 + a), 16.0 + 8.0 * a, 4.0], 1e-12);
        }
        let a = 0.5 + beyond;
        // Creases are cut off as far as the faces are from the nodes.
        let truths = [8.0 * a.powi(3), 24.0 * a * a, 24.0 * a * a];
        check_job("box scale a", a, truths, 1e-12 + 20.0 * beyond);
    }
}

#[test]
fn a_gyroid_that_the_box_cuts_is_measured_as_by_the_limit_of_meshes() {
    let job = Job::parse("gyroid dilate 0.35 box").unwrap();
    let mesh = |spacing: f64| {
        let found = job.totals(&JobSettings::with_spacing(spacing), &Progress::new()).unwrap();
        [found.volume, found.area]
    };
    let [finest, finer, coarse] = [0.01, 0.02, 0.05].map(mesh);
    let found = job.field_measures(&JobSettings::with_spacing(0.05), &Progress::new()).unwrap();
    for (i, found) in [found.volume, found.area].into_iter().enumerate() {
        let limit = finest[i] + (finest[i] - finer[i]) / 3.0;
        let off = error(found, limit) / limit;
        assert!(off < [2e-5, 6e-5][i], "{off}");
        assert!(50.0 * off < (coarse[i] / limit - 1.0).abs(), "{off}, {coarse:?}, {limit}");
        assert!(off < found.error / limit, "{found:?}, {limit}");
    }
}

#[test]
fn a_ball_of_a_field_that_jumps_is_extrapolated_from_flat_pieces() {
    // Crossings have no gradients: nothing is known of bulges, and errors are of second order.
    let job = Job::parse("floor(10*sqrt(x^2+y^2+z^2))-7.5").unwrap();
    let bounds = Some(Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0)));
    let settings = JobSettings { bounds, ..JobSettings::with_spacing(0.043) };
    let found = job.field_measures(&settings, &Progress::new()).unwrap();
    assert!(found.unresolved > 0);
    let r = 0.8_f64;
    for (found, truth) in
        [(found.volume, 4.0 / 3.0 * PI * r.powi(3)), (found.area, 4.0 * PI * r * r)]
    {
        let off = error(found, truth);
        assert!(off < found.error && off < 1e-4 * truth, "{off}: {found:?}, {truth}");
    }
}

#[test]
fn nothing_and_everything_have_no_error() {
    let full = |half: f64, graph: &mut Graph, _: &[NodeId]| -> Solid {
        let side = graph.constant(half);
        primitives::cube(graph).scale(graph, [side; 3])
    };
    for (half, volume, area) in [(2.0, 8.0, 24.0), (1.0, 8.0, 24.0)] {
        let model = Model::new(&[], Some(1.0), 0.17, |graph, p| full(half, graph, p));
        let found = measures(&model);
        assert!(error(found.volume, volume) < 1e-12 && error(found.area, area) < 1e-12);
        assert!(found.volume.error < 1e-12 && found.area.error < 1e-12);
    }
}
