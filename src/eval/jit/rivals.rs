//! What the oracles of compiled programs lose against, and the numbers for it at run time.

use super::call::Arguments;
use super::calls::Operand;
use crate::eval::regions::is_set;
use crate::eval::rival::{Order, Rival, Values, rival};
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position};
use crate::expr::Output;
use rustc_hash::FxHashMap;

/// The rivals of oracle values, by position.
pub(super) fn rivals(schedule: &Schedule) -> FxHashMap<Position, Rival<Position, Position>> {
    let tape = schedule.tape();
    let is_value = |p: &Position| matches!(tape.op(*p), Op::Oracle(_, Output::Value, _));
    let values = tape.positions().filter(is_value);
    values.filter_map(|p| Some((p, rival(tape, schedule, p)?))).collect()
}

impl Order for Schedule {
    fn is_before(&self, other: Position, value: Position) -> bool {
        other < value
    }

    fn needed(&self, other: Position, value: Position, (p, side): (Position, usize)) -> Vec<u32> {
        let regions = self.regions();
        let mut region = regions.of(other);
        // Where the region that is that side is dead, a number that loses stands in for it.
        if regions.sides(p).and_then(|sides| sides[side]) == Some(region) {
            region = regions.parent(region);
        }
        let mut bits = Vec::new();
        while regions.common(region, regions.of(value)) != region {
            bits.extend(regions.bit(region));
            region = regions.parent(region);
        }
        bits
    }
}

/// The values that a call for a plane finds.
pub(super) struct InPlane<'a, 'b> {
    pub(super) arguments: &'a Arguments<'b>,
    pub(super) plane: usize,
}

impl Values<Operand, Operand> for InPlane<'_, '_> {
    fn is_active(&self, bit: u32) -> bool {
        is_set(self.arguments.activity, bit)
    }

    fn uniform(&self, place: Operand) -> f64 {
        let mut value = [0.0];
        place.spread_to(self.arguments, self.plane, &mut value);
        value[0]
    }

    fn others(&self, place: Operand, out: &mut [f64]) {
        place.spread_to(self.arguments, self.plane, out);
    }
}
