//! Parts filled with a lattice: the lattice inside of the part, and the part's skin.
//!
//! What a filled part consists of is told by [`Filling`]; all of it are set operations and offsets of
//! the part and the lattice. Lengths are true where the part's field is a distance, as a mesh's is.
//!
//! Only whole cells can be kept: those whose circumscribed ball lies in the part. A cell is found by
//! its centre, so that the field jumps from cell to cell; the surface there is the cells' faces.

use crate::expr::{Graph, NodeId, Unary};
use crate::solid::motions::substitute;
use crate::solid::walls::Method;
use crate::solid::{Solid, primitives};

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
    /// Those that lie whole in the part.
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
fn whole_cells(graph: &mut Graph, part: Solid, corner: [NodeId; 3], size: [NodeId; 3]) -> Solid {
    let (half, point) = (graph.constant(0.5), graph.point());
    let middles = std::array::from_fn(|i| {
        let way = graph.sub(point[i], corner[i]);
        let place = graph.div(way, size[i]);
        let number = graph.unary(Unary::Floor, place);
        let middle = graph.add(number, half);
        let middle = graph.mul(middle, size[i]);
        graph.add(middle, corner[i])
    });
    let diagonal = primitives::length(graph, &size);
    let radius = graph.mul(half, diagonal);
    let mut cells = part;
    let at_middles = substitute(graph, cells.field, middles);
    cells.field = graph.add(at_middles, radius);
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
        // The cell from 0.5 to 0.75 along x has its middle 0.65 from the origin, and half a
        // diagonal of 0.2165; the next would reach beyond the ball.
        assert!(kept([0.74, 0.01, 0.01]) && !kept([0.76, 0.01, 0.01]));
        for i in 0..1000 {
            let at = [0.377, 0.691, 0.173].map(|s: f64| 2.0 * (s * f64::from(i)).fract() - 1.0);
            let corner = at.map(|c| (c / 0.25).floor() * 0.25);
            let far = corner.map(|c| c.abs().max((c + 0.25).abs()));
            let reach = far.iter().map(|c| c * c).sum::<f64>().sqrt();
            assert!(!kept(at) || reach <= 1.0, "{at:?}");
        }
    }
}
