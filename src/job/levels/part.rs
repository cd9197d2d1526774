//! The part that a lattice is put in, in cells that divide a box, and how much of each cell is in it.

use super::values_at;
use crate::eval::interpret;
use crate::expr::{Failure, Graph, NodeId, derive};
use crate::geom::Aabb;
use crate::num::{EVEN_STEPS, Interval};
use glam::DVec3;
use rayon::prelude::*;
use std::iter::successors;
use std::ops::Range;

/// Cells a side of the blocks that are enclosed, and evaluated one after the other.
const SIDE: usize = 4;

/// Boxes enclosed at once.
const BOXES: usize = 512;

/// How much farther than a plane through a cell's middle says a face may be and pass through the cell.
const SURE: f64 = 1.2;

/// Lines a side along which a cell cut by a plane is measured.
const LINES: usize = 4;

/// The lists of coordinates of points.
pub(super) type Points = [Vec<f64>; 3];

/// Cells that divide a box evenly, x fastest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    lo: DVec3,
    size: DVec3,
    counts: [usize; 3],
}

impl Cells {
    /// About `count` cells, at most three times as many, nearly cubes where the box has room for them:
    /// there is one cell along a side that is shorter than theirs.
    pub fn new(bounds: Aabb, count: usize) -> Self {
        let mut sides = bounds.size().to_array();
        sides.sort_unstable_by(f64::total_cmp);
        let [least, middle, most] = sides;
        let count = count as f64;
        let cube = libm::cbrt(least / most * (middle / most) / count) * most;
        let square = (middle / most / count).sqrt() * most;
        let side = if cube <= least {
            cube
        } else if square <= middle {
            square
        } else {
            most / count
        };
        let counts =
            bounds.size().to_array().map(|length| ((length / side).round() as usize).max(1));
        let size = bounds.size() / DVec3::from_array(counts.map(|n| n as f64));
        Self { lo: bounds.lo, size, counts }
    }

    /// The longest side of a cell.
    pub fn longest(&self) -> f64 {
        self.size.max_element()
    }

    /// The area of a cell's side across an axis, in units of its longest side squared.
    pub fn side(&self, axis: usize) -> f64 {
        self.volume() / (self.size[axis] / self.longest())
    }

    /// The volume of a cell, in units of its longest side cubed.
    pub fn volume(&self) -> f64 {
        (self.size / self.longest()).element_product()
    }

    fn count(&self) -> usize {
        self.counts.iter().product()
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.counts[0] * (y + self.counts[1] * z)
    }

    fn place(&self, cell: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [cell % nx, cell / nx % ny, cell / (nx * ny)]
    }

    /// The points of cells at these shares of their sides, by coordinate.
    pub fn points(&self, points: impl Iterator<Item = (usize, DVec3)>) -> Points {
        let mut lists = [const { Vec::new() }; 3];
        let (least, most) = points.size_hint();
        let capacity = most.unwrap_or(least);
        lists.iter_mut().for_each(|list: &mut Vec<f64>| list.reserve(capacity));
        for (cell, share) in points {
            let point = self.lo
                + (DVec3::from_array(self.place(cell).map(|i| i as f64)) + share) * self.size;
            for (list, value) in lists.iter_mut().zip(point.to_array()) {
                list.push(value);
            }
        }
        lists
    }

    /// A point in each cell.
    pub fn scattered(&self) -> Points {
        self.points((0..self.count()).zip(scattered(0)))
    }

    /// The cell and those that touch it.
    pub fn around(&self, cell: usize) -> impl Iterator<Item = usize> + '_ {
        let place = self.place(cell);
        let ends = move |axis: usize| {
            place[axis].saturating_sub(1)..(place[axis] + 2).min(self.counts[axis])
        };
        let row = move |y: usize, z: usize| ends(0).map(move |x| self.index([x, y, z]));
        ends(2).flat_map(move |z| ends(1).map(move |y| (y, z))).flat_map(move |(y, z)| row(y, z))
    }

    /// The cell after it along an axis.
    pub fn next(&self, cell: usize, axis: usize) -> Option<usize> {
        let mut place = self.place(cell);
        place[axis] += 1;
        (place[axis] < self.counts[axis]).then(|| self.index(place))
    }

    /// Whether the cell lies at the box's side.
    fn is_outer(&self, cell: usize) -> bool {
        let place = self.place(cell);
        (0..3).any(|axis| place[axis] == 0 || place[axis] + 1 == self.counts[axis])
    }

    /// The blocks of [`SIDE`] cells a side: the ranges of their cells along each axis.
    fn blocks(&self) -> Vec<[Range<usize>; 3]> {
        let counts = self.counts.map(|n| n.div_ceil(SIDE));
        let block = |number: usize| {
            let place = [
                number % counts[0],
                number / counts[0] % counts[1],
                number / (counts[0] * counts[1]),
            ];
            std::array::from_fn(|axis| {
                let first = place[axis] * SIDE;
                first..(first + SIDE).min(self.counts[axis])
            })
        };
        (0..counts.iter().product()).map(block).collect()
    }

    /// The cells of a block.
    fn cells_of(&self, [xs, ys, zs]: &[Range<usize>; 3]) -> Vec<usize> {
        let rows = zs.clone().flat_map(|z| ys.clone().map(move |y| (y, z)));
        rows.flat_map(|(y, z)| xs.clone().map(move |x| self.index([x, y, z]))).collect()
    }

    /// The sides of a block.
    fn sides_of(&self, block: &[Range<usize>; 3]) -> [Interval; 3] {
        std::array::from_fn(|axis| {
            let end = |n: usize| self.lo[axis] + self.size[axis] * n as f64;
            Interval::new(end(block[axis].start), end(block[axis].end))
        })
    }
}

/// Shares of a cell's sides, spread evenly as their number grows: those from `number` on.
pub(super) fn scattered(number: usize) -> impl Iterator<Item = DVec3> {
    let start = EVEN_STEPS.map(|step| (0.5 + step * number as f64).fract());
    let next = |at: &DVec3| {
        let at = *at + DVec3::from_array(EVEN_STEPS);
        Some(at - DVec3::select(at.cmpge(DVec3::ONE), DVec3::ONE, DVec3::ZERO))
    };
    successors(Some(DVec3::from_array(start)), next)
}

/// The cells of a part.
pub(super) struct Part {
    pub cells: Cells,
    /// How much of each cell is in the part, from 0 to 1.
    pub weights: Vec<f64>,
    /// The cells in the part and those that touch them, rising.
    pub near: Vec<usize>,
    /// The cells that the part's faces may pass through, rising.
    cut: Vec<(usize, Eighths)>,
}

/// The part's field in the eighths of a cell, of which the lower ones along x are even.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eighths([Plane; 8]);

/// The part's field in an eighth of a cell, as if it were linear: negative inside.
#[derive(Clone, Copy, Debug)]
struct Plane {
    /// The value in the middle.
    value: f64,
    /// What the field rises by along the sides.
    rise: DVec3,
}

impl Plane {
    /// The share of the eighth where the field is negative: the mean of [`LINES`]² lines along the
    /// axis that the field changes most along.
    fn share(&self) -> f64 {
        let Self { value, rise } = *self;
        let steepest = (0..3)
            .fold(0, |best, axis| if rise[axis].abs() > rise[best].abs() { axis } else { best });
        let [u, v] = [(steepest + 1) % 3, (steepest + 2) % 3];
        let along = rise[steepest].abs();
        if along == 0.0 || !along.is_finite() || !value.is_finite() {
            return f64::from(u8::from(value < 0.0));
        }
        let offset = |i: usize| (i as f64 + 0.5) / LINES as f64 - 0.5;
        let line = |i: usize| {
            let at = value + rise[u] * offset(i % LINES) + rise[v] * offset(i / LINES);
            (0.5 - at / along).clamp(0.0, 1.0)
        };
        (0..LINES * LINES).map(line).sum::<f64>() / (LINES * LINES) as f64
    }
}

impl Part {
    /// The part in which a solid changes between two fields: one with nothing of a lattice left in, and
    /// one with everything.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    pub fn new(
        graph: Graph,
        [empty, full]: [NodeId; 2],
        parameters: &[f64],
        cells: Cells,
    ) -> Result<Self, Failure> {
        let mut ends = Ends { graph, full, empty: Some(empty), parameters };
        let (values, mut open) = ends.middles(&cells)?;
        // Faces may also pass between the middle of a cell and the box's side.
        let is_edge = |&cell: &usize| {
            let own = values[cell] < 0.0;
            cells.is_outer(cell) || cells.around(cell).any(|other| (values[other] < 0.0) != own)
        };
        open.sort_unstable();
        open.retain(is_edge);
        let mut weights: Vec<f64> =
            values.iter().map(|value| f64::from(u8::from(*value < 0.0))).collect();
        let cut = ends.cut(&cells, &open)?;
        for (cell, Eighths(planes)) in &cut {
            weights[*cell] = planes.iter().map(Plane::share).sum::<f64>() / 8.0;
        }
        let is_near = |&cell: &usize| cells.around(cell).any(|other| weights[other] > 0.0);
        let near = (0..cells.count()).into_par_iter().filter(is_near).collect();
        Ok(Self { cells, weights, near, cut })
    }

    /// A point in each of the cells near the part.
    pub fn scattered(&self) -> Points {
        self.cells.points(self.near.iter().copied().zip(scattered(0)))
    }

    /// Those of `values`, one for each cell near the part, in cells of the part.
    pub fn own<'v>(&'v self, values: &'v [f64]) -> impl Iterator<Item = f64> + Clone + 'v {
        let pairs = self.near.iter().zip(values).filter(|(cell, _)| self.weights[**cell] > 0.0);
        pairs.map(|(_, value)| *value)
    }

    /// The mean over the part of `values`, one for each cell near it; none of an empty part.
    pub fn mean(&self, values: &[f64]) -> Option<f64> {
        let whole: f64 = self.near.iter().map(|&cell| self.weights[cell]).sum();
        let sum: f64 =
            self.near.iter().zip(values).map(|(&cell, value)| self.weights[cell] * value).sum();
        (whole > 0.0).then(|| sum / whole)
    }

    /// The eighths of a cell that faces of the part may pass through.
    pub fn eighths(&self, cell: usize) -> Option<&Eighths> {
        let found = self.cut.binary_search_by_key(&cell, |(cell, _)| *cell).ok()?;
        Some(&self.cut[found].1)
    }
}

impl Eighths {
    /// Whether the point of the cell at these shares of its sides is in the part.
    pub fn has(&self, share: DVec3) -> bool {
        let upper = share.to_array().map(|share| usize::from(share >= 0.5));
        let k = upper[0] | upper[1] << 1 | upper[2] << 2;
        let Plane { value, rise } = self.0[k];
        value + 2.0 * rise.dot(share - middle(k)) < 0.0
    }
}

/// Where in a cell the middle of its eighth `k` is.
fn middle(k: usize) -> DVec3 {
    DVec3::from_array([k & 1, k >> 1 & 1, k >> 2].map(|upper| 0.25 + 0.5 * upper as f64))
}

/// Tangent planes in the middles of eighths, moved to the mean of the field over each: 1/24 of the
/// sum of its second differences along the axes above the value in the middle.
fn bent(planes: [Plane; 8]) -> [Plane; 8] {
    std::array::from_fn(|k| {
        let Plane { value, rise } = planes[k];
        let along = |axis: usize| {
            let [before, after] = [k & !(1 << axis), k | 1 << axis];
            planes[after].rise[axis] - planes[before].rise[axis]
        };
        let sum: f64 = (0..3).map(along).sum();
        // Near kinks, and where a slope is not finite, planes are all there is.
        let bend = if sum.abs() <= rise.length() { sum / 24.0 } else { 0.0 };
        Plane { value: value + bend, rise }
    })
}

/// The solid at both ends of a level.
struct Ends<'a> {
    graph: Graph,
    /// Its field with everything of the lattice left in.
    full: NodeId,
    /// Its field with nothing left in, if anything of the solid may be left then.
    empty: Option<NodeId>,
    parameters: &'a [f64],
}

impl Ends<'_> {
    /// The part's field in the middle of each cell, infinite where a whole block of cells is on one
    /// side, and the cells of all other blocks. Finds out whether anything may be left.
    fn middles(&mut self, cells: &Cells) -> Result<(Vec<f64>, Vec<usize>), Failure> {
        let blocks = cells.blocks();
        let sides: Vec<_> = blocks.iter().map(|block| cells.sides_of(block)).collect();
        let full = self.ranges(self.full, &sides)?;
        let empty = match self.empty {
            Some(empty) => self.ranges(empty, &sides)?,
            None => vec![Interval::point(f64::INFINITY); sides.len()],
        };
        let mut values = vec![f64::INFINITY; cells.count()];
        let mut open = Vec::new();
        let mut has_core = false;
        for (block, (empty, full)) in blocks.iter().zip(empty.into_iter().zip(full)) {
            let is_in = full.is_inside() && empty.is_outside() && !empty.nan;
            if is_in {
                cells.cells_of(block).into_iter().for_each(|cell| values[cell] = -f64::INFINITY);
            } else if !full.is_outside() && !empty.is_inside() {
                open.extend(cells.cells_of(block));
                has_core |= empty.nan || full.nan || -empty.lo > full.lo;
            }
        }
        self.empty = self.empty.filter(|_| has_core);
        let at = cells.points(open.iter().map(|&cell| (cell, DVec3::splat(0.5))));
        let found = self.at(&at, [self.full], self.empty.map(|empty| [empty]))?;
        for (&cell, [value]) in open.iter().zip(&found) {
            values[cell] = *value;
        }
        Ok((values, open))
    }

    /// Ranges of a field over boxes.
    fn ranges(&self, field: NodeId, sides: &[[Interval; 3]]) -> Result<Vec<Interval>, Failure> {
        let some = |boxes: &[[Interval; 3]]| -> Result<Vec<Interval>, Failure> {
            let lists: [Vec<Interval>; 3] =
                std::array::from_fn(|axis| boxes.iter().map(|sides| sides[axis]).collect());
            let at = lists.each_ref().map(Vec::as_slice);
            let mut out = vec![Interval::point(0.0); boxes.len()];
            interpret::enclose(&self.graph, &[field], at, self.parameters, &mut out)?;
            Ok(out)
        };
        let found = sides.par_chunks(BOXES).map(some).collect::<Result<Vec<_>, _>>()?;
        Ok(found.concat())
    }

    /// Those of `edges`, rising, that faces may pass through.
    fn cut(&mut self, cells: &Cells, edges: &[usize]) -> Result<Vec<(usize, Eighths)>, Failure> {
        let mut with_slopes = |field: NodeId| {
            let [x, y, z] = derive::gradient(&mut self.graph, field);
            [field, x, y, z]
        };
        let (full, empty) = (with_slopes(self.full), self.empty.map(with_slopes));
        let planes = |at: &Points| -> Result<Vec<Plane>, Failure> {
            let plane = |[value, slope @ ..]: [f64; 4]| Plane {
                value,
                rise: DVec3::from_array(slope) * cells.size,
            };
            Ok(self.at(at, full, empty)?.into_iter().map(plane).collect())
        };
        let centre = DVec3::splat(0.5);
        let middles = planes(&cells.points(edges.iter().map(|&cell| (cell, centre))))?;
        let is_cut = |(_, plane): &(&usize, &Plane)| {
            let reach = SURE * 0.5 * plane.rise.abs().element_sum();
            plane.value.abs() <= reach || reach.is_nan()
        };
        let pairs = edges.iter().zip(&middles).filter(is_cut);
        let cut: Vec<usize> = pairs.map(|(&cell, _)| cell).collect();
        let places = cut.iter().flat_map(|&cell| (0..8).map(move |k| (cell, middle(k))));
        let mut found = planes(&cells.points(places))?;
        found.iter_mut().for_each(|plane| plane.rise *= 0.5);
        let of_cell = |(&cell, planes): (&usize, &[Plane])| {
            (cell, Eighths(bent(std::array::from_fn(|k| planes[k]))))
        };
        Ok(cut.iter().zip(found.chunks_exact(8)).map(of_cell).collect())
    }

    /// The part's field, and what the lists have after it, its derivatives: of the solid with everything
    /// left in or, where it is greater, of the complement of the solid with nothing left in.
    fn at<const N: usize>(
        &self,
        at: &Points,
        full: [NodeId; N],
        empty: Option<[NodeId; N]>,
    ) -> Result<Vec<[f64; N]>, Failure> {
        let values = |outputs: [NodeId; N]| -> Result<Vec<[f64; N]>, Failure> {
            let lists = values_at(&self.graph, at, &outputs, self.parameters)?;
            let one = |i: usize| std::array::from_fn(|k| lists[k][i]);
            Ok((0..at[0].len()).map(one).collect())
        };
        let mut found = values(full)?;
        let Some(empty) = empty else { return Ok(found) };
        for (full, empty) in found.iter_mut().zip(values(empty)?) {
            let complement = empty.map(|value| -value);
            // Where one of the two is NaN the point is not in the part.
            if full[0].is_nan() || complement[0].is_nan() {
                *full = [f64::INFINITY; N];
            } else if complement[0] > full[0] {
                *full = complement;
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_of_any_shape_is_divided_into_as_many_cells_as_asked_for() {
        for size in [
            [1.0, 1.0, 1.0],
            [1.0, 0.7, 0.6],
            [1e11, 1.0, 1.0],
            [1.0, 1e16, 1.0],
            [1e4, 1e4, 1e-2],
            [1e-60, 1e70, 1e70],
            [3.0, 3.0, 0.04],
        ] {
            let size = DVec3::from_array(size);
            for count in [512, 1 << 15, 1 << 20] {
                let cells = Cells::new(Aabb::new(DVec3::ZERO, size), count);
                let found = cells.count();
                assert!(found >= count / 3 && found <= 3 * count, "{size}: {found} for {count}");
            }
        }
    }

    #[test]
    fn cells_are_cubes_where_there_is_room() {
        let cells = Cells::new(Aabb::new(DVec3::ZERO, DVec3::new(4.0, 2.0, 1.0)), 1000);
        assert_eq!(cells.counts, [20, 10, 5]);
    }
}
