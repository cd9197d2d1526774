//! Distances to meshes as they come: every public test mesh, clean or not, gives a field.
//!
//! The meshes are read from the folder that the environment variable `ALVEOLE_DATA` names.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

use alveole::expr::{Oracle, Queries};
use alveole::field::{MeshDistance, Reason, SignMethod, mesh_distance};
use alveole::mesh::Mesh;
use alveole::num::Interval;
use std::path::PathBuf;

/// The folder of test meshes, if there is one.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("ALVEOLE_DATA").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: ALVEOLE_DATA names no folder of meshes");
    }
    folder
}

fn mesh(name: &str) -> Option<Mesh> {
    Some(alveole::mesh::io::read(&data()?.join(name)).unwrap())
}

fn field(name: &str) -> Option<MeshDistance> {
    Some(mesh_distance(&mesh(name)?, name).unwrap())
}

/// `n` coordinates an axis in the middle of equal cells of the bounds, grown by a tenth.
fn grid(bounds: alveole::geom::Aabb, n: usize) -> [Vec<f64>; 3] {
    let bounds = bounds.grown(0.1 * bounds.size());
    [0, 1, 2].map(|axis| {
        let step = bounds.size()[axis] / n as f64;
        (0..n).map(|i| bounds.lo[axis] + (i as f64 + 0.5) * step).collect()
    })
}

fn values(field: &MeshDistance, [x, y, z]: &[Vec<f64>; 3]) -> Vec<f64> {
    let mut values = vec![0.0; x.len() * y.len() * z.len()];
    field.brick([x, y, z], &mut values).unwrap();
    values
}

#[test]
fn every_readable_mesh_gives_finite_values_and_one_answer_a_point() {
    let Some(folder) = data() else { return };
    let mut fields = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let Ok(mesh) = alveole::mesh::io::read(&path) else { continue };
        let name = path.display().to_string();
        let field = mesh_distance(&mesh, &name).unwrap();
        let axes = grid(field.bounds(), 8);
        let bricks = values(&field, &axes);
        let range = field.range([0, 1, 2].map(|a| Interval::new(axes[a][0], axes[a][7])));
        for (n, brick) in bricks.iter().enumerate() {
            let at = [axes[0][n % 8], axes[1][n / 8 % 8], axes[2][n / 64]];
            let mut value = [0.0];
            let at = [&at[..1], &at[1..2], &at[2..]];
            field.points(Queries { at, value: &mut value, gradient: None }).unwrap();
            assert!(brick.is_finite() && value[0].to_bits() == brick.to_bits(), "{name}");
            assert!(range.contains(*brick), "{name}: {brick} {range:?}");
        }
        fields += 1;
    }
    assert!(fields > 40, "{fields} meshes");
}

#[test]
fn spoilt_copies_of_a_part_have_its_inside() {
    let Some(clean) = field("featuretype_clean.ply") else { return };
    assert_eq!(clean.report().method, SignMethod::Pseudonormals);
    let axes = grid(clean.bounds(), 40);
    let expected = values(&clean, &axes);
    let inside = expected.iter().filter(|v| **v < 0.0).count() as f64;
    let scale = clean.bounds().size().max_element();
    for name in [
        "featuretype.stl",
        "dirty_degenerate.ply",
        "dirty_duplicates.ply",
        "dirty_flipped.ply",
        "dirty_holes.ply",
        "dirty_inverted.ply",
        "dirty_needles.ply",
        "dirty_nonmanifold.ply",
    ] {
        let spoilt = field(name).unwrap();
        let found = values(&spoilt, &axes);
        // A hole of a few faces bulges by a part of its width: compare away from the surface.
        let wrong = expected
            .iter()
            .zip(&found)
            .filter(|(e, f)| e.abs() > 0.01 * scale && (**e < 0.0) != (**f < 0.0));
        assert_eq!(wrong.count(), 0, "{name}: {}", spoilt.report());
        let change = found.iter().filter(|v| **v < 0.0).count() as f64 / inside - 1.0;
        assert!(change.abs() < 0.01, "{name}: {change} {}", spoilt.report());
    }
}

#[test]
fn counted_volumes_are_those_of_the_meshes() {
    let Some(_) = data() else { return };
    for name in [
        "bunny_closed.obj",
        "wingnut.obj",
        "wingnut_1e7_far_f64.ply",
        "gearwheel_ascii.stl",
        "cube_huge.stl",
        "box_3x3x3_offset.stl",
        "spot_low.obj",
    ] {
        let mesh = mesh(name).unwrap();
        let field = mesh_distance(&mesh, name).unwrap();
        let bounds = field.bounds();
        // An additive sequence that spreads evenly over the box, so that flat faces along the axes
        // are not counted as whole layers of a grid.
        let steps = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
        let count = 60_000;
        let [x, y, z] = [0, 1, 2].map(|axis| -> Vec<f64> {
            let unit = |i: usize| (0.5 + steps[axis] * i as f64).fract();
            (0..count).map(|i| bounds.lo[axis] + unit(i) * bounds.size()[axis]).collect()
        });
        let mut values = vec![0.0; count];
        field.points(Queries { at: [&x, &y, &z], value: &mut values, gradient: None }).unwrap();
        let inside = values.iter().filter(|v| **v < 0.0).count() as f64 / count as f64;
        let volume = alveole::mesh::measure::volume(&mesh).abs();
        let ratio = inside * bounds.size().element_product() / volume;
        // Independent points would scatter by 0.4 % where half of the box is filled.
        assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
    }
}

#[test]
fn overlapping_copies_are_a_union() {
    let Some(both) = field("dirty_selfintersecting.ply") else { return };
    assert!(matches!(both.report().reason, Reason::Contradiction { .. }));
    let one = field("featuretype_clean.ply").unwrap();
    let axes = grid(both.bounds(), 32);
    let (union, part) = (values(&both, &axes), values(&one, &axes));
    // The first copy is the clean part: what is inside of it is inside of both.
    assert!(part.iter().zip(&union).all(|(p, u)| *p >= -1e-9 || *u < 0.0));
    assert!(union.iter().filter(|v| **v < 0.0).count() > part.iter().filter(|v| **v < 0.0).count());
}
