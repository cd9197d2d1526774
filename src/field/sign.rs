//! Sides of a closed surface by pseudonormals.
//!
//! The sign of (p - q) . n tells the side of p, where q is the closest point of the surface and n
//! the normal of the face that q lies on, the sum of the two normals at an edge, or the sum of the
//! normals weighted by their angles at a vertex. True for closed, oriented manifolds that do not
//! intersect themselves. Where the product is too weak to trust, or a normal has no meaning (a
//! face without area, a vertex where several fans of faces meet), there is no answer, and the
//! caller asks the winding number instead.
//!
//! Source: Bærentzen & Aanæs 2005, doi:10.1109/TVCG.2005.49.

use super::surface::{Edges, NONE, Surface};
use super::triangle::{Closest, Feature, unit_normal};
use glam::DVec3;
use rayon::prelude::*;

/// Cosine between offset and pseudonormal below which the side is not decided.
const WEAK: f64 = 0.01;

/// A side of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// In the solid.
    Inside,
    /// Not in the solid.
    Outside,
}

impl Side {
    /// -1 inside, 1 outside.
    #[inline(always)]
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Inside => -1.0,
            Self::Outside => 1.0,
        }
    }
}

/// The normals of a surface's faces, edges and vertices.
#[derive(Clone, Debug)]
pub struct Pseudonormals {
    /// Unit normals; zero for faces without area.
    face: Vec<DVec3>,
    /// By half-edge; shared by the two half-edges of an edge.
    twin: Vec<u32>,
    /// Zero where there is none.
    vertex: Vec<DVec3>,
}

impl Pseudonormals {
    /// The unit normals of the faces of `surface` alone: edges and vertices have none.
    #[must_use]
    pub fn of_faces(surface: &Surface) -> Self {
        let face = (0..surface.triangles.len())
            .into_par_iter()
            .map(|face| unit_normal(surface.corners(face)).unwrap_or(DVec3::ZERO))
            .collect();
        Self { face, twin: Vec::new(), vertex: Vec::new() }
    }

    /// These normals of the faces of `surface`, a closed manifold, with those of its edges and
    /// vertices.
    #[must_use]
    pub fn completed(self, surface: &Surface) -> Self {
        let Self { face, .. } = self;
        let vertices = surface.positions.len();
        let mut vertex = vec![DVec3::ZERO; vertices];
        let mut meaningless = vec![false; vertices];
        let mut faces_at = vec![0_u32; vertices];
        let mut half_from = vec![NONE; vertices];
        for (number, corners) in surface.triangles.iter().enumerate() {
            let at = surface.corners(number);
            for i in 0..3 {
                let (u, v) = (at[(i + 1) % 3] - at[i], at[(i + 2) % 3] - at[i]);
                let angle = libm::atan2(u.cross(v).length(), u.dot(v));
                let here = corners[i] as usize;
                vertex[here] += angle * face[number];
                meaningless[here] |= face[number] == DVec3::ZERO;
                faces_at[here] += 1;
                half_from[here] = (3 * number + i) as u32;
            }
        }
        for here in 0..vertices {
            let several = half_from[here] != NONE
                && faces_in_fan(&surface.edges, half_from[here]) != faces_at[here];
            if several || meaningless[here] {
                vertex[here] = DVec3::ZERO;
            }
        }
        Self { face, twin: surface.edges.twin.clone(), vertex }
    }

    /// The unit normal of a face, if it has area.
    #[inline(always)]
    #[must_use]
    pub fn face(&self, face: usize) -> Option<DVec3> {
        let normal = self.face[face];
        (normal != DVec3::ZERO).then_some(normal)
    }

    /// The normal, of any length, of the part of `face` with these `corners` that is closest.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, face: usize, corners: [u32; 3], feature: Feature) -> Option<DVec3> {
        match feature {
            Feature::Face => self.face(face),
            Feature::Edge(i) => {
                let other = *self.twin.get(3 * face + i)?;
                Some(self.face(face)? + self.face(other as usize / 3)?)
            }
            Feature::Vertex(i) => self.vertex.get(corners[i] as usize).copied(),
        }
    }

    /// The side of the point whose closest point on the surface lies on `face`, as it is told by
    /// the pseudonormal there; `None` if it can't tell.
    #[inline(always)]
    #[must_use]
    pub fn side(&self, face: usize, corners: [u32; 3], closest: &Closest) -> Option<Side> {
        let normal = self.at(face, corners, closest.feature)?;
        let along = normal.dot(closest.offset);
        let least = WEAK * WEAK * normal.length_squared() * closest.offset.length_squared();
        if along * along <= least {
            None
        } else if along < 0.0 {
            Some(Side::Inside)
        } else {
            Some(Side::Outside)
        }
    }
}

/// The number of faces met on the way around the vertex at which the half-edge `start` begins.
fn faces_in_fan(edges: &Edges, start: u32) -> u32 {
    let (mut half, mut count) = (start, 0);
    loop {
        count += 1;
        let (face, corner) = (half / 3, half % 3);
        half = edges.twin[(3 * face + (corner + 2) % 3) as usize];
        if half == start || half == NONE {
            return count;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{both, cube, mapped};
    use super::*;

    #[test]
    fn the_normals_of_a_cube_point_outward() {
        let surface = Surface::new(&cube()).unwrap();
        let normals = Pseudonormals::of_faces(&surface).completed(&surface);
        let middle = DVec3::splat(0.5);
        for (face, corners) in surface.triangles.iter().enumerate() {
            for feature in (0..3).flat_map(|i| [Feature::Edge(i), Feature::Vertex(i)]) {
                let normal = normals.at(face, *corners, feature).unwrap();
                let from = match feature {
                    Feature::Edge(i) => {
                        0.5 * (surface.corners(face)[i] + surface.corners(face)[(i + 1) % 3])
                    }
                    Feature::Vertex(i) => surface.corners(face)[i],
                    Feature::Face => unreachable!(),
                };
                // Diagonals of the quads have their normals, edges and corners point diagonally.
                let outward = ((from - middle) * 2.0).round();
                let outward =
                    if feature_is_diagonal(from) { normals.face(face).unwrap() } else { outward };
                assert!(normal.normalize().distance(outward.normalize()) < 1e-15);
            }
        }
    }

    /// Whether an edge's middle lies in the middle of a quad.
    fn feature_is_diagonal(middle: DVec3) -> bool {
        middle.to_array().iter().filter(|x| **x == 0.5).count() == 2
    }

    #[test]
    fn a_vertex_shared_by_two_bodies_has_no_normal() {
        let touching = both(&cube(), &mapped(&cube(), |p| p + DVec3::ONE));
        let surface = Surface::new(&touching).unwrap();
        assert!(surface.edges.is_closed_manifold());
        let normals = Pseudonormals::of_faces(&surface).completed(&surface);
        let none = (0..surface.positions.len())
            .filter(|v| surface.triangles.iter().flatten().any(|c| *c as usize == *v))
            .filter(|v| normals.vertex[*v] == DVec3::ZERO)
            .count();
        assert_eq!(none, 1);
    }
}
