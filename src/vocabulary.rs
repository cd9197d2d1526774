//! The one table of words: what each is called, takes, does and comes from.
//!
//! The parser, `alveole list`, `--help`, the completions and the reference in the README all read
//! it. A word is declared here and nowhere else; the periodic surfaces are rows of
//! [`tpms::CATALOGUE`] and the unit cells of [`table::CELLS`], from which this table takes them.
//!
//! Offsets (`dilate`, `erode`, `shell`) are in units of the field. What a field is, [`Exactness`]
//! says: only for distances is an offset a length.

use crate::cellular::fill::{Filling, Trim, fill};
use crate::cellular::spinodoid::{self, Spinodoid};
use crate::cellular::struts::voronoi::{self, Part};
use crate::cellular::struts::{Cell, Sizes, bubbles, table};
use crate::cellular::tpms;
use crate::expr::{Graph, NodeId};
use crate::geom::Axis;
use crate::lang::{
    Action, Argument, Arguments, Domain, MakeShape, Presence, Shape, Vocabulary, Word,
};
use crate::solid::blends::Ramp;
use crate::solid::maps::{Cylindrical, Spherical};
use crate::solid::motions::Motion;
use crate::solid::walls::Method;
use crate::solid::{Solid, primitives};
use rustc_hash::FxHashMap;
use std::sync::{Arc, LazyLock};

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
    Binary(fn(&mut Graph, Solid, Solid, &Arguments) -> Solid),
}

/// What a shape belongs with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Shapes with a closed form.
    Primitive,
    /// Periodic surfaces.
    Surface {
        /// The formula, as an equation; see [`tpms::Surface::formula`].
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
    let mut rows = shapes();
    rows.extend(tpms::CATALOGUE.iter().map(surface));
    rows.extend(table::CELLS.iter().map(cell));
    rows.extend(random());
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

fn shapes() -> Vec<Row> {
    use Exactness::{Bound, Distance};
    vec![
        shape("sphere", &["ball"], Distance, &[], |graph, _| primitives::sphere(graph))
            .help("the ball of radius 1 around the origin", PAPER),
        shape("cylinder", &[], Distance, &[], |graph, _| primitives::cylinder(graph))
            .help("the cylinder of radius 1 about the z axis, unbounded along it", PAPER),
        shape("box", &["cube"], Distance, &[], |graph, _| primitives::cube(graph))
            .help("the cube [-1, 1]^3", PAPER),
        shape("rounded-box", &["rounded-cube"], Distance, ROUNDED_BOX, |graph, given| {
            primitives::rounded_cube(graph, given.number(0))
        })
        .help("the cube [-1, 1]^3 with rounded edges and corners", PLANE_GEOMETRY),
        shape("torus", &[], Distance, TORUS, |graph, given| {
            primitives::torus(graph, given.number(0), given.number(1))
        })
        .help("the torus about the z axis", PLANE_GEOMETRY),
        shape("cone", &[], Distance, CONE, |graph, given| {
            primitives::cone(graph, given.number(0), given.number(1))
        })
        .help("the cone about the z axis, its tip up, centred in height", PLANE_GEOMETRY),
        shape("capsule", &[], Distance, CAPSULE, |graph, given| {
            primitives::capsule(graph, given.number(0), given.number(1))
        })
        .help("a cylinder along the z axis with round ends", PLANE_GEOMETRY),
        shape("plane", &["half-space"], Distance, PLANE, |graph, given| {
            primitives::half_space(graph, given.vector(0), given.number(1))
        })
        .help("the half space below a plane, unbounded", PLANE_GEOMETRY),
        shape("ellipsoid", &[], Bound, ELLIPSOID, |graph, given| {
            primitives::ellipsoid(graph, given.vector(0))
        })
        .help("the ellipsoid around the origin", PLANE_GEOMETRY),
        shape("octahedron", &[], Distance, OCTAHEDRON, |graph, given| {
            primitives::octahedron(graph, given.number(0))
        })
        .help(
            "the octahedron around the origin, its tips on the axes",
            "Quilez, Distance functions",
        ),
    ]
}

fn surface(surface: &'static tpms::Surface) -> Row {
    let tpms::Surface { name, aliases, help, formula, .. } = *surface;
    Row {
        name,
        aliases,
        kind: Kind::Shape {
            exactness: Exactness::LevelSet,
            family: Family::Surface { formula },
            make: Box::new(|graph, _| surface.solid(graph)),
        },
        arguments: &[],
        help,
        source: "Cesogen paper, Table 1",
    }
}

fn cell(row: &'static table::Row) -> Row {
    let table::Row { name, aliases, help, source, .. } = *row;
    let is_of_plates = row.is_of_plates();
    Row {
        name,
        aliases,
        kind: Kind::Shape {
            exactness: Exactness::Bound,
            family: Family::Cell,
            make: Box::new(move |graph, given| {
                // A cell has struts or plates; the size of what it has not is not looked at.
                let (size, fillet) = (given.number(0), given.number(1));
                row.solid(graph, Sizes { radius: size, thickness: size, fillet })
            }),
        },
        arguments: if is_of_plates { PLATES } else { STRUTS },
        help,
        source,
    }
}

fn random() -> Vec<Row> {
    vec![
        shape("voronoi-struts", &["voronoi"], Exactness::Bound, FOAM_STRUTS, |graph, given| {
            foam(graph, given, Part::Struts)
        })
        .help("the edges of the bubbles of a random foam, of period 1", VORONOI)
        .of(Family::Random),
        shape(
            "voronoi-walls",
            &["voronoi-plates"],
            Exactness::Bound,
            FOAM_WALLS,
            |graph, given| foam(graph, given, Part::Walls),
        )
        .help("the faces of the bubbles of a random foam, of period 1", VORONOI)
        .of(Family::Random),
        shape("spinodoid", &[], Exactness::LevelSet, SPINODOID, |graph, given| {
            let number = |index: usize| fixed(graph, given.number(index));
            let (seed, waves) = (number(0) as u64, number(1) as usize);
            let cones = given.vector(2).map(|angle| fixed(graph, angle));
            Spinodoid { seed, waves, cones }.solid(graph)
        })
        .help("a sum of random waves of length 1, as spinodal decomposition leaves", KUMAR)
        .of(Family::Random),
    ]
}

const VORONOI: &str = "Voronoi cells of Mitchell's points";
const KUMAR: &str = "Kumar et al. 2020, doi:10.1038/s41524-020-0341-6";

/// The foam that the arguments of a word ask for: seed, bubbles, size and fillet.
fn foam(graph: &mut Graph, given: &Arguments, part: Part) -> Solid {
    let [seed, count] = [0, 1].map(|index| fixed(graph, given.number(index)));
    let points = voronoi::random_points(seed as u64, count as usize);
    let (size, fillet) = (given.number(2), given.number(3));
    if part == Part::Walls && graph.as_constant(fillet) == Some(0.0) {
        return bubbles::walls(graph, &points, [false; 3], size);
    }
    voronoi::foam(&points, part).solid(graph, Sizes { radius: size, thickness: size, fillet })
}

/// The value of an argument that takes no parameters.
fn fixed(graph: &Graph, node: NodeId) -> f64 {
    graph.as_constant(node).expect("an equation of numbers is a constant of the graph")
}

/// What makes the lattice of a cell that a file holds, from [`Words::lattice_arguments`].
#[must_use]
pub fn lattice(cell: Cell) -> Arc<MakeShape> {
    Arc::new(move |graph, given| {
        let [radius, thickness, fillet] = [0, 1, 2].map(|index| given.number(index));
        cell.solid(graph, Sizes { radius, thickness, fillet })
    })
}

fn operations() -> Vec<Row> {
    vec![
        unary("complement", &[], &[], |graph, a, _| a.complement(graph))
            .help("what is outside: -f; unbounded", PAPER),
        unary("dilate", &[], DILATE, |graph, a, given| a.dilate(graph, given.number(0)))
            .help("grows the last shape only: f - offset", "Cesogen paper, equation 3"),
        unary("erode", &[], ERODE, |graph, a, given| a.erode(graph, given.number(0)))
            .help("shrinks the last shape only: f + offset", "Cesogen paper, equation 4"),
        unary("shell", &[], SHELL, |graph, a, given| a.shell(graph, given.number(0))).help(
            "a wall on both sides of the surface: |f| - thickness/2",
            "Cesogen paper, equation 5",
        ),
        motion("translate", &["move"], TRANSLATE, |_, given| Motion::Translate(given.vector(0)))
            .help("moves the last shape", "Cesogen paper, equation 6"),
        motion("scale", &[], SCALE, |_, given| Motion::Scale(given.vector(0))).help(
            "scales the last shape and its levels; a negative factor mirrors",
            "Cesogen paper, equation 7",
        ),
        motion("rotate", &[], ROTATE, |graph, given| {
            Motion::rotate(graph, given.number(0), given.vector(1))
        })
        .help(
            "turns the last shape: `rotate pi/2 0,0,1` carries (1,0,0) to (0,-1,0)",
            "Cesogen paper, equation 8",
        ),
        unary("sheet", &[], &[], |graph, a, _| a.sheet(graph))
            .help("the surface itself, without volume: |f|; to be dilated", IDENTITY),
        unary("thickness", &["wall"], THICKNESS, |graph, a, given| {
            a.wall(graph, given.number(0), Method::ALL[given.choice(1).unwrap_or(0)])
        })
        .help("a wall of that true thickness about the surface", "Hartmann 1999"),
        unary("cylindrical", &[], CYLINDRICAL, |graph, a, given| {
            let number = |index: usize| given.optional(index).map(|[value, ..]| value);
            let (around, radius) = (given.number(0), given.number(1));
            let map = Cylindrical { around, radius, radial: number(2), axial: number(3) };
            a.cylindrical(graph, map)
        })
        .help("bends cells of length 1 around the z axis; unbounded", COORDINATES),
        unary("spherical", &[], SPHERICAL, |graph, a, given| {
            let (around, along, radius) = (given.number(0), given.number(1), given.number(2));
            let radial = given.optional(3).map(|[value, ..]| value);
            a.spherical(graph, Spherical { around, along, radius, radial })
        })
        .help("bends cells of length 1 around the origin; unbounded", COORDINATES),
        unary("conform", &["map"], CONFORM, |graph, a, given| a.mapped(graph, given.vector(0)))
            .help("pulls the shape back by three equations: f(u,v,w); unbounded", IDENTITY),
        unary("density", &[], DENSITY, |graph, a, given| a.density(graph, given.number(0)))
            .help("the level at which it fills that share of the part it is put in", IDENTITY),
        unary("stretch", &[], STRETCH, |graph, a, given| {
            a.stretch(graph, Axis::ALL[given.choice(0).unwrap_or(0)], given.number(1))
        })
        .help("gives cells of length 1 another one along an axis; levels stay", IDENTITY),
        binary("union", &[], &[], |graph, a, b, _| a.union(graph, b)).help(
            "what is in either of the last two shapes: min(f, g)",
            "Cesogen paper, equation 9",
        ),
        binary("intersection", &["intersect"], &[], |graph, a, b, _| a.intersection(graph, b))
            .help(
                "what is in both of the last two shapes: max(f, g)",
                "Cesogen paper, equation 10",
            ),
        binary("difference", &["subtract"], &[], |graph, a, b, _| a.difference(graph, b)).help(
            "the shape before the last without the last: max(f, -g)",
            "Cesogen paper, equation 11",
        ),
        binary("rounded-union", &["smooth-union"], ROUNDED, |graph, a, b, given| {
            a.rounded_union(graph, b, given.number(0))
        })
        .help("the union of the last two shapes with fillets between them", "hg_sdf, Mercury"),
        binary("rounded-intersection", &["smooth-intersection"], ROUNDED, |graph, a, b, given| {
            a.rounded_intersection(graph, b, given.number(0))
        })
        .help("the intersection of the last two shapes with rounded edges", "hg_sdf, Mercury"),
        binary("rounded-difference", &["smooth-difference"], ROUNDED, |graph, a, b, given| {
            a.rounded_difference(graph, b, given.number(0))
        })
        .help("the shape before the last without the last, edges rounded", "hg_sdf, Mercury"),
        binary("fill", &[], FILL, |graph, part, lattice, given| {
            let number = |index: usize| given.optional(index).map(|[value, ..]| value);
            let filling = Filling {
                size: given.optional(0),
                density: number(1),
                thickness: number(2),
                skin: number(3),
                trim: Trim::ALL[given.choice(4).unwrap_or(0)],
            };
            fill(graph, part, lattice, filling)
        })
        .help("the shape before the last filled with the last, and its skin", IDENTITY),
        binary("blend", &[], BLEND, |graph, a, b, given| {
            let ramp = Ramp::ALL[given.choice(1).unwrap_or(0)];
            let weight = ramp.weight(graph, given.number(0), given.number(2));
            a.blend(graph, b, weight, given.number(3))
        })
        .help(
            "passes from the shape before the last to the last as a weight goes from 0 to 1",
            "ASLI, Perez-Boerema et al. 2022",
        ),
    ]
}

const ROUNDED_BOX: &[Argument] =
    &[number("radius", Domain::Fraction, Presence::Default("0.25"), "radius of the edges")];
const TORUS: &[Argument] = &[
    number(
        "major",
        Domain::Positive,
        Presence::Default("0.75"),
        "radius of the middle of the tube",
    ),
    number("minor", Domain::Positive, Presence::Default("0.25"), "radius of the tube"),
];
const CONE: &[Argument] = &[
    number("radius", Domain::Positive, Presence::Default("1"), "radius of the base"),
    number("height", Domain::Positive, Presence::Default("2"), "distance from base to tip"),
];
const CAPSULE: &[Argument] = &[
    number("radius", Domain::Positive, Presence::Default("0.5"), "radius of the ends"),
    number(
        "length",
        Domain::NotNegative,
        Presence::Default("1"),
        "distance between the centres of the ends",
    ),
];
const PLANE: &[Argument] = &[
    Argument {
        name: "normal",
        shape: Shape::Vector,
        domain: Domain::SomeNonzero,
        presence: Presence::Default("0,0,1"),
        meaning: "outward direction",
    },
    number(
        "offset",
        Domain::Any,
        Presence::Default("0"),
        "distance from the origin along the normal",
    ),
];
const ELLIPSOID: &[Argument] = &[Argument {
    name: "radii",
    shape: Shape::Vector,
    domain: Domain::Positive,
    presence: Presence::Default("1,0.75,0.5"),
    meaning: "semi-axes",
}];
const OCTAHEDRON: &[Argument] = &[number(
    "radius",
    Domain::Positive,
    Presence::Default("1"),
    "distance of the tips from the origin",
)];
const FILLET: Argument = number(
    "fillet",
    Domain::NotNegative,
    Presence::Default("0"),
    "radius of the fillets where they meet, in cells",
);
const RADIUS: Argument =
    number("radius", Domain::Positive, Presence::Default("0.05"), "radius of the struts, in cells");
const PLATE: Argument = number(
    "thickness",
    Domain::Positive,
    Presence::Default("0.05"),
    "thickness of the plates, in cells",
);
const STRUTS: &[Argument] = &[RADIUS, FILLET];
const PLATES: &[Argument] = &[PLATE, FILLET];
const LATTICE: [Argument; 3] = [RADIUS, PLATE, FILLET];
/// Whole numbers up to this are exact.
const MOST_SEED: u64 = 1 << 53;
const SEED: Argument =
    number("seed", Domain::Whole(0, MOST_SEED), Presence::Default("1"), "chooses one of many");
const BUBBLES: Argument = number(
    "bubbles",
    Domain::Whole(1, voronoi::MOST_POINTS as u64),
    Presence::Default("16"),
    "number of bubbles in a cell",
);
const FOAM_STRUTS: &[Argument] = &[SEED, BUBBLES, RADIUS, FILLET];
const FOAM_WALLS: &[Argument] = &[SEED, BUBBLES, PLATE, FILLET];
const SPINODOID: &[Argument] = &[
    SEED,
    number(
        "waves",
        Domain::Whole(1, spinodoid::MOST_WAVES as u64),
        Presence::Default("100"),
        "number of waves",
    ),
    Argument {
        name: "cones",
        shape: Shape::Vector,
        domain: Domain::Cone,
        presence: Presence::Default("pi/2,pi/2,pi/2"),
        meaning: "half the opening angles of the cones of directions about x, y and z",
    },
];
const DILATE: &[Argument] =
    &[number("offset", Domain::Any, Presence::Required, "growth in units of the field")];
const ERODE: &[Argument] =
    &[number("offset", Domain::Any, Presence::Required, "shrinkage in units of the field")];
const SHELL: &[Argument] = &[number(
    "thickness",
    Domain::NotNegative,
    Presence::Required,
    "full thickness in units of the field",
)];
const TRANSLATE: &[Argument] = &[Argument {
    name: "offset",
    shape: Shape::Vector,
    domain: Domain::Any,
    presence: Presence::Required,
    meaning: "displacement",
}];
const SCALE: &[Argument] = &[Argument {
    name: "factor",
    shape: Shape::Factor,
    domain: Domain::EachNonzero,
    presence: Presence::Required,
    meaning: "factor along all axes or along each",
}];
const THICKNESS: &[Argument] = &[
    number("thickness", Domain::NotNegative, Presence::Required, "full thickness, a length"),
    choice("method", Method::NAMES, Presence::Default("exact"), "Newton's method, or first order"),
];
const CYLINDRICAL: &[Argument] = &[
    number("around", Domain::Positive, Presence::Required, "cells around; a whole number closes"),
    number("radius", Domain::Positive, Presence::Default("1"), "radius where a cell begins"),
    number("radial", Domain::Positive, Presence::Optional, "length of a cell along the radius"),
    number("axial", Domain::Positive, Presence::Optional, "length of a cell along the axis"),
];
const SPHERICAL: &[Argument] = &[
    number("around", Domain::Positive, Presence::Required, "cells around; a whole number closes"),
    number("along", Domain::Positive, Presence::Required, "cells from pole to pole"),
    number("radius", Domain::Positive, Presence::Default("1"), "radius where a cell begins"),
    number("radial", Domain::Positive, Presence::Optional, "length of a cell along the radius"),
];
const CONFORM: &[Argument] = &[Argument {
    name: "place",
    shape: Shape::Vector,
    domain: Domain::Any,
    presence: Presence::Required,
    meaning: "coordinates of the shape's own space at the point",
}];
const DENSITY: &[Argument] = &[number(
    "fraction",
    Domain::ProperFraction,
    Presence::Required,
    "share of the part's volume, between 0 and 1",
)];
const STRETCH: &[Argument] = &[
    choice("along", &["x", "y", "z"], Presence::Required, "the axis"),
    number("size", Domain::Positive, Presence::Required, "length of a cell at the point"),
];
const ROUNDED: &[Argument] =
    &[number("radius", Domain::Positive, Presence::Required, "radius of the fillets")];
const FILL: &[Argument] = &[
    Argument {
        name: "size",
        shape: Shape::Factor,
        domain: Domain::Positive,
        presence: Presence::Optional,
        meaning: "length of a cell of length 1, along all axes or along each",
    },
    number(
        "density",
        Domain::ProperFraction,
        Presence::Optional,
        "share of the part inside the skin, between 0 and 1",
    ),
    number("thickness", Domain::NotNegative, Presence::Optional, "thickness of walls, a length"),
    number("skin", Domain::NotNegative, Presence::Optional, "thickness of the skin, a length"),
    choice("trim", Trim::NAMES, Presence::Default("part"), "cut cells, or keep whole ones only"),
];
const BLEND: &[Argument] = &[
    number("weight", Domain::Any, Presence::Required, "weight of the last shape, or what gives it"),
    choice(
        "ramp",
        Ramp::NAMES,
        Presence::Default("weight"),
        "how the weight is had: as it is, or rising through zero over the width",
    ),
    number("width", Domain::Positive, Presence::Default("1"), "width of the ramp"),
    number(
        "correction",
        Domain::Any,
        Presence::Default("0"),
        "growth in the middle, in units of the field",
    ),
];
const ROTATE: &[Argument] = &[
    number("angle", Domain::Any, Presence::Required, "angle in radians"),
    Argument {
        name: "axis",
        shape: Shape::Vector,
        domain: Domain::SomeNonzero,
        presence: Presence::Required,
        meaning: "axis of rotation, of any length",
    },
];

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
    apply: fn(&mut Graph, Solid, Solid, &Arguments) -> Solid,
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
