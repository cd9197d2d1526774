//! The arithmetic of compiled code: two lanes of `f64`, the bits of [`expr::op`](crate::expr::op).
//!
//! Operators not found here ([`is_arithmetic`], [`is_arithmetic_binary`]) are computed by calls of
//! precompiled code between the functions. Bits of NaN are not part of the promise.

use crate::expr::{Binary, Extremum, Unary};
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::{F64X2, I32, I32X4, Type};
use cranelift_codegen::ir::{ConstantData, Endianness, InstBuilder, MemFlagsData, Value};
use cranelift_frontend::FunctionBuilder;

/// Whether `op` is emitted as instructions.
pub(super) const fn is_arithmetic(op: Unary) -> bool {
    match op {
        Unary::Neg
        | Unary::Abs
        | Unary::Sign
        | Unary::Sqrt
        | Unary::Floor
        | Unary::Ceil
        | Unary::Round => true,
        Unary::Cbrt
        | Unary::Sin
        | Unary::Cos
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos
        | Unary::Atan
        | Unary::Sinh
        | Unary::Cosh
        | Unary::Tanh
        | Unary::Exp
        | Unary::Log
        | Unary::Log10 => false,
    }
}

/// Whether `op` is emitted as instructions.
pub(super) const fn is_arithmetic_binary(op: Binary) -> bool {
    match op {
        Binary::Add
        | Binary::Sub
        | Binary::Mul
        | Binary::Div
        | Binary::Min
        | Binary::Max
        | Binary::Mod => true,
        Binary::Pow | Binary::Atan2 | Binary::Hypot => false,
    }
}

/// Reinterprets the bits of a vector.
pub(super) fn cast(builder: &mut FunctionBuilder<'_>, to: Type, value: Value) -> Value {
    let flags = MemFlagsData::new().with_endianness(Endianness::Little);
    builder.ins().bitcast(to, flags, value)
}

/// The vector with `value` in both lanes.
pub(super) fn constant(builder: &mut FunctionBuilder<'_>, value: f64) -> Value {
    let bytes = value.to_bits().to_le_bytes();
    let data: ConstantData = bytes.iter().chain(&bytes).copied().collect();
    let handle = builder.func.dfg.constants.insert(data);
    builder.ins().vconst(F64X2, handle)
}

/// Lanes of ones where `a < b`, as a vector of numbers.
fn less(builder: &mut FunctionBuilder<'_>, a: Value, b: Value) -> Value {
    let mask = builder.ins().fcmp(FloatCC::LessThan, a, b);
    cast(builder, F64X2, mask)
}

/// `op` of `a`, if it [is arithmetic](is_arithmetic).
pub(super) fn unary(builder: &mut FunctionBuilder<'_>, op: Unary, a: Value) -> Option<Value> {
    // One operation with a constant; the instructions for it build the constant anew each time.
    let sign_bit = -0.0;
    Some(match op {
        Unary::Neg => {
            let mask = constant(builder, sign_bit);
            builder.ins().bxor(a, mask)
        }
        Unary::Abs => {
            let mask = constant(builder, f64::from_bits(!f64::to_bits(sign_bit)));
            builder.ins().band(a, mask)
        }
        Unary::Sign => {
            let (zero, one, minus_one) =
                (constant(builder, 0.0), constant(builder, 1.0), constant(builder, -1.0));
            let positive = less(builder, zero, a);
            let positive = builder.ins().band(positive, one);
            let negative = less(builder, a, zero);
            let negative = builder.ins().band(negative, minus_one);
            let sign = builder.ins().bor(positive, negative);
            let nan = builder.ins().fcmp(FloatCC::Unordered, a, a);
            let nan = cast(builder, F64X2, nan);
            builder.ins().bitselect(nan, a, sign)
        }
        Unary::Sqrt => builder.ins().sqrt(a),
        Unary::Floor => builder.ins().floor(a),
        Unary::Ceil => builder.ins().ceil(a),
        Unary::Round => builder.ins().nearest(a),
        Unary::Cbrt
        | Unary::Sin
        | Unary::Cos
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos
        | Unary::Atan
        | Unary::Sinh
        | Unary::Cosh
        | Unary::Tanh
        | Unary::Exp
        | Unary::Log
        | Unary::Log10 => return None,
    })
}

/// `op` of `a` and `b`, if it [is arithmetic](is_arithmetic_binary).
pub(super) fn binary(
    builder: &mut FunctionBuilder<'_>,
    op: Binary,
    a: Value,
    b: Value,
) -> Option<Value> {
    Some(match op {
        Binary::Add => builder.ins().fadd(a, b),
        Binary::Sub => builder.ins().fsub(a, b),
        Binary::Mul => builder.ins().fmul(a, b),
        Binary::Div => builder.ins().fdiv(a, b),
        Binary::Min => pick(builder, Extremum::Min, [a, b, a, b]),
        Binary::Max => pick(builder, Extremum::Max, [a, b, a, b]),
        Binary::Mod => {
            let quotient = builder.ins().fdiv(a, b);
            let whole = builder.ins().floor(quotient);
            let product = builder.ins().fmul(b, whole);
            builder.ins().fsub(a, product)
        }
        Binary::Pow | Binary::Atan2 | Binary::Hypot => return None,
    })
}

/// `c` where the extremum of `a` and `b` is `a`, else `d`.
///
/// With `c = a` and `d = b` it is one instruction on x86-64, whose minimum and maximum are exactly
/// these: `fmin` and `fmax` treat NaN and zeros otherwise.
pub(super) fn pick(
    builder: &mut FunctionBuilder<'_>,
    extremum: Extremum,
    [a, b, c, d]: [Value; 4],
) -> Value {
    let first = match extremum {
        Extremum::Min => less(builder, a, b),
        Extremum::Max => less(builder, b, a),
    };
    builder.ins().bitselect(first, c, d)
}

/// The signs of a row of sixteen lanes, packed as its vectors are made: few registers are held.
#[derive(Debug, Default)]
pub(super) struct Signs {
    /// Masks of 1, 2 and 4 vectors that wait for their like.
    waiting: [Option<Value>; 3],
    bits: Option<Value>,
}

impl Signs {
    /// Takes the next two lanes.
    pub(super) fn push(&mut self, builder: &mut FunctionBuilder<'_>, lanes: Value) {
        let zero = constant(builder, 0.0);
        let mask = builder.ins().fcmp(FloatCC::LessThan, lanes, zero);
        let mut mask = cast(builder, I32X4, mask);
        // Masks keep their order through saturating halvings: -1 stays -1, and a lane that is two
        // equal halves becomes one.
        for (level, waiting) in self.waiting.iter_mut().enumerate() {
            let Some(low) = waiting.take() else {
                *waiting = Some(mask);
                return;
            };
            let halves = builder.ins().snarrow(low, mask);
            mask = match level {
                0 => cast(builder, I32X4, halves),
                _ => halves,
            };
        }
        self.bits = Some(builder.ins().vhigh_bits(I32, mask));
    }

    /// Sixteen bits, one a lane in order: set where the lane is below zero.
    ///
    /// # Panics
    /// Unless eight vectors were taken.
    pub(super) fn finish(self) -> Value {
        self.bits.expect("a row has eight vectors")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::jit::assembly::Assembly;
    use crate::eval::jit::call::{Arguments, Base};
    use crate::expr::probe::SPECIAL;

    const OPERANDS: usize = SPECIAL.len() * SPECIAL.len();

    /// Every pair of special numbers, as first and second operands.
    fn operands() -> [Vec<f64>; 2] {
        let pairs = SPECIAL.iter().flat_map(|a| SPECIAL.iter().map(move |b| (*a, *b)));
        let (a, b) = pairs.unzip();
        [a, b]
    }

    /// What `emit` computes of the operands.
    fn compiled(
        mut assembly: Assembly,
        emit: impl Fn(&mut FunctionBuilder<'_>, Value, Value) -> Value,
    ) -> Vec<f64> {
        let define = assembly.define(OPERANDS / 2, |body| {
            let scratch = body.base(Base::Scratch);
            body.steps(|body, step| {
                let pair = body.advance(scratch, step, 16);
                let (a, b) = (body.load(pair, 0), body.load(pair, OPERANDS));
                let result = emit(&mut body.builder, a, b);
                body.store(result, pair, 2 * OPERANDS);
            });
        });
        let (number, code) = (define.unwrap(), assembly.finish().unwrap());
        let mut scratch = operands().concat();
        scratch.resize(3 * OPERANDS, 0.0);
        let mut arguments = Arguments { scratch: &mut scratch, ..Arguments::default() };
        code.call(number, &mut arguments, 0..OPERANDS / 2);
        scratch.split_off(2 * OPERANDS)
    }

    fn check(
        name: &str,
        emit: impl Fn(&mut FunctionBuilder<'_>, Value, Value) -> Value,
        expected: impl Fn(f64, f64) -> f64,
    ) {
        let [a, b] = operands();
        let results = compiled(Assembly::new().unwrap(), &emit);
        for ((a, b), result) in a.iter().zip(&b).zip(results) {
            let expected = expected(*a, *b);
            let same = result.to_bits() == expected.to_bits();
            assert!(
                same || (result.is_nan() && expected.is_nan()),
                "{name} of {a:e} and {b:e} is {result:e}, not {expected:e}"
            );
        }
    }

    #[test]
    fn arithmetic_has_the_defined_bits() {
        for op in Unary::ALL.into_iter().filter(|op| is_arithmetic(*op)) {
            let emit = |f: &mut FunctionBuilder<'_>, a, _| unary(f, op, a).unwrap();
            check(op.name(), emit, |a, _| op.apply(a));
        }
        for op in Binary::ALL.into_iter().filter(|op| is_arithmetic_binary(*op)) {
            let emit = |f: &mut FunctionBuilder<'_>, a, b| binary(f, op, a, b).unwrap();
            check(op.name(), emit, |a, b| op.apply(a, b));
        }
        for extremum in [Extremum::Min, Extremum::Max] {
            let emit = |f: &mut FunctionBuilder<'_>, a, b| {
                let [c, d] = [1.0, 2.0].map(|value| constant(f, value));
                pick(f, extremum, [a, b, c, d])
            };
            check("pick", emit, |a, b| if extremum.picks_first(a, b) { 1.0 } else { 2.0 });
        }
    }
}
