//! Derivatives of expressions, as expressions.
//!
//! Accumulation is forward: the derivative of a node is built from those of its operands, one
//! direction at a time. It gives the smaller graph here. Most nodes of a field depend on one or
//! two axes, and a derivative that is zero for want of dependence is never built; local factors
//! (the cosine of a sine, the choice of an extremum) are one node for the three directions, by
//! hash-consing; and the derivative of a union stays a [`Node::Pick`] between the derivatives of
//! its sides, so that it is pruned with them. Reverse accumulation would sum the shares of all
//! sides at each coordinate, where nothing can be skipped and a discarded side's infinite slope
//! times zero is NaN. The gyroid has 18 nodes, 34 with its gradient; a union of a hundred spheres
//! has 1401, with its gradient 1998.
//!
//! Where a function has a kink or a jump the derivative is that of one side: of the second operand
//! of an extremum at ties, of `a` for `abs(a)` at zero; `sign`, `floor`, `ceil` and `round` have
//! derivative zero everywhere. The derivative of an oracle's partial derivative is taken as zero.

use super::depends::reachable;
use super::{Binary, Extremum, Graph, Node, NodeId, Output, ParameterId, Unary};
use crate::geom::Axis;

/// The derivative of `root` along `axis`.
pub fn partial(graph: &mut Graph, root: NodeId, axis: Axis) -> NodeId {
    forward(graph, root, Node::Coordinate(axis))
}

/// The derivatives of `root` along the three axes.
pub fn gradient(graph: &mut Graph, root: NodeId) -> [NodeId; 3] {
    Axis::ALL.map(|axis| partial(graph, root, axis))
}

/// The derivative of `root` by a parameter.
pub fn by_parameter(graph: &mut Graph, root: NodeId, parameter: ParameterId) -> NodeId {
    forward(graph, root, Node::Parameter(parameter))
}

/// The derivative of `root` by the leaf `variable`.
fn forward(graph: &mut Graph, root: NodeId, variable: Node) -> NodeId {
    // A node without an entry does not depend on the variable.
    let mut slopes = Slopes(vec![None; root.index() + 1]);
    for id in reachable(graph, &[root]) {
        let node = graph.node(id);
        let slope =
            if node == variable { Some(graph.constant(1.0)) } else { slope(graph, id, &slopes) };
        slopes.0[id.index()] = slope;
    }
    slopes.of(root).unwrap_or_else(|| graph.constant(0.0))
}

/// The derivatives of nodes by index; none for zero.
struct Slopes(Vec<Option<NodeId>>);

impl Slopes {
    fn of(&self, id: NodeId) -> Option<NodeId> {
        self.0[id.index()]
    }
}

/// The derivative of the node `id` given those of its operands; `None` for zero.
fn slope(graph: &mut Graph, id: NodeId, slopes: &Slopes) -> Option<NodeId> {
    let of = |id: NodeId| slopes.of(id);
    match graph.node(id) {
        Node::Coordinate(_) | Node::Constant(_) | Node::Parameter(_) => None,
        Node::Unary(op, a) => unary(graph, op, id, a, of(a)?),
        Node::Binary(op, a, b) => binary(graph, op, id, [a, b], [of(a), of(b)]),
        Node::Pick(extremum, [a, b, c, d]) => pick(graph, extremum, [a, b], [of(c), of(d)]),
        Node::Oracle(_, Output::Partial(_), _) => None,
        Node::Oracle(oracle, Output::Value, at) => {
            let mut sum = None;
            for axis in Axis::ALL {
                if let Some(slope) = of(at[axis.index()]) {
                    let partial = graph.oracle(oracle, Output::Partial(axis), at);
                    let share = graph.mul(partial, slope);
                    sum = add(graph, sum, Some(share));
                }
            }
            sum
        }
    }
}

/// The derivative of `value`, which is `op(a)`, where `da` is that of `a`.
fn unary(graph: &mut Graph, op: Unary, value: NodeId, a: NodeId, da: NodeId) -> Option<NodeId> {
    let slope = match op {
        Unary::Neg => graph.neg(da),
        Unary::Abs => {
            let (zero, opposite) = (graph.constant(0.0), graph.neg(da));
            graph.pick(Extremum::Min, [a, zero, opposite, da])
        }
        Unary::Sign | Unary::Floor | Unary::Ceil | Unary::Round => return None,
        Unary::Sqrt => match half(graph, da) {
            Some(half) => graph.div(half, value),
            None => {
                let double = scaled(graph, 2.0, value);
                graph.div(da, double)
            }
        },
        Unary::Cbrt => {
            let square = graph.mul(value, value);
            let triple = scaled(graph, 3.0, square);
            graph.div(da, triple)
        }
        Unary::Sin => {
            let cosine = graph.unary(Unary::Cos, a);
            graph.mul(cosine, da)
        }
        Unary::Cos => {
            let sine = graph.unary(Unary::Sin, a);
            let product = graph.mul(sine, da);
            graph.neg(product)
        }
        Unary::Tan => {
            let growth = one_plus_square(graph, value);
            graph.mul(growth, da)
        }
        Unary::Asin => {
            let root = root_of_one_minus_square(graph, a);
            graph.div(da, root)
        }
        Unary::Acos => {
            let root = root_of_one_minus_square(graph, a);
            let quotient = graph.div(da, root);
            graph.neg(quotient)
        }
        Unary::Atan => {
            let growth = one_plus_square(graph, a);
            graph.div(da, growth)
        }
        Unary::Sinh => {
            let cosine = graph.unary(Unary::Cosh, a);
            graph.mul(cosine, da)
        }
        Unary::Cosh => {
            let sine = graph.unary(Unary::Sinh, a);
            graph.mul(sine, da)
        }
        Unary::Tanh => {
            let rest = one_minus_square(graph, value);
            graph.mul(rest, da)
        }
        Unary::Exp => graph.mul(value, da),
        Unary::Log => graph.div(da, a),
        Unary::Log10 => {
            let scale = scaled(graph, std::f64::consts::LN_10, a);
            graph.div(da, scale)
        }
    };
    Some(slope)
}

/// The derivative of `value`, which is `op(a, b)`, where `da` and `db` are those of `a` and `b`.
fn binary(
    graph: &mut Graph,
    op: Binary,
    value: NodeId,
    [a, b]: [NodeId; 2],
    [da, db]: [Option<NodeId>; 2],
) -> Option<NodeId> {
    if da.is_none() && db.is_none() {
        return None;
    }
    match op {
        Binary::Add => add(graph, da, db),
        Binary::Sub => sub(graph, da, db),
        Binary::Mul if a == b => {
            let product = times(graph, Some(a), da)?;
            Some(scaled(graph, 2.0, product))
        }
        Binary::Mul => {
            let left = times(graph, da, Some(b));
            let right = times(graph, Some(a), db);
            add(graph, left, right)
        }
        Binary::Div => {
            // (a/b)' = (a' - (a/b) b') / b: shares the quotient and cannot overflow in b².
            let right = times(graph, Some(value), db);
            let difference = sub(graph, da, right)?;
            Some(graph.div(difference, b))
        }
        Binary::Min => pick(graph, Extremum::Min, [a, b], [da, db]),
        Binary::Max => pick(graph, Extremum::Max, [a, b], [da, db]),
        Binary::Mod => {
            let right = db.map(|db| {
                let quotient = graph.div(a, b);
                let periods = graph.unary(Unary::Floor, quotient);
                graph.mul(periods, db)
            });
            sub(graph, da, right)
        }
        Binary::Pow => power(graph, value, [a, b], [da, db]),
        Binary::Atan2 => {
            let left = times(graph, da, Some(b));
            let right = times(graph, Some(a), db);
            let difference = sub(graph, left, right)?;
            let (aa, bb) = (graph.mul(a, a), graph.mul(b, b));
            let square = graph.add(aa, bb);
            Some(graph.div(difference, square))
        }
        Binary::Hypot => {
            let left = times(graph, Some(a), da);
            let right = times(graph, Some(b), db);
            let sum = add(graph, left, right)?;
            Some(graph.div(sum, value))
        }
    }
}

/// The derivative of `value`, which is `a^b`.
///
/// Where the exponent does not vary only the power rule is used: it holds for negative bases too.
/// Otherwise the base must be positive for the result to be a number.
fn power(
    graph: &mut Graph,
    value: NodeId,
    [a, b]: [NodeId; 2],
    [da, db]: [Option<NodeId>; 2],
) -> Option<NodeId> {
    let by_base = da.map(|da| {
        let one = graph.constant(1.0);
        let less = graph.sub(b, one);
        let lower = graph.binary(Binary::Pow, a, less);
        let factor = graph.mul(b, lower);
        graph.mul(factor, da)
    });
    let by_exponent = db.map(|db| {
        let logarithm = graph.unary(Unary::Log, a);
        let factor = graph.mul(value, logarithm);
        graph.mul(factor, db)
    });
    add(graph, by_base, by_exponent)
}

/// The choice of `extremum` between `a` and `b`, made between `da` and `db`.
fn pick(
    graph: &mut Graph,
    extremum: Extremum,
    [a, b]: [NodeId; 2],
    [da, db]: [Option<NodeId>; 2],
) -> Option<NodeId> {
    if da.is_none() && db.is_none() {
        return None;
    }
    let [da, db] = [da, db].map(|d| d.unwrap_or_else(|| graph.constant(0.0)));
    Some(graph.pick(extremum, [a, b, da, db]))
}

/// `a + b`, where `None` is zero; the double of a sum for a sum of doubles.
fn add(graph: &mut Graph, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(match (half(graph, a), half(graph, b)) {
            (Some(a), Some(b)) => {
                let sum = graph.add(a, b);
                scaled(graph, 2.0, sum)
            }
            _ => graph.add(a, b),
        }),
        (one, None) | (None, one) => one,
    }
}

/// `a` if `id` is `a * 2`: the squares under a root bring a factor that the root takes away.
fn half(graph: &Graph, id: NodeId) -> Option<NodeId> {
    if let Node::Binary(Binary::Mul, a, b) = graph.node(id)
        && graph.as_constant(b) == Some(2.0)
    {
        return Some(a);
    }
    None
}

/// `a - b`, where `None` is zero.
fn sub(graph: &mut Graph, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(graph.sub(a, b)),
        (None, Some(b)) => Some(graph.neg(b)),
        (one, None) => one,
    }
}

/// `a * b`, where `None` is zero whatever the other factor is.
fn times(graph: &mut Graph, a: Option<NodeId>, b: Option<NodeId>) -> Option<NodeId> {
    let (a, b) = (a?, b?);
    Some(graph.mul(a, b))
}

fn scaled(graph: &mut Graph, factor: f64, a: NodeId) -> NodeId {
    let factor = graph.constant(factor);
    graph.mul(factor, a)
}

fn one_plus_square(graph: &mut Graph, a: NodeId) -> NodeId {
    let (one, square) = (graph.constant(1.0), graph.mul(a, a));
    graph.add(one, square)
}

fn one_minus_square(graph: &mut Graph, a: NodeId) -> NodeId {
    let (one, square) = (graph.constant(1.0), graph.mul(a, a));
    graph.sub(one, square)
}

fn root_of_one_minus_square(graph: &mut Graph, a: NodeId) -> NodeId {
    let rest = one_minus_square(graph, a);
    graph.unary(Unary::Sqrt, rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::probe::{Simplified, Source, evaluate, random};
    use crate::expr::{Failure, Oracle, Queries};
    use crate::num::Interval;
    use std::sync::Arc;

    /// Value and gradient of `root` at a point.
    fn tangent(graph: &Graph, root: NodeId, gradient: [NodeId; 3], at: [f64; 3]) -> [f64; 4] {
        let values = evaluate(graph, at, &[0.7, -1.3]);
        [root, gradient[0], gradient[1], gradient[2]].map(|id| values[id.index()])
    }

    /// Compares the gradient of `build` with central differences at random points of [lo, hi]³.
    fn check(lo: f64, hi: f64, build: impl Fn(&mut Graph, [NodeId; 3]) -> NodeId) {
        let mut graph = Graph::new();
        let point = graph.point();
        let root = build(&mut graph, point);
        let gradient = gradient(&mut graph, root);
        let mut source = Source(1);
        for _ in 0..50 {
            let at = [(); 3].map(|()| source.within(lo, hi));
            let exact = tangent(&graph, root, gradient, at);
            for axis in 0..3 {
                let step = 1e-5;
                let [above, below] = [step, -step].map(|step| {
                    let mut at = at;
                    at[axis] += step;
                    tangent(&graph, root, gradient, at)[0]
                });
                let difference = (above - below) / (2.0 * step);
                let slope = exact[axis + 1];
                // Differences err by step² times the third derivative and by rounding / step.
                let close =
                    (slope - difference).abs() <= 1e-6 * (1.0 + slope.abs() + exact[0].abs());
                assert!(close, "{slope} is not {difference} along {axis} at {at:?}");
            }
        }
    }

    #[test]
    fn every_unary_operator_has_the_slope_of_its_differences() {
        for op in Unary::ALL {
            // All are smooth on (0.1, 0.9) / 1.9; products and sums exercise the chain rule.
            check(0.1, 0.9, |graph, [x, y, z]| {
                let xy = graph.mul(x, y);
                let sum = graph.add(xy, z);
                let scale = graph.constant(1.9);
                let inner = graph.div(sum, scale);
                let outer = graph.unary(op, inner);
                graph.mul(outer, x)
            });
        }
        check(-0.9, -0.1, |graph, [x, ..]| graph.unary(Unary::Abs, x));
    }

    #[test]
    fn every_binary_operator_has_the_slope_of_its_differences() {
        for op in Binary::ALL {
            // y + 1 > x throughout, so that no extremum is tied and `mod` does not jump.
            check(0.2, 0.9, |graph, [x, y, z]| {
                let one = graph.constant(1.0);
                let (above, product) = (graph.add(y, one), graph.mul(x, z));
                let (left, right) = (graph.binary(op, product, above), graph.binary(op, above, z));
                if op == Binary::Mod { left } else { graph.mul(left, right) }
            });
            check(0.2, 0.9, |graph, [x, y, ..]| {
                let three = graph.constant(3.0);
                let left = graph.binary(op, x, three);
                if op == Binary::Mod {
                    return left;
                }
                let right = graph.binary(op, three, y);
                graph.add(left, right)
            });
        }
    }

    #[test]
    fn a_power_of_a_negative_base_has_a_slope() {
        check(-2.0, -0.5, |graph, [x, ..]| {
            let three = graph.constant(3.0);
            graph.binary(Binary::Pow, x, three)
        });
    }

    #[test]
    fn a_square_is_derived_once() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        let square = graph.mul(x, x);
        let slope = partial(&mut graph, square, Axis::X);
        let values = evaluate(&graph, [3.0, 0.0, 0.0], &[]);
        assert_eq!(values[slope.index()], 6.0);
    }

    #[test]
    fn the_gradient_of_a_distance_has_no_factors_of_two() {
        let mut graph = Graph::new();
        let squares = graph.point().map(|axis| graph.mul(axis, axis));
        let sum = squares.into_iter().reduce(|a, b| graph.add(a, b)).unwrap();
        let distance = graph.unary(Unary::Sqrt, sum);
        let slope = partial(&mut graph, distance, Axis::Y);
        let y = graph.coordinate(Axis::Y);
        assert_eq!(graph.node(slope), Node::Binary(Binary::Div, y, distance));
    }

    #[test]
    fn steps_have_no_slope() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        for op in [Unary::Sign, Unary::Floor, Unary::Ceil, Unary::Round] {
            let step = graph.unary(op, x);
            let slope = partial(&mut graph, step, Axis::X);
            assert_eq!(graph.as_constant(slope), Some(0.0));
        }
    }

    #[test]
    fn the_slope_of_an_extremum_is_that_of_the_value_taken() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        let (two, three) = (graph.constant(2.0), graph.constant(3.0));
        let (left, right) = (graph.mul(two, x), graph.mul(three, x));
        for (op, expected) in [(Binary::Min, [3.0, 2.0, 3.0]), (Binary::Max, [2.0, 3.0, 3.0])] {
            let root = graph.binary(op, left, right);
            let slope = partial(&mut graph, root, Axis::X);
            let along_y = partial(&mut graph, root, Axis::Y);
            assert_eq!(graph.as_constant(along_y), Some(0.0));
            // Ties take the second operand.
            for (at, expected) in [-1.0, 1.0, 0.0].into_iter().zip(expected) {
                assert_eq!(evaluate(&graph, [at, 0.0, 0.0], &[])[slope.index()], expected);
            }
        }
    }

    #[test]
    fn an_expression_of_one_axis_has_two_constant_zero_partials() {
        let mut graph = Graph::new();
        let [_, y, _] = graph.point();
        let root = graph.unary(Unary::Exp, y);
        let [dx, dy, dz] = gradient(&mut graph, root);
        assert_eq!(graph.as_constant(dx), Some(0.0));
        assert_eq!(graph.as_constant(dz), Some(0.0));
        let values = evaluate(&graph, [0.0, 0.5, 0.0], &[]);
        assert_eq!(values[dy.index()], values[root.index()]);
    }

    #[test]
    fn parameters_have_derivatives_too() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        let p = graph.parameter("p", 2.0);
        let Node::Parameter(slot) = graph.node(p) else { unreachable!() };
        let product = graph.mul(p, x);
        let root = graph.unary(Unary::Sin, product);
        let slope = by_parameter(&mut graph, root, slot);
        let value = evaluate(&graph, [0.3, 0.0, 0.0], &[2.0])[slope.index()];
        assert!((value - 0.3 * 0.6f64.cos()).abs() < 1e-15);
    }

    #[test]
    fn random_expressions_have_the_slope_of_their_differences() {
        let mut source = Source(7);
        let mut compared = 0;
        for _ in 0..400 {
            let mut graph = Graph::new();
            let root = random::<Simplified>(&mut graph, &mut source, 12, &[0.5, 2.0, 3.0]);
            let gradient = gradient(&mut graph, root);
            let at = [(); 3].map(|()| source.within(0.2, 1.2));
            let exact = tangent(&graph, root, gradient, at);
            for axis in 0..3 {
                let along = |step: f64| {
                    let mut at = at;
                    at[axis] += step;
                    tangent(&graph, root, gradient, at)
                };
                let step = 1e-5;
                let (above, below) = (along(step), along(-step));
                // Away from kinks and jumps the slope itself varies little across the step.
                let slopes = [above, below, exact].map(|t| t[axis + 1]);
                let scale = 1.0 + exact[0].abs() + slopes[2].abs();
                let smooth = slopes.iter().all(|s| (s - slopes[2]).abs() < 1e-3 * scale);
                let jump = (above[0] - below[0]).abs() > 1e-2 * scale;
                if !smooth || jump || scale > 1e6 {
                    continue;
                }
                let difference = (above[0] - below[0]) / (2.0 * step);
                assert!((difference - slopes[2]).abs() <= 1e-3 * scale, "{difference} {slopes:?}");
                compared += 1;
            }
        }
        assert!(compared > 500, "only {compared} slopes were compared");
    }

    /// The distance to the unit sphere at the origin.
    #[derive(Debug)]
    struct Sphere;

    impl Oracle for Sphere {
        fn name(&self) -> &str {
            "sphere"
        }

        fn points(&self, queries: Queries<'_>) -> Result<(), Failure> {
            let Queries { at, value, mut gradient } = queries;
            for i in 0..value.len() {
                let p = at.map(|axis| axis[i]);
                let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
                value[i] = length - 1.0;
                for (partials, p) in gradient.iter_mut().flatten().zip(p) {
                    partials[i] = p / length;
                }
            }
            Ok(())
        }

        fn range(&self, _: [Interval; 3]) -> Interval {
            Interval::ANYTHING
        }
    }

    #[test]
    fn an_oracle_obeys_the_chain_rule() {
        check(0.2, 0.9, |graph, [x, y, z]| {
            let sphere: Arc<dyn Oracle> = Arc::new(Sphere);
            let sphere = graph.add_oracle(&sphere);
            let (xy, sine) = (graph.mul(x, y), graph.unary(Unary::Sin, z));
            let sum = graph.add(x, z);
            graph.oracle(sphere, Output::Value, [xy, sine, sum])
        });
    }

    #[test]
    fn a_deep_expression_is_derived_without_recursion() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        let mut root = x;
        for _ in 0..100_000 {
            root = graph.unary(Unary::Sin, root);
        }
        partial(&mut graph, root, Axis::X);
    }
}
