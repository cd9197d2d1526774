//! How fast the winding number of an open surface can change.
//!
//! The gradient of the winding number depends on the surface's boundary only: it is the field of a
//! current of one unit along the boundary, and its length is at most the integral of
//! 1 / (4 pi r^2) along the boundary at distance r (Biot & Savart). So the winding number of a
//! surface without boundary is constant wherever no face is met, and that of an open one nearly
//! constant far from its holes.

use super::surface::Surface;
use crate::geom::bvh::NO_ITEM;
use crate::geom::{Aabb, Bvh};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Most edges that are kept apart, for a tighter bound.
const SINGLE_EDGES: usize = 256;

/// Some edges of the boundary.
#[derive(Clone, Copy, Debug)]
struct Piece {
    center: DVec3,
    radius: f64,
    /// Length, counted as often as the edges are.
    length: f64,
}

/// A connected part of the boundary, and the cone over it that caps the hole.
#[derive(Clone, Copy, Debug)]
struct Hole {
    center: DVec3,
    radius: f64,
    /// Length, counted as often as the edges are.
    length: f64,
}

/// The boundary of a surface.
#[derive(Clone, Debug)]
pub struct Rim {
    pieces: Vec<Piece>,
    holes: Vec<Hole>,
}

impl Rim {
    /// The boundary of `surface`.
    #[must_use]
    pub fn new(surface: &Surface) -> Self {
        let edges = &surface.edges.rim;
        let ends = |edge: usize| {
            let (a, b, _) = edges[edge];
            [surface.positions[a as usize], surface.positions[b as usize]]
        };
        let boxes: Vec<Aabb> = (0..edges.len()).map(|edge| Aabb::around(ends(edge))).collect();
        let tree = Bvh::build(edges.len(), ends);
        let length = |edge: usize| {
            let [a, b] = ends(edge);
            a.distance(b) * f64::from(edges[edge].2.unsigned_abs())
        };
        let piece = |members: &[u32]| {
            let members = || members.iter().map(|m| *m as usize).filter(|m| *m != NO_ITEM as usize);
            let hull = members().fold(Aabb::EMPTY, |hull, m| hull.hull(boxes[m]));
            Piece {
                center: hull.center(),
                radius: 0.5 * hull.size().length(),
                length: members().map(length).sum(),
            }
        };
        let leaves = tree.leaves().iter();
        let pieces = if edges.len() <= SINGLE_EDGES {
            leaves.flatten().filter(|edge| **edge != NO_ITEM).map(|edge| piece(&[*edge])).collect()
        } else {
            leaves.map(|leaf| piece(leaf)).collect()
        };
        let holes = parts(edges)
            .iter()
            .map(|part| {
                let ends = || part.iter().flat_map(|edge| ends(*edge as usize));
                let center = Aabb::around(ends()).center();
                Hole {
                    center,
                    radius: ends().map(|end| end.distance(center)).fold(0.0, f64::max),
                    length: part.iter().map(|edge| length(*edge as usize)).sum(),
                }
            })
            .collect();
        Self { pieces, holes }
    }

    /// Whether the surface has no boundary.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Number of terms of [`variation`](Self::variation).
    #[must_use]
    pub fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// A bound on the winding number of the caps of all holes around `point`; infinite near a hole.
    ///
    /// Caps are cones over the parts of the boundary, so that the surface with its caps has no
    /// boundary. A solid angle is at most area over squared distance.
    #[inline(always)]
    #[must_use]
    pub fn shadow(&self, point: DVec3) -> f64 {
        let mut shadow = 0.0;
        for hole in &self.holes {
            let distance = hole.center.distance(point) - hole.radius;
            if distance <= 0.0 {
                return f64::INFINITY;
            }
            shadow += 0.5 * hole.length * hole.radius / (distance * distance);
        }
        shadow * (0.25 / std::f64::consts::PI)
    }

    /// A bound not less than [`variation`](Self::variation), quickly: by holes as a whole.
    #[inline(always)]
    #[must_use]
    pub fn roughly(&self, center: DVec3, radius: f64) -> f64 {
        let mut steepness = 0.0;
        for hole in &self.holes {
            let distance = hole.center.distance(center) - hole.radius - radius;
            if distance <= 0.0 {
                return f64::INFINITY;
            }
            steepness += hole.length / (distance * distance);
        }
        steepness * radius * (0.25 / std::f64::consts::PI)
    }

    /// A bound on how much the winding number differs from that at `center` within `radius` of it,
    /// if no face is met on the way; infinite near the boundary.
    #[inline(always)]
    #[must_use]
    pub fn variation(&self, center: DVec3, radius: f64) -> f64 {
        let mut steepness = 0.0;
        for piece in &self.pieces {
            let distance = piece.center.distance(center) - piece.radius - radius;
            if distance <= 0.0 {
                return f64::INFINITY;
            }
            steepness += piece.length / (distance * distance);
        }
        steepness * radius * (0.25 / std::f64::consts::PI)
    }
}

/// The connected parts of `edges`, as their numbers.
fn parts(edges: &[(u32, u32, i32)]) -> Vec<Vec<u32>> {
    let mut at: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for (number, (a, b, _)) in edges.iter().enumerate() {
        at.entry(*a).or_default().push(number as u32);
        at.entry(*b).or_default().push(number as u32);
    }
    let mut seen = vec![false; edges.len()];
    let mut parts = Vec::new();
    for seed in 0..edges.len() {
        if seen[seed] {
            continue;
        }
        seen[seed] = true;
        let mut part = vec![seed as u32];
        let mut next = 0;
        while let Some(edge) = part.get(next).map(|edge| *edge as usize) {
            next += 1;
            let (a, b, _) = edges[edge];
            for other in [a, b].iter().filter_map(|vertex| at.get(vertex)).flatten() {
                if !std::mem::replace(&mut seen[*other as usize], true) {
                    part.push(*other);
                }
            }
        }
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::super::samples::{Uniform, cube, sphere};
    use super::super::winding::exact;
    use super::*;

    #[test]
    fn a_closed_surface_has_no_rim() {
        let rim = Rim::new(&Surface::new(&cube()).unwrap());
        assert!(rim.is_empty() && rim.variation(DVec3::ZERO, 1.0) == 0.0);
    }

    #[test]
    fn winding_numbers_vary_less_than_the_bound() {
        let mut bowl = sphere(3);
        bowl.triangles.retain(|t| bowl.positions[t[0] as usize][0] < 0.7);
        let surface = Surface::new(&bowl).unwrap();
        let rim = Rim::new(&surface);
        let mut random = Uniform(6);
        let mut tightest: f64 = 0.0;
        for _ in 0..300 {
            let center = random.point(-0.5, 0.5);
            let radius = 0.1 * random.next();
            let bound = rim.variation(center, radius);
            let other = center + radius * random.point(-1.0, 1.0).normalize();
            let change = (exact(surface.faces(), other) - exact(surface.faces(), center)).abs();
            assert!(change <= bound, "{center} {radius}");
            tightest = tightest.max(change / bound);
        }
        // The bound is of use: it is not many times too wide. It can't be attained, since the
        // parts of a boundary pull in different directions.
        assert!(tightest > 0.1, "{tightest}");
    }
}
