//! Union, intersection, difference and complement.
//!
//! Signed distances become bounds under them: right on the surface and in sign, too small elsewhere.
//!
//! Source: the Cesogen paper, equations 9 to 11.

use super::Solid;
use super::extent::{Join, Order, Rule};
use crate::expr::{Graph, NodeId};

impl Solid {
    /// What lies in either: min(f, g).
    #[must_use]
    pub fn union(self, graph: &mut Graph, other: Self) -> Self {
        let field = graph.min(self.field, other.field);
        self.joined(Join::Union, other, field)
    }

    /// What lies in both: max(f, g).
    #[must_use]
    pub fn intersection(self, graph: &mut Graph, other: Self) -> Self {
        let field = graph.max(self.field, other.field);
        self.joined(Join::Intersection, other, field)
    }

    /// What lies in `self` but not in `other`: max(f, -g).
    #[must_use]
    pub fn difference(self, graph: &mut Graph, other: Self) -> Self {
        let outside = graph.neg(other.field);
        let field = graph.max(self.field, outside);
        self.joined(Join::Difference, other, field)
    }

    /// What lies not in it: -f. It is unbounded.
    #[must_use]
    pub fn complement(mut self, graph: &mut Graph) -> Self {
        self.field = graph.neg(self.field);
        self.push(Rule::Everywhere);
        self
    }

    /// What lies in all of `solids`, in their order; `None` if there are none.
    #[must_use]
    pub fn intersection_of(
        graph: &mut Graph,
        solids: impl IntoIterator<Item = Self>,
    ) -> Option<Self> {
        solids.into_iter().reduce(|all, next| all.intersection(graph, next))
    }

    /// Appends the shorter list of steps to the longer, so that joining n solids in any order costs
    /// n log n.
    pub(super) fn joined(mut self, join: Join, mut other: Self, field: NodeId) -> Self {
        let order = if self.steps.len() < other.steps.len() {
            std::mem::swap(&mut self.steps, &mut other.steps);
            Order::Exchanged
        } else {
            Order::AsWritten
        };
        self.steps.append(&mut other.steps);
        self.walls.append(&mut other.walls);
        self.true_walls.append(&mut other.true_walls);
        self.fractions.append(&mut other.fractions);
        self.push(Rule::Join(join, order));
        self.field = field;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, cylinder, sphere};
    use crate::solid::walk::value;

    fn moved(graph: &mut Graph, solid: Solid, x: f64) -> Solid {
        let [x, zero] = [x, 0.0].map(|v| graph.constant(v));
        solid.translate(graph, [x, zero, zero])
    }

    #[test]
    fn sets_are_extrema_in_the_order_of_their_operands() {
        let mut graph = Graph::new();
        let (a, b) = (cube(&mut graph), sphere(&mut graph));
        let b = moved(&mut graph, b, 1.0);
        let at = |graph: &Graph, solid: &Solid, x: f64| value(graph, solid.field, [x, 0.0, 0.0]);
        let union = a.clone().union(&mut graph, b.clone());
        let both = a.clone().intersection(&mut graph, b.clone());
        let rest = a.clone().difference(&mut graph, b.clone());
        let out = a.clone().complement(&mut graph);
        assert_eq!([-0.5, 0.5, 1.5].map(|x| at(&graph, &union, x)), [-0.5, -0.5, -0.5]);
        assert_eq!([-0.5, 0.5, 1.5].map(|x| at(&graph, &both, x)), [0.5, -0.5, 0.5]);
        assert_eq!([-0.5, 0.5, 1.5].map(|x| at(&graph, &rest, x)), [-0.5, 0.5, 0.5]);
        assert_eq!([-0.5, 0.5, 1.5].map(|x| at(&graph, &out, x)), [0.5, 0.5, -0.5]);
        assert_eq!(union.field, graph.min(a.field, b.field));
        assert_eq!(both.field, graph.max(a.field, b.field));
    }

    #[test]
    fn growth_of_an_intersection_is_that_of_the_bounded_operand() {
        let mut graph = Graph::new();
        let factor = [4.0, 1.0, 1.0].map(|v| graph.constant(v));
        let long = cylinder(&mut graph).scale(&mut graph, factor);
        let both = long.intersection_with_cube(&mut graph);
        // Along x both have ends, along z only the cube.
        assert_eq!(both.extent(&graph, &[]).growth.to_array(), [4.0, 1.0, 1.0]);
    }

    impl Solid {
        fn intersection_with_cube(self, graph: &mut Graph) -> Self {
            let other = cube(graph);
            self.intersection(graph, other)
        }
    }

    #[test]
    fn either_operand_may_have_the_longer_list_of_steps() {
        let mut graph = Graph::new();
        let small = cube(&mut graph);
        let large = sphere(&mut graph);
        let large = moved(&mut graph, large, 3.0);
        for (a, b) in [(&small, &large), (&large, &small)] {
            let rest = a.clone().difference(&mut graph, b.clone());
            assert_eq!(rest.bounds(&graph, &[]), a.bounds(&graph, &[]));
        }
    }

    #[test]
    fn ten_thousand_parts_are_joined_quickly_in_any_order() {
        let mut graph = Graph::new();
        let parts: Vec<Solid> = (0..10_000)
            .map(|i| {
                let part = cube(&mut graph);
                moved(&mut graph, part, f64::from(i))
            })
            .collect();
        let left = parts.iter().cloned().reduce(|all, part| all.union(&mut graph, part)).unwrap();
        let right =
            parts.into_iter().rev().reduce(|all, part| part.union(&mut graph, all)).unwrap();
        for solid in [left, right] {
            let bounds = solid.bounds(&graph, &[]);
            assert_eq!((bounds.lo.x, bounds.hi.x), (-1.0, 10_000.0));
        }
    }
}
