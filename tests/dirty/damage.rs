//! Damage done to clean meshes, each kind as programs and scanners do it, and how much.

use alveole::job::{Job, Settings};
use alveole::mesh::Mesh;
use alveole::num::Random;

/// A clean mesh: closed, of more than one genus and curvature.
pub fn clean(program: &str, spacing: f64) -> Mesh {
    Job::parse(program).unwrap().mesh(&Settings::with_spacing(spacing)).unwrap()
}

/// Whether something happens to item `index`, with probability `part`.
fn happens(random: Random, index: usize, part: f64) -> bool {
    random.uniform(index as u64)[0] < part
}

/// Without that part of its faces; how many are gone.
pub fn holes(mesh: &mut Mesh, part: f64, random: Random) -> usize {
    let (before, mut index) = (mesh.triangles.len(), 0);
    mesh.triangles.retain(|_| {
        index += 1;
        !happens(random, index, part)
    });
    before - mesh.triangles.len()
}

/// With that part of its faces turned over; how many are.
pub fn flips(mesh: &mut Mesh, part: f64, random: Random) -> usize {
    let mut count = 0;
    for (index, corners) in mesh.triangles.iter_mut().enumerate() {
        if happens(random, index, part) {
            corners.swap(0, 1);
            count += 1;
        }
    }
    count
}

/// With that part of its faces twice, from another corner; how many are.
pub fn duplicates(mesh: &mut Mesh, part: f64, random: Random) -> usize {
    let chosen = mesh.triangles.iter().enumerate().filter(|(i, _)| happens(random, *i, part));
    let more: Vec<_> = chosen.map(|(_, [a, b, c])| [*b, *c, *a]).collect();
    mesh.triangles.extend(&more);
    more.len()
}

/// With that part of its faces cut in three about a point so near to a side that one of the three
/// is a needle; how many are.
pub fn needles(mesh: &mut Mesh, part: f64, random: Random) -> usize {
    let mut count = 0;
    for index in 0..mesh.triangles.len() {
        if happens(random, index, part) {
            let [a, b, c] = mesh.triangles[index];
            let [p, q, r] = [a, b, c].map(|v| mesh.positions[v as usize]);
            let inner = mesh.positions.len() as u32;
            let point = |i: usize| 0.6 * p[i] + 0.4 * q[i] + 1e-9 * (r[i] - p[i]);
            mesh.positions.push([0, 1, 2].map(point));
            mesh.triangles[index] = [a, b, inner];
            mesh.triangles.extend([[b, c, inner], [c, a, inner]]);
            count += 1;
        }
    }
    count
}

/// With faces whose corners are one or two positions, by other vertices; how many there are.
pub fn degenerates(mesh: &mut Mesh, part: f64, random: Random) -> usize {
    let mut count = 0;
    for index in 0..mesh.triangles.len() {
        if happens(random, index, part) {
            let [a, b, _] = mesh.triangles[index];
            let again = mesh.positions.len() as u32;
            mesh.positions.push(mesh.positions[a as usize]);
            mesh.triangles.push([a, again, b]);
            count += 1;
        }
    }
    count
}

/// With fins: faces that stand on an edge that two others have; how many there are.
pub fn fins(mesh: &mut Mesh, part: f64, random: Random) -> usize {
    let mut count = 0;
    for index in 0..mesh.triangles.len() {
        if happens(random, index, part) {
            let [a, b, c] = mesh.triangles[index];
            let [p, q, r] = [a, b, c].map(|v| glam::DVec3::from_array(mesh.positions[v as usize]));
            let tip = mesh.positions.len() as u32;
            let up = (q - p).cross(r - p).normalize_or_zero() * p.distance(q) * 0.5;
            mesh.positions.push((0.5 * (p + q) + up).to_array());
            mesh.triangles.push([a, b, tip]);
            count += 1;
        }
    }
    count
}

/// Every face with vertices of its own, those of a part of them off by the last bits of single precision.
pub fn cracks(mesh: &mut Mesh, part: f64, random: Random) {
    let mut soup = Mesh::default();
    for (index, corners) in mesh.triangles.iter().enumerate() {
        let first = soup.positions.len() as u32;
        for corner in corners {
            let mut point = mesh.positions[*corner as usize].map(|value| f64::from(value as f32));
            if happens(random, index, part) {
                point = point.map(|value| value * (1.0 + f64::from(f32::EPSILON)));
            }
            soup.positions.push(point);
        }
        soup.triangles.push([first, first + 1, first + 2]);
    }
    *mesh = soup;
}

/// Scaled, then moved along all axes.
pub fn moved(mesh: &mut Mesh, factor: f64, offset: f64) {
    for position in &mut mesh.positions {
        *position = position.map(|value| value * factor + offset);
    }
}

/// With a copy of itself, moved along x.
pub fn overlap(mesh: &mut Mesh, by: f64) {
    let first = mesh.positions.len() as u32;
    let copy: Vec<_> = mesh.positions.iter().map(|[x, y, z]| [x + by, *y, *z]).collect();
    mesh.positions.extend(copy);
    let copy: Vec<_> = mesh.triangles.iter().map(|t| t.map(|v| v + first)).collect();
    mesh.triangles.extend(copy);
}
