//! Which values are only compared with numbers, and with which.
//!
//! Where only the sign of an expression is wanted, most operations are not needed for their values.
//! An operation is *compared with levels* if the sign of the result stays what it is when the value
//! is replaced by any other that lies below, on or above each of the levels as it does:
//!
//! * the result itself, with zero;
//! * the operand of a negation, with the opposite levels; that of a magnitude, with both signs of
//!   them;
//! * the operands of an extremum, with its levels: an extremum of places in an order is the place of
//!   the extremum;
//! * the operand of a sum or difference with a uniform value, if that is compared with zero, with
//!   the uniform value: the sign of a rounded sum is exact.
//!
//! An oracle can then do with stand-ins ([`Oracle::brick_beside`](crate::expr::Oracle)), most of
//! which cost nothing: a distance at one point tells on which side of a level the points around it
//! are.

use super::tape::{Op, Operations, Position};
use crate::expr::{Binary, Unary};

/// Most levels of an operation.
pub const MOST_LEVELS: usize = 4;

/// A number that values are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Zero.
    Zero,
    /// A uniform value.
    Of(Position),
    /// The opposite of a uniform value.
    Opposite(Position),
}

impl Level {
    const fn opposite(self) -> Self {
        match self {
            Self::Zero => Self::Zero,
            Self::Of(p) => Self::Opposite(p),
            Self::Opposite(p) => Self::Of(p),
        }
    }
}

/// What is made of an operation's value.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Use {
    /// It is compared with some levels at most.
    Compared(Vec<Level>),
    /// Anything.
    Used,
}

/// The levels that each of `operations` is compared with if only the sign of the first output is
/// wanted; none where more may be made of it.
#[must_use]
pub fn levels(operations: &impl Operations) -> Vec<Option<Vec<Level>>> {
    let mut uses = vec![Use::Compared(Vec::new()); operations.count()];
    let add = |uses: &mut [Use], p: Position, other: &Use| {
        if let Some(own) = uses.get_mut(p.index()) {
            add(own, other);
        }
    };
    for (number, output) in operations.outputs().enumerate() {
        let levels = if number == 0 { Use::Compared(vec![Level::Zero]) } else { Use::Used };
        add(&mut uses, output, &levels);
    }
    for p in (0..operations.count()).rev().map(Position::new) {
        let own = uses[p.index()].clone();
        for (operand, of_operand) in passed(operations, operations.op(p), &own) {
            add(&mut uses, operand, &of_operand);
        }
    }
    let found = |levels: Use| match levels {
        Use::Compared(levels) if !levels.is_empty() => Some(levels),
        Use::Compared(_) | Use::Used => None,
    };
    uses.into_iter().map(found).collect()
}

/// What an operation that is used in the way `own` makes of its operands.
fn passed(operations: &impl Operations, op: Op, own: &Use) -> Vec<(Position, Use)> {
    let Use::Compared(levels) = own else {
        return op.operands().iter().map(|o| (*o, Use::Used)).collect();
    };
    let only_zero = levels.iter().all(|level| *level == Level::Zero);
    let is_uniform = |p: Position| operations.is_uniform(p);
    let opposite = || levels.iter().map(|level| level.opposite());
    match op {
        Op::Unary(Unary::Neg, a) => vec![(a, Use::Compared(opposite().collect()))],
        Op::Unary(Unary::Abs, a) => {
            vec![(a, Use::Compared(levels.iter().copied().chain(opposite()).collect()))]
        }
        Op::Binary(Binary::Min | Binary::Max, a, b) => vec![(a, own.clone()), (b, own.clone())],
        Op::Binary(Binary::Sub, a, b) if only_zero && is_uniform(b) => {
            vec![(a, Use::Compared(vec![Level::Of(b)])), (b, Use::Used)]
        }
        Op::Binary(Binary::Sub, a, b) if only_zero && is_uniform(a) => {
            vec![(b, Use::Compared(vec![Level::Of(a)])), (a, Use::Used)]
        }
        Op::Binary(Binary::Add, a, b) if only_zero && is_uniform(b) => {
            vec![(a, Use::Compared(vec![Level::Opposite(b)])), (b, Use::Used)]
        }
        Op::Binary(Binary::Add, a, b) if only_zero && is_uniform(a) => {
            vec![(b, Use::Compared(vec![Level::Opposite(a)])), (a, Use::Used)]
        }
        Op::Coordinate(_)
        | Op::Constant(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..)
        | Op::Oracle(..) => op.operands().iter().map(|o| (*o, Use::Used)).collect(),
    }
}

/// Adds `other` to what is made of a value.
fn add(own: &mut Use, other: &Use) {
    match (&mut *own, other) {
        (Use::Compared(levels), Use::Compared(more)) => {
            for level in more {
                if !levels.contains(level) {
                    levels.push(*level);
                }
            }
            if levels.len() > MOST_LEVELS {
                *own = Use::Used;
            }
        }
        (_, Use::Used) => *own = Use::Used,
        (Use::Used, Use::Compared(_)) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::tape::Tape;
    use crate::expr::probe::{self, Simplified, Source, evaluate};
    use crate::expr::{Graph, NodeId};

    /// The levels of `node` in the expression `root`, as numbers.
    fn numbers(graph: &Graph, root: NodeId, node: NodeId) -> Option<Vec<f64>> {
        let tape = Tape::new(graph, &[root]);
        let p = tape.positions().find(|p| tape.node(*p) == node).unwrap();
        let parameters: Vec<f64> = graph.parameters().iter().map(|p| p.1).collect();
        let values = evaluate(graph, [0.0; 3], &parameters);
        let number = |level: &Level| match level {
            Level::Zero => 0.0,
            Level::Of(p) => values[tape.node(*p).index()],
            Level::Opposite(p) => -values[tape.node(*p).index()],
        };
        levels(&tape)[p.index()].as_ref().map(|levels| levels.iter().map(number).collect())
    }

    #[test]
    fn set_operations_and_offsets_compare() {
        let mut graph = Graph::new();
        let [x, y, _] = graph.point();
        let (t, u) = (graph.constant(0.25), graph.parameter("u", 0.5));
        let f = graph.mul(x, y);
        let wall = graph.unary(Unary::Abs, f);
        let wall = graph.sub(wall, t);
        assert_eq!(numbers(&graph, wall, f), Some(vec![0.25, -0.25]));
        let grown = graph.add(f, u);
        let cut = graph.max(grown, x);
        let cut = graph.neg(cut);
        assert_eq!(numbers(&graph, cut, f), Some(vec![-0.5]));
        assert_eq!(numbers(&graph, cut, grown), Some(vec![0.0]));
        let both = graph.min(cut, wall);
        assert_eq!(numbers(&graph, both, f), Some(vec![-0.5, 0.25, -0.25]));
    }

    #[test]
    fn values_that_are_computed_with_are_used() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let f = graph.mul(x, y);
        for root in [graph.add(f, z), graph.mul(f, f), graph.unary(Unary::Sin, f)] {
            assert_eq!(numbers(&graph, root, f), None);
        }
        let cut = graph.max(f, z);
        let sum = graph.add(f, x);
        let root = graph.min(cut, sum);
        assert_eq!(numbers(&graph, root, f), None);
    }

    /// A stand-in for z anywhere in a random expression leaves the sign as it is.
    #[test]
    fn stand_ins_do_not_show_in_signs() {
        let mut source = Source(71);
        let mut compared = 0;
        for i in 0..8000 {
            let mut graph = Graph::new();
            let size = 1 + source.below(12);
            let root = probe::random::<Simplified>(&mut graph, &mut source, size, &[0.3, -7.0]);
            let [_, _, z] = graph.point();
            let tape = Tape::new(&graph, &[root]);
            if !tape.positions().any(|p| tape.node(p) == z) {
                continue;
            }
            let Some(levels) = numbers(&graph, root, z) else { continue };
            compared += 1;
            let parameters: Vec<f64> = graph.parameters().iter().map(|p| p.1).collect();
            let sign = |at: [f64; 3]| evaluate(&graph, at, &parameters)[root.index()] < 0.0;
            for _ in 0..30 {
                let (x, y) = (source.within(-2.0, 2.0), source.spicy());
                let z = if source.below(2) == 0 { source.of(&levels) } else { source.spicy() };
                let place = |z: f64| levels.iter().map(|l| z.partial_cmp(l)).collect::<Vec<_>>();
                let other = [z.next_up(), z.next_down(), source.spicy(), source.within(-9.0, 9.0)];
                for other in other.into_iter().filter(|other| place(*other) == place(z)) {
                    let name = format!("expression {i}, {z:e} or {other:e} beside {levels:?}");
                    assert_eq!(sign([x, y, z]), sign([x, y, other]), "{name}");
                }
            }
        }
        assert!(compared > 70, "{compared}");
    }
}
