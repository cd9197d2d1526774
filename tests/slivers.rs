//! Snapping: no slivers are left, whatever the surface, and nothing else changes.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::cellular::tpms::CATALOGUE;
use alveole::job::{Job, Settings, Slivers};
use alveole::mesh::Mesh;
use alveole::mesh::check::check;
use alveole::mesh::measure::{measure, volume};
use alveole::mesh::weld::weld;
use rayon::ThreadPoolBuilder;

fn meshes(text: &str, spacing: f64) -> [Mesh; 2] {
    let job = common::job(text);
    [Slivers::Kept, Slivers::Removed].map(|slivers| {
        let settings = Settings { slivers, ..Settings::with_spacing(spacing) };
        job.mesh(&settings).unwrap()
    })
}

/// What a file of single precision holds of `mesh` is sound: no two vertices are one, no area is lost.
#[track_caller]
fn is_sound_in_single(text: &str, mesh: &Mesh) {
    let mut stored = mesh.clone();
    for position in &mut stored.positions {
        *position = position.map(|coordinate| f64::from(coordinate as f32));
    }
    let welded = weld(&mut stored);
    assert_eq!(welded.merged, 0, "{text}: vertices of one place");
    let found = check(&stored);
    assert!(found.is_sound(), "{text}: {:?}", found.defects);
}

/// The mesh is as sound, as large and of the same kind without its slivers as with them, and no angle is
/// below `least_deg`.
#[track_caller]
fn holds(text: &str, spacing: f64, least_deg: f64) {
    let [kept, removed] = meshes(text, spacing);
    is_sound_in_single(text, &removed);
    let (before, after) = (check(&kept), check(&removed));
    assert!(after.is_sound(), "{text}: {:?}", after.defects);
    assert_eq!(before.euler, after.euler, "{text}");
    assert_eq!(before.components.len(), after.components.len(), "{text}");
    let found = measure(&removed).quality.least_angle_deg;
    assert!(found > least_deg, "{text}: {found} degrees");
    let bounds = common::job(text).bounds().unwrap();
    let is_in_box = |p: &[f64; 3]| {
        let at = glam::DVec3::from_array(*p);
        at.cmpge(bounds.lo).all() && at.cmple(bounds.hi).all()
    };
    assert!(removed.positions.iter().all(is_in_box), "{text}: a vertex has left the box");
    let is_corner = |p: &&[f64; 3]| {
        let at = glam::DVec3::from_array(**p);
        (at.cmpeq(bounds.lo) | at.cmpeq(bounds.hi)).all()
    };
    let corners = |mesh: &Mesh| mesh.positions.iter().filter(is_corner).count();
    assert_eq!(corners(&kept), corners(&removed), "{text}: corners of the box");
    let change = volume(&removed) / volume(&kept) - 1.0;
    assert!(change.abs() < 3e-3, "{text}: the volume changed by {change}");
}

#[test]
fn surfaces_of_the_catalogue_have_no_angle_below_5_degrees() {
    for surface in &CATALOGUE {
        holds(&format!("{} box", surface.name), 2.0 / 64.0, 5.0);
    }
}

#[test]
fn edges_of_the_box_that_the_surface_touches_leave_no_slivers() {
    // The surface crosses the box's edges twice within a tenth of the spacing, or passes them as close.
    holds("q-star box", 2.0 / 40.0, 5.0);
    holds("q-star box", 2.0 / 50.0, 5.0);
    holds("c-g box", 2.0 / 55.0, 5.0);
}

#[test]
fn vertices_keep_to_their_side_of_walls_and_jumps() {
    for (text, spacing, is_resolved) in [
        ("'floor(4*x)-4*x+0.3' box", 0.1, true),
        ("'mod(x+y,0.3)-0.1' box", 0.1, true),
        // Of a wall thinner than a quarter of the spacing scraps are left, of whatever volume.
        ("gyroid thickness 0.03 box", 0.13, false),
    ] {
        let [kept, removed] = meshes(text, spacing);
        let coincident = |mesh: &Mesh| {
            let mut places: Vec<_> =
                mesh.positions.iter().map(|p| p.map(|c| (c as f32).to_bits())).collect();
            places.sort_unstable();
            places.windows(2).filter(|pair| pair[0] == pair[1]).count()
        };
        assert_eq!(coincident(&removed), coincident(&kept), "{text}");
        let change = volume(&removed) / volume(&kept) - 1.0;
        assert!(!is_resolved || change.abs() < 1e-3, "{text}: the volume changed by {change}");
    }
}

#[test]
fn where_a_surface_crosses_itself_files_hold_no_vertex_twice() {
    for text in ["w-surface torus union box", "f-surface torus union box"] {
        let [kept, removed] = meshes(text, 0.05);
        is_sound_in_single(text, &kept);
        is_sound_in_single(text, &removed);
        assert_eq!(check(&kept).euler, check(&removed).euler, "{text}");
    }
}

#[test]
fn smooth_solids_have_no_angle_below_20_degrees() {
    holds("sphere", 0.05, 20.0);
    holds("torus", 0.04, 20.0);
    holds("p-surface box", 0.05, 20.0);
    // Where a wall is cut at a slant its sharp edge keeps triangles thin.
    holds("gyroid sheet dilate 0.3 box", 0.03, 10.0);
}

#[test]
fn creases_lose_their_slivers_too() {
    holds("sphere sphere translate 0.7,0.3,0.2 union", 0.05, 5.0);
    holds("cylinder rotate 0.3 1,2,3 box scale 0.8 rotate 0.2 0,1,1 intersection", 0.05, 5.0);
}

#[test]
fn flat_cuts_stay_flat_and_corners_stay_corners() {
    let [kept, removed] = meshes("'x+2*y+3*z' box", 0.1);
    let corner = |mesh: &Mesh| mesh.positions.contains(&[-1.0, -1.0, -1.0]);
    assert!(corner(&kept) && corner(&removed));
    assert!((volume(&removed) - 4.0).abs() < 1e-4);
    let apart = |p: &[f64; 3]| (p[0] + 2.0 * p[1] + 3.0 * p[2]).abs();
    let on_box = |p: &[f64; 3]| p.iter().any(|c| c.abs() == 1.0);
    assert!(removed.positions.iter().all(|p| on_box(p) || apart(p) < 1e-9));
}

#[test]
fn vertices_stay_on_the_surface_and_files_do_not_depend_on_threads() {
    let job = common::job("gyroid box");
    let settings = Settings { slivers: Slivers::Removed, ..Settings::with_spacing(0.04) };
    let on = |threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| job.mesh(&settings)).unwrap()
    };
    let (one, four) = (on(1), on(4));
    assert_eq!(one, four);
    let wave =
        |a: f64, b: f64| (std::f64::consts::TAU * a).cos() * (std::f64::consts::TAU * b).sin();
    let value = |p: &[f64; 3]| wave(p[0], p[1]) + wave(p[1], p[2]) + wave(p[2], p[0]);
    let inside = one.positions.iter().filter(|p| p.iter().all(|c| c.abs() < 1.0));
    // The gradient is at most 2 sqrt(3) tau long.
    assert!(inside.map(value).all(|value: f64| value.abs() < 22.0 * 1e-9 * 0.04));
}

#[test]
fn a_job_reports_what_was_done() {
    let job: Job = common::job("neovius box");
    let settings = Settings { slivers: Slivers::Removed, ..Settings::with_spacing(0.05) };
    let grid = job.grid(&settings).unwrap();
    let mut sink = alveole::mesh::sink::Collect::default();
    let progress = alveole::num::Progress::new();
    let report = job.contour(&grid, &settings, &progress, &mut sink).unwrap();
    let (mesh, done) = (sink.into_mesh(), report.slivers.unwrap());
    assert_eq!(report.contour.triangles, mesh.triangles.len() as u64);
    assert!(done.slivers_before > 1000 && done.slivers == 0, "{done:?}");
    assert!(done.merged > 0 && done.flipped > 0 && done.slid > 0, "{done:?}");
}

#[test]
fn the_option_snap_removes_slivers_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let run = |program: &str, arguments: &[&str]| {
        let mut command = std::process::Command::new(program);
        let output = command.args(arguments).current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let options = ["--snap", "-q", "-s", "0.05", "--stats", "s.json", "-o", "p.stl"];
    run(env!("CARGO_BIN_EXE_cesogen"), &[&options[..], &["p-surface", "box"]].concat());
    let read = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let statistics = read(&std::fs::read_to_string(folder.path().join("s.json")).unwrap());
    assert_eq!(statistics["slivers"]["slivers"], 0);
    let checked = read(&run(env!("CARGO_BIN_EXE_alveole"), &["check", "--json", "p.stl"]));
    assert!(checked["quality"]["least_angle_deg"].as_f64().unwrap() > 20.0, "{checked}");
}
