//! Oracles that are asked once a brick.
//!
//! Where the coordinates of an oracle are values on x alone, on y alone and on z alone, none of them
//! uniform, one brick query answers for all samples of a brick.

use super::call::Arguments;
use super::calls::{Levels, Numbers, Operand, PLANE, ROW, Source, Spread, Staging};
use super::layout::Users;
use crate::eval::BRICK;
use crate::eval::regions::is_set;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position};
use crate::expr::{AxisSet, Failure, Interest, Oracle, Output, Queries};
use crate::geom::Axis;
use std::sync::Arc;

/// Samples of a brick.
pub(super) const SAMPLES: usize = BRICK * BRICK * BRICK;

/// A brick of an oracle's values.
#[derive(Clone, Debug)]
pub(super) struct Volume {
    /// The oracle's number.
    pub(super) oracle: usize,
    /// Where the coordinates along each axis are.
    pub(super) at: [Source; 3],
    /// Where the values go in the scratch memory.
    pub(super) first: usize,
    /// The bits of the regions around it, outer ones first; the last is its own.
    pub(super) bits: Vec<u32>,
    /// What stands for the values where its own region is dead, if that matters.
    pub(super) loser: Option<f64>,
    /// What the values are compared with, if they are not used otherwise.
    pub(super) levels: Option<Levels>,
}

/// The values that one brick query each can answer for: no gradient is wanted at the same points.
pub(super) fn volumes(schedule: &Schedule, users: &Users) -> Vec<Position> {
    let tape = schedule.tape();
    let is_volume = |p: &Position| {
        let Op::Oracle(oracle, Output::Value, at) = tape.op(*p) else { return false };
        let apart =
            at.iter().zip(Axis::ALL).all(|(&o, axis)| tape.axes(o).is_subset(AxisSet::only(axis)));
        let gradient = users.of(at[0]).iter().any(|&q| {
            matches!(tape.op(q), Op::Oracle(other, Output::Partial(_), other_at)
                if other == oracle && other_at == at)
        });
        apart && !gradient && tape.axes(*p) == AxisSet::ALL
    };
    tape.positions().filter(is_volume).collect()
}

impl Volume {
    /// Asks the oracle, or fills in for it where nobody looks.
    pub(super) fn run(
        &self,
        arguments: &mut Arguments<'_>,
        staging: &mut Staging,
        oracles: &[Arc<dyn Oracle>],
    ) -> Result<(), Failure> {
        let values = self.first..self.first + SAMPLES;
        if let Some(dead) = self.bits.iter().position(|bit| !is_set(arguments.activity, *bit)) {
            if let Some(loser) = self.loser.filter(|_| dead + 1 == self.bits.len()) {
                arguments.scratch[values].fill(loser);
            }
            return Ok(());
        }
        for (&source, out) in self.at.iter().zip(staging.iter_mut()) {
            let spread = match source {
                Source::Constant(_) | Source::Uniform(_) => Spread::One,
                Source::Table { .. } | Source::Scratch { .. } => Spread::Lanes,
            };
            Operand { source, spread }.spread_to(arguments, 0, &mut out[..ROW]);
        }
        let [x, y, z, _] = staging;
        let at = [&x[..ROW], &y[..ROW], &z[..ROW]];
        let oracle = &oracles[self.oracle];
        let numbers = self.levels.as_ref().map(|levels| levels.numbers(arguments));
        let levels = numbers.as_ref().map(Numbers::list);
        let values = &mut arguments.scratch[values];
        // Functions of a coordinate need not be monotone, as brick queries ask.
        if at.iter().all(|at| at.is_sorted() || at.iter().rev().is_sorted()) {
            return match levels {
                Some(levels) => oracle.brick_beside(at, levels, values),
                None => oracle.brick(at, values),
            };
        }
        let mut points = [[0.0; PLANE]; 3];
        for (plane, value) in values.chunks_mut(PLANE).enumerate() {
            for lane in 0..PLANE {
                points[0][lane] = at[0][lane % ROW];
                points[1][lane] = at[1][lane / ROW];
                points[2][lane] = at[2][plane];
            }
            let at = points.each_ref().map(|p| &p[..]);
            let queries = Queries { at, value, gradient: None };
            match levels {
                Some(levels) => oracle.points_for(queries, Interest::Beside(levels))?,
                None => oracle.points(queries)?,
            }
        }
        Ok(())
    }
}
