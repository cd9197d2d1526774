//! Solids: a field with the box that holds it, and the operations that make solids from solids.
//!
//! A solid is {f < 0} for a field f of one [`Graph`]. With the field goes its [`Extent`]: the box,
//! how fast it grows under dilation, the slope and the period, all functions of the parameters.
//! Operations consume solids and add nodes to the graph; they cannot fail. Numbers that make no
//! sense (a scale of zero) are refused where they are read, and where a parameter takes one later,
//! by [`Solid::finite_bounds`].
//!
//! Source: the operations are equations 2 to 11 of the Cesogen paper; names follow it.

pub mod blends;
pub mod density;
pub mod extent;
pub mod frame;
pub mod maps;
pub mod motions;
pub mod offsets;
pub mod primitives;
mod ranges;
pub mod rounded;
pub mod sets;
mod slopes;
pub mod span;
mod stretch;
pub mod values;
pub mod walls;
mod warps;

pub use density::Fraction;
pub use extent::{BoundsFault, Extent};
pub use span::Span;
pub use values::Values;

use crate::expr::{Graph, NodeId};
use crate::geom::{Aabb, Axis};
use extent::{Leaf, Rule, Step};

/// A field with its extent and origin.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The field, negative inside.
    pub field: NodeId,
    /// The walls and struts whose thickness is known, as they now lie.
    pub walls: Vec<Wall>,
    /// The walls that [`wall`](Solid::wall) made by Newton's method.
    pub true_walls: Vec<TrueWall>,
    /// What the unknown levels in it have to bring about.
    pub fractions: Vec<Fraction>,
    steps: Vec<Step>,
}

/// What the field of a [`Wall`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Zero in the middle of the wall {|f| < half thickness}, which is in units of the field: where
    /// |grad f| = s it is about `2 * half_thickness / s` thick.
    Middle,
    /// Zero on the surface of the wall, whose half thickness is a length.
    Surface,
}

/// A wall, or struts, which a grid may miss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// The field that is zero where `side` says.
    pub field: NodeId,
    /// Half the thickness, or the radius of struts; of several the least.
    pub half_thickness: NodeId,
    /// Where the field is zero.
    pub side: Side,
    /// The text of the operation.
    pub span: Span,
}

/// A wall of a true thickness around a surface, in the space in which it was made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueWall {
    /// The field whose zero is the middle of the wall.
    pub surface: NodeId,
    /// The wall's field.
    pub field: NodeId,
    /// Half the thickness, a length.
    pub half_thickness: NodeId,
    /// An upper bound of the length of the gradient of `surface`; infinite if none is known.
    pub lipschitz: f64,
    /// Where a point of the solid is in that space.
    pub place: [NodeId; 3],
}

impl Solid {
    /// The solid of `field` within `bounds`, whose growth is 1 where it is finite.
    ///
    /// The growth makes a promise: {f <= t} lies in `bounds` grown by t. A distance keeps it;
    /// a field that does not needs infinite bounds. `lipschitz` is an upper bound of the
    /// gradient's length, infinite if none is known.
    #[must_use]
    pub fn within(graph: &mut Graph, field: NodeId, bounds: Aabb, lipschitz: f64) -> Self {
        let bounds =
            [bounds.lo, bounds.hi].map(|end| end.to_array().map(|value| graph.constant(value)));
        Self::leaf(field, Leaf { bounds, lipschitz, period: None })
    }

    /// The solid of a field of which nothing is known.
    #[must_use]
    pub fn unbounded(graph: &mut Graph, field: NodeId) -> Self {
        Self::within(graph, field, Aabb::WHOLE, f64::INFINITY)
    }

    /// The solid of a field with period `period` along each axis; it is unbounded.
    #[must_use]
    pub fn periodic(graph: &mut Graph, field: NodeId, period: f64, lipschitz: f64) -> Self {
        let ends = [f64::NEG_INFINITY, f64::INFINITY];
        let bounds = ends.map(|end| Axis::ALL.map(|_| graph.constant(end)));
        Self::leaf(field, Leaf { bounds, lipschitz, period: Some(period) })
    }

    /// Says that the operations since the last call are the text at `span`.
    #[must_use]
    pub fn located(mut self, span: Span) -> Self {
        let unplaced = |step: &&mut Step| step.span == Span::NOWHERE;
        self.steps.iter_mut().rev().take_while(unplaced).for_each(|step| step.span = span);
        let walls = self.walls.iter_mut().rev();
        walls.take_while(|wall| wall.span == Span::NOWHERE).for_each(|wall| wall.span = span);
        let new = self.fractions.iter_mut().rev().take_while(|f| f.span == Span::NOWHERE);
        new.for_each(|fraction| fraction.span = span);
        self
    }

    /// The same solid, a wall or struts all of which are `half_thickness`, a length, to either side
    /// of their middle or thicker.
    #[must_use]
    pub fn with_half_thickness(mut self, half_thickness: NodeId) -> Self {
        let (field, side, span) = (self.field, Side::Surface, Span::NOWHERE);
        self.walls.push(Wall { field, half_thickness, side, span });
        self
    }

    fn leaf(field: NodeId, leaf: Leaf) -> Self {
        let mut solid = Self {
            field,
            walls: Vec::new(),
            true_walls: Vec::new(),
            fractions: Vec::new(),
            steps: Vec::new(),
        };
        solid.push(Rule::Leaf(leaf));
        solid
    }

    fn push(&mut self, rule: Rule) {
        self.steps.push(Step { rule, span: Span::NOWHERE });
    }
}

#[cfg(test)]
pub(crate) mod walk;
