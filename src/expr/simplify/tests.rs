//! A test for each rule, and for all of them on random expressions.

use super::*;
use crate::expr::probe::{Make, Raw, SPECIAL, Simplified, Source, evaluate, random};
use crate::expr::text::text;
use Binary::{Add, Atan2, Div, Hypot, Max, Min, Mod, Mul, Pow, Sub};
use Unary::{Abs, Cos, Cosh, Exp, Floor, Neg, Round, Sign, Sin, Sqrt, Tan};

/// Compares what the constructors make of x, y and a constant with its text.
#[track_caller]
fn check(constant: f64, build: impl Fn(&mut Graph, [NodeId; 3]) -> NodeId, expected: &str) {
    let mut graph = Graph::new();
    let [x, y, _] = graph.point();
    let constant = graph.constant(constant);
    let root = build(&mut graph, [x, y, constant]);
    assert_eq!(text(&graph, root), expected);
}

#[test]
fn operators_of_constants_are_constants() {
    check(4.0, |g, [.., c]| g.unary(Sqrt, c), "2");
    check(0.0, |g, [.., c]| g.neg(c), "-0");
    check(4.0, |g, [.., c]| g.sub(c, c), "0");
    check(f64::NAN, |g, [.., c]| g.sub(c, c), "nan");
}

#[test]
fn negations_cancel_and_enter_constants() {
    check(0.0, |g, [x, ..]| negated(g, x, Neg), "x");
    check(3.0, |g, [x, _, c]| then(g, Mul, x, c, Neg), "x * (-3)");
    check(3.0, |g, [x, _, c]| then(g, Div, x, c, Neg), "x / (-3)");
    check(3.0, |g, [x, _, c]| then(g, Div, c, x, Neg), "-3 / x");
}

#[test]
fn magnitudes_of_nonnegative_values_are_the_values() {
    check(
        0.0,
        |g, [x, y, _]| {
            let (square, growth) = (g.mul(x, x), g.unary(Exp, y));
            then(g, Add, square, growth, Abs)
        },
        "x * x + exp(y)",
    );
    // The root of -0.0 is -0.0.
    check(
        0.0,
        |g, [x, ..]| {
            let root = g.unary(Sqrt, x);
            g.unary(Abs, root)
        },
        "abs(sqrt(x))",
    );
}

#[test]
fn even_functions_drop_signs_and_odd_ones_pass_them_on() {
    for op in [Abs, Cos, Cosh] {
        let expected = format!("{}(x)", op.name());
        check(0.0, |g, [x, ..]| negated(g, x, op), &expected);
        check(
            0.0,
            |g, [x, ..]| {
                let a = g.unary(Abs, x);
                g.unary(op, a)
            },
            &expected,
        );
    }
    check(0.0, |g, [x, ..]| negated(g, x, Sin), "-sin(x)");
    check(0.0, |g, [x, ..]| negated(g, x, Tan), "tan(-x)");
    check(0.0, |g, [x, ..]| negated(g, x, Exp), "exp(-x)");
}

#[test]
fn whole_numbers_are_not_rounded_again() {
    check(
        0.0,
        |g, [x, ..]| {
            let a = g.unary(Floor, x);
            g.unary(Round, a)
        },
        "floor(x)",
    );
    check(
        0.0,
        |g, [x, ..]| {
            let a = g.unary(Sign, x);
            g.unary(Sign, a)
        },
        "sign(x)",
    );
    check(
        0.0,
        |g, [x, ..]| {
            let a = g.unary(Round, x);
            g.unary(Sign, a)
        },
        "sign(round(x))",
    );
}

#[test]
fn small_whole_powers_are_products() {
    for (n, expected) in [
        (0.0, "1"),
        (-0.0, "1"),
        (1.0, "x"),
        (2.0, "x * x"),
        (3.0, "x * (x * x)"),
        (6.0, "t0 = x * (x * x)\nt0 * t0"),
        (-1.0, "1 / x"),
        (-2.0, "1 / (x * x)"),
        (17.0, "pow(x, 17)"),
        (2.5, "pow(x, 2.5)"),
    ] {
        check(n, |g, [x, _, n]| g.binary(Pow, x, n), expected);
    }
}

#[test]
fn a_power_of_a_constant_is_the_same_product() {
    let mut graph = Graph::new();
    let (base, n) = (graph.constant(1.1), graph.constant(5.0));
    let power = graph.binary(Pow, base, n);
    let fourth = (1.1f64 * 1.1) * (1.1 * 1.1);
    assert_eq!(graph.as_constant(power), Some(fourth * 1.1));
}

#[test]
fn sums_and_products_have_sorted_operands() {
    check(3.0, |g, [x, y, _]| g.add(y, x), "x + y");
    check(3.0, |g, [x, y, _]| g.mul(y, x), "x * y");
    check(3.0, |g, [x, _, c]| g.add(c, x), "x + 3");
    check(3.0, |g, [x, _, c]| g.mul(c, x), "x * 3");
    for op in [Min, Max, Mod, Pow, Atan2, Hypot] {
        check(3.0, |g, [x, y, _]| g.binary(op, y, x), &format!("{}(y, x)", op.name()));
    }
    check(3.0, |g, [x, y, _]| g.sub(y, x), "y - x");
    check(3.0, |g, [x, y, _]| g.div(y, x), "y / x");
}

#[test]
fn neutral_constants_vanish_and_others_stay() {
    for (op, value, expected) in [
        (Mul, 1.0, "x"),
        (Div, 1.0, "x"),
        (Mul, -1.0, "-x"),
        (Div, -1.0, "-x"),
        (Sub, 0.0, "x"),
        (Add, -0.0, "x"),
        (Add, 0.0, "x + 0"),
        (Sub, -0.0, "x + 0"),
        (Mul, 0.0, "x * 0"),
        (Add, -2.0, "x - 2"),
        (Sub, -2.0, "x + 2"),
        (Add, f64::NAN, "x + nan"),
    ] {
        check(value, |g, [x, _, c]| g.binary(op, x, c), expected);
    }
    check(0.0, |g, [x, ..]| g.sub(x, x), "x - x");
    check(0.0, |g, [x, ..]| g.div(x, x), "x / x");
    check(-0.0, |g, [x, _, c]| g.sub(c, x), "-x");
    check(0.0, |g, [x, _, c]| g.sub(c, x), "0 - x");
}

#[test]
fn sums_take_in_negations() {
    check(
        0.0,
        |g, [x, y, _]| {
            let b = g.neg(y);
            g.add(x, b)
        },
        "x - y",
    );
    check(
        0.0,
        |g, [x, y, _]| {
            let a = g.neg(x);
            g.add(a, y)
        },
        "y - x",
    );
    check(
        0.0,
        |g, [x, y, _]| {
            let b = g.neg(y);
            g.sub(x, b)
        },
        "x + y",
    );
    // -x - y is -0.0 where -(x + y) is 0.0.
    check(
        0.0,
        |g, [x, y, _]| {
            let a = g.neg(x);
            g.sub(a, y)
        },
        "-x - y",
    );
}

#[test]
fn products_and_quotients_pass_negations_on() {
    for (op, symbol) in [(Mul, '*'), (Div, '/')] {
        let (once, twice) = (format!("-(x {symbol} y)"), format!("x {symbol} y"));
        check(
            0.0,
            |g, [x, y, _]| {
                let a = g.neg(x);
                g.binary(op, a, y)
            },
            &once,
        );
        check(
            0.0,
            |g, [x, y, _]| {
                let b = g.neg(y);
                g.binary(op, x, b)
            },
            &once,
        );
        check(
            0.0,
            |g, [x, y, _]| {
                let (a, b) = (g.neg(x), g.neg(y));
                g.binary(op, a, b)
            },
            &twice,
        );
        let constant = format!("x {symbol} (-3)");
        check(
            3.0,
            |g, [x, _, c]| {
                let a = g.neg(x);
                g.binary(op, a, c)
            },
            &constant,
        );
    }
    check(
        0.0,
        |g, [x, ..]| {
            let a = g.unary(Abs, x);
            g.mul(a, a)
        },
        "x * x",
    );
}

#[test]
fn quotients_by_powers_of_two_are_products() {
    check(-4.0, |g, [x, _, c]| g.div(x, c), "x * (-0.25)");
    check(3.0, |g, [x, _, c]| g.div(x, c), "x / 3");
    // The inverse of 2^1023 is subnormal, that of the least number infinite.
    for divisor in [2f64.powi(1023), 5e-324, 0.0, f64::INFINITY] {
        let expected = format!("x / {divisor:?}").replace(".0", "");
        check(divisor, |g, [x, _, c]| g.div(x, c), &expected);
    }
}

#[test]
fn extrema_that_are_decided_vanish() {
    for (op, loser) in [(Min, f64::INFINITY), (Max, f64::NEG_INFINITY)] {
        let name = op.name();
        check(0.0, |g, [x, ..]| g.binary(op, x, x), "x");
        check(loser, |g, [x, _, c]| g.binary(op, c, x), "x");
        check(loser, |g, [x, _, c]| g.binary(op, x, c), &format!("{name}(x, {loser})"));
        let once = format!("{name}(x, y)");
        check(
            0.0,
            |g, [x, y, _]| {
                let m = g.binary(op, x, y);
                g.binary(op, x, m)
            },
            &once,
        );
        check(
            0.0,
            |g, [x, y, _]| {
                let m = g.binary(op, x, y);
                g.binary(op, y, m)
            },
            &once,
        );
        check(
            0.0,
            |g, [x, y, _]| {
                let m = g.binary(op, x, y);
                g.binary(op, m, y)
            },
            &once,
        );
        // Where x is NaN the inner one is y.
        let twice = format!("{name}({name}(x, y), x)");
        check(
            0.0,
            |g, [x, y, _]| {
                let m = g.binary(op, x, y);
                g.binary(op, m, x)
            },
            &twice,
        );
    }
}

#[test]
fn half_powers_are_roots_where_the_base_is_never_negative() {
    check(
        0.5,
        |g, [x, y, c]| {
            let (xx, yy) = (g.mul(x, x), g.mul(y, y));
            let sum = g.add(xx, yy);
            g.binary(Pow, sum, c)
        },
        "sqrt(x * x + y * y)",
    );
    check(0.5, |g, [x, _, c]| g.binary(Pow, x, c), "pow(x, 0.5)");
}

#[test]
fn choices_that_are_made_vanish() {
    for e in [Extremum::Min, Extremum::Max] {
        let name = e.operator().name();
        check(0.0, |g, [x, y, _]| g.pick(e, [x, y, y, y]), "y");
        check(0.0, |g, [x, y, _]| g.pick(e, [x, x, x, y]), "y");
        check(0.0, |g, [x, y, _]| g.pick(e, [x, y, x, y]), &format!("{name}(x, y)"));
        check(
            0.0,
            |g, [x, y, c]| {
                let inner = g.pick(e, [x, y, c, x]);
                g.pick(e, [x, y, y, inner])
            },
            &format!("pick_{name}(x, y, y, x)"),
        );
        check(
            0.0,
            |g, [x, y, c]| {
                let inner = g.pick(e, [x, y, c, x]);
                g.pick(e, [x, y, inner, y])
            },
            &format!("pick_{name}(x, y, 0, y)"),
        );
    }
    check(
        2.0,
        |g, [x, y, c]| {
            let one = g.constant(1.0);
            g.pick(Extremum::Min, [one, c, x, y])
        },
        "x",
    );
}

fn negated(graph: &mut Graph, a: NodeId, op: Unary) -> NodeId {
    let a = graph.neg(a);
    graph.unary(op, a)
}

fn then(graph: &mut Graph, inner: Binary, a: NodeId, b: NodeId, outer: Unary) -> NodeId {
    let value = graph.binary(inner, a, b);
    graph.unary(outer, value)
}

/// Numbers that rules look for, beside the special ones.
fn constants() -> Vec<f64> {
    [SPECIAL.as_slice(), &[4.0, 0.25, 7.0, -3.0, 16.0, -1e-310]].concat()
}

#[test]
fn simplified_expressions_keep_the_bits_of_raw_ones() {
    for seed in 0..3000 {
        let (mut plain, mut simple) = (Graph::new(), Graph::new());
        let constants = constants();
        let size = 3 + (seed as usize % 25);
        let left = random::<Raw>(&mut plain, &mut Source(seed), size, &constants);
        let right = random::<Simplified>(&mut simple, &mut Source(seed), size, &constants);
        let mut source = Source(!seed);
        for _ in 0..20 {
            let at = [(); 3].map(|()| source.spicy());
            let parameters = [source.spicy(), source.spicy()];
            let expected = evaluate(&plain, at, &parameters)[left.index()];
            let value = evaluate(&simple, at, &parameters)[right.index()];
            let same = value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan();
            assert!(same, "{value} is not {expected} at {at:?} {parameters:?}, seed {seed}");
        }
    }
}

#[test]
fn every_operator_of_small_operands_keeps_its_bits() {
    // All pairs of simple operands, so that every rule meets every operator.
    let operands = |g: &mut Graph, signed: bool, make: fn(&mut Graph, Node) -> NodeId| {
        let mut list = g.point().to_vec();
        for op in [Neg, Abs, Floor, Sign, Exp, Sqrt] {
            list.push(make(g, Node::Unary(op, list[usize::from(signed)])));
        }
        list.push(make(g, Node::Binary(Mul, list[0], list[0])));
        list.push(make(g, Node::Binary(Min, list[0], list[1])));
        list.push(make(g, Node::Binary(Max, list[1], list[0])));
        list.extend(constants().into_iter().map(|value| g.constant(value)));
        list
    };
    let mut source = Source(3);
    let mut graph = Graph::new();
    let intern = |g: &mut Graph, node| g.intern(node);
    let (left, right) = (operands(&mut graph, false, intern), operands(&mut graph, true, intern));
    let mut pairs = Vec::new();
    for &a in &left {
        for op in Unary::ALL {
            pairs.push((graph.intern(Node::Unary(op, a)), graph.unary(op, a)));
        }
        for &b in &right {
            for op in Binary::ALL {
                pairs.push((Raw::binary(&mut graph, op, a, b), graph.binary(op, a, b)));
            }
        }
    }
    for _ in 0..60 {
        let at = [(); 3].map(|()| source.spicy());
        let values = evaluate(&graph, at, &[]);
        for &(plain, simple) in &pairs {
            let (expected, value) = (values[plain.index()], values[simple.index()]);
            let same = value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan();
            assert!(same, "{:?}: {value} is not {expected} at {at:?}", graph.node(plain));
        }
    }
}
