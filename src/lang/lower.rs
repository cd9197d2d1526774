//! Runs items on a stack of solids.
//!
//! Shapes, meshes and equations push; operations pop and push; what remains at the end is
//! intersected in its order.
//!
//! Source: the Cesogen paper, section 3.2.

use super::infix::{self, Coordinates, Scope};
use super::syntax::{Content, Equation, Item, Leaf, Located, Operation, Term, Value};
use super::word::{Given, Shape};
use super::{
    Action, Argument, Arguments, Demand, Diagnostic, Loaded, Loader, Span, Vocabulary, Word,
};
use crate::expr::defined::is_always_defined;
use crate::expr::{Graph, NodeId, OracleId, Output};
use crate::solid::Solid;
use crate::solid::motions::Motion;
use rustc_hash::FxHashMap;

/// What the items of a program make.
#[derive(Clone, Debug)]
pub struct Made {
    /// The intersection of what they leave on the stack.
    pub solid: Solid,
    /// The operands of that intersection, in order.
    pub operands: Vec<Solid>,
    /// What arguments ask of the parameters.
    pub demands: Vec<Demand>,
}

/// Runs `items`, putting expressions into `graph`.
///
/// The parameters become those of the graph, slot by slot.
///
/// # Errors
/// At least one diagnostic, in the order of the text.
pub fn run(
    items: &[Item],
    graph: &mut Graph,
    vocabulary: &dyn Vocabulary,
    loader: &mut dyn Loader,
    parameters: &[(String, f64)],
) -> Result<Made, Vec<Diagnostic>> {
    let nodes = parameters
        .iter()
        .map(|(name, value)| (name.clone(), graph.parameter(name, *value)))
        .collect();
    let values = parameters.iter().map(|(_, value)| *value).collect();
    let (meshes, points) = (FxHashMap::default(), FxHashMap::default());
    let (demands, alone) = (Vec::new(), items.len() == 1);
    let mut machine = Machine { graph, loader, nodes, values, meshes, points, demands, alone };
    let mut stack: Vec<Operand> = Vec::new();
    let mut faults = Vec::new();
    for item in items {
        let step = machine.step(item, &mut stack, vocabulary);
        if machine.graph.is_exhausted() {
            faults.push(too_large(item.span));
            break;
        }
        match step {
            Ok(made) => stack.push(made),
            Err(mut found) => {
                faults.append(&mut found.faults);
                if found.is_final {
                    break;
                }
                let stand_in = machine.graph.constant(f64::NAN);
                stack.push(Solid::unbounded(machine.graph, stand_in).into());
            }
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let demands = machine.demands;
    let operands: Vec<Solid> = stack.into_iter().map(|operand| operand.moved(graph)).collect();
    if let (true, Some(last)) = (graph.is_exhausted(), items.last()) {
        return Err(vec![too_large(last.span)]);
    }
    match Solid::intersection_of(graph, operands.clone()) {
        Some(solid) => Ok(Made { solid, operands, demands }),
        None => {
            let fault = Diagnostic::new("the program has no shape");
            Err(vec![fault.cure("give at least one shape, mesh file or equation")])
        }
    }
}

/// The fault of an item, at `span`, with which the expression becomes too large.
fn too_large(span: Span) -> Diagnostic {
    let fault = Diagnostic::new("the program's expression is too large");
    let cure = "nest fewer operations that repeat what they act on, such as `thickness`, motions \
                and maps";
    fault.at(span, "makes it larger than any that is taken").cure(cure)
}

/// A solid on the stack, with the motions that it has yet to make: together they cost as much as one.
struct Operand {
    solid: Solid,
    motions: Vec<(Motion, Span)>,
}

impl From<Solid> for Operand {
    fn from(solid: Solid) -> Self {
        Self { solid, motions: Vec::new() }
    }
}

impl Operand {
    fn moved(self, graph: &mut Graph) -> Solid {
        self.solid.moved(graph, &self.motions)
    }
}

/// Why a step failed, and whether steps after it make no sense.
struct Failed {
    faults: Vec<Diagnostic>,
    is_final: bool,
}

/// What the steps share.
struct Machine<'a> {
    graph: &'a mut Graph,
    loader: &'a mut dyn Loader,
    nodes: FxHashMap<String, NodeId>,
    values: Vec<f64>,
    meshes: FxHashMap<String, Loaded>,
    points: FxHashMap<String, OracleId>,
    demands: Vec<Demand>,
    /// Whether the program has but one item.
    alone: bool,
}

impl Machine<'_> {
    /// Pops the operands of `item` and returns its result.
    fn step(
        &mut self,
        item: &Item,
        stack: &mut Vec<Operand>,
        vocabulary: &dyn Vocabulary,
    ) -> Result<Operand, Failed> {
        let made = match &item.operation {
            Operation::Mesh(path) => self.mesh(path, item.span)?,
            Operation::Lattice { path, values } => {
                let word = Word::of_file(path, vocabulary.lattice_arguments());
                let arguments = self
                    .arguments(word, values)
                    .map_err(|faults| Failed { faults, is_final: false })?;
                let make = self.loader.lattice(path).map_err(|refusal| {
                    let message = format!("can't read the lattice `{path}`: {refusal}");
                    let faults = vec![Diagnostic::new(message).at(item.span, "").of_a_file()];
                    Failed { faults, is_final: false }
                })?;
                make(self.graph, &arguments)
            }
            Operation::Equation(equation) => {
                let field = self
                    .expression(equation, item.span)
                    .map_err(|fault| Failed { faults: vec![fault], is_final: false })?;
                let solid = Solid::unbounded(self.graph, field);
                // On its own, what is not a number is outside anyway, and can be counted.
                if self.alone { solid } else { self.defined(solid) }
            }
            Operation::Word { name, values } => {
                let Some(word) = vocabulary.word(name) else {
                    let fault = Diagnostic::new(format!("unknown word `{name}`"));
                    return Err(Failed { faults: vec![fault.at(item.span, "")], is_final: false });
                };
                return self.word(word, values, item.span, stack);
            }
        };
        Ok(made.located(item.span).into())
    }

    /// Pops the operands of `word`, which stands at `span`, and returns its result.
    fn word(
        &mut self,
        word: Word<'_>,
        values: &[Option<Value>],
        span: Span,
        stack: &mut Vec<Operand>,
    ) -> Result<Operand, Failed> {
        let needed = match word.action {
            Action::Shape(_) => 0,
            Action::Motion(_) | Action::Unary(_) => 1,
            Action::Binary(_) => 2,
        };
        if stack.len() < needed {
            return Err(too_few(word, span, stack.len(), needed));
        }
        let mut operands = stack.split_off(stack.len() - needed).into_iter();
        let arguments =
            self.arguments(word, values).map_err(|faults| Failed { faults, is_final: false })?;
        let varies = values.iter().flatten().flat_map(Value::components);
        let varies = varies.into_iter().any(Equation::has_coordinate);
        let made = match (word.action, operands.next(), operands.next()) {
            (Action::Motion(motion), Some(mut a), _) => {
                a.motions.push((motion(self.graph, &arguments), span));
                if !varies {
                    return Ok(a);
                }
                a.moved(self.graph)
            }
            (Action::Unary(apply), Some(a), _) => {
                let a = a.moved(self.graph);
                apply(self.graph, a, &arguments)
            }
            (Action::Binary(apply), Some(a), Some(b)) => {
                let (a, b) = (a.moved(self.graph), b.moved(self.graph));
                apply(self.graph, a, b, &arguments).map_err(|refusal| {
                    let fault = Diagnostic::new(format!("can't `{}`: {refusal}", word.name));
                    Failed { faults: vec![fault.at(span, "")], is_final: false }
                })?
            }
            (Action::Shape(make), ..) => make(self.graph, &arguments),
            (Action::Motion(_) | Action::Unary(_) | Action::Binary(_), ..) => {
                return Err(too_few(word, span, 0, needed));
            }
        };
        let made = if varies { self.defined(made) } else { made };
        Ok(made.located(span).into())
    }

    /// `solid` with the outside where its field may not be a number.
    ///
    /// Set operations know only more and less, so there what is not a number must be far outside.
    fn defined(&mut self, mut solid: Solid) -> Solid {
        if !is_always_defined(self.graph, solid.field) {
            let outside = self.graph.constant(f64::INFINITY);
            solid.field = self.graph.min(solid.field, outside);
        }
        solid
    }

    /// The distance to the mesh in the file `path`; a file named twice is read once.
    fn mesh(&mut self, path: &str, span: Span) -> Result<Solid, Failed> {
        let loaded = match self.meshes.get(path) {
            Some(loaded) => loaded.clone(),
            None => match self.loader.mesh(path) {
                Ok(loaded) => {
                    self.meshes.insert(path.to_owned(), loaded.clone());
                    loaded
                }
                Err(refusal) => {
                    let message = format!("can't read the mesh `{path}`: {refusal}");
                    let faults = vec![Diagnostic::new(message).at(span, "").of_a_file()];
                    return Err(Failed { faults, is_final: false });
                }
            },
        };
        let Loaded { distance, bounds } = loaded;
        let oracle = self.graph.add_oracle(&distance);
        let point = self.graph.point();
        let field = self.graph.oracle(oracle, Output::Value, point);
        Ok(Solid::within(self.graph, field, bounds, distance.lipschitz()))
    }

    /// The values of the arguments of `word`, defaults in place of those not given.
    fn arguments(
        &mut self,
        word: Word<'_>,
        values: &[Option<Value>],
    ) -> Result<Arguments, Vec<Diagnostic>> {
        let mut arguments = Arguments::default();
        let mut faults = Vec::new();
        for (i, argument) in word.arguments.iter().enumerate() {
            let given = match values.get(i).and_then(Option::as_ref) {
                Some(value) => Some(value.clone()),
                None => default(argument)?,
            };
            let Some(Value { content, span: Located(span) }) = given else {
                arguments.0.push(Given::Nothing);
                continue;
            };
            let components = match content {
                Content::Choice(_, place) => {
                    arguments.0.push(Given::Choice(place));
                    continue;
                }
                Content::Numbers(components) => components,
            };
            let nodes: Result<Vec<_>, _> =
                components.iter().map(|c| self.expression(c, span)).collect();
            let nodes = nodes.map_err(|fault| vec![fault])?;
            arguments.0.push(Given::Numbers(match nodes.as_slice() {
                [a, b, c] => [*a, *b, *c],
                [one, ..] => [*one; 3],
                [] => return Err(vec![Diagnostic::new("an argument is empty").at(span, "")]),
            }));
            let demand = Demand::new(word.name, *argument, nodes, span);
            faults.extend(demand.objection(self.graph, &self.values));
            if demand.is_open(self.graph) {
                self.demands.push(demand);
            }
        }
        if faults.is_empty() { Ok(arguments) } else { Err(faults) }
    }

    /// The node of `equation`, which stands at `span`; files of points are read once.
    fn expression(&mut self, equation: &Equation, span: Span) -> Result<NodeId, Diagnostic> {
        for term in equation.terms() {
            if let Term::Points(text) = term
                && !self.points.contains_key(text)
            {
                self.loader.check_points(text).map_err(|usage| {
                    let message = format!("`[{text}]` names no numbers at points of a file");
                    Diagnostic::new(message).at(span, "").cure(usage.cause)
                })?;
                let oracle = self.loader.points(text).map_err(|refusal| {
                    let message = format!("can't read the points `[{text}]`: {refusal}");
                    Diagnostic::new(message).at(span, "").of_a_file()
                })?;
                self.points.insert(text.clone(), self.graph.add_oracle(&oracle));
            }
        }
        let Self { nodes, points, graph, .. } = self;
        Ok(equation.expression(graph, &mut |graph, leaf| match leaf {
            Leaf::Parameter(name) => match nodes.get(name) {
                Some(node) => *node,
                None => graph.parameter(name, f64::NAN),
            },
            Leaf::Points(text) => {
                let point = graph.point();
                graph.oracle(points[text], Output::Value, point)
            }
        }))
    }
}

/// The default of `argument`; `None` if it has none.
fn default(argument: &Argument) -> Result<Option<Value>, Vec<Diagnostic>> {
    let Some(text) = argument.default() else { return Ok(None) };
    let content = if let Shape::Choice(words) = argument.shape {
        let place = words.iter().position(|word| *word == text);
        place.map(|place| Content::Choice(words[place], place))
    } else {
        let scope = Scope { coordinates: Coordinates::Forbidden(argument.name), parameters: &[] };
        Some(Content::Numbers(infix::list(text, Span::NOWHERE, scope)?))
    };
    Ok(content.map(|content| Value { content, span: Located(Span::NOWHERE) }))
}

/// The fault of an operation that finds too few solids on the stack.
fn too_few(word: Word<'_>, span: Span, found: usize, needed: usize) -> Failed {
    let name = word.name;
    let (message, cure) = if needed == 1 {
        (
            format!("`{name}` needs a shape before it"),
            format!("operations follow their shapes: SHAPE {name}"),
        )
    } else {
        (
            format!("`{name}` needs two shapes before it"),
            format!("operations follow their shapes: SHAPE SHAPE {name}"),
        )
    };
    let label = if found == 0 { "has none" } else { "has only one" };
    let fault = Diagnostic::new(message).at(span, label).cure(cure);
    Failed { faults: vec![fault], is_final: true }
}
