//! Sides of points about damaged meshes, against the clean ones.

use super::damage;
use alveole::expr::{Oracle, Queries};
use alveole::field::{MeshDistance, Reason, SignMethod, mesh_distance};
use alveole::job::{Job, Settings};
use alveole::mesh::io::{self, Format, Precision};
use alveole::mesh::{Mesh, check, measure};
use alveole::num::Random;

/// The clean solids and the spacing of their meshes.
const CLEAN: [(&str, f64); 3] = [
    ("torus", 0.1),
    ("gyroid scale 1.4 dilate 0.2 sphere", 0.1),
    ("box sphere scale 0.6 difference box scale 0.3 translate 0.8,0.8,0.8 union", 0.13),
];

/// Nearer to the surface, sides are a matter of rounding.
const EXACT: f64 = 1e-9;

/// Coordinates of points in the middle of `n` cells an axis of the box around the mesh.
fn points(mesh: &Mesh, n: usize) -> [Vec<f64>; 3] {
    let measures = measure(mesh);
    let mut at: [Vec<f64>; 3] = Default::default();
    for k in 0..n * n * n {
        let place = [k % n, k / n % n, k / n / n];
        for axis in 0..3 {
            let (lo, hi) = (measures.lo[axis], measures.hi[axis]);
            at[axis].push(lo + (hi - lo) * (place[axis] as f64 + 0.5) / n as f64);
        }
    }
    at
}

fn values(field: &MeshDistance, at: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut value = vec![0.0; at[0].len()];
    let at = at.each_ref().map(|axis| axis.as_slice());
    field.points(Queries { at, value: &mut value, gradient: None }).unwrap();
    value
}

/// Points on the wrong side that are more than `margin` sizes of the mesh away from the surface.
fn wrong(clean: &Mesh, dirty: &MeshDistance, margin: f64) -> (usize, usize) {
    let expected = mesh_distance(clean, "clean").unwrap();
    assert_eq!(expected.report().method, SignMethod::Pseudonormals, "{}", expected.report());
    let at = points(clean, 24);
    let margin = margin * expected.bounds().size().max_element();
    let (expected, found) = (values(&expected, &at), values(dirty, &at));
    let far = expected.iter().zip(&found).filter(|(e, _)| e.abs() > margin);
    (far.clone().filter(|(e, f)| (**e < 0.0) != (**f < 0.0)).count(), far.count())
}

/// What is made of the mesh in a program is closed, and has about the volume of the clean one.
fn assert_closed(name: &str, clean: &Mesh, dirty: &Mesh, tolerance: f64) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dirty.ply");
    let mut file = Vec::new();
    io::write(dirty, Format::Ply, Precision::Double, &mut file).unwrap();
    std::fs::write(&path, file).unwrap();
    let job = Job::new(&[path.display().to_string()]).unwrap();
    let size = job.bounds().unwrap().size().max_element();
    let mesh = job.mesh(&Settings::with_spacing(size / 40.0)).unwrap();
    let found = check(&mesh);
    assert!(found.is_sound(), "{name}: {:?}", found.defects);
    let (volume, expected) = (measure(&mesh).volume, measure(clean).volume);
    assert!((volume / expected - 1.0).abs() < tolerance, "{name}: {volume} for {expected}");
}

/// Damages every clean mesh by `damage`, which says how often it struck, and holds the copy to the
/// clean one, but for points nearer to its surface than `margin` sizes, and its report to `said`.
fn check_damage(
    name: &str,
    margin: f64,
    damage: impl Fn(&mut Mesh, Random) -> usize,
    said: impl Fn(&MeshDistance, usize) -> bool,
) {
    for (number, (program, spacing)) in CLEAN.into_iter().enumerate() {
        let clean = damage::clean(program, spacing);
        let mut dirty = clean.clone();
        let count = damage(&mut dirty, Random::new(5, number as u32));
        assert!(count > 0, "{name} spared {program}");
        let field = mesh_distance(&dirty, name).unwrap();
        assert!(said(&field, count), "{name}, {program}: {count}, but {}", field.report());
        let (wrong, of) = wrong(&clean, &field, margin);
        assert_eq!(wrong, 0, "{name}, {program}: of {of}; {}", field.report());
        assert!(of > 5000, "{of}");
        assert_closed(&format!("{name}, {program}"), &clean, &dirty, 0.05);
    }
}

#[test]
fn holes_are_told_and_closed() {
    for part in [0.005, 0.03] {
        check_damage(
            "holes",
            0.02,
            |mesh, random| damage::holes(mesh, part, random),
            |field, count| {
                let report = field.report();
                let Reason::Open { edges } = report.reason else { return false };
                // A hole has three edges; holes side by side share some.
                report.method == SignMethod::WindingNumbers && (count..=3 * count).contains(&edges)
            },
        );
    }
}

#[test]
fn faces_turned_over_are_turned_back_to_the_last() {
    for part in [0.01, 0.25] {
        check_damage(
            "flips",
            EXACT,
            |mesh, random| damage::flips(mesh, part, random),
            |field, count| field.report().repairs.turned_faces == count,
        );
    }
}

#[test]
fn a_mesh_inside_out_is_turned_over() {
    check_damage(
        "inside out",
        EXACT,
        |mesh, random| damage::flips(mesh, 2.0, random),
        |field, _| field.report().repairs.inverted || field.report().repairs.turned_faces > 0,
    );
}

#[test]
fn repeated_and_degenerate_faces_are_counted_and_left_out() {
    check_damage(
        "duplicates",
        EXACT,
        |mesh, random| damage::duplicates(mesh, 0.2, random),
        |field, count| {
            let report = field.report();
            report.repairs.repeated_faces == count && report.method == SignMethod::Pseudonormals
        },
    );
    check_damage(
        "degenerates",
        EXACT,
        |mesh, random| damage::degenerates(mesh, 0.2, random),
        |field, count| {
            let report = field.report();
            report.repairs.degenerate_faces == count && report.method == SignMethod::Pseudonormals
        },
    );
}

#[test]
fn needles_and_cracks_do_no_harm() {
    check_damage(
        "needles",
        1e-6,
        |mesh, random| damage::needles(mesh, 0.3, random),
        |field, _| field.report().faces > 0,
    );
    check_damage(
        "cracks",
        1e-4,
        |mesh, random| {
            damage::cracks(mesh, 0.2, random);
            1
        },
        |field, _| matches!(field.report().reason, Reason::Open { .. }),
    );
}

#[test]
fn fins_are_told() {
    check_damage(
        "fins",
        0.02,
        |mesh, random| damage::fins(mesh, 0.002, random),
        |field, count| matches!(field.report().reason, Reason::Crowded { edges } if edges.abs_diff(count) <= count / 4),
    );
}

#[test]
fn all_damage_at_once_leaves_the_inside() {
    check_damage(
        "all",
        0.02,
        |mesh, random| {
            damage::duplicates(mesh, 0.05, random);
            damage::degenerates(mesh, 0.05, random);
            damage::needles(mesh, 0.05, random);
            damage::holes(mesh, 0.01, random);
            damage::cracks(mesh, 0.05, random);
            1
        },
        |field, _| field.report().method == SignMethod::WindingNumbers,
    );
}

#[test]
fn bodies_that_overlap_are_their_union() {
    for (program, spacing) in CLEAN {
        let clean = damage::clean(program, spacing);
        let by = 0.37;
        let mut dirty = clean.clone();
        damage::overlap(&mut dirty, by);
        let field = mesh_distance(&dirty, "overlap").unwrap();
        let one = mesh_distance(&clean, "one").unwrap();
        let at = points(&dirty, 24);
        let shifted = [at[0].iter().map(|x| x - by).collect(), at[1].clone(), at[2].clone()];
        let (first, second) = (values(&one, &at), values(&one, &shifted));
        let found = values(&field, &at);
        let wrong = first.iter().zip(&second).zip(&found).filter(|((a, b), found)| {
            let expected = a.min(**b);
            expected.abs() > 1e-6 && (expected < 0.0) != (**found < 0.0)
        });
        assert_eq!(wrong.count(), 0, "{program}: {}", field.report());
    }
}

#[test]
fn size_and_place_do_not_matter() {
    for (program, spacing) in CLEAN {
        let clean = damage::clean(program, spacing);
        for (factor, offset) in [(1e-7, 0.0), (1e7, 0.0), (1.0, 1e7), (1e-3, 1.0), (1e7, -1e9)] {
            let mut moved = clean.clone();
            damage::moved(&mut moved, factor, offset);
            let name = format!("{program}, {factor:e}, {offset:e}");
            let mut dirty = moved.clone();
            let count = damage::flips(&mut dirty, 0.25, Random::new(6, 0));
            damage::duplicates(&mut dirty, 0.1, Random::new(6, 1));
            let field = mesh_distance(&dirty, &name).unwrap();
            assert_eq!(field.report().repairs.turned_faces, count, "{name}: {}", field.report());
            let (wrong, of) = wrong(&moved, &field, 1e-3);
            assert_eq!(wrong, 0, "{name}: of {of}; {}", field.report());
            assert_closed(&name, &moved, &dirty, 0.03);
        }
    }
}
