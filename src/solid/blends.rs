//! Blends: one solid passing into another from place to place, by a weight that varies in space.
//!
//! > ((1 - w) f + w g) / |(1 - w, w)| - c (1 - (2 w - 1)²)
//!
//! with the weight w from 0 (the first solid) to 1 (the second). The fields of two lattices are
//! uncorrelated, so that a plain mean of them is flatter than either and its walls are thinner at the
//! same level; dividing by the length of the weights keeps the mean square. Where that is not enough,
//! a correction c, in units of the field, thickens the solid in the middle of the transition.
//!
//! **Bounds.** Where both fields exceed t >= 0 so does the blend without correction, the length being
//! 1 at most: it lies in the union of the boxes, grown by the correction.
//!
//! Source: the normalisation and the correction are those of ASLI (Perez-Boerema et al. 2022,
//! doi:10.1016/j.softx.2022.101091), which boosts the level by 1 + c (1 - (2 w - 1)²) instead.

use super::Solid;
use super::extent::Join;
use super::primitives::length;
use crate::expr::{Graph, NodeId, Unary};

/// How an equation becomes a weight from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// It is the weight, cut off below 0 and above 1.
    Weight,
    /// Straight across `width`, 1/2 where the equation is zero.
    Linear,
    /// The logistic curve 1 / (1 + exp(-4 e / width)), as steep in the middle as the straight ramp.
    Sigmoid,
}

impl Ramp {
    /// What the ramps are called, in order.
    pub const NAMES: &'static [&'static str] = &["weight", "linear", "sigmoid"];
    /// The ramps, in order.
    pub const ALL: [Self; 3] = [Self::Weight, Self::Linear, Self::Sigmoid];

    /// The weight that `equation` gives; `width` is positive and in the equation's units.
    pub fn weight(self, graph: &mut Graph, equation: NodeId, width: NodeId) -> NodeId {
        let [zero, half, one] = [0.0, 0.5, 1.0].map(|v| graph.constant(v));
        let straight = match self {
            Self::Weight => equation,
            Self::Linear => {
                let part = graph.div(equation, width);
                graph.add(part, half)
            }
            Self::Sigmoid => {
                let steepness = graph.constant(-4.0);
                let part = graph.div(equation, width);
                let exponent = graph.mul(steepness, part);
                let growth = graph.unary(Unary::Exp, exponent);
                let sum = graph.add(one, growth);
                return graph.div(one, sum);
            }
        };
        let raised = graph.max(straight, zero);
        graph.min(raised, one)
    }
}

impl Solid {
    /// `self` where `weight` is 0, `other` where it is 1; `correction` thickens the middle.
    #[must_use]
    pub fn blend(self, graph: &mut Graph, other: Self, weight: NodeId, correction: NodeId) -> Self {
        let one = graph.constant(1.0);
        let rest = graph.sub(one, weight);
        let (first, second) = (graph.mul(rest, self.field), graph.mul(weight, other.field));
        let sum = graph.add(first, second);
        let norm = length(graph, &[rest, weight]);
        let mut field = graph.div(sum, norm);
        let is_corrected = graph.as_constant(correction) != Some(0.0);
        if is_corrected {
            let off = graph.sub(weight, rest);
            let square = graph.mul(off, off);
            let middle = graph.sub(one, square);
            let more = graph.mul(correction, middle);
            field = graph.sub(field, more);
        }
        let mut joined = self.joined(Join::Union, other, field);
        if is_corrected {
            joined.grow(graph, correction);
        }
        joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Axis;
    use crate::solid::primitives::{cube, sphere};
    use crate::solid::walk::value;

    #[test]
    fn ramps_rise_from_nought_to_one() {
        let mut graph = Graph::new();
        let (x, width) = (graph.coordinate(Axis::X), graph.constant(2.0));
        let weights = Ramp::ALL.map(|ramp| ramp.weight(&mut graph, x, width));
        let at = |node: NodeId, x: f64| value(&graph, node, [x, 0.0, 0.0]);
        assert_eq!([-1.0, 0.25, 3.0].map(|x| at(weights[0], x)), [0.0, 0.25, 1.0]);
        assert_eq!([-1.5, 0.5, 1.5].map(|x| at(weights[1], x)), [0.0, 0.75, 1.0]);
        assert_eq!(at(weights[2], 0.0), 0.5);
        let slope = (at(weights[2], 1e-4) - at(weights[2], -1e-4)) / 2e-4;
        assert!((slope - 0.5).abs() < 1e-7);
        assert!(at(weights[2], -20.0) < 1e-15 && at(weights[2], 20.0) > 1.0 - 1e-15);
        assert_eq!([-1e9, 1e9].map(|x| at(weights[2], x)), [0.0, 1.0]);
    }

    #[test]
    fn a_blend_is_one_solid_at_each_end_and_thicker_in_the_middle() {
        let mut graph = Graph::new();
        let (x, tenth, zero) =
            (graph.coordinate(Axis::X), graph.constant(0.1), graph.constant(0.0));
        let (ball, block) = (sphere(&mut graph), cube(&mut graph));
        let weight = Ramp::Weight.weight(&mut graph, x, zero);
        let plain = ball.clone().blend(&mut graph, block.clone(), weight, zero);
        let thick = ball.clone().blend(&mut graph, block.clone(), weight, tenth);
        let points = [[-0.5, 0.2, 0.9], [1.5, 0.2, 0.9]];
        for (point, whole) in points.into_iter().zip([&ball, &block]) {
            for blend in [&plain, &thick] {
                assert_eq!(value(&graph, blend.field, point), value(&graph, whole.field, point));
            }
        }
        let middle = [0.5, 0.2, 0.9];
        let [a, b] = [&ball, &block].map(|solid| value(&graph, solid.field, middle));
        let expected = (0.5 * a + 0.5 * b) / 0.5_f64.sqrt();
        assert!((value(&graph, plain.field, middle) - expected).abs() < 1e-15);
        assert!((value(&graph, thick.field, middle) - expected + 0.1).abs() < 1e-15);
        assert_eq!(thick.bounds(&graph, &[]).hi.x, 1.1);
    }
}
