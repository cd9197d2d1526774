//! Dilation, erosion and shell: moving a solid's level.
//!
//! The offset is in units of the field: a length for distances, a difference of level for periodic
//! surfaces and formulas. It may vary in space: then the level is another at each point.
//!
//! Source: the Cesogen paper, equations 3 to 5.

use super::extent::Rule;
use super::motions::vary;
use super::warps::Warp;
use super::{Side, Solid, Span, Wall};
use crate::expr::{Graph, NodeId, Unary, derive};

impl Solid {
    /// {f < offset}: the field f - offset. A negative offset erodes.
    #[must_use]
    pub fn dilate(mut self, graph: &mut Graph, offset: NodeId) -> Self {
        self.field = graph.sub(self.field, offset);
        self.grow(graph, offset);
        self
    }

    /// {f < -offset}: the field f + offset. A negative offset dilates. The box stays.
    #[must_use]
    pub fn erode(mut self, graph: &mut Graph, offset: NodeId) -> Self {
        self.field = graph.add(self.field, offset);
        let outward = graph.neg(offset);
        self.grow(graph, outward);
        self
    }

    /// {|f| < thickness / 2}: a wall on both sides of the surface.
    #[must_use]
    pub fn shell(mut self, graph: &mut Graph, thickness: NodeId) -> Self {
        let two = graph.constant(2.0);
        let half_thickness = graph.div(thickness, two);
        let (field, side, span) = (self.field, Side::Middle, Span::NOWHERE);
        self.walls.push(Wall { field, half_thickness, side, span });
        let distance = graph.unary(Unary::Abs, self.field);
        self.field = graph.sub(distance, half_thickness);
        self.grow(graph, half_thickness);
        self
    }

    /// What has no volume but the surface itself: |f|, to be dilated.
    #[must_use]
    pub fn sheet(mut self, graph: &mut Graph) -> Self {
        self.field = graph.unary(Unary::Abs, self.field);
        self
    }

    /// Says that the box grows by the growth times `by`, which may vary in space.
    pub(super) fn grow(&mut self, graph: &mut Graph, by: NodeId) {
        self.push(if vary(graph, &[by]) {
            Rule::Warp(Warp::Grow { by, slopes: derive::gradient(graph, by) })
        } else {
            Rule::Grow(by)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, cylinder};
    use crate::solid::walk::value;

    #[test]
    fn offsets_move_the_level() {
        let mut graph = Graph::new();
        let half = graph.constant(0.5);
        let shape = cube(&mut graph);
        let at = |graph: &Graph, solid: &Solid| {
            [0.0, 1.0, 3.0].map(|x| value(graph, solid.field, [x, 0.0, 0.0]))
        };
        let wide = shape.clone().dilate(&mut graph, half);
        let narrow = shape.clone().erode(&mut graph, half);
        let wall = shape.clone().shell(&mut graph, half);
        assert_eq!(at(&graph, &wide), [-1.5, -0.5, 1.5]);
        assert_eq!(at(&graph, &narrow), [-0.5, 0.5, 2.5]);
        assert_eq!(at(&graph, &wall), [0.75, -0.25, 1.75]);
        assert_eq!(wall.walls.len(), 1);
        assert_eq!(wall.walls[0].field, shape.field);
    }

    #[test]
    fn boxes_grow_and_do_not_shrink() {
        let mut graph = Graph::new();
        let (half, minus) = (graph.constant(0.5), graph.constant(-0.5));
        let shape = cube(&mut graph);
        let mut reach = |make: &dyn Fn(&mut Graph, Solid) -> Solid| {
            let solid = make(&mut graph, shape.clone());
            solid.bounds(&graph, &[]).hi.x
        };
        assert_eq!(reach(&|graph, a| a.dilate(graph, half)), 1.5);
        assert_eq!(reach(&|graph, a| a.dilate(graph, minus)), 1.0);
        assert_eq!(reach(&|graph, a| a.erode(graph, half)), 1.0);
        assert_eq!(reach(&|graph, a| a.erode(graph, minus)), 1.5);
        assert_eq!(reach(&|graph, a| a.shell(graph, half)), 1.25);
    }

    #[test]
    fn a_shell_of_the_unbounded_is_unbounded() {
        let mut graph = Graph::new();
        let half = graph.constant(0.5);
        let wall = cylinder(&mut graph).shell(&mut graph, half);
        let bounds = wall.bounds(&graph, &[]);
        assert_eq!((bounds.hi.x, bounds.hi.z), (1.25, f64::INFINITY));
    }
}
