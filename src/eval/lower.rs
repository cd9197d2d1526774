//! From the expression as written to the expression that is sampled.
//!
//! A grid is a product of three coordinate tables, so what depends on one axis is worth a table and
//! what depends on two a plane. The sine and cosine of a sum whose terms depend on different axes
//! are split by the addition theorems, after uniform factors are multiplied out, so that no sine or
//! cosine of a plane wave is left under more than one axis. Everything else is copied. Both engines
//! sample the lowered form, so their bits agree by construction.
//!
//! The theorems are the product of two complex numbers, taken with three multiplications where both
//! parts are wanted:
//!
//! > k = cos b (sin a + cos a),
//! > sin(a + b) = k + cos a (sin b - cos b), cos(a + b) = k - sin a (sin b + cos b).
//!
//! The sums in parentheses depend on fewer axes than the results, so of the six operations that the
//! plain products take in the innermost loop five are left, and each number fetched there is used
//! once, as the operand of a multiplication.
//!
//! **Distance from the source form.** Interval programs keep the source form, whose enclosures are
//! tighter, and widen each split sine by [`Split::allowance`]. Let u = 2^-53, t the exact value of
//! the sum of the terms (products of computed leaves and factors), M the sum of their magnitudes
//! and n the number of operations multiplied out. The source's argument and the sum of the
//! lowered parts each pass through at most n, respectively 2n, roundings of quantities at most
//! about M, so they differ from t by at most n u M and 2 n u M. Sine and cosine are computed within
//! 2u. The theorem's identities hold for any four numbers, so the errors of its inputs, e and 2u,
//! pass as through the plain products: sqrt(2) (e + 2u). Of the roundings, those of the two sums and
//! of the two products are of numbers up to sqrt(2), that of the result of one up to 1: at most
//! (4 sqrt(2) + 1) u < 7u. So three parts, which is the most, end within 28u. The source's computed
//! sine is within 2u of its own argument's. In all: 30 u + 3 n u M; the allowance is (40 + 4 n M) u,
//! which covers the rounding of M and of itself. The result never exceeds 1 by more than 40 u,
//! whatever M.

use super::images::Images;
use crate::expr::{AxisSet, Binary, Graph, Node, NodeId, Unary, depends};
use rustc_hash::FxHashMap;

/// An expression in the form in which it is sampled.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// The source graph with the nodes of the lowered form added.
    pub graph: Graph,
    /// The lowered root.
    pub root: NodeId,
    image: Images,
    splits: FxHashMap<NodeId, Split>,
}

impl Lowered {
    /// The lowered form of the source node `id`, if the root needs it.
    #[must_use]
    pub fn image(&self, id: NodeId) -> Option<NodeId> {
        self.image.get(id)
    }

    /// How the source node `id`, a sine or a cosine, was split.
    #[must_use]
    pub fn split(&self, id: NodeId) -> Option<&Split> {
        self.splits.get(&id)
    }
}

/// The sum under a sine or cosine that was split.
#[derive(Clone, Debug)]
pub struct Split {
    /// The terms of the sum.
    pub terms: Vec<Term>,
    /// Number of operations that were multiplied out.
    pub steps: usize,
}

/// A term of a sum: a leaf times and over uniform factors, added or subtracted.
#[derive(Clone, Debug)]
pub struct Term {
    /// The leaf, a source node.
    pub leaf: NodeId,
    /// The uniform factors, source nodes, outermost first.
    pub factors: Vec<Factor>,
    negative: bool,
}

/// A uniform factor of a term.
#[derive(Clone, Copy, Debug)]
pub enum Factor {
    /// The term is multiplied by it.
    Times(NodeId),
    /// The term is divided by it.
    Over(NodeId),
}

/// The unit of the allowance, half the spacing of numbers at one.
const UNIT: f64 = 1.0 / (1u64 << 53) as f64;

impl Split {
    /// A split sine or cosine lies within this of the enclosure of its source form, if the
    /// magnitudes of the terms sum up to at most `magnitude`.
    #[must_use]
    pub fn allowance(&self, magnitude: f64) -> f64 {
        (40.0 + 4.0 * self.steps as f64 * magnitude) * UNIT
    }

    /// The largest magnitude of a split sine or cosine.
    pub const LARGEST: f64 = 1.0 + 40.0 * UNIT;
}

/// The lowered form of `root`.
#[must_use]
pub fn lower(source: &Graph, root: NodeId) -> Lowered {
    lower_own(source.clone(), root)
}

/// The lowered form of `root`, added to the graph itself.
#[must_use]
pub fn lower_own(mut graph: Graph, root: NodeId) -> Lowered {
    let axes = depends::axes(&graph);
    let mut image = Images::new(root);
    let mut splits = FxHashMap::default();
    for id in depends::reachable(&graph, &[root]) {
        let node = graph.node(id);
        let lowered = match node {
            Node::Unary(op @ (Unary::Sin | Unary::Cos), a) => {
                split(&graph, &axes, a).map(|(split, parts)| {
                    splits.insert(id, split);
                    let parts: Vec<NodeId> =
                        parts.iter().map(|part| sum(&mut graph, &image, part)).collect();
                    wave(&mut graph, op, &parts)
                })
            }
            Node::Coordinate(_)
            | Node::Constant(_)
            | Node::Parameter(_)
            | Node::Unary(..)
            | Node::Binary(..)
            | Node::Pick(..)
            | Node::Oracle(..) => None,
        };
        let lowered = lowered.unwrap_or_else(|| image.rebuilt(&mut graph, id, node));
        image.set(id, lowered);
    }
    Lowered { root: image.of(root), graph, image, splits }
}

/// Terms whose sum is one part of the argument of a split sine.
type Part = Vec<Term>;

/// The argument `argument` in parts, each on fewer axes than the whole, if it has two or more.
fn split(source: &Graph, axes: &[AxisSet], argument: NodeId) -> Option<(Split, Vec<Part>)> {
    let split = terms(source, axes, argument)?;
    let mut parts: Vec<(AxisSet, Part)> = Vec::new();
    for term in &split.terms {
        let set = axes[term.leaf.index()];
        match parts.iter_mut().find(|(s, _)| *s == set) {
            Some((_, part)) => part.push(term.clone()),
            None => parts.push((set, vec![term.clone()])),
        }
    }
    // A part inside another's axes joins it: splitting it off would save nothing.
    while let Some((i, j)) = nested(&parts) {
        let (_, part) = parts.swap_remove(i);
        let j = if j == parts.len() { i } else { j };
        parts[j].1.extend(part);
    }
    // Parts on few axes are combined first, where the products cost least.
    parts.sort_by_key(|(set, _)| (set.len(), set.index()));
    (parts.len() > 1).then(|| (split, parts.into_iter().map(|(_, part)| part).collect()))
}

/// Two parts, the axes of the first being among those of the second.
fn nested(parts: &[(AxisSet, Part)]) -> Option<(usize, usize)> {
    let pairs = (0..parts.len()).flat_map(|i| (0..parts.len()).map(move |j| (i, j)));
    pairs.into_iter().find(|&(i, j)| i != j && parts[i].0.is_subset(parts[j].0))
}

/// The most operations that are multiplied out; a longer sum stays as it is.
const LONGEST: usize = 64;

/// The terms of a sum on several axes, uniform factors multiplied out.
fn terms(source: &Graph, axes: &[AxisSet], argument: NodeId) -> Option<Split> {
    let uniform = |id: NodeId| axes[id.index()].is_empty();
    let mut terms = Vec::new();
    let mut steps = 0;
    let mut pending = vec![Term { leaf: argument, factors: Vec::new(), negative: false }];
    while let Some(mut term) = pending.pop() {
        steps += 1;
        if steps > LONGEST {
            return None;
        }
        if axes[term.leaf.index()].len() < 2 {
            terms.push(term);
            continue;
        }
        match source.node(term.leaf) {
            Node::Unary(Unary::Neg, a) => {
                pending.push(Term { leaf: a, negative: !term.negative, ..term });
            }
            Node::Binary(op @ (Binary::Add | Binary::Sub), a, b) => {
                let negative = term.negative != (op == Binary::Sub);
                pending.push(Term { leaf: b, factors: term.factors.clone(), negative });
                pending.push(Term { leaf: a, ..term });
            }
            Node::Binary(Binary::Mul, a, b) if uniform(a) || uniform(b) => {
                let (factor, leaf) = if uniform(a) { (a, b) } else { (b, a) };
                term.factors.push(Factor::Times(factor));
                pending.push(Term { leaf, ..term });
            }
            Node::Binary(Binary::Div, a, b) if uniform(b) => {
                term.factors.push(Factor::Over(b));
                pending.push(Term { leaf: a, ..term });
            }
            Node::Coordinate(_)
            | Node::Constant(_)
            | Node::Parameter(_)
            | Node::Unary(..)
            | Node::Binary(..)
            | Node::Pick(..)
            | Node::Oracle(..) => terms.push(term),
        }
    }
    Some(Split { terms, steps })
}

/// The sum of a part's terms.
fn sum(graph: &mut Graph, image: &Images, part: &[Term]) -> NodeId {
    let mut total = None;
    for term in part {
        let mut value = image.of(term.leaf);
        for factor in term.factors.iter().rev() {
            value = match factor {
                Factor::Times(f) => graph.mul(value, image.of(*f)),
                Factor::Over(f) => graph.div(value, image.of(*f)),
            };
        }
        total = Some(match (total, term.negative) {
            (None, false) => value,
            (None, true) => graph.neg(value),
            (Some(total), false) => graph.add(total, value),
            (Some(total), true) => graph.sub(total, value),
        });
    }
    total.unwrap_or_else(|| graph.constant(0.0))
}

/// The sine or cosine `op` of the sum of `parts`.
fn wave(graph: &mut Graph, op: Unary, parts: &[NodeId]) -> NodeId {
    let mut waves = parts.iter().map(|&part| [Unary::Sin, Unary::Cos].map(|f| (f, part)));
    let mut leaf =
        |graph: &mut Graph| waves.next().map(|wave| wave.map(|(f, part)| graph.unary(f, part)));
    let zero = graph.constant(0.0);
    let [mut sin, mut cos] = leaf(graph).unwrap_or([zero; 2]);
    while let Some([s, c]) = leaf(graph) {
        let (less, more, both) = (graph.sub(s, c), graph.add(s, c), graph.add(sin, cos));
        let common = graph.mul(c, both);
        let (cosines, sines) = (graph.mul(cos, less), graph.mul(sin, more));
        (sin, cos) = (graph.add(common, cosines), graph.sub(common, sines));
    }
    if op == Unary::Sin { sin } else { cos }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::tape::Tape;
    use crate::expr::probe::Source;

    /// The number of axes under each sine and cosine that the root needs.
    fn waves(lowered: &Lowered) -> Vec<usize> {
        let axes = depends::axes(&lowered.graph);
        let nodes = depends::reachable(&lowered.graph, &[lowered.root]);
        let wave = |id: &NodeId| {
            let node = lowered.graph.node(*id);
            let Node::Unary(Unary::Sin | Unary::Cos, a) = node else { return None };
            Some(axes[a.index()].len())
        };
        let mut counts: Vec<usize> = nodes.iter().filter_map(wave).collect();
        counts.sort_unstable();
        counts
    }

    #[test]
    fn a_plane_wave_becomes_products_of_waves_on_one_axis() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let [tau, a, b, shift] = [6.25, 0.8, 0.6, 0.125].map(|c| graph.constant(c));
        let (ax, by) = (graph.mul(a, x), graph.mul(b, y));
        let sum = graph.add(ax, by);
        let sum = graph.sub(sum, z);
        let sum = graph.add(sum, shift);
        let argument = graph.mul(tau, sum);
        let root = graph.unary(Unary::Sin, argument);
        let lowered = lower(&graph, root);
        assert_eq!(waves(&lowered), [1; 6]);
        assert_eq!(lowered.split(root).map(|s| s.terms.len()), Some(4));
    }

    #[test]
    fn a_part_within_the_axes_of_another_is_not_split_off() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let xy = graph.mul(x, y);
        let sum = graph.add(xy, x);
        let root = graph.unary(Unary::Cos, sum);
        assert_eq!(waves(&lower(&graph, root)), [2]);
        let sum = graph.add(sum, z);
        let root = graph.unary(Unary::Cos, sum);
        assert_eq!(waves(&lower(&graph, root)), [1, 1, 2, 2]);
    }

    #[test]
    fn what_is_not_a_wave_is_copied() {
        let mut source = Source(1);
        for _ in 0..200 {
            let mut graph = Graph::new();
            let [x, y, z] = graph.point();
            let mut nodes = vec![x, y, z];
            for _ in 0..20 {
                let op = source.of(&Binary::ALL);
                let (a, b) = (source.of(&nodes), source.of(&nodes));
                nodes.push(graph.binary(op, a, b));
            }
            let root = nodes[nodes.len() - 1];
            let lowered = lower(&graph, root);
            assert_eq!((lowered.root, lowered.graph.len()), (root, graph.len()));
        }
    }

    #[test]
    fn a_long_sum_is_left_whole() {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let mut sum = graph.add(x, y);
        for _ in 0..20_000 {
            let product = graph.mul(sum, z);
            sum = graph.add(product, x);
        }
        let mut chain = graph.add(x, y);
        for i in 0..100 {
            let c = graph.constant(f64::from(i));
            let cz = graph.mul(c, z);
            chain = graph.add(chain, cz);
        }
        let total = graph.add(sum, chain);
        let root = graph.unary(Unary::Sin, total);
        let lowered = lower(&graph, root);
        assert_eq!(lowered.root, root);
        assert!(Tape::new(&lowered.graph, &[root]).len() > 20_000);
    }
}
