//! Where a solid can be: its box, how fast the box grows under dilation, its slope and period.
//!
//! Box B and growth g promise that {f <= t} lies in B grown by g*t for every t >= 0, axis by axis.
//! All are functions of the parameters, so a solid keeps the *rules* that yield them as a postfix
//! program and [`Solid::extent`] runs it for given parameter values. Nothing recurses,
//! and joining two programs appends the shorter to the longer: ten thousand parts cost little.
//!
//! An intersection of disjoint boxes is kept as a box with `lo > hi`: growing it is still right,
//! since a dilation may bring the operands together.

use super::warps::Warp;
use super::{Solid, Span, Values};
use crate::expr::{Graph, NodeId};
use crate::geom::{Aabb, Axis};
use glam::DVec3;

/// Rounding of a rotated box, relative to the products that are summed: three products, two sums.
const ROTATION_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// One rule of the postfix program of a solid's extent, and where the text says it.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) rule: Rule,
    pub(super) span: Span,
}

/// What a step does to the extents on the stack.
#[derive(Clone, Debug)]
pub(super) enum Rule {
    /// Pushes an extent.
    Leaf(Leaf),
    /// Grows by the growth times a length; a negative length changes nothing.
    Grow(NodeId),
    /// Everything: the complement of something.
    Everywhere,
    /// Is pulled back by a map of which nothing is known.
    Map,
    /// Has a field that is no smaller than the size of the old one over this.
    Quotient(f64),
    /// Moves by a vector.
    Translate([NodeId; 3]),
    /// Scales along the axes.
    Scale([NodeId; 3]),
    /// Pulls back by the matrix with these rows.
    Rotate([[NodeId; 3]; 3]),
    /// Is moved by numbers that vary in space.
    Warp(Warp),
    /// Pops two and pushes their combination.
    Join(Join, Order),
}

/// The extent of a field as it is made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    /// Ends of the box; constants may be infinite.
    pub(super) bounds: [[NodeId; 3]; 2],
    /// An upper bound of the gradient's length.
    pub(super) lipschitz: f64,
    /// The period along every axis.
    pub(super) period: Option<f64>,
}

/// A set operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Join {
    Union,
    Intersection,
    Difference,
}

/// Which operand of a set operation comes first in the postfix program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    AsWritten,
    Exchanged,
}

/// Where a solid can be, for one choice of parameter values.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// The box B that holds the solid; `lo > hi` on some axis if the solid is empty.
    pub bounds: Aabb,
    /// The growth g per axis; of no meaning along an axis without finite end.
    pub growth: DVec3,
    /// An upper bound of the gradient's length; infinite if none is known.
    pub lipschitz: f64,
    /// The period of the field along each axis, if it is periodic along all three.
    pub period: Option<DVec3>,
    /// The text of the operand.
    pub span: Span,
    /// The operand to blame for each axis without finite ends.
    pub(super) unbounded: [Option<Span>; 3],
    /// The two operands whose boxes do not meet.
    apart: Option<[Span; 2]>,
    /// The step whose numbers are not finite.
    undefined: Option<Span>,
}

/// Why a solid has no box that a grid could fill.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BoundsFault {
    /// The solid reaches to infinity.
    #[error("the solid is unbounded: intersect it with a bounded shape, or give its bounds")]
    Unbounded {
        /// The operand to blame for each unbounded axis.
        axes: [Option<Span>; 3],
    },
    /// No point, or only a plane, is left of the solid.
    #[error("the solid is empty: {} do not overlap", if apart.is_some() { "two operands" } else { "its parts" })]
    Empty {
        /// The two operands whose boxes do not meet, if they are known.
        apart: Option<[Span; 2]>,
        /// The text of the solid.
        span: Span,
    },
    /// A number in the solid is infinite or undefined for these parameter values.
    #[error("the size of the solid is not a finite number")]
    Undefined {
        /// The operation with the number.
        span: Span,
    },
}

impl Solid {
    /// The extent of the solid where the parameter in slot `i` of `graph` is `parameters[i]`.
    #[must_use]
    pub fn extent(&self, graph: &Graph, parameters: &[f64]) -> Extent {
        let mut values = Values::new(graph, parameters);
        let mut stack: Vec<Extent> = Vec::new();
        for step in &self.steps {
            step.run(&mut stack, &mut values);
        }
        pop(&mut stack)
    }

    /// The box that holds the solid, for given parameter values; perhaps infinite or empty.
    #[must_use]
    pub fn bounds(&self, graph: &Graph, parameters: &[f64]) -> Aabb {
        self.extent(graph, parameters).bounds
    }

    /// The box that holds the solid, for given parameter values.
    ///
    /// # Errors
    /// [`BoundsFault`] unless the box is finite and has positive sides.
    pub fn finite_bounds(&self, graph: &Graph, parameters: &[f64]) -> Result<Aabb, BoundsFault> {
        let extent = self.extent(graph, parameters);
        let Extent { bounds, span, unbounded, apart, undefined, .. } = extent;
        if let Some(span) = undefined {
            Err(BoundsFault::Undefined { span })
        } else if bounds.size().cmple(DVec3::ZERO).any() {
            Err(BoundsFault::Empty { apart, span })
        } else if !bounds.is_finite() {
            Err(BoundsFault::Unbounded { axes: unbounded })
        } else {
            Ok(bounds)
        }
    }
}

impl Step {
    /// Replaces the extents on the stack that the step takes by the one that it makes.
    pub(super) fn run(&self, stack: &mut Vec<Extent>, values: &mut Values<'_>) {
        let Self { rule, span } = self;
        let extent = match rule {
            Rule::Leaf(leaf) => Extent::leaf(leaf, *span, values),
            Rule::Join(join, order) => {
                let (second, first) = (pop(stack), pop(stack));
                match order {
                    Order::AsWritten => Extent::joined(*join, first, second, *span),
                    Order::Exchanged => Extent::joined(*join, second, first, *span),
                }
            }
            Rule::Grow(by) => pop(stack).grown(*by, *span, values),
            Rule::Everywhere => pop(stack).everywhere(*span),
            Rule::Map => pop(stack).mapped(*span),
            Rule::Quotient(by) => pop(stack).quotient(*by, *span),
            Rule::Translate(by) => pop(stack).translated(*by, *span, values),
            Rule::Scale(by) => pop(stack).scaled(*by, *span, values),
            Rule::Rotate(rows) => pop(stack).rotated(*rows, *span, values),
            Rule::Warp(warp) => pop(stack).warped(warp, *span, values),
        };
        stack.push(extent);
    }
}

/// The extent on top of the stack.
pub(super) fn pop(stack: &mut Vec<Extent>) -> Extent {
    stack.pop().expect("a solid's steps are built by its own operations and are balanced")
}

impl Extent {
    fn leaf(leaf: &Leaf, span: Span, values: &mut Values<'_>) -> Self {
        let [lo, hi] = leaf.bounds.map(|end| DVec3::from_array(values.triple(end)));
        let extent = Self {
            bounds: Aabb::new(lo, hi),
            growth: DVec3::ONE,
            lipschitz: leaf.lipschitz,
            period: leaf.period.map(DVec3::splat),
            span,
            unbounded: [Some(span); 3],
            apart: None,
            undefined: (lo.is_nan() || hi.is_nan()).then_some(span),
        };
        extent.with_blame_where_unbounded()
    }

    /// Forgets the blame for axes with finite ends.
    pub(super) fn with_blame_where_unbounded(mut self) -> Self {
        for (axis, blame) in self.unbounded.iter_mut().enumerate() {
            if self.bounds.lo[axis].is_finite() && self.bounds.hi[axis].is_finite() {
                *blame = None;
            }
        }
        self
    }

    /// Extends the text by `span`, and blames it if one of its `numbers` is not finite.
    pub(super) fn said(mut self, span: Span, numbers: &[f64]) -> Self {
        self.span = self.span.to(span);
        if numbers.iter().any(|n| !n.is_finite()) {
            self.undefined = self.undefined.or(Some(span));
        }
        self
    }

    fn grown(mut self, by: NodeId, span: Span, values: &mut Values<'_>) -> Self {
        let by = values.of(by).unwrap_or(f64::NAN);
        if by > 0.0 {
            self.bounds = self.bounds.grown(self.growth * by);
        }
        self.said(span, &[by])
    }

    fn everywhere(mut self, span: Span) -> Self {
        self.bounds = Aabb::WHOLE;
        self.growth = DVec3::ONE;
        self.apart = None;
        self.unbounded = [Some(self.span.to(span)); 3];
        self.said(span, &[])
    }

    fn mapped(self, span: Span) -> Self {
        let mut mapped = self.everywhere(span);
        mapped.lipschitz = f64::INFINITY;
        mapped.period = None;
        mapped
    }

    fn quotient(mut self, by: f64, span: Span) -> Self {
        self.growth *= by;
        self.lipschitz = f64::INFINITY;
        self.said(span, &[])
    }

    fn translated(mut self, by: [NodeId; 3], span: Span, values: &mut Values<'_>) -> Self {
        let by = values.triple(by);
        let offset = DVec3::from_array(by);
        self.bounds = Aabb::new(self.bounds.lo + offset, self.bounds.hi + offset);
        self.said(span, &by)
    }

    /// {a0 f(x/a) <= t} is the image of {f <= t/a0}, so g grows by |a|/a0; the slope stays, since
    /// a0 is the least |a|.
    fn scaled(mut self, by: [NodeId; 3], span: Span, values: &mut Values<'_>) -> Self {
        let by = values.triple(by);
        let factor = DVec3::from_array(by);
        let (lo, hi) = (self.bounds.lo * factor, self.bounds.hi * factor);
        let mirrored = factor.cmplt(DVec3::ZERO);
        self.bounds = Aabb::new(DVec3::select(mirrored, hi, lo), DVec3::select(mirrored, lo, hi));
        self.growth *= factor.abs() / factor.abs().min_element();
        self.period = self.period.map(|period| period * factor.abs());
        // A factor of zero is as bad as an infinite one: the field divides by it.
        self.said(span, &by).said(span, &by.map(f64::recip))
    }

    fn rotated(self, rows: [[NodeId; 3]; 3], span: Span, values: &mut Values<'_>) -> Self {
        let rows = rows.map(|row| values.triple(row));
        let Aabb { lo, hi } = self.bounds;
        let (growth, period, blame) = (self.growth, self.period, self.unbounded);
        let mut turned = self;
        for axis in Axis::ALL.map(Axis::index) {
            // x = transposed(M) u, so coordinate `axis` of x takes column `axis` of M. A zero entry
            // contributes nothing even along an unbounded axis.
            let terms = (0..3).filter(|&j| rows[j][axis] != 0.0);
            let (mut low, mut high, mut wide) = ([0.0; 2], [0.0; 2], 0.0);
            turned.unbounded[axis] = None;
            let mut exact = true;
            for j in terms {
                let entry = rows[j][axis];
                let (a, b) = (entry * lo[j], entry * hi[j]);
                let (a, b) = if entry < 0.0 { (b, a) } else { (a, b) };
                low = [low[0] + a, low[1] + a.abs()];
                high = [high[0] + b, high[1] + b.abs()];
                wide += entry.abs() * growth[j];
                turned.unbounded[axis] = turned.unbounded[axis].or(blame[j]);
                exact &= entry.abs() == 1.0;
            }
            let margin = if exact { 0.0 } else { ROTATION_ROUNDING };
            turned.bounds.lo[axis] = low[0] - rounding(margin, low[1]);
            turned.bounds.hi[axis] = high[0] + rounding(margin, high[1]);
            turned.growth[axis] = wide;
        }
        turned.period = period.and_then(|period| permuted(period, rows));
        turned.said(span, rows.as_flattened())
    }

    fn joined(join: Join, first: Self, second: Self, span: Span) -> Self {
        let bounds = match join {
            // Not `Aabb::hull`, which would drop an empty box that a dilation could still fill.
            Join::Union => Aabb::new(
                first.bounds.lo.min(second.bounds.lo),
                first.bounds.hi.max(second.bounds.hi),
            ),
            Join::Intersection => first.bounds.overlap(second.bounds),
            Join::Difference => first.bounds,
        };
        let growth = match join {
            Join::Union => first.growth.max(second.growth),
            Join::Intersection => DVec3::from_array(Axis::ALL.map(|axis| {
                let a = axis.index();
                match (first.has_end(a), second.has_end(a)) {
                    (true, false) => first.growth[a],
                    (false, true) => second.growth[a],
                    _ => first.growth[a].max(second.growth[a]),
                }
            })),
            Join::Difference => first.growth,
        };
        let blame = |a: usize| match join {
            Join::Union | Join::Intersection => first.unbounded[a].or(second.unbounded[a]),
            Join::Difference => first.unbounded[a],
        };
        let apart = match join {
            Join::Intersection if first.is_possible() && second.is_possible() => {
                let meets = bounds.size().cmpgt(DVec3::ZERO).all();
                (!meets).then_some([first.span, second.span])
            }
            Join::Union | Join::Intersection => first.apart.or(second.apart),
            Join::Difference => first.apart,
        };
        let extent = Self {
            bounds,
            growth,
            lipschitz: first.lipschitz.max(second.lipschitz),
            period: first.period.filter(|_| first.period == second.period),
            span: first.span.to(second.span).to(span),
            unbounded: Axis::ALL.map(|axis| blame(axis.index())),
            apart,
            undefined: first.undefined.or(second.undefined),
        };
        extent.with_blame_where_unbounded()
    }

    /// Whether the box has a finite end along axis `a`.
    pub(super) fn has_end(&self, a: usize) -> bool {
        self.bounds.lo[a].is_finite() || self.bounds.hi[a].is_finite()
    }

    /// Whether the box has positive sides.
    fn is_possible(&self) -> bool {
        self.bounds.size().cmpgt(DVec3::ZERO).all()
    }
}

/// `relative` times `magnitude`, where no rounding at all is no rounding of infinity either.
fn rounding(relative: f64, magnitude: f64) -> f64 {
    if relative == 0.0 { 0.0 } else { relative * magnitude }
}

/// The period after a rotation that only permutes and reflects the axes.
fn permuted(period: DVec3, rows: [[f64; 3]; 3]) -> Option<DVec3> {
    let mut turned = DVec3::ZERO;
    for axis in Axis::ALL.map(Axis::index) {
        let source = (0..3).find(|&j| rows[j][axis].abs() == 1.0)?;
        turned[axis] = period[source];
    }
    Some(turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, sphere};
    use std::f64::consts::FRAC_PI_4;

    #[test]
    fn a_turned_box_lies_in_a_larger_one() {
        let mut graph = Graph::new();
        let [zero, one, angle] = [0.0, 1.0, FRAC_PI_4].map(|v| graph.constant(v));
        let turned = cube(&mut graph).rotate(&mut graph, angle, [zero, zero, one]);
        let extent = turned.extent(&graph, &[]);
        let root = 2.0_f64.sqrt();
        for axis in [0, 1] {
            assert!(extent.bounds.hi[axis] >= root && extent.bounds.hi[axis] < root + 1e-14);
            assert!((extent.growth[axis] - root).abs() < 1e-15);
        }
        assert_eq!(extent.bounds.hi.z, 1.0);
        assert_eq!(extent.period, None);
    }

    #[test]
    fn operands_that_a_dilation_brings_together_are_kept() {
        let mut graph = Graph::new();
        let [zero, two, three] = [0.0, 2.0, 3.0].map(|v| graph.constant(v));
        let (a, b) = (cube(&mut graph), cube(&mut graph));
        let b = b.translate(&mut graph, [three, zero, zero]);
        let apart = a.intersection(&mut graph, b);
        assert!(apart.bounds(&graph, &[]).is_empty());
        assert!(matches!(
            apart.finite_bounds(&graph, &[]),
            Err(BoundsFault::Empty { apart: Some(_), .. })
        ));
        let together = apart.dilate(&mut graph, two);
        let bounds = together.finite_bounds(&graph, &[]).unwrap();
        assert_eq!((bounds.lo.x, bounds.hi.x), (0.0, 3.0));
    }

    #[test]
    fn numbers_that_a_parameter_spoils_are_reported() {
        let mut graph = Graph::new();
        let t = graph.parameter("t", 1.0);
        let solid = sphere(&mut graph).scale(&mut graph, [t; 3]);
        assert!(solid.finite_bounds(&graph, &[2.0]).is_ok());
        for t in [f64::NAN, f64::INFINITY, 0.0] {
            let fault = solid.finite_bounds(&graph, &[t]).unwrap_err();
            assert!(matches!(fault, BoundsFault::Undefined { .. }), "{t}: {fault}");
        }
    }

    #[test]
    fn periods_scale_and_permute() {
        let mut graph = Graph::new();
        let zero = graph.constant(0.0);
        let solid = Solid::periodic(&mut graph, zero, 1.0, 0.0);
        let factor = [2.0, -3.0, 4.0].map(|v| graph.constant(v));
        let [one, quarter] = [1.0, 2.0 * FRAC_PI_4].map(|v| graph.constant(v));
        let scaled = solid.scale(&mut graph, factor);
        assert_eq!(scaled.extent(&graph, &[]).period, Some(DVec3::new(2.0, 3.0, 4.0)));
        let turned = scaled.rotate(&mut graph, quarter, [one, zero, zero]);
        assert_eq!(turned.extent(&graph, &[]).period, Some(DVec3::new(2.0, 4.0, 3.0)));
    }
}
