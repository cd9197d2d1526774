//! Meshes cut by hand, next to which the surface passes nodes at any distance.

use super::*;
use crate::mesh::check::check;
use crate::mesh::measure::{measure, volume};
use std::convert::Infallible;

struct Never;

impl From<Cancelled> for Never {
    fn from(_: Cancelled) -> Self {
        Self
    }
}

impl From<Infallible> for Never {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

/// A ball of radius 0.7 in a box, its poles full of slivers: a globe of meridians and parallels.
fn globe() -> Mesh {
    let (meridians, parallels) = (64, 32);
    let mut mesh = Mesh { positions: vec![[0.0, 0.0, 0.7]], triangles: Vec::new() };
    for i in 1..parallels {
        let tilt = std::f64::consts::PI * f64::from(i) / f64::from(parallels);
        for j in 0..meridians {
            let turn = std::f64::consts::TAU * f64::from(j) / f64::from(meridians);
            let (ring, z) = (0.7 * tilt.sin(), 0.7 * tilt.cos());
            mesh.positions.push([ring * turn.cos(), ring * turn.sin(), z]);
        }
    }
    mesh.positions.push([0.0, 0.0, -0.7]);
    let south = mesh.positions.len() as u32 - 1;
    let at = |i: u32, j: u32| 1 + (i - 1) * meridians as u32 + j % meridians as u32;
    for j in 0..meridians as u32 {
        mesh.triangles.push([0, at(1, j), at(1, j + 1)]);
        for i in 1..parallels as u32 - 1 {
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        mesh.triangles.push([at(parallels as u32 - 1, j), south, at(parallels as u32 - 1, j + 1)]);
    }
    mesh
}

fn ball(points: &[[f64; 3]], out: &mut [[f64; 4]]) -> Result<(), Never> {
    ball_of(0.7, points, out)
}

fn ball_of(radius: f64, points: &[[f64; 3]], out: &mut [[f64; 4]]) -> Result<(), Never> {
    for (point, out) in points.iter().zip(out) {
        let [x, y, z] = *point;
        let length = (x * x + y * y + z * z).sqrt();
        *out = [length - radius, x / length, y / length, z / length];
    }
    Ok(())
}

fn cut() -> Cut {
    Cut { bounds: Aabb::new(glam::DVec3::splat(-1.0), glam::DVec3::splat(1.0)), spacing: 0.07 }
}

#[test]
fn a_globe_loses_its_slivers_and_stays_a_ball() {
    let mut mesh = globe();
    assert!(check(&mesh).is_sound());
    let before = measure(&mesh);
    let Ok(found) = remove(&mut mesh, &cut(), &Progress::new(), Some(&mut ball)) else {
        panic!("nothing fails")
    };
    let after = measure(&mesh);
    assert!(before.quality.least_angle_deg < 6.0 && found.slivers_before == 0);
    assert!(found.least_angle_deg > 20.0, "{found:?}");
    assert!((after.quality.least_angle_deg - found.least_angle_deg).abs() < 1e-9);
    assert!(found.merged > 100 && found.slivers == 0);
    let checked = check(&mesh);
    assert!(checked.is_sound(), "{:?}", checked.defects);
    assert_eq!(checked.euler, 2);
    let radii = mesh.positions.iter().map(|p| p.iter().map(|c| c * c).sum::<f64>().sqrt());
    assert!(radii.into_iter().all(|radius| (radius - 0.7).abs() < 1e-9 * 0.07 + 1e-15));
    let ideal = 4.0 / 3.0 * std::f64::consts::PI * 0.343;
    assert!((volume(&mesh) / ideal - 1.0).abs() < 0.01);
}

#[test]
fn without_a_field_vertices_stay_where_they_are() {
    let mut mesh = globe();
    let known: std::collections::HashSet<_> =
        mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect();
    let Ok(found) = remove::<Never>(&mut mesh, &cut(), &Progress::new(), None) else {
        panic!("nothing fails")
    };
    assert!(found.merged > 100 && found.slid == 0);
    assert!(mesh.positions.iter().all(|p| known.contains(&p.map(f64::to_bits))));
    assert!(check(&mesh).is_sound());
}

#[test]
fn no_vertex_slides_out_of_the_box() {
    let mut mesh = globe();
    // The surface lies beyond the sides of the box next to the axes.
    let side = 0.705;
    let cut =
        Cut { bounds: Aabb::new(glam::DVec3::splat(-side), glam::DVec3::splat(side)), ..cut() };
    let mut larger = |points: &[[f64; 3]], out: &mut [[f64; 4]]| ball_of(0.71, points, out);
    let Ok(found) = remove(&mut mesh, &cut, &Progress::new(), Some(&mut larger)) else {
        panic!("nothing fails")
    };
    assert!(found.slid > 100, "{found:?}");
    assert!(mesh.positions.iter().flatten().all(|c| c.abs() < side));
    assert!(check(&mesh).is_sound());
}

#[test]
fn a_tetrahedron_is_not_contracted() {
    // Two corners are one but for a millionth of a spacing.
    let mut mesh = Mesh {
        positions: vec![[0.0, 0.0, 0.0], [0.0, 0.0, 7e-8], [0.05, 0.0, 0.0], [0.0, 0.05, 0.0]],
        triangles: vec![[0, 3, 2], [1, 2, 3], [0, 1, 3], [0, 2, 1]],
    };
    assert!(check(&mesh).is_sound());
    let Ok(found) = remove::<Never>(&mut mesh, &cut(), &Progress::new(), None) else {
        panic!("nothing fails")
    };
    assert_eq!((found.merged, mesh.triangles.len()), (0, 4));
    assert!(check(&mesh).is_sound());
}

#[test]
fn cancelled_work_stops() {
    let progress = Progress::new();
    progress.cancel();
    assert!(remove(&mut globe(), &cut(), &progress, Some(&mut ball)).is_err());
}
