//! Meshes and random numbers for the tests of this module.

use crate::mesh::Mesh;
use glam::DVec3;

/// The cube [0, 1]^3, closed and outward.
pub(crate) fn cube() -> Mesh {
    let positions = (0..8_u32).map(|c| [0, 1, 2].map(|a| f64::from(c >> a & 1))).collect();
    let quads =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh { positions, triangles }
}

/// `mesh` and `other` as one mesh.
pub(crate) fn both(mesh: &Mesh, other: &Mesh) -> Mesh {
    let shift = mesh.positions.len() as u32;
    let mut sum = mesh.clone();
    sum.positions.extend(&other.positions);
    sum.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + shift)));
    sum
}

/// `mesh` with every position mapped.
pub(crate) fn mapped(mesh: &Mesh, map: impl Fn(DVec3) -> DVec3) -> Mesh {
    let positions = mesh.positions.iter().map(|p| map(DVec3::from_array(*p)).to_array()).collect();
    Mesh { positions, triangles: mesh.triangles.clone() }
}

/// `mesh` with every face given vertices of its own.
pub(crate) fn soup(mesh: &Mesh) -> Mesh {
    let positions = mesh.triangles.iter().flatten().map(|v| mesh.positions[*v as usize]);
    let triangles = (0..mesh.triangles.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
    Mesh { positions: positions.collect(), triangles: triangles.collect() }
}

/// A small generator of uniform numbers in [0, 1).
pub(crate) struct Uniform(pub(crate) u64);

impl Uniform {
    /// The next number.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A point of the cube [lo, hi]^3.
    pub(crate) fn point(&mut self, lo: f64, hi: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| lo + (hi - lo) * self.next()))
    }
}

/// The unit sphere, from an octahedron with every face cut in four `levels` times.
pub(crate) fn sphere(levels: u32) -> Mesh {
    let mut positions: Vec<DVec3> = DVec3::AXES.iter().flat_map(|a| [*a, -*a]).collect();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for octant in 0..8_u32 {
        let [x, y, z] = [0, 1, 2].map(|a| 2 * a + (octant >> a & 1));
        let even = octant.count_ones() % 2 == 0;
        triangles.push(if even { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..levels {
        let mut middle = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
                *middle.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                    let sum = positions[p as usize] + positions[q as usize];
                    positions.push(sum.normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    Mesh { positions: positions.iter().map(|p| p.to_array()).collect(), triangles }
}

/// A mesh of each kind: closed, open, overlapping, and a soup.
pub(crate) fn kinds() -> Vec<Mesh> {
    let mut open = sphere(3);
    open.triangles.retain(|t| open.positions[t[0] as usize][0] < 0.6);
    let mut random = Uniform(21);
    let soup = Mesh {
        positions: (0..300).map(|_| random.point(-1.0, 1.0).to_array()).collect(),
        triangles: (0..100).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
    };
    let overlap = both(&sphere(3), &mapped(&sphere(3), |p| p + DVec3::new(0.5, 0.25, 0.0)));
    vec![sphere(4), open, overlap, soup, cube()]
}
