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

use super::search::{Faces, Nearest};
use super::surface::{Edges, NONE};
use super::triangle::Feature;
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

/// The normals of the vertices of a surface; those of faces and edges come with the faces.
#[derive(Clone, Debug)]
pub struct Pseudonormals {
    /// Zero where there is none.
    vertex: Vec<DVec3>,
}

impl Pseudonormals {
    /// The normals of `faces`. A vertex has one where its faces form a single fan without an end.
    #[must_use]
    pub fn new(faces: &Faces) -> Self {
        let surface = &faces.surface;
        let vertices = surface.positions.len();
        let mut vertex = vec![DVec3::ZERO; vertices];
        let mut meaningless = vec![false; vertices];
        let mut faces_at = vec![0_u32; vertices];
        let mut half_from = vec![NONE; vertices];
        for (number, corners) in surface.triangles.iter().enumerate() {
            let at = surface.corners(number);
            let normal = faces.normal(number);
            for i in 0..3 {
                let (u, v) = (at[(i + 1) % 3] - at[i], at[(i + 2) % 3] - at[i]);
                let angle = libm::atan2(u.cross(v).length(), u.dot(v));
                let here = corners[i] as usize;
                vertex[here] += angle * normal.unwrap_or(DVec3::ZERO);
                meaningless[here] |= normal.is_none();
                faces_at[here] += 1;
                half_from[here] = (3 * number + i) as u32;
            }
        }
        vertex.par_iter_mut().enumerate().for_each(|(here, vertex)| {
            let whole = half_from[here] != NONE
                && faces_in_fan(&surface.edges, half_from[here]) == Some(faces_at[here]);
            if !whole || meaningless[here] {
                *vertex = DVec3::ZERO;
            }
        });
        Self { vertex }
    }

    /// The normal, of any length, of the part of a face that is closest.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, faces: &Faces, face: usize, feature: Feature) -> Option<DVec3> {
        match feature {
            Feature::Face => faces.normal(face),
            Feature::Edge(i) => {
                let other = faces.surface.edges.twin[3 * face + i];
                let other = (other != NONE).then_some(other as usize / 3)?;
                Some(faces.normal(face)? + faces.normal(other)?)
            }
            Feature::Vertex(i) => {
                let normal = self.vertex[faces.surface.triangles[face][i] as usize];
                (normal != DVec3::ZERO).then_some(normal)
            }
        }
    }

    /// The side of the point with this nearest face, as it is told by the pseudonormal there;
    /// `None` if it can't tell.
    #[inline(always)]
    #[must_use]
    pub fn side(&self, faces: &Faces, nearest: &Nearest) -> Option<Side> {
        let Nearest { face, closest } = nearest;
        let normal = self.at(faces, *face, closest.feature)?;
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

/// The number of faces met on the way around the vertex at which the half-edge `start` begins;
/// `None` if the way has an end.
fn faces_in_fan(edges: &Edges, start: u32) -> Option<u32> {
    let (mut half, mut count) = (start, 0);
    loop {
        count += 1;
        let (face, corner) = (half / 3, half % 3);
        half = edges.twin[(3 * face + (corner + 2) % 3) as usize];
        if half == NONE {
            return None;
        }
        if half == start {
            return Some(count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{both, cube, mapped};
    use super::super::surface::Surface;
    use super::*;

    #[test]
    fn the_normals_of_a_cube_point_outward() {
        let faces = Faces::new(Surface::new(&cube()).unwrap());
        let surface = &faces.surface;
        let normals = Pseudonormals::new(&faces);
        let middle = DVec3::splat(0.5);
        for face in 0..surface.triangles.len() {
            for feature in (0..3).flat_map(|i| [Feature::Edge(i), Feature::Vertex(i)]) {
                let normal = normals.at(&faces, face, feature).unwrap();
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
                    if feature_is_diagonal(from) { faces.normal(face).unwrap() } else { outward };
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
        let faces = Faces::new(Surface::new(&touching).unwrap());
        let surface = &faces.surface;
        assert!(surface.edges.is_closed_manifold());
        let normals = Pseudonormals::new(&faces);
        let none = (0..surface.positions.len())
            .filter(|v| surface.triangles.iter().flatten().any(|c| *c as usize == *v))
            .filter(|v| normals.vertex[*v] == DVec3::ZERO)
            .count();
        assert_eq!(none, 1);
    }
}
