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
    fn joined(mut self, join: Join, mut other: Self, field: NodeId) -> Self {
        let order = if self.steps.len() < other.steps.len() {
            std::mem::swap(&mut self.steps, &mut other.steps);
            Order::Exchanged
        } else {
            Order::AsWritten
        };
        self.steps.append(&mut other.steps);
        self.walls.append(&mut other.walls);
        self.push(Rule::Join(join, order));
        self.field = field;
        self
    }
}
