//! The language of solids: words in postfix order, and equations between them.
//!
//! ```text
//! cylinder gyroid scale 0.5 shell 0.3 intersection "x+y+z-1"
//! ```
//!
//! Text passes through four stages, each in a file of its own: [`words`] expands `@file` words,
//! [`stack`] reads words as items with their arguments ([`syntax`]), reading equations by
//! [`infix`], and [`lower`] runs the items on a stack of solids. Faults become [`Diagnostic`]s,
//! plain data with spans. A [parameter](parameters) stays a leaf of the graph, whatever its value;
//! so do numbers at points of a file, which an equation names in brackets. Nothing here reads
//! files, prints, or knows a shape by name: the [`Vocabulary`] and the [`Loader`] are given. No
//! input makes it panic or recurse without limit.
//!
//! Source: the Cesogen paper, section 3.2; supersets are noted where they are made.

pub mod diagnostic;
pub mod infix;
pub mod lexer;
pub mod lower;
pub mod names;
pub mod parameters;
pub mod source;
pub mod stack;
pub mod syntax;
pub mod word;
pub mod words;

pub use diagnostic::{Diagnostic, Label, shortened};
pub use parameters::Demand;
pub use source::{Place, Source, Sources};
pub use syntax::{Equation, Item, Leaf, Operation, Value};
pub use word::{
    Action, Argument, Arguments, Domain, Loaded, Loader, MakeShape, Presence, Refusal, Shape,
    Translation, Vocabulary, Word,
};
pub use words::Token;

use crate::expr::Graph;
use crate::solid::Solid;
pub use crate::solid::Span;
use lower::Made;

/// The words of a program with the texts they come from.
#[derive(Clone, Debug)]
pub struct Text {
    /// The words, those of files in the place of the files' names.
    pub words: Vec<Token>,
    /// The texts.
    pub sources: Sources,
}

/// Program text turned into a solid.
#[derive(Clone, Debug)]
pub struct Program {
    /// What the text says, step by step.
    pub items: Vec<Item>,
    /// The graph of the solid's field and numbers; its parameters are those given, slot by slot.
    pub graph: Graph,
    /// The intersection of what the text leaves on the stack.
    pub solid: Solid,
    /// What the text leaves on the stack: the operands of that intersection, in order.
    pub operands: Vec<Solid>,
    /// What arguments ask of the parameters, met by the values given.
    pub demands: Vec<Demand>,
    /// The texts, for messages about the solid's spans.
    pub sources: Sources,
}

impl Program {
    /// The names of the parameters that the text does not use.
    #[must_use]
    pub fn unused_parameters(&self) -> Vec<&str> {
        let used = parameters::used(&self.items);
        let names = self.graph.named_parameters().iter().map(|(name, _)| name.as_str());
        names.filter(|name| !used.contains(name)).collect()
    }
}

/// Text that is at fault.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}", diagnostics.first().map_or("the text is at fault", |first| &first.message))]
pub struct Rejected {
    /// What is wrong, in the order of the text; at least one.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts.
    pub sources: Sources,
}

/// The solid that `arguments` describe: the words of a command line after its options.
///
/// `parameters` are the names, with present values, that equations may use besides x, y and z.
/// The solid is one for all values that meet its [demands](Program::demands).
///
/// # Errors
/// [`Rejected`], with every fault found.
pub fn parse(
    arguments: &[String],
    vocabulary: &dyn Vocabulary,
    loader: &mut dyn Loader,
    parameters: &[(String, f64)],
) -> Result<Program, Rejected> {
    program(expand(arguments, loader)?, vocabulary, loader, parameters)
}

/// The words of a command line, `@file` words replaced by the words of the file.
///
/// For those who look for options at the front before they pass the rest to [`program`].
///
/// # Errors
/// [`Rejected`] for files that can't be used.
pub fn expand(arguments: &[String], loader: &mut dyn Loader) -> Result<Text, Rejected> {
    let mut sources = Sources::new(arguments);
    match words::expand(&mut sources, loader) {
        Ok(words) => Ok(Text { words, sources }),
        Err(diagnostics) => Err(Rejected { diagnostics, sources }),
    }
}

/// Operations that a program may make of its text, those made again included: some seconds of work
/// and half a gigabyte. A hundred thousand moved parts make half of it.
const MOST_OPERATIONS: u64 = 1 << 23;

/// The solid that `text` describes; see [`parse`].
///
/// # Errors
/// [`Rejected`], with every fault found.
pub fn program(
    text: Text,
    vocabulary: &dyn Vocabulary,
    loader: &mut dyn Loader,
    parameters: &[(String, f64)],
) -> Result<Program, Rejected> {
    let Text { words, sources } = text;
    let mut graph = Graph::limited(MOST_OPERATIONS);
    let made = parameters::check(parameters, vocabulary)
        .and_then(|()| stack::read(&words, vocabulary, &*loader, parameters))
        .and_then(|items| {
            let made = lower::run(&items, &mut graph, vocabulary, loader, parameters)?;
            Ok((items, made))
        });
    match made {
        Ok((items, Made { solid, operands, demands })) => {
            let graph = graph.without_limit();
            Ok(Program { items, graph, solid, operands, demands, sources })
        }
        Err(diagnostics) => Err(Rejected { diagnostics, sources }),
    }
}

/// The numbers that `text` lists, equations with commas between them: the value of an option.
///
/// `what` names the value in messages, such as "the spacing".
///
/// # Errors
/// [`Rejected`] for faults in the equations and for numbers that are not finite.
pub fn numbers(text: &str, what: &str, parameters: &[(String, f64)]) -> Result<Vec<f64>, Rejected> {
    let sources = Sources::new(&[text.to_owned()]);
    let span = sources.all()[0].word(0);
    let listed = parameters::listed(text, span, what, parameters);
    listed.map_err(|diagnostics| Rejected { diagnostics, sources })
}

/// The words of a program that means what `items` say.
///
/// Names, arguments and equations come in their plainest form; no `@file` words.
#[must_use]
pub fn format(items: &[Item], vocabulary: &dyn Vocabulary) -> Vec<String> {
    let mut words = Vec::new();
    for Item { operation, .. } in items {
        match operation {
            Operation::Mesh(path) => words.push(path.clone()),
            Operation::Equation(equation) => words.push(equation.to_string()),
            Operation::Lattice { path, values } => {
                words.push(path.clone());
                for (argument, value) in vocabulary.lattice_arguments().iter().zip(values) {
                    if let Some(value) = value {
                        words.extend([argument.name.to_owned(), value.to_string()]);
                    }
                }
            }
            Operation::Word { name, values } => {
                words.push(name.clone());
                let word = vocabulary.word(name);
                for (index, value) in values.iter().enumerate() {
                    let Some(value) = value else { continue };
                    // What an operation requires it takes by position, all else is taken by name.
                    if let Some(Word { arguments, action, .. }) = word
                        && let Some(argument) = arguments.get(index)
                        && (matches!(action, Action::Shape(_)) || !argument.is_required())
                    {
                        words.push(argument.name.to_owned());
                    }
                    words.push(value.to_string());
                }
            }
        }
    }
    words
}
