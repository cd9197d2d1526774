//! The machine that compiled programs run on.
//!
//! Promises that every program of a process is compiled with the same settings, found once.

use super::CompileError;
use cranelift_codegen::isa::{self, OwnedTargetIsa};
use cranelift_codegen::settings::{self, Configurable, Flags};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::default_libcall_names;
use std::sync::{Arc, OnceLock};

/// Instruction set and settings of this host.
fn target() -> Result<OwnedTargetIsa, CompileError> {
    static TARGET: OnceLock<Result<OwnedTargetIsa, CompileError>> = OnceLock::new();
    TARGET.get_or_init(detect).as_ref().map(Arc::clone).map_err(Clone::clone)
}

fn detect() -> Result<OwnedTargetIsa, CompileError> {
    with_flags(cranelift_native::builder().map_err(CompileError::Host)?)
}

/// The backend of `builder` with the settings of all programs.
fn with_flags(isa: isa::Builder) -> Result<OwnedTargetIsa, CompileError> {
    let mut builder = settings::builder();
    let verifier = if cfg!(any(test, debug_assertions)) { "true" } else { "false" };
    // `opt_level` beyond "none" moves every constant out of the loops and spills it there.
    for (name, value) in [
        ("opt_level", "none"),
        ("enable_verifier", verifier),
        ("is_pic", "false"),
        ("use_colocated_libcalls", "false"),
        ("unwind_info", "false"),
    ] {
        builder.set(name, value).map_err(|_| CompileError::Host("a setting is unknown"))?;
    }
    isa.finish(Flags::new(builder))
        .map_err(|_| CompileError::Host("the code generator has no backend for it"))
}

/// A module without functions.
pub(super) fn module() -> Result<JITModule, CompileError> {
    Ok(module_for(target()?))
}

/// A module for a host that has none of the optional instructions.
#[cfg(test)]
pub(super) fn plain_module() -> Result<JITModule, CompileError> {
    let builder = cranelift_native::builder_with_options(false).map_err(CompileError::Host)?;
    Ok(module_for(with_flags(builder)?))
}

fn module_for(target: OwnedTargetIsa) -> JITModule {
    let mut builder = JITBuilder::with_isa(target, default_libcall_names());
    // Before SSE 4.1, x86-64 rounds by calls to the C library's names; a static binary has none.
    builder.symbol("floor", floor as *const u8);
    builder.symbol("ceil", ceil as *const u8);
    builder.symbol("nearbyint", nearest as *const u8);
    JITModule::new(builder)
}

extern "C" fn floor(a: f64) -> f64 {
    a.floor()
}

extern "C" fn ceil(a: f64) -> f64 {
    a.ceil()
}

extern "C" fn nearest(a: f64) -> f64 {
    a.round_ties_even()
}
