//! Which expressions always have a value.
//!
//! An operator analysis: it knows the domains of the operators and which expressions are never
//! negative, nothing of ranges. So it says yes to polynomials, to sines and cosines of them and to
//! the length of a vector, and no to `log(x)`, `1/x` and `sqrt(1-x^2)`, also where their arguments
//! happen to stay in the domain.

use super::graph::operands;
use super::simplify::is_never_negative;
use super::{Binary, Graph, Node, NodeId, Unary, depends};
use rustc_hash::FxHashMap;

/// Whether `root` is a number at every point and for all values of the parameters, as long as no
/// operand of it overflows; `false` if that is not known.
#[must_use]
pub fn is_always_defined(graph: &Graph, root: NodeId) -> bool {
    let mut known: FxHashMap<NodeId, bool> = FxHashMap::default();
    for id in depends::reachable(graph, &[root]) {
        let node = graph.node(id);
        let defined = operands(&node).iter().all(|o| known[o]) && is_total(graph, node);
        known.insert(id, defined);
    }
    known[&root]
}

/// Whether `node` is a number wherever its operands are.
fn is_total(graph: &Graph, node: Node) -> bool {
    use Unary::{
        Abs, Acos, Asin, Atan, Cbrt, Ceil, Cos, Cosh, Exp, Floor, Log, Log10, Neg, Round, Sign,
        Sin, Sinh, Sqrt, Tan, Tanh,
    };
    let is_constant = |id: NodeId, holds: fn(f64) -> bool| graph.as_constant(id).is_some_and(holds);
    match node {
        Node::Coordinate(_) | Node::Parameter(_) | Node::Pick(..) | Node::Oracle(..) => true,
        Node::Constant(bits) => f64::from_bits(bits).is_finite(),
        Node::Unary(op, a) => match op {
            Neg | Abs | Sign | Cbrt | Floor | Ceil | Round | Sin | Cos | Tan | Atan | Sinh
            | Cosh | Tanh | Exp => true,
            Sqrt => is_never_negative(graph, a),
            // The logarithm of zero is infinite, and what comes of infinities is anyone's guess.
            Asin | Acos | Log | Log10 => false,
        },
        Node::Binary(op, a, b) => match op {
            Binary::Add | Binary::Sub | Binary::Mul | Binary::Min | Binary::Max => true,
            Binary::Atan2 | Binary::Hypot => true,
            Binary::Div | Binary::Mod => is_constant(b, |b| b != 0.0),
            Binary::Pow => {
                is_constant(a, |a| a > 0.0)
                    || is_constant(b, |b| b > 0.0 && b.fract() == 0.0)
                    || is_constant(b, |b| b > 0.0) && is_never_negative(graph, a)
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(make: impl FnOnce(&mut Graph, [NodeId; 3]) -> NodeId, expected: bool) {
        let mut graph = Graph::new();
        let point = graph.point();
        let root = make(&mut graph, point);
        assert_eq!(
            is_always_defined(&graph, root),
            expected,
            "{}",
            crate::expr::text::text(&graph, root)
        );
    }

    #[test]
    fn ordinary_fields_are_defined() {
        check(|g, [x, y, _]| g.mul(x, y), true);
        check(
            |g, [x, y, _]| {
                let (a, b) = (g.unary(Unary::Sin, x), g.unary(Unary::Cos, y));
                g.add(a, b)
            },
            true,
        );
        check(
            |g, [x, y, _]| {
                let (a, b) = (g.mul(x, x), g.mul(y, y));
                let sum = g.add(a, b);
                let root = g.unary(Unary::Sqrt, sum);
                let one = g.constant(1.0);
                g.sub(root, one)
            },
            true,
        );
        check(
            |g, [x, ..]| {
                let three = g.constant(3.0);
                g.div(x, three)
            },
            true,
        );
    }

    #[test]
    fn functions_with_a_domain_are_not() {
        for op in [Unary::Sqrt, Unary::Asin, Unary::Acos, Unary::Log, Unary::Log10] {
            check(|g, [x, ..]| g.unary(op, x), false);
            check(
                |g, [x, y, _]| {
                    let inner = g.unary(op, x);
                    g.add(inner, y)
                },
                false,
            );
        }
        for op in [Binary::Div, Binary::Mod, Binary::Pow] {
            check(|g, [x, y, _]| g.binary(op, x, y), false);
        }
        check(|g, _| g.constant(f64::NAN), false);
        check(
            |g, [x, ..]| {
                let half = g.constant(0.3);
                g.binary(Binary::Pow, x, half)
            },
            false,
        );
    }
}
