//! Rewrite rules, applied as nodes are made.
//!
//! A rule preserves the value at every operand to the bit: signed zeros and infinities count, the
//! payload and sign of a NaN do not. So `a + 0.0` stays (it turns -0.0 into 0.0) while `a - 0.0`
//! is `a`; `a - a` and `a * 0.0` stay (they may be NaN); nothing is reassociated. The one
//! exception is a matter of definition: a power with a constant whole exponent up to
//! [`PRODUCT_LIMIT`] in magnitude *is* the product, by squaring from the leading binary digit, or
//! one divided by it.
//!
//! Normal forms: a constant is the second operand of a sum or product, other operands of these are
//! in the order of their ids; negations move outwards, out of products, quotients and odd functions,
//! until a sum or a constant factor takes them in.
//!
//! A rule may call the constructors again, but only on operands with fewer negations or operators,
//! so the depth of calls is bounded whatever the depth of the expression.

use super::{Binary, Extremum, Graph, Node, NodeId, Unary};

/// Largest magnitude of a constant whole exponent that makes a power a product.
pub const PRODUCT_LIMIT: f64 = 16.0;

/// Operators that are looked at to see that a value is never negative.
const SIGN_DEPTH: usize = 6;

type UnaryRule = fn(&mut Graph, Unary, NodeId) -> Option<NodeId>;
type BinaryRule = fn(&mut Graph, Binary, NodeId, NodeId) -> Option<NodeId>;
type PickRule = fn(&mut Graph, Extremum, [NodeId; 4]) -> Option<NodeId>;

const UNARY: [UnaryRule; 7] = [
    unary_of_constant,
    negation_of_negation,
    negation_of_scaled,
    magnitude_of_nonnegative,
    even_function_of_signed,
    odd_function_of_negation,
    rounding_of_whole,
];

const BINARY: [BinaryRule; 15] = [
    power_by_products,
    binary_of_constants,
    sorted_operands,
    neutral_constant,
    negative_zero_less,
    signed_constant_term,
    sum_with_negation,
    product_with_negation,
    product_of_magnitudes,
    quotient_with_negation,
    quotient_by_power_of_two,
    extremum_of_equals,
    extremum_with_loser,
    extremum_absorbed,
    square_root_as_power,
];

const PICK: [PickRule; 4] =
    [choice_between_equals, choice_of_itself, decided_choice, repeated_choice];

pub(super) fn unary(graph: &mut Graph, op: Unary, a: NodeId) -> NodeId {
    let simpler = UNARY.iter().find_map(|rule| rule(graph, op, a));
    simpler.unwrap_or_else(|| graph.intern(Node::Unary(op, a)))
}

pub(super) fn binary(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> NodeId {
    let simpler = BINARY.iter().find_map(|rule| rule(graph, op, a, b));
    simpler.unwrap_or_else(|| graph.intern(Node::Binary(op, a, b)))
}

pub(super) fn pick(graph: &mut Graph, extremum: Extremum, operands: [NodeId; 4]) -> NodeId {
    let simpler = PICK.iter().find_map(|rule| rule(graph, extremum, operands));
    simpler.unwrap_or_else(|| graph.intern(Node::Pick(extremum, operands)))
}

/// `op(constant)` is a constant.
fn unary_of_constant(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    let a = graph.as_constant(a)?;
    Some(graph.constant(op.apply(a)))
}

/// `-(-a)` is `a`.
fn negation_of_negation(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    if op == Unary::Neg { operand_of(graph, Unary::Neg, a) } else { None }
}

/// `-(a * c)` is `a * -c`, and so for `a / c` and `c / a`.
fn negation_of_scaled(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    let Node::Binary(inner @ (Binary::Mul | Binary::Div), left, right) = graph.node(a) else {
        return None;
    };
    match (op, graph.as_constant(left), graph.as_constant(right)) {
        (Unary::Neg, _, Some(c)) => {
            let c = graph.constant(-c);
            Some(graph.binary(inner, left, c))
        }
        (Unary::Neg, Some(c), None) => {
            let c = graph.constant(-c);
            Some(graph.binary(inner, c, right))
        }
        _ => None,
    }
}

/// `|a|` is `a` where `a` is never negative, nor -0.0.
fn magnitude_of_nonnegative(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    (op == Unary::Abs && is_nonnegative(graph, a, SIGN_DEPTH)).then_some(a)
}

/// `f(-a)` and `f(|a|)` are `f(a)` for abs, cos and cosh.
fn even_function_of_signed(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    if !matches!(op, Unary::Abs | Unary::Cos | Unary::Cosh) {
        return None;
    }
    let inner = operand_of(graph, Unary::Neg, a).or_else(|| operand_of(graph, Unary::Abs, a))?;
    Some(graph.unary(op, inner))
}

/// `f(-a)` is `-f(a)` for the functions whose code strips the sign of the argument.
fn odd_function_of_negation(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    use Unary::{Asin, Atan, Cbrt, Sin, Sinh, Tanh};
    if !matches!(op, Sin | Asin | Atan | Sinh | Tanh | Cbrt) {
        return None;
    }
    let inner = operand_of(graph, Unary::Neg, a)?;
    let value = graph.unary(op, inner);
    Some(graph.neg(value))
}

/// Rounding a whole number changes nothing, and neither does taking the sign of a sign.
fn rounding_of_whole(graph: &mut Graph, op: Unary, a: NodeId) -> Option<NodeId> {
    use Unary::{Ceil, Floor, Round, Sign};
    let Node::Unary(inner, _) = graph.node(a) else { return None };
    let whole = matches!(inner, Floor | Ceil | Round | Sign) && matches!(op, Floor | Ceil | Round);
    (whole || (op, inner) == (Sign, Sign)).then_some(a)
}

/// `a^n` is a product for constant whole `n` up to [`PRODUCT_LIMIT`] in magnitude.
fn power_by_products(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let n = graph.as_constant(b)?;
    if op != Binary::Pow || n.fract() != 0.0 || n.abs() > PRODUCT_LIMIT {
        return None;
    }
    let times = n.abs() as u32;
    let Some(leading) = times.checked_ilog2() else { return Some(graph.constant(1.0)) };
    let mut product = a;
    for digit in (0..leading).rev() {
        product = graph.mul(product, product);
        if times >> digit & 1 == 1 {
            product = graph.mul(product, a);
        }
    }
    if n < 0.0 {
        let one = graph.constant(1.0);
        product = graph.div(one, product);
    }
    Some(product)
}

/// `op(constant, constant)` is a constant.
fn binary_of_constants(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let (a, b) = (graph.as_constant(a)?, graph.as_constant(b)?);
    Some(graph.constant(op.apply(a, b)))
}

/// `a + b` and `a * b` commute: a constant comes second, else the later node does.
fn sorted_operands(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let rank = |id: NodeId| (graph.as_constant(id).is_some(), id);
    let exchange = matches!(op, Binary::Add | Binary::Mul) && rank(a) > rank(b);
    exchange.then(|| graph.binary(op, b, a))
}

/// `a * 1`, `a / 1`, `a - 0.0` and `a + -0.0` are `a`; `a * -1` and `a / -1` are `-a`.
fn neutral_constant(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let c = graph.as_constant(b)?;
    let scales = matches!(op, Binary::Mul | Binary::Div);
    let is = |value: f64| c.to_bits() == value.to_bits();
    if scales && is(-1.0) {
        return Some(graph.neg(a));
    }
    let neutral =
        scales && is(1.0) || op == Binary::Sub && is(0.0) || op == Binary::Add && is(-0.0);
    neutral.then_some(a)
}

/// `-0.0 - a` is `-a`; `0.0 - a` is not, at zero.
fn negative_zero_less(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let c = graph.as_constant(a)?;
    (op == Binary::Sub && c.to_bits() == (-0.0f64).to_bits()).then(|| graph.neg(b))
}

/// `a + c` is `a - |c|` for negative `c`, and `a - c` is `a + |c|`.
fn signed_constant_term(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let c = graph.as_constant(b).filter(|c| c.is_sign_negative() && !c.is_nan())?;
    let opposite = opposite_sum(op)?;
    let magnitude = graph.constant(-c);
    Some(graph.binary(opposite, a, magnitude))
}

/// `a + -b` is `a - b`, `-a + b` is `b - a`, `a - -b` is `a + b`.
fn sum_with_negation(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let opposite = opposite_sum(op)?;
    if let Some(b) = operand_of(graph, Unary::Neg, b) {
        return Some(graph.binary(opposite, a, b));
    }
    let a = operand_of(graph, Unary::Neg, a).filter(|_| op == Binary::Add)?;
    Some(graph.sub(b, a))
}

/// `-a * b` and `a * -b` are `-(a * b)`.
fn product_with_negation(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    if op == Binary::Mul { without_negation(graph, op, a, b) } else { None }
}

/// `|a| * |a|` is `a * a`.
fn product_of_magnitudes(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let inner = operand_of(graph, Unary::Abs, a).filter(|_| op == Binary::Mul && a == b)?;
    Some(graph.mul(inner, inner))
}

/// `-a / b` and `a / -b` are `-(a / b)`.
fn quotient_with_negation(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    if op == Binary::Div { without_negation(graph, op, a, b) } else { None }
}

/// `a / 2^n` is `a * 2^-n`: both round the same number.
fn quotient_by_power_of_two(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let c = graph.as_constant(b).filter(|_| op == Binary::Div)?;
    let inverse = 1.0 / c;
    let power = |c: f64| c.is_normal() && c.to_bits() << 12 == 0;
    if !(power(c) && power(inverse)) {
        return None;
    }
    let inverse = graph.constant(inverse);
    Some(graph.mul(a, inverse))
}

/// The extremum of `a` and `a` is `a`.
fn extremum_of_equals(_: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    (op.extremum().is_some() && a == b).then_some(a)
}

/// `min(inf, b)` and `max(-inf, b)` are `b`; `min(a, inf)` is not `a`, for NaN.
fn extremum_with_loser(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    (graph.as_constant(a)? == op.extremum()?.loser()).then_some(b)
}

/// `min(a, m)`, `min(b, m)` and `min(m, b)` are `m` where `m` is `min(a, b)`; so for max.
///
/// `min(m, a)` is not: where `a` is NaN, `m` is `b`.
fn extremum_absorbed(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    op.extremum()?;
    if let Node::Binary(inner, c, d) = graph.node(b)
        && inner == op
        && (a == c || a == d)
    {
        return Some(b);
    }
    if let Node::Binary(inner, _, d) = graph.node(a)
        && inner == op
        && b == d
    {
        return Some(a);
    }
    None
}

/// `a^0.5` is the square root where `a` is never negative, nor -0.0.
///
/// Elsewhere they differ: at -0.0 the power is 0.0, at minus infinity it is infinite.
fn square_root_as_power(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let half = graph.as_constant(b)? == 0.5;
    (op == Binary::Pow && half && is_nonnegative(graph, a, SIGN_DEPTH))
        .then(|| graph.unary(Unary::Sqrt, a))
}

/// A choice between `c` and `c` is `c`.
fn choice_between_equals(_: &mut Graph, _: Extremum, [_, _, c, d]: [NodeId; 4]) -> Option<NodeId> {
    (c == d).then_some(c)
}

/// The extremum's choice between its own operands is the extremum.
fn choice_of_itself(
    graph: &mut Graph,
    extremum: Extremum,
    [a, b, c, d]: [NodeId; 4],
) -> Option<NodeId> {
    ((a, b) == (c, d)).then(|| graph.binary(extremum.operator(), a, b))
}

/// Equal or constant operands decide a choice.
fn decided_choice(
    graph: &mut Graph,
    extremum: Extremum,
    [a, b, c, d]: [NodeId; 4],
) -> Option<NodeId> {
    if a == b {
        return Some(d);
    }
    let (a, b) = (graph.as_constant(a)?, graph.as_constant(b)?);
    Some(if extremum.picks_first(a, b) { c } else { d })
}

/// A choice inside the same choice is made already.
fn repeated_choice(
    graph: &mut Graph,
    extremum: Extremum,
    [a, b, c, d]: [NodeId; 4],
) -> Option<NodeId> {
    let sides = |id: NodeId| {
        if let Node::Pick(inner, [p, q, then, otherwise]) = graph.node(id)
            && (inner, p, q) == (extremum, a, b)
        {
            return Some((then, otherwise));
        }
        None
    };
    let (then, otherwise) = (sides(c), sides(d));
    let c = then.map_or(c, |(then, _)| then);
    let d = otherwise.map_or(d, |(_, otherwise)| otherwise);
    (then.is_some() || otherwise.is_some()).then(|| graph.pick(extremum, [a, b, c, d]))
}

/// `a` if `id` is `op(a)`.
fn operand_of(graph: &Graph, op: Unary, id: NodeId) -> Option<NodeId> {
    if let Node::Unary(outer, a) = graph.node(id)
        && outer == op
    {
        return Some(a);
    }
    None
}

/// Difference for sum and sum for difference.
fn opposite_sum(op: Binary) -> Option<Binary> {
    if op == Binary::Add {
        Some(Binary::Sub)
    } else if op == Binary::Sub {
        Some(Binary::Add)
    } else {
        None
    }
}

/// `op(a, b)` with one negation taken out of an operand and put before it.
fn without_negation(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> Option<NodeId> {
    let (a, b) = match (operand_of(graph, Unary::Neg, a), operand_of(graph, Unary::Neg, b)) {
        (Some(a), _) => (a, b),
        (None, Some(b)) => (a, b),
        (None, None) => return None,
    };
    let value = graph.binary(op, a, b);
    Some(graph.neg(value))
}

/// Whether the value is never negative nor -0.0, as far as a few operators tell; it may be NaN.
pub(super) fn is_never_negative(graph: &Graph, id: NodeId) -> bool {
    is_nonnegative(graph, id, SIGN_DEPTH)
}

/// Whether the value is never negative nor -0.0, as seen within `depth` operators; it may be NaN.
fn is_nonnegative(graph: &Graph, id: NodeId, depth: usize) -> bool {
    use Binary::{Add, Div, Hypot, Max, Min, Mul};
    use Unary::{Abs, Cosh, Exp, Sqrt};
    let deeper = |id| depth > 0 && is_nonnegative(graph, id, depth - 1);
    match graph.node(id) {
        Node::Constant(bits) => f64::from_bits(bits).is_sign_positive(),
        Node::Unary(op, a) => matches!(op, Abs | Exp | Cosh) || op == Sqrt && deeper(a),
        Node::Binary(Hypot, ..) => true,
        Node::Binary(Mul, a, b) if a == b => true,
        Node::Binary(Add | Mul | Div | Min, a, b) => deeper(a) && deeper(b),
        // Where the first is the greater, it is greater than a number that is not negative.
        Node::Binary(Max, _, b) => deeper(b),
        Node::Pick(_, [_, _, c, d]) => deeper(c) && deeper(d),
        Node::Binary(..) | Node::Coordinate(_) | Node::Parameter(_) | Node::Oracle(..) => false,
    }
}

#[cfg(test)]
mod tests;
