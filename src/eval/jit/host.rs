//! The machine that compiled programs run on.
//!
//! Promises that every program of a process is compiled with the same settings, found once.

use super::CompileError;
use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable, Flags};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::default_libcall_names;
use std::sync::{Arc, OnceLock};

/// Instruction set and settings of this host.
fn target() -> Result<OwnedTargetIsa, CompileError> {
    static TARGET: OnceLock<Result<OwnedTargetIsa, CompileError>> = OnceLock::new();
    TARGET.get_or_init(detect).as_ref().map(Arc::clone).map_err(Clone::clone)
}

/// The environment variable that has tests compile without the host's optional instructions.
const PLAIN: &str = "ALVEOLE_TEST_PLAIN";

fn detect() -> Result<OwnedTargetIsa, CompileError> {
    let is_plain = cfg!(test) && std::env::var_os(PLAIN).is_some();
    let isa = cranelift_native::builder_with_options(!is_plain).map_err(CompileError::Host)?;
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
    let mut builder = JITBuilder::with_isa(target()?, default_libcall_names());
    // Before SSE 4.1, x86-64 rounds by calls to the C library's names; a static binary has none.
    builder.symbol("floor", floor as *const u8);
    builder.symbol("ceil", ceil as *const u8);
    builder.symbol("nearbyint", nearest as *const u8);
    Ok(JITModule::new(builder))
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn every_test_of_compiled_programs_holds_without_optional_instructions() {
        if std::env::var_os(PLAIN).is_some() {
            let flags = target().unwrap().isa_flags();
            let optional: Vec<_> = flags
                .iter()
                .filter(|flag| flag.as_bool() == Some(true))
                .map(|flag| flag.name)
                .collect();
            assert!(optional.is_empty(), "{optional:?}");
            return;
        }
        // The instructions are chosen once for a process.
        let run = Command::new(std::env::current_exe().unwrap())
            .args(["eval::jit", "eval::rates", "eval::enclosing"])
            .env(PLAIN, "")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stdout);
        assert!(run.status.success(), "{said}");
        for test in ["tests::every_operator_conforms", "host::tests::every_test", "ops::tests::"] {
            assert!(said.contains(&format!("test eval::jit::{test}")), "{said}");
        }
    }
}
