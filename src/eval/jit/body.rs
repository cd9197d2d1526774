//! Generation of one compiled function: loops, loads and stores.
//!
//! Every access goes through a [`Pointer`], which knows how far the loops around it can carry it,
//! and is recorded in the function's [`Reach`].

use super::call::{BEGIN, Base, END, Reach};
use super::ops::Signs;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F64, F64X2, I16, I64};
use cranelift_codegen::ir::{Block, BlockArg, InstBuilder, MemFlagsData, Value};
use cranelift_frontend::FunctionBuilder;

/// Bytes of a number.
const NUMBER: usize = size_of::<f64>();
/// Bytes of a vector of two lanes.
const PAIR: usize = 2 * NUMBER;

/// A counter of a loop, or of the steps that the function is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Index {
    value: Value,
    /// It is less than this.
    count: usize,
}

/// An address in the memory behind a [`Base`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Pointer {
    base: Base,
    address: Value,
    /// Bytes it is at most beyond the base.
    extent: usize,
}

/// The place of a lane's node in its brick, in bytes of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place(Value);

/// Places are at most so great, whatever is read: a row is then read no further than this.
const LAST_PLACE: usize = 31;

/// An alternative under construction.
#[derive(Debug)]
pub(super) struct Branch {
    dead: Block,
    after: Block,
}

/// A function under construction.
pub(super) struct Body<'a> {
    /// Emits the arithmetic; loads and stores are emitted by [`Body`] alone.
    pub(super) builder: FunctionBuilder<'a>,
    bases: [Value; Base::COUNT],
    /// The first of the steps that the function is asked for, and the one after the last.
    range: [Value; 2],
    reach: Reach,
}

impl<'a> Body<'a> {
    /// The body of a function of one parameter, the address of its frame.
    pub(super) fn new(mut builder: FunctionBuilder<'a>, steps: usize) -> Self {
        let entry = builder.create_block();
        builder.append_block_params_for_function_params(entry);
        builder.switch_to_block(entry);
        let frame = builder.block_params(entry)[0];
        let mut word = |offset: usize| {
            let flags = MemFlagsData::trusted().with_readonly();
            builder.ins().load(I64, flags, frame, immediate(offset))
        };
        let bases = std::array::from_fn(|slot| word(slot * size_of::<*mut u8>()));
        let range = [word(BEGIN), word(END)];
        Self { builder, bases, range, reach: Reach::of_steps(steps) }
    }

    /// Ends the function.
    pub(super) fn finish(mut self, config: cranelift_codegen::isa::TargetFrontendConfig) -> Reach {
        self.builder.ins().return_(&[]);
        self.builder.seal_all_blocks();
        self.builder.finalize(config);
        self.reach
    }

    /// The start of the memory behind `base`.
    pub(super) fn base(&self, base: Base) -> Pointer {
        Pointer { base, address: self.bases[base.slot()], extent: 0 }
    }

    /// The address `stride` bytes beyond `pointer` for every count of `index`.
    pub(super) fn advance(&mut self, pointer: Pointer, index: Index, stride: usize) -> Pointer {
        let offset = if stride.is_power_of_two() {
            self.builder.ins().ishl_imm_u(index.value, i64::from(stride.trailing_zeros()))
        } else {
            self.builder.ins().imul_imm_u(index.value, stride as i64)
        };
        Pointer {
            address: self.builder.ins().iadd(pointer.address, offset),
            extent: pointer.extent + (index.count - 1) * stride,
            ..pointer
        }
    }

    /// Runs what `inside` emits for each of the steps that the function is asked for.
    pub(super) fn steps(&mut self, inside: impl FnOnce(&mut Self, Index)) {
        let [begin, end] = self.range;
        let count = self.reach.steps;
        self.loop_between(begin, end, count, inside);
    }

    /// Runs what `inside` emits `count` times.
    pub(super) fn repeat(&mut self, count: usize, inside: impl FnOnce(&mut Self, Index)) {
        let begin = self.builder.ins().iconst(I64, 0);
        let end = self.builder.ins().iconst(I64, count as i64);
        self.loop_between(begin, end, count, inside);
    }

    /// The range must not be empty: the test is at the loop's end.
    fn loop_between(
        &mut self,
        begin: Value,
        end: Value,
        count: usize,
        inside: impl FnOnce(&mut Self, Index),
    ) {
        let body = self.builder.create_block();
        let value = self.builder.append_block_param(body, I64);
        let done = self.builder.create_block();
        self.builder.ins().jump(body, &[BlockArg::Value(begin)]);
        self.builder.switch_to_block(body);
        inside(self, Index { value, count });
        let next = self.builder.ins().iadd_imm_u(value, 1);
        let more = self.builder.ins().icmp(IntCC::UnsignedLessThan, next, end);
        self.builder.ins().brif(more, body, &[BlockArg::Value(next)], done, &[]);
        self.builder.switch_to_block(done);
    }

    /// Goes on with what happens when bit `bit` of the activity is set.
    pub(super) fn if_live(&mut self, bit: u32) -> Branch {
        let words = self.base(Base::Activity);
        let byte = self.byte(words, bit as usize / 8);
        let set = self.builder.ins().band_imm_u(byte, 1 << (bit % 8));
        let [live, dead, after] = std::array::from_fn(|_| self.builder.create_block());
        self.builder.ins().brif(set, live, &[], dead, &[]);
        self.builder.switch_to_block(live);
        Branch { dead, after }
    }

    /// Goes on with what happens when the bit is clear.
    pub(super) fn if_dead(&mut self, branch: &Branch) {
        self.builder.ins().jump(branch.after, &[]);
        self.builder.switch_to_block(branch.dead);
    }

    /// Goes on with what happens in both cases.
    pub(super) fn end_if(&mut self, branch: Branch) {
        self.builder.ins().jump(branch.after, &[]);
        self.builder.switch_to_block(branch.after);
    }

    /// The byte at `offset`, whatever the order of bytes in a word of 64 bits.
    fn byte(&mut self, words: Pointer, offset: usize) -> Value {
        let offset = if cfg!(target_endian = "little") { offset } else { offset ^ 7 };
        // Whole words are given.
        self.reach.extend(words.base, words.extent + (offset / 8 + 1) * 8);
        let flags = MemFlagsData::trusted().with_readonly();
        self.builder.ins().uload8(I64, flags, words.address, immediate(offset))
    }

    /// The two numbers `offset` numbers beyond `pointer`.
    pub(super) fn load(&mut self, pointer: Pointer, offset: usize) -> Value {
        let bytes = offset * NUMBER;
        self.reach.extend(pointer.base, pointer.extent + bytes + PAIR);
        let flags = MemFlagsData::new().with_notrap();
        self.builder.ins().load(F64X2, flags, pointer.address, immediate(bytes))
    }

    /// The places of two lanes, `offset` places beyond `pointer`.
    pub(super) fn places(&mut self, pointer: Pointer, offset: usize) -> [Place; 2] {
        const PLACE: usize = size_of::<u16>();
        let bytes = offset * PLACE;
        self.reach.extend(pointer.base, pointer.extent + bytes + 2 * PLACE);
        [bytes, bytes + PLACE].map(|bytes| {
            let flags = MemFlagsData::trusted().with_readonly();
            let place = self.builder.ins().uload16(I64, flags, pointer.address, immediate(bytes));
            let place = self.builder.ins().band_imm_u(place, LAST_PLACE as i64);
            Place(self.builder.ins().ishl_imm_u(place, i64::from(NUMBER.trailing_zeros())))
        })
    }

    /// The numbers at `places` of the row that is `offset` numbers beyond `pointer`.
    pub(super) fn pick(&mut self, pointer: Pointer, places: [Place; 2], offset: usize) -> Value {
        let bytes = offset * NUMBER;
        self.reach.extend(pointer.base, pointer.extent + bytes + (LAST_PLACE + 1) * NUMBER);
        let [first, second] = places.map(|Place(place)| {
            let flags = MemFlagsData::trusted().with_readonly();
            let address = self.builder.ins().iadd(pointer.address, place);
            self.builder.ins().load(F64, flags, address, immediate(bytes))
        });
        let lanes = self.builder.ins().scalar_to_vector(F64X2, first);
        self.builder.ins().insertlane(lanes, second, 1)
    }

    /// The number `offset` numbers beyond `pointer`, in both lanes.
    pub(super) fn splat(&mut self, pointer: Pointer, offset: usize) -> Value {
        let bytes = offset * NUMBER;
        self.reach.extend(pointer.base, pointer.extent + bytes + NUMBER);
        let flags = MemFlagsData::new().with_notrap();
        let number = self.builder.ins().load(F64, flags, pointer.address, immediate(bytes));
        self.builder.ins().splat(F64X2, number)
    }

    /// Stores two numbers `offset` numbers beyond `pointer`.
    pub(super) fn store(&mut self, lanes: Value, pointer: Pointer, offset: usize) {
        let bytes = offset * NUMBER;
        self.reach.extend(pointer.base, pointer.extent + bytes + PAIR);
        let flags = MemFlagsData::new().with_notrap();
        self.builder.ins().store(flags, lanes, pointer.address, immediate(bytes));
    }

    /// Stores the signs of sixteen lanes as the word that `pointer` addresses.
    pub(super) fn store_signs(&mut self, row: Signs, pointer: Pointer) {
        let bits = row.finish();
        self.reach.extend(pointer.base, pointer.extent + size_of::<u16>());
        let flags = MemFlagsData::new().with_notrap();
        let word = self.builder.ins().ireduce(I16, bits);
        self.builder.ins().store(flags, word, pointer.address, 0);
    }
}

/// A constant offset as an instruction holds it.
fn immediate(bytes: usize) -> i32 {
    i32::try_from(bytes).expect("programs are limited so that offsets fit an instruction")
}
