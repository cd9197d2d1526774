//! Translation, scaling and rotation: expressions in moved coordinates.
//!
//! A motion substitutes expressions for the coordinates of a field. Nothing is evaluated, so a
//! motion may depend on parameters. It may vary in space, too: then it is a map that pulls the field
//! back, f(M(x)), with its own offset, factor or angle at each point. Values mean as much as before
//! under varying offsets and angles, but distances are distances no more; where bounds go,
//! `warps.rs` says.
//!
//! Source: the Cesogen paper, equations 6 to 8. Equation 8 pulls back by the right-handed rotation
//! matrix M, f(Mx), so the solid turns by minus the angle: a quarter turn about z carries (1,0,0) to
//! (0,-1,0). We keep that, and normalise the axis.

use super::extent::{Rule, Step};
use super::warps::Warp;
use super::{Fraction, Solid, Span, TrueWall, Wall};
use crate::expr::graph::operands;
use crate::expr::{Binary, Graph, Node, NodeId, Unary, depends, derive};
use rustc_hash::FxHashMap;

/// Entries of a rotation matrix as near as this to -1, 0 or 1 are rounding errors of them.
///
/// pi/2 is no binary number, so the cosine of a quarter turn comes out as 6e-17. Without this, a
/// box turned by it would have slanted faces, and its field would depend on all three axes.
const NEGLIGIBLE: f64 = 4.0 * f64::EPSILON;

/// A motion, whose numbers may depend on parameters and vary in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// See [`Solid::translate`].
    Translate([NodeId; 3]),
    /// See [`Solid::scale`].
    Scale([NodeId; 3]),
    /// By the rows of a rotation matrix: f(Mx).
    Rotate([[NodeId; 3]; 3]),
}

impl Motion {
    /// See [`Solid::rotate`].
    #[must_use]
    pub fn rotate(graph: &mut Graph, angle: NodeId, axis: [NodeId; 3]) -> Self {
        // What is computed on the way to nine constants is left in a graph of its own.
        let mut own = Graph::new();
        let numbers = [angle, axis[0], axis[1], axis[2]];
        let numbers = numbers.map(|n| graph.as_constant(n).map(|value| own.constant(value)));
        let known: Option<Vec<f64>> = if let [Some(angle), Some(x), Some(y), Some(z)] = numbers {
            let rows = rotation(&mut own, angle, [x, y, z]);
            rows.as_flattened().iter().map(|entry| own.as_constant(*entry)).collect()
        } else {
            None
        };
        Self::Rotate(match known.as_deref() {
            Some(&[a, b, c, d, e, f, g, h, i]) => {
                [[a, b, c], [d, e, f], [g, h, i]].map(|row| row.map(|entry| graph.constant(entry)))
            }
            _ => rotation(graph, angle, axis),
        })
    }

    /// Whether it is another at every point.
    #[must_use]
    pub fn varies(&self, graph: &Graph) -> bool {
        vary(graph, self.numbers())
    }

    fn numbers(&self) -> &[NodeId] {
        match self {
            Self::Translate(numbers) | Self::Scale(numbers) => numbers,
            Self::Rotate(rows) => rows.as_flattened(),
        }
    }

    /// The same at `point`, an expression of the coordinates of another space.
    fn at(self, graph: &mut Graph, point: [NodeId; 3]) -> Self {
        if !self.varies(graph) {
            return self;
        }
        let mut there = Substitution { point, known: FxHashMap::default() };
        let mut at = |numbers: [NodeId; 3]| numbers.map(|number| there.of(graph, number));
        match self {
            Self::Translate(offset) => Self::Translate(at(offset)),
            Self::Scale(factor) => Self::Scale(at(factor)),
            Self::Rotate(rows) => Self::Rotate(rows.map(at)),
        }
    }

    /// Where the field is asked for its value at `point`.
    fn pulled(self, graph: &mut Graph, point: [NodeId; 3]) -> [NodeId; 3] {
        match self {
            Self::Translate(offset) => std::array::from_fn(|i| graph.sub(point[i], offset[i])),
            Self::Scale(factor) => std::array::from_fn(|i| graph.div(point[i], factor[i])),
            Self::Rotate(rows) => rows.map(|row| dot(graph, row, point)),
        }
    }

    /// What its values are multiplied by.
    fn factor(self, graph: &mut Graph) -> Option<NodeId> {
        let Self::Scale(factor) = self else { return None };
        let [a, b, c] = factor.map(|f| graph.unary(Unary::Abs, f));
        let least = graph.min(a, b);
        Some(graph.min(least, c))
    }

    /// What it does to an extent.
    fn rule(self, graph: &mut Graph) -> Rule {
        match (self, self.varies(graph)) {
            (Self::Translate(by), true) => {
                let slopes = by.map(|component| derive::gradient(graph, component));
                Rule::Warp(Warp::Translate { by, slopes })
            }
            (Self::Translate(offset), false) => Rule::Translate(offset),
            (Self::Scale(factor), true) => Rule::Warp(Warp::Scale(factor)),
            (Self::Scale(factor), false) => Rule::Scale(factor),
            (Self::Rotate(rows), true) => Rule::Warp(Warp::Rotate(rows)),
            (Self::Rotate(rows), false) => Rule::Rotate(rows),
        }
    }
}

impl Solid {
    /// Moved by `offset`: f(x - offset).
    #[must_use]
    pub fn translate(self, graph: &mut Graph, offset: [NodeId; 3]) -> Self {
        self.moved(graph, &[(Motion::Translate(offset), Span::NOWHERE)])
    }

    /// Scaled by `factor` along the axes: a f(x / factor) with a = min |factor|.
    ///
    /// Distances stay distances if the factors are equal in size, else they become bounds. Levels
    /// are scaled too: a dilation means more before than after a scaling down. A factor that varies
    /// scales levels by what it is at the point.
    #[must_use]
    pub fn scale(self, graph: &mut Graph, factor: [NodeId; 3]) -> Self {
        self.moved(graph, &[(Motion::Scale(factor), Span::NOWHERE)])
    }

    /// Turned by minus `angle` radians about `axis`, which need not have unit length.
    #[must_use]
    pub fn rotate(self, graph: &mut Graph, angle: NodeId, axis: [NodeId; 3]) -> Self {
        let motion = Motion::rotate(graph, angle, axis);
        self.moved(graph, &[(motion, Span::NOWHERE)])
    }

    /// Moved by one after the other of `motions`, each the text at its span.
    ///
    /// The same as by one at a time, but the field is rebuilt but once.
    #[must_use]
    pub fn moved(self, graph: &mut Graph, motions: &[(Motion, Span)]) -> Self {
        if motions.is_empty() {
            return self;
        }
        // From the last motion to the first, each at what those after it make of the point.
        let mut point = graph.point();
        let mut there = Vec::new();
        for (i, (motion, _)) in motions.iter().rev().enumerate() {
            let motion = if i == 0 { *motion } else { motion.at(graph, point) };
            point = motion.pulled(graph, point);
            there.push(motion);
        }
        let mut moved = self.substituted(graph, point);
        for motion in there.iter().rev() {
            let Some(least) = motion.factor(graph) else { continue };
            moved.field = graph.mul(least, moved.field);
            for wall in &mut moved.walls {
                wall.field = graph.mul(least, wall.field);
                wall.half_thickness = graph.mul(least, wall.half_thickness);
            }
        }
        for &(motion, span) in motions {
            let rule = motion.rule(graph);
            moved.steps.push(Step { rule, span });
        }
        moved
    }

    /// The solid with `point` in place of the coordinates.
    pub(super) fn substituted(mut self, graph: &mut Graph, point: [NodeId; 3]) -> Self {
        let mut substitution = Substitution { point, known: FxHashMap::default() };
        self.field = substitution.of(graph, self.field);
        for Wall { field, half_thickness, .. } in &mut self.walls {
            *field = substitution.of(graph, *field);
            *half_thickness = substitution.of(graph, *half_thickness);
        }
        for TrueWall { place, .. } in &mut self.true_walls {
            *place = place.map(|coordinate| substitution.of(graph, coordinate));
        }
        for Fraction { family, field, target, .. } in &mut self.fractions {
            *family = substitution.of(graph, *family);
            *field = substitution.of(graph, *field);
            *target = substitution.of(graph, *target);
        }
        self
    }
}

/// Whether one of `numbers` varies in space.
pub(super) fn vary(graph: &Graph, numbers: &[NodeId]) -> bool {
    numbers.iter().any(|number| depends::on_point(graph, *number))
}

/// `root` with the expressions `point` in place of x, y and z.
#[must_use]
pub fn substitute(graph: &mut Graph, root: NodeId, point: [NodeId; 3]) -> NodeId {
    Substitution { point, known: FxHashMap::default() }.of(graph, root)
}

/// `root` with the expression `by` in place of the node `replaced`.
#[must_use]
pub fn replace(graph: &mut Graph, root: NodeId, replaced: NodeId, by: NodeId) -> NodeId {
    let known = std::iter::once((replaced, by)).collect();
    Substitution { point: graph.point(), known }.of(graph, root)
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
///
/// An entry that depends on parameters stays as it is: rounded, its derivative would vanish at
/// quarter turns, where optimizers like to start. Such a turn is exact to rounding only.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, sphere};
    use crate::solid::walk::value;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

    fn constants(graph: &mut Graph, values: [f64; 3]) -> [NodeId; 3] {
        values.map(|value| graph.constant(value))
    }

    /// A small ball at (1, 0, 0), turned.
    fn turned_ball(graph: &mut Graph, angle: f64, axis: [f64; 3]) -> Solid {
        let small = graph.constant(0.25);
        let offset = constants(graph, [1.0, 0.0, 0.0]);
        let ball = sphere(graph).scale(graph, [small; 3]).translate(graph, offset);
        let (angle, axis) = (graph.constant(angle), constants(graph, axis));
        ball.rotate(graph, angle, axis)
    }

    #[test]
    fn a_quarter_turn_about_z_carries_x_to_minus_y() {
        let mut graph = Graph::new();
        let solid = turned_ball(&mut graph, FRAC_PI_2, [0.0, 0.0, 7.0]);
        assert_eq!(value(&graph, solid.field, [0.0, -1.0, 0.0]), -0.25);
        let bounds = solid.bounds(&graph, &[]);
        assert_eq!(bounds.lo.to_array(), [-0.25, -1.25, -0.25]);
        assert_eq!(bounds.hi.to_array(), [0.25, -0.75, 0.25]);
    }

    #[test]
    fn rotation_follows_equation_8() {
        // M of the paper for a unit axis, written out independently of the entries above.
        let (angle, axis) = (FRAC_PI_6, [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0]);
        let (s, c) = angle.sin_cos();
        let [v1, v2, v3] = axis;
        let b = [[c, -v3 * s, v2 * s], [v3 * s, c, -v1 * s], [-v2 * s, v1 * s, c]];
        let point = [0.3, -0.8, 1.1];
        let mut pulled = [0.0; 3];
        for i in 0..3 {
            for j in 0..3 {
                pulled[i] += (axis[i] * axis[j] * (1.0 - c) + b[i][j]) * point[j];
            }
        }
        let mut graph = Graph::new();
        let shape = cube(&mut graph);
        let expected = value(&graph, shape.field, pulled);
        let (angle, axis) = (graph.constant(angle), constants(&mut graph, [4.0, -2.0, 4.0]));
        let turned = shape.rotate(&mut graph, angle, axis);
        let found = value(&graph, turned.field, point);
        assert!((found - expected).abs() < 1e-14, "{found} is not {expected}");
    }

    #[test]
    fn a_turned_box_keeps_flat_faces_and_a_turn_about_z_leaves_z_alone() {
        let mut graph = Graph::new();
        let axis = constants(&mut graph, [0.0, 0.0, 1.0]);
        let angle = graph.constant(FRAC_PI_2);
        let turned = cube(&mut graph).rotate(&mut graph, angle, axis);
        for x in [-0.9, 0.1, 0.7] {
            assert_eq!(value(&graph, turned.field, [x, 1.0, 0.0]), 0.0);
        }
        let t = graph.parameter("t", 0.5);
        let rows = rotation(&mut graph, t, axis);
        let point = graph.point();
        let z = dot(&mut graph, rows[2], point);
        let mut values = crate::solid::Values::new(&graph, &[0.5]);
        assert!((values.of(rows[2][2]).unwrap() - 1.0).abs() < 1e-15);
        assert_eq!((values.of(rows[2][0]), values.of(rows[0][2])), (Some(0.0), Some(0.0)));
        let reached = |axis: crate::geom::Axis| {
            let mut pending = vec![z];
            let mut found = false;
            while let Some(id) = pending.pop() {
                found |= graph.node(id) == Node::Coordinate(axis);
                pending.extend(operands(&graph.node(id)).iter());
            }
            found
        };
        assert!(!reached(crate::geom::Axis::X) && !reached(crate::geom::Axis::Y));
    }

    #[test]
    fn scaling_multiplies_levels_by_the_least_factor() {
        let mut graph = Graph::new();
        let factor = constants(&mut graph, [2.0, -3.0, 4.0]);
        let solid = sphere(&mut graph).scale(&mut graph, factor);
        assert_eq!(value(&graph, solid.field, [0.0, 0.0, 8.0]), 2.0);
        assert_eq!(value(&graph, solid.field, [0.0, 3.0, 0.0]), 0.0);
        let extent = solid.extent(&graph, &[]);
        assert_eq!(extent.bounds.hi.to_array(), [2.0, 3.0, 4.0]);
        assert_eq!(extent.growth.to_array(), [1.0, 1.5, 2.0]);
        assert_eq!(extent.lipschitz, 1.0);
    }

    #[test]
    fn motions_at_once_are_motions_one_by_one() {
        let mut graph = Graph::new();
        let graph = &mut graph;
        let t = graph.parameter("t", 0.3);
        let [x, ..] = graph.point();
        let one = graph.constant(1.0);
        let growing = graph.add(one, t);
        let growing = graph.mul(growing, x);
        let growing = graph.unary(Unary::Exp, growing);
        let (offset, skew) =
            (constants(graph, [0.3, -0.2, 1.0]), constants(graph, [1.0, 2.0, 0.5]));
        let turn = Motion::rotate(graph, t, skew);
        let motions = [
            Motion::Scale([one, growing, t]),
            Motion::Translate([t, growing, x]),
            turn,
            Motion::Scale(skew),
            Motion::Translate(offset),
        ];
        let ball = sphere(graph).shell(graph, t);
        let mut slowly = ball.clone();
        for motion in motions {
            slowly = slowly.moved(graph, &[(motion, Span::NOWHERE)]);
        }
        let spanned = motions.map(|motion| (motion, Span::NOWHERE));
        let at_once = ball.moved(graph, &spanned);
        assert_eq!(at_once.field, slowly.field);
        assert_eq!(at_once.walls, slowly.walls);
        let steps = |solid: &Solid| format!("{:?}", solid.steps);
        assert_eq!(steps(&at_once), steps(&slowly));
    }

    #[test]
    fn walls_move_with_their_solid() {
        let mut graph = Graph::new();
        let (thick, two) = (graph.constant(0.5), graph.constant(2.0));
        let offset = constants(&mut graph, [5.0, 0.0, 0.0]);
        let solid = sphere(&mut graph).shell(&mut graph, thick);
        let solid = solid.scale(&mut graph, [two; 3]).translate(&mut graph, offset);
        let [wall] = solid.walls[..] else { panic!("one wall, not {}", solid.walls.len()) };
        assert_eq!(graph.as_constant(wall.half_thickness), Some(0.5));
        assert_eq!(value(&graph, wall.field, [7.0, 0.0, 0.0]), 0.0);
        assert_eq!(value(&graph, solid.field, [7.0, 0.0, 0.0]), -0.5);
    }

    #[test]
    fn substitution_is_not_stopped_by_depth() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let deep = (0..100_000).fold(x, |sum, _| graph.add(sum, y));
        let moved = substitute(&mut graph, deep, [z, x, y]);
        assert_eq!(value(&graph, moved, [0.5, 0.0, 1.0]), 50_001.0);
    }
}
