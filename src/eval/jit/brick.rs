//! Programs over bricks: the signs or the values of 16 x 16 x 16 samples.
//!
//! Values on two axes are computed once a brick, 256 of them; then, plane by plane, those on all
//! axes, row by row. So calls of precompiled code for values on two axes are one a brick. The
//! results of the last loop are packed into signs in registers. Where the whole expression is an
//! extremum of which a brick needs one side only, that side's last loop packs the signs.

use super::action::{Action, Emit, Fill, Run, actions};
use super::assembly::Assembly;
use super::body::{Body, Index};
use super::call::{Arguments, Code};
use super::calls::{Call, Levels, Operand, PLANE, ROW, Sense, Source, Spread};
use super::flow::{self, Flow, Item, Kind};
use super::layout::{self, Home, Users};
use super::ops::Signs;
use super::segment::{Access, LANES, Lanes};
use super::tiles::STRIDE;
use super::volume::{self, SAMPLES, Volume};
use super::window::{VECTORS, Window, across, is_edge};
use super::{CompileError, check_size};
use crate::eval::BRICK;
use crate::eval::compared::{self, Level};
use crate::eval::leaves::Leaves;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position};
use crate::expr::{AxisSet, Failure};
use crate::geom::Axis;
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::Range;

/// What a program over bricks returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Yield {
    /// A bit a sample.
    Signs,
    /// A number a sample.
    Values,
}

/// A compiled program over bricks.
#[derive(Debug)]
pub(super) struct Brick {
    pub(super) code: Code,
    volumes: Vec<Volume>,
    across: Vec<Action>,
    edges: Vec<Action>,
    planes: Vec<Action>,
    /// Numbers of scratch memory.
    pub(super) scratch: usize,
}

impl Brick {
    /// Compiles the program of `schedule`, whose tape has one output.
    pub(super) fn compile(
        schedule: &Schedule,
        leaves: &Leaves,
        yields: Yield,
    ) -> Result<Self, CompileError> {
        let mut assembly = Assembly::new()?;
        let plan = Plan::new(schedule, leaves, yields);
        check_size(plan.scratch)?;
        let mut part =
            Part { plan: &plan, assembly: &mut assembly, flow: &plan.across, steps: Steps::Once };
        let across = actions(&plan.across, &mut part, false)?;
        let mut part = Part { flow: &plan.edges, steps: Steps::Planes, ..part };
        let edges = actions(&plan.edges, &mut part, false)?;
        let mut part = Part { flow: &plan.planes, steps: Steps::Results, ..part };
        let planes = actions(&plan.planes, &mut part, true)?;
        let (volumes, scratch) = (plan.volumes, plan.scratch);
        Ok(Self { code: assembly.finish()?, volumes, across, edges, planes, scratch })
    }

    /// Runs the program.
    pub(super) fn run(
        &self,
        run: &mut Run<'_>,
        arguments: &mut Arguments<'_>,
    ) -> Result<(), Failure> {
        for volume in &self.volumes {
            volume.run(arguments, run.staging, run.oracles)?;
        }
        run.actions(&self.across, arguments, 0..1)?;
        run.actions(&self.edges, arguments, 0..BRICK)?;
        if let [Action::Code(number)] = self.planes[..] {
            run.code.call(number, arguments, 0..BRICK);
            return Ok(());
        }
        (0..BRICK).try_for_each(|plane| run.actions(&self.planes, arguments, plane..plane + 1))
    }
}

/// What the generation of code needs to know of a program.
struct Plan<'a> {
    schedule: &'a Schedule,
    users: Users,
    homes: Vec<Home>,
    /// Values on x and y; on z and one other axis; on all three.
    across: Flow,
    edges: Flow,
    planes: Flow,
    volumes: Vec<Volume>,
    root: Position,
    yields: Yield,
    scratch: usize,
    /// Whether each side of the outermost extrema is compiled for itself.
    specialised: bool,
    /// Vectors that a short loop computes at once if it is not.
    vectors: usize,
    /// Extrema that are nothing to do where their first side is dead, with the second operand, in
    /// whose buffer they are computed.
    heirs: FxHashMap<Position, Position>,
    /// Operands of those: nobody looks at them where they are dead.
    unseen: FxHashSet<Position>,
    /// What is compared with levels, if signs are all that is wanted.
    compared: Vec<Option<Vec<Level>>>,
}

/// Operations on all axes up to which a program is compiled for each side of its outermost extrema.
const SPECIALISED: usize = 48;
/// Operations up to which the short loops of a program that is not are unrolled further.
const UNROLLED: usize = 1024;
/// Depth to which extrema are followed for that.
const DEPTH: usize = 3;
/// Operations up to which a loop computes the vectors of a whole row at once.
const ROW_AT_ONCE: usize = 32;

impl<'a> Plan<'a> {
    fn new(schedule: &'a Schedule, leaves: &Leaves, yields: Yield) -> Self {
        let tape = schedule.tape();
        let users = Users::new(tape);
        let volumes = volume::volumes(schedule, &users);
        let kind = |p| {
            if flow::is_call(tape.op(p)) { Kind::Call } else { Kind::Loop(tape.axes(p)) }
        };
        let flow = |belongs: &dyn Fn(AxisSet) -> bool| {
            let chosen = tape.positions().filter(|p| belongs(tape.axes(*p)));
            let computed = chosen.filter(|p| volumes.binary_search(p).is_err());
            Flow::new(schedule, computed, kind, &FxHashSet::default())
        };
        let across_flow = flow(&|axes| axes == across());
        let edges = flow(&is_edge);
        let planes = flow(&|axes| axes == AxisSet::ALL);
        let operations = edges.ops(0..edges.items.len()) + planes.ops(0..planes.items.len());
        let mut plan = Self {
            specialised: operations <= SPECIALISED,
            vectors: if operations <= UNROLLED { VECTORS / 2 } else { VECTORS / 4 },
            schedule,
            users,
            homes: vec![Home::Register; tape.len()],
            across: across_flow,
            edges,
            planes,
            volumes: Vec::new(),
            root: tape.outputs()[0],
            yields,
            scratch: 0,
            heirs: FxHashMap::default(),
            unseen: FxHashSet::default(),
            compared: match yields {
                Yield::Signs => compared::levels(tape),
                Yield::Values => vec![None; tape.len()],
            },
        };
        if !plan.specialised {
            plan.find_heirs();
        }
        plan.house(leaves);
        plan.add_volumes(&volumes);
        plan
    }

    /// Finds the extrema that need not be computed where a side is dead.
    ///
    /// In a large union most sides are dead, and what is left of the tree above a live part is a
    /// chain of extrema that pass one value on.
    fn find_heirs(&mut self) {
        let (tape, regions) = (self.schedule.tape(), self.schedule.regions());
        for item in &self.planes.items {
            let Item::Segment(segment) = item else { continue };
            let ([p], Some(_)) =
                (&segment.ops[..], segment.ops.first().and_then(|p| regions.sides(*p)))
            else {
                continue;
            };
            let Op::Binary(_, a, b) = tape.op(*p) else { continue };
            let is_own = |o: Position| {
                tape.axes(o) == AxisSet::ALL
                    && !matches!(tape.op(o), Op::Oracle(..))
                    && self.users.of(o).iter().all(|user| user == p)
            };
            if *p != self.root && a != b && is_own(a) && is_own(b) {
                self.heirs.insert(*p, b);
                self.unseen.extend([a, b]);
            }
        }
    }

    /// Gives every value its home.
    fn house(&mut self, leaves: &Leaves) {
        let tape = self.schedule.tape();
        let is_computed = |p: Position| tape.axes(p).len() >= 2;
        let operands = tape.positions().filter(|p| is_computed(*p));
        let operands = operands.flat_map(|p| tape.op(p).operands().to_vec());
        for p in operands.chain([self.root]).filter(|p| !is_computed(*p)) {
            self.homes[p.index()] =
                layout::leaf(self.schedule, leaves, p).unwrap_or(Home::Register);
        }
        let flows = [&self.across, &self.edges, &self.planes];
        let kept = layout::kept(tape, &self.users, &flows, &[self.root]);
        let on = |axes: &dyn Fn(AxisSet) -> bool| {
            let chosen = kept.iter().filter(|k| axes(tape.axes(k.position)));
            chosen.copied().collect::<Vec<_>>()
        };
        let homes = &mut self.homes;
        let flat = on(&|axes| axes.len() == 2);
        let all = on(&|axes| axes == AxisSet::ALL);
        let end = layout::place(&flat, homes, 0, PLANE, false, &FxHashMap::default());
        self.scratch = layout::place(&all, homes, end, PLANE, !self.specialised, &self.heirs);
    }

    /// Adds the oracles that are asked once a brick.
    fn add_volumes(&mut self, positions: &[Position]) {
        let (tape, regions) = (self.schedule.tape(), self.schedule.regions());
        let losers = flow::losers(self.schedule);
        for &p in positions {
            let Op::Oracle(oracle, _, operands) = tape.op(p) else { continue };
            let mut bits = Vec::new();
            let mut region = regions.of(p);
            while let Some(bit) = regions.bit(region) {
                bits.push(bit);
                region = regions.parent(region);
            }
            bits.reverse();
            let first = self.scratch;
            self.scratch += SAMPLES;
            self.homes[p.index()] = Home::Volume(first);
            self.volumes.push(Volume {
                oracle: oracle.index(),
                at: operands.map(|o| self.source(o, AxisSet::EMPTY)),
                first,
                bits,
                loser: losers.get(&p).map(|(_, loser)| *loser),
                levels: self.levels(p),
            });
        }
    }

    /// What the value at `p` is compared with, if it is not used otherwise.
    fn levels(&self, p: Position) -> Option<Levels> {
        let number = |level: &Level| match *level {
            Level::Zero => (Source::Constant(0.0), Sense::Own),
            Level::Of(p) => (self.source(p, AxisSet::EMPTY), Sense::Own),
            Level::Opposite(p) => (self.source(p, AxisSet::EMPTY), Sense::Opposite),
        };
        let levels = self.compared[p.index()].as_ref()?;
        Some(Levels(levels.iter().map(number).collect()))
    }

    /// Where a call at rate `rate` finds the numbers of an operand: those of one plane if the rate
    /// is all axes, else those of the brick.
    fn source(&self, p: Position, rate: AxisSet) -> Source {
        let of_plane = rate == AxisSet::ALL;
        let is_edge = is_edge(self.schedule.tape().axes(p));
        match self.homes[p.index()] {
            Home::Register => unreachable!("an operand of a call has a home"),
            Home::Constant(value) => Source::Constant(value),
            Home::Uniform(number) => Source::Uniform(number),
            Home::Table(axis, number) => Source::Table {
                axis,
                first: number * STRIDE,
                per_plane: of_plane && axis == Axis::Z,
            },
            Home::Buffer(first) if of_plane && is_edge => Source::Scratch { first, plane: ROW },
            Home::Buffer(first) => Source::Scratch { first, plane: 0 },
            Home::Volume(first) => Source::Scratch { first, plane: PLANE },
        }
    }

    /// An operand of a call at rate `rate`, whose lanes are rows: along x if that is among the
    /// rate's axes, else along y; one for each number along y, or along z if there is no other.
    fn operand(&self, p: Position, rate: AxisSet) -> Operand {
        let axes = self.schedule.tape().axes(p);
        let (along, across) = match (rate.contains(Axis::X), rate.contains(Axis::Y)) {
            (true, true) => (Axis::X, Axis::Y),
            (true, false) => (Axis::X, Axis::Z),
            (false, _) => (Axis::Y, Axis::Z),
        };
        let spread = match (axes.contains(along), axes.contains(across)) {
            (true, true) => Spread::Lanes,
            (true, false) => Spread::Rows,
            (false, true) => Spread::Columns,
            (false, false) => Spread::One,
        };
        Operand { source: self.source(p, rate), spread }
    }

    /// Emits the items in `items`, results going to memory.
    fn items(&self, body: &mut Body<'_>, flow: &Flow, items: Range<usize>, plane: Option<Index>) {
        flow::walk(
            body,
            flow,
            items,
            &mut |body, segment| match segment.ops[..] {
                [p] if self.heirs.contains_key(&p) => self.heir(body, p, plane),
                _ => self.segment(body, &segment.ops, segment.rate, plane, None),
            },
            &mut |body, p, value| self.fill(body, p, value, plane),
        );
    }

    /// Emits the extremum at `p`, which lies where its second operand lies.
    fn heir(&self, body: &mut Body<'_>, p: Position, plane: Option<Index>) {
        let regions = self.schedule.regions();
        let sides = regions.sides(p).unwrap_or_default();
        let [first, second] = sides.map(|side| side.and_then(|region| regions.bit(region)));
        let first = first.map(|bit| body.if_live(bit));
        let second = second.map(|bit| body.if_live(bit));
        self.segment(body, &[p], AxisSet::ALL, plane, None);
        if let Some(branch) = second {
            body.if_dead(&branch);
            self.copy_first(body, p, plane);
            body.end_if(branch);
        }
        if let Some(branch) = first {
            body.if_dead(&branch);
            body.end_if(branch);
        }
    }

    /// Copies the first operand of `p` to where `p` lies.
    fn copy_first(&self, body: &mut Body<'_>, p: Position, plane: Option<Index>) {
        let first = self.schedule.tape().op(p).operands()[0];
        let window = Window::new(body, plane);
        body.repeat(ROW, |body, row| {
            let window = window.in_row(body, row);
            let [from, to] = [first, p].map(|p| self.access(&window, p, AxisSet::ALL));
            if let (Access::Lanes(from, a), Access::Lanes(to, b)) = (from, to) {
                for v in 0..VECTORS {
                    let lanes = body.load(from, a + v * LANES);
                    body.store(lanes, to, b + v * LANES);
                }
            }
        });
    }

    /// Fills the buffer of `p`.
    fn fill(&self, body: &mut Body<'_>, p: Position, value: f64, plane: Option<Index>) {
        if self.unseen.contains(&p) {
            return;
        }
        let axes = self.schedule.tape().axes(p);
        let window = Window::new(body, plane);
        let lanes = super::ops::constant(&mut body.builder, value);
        let write = |body: &mut Body<'_>, window: Window| {
            if let Some(Access::Lanes(pointer, first)) =
                window.access(self.homes[p.index()], axes, axes)
            {
                (0..VECTORS).for_each(|v| body.store(lanes, pointer, first + v * LANES));
            }
        };
        if is_edge(axes) {
            write(body, window);
        } else {
            body.repeat(ROW, |body, row| {
                let window = window.in_row(body, row);
                write(body, window);
            });
        }
    }

    /// Emits a loop over `ops` whose results go to memory where they are used outside of it, and
    /// `also` in any case.
    fn segment(
        &self,
        body: &mut Body<'_>,
        ops: &[Position],
        rate: AxisSet,
        plane: Option<Index>,
        also: Option<Position>,
    ) {
        let tape = self.schedule.tape();
        let mut stored = self.used_outside(ops);
        stored.extend(also.filter(|p| !stored.contains(p)));
        let window = Window::new(body, plane);
        let vectors = match ops.len() {
            1 => VECTORS,
            0..=4 if self.specialised => VECTORS,
            0..=4 => self.vectors,
            _ if !self.specialised => 1,
            5..=8 => VECTORS / 2,
            9..=24 => VECTORS / 4,
            _ => 1,
        };
        let inside = |body: &mut Body<'_>, window: Window| {
            let access = |p| self.access(&window, p, rate);
            let mut lanes = Lanes::new(body, tape, ops, None, &access);
            let mut each = |body: &mut Body<'_>, window: Window, vector: usize| {
                let access = |p| self.access(&window, p, rate);
                lanes.compute(body, vector, &access);
                for &p in &stored {
                    let value = lanes.value(body, p, vector, &access);
                    if let Access::Lanes(pointer, first) = access(p) {
                        body.store(value, pointer, first + vector * LANES);
                    }
                }
            };
            if vectors == VECTORS {
                (0..VECTORS).for_each(|vector| each(body, window, vector));
            } else {
                body.repeat(VECTORS / vectors, |body, group| {
                    let window = window.in_group(body, rate, group, vectors);
                    (0..vectors).for_each(|vector| each(body, window, vector));
                });
            }
        };
        if across().is_subset(rate) {
            body.repeat(ROW, |body, row| {
                let window = window.in_row(body, row);
                inside(body, window);
            });
        } else {
            inside(body, window);
        }
    }

    /// Where a loop at rate `rate` finds the value at `p`.
    fn access(&self, window: &Window, p: Position, rate: AxisSet) -> Access {
        let axes = self.schedule.tape().axes(p);
        let home = self.homes[p.index()];
        window.access(home, axes, rate).expect("a value used by several loops has a home")
    }

    /// The operations among `ops` that others use.
    fn used_outside(&self, ops: &[Position]) -> Vec<Position> {
        let own: FxHashSet<Position> = ops.iter().copied().collect();
        let is_used = |p: &Position| {
            *p == self.root || self.users.of(*p).iter().any(|user| !own.contains(user))
        };
        ops.iter().copied().filter(is_used).collect()
    }

    /// Emits a loop over `ops` and yields the value at `value`.
    fn last(&self, body: &mut Body<'_>, ops: &[Position], value: Position, plane: Index) {
        if ops.len() > ROW_AT_ONCE {
            self.segment(body, ops, AxisSet::ALL, Some(plane), Some(value));
            return self.last(body, &[], value, plane);
        }
        let tape = self.schedule.tape();
        let window = Window::new(body, Some(plane));
        let mut stored = self.used_outside(ops);
        stored.retain(|p| *p != value);
        body.repeat(ROW, |body, row| {
            let window = window.in_row(body, row);
            let access = |p| self.access(&window, p, AxisSet::ALL);
            let mut lanes = Lanes::new(body, tape, ops, Some(value), &access);
            let mut signs = Signs::default();
            for vector in 0..VECTORS {
                lanes.compute(body, vector, &access);
                for &p in &stored {
                    let value = lanes.value(body, p, vector, &access);
                    if let Access::Lanes(pointer, first) = access(p) {
                        body.store(value, pointer, first + vector * LANES);
                    }
                }
                let result = lanes.value(body, value, vector, &access);
                match self.yields {
                    Yield::Signs => signs.push(&mut body.builder, result),
                    Yield::Values => body.store(result, window.values, vector * LANES),
                }
            }
            if self.yields == Yield::Signs {
                body.store_signs(signs, window.signs);
            }
        });
    }

    /// Emits the items in `list`, each with all that belongs to it, and yields the value at
    /// `value`, which the last of them may compute.
    fn conclude(
        &self,
        body: &mut Body<'_>,
        list: &[usize],
        value: Position,
        plane: Index,
        depth: usize,
    ) {
        let flow = &self.planes;
        let emit = |body: &mut Body<'_>, list: &[usize]| {
            for &item in list {
                self.items(body, flow, item..flow.after(item), Some(plane));
            }
        };
        let (before, last) = match list.split_last() {
            Some((&item, before)) => match &flow.items[item] {
                Item::Segment(segment)
                    if segment.rate == AxisSet::ALL && segment.ops.contains(&value) =>
                {
                    (before, &segment.ops[..])
                }
                Item::Segment(_) | Item::Enter { .. } | Item::Call(_) => (list, &[][..]),
            },
            None => (list, &[][..]),
        };
        let sides = (self.specialised && depth < DEPTH && last == [value])
            .then(|| self.sides(before, value))
            .flatten();
        let Some(Sides { operands, bits, blocks }) = sides else {
            emit(body, before);
            return self.last(body, last, value, plane);
        };
        let common: Vec<usize> =
            before.iter().copied().filter(|item| !blocks.contains(&Some(*item))).collect();
        emit(body, &common);
        let content = |side: usize| blocks[side].map_or(Vec::new(), |item| self.content(item));
        let first = bits[0].map(|bit| body.if_live(bit));
        let second = bits[1].map(|bit| body.if_live(bit));
        let both: Vec<usize> = [content(0), content(1)].concat();
        // Without regions inside, both sides and the extremum make one loop.
        let is_loop =
            |item: &usize| matches!(&flow.items[*item], Item::Segment(s) if s.rate == AxisSet::ALL);
        let is_segment = |item: &usize| matches!(&flow.items[*item], Item::Segment(_));
        if both.iter().all(is_segment) {
            let (fused, before): (Vec<usize>, Vec<usize>) = both.into_iter().partition(is_loop);
            emit(body, &before);
            let ops = fused.iter().flat_map(|item| flow.items[*item].ops());
            let ops: Vec<Position> = ops.copied().chain([value]).collect();
            self.last(body, &ops, value, plane);
        } else {
            emit(body, &both);
            self.last(body, &[value], value, plane);
        }
        for (branch, live) in [(second, 0), (first, 1)] {
            if let Some(branch) = branch {
                body.if_dead(&branch);
                self.conclude(body, &content(live), operands[live], plane, depth + 1);
                body.end_if(branch);
            }
        }
    }

    /// The items inside the region that `item` enters, each standing for all that belongs to it.
    fn content(&self, item: usize) -> Vec<usize> {
        top_level(&self.planes, item + 1..self.planes.after(item))
    }

    /// The sides of the extremum at `value`, if it has activity bits and is all that they are for.
    fn sides(&self, before: &[usize], value: Position) -> Option<Sides> {
        let tape = self.schedule.tape();
        let choice = tape.op(value).choice()?;
        let regions = self.schedule.regions();
        let bits = regions.sides(value)?.map(|side| side.and_then(|region| regions.bit(region)));
        let Op::Binary(_, a, b) = tape.op(value) else { return None };
        let is_shared =
            self.users.of(a).iter().any(|p| *p != value && tape.op(*p).choice() == Some(choice));
        let blocks = bits.map(|bit| {
            before.iter().copied().rfind(|item| {
                matches!(&self.planes.items[*item], Item::Enter { bit: b, .. } if Some(*b) == bit)
            })
        });
        (!is_shared && bits != [None, None]).then_some(Sides { operands: [a, b], bits, blocks })
    }
}

/// The two sides of an extremum.
struct Sides {
    operands: [Position; 2],
    bits: [Option<u32>; 2],
    /// The last item of each side's region.
    blocks: [Option<usize>; 2],
}

/// The items at `range` that are not inside others.
fn top_level(flow: &Flow, range: Range<usize>) -> Vec<usize> {
    let mut list = Vec::new();
    let mut item = range.start;
    while item < range.end {
        list.push(item);
        item = flow.after(item);
    }
    list
}

/// What the functions of a flow run over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Steps {
    /// Everything at once.
    Once,
    /// The planes of a brick.
    Planes,
    /// The same, the last function yielding the results.
    Results,
}

/// The generation of one of the flows.
struct Part<'a, 'b> {
    plan: &'b Plan<'a>,
    assembly: &'b mut Assembly,
    flow: &'b Flow,
    steps: Steps,
}

impl Emit for Part<'_, '_> {
    fn code(&mut self, items: Range<usize>, last: bool) -> Result<usize, CompileError> {
        let Self { plan, assembly, flow, steps } = self;
        if *steps == Steps::Once {
            return assembly.define(1, |body| plan.items(body, flow, items, None));
        }
        let concludes = last && *steps == Steps::Results;
        assembly.define(BRICK, |body| {
            body.steps(|body, plane| {
                if concludes {
                    plan.conclude(body, &top_level(flow, items), plan.root, plane, 0);
                } else {
                    plan.items(body, flow, items, Some(plane));
                }
            });
        })
    }

    fn call(&self, ops: &[Position]) -> Call {
        let tape = self.plan.schedule.tape();
        let rate = tape.axes(ops[0]);
        let buffer = |p: Position| self.plan.homes[p.index()].buffer();
        let result = |p| buffer(p).expect("a result of a call is kept");
        let call = Call::new(tape, ops, PLANE, |p| self.plan.operand(p, rate), result);
        // Partial derivatives are used, whatever becomes of the value.
        call.beside(if ops.len() == 1 { self.plan.levels(ops[0]) } else { None })
    }

    fn fill(&self, (p, value): (Position, f64)) -> Option<Fill> {
        let first = self.plan.homes[p.index()].buffer()?;
        (!self.plan.unseen.contains(&p)).then_some(Fill { first, len: PLANE, value })
    }
}
