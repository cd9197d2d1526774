//! The language of solids: words in postfix order, and equations between them.
//!
//! ```text
//! cylinder gyroid scale 0.5 shell 0.3 intersection "x+y+z-1"
//! ```
//!
//! Text passes through four stages, each in a file of its own: [`words`] expands `@file` words,
//! [`stack`] reads words as items with their arguments ([`syntax`]), reading equations by
//! [`infix`], and [`lower`] runs the items on a stack of solids. Faults become [`Diagnostic`]s,
//! plain data with spans. Nothing here reads files, prints, or knows a shape by name: the
//! [`Vocabulary`] and the [`Loader`] are given. No input makes it panic or recurse without limit.
//!
//! Source: the Cesogen paper, section 3.2; supersets are noted where they are made.

pub mod diagnostic;
pub mod infix;
pub mod lexer;
pub mod lower;
pub mod names;
pub mod numbers;
pub mod source;
pub mod stack;
pub mod syntax;
pub mod word;
pub mod words;

pub use diagnostic::{Diagnostic, Label};
pub use source::{Place, Source, Sources};
pub use word::{
    Action, Argument, Arguments, Domain, Loaded, Loader, Refusal, Shape, Vocabulary, Word,
};

use crate::expr::Graph;
use crate::solid::Solid;
pub use crate::solid::Span;

/// Program text turned into a solid.
#[derive(Clone, Debug)]
pub struct Program {
    /// The graph of the solid's field and numbers.
    pub graph: Graph,
    /// The intersection of what the text leaves on the stack.
    pub solid: Solid,
    /// What the text leaves on the stack: the operands of that intersection, in order.
    pub operands: Vec<Solid>,
    /// The text, for messages about the solid's spans.
    pub sources: Sources,
}

/// Program text that is at fault.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}", diagnostics.first().map_or("the program is at fault", |first| &first.message))]
pub struct Rejected {
    /// What is wrong, in the order of the text; at least one.
    pub diagnostics: Vec<Diagnostic>,
    /// The text.
    pub sources: Sources,
}

/// The solid that `arguments` describe: the words of a command line after its options.
///
/// `parameters` are the names, with present values, that equations may use besides x, y and z.
///
/// # Errors
/// [`Rejected`], with every fault found.
pub fn parse(
    arguments: &[String],
    vocabulary: &dyn Vocabulary,
    loader: &mut dyn Loader,
    parameters: &[(String, f64)],
) -> Result<Program, Rejected> {
    let mut sources = Sources::new(arguments);
    let mut faults = names::parameter_faults(parameters, vocabulary);
    let solid = words::expand(&mut sources, loader).and_then(|words| {
        if !faults.is_empty() {
            return Err(std::mem::take(&mut faults));
        }
        let items = stack::read(&words, vocabulary, &*loader, parameters)?;
        let mut graph = Graph::new();
        let (solid, operands) = lower::run(&items, &mut graph, vocabulary, loader, parameters)?;
        Ok((graph, solid, operands))
    });
    match solid {
        Ok((graph, solid, operands)) => Ok(Program { graph, solid, operands, sources }),
        Err(diagnostics) => Err(Rejected { diagnostics, sources }),
    }
}
