//! Dilation, erosion and shell: moving a solid's level.
//!
//! The offset is in units of the field: a length for distances, a difference of level for periodic
//! surfaces and formulas.
//!
//! Source: the Cesogen paper, equations 3 to 5.

use super::extent::Rule;
use super::{Solid, Span, Wall};
use crate::expr::{Graph, NodeId, Unary};

impl Solid {
    /// {f < offset}: the field f - offset. A negative offset erodes.
    #[must_use]
    pub fn dilate(mut self, graph: &mut Graph, offset: NodeId) -> Self {
        self.field = graph.sub(self.field, offset);
        self.push(Rule::Grow(offset));
        self
    }

    /// {f < -offset}: the field f + offset. A negative offset dilates. The box stays.
    #[must_use]
    pub fn erode(mut self, graph: &mut Graph, offset: NodeId) -> Self {
        self.field = graph.add(self.field, offset);
        let outward = graph.neg(offset);
        self.push(Rule::Grow(outward));
        self
    }

    /// {|f| < thickness / 2}: a wall on both sides of the surface.
    #[must_use]
    pub fn shell(mut self, graph: &mut Graph, thickness: NodeId) -> Self {
        let two = graph.constant(2.0);
        let half_thickness = graph.div(thickness, two);
        self.walls.push(Wall { field: self.field, half_thickness, span: Span::NOWHERE });
        let distance = graph.unary(Unary::Abs, self.field);
        self.field = graph.sub(distance, half_thickness);
        self.push(Rule::Grow(half_thickness));
        self
    }
}
