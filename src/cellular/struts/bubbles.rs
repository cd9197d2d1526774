//! The walls of a whole foam, without polygons: by the bubbles between them.
//!
//! Inside of a convex bubble the distance to its walls is the least distance to their planes. A
//! point outside of it lies beyond one of the planes, so that the least signed distance is negative. Hence
//! the distance to the walls of a foam that fills space is
//!
//! > maxᵢ minⱼ (nᵢⱼ . u - aᵢⱼ),
//!
//! over the bubbles i and their faces j, with normals inwards: piecewise linear, exact on both sides of the
//! walls' surfaces, with two bubbles sharing the form of the face between them.

use super::field::{folded, over_space};
use super::forms::Forms;
use super::voronoi::facets;
use crate::expr::{Binary, Graph, NodeId};
use crate::geom::Axis;
use crate::solid::Solid;
use glam::DVec3;

/// The walls of `thickness` of the foam of `points`, mirrored across the axes that `mirrored` names.
///
/// Of period 1, and unbounded.
#[must_use]
pub fn walls(graph: &mut Graph, points: &[DVec3], mirrored: [bool; 3], thickness: NodeId) -> Solid {
    let size = DVec3::from_array(mirrored.map(|mirrored| if mirrored { 0.5 } else { 1.0 }));
    let u = Axis::ALL.map(|axis| folded(graph, axis, mirrored[axis.index()]));
    let two = graph.constant(2.0);
    let half = graph.div(thickness, two);
    let mut forms = Forms::new(graph, u);
    let mut bubbles = Vec::new();
    for number in 0..points.len() {
        let faces = facets(points, number);
        let corners = || faces.iter().flat_map(|face| face.corners.iter().copied());
        let lo = corners().fold(DVec3::INFINITY, DVec3::min);
        let hi = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        for image in 0..125_i32 {
            let shift = DVec3::new(
                f64::from(image % 5 - 2),
                f64::from(image / 5 % 5 - 2),
                f64::from(image / 25 - 2),
            );
            let is_apart = (lo + shift).cmpgt(size).any() || (hi + shift).cmplt(DVec3::ZERO).any();
            if is_apart {
                continue;
            }
            let own = points[number] + shift;
            let heights = faces.iter().filter_map(|face| face.beyond).map(|(other, by)| {
                let neighbour = points[other] + by + shift;
                let inward = (own - neighbour).normalize();
                (inward, inward.dot(0.5 * (own + neighbour)))
            });
            let heights: Vec<(DVec3, f64)> = heights.collect();
            let nearest = heights.into_iter().map(|(n, a)| forms.signed_form(n, a));
            let nearest: Vec<NodeId> = nearest.collect();
            let nearest = nearest.into_iter().reduce(|a, b| forms.graph.min(a, b));
            bubbles.extend(nearest.map(|nearest| (nearest, own)));
        }
    }
    let distance = over_space(graph, bubbles, Binary::Max);
    let field = graph.sub(distance, half);
    Solid::periodic(graph, field, 1.0, 1.0).with_half_thickness(half)
}
