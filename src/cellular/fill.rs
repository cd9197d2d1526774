//! Parts filled with a lattice: the lattice inside of the part, and the part's skin.
//!
//! What a filled part consists of is told by [`Filling`]; all of it are set operations and offsets of
//! the part and the lattice. Lengths are true where the part's field is a distance, as a mesh's is.
//!
//! Only whole cells can be kept: those whose eight corners and whose inscribed ball lie in the part. For
//! the ball the part's field counts as linear about the centre, with the slope that it has there. Both are
//! exact where the field is convex, whether a distance or not: a convex part has a cell where it has its
//! corners, and a convex field is no lower than its tangent plane, so that no cell of the part fails
//! by its ball. Elsewhere the ball is right where the field is a distance, and a cell is kept though a hole
//! or a notch reaches into it that misses the corners and the ball. Where the size of cells varies, a cell is
//! the one of the size at the point, and kept or not point by point. The field jumps from cell to cell; the
//! surface there is the cells' faces. It costs nine evaluations of the part, and one of its slope.

use crate::expr::{Graph, NodeId, Unary, derive};
use crate::solid::motions::substitute;
use crate::solid::walls::Method;
use crate::solid::{Solid, primitives};

/// How far a whole cell may reach out of the part, in the cell's least side: corners on the part's
/// faces are off by the rounding of their coordinates.
const ROUNDING: f64 = 1e-9;

/// How a part is filled. Sizes may vary in space.
#[derive(Clone, Copy, Debug)]
pub struct Filling {
    /// Length of a cell along each axis; the lattice as it is, with cells of length 1, if `None`.
    pub size: Option<[NodeId; 3]>,
    /// The least corner of a cell; the origin if `None`.
    pub corner: Option<[NodeId; 3]>,
    /// Thickness of walls that take the place of the lattice's own, a length.
    pub thickness: Option<NodeId>,
    /// Share of the part inside of the skin that the lattice fills, between 0 and 1. Walls become
    /// as thick as it takes.
    pub density: Option<NodeId>,
    /// Thickness of the solid layer inside of the part's surface, a length.
    pub skin: Option<NodeId>,
    /// Which cells are kept.
    pub trim: Trim,
}

/// Which cells of a filling are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trim {
    /// All, cut by the part.
    Part,
    /// Those whose corners and inscribed ball lie in the part: all that lie whole in a convex one.
    Cells,
}

impl Trim {
    /// What the choices are called, in order.
    pub const NAMES: &'static [&'static str] = &["part", "cells"];
    /// The choices, in order.
    pub const ALL: [Self; 2] = [Self::Part, Self::Cells];
}

/// `part` filled with `lattice`.
#[must_use]
pub fn fill(graph: &mut Graph, part: Solid, mut lattice: Solid, filling: Filling) -> Solid {
    let Filling { size, corner, thickness, density, skin, trim } = filling;
    if let Some(size) = size {
        lattice = lattice.scale(graph, size);
    }
    if let Some(corner) = corner {
        lattice = lattice.translate(graph, corner);
    }
    if let Some(thickness) = thickness {
        lattice = lattice.wall(graph, thickness, Method::Exact);
    }
    if let Some(density) = density {
        lattice = lattice.density(graph, density);
    }
    let room = match trim {
        Trim::Part => part.clone(),
        Trim::Cells => {
            let [zero, one] = [0.0, 1.0].map(|number| graph.constant(number));
            let (corner, size) = (corner.unwrap_or([zero; 3]), size.unwrap_or([one; 3]));
            whole_cells(graph, part.clone(), corner, size)
        }
    };
    let Some(skin) = skin else { return room.intersection(graph, lattice) };
    // The part, less what is neither in its skin nor in the lattice: one way to its faces, whose
    // distance need not be known deep inside. Cells that lie whole in the part end there themselves.
    let inside = match trim {
        Trim::Part => lattice,
        Trim::Cells => room.intersection(graph, lattice),
    };
    let skin = part.clone().erode(graph, skin).complement(graph);
    let inside = inside.union(graph, skin);
    part.intersection(graph, inside)
}

/// The cells of lengths `size`, one with its least corner at `corner`, that lie whole in `part`.
///
/// The field is the greatest of the part's at the corners and the centre, less the rounding, and of what it
/// is to first order at the farthest point of the inscribed ball.
fn whole_cells(graph: &mut Graph, part: Solid, corner: [NodeId; 3], size: [NodeId; 3]) -> Solid {
    let [half, one] = [0.5, 1.0].map(|number| graph.constant(number));
    let point = graph.point();
    let numbers: [NodeId; 3] = std::array::from_fn(|i| {
        let way = graph.sub(point[i], corner[i]);
        let place = graph.div(way, size[i]);
        graph.unary(Unary::Floor, place)
    });
    // A corner has the same coordinates in every cell that it belongs to.
    let places = [None, Some(half), Some(one)].map(|share| {
        std::array::from_fn::<_, 3, _>(|i| {
            let number = share.map_or(numbers[i], |share| graph.add(numbers[i], share));
            let way = graph.mul(number, size[i]);
            graph.add(way, corner[i])
        })
    });
    let [least, middle, greatest] = places;
    let sides = size.map(|side| graph.unary(Unary::Abs, side));
    let side = graph.min(sides[0], sides[1]);
    let side = graph.min(side, sides[2]);
    let farthest = (0..8)
        .map(|k| {
            let corner = std::array::from_fn(|i| [least, greatest][k >> i & 1][i]);
            substitute(graph, part.field, corner)
        })
        .collect::<Vec<_>>();
    let at_middle = substitute(graph, part.field, middle);
    let farthest = farthest.into_iter().fold(at_middle, |a, b| graph.max(a, b));
    let slopes = derive::gradient(graph, part.field);
    let slope = primitives::length(graph, &slopes);
    let radius = graph.mul(half, side);
    let rise = graph.mul(radius, slope);
    let ball = graph.add(part.field, rise);
    let ball = substitute(graph, ball, middle);
    let rounding = graph.constant(ROUNDING);
    let rounding = graph.mul(rounding, side);
    let mut cells = part;
    // In this order: where the part has no slope, as on the axis of a hole, the values tell.
    let outermost = graph.max(ball, farthest);
    cells.field = graph.sub(outermost, rounding);
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::primitives::{cube, sphere};
    use crate::solid::walk::value;

    const PLAIN: Filling = Filling {
        size: None,
        corner: None,
        thickness: None,
        density: None,
        skin: None,
        trim: Trim::Part,
    };

    fn lattice(graph: &mut Graph) -> Solid {
        let [x, ..] = graph.point();
        let tau = graph.constant(std::f64::consts::TAU);
        let phase = graph.mul(tau, x);
        let field = graph.unary(Unary::Cos, phase);
        Solid::periodic(graph, field, 1.0, std::f64::consts::TAU)
    }

    #[test]
    fn a_skin_is_solid_and_the_rest_is_lattice() {
        let mut graph = Graph::new();
        let (part, slabs) = (cube(&mut graph), lattice(&mut graph));
        let (half, tenth) = (graph.constant(0.5), graph.constant(0.1));
        let filling = Filling { size: Some([half; 3]), skin: Some(tenth), ..PLAIN };
        let filled = fill(&mut graph, part, slabs, filling);
        let inside = |x: f64, y: f64| value(&graph, filled.field, [x, y, 0.0]) < 0.0;
        assert!(inside(0.25, 0.0) && !inside(0.5, 0.0) && !inside(0.0, 0.0));
        assert!(inside(0.95, 0.0) && inside(0.5, -0.95) && !inside(0.5, -0.85));
        assert!(!inside(1.05, 0.0));
        assert_eq!(filled.bounds(&graph, &[]).hi.x, 1.0);
    }

    #[test]
    fn whole_cells_lie_in_the_part() {
        let mut graph = Graph::new();
        let [zero, quarter] = [0.0, 0.25].map(|number| graph.constant(number));
        let ball = sphere(&mut graph);
        let cells = whole_cells(&mut graph, ball, [zero; 3], [quarter; 3]);
        let kept = |p: [f64; 3]| value(&graph, cells.field, p) < 0.0;
        // The cell from 0.5 to 0.75 along x has its farthest corner at 0.83; the next would reach
        // beyond the ball.
        assert!(kept([0.74, 0.01, 0.01]) && !kept([0.76, 0.01, 0.01]));
        for i in 0..1000 {
            let at = [0.377, 0.691, 0.173].map(|s: f64| 2.0 * (s * f64::from(i)).fract() - 1.0);
            let corner = at.map(|c| (c / 0.25).floor() * 0.25);
            let far = corner.map(|c| c.abs().max((c + 0.25).abs()));
            let reach = far.iter().map(|c| c * c).sum::<f64>().sqrt();
            assert_eq!(kept(at), reach <= 1.0, "{at:?}");
        }
    }
}
