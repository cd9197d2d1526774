//! Walls of a true thickness about the surface of a solid, where its field is no distance.
//!
//! A shell |f| < t/2 is as thick as the slope of f lets it be: a gyroid's by a factor of 1.6 from place to
//! place. Here |d| < t/2, with d the distance to the surface {f = 0}, is had in one of two ways.
//!
//! * **Gradient**: d = f / |grad f|, right to first order in d times the curvature: walls of a
//!   tenth of a cell come out 1 to 5 % thin.
//! * **Exact**: the nearest point p of the surface by Newton's method. With the field made linear at
//!   the last p, the nearest point of its zero plane to x is
//!
//!   > p' = x - λ g, λ = (f(p) + g · (x - p)) / g · g, g = grad f(p),
//!
//!   and d = λ |g| there. p begins at x and is improved twice. Far from the surface, where g is small, the
//!   first step would lead beyond it; it is no longer than 0.6 of half the thickness, since what is farther than
//!   half is no part of the wall. What is left of the error falls by the product
//!   of distance and curvature in each step, and enters d squared; walls of the gyroid, P and D
//!   surfaces up to 0.15 of a cell have the volume of the tube formula to 0.1 %.
//!
//! **What is guaranteed.** A point of the surface is no nearer than the nearest, so d is not too
//! small where p lies on the surface and x above p. How far p is off the surface, |f(p)| / |g| tells, and d is
//! taken no smaller than four times that; how far x is from the normal through p is the length of x - p
//! without its part along g, and d is taken no smaller than twice that, but no larger than the length of
//! x - p and four times what p is off together, which it does not exceed: at edges the normal says
//! nothing. So far from the surface, where the iteration wanders, nothing solid appears.
//! Where a Lipschitz bound L of f is known, d is taken no smaller than |f| / L, which it can't be: so
//! ranges of boxes exclude what is far, and the wall lies in {|f| <= L t / 2}. Without one, as for
//! equations, the wall has no bounds of its own. Beyond the reach of the surface (half the distance to its
//! other sheets, the radius of its curvature) walls meet, and d has the medial axis' creases.
//!
//! Everything is an expression: the wall may vary in thickness, move and be combined, and every
//! engine runs it. It costs three evaluations of f and of its gradient.
//!
//! Source: orthogonal projection to an implicit surface, Hartmann 1999, doi:10.1007/s003710050180.

use super::extent::Rule;
use super::motions::substitute;
use super::primitives::length;
use super::{Solid, TrueWall};
use crate::expr::{Graph, NodeId, Unary, derive};

/// Improvements of the nearest point.
const STEPS: usize = 2;

/// The least distance, in distances that the nearest point is off the surface.
const DOUBT: f64 = 4.0;

/// The longest first step, in halves of the thickness.
///
/// Of 0.2, 0.4 ... 1.2 it is the one with which walls of gyroid, P, D and IWP surfaces are right farthest.
const REACH: f64 = 0.6;

/// The least distance, in distances of x from the normal through p.
///
/// With 1, solid is left more than a tenth too far from the surface where walls meet, with 2 none.
const SLANT: f64 = 2.0;

/// How the distance to a surface is had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By Newton's method.
    Exact,
    /// To first order.
    Gradient,
}

impl Method {
    /// What the methods are called, in order.
    pub const NAMES: &'static [&'static str] = &["exact", "gradient"];
    /// The methods, in order.
    pub const ALL: [Self; 2] = [Self::Exact, Self::Gradient];
}

impl Solid {
    /// The wall of `thickness`, a length, about the surface: half of it on either side.
    #[must_use]
    pub fn wall(mut self, graph: &mut Graph, thickness: NodeId, method: Method) -> Self {
        let two = graph.constant(2.0);
        let half = graph.div(thickness, two);
        let parameters: Vec<f64> = graph.parameters().iter().map(|(_, value)| *value).collect();
        let lipschitz = self.extent(graph, &parameters).lipschitz;
        let distance = match method {
            Method::Exact => exact(graph, self.field, half, lipschitz),
            Method::Gradient => gradient(graph, self.field),
        };
        let surface = self.field;
        self.field = graph.sub(distance, half);
        if method == Method::Exact {
            self.true_walls.push(TrueWall {
                surface,
                field: self.field,
                half_thickness: half,
                lipschitz,
                place: graph.point(),
            });
        }
        match method {
            Method::Exact if lipschitz.is_finite() => {
                self.push(Rule::Quotient(lipschitz));
                self.grow(graph, half);
            }
            // A field that falls steeply far away may look near: there is no bound.
            Method::Exact | Method::Gradient => self.push(Rule::Everywhere),
        }
        self.with_half_thickness(half)
    }
}

/// |f| / |grad f|.
fn gradient(graph: &mut Graph, field: NodeId) -> NodeId {
    let slopes = derive::gradient(graph, field);
    let slope = length(graph, &slopes);
    let size = graph.unary(Unary::Abs, field);
    graph.div(size, slope)
}

/// The distance to {f = 0}, by Newton's method, for walls of `half` on either side.
fn exact(graph: &mut Graph, field: NodeId, half: NodeId, lipschitz: f64) -> NodeId {
    let reach = graph.constant(REACH);
    let reach = graph.mul(reach, half);
    let point = graph.point();
    let slopes = derive::gradient(graph, field);
    let (mut value, mut slope) = (field, slopes);
    let mut ahead = value;
    let mut offset = point;
    for step in 0..STEPS {
        let square = dot(graph, slope, slope);
        let mut factor = graph.div(ahead, square);
        if step == 0 {
            let steepness = graph.unary(Unary::Sqrt, square);
            let most = graph.div(reach, steepness);
            let least = graph.neg(most);
            factor = graph.min(factor, most);
            factor = graph.max(factor, least);
        }
        let nearest = std::array::from_fn(|i| {
            let step = graph.mul(factor, slope[i]);
            graph.sub(point[i], step)
        });
        value = substitute(graph, field, nearest);
        slope = slopes.map(|s| substitute(graph, s, nearest));
        offset = std::array::from_fn(|i| graph.sub(point[i], nearest[i]));
        let rise = dot(graph, slope, offset);
        ahead = graph.add(value, rise);
    }
    let steepness = length(graph, &slope);
    let doubt = graph.constant(DOUBT);
    let [ahead, off] = [ahead, value].map(|v| graph.unary(Unary::Abs, v));
    let off = graph.mul(doubt, off);
    let larger = graph.max(ahead, off);
    let distance = graph.div(larger, steepness);
    let off = graph.div(off, steepness);
    let direct = length(graph, &offset);
    let direct = graph.add(direct, off);
    let aside = aside(graph, offset, slope);
    let slant = graph.constant(SLANT);
    let aside = graph.mul(slant, aside);
    let distance = graph.max(distance, aside);
    let distance = graph.min(direct, distance);
    if lipschitz.is_finite() && lipschitz > 0.0 {
        let size = graph.unary(Unary::Abs, field);
        let bound = graph.constant(lipschitz);
        let least = graph.div(size, bound);
        // In this order: where the distance is no number, it is the bound.
        graph.max(distance, least)
    } else {
        distance
    }
}

/// The length of `offset` without its part along `slope`.
fn aside(graph: &mut Graph, offset: [NodeId; 3], slope: [NodeId; 3]) -> NodeId {
    let (rise, square) = (dot(graph, slope, offset), dot(graph, slope, slope));
    let factor = graph.div(rise, square);
    let across: [NodeId; 3] = std::array::from_fn(|i| {
        let along = graph.mul(factor, slope[i]);
        graph.sub(offset[i], along)
    });
    length(graph, &across)
}

fn dot(graph: &mut Graph, a: [NodeId; 3], b: [NodeId; 3]) -> NodeId {
    let [x, y, z] = std::array::from_fn(|i| graph.mul(a[i], b[i]));
    let sum = graph.add(x, y);
    graph.add(sum, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, sphere};
    use crate::solid::walk::value;

    /// The ellipsoid's quadric, which is no distance, about the unit ball: f = (|x|² - 1) (1 + x/4).
    fn uneven_ball(graph: &mut Graph) -> Solid {
        let [x, y, z] = graph.point();
        let square = dot(graph, [x, y, z], [x, y, z]);
        let (one, quarter) = (graph.constant(1.0), graph.constant(0.25));
        let level = graph.sub(square, one);
        let slant = graph.mul(quarter, x);
        let slant = graph.add(one, slant);
        let field = graph.mul(level, slant);
        Solid::unbounded(graph, field)
    }

    #[test]
    fn exact_walls_have_their_thickness_where_the_field_is_uneven() {
        let mut graph = Graph::new();
        let thickness = graph.constant(0.3);
        let ball = uneven_ball(&mut graph);
        let exact = ball.clone().wall(&mut graph, thickness, Method::Exact);
        let rough = ball.wall(&mut graph, thickness, Method::Gradient);
        let (mut worst, mut roughest) = (0.0_f64, 0.0_f64);
        for direction in [[1.0, 0.0, 0.0], [-0.6, 0.8, 0.0], [0.48, 0.6, -0.64]] {
            for radius in [0.85, 0.95, 1.05, 1.15] {
                let at = direction.map(|d: f64| d * radius);
                let expected = (radius - 1.0_f64).abs() - 0.15;
                worst = worst.max((value(&graph, exact.field, at) - expected).abs());
                roughest = roughest.max((value(&graph, rough.field, at) - expected).abs());
            }
        }
        assert!(worst < 1e-5 && roughest > 0.01, "{worst} {roughest}");
    }

    #[test]
    fn a_wall_about_a_distance_is_its_shell() {
        let mut graph = Graph::new();
        let thickness = graph.constant(0.5);
        for shape in [sphere(&mut graph), cube(&mut graph)] {
            let wall = shape.clone().wall(&mut graph, thickness, Method::Exact);
            let shell = shape.shell(&mut graph, thickness);
            for point in [[0.8, 0.1, 0.0], [0.1, 1.2, -0.3], [1.1, 1.2, 1.3]] {
                let [a, b] = [&wall, &shell].map(|solid| value(&graph, solid.field, point));
                assert!((a - b).abs() < 1e-12, "{a} is not {b} at {point:?}");
            }
            assert_eq!(wall.bounds(&graph, &[]), shell.bounds(&graph, &[]));
        }
    }
}
