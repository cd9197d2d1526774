//! The engine of huge expressions: what a box needs is cut out of the expression and interpreted.
//!
//! A union of ten thousand parts takes longer to compile, or to arrange for the interpreter, than to
//! evaluate: a block of it needs ten. Here nothing is arranged for the whole. A box comes with the
//! activity that intervals left it; a walk from the root meets the operations that are alive
//! ([`cut`]), which are enclosed ([`enclose`]) or laid out as steps ([`tape`]) and run over the
//! nodes of a block of eight a side ([`block`]) or over edges ([`edges`]). The eight blocks of a brick are
//! enclosed once more before they are sampled, each for itself, near zero alone: so the cost of a
//! brick is that of the parts near its surface.
//!
//! Results are those of the other engines to the bit: the same operators on the same operands, and
//! sides of extrema are left out by the same rules (`enclosing`, `interpret/chains`).
//!
//! It promises nothing about time where nothing can be left out; then it is an interpreter.

mod block;
mod choices;
mod code;
mod cut;
mod edges;
mod enclose;
mod tape;

use super::interpret::rows::View;
use super::interpret::{self, LANES};
use super::lower::Lowered;
use super::regions::Bits;
use super::sampler::{BRICK, BrickSigns, End, NodeBox, place_of};
use crate::expr::{Failure, Graph, Node, NodeId, Oracle};
use crate::geom::Axis;
use crate::num::Interval;
use block::{Blocks, SIDE};
use choices::{Choices, Memo, Near};
use code::{Code, Form};
use cut::{Cut, Cutter, Row};
use edges::{Group, Wanted};
use enclose::{Boxes, Enclosure, Rows, UNLIMITED};
use std::sync::Arc;

/// Operations that make it worth the while to look at each block of a brick for itself.
const WORTHWHILE: usize = 100;
/// Of the length of a brick's range, the part to both sides of zero that counts as near the
/// surface; see `enclosing`.
const NEAR: f64 = 0.125;

/// The ends of edges are looked for so many times farther from zero than they ever were. A closer
/// look costs less; one that was too close is taken again, which costs much, but happens only
/// where an edge is longer, or the field steeper, than anywhere before.
const FARTHER: f64 = 1.25;

/// A program that is cut down to what a box needs.
#[derive(Debug)]
pub(super) struct Pruned {
    code: Code,
}

/// A [`Pruned`] program bound to a grid and to values of the parameters.
#[derive(Debug)]
pub(super) struct BoundPruned {
    program: Arc<Pruned>,
    coordinates: [Vec<f64>; 3],
    /// By node: the value, if it is on no axis.
    uniforms: Result<Vec<f64>, Failure>,
    memo: Memo,
}

/// What is the same in all queries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared<'a> {
    code: &'a Code,
    uniforms: &'a [f64],
}

impl Shared<'_> {
    fn oracles(&self) -> &[Arc<dyn Oracle>] {
        self.code.graph().oracles()
    }
}

/// Memory of one thread that queries a [`BoundPruned`] program.
#[derive(Debug)]
pub struct PrunedWorkspace {
    cutter: Cutter,
    /// The present cut of the source form, and of another.
    source: Cut,
    other: Cut,
    enclosure: Enclosure,
    /// What matters in the present brick near the surface, by what is known of it.
    near: Choices,
    focus: Focus,
    /// What matters in the blocks of the present brick, far from the surface too.
    whole: Focus,
    /// The farthest from zero that ends of edges were so far.
    reach: f64,
    blocks: Blocks,
    /// The form and the row that `blocks` has taken whole.
    taken: Option<(Form, Vec<u64>)>,
    rows: Vec<u64>,
    /// By level: the box that was enclosed last on the way down to a brick, and its row.
    path: Vec<Option<([u32; 3], Vec<u64>)>>,
    batch: Batch,
}

/// What matters in the blocks of a brick, and the blocks' ranges.
#[derive(Debug)]
struct Focus {
    key: Option<([u32; 3], Nearness, Vec<u64>)>,
    cut: Whose,
    /// Values this far from zero are not what the expression is; infinite if all are.
    limit: f64,
    ranges: [Interval; LANES],
    choices: Choices,
}

/// What tells the sides of choices that matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Whose {
    /// The row of the brick.
    Row,
    /// What is known of the brick near the surface.
    Brick,
    /// Each block for itself.
    Block,
}

/// How near to zero the expression is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Nearness {
    /// Its sign alone.
    Sign,
    /// Its values next to the surface.
    Surface,
    /// Everywhere.
    Nowhere,
}

/// The present batch of edges.
#[derive(Debug)]
struct Batch {
    axis: Axis,
    brick: [u32; 3],
    nodes: Vec<u16>,
    row: Vec<u64>,
    /// The edges in each block of the brick, or all in the first.
    groups: [Group; LANES],
    /// What each group has taken: for an axis, in a brick or wherever a row is the same.
    taken: [Option<Taken>; LANES],
}

/// What the cut of a group was made for.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Taken {
    axis: Axis,
    /// Where it holds; none if wherever the row is the same.
    brick: Option<[u32; 3]>,
    row: Vec<u64>,
    is_whole: bool,
}

impl Pruned {
    /// The program of the expression `root`.
    pub(super) fn new(graph: &Graph, root: NodeId) -> Self {
        Self { code: Code::new(graph, root) }
    }

    /// The form that is sampled.
    pub(super) fn lowered(&self) -> &Lowered {
        &self.code.lowered
    }

    /// The activity bits of the form that is sampled.
    pub(super) fn bits(&self) -> Bits {
        self.code.bits()
    }

    /// Binds the program; see [`Program::bind`](super::Program::bind).
    pub(super) fn bind(
        self: &Arc<Self>,
        coordinates: [Vec<f64>; 3],
        parameters: &[f64],
    ) -> BoundPruned {
        let uniforms = self.uniforms(parameters);
        BoundPruned { program: Arc::clone(self), coordinates, uniforms, memo: Memo::default() }
    }

    fn uniforms(&self, parameters: &[f64]) -> Result<Vec<f64>, Failure> {
        let graph = self.code.graph();
        let mut made = Vec::new();
        let mut values: Vec<f64> = (graph.iter().zip(&self.code.axes))
            .map(|((id, node), axes)| match node {
                Node::Constant(bits) => f64::from_bits(bits),
                _ if axes.is_empty() => {
                    made.push(id);
                    f64::NAN
                }
                Node::Coordinate(_)
                | Node::Parameter(_)
                | Node::Unary(..)
                | Node::Binary(..)
                | Node::Pick(..)
                | Node::Oracle(..) => f64::NAN,
            })
            .collect();
        let mut results = vec![0.0; made.len()];
        let mut out: Vec<&mut [f64]> = results.chunks_mut(1).collect();
        interpret::points(graph, &made, [&[0.0]; 3], parameters, &mut out)?;
        for (id, result) in made.iter().zip(results) {
            values[id.index()] = result;
        }
        Ok(values)
    }
}

impl BoundPruned {
    fn shared(&self) -> Result<Shared<'_>, Failure> {
        let uniforms = self.uniforms.as_ref().map_err(Clone::clone)?;
        Ok(Shared { code: &self.program.code, uniforms })
    }

    pub(super) fn workspace(&self) -> PrunedWorkspace {
        let code = &self.program.code;
        let focus = || Focus {
            key: None,
            cut: Whose::Row,
            limit: f64::INFINITY,
            ranges: [Interval::ANYTHING; LANES],
            choices: Choices::new(code.count),
        };
        let batch = Batch {
            axis: Axis::X,
            brick: [0; 3],
            nodes: Vec::new(),
            row: Vec::new(),
            groups: Default::default(),
            taken: Default::default(),
        };
        PrunedWorkspace {
            cutter: Cutter::new(code),
            source: Cut::default(),
            other: Cut::default(),
            enclosure: Enclosure::default(),
            near: Choices::new(code.count),
            focus: focus(),
            whole: focus(),
            reach: 0.0,
            blocks: Blocks::default(),
            taken: None,
            rows: Vec::new(),
            path: Vec::new(),
            batch,
        }
    }

    pub(super) fn nodes(&self) -> [usize; 3] {
        self.coordinates.each_ref().map(Vec::len)
    }

    pub(super) fn activity_words(&self) -> usize {
        self.program.code.words()
    }

    /// The interval from node `first` along `axis` to the one so many further, or to the last.
    fn side(&self, axis: Axis, first: usize, nodes: usize) -> Interval {
        let table = &self.coordinates[axis.index()];
        let last = table.len() - 1;
        Interval::new(table[first.min(last)], table[(first + nodes).min(last)])
    }

    /// See [`Sampler::ranges`](super::Sampler::ranges).
    pub(super) fn ranges(
        &self,
        workspace: &mut PrunedWorkspace,
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let mut any = std::mem::take(&mut workspace.rows);
        let PrunedWorkspace { cutter, source, enclosure, .. } = workspace;
        let words = self.activity_words();
        let mut own = activity.chunks_exact(words.max(1));
        let first = own.next().unwrap_or_default();
        any.clear();
        any.extend_from_slice(first);
        let mut is_one = true;
        for row in own {
            is_one &= row == first;
            any.iter_mut().zip(row).for_each(|(any, own)| *any |= own);
        }
        cutter.cut(shared.code, Form::Source, &[shared.code.source], &Row(&any), source);
        let mut sides = [[Interval::ANYTHING; LANES]; 3];
        for (axis, sides) in Axis::ALL.into_iter().zip(&mut sides) {
            for (side, node) in sides.iter_mut().zip(boxes) {
                let nodes = BRICK << node.level;
                *side = self.side(axis, node.index[axis.index()] as usize * nodes, nodes);
            }
        }
        let count = boxes.len();
        let rows = if is_one { Rows::One } else { Rows::Own(activity, words) };
        let around = Boxes { count, sides };
        let output = enclosure.enclose(shared, (source, cutter), &around, rows);
        for (lane, range) in ranges.iter_mut().take(count).enumerate() {
            *range = output.lane(lane);
        }
        any.clear();
        any.resize(words * count, 0);
        let mut set = |lane: usize, bit: u32| {
            any[lane * words + bit as usize / 64] |= 1 << (bit % 64);
        };
        enclosure.decide(shared, source, (count, rows), &UNLIMITED, |choice, alive| {
            for (alive, side) in alive.into_iter().zip(0..) {
                let lanes = (0..count).filter(|lane| alive >> lane & 1 == 1);
                lanes.for_each(|lane| set(lane, 2 * choice + side));
            }
        });
        if is_one && source.open > 0 && boxes.iter().all(|node| node.level == 0) {
            self.remember(workspace, shared, boxes, ranges);
        }
        activity[..words * count].copy_from_slice(&any);
        workspace.rows = any;
        Ok(())
    }

    /// Keeps what matters near the surface in each brick of `boxes` that is not settled; all were
    /// just enclosed.
    fn remember(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        boxes: &[NodeBox],
        ranges: &[Interval],
    ) {
        let PrunedWorkspace { source, enclosure, .. } = workspace;
        let limits = std::array::from_fn(|lane| ranges.get(lane).map_or(0.0, near));
        let mut found: [Vec<(u32, u8)>; LANES] = Default::default();
        let count = boxes.len();
        enclosure.decide(shared, source, (count, Rows::One), &limits, |choice, alive| {
            for (lane, found) in found.iter_mut().enumerate().take(count) {
                let sides = alive[0] >> lane & 1 | (alive[1] >> lane & 1) << 1;
                if sides != 0 {
                    found.push((choice, sides));
                }
            }
        });
        for (((node, range), limit), list) in boxes.iter().zip(ranges).zip(limits).zip(found) {
            let is_open = range.nan || !(range.is_inside() || range.is_outside());
            if is_open && limit > 0.0 {
                self.memo.insert(node.index, Near { limit, sides: list.into_boxed_slice() });
            }
        }
    }

    /// Looks at the blocks of `brick`, whose row is `row`: see [`Focus`].
    fn focus(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        brick: [u32; 3],
        row: &[u64],
        nearness: Nearness,
    ) {
        let PrunedWorkspace {
            cutter, source, enclosure, near: of_brick, focus, whole, reach, ..
        } = workspace;
        let focus = if nearness == Nearness::Nowhere { whole } else { focus };
        let is_known = matches!(&focus.key, Some((at, near, from))
            if *at == brick && *near == nearness && from == row);
        if is_known {
            return;
        }
        focus.key = Some((brick, nearness, row.to_vec()));
        let is_everything = row.iter().all(|word| *word == u64::MAX);
        let is_near = nearness != Nearness::Nowhere && !is_everything;
        let known = is_near.then(|| self.memo.get(brick)).flatten();
        let outputs = [shared.code.source];
        match &known {
            Some(known) => {
                of_brick.load(&known.sides);
                cutter.cut(shared.code, Form::Source, &outputs, &of_brick.within(0), source);
            }
            None => cutter.cut(shared.code, Form::Source, &outputs, &Row(row), source),
        }
        focus.cut = if known.is_some() { Whose::Brick } else { Whose::Row };
        focus.limit = known.as_ref().map_or(f64::INFINITY, |known| known.limit);
        if source.open == 0 || source.items.len() < WORTHWHILE {
            return;
        }
        focus.cut = Whose::Block;
        let mut boxes = Boxes { count: LANES, sides: [[Interval::ANYTHING; LANES]; 3] };
        for (axis, sides) in Axis::ALL.into_iter().zip(&mut boxes.sides) {
            for (block, side) in sides.iter_mut().enumerate() {
                let half = block >> axis.index() & 1;
                let first = brick[axis.index()] as usize * BRICK + half * SIDE;
                *side = self.side(axis, first, SIDE);
            }
        }
        let range = enclosure.enclose(shared, (source, cutter), &boxes, Rows::One);
        focus.ranges = std::array::from_fn(|block| range.lane(block));
        let limit = match nearness {
            Nearness::Sign => f64::MIN_POSITIVE,
            Nearness::Surface => {
                let brick = || focus.ranges.into_iter().fold(focus.ranges[0], Interval::hull);
                let limit = if known.is_some() { focus.limit } else { near(&brick()) };
                if *reach > 0.0 { limit.min(FARTHER * *reach) } else { limit }
            }
            Nearness::Nowhere => 0.0,
        };
        focus.limit = if limit > 0.0 { limit } else { f64::INFINITY };
        let choices = &mut focus.choices;
        choices.clear();
        let limits = [limit; LANES];
        enclosure.decide(shared, source, (LANES, Rows::One), &limits, |choice, sides| {
            choices.add(choice, sides);
        });
    }

    /// The coordinates of block `block` of `brick`.
    fn block_at(&self, brick: [u32; 3], block: usize) -> Option<[&[f64; SIDE]; 3]> {
        let along = |axis: usize| {
            let first = brick[axis] as usize * BRICK + (block >> axis & 1) * SIDE;
            self.coordinates[axis].get(first..)?.first_chunk::<SIDE>()
        };
        Some([along(0)?, along(1)?, along(2)?])
    }

    /// Samples the blocks of `brick` with the cut of `form` that `row` leaves.
    fn sample_whole(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        brick: [u32; 3],
        (form, root, row): (Form, NodeId, &[u64]),
        mut receive: impl FnMut(usize, View<'_>),
    ) -> Result<(), Failure> {
        let PrunedWorkspace { cutter, other, blocks, taken, .. } = workspace;
        if !matches!(taken, Some((own, from)) if *own == form && from == row) {
            cutter.cut(shared.code, form, &[root], &Row(row), other);
            blocks.take(shared, other);
            *taken = Some((form, row.to_vec()));
        }
        for block in 0..LANES {
            if let Some(at) = self.block_at(brick, block) {
                blocks.sample(shared.oracles(), at, |view| receive(block, view))?;
            }
        }
        Ok(())
    }

    /// See [`Sampler::signs`](super::Sampler::signs).
    pub(super) fn signs(
        &self,
        workspace: &mut PrunedWorkspace,
        brick: [u32; 3],
        row: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let root = shared.code.sign;
        self.focus(workspace, shared, brick, row, Nearness::Sign);
        if workspace.focus.cut == Whose::Row {
            let of = (Form::Sign, root, row);
            return self.sample_whole(workspace, shared, brick, of, |block, view| {
                pack(block, view, signs);
            });
        }
        let PrunedWorkspace { cutter, other, blocks, taken, near, focus, .. } = workspace;
        *taken = None;
        for block in 0..LANES {
            if focus.cut == Whose::Block {
                let range = focus.ranges[block];
                if range.is_inside() || range.is_outside() && !range.nan {
                    fill(block, range.is_inside(), signs);
                    continue;
                }
                let guide = focus.choices.within(block);
                cutter.cut(shared.code, Form::Sign, &[root], &guide, other);
                blocks.take(shared, other);
            } else if block == 0 {
                cutter.cut(shared.code, Form::Sign, &[root], &near.within(0), other);
                blocks.take(shared, other);
            }
            if let Some(at) = self.block_at(brick, block) {
                blocks.sample(shared.oracles(), at, |view| pack(block, view, signs))?;
            }
        }
        Ok(())
    }

    /// See [`Sampler::values`](super::Sampler::values).
    pub(super) fn values(
        &self,
        workspace: &mut PrunedWorkspace,
        brick: [u32; 3],
        row: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let of = (Form::Sampled, shared.code.lowered.root, row);
        self.sample_whole(workspace, shared, brick, of, |block, view| {
            let mut own = [0.0; block::FULL];
            view.copy_rows_to::<{ SIDE * SIDE }>(&mut own);
            for (line, from) in own.as_chunks::<SIDE>().0.iter().enumerate() {
                values[BRICK * row_of(block, line) + SIDE * (block & 1)..][..SIDE]
                    .copy_from_slice(from);
            }
        })
    }

    /// The row that intervals leave `brick`, found from the whole grid down.
    fn descend(
        &self,
        workspace: &mut PrunedWorkspace,
        brick: [u32; 3],
    ) -> Result<Vec<u64>, Failure> {
        let bricks = self.nodes().map(|nodes| (nodes - 1) / BRICK);
        let top = bricks.iter().map(|n| n.next_power_of_two().ilog2()).max().unwrap_or(0);
        let mut row = vec![u64::MAX; self.activity_words()];
        workspace.path.resize(top as usize + 1, None);
        for level in (0..=top as u8).rev() {
            let index = brick.map(|b| b >> level);
            match &workspace.path[usize::from(level)] {
                Some((known, own)) if *known == index => row.clone_from(own),
                _ => {
                    let boxes = [NodeBox { level, index }];
                    let mut range = [Interval::ANYTHING];
                    self.ranges(workspace, &boxes, &mut row, &mut range)?;
                    workspace.path[usize::from(level)] = Some((index, row.clone()));
                    workspace.path[..usize::from(level)].fill(None);
                }
            }
        }
        Ok(row)
    }

    /// See [`Sampler::line_begin`](super::Sampler::line_begin).
    pub(super) fn line_begin(
        &self,
        workspace: &mut PrunedWorkspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        row: &[u64],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let everything = !row.is_empty() && row.iter().all(|word| *word == u64::MAX);
        let found;
        let row = if everything {
            // Edges of outer planes come without a row: see `contour::place`.
            found = self.descend(workspace, brick)?;
            &found[..]
        } else {
            row
        };
        self.focus(workspace, shared, brick, row, Nearness::Surface);
        let is_apart = workspace.focus.cut == Whose::Block;
        let Batch { groups, nodes: own, row: own_row, axis: own_axis, brick: own_brick, .. } =
            &mut workspace.batch;
        (*own_axis, *own_brick) = (axis, brick);
        own.clear();
        own.extend_from_slice(nodes);
        own_row.clear();
        own_row.extend_from_slice(row);
        groups.iter_mut().for_each(|group| group.edges.clear());
        for (edge, &node) in (0..).zip(nodes) {
            let [x, y, z] = place_of(node).map(|place| usize::from(place >= SIDE));
            let block = if is_apart { x | y << 1 | z << 2 } else { 0 };
            groups[block].edges.push(edge);
        }
        for block in 0..LANES {
            if !workspace.batch.groups[block].edges.is_empty() {
                self.ready(workspace, shared, block, false)?;
            }
        }
        Ok(())
    }

    /// Readies the group of block `block`, with what matters near the surface or with the `whole`.
    fn ready(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        block: usize,
        is_whole: bool,
    ) -> Result<(), Failure> {
        let PrunedWorkspace { cutter, other, near, focus, whole, batch, .. } = workspace;
        let focus = if is_whole { whole } else { focus };
        let Batch { axis, brick, nodes, row, groups, taken } = batch;
        let (group, taken) = (&mut groups[block], &mut taken[block]);
        let brick_of = (focus.cut != Whose::Row).then_some(*brick);
        let is_taken = matches!(taken, Some(own) if own.axis == *axis
            && own.brick == brick_of && own.row == *row && own.is_whole == is_whole);
        if !is_taken {
            let outputs = [shared.code.lowered.root, shared.code.slopes[axis.index()]];
            let (code, form) = (shared.code, Form::Sampled);
            match focus.cut {
                Whose::Row => cutter.cut(code, form, &outputs, &Row(row), other),
                Whose::Brick => cutter.cut(code, form, &outputs, &near.within(0), other),
                Whose::Block => {
                    cutter.cut(code, form, &outputs, &focus.choices.within(block), other);
                }
            }
            group.take(shared, other, *axis);
            group.limit = focus.limit;
            *taken = Some(Taken { axis: *axis, brick: brick_of, row: row.clone(), is_whole });
        }
        let places = group.edges.iter().map(|edge| place_of(nodes[usize::from(*edge)]));
        // The grid's last node begins a brick of its own, which ghosts may lie in.
        let along: [[f64; edges::NODES]; 3] = std::array::from_fn(|a| {
            let (table, first) = (&self.coordinates[a], brick[a] as usize * BRICK);
            std::array::from_fn(|node| table[(first + node).min(table.len() - 1)])
        });
        // Collected, because the group is changed by what is made from its own edges.
        let places: Vec<[usize; 3]> = places.collect();
        for other in Axis::ALL.into_iter().filter(|other| other != axis) {
            let a = other.index();
            group.locate(other, places.iter().map(|place| along[a][place[a]]));
        }
        group.place(shared.oracles(), *brick, &along, places.iter().copied())?;
        group.begin(shared.oracles())
    }

    /// Asks the groups for values and slopes where they are `wanted`, at the coordinates `at`.
    fn evaluate(
        &self,
        workspace: &mut PrunedWorkspace,
        at: &[f64],
        wanted: Wanted,
        mut out: [&mut [f64]; 2],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        for block in 0..LANES {
            loop {
                let Batch { axis, groups, .. } = &mut workspace.batch;
                let group = &mut groups[block];
                if group.edges.is_empty() {
                    break;
                }
                group.locate_along(*axis, at);
                group.evaluate(shared.oracles(), wanted)?;
                let mut is_trusted = true;
                for (number, out) in out.iter_mut().enumerate() {
                    let is_within = group.deliver(number, out);
                    is_trusted &= is_within || number > 0;
                }
                if is_trusted {
                    break;
                }
                // Once more with what matters far from the surface too.
                let (brick, row) = (workspace.batch.brick, workspace.batch.row.clone());
                self.focus(workspace, shared, brick, &row, Nearness::Nowhere);
                self.ready(workspace, shared, block, true)?;
            }
        }
        Ok(())
    }

    /// See [`Sampler::line_ends`](super::Sampler::line_ends).
    pub(super) fn line_ends(
        &self,
        workspace: &mut PrunedWorkspace,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        let ahead = usize::from(end == End::Upper);
        // Where the value is a coordinate, that is read at the nodes.
        let Batch { axis, brick, nodes, .. } = &workspace.batch;
        let (a, first) = (axis.index(), brick[axis.index()] as usize * BRICK);
        let table = &self.coordinates[a];
        let at: Vec<f64> =
            nodes.iter().map(|node| table[first + place_of(*node)[a] + ahead]).collect();
        self.evaluate(workspace, &at, Wanted::End(ahead), [&mut *values, slopes])?;
        let far = values.iter().map(|value| value.abs()).filter(|value| value.is_finite());
        workspace.reach = far.fold(workspace.reach, f64::max);
        Ok(())
    }

    /// See [`Sampler::line`](super::Sampler::line).
    pub(super) fn line(
        &self,
        workspace: &mut PrunedWorkspace,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        self.evaluate(workspace, at, Wanted::Between, [values, slopes])
    }
}

/// How near to zero a box whose range is `range` is looked at for its surface; zero if not at all.
fn near(range: &Interval) -> f64 {
    let limit = (range.hi - range.lo) * NEAR;
    if limit.is_finite() && limit > 0.0 { limit } else { 0.0 }
}

/// The row of a brick in which line `line` of block `block` lies.
const fn row_of(block: usize, line: usize) -> usize {
    let (y, z) = (line % SIDE + SIDE * (block >> 1 & 1), line / SIDE + SIDE * (block >> 2 & 1));
    z * BRICK + y
}

/// Sets all signs of a block.
fn fill(block: usize, inside: bool, signs: &mut BrickSigns) {
    for line in 0..SIDE * SIDE {
        put(block, line, if inside { u8::MAX } else { 0 }, signs);
    }
}

/// Sets the signs of a block from its values.
fn pack(block: usize, view: View<'_>, signs: &mut BrickSigns) {
    let bits = |values: &[f64]| {
        values.iter().zip(0..).fold(0, |word, (value, x)| word | u8::from(*value < 0.0) << x)
    };
    for line in 0..SIDE * SIDE {
        let (y, z) = (line % SIDE, line / SIDE);
        let word = match view {
            View::Rows { values, stride } => bits(&values[z * stride + y * SIDE..][..SIDE]),
            View::Splat { values, stride } => {
                if values[z * stride] < 0.0 {
                    u8::MAX
                } else {
                    0
                }
            }
        };
        put(block, line, word, signs);
    }
}

fn put(block: usize, line: usize, word: u8, signs: &mut BrickSigns) {
    let own = &mut signs[row_of(block, line)];
    let shift = SIDE * (block & 1);
    *own = *own & !(0xff << shift) | u16::from(word) << shift;
}
