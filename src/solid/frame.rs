//! The box of a solid as expressions of the parameters, for what is placed by it.
//!
//! It is the box of [`Solid::extent`](super::Solid::extent), but for the rounding of turned boxes, with an expression for
//! each of its ends: what is placed by them follows the parameters, and has derivatives. Where the
//! box is not finite, or a number varies in space, there is none.

use super::Solid;
use super::extent::{Join, Leaf, Order, Rule};
use crate::expr::{Binary, Graph, NodeId, Unary};

/// The least and the greatest corner of a box.
pub type Corners = [[NodeId; 3]; 2];

/// A box whose ends may lie at infinity, and its growth: see [`Extent`](super::extent::Extent).
#[derive(Clone, Copy, Debug)]
struct Frame {
    /// `None` at infinity.
    lo: [Option<NodeId>; 3],
    hi: [Option<NodeId>; 3],
    growth: [NodeId; 3],
}

impl Solid {
    /// The corners of the box that holds the solid; `None` if it is not finite, or not known as an
    /// expression.
    #[must_use]
    pub fn corners(&self, graph: &mut Graph) -> Option<Corners> {
        let mut stack: Vec<Frame> = Vec::new();
        for step in &self.steps {
            let frame = match &step.rule {
                Rule::Leaf(leaf) => Frame::leaf(graph, leaf),
                Rule::Join(join, order) => {
                    let (second, first) = (stack.pop()?, stack.pop()?);
                    match order {
                        Order::AsWritten => first.joined(graph, second, *join),
                        Order::Exchanged => second.joined(graph, first, *join),
                    }
                }
                Rule::Grow(by) => stack.pop()?.grown(graph, *by),
                Rule::Everywhere | Rule::Map => Frame::everywhere(graph),
                Rule::Quotient(by) => stack.pop()?.quotient(graph, *by),
                Rule::Translate(by) => stack.pop()?.translated(graph, *by),
                Rule::Scale(by) => stack.pop()?.scaled(graph, *by),
                Rule::Rotate(rows) => stack.pop()?.rotated(graph, *rows),
                Rule::Warp(_) => return None,
            };
            stack.push(frame);
        }
        let Frame { lo, hi, .. } = stack.pop()?;
        let all = |ends: [Option<NodeId>; 3]| Some([ends[0]?, ends[1]?, ends[2]?]);
        Some([all(lo)?, all(hi)?])
    }
}

impl Frame {
    fn leaf(graph: &mut Graph, leaf: &Leaf) -> Self {
        let is_finite = |end: &NodeId| graph.as_constant(*end).is_none_or(f64::is_finite);
        let [lo, hi] = leaf.bounds.map(|corner| corner.map(|end| Some(end).filter(is_finite)));
        let one = graph.constant(1.0);
        Self { lo, hi, growth: [one; 3] }
    }

    fn everywhere(graph: &mut Graph) -> Self {
        let one = graph.constant(1.0);
        Self { lo: [None; 3], hi: [None; 3], growth: [one; 3] }
    }

    fn grown(self, graph: &mut Graph, by: NodeId) -> Self {
        let zero = graph.constant(0.0);
        let by = graph.max(by, zero);
        let ways = self.growth.map(|growth| graph.mul(growth, by));
        let lo = each(|i| self.lo[i].map(|end| graph.sub(end, ways[i])));
        let hi = each(|i| self.hi[i].map(|end| graph.add(end, ways[i])));
        Self { lo, hi, ..self }
    }

    fn quotient(self, graph: &mut Graph, by: f64) -> Self {
        let by = graph.constant(by);
        Self { growth: self.growth.map(|growth| graph.mul(growth, by)), ..self }
    }

    fn translated(self, graph: &mut Graph, by: [NodeId; 3]) -> Self {
        let lo = each(|i| self.lo[i].map(|end| graph.add(end, by[i])));
        let hi = each(|i| self.hi[i].map(|end| graph.add(end, by[i])));
        Self { lo, hi, ..self }
    }

    fn scaled(self, graph: &mut Graph, by: [NodeId; 3]) -> Self {
        let ends = each(|i| self.times(graph, i, by[i]));
        let sizes = by.map(|factor| graph.unary(Unary::Abs, factor));
        let [a, b, c] = sizes;
        let least = graph.min(a, b);
        let least = graph.min(least, c);
        let growth = each(|i| {
            let ratio = graph.div(sizes[i], least);
            graph.mul(self.growth[i], ratio)
        });
        Self { lo: ends.map(|[lo, _]| lo), hi: ends.map(|[_, hi]| hi), growth }
    }

    fn rotated(self, graph: &mut Graph, rows: [[NodeId; 3]; 3]) -> Self {
        let zero = graph.constant(0.0);
        let mut turned = Self { lo: [Some(zero); 3], hi: [Some(zero); 3], growth: [zero; 3] };
        for axis in 0..3 {
            for (j, row) in rows.iter().enumerate() {
                let entry = row[axis];
                // Nothing is contributed even by an infinite end.
                if graph.as_constant(entry) == Some(0.0) {
                    continue;
                }
                let [lo, hi] = self.times(graph, j, entry);
                turned.lo[axis] = of_both(graph, turned.lo[axis], lo, Binary::Add);
                turned.hi[axis] = of_both(graph, turned.hi[axis], hi, Binary::Add);
                let size = graph.unary(Unary::Abs, entry);
                let way = graph.mul(size, self.growth[j]);
                turned.growth[axis] = graph.add(turned.growth[axis], way);
            }
        }
        turned
    }

    fn joined(self, graph: &mut Graph, other: Self, join: Join) -> Self {
        match join {
            Join::Difference => self,
            Join::Union => Self {
                lo: each(|i| of_both(graph, self.lo[i], other.lo[i], Binary::Min)),
                hi: each(|i| of_both(graph, self.hi[i], other.hi[i], Binary::Max)),
                growth: each(|i| graph.max(self.growth[i], other.growth[i])),
            },
            Join::Intersection => Self {
                lo: each(|i| of_either(graph, self.lo[i], other.lo[i], Binary::Max)),
                hi: each(|i| of_either(graph, self.hi[i], other.hi[i], Binary::Min)),
                growth: each(|i| match (self.has_end(i), other.has_end(i)) {
                    (true, false) => self.growth[i],
                    (false, true) => other.growth[i],
                    _ => graph.max(self.growth[i], other.growth[i]),
                }),
            },
        }
    }

    fn has_end(&self, axis: usize) -> bool {
        self.lo[axis].is_some() || self.hi[axis].is_some()
    }

    /// The lesser and the greater of the ends along `axis` times `factor`.
    fn times(&self, graph: &mut Graph, axis: usize, factor: NodeId) -> [Option<NodeId>; 2] {
        let [a, b] = [self.lo, self.hi].map(|ends| ends[axis].map(|end| graph.mul(end, factor)));
        match graph.as_constant(factor) {
            Some(factor) if factor < 0.0 => [b, a],
            Some(_) => [a, b],
            None => [Binary::Min, Binary::Max].map(|extremum| of_both(graph, a, b, extremum)),
        }
    }
}

fn each<T>(make: impl FnMut(usize) -> T) -> [T; 3] {
    [0, 1, 2].map(make)
}

/// What `op` makes of two ends; none if either is none.
fn of_both(graph: &mut Graph, a: Option<NodeId>, b: Option<NodeId>, op: Binary) -> Option<NodeId> {
    Some(graph.binary(op, a?, b?))
}

/// What `op` makes of two ends; the other one if either is none.
fn of_either(
    graph: &mut Graph,
    a: Option<NodeId>,
    b: Option<NodeId>,
    op: Binary,
) -> Option<NodeId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(graph.binary(op, a, b)),
        (one, None) | (None, one) => one,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::Values;
    use crate::solid::primitives::{cube, cylinder, sphere};

    /// Checks that the corners are the ends of the numeric box for several parameter values.
    fn check(make: impl Fn(&mut Graph, NodeId) -> Solid) {
        let mut graph = Graph::new();
        let t = graph.parameter("t", 1.0);
        let solid = make(&mut graph, t);
        let corners = solid.corners(&mut graph).unwrap();
        for t in [0.3, 1.0, -0.7] {
            let known = solid.bounds(&graph, &[t]);
            let parameters = [t];
            let mut values = Values::new(&graph, &parameters);
            let [lo, hi] = corners.map(|corner| values.triple(corner));
            for i in 0..3 {
                assert!((lo[i] - known.lo[i]).abs() < 1e-13, "{t}: {lo:?} {known:?}");
                assert!((hi[i] - known.hi[i]).abs() < 1e-13, "{t}: {hi:?} {known:?}");
            }
        }
    }

    #[test]
    fn corners_are_the_ends_of_the_box() {
        check(|graph, t| {
            let two = graph.constant(2.0);
            sphere(graph).scale(graph, [t, two, t]).translate(graph, [t, two, two])
        });
        check(|graph, t| {
            let (a, b) = (cube(graph), sphere(graph));
            let b = b.translate(graph, [t, t, t]);
            a.union(graph, b).dilate(graph, t)
        });
        check(|graph, t| {
            let [zero, one] = [0.0, 1.0].map(|v| graph.constant(v));
            let turned = cube(graph).rotate(graph, t, [one, one, zero]);
            let ball = sphere(graph).translate(graph, [t, zero, zero]);
            turned.intersection(graph, ball)
        });
        check(|graph, t| {
            let half = graph.constant(0.5);
            let (a, b) = (cylinder(graph), sphere(graph));
            let a = a.scale(graph, [half; 3]);
            let shell = b.difference(graph, a).shell(graph, half);
            shell.translate(graph, [t, half, t])
        });
    }

    #[test]
    fn there_are_none_without_a_finite_box() {
        let mut graph = Graph::new();
        let x = graph.point()[0];
        let plane = Solid::unbounded(&mut graph, x);
        assert!(plane.corners(&mut graph).is_none());
        let outside = sphere(&mut graph).complement(&mut graph);
        assert!(outside.corners(&mut graph).is_none());
        let ball = sphere(&mut graph);
        let cut = plane.intersection(&mut graph, ball);
        assert!(cut.corners(&mut graph).is_some());
        let two = graph.constant(2.0);
        let factor = graph.add(x, two);
        let warped = sphere(&mut graph).scale(&mut graph, [factor; 3]);
        assert!(warped.corners(&mut graph).is_none());
    }
}
