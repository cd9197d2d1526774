//! Translation, scaling and rotation: expressions in moved coordinates.
//!
//! A motion substitutes expressions for the coordinates of a field. Nothing is evaluated, so a
//! motion may depend on parameters.
//!
//! Source: the Cesogen paper, equations 6 to 8. Equation 8 pulls back by the right-handed rotation
//! matrix M, f(Mx), so the solid turns by minus the angle: a quarter turn about z carries (1,0,0) to
//! (0,-1,0). We keep that, and normalise the axis.

use super::extent::Rule;
use super::{Solid, Wall};
use crate::expr::graph::operands;
use crate::expr::{Binary, Graph, Node, NodeId, Unary};
use rustc_hash::FxHashMap;

/// Entries of a rotation matrix as near as this to -1, 0 or 1 are rounding errors of them.
///
/// pi/2 is no binary number, so the cosine of a quarter turn comes out as 6e-17. Without this, a
/// box turned by it would have slanted faces, and its field would depend on all three axes.
const NEGLIGIBLE: f64 = 4.0 * f64::EPSILON;

impl Solid {
    /// Moved by `offset`: f(x - offset).
    #[must_use]
    pub fn translate(self, graph: &mut Graph, offset: [NodeId; 3]) -> Self {
        let point = graph.point();
        let pulled = std::array::from_fn(|i| graph.sub(point[i], offset[i]));
        let mut moved = self.substituted(graph, pulled);
        moved.push(Rule::Translate(offset));
        moved
    }

    /// Scaled by `factor` along the axes: a f(x / factor) with a = min |factor|.
    ///
    /// Distances stay distances if the factors are equal in size, else they become bounds. Levels
    /// are scaled too: a dilation means more before than after a scaling down.
    #[must_use]
    pub fn scale(self, graph: &mut Graph, factor: [NodeId; 3]) -> Self {
        let point = graph.point();
        let pulled = std::array::from_fn(|i| graph.div(point[i], factor[i]));
        let [a, b, c] = factor.map(|f| graph.unary(Unary::Abs, f));
        let least = graph.min(a, b);
        let least = graph.min(least, c);
        let mut moved = self.substituted(graph, pulled);
        moved.field = graph.mul(least, moved.field);
        for wall in &mut moved.walls {
            wall.field = graph.mul(least, wall.field);
            wall.half_thickness = graph.mul(least, wall.half_thickness);
        }
        moved.push(Rule::Scale(factor));
        moved
    }

    /// Turned by minus `angle` radians about `axis`, which need not have unit length.
    #[must_use]
    pub fn rotate(self, graph: &mut Graph, angle: NodeId, axis: [NodeId; 3]) -> Self {
        let rows = rotation(graph, angle, axis);
        let point = graph.point();
        let pulled = rows.map(|row| dot(graph, row, point));
        let mut moved = self.substituted(graph, pulled);
        moved.push(Rule::Rotate(rows));
        moved
    }

    /// The solid with `point` in place of the coordinates.
    fn substituted(mut self, graph: &mut Graph, point: [NodeId; 3]) -> Self {
        let mut substitution = Substitution { point, known: FxHashMap::default() };
        self.field = substitution.of(graph, self.field);
        for Wall { field, .. } in &mut self.walls {
            *field = substitution.of(graph, *field);
        }
        self
    }
}

/// `root` with the expressions `point` in place of x, y and z.
#[must_use]
pub fn substitute(graph: &mut Graph, root: NodeId, point: [NodeId; 3]) -> NodeId {
    Substitution { point, known: FxHashMap::default() }.of(graph, root)
}

/// Expressions for the coordinates, and the nodes rebuilt so far.
struct Substitution {
    point: [NodeId; 3],
    known: FxHashMap<NodeId, NodeId>,
}

impl Substitution {
    /// Rebuilds what `root` reaches, operands first, through the simplifying constructors.
    fn of(&mut self, graph: &mut Graph, root: NodeId) -> NodeId {
        let mut pending = vec![root];
        while let Some(&top) = pending.last() {
            if self.known.contains_key(&top) {
                pending.pop();
                continue;
            }
            let node = graph.node(top);
            let before = pending.len();
            pending.extend(operands(&node).iter().filter(|o| !self.known.contains_key(o)));
            if pending.len() == before {
                let rebuilt = self.rebuilt(graph, top, node);
                self.known.insert(top, rebuilt);
                pending.pop();
            }
        }
        self.known[&root]
    }

    fn rebuilt(&self, graph: &mut Graph, id: NodeId, node: Node) -> NodeId {
        match node {
            Node::Coordinate(axis) => self.point[axis.index()],
            Node::Constant(_) | Node::Parameter(_) => id,
            Node::Unary(op, a) => graph.unary(op, self.known[&a]),
            Node::Binary(op, a, b) => graph.binary(op, self.known[&a], self.known[&b]),
            Node::Pick(extremum, list) => graph.pick(extremum, list.map(|o| self.known[&o])),
            Node::Oracle(oracle, output, at) => {
                graph.oracle(oracle, output, at.map(|o| self.known[&o]))
            }
        }
    }
}

/// Rows of the right-handed rotation by `angle` about `axis`: A + B of equation 8.
fn rotation(graph: &mut Graph, angle: NodeId, axis: [NodeId; 3]) -> [[NodeId; 3]; 3] {
    let [x, y, z] = unit(graph, axis);
    let (sine, cosine) = (graph.unary(Unary::Sin, angle), graph.unary(Unary::Cos, angle));
    let one = graph.constant(1.0);
    let versine = graph.sub(one, cosine);
    let v = [x, y, z];
    // Products with a component that is the constant zero are left out: a turn about z by a
    // parameter must not bring z into the other coordinates.
    let is_zero = |graph: &Graph, id: NodeId| graph.as_constant(id) == Some(0.0);
    let mut entry = |i: usize, j: usize| {
        let a = if is_zero(graph, v[i]) || is_zero(graph, v[j]) {
            graph.constant(0.0)
        } else {
            let square = graph.mul(v[i], v[j]);
            graph.mul(square, versine)
        };
        if i == j {
            let sum = plus(graph, a, Binary::Add, cosine);
            return rounded(graph, sum);
        }
        // B of equation 8: in row i and column j the third axis, with the sign of the cycle.
        let third = v[3 - i - j];
        let op = if (i + 1) % 3 == j { Binary::Sub } else { Binary::Add };
        let b = if is_zero(graph, third) { third } else { graph.mul(third, sine) };
        let sum = plus(graph, a, op, b);
        rounded(graph, sum)
    };
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// `a` plus or minus `b`, without the one that is the constant zero.
fn plus(graph: &mut Graph, a: NodeId, op: Binary, b: NodeId) -> NodeId {
    match (graph.as_constant(a), graph.as_constant(b)) {
        (Some(0.0), _) if op == Binary::Add => b,
        (Some(0.0), _) => graph.neg(b),
        (_, Some(0.0)) => a,
        _ => graph.binary(op, a, b),
    }
}

/// A constant entry of a rotation matrix, made -1, 0 or 1 if it is so but for rounding.
fn rounded(graph: &mut Graph, entry: NodeId) -> NodeId {
    match graph.as_constant(entry) {
        Some(value) if (value - value.round()).abs() < NEGLIGIBLE => graph.constant(value.round()),
        _ => entry,
    }
}

/// `v` divided by its length; by its greatest component first, so that no square overflows.
pub(super) fn unit(graph: &mut Graph, v: [NodeId; 3]) -> [NodeId; 3] {
    let [a, b, c] = v.map(|component| graph.unary(Unary::Abs, component));
    let greatest = graph.max(a, b);
    let greatest = graph.max(greatest, c);
    let v = v.map(|component| graph.div(component, greatest));
    let length = super::primitives::length(graph, &v);
    v.map(|component| graph.div(component, length))
}

/// The inner product of `row` and `point`, without the terms whose factor is the constant zero.
///
/// Dropping a term assumes that coordinates are finite numbers.
fn dot(graph: &mut Graph, row: [NodeId; 3], point: [NodeId; 3]) -> NodeId {
    let mut sum = None;
    for (factor, coordinate) in row.into_iter().zip(point) {
        let term = match graph.as_constant(factor) {
            Some(0.0) => continue,
            Some(1.0) => coordinate,
            Some(-1.0) => graph.neg(coordinate),
            _ => graph.mul(factor, coordinate),
        };
        sum = Some(sum.map_or(term, |sum| graph.add(sum, term)));
    }
    sum.unwrap_or_else(|| graph.constant(0.0))
}
