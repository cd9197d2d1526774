//! Parameters: named numbers that equations use and whose values may change after reading.
//!
//! Reading keeps a parameter as a leaf of the graph. What an argument asks of its value, such as a
//! factor that differs from zero, is kept as a [`Demand`] and can be asked again of other values.

use super::infix::{self, Coordinates, Scope};
use super::lexer::{Lexeme, lexemes};
use super::names::{self, CONSTANTS, Function};
use super::syntax::{Equation, Item, Leaf, Operation, Term, Value};
use super::word::normalized;
use super::{Argument, Diagnostic, Rejected, Shape, Sources, Span, Vocabulary};
use crate::expr::{Graph, NodeId, depends};
use crate::solid::Values;
use rustc_hash::FxHashSet;

/// The parameters that `definitions` name, such as `t=0.3`, with their values.
///
/// A value is an equation of numbers and of the parameters before it.
///
/// # Errors
/// [`Rejected`] for what is no definition, a name that means something else or is given twice, and
/// a value that is no finite number.
pub fn define(
    definitions: &[String],
    vocabulary: &dyn Vocabulary,
) -> Result<Vec<(String, f64)>, Rejected> {
    let sources = Sources::new(definitions);
    let mut parameters: Vec<(String, f64)> = Vec::new();
    for (i, definition) in definitions.iter().enumerate() {
        let span = sources.all()[0].word(i);
        let defined = definition_of(definition, span, vocabulary, &parameters);
        match defined {
            Ok(parameter) => parameters.push(parameter),
            // Later values may depend on the faulty one: there is no telling what they mean.
            Err(diagnostics) => return Err(Rejected { diagnostics, sources }),
        }
    }
    Ok(parameters)
}

fn definition_of(
    text: &str,
    span: Span,
    vocabulary: &dyn Vocabulary,
    earlier: &[(String, f64)],
) -> Result<(String, f64), Vec<Diagnostic>> {
    let Some((before, value)) = text.split_once('=') else {
        let message = format!("the parameter `{text}` has no value");
        let cure = "write its name, `=` and a number, as in `t=0.3`";
        return Err(vec![Diagnostic::new(message).at(span, "").cure(cure)]);
    };
    let part = |start: usize, length: usize| {
        let start = span.start.saturating_add(start as u32);
        Span { start, end: start.saturating_add(length as u32), ..span }
    };
    let name = before.trim();
    let name_span = part(before.len() - before.trim_start().len(), name.len());
    if let Some(fault) = fault_of_name(name, vocabulary, earlier) {
        return Err(vec![fault.at(name_span, "")]);
    }
    let what = format!("the value of the parameter `{name}`");
    let value_span = part(before.len() + 1, value.len());
    let numbers = listed(value, value_span, &what, earlier)?;
    match numbers.as_slice() {
        [value] => Ok((name.to_owned(), *value)),
        _ => {
            let fault = Diagnostic::new(format!("{what} must be one number"));
            Err(vec![fault.at(value_span, format!("has {}", numbers.len()))])
        }
    }
}

/// The numbers that `text`, at `span`, lists; `what` names them in messages.
pub(super) fn listed(
    text: &str,
    span: Span,
    what: &str,
    parameters: &[(String, f64)],
) -> Result<Vec<f64>, Vec<Diagnostic>> {
    let scope = Scope { coordinates: Coordinates::Forbidden(what), parameters };
    let mut graph = Graph::new();
    let value_of = |name: &str| parameters.iter().find(|(known, _)| known == name).map(|p| p.1);
    let number = |equation: &Equation| {
        let node = equation.expression(&mut graph, &mut |graph, leaf| match leaf {
            Leaf::Parameter(name) => graph.parameter(name, value_of(name).unwrap_or(f64::NAN)),
            // Forbidden by the scope.
            Leaf::Points(_) => graph.constant(f64::NAN),
        });
        let present: Vec<f64> = graph.parameters().iter().map(|(_, value)| *value).collect();
        let value = Values::new(&graph, &present).of(node).filter(|value| value.is_finite());
        value.ok_or_else(|| {
            let message = format!("{what} must be a finite number");
            vec![Diagnostic::new(message).at(span, format!("`{equation}` is not"))]
        })
    };
    infix::list(text, span, scope)?.iter().map(number).collect()
}

/// Checks that the names of `parameters` are names and mean nothing else.
///
/// # Errors
/// A diagnostic for each that does not.
pub fn check(
    parameters: &[(String, f64)],
    vocabulary: &dyn Vocabulary,
) -> Result<(), Vec<Diagnostic>> {
    let fault =
        |(i, (name, _)): (usize, &(String, f64))| fault_of_name(name, vocabulary, &parameters[..i]);
    let faults: Vec<_> = parameters.iter().enumerate().filter_map(fault).collect();
    if faults.is_empty() { Ok(()) } else { Err(faults) }
}

/// What keeps `name` from being the name of a parameter after those `earlier`.
fn fault_of_name(
    name: &str,
    vocabulary: &dyn Vocabulary,
    earlier: &[(String, f64)],
) -> Option<Diagnostic> {
    let mut letters = name.chars();
    let is_name = letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name {
        let fault = Diagnostic::new(format!("`{name}` can't be the name of a parameter"));
        return Some(fault.cure("use letters, digits and `_`, a letter first"));
    }
    if earlier.iter().any(|(other, _)| other == name) {
        return Some(Diagnostic::new(format!("the parameter `{name}` is given twice")));
    }
    let meaning = other_meaning(name, vocabulary)?;
    let fault = Diagnostic::new(format!("the parameter `{name}` would hide {meaning}"));
    Some(fault.cure("give it another name"))
}

/// What `name` means in a program without parameters.
fn other_meaning(name: &str, vocabulary: &dyn Vocabulary) -> Option<String> {
    let spelling = normalized(name);
    if names::coordinate(name).is_some() {
        Some("the coordinate of that name".to_owned())
    } else if CONSTANTS.iter().any(|(known, _)| *known == name) {
        Some("the constant of that name".to_owned())
    } else if Function::named(name).is_some() {
        Some("the function of that name".to_owned())
    } else if let Some(word) = vocabulary.word(&spelling) {
        Some(format!("the word `{}` of the language", word.name))
    } else {
        let words = vocabulary.spellings().into_iter().filter_map(|word| vocabulary.word(word));
        let mut takers = words.filter(|w| w.arguments.iter().any(|a| a.name == spelling));
        takers.next().map(|word| format!("the argument `{spelling}` of `{}`", word.name))
    }
}

/// The names that the equations in `text` mention.
pub fn mentioned(text: &str) -> impl Iterator<Item = &str> {
    let found = lexemes(text, Span::NOWHERE).unwrap_or_default().into_iter();
    found.filter_map(|(lexeme, _)| if let Lexeme::Name(name) = lexeme { Some(name) } else { None })
}

/// The names of parameters that `items` use.
pub(super) fn used(items: &[Item]) -> FxHashSet<&str> {
    let equations = items.iter().flat_map(|item| match &item.operation {
        Operation::Equation(equation) => std::slice::from_ref(equation).iter().collect(),
        Operation::Word { values, .. } | Operation::Lattice { values, .. } => {
            values.iter().flatten().flat_map(Value::components).collect::<Vec<_>>()
        }
        Operation::Mesh(_) => Vec::new(),
    });
    let terms = equations.flat_map(Equation::terms);
    terms
        .filter_map(|term| match term {
            Term::Parameter(name) => Some(name.as_str()),
            Term::Number(_)
            | Term::Coordinate(_)
            | Term::Constant(_)
            | Term::Points(_)
            | Term::Negate
            | Term::Infix(_)
            | Term::Call(..) => None,
        })
        .collect()
}

/// What an argument of a word asks of its value, which may depend on parameters.
#[derive(Clone, Debug)]
pub struct Demand {
    word: String,
    argument: Argument,
    components: Vec<NodeId>,
    span: Span,
}

impl Demand {
    /// What `argument` of the word `word` asks of `components`, which the text at `span` gives.
    ///
    /// Components that vary in space are not judged: what is wrong at one point may lie outside of
    /// the solid.
    pub(super) fn new(word: &str, argument: Argument, components: Vec<NodeId>, span: Span) -> Self {
        Self { word: word.to_owned(), argument, components, span }
    }

    /// Whether the answer can change with the parameters of `graph`.
    pub(super) fn is_open(&self, graph: &Graph) -> bool {
        self.components.iter().any(|node| graph.as_constant(*node).is_none())
    }

    /// The fault of the argument where the parameter in slot `i` of `graph` is `values[i]`.
    #[must_use]
    pub fn objection(&self, graph: &Graph, values: &[f64]) -> Option<Diagnostic> {
        let Self { word, argument, components, span } = self;
        let mut evaluated = Values::new(graph, values);
        let fixed = components.iter().filter(|node| !depends::on_point(graph, **node));
        let present: Vec<f64> = fixed.map(|node| evaluated.of(*node).unwrap_or(f64::NAN)).collect();
        if present.is_empty() {
            return None;
        }
        let objection = argument.domain.objection(&present)?;
        let prefix = match argument.shape {
            Shape::Factor if present.len() > 1 => "each component of ",
            Shape::Number | Shape::Vector | Shape::Factor | Shape::Choice(_) => "",
        };
        let message = format!("{prefix}the `{}` of `{word}` {objection}", argument.name);
        let value: Vec<_> = present.iter().map(f64::to_string).collect();
        let mut label = format!("is {}", value.join(","));
        let slots = graph.parameters_of(components).into_iter();
        let named: Vec<_> = slots
            .filter_map(|slot| {
                let (name, _) = graph.parameters().get(slot.index())?;
                Some(format!("`{name}` is {}", values.get(slot.index())?))
            })
            .collect();
        if !named.is_empty() {
            label.push_str(&format!(" where {}", named.join(" and ")));
        }
        Some(Diagnostic::new(message).at(*span, label))
    }
}
