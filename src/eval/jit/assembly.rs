//! A module under construction: functions in, finished [`Code`] out.

use super::body::Body;
use super::call::{Code, Memory, Reach};
use super::{CompileError, host};
use cranelift_codegen::Context;
use cranelift_codegen::ir::AbiParam;
use cranelift_codegen::ir::types::I64;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_module::{FuncId, Module};

/// A module under construction.
pub(super) struct Assembly {
    memory: Memory,
    context: Context,
    builder: FunctionBuilderContext,
    functions: Vec<(FuncId, Reach)>,
}

impl Assembly {
    /// A module without functions.
    pub(super) fn new() -> Result<Self, CompileError> {
        let module = host::module()?;
        let context = module.make_context();
        let builder = FunctionBuilderContext::new();
        Ok(Self { memory: Memory::new(module), context, builder, functions: Vec::new() })
    }

    /// Compiles the function that `emit` writes, to be asked for at most `steps` steps, and numbers
    /// it in the [`Code`].
    pub(super) fn define(
        &mut self,
        steps: usize,
        emit: impl FnOnce(&mut Body<'_>),
    ) -> Result<usize, CompileError> {
        let Self { memory, context, builder, functions } = self;
        let module = memory.module();
        module.clear_context(context);
        context.func.signature.params.push(AbiParam::new(I64));
        let mut body = Body::new(FunctionBuilder::new(&mut context.func, builder), steps);
        emit(&mut body);
        let reach = body.finish(module.isa().frontend_config());
        let id = module.declare_anonymous_function(&context.func.signature)?;
        module.define_function(id, context)?;
        functions.push((id, reach));
        Ok(functions.len() - 1)
    }

    /// Makes the functions executable.
    pub(super) fn finish(mut self) -> Result<Code, CompileError> {
        self.memory.module().finalize_definitions()?;
        Ok(Code::new(self.memory, &self.functions))
    }
}
