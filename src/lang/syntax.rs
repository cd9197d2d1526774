//! What program text says: items, their arguments, and equations.
//!
//! An [`Equation`] is a list of terms in postfix order, so that nothing here recurses: neither
//! building, printing, comparing nor freeing. Printing gives text that reads back as the same.

use super::Span;
use super::names::{CONSTANTS, Function};
use crate::expr::{Binary, Graph, NodeId};
use crate::geom::Axis;
use std::fmt;

/// One step of a program.
#[derive(Clone, Debug)]
pub struct Item {
    /// What it does.
    pub operation: Operation,
    /// Its words.
    pub span: Span,
}

/// What a step of a program does.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// A word of the vocabulary.
    Word {
        /// The word's name.
        name: String,
        /// One value for each argument of the word; `None` where the text gives none.
        values: Vec<Option<Value>>,
    },
    /// A mesh file.
    Mesh(String),
    /// A lattice file.
    Lattice {
        /// The file.
        path: String,
        /// One value for each argument that may follow; `None` where the text gives none.
        values: Vec<Option<Value>>,
    },
    /// An equation in x, y and z.
    Equation(Equation),
}

/// The value of an argument.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// What it says.
    pub content: Content,
    /// The word that gives it.
    pub span: Located,
}

/// What the value of an argument says.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// One or three components.
    Numbers(Vec<Equation>),
    /// A word among the argument's choices, and its place there.
    Choice(&'static str, usize),
}

impl Value {
    /// The components; none for a choice.
    #[must_use]
    pub fn components(&self) -> &[Equation] {
        match &self.content {
            Content::Numbers(components) => components,
            Content::Choice(..) => &[],
        }
    }
}

/// A place that does not count when syntax is compared.
#[derive(Clone, Copy, Debug)]
pub struct Located(pub Span);

impl PartialEq for Located {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl PartialEq for Item {
    fn eq(&self, other: &Self) -> bool {
        self.operation == other.operation
    }
}

/// An equation, its terms in postfix order.
#[derive(Clone, Debug, PartialEq)]
pub struct Equation(pub(super) Vec<Term>);

/// A part of an equation; operators follow their operands.
#[derive(Clone, Debug, PartialEq)]
pub enum Term {
    /// A number without sign.
    Number(f64),
    /// A coordinate of the point.
    Coordinate(Axis),
    /// A named constant, by its position in [`CONSTANTS`].
    Constant(usize),
    /// A parameter.
    Parameter(String),
    /// Numbers at points of a file, as they stand in brackets.
    Points(String),
    /// The negative of the term before.
    Negate,
    /// An infix operator on the two terms before.
    Infix(Infix),
    /// A function of that many terms before.
    Call(Function, usize),
}

/// A part of an equation that others know the node of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaf<'a> {
    /// The parameter of this name.
    Parameter(&'a str),
    /// Numbers at points of a file; see [`Term::Points`].
    Points(&'a str),
}

/// An infix operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are the operations'")]
pub enum Infix {
    Add,
    Sub,
    Mul,
    Div,
    Pow,
}

impl Infix {
    /// The table of operators: sign, precedence (greater binds tighter), operation.
    ///
    /// Negation stands between multiplication and power: -x^2 is -(x^2), -x*y is (-x)*y.
    const TABLE: [(char, u8, Self); 5] = [
        ('+', 1, Self::Add),
        ('-', 1, Self::Sub),
        ('*', 2, Self::Mul),
        ('/', 2, Self::Div),
        ('^', 4, Self::Pow),
    ];
    /// Precedence of negation.
    pub const NEGATION: u8 = 3;

    /// The operator written `sign`.
    #[must_use]
    pub fn written(sign: char) -> Option<Self> {
        Self::TABLE.iter().find(|(known, ..)| *known == sign).map(|(.., infix)| *infix)
    }

    /// Its precedence; greater binds tighter.
    #[must_use]
    pub fn precedence(self) -> u8 {
        Self::TABLE[self as usize].1
    }

    /// Whether a chain of it groups from the right: powers do.
    #[must_use]
    pub const fn is_right_associative(self) -> bool {
        matches!(self, Self::Pow)
    }

    const fn sign(self) -> char {
        Self::TABLE[self as usize].0
    }

    const fn operation(self) -> Binary {
        match self {
            Self::Add => Binary::Add,
            Self::Sub => Binary::Sub,
            Self::Mul => Binary::Mul,
            Self::Div => Binary::Div,
            Self::Pow => Binary::Pow,
        }
    }
}

impl Equation {
    /// The terms in postfix order.
    #[must_use]
    pub fn terms(&self) -> &[Term] {
        &self.0
    }

    /// Whether the point occurs in it.
    #[must_use]
    pub fn has_coordinate(&self) -> bool {
        self.0.iter().any(|term| matches!(term, Term::Coordinate(_) | Term::Points(_)))
    }

    /// Its expression, where `leaf` makes the nodes of parameters and of numbers at points.
    ///
    /// # Panics
    /// Never for equations read from text.
    pub fn expression(
        &self,
        graph: &mut Graph,
        leaf: &mut dyn FnMut(&mut Graph, Leaf<'_>) -> NodeId,
    ) -> NodeId {
        let mut stack: Vec<NodeId> = Vec::new();
        for term in &self.0 {
            let node = match term {
                Term::Number(value) => graph.constant(*value),
                Term::Coordinate(axis) => graph.coordinate(*axis),
                Term::Constant(index) => graph.constant(CONSTANTS[*index].1),
                Term::Parameter(name) => leaf(graph, Leaf::Parameter(name)),
                Term::Points(text) => leaf(graph, Leaf::Points(text)),
                Term::Negate => {
                    let [a] = operands(&mut stack);
                    graph.neg(a)
                }
                Term::Infix(infix) => {
                    let [a, b] = operands(&mut stack);
                    graph.binary(infix.operation(), a, b)
                }
                Term::Call(Function::Unary(op), _) => {
                    let [a] = operands(&mut stack);
                    graph.unary(*op, a)
                }
                Term::Call(Function::Binary(op), count) => {
                    let rest = stack.split_off(stack.len() - (count - 1));
                    let [first] = operands(&mut stack);
                    rest.into_iter().fold(first, |a, b| graph.binary(*op, a, b))
                }
                Term::Call(Function::Clamp, _) => {
                    let [a, lo, hi] = operands(&mut stack);
                    let raised = graph.max(a, lo);
                    graph.min(raised, hi)
                }
            };
            stack.push(node);
        }
        let [root] = operands(&mut stack);
        root
    }
}

/// The last `N` nodes, in order.
fn operands<const N: usize>(stack: &mut Vec<NodeId>) -> [NodeId; N] {
    let rest = stack.split_off(stack.len() - N);
    rest.try_into().expect("an equation's terms are in postfix order, each with its operands")
}

/// Text that reads back as the same equation, with the parentheses it needs.
impl fmt::Display for Equation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Precedence of what needs no parentheses.
        const ATOM: u8 = 5;
        let mut stack: Vec<(String, u8)> = Vec::new();
        let enclosed = |(text, precedence): (String, u8), needed: u8| {
            if precedence < needed { format!("({text})") } else { text }
        };
        for term in &self.0 {
            let piece = match term {
                Term::Number(value) => (number(*value), ATOM),
                Term::Coordinate(axis) => (["x", "y", "z"][axis.index()].to_owned(), ATOM),
                Term::Constant(index) => (CONSTANTS[*index].0.to_owned(), ATOM),
                Term::Parameter(name) => (name.clone(), ATOM),
                Term::Points(text) => (format!("[{text}]"), ATOM),
                Term::Negate => {
                    let a = stack.pop().unwrap_or_default();
                    (format!("-{}", enclosed(a, Infix::NEGATION)), Infix::NEGATION)
                }
                Term::Infix(infix) => {
                    let (b, a) = (stack.pop().unwrap_or_default(), stack.pop().unwrap_or_default());
                    let own = infix.precedence();
                    let right = infix.is_right_associative();
                    // A negation may stand to the right of a power, where its precedence is the
                    // reader's: 2^-x.
                    let negated = right && b.1 == Infix::NEGATION;
                    let b_needs = if negated { 0 } else { own + u8::from(!right) };
                    let mut text = enclosed(a, own + u8::from(right));
                    text.push(infix.sign());
                    text.push_str(&enclosed(b, b_needs));
                    (text, own)
                }
                Term::Call(function, count) => {
                    let arguments = stack.split_off(stack.len().saturating_sub(*count));
                    let list: Vec<_> = arguments.into_iter().map(|(text, _)| text).collect();
                    (format!("{}({})", function.name(), list.join(",")), ATOM)
                }
            };
            stack.push(piece);
        }
        f.write_str(&stack.pop().unwrap_or_default().0)
    }
}

/// The shortest text that reads back as `value`.
fn number(value: f64) -> String {
    let (plain, scientific) = (format!("{value}"), format!("{value:e}"));
    if plain.len() <= scientific.len() + 3 { plain } else { scientific }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Content::Choice(word, _) = self.content {
            return f.write_str(word);
        }
        for (i, component) in self.components().iter().enumerate() {
            if i > 0 {
                f.write_str(",")?;
            }
            write!(f, "{component}")?;
        }
        Ok(())
    }
}

const _: () = {
    // The table is indexed by the operators' own numbers.
    let mut i = 0;
    while i < Infix::TABLE.len() {
        assert!(Infix::TABLE[i].2 as usize == i);
        i += 1;
    }
};
