//! Closed meshes with known measures, for tests.

use super::Mesh;
use rustc_hash::FxHashMap;

/// The cube [0, 1]^3: 8 vertices, 12 triangles.
pub fn cube() -> Mesh {
    let positions = (0..8_u32).map(|c| [0, 1, 2].map(|axis| f64::from(c >> axis & 1))).collect();
    let quads: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { positions, triangles }
}

/// The corner of the unit cube at the origin: volume 1/6.
pub fn tetrahedron() -> Mesh {
    Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    }
}

/// An octahedron in the unit sphere, each triangle divided into four `times` times, its vertices
/// moved to the sphere.
pub fn sphere(times: u32) -> Mesh {
    let mut positions = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut p = [0.0; 3];
            p[axis] = sign;
            positions.push(p);
        }
    }
    let mut triangles = Vec::new();
    for octant in 0..8_u32 {
        let [x, y, z] = [0, 1, 2].map(|axis| 2 * axis + (octant >> axis & 1));
        triangles.push(if octant.count_ones() % 2 == 0 { [x, y, z] } else { [y, x, z] });
    }
    for _ in 0..times {
        let mut middles: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum = [0, 1, 2].map(|k| positions[a as usize][k] + positions[b as usize][k]);
                let length = sum.iter().map(|s| s * s).sum::<f64>().sqrt();
                positions.push(sum.map(|s| s / length));
                positions.len() as u32 - 1
            })
        };
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    Mesh { positions, triangles }
}

/// A torus of `n` by `n` quadrilaterals.
pub fn torus(n: u32) -> Mesh {
    let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let mut mesh = Mesh::default();
    for i in 0..n {
        for j in 0..n {
            let ring = 1.0 + 0.4 * angle(j).cos();
            mesh.positions.push([
                ring * angle(i).cos(),
                ring * angle(i).sin(),
                0.4 * angle(j).sin(),
            ]);
            let at = |i: u32, j: u32| i % n * n + j % n;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Both meshes in one.
pub fn both(mut first: Mesh, second: &Mesh) -> Mesh {
    let offset = first.positions.len() as u32;
    first.positions.extend_from_slice(&second.positions);
    first.triangles.extend(second.triangles.iter().map(|t| t.map(|v| v + offset)));
    first
}
