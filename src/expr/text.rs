//! Expressions as text, for people and tests.
//!
//! The text is infix, with functions by their names in program text and one line for each part
//! that is used more than once or grows long:
//!
//! ```text
//! t0 = sin(x)
//! t0 * t0 + y
//! ```
//!
//! The last line is the expression. Parentheses keep the association; numbers are the shortest
//! that read back as the same bits. An extremum's choice is `pick_min(a, b, c, d)` or
//! `pick_max(…)`, an output of an oracle `oracle0(x, y, z)` or, for partials, `oracle0_x(…)`.

use super::depends::reachable;
use super::graph::operands;
use super::{Binary, Extremum, Graph, Node, NodeId, Output, Unary};
use crate::geom::Axis;
use rustc_hash::FxHashMap;

/// Characters from which a part has a line of its own.
const LONG: usize = 100;

/// How tightly the outermost operator of a text binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Strength {
    Sum,
    Product,
    Sign,
    Whole,
}

/// A part of the text.
struct Phrase {
    text: String,
    strength: Strength,
}

impl Phrase {
    fn whole(text: impl Into<String>) -> Self {
        Self { text: text.into(), strength: Strength::Whole }
    }

    /// The text, in parentheses unless it binds at least as `strength` does.
    fn bound(&self, strength: Strength) -> String {
        let text = &self.text;
        if self.strength >= strength { text.clone() } else { format!("({text})") }
    }
}

/// The text of `root`.
#[must_use]
pub fn text(graph: &Graph, root: NodeId) -> String {
    let nodes = reachable(graph, &[root]);
    let mut uses: FxHashMap<NodeId, usize> = FxHashMap::default();
    for &id in &nodes {
        for &operand in operands(&graph.node(id)).iter() {
            *uses.entry(operand).or_default() += 1;
        }
    }
    let mut names = (0..)
        .map(|n| format!("t{n}"))
        .filter(|name| graph.parameters().iter().all(|(parameter, _)| parameter != name));
    let mut lines = String::new();
    let mut phrases: FxHashMap<NodeId, Phrase> = FxHashMap::default();
    for &id in &nodes {
        let node = graph.node(id);
        let mut phrase = phrase(graph, node, &phrases);
        let shared = uses.get(&id).is_some_and(|&uses| uses > 1) && !operands(&node).is_empty();
        if id != root && (shared || phrase.text.len() > LONG) {
            let name = names.next().unwrap_or_default();
            lines += &format!("{name} = {}\n", phrase.text);
            phrase = Phrase::whole(name);
        }
        phrases.insert(id, phrase);
    }
    lines + &phrases[&root].text
}

fn phrase(graph: &Graph, node: Node, phrases: &FxHashMap<NodeId, Phrase>) -> Phrase {
    let call = |name: &str, arguments: &[NodeId]| {
        let list: Vec<&str> = arguments.iter().map(|id| phrases[id].text.as_str()).collect();
        Phrase::whole(format!("{name}({})", list.join(", ")))
    };
    let infix = |op: Binary, strength, tighter, a: NodeId, b: NodeId| {
        let (a, b) = (phrases[&a].bound(strength), phrases[&b].bound(tighter));
        Phrase { text: format!("{a} {} {b}", op.name()), strength }
    };
    match node {
        Node::Coordinate(axis) => Phrase::whole(axis_name(axis)),
        Node::Constant(bits) => number(f64::from_bits(bits)),
        Node::Parameter(slot) => Phrase::whole(graph.parameters()[slot.index()].0.as_str()),
        Node::Unary(Unary::Neg, a) => Phrase {
            text: format!("-{}", phrases[&a].bound(Strength::Whole)),
            strength: Strength::Sign,
        },
        Node::Unary(op, a) => call(op.name(), &[a]),
        // The second operand binds tighter: nothing is reassociated.
        Node::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
            infix(op, Strength::Sum, Strength::Product, a, b)
        }
        Node::Binary(op @ (Binary::Mul | Binary::Div), a, b) => {
            infix(op, Strength::Product, Strength::Whole, a, b)
        }
        Node::Binary(op, a, b) => call(op.name(), &[a, b]),
        Node::Pick(Extremum::Min, list) => call("pick_min", &list),
        Node::Pick(Extremum::Max, list) => call("pick_max", &list),
        Node::Oracle(id, Output::Value, at) => call(&format!("oracle{}", id.index()), &at),
        Node::Oracle(id, Output::Partial(axis), at) => {
            call(&format!("oracle{}_{}", id.index(), axis_name(axis)), &at)
        }
    }
}

fn axis_name(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
        Axis::Z => "z",
    }
}

fn number(value: f64) -> Phrase {
    if value.is_nan() {
        return Phrase::whole("nan");
    }
    let text = format!("{value:?}");
    let text = text.strip_suffix(".0").unwrap_or(&text).to_owned();
    let strength = if value.is_sign_negative() { Strength::Sign } else { Strength::Whole };
    Phrase { text, strength }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{Failure, Oracle, Queries};
    use crate::num::Interval;
    use std::sync::Arc;

    #[track_caller]
    fn check(build: impl Fn(&mut Graph, [NodeId; 3]) -> NodeId, expected: &str) {
        let mut graph = Graph::new();
        let point = graph.point();
        let root = build(&mut graph, point);
        assert_eq!(text(&graph, root), expected);
    }

    #[test]
    fn operators_are_infix_and_keep_their_association() {
        check(
            |g, [x, y, z]| {
                let a = g.add(x, y);
                g.mul(a, z)
            },
            "z * (x + y)",
        );
        check(
            |g, [x, y, z]| {
                let a = g.sub(y, z);
                g.sub(x, a)
            },
            "x - (y - z)",
        );
        check(
            |g, [x, y, z]| {
                let a = g.sub(x, y);
                g.sub(a, z)
            },
            "x - y - z",
        );
        check(
            |g, [x, y, z]| {
                let a = g.div(y, z);
                g.div(x, a)
            },
            "x / (y / z)",
        );
        check(
            |g, [x, y, z]| {
                let a = g.mul(y, z);
                g.add(x, a)
            },
            "x + y * z",
        );
        check(
            |g, [x, y, _]| {
                let a = g.add(x, y);
                g.neg(a)
            },
            "-(x + y)",
        );
        check(
            |g, [x, y, _]| {
                let a = g.neg(x);
                g.sub(a, y)
            },
            "-x - y",
        );
        check(
            |g, [x, y, _]| {
                let a = g.neg(x);
                g.min(y, a)
            },
            "min(y, -x)",
        );
        check(|g, [x, y, z]| g.pick(Extremum::Max, [x, y, z, x]), "pick_max(x, y, z, x)");
    }

    #[test]
    fn numbers_are_the_shortest_that_read_back() {
        for (value, expected) in [
            (0.1, "0.1"),
            (3.0, "3"),
            (-0.0, "-0"),
            (1e300, "1e300"),
            (5e-324, "5e-324"),
            (f64::INFINITY, "inf"),
            (f64::NAN, "nan"),
        ] {
            check(|g, _| g.constant(value), expected);
            if !value.is_nan() {
                assert_eq!(expected.parse::<f64>().unwrap().to_bits(), value.to_bits());
            }
        }
        check(
            |g, [x, ..]| {
                let a = g.constant(-2.5);
                g.mul(x, a)
            },
            "x * (-2.5)",
        );
    }

    #[test]
    fn shared_parts_have_lines_and_parameters_names() {
        check(
            |g, [x, y, _]| {
                let (sine, t0) = (g.unary(Unary::Sin, x), g.parameter("t0", 1.0));
                let square = g.mul(sine, sine);
                let sum = g.add(square, y);
                g.mul(sum, t0)
            },
            "t1 = sin(x)\nt0 * (y + t1 * t1)",
        );
    }

    #[test]
    fn a_deep_expression_has_short_lines() {
        let mut graph = Graph::new();
        let [x, ..] = graph.point();
        let mut root = x;
        for _ in 0..10_000 {
            root = graph.unary(Unary::Sin, root);
        }
        let text = text(&graph, root);
        assert!(text.len() < 100_000 && text.lines().all(|line| line.len() < 120));
    }

    #[derive(Debug)]
    struct Nothing;

    impl Oracle for Nothing {
        fn name(&self) -> &str {
            "nothing"
        }

        fn points(&self, _: Queries<'_>) -> Result<(), Failure> {
            Ok(())
        }

        fn range(&self, _: [Interval; 3]) -> Interval {
            Interval::ANYTHING
        }
    }

    #[test]
    fn oracles_are_called_with_their_point() {
        let nothing: Arc<dyn Oracle> = Arc::new(Nothing);
        check(
            |g, [x, y, z]| {
                let id = g.add_oracle(&nothing);
                let value = g.oracle(id, Output::Value, [x, z, y]);
                let partial = g.oracle(id, Output::Partial(Axis::Y), [x, y, z]);
                g.add(value, partial)
            },
            "oracle0(x, z, y) + oracle0_y(x, y, z)",
        );
    }
}
