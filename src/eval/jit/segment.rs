//! The inside of the loops: a segment's operations on two lanes.

use super::body::{Body, Place, Pointer};
use super::ops;
use crate::eval::tape::{Op, Position, Tape};
use cranelift_codegen::ir::Value;
use rustc_hash::FxHashMap;

/// Where a loop finds a value.
#[derive(Clone, Copy, Debug)]
pub(super) enum Access {
    /// In the code.
    Constant(f64),
    /// One number for all lanes, so many numbers beyond the pointer.
    Splat(Pointer, usize),
    /// Numbers that follow the lanes, the first so many beyond the pointer.
    Lanes(Pointer, usize),
    /// Numbers at the places of the lanes in a row, so many beyond the pointer; of one vector.
    Picked(Pointer, [Place; 2], usize),
}

/// A vector holds this many lanes.
pub(super) const LANES: usize = 2;

/// Values that are the same in all lanes, beyond so many, are fetched at every use: registers are
/// few.
const KEPT: usize = 9;

/// The operations of a loop's body, computed for one vector of lanes after the other.
pub(super) struct Lanes<'a> {
    tape: &'a Tape,
    ops: &'a [Position],
    uniform: FxHashMap<Position, Value>,
    values: FxHashMap<Position, Value>,
}

impl<'a> Lanes<'a> {
    /// Prepares `ops`, and `also`, which is wanted too, fetching what all lanes share.
    pub(super) fn new(
        body: &mut Body<'_>,
        tape: &'a Tape,
        ops: &'a [Position],
        also: Option<Position>,
        access: &impl Fn(Position) -> Access,
    ) -> Self {
        let mut uniform: Vec<(Position, Access)> = Vec::new();
        let operands = ops.iter().flat_map(|p| tape.op(*p).operands().to_vec()).chain(also);
        let own: rustc_hash::FxHashSet<Position> = ops.iter().copied().collect();
        for operand in operands.filter(|operand| !own.contains(operand)) {
            let place = access(operand);
            if matches!(place, Access::Constant(_) | Access::Splat(..))
                && uniform.len() < KEPT
                && uniform.iter().all(|(p, _)| *p != operand)
            {
                uniform.push((operand, place));
            }
        }
        let uniform = uniform.into_iter().map(|(p, place)| (p, fetch(body, place, 0))).collect();
        Self { tape, ops, uniform, values: FxHashMap::default() }
    }

    /// Computes the operations in the vector `vector` of the loop's.
    pub(super) fn compute(
        &mut self,
        body: &mut Body<'_>,
        vector: usize,
        access: &impl Fn(Position) -> Access,
    ) {
        self.values.clear();
        for &p in self.ops {
            let op = self.tape.op(p);
            let operands = op.operands();
            let mut values = [None; 4];
            for (value, &operand) in values.iter_mut().zip(operands.iter()) {
                *value = Some(self.value(body, operand, vector, access));
            }
            let result = match (op, values) {
                (Op::Unary(op, _), [Some(a), ..]) => ops::unary(&mut body.builder, op, a),
                (Op::Binary(op, ..), [Some(a), Some(b), ..]) => {
                    ops::binary(&mut body.builder, op, a, b)
                }
                (Op::Pick(extremum, _), [Some(a), Some(b), Some(c), Some(d)]) => {
                    Some(ops::pick(&mut body.builder, extremum, [a, b, c, d]))
                }
                _ => None,
            };
            let result = result.expect("a segment holds nothing but arithmetic");
            self.values.insert(p, result);
        }
    }

    /// The value at `p`, computed here or elsewhere.
    pub(super) fn value(
        &mut self,
        body: &mut Body<'_>,
        p: Position,
        vector: usize,
        access: &impl Fn(Position) -> Access,
    ) -> Value {
        if let Some(value) = self.uniform.get(&p).or_else(|| self.values.get(&p)) {
            return *value;
        }
        let value = fetch(body, access(p), vector);
        self.values.insert(p, value);
        value
    }
}

fn fetch(body: &mut Body<'_>, place: Access, vector: usize) -> Value {
    match place {
        Access::Constant(value) => ops::constant(&mut body.builder, value),
        Access::Splat(pointer, offset) => body.splat(pointer, offset),
        Access::Lanes(pointer, offset) => body.load(pointer, offset + LANES * vector),
        Access::Picked(pointer, places, offset) => body.pick(pointer, places, offset),
    }
}
