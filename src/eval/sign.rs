//! From the expression that is sampled to a cheaper one that is negative at the same points.
//!
//! Marching needs signs, and values only where the surface is. That a value lies below zero is a
//! *test*, and a test of a monotone function is a test of its argument: the distance to a ball,
//! fl(fl(fl(√q) − r) s), is negative where q is below some number. A test passes
//!
//! * from a sum, difference, product or quotient with a constant, and from a square root, to the
//!   argument, the new threshold being found by bisection on the very rounding functions: they are
//!   monotone, so the outcomes are the same for every number;
//! * from an extremum to both operands with the same threshold, a minimum that is to lie *above*
//!   becoming a maximum of what lies below.
//!
//! What it stops at is compared with the threshold by a subtraction, whose sign is exact. Every
//! step keeps NaN where it was: a NaN is neither below nor above anything, constants are finite and
//! not zero where they multiply, and roots are passed only where the argument can't be negative. So
//! the outcome is the sign of the value to the bit of every sample, which the interpreter, whose
//! signs are those of the values themselves, checks in the tests of engines.
//!
//! Only operations with a single user are passed, so the form is never longer than what it is made
//! from by more than an operation a leaf.

use super::regions::Key;
use super::tape::{Op, Position, Tape};
use crate::expr::{Binary, Extremum, Graph, NodeId, Unary};

/// An expression in the form whose sign is sampled.
#[derive(Clone, Debug)]
pub struct SignForm {
    /// Negative where the original is, and nowhere else.
    pub root: NodeId,
    /// The choices of the original with what has become of them.
    pub choices: Vec<(Key, Key)>,
}

/// What is asked of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Test {
    /// Whether it lies below a finite number.
    Below(f64),
    /// Whether it lies above a finite number.
    Above(f64),
}

impl Test {
    fn holds(self, value: f64) -> bool {
        match self {
            Self::Below(threshold) => value < threshold,
            Self::Above(threshold) => value > threshold,
        }
    }
}

/// A test of the result of an operation as one of its operands.
#[derive(Clone, Copy, Debug)]
enum Passed {
    /// Of this one.
    To(Position, Test),
    /// Of both, an extremum's.
    ToBoth(Test),
}

impl Passed {
    const fn test(self) -> Test {
        match self {
            Self::To(_, test) | Self::ToBoth(test) => test,
        }
    }

    fn reaches(self, operand: Position) -> bool {
        match self {
            Self::To(only, _) => only == operand,
            Self::ToBoth(_) => true,
        }
    }
}

/// The sign form of `root`, whose nodes are added to `graph`.
pub fn form(graph: &mut Graph, root: NodeId) -> SignForm {
    let tape = Tape::new(graph, &[root]);
    let last = tape.outputs()[0];
    let (mut uses, mut squares) = (vec![0; tape.len()], vec![false; tape.len()]);
    for p in tape.positions() {
        squares[p.index()] = is_nonnegative(tape.op(p), &squares);
        for operand in tape.op(p).operands().iter() {
            uses[operand.index()] += 1;
        }
    }
    // From users to operands: what is asked of each, and how it passes that on.
    let mut asked = vec![None; tape.len()];
    let mut passed = vec![None; tape.len()];
    asked[last.index()] = Some(Test::Below(0.0));
    for p in tape.positions().rev() {
        let Some(test) = asked[p.index()] else { continue };
        let Some(request) = pass(&tape, tape.op(p), &squares, test) else { continue };
        passed[p.index()] = Some(request);
        for operand in tape.op(p).operands().iter().filter(|o| request.reaches(**o)) {
            if uses[operand.index()] == 1 {
                asked[operand.index()] = Some(request.test());
            }
        }
    }
    let mut images: Vec<Option<NodeId>> = vec![None; tape.len()];
    let mut choices = Vec::new();
    for p in tape.positions() {
        let own = choice(&tape, p);
        let mut image_of_choice = own;
        if let Some(test) = asked[p.index()] {
            let mut image = |o: Position, test: Test| {
                images[o.index()].unwrap_or_else(|| leaf(graph, tape.node(o), test))
            };
            let image = match (passed[p.index()], tape.op(p).choice()) {
                (Some(Passed::To(operand, test)), _) => image(operand, test),
                (Some(Passed::ToBoth(test)), Some((extremum, a, b))) => {
                    let (a, b) = (image(a, test), image(b, test));
                    let extremum = match (extremum, test) {
                        (_, Test::Below(_)) => extremum,
                        (Extremum::Min, Test::Above(_)) => Extremum::Max,
                        (Extremum::Max, Test::Above(_)) => Extremum::Min,
                    };
                    image_of_choice = Some((extremum, a, b));
                    match extremum {
                        Extremum::Min => graph.min(a, b),
                        Extremum::Max => graph.max(a, b),
                    }
                }
                (None, _) | (Some(Passed::ToBoth(_)), None) => leaf(graph, tape.node(p), test),
            };
            images[p.index()] = Some(image);
        }
        choices.extend(own.zip(image_of_choice));
    }
    SignForm { root: images[last.index()].unwrap_or(root), choices }
}

/// The choice that the operation at `p` makes.
fn choice(tape: &Tape, p: Position) -> Option<Key> {
    let (extremum, a, b) = tape.op(p).choice()?;
    Some((extremum, tape.node(a), tape.node(b)))
}

fn constant(tape: &Tape, p: Position) -> Option<f64> {
    match tape.op(p) {
        Op::Constant(bits) => Some(f64::from_bits(bits)),
        Op::Coordinate(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..)
        | Op::Oracle(..) => None,
    }
}

/// Whether the result is NaN or at least zero, whatever the operands that are not `known` to be.
fn is_nonnegative(op: Op, known: &[bool]) -> bool {
    let known = |p: Position| known[p.index()];
    match op {
        Op::Constant(bits) => f64::from_bits(bits) >= 0.0,
        Op::Unary(Unary::Abs | Unary::Sqrt, _) | Op::Binary(Binary::Hypot, ..) => true,
        Op::Binary(Binary::Mul, a, b) => a == b || known(a) && known(b),
        // Not a quotient: the divisor may be minus zero.
        Op::Binary(Binary::Add | Binary::Min | Binary::Max, a, b) => known(a) && known(b),
        Op::Coordinate(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..)
        | Op::Oracle(..) => false,
    }
}

/// How `test` of the result of `op` is the same test of its operands, or of the one that is not
/// constant, for every number.
fn pass(tape: &Tape, op: Op, nonnegative: &[bool], test: Test) -> Option<Passed> {
    let finite = |p: Position| constant(tape, p).filter(|c| c.is_finite());
    let factor = |p: Position| finite(p).filter(|c| *c != 0.0);
    let (operand, test) = match op {
        Op::Binary(Binary::Min | Binary::Max, ..) => return Some(Passed::ToBoth(test)),
        Op::Binary(op @ (Binary::Add | Binary::Sub), a, b) => match (finite(a), finite(b)) {
            (Some(c), None) => (b, threshold(f64::MIN, |b| test.holds(op.apply(c, b)))),
            (None, Some(c)) => (a, threshold(f64::MIN, |a| test.holds(op.apply(a, c)))),
            _ => return None,
        },
        Op::Binary(Binary::Mul, a, b) => match (factor(a), factor(b)) {
            (Some(c), None) => (b, threshold(f64::MIN, |b| test.holds(c * b))),
            (None, Some(c)) => (a, threshold(f64::MIN, |a| test.holds(a * c))),
            _ => return None,
        },
        Op::Binary(Binary::Div, a, b) => {
            let divisor = factor(b)?;
            (a, threshold(f64::MIN, |a| test.holds(a / divisor)))
        }
        Op::Unary(Unary::Neg, a) => (a, threshold(f64::MIN, |a| test.holds(-a))),
        Op::Unary(Unary::Sqrt, a) if nonnegative[a.index()] => {
            (a, threshold(0.0, |a| test.holds(a.sqrt())))
        }
        Op::Coordinate(_)
        | Op::Constant(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..)
        | Op::Oracle(..) => return None,
    };
    Some(Passed::To(operand, test?))
}

/// The test that holds at the numbers from `least` on where `holds` does, if that changes once
/// among the finite ones.
fn threshold(least: f64, holds: impl Fn(f64) -> bool) -> Option<Test> {
    let (first, last) = (holds(least), holds(f64::MAX));
    if first == last {
        return None;
    }
    let (mut low, mut high) = (rank(least), rank(f64::MAX));
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(ranked(middle)) == first {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(if first { Test::Below(ranked(high)) } else { Test::Above(ranked(low)) })
}

/// The place of a number that is not NaN in the order of all, minus zero being zero.
fn rank(a: f64) -> i128 {
    let magnitude = i128::from(a.abs().to_bits());
    if a < 0.0 { -magnitude } else { magnitude }
}

/// The number of that [`rank`].
fn ranked(rank: i128) -> f64 {
    let magnitude = f64::from_bits(rank.unsigned_abs() as u64);
    if rank < 0 { -magnitude } else { magnitude }
}

/// Negative where `test` holds of `node`.
fn leaf(graph: &mut Graph, node: NodeId, test: Test) -> NodeId {
    match test {
        Test::Below(0.0) => node,
        Test::Below(threshold) => {
            let threshold = graph.constant(threshold);
            graph.sub(node, threshold)
        }
        Test::Above(0.0) => graph.neg(node),
        Test::Above(threshold) => {
            let threshold = graph.constant(threshold);
            graph.sub(threshold, node)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::probe::{self, Raw, SPECIAL, Simplified, Source, evaluate};

    /// The sign form of `root` is negative where `root` is, at each of `points`.
    fn check(graph: &Graph, root: NodeId, points: impl Iterator<Item = [f64; 3]>, name: &str) {
        let mut both = graph.clone();
        let form = form(&mut both, root);
        let parameters: Vec<f64> = graph.parameters().iter().map(|p| p.1).collect();
        for point in points {
            let values = evaluate(&both, point, &parameters);
            let (value, sign) = (values[root.index()], values[form.root.index()]);
            assert_eq!(sign < 0.0, value < 0.0, "{name} at {point:?}: {sign:e} for {value:e}");
        }
    }

    fn points(source: &mut Source, count: usize) -> Vec<[f64; 3]> {
        let mut number = || loop {
            let number = source.spicy();
            if number.is_finite() {
                break number;
            }
        };
        (0..count).map(|_| [number(), number(), number()]).collect()
    }

    #[test]
    fn random_expressions_keep_their_signs() {
        let mut source = Source(41);
        for i in 0..4000 {
            let mut graph = Graph::new();
            let size = 1 + source.below(30);
            let root = if i % 2 == 0 {
                probe::random::<Raw>(&mut graph, &mut source, size, &SPECIAL)
            } else {
                probe::random::<Simplified>(&mut graph, &mut source, size, &[0.3, -7.0, 1e-3])
            };
            let points = points(&mut source, 30);
            check(&graph, root, points.into_iter(), &format!("expression {i} of seed 41"));
        }
    }

    /// Constants and operators in a chain from a value that is no chain itself.
    #[test]
    fn chains_of_monotone_operations_keep_their_signs_next_to_the_threshold() {
        let mut source = Source(42);
        for i in 0..4000 {
            let mut graph = Graph::new();
            let [x, y, z] = graph.point();
            let base = graph.add(y, z);
            let square = graph.mul(base, base);
            let mut f = if source.below(2) == 0 { base } else { graph.unary(Unary::Sqrt, square) };
            for _ in 0..1 + source.below(5) {
                let c = graph.constant(match source.below(4) {
                    0 => source.spicy(),
                    _ => source.within(-2.0, 2.0),
                });
                f = match source.below(7) {
                    0 => graph.add(f, c),
                    1 => graph.sub(c, f),
                    2 => graph.mul(f, c),
                    3 => graph.div(f, c),
                    4 => graph.min(f, x),
                    5 => graph.max(x, f),
                    _ => graph.neg(f),
                };
            }
            let name = format!("chain {i} of seed 42");
            let mut near = points(&mut source, 20);
            // A point where the sign changes, if a search along y finds one, and its neighbours.
            let negative = |y: f64| evaluate(&graph, [0.5, y, 0.0], &[])[f.index()] < 0.0;
            let (mut low, mut high) = (-10.0f64, 10.0f64);
            while negative(low) != negative(high) && low.next_up() < high {
                let middle = 0.5 * low + 0.5 * high;
                if negative(middle) == negative(low) { low = middle } else { high = middle }
            }
            for _ in 0..4 {
                (low, high) = (low.next_down(), high.next_up());
                near.extend([low, high].map(|y| [0.5, y, 0.0]));
            }
            check(&graph, f, near.into_iter(), &name);
        }
    }

    #[test]
    fn the_test_of_a_union_of_balls_takes_no_roots_and_scales_nothing() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let mut root = None;
        for (i, scale) in [0.3, 0.7, 1.3].into_iter().enumerate() {
            let shift = graph.constant(i as f64);
            let scale = graph.constant(scale);
            let u = graph.sub(x, shift);
            let squares = [u, y, z].map(|u| {
                let u = graph.div(u, scale);
                graph.mul(u, u)
            });
            let q = graph.add(squares[0], squares[1]);
            let q = graph.add(q, squares[2]);
            let distance = graph.unary(Unary::Sqrt, q);
            let one = graph.constant(1.0);
            let field = graph.sub(distance, one);
            let field = graph.mul(field, scale);
            root = Some(root.map_or(field, |root| graph.min(root, field)));
        }
        let grown = graph.constant(0.05);
        let root = graph.sub(root.unwrap(), grown);
        let form = form(&mut graph, root);
        let tape = Tape::new(&graph, &[form.root]);
        let count = |is: &dyn Fn(Op) -> bool| tape.positions().filter(|p| is(tape.op(*p))).count();
        assert_eq!(count(&|op| matches!(op, Op::Unary(..))), 0);
        assert_eq!(count(&|op| matches!(op, Op::Binary(Binary::Min, ..))), 2);
        // Three along each axis to place the balls; the last of each ball is its threshold.
        let full = |p: &Position| tape.axes(*p).len() == 3;
        let full = tape.positions().filter(full).filter(|p| tape.op(*p).choice().is_none());
        assert_eq!(full.count(), 6);
        assert_eq!(form.choices.len(), 2);
    }

    #[test]
    fn what_is_used_twice_is_not_passed() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let ball = {
            let (xx, yy) = (graph.mul(x, x), graph.mul(y, y));
            let sum = graph.add(xx, yy);
            graph.unary(Unary::Sqrt, sum)
        };
        let [a, b] = [0.5, 0.7].map(|r| graph.constant(r));
        let (inner, outer) = (graph.sub(ball, a), graph.sub(b, ball));
        let product = graph.mul(inner, outer);
        let root = graph.max(product, z);
        assert_eq!(form(&mut graph, root).root, root);
    }
}
