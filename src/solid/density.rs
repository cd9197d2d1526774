//! Solids of a wanted relative density: levels that are unknowns, to be solved for.
//!
//! `gyroid density 0.3` is {f < t} with a level t of which only this is known: that the solid then
//! fills three tenths of the part that it is put in. So the level is an unknown of the graph,
//! a parameter that no text names, and a [`Fraction`] says what it has to bring about. Who evaluates the
//! solid solves for it ([`job`](crate::job)), anew when parameters change. Nothing is compiled again.
//!
//! A density that varies in space needs a level that does. The distribution of the field's values
//! says which level L(r) a uniform lattice needs for the density r; L is kept as a Chebyshev
//! polynomial whose coefficients are unknowns too, and the level is L(r(x)) + t, where t makes the
//! whole right. That is the density of a uniform lattice at each point, so it holds where the
//! density varies little over a cell. Beyond the densities that occur in the part, L stays constant.
//!
//! Source: Clenshaw 1955, doi:10.1090/S0025-5718-1955-0071856-0, for the polynomial.

use super::extent::Rule;
use super::motions::vary;
use super::{Side, Solid, Span, Wall};
use crate::expr::{Graph, Node, NodeId, ParameterId, Unary};
use crate::num::elementary;

/// Coefficients of the polynomial that turns densities into levels.
pub const TERMS: usize = 12;

/// What the level of a family of solids has to bring about.
#[derive(Clone, Copy, Debug)]
pub struct Fraction {
    /// The unknown level t: the solid is {family < t}, or {family < L + t}.
    pub level: ParameterId,
    /// The field whose level it is.
    pub family: NodeId,
    /// The field less its level: negative in the solid.
    pub field: NodeId,
    /// The share of the part that the solid is to fill, above 0 and below 1.
    pub target: NodeId,
    /// The levels of uniform lattices; `None` if the target does not vary in space.
    pub curve: Option<Curve>,
    /// The text of the operation.
    pub span: Span,
}

/// The polynomial that turns densities into levels.
#[derive(Clone, Copy, Debug)]
pub struct Curve {
    /// The least and the greatest density, where the polynomial's argument is -1 and 1.
    pub ends: [ParameterId; 2],
    /// The coefficients of the Chebyshev polynomials, from degree 0 up.
    pub coefficients: [ParameterId; TERMS],
}

impl Solid {
    /// The solid at the level at which it fills the share `target` of the part that it is put in.
    ///
    /// The part is what the whole program makes of it were the level so high that nothing is left
    /// out, without what is solid even where the level is so low that nothing is left in.
    #[must_use]
    pub fn density(mut self, graph: &mut Graph, target: NodeId) -> Self {
        let (level, node) = unknown(graph);
        let (curve, height) = if vary(graph, &[target]) {
            let (curve, uniform) = curve(graph, target);
            (Some(curve), graph.add(uniform, node))
        } else {
            (None, node)
        };
        let family = self.field;
        if let Node::Unary(Unary::Abs, middle) = graph.node(family) {
            let (side, span) = (Side::Middle, Span::NOWHERE);
            self.walls.push(Wall { field: middle, half_thickness: height, side, span });
        }
        self.field = graph.sub(family, height);
        let (field, span) = (self.field, Span::NOWHERE);
        self.fractions.push(Fraction { level, family, field, target, curve, span });
        self.push(Rule::Everywhere);
        self
    }
}

/// A new unknown and its node.
fn unknown(graph: &mut Graph) -> (ParameterId, NodeId) {
    let slot = graph.unknown();
    (slot, graph.intern(Node::Parameter(slot)))
}

/// The level of a uniform lattice of the density `target`, as an expression of unknowns.
fn curve(graph: &mut Graph, target: NodeId) -> (Curve, NodeId) {
    let (least, low) = unknown(graph);
    let (greatest, high) = unknown(graph);
    let coefficients = [(); TERMS].map(|()| unknown(graph));
    let [minus, zero, one, two] = [-1.0, 0.0, 1.0, 2.0].map(|v| graph.constant(v));
    let sum = graph.add(low, high);
    let double = graph.mul(two, target);
    let (offset, width) = (graph.sub(double, sum), graph.sub(high, low));
    let u = graph.div(offset, width);
    let u = graph.max(u, minus);
    let u = graph.min(u, one);
    let twice = graph.mul(two, u);
    let (mut next, mut after) = (zero, zero);
    for (_, coefficient) in coefficients.iter().skip(1).rev() {
        let product = graph.mul(twice, next);
        let sum = graph.add(*coefficient, product);
        (next, after) = (graph.sub(sum, after), next);
    }
    let product = graph.mul(u, next);
    let sum = graph.add(coefficients[0].1, product);
    let level = graph.sub(sum, after);
    let coefficients = coefficients.map(|(slot, _)| slot);
    (Curve { ends: [least, greatest], coefficients }, level)
}

/// The coefficients of the polynomial that takes the value `value(u)` at the Chebyshev nodes u in
/// (-1, 1).
#[must_use]
pub fn coefficients(value: impl Fn(f64) -> f64) -> [f64; TERMS] {
    let angle = |j: usize| std::f64::consts::PI * (j as f64 + 0.5) / TERMS as f64;
    let values: [f64; TERMS] = std::array::from_fn(|j| value(elementary::cos(angle(j))));
    std::array::from_fn(|k| {
        let terms =
            values.iter().enumerate().map(|(j, v)| v * elementary::cos(k as f64 * angle(j)));
        let share = if k == 0 { 1.0 } else { 2.0 };
        share / TERMS as f64 * terms.sum::<f64>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Axis;
    use crate::solid::primitives::sphere;
    use crate::solid::walk::value;

    #[test]
    fn a_density_is_an_unknown_level() {
        let mut graph = Graph::new();
        let target = graph.constant(0.3);
        let solid = sphere(&mut graph).density(&mut graph, target);
        let [fraction] = solid.fractions[..] else { panic!("one fraction") };
        assert_eq!(fraction.level.index(), 0);
        assert!(graph.named_parameters().is_empty());
        graph.set_parameter(fraction.level, 0.25);
        assert_eq!(value(&graph, solid.field, [2.0, 0.0, 0.0]), 0.75);
    }

    #[test]
    fn a_varying_density_takes_its_level_from_the_curve() {
        let mut graph = Graph::new();
        let x = graph.coordinate(Axis::X);
        let ball = sphere(&mut graph);
        let solid = ball.clone().density(&mut graph, x);
        let curve = solid.fractions[0].curve.unwrap();
        // Levels that are the cube of the density, from 0.2 to 0.6.
        let found = coefficients(|u| (0.4 + 0.2 * u).powi(3));
        let slots = curve.ends.iter().chain(&curve.coefficients);
        for (slot, value) in slots.zip([0.2, 0.6].into_iter().chain(found)) {
            graph.set_parameter(*slot, value);
        }
        graph.set_parameter(solid.fractions[0].level, 0.01);
        for x in [0.2_f64, 0.35, 0.6] {
            let [whole, part] = [&ball, &solid].map(|s| value(&graph, s.field, [x, 0.0, 0.0]));
            let level = whole - part;
            assert!((level - x.powi(3) - 0.01).abs() < 1e-14, "{x}: {level}");
        }
    }
}
