//! The words that change and combine solids.

use super::{COORDINATES, IDENTITY, PAPER, Row, binary, choice, motion, number, unary};
use crate::cellular::fill::{Filling, Trim, fill};
use crate::expr::{Graph, NodeId};
use crate::geom::Axis;
use crate::lang::{Argument, Domain, Presence, Refusal, Shape};
use crate::solid::Solid;
use crate::solid::blends::Ramp;
use crate::solid::maps::{Cylindrical, Spherical};
use crate::solid::motions::Motion;
use crate::solid::walls::Method;

/// Every word that changes or combines solids.
pub(super) fn operations() -> Vec<Row> {
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
        binary("union", &[], &[], |graph, a, b, _| Ok(a.union(graph, b))).help(
            "what is in either of the last two shapes: min(f, g)",
            "Cesogen paper, equation 9",
        ),
        binary("intersection", &["intersect"], &[], |graph, a, b, _| Ok(a.intersection(graph, b)))
            .help(
                "what is in both of the last two shapes: max(f, g)",
                "Cesogen paper, equation 10",
            ),
        binary("difference", &["subtract"], &[], |graph, a, b, _| Ok(a.difference(graph, b))).help(
            "the shape before the last without the last: max(f, -g)",
            "Cesogen paper, equation 11",
        ),
        binary("rounded-union", &["smooth-union"], ROUNDED, |graph, a, b, given| {
            Ok(a.rounded_union(graph, b, given.number(0)))
        })
        .help("the union of the last two shapes with fillets between them", "hg_sdf, Mercury"),
        binary("rounded-intersection", &["smooth-intersection"], ROUNDED, |graph, a, b, given| {
            Ok(a.rounded_intersection(graph, b, given.number(0)))
        })
        .help("the intersection of the last two shapes with rounded edges", "hg_sdf, Mercury"),
        binary("rounded-difference", &["smooth-difference"], ROUNDED, |graph, a, b, given| {
            Ok(a.rounded_difference(graph, b, given.number(0)))
        })
        .help("the shape before the last without the last, edges rounded", "hg_sdf, Mercury"),
        binary("fill", &[], FILL, |graph, part, lattice, given| {
            let number = |index: usize| given.optional(index).map(|[value, ..]| value);
            let cells = Cells { size: given.optional(0), count: given.optional(5) };
            let Place { size, corner } = cells.place(graph, &part)?;
            let filling = Filling {
                size,
                corner,
                density: number(1),
                thickness: number(2),
                skin: number(3),
                trim: Trim::ALL[given.choice(4).unwrap_or(0)],
            };
            Ok(fill(graph, part, lattice, filling))
        })
        .help("the shape before the last filled with the last, and its skin", IDENTITY),
        binary("blend", &[], BLEND, |graph, a, b, given| {
            let ramp = Ramp::ALL[given.choice(1).unwrap_or(0)];
            let weight = ramp.weight(graph, given.number(0), given.number(2));
            Ok(a.blend(graph, b, weight, given.number(3)))
        })
        .help(
            "passes from the shape before the last to the last as a weight goes from 0 to 1",
            "ASLI, Perez-Boerema et al. 2022",
        ),
    ]
}

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
    choice(
        "trim",
        Trim::NAMES,
        Presence::Default("part"),
        "cut cells, or keep those with corners and ball inside",
    ),
    Argument {
        name: "count",
        shape: Shape::Factor,
        domain: Domain::Positive,
        presence: Presence::Optional,
        meaning: "cells across the part's box, along all axes or along each, in place of size",
    },
];

/// What a text says of the cells of a filling.
struct Cells {
    size: Option<[NodeId; 3]>,
    count: Option<[NodeId; 3]>,
}

/// How large the cells of a filling are and where one begins.
struct Place {
    size: Option<[NodeId; 3]>,
    corner: Option<[NodeId; 3]>,
}

impl Cells {
    /// The cells that divide the box of `part` where they are counted.
    fn place(self, graph: &mut Graph, part: &Solid) -> Result<Place, Refusal> {
        let Self { size, count } = self;
        let Some(count) = count else { return Ok(Place { size, corner: None }) };
        if size.is_some() {
            let cause = "cells have a `size` or a `count`, not both".to_owned();
            return Err(Refusal { cause });
        }
        let Some([lo, hi]) = part.corners(graph) else {
            let cause = "cells can't be counted where the part's box is not finite or not known; \
                         give their `size`";
            return Err(Refusal { cause: cause.to_owned() });
        };
        let size = [0, 1, 2].map(|i| {
            let side = graph.sub(hi[i], lo[i]);
            graph.div(side, count[i])
        });
        Ok(Place { size: Some(size), corner: Some(lo) })
    }
}
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
