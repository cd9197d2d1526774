//! The field of a lattice: the distance to a cell's struts and plates, in folded space.
//!
//! **Folding.** Along an axis in which the lattice is its own mirror image, x is replaced by its
//! distance |x - round(x)| from the nearest whole number, from 0 to 1/2; along any other by
//! x - floor(x), from 0 to 1. What is evaluated is the least distance to the elements of all cells
//! that are nearest somewhere in that box ([`near`](super::near)), so the field is the one
//! of the infinite lattice everywhere, and a million cells cost what one does. It is continuous
//! though the folded coordinates may jump: on both sides the same distances are least. A box that
//! a fold of a coordinate goes through is enclosed as if it were the whole cell along that axis.
//!
//! **Exactness.** Outside, the field is the distance to the solid. Inside it is no larger in size than
//! the depth, and equal to it away from where struts meet: so a dilation makes the struts
//! thicker by just that, and the slope is 1 everywhere. Where factors differ, this holds for radii
//! and half thicknesses up to [`LARGEST`]; beyond, the lattice has long filled space.
//!
//! **Fillets** of radius R replace the least distance by the rounded minimum
//! ([`rounded`](crate::solid::rounded)) over all elements that come nearer than R + radius, struts in a
//! row counting as one. Where n surfaces meet they add material of up to R (1 - 1/√n) over them, and
//! the field is a bound of the distance with a slope of at most √n. The sum of radius and fillet
//! may be up to a cell, or up to [`LARGEST`] if one of them is a parameter; beyond, the field jumps.

use super::cell::Cell;
use super::element::{self, Element, Family, Shape};
use super::forms::Forms;
use super::near::{self, LARGEST};
use crate::expr::{Binary, Graph, NodeId, Unary};
use crate::geom::Axis;
use crate::solid::Solid;
use crate::solid::rounded::round_minimum;
use glam::DVec3;

/// The sizes of a lattice with cells of length 1.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Radius of a strut of factor 1.
    pub radius: NodeId,
    /// Thickness of a plate of factor 1.
    pub thickness: NodeId,
    /// Radius of the fillets where struts and plates meet; zero for none.
    pub fillet: NodeId,
}

/// The sum of radius and fillet, in cells, up to which fillets do not jump: the lattice has long
/// filled space.
const FARTHEST_FILLET: f64 = 1.0;

/// An element's distance and where it is, for a tree over space.
pub(super) type Placed = (NodeId, DVec3);

impl Cell {
    /// The lattice of this cell: of period 1, and unbounded.
    #[must_use]
    pub fn solid(&self, graph: &mut Graph, sizes: Sizes) -> Solid {
        let Sizes { radius, thickness, fillet } = sizes;
        let mirrored = [0, 1, 2].map(|axis| self.is_mirrored(axis));
        let size = DVec3::from_array(mirrored.map(|mirrored| if mirrored { 0.5 } else { 1.0 }));
        let u = Axis::ALL.map(|axis| folded(graph, axis, mirrored[axis.index()]));
        let two = graph.constant(2.0);
        let half = graph.div(thickness, two);
        let kinds = [(element::of_struts(self), radius), (element::of_plates(self), half)];
        let is_sharp = graph.as_constant(fillet) == Some(0.0);
        let mut forms = Forms::new(graph, u);
        let mut parts = Vec::new();
        for (families, offset) in kinds {
            let elements = if is_sharp {
                near::nearest(&families, size)
            } else {
                rounded_over(forms.graph, &families, size, [offset, fillet])
            };
            if is_sharp {
                parts.extend(least(&mut forms, &elements, offset, 0.5 * size));
            } else {
                parts.extend(elements.iter().map(|element| own(&mut forms, element, offset)));
            }
        }
        if is_sharp || parts.is_empty() {
            // Nothing is infinitely far from everything.
            let nothing = graph.constant(f64::INFINITY);
            let field = parts.into_iter().reduce(|a, b| graph.min(a, b)).unwrap_or(nothing);
            let solid = Solid::periodic(graph, field, 1.0, 1.0);
            return self.with_thinnest(graph, solid, [radius, half]);
        }
        let field = round_minimum(graph, &parts, fillet);
        let solid = Solid::periodic(graph, field, 1.0, (parts.len() as f64).sqrt());
        self.with_thinnest(graph, solid, [radius, half])
    }

    /// `solid` with the least radius of its struts and half thickness of its plates.
    fn with_thinnest(&self, graph: &mut Graph, solid: Solid, [radius, half]: [NodeId; 2]) -> Solid {
        let of_struts = self.struts().iter().flat_map(|strut| strut.factors).reduce(f64::min);
        let of_plates = self.plates().iter().map(|plate| plate.factor).reduce(f64::min);
        let thinnest = [(of_struts, radius), (of_plates, half)].into_iter();
        let thinnest = thinnest.filter_map(|(factor, offset)| {
            let factor = graph.constant(factor?);
            Some(graph.mul(factor, offset))
        });
        let thinnest: Vec<NodeId> = thinnest.collect();
        match thinnest.into_iter().reduce(|a, b| graph.min(a, b)) {
            Some(half) => solid.with_half_thickness(half),
            None => solid,
        }
    }
}

/// The elements over which fillets reach.
fn rounded_over(
    graph: &Graph,
    families: &[Family],
    size: DVec3,
    [offset, fillet]: [NodeId; 2],
) -> Vec<Element> {
    let largest = families.iter().flat_map(|f| f.element.factors).fold(0.0, f64::max);
    let reach = match (graph.as_constant(offset), graph.as_constant(fillet)) {
        (Some(offset), Some(fillet)) => (largest * offset + fillet).min(FARTHEST_FILLET),
        _ => LARGEST,
    };
    near::nearest_or_within(families, size, reach)
}

/// The coordinate along `axis` in the cell.
pub(super) fn folded(graph: &mut Graph, axis: Axis, mirrored: bool) -> NodeId {
    let x = graph.coordinate(axis);
    let op = if mirrored { Unary::Round } else { Unary::Floor };
    let whole = graph.unary(op, x);
    let rest = graph.sub(x, whole);
    if mirrored { graph.unary(Unary::Abs, rest) } else { rest }
}

/// The distance to `element` of the radius or half thickness `offset`.
fn own(forms: &mut Forms<'_>, element: &Element, offset: NodeId) -> NodeId {
    let [a, b] = element.factors.map(|factor| scaled(forms.graph, offset, factor));
    match &element.shape {
        Shape::Segment(ends) if element.factors[0] != element.factors[1] => {
            forms.tapered(*ends, [a, b])
        }
        Shape::Plane { normal, offset } => {
            let height = forms.form(*normal, *offset);
            let distance = forms.graph.unary(Unary::Abs, height);
            forms.graph.sub(distance, a)
        }
        Shape::Segment(_) | Shape::Line { .. } | Shape::Polygon(_) => {
            let square = forms.square(element);
            let distance = forms.graph.unary(Unary::Sqrt, square);
            forms.graph.sub(distance, a)
        }
    }
}

fn scaled(graph: &mut Graph, offset: NodeId, factor: f64) -> NodeId {
    let factor = graph.constant(factor);
    graph.mul(offset, factor)
}

/// The least distances to `elements`, one for each group of them that shares a factor.
///
/// The root and the offset are taken of the least square in a group: both keep the order, so that
/// it is the same number, to the bit.
fn least(
    forms: &mut Forms<'_>,
    elements: &[Element],
    offset: NodeId,
    middle: DVec3,
) -> Vec<NodeId> {
    let mut groups: Vec<(f64, Vec<Placed>)> = Vec::new();
    let mut others: Vec<Placed> = Vec::new();
    for element in elements {
        let place = element.place_near(middle);
        let [a, b] = element.factors;
        if a != b {
            others.push((own(forms, element, offset), place));
            continue;
        }
        let square = (forms.square(element), place);
        match groups.iter_mut().find(|(factor, _)| *factor == a) {
            Some((_, group)) => group.push(square),
            None => groups.push((a, vec![square])),
        }
    }
    let graph = &mut *forms.graph;
    let mut parts = Vec::new();
    for (factor, group) in groups {
        let square = over_space(graph, group, Binary::Min);
        let distance = graph.unary(Unary::Sqrt, square);
        let offset = scaled(graph, offset, factor);
        parts.push(graph.sub(distance, offset));
    }
    if !others.is_empty() {
        parts.push(over_space(graph, others, Binary::Min));
    }
    parts
}

/// The extremum of `parts`, at least one, as a balanced tree over space, so that a box discards half
/// of them at a stroke.
pub(super) fn over_space(graph: &mut Graph, mut parts: Vec<Placed>, extremum: Binary) -> NodeId {
    if let [(only, _)] = parts[..] {
        return only;
    }
    let lo = parts.iter().map(|(_, place)| *place).fold(DVec3::INFINITY, DVec3::min);
    let hi = parts.iter().map(|(_, place)| *place).fold(DVec3::NEG_INFINITY, DVec3::max);
    let size = hi - lo;
    let longest = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]).then(b.cmp(&a)));
    let axis = longest.unwrap_or(0);
    parts.sort_by(|(_, a), (_, b)| a[axis].total_cmp(&b[axis]));
    let upper = parts.split_off(parts.len().div_ceil(2));
    let [a, b] = [parts, upper].map(|half| over_space(graph, half, extremum));
    graph.binary(extremum, a, b)
}
