//! Calls into compiled code and its memory: the only unsafe code of the crate.
//!
//! A compiled function has one fixed signature: it receives a [`Frame`] of pointers and a range of
//! steps to run. While a function is generated, [`Reach`] records how far it reads and writes
//! behind every pointer; [`Code::call`] compares that with the slices it is given and refuses to
//! run otherwise. So a call is safe if the generated code keeps to its own record, which
//! [`Body`](super::body::Body) sees to by being the only one to emit loads and stores.

#![allow(unsafe_code)]

use crate::geom::Axis;
use cranelift_jit::JITModule;
use cranelift_module::FuncId;
use std::ops::Range;

/// Memory that compiled code can reach, in the order of the pointers in [`Frame`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Base {
    /// Values of the one-axis nodes of x; y; z.
    Table(Axis),
    /// Values of the parameters and of what depends on nothing else.
    Uniforms,
    /// Activity bits.
    Activity,
    /// Buffers between the parts of a program.
    Scratch,
    /// Sign words: one of sixteen bits for every row.
    Signs,
    /// Values.
    Values,
    /// Places of the nodes of edges in their brick, by axis and lane.
    Places,
}

impl Base {
    /// Number of pointers in the frame.
    pub(super) const COUNT: usize = 9;

    /// Position of the pointer in the frame.
    pub(super) const fn slot(self) -> usize {
        match self {
            Self::Table(axis) => axis as usize,
            Self::Uniforms => 3,
            Self::Activity => 4,
            Self::Scratch => 5,
            Self::Signs => 6,
            Self::Values => 7,
            Self::Places => 8,
        }
    }
}

/// Bytes that a function may touch behind each pointer, and the steps it may be asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reach {
    bytes: [usize; Base::COUNT],
    /// Steps that the bytes account for.
    pub(super) steps: usize,
}

impl Reach {
    /// Nothing touched yet, of `steps` steps.
    pub(super) fn of_steps(steps: usize) -> Self {
        Self { steps, ..Self::default() }
    }

    /// Records that bytes up to `end` behind `base` are touched.
    pub(super) fn extend(&mut self, base: Base, end: usize) {
        let bytes = &mut self.bytes[base.slot()];
        *bytes = (*bytes).max(end);
    }
}

/// What a compiled function receives.
#[repr(C)]
struct Frame {
    bases: [*mut u8; Base::COUNT],
    begin: u64,
    end: u64,
}

/// Offset of the first step in the frame; the end follows.
pub(super) const BEGIN: usize = size_of::<*mut u8>() * Base::COUNT;
/// Offset of the end of the steps in the frame.
pub(super) const END: usize = BEGIN + size_of::<u64>();

/// What a call works on.
#[derive(Debug, Default)]
pub(super) struct Arguments<'a> {
    pub(super) tables: [&'a [f64]; 3],
    pub(super) uniforms: &'a [f64],
    pub(super) activity: &'a [u64],
    pub(super) scratch: &'a mut [f64],
    pub(super) signs: &'a mut [u16],
    pub(super) values: &'a mut [f64],
    pub(super) places: &'a [u16],
}

/// A function of a [`Code`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    address: *const u8,
    reach: Reach,
}

/// A module whose memory is freed with it.
pub(super) struct Memory(Option<JITModule>);

impl Memory {
    /// Takes over `module`.
    pub(super) const fn new(module: JITModule) -> Self {
        Self(Some(module))
    }

    /// The module.
    pub(super) const fn module(&mut self) -> &mut JITModule {
        self.0.as_mut().expect("the module is there until it is dropped")
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        if let Some(module) = self.0.take() {
            // SAFETY: addresses in the module are used by `Code` alone, which owns the `Memory`;
            // its calls borrow it, so none is running.
            unsafe { module.free_memory() };
        }
    }
}

/// Finished functions and the memory they live in.
pub(super) struct Code {
    /// Keeps the code where it is.
    _memory: Memory,
    entries: Vec<Entry>,
}

// SAFETY: a finished module is never changed: its memory is read and executed only, and freed by
// the one owner. The addresses in `entries` are plain numbers, valid as long as the module.
unsafe impl Send for Code {}
// SAFETY: as above; `Code` gives no access to the module, whose interior is not thread-safe.
unsafe impl Sync for Code {}

impl Code {
    /// Takes over `memory`; `functions` are its finished functions with the reach of each.
    pub(super) fn new(mut memory: Memory, functions: &[(FuncId, Reach)]) -> Self {
        let module = memory.module();
        let entries = functions
            .iter()
            .map(|&(id, reach)| Entry { address: module.get_finalized_function(id), reach })
            .collect();
        Self { _memory: memory, entries }
    }

    /// Runs `steps` of the function `number`.
    ///
    /// # Panics
    /// If an argument is shorter than what the function reaches.
    #[inline]
    pub(super) fn call(&self, number: usize, arguments: &mut Arguments<'_>, steps: Range<usize>) {
        let Entry { address, reach } = &self.entries[number];
        let Arguments { tables, uniforms, activity, scratch, signs, values, places } = arguments;
        let room = [
            size_of_val(tables[0]),
            size_of_val(tables[1]),
            size_of_val(tables[2]),
            size_of_val(*uniforms),
            size_of_val(*activity),
            size_of_val(*scratch),
            size_of_val(*signs),
            size_of_val(*values),
            size_of_val(*places),
        ];
        assert!(
            steps.start < steps.end
                && steps.end <= reach.steps
                && reach.bytes.iter().zip(room).all(|(need, have)| *need <= have),
            "a compiled function is given what it reaches: {reach:?} in {room:?}"
        );
        let frame = Frame {
            bases: [
                tables[0].as_ptr().cast_mut().cast(),
                tables[1].as_ptr().cast_mut().cast(),
                tables[2].as_ptr().cast_mut().cast(),
                uniforms.as_ptr().cast_mut().cast(),
                activity.as_ptr().cast_mut().cast(),
                scratch.as_mut_ptr().cast(),
                signs.as_mut_ptr().cast(),
                values.as_mut_ptr().cast(),
                places.as_ptr().cast_mut().cast(),
            ],
            begin: steps.start as u64,
            end: steps.end as u64,
        };
        // SAFETY: `address` is that of a finished function of the module that `self` owns, compiled
        // with this signature and the C calling convention of the host.
        let function: extern "C" fn(&Frame) = unsafe { std::mem::transmute(*address) };
        // The function only touches the slices, within the lengths asserted above; it writes only
        // to the three that are borrowed mutably, and calls nothing that unwinds.
        function(&frame);
    }
}

impl std::fmt::Debug for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Code").field("entries", &self.entries).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::jit::assembly::Assembly;

    /// Doubles pairs of numbers in place, at most four pairs.
    fn doubling() -> Code {
        let mut assembly = Assembly::new().unwrap();
        let double = |body: &mut crate::eval::jit::body::Body<'_>| {
            let scratch = body.base(Base::Scratch);
            body.steps(|body, step| {
                let pair = body.advance(scratch, step, 16);
                let value = body.load(pair, 0);
                let twice =
                    cranelift_codegen::ir::InstBuilder::fadd(body.builder.ins(), value, value);
                body.store(twice, pair, 0);
            });
        };
        assembly.define(4, double).unwrap();
        assembly.finish().unwrap()
    }

    fn run(len: usize, steps: Range<usize>) -> Vec<f64> {
        let mut scratch = vec![1.0; len];
        let mut arguments = Arguments { scratch: &mut scratch, ..Arguments::default() };
        doubling().call(0, &mut arguments, steps);
        scratch
    }

    #[test]
    fn a_function_runs_the_steps_that_it_is_asked_for() {
        assert_eq!(run(8, 1..3), [1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 1.0, 1.0]);
    }

    #[test]
    #[should_panic(expected = "given what it reaches")]
    fn a_call_with_too_little_memory_is_refused() {
        run(7, 0..1);
    }

    #[test]
    #[should_panic(expected = "given what it reaches")]
    fn a_call_for_too_many_steps_is_refused() {
        run(80, 0..5);
    }
}
