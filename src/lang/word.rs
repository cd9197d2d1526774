//! What the language asks of those who know shapes and files.

use super::{Diagnostic, Span};
use crate::expr::{Graph, NodeId, Oracle};
use crate::geom::Aabb;
use crate::solid::Solid;
use crate::solid::motions::Motion;
use std::borrow::Cow;
use std::sync::Arc;

/// Knows the words of the language.
pub trait Vocabulary {
    /// The word spelt `spelling`, which is in lower case with `-` for `_`.
    fn word(&self, spelling: &str) -> Option<Word<'_>>;

    /// Every spelling, for suggestions.
    fn spellings(&self) -> Vec<&str>;

    /// What may follow the name of a lattice file, as it may a shape.
    fn lattice_arguments(&self) -> &[Argument] {
        &[]
    }
}

/// A word of the language.
#[derive(Clone, Copy)]
pub struct Word<'a> {
    /// Its first spelling.
    pub name: &'a str,
    /// Numbers that follow it.
    pub arguments: &'a [Argument],
    /// What it does.
    pub action: Action<'a>,
}

/// What a word does to the stack of solids.
#[derive(Clone, Copy)]
pub enum Action<'a> {
    /// Pushes a solid. Its arguments are optional and given by name.
    Shape(&'a MakeShape),
    /// Moves a solid. Its required arguments may go without their names.
    Motion(fn(&mut Graph, &Arguments) -> Motion),
    /// Pops one solid and pushes one. Its required arguments may go without their names.
    Unary(fn(&mut Graph, Solid, &Arguments) -> Solid),
    /// Pops two solids and pushes one, or says why there is none. Its required arguments may go
    /// without their names.
    Binary(fn(&mut Graph, Solid, Solid, &Arguments) -> Result<Solid, Refusal>),
}

/// Makes the solid of a shape word.
pub type MakeShape = dyn Fn(&mut Graph, &Arguments) -> Solid + Send + Sync;

impl<'a> Word<'a> {
    /// The name of a file that will make a shape, in the place of a word while text is read.
    pub(super) fn of_file(name: &'a str, arguments: &'a [Argument]) -> Self {
        fn nothing(graph: &mut Graph, _: &Arguments) -> Solid {
            let outside = graph.constant(f64::INFINITY);
            Solid::unbounded(graph, outside)
        }
        Self { name, arguments, action: Action::Shape(&nothing) }
    }
}

/// A number, three or a choice, that follows a word.
///
/// Numbers of operations may be equations in x, y and z; those of shapes may not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Argument {
    /// The name that may stand before the value.
    pub name: &'static str,
    /// How many components it has.
    pub shape: Shape,
    /// Which values make sense.
    pub domain: Domain,
    /// What it means to leave it out.
    pub presence: Presence,
    /// What it is, with its unit, in a few words.
    pub meaning: &'static str,
}

/// What it means to leave an argument out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// That the text is at fault.
    Required,
    /// That it has this value.
    Default(&'static str),
    /// That the word does without.
    Optional,
}

impl Argument {
    /// The value where the text gives none, if there is one.
    #[must_use]
    pub const fn default(&self) -> Option<&'static str> {
        match self.presence {
            Presence::Required | Presence::Optional => None,
            Presence::Default(text) => Some(text),
        }
    }

    /// Whether the text must give it.
    #[must_use]
    pub const fn is_required(&self) -> bool {
        matches!(self.presence, Presence::Required)
    }
}

/// What the value of an argument consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One.
    Number,
    /// Three, in one word, with commas.
    Vector,
    /// Three, or one that stands for all three.
    Factor,
    /// One of these words.
    Choice(&'static [&'static str]),
}

/// Which values of an argument make sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// All finite values.
    Any,
    /// Zero and above.
    NotNegative,
    /// Above zero, each component.
    Positive,
    /// From 0 to 1.
    Fraction,
    /// Above 0 and below 1.
    ProperFraction,
    /// Each component differs from zero.
    EachNonzero,
    /// Some component differs from zero.
    SomeNonzero,
    /// Whole numbers from the first to the second. No parameter may give them.
    Whole(u64, u64),
    /// From 0 to a right angle, in radians, each component. No parameter may give it.
    Cone,
}

impl Domain {
    /// What is wrong with the value `components`, if anything; it completes "must ...".
    #[must_use]
    pub fn objection(self, components: &[f64]) -> Option<Cow<'static, str>> {
        let all = |holds: fn(f64) -> bool| components.iter().all(|&c| holds(c));
        let right_angle = std::f64::consts::FRAC_PI_2;
        let (sound, objection) = match self {
            Self::Any => (true, ""),
            Self::NotNegative => (all(|c| c >= 0.0), "must not be negative"),
            Self::Positive => (all(|c| c > 0.0), "must be positive"),
            Self::Fraction => (all(|c| (0.0..=1.0).contains(&c)), "must be from 0 to 1"),
            Self::ProperFraction => (all(|c| c > 0.0 && c < 1.0), "must lie between 0 and 1"),
            Self::EachNonzero => (all(|c| c != 0.0), "must not be zero"),
            Self::SomeNonzero => (!all(|c| c == 0.0), "must not be the zero vector"),
            Self::Cone => (
                components.iter().all(|c| (0.0..=right_angle).contains(c)),
                "must be from 0 to pi/2",
            ),
            Self::Whole(least, most) => {
                let range = least as f64..=most as f64;
                if components.iter().all(|c| range.contains(c) && c.fract() == 0.0) {
                    (true, "")
                } else {
                    return Some(format!("must be a whole number from {least} to {most}").into());
                }
            }
        };
        if !all(f64::is_finite) {
            Some("must be a finite number".into())
        } else {
            (!sound).then_some(objection.into())
        }
    }

    /// Whether a parameter may give the value: it may not where the value decides which expression is
    /// made, not what the expression yields.
    #[must_use]
    pub const fn takes_parameters(self) -> bool {
        match self {
            Self::Any
            | Self::NotNegative
            | Self::Positive
            | Self::Fraction
            | Self::ProperFraction
            | Self::EachNonzero
            | Self::SomeNonzero => true,
            Self::Whole(..) | Self::Cone => false,
        }
    }
}

/// Values of a word's arguments, in the order of their declaration.
#[derive(Clone, Debug, Default)]
pub struct Arguments(pub(super) Vec<Given>);

/// The value of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Given {
    /// There is none.
    Nothing,
    /// The components; one number three times.
    Numbers([NodeId; 3]),
    /// The place of the word chosen among its [choices](Shape::Choice).
    Choice(usize),
}

impl Arguments {
    /// The value of argument `index`, a number.
    ///
    /// # Panics
    /// If the word declares fewer arguments, or that one may be left out or is a choice.
    #[must_use]
    pub fn number(&self, index: usize) -> NodeId {
        self.vector(index)[0]
    }

    /// The components of argument `index`, a vector or factor.
    ///
    /// # Panics
    /// If the word declares fewer arguments, or that one may be left out or is a choice.
    #[must_use]
    pub fn vector(&self, index: usize) -> [NodeId; 3] {
        self.optional(index).expect("a required argument, or one with a default, has a value")
    }

    /// The components of argument `index`, a number, vector or factor; `None` if it is left out.
    ///
    /// # Panics
    /// If the word declares fewer arguments.
    #[must_use]
    pub fn optional(&self, index: usize) -> Option<[NodeId; 3]> {
        match self.0[index] {
            Given::Numbers(components) => Some(components),
            Given::Nothing | Given::Choice(_) => None,
        }
    }

    /// The place of the word given for argument `index` among its choices; `None` if it is left
    /// out or is no choice.
    ///
    /// # Panics
    /// If the word declares fewer arguments.
    #[must_use]
    pub fn choice(&self, index: usize) -> Option<usize> {
        match self.0[index] {
            Given::Choice(place) => Some(place),
            Given::Nothing | Given::Numbers(_) => None,
        }
    }
}

/// Reads the files that a program names.
pub trait Loader {
    /// The text of the file `path` of an `@path` word.
    ///
    /// # Errors
    /// [`Refusal`] if it can't be read.
    fn text(&mut self, path: &str) -> Result<String, Refusal>;

    /// Whether `word` is named like a mesh file, whether or not the file exists.
    fn is_mesh(&self, word: &str) -> bool;

    /// The field of the mesh file `path`.
    ///
    /// # Errors
    /// [`Refusal`] if it can't be read or is no mesh.
    fn mesh(&mut self, path: &str) -> Result<Loaded, Refusal>;

    /// Whether `word` is named like a lattice file, whether or not the file exists.
    fn is_lattice(&self, _word: &str) -> bool {
        false
    }

    /// What makes the lattice of the file `path` from its
    /// [arguments](Vocabulary::lattice_arguments).
    ///
    /// # Errors
    /// [`Refusal`] if it can't be read or is no lattice.
    fn lattice(&mut self, _path: &str) -> Result<Arc<MakeShape>, Refusal> {
        Err(Refusal { cause: "lattice files can't be read here".to_owned() })
    }

    /// Whether `text`, as it stands in brackets in an equation, names numbers at points of a file.
    ///
    /// # Errors
    /// [`Refusal`] that says what to write, if it does not.
    fn check_points(&self, _text: &str) -> Result<(), Refusal> {
        Ok(())
    }

    /// The numbers at points that `text` names, as it stands in brackets in an equation: a file, and
    /// what of it is meant.
    ///
    /// # Errors
    /// [`Refusal`] if it can't be read or holds no points.
    fn points(&mut self, _text: &str) -> Result<Arc<dyn Oracle>, Refusal> {
        Err(Refusal { cause: "files of points can't be read here".to_owned() })
    }

    /// The program text for `word`, which stands at `span`, if it is the input of another tool.
    ///
    /// # Errors
    /// A diagnostic if it is one, and can't be read or translated.
    fn translation(
        &mut self,
        _word: &str,
        _span: Span,
    ) -> Option<Result<Translation, Box<Diagnostic>>> {
        None
    }
}

/// A program text that stands for a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Translation {
    /// What to call it in messages.
    pub name: String,
    /// The text, as a file would hold it.
    pub text: String,
}

/// The distance to a mesh and the box around it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The signed distance.
    pub distance: Arc<dyn Oracle>,
    /// The box around the mesh.
    pub bounds: Aabb,
}

/// Why a file or a word can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{cause}")]
pub struct Refusal {
    /// What went wrong, in lower case, without the name of the file or word.
    pub cause: String,
}

/// `word` as vocabularies spell it: lower case, `-` for `_`.
#[must_use]
pub fn normalized(word: &str) -> Cow<'_, str> {
    // As most words are written.
    if word.bytes().all(|c| c.is_ascii() && !c.is_ascii_uppercase() && c != b'_') {
        return Cow::Borrowed(word);
    }
    Cow::Owned(word.to_lowercase().replace('_', "-"))
}
