//! Distances to meshes as they come: every public test mesh, clean or not, gives a field.
//!
//! The meshes are read from the folder that the environment variable `ALVEOLE_DATA` names.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod common;

use alveole::expr::{Oracle, Queries};
use alveole::field::{MeshDistance, Reason, SignMethod, mesh_distance};
use alveole::mesh::Mesh;
use alveole::num::Interval;
use common::{Uniform, real_meshes};
use glam::DVec3;

fn mesh(name: &str) -> Option<Mesh> {
    Some(alveole::mesh::io::read(&real_meshes()?.join(name)).unwrap())
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
    let Some(folder) = real_meshes() else { return };
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
fn stand_ins_lie_where_the_values_of_every_readable_mesh_do() {
    let Some(folder) = real_meshes() else { return };
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let Ok(mesh) = alveole::mesh::io::read(&path) else { continue };
        let field = mesh_distance(&mesh, "any").unwrap();
        let axes = grid(field.bounds(), 32);
        let exact = values(&field, &axes);
        let offset = 0.05 * field.bounds().size().max_element();
        for levels in [&[0.0][..], &[offset, -offset]] {
            let at = axes.each_ref().map(|axis| &axis[..]);
            let mut found = vec![0.0; exact.len()];
            field.brick_beside(at, levels, &mut found).unwrap();
            for (found, exact) in found.iter().zip(&exact) {
                for level in levels {
                    let name = format!("{}: {found:e} for {exact:e}", path.display());
                    assert_eq!(found.partial_cmp(level), exact.partial_cmp(level), "{name}");
                }
            }
        }
    }
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
    let Some(_) = real_meshes() else { return };
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

/// Squared distance from `p` to a triangle, by the regions of its plane (Ericson 2005, Real-Time
/// Collision Detection, section 5.1.5).
fn squared_to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let (ab, ac, ap, bp, cp) = (b - a, c - a, p - a, p - b, p - c);
    let (d1, d2, d3, d4, d5, d6) =
        (ab.dot(ap), ac.dot(ap), ab.dot(bp), ac.dot(bp), ab.dot(cp), ac.dot(cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let to = |q: DVec3| p.distance_squared(q);
    if d1 <= 0.0 && d2 <= 0.0 {
        to(a)
    } else if d3 >= 0.0 && d4 <= d3 {
        to(b)
    } else if d6 >= 0.0 && d5 <= d6 {
        to(c)
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        to(a + ab * (d1 / (d1 - d3)))
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        to(a + ac * (d2 / (d2 - d6)))
    } else if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        to(b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))))
    } else {
        let sum = va + vb + vc;
        to(a + ab * (vb / sum) + ac * (vc / sum))
    }
}

/// Triangles of three sizes anywhere in the cube [-1, 1]^3.
fn soup(random: &mut Uniform, count: u32) -> Mesh {
    let mut positions = Vec::new();
    for face in 0..count {
        let size = [0.5, 0.1, 0.02][face as usize % 3];
        let middle = anywhere(random);
        for _ in 0..3 {
            positions.push((middle + size * anywhere(random)).to_array());
        }
    }
    let triangles = (0..count).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    Mesh { positions, triangles }
}

/// A point of the cube [-1, 1]^3.
fn anywhere(random: &mut Uniform) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| 2.0 * random.next() - 1.0))
}

#[test]
fn magnitudes_are_the_least_over_all_faces() {
    for seed in 1..5 {
        let mut random = Uniform(seed);
        let mesh = soup(&mut random, 700);
        let field = mesh_distance(&mesh, "soup").unwrap();
        let corners =
            |face: &[u32; 3]| face.map(|vertex| DVec3::from_array(mesh.positions[vertex as usize]));
        // More points than are worth sorting, near and far.
        let points: Vec<DVec3> =
            (0..700).map(|i| anywhere(&mut random) * [1.0, 1.5, 40.0][i % 3]).collect();
        let [x, y, z] = [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect::<Vec<f64>>());
        let mut values = vec![0.0; points.len()];
        field.points(Queries { at: [&x, &y, &z], value: &mut values, gradient: None }).unwrap();
        for (p, value) in points.iter().zip(values) {
            let brute = mesh
                .triangles
                .iter()
                .map(|face| squared_to_triangle(*p, corners(face)))
                .fold(f64::INFINITY, f64::min)
                .sqrt();
            // Roundings in units of the coordinates.
            let error = (value.abs() - brute).abs();
            assert!(error <= 1e-14 * (1.0 + p.length()), "{p} {value} {brute} seed {seed}");
        }
    }
}

#[test]
fn ways_towards_roots_leave_no_trace_in_the_answers() {
    // Batches with gradients, each step a tenth as long as the one before, some lanes starting anew.
    for seed in 11..15 {
        let mut random = Uniform(seed);
        let field = mesh_distance(&soup(&mut random, 500), "soup").unwrap();
        let mut points: Vec<DVec3> = (0..200).map(|_| 1.2 * anywhere(&mut random)).collect();
        for round in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect::<Vec<f64>>());
            let mut values = vec![0.0; points.len()];
            let mut slopes = [(); 3].map(|()| vec![0.0; points.len()]);
            let gradient = Some(slopes.each_mut().map(|row| &mut row[..]));
            field.points(Queries { at: [&x, &y, &z], value: &mut values, gradient }).unwrap();
            for (i, value) in values.iter().enumerate() {
                let mut alone = [0.0];
                let at = [&x[i..=i], &y[i..=i], &z[i..=i]];
                field.points(Queries { at, value: &mut alone, gradient: None }).unwrap();
                assert_eq!(alone[0].to_bits(), value.to_bits(), "{} seed {seed}", points[i]);
            }
            for (i, point) in points.iter_mut().enumerate() {
                let slope = DVec3::new(slopes[0][i], slopes[1][i], slopes[2][i]);
                let step = 0.05 * 0.1_f64.powi(round) * anywhere(&mut random);
                *point = match i % 4 {
                    0 => *point - values[i] * slope,
                    1 => *point + step,
                    2 => *point + 0.01 * values[i] * anywhere(&mut random),
                    _ => 1.2 * anywhere(&mut random),
                };
            }
        }
    }
}
