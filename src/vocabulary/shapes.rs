//! The words that make solids: primitives, periodic surfaces, cells of struts and plates, foams.

use super::{Exactness, Family, Kind, PAPER, PLANE_GEOMETRY, Row, number, shape};
use crate::cellular::spinodoid::{self, Spinodoid};
use crate::cellular::struts::voronoi::{self, Part};
use crate::cellular::struts::{Cell, Sizes, bubbles, table};
use crate::cellular::tpms;
use crate::expr::{Graph, NodeId};
use crate::lang::{Argument, Arguments, Domain, MakeShape, Presence, Shape};
use crate::solid::{Solid, primitives};
use std::sync::Arc;

/// Every word that makes a solid.
pub(super) fn rows() -> Vec<Row> {
    let mut rows = primitives();
    rows.extend(tpms::CATALOGUE.iter().map(surface));
    rows.extend(table::CELLS.iter().map(cell));
    rows.extend(random());
    rows
}

fn primitives() -> Vec<Row> {
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

/// What makes the lattice of a cell that a file holds, from the arguments of [`Words`](super::Words).
#[must_use]
pub fn lattice(cell: Cell) -> Arc<MakeShape> {
    Arc::new(move |graph, given| {
        let [radius, thickness, fillet] = [0, 1, 2].map(|index| given.number(index));
        cell.solid(graph, Sizes { radius, thickness, fillet })
    })
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
pub(super) const LATTICE: [Argument; 3] = [RADIUS, PLATE, FILLET];
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
