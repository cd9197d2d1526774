//! Distances to segments, lines, planes and polygons as expressions of few linear forms.
//!
//! Each is written in a frame of the element: with unit vectors d along a strut and m, n across it, the
//! square of the distance of a line is (m . u - a)² + (n . u - b)². Parallel elements share the
//! products m . u, a form in which each coordinate occurs once has an exact range over a box,
//! and a form in one coordinate is evaluated once a plane of samples.

use super::element::{Element, Shape, normal};
use crate::expr::{Extremum, Graph, NodeId, Unary};
use crate::solid::primitives::length;
use glam::DVec3;

/// Directions whose components differ by less are the same one.
const SAME: f64 = 1e-12;

/// Makes expressions of the point `u`.
pub(super) struct Forms<'a> {
    pub(super) graph: &'a mut Graph,
    u: [NodeId; 3],
    directions: Vec<DVec3>,
}

impl<'a> Forms<'a> {
    pub(super) fn new(graph: &'a mut Graph, u: [NodeId; 3]) -> Self {
        Self { graph, u, directions: Vec::new() }
    }

    /// The square of the distance to the middle of `element`.
    pub(super) fn square(&mut self, element: &Element) -> NodeId {
        match &element.shape {
            Shape::Line { point, direction } => self.square_across(*direction, *point),
            Shape::Segment([a, b]) => {
                let direction = (*b - *a).normalize();
                let across = self.square_across(direction, *a);
                let beyond = self.beyond(*a, *b);
                let beyond = self.graph.mul(beyond, beyond);
                self.graph.add(across, beyond)
            }
            Shape::Plane { normal, offset } => {
                let height = self.form(*normal, *offset);
                self.graph.mul(height, height)
            }
            Shape::Polygon(corners) => self.square_to_polygon(corners),
        }
    }

    /// The distance to a strut that tapers from the radius `radii[0]` at one end to `radii[1]`.
    ///
    /// It is the least of |u - c| - r over the balls along the segment. With the slope
    /// s = (r0 - r1) / length, the least is taken where the way from c to u slants by s against
    /// the axis' normal, or at an end: exact outside, and right where one ball holds the other.
    pub(super) fn tapered(&mut self, [a, b]: [DVec3; 2], radii: [NodeId; 2]) -> NodeId {
        let direction = (b - a).normalize();
        let across = self.square_across(direction, a);
        let along = self.signed_form(direction, direction.dot(a));
        let graph = &mut *self.graph;
        let rho = graph.unary(Unary::Sqrt, across);
        let [zero, one, tiny] = [0.0, 1.0, 1e-24].map(|v| graph.constant(v));
        let longest = graph.constant(a.distance(b));
        let fall = graph.sub(radii[0], radii[1]);
        let slope = graph.div(fall, longest);
        let square = graph.mul(slope, slope);
        let rest = graph.sub(one, square);
        let rest = graph.max(rest, tiny);
        let cosine = graph.unary(Unary::Sqrt, rest);
        let lead = graph.mul(slope, rho);
        let lead = graph.div(lead, cosine);
        let place = graph.sub(along, lead);
        let place = graph.max(place, zero);
        let place = graph.min(place, longest);
        let rest = graph.sub(along, place);
        let distance = length(graph, &[rho, rest]);
        let thinner = graph.mul(slope, place);
        let radius = graph.sub(radii[0], thinner);
        graph.sub(distance, radius)
    }

    /// The square of the distance to the line through `point` along `direction`.
    fn square_across(&mut self, direction: DVec3, point: DVec3) -> NodeId {
        let [m, n] = across(self.known(direction));
        let [a, b] = [m, n].map(|unit| {
            let form = self.form(unit, unit.dot(point));
            self.graph.mul(form, form)
        });
        self.graph.add(a, b)
    }

    /// How far the point lies beyond the ends of the segment, along it.
    fn beyond(&mut self, a: DVec3, b: DVec3) -> NodeId {
        let direction = self.known((b - a).normalize());
        let from_middle = self.form(direction, direction.dot(0.5 * (a + b)));
        let graph = &mut *self.graph;
        let (zero, half) = (graph.constant(0.0), graph.constant(0.5 * a.distance(b)));
        let size = graph.unary(Unary::Abs, from_middle);
        let beyond = graph.sub(size, half);
        graph.max(beyond, zero)
    }

    fn square_to_polygon(&mut self, corners: &[DVec3]) -> NodeId {
        let up = normal(corners);
        let height = self.form(up, up.dot(corners[0]));
        let (mut greatest, mut least) = (None, None);
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let outward = (b - *a).cross(up).normalize();
            let excess = self.signed_form(outward, outward.dot(*a));
            let beyond = self.beyond(*a, b);
            let graph = &mut *self.graph;
            let squares = [excess, beyond].map(|v| graph.mul(v, v));
            let square = graph.add(squares[0], squares[1]);
            greatest = Some(greatest.map_or(excess, |g| graph.max(g, excess)));
            least = Some(least.map_or(square, |l| graph.min(l, square)));
        }
        let graph = &mut *self.graph;
        let zero = graph.constant(0.0);
        let (greatest, least) = (greatest.unwrap_or(zero), least.unwrap_or(zero));
        let aside = graph.pick(Extremum::Max, [greatest, zero, least, zero]);
        let above = graph.mul(height, height);
        graph.add(above, aside)
    }

    /// ±(unit . u - offset), whichever shares more.
    pub(super) fn form(&mut self, unit: DVec3, offset: f64) -> NodeId {
        let (unit, offset) = if is_backward(unit) { (-unit, -offset) } else { (unit, offset) };
        let unit = self.known(unit);
        let mut sum = None;
        for (axis, factor) in unit.to_array().into_iter().enumerate() {
            if factor.abs() > SAME {
                let factor = self.graph.constant(factor);
                let term = self.graph.mul(self.u[axis], factor);
                sum = Some(sum.map_or(term, |sum| self.graph.add(sum, term)));
            }
        }
        let zero = self.graph.constant(0.0);
        let offset = self.graph.constant(offset);
        self.graph.sub(sum.unwrap_or(zero), offset)
    }

    /// unit . u - offset.
    pub(super) fn signed_form(&mut self, unit: DVec3, offset: f64) -> NodeId {
        let form = self.form(unit, offset);
        if is_backward(unit) { self.graph.neg(form) } else { form }
    }

    /// A direction seen before that equals `direction` but for rounding, or its opposite.
    fn known(&mut self, direction: DVec3) -> DVec3 {
        let snapped = direction.map(|c| {
            let whole = c.round();
            if (c - whole).abs() < SAME { whole } else { c }
        });
        let is_same = |known: &&DVec3| (**known - snapped).abs().max_element() < SAME;
        if let Some(known) = self.directions.iter().find(is_same) {
            return *known;
        }
        self.directions.push(snapped);
        snapped
    }
}

/// Whether the first component that is not zero is negative.
fn is_backward(unit: DVec3) -> bool {
    unit.to_array().into_iter().find(|c| c.abs() > SAME).is_some_and(|c| c < 0.0)
}

/// Two unit vectors across `direction` and across one another, along axes where possible.
fn across(direction: DVec3) -> [DVec3; 2] {
    let d = direction.to_array();
    let unit = |axis: usize| DVec3::from_array([0, 1, 2].map(|i| f64::from(u8::from(i == axis))));
    let first = match [0, 1, 2].into_iter().find(|&axis| d[axis].abs() < SAME) {
        Some(axis) => unit(axis),
        None => DVec3::new(d[1], -d[0], 0.0).normalize(),
    };
    [first, direction.cross(first).normalize()]
}
