//! Shapes with a formula: spheres, boxes, cylinders and their kin.
//!
//! All but the ellipsoid are exact signed distances: growth and slope 1. Sizes are expressions, so
//! a parameter may set them; they must be positive where nothing else is said.
//!
//! Sources: the Cesogen paper, section 3.2 (sphere, cylinder, box); the others are closed forms of
//! plane geometry, derived where they stand. The octahedron follows Quilez, "Distance functions",
//! iquilezles.org/articles/distfunctions.

use super::Solid;
use super::extent::Leaf;
use super::motions::unit;
use crate::expr::{Extremum, Graph, NodeId, Unary};

/// The ball of radius 1 around the origin.
#[must_use]
pub fn sphere(graph: &mut Graph) -> Solid {
    let point = graph.point();
    let radius = length(graph, &point);
    let one = graph.constant(1.0);
    let field = graph.sub(radius, one);
    distance(graph, field, [one; 3])
}

/// The cylinder of radius 1 about the z axis, unbounded along it.
#[must_use]
pub fn cylinder(graph: &mut Graph) -> Solid {
    let [x, y, _] = graph.point();
    let radius = length(graph, &[x, y]);
    let (one, infinity) = (graph.constant(1.0), graph.constant(f64::INFINITY));
    let field = graph.sub(radius, one);
    distance(graph, field, [one, one, infinity])
}

/// The cube [-1, 1]^3.
#[must_use]
pub fn cube(graph: &mut Graph) -> Solid {
    let one = graph.constant(1.0);
    let field = block(graph, one);
    distance(graph, field, [one; 3])
}

/// The cube [-1, 1]^3 with edges and corners rounded by `radius`, from 0 to 1.
#[must_use]
pub fn rounded_cube(graph: &mut Graph, radius: NodeId) -> Solid {
    let one = graph.constant(1.0);
    let core = graph.sub(one, radius);
    let field = block(graph, core);
    let field = graph.sub(field, radius);
    distance(graph, field, [one; 3])
}

/// The torus about the z axis whose tube of radius `minor` has its middle at radius `major`.
///
/// A distance while `minor` does not exceed `major`.
#[must_use]
pub fn torus(graph: &mut Graph, major: NodeId, minor: NodeId) -> Solid {
    let [x, y, z] = graph.point();
    let radius = length(graph, &[x, y]);
    let from_ring = graph.sub(radius, major);
    let from_middle = length(graph, &[from_ring, z]);
    let field = graph.sub(from_middle, minor);
    let reach = graph.add(major, minor);
    distance(graph, field, [reach, reach, minor])
}

/// The points within `radius` of a segment of the z axis of length `length`, centred at the origin.
#[must_use]
pub fn capsule(graph: &mut Graph, radius: NodeId, segment: NodeId) -> Solid {
    let [x, y, z] = graph.point();
    let (zero, two) = (graph.constant(0.0), graph.constant(2.0));
    let half = graph.div(segment, two);
    let height = graph.unary(Unary::Abs, z);
    let beyond = graph.sub(height, half);
    let beyond = graph.max(beyond, zero);
    let from_segment = length(graph, &[x, y, beyond]);
    let field = graph.sub(from_segment, radius);
    let reach = graph.add(half, radius);
    distance(graph, field, [radius, radius, reach])
}

/// The cone about the z axis with its base of radius `radius` at z = -height/2 and its tip at
/// z = height/2.
///
/// In the half plane of (radius r, z) it is a triangle. Inside, the distance is to the nearer of
/// base and slant; outside, to the nearer of their segments.
#[must_use]
pub fn cone(graph: &mut Graph, radius: NodeId, height: NodeId) -> Solid {
    let [x, y, z] = graph.point();
    let (zero, one, two) = (graph.constant(0.0), graph.constant(1.0), graph.constant(2.0));
    let half = graph.div(height, two);
    let r = length(graph, &[x, y]);

    // Up the slant from the rim: u along it, from 0 to 1, with (r, z) relative to the rim.
    let slant = length(graph, &[radius, height]);
    let from_rim = graph.sub(r, radius);
    let above_base = graph.add(z, half);
    let along = {
        let inward = graph.mul(radius, from_rim);
        let upward = graph.mul(height, above_base);
        let inner = graph.sub(upward, inward);
        let square = graph.mul(slant, slant);
        let u = graph.div(inner, square);
        let u = graph.max(u, zero);
        graph.min(u, one)
    };
    let slant_distance = {
        let (foot_r, foot_z) = (graph.mul(along, radius), graph.mul(along, height));
        let away_r = graph.add(from_rim, foot_r);
        let away_z = graph.sub(above_base, foot_z);
        length(graph, &[away_r, away_z])
    };
    let base_distance = {
        let beyond = graph.max(from_rim, zero);
        length(graph, &[beyond, above_base])
    };
    let outside = graph.min(slant_distance, base_distance);

    let inside = {
        let (a, b) = (graph.mul(height, from_rim), graph.mul(radius, above_base));
        let sum = graph.add(a, b);
        let beyond_slant = graph.div(sum, slant);
        let below_base = graph.neg(above_base);
        graph.max(beyond_slant, below_base)
    };
    let field = graph.pick(Extremum::Min, [inside, zero, inside, outside]);
    distance(graph, field, [radius, radius, half])
}

/// The half space {n . x < offset} with n = `normal` made of unit length.
///
/// Bounded on one side along an axis if the normal is a constant along it.
#[must_use]
pub fn half_space(graph: &mut Graph, normal: [NodeId; 3], offset: NodeId) -> Solid {
    let n = unit(graph, normal);
    let point = graph.point();
    let mut height = None;
    for (factor, coordinate) in n.into_iter().zip(point) {
        if graph.as_constant(factor) != Some(0.0) {
            let term = graph.mul(factor, coordinate);
            height = Some(height.map_or(term, |sum| graph.add(sum, term)));
        }
    }
    let height = height.unwrap_or_else(|| graph.constant(f64::NAN));
    let field = graph.sub(height, offset);

    let mut bounds = [f64::NEG_INFINITY, f64::INFINITY].map(|end| [graph.constant(end); 3]);
    let constants = n.map(|factor| graph.as_constant(factor));
    for axis in 0..3 {
        let others = [constants[(axis + 1) % 3], constants[(axis + 2) % 3]];
        if others == [Some(0.0); 2] {
            match constants[axis] {
                Some(1.0) => bounds[1][axis] = offset,
                Some(-1.0) => bounds[0][axis] = graph.neg(offset),
                _ => {}
            }
        }
    }
    Solid::leaf(field, Leaf { bounds, lipschitz: 1.0, period: None })
}

/// The ellipsoid with semi-axes `radii`: a scaled sphere, so its field is a bound of the distance.
#[must_use]
pub fn ellipsoid(graph: &mut Graph, radii: [NodeId; 3]) -> Solid {
    sphere(graph).scale(graph, radii)
}

/// The octahedron |x| + |y| + |z| < `radius`.
///
/// By symmetry in the first octant: where the foot of the perpendicular on the face's plane leaves
/// the face, the nearest point lies on the edge beyond which it is.
#[must_use]
pub fn octahedron(graph: &mut Graph, radius: NodeId) -> Solid {
    let p = graph.point().map(|coordinate| graph.unary(Unary::Abs, coordinate));
    let (three, root) = (graph.constant(3.0), graph.constant(3.0_f64.sqrt()));
    let sum = graph.add(p[0], p[1]);
    let sum = graph.add(sum, p[2]);
    let excess = graph.sub(sum, radius);
    let mut field = graph.div(excess, root);
    for axis in [2, 1, 0] {
        let (own, next, last) = (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]);
        let edge = edge_distance(graph, [own, next, last], radius);
        let triple = graph.mul(three, own);
        field = graph.pick(Extremum::Min, [triple, excess, edge, field]);
    }
    distance(graph, field, [radius; 3])
}

/// Distance to the segment from (0, s, 0) to (0, 0, s), for non-negative coordinates.
fn edge_distance(graph: &mut Graph, [x, y, z]: [NodeId; 3], s: NodeId) -> NodeId {
    let (zero, half) = (graph.constant(0.0), graph.constant(0.5));
    let along = graph.sub(z, y);
    let along = graph.add(along, s);
    let along = graph.mul(half, along);
    let along = graph.max(along, zero);
    let along = graph.min(along, s);
    let (dy, dz) = (graph.sub(y, s), graph.sub(z, along));
    let dy = graph.add(dy, along);
    length(graph, &[x, dy, dz])
}

/// Signed distance to the cube of half width `half`.
///
/// Inside, the greatest of |x| - half and its kin; elsewhere the length of their positive parts.
/// Written as a choice, so that the square root is pruned inside, where nearly all samples lie.
fn block(graph: &mut Graph, half: NodeId) -> NodeId {
    let zero = graph.constant(0.0);
    let excess = graph.point().map(|coordinate| {
        let size = graph.unary(Unary::Abs, coordinate);
        graph.sub(size, half)
    });
    let greatest = graph.max(excess[0], excess[1]);
    let greatest = graph.max(greatest, excess[2]);
    let beyond = excess.map(|e| graph.max(e, zero));
    let outside = length(graph, &beyond);
    graph.pick(Extremum::Min, [greatest, zero, greatest, outside])
}

/// The square root of the sum of the squares, in order.
#[must_use]
pub fn length(graph: &mut Graph, components: &[NodeId]) -> NodeId {
    let mut sum = None;
    for &component in components {
        let square = graph.mul(component, component);
        sum = Some(sum.map_or(square, |sum| graph.add(sum, square)));
    }
    let sum = sum.unwrap_or_else(|| graph.constant(0.0));
    graph.unary(Unary::Sqrt, sum)
}

/// The solid of a distance, within the box that reaches `reach` to both sides of the origin.
fn distance(graph: &mut Graph, field: NodeId, reach: [NodeId; 3]) -> Solid {
    let low = reach.map(|end| graph.neg(end));
    Solid::leaf(field, Leaf { bounds: [low, reach], lipschitz: 1.0, period: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::EVEN_STEPS;
    use crate::solid::walk::value;
    use glam::DVec3;

    /// Every primitive with sizes away from the defaults.
    fn all(graph: &mut Graph) -> Vec<(&'static str, Solid)> {
        let [a, b, c] = [0.9, 0.35, 1.6].map(|size| graph.constant(size));
        let normal = [a, b, c];
        vec![
            ("sphere", sphere(graph)),
            ("cylinder", cylinder(graph)),
            ("cube", cube(graph)),
            ("rounded cube", rounded_cube(graph, b)),
            ("torus", torus(graph, a, b)),
            ("capsule", capsule(graph, b, a)),
            ("cone", cone(graph, a, c)),
            ("half space", half_space(graph, normal, b)),
            ("octahedron", octahedron(graph, a)),
        ]
    }

    /// Points of [-2, 2]^3 on no plane of symmetry.
    fn points() -> impl Iterator<Item = DVec3> {
        let step = DVec3::from_array(EVEN_STEPS);
        (1..400).map(move |i| (f64::from(i) * step).fract() * 4.0 - 2.0)
    }

    #[test]
    fn distances_lead_to_the_surface() {
        // For a distance f, p - f grad f is the nearest point of the surface. Differences of step
        // 1e-6 have errors below 1e-4 but next to kinks, where two nearest points change places.
        let mut graph = Graph::new();
        for (name, solid) in all(&mut graph) {
            let f = |p: DVec3| value(&graph, solid.field, p.to_array());
            let mut near_kinks = 0;
            for p in points() {
                let h = 1e-6;
                let gradient = DVec3::from_array(
                    [DVec3::X, DVec3::Y, DVec3::Z]
                        .map(|u| (f(p + h * u) - f(p - h * u)) / (2.0 * h)),
                );
                let is_steep = (gradient.length() - 1.0).abs() < 1e-4;
                let arrives = f(p - f(p) * gradient).abs() < 1e-3;
                near_kinks += i32::from(!(is_steep && arrives));
            }
            assert!(near_kinks <= 1, "{name}: {near_kinks} of 399 points miss the surface");
        }
    }

    #[test]
    fn distances_are_right_where_they_are_known() {
        let mut graph = Graph::new();
        let solids = all(&mut graph);
        let check = |name: &str, point: [f64; 3], expected: f64| {
            let (_, solid) = solids.iter().find(|(known, _)| *known == name).unwrap();
            let found = value(&graph, solid.field, point);
            assert!((found - expected).abs() < 1e-14, "{name} at {point:?}: {found}");
        };
        check("sphere", [0.0, 3.0, 4.0], 4.0);
        check("cylinder", [3.0, 4.0, 9.0], 4.0);
        check("cube", [0.0, 0.0, 0.5], -0.5);
        check("cube", [4.0, 5.0, 0.0], 5.0);
        check("cube", [1.0, 0.0, 0.0], 0.0);
        check("rounded cube", [0.0, 0.0, 1.0], 0.0);
        check("rounded cube", [0.65, 0.65, 0.65], -0.35);
        check("torus", [0.9, 0.0, 0.0], -0.35);
        check("torus", [0.0, 0.0, 0.0], 0.9 - 0.35);
        check("capsule", [0.0, 0.0, 1.45], 0.65);
        check("capsule", [0.35, 0.0, 0.3], 0.0);
        check("cone", [0.0, 0.0, 1.8], 1.0);
        check("cone", [0.0, 0.0, -1.8], 1.0);
        check("cone", [0.9, 0.0, -0.8], 0.0);
        check("cone", [0.0, 0.0, -0.7], -0.1);
        check("octahedron", [0.0, 0.0, 1.9], 1.0);
        check("octahedron", [0.3, 0.3, 0.3], 0.0);
        check("octahedron", [0.0, 0.0, 0.0], -0.9 / 3.0_f64.sqrt());
    }

    #[test]
    fn half_spaces_along_an_axis_are_bounded_on_one_side() {
        let mut graph = Graph::new();
        let [zero, two, minus] = [0.0, 2.0, -3.0].map(|v| graph.constant(v));
        let up = half_space(&mut graph, [zero, two, zero], two).bounds(&graph, &[]);
        assert_eq!((up.lo.y, up.hi.y), (f64::NEG_INFINITY, 2.0));
        let down = half_space(&mut graph, [zero, zero, minus], two).bounds(&graph, &[]);
        assert_eq!((down.lo.z, down.hi.z), (-2.0, f64::INFINITY));
        let slanted = half_space(&mut graph, [zero, two, minus], two).bounds(&graph, &[]);
        assert_eq!(slanted, crate::geom::Aabb::WHOLE);
    }
}
