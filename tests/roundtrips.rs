//! Solids that pass through files: round trips, lattices laid into one another step by step, and
//! parts filled with lattices.
//!
//! A mesh read back and contoured on the grid that made it is a fixed point: each of its vertices
//! lies on a grid edge, where its distance has a root. Source of the experiments: the Cesogen
//! paper, section 4.2.
#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stdout, reason = "measured errors, and what is skipped")]

mod common;

use alveole::eval::interpret;
use alveole::geom::Aabb;
use alveole::job::{Job, Settings};
use alveole::mesh::Mesh;
use alveole::mesh::io::{self, Format, Precision};
use alveole::mesh::measure::volume;
use common::{assert_sound, job};
use glam::DVec3;
use serde_json::Value;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;

fn cube(half: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half), DVec3::splat(half))
}

/// The sound mesh of a program's words on the grid of `bounds`.
fn mesh(words: &[&str], spacing: f64, bounds: Aabb) -> Mesh {
    let job = Job::new(&words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>()).unwrap();
    let settings = Settings { bounds: Some(bounds), ..Settings::with_spacing(spacing) };
    let mesh = job.mesh(&settings).unwrap_or_else(|fault| panic!("{words:?}: {fault}"));
    assert_sound(&format!("{words:?}"), &mesh);
    mesh
}

fn write(mesh: &Mesh, path: &Path) {
    let mut file = BufWriter::new(File::create(path).unwrap());
    io::write(mesh, Format::Ply, Precision::Double, &mut file).unwrap();
}

/// What round trips did to a mesh.
#[derive(Debug)]
struct Drift {
    /// The greatest way of a vertex from its first place, in spacings.
    vertex: f64,
    /// The relative change of the volume.
    volume: f64,
}

/// The solid of Figure 10.
const FIGURE_10: &str = "box scale 4,4,4 sphere scale 4,4,4 gyroid scale 4,4,4";

/// Writes and reads and contours the solid of Figure 10 `trips` times on its own grid.
fn round_trips(spacing: f64, trips: usize) -> Drift {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trip.ply");
    let bounds = cube(4.0);
    let first = mesh(&FIGURE_10.split(' ').collect::<Vec<_>>(), spacing, bounds);
    let mut last = first.clone();
    for trip in 1..=trips {
        write(&last, &path);
        last = mesh(&[path.to_str().unwrap()], spacing, bounds);
        assert!(last.triangles == first.triangles, "other triangles after {trip} trips");
    }
    let moved = first
        .positions
        .iter()
        .zip(&last.positions)
        .map(|(a, b)| (DVec3::from_array(*a) - DVec3::from_array(*b)).length() / spacing);
    Drift {
        vertex: moved.fold(0.0, f64::max),
        volume: (volume(&last) / volume(&first) - 1.0).abs(),
    }
}

/// Checks that vertices stay: a trip moves none by more than rounding.
fn check_round_trips(spacing: f64, trips: usize) {
    let drift = round_trips(spacing, trips);
    // A part in 1e14 a trip, where vertices are not fixed to the bit.
    let most = 2e-14 * trips as f64;
    assert!(drift.vertex < most && drift.volume < 1e-13, "{drift:?}");
}

#[test]
fn round_trips_leave_a_mesh_as_it_is() {
    check_round_trips(4.0 / 20.0, 10);
}

#[test]
#[ignore = "300 seconds"]
fn a_hundred_round_trips_at_the_spacing_of_the_paper_leave_a_mesh_as_it_is() {
    check_round_trips(4.0 / 100.0, 100);
}

/// The shapes of Figure 5, each intersected with what precedes it.
const HIERARCHY: [&str; 4] = [
    "box scale 4,4,4 sphere scale 5,5,5",
    "p-surface scale 4,4,4",
    "d-surface scale 3.75,3.75,3.75",
    "gyroid scale 1.25,1.25,1.25",
];

/// Distances of a mesh to a field's surface, as values of the field relative to the diagonal of the
/// grid: root of the mean square, and greatest.
#[derive(Debug)]
struct Errors {
    points: [f64; 2],
    centres: [f64; 2],
}

fn errors(mesh: &Mesh, reference: &Job, bounds: Aabb) -> Errors {
    let (graph, field) = reference.field();
    let of = |points: &[DVec3]| {
        let at: [Vec<f64>; 3] = [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect());
        let mut values = vec![0.0; points.len()];
        let at = at.each_ref().map(|list| &list[..]);
        interpret::points(graph, &[field], at, &[], &mut [&mut values]).unwrap();
        let mean = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        let greatest = values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        [mean.sqrt(), greatest].map(|error| error / bounds.size().length())
    };
    let points: Vec<_> = mesh.positions.iter().map(|p| DVec3::from_array(*p)).collect();
    let centre =
        |corners: &[u32; 3]| corners.map(|v| points[v as usize]).iter().sum::<DVec3>() / 3.0;
    let centres: Vec<_> = mesh.triangles.iter().map(centre).collect();
    Errors { points: of(&points), centres: of(&centres) }
}

/// Makes the solid of Figure 5 at once and by steps through files, and compares each step.
fn check_hierarchy(spacing: f64) {
    let folder = tempfile::tempdir().unwrap();
    let bounds = cube(4.0);
    let mut read = String::new();
    for (step, shape) in HIERARCHY.iter().enumerate() {
        let program = HIERARCHY[..=step].join(" ");
        let reference = job(&program);
        let direct = mesh(&program.split(' ').collect::<Vec<_>>(), spacing, bounds);
        let words: Vec<&str> = std::iter::once(read.as_str()).chain(shape.split(' ')).collect();
        let sequential = mesh(&words[usize::from(step == 0)..], spacing, bounds);
        let path = folder.path().join(format!("step{step}.ply"));
        write(&sequential, &path);
        read = path.to_str().unwrap().to_owned();

        let [by_steps, at_once] =
            [&sequential, &direct].map(|mesh| errors(mesh, &reference, bounds));
        println!("{program} at {spacing}:\n  at once  {at_once:?}\n  by steps {by_steps:?}");
        for (a, b) in [(by_steps.centres, at_once.centres), (by_steps.points, at_once.points)] {
            assert!(a[0] <= 2.0 * b[0], "{a:?} by steps, {b:?} at once");
        }
        let [a, b] = [volume(&sequential), volume(&direct)];
        assert!((a / b - 1.0).abs() < 1e-3, "{program}: {a} by steps, {b} at once");
    }
}

#[test]
fn a_hierarchy_made_by_steps_is_as_good_as_at_once() {
    check_hierarchy(4.0 / 50.0);
}

#[test]
#[ignore = "40 seconds"]
fn a_hierarchy_at_the_spacing_of_the_paper_made_by_steps_is_as_good_as_at_once() {
    check_hierarchy(4.0 / 130.0);
}

/// What `alveole study` prints as JSON.
fn study(experiment: &str, arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_alveole"))
        .args(["study", experiment, "-q", "--json"])
        .args(arguments)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.is_empty(), "{arguments:?}: {said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The four errors that a mesh of an experiment has, by the values of the field.
fn four(mesh: &Value) -> [f64; 4] {
    let of = |place: &str, norm: &str| mesh["values"][place][norm].as_f64().unwrap();
    [of("points", "l2"), of("points", "max"), of("centres", "l2"), of("centres", "max")]
}

/// Holds the errors that a command told of the mesh of `program` to those that are computed here.
fn check_errors(told: &Value, program: &str, spacing: f64) {
    let words: Vec<&str> = program.split(' ').collect();
    let bounds = cube(4.0);
    let Errors { points, centres } = errors(&mesh(&words, spacing, bounds), &job(program), bounds);
    let here = [points[0], points[1], centres[0], centres[1]];
    for (told, here) in four(told).into_iter().zip(here) {
        assert!((told / here - 1.0).abs() < 1e-9, "{told} told, {here} here");
    }
}

#[test]
fn the_command_for_round_trips_finds_the_fixed_point() {
    let words: Vec<&str> = FIGURE_10.split(' ').collect();
    let found = study("roundtrip", &[&["-s", "4/20", "--times", "20"], &words[..]].concat());
    let trips = found["trips"].as_array().unwrap();
    assert_eq!(trips.len(), 21);
    check_errors(&trips[0], FIGURE_10, 4.0 / 20.0);
    for trip in trips {
        assert!(trip["moved"].as_f64().unwrap() < 4e-13, "{trip}");
        assert_eq!((&trip["sound"], &trip["euler"]), (&true.into(), &trips[0]["euler"]));
        for (error, first) in four(trip).into_iter().zip(four(&trips[0])) {
            assert!((error / first - 1.0).abs() < 1e-6, "{error} from {first}: {trip}");
        }
    }
}

#[test]
fn on_shifted_grids_a_trip_loses_what_is_of_second_order() {
    let words: Vec<&str> = FIGURE_10.split(' ').collect();
    let of = |spacing| {
        let options = ["--shift", "--times", "3", "-s", spacing];
        let found = study("roundtrip", &[&options, &words[..]].concat());
        let trips = found["trips"].as_array().unwrap().clone();
        for trip in &trips {
            assert_eq!((&trip["sound"], &trip["euler"]), (&true.into(), &trips[0]["euler"]));
        }
        let volume = |trip: usize| trips[trip]["volume"].as_f64().unwrap();
        // What the first trip loses, a later one, and the error of points after three.
        [volume(0) - volume(1), volume(2) - volume(3), four(&trips[3])[0]]
    };
    let [coarse, fine] = ["4/20", "4/40"].map(of);
    println!("{coarse:?} at 4/20, {fine:?} at 4/40");
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        // At sharp edges, a part of first order of all points, those are off by first order: by the square
        // root of three orders in the mean square.
        assert!(fine > 0.0 && (2.5..5.0).contains(&(coarse / fine)), "{coarse} and {fine}");
    }
}

#[test]
fn the_command_for_hierarchies_finds_steps_as_good_as_all_at_once() {
    let found = study("hierarchy", &[&["-s", "4/50"], &HIERARCHY[..]].concat());
    let steps = found.as_array().unwrap();
    assert_eq!(steps.len(), HIERARCHY.len());
    check_errors(&steps[2]["direct"], &HIERARCHY[..3].join(" "), 4.0 / 50.0);
    for step in steps {
        let ratio = four(&serde_json::json!({ "values": step["ratio"] }));
        assert!(ratio.iter().all(|ratio| *ratio <= 2.0), "{step}");
        assert_eq!(step["sequential"]["euler"], step["direct"]["euler"]);
        let of = |way: &str| step[way]["volume"].as_f64().unwrap();
        assert!((of("sequential") / of("direct") - 1.0).abs() < 1e-3, "{step}");
        assert_eq!(step["sequential"]["sound"], true);
    }
}

#[test]
fn a_bunny_is_filled_by_a_gyroid() {
    let Ok(folder) = std::env::var("ALVEOLE_DATA") else {
        println!("skipped: ALVEOLE_DATA names no folder with bunny_closed.obj");
        return;
    };
    let bunny = format!("{folder}/bunny_closed.obj");
    let bounds = job(&bunny).bounds().unwrap();
    let spacing = bounds.size().max_element() / 100.0;
    let whole = volume(&mesh(&[&bunny], spacing, bounds));
    let read = volume(&io::read(Path::new(&bunny)).unwrap());
    // Folds and ears about as thin as the spacing are chamfered.
    assert!((whole / read - 1.0).abs() < 5e-3, "{whole} of {read}");
    let filled = volume(&mesh(&[&bunny, "gyroid", "scale", "0.2"], spacing, bounds));
    // Half of space, and the bunny holds about a hundred cells.
    assert!((filled / whole - 0.5).abs() < 0.02, "{filled} of {whole}");
    let words = [&bunny, "gyroid", "scale", "0.2", "complement"];
    let rest = volume(&mesh(&words, spacing, bounds));
    // Both are chamfered along the edges where the gyroid meets the skin.
    assert!(((filled + rest) / whole - 1.0).abs() < 1e-2, "{filled} and {rest} of {whole}");
}
