//! How far a mesh is from a surface f = 0, at its vertices and at the centres of its triangles.
//!
//! The two tell different things: vertices tell how exactly points were placed, centres how well flat
//! triangles follow what is bent between them.
//!
//! Distances are told in two ways, both relative to a length that the caller gives: as |f|, a length
//! only where f is a distance, and as |f| / |grad f|, the distance to first order where f is smooth.
//! Where f has a kink the second one takes the slope of one of its sides.
//!
//! Source: the four errors of the Cesogen paper, section 4.2, where the length is the diagonal of the
//! grid and distances are values of a *reference SDF*, which for its periodic surfaces is a level set: |f|
//! is that. The paper does not say how its L2 error weighs points; here it is the root of the mean square, so that
//! meshes of different sizes compare.

use crate::eval::interpret;
use crate::expr::{Failure, Graph, NodeId, derive};
use crate::mesh::Mesh;
use rayon::prelude::*;

/// Points that are evaluated at once: enough that what is prepared for them does not count.
const PIECE: usize = 1 << 14;

/// The size of a list of distances, relative to a length.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Norms {
    /// Root of the mean square; 0 for an empty list.
    pub l2: f64,
    /// The greatest; 0 for an empty list.
    pub max: f64,
}

/// How far a mesh is from a surface: the four errors. Not a number where a field is none at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Deviation {
    /// At the vertices.
    pub points: Norms,
    /// At the centres of the triangles.
    pub centres: Norms,
}

impl Deviation {
    /// The four errors: L2 and maximum at points, L2 and maximum at centres.
    #[must_use]
    pub fn errors(&self) -> [f64; 4] {
        let Self { points, centres } = self;
        [points.l2, points.max, centres.l2, centres.max]
    }
}

/// The four errors, told in two ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Deviations {
    /// By |f|, as the paper has them.
    pub values: Deviation,
    /// By |f| / |grad f|; infinite where the slope vanishes off the surface.
    pub distances: Deviation,
}

/// A surface f = 0 that meshes are compared with.
#[derive(Debug)]
pub struct Reference {
    graph: Graph,
    /// The field and its partial derivatives.
    outputs: [NodeId; 4],
    parameters: Vec<f64>,
    unit: f64,
}

impl Reference {
    /// The surface where `field` of `graph` is zero, parameter `i` being `parameters[i]`; distances are
    /// told in units of the length `unit`, which is positive.
    #[must_use]
    pub fn new(mut graph: Graph, field: NodeId, parameters: Vec<f64>, unit: f64) -> Self {
        let [x, y, z] = derive::gradient(&mut graph, field);
        Self { graph, outputs: [field, x, y, z], parameters, unit }
    }

    /// How far `mesh` is from the surface. It does not depend on the number of threads.
    ///
    /// Every corner of every triangle must be a vertex.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn deviations(&self, mesh: &Mesh) -> Result<Deviations, Failure> {
        let vertex = |number: usize| mesh.positions[number];
        let centre = |number: usize| {
            let corners = mesh.triangles[number].map(|v| mesh.positions[v as usize]);
            [0, 1, 2].map(|a| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0)
        };
        let points = self.norms(mesh.positions.len(), vertex)?;
        let centres = self.norms(mesh.triangles.len(), centre)?;
        let [values, distances] =
            [0, 1].map(|way| Deviation { points: points[way], centres: centres[way] });
        Ok(Deviations { values, distances })
    }

    /// The sizes of |f| and of |f| / |grad f| at `count` points.
    fn norms(
        &self,
        count: usize,
        point: impl Fn(usize) -> [f64; 3] + Sync,
    ) -> Result<[Norms; 2], Failure> {
        let pieces = (0..count.div_ceil(PIECE)).into_par_iter().map(|piece| {
            let numbers = piece * PIECE..count.min((piece + 1) * PIECE);
            self.sums(&numbers.map(&point).collect::<Vec<_>>())
        });
        let mut sums = [Sums::default(); 2];
        for piece in pieces.collect::<Result<Vec<_>, Failure>>()? {
            sums.iter_mut().zip(piece).for_each(|(sum, piece)| sum.add(piece));
        }
        Ok(sums.map(|Sums { squares, max }| {
            let mean = if count == 0 { 0.0 } else { squares / count as f64 };
            Norms { l2: mean.sqrt() / self.unit, max: max / self.unit }
        }))
    }

    fn sums(&self, points: &[[f64; 3]]) -> Result<[Sums; 2], Failure> {
        let at = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<_>>());
        let mut found = [(); 4].map(|()| vec![0.0; points.len()]);
        let mut lists = found.each_mut().map(Vec::as_mut_slice);
        let at = at.each_ref().map(Vec::as_slice);
        interpret::points(&self.graph, &self.outputs, at, &self.parameters, &mut lists)?;
        let mut sums = [Sums::default(); 2];
        for i in 0..points.len() {
            let [value, x, y, z] = found.each_ref().map(|list| list[i]);
            let value = value.abs();
            // On the surface the slope does not matter, and may be none.
            let distance = if value == 0.0 { 0.0 } else { value / (x * x + y * y + z * z).sqrt() };
            sums[0].include(value);
            sums[1].include(distance);
        }
        Ok(sums)
    }
}

/// What a list of distances adds up to.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    squares: f64,
    max: f64,
}

impl Sums {
    fn include(&mut self, distance: f64) {
        self.add(Self { squares: distance * distance, max: distance });
    }

    fn add(&mut self, Self { squares, max }: Self) {
        self.squares += squares;
        // What is not a number stays.
        self.max = if max > self.max || max.is_nan() { max } else { self.max };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::Unary;
    use crate::geom::Axis;

    /// |x|^2 - 1 with the slope 2 |x|.
    fn ball() -> (Graph, NodeId) {
        let mut graph = Graph::new();
        let squares = graph.point().map(|u| graph.mul(u, u));
        let sum = graph.add(squares[0], squares[1]);
        let sum = graph.add(sum, squares[2]);
        let one = graph.constant(1.0);
        let field = graph.sub(sum, one);
        (graph, field)
    }

    fn octahedron(radius: f64) -> Mesh {
        let mut positions = Vec::new();
        for axis in 0..3 {
            for side in [radius, -radius] {
                let mut point = [0.0; 3];
                point[axis] = side;
                positions.push(point);
            }
        }
        let mut triangles = Vec::new();
        for corner in 0..8_u32 {
            triangles.push([corner & 1, 2 + (corner >> 1 & 1), 4 + (corner >> 2)]);
        }
        Mesh { positions, triangles }
    }

    #[track_caller]
    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-15, "{found} is not {expected}");
    }

    #[test]
    fn an_octahedron_is_off_the_ball_by_its_closed_form() {
        let (graph, field) = ball();
        let reference = Reference::new(graph, field, Vec::new(), 2.0);
        // Corners at 1 are on the ball; centres are at 1 / sqrt 3, where f = -2/3 with slope 2 / sqrt 3.
        let found = reference.deviations(&octahedron(1.0)).unwrap();
        assert_eq!(found.values.points, Norms::default());
        assert_eq!(found.distances.points, Norms::default());
        for norm in [found.values.centres.l2, found.values.centres.max] {
            close(norm, 1.0 / 3.0);
        }
        close(found.distances.centres.max, 1.0 / 3.0_f64.sqrt() / 2.0);
        // At 1.5, f = 1.25 with slope 3.
        let found = reference.deviations(&octahedron(1.5)).unwrap();
        close(found.values.points.l2, 0.625);
        close(found.distances.points.max, 1.25 / 3.0 / 2.0);
    }

    #[test]
    fn the_mean_and_the_greatest_are_those_of_the_list() {
        let mut graph = Graph::new();
        let x = graph.coordinate(Axis::X);
        let reference = Reference::new(graph, x, Vec::new(), 1.0);
        // More points than a piece holds, of which every tenth is off by 3 and the last by 5.
        let count = 3 * PIECE + 10;
        let off = |i: usize| {
            if i + 1 == count { 5.0 } else { f64::from(u8::from(i.is_multiple_of(10))) * -3.0 }
        };
        let positions = (0..count).map(|i| [off(i), 0.0, 0.0]).collect();
        let mesh = Mesh { positions, triangles: Vec::new() };
        let squares: f64 = (0..count).map(|i| off(i) * off(i)).sum();
        let found = reference.deviations(&mesh).unwrap();
        close(found.values.points.l2, (squares / count as f64).sqrt());
        assert_eq!(found.values.points.max, 5.0);
        assert_eq!(found.values, found.distances);
        assert_eq!(found.values.centres, Norms::default());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(|| reference.deviations(&mesh)).unwrap(), found);
    }

    #[test]
    fn what_is_not_a_number_is_not_lost() {
        let mut graph = Graph::new();
        let x = graph.coordinate(Axis::X);
        let root = graph.unary(Unary::Sqrt, x);
        let reference = Reference::new(graph, root, Vec::new(), 1.0);
        let positions = vec![[4.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [9.0, 0.0, 0.0]];
        let found = reference.deviations(&Mesh { positions, triangles: Vec::new() }).unwrap();
        assert!(found.values.points.l2.is_nan() && found.values.points.max.is_nan());
    }
}
