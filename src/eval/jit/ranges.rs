//! Ranges over boxes by compiled code: runs of an interval program's instructions.
//!
//! The interpreter of [`BoxProgram`] keeps the whole: it skips dead regions, decides activity bits,
//! calls functions and oracles. Stretches of arithmetic between those are compiled, and run where
//! they are valid: where nothing that they read may be NaN and everything that they read and
//! compute is finite, no square root is taken below zero and no divisor's range holds zero. There
//! an enclosure is plain arithmetic on its ends, in the association of the interpreter's, so the
//! bits are the same. A stretch proves its validity while it computes: its results go to a staging
//! area together with one mask a pair of lanes, and count only if every mask is clear; else the
//! interpreter does the stretch anew, whose inputs are untouched.
//!
//! Boxes must be eighths of one box. Then there are two slabs an axis, and lanes are computed in
//! pairs that differ in x: a table along x is a vector, one along y or z a number.

use super::CompileError;
use super::assembly::Assembly;
use super::body::{Body, Pointer};
use super::call::{Arguments, Base, Code};
use super::{check_size, ops};
use crate::eval::interpret::{Action, BoxProgram, Instruction, NUMBERS, Octets, Source};
use crate::expr::{Binary, Unary};
use crate::geom::Axis;
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::F64X2;
use cranelift_codegen::ir::{InstBuilder, Value};
use cranelift_frontend::FunctionBuilder;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Lanes of an octet.
const LANES: usize = NUMBERS / 2;
/// Bytes of a number.
const NUMBER: usize = size_of::<f64>();
/// A stretch that saves less than this, in additions of the interpreter, is not worth a call.
const LEAST: isize = 4;
/// More instructions than this are divided: the time to compile grows faster than the length.
const LONGEST: usize = 250;

/// The compiled stretches of an interval program.
#[derive(Debug)]
pub struct Ranges {
    code: Code,
    stretches: Vec<Stretch>,
    /// By instruction: the stretch that begins there.
    starts: Vec<Option<u32>>,
    staging: usize,
}

/// Instructions that are compiled together.
#[derive(Debug)]
struct Stretch {
    /// The instruction after the last.
    end: usize,
    function: usize,
    /// The buffers that it reads.
    reads: Vec<u32>,
    /// The buffers that it writes and others read, in the order of the staging area.
    writes: Vec<u32>,
}

/// What the compiled code of a call reads besides buffers.
#[derive(Clone, Copy, Debug)]
pub struct Leaves<'a> {
    /// The ranges of all tables over two slabs an axis; all finite and free of NaN.
    pub tables: [&'a [[f64; 4]]; 3],
    /// The uniform values; all finite.
    pub uniforms: &'a [f64],
}

impl Ranges {
    /// Compiles the stretches of `program`.
    ///
    /// # Errors
    /// [`CompileError`]; the interpreter needs no compiler.
    pub fn compile(program: &BoxProgram) -> Result<Self, CompileError> {
        let list = program.instructions();
        check_size(list.len().saturating_mul(NUMBERS))?;
        let ranges = stretches(program);
        let needed = needed(program, &ranges);
        let mut assembly = Assembly::new()?;
        let mut starts = vec![None; list.len()];
        let mut stretches = Vec::with_capacity(ranges.len());
        let mut staging = LANES;
        for range in ranges {
            let mut writes = Vec::new();
            let mut reads = Vec::new();
            let function = assembly.define(1, |body| {
                (reads, writes) = emit(body, &list[range.clone()], &needed[range.clone()]);
            })?;
            starts[range.start] = Some(stretches.len() as u32);
            staging = staging.max(LANES + NUMBERS * writes.len());
            stretches.push(Stretch { end: range.end, function, reads, writes });
        }
        Ok(Self { code: assembly.finish()?, stretches, starts, staging })
    }

    /// Numbers in the staging area.
    #[must_use]
    pub fn staging(&self) -> usize {
        self.staging
    }

    /// Runs the stretch that begins at instruction `at`, if there is one and it is valid, and names
    /// the instruction after it. `staging` is the [staging](Self::staging) area.
    #[inline]
    pub(in crate::eval) fn run(
        &self,
        at: usize,
        leaves: Leaves<'_>,
        octets: &mut Octets,
        staging: &mut [f64],
    ) -> Option<usize> {
        let stretch = &self.stretches[self.starts[at]? as usize];
        if stretch.reads.iter().any(|&buffer| octets.may_be_nan(buffer)) {
            return None;
        }
        let mut arguments = Arguments {
            tables: leaves.tables.map(<[_]>::as_flattened),
            uniforms: leaves.uniforms,
            scratch: octets.numbers_mut(),
            values: staging,
            ..Arguments::default()
        };
        self.code.call(stretch.function, &mut arguments, 0..1);
        let (masks, results) = staging.split_at(LANES);
        if masks.iter().any(|mask| mask.to_bits() != 0) {
            return None;
        }
        for (&buffer, numbers) in stretch.writes.iter().zip(results.chunks_exact(NUMBERS)) {
            octets.set_numbers(buffer, numbers);
        }
        Some(stretch.end)
    }
}

/// Whether an instruction is compiled: arithmetic that decides nothing.
fn is_compiled(instruction: &Instruction) -> bool {
    instruction.link.is_none()
        && match instruction.action {
            Action::Gather(..) | Action::Square | Action::Choose(_, [None, None]) => true,
            Action::Unary(op) => ops::is_arithmetic(op) && op != Unary::Sign,
            Action::Binary(op) => ops::is_arithmetic_binary(op) && op != Binary::Mod,
            Action::Read
            | Action::Choose(..)
            | Action::Pick(..)
            | Action::Wave(..)
            | Action::Oracle(..)
            | Action::Anything => false,
        }
}

/// What it saves to compile an instruction rather than to interpret it, in additions of the
/// interpreter: compiled code has a quarter of the interpreter's lanes, which costs most where
/// there is much to do, but keeps values in registers.
fn saving(instruction: &Instruction) -> isize {
    let [a, b, ..] = instruction.operands;
    let is_scaling = [a, b].iter().any(|operand| matches!(operand, Source::Uniform(_)));
    match instruction.action {
        Action::Binary(Binary::Div) => 8,
        Action::Binary(Binary::Mul) if is_scaling => 3,
        Action::Binary(Binary::Mul) | Action::Gather(..) => 2,
        Action::Unary(_) | Action::Binary(_) | Action::Square | Action::Choose(..) => 1,
        Action::Read | Action::Pick(..) | Action::Wave(..) | Action::Oracle(..) => 0,
        Action::Anything => 0,
    }
}

/// The instructions that are compiled together, where that pays.
fn stretches(program: &BoxProgram) -> Vec<Range<usize>> {
    let list = program.instructions();
    let mut ranges = Vec::new();
    for run in program.runs() {
        let mut start = run.start;
        for (instruction, at) in list[run.clone()].iter().zip(run.start..) {
            let goes_on = is_compiled(instruction);
            if !goes_on || at - start >= LONGEST {
                ranges.push(start..at);
                start = if goes_on { at } else { at + 1 };
            }
        }
        ranges.push(start..run.end);
    }
    let needed = needed(program, &ranges);
    ranges.retain(|range| {
        let saving = |at: usize| saving(&list[at]) - if needed[at] { 2 } else { 0 };
        range.clone().map(saving).sum::<isize>() >= LEAST
    });
    ranges
}

/// By instruction: whether one outside of its stretch reads it.
fn needed(program: &BoxProgram, ranges: &[Range<usize>]) -> Vec<bool> {
    let mut stretch_of = vec![None; program.instructions().len()];
    for (number, range) in ranges.iter().enumerate() {
        stretch_of[range.clone()].fill(Some(number));
    }
    let mut needed = vec![false; stretch_of.len()];
    let mut writers: FxHashMap<u32, usize> = FxHashMap::default();
    let mut read = |source, reader: Option<usize>, writers: &FxHashMap<u32, usize>| {
        if let Source::Buffer(buffer) = source
            && let Some(&writer) = writers.get(&buffer)
        {
            needed[writer] |= stretch_of[writer].is_some() && stretch_of[writer] != reader;
        }
    };
    for at in program.runs().flatten() {
        for source in program.reads(at) {
            read(source, stretch_of[at], &writers);
        }
        writers.insert(program.instructions()[at].out, at);
    }
    read(program.output(), None, &writers);
    needed
}

/// The ends of a range in two lanes.
#[derive(Clone, Copy)]
struct Ends {
    lo: Value,
    hi: Value,
}

impl Ends {
    /// Whether the range is known to be a number.
    fn is_point(self) -> bool {
        self.lo == self.hi
    }
}

/// Emits a stretch; returns the buffers that it reads, and those that it writes.
fn emit(body: &mut Body<'_>, list: &[Instruction], needed: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let (mut reads, mut writes) = (Vec::new(), Vec::new());
    body.repeat(2, |body, z| {
        body.repeat(2, |body, y| {
            let mut along = |axis| {
                let table = body.base(Base::Table(axis));
                match axis {
                    Axis::X => table,
                    Axis::Y => body.advance(table, y, NUMBER),
                    Axis::Z => body.advance(table, z, NUMBER),
                }
            };
            let tables = Axis::ALL.map(&mut along);
            let [scratch, staging] = [Base::Scratch, Base::Values].map(|base| {
                let start = body.base(base);
                let pointer = body.advance(start, z, 4 * NUMBER);
                body.advance(pointer, y, 2 * NUMBER)
            });
            let mut pair = Pair::new(body, tables, scratch);
            let mut results = Vec::new();
            for (instruction, needed) in list.iter().zip(needed) {
                let ends = pair.compute(instruction);
                pair.known.insert(instruction.out, ends);
                if *needed {
                    results.push((instruction.out, ends));
                }
            }
            let mask = pair.mask();
            reads = pair.reads;
            body.store(mask, staging, 0);
            for (number, (_, ends)) in results.iter().enumerate() {
                let first = LANES + NUMBERS * number;
                body.store(ends.lo, staging, first);
                body.store(ends.hi, staging, first + LANES);
            }
            writes = results.into_iter().map(|(buffer, _)| buffer).collect();
        });
    });
    (reads, writes)
}

/// A stretch under construction, on the two lanes of a pair.
struct Pair<'p, 'b> {
    body: &'p mut Body<'b>,
    tables: [Pointer; 3],
    scratch: Pointer,
    /// What is in registers, by buffer.
    known: FxHashMap<u32, Ends>,
    reads: Vec<u32>,
    /// The greatest upper end and the least lower end so far.
    extremes: Ends,
    /// Ones where something else is not valid.
    invalid: Option<Value>,
}

impl<'p, 'b> Pair<'p, 'b> {
    fn new(body: &'p mut Body<'b>, tables: [Pointer; 3], scratch: Pointer) -> Self {
        let zero = ops::constant(&mut body.builder, 0.0);
        let extremes = Ends { lo: zero, hi: zero };
        let (known, reads) = (FxHashMap::default(), Vec::new());
        Self { body, tables, scratch, known, reads, extremes, invalid: None }
    }

    fn read(&mut self, source: Source) -> Ends {
        match source {
            Source::Uniform(number) => {
                let uniforms = self.body.base(Base::Uniforms);
                let value = self.body.splat(uniforms, number as usize);
                Ends { lo: value, hi: value }
            }
            Source::Buffer(buffer) => {
                if let Some(ends) = self.known.get(&buffer) {
                    return *ends;
                }
                let first = NUMBERS * buffer as usize;
                let [lo, hi] =
                    [first, first + LANES].map(|offset| self.body.load(self.scratch, offset));
                let ends = Ends { lo, hi };
                self.reads.push(buffer);
                self.known.insert(buffer, ends);
                self.bound(ends);
                ends
            }
        }
    }

    fn gather(&mut self, axis: Axis, table: usize) -> Ends {
        let pointer = self.tables[axis.index()];
        let [lo, hi] = [4 * table, 4 * table + 2].map(|offset| match axis {
            Axis::X => self.body.load(pointer, offset),
            Axis::Y | Axis::Z => self.body.splat(pointer, offset),
        });
        Ends { lo, hi }
    }

    /// Holds that `ends` must be finite. The first that is not is infinite and no NaN, and NaN
    /// after it leaves the extremes as they are.
    fn bound(&mut self, ends: Ends) {
        let Ends { lo, hi } = self.extremes;
        let (lo, hi) =
            (self.binary(Binary::Min, ends.lo, lo), self.binary(Binary::Max, ends.hi, hi));
        self.extremes = Ends { lo, hi };
    }

    /// Holds that lanes of ones in `mask` are not valid.
    fn forbid(&mut self, mask: Value) {
        self.invalid = Some(match self.invalid {
            Some(before) => self.ins().ins().bor(before, mask),
            None => mask,
        });
    }

    /// Ones in the lanes that are not valid.
    fn mask(&mut self) -> Value {
        let [least, greatest] = [f64::NEG_INFINITY, f64::INFINITY].map(|end| self.constant(end));
        let Ends { lo, hi } = self.extremes;
        let below = self.compare(FloatCC::LessThanOrEqual, lo, least);
        let above = self.compare(FloatCC::LessThanOrEqual, greatest, hi);
        self.forbid(below);
        self.forbid(above);
        self.invalid.unwrap_or(below)
    }

    fn ins(&mut self) -> &mut FunctionBuilder<'b> {
        &mut self.body.builder
    }

    fn constant(&mut self, value: f64) -> Value {
        ops::constant(self.ins(), value)
    }

    fn unary(&mut self, op: Unary, a: Value) -> Value {
        ops::unary(self.ins(), op, a).expect("only arithmetic is compiled")
    }

    fn binary(&mut self, op: Binary, a: Value, b: Value) -> Value {
        ops::binary(self.ins(), op, a, b).expect("only arithmetic is compiled")
    }

    fn compare(&mut self, condition: FloatCC, a: Value, b: Value) -> Value {
        let mask = self.ins().ins().fcmp(condition, a, b);
        ops::cast(self.ins(), F64X2, mask)
    }

    fn compute(&mut self, instruction: &Instruction) -> Ends {
        let [a, b, ..] = instruction.operands;
        match instruction.action {
            Action::Gather(axis, table) => self.gather(axis, table as usize),
            Action::Unary(op) => {
                let a = self.read(a);
                self.unary_range(op, a)
            }
            Action::Square => {
                let a = self.read(a);
                let Ends { lo, hi } = self.unary_range(Unary::Abs, a);
                let [lo, hi] = [lo, hi].map(|end| self.binary(Binary::Mul, end, end));
                self.bounded(Ends { lo, hi })
            }
            Action::Binary(op) => {
                let (a, b) = (self.read(a), self.read(b));
                self.binary_range(op, a, b)
            }
            Action::Choose(extremum, _) => {
                let (a, b) = (self.read(a), self.read(b));
                self.binary_range(extremum.operator(), a, b)
            }
            Action::Read
            | Action::Pick(..)
            | Action::Wave(..)
            | Action::Oracle(..)
            | Action::Anything => unreachable!("only arithmetic is compiled"),
        }
    }

    fn bounded(&mut self, ends: Ends) -> Ends {
        self.bound(ends);
        ends
    }

    /// As the interpreter encloses `op` of a finite range.
    fn unary_range(&mut self, op: Unary, Ends { lo, hi }: Ends) -> Ends {
        match op {
            Unary::Neg => {
                let [lo, hi] = [hi, lo].map(|end| self.unary(op, end));
                Ends { lo, hi }
            }
            Unary::Abs => {
                let [below, above] = [lo, hi].map(|end| self.unary(Unary::Neg, end));
                let zero = self.constant(0.0);
                let least = self.binary_greater(lo, above);
                Ends { lo: self.binary_greater(least, zero), hi: self.binary_greater(hi, below) }
            }
            Unary::Sqrt => {
                let zero = self.constant(0.0);
                let negative = self.compare(FloatCC::LessThan, lo, zero);
                self.forbid(negative);
                self.rising(op, Ends { lo, hi })
            }
            Unary::Floor | Unary::Ceil | Unary::Round => self.rising(op, Ends { lo, hi }),
            Unary::Sign
            | Unary::Cbrt
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
            | Unary::Log10 => unreachable!("only arithmetic is compiled"),
        }
    }

    /// `op` of both ends, where `op` never falls.
    fn rising(&mut self, op: Unary, Ends { lo, hi }: Ends) -> Ends {
        let [lo, hi] = [lo, hi].map(|end| self.unary(op, end));
        Ends { lo, hi }
    }

    /// `a > b ? a : b`.
    fn binary_greater(&mut self, a: Value, b: Value) -> Value {
        self.binary(Binary::Max, a, b)
    }

    /// As the interpreter encloses `op` of finite ranges.
    fn binary_range(&mut self, op: Binary, a: Ends, b: Ends) -> Ends {
        let ends = match op {
            Binary::Add => {
                Ends { lo: self.binary(op, a.lo, b.lo), hi: self.binary(op, a.hi, b.hi) }
            }
            Binary::Sub => {
                Ends { lo: self.binary(op, a.lo, b.hi), hi: self.binary(op, a.hi, b.lo) }
            }
            Binary::Min | Binary::Max => {
                // Ends of finite ranges are finite.
                return Ends { lo: self.binary(op, a.lo, b.lo), hi: self.binary(op, a.hi, b.hi) };
            }
            Binary::Mul => self.corners(op, a, b),
            Binary::Div => {
                let zero = self.constant(0.0);
                let from = self.compare(FloatCC::LessThanOrEqual, b.lo, zero);
                let to = self.compare(FloatCC::LessThanOrEqual, zero, b.hi);
                let holds_zero = self.ins().ins().band(from, to);
                self.forbid(holds_zero);
                self.corners(op, a, b)
            }
            Binary::Mod | Binary::Pow | Binary::Atan2 | Binary::Hypot => {
                unreachable!("only arithmetic is compiled")
            }
        };
        self.bounded(ends)
    }

    /// The hull of `op` at the corners of `a` and `b`. Where one is a number, corners coincide.
    fn corners(&mut self, op: Binary, a: Ends, b: Ends) -> Ends {
        let corner = |this: &mut Self, a, b| this.binary(op, a, b);
        let first = corner(self, a.lo, b.lo);
        if a.is_point() && b.is_point() {
            return Ends { lo: first, hi: first };
        }
        let pairs = if b.is_point() {
            let last = corner(self, a.hi, b.lo);
            vec![[first, last]]
        } else if a.is_point() {
            let last = corner(self, a.lo, b.hi);
            vec![[first, last]]
        } else {
            let (q, r, s) =
                (corner(self, a.lo, b.hi), corner(self, a.hi, b.lo), corner(self, a.hi, b.hi));
            vec![[first, q], [r, s]]
        };
        let [lo, hi] = [Binary::Min, Binary::Max].map(|op| {
            let ends: Vec<Value> = pairs.iter().map(|[p, q]| self.binary(op, *p, *q)).collect();
            ends.into_iter().reduce(|p, q| self.binary(op, p, q)).unwrap_or(first)
        });
        Ends { lo, hi }
    }
}
