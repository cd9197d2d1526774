//! What is known of an expression before anything is evaluated.
//!
//! The graph itself is the program: nodes are in an order in which they can be computed, and a
//! [cut](super::cut) takes of them what a box needs. Here they get the numbers of their choices,
//! which are the positions of their activity bits, and what intervals may conclude from them.
//!
//! **Bits.** Choice `c` of the source expression has bits `2 c` and `2 c + 1`, one a side, set where
//! the side may matter. A choice that nothing needs has none set. In other forms of the expression
//! (the lowered one, the one whose sign is sampled) a choice has the bits of the one that it comes
//! from; where two become one it has none, and both sides are always taken.

use crate::eval::lower::{Lowered, lower_own};
use crate::eval::regions::{Bits, Key};
use crate::eval::{balance, sign};
use crate::expr::graph::operands;
use crate::expr::{AxisSet, Binary, Graph, Node, NodeId, Unary, depends, derive};
use crate::geom::Axis;
use rustc_hash::{FxHashMap, FxHashSet};

/// The forms of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// As it is enclosed.
    Source,
    /// As it is sampled, with its derivatives.
    Sampled,
    /// What is negative where the expression is.
    Sign,
}

/// A node that makes no choice, or one without bits.
pub(super) const NO_CHOICE: u32 = u32::MAX;

/// An expression in its three forms.
#[derive(Debug)]
pub(super) struct Code {
    /// The lowered form, in a graph that holds the others too.
    pub(super) lowered: Lowered,
    /// The root of the source form and of the form whose sign is sampled.
    pub(super) source: NodeId,
    pub(super) sign: NodeId,
    /// The derivatives of the sampled form.
    pub(super) slopes: [NodeId; 3],
    /// By node: the axes that it depends on.
    pub(super) axes: Vec<AxisSet>,
    /// Number of choices.
    pub(super) count: usize,
    /// By form and node: the number of the choice.
    choices: [Vec<u32>; 3],
    /// By node of the source form: what holds of it.
    traits: Vec<Traits>,
    keys: FxHashMap<Key, u32>,
}

/// What holds of a node of the source form; see [`chains`](crate::eval::interpret).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Traits {
    /// It is an extremum used once, by one of the same kind; neither has picks on its choice.
    pub(super) joins: bool,
    /// It is an extremum without picks that the root needs through others and negations alone.
    pub(super) crowns: bool,
}

impl Code {
    /// Readies the expression `root`.
    pub(super) fn new(graph: &Graph, root: NodeId) -> Self {
        let (graph, source) = balance::balance(graph, root);
        let nodes = depends::reachable(&graph, &[source]);
        let mut lowered = lower_own(graph, source);
        let slopes = Axis::ALL.map(|axis| derive::partial(&mut lowered.graph, lowered.root, axis));
        let form = sign::form(&mut lowered.graph, lowered.root);
        let whole = &lowered.graph;
        let mut keys: FxHashMap<Key, u32> = FxHashMap::default();
        for key in nodes.iter().filter_map(|&id| key(whole, id)) {
            let next = keys.len() as u32;
            keys.entry(key).or_insert(next);
        }
        let count = keys.len();
        let sampled = onto(keys.iter().filter_map(|(&(extremum, a, b), &number)| {
            Some(((extremum, lowered.image(a)?, lowered.image(b)?), number))
        }));
        let signs = onto(form.choices.iter().filter_map(|(old, new)| {
            let number = sampled.get(old).copied()?;
            (number != NO_CHOICE).then_some((*new, number))
        }));
        let is_clear = [&sampled, &signs].iter().all(|map| map.values().all(|n| *n != NO_CHOICE));
        let choices = [&keys, &sampled, &signs].map(|map| {
            let number = |(id, _)| key(whole, id).and_then(|key| map.get(&key).copied());
            whole.iter().map(|node| number(node).unwrap_or(NO_CHOICE)).collect()
        });
        let mut traits = vec![Traits::default(); whole.len()];
        if is_clear {
            find_traits(whole, source, &nodes, &mut traits);
        }
        let axes = depends::axes(whole);
        let sign = form.root;
        Self { source, sign, slopes, axes, count, choices, traits, keys: sampled, lowered }
    }

    /// The graph of all forms.
    pub(super) fn graph(&self) -> &Graph {
        &self.lowered.graph
    }

    /// The number of the choice that node `id`, which is `node`, makes in form `form`.
    #[inline]
    pub(super) fn choice(&self, form: Form, id: NodeId, node: &Node) -> u32 {
        match node {
            Node::Binary(Binary::Min | Binary::Max, ..) | Node::Pick(..) => {
                self.choices[form as usize][id.index()]
            }
            Node::Coordinate(_)
            | Node::Constant(_)
            | Node::Parameter(_)
            | Node::Unary(..)
            | Node::Binary(..)
            | Node::Oracle(..) => NO_CHOICE,
        }
    }

    #[inline]
    pub(super) fn traits(&self, id: NodeId) -> Traits {
        self.traits[id.index()]
    }

    /// Words of an activity row.
    pub(super) fn words(&self) -> usize {
        (2 * self.count).div_ceil(64)
    }

    /// The bits of the choices of the sampled form, for other programs of it.
    pub(super) fn bits(&self) -> Bits {
        let numbered = self.keys.iter().filter(|(_, number)| **number != NO_CHOICE);
        Bits::of_choices(numbered.map(|(key, number)| (*key, *number)), self.count)
    }
}

/// The choice that node `id` makes.
fn key(graph: &Graph, id: NodeId) -> Option<Key> {
    match graph.node(id) {
        Node::Binary(op, a, b) => op.extremum().map(|extremum| (extremum, a, b)),
        Node::Pick(extremum, [a, b, _, _]) => Some((extremum, a, b)),
        Node::Coordinate(_)
        | Node::Constant(_)
        | Node::Parameter(_)
        | Node::Unary(..)
        | Node::Oracle(..) => None,
    }
}

/// The numbers of choices by what has become of them; none where several have become one.
fn onto(choices: impl Iterator<Item = (Key, u32)>) -> FxHashMap<Key, u32> {
    let mut numbers: FxHashMap<Key, u32> = FxHashMap::default();
    for (key, number) in choices {
        let known = numbers.entry(key).or_insert(number);
        if *known != number {
            *known = NO_CHOICE;
        }
    }
    numbers
}

/// Finds the traits of `nodes`, which `root` needs.
fn find_traits(graph: &Graph, root: NodeId, nodes: &[NodeId], traits: &mut [Traits]) {
    let mut uses = vec![0u32; graph.len()];
    uses[root.index()] = 1;
    let mut picked: FxHashSet<Key> = FxHashSet::default();
    for &id in nodes {
        let node = graph.node(id);
        operands(&node).iter().for_each(|o| uses[o.index()] += 1);
        picked.extend(matches!(node, Node::Pick(..)).then(|| key(graph, id)).flatten());
    }
    let extremum = |id: NodeId| match graph.node(id) {
        Node::Binary(..) => key(graph, id).filter(|key| !picked.contains(key)),
        Node::Coordinate(_)
        | Node::Constant(_)
        | Node::Parameter(_)
        | Node::Unary(..)
        | Node::Pick(..)
        | Node::Oracle(..) => None,
    };
    for &id in nodes {
        let Some((kind, a, b)) = extremum(id) else { continue };
        for o in [a, b].into_iter().filter(|o| uses[o.index()] == 1) {
            traits[o.index()].joins = extremum(o).is_some_and(|(other, _, _)| other == kind);
        }
    }
    let mut pending = vec![root];
    while let Some(id) = pending.pop() {
        if uses[id.index()] != 1 {
            continue;
        }
        if let Some((_, a, b)) = extremum(id) {
            traits[id.index()].crowns = true;
            pending.extend([a, b]);
        } else if let Node::Unary(Unary::Neg, a) = graph.node(id) {
            pending.push(a);
        }
    }
}
