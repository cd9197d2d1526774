//! Cells whose length changes along one axis, without shear and without phases that run away.
//!
//! A periodic field f(x) has cells of one length. Written f(x / s(x)), with a local length s, it has
//! cells of another one: the phase x / s changes by 1/s - x s'/s², so that far from the origin cells
//! are as short or as long as the slope of s pleases, and may turn back. The phase that gives the length
//! asked for is the integral
//!
//! > phi(x) = ∫₀ˣ dt / s(t) = x ∫₀¹ du / s(u x),
//!
//! here by Gauss-Legendre quadrature with 24 nodes, as an expression: its derivative, its
//! ranges and its parameters are the engine's business, and where s depends on the stretched axis
//! alone it costs nothing per sample. The error falls like a geometric series where s is analytic: a
//! pole of 1/s half as far beyond the ends as the solid is long leaves 1e-20. An s with kinks is
//! integrated to about 1e-3 of a cell. The origin stays where it is, and so does the level.
//!
//! **Bounds.** x = phi / mean(1/s), so that x lies between phi times the least and the greatest s.
//!
//! Source: the phase integral is that of a chirp, phi' = 1/s; nodes and weights by Newton's method on
//! the Legendre polynomials (Press et al., Numerical Recipes, section 4.6).

use super::extent::Rule;
use super::motions::vary;
use super::warps::Warp;
use super::{Side, Solid};
use crate::expr::{Graph, NodeId};
use crate::geom::Axis;
use crate::num::elementary;

/// Nodes of the quadrature.
const NODES: usize = 24;

impl Solid {
    /// What repeats over a length of 1 along `axis` repeats over the local length `size`, which is
    /// positive and may vary in space.
    #[must_use]
    pub fn stretch(self, graph: &mut Graph, axis: Axis, size: NodeId) -> Self {
        let point = graph.point();
        let coordinate = point[axis.index()];
        let phase = if vary(graph, &[size]) {
            let mean = mean_rate(graph, axis, size);
            graph.mul(coordinate, mean)
        } else {
            graph.div(coordinate, size)
        };
        let mut pulled = point;
        pulled[axis.index()] = phase;
        let mut stretched = self.substituted(graph, pulled);
        stretched.walls.retain(|wall| wall.side == Side::Middle);
        let mut factor = [graph.constant(1.0); 3];
        factor[axis.index()] = size;
        stretched.push(Rule::Warp(Warp::Scale(factor)));
        stretched
    }
}

/// The mean of 1 / `size` from the origin to the point, along `axis`.
fn mean_rate(graph: &mut Graph, axis: Axis, size: NodeId) -> NodeId {
    let point = graph.point();
    let mut sum = None;
    for (node, weight) in gauss_legendre() {
        let (node, weight) = (graph.constant(node), graph.constant(weight));
        let mut there = point;
        there[axis.index()] = graph.mul(node, point[axis.index()]);
        let local = super::motions::substitute(graph, size, there);
        let term = graph.div(weight, local);
        sum = Some(sum.map_or(term, |sum| graph.add(sum, term)));
    }
    sum.expect("the quadrature has nodes")
}

/// Nodes in (0, 1) with their weights, which add up to 1.
fn gauss_legendre() -> [(f64, f64); NODES] {
    std::array::from_fn(|i| {
        // The usual guess at root i of the polynomial, from the end +1.
        let guess = std::f64::consts::PI * (i as f64 + 0.75) / (NODES as f64 + 0.5);
        let mut x = elementary::cos(guess);
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=NODES {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = NODES as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::Values;
    use crate::solid::walk::value;

    #[test]
    fn the_quadrature_is_exact_for_polynomials() {
        for power in 0..2 * NODES as i32 {
            let sum: f64 = gauss_legendre().iter().map(|(x, w)| w * x.powi(power)).sum();
            assert!((sum * f64::from(power + 1) - 1.0).abs() < 1e-13, "{power}: {sum}");
        }
    }

    #[test]
    fn the_phase_is_the_integral_of_one_over_the_length() {
        let mut graph = Graph::new();
        let z = graph.coordinate(Axis::Z);
        let [half, fifth] = [0.5, 0.2].map(|v| graph.constant(v));
        let slope = graph.mul(fifth, z);
        let size = graph.add(half, slope);
        let solid = Solid::unbounded(&mut graph, z).stretch(&mut graph, Axis::Z, size);
        for z in [-2.0_f64, -0.5, 0.0, 1.0, 10.0] {
            let expected = 5.0 * ((0.5 + 0.2 * z) / 0.5).ln();
            let found = value(&graph, solid.field, [0.0, 0.0, z]);
            assert!((found - expected).abs() < 1e-12, "{z}: {found}, not {expected}");
        }
    }

    #[test]
    fn a_constant_length_is_a_scaling_that_keeps_the_level() {
        let mut graph = Graph::new();
        let (x, size) = (graph.coordinate(Axis::X), graph.constant(4.0));
        let solid = Solid::unbounded(&mut graph, x).stretch(&mut graph, Axis::X, size);
        assert_eq!(value(&graph, solid.field, [2.0, 0.0, 0.0]), 0.5);
        let cube = super::super::primitives::cube(&mut graph);
        let bounds = cube.stretch(&mut graph, Axis::X, size).bounds(&graph, &[]);
        assert_eq!((bounds.hi.x, bounds.hi.y), (4.0, 1.0));
        assert!(Values::new(&graph, &[]).of(size).is_some());
    }
}
