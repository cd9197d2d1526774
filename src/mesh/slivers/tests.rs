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
    Cut {
        bounds: Aabb::new(glam::DVec3::splat(-1.0), glam::DVec3::splat(1.0)),
        spacing: 0.07,
        precision: Precision::Double,
    }
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

/// A closed thread along z of three edges, `width` wide, its rings a spacing apart: w, e and n of each,
/// then both tips. It lies where `crossing` is zero.
fn thread(width: f64) -> Mesh {
    let (rings, h) = (6_u32, cut().spacing);
    let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
    for i in 0..rings {
        let z = h * f64::from(i);
        mesh.positions.extend([[-width, 0.0, z], [width, 0.0, z], [0.0, width, z]]);
    }
    mesh.positions.extend([[0.0, 0.0, -h], [0.0, 0.0, h * f64::from(rings)]]);
    let (below, above) = (3 * rings, 3 * rings + 1);
    for side in 0..3 {
        let at = |ring: u32| [3 * ring + side, 3 * ring + (side + 1) % 3];
        let [a, b] = at(0);
        mesh.triangles.push([below, b, a]);
        for ring in 1..rings {
            let ([a, b], [c, d]) = (at(ring - 1), at(ring));
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
        let [a, b] = at(rings - 1);
        mesh.triangles.push([above, a, b]);
    }
    mesh
}

/// Two planes that cross along z.
fn crossing(points: &[[f64; 3]], out: &mut [[f64; 4]]) -> Result<(), Never> {
    for ([x, y, _], out) in points.iter().zip(out) {
        *out = [x * y, *y, *x, 0.0];
    }
    Ok(())
}

#[test]
fn a_thread_widens_along_the_surface() {
    let mut mesh = thread(1e-3 * cut().spacing);
    assert!(check(&mesh).is_sound());
    let Ok(found) = remove(&mut mesh, &cut(), &Progress::new(), Some(&mut crossing)) else {
        panic!("nothing fails")
    };
    assert!(found.slivers_before >= 36 && found.slivers == 0, "{found:?}");
    let checked = check(&mesh);
    assert!(checked.is_sound(), "{:?}", checked.defects);
    assert_eq!(checked.euler, 2);
    assert!(mesh.positions.iter().all(|[x, y, _]| x.abs().min(y.abs()) < 1e-9 * cut().spacing));
}

#[test]
fn a_block_gets_the_edge_back_that_a_narrow_strip_cuts_off() {
    // A prism over a square without one of its corners, in eight storeys.
    let (c, storeys) = (1e-3, 8_u32);
    let outline = [[c - 1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, c - 1.0]];
    let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
    for storey in 0..=storeys {
        let z = -1.0 + 2.0 * f64::from(storey) / f64::from(storeys);
        mesh.positions.extend(outline.map(|[x, y]| [x, y, z]));
    }
    for side in 0..5 {
        for storey in 0..storeys {
            let [a, b] = [5 * storey + side, 5 * storey + (side + 1) % 5];
            mesh.triangles.extend([[a, b, b + 5], [a, b + 5, a + 5]]);
        }
    }
    for [a, b, c] in [[2, 3, 4], [2, 4, 0], [2, 0, 1]] {
        mesh.triangles.extend([[a, c, b], [a, b, c].map(|corner| corner + 5 * storeys)]);
    }
    assert!(check(&mesh).is_sound());
    let Ok(found) = remove::<Never>(&mut mesh, &cut(), &Progress::new(), None) else {
        panic!("nothing fails")
    };
    assert_eq!((found.merged, found.slivers), (storeys as usize + 1, 0), "{found:?}");
    assert!(check(&mesh).is_sound());
    assert!((volume(&mesh) - 8.0).abs() < 1e-12);
    let is_corner = |p: &&[f64; 3]| p.iter().all(|c| c.abs() == 1.0);
    assert_eq!(mesh.positions.iter().filter(is_corner).count(), 8);
}

/// A vase: a neck of three edges between two wider rings, one of them a thousandth of a spacing long.
fn vase() -> Mesh {
    let h = cut().spacing;
    let ring = |z: f64, corners: [[f64; 2]; 3]| corners.map(|[x, y]| [h * x, h * y, h * z]);
    let wide = [[-0.5, -0.3], [0.5, -0.3], [0.0, 0.7]];
    let narrow = [[-0.0005, -0.2], [0.0005, -0.2], [0.0, 0.4]];
    let mut mesh = Mesh { positions: Vec::new(), triangles: vec![[0, 2, 1], [6, 7, 8]] };
    mesh.positions.extend([ring(0.0, wide), ring(0.7, narrow), ring(1.4, wide)].concat());
    for [below, above] in [[0, 3], [3, 6]] {
        for side in 0..3 {
            let next = (side + 1) % 3;
            let [a, b, c, d] = [below + side, below + next, above + side, above + next];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// Zero everywhere: the surface is wherever a vertex goes.
fn anywhere(_: &[[f64; 3]], out: &mut [[f64; 4]]) -> Result<(), Never> {
    out.fill([0.0, 1.0, 0.0, 0.0]);
    Ok(())
}

#[test]
fn a_neck_of_three_edges_gets_a_fourth_for_the_one_that_goes() {
    let mut sheets = Sheets::new(vase(), &cut());
    assert!(check(&sheets.mesh).is_sound());
    assert_eq!(contract::contract(&mut sheets, cut().spacing), 0);
    let Ok(done) = split::split(&mut sheets, cut().spacing, &mut anywhere) else {
        panic!("nothing fails")
    };
    assert_eq!(done, [1, 1]);
    let (slivers, least_deg) = sheets.slivers();
    assert!(slivers == 0, "{least_deg}");
    let checked = check(&sheets.into_mesh());
    assert!(checked.is_sound(), "{:?}", checked.defects);
    assert_eq!(checked.euler, 2);
}

#[test]
fn cancelled_work_stops() {
    let progress = Progress::new();
    progress.cancel();
    assert!(remove(&mut globe(), &cut(), &progress, Some(&mut ball)).is_err());
}
