//! The one table of words: what each is called, takes, does and comes from.
//!
//! The parser, `alveole list`, `--help`, the completions and the reference in the README all read
//! it. A word is declared here and nowhere else; the periodic surfaces are rows of
//! [`CATALOGUE`](crate::cellular::tpms::CATALOGUE) and the unit cells of
//! [`CELLS`](crate::cellular::struts::table::CELLS), from which this table takes them.
//!
//! Offsets (`dilate`, `erode`, `shell`) are in units of the field. What a field is, [`Exactness`]
//! says: only for distances is an offset a length.

mod operations;
mod shapes;

pub use shapes::lattice;

use crate::expr::Graph;
use crate::lang::{
    Action, Argument, Arguments, Domain, MakeShape, Presence, Refusal, Shape, Vocabulary, Word,
};
use crate::solid::Solid;
use crate::solid::motions::Motion;
use operations::operations;
use rustc_hash::FxHashMap;
use shapes::LATTICE;
use std::sync::LazyLock;

/// What the values of a shape's field are, away from its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exactness {
    /// The signed distance to the surface, in model units.
    Distance,
    /// At most the distance in size: right in sign, too small away from the surface.
    Bound,
    /// Only the sign is right; offsets are differences of level.
    LevelSet,
}

impl Exactness {
    /// What to call it in lists.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Distance => "distance",
            Self::Bound => "bound",
            Self::LevelSet => "level set",
        }
    }
}

/// A row of the table.
pub struct Row {
    /// The word.
    pub name: &'static str,
    /// Other spellings, in lower case.
    pub aliases: &'static [&'static str],
    /// What it does, with its constructor.
    pub kind: Kind,
    /// Numbers that follow it.
    pub arguments: &'static [Argument],
    /// What it is or does: one line, lower case, no full stop.
    pub help: &'static str,
    /// Where it is defined.
    pub source: &'static str,
}

/// What a word does, with its constructor.
pub enum Kind {
    /// Makes a solid.
    Shape {
        /// What its field is.
        exactness: Exactness,
        /// What it belongs with.
        family: Family,
        /// Makes it.
        make: Box<MakeShape>,
    },
    /// Moves a solid.
    Motion(fn(&mut Graph, &Arguments) -> Motion),
    /// Changes a solid.
    Unary(fn(&mut Graph, Solid, &Arguments) -> Solid),
    /// Combines two solids.
    Binary(fn(&mut Graph, Solid, Solid, &Arguments) -> Result<Solid, Refusal>),
}

/// What a shape belongs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Shapes with a closed form.
    Primitive,
    /// Periodic surfaces.
    Surface {
        /// The formula, as an equation; see [`Surface::formula`](crate::cellular::tpms::Surface::formula).
        formula: &'static str,
    },
    /// Lattices of struts or plates.
    Cell,
    /// Foams and other solids from a seed.
    Random,
}

/// The table as the language reads it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Words;

impl Vocabulary for Words {
    fn word(&self, spelling: &str) -> Option<Word<'_>> {
        let row = &TABLE.rows[*TABLE.places.get(spelling)?];
        let action = match &row.kind {
            Kind::Shape { make, .. } => Action::Shape(make.as_ref()),
            Kind::Motion(motion) => Action::Motion(*motion),
            Kind::Unary(apply) => Action::Unary(*apply),
            Kind::Binary(apply) => Action::Binary(*apply),
        };
        Some(Word { name: row.name, arguments: row.arguments, action })
    }

    fn spellings(&self) -> Vec<&str> {
        rows().iter().flat_map(Row::spellings).collect()
    }

    fn lattice_arguments(&self) -> &[Argument] {
        &LATTICE
    }
}

impl Row {
    /// The name and the aliases.
    pub fn spellings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.name).chain(self.aliases.iter().copied())
    }

    /// How to write it: operands in capitals, optional arguments in brackets with their defaults.
    #[must_use]
    pub fn usage(&self) -> String {
        let mut usage = match self.kind {
            Kind::Shape { .. } => self.name.to_owned(),
            Kind::Motion(_) | Kind::Unary(_) => format!("SHAPE {}", self.name),
            Kind::Binary(_) => format!("SHAPE SHAPE {}", self.name),
        };
        for Argument { name, presence, .. } in self.arguments {
            usage.push_str(&match presence {
                Presence::Default(default) => format!(" [{name} {default}]"),
                Presence::Optional => format!(" [{name} {}]", name.to_uppercase()),
                Presence::Required => format!(" {}", name.to_uppercase()),
            });
        }
        usage
    }
}

/// Every word: shapes, periodic surfaces, cells, operations.
#[must_use]
pub fn rows() -> &'static [Row] {
    &TABLE.rows
}

/// The row of a word or alias, in lower case.
#[must_use]
pub fn row(spelling: &str) -> Option<&'static Row> {
    TABLE.places.get(spelling).map(|place| &TABLE.rows[*place])
}

struct Table {
    rows: Vec<Row>,
    places: FxHashMap<&'static str, usize>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let mut rows = shapes::rows();
    rows.extend(operations());
    let spellings = |(place, row): (usize, &Row)| {
        row.spellings().map(|spelling| (spelling, place)).collect::<Vec<_>>()
    };
    let places = rows.iter().enumerate().flat_map(spellings).collect();
    Table { rows, places }
});

const PAPER: &str = "Cesogen paper, section 3.2";
const PLANE_GEOMETRY: &str = "closed form";
const COORDINATES: &str = "cylinder and sphere coordinates, ISO 80000-2";
const IDENTITY: &str = "by definition";

const fn number(
    name: &'static str,
    domain: Domain,
    presence: Presence,
    meaning: &'static str,
) -> Argument {
    Argument { name, shape: Shape::Number, domain, presence, meaning }
}

const fn choice(
    name: &'static str,
    words: &'static [&'static str],
    presence: Presence,
    meaning: &'static str,
) -> Argument {
    Argument { name, shape: Shape::Choice(words), domain: Domain::Any, presence, meaning }
}

fn shape(
    name: &'static str,
    aliases: &'static [&'static str],
    exactness: Exactness,
    arguments: &'static [Argument],
    make: fn(&mut Graph, &Arguments) -> Solid,
) -> Row {
    let kind = Kind::Shape { exactness, family: Family::Primitive, make: Box::new(make) };
    Row { name, aliases, kind, arguments, help: "", source: "" }
}

fn motion(
    name: &'static str,
    aliases: &'static [&'static str],
    arguments: &'static [Argument],
    motion: fn(&mut Graph, &Arguments) -> Motion,
) -> Row {
    Row { name, aliases, kind: Kind::Motion(motion), arguments, help: "", source: "" }
}

fn unary(
    name: &'static str,
    aliases: &'static [&'static str],
    arguments: &'static [Argument],
    apply: fn(&mut Graph, Solid, &Arguments) -> Solid,
) -> Row {
    Row { name, aliases, kind: Kind::Unary(apply), arguments, help: "", source: "" }
}

fn binary(
    name: &'static str,
    aliases: &'static [&'static str],
    arguments: &'static [Argument],
    apply: fn(&mut Graph, Solid, Solid, &Arguments) -> Result<Solid, Refusal>,
) -> Row {
    Row { name, aliases, kind: Kind::Binary(apply), arguments, help: "", source: "" }
}

impl Row {
    /// The row with its help and source.
    fn help(self, help: &'static str, source: &'static str) -> Self {
        Self { help, source, ..self }
    }

    /// The row of a shape of `family`.
    fn of(mut self, belongs: Family) -> Self {
        if let Kind::Shape { family, .. } = &mut self.kind {
            *family = belongs;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cellular::tpms;
    use crate::expr::NodeId;
    use crate::geom::Axis;
    use crate::lang::infix::{self, Coordinates, Scope};
    use crate::lang::word::normalized;
    use crate::lang::{Leaf, names};
    use crate::solid::Span;
    use crate::solid::walk::value;

    #[test]
    fn no_spelling_means_two_things() {
        let mut spellings = Words.spellings();
        let count = spellings.len();
        spellings.sort_unstable();
        spellings.dedup();
        assert_eq!(spellings.len(), count);
        for spelling in spellings {
            assert_eq!(normalized(spelling), spelling);
            assert!(names::reserved().all(|name| name != spelling), "`{spelling}` is a name");
            assert!(!spelling.starts_with(['@', '-', '#']) && !spelling.contains(','));
            assert_eq!(row(spelling).unwrap().name, Words.word(spelling).unwrap().name);
        }
    }

    #[test]
    fn usage_shows_operands_arguments_and_defaults() {
        let check = |word: &str, usage: &str| assert_eq!(row(word).unwrap().usage(), usage);
        check("ball", "sphere");
        check("torus", "torus [major 0.75] [minor 0.25]");
        check("rotate", "SHAPE rotate ANGLE AXIS");
        check("difference", "SHAPE SHAPE difference");
    }

    #[test]
    fn the_spellings_of_table_1_are_known() {
        // The paper attests these; the plain names and the printed ones of the others are ours.
        for word in ["gyroid", "d-surface", "p-surface", "sphere", "cylinder", "box"] {
            assert_eq!(row(word).unwrap().name, word);
        }
        for (word, title) in
            [("c(i2-y**)", "C(I2-Y**)"), ("g'2", "G'2"), ("q*", "Q*"), ("+-y", "±Y")]
        {
            let surface = tpms::CATALOGUE.iter().find(|surface| surface.title == title).unwrap();
            assert_eq!(row(word).unwrap().name, surface.name);
        }
    }

    #[test]
    fn every_word_has_help_and_source() {
        for Row { name, help, source, arguments, .. } in rows() {
            assert!(!help.is_empty() && !help.ends_with('.') && help.len() < 80, "{name}: {help}");
            assert!(!source.is_empty(), "{name}");
            for argument in *arguments {
                assert!(!argument.meaning.is_empty(), "{name} {}", argument.name);
            }
        }
    }

    #[test]
    fn argument_names_are_no_names_of_equations_and_defaults_make_sense() {
        for Row { name, arguments, kind, .. } in rows() {
            for (i, argument) in arguments.iter().enumerate() {
                assert!(names::reserved().all(|known| known != argument.name));
                assert!(arguments[..i].iter().all(|other| other.name != argument.name));
                let is_shape = matches!(kind, Kind::Shape { .. });
                assert!(!is_shape || argument.default().is_some(), "{name} {}", argument.name);
                if let Shape::Choice(words) = argument.shape {
                    assert!(argument.default().is_none_or(|default| words.contains(&default)));
                } else if let Some(default) = argument.default() {
                    let values = crate::lang::numbers(default, "a default", &[]).unwrap();
                    assert_eq!(values.len(), if argument.shape == Shape::Vector { 3 } else { 1 });
                    assert_eq!(argument.domain.objection(&values), None, "{name}");
                }
            }
        }
    }

    #[test]
    fn formulas_of_surfaces_are_what_is_evaluated() {
        // `cx`, `s2y`, ... become parameters of the reader, bound to waves written in full.
        let waves: Vec<(String, f64)> = ["s", "c"]
            .into_iter()
            .flat_map(|wave| ["", "2", "3"].map(|k| format!("{wave}{k}")))
            .flat_map(|wave| ["x", "y", "z"].map(|axis| (format!("{wave}{axis}"), 0.0)))
            .collect();
        let scope = Scope { coordinates: Coordinates::Known, parameters: &waves };
        for surface in &tpms::CATALOGUE {
            let mut graph = Graph::new();
            let equation = infix::equation(surface.formula, Span::NOWHERE, scope).unwrap();
            let read = equation.expression(&mut graph, &mut |graph, leaf| match leaf {
                Leaf::Parameter(name) | Leaf::Points(name) => wave(graph, name),
            });
            let made = surface.field(&mut graph);
            for point in [[0.1, 0.27, 0.44], [-0.3, 0.62, 0.05], [0.81, -0.19, 0.33]] {
                let [a, b] = [read, made].map(|field| value(&graph, field, point));
                assert!((a - b).abs() < 1e-13, "{}: {a} is not {b}", surface.name);
            }
        }
    }

    /// The wave called `name`: `s2y` is sin(2 tau y).
    fn wave(graph: &mut Graph, name: &str) -> NodeId {
        use crate::expr::Unary;
        let mut letters = name.chars();
        let op = if letters.next() == Some('s') { Unary::Sin } else { Unary::Cos };
        let axis = Axis::ALL["xyz".find(letters.next_back().unwrap()).unwrap()];
        let harmonic: f64 = letters.as_str().parse().unwrap_or(1.0);
        let angle = graph.constant(harmonic * std::f64::consts::TAU);
        let coordinate = graph.coordinate(axis);
        let angle = graph.mul(angle, coordinate);
        graph.unary(op, angle)
    }
}
