//! Which operations a box needs: the regions of an expression.
//!
//! A *choice* compares two values: an extremum of `a` and `b`, together with every pick on the same
//! `a` and `b`. It has two sides: the first (`a`, and `c` of its picks) and the second (`b`, `d`).
//! Each side is a *region*; regions form a tree, the parent of a side being the smallest region
//! that holds every user of the choice. An operation belongs to the smallest region that holds all
//! its uses: the root region [`TOP`] if it is an output, and in general the lowest common ancestor
//! of the contexts of its uses. So whenever a use is evaluated and looks at the operation, the
//! operation's region and the regions around it are active.
//!
//! A side is dead in a box where the other operand is strictly ahead of it and neither may be NaN;
//! whatever stands in for its values, the extremum then returns the other operand's bits
//! ([`Extremum::loser`] does without a branch). Every region inside a dead one is dead.
//!
//! **Bits.** Regions of the *source* expression are numbered once ([`Bits::number`]); every other
//! tape of the same expression takes their bits over ([`Bits::through`]), so that what the
//! interval program decides serves all programs. A choice keeps its bits on a tape only if the tape
//! has it inside the region that enclosed it in the source: a bit may be clear because the
//! surrounding region is dead, so it says nothing outside of it. Choices without bits, and sides
//! without operations of their own, make no region: their operands are evaluated with their users.

use super::tape::{Position, Tape};
use crate::expr::{Extremum, NodeId};
use rustc_hash::FxHashMap;

/// A region of a tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RegionId(u32);

/// The region that is always active.
pub const TOP: RegionId = RegionId(0);

impl RegionId {
    /// Position of the region in its tape's list.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A side of a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Region {
    parent: RegionId,
    depth: u32,
    bit: Option<u32>,
}

/// A choice by its extremum and the nodes that it compares.
pub type Key = (Extremum, NodeId, NodeId);

/// The activity bits of the choices of an expression.
#[derive(Clone, Debug, Default)]
pub struct Bits {
    choices: FxHashMap<Key, ChoiceBits>,
    count: usize,
}

/// The bits of a choice's first and second side, and that of the region around the choice.
#[derive(Clone, Copy, Debug)]
struct ChoiceBits {
    sides: [Option<u32>; 2],
    around: Option<u32>,
}

impl Bits {
    /// Numbers the regions of the source tape that have operations on two axes or more.
    ///
    /// A region's bit comes before those of the regions inside it.
    #[must_use]
    pub fn number(source: &Tape) -> Self {
        let mut every = Self::default();
        for key in source.positions().filter_map(|p| key(source, p)) {
            let first = 2 * every.choices.len() as u32;
            let sides = [Some(first), Some(first + 1)];
            every.choices.entry(key).or_insert(ChoiceBits { sides, around: None });
        }
        let regions = Regions::new(source, &every, 1);
        let mut populated = vec![false; regions.list.len()];
        for position in source.positions().filter(|p| source.axes(*p).len() >= 2) {
            populated[regions.of(position).index()] = true;
        }
        let mut count = 0;
        let numbers: Vec<Option<u32>> = (populated.iter().enumerate())
            .map(|(i, populated)| {
                let number = (i > 0 && *populated).then_some(count);
                count += u32::from(number.is_some());
                number
            })
            .collect();
        let mut bits = Self { choices: FxHashMap::default(), count: count as usize };
        for position in source.positions() {
            if let Some((key, sides)) = key(source, position).zip(regions.sides(position)) {
                let sides = sides.map(|side| side.and_then(|r| numbers[r.index()]));
                if sides != [None, None] {
                    bits.choices.insert(key, ChoiceBits { sides, around: None });
                }
            }
        }
        // What surrounds a choice is read off the regions that the interval program will have.
        let regions = Regions::new(source, &bits, 1);
        for position in source.positions() {
            if let Some((key, [first, second])) = key(source, position).zip(regions.sides(position))
                && let Some(choice) = bits.choices.get_mut(&key)
            {
                let parent = first.or(second).map_or(TOP, |side| regions.parent(side));
                choice.around = regions.bit(parent);
            }
        }
        bits
    }

    /// The bits of choices that are numbered: `2 n` and `2 n + 1` for number `n` below `count`.
    ///
    /// A bit may be clear only where its side is dead, or where nothing needs the choice.
    #[must_use]
    pub fn of_choices(numbered: impl Iterator<Item = (Key, u32)>, count: usize) -> Self {
        let bits = |number: u32| [Some(2 * number), Some(2 * number + 1)];
        let choices = numbered
            .map(|(key, number)| (key, ChoiceBits { sides: bits(number), around: None }))
            .collect();
        Self { choices, count: 2 * count }
    }

    /// The same bits for a rewritten expression, `image` giving the new node of each old one.
    #[must_use]
    pub fn through(&self, image: impl Fn(NodeId) -> Option<NodeId>) -> Self {
        let mut choices: Vec<_> = self.choices.iter().collect();
        // By bits: where two choices become one, the result must not depend on hashing.
        choices.sort_unstable_by_key(|(_, bits)| bits.sides);
        let mut mapped = FxHashMap::default();
        for (&(extremum, a, b), &bits) in choices {
            if let (Some(a), Some(b)) = (image(a), image(b)) {
                mapped.entry((extremum, a, b)).or_insert(bits);
            }
        }
        Self { choices: mapped, count: self.count }
    }

    /// The same bits for an expression whose choices have become others, as `choices` says.
    #[must_use]
    pub fn onto(&self, choices: &[(Key, Key)]) -> Self {
        let mut found: Vec<(Key, ChoiceBits)> = (choices.iter())
            .filter_map(|(old, new)| self.choices.get(old).map(|bits| (*new, *bits)))
            .collect();
        found.sort_by_key(|(_, bits)| bits.sides);
        let mut mapped = FxHashMap::default();
        for (choice, bits) in found {
            mapped.entry(choice).or_insert(bits);
        }
        Self { choices: mapped, count: self.count }
    }

    /// Number of bits.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no bits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of words that hold the bits.
    #[must_use]
    pub fn words(&self) -> usize {
        self.count.div_ceil(64)
    }
}

/// Whether bit `bit` is set in `activity`.
#[must_use]
#[inline]
pub fn is_set(activity: &[u64], bit: u32) -> bool {
    activity[bit as usize / 64] >> (bit % 64) & 1 == 1
}

/// The regions of a tape.
#[derive(Clone, Debug)]
pub struct Regions {
    list: Vec<Region>,
    of: Vec<RegionId>,
    choices: Vec<[Option<RegionId>; 2]>,
    choice_of: Vec<Option<u32>>,
}

impl Regions {
    /// The regions of `tape` among those that have bits in `bits`.
    ///
    /// Operations on fewer than `axes` axes (at least one) belong to [`TOP`].
    #[must_use]
    pub fn new(tape: &Tape, bits: &Bits, axes: usize) -> Self {
        Analysis::new(tape, bits, axes).run()
    }

    /// The region of the operation at `position`.
    #[must_use]
    pub fn of(&self, position: Position) -> RegionId {
        self.of[position.index()]
    }

    /// The regions of the first and second side of the choice made at `position`, if it makes one
    /// that has regions.
    #[must_use]
    pub fn sides(&self, position: Position) -> Option<[Option<RegionId>; 2]> {
        self.choice_of[position.index()].map(|choice| self.choices[choice as usize])
    }

    /// The activity bit of `region`; none for [`TOP`].
    #[must_use]
    pub fn bit(&self, region: RegionId) -> Option<u32> {
        self.list[region.index()].bit
    }

    /// The region around `region`; [`TOP`] for itself.
    #[must_use]
    pub fn parent(&self, region: RegionId) -> RegionId {
        self.list[region.index()].parent
    }

    /// Number of regions around `region`.
    #[must_use]
    pub fn depth(&self, region: RegionId) -> usize {
        self.list[region.index()].depth as usize
    }

    /// Every region but [`TOP`], outer ones before inner ones.
    pub fn inner(&self) -> impl DoubleEndedIterator<Item = RegionId> + ExactSizeIterator + use<> {
        (1..self.list.len()).map(|i| RegionId(i as u32))
    }

    /// The smallest region that contains both.
    #[must_use]
    pub fn common(&self, a: RegionId, b: RegionId) -> RegionId {
        common(&self.list, a, b)
    }

    /// The regions for the tape reordered by `order`.
    pub(super) fn reordered(self, order: &[Position]) -> Self {
        Self {
            of: order.iter().map(|p| self.of[p.index()]).collect(),
            choice_of: order.iter().map(|p| self.choice_of[p.index()]).collect(),
            ..self
        }
    }
}

fn key(tape: &Tape, position: Position) -> Option<Key> {
    tape.op(position).choice().map(|(extremum, a, b)| (extremum, tape.node(a), tape.node(b)))
}

fn common(list: &[Region], mut a: RegionId, mut b: RegionId) -> RegionId {
    while a != b {
        if list[a.index()].depth >= list[b.index()].depth {
            a = list[a.index()].parent;
        } else {
            b = list[b.index()].parent;
        }
    }
    a
}

/// A choice of a tape while its regions are being found.
#[derive(Debug)]
struct Choice {
    bits: ChoiceBits,
    users: Vec<Position>,
    pending: usize,
    sides: [Option<RegionId>; 2],
}

/// The search for regions, users before operands.
///
/// An operation is settled when every use has a context: uses by an operation without a choice
/// when that is settled, uses by a choice when all users of the choice are. Should an operation
/// both follow from a pick and stand before another user of the pick's choice, nothing could be
/// settled next; the latest such operation then takes the pick's own region as context, which is
/// active whenever the pick is evaluated.
struct Analysis<'a> {
    tape: &'a Tape,
    participates: Vec<bool>,
    choices: Vec<Choice>,
    choice_of: Vec<Option<u32>>,
    /// Users of the operation at `p`: `users[starts[p]..starts[p + 1]]`.
    users: Vec<Position>,
    starts: Vec<usize>,
    pending: Vec<usize>,
    settled: Vec<bool>,
    outputs: Vec<bool>,
    of: Vec<RegionId>,
    list: Vec<Region>,
}

impl<'a> Analysis<'a> {
    fn new(tape: &'a Tape, bits: &Bits, axes: usize) -> Self {
        let participates: Vec<bool> =
            tape.positions().map(|p| tape.axes(p).len() >= axes.max(1)).collect();
        let mut starts = vec![0; tape.len() + 1];
        let mut choice_of = vec![None; tape.len()];
        let mut choices: Vec<Choice> = Vec::new();
        let mut numbers: FxHashMap<Key, u32> = FxHashMap::default();
        for p in tape.positions().filter(|p| participates[p.index()]) {
            for o in tape.op(p).operands().iter() {
                starts[o.index() + 1] += 1;
            }
            let Some((key, bits)) = key(tape, p).and_then(|k| Some((k, *bits.choices.get(&k)?)))
            else {
                continue;
            };
            let number = *numbers.entry(key).or_insert_with(|| {
                choices.push(Choice { bits, users: Vec::new(), pending: 0, sides: [None; 2] });
                choices.len() as u32 - 1
            });
            choice_of[p.index()] = Some(number);
            choices[number as usize].users.push(p);
            choices[number as usize].pending += 1;
        }
        let pending = starts[1..].to_vec();
        for i in 0..tape.len() {
            starts[i + 1] += starts[i];
        }
        let mut users = vec![Position::new(0); starts[tape.len()]];
        let mut next = starts.clone();
        for p in tape.positions().filter(|p| participates[p.index()]) {
            for o in tape.op(p).operands().iter() {
                users[next[o.index()]] = p;
                next[o.index()] += 1;
            }
        }
        Self {
            tape,
            participates,
            choices,
            choice_of,
            users,
            starts,
            pending,
            settled: vec![false; tape.len()],
            outputs: tape.output_flags(),
            of: vec![TOP; tape.len()],
            list: vec![Region { parent: TOP, depth: 0, bit: None }],
        }
    }

    fn run(mut self) -> Regions {
        let open =
            |this: &Self, p: &Position| this.participates[p.index()] && !this.settled[p.index()];
        let mut ready: Vec<Position> = (self.tape.positions())
            .filter(|p| self.participates[p.index()] && self.pending[p.index()] == 0)
            .collect();
        for latest in self.tape.positions().rev() {
            if open(&self, &latest) {
                while let Some(p) = ready.pop() {
                    if open(&self, &p) {
                        self.settle(p, &mut ready);
                    }
                }
            }
            if open(&self, &latest) {
                self.settle(latest, &mut ready);
            }
        }
        Regions {
            list: self.list,
            of: self.of,
            choices: self.choices.into_iter().map(|choice| choice.sides).collect(),
            choice_of: self.choice_of,
        }
    }

    fn settle(&mut self, p: Position, ready: &mut Vec<Position>) {
        self.settled[p.index()] = true;
        self.of[p.index()] = self.smallest(p);
        match self.choice_of[p.index()] {
            None => self.release(p, ready),
            Some(number) => {
                let choice = &mut self.choices[number as usize];
                choice.pending -= 1;
                if choice.pending == 0 {
                    self.complete(number);
                    for user in self.choices[number as usize].users.clone() {
                        self.release(user, ready);
                    }
                }
            }
        }
    }

    /// The smallest region that holds every use of `p`.
    fn smallest(&self, p: Position) -> RegionId {
        if self.outputs[p.index()] {
            return TOP;
        }
        let users = &self.users[self.starts[p.index()]..self.starts[p.index() + 1]];
        let contexts = users.iter().map(|&user| self.context(user, p));
        contexts.reduce(|a, b| common(&self.list, a, b)).unwrap_or(TOP)
    }

    /// The region in which `user` uses `operand`.
    fn context(&self, user: Position, operand: Position) -> RegionId {
        let own = self.of[user.index()];
        let Some(choice) = self.choice_of[user.index()].map(|c| &self.choices[c as usize]) else {
            return own;
        };
        let operands = self.tape.op(user).operands();
        let sides = operands.iter().enumerate().filter(|(_, o)| **o == operand).map(|(i, _)| i % 2);
        sides
            .map(|side| choice.sides[side].unwrap_or(own))
            .reduce(|a, b| common(&self.list, a, b))
            .unwrap_or(own)
    }

    /// Makes the regions of a choice, all of whose users are settled.
    fn complete(&mut self, number: u32) {
        let choice = &self.choices[number as usize];
        let contexts = choice.users.iter().map(|user| self.of[user.index()]);
        let parent = contexts.reduce(|a, b| common(&self.list, a, b)).unwrap_or(TOP);
        if let Some(around) = choice.bits.around {
            let mut region = parent;
            while self.list[region.index()].bit != Some(around) {
                if region == TOP {
                    return;
                }
                region = self.list[region.index()].parent;
            }
        }
        let depth = self.list[parent.index()].depth + 1;
        let sides = choice.bits.sides.map(|bit| {
            bit.map(|bit| {
                self.list.push(Region { parent, depth, bit: Some(bit) });
                RegionId(self.list.len() as u32 - 1)
            })
        });
        self.choices[number as usize].sides = sides;
    }

    /// Counts the uses of the operands of `p` as known.
    fn release(&mut self, p: Position, ready: &mut Vec<Position>) {
        for o in self.tape.op(p).operands().iter() {
            let pending = &mut self.pending[o.index()];
            *pending -= 1;
            if *pending == 0 && self.participates[o.index()] {
                ready.push(*o);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::schedule::{Schedule, Step, brick};
    use crate::expr::{Binary, Graph};

    /// A two-axis field of its own: x * y + c.
    fn field(graph: &mut Graph, c: f64) -> NodeId {
        let [x, y, _] = graph.point();
        let (xy, c) = (graph.mul(x, y), graph.constant(c));
        graph.binary(Binary::Hypot, xy, c)
    }

    fn schedule(graph: &Graph, root: NodeId) -> (Schedule, Bits) {
        let tape = Tape::new(graph, &[root]);
        let bits = Bits::number(&tape);
        (Schedule::brick(&tape, &bits), bits)
    }

    fn region_of(schedule: &Schedule, id: NodeId) -> RegionId {
        let tape = schedule.tape();
        let position = tape.positions().find(|&p| tape.node(p) == id);
        schedule.regions().of(position.unwrap())
    }

    #[test]
    fn sides_of_nested_extrema_are_nested_regions_and_shared_nodes_lie_outside() {
        let mut graph = Graph::new();
        let [a, b, c] = [1.0, 2.0, 3.0].map(|v| field(&mut graph, v));
        let inner = graph.min(a, b);
        let root = graph.max(inner, c);
        let (schedule, bits) = schedule(&graph, root);
        assert_eq!((bits.len(), bits.words()), (4, 1));
        let [ra, rb, rc, ri] = [a, b, c, inner].map(|id| region_of(&schedule, id));
        assert_eq!(region_of(&schedule, root), TOP);
        assert_eq!(schedule.regions().parent(ra), ri);
        assert_eq!(schedule.regions().parent(rb), ri);
        assert_eq!(schedule.regions().parent(ri), TOP);
        assert!(ra != rb && ri != rc && schedule.regions().bit(ri) < schedule.regions().bit(ra));
        let [x, y, _] = graph.point();
        let shared = graph.mul(x, y);
        assert_eq!(region_of(&schedule, shared), TOP);
    }

    #[test]
    fn picks_share_the_regions_of_their_extremum() {
        let mut graph = Graph::new();
        let [a, b, c, d] = [1.0, 2.0, 3.0, 4.0].map(|v| field(&mut graph, v));
        let min = graph.min(a, b);
        let pick = graph.pick(Extremum::Min, [a, b, c, d]);
        let root = graph.add(min, pick);
        let (schedule, bits) = schedule(&graph, root);
        assert_eq!(bits.len(), 2);
        assert_eq!(region_of(&schedule, a), region_of(&schedule, c));
        assert_eq!(region_of(&schedule, b), region_of(&schedule, d));
        assert!(region_of(&schedule, a) != region_of(&schedule, b));
    }

    #[test]
    fn a_pick_operand_made_from_the_extremum_itself_is_settled() {
        let mut graph = Graph::new();
        let [a, b, d] = [1.0, 2.0, 4.0].map(|v| field(&mut graph, v));
        let min = graph.min(a, b);
        let c = graph.mul(min, min);
        let root = graph.pick(Extremum::Min, [a, b, c, d]);
        let (schedule, _) = schedule(&graph, root);
        // The square needs the minimum, which needs both sides: it is in neither.
        assert_eq!(region_of(&schedule, c), TOP);
        assert_eq!(region_of(&schedule, min), TOP);
    }

    #[test]
    fn a_choice_found_outside_the_region_that_enclosed_it_loses_its_bits() {
        let mut graph = Graph::new();
        let [a, b, c] = [1.0, 2.0, 3.0].map(|v| field(&mut graph, v));
        let inner = graph.min(a, b);
        let root = graph.max(inner, c);
        let bits = Bits::number(&Tape::new(&graph, &[root]));
        let lone = Tape::new(&graph, &[inner]);
        let regions = Regions::new(&lone, &bits, 2);
        assert!(lone.positions().all(|p| regions.of(p) == TOP));
    }

    #[test]
    fn a_dead_region_is_jumped_over_in_one_step() {
        let mut graph = Graph::new();
        let fields: Vec<NodeId> = (0..64).map(|i| field(&mut graph, f64::from(i))).collect();
        let mut row = fields;
        while row.len() > 1 {
            row = row.chunks(2).map(|pair| graph.min(pair[0], pair[1])).collect();
        }
        let (schedule, bits) = schedule(&graph, row[0]);
        assert_eq!(bits.len(), 2 * 63);
        let steps = schedule.steps(schedule.stage(brick::FLAT));
        let mut visited = 0;
        let mut at = 0;
        while at < steps.len() {
            visited += 1;
            at = if let Step::Enter { end, .. } = steps[at] { end } else { at + 1 };
        }
        // What all share, the two sides of the root, the root.
        assert_eq!(visited, 4);
    }

    #[test]
    fn a_left_deep_union_of_ten_thousand_is_analysed() {
        let mut graph = Graph::new();
        let mut root = field(&mut graph, 0.0);
        for i in 1..10_000 {
            let next = field(&mut graph, f64::from(i));
            root = graph.min(root, next);
        }
        let (schedule, bits) = schedule(&graph, root);
        assert_eq!(bits.len(), 2 * 9_999);
        assert!(!schedule.steps(schedule.stage(brick::FLAT)).is_empty());
    }
}
