//! Set operations with rounded edges: fillets of a given radius where surfaces meet.
//!
//! > union: max(r, min aᵢ) - |(max(r - a₁, 0), max(r - a₂, 0), …)|
//!
//! Where all operands are farther than r it is the plain union; two planes at a right angle are
//! joined by a fillet of radius r exactly; other angles give fillets that end where the operands reach
//! r. It takes any number of operands and does not depend on their order. The intersection and the
//! difference follow by complements.
//!
//! **Bounds.** Where the result is at most t, the largest of r - aᵢ is at least (r - t) / √n, so that the
//! least operand is at most t + r (1 - 1/√n): the union grows by that. Rounded intersections and
//! differences lie in the plain ones.
//!
//! Source: the two-operand form is common in shader programming, as *round union* in the hg_sdf
//! library of Mercury; that of n operands and the bound are ours.

use super::Solid;
use super::extent::Join;
use super::primitives::length;
use crate::expr::{Graph, NodeId};
use std::f64::consts::FRAC_1_SQRT_2;

impl Solid {
    /// What lies in either, and in the fillets of `radius` between them.
    #[must_use]
    pub fn rounded_union(self, graph: &mut Graph, other: Self, radius: NodeId) -> Self {
        let field = round_minimum(graph, &[self.field, other.field], radius);
        let mut joined = self.joined(Join::Union, other, field);
        let share = graph.constant(1.0 - FRAC_1_SQRT_2);
        let beyond = graph.mul(share, radius);
        joined.grow(graph, beyond);
        joined
    }

    /// What lies in both, its edges rounded by `radius`.
    #[must_use]
    pub fn rounded_intersection(self, graph: &mut Graph, other: Self, radius: NodeId) -> Self {
        let field = round_maximum(graph, [self.field, other.field], radius);
        self.joined(Join::Intersection, other, field)
    }

    /// What lies in `self` but not in `other`, its edges rounded by `radius`.
    #[must_use]
    pub fn rounded_difference(self, graph: &mut Graph, other: Self, radius: NodeId) -> Self {
        let outside = graph.neg(other.field);
        let field = round_maximum(graph, [self.field, outside], radius);
        self.joined(Join::Difference, other, field)
    }
}

/// The rounded minimum of `fields` with the radius `radius`, which is positive.
///
/// # Panics
/// If there are no fields.
#[must_use]
pub fn round_minimum(graph: &mut Graph, fields: &[NodeId], radius: NodeId) -> NodeId {
    let zero = graph.constant(0.0);
    let least = fields.iter().copied().reduce(|a, b| graph.min(a, b));
    let least = least.expect("a minimum is taken of at least one field");
    let depths: Vec<NodeId> = (fields.iter())
        .map(|field| {
            let depth = graph.sub(radius, *field);
            graph.max(depth, zero)
        })
        .collect();
    let depth = length(graph, &depths);
    let far = graph.max(radius, least);
    graph.sub(far, depth)
}

fn round_maximum(graph: &mut Graph, fields: [NodeId; 2], radius: NodeId) -> NodeId {
    let outsides = fields.map(|field| graph.neg(field));
    let least = round_minimum(graph, &outsides, radius);
    graph.neg(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, half_space};
    use crate::solid::walk::value;

    fn walls(graph: &mut Graph) -> [Solid; 2] {
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|normal| {
            let normal = normal.map(|n| graph.constant(n));
            let zero = graph.constant(0.0);
            half_space(graph, normal, zero)
        })
    }

    #[test]
    fn planes_at_a_right_angle_meet_in_a_fillet_of_the_radius() {
        let mut graph = Graph::new();
        let radius = graph.constant(0.5);
        let [a, b] = walls(&mut graph);
        let union = a.clone().rounded_union(&mut graph, b.clone(), radius);
        let both = a.rounded_intersection(&mut graph, b, radius);
        for angle in [0.1_f64, 0.7, 1.2] {
            let (s, c) = angle.sin_cos();
            // The fillet of the union is round about (r, r), that of the intersection about (-r, -r).
            let fillet = value(&graph, union.field, [0.5 - 0.5 * c, 0.5 - 0.5 * s, 3.0]);
            let edge = value(&graph, both.field, [0.5 * c - 0.5, 0.5 * s - 0.5, 3.0]);
            assert!(fillet.abs() < 1e-15 && edge.abs() < 1e-15, "{fillet} {edge}");
        }
        assert_eq!(value(&graph, union.field, [0.75, 2.0, 0.0]), 0.75);
        assert_eq!(value(&graph, both.field, [-0.75, -2.0, 0.0]), -0.75);
    }

    #[test]
    fn the_fillet_lies_in_the_box() {
        let mut graph = Graph::new();
        let [radius, two, zero] = [0.5, 1.5, 0.0].map(|v| graph.constant(v));
        let (a, b) = (cube(&mut graph), cube(&mut graph));
        let b = b.translate(&mut graph, [two, two, zero]);
        let union = a.rounded_union(&mut graph, b, radius);
        let reach = 0.5 * (1.0 - FRAC_1_SQRT_2);
        assert_eq!(union.bounds(&graph, &[]).hi.x, 2.5 + reach);
    }
}
