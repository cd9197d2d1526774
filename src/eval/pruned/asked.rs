//! The oracles of a cut: what is made of their answers, so that not all need be exact.
//!
//! A cut has uniform values as numbers, and everything that it has is computed.

use super::cut::{Arg, Cut, Op as Own};
use super::edges::operand;
use crate::eval::compared::{self, Level};
use crate::eval::rival::{Order, Rival, Values, rival};
use crate::eval::tape::{Op, Operations, Position};
use crate::expr::{Binary, Failure, Oracle, OracleId, Output, Queries};
use std::sync::Arc;

/// A cut with the uniform values that its operations read.
#[derive(Clone, Copy, Debug)]
struct Cutting<'a> {
    cut: &'a Cut,
    uniforms: &'a [f64],
}

impl Cutting<'_> {
    /// The uniform value at `p`.
    fn uniform(&self, p: Position) -> f64 {
        Arg::at(p).place().map_or_else(|node| self.uniforms[node], |_| f64::NAN)
    }
}

impl Operations for Cutting<'_> {
    fn count(&self) -> usize {
        self.cut.items.len()
    }

    fn op(&self, p: Position) -> Op {
        let Ok(at) = Arg::at(p).place() else {
            return Op::Constant(self.uniform(p).to_bits());
        };
        let item = &self.cut.items[at];
        let [a, b, c, d] = item.args.map(Arg::position);
        match item.op {
            Own::Coordinate(axis) => Op::Coordinate(axis),
            Own::Unary(op) => Op::Unary(op, a),
            Own::Square => Op::Binary(Binary::Mul, a, a),
            Own::Binary(op) => Op::Binary(op, a, b),
            Own::Choose(extremum) => Op::Binary(extremum.operator(), a, b),
            Own::Pick(extremum) => Op::Pick(extremum, [a, b, c, d]),
            Own::Oracle(oracle, output) => Op::Oracle(oracle, output, [a, b, c]),
            Own::Pass(_) => unreachable!("the form that is enclosed is not computed"),
        }
    }

    fn is_uniform(&self, p: Position) -> bool {
        Arg::at(p).place().is_err()
    }

    fn outputs(&self) -> impl Iterator<Item = Position> {
        self.cut.outputs.iter().map(|output| output.position())
    }
}

/// The numbers that each oracle value of `cut`, by its place, is compared with if only the sign of
/// the first output is wanted; without those of which more may be made.
pub(super) fn levels(cut: &Cut, uniforms: &[f64]) -> Vec<(usize, Vec<f64>)> {
    if !has_oracles(cut) {
        return Vec::new();
    }
    let cutting = Cutting { cut, uniforms };
    let number = |level: &Level| match *level {
        Level::Zero => 0.0,
        Level::Of(p) => cutting.uniform(p),
        Level::Opposite(p) => -cutting.uniform(p),
    };
    let levels = compared::levels(&cutting);
    let values = cut.items.iter().zip(levels).enumerate();
    let values = values.filter_map(|(at, (item, levels))| {
        let is_value = matches!(item.op, Own::Oracle(_, Output::Value));
        Some((at, levels.filter(|_| is_value)?.iter().map(number).collect()))
    });
    values.collect()
}

/// Whether `cut` asks oracles.
fn has_oracles(cut: &Cut) -> bool {
    cut.items.iter().any(|item| matches!(item.op, Own::Oracle(..)))
}

/// Sorts `order`, places of operations of `cut` of which operands come before users and those that are
/// `later` than others come last, so that an oracle comes as late as it may among its like, and
/// with all of its outputs at a point.
pub(super) fn put_off(cut: &Cut, order: &mut [usize], later: impl Fn(usize) -> bool) {
    if !has_oracles(cut) {
        return;
    }
    // Most oracles on a way to an operation, itself included.
    let mut depth = vec![0_u32; cut.items.len()];
    for (at, item) in cut.items.iter().enumerate() {
        let operands = item.args.iter().filter_map(|arg| arg.place().ok()).filter(|o| *o < at);
        let deepest = operands.map(|operand| depth[operand]).max().unwrap_or(0);
        depth[at] = deepest + u32::from(matches!(item.op, Own::Oracle(..)));
    }
    // By place: the first operation that asks the same oracle at the same point.
    let mut calls: Vec<usize> = Vec::new();
    let mut first = |at: usize| {
        let known = calls.iter().copied().find(|known| is_joint(cut, *known, at));
        known.unwrap_or_else(|| {
            calls.push(at);
            at
        })
    };
    order.sort_by_cached_key(|&at| match cut.items[at].op {
        Own::Oracle(..) => (later(at), depth[at], 0, first(at)),
        Own::Coordinate(_)
        | Own::Pass(_)
        | Own::Unary(_)
        | Own::Square
        | Own::Binary(_)
        | Own::Choose(_)
        | Own::Pick(_) => (later(at), depth[at], 1, 0),
    });
}

/// Whether the operations at `a` and `b` ask one oracle at one point.
pub(super) fn is_joint(cut: &Cut, a: usize, b: usize) -> bool {
    let [a, b] = [a, b].map(|at| &cut.items[at]);
    match (a.op, b.op) {
        (Own::Oracle(own, _), Own::Oracle(other, _)) => own == other && a.args[..3] == b.args[..3],
        _ => false,
    }
}

/// A call of an oracle in a row of edges.
#[derive(Clone, Debug)]
struct Call {
    oracle: OracleId,
    /// Where the coordinates are.
    at: [u32; 3],
    /// Where the value and the partial derivatives go.
    outs: [Option<u32>; 4],
    rival: Option<Rival<f64, u32>>,
}

/// The calls of a group of edges.
#[derive(Debug, Default)]
pub(super) struct Calls {
    list: Vec<Call>,
    /// By place in the cut: when it is computed, if it is.
    ranks: Vec<u32>,
}

impl Calls {
    /// Forgets all; those of `cut` follow, whose operations run in `order`.
    pub(super) fn begin(&mut self, cut: &Cut, order: &[usize]) {
        self.list.clear();
        self.ranks.clear();
        self.ranks.resize(cut.items.len(), u32::MAX);
        for (rank, at) in (0..).zip(order) {
            self.ranks[*at] = rank;
        }
    }

    /// Adds a call of `oracle` with its coordinates at `at`; its number.
    pub(super) fn add(&mut self, oracle: OracleId, at: [u32; 3]) -> u32 {
        self.list.push(Call { oracle, at, outs: [None; 4], rival: None });
        self.list.len() as u32 - 1
    }

    /// Lets the last call answer `output`, the operation of `cut` at `at`, in `out`; `other` gives the
    /// operands of edges for those of the cut.
    pub(super) fn answer(
        &mut self,
        (cut, uniforms): (&Cut, &[f64]),
        (at, output): (usize, Output),
        out: u32,
        mut other: impl FnMut(Arg) -> u32,
    ) {
        let Self { list, ranks } = self;
        let Some(call) = list.last_mut() else { return };
        call.outs[output.index()] = Some(out);
        if output == Output::Value {
            let cutting = Cutting { cut, uniforms };
            let rival = rival(&cutting, &Ranks(ranks), Arg::item(at).position());
            let place = |p: Position| other(Arg::at(p));
            call.rival = rival.map(|rival| rival.at(|p| cutting.uniform(p), place));
        }
    }

    /// Asks call `number` at the first `edges` edges of a row.
    #[inline(never)]
    pub(super) fn run<const W: usize>(
        &self,
        number: u32,
        oracles: &[Arc<dyn Oracle>],
        edges: usize,
        (scalars, values): (&[f64], &mut [[f64; W]]),
    ) -> Result<(), Failure> {
        let Call { oracle, at, outs, rival } = &self.list[number as usize];
        let oracle = &oracles[oracle.index()];
        let at = at.map(|arg| {
            let mut at = [0.0; W];
            operand(arg, scalars, values).copy_rows_to::<W>(&mut at);
            at
        });
        let mut answers = [[0.0; W]; 4];
        let [value, partials @ ..] = answers.each_mut().map(|answers| &mut answers[..edges]);
        let wants_gradient = outs[1..].iter().any(Option::is_some);
        let gradient = wants_gradient.then_some(partials);
        let queries = Queries { at: at.each_ref().map(|at| &at[..edges]), value, gradient };
        match rival {
            None => oracle.points(queries)?,
            Some(rival) => {
                let mut room = [[0.0; W]; 2];
                let room = room.each_mut().map(|numbers| &mut numbers[..edges]);
                let row = InRow { scalars, values: &*values };
                rival.with_interest(&row, room, |interest| match interest {
                    Some(interest) => oracle.points_for(queries, interest),
                    None => oracle.points(queries),
                })?;
            }
        }
        for (out, answer) in outs.iter().zip(answers) {
            if let Some(out) = out {
                values[*out as usize] = answer;
            }
        }
        Ok(())
    }
}

/// When the operations of a cut are computed, by place.
struct Ranks<'a>(&'a [u32]);

impl Order for Ranks<'_> {
    fn is_before(&self, other: Position, value: Position) -> bool {
        // What is uniform is there from the beginning.
        let rank = |p: Position| Arg::at(p).place().ok().map(|at| self.0[at]);
        rank(other) < rank(value)
    }

    fn needed(&self, _: Position, _: Position, _: (Position, usize)) -> Vec<u32> {
        Vec::new()
    }
}

/// The values of a row of edges.
struct InRow<'a, const W: usize> {
    scalars: &'a [f64],
    values: &'a [[f64; W]],
}

impl<const W: usize> Values<f64, u32> for InRow<'_, W> {
    fn is_active(&self, _: u32) -> bool {
        true
    }

    fn uniform(&self, place: f64) -> f64 {
        place
    }

    fn others(&self, place: u32, out: &mut [f64]) {
        operand(place, self.scalars, self.values).copy_rows_to::<W>(out);
    }
}
