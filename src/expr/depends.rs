//! What an expression depends on: the nodes below it, and the axes that matter to it.

use super::graph::operands;
use super::{Graph, Node, NodeId};
use crate::geom::Axis;
use std::fmt;

/// A set of coordinate axes.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AxisSet(u8);

impl AxisSet {
    /// No axis.
    pub const EMPTY: Self = Self(0);
    /// The three axes.
    pub const ALL: Self = Self(0b111);

    /// The set of `axis` alone.
    #[must_use]
    pub const fn only(axis: Axis) -> Self {
        Self(1 << axis.index())
    }

    /// The axes that are in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether `axis` is in the set.
    #[must_use]
    pub const fn contains(self, axis: Axis) -> bool {
        self.0 & Self::only(axis).0 != 0
    }

    /// Whether every axis of this set is in `other`.
    #[must_use]
    pub const fn is_subset(self, other: Self) -> bool {
        self.0 & !other.0 == 0
    }

    /// Number of axes in the set, 0 to 3.
    #[must_use]
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether the set has no axis.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Position of the set among the eight: bit `axis.index()` tells whether `axis` is in it.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The axes of the set in order.
    pub fn iter(self) -> impl Iterator<Item = Axis> {
        Axis::ALL.into_iter().filter(move |axis| self.contains(*axis))
    }
}

impl FromIterator<Axis> for AxisSet {
    fn from_iter<I: IntoIterator<Item = Axis>>(axes: I) -> Self {
        axes.into_iter().fold(Self::EMPTY, |set, axis| set.union(Self::only(axis)))
    }
}

impl fmt::Debug for AxisSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

/// For each node of `graph`, by index, the axes of the coordinates it is computed from.
///
/// The dependence is of form, not of value: `x * 0` depends on x.
#[must_use]
pub fn axes(graph: &Graph) -> Vec<AxisSet> {
    let mut sets: Vec<AxisSet> = Vec::with_capacity(graph.len());
    for (_, node) in graph.iter() {
        let own = match node {
            Node::Coordinate(axis) => AxisSet::only(axis),
            Node::Constant(_)
            | Node::Parameter(_)
            | Node::Unary(..)
            | Node::Binary(..)
            | Node::Pick(..)
            | Node::Oracle(..) => AxisSet::EMPTY,
        };
        let set = operands(&node).iter().fold(own, |set, o| set.union(sets[o.index()]));
        sets.push(set);
    }
    sets
}

/// Whether `root` is computed from a coordinate.
///
/// Of form, not of value, as in [`axes`]; takes time in proportion to what `root` reaches.
#[must_use]
pub fn on_point(graph: &Graph, root: NodeId) -> bool {
    let is_coordinate = |id: NodeId| matches!(graph.node(id), Node::Coordinate(_));
    graph.as_constant(root).is_none() && reachable(graph, &[root]).into_iter().any(is_coordinate)
}

/// The nodes that `roots` are computed from, the roots included, operands before users.
///
/// Takes time in proportion to their number, and a bit for every node before the last root.
#[must_use]
pub fn reachable(graph: &Graph, roots: &[NodeId]) -> Vec<NodeId> {
    let last = roots.iter().map(|root| root.index() + 1).max().unwrap_or(0);
    let mut seen = vec![0u64; last.div_ceil(64)];
    let mut insert = |id: NodeId| {
        let (word, bit) = (id.index() / 64, 1 << (id.index() % 64));
        let is_new = seen[word] & bit == 0;
        seen[word] |= bit;
        is_new
    };
    let mut nodes: Vec<NodeId> = roots.iter().copied().filter(|root| insert(*root)).collect();
    let mut next = 0;
    while let Some(&id) = nodes.get(next) {
        next += 1;
        nodes.extend(operands(&graph.node(id)).iter().filter(|operand| insert(**operand)));
    }
    nodes.sort_unstable();
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{Binary, Unary};

    #[test]
    fn sets_unite_and_list_their_axes_in_order() {
        let xz: AxisSet = [Axis::Z, Axis::X].into_iter().collect();
        assert_eq!(xz.iter().collect::<Vec<_>>(), [Axis::X, Axis::Z]);
        assert_eq!((xz.len(), xz.index()), (2, 0b101));
        assert!(xz.contains(Axis::X) && !xz.contains(Axis::Y));
        assert_eq!(xz.union(AxisSet::only(Axis::Y)), AxisSet::ALL);
        assert!(xz.is_subset(AxisSet::ALL) && !AxisSet::ALL.is_subset(xz));
        assert!(AxisSet::EMPTY.is_empty() && !xz.is_empty());
        assert_eq!(format!("{xz:?}"), "{X, Z}");
    }

    #[test]
    fn a_node_depends_on_the_axes_of_its_operands() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let parameter = graph.parameter("a", 2.0);
        let sine = graph.unary(Unary::Sin, x);
        let product = graph.mul(sine, z);
        let scaled = graph.binary(Binary::Hypot, parameter, y);
        let sets = axes(&graph);
        assert_eq!(sets.len(), graph.len());
        assert_eq!(sets[parameter.index()], AxisSet::EMPTY);
        assert_eq!(sets[sine.index()], AxisSet::only(Axis::X));
        assert_eq!(sets[product.index()], [Axis::X, Axis::Z].into_iter().collect());
        assert_eq!(sets[scaled.index()], AxisSet::only(Axis::Y));
    }

    #[test]
    fn reachable_nodes_are_those_below_the_roots() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let (a, b) = (graph.add(x, y), graph.mul(y, z));
        let c = graph.mul(a, a);
        assert_eq!(reachable(&graph, &[c]), [x, y, a, c]);
        assert_eq!(reachable(&graph, &[b, a, b]), [x, y, z, a, b]);
        assert_eq!(reachable(&graph, &[]), []);
    }
}
