//! Where the values of a program are kept.

use super::flow::{Flow, is_call};
use crate::eval::leaves::Leaves;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position, Tape};
use crate::geom::Axis;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Where a value is kept between the loops that use it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Home {
    /// Nowhere: it lives inside one loop.
    Register,
    /// In the program.
    Constant(f64),
    /// Among the uniform values, by number.
    Uniform(usize),
    /// In a table, by axis and number.
    Table(Axis, usize),
    /// In the scratch memory, from this number on.
    Buffer(usize),
    /// In the scratch memory: a brick of values, from this number on.
    Volume(usize),
}

impl Home {
    /// The first number of the buffer, if it is one.
    pub(super) const fn buffer(self) -> Option<usize> {
        match self {
            Self::Buffer(first) => Some(first),
            Self::Register
            | Self::Constant(_)
            | Self::Uniform(_)
            | Self::Table(..)
            | Self::Volume(_) => None,
        }
    }
}

/// Users of each operation of a tape.
#[derive(Debug)]
pub(super) struct Users {
    starts: Vec<usize>,
    list: Vec<Position>,
}

impl Users {
    pub(super) fn new(tape: &Tape) -> Self {
        let mut starts = vec![0; tape.len() + 1];
        for p in tape.positions() {
            for o in tape.op(p).operands().iter() {
                starts[o.index() + 1] += 1;
            }
        }
        for i in 0..tape.len() {
            starts[i + 1] += starts[i];
        }
        let mut list = vec![Position::new(0); starts[tape.len()]];
        let mut next = starts.clone();
        for p in tape.positions() {
            for o in tape.op(p).operands().iter() {
                list[next[o.index()]] = p;
                next[o.index()] += 1;
            }
        }
        Self { starts, list }
    }

    /// The operations that `p` is an operand of.
    pub(super) fn of(&self, p: Position) -> &[Position] {
        &self.list[self.starts[p.index()]..self.starts[p.index() + 1]]
    }
}

/// The home of what is read but not computed: a constant, a uniform value or a table.
pub(super) fn leaf(schedule: &Schedule, leaves: &Leaves, p: Position) -> Option<Home> {
    let tape = schedule.tape();
    let number = || leaves.number(tape.node(p)) as usize;
    match (tape.op(p), tape.axes(p).iter().next(), tape.axes(p).len()) {
        (Op::Constant(bits), ..) => Some(Home::Constant(f64::from_bits(bits))),
        (_, None, _) => Some(Home::Uniform(number())),
        (_, Some(axis), 1) => Some(Home::Table(axis, number())),
        _ => None,
    }
}

/// A value that is kept in a buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub(super) position: Position,
    /// Number of the item that computes it, counted through the flows.
    pub(super) item: usize,
    /// Number of the last item that uses it.
    last: usize,
}

/// The values that are computed in some item of `flows` and used outside of it, or called, in
/// order; those in `wanted` are used after all items.
pub(super) fn kept(tape: &Tape, users: &Users, flows: &[&Flow], wanted: &[Position]) -> Vec<Kept> {
    let mut item_of = vec![usize::MAX; tape.len()];
    let items = || flows.iter().flat_map(|flow| &flow.items).enumerate();
    for (item, content) in items() {
        for p in content.ops() {
            item_of[p.index()] = item;
        }
    }
    let of = |p: Position| item_of[p.index()];
    let mut kept = Vec::new();
    for (item, content) in items() {
        for &position in content.ops() {
            let is_wanted = wanted.contains(&position);
            let users_here = users.of(position).iter().map(|user| of(*user));
            let last = users_here.filter(|&user| user != usize::MAX).max();
            let last = if is_wanted { usize::MAX } else { last.unwrap_or(item) };
            let leaves = users.of(position).iter().any(|user| of(*user) != item);
            if is_wanted || leaves || is_call(tape.op(position)) {
                kept.push(Kept { position, item, last });
            }
        }
    }
    kept
}

/// Gives buffers of `len` numbers to `kept`, from number `first` on; returns the number after the
/// last. With `reuse`, values that are not alive at the same time share a buffer. A value in
/// `heirs` takes over the buffer of the operand given there, which nobody else uses.
pub(super) fn place(
    kept: &[Kept],
    homes: &mut [Home],
    first: usize,
    len: usize,
    reuse: bool,
    heirs: &FxHashMap<Position, Position>,
) -> usize {
    // How long an heir is alive, so is the buffer that it takes over.
    let mut lasts: FxHashMap<Position, usize> = FxHashMap::default();
    for value in kept.iter().rev() {
        let last = lasts.get(&value.position).copied().unwrap_or(value.last);
        if let Some(operand) = heirs.get(&value.position) {
            lasts.insert(*operand, last);
        }
    }
    let mut end = first;
    let mut free: Vec<usize> = Vec::new();
    let mut busy: BinaryHeap<Reverse<(usize, usize)>> = BinaryHeap::new();
    for value in kept {
        if let Some(operand) = heirs.get(&value.position) {
            homes[value.position.index()] = homes[operand.index()];
            continue;
        }
        while reuse && let Some(&Reverse((last, buffer))) = busy.peek() {
            if last >= value.item {
                break;
            }
            busy.pop();
            free.push(buffer);
        }
        let buffer = free.pop().unwrap_or_else(|| {
            end += len;
            end - len
        });
        busy.push(Reverse((lasts.get(&value.position).copied().unwrap_or(value.last), buffer)));
        homes[value.position.index()] = Home::Buffer(buffer);
    }
    end
}
