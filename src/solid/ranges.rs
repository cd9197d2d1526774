//! Ranges of expressions over a box, perhaps an unbounded one.
//!
//! The natural interval extension: every value that the expression takes in the box lies in the
//! range, which may be several times too wide. Oracles have the range that they say; their slopes have any value.

use super::Values;
use crate::expr::enclosure;
use crate::expr::{Node, NodeId, Output, depends};
use crate::geom::Aabb;
use crate::num::Interval;
use rustc_hash::FxHashMap;

impl Values<'_> {
    /// The range of `root` in `domain`, for the values of the parameters; takes time in proportion
    /// to what `root` reaches.
    ///
    /// An empty box has the range of the whole space.
    #[must_use]
    pub fn range(&self, root: NodeId, domain: &Aabb) -> Interval {
        let side = |axis: usize| Interval::new(domain.lo[axis], domain.hi[axis]);
        let mut known: FxHashMap<NodeId, Interval> = FxHashMap::default();
        for id in depends::reachable(self.graph(), &[root]) {
            let at = |id: NodeId| known[&id];
            let range = match self.graph().node(id) {
                Node::Coordinate(axis) => Interval { nan: false, ..side(axis.index()) },
                Node::Constant(bits) => Interval::point(f64::from_bits(bits)),
                Node::Parameter(slot) => {
                    let value = self.parameters().get(slot.index());
                    value.map_or(Interval::ANYTHING, |value| Interval::point(*value))
                }
                Node::Unary(op, a) => enclosure::unary(op, at(a)),
                Node::Binary(op, a, b) if a == b && op == crate::expr::Binary::Mul => {
                    at(a).square()
                }
                Node::Binary(op, a, b) => enclosure::binary(op, at(a), at(b)),
                Node::Pick(extremum, list) => enclosure::pick(extremum, list.map(at)),
                Node::Oracle(oracle, Output::Value, point) => {
                    self.graph().oracles()[oracle.index()].range(point.map(at))
                }
                Node::Oracle(..) => Interval::ANYTHING,
            };
            known.insert(id, range);
        }
        known[&root]
    }

    /// The largest magnitude of `root` in `domain`.
    #[must_use]
    pub(super) fn magnitude(&self, root: NodeId, domain: &Aabb) -> f64 {
        let range = self.range(root, domain);
        range.hi.max(-range.lo)
    }
}
