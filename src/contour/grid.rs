//! The grid that is contoured: where its nodes lie, where they are sampled, how it is padded.
//!
//! Along each axis node `i` lies at `lo + i h` and **the last node is exactly `hi`**: there are
//! `max(1, ceil(L / h - 1/4))` cells, so the last one is 0.25 to 1.25 spacings long (one spacing
//! where it divides the side).
//!
//! A node has a *placed* coordinate, where vertices go, and a *sampled* one, where the field is
//! asked. They differ on the outer planes only: there the field is sampled [`INSET`] spacings
//! further in, so that a solid that ends in the plane is cut flat by it whatever the rounding.
//!
//! The tables are *padded* by a layer of ghost nodes that are outside by decree: table position
//! `p` is node `p - 1`, position 0 and the one after the last node are ghosts. The cells between
//! nodes and ghosts are what caps the solid. A table is a multiple of [`BRICK`] long, plus one.
//! Ghosts and filler hold the coordinate halfway from the plane to where it is sampled, so that
//! tables never decrease and the way of the surface towards the plane can be told
//! (`place`).

use super::outlines::MOST_PLANES;
use crate::eval::BRICK;
use crate::geom::{Aabb, Axis};
use crate::mesh::io::Precision;
use glam::DVec3;

/// How far inside the outer planes the field is sampled, in spacings.
///
/// Smaller than any error of the mesh, yet larger than the rounding of coordinates up to a
/// million spacings from the origin: at `2^-40` one box in fifteen of random size and place
/// loses a face to rounding, at `2^-20` none.
pub const INSET: f64 = 1.0 / (1u64 << 20) as f64;

/// Least distance of a vertex from a node at which several edges are crossed, in edge lengths.
///
/// Keeps every triangle's area above `TAU^2 / 2` squared spacings.
pub const TAU: f64 = 1.0 / 1024.0;

/// Most cells along an axis.
pub const MAX_CELLS: usize = 1 << 18;

/// Most bricks in a grid: positions of bricks fit in 32 bits.
const MAX_BRICKS: u64 = 1 << 32;

/// Least length of an edge, and greatest coordinate: the volumes of cells and of the box are
/// numbers, and so are squares of areas.
const LENGTHS: [f64; 2] = [1e-70, 1e70];

/// Why a box and a spacing make no grid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// The box is empty, flat or unbounded along an axis.
    #[error("the box runs from {lo:?} to {hi:?} along {axis:?}; give finite bounds with lo < hi")]
    Bounds {
        /// The axis at fault.
        axis: Axis,
        /// Lower bound.
        lo: f64,
        /// Upper bound.
        hi: f64,
    },
    /// The spacing is not a positive number.
    #[error("the spacing along {axis:?} is {spacing}; give a positive number")]
    Spacing {
        /// The axis at fault.
        axis: Axis,
        /// The spacing given.
        spacing: f64,
    },
    /// Volumes would be too small or too large for numbers.
    #[error(
        "the box runs from {lo:e} to {hi:e} along {axis:?}, in edges of {spacing:e}; scale the \
         model: coordinates must be below {most:e}, and edges above {least:e}",
        least = LENGTHS[0], most = LENGTHS[1]
    )]
    Scale {
        /// The axis at fault.
        axis: Axis,
        /// Lower bound.
        lo: f64,
        /// Upper bound.
        hi: f64,
        /// Length of an edge.
        spacing: f64,
    },
    /// There would be too many nodes along an axis.
    #[error("{cells:.0} cells along {axis:?} are more than {MAX_CELLS}; give a larger spacing")]
    Cells {
        /// The axis at fault.
        axis: Axis,
        /// Cells asked for.
        cells: f64,
    },
    /// There would be too many bricks.
    #[error(
        "{bricks} bricks of samples are more than 2^32; give a larger spacing or smaller bounds"
    )]
    Bricks {
        /// Bricks asked for.
        bricks: u64,
    },
    /// Neighbouring nodes have the same rounded coordinate.
    #[error(
        "the spacing {spacing} along {axis:?} is lost in the rounding of coordinates near {at}; give a larger spacing or move the model to the origin"
    )]
    Rounding {
        /// The axis at fault.
        axis: Axis,
        /// The spacing given.
        spacing: f64,
        /// A coordinate where nodes coincide.
        at: f64,
    },
}

/// Coordinates along one axis.
#[derive(Clone, Debug, PartialEq)]
struct Line {
    cells: usize,
    placed: Vec<f64>,
    sampled: Vec<f64>,
    shortest: f64,
}

/// A rectilinear grid in a box, padded and cut into bricks.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    lines: [Line; 3],
}

impl Grid {
    /// The grid of `bounds` with the given `spacing` along each axis, in model units.
    ///
    /// # Errors
    /// [`GridError`] when the box or the spacing is degenerate, too fine or too large.
    pub fn new(bounds: Aabb, spacing: DVec3) -> Result<Self, GridError> {
        let line = |axis: Axis| {
            let a = axis.index();
            line(axis, bounds.lo[a], bounds.hi[a], spacing[a])
        };
        let grid = Self { lines: [line(Axis::X)?, line(Axis::Y)?, line(Axis::Z)?] };
        let bricks = grid.bricks().iter().map(|&n| u64::from(n)).product();
        if bricks > MAX_BRICKS { Err(GridError::Bricks { bricks }) } else { Ok(grid) }
    }

    /// The grid whose nodes along `axis` are at `heights`, and the same as here along the others: planes
    /// to cut a solid by.
    ///
    /// Heights on an outer plane are sampled as its nodes are.
    ///
    /// # Panics
    /// If there are no heights or more than [`MOST_PLANES`], they are not in order, or one is not between
    /// the outer planes.
    #[must_use]
    pub fn planes(&self, axis: Axis, heights: &[f64]) -> Self {
        assert!((1..=MOST_PLANES).contains(&heights.len()), "{} planes", heights.len());
        let mut planes = self.clone();
        let line = &mut planes.lines[axis.index()];
        let cells = line.cells;
        let [lo, hi] = [line.placed[1], line.placed[cells + 1]];
        assert!(heights.is_sorted() && heights.iter().all(|u| (lo..=hi).contains(u)), "heights");
        // Ghosts and filler are at the first and the last height.
        let at = |p: usize| heights[p.saturating_sub(1).min(heights.len() - 1)];
        let placed: Vec<f64> = (0..=BRICK).map(at).collect();
        let [first, last] = [line.sampled[1], line.sampled[cells + 1]];
        let sampled = placed.iter().map(|u| u.clamp(first, last)).collect();
        *line = Line { cells: heights.len() - 1, placed, sampled, shortest: f64::INFINITY };
        planes
    }

    /// Cells along each axis, ghosts apart.
    #[must_use]
    pub fn cells(&self) -> [usize; 3] {
        self.lines.each_ref().map(|line| line.cells)
    }

    /// Bricks along each axis.
    #[must_use]
    pub fn bricks(&self) -> [u32; 3] {
        self.lines.each_ref().map(|line| (line.sampled.len() / BRICK) as u32)
    }

    /// Coordinates where vertices are placed, by padded position.
    #[must_use]
    pub fn placed(&self, axis: Axis) -> &[f64] {
        &self.lines[axis.index()].placed
    }

    /// Coordinates where the field is sampled, by padded position; what a sampler is bound to.
    #[must_use]
    pub fn sampled(&self, axis: Axis) -> &[f64] {
        &self.lines[axis.index()].sampled
    }

    /// The sampled coordinates along x, y and z: the tables to bind a field to.
    #[must_use]
    pub fn tables(&self) -> [Vec<f64>; 3] {
        self.lines.each_ref().map(|line| line.sampled.clone())
    }

    /// The box that the grid fills.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let end = |pick: fn(&[f64]) -> Option<&f64>| {
            DVec3::from_array(
                Axis::ALL.map(|axis| pick(self.placed(axis)).copied().unwrap_or_default()),
            )
        };
        Aabb::new(end(<[f64]>::first), end(<[f64]>::last))
    }

    /// Largest magnitude of a coordinate.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.lines.iter().flat_map(|line| &line.placed).fold(0.0, |most, u| u.abs().max(most))
    }

    /// The least precision in which no triangle of a mesh of this grid loses its area.
    ///
    /// Vertices keep [`TAU`] edge lengths from the nodes that matter. Rounding is monotone, so they
    /// stay on their edges of the rounded grid as long as that distance is at least an ulp of the
    /// largest coordinate; [`Precision::to_resolve`] asks for four.
    #[must_use]
    pub fn precision(&self) -> Precision {
        Precision::to_resolve(TAU * self.shortest_edge(), self.extent())
    }

    /// Length of the shortest edge.
    #[must_use]
    pub fn shortest_edge(&self) -> f64 {
        self.lines.iter().map(|line| line.shortest).fold(f64::INFINITY, f64::min)
    }
}

fn line(axis: Axis, lo: f64, hi: f64, spacing: f64) -> Result<Line, GridError> {
    let length = hi - lo;
    if !(lo.is_finite() && hi.is_finite() && length > 0.0 && length.is_finite()) {
        return Err(GridError::Bounds { axis, lo, hi });
    }
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(GridError::Spacing { axis, spacing });
    }
    let cells = (length / spacing - 0.25).ceil().max(1.0);
    if cells > MAX_CELLS as f64 {
        return Err(GridError::Cells { axis, cells });
    }
    let cells = cells as usize;
    let node = |i: usize| if i == cells { hi } else { lo + i as f64 * spacing };
    let inset = INSET * spacing.min(length);
    let sample = |i: usize| match i {
        0 => lo + inset,
        _ if i == cells => hi - inset,
        _ => node(i),
    };
    // Cells p = 0..=cells + 1 of the padded grid are owned by bricks, their far corners are not.
    let table = (cells + 2).div_ceil(BRICK) * BRICK + 1;
    let real = |p: usize| p.saturating_sub(1).min(cells);
    let placed: Vec<f64> = (0..table).map(|p| node(real(p))).collect();
    let sampled: Vec<f64> = (0..table)
        .map(|p| match p {
            0 => lo + 0.5 * inset,
            _ if p > cells + 1 => hi - 0.5 * inset,
            _ => sample(real(p)),
        })
        .collect();
    let distinct = sampled[1] > lo && sampled[cells + 1] < hi;
    let merged = (1..=cells).find(|&p| sampled[p] >= sampled[p + 1] || placed[p] >= placed[p + 1]);
    if !distinct || merged.is_some() {
        let at = if lo.abs() > hi.abs() { lo } else { hi };
        return Err(GridError::Rounding { axis, spacing, at: merged.map_or(at, |p| placed[p]) });
    }
    let shortest = placed[1..=cells + 1].windows(2).map(|w| w[1] - w[0]);
    let shortest = shortest.fold(f64::INFINITY, f64::min);
    let [least, most] = LENGTHS;
    if shortest < least || lo.abs().max(hi.abs()) > most {
        return Err(GridError::Scale { axis, lo, hi, spacing });
    }
    Ok(Line { cells, placed, sampled, shortest })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(lo: f64, hi: f64, spacing: f64) -> Result<Grid, GridError> {
        Grid::new(Aabb::new(DVec3::splat(lo), DVec3::splat(hi)), DVec3::splat(spacing))
    }

    #[test]
    fn the_last_node_is_the_upper_bound() {
        for (lo, hi, spacing) in [(-1.0, 1.0, 2.0 / 49.0), (-1.0, 1.0, 0.3), (0.1, 0.7, 0.07)] {
            let grid = cube(lo, hi, spacing).unwrap();
            let n = grid.cells()[0];
            let nodes = &grid.placed(Axis::X)[1..n + 2];
            assert_eq!((nodes[0], nodes[n]), (lo, hi));
            let last = (nodes[n] - nodes[n - 1]) / spacing;
            assert!((0.2499..=1.2501).contains(&last), "{last}");
        }
        assert_eq!(cube(-1.0, 1.0, 2.0 / 49.0).unwrap().cells(), [49; 3]);
        assert_eq!(cube(0.0, 1.0, 10.0).unwrap().cells(), [1; 3]);
    }

    #[test]
    fn tables_are_padded_and_never_decrease() {
        for n in 1..40 {
            let grid = cube(0.0, n as f64, 1.0).unwrap();
            let table = grid.sampled(Axis::Z);
            assert_eq!(table.len() % BRICK, 1);
            assert!(table.len() >= n + 3 && table.len() < n + 3 + BRICK);
            assert!(table.is_sorted());
            assert_eq!((table[0], table[1]), (0.5 * INSET, INSET));
            assert_eq!(table[n + 1], n as f64 - INSET);
            assert!(table[n + 2..].iter().all(|u| *u == n as f64 - 0.5 * INSET));
            assert_eq!(grid.bricks()[2] as usize * BRICK + 1, table.len());
        }
    }

    #[test]
    fn degenerate_grids_are_refused() {
        assert!(matches!(cube(1.0, 1.0, 0.1), Err(GridError::Bounds { .. })));
        assert!(matches!(cube(0.0, f64::INFINITY, 0.1), Err(GridError::Bounds { .. })));
        assert!(matches!(cube(f64::NAN, 1.0, 0.1), Err(GridError::Bounds { .. })));
        assert!(matches!(cube(0.0, 1.0, 0.0), Err(GridError::Spacing { .. })));
        assert!(matches!(cube(0.0, 1.0, f64::NAN), Err(GridError::Spacing { .. })));
        assert!(matches!(cube(0.0, 1.0, 1e-9), Err(GridError::Cells { .. })));
        assert!(matches!(cube(0.0, 1.0, 1e-5), Err(GridError::Bricks { .. })));
        assert!(matches!(cube(1e15, 1e15 + 4.0, 1.0), Err(GridError::Rounding { .. })));
        assert!(matches!(cube(0.0, 2e70, 1e69), Err(GridError::Scale { .. })));
        assert!(matches!(cube(-2e70, -1e70, 1e69), Err(GridError::Scale { .. })));
        assert!(matches!(cube(0.0, 1e-70, 0.5e-70), Err(GridError::Scale { .. })));
        assert!(cube(0.0, 1e70, 1e69).is_ok() && cube(0.0, 3e-70, 1.5e-70).is_ok());
    }

    #[test]
    fn single_precision_serves_until_tau_is_four_ulps() {
        let precision = |lo, hi| cube(lo, hi, 2.0 / 400.0).unwrap().precision();
        assert_eq!(precision(-1.0, 1.0), Precision::Single);
        assert_eq!(precision(999.0, 1001.0), Precision::Double);
    }
}
