//! Cell maps: lattices whose cells follow a cylinder, a sphere or coordinates of one's own.
//!
//! A map gives each point of space its place among the cells, u(x), in cells of length 1; the lattice
//! f becomes f(u(x)). Levels stay as they are. A wall of a true thickness is had by asking for it after
//! the map, `gyroid cylindrical 12 thickness 0.1`: the distance is then that of space, whatever the map
//! does to cells ([`walls`](super::walls)).
//!
//! * **Cylindrical**: u = (n θ / 2π, (r - R) / a, z / b), θ being the angle about the z axis from the x
//!   axis. Where n is a whole number the n cells around close up: θ jumps by 2π at the half plane
//!   y = 0, x < 0, which a lattice of period 1 doesn't see.
//! * **Spherical**: u = (n θ / 2π, m φ / π, (ρ - R) / a), φ being the angle from the z axis: n cells
//!   around, m from pole to pole. At the poles cells shrink to nothing.
//! * **Conformal**: u as three equations say.
//!
//! a and b are by default what makes cells cubes at the radius R. **Bounds**: none; the result is to be
//! intersected with a bounded shape.
//!
//! Source: cell maps apart from cells and thickness are those of OpenVCAD; coordinates as in ISO
//! 80000-2.

use super::extent::Rule;
use super::primitives::length;
use super::{Side, Solid};
use crate::expr::{Binary, Graph, NodeId, Unary};
use std::f64::consts::{PI, TAU};

/// Cells around a cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Cylindrical {
    /// Cells around the axis.
    pub around: NodeId,
    /// Radius at which a cell begins, positive.
    pub radius: NodeId,
    /// Length of a cell along the radius.
    pub radial: Option<NodeId>,
    /// Length of a cell along the axis.
    pub axial: Option<NodeId>,
}

/// Cells around a sphere.
#[derive(Clone, Copy, Debug)]
pub struct Spherical {
    /// Cells around the axis.
    pub around: NodeId,
    /// Cells from pole to pole.
    pub along: NodeId,
    /// Radius at which a cell begins, positive.
    pub radius: NodeId,
    /// Length of a cell along the radius.
    pub radial: Option<NodeId>,
}

impl Solid {
    /// The lattice with its cells around the z axis.
    #[must_use]
    pub fn cylindrical(self, graph: &mut Graph, map: Cylindrical) -> Self {
        let Cylindrical { around, radius, radial, axial } = map;
        let [x, y, z] = graph.point();
        let cube = side(graph, radius, around);
        let turns = turns(graph);
        let from_axis = length(graph, &[x, y]);
        let u = graph.mul(around, turns);
        let v = cells(graph, from_axis, radius, radial.unwrap_or(cube));
        let w = graph.div(z, axial.unwrap_or(cube));
        self.mapped(graph, [u, v, w])
    }

    /// The lattice with its cells around the origin.
    #[must_use]
    pub fn spherical(self, graph: &mut Graph, map: Spherical) -> Self {
        let Spherical { around, along, radius, radial } = map;
        let [x, y, z] = graph.point();
        let cube = side(graph, radius, around);
        let turns = turns(graph);
        let from_axis = length(graph, &[x, y]);
        let from_origin = length(graph, &[x, y, z]);
        let u = graph.mul(around, turns);
        // By atan2, which has no rounding at the poles as the arc cosine has.
        let down = graph.binary(Binary::Atan2, from_axis, z);
        let half = graph.constant(1.0 / PI);
        let share = graph.mul(half, down);
        let v = graph.mul(along, share);
        let w = cells(graph, from_origin, radius, radial.unwrap_or(cube));
        self.mapped(graph, [u, v, w])
    }

    /// The lattice whose cells are those of the coordinates `place`, expressions of the point.
    #[must_use]
    pub fn mapped(self, graph: &mut Graph, place: [NodeId; 3]) -> Self {
        let mut mapped = self.substituted(graph, place);
        mapped.walls.retain(|wall| wall.side == Side::Middle);
        mapped.push(Rule::Map);
        mapped
    }
}

/// The side of a cube, of which `around` go around at `radius`.
fn side(graph: &mut Graph, radius: NodeId, around: NodeId) -> NodeId {
    let tau = graph.constant(TAU);
    let circumference = graph.mul(tau, radius);
    let side = graph.div(circumference, around);
    graph.unary(Unary::Abs, side)
}

/// The angle about the z axis in turns, from -1/2 to 1/2.
fn turns(graph: &mut Graph) -> NodeId {
    let [x, y, _] = graph.point();
    let angle = graph.binary(Binary::Atan2, y, x);
    let per_turn = graph.constant(1.0 / TAU);
    graph.mul(per_turn, angle)
}

/// (distance - radius) / size.
fn cells(graph: &mut Graph, distance: NodeId, radius: NodeId, size: NodeId) -> NodeId {
    let beyond = graph.sub(distance, radius);
    graph.div(beyond, size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Axis;
    use crate::solid::walk::value;

    /// The coordinate along `axis` as a solid's field.
    fn coordinate(graph: &mut Graph, axis: Axis) -> Solid {
        let field = graph.coordinate(axis);
        Solid::unbounded(graph, field)
    }

    #[test]
    fn cells_around_a_cylinder_are_cubes_at_the_radius() {
        let mut graph = Graph::new();
        let [around, radius] = [8.0, 2.0].map(|v| graph.constant(v));
        let map = Cylindrical { around, radius, radial: None, axial: None };
        let found = Axis::ALL.map(|axis| coordinate(&mut graph, axis).cylindrical(&mut graph, map));
        let at = |r: f64, turn: f64, z: f64| {
            let (s, c) = (TAU * turn).sin_cos();
            found.each_ref().map(|solid| value(&graph, solid.field, [r * c, r * s, z]))
        };
        let side = TAU * 2.0 / 8.0;
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(close(at(2.0, 0.25, 0.0), [2.0, 0.0, 0.0]));
        assert!(close(at(2.0 + side, -0.125, 3.0 * side), [-1.0, 1.0, 3.0]));
        // On both sides of the seam lie the ends of the eighth cell.
        let (above, below) = (at(2.0, 0.5 - 1e-13, 0.0), at(2.0, 0.5 + 1e-13, 0.0));
        assert!((above[0] - 4.0).abs() < 1e-11 && (below[0] + 4.0).abs() < 1e-11);
    }

    #[test]
    fn cells_on_a_sphere_are_counted_from_the_poles() {
        let mut graph = Graph::new();
        let [around, along, radius] = [12.0, 6.0, 1.5].map(|v| graph.constant(v));
        let map = Spherical { around, along, radius, radial: Some(along) };
        let found = Axis::ALL.map(|axis| coordinate(&mut graph, axis).spherical(&mut graph, map));
        let at = |p: [f64; 3]| found.each_ref().map(|solid| value(&graph, solid.field, p));
        assert_eq!(at([0.0, 0.0, 1.5])[1..], [0.0, 0.0]);
        let equator = at([0.0, 7.5, 0.0]);
        assert!((equator[0] - 3.0).abs() < 1e-14 && (equator[1] - 3.0).abs() < 1e-14);
        assert_eq!(equator[2], 1.0);
        assert_eq!(at([0.0, 0.0, -1.5])[1], 6.0);
    }
}
