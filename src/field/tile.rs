//! The faces nearest to many points close together.
//!
//! A grid is cut into tiles of up to [`POINTS`] points. The leaf nearest to the middle of a tile
//! bounds the distances of all its points, the tree yields the leaves within that bound of the
//! tile's box, and each of these is tried on chunks of points that it can still improve, points
//! side by side in lanes. Since the nearest face is the least of an order without ties, the answers
//! are those of searching for each point alone.

use super::search::{Faces, Place, Search};
use crate::geom::bvh::{Found, reach};
use glam::DVec3;

/// Most points of a tile.
pub const POINTS: usize = 64;
/// Points side by side: a cube of two points a side, if the grid allows.
const CHUNK: usize = 8;

/// How a grid is cut into tiles.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Points along each axis: powers of two.
    pub sides: [usize; 3],
}

impl Shape {
    /// Tiles for a grid with so many points along each axis: as cubic as the grid allows.
    #[must_use]
    pub fn of(grid: [usize; 3]) -> Self {
        let mut sides = [1; 3];
        while sides.iter().product::<usize>() < POINTS {
            let axis = (0..3).filter(|a| sides[*a] < grid[*a]).min_by_key(|a| sides[*a]);
            let Some(axis) = axis else { break };
            sides[axis] *= 2;
        }
        Self { sides }
    }

    /// Positions of the points in the tile, neighbours in space being neighbours in order; their
    /// number.
    #[must_use]
    pub fn slots(self) -> ([[usize; 3]; POINTS], usize) {
        let count = self.sides.iter().product();
        let mut slots = [[0; 3]; POINTS];
        for (number, slot) in slots.iter_mut().enumerate().take(count) {
            let mut bits = number;
            let mut unit = 1;
            // One bit of the number an axis in turn.
            while unit < POINTS {
                for (axis, side) in self.sides.iter().enumerate() {
                    if unit < *side {
                        slot[axis] |= (bits & 1) * unit;
                        bits >>= 1;
                    }
                }
                unit *= 2;
            }
        }
        (slots, count)
    }
}

/// Points and their nearest faces.
#[derive(Clone, Debug)]
pub struct Tile {
    count: usize,
    scaled: [[f64; POINTS]; 3],
    /// In the tree's frame, in its precision.
    local: [[f32; POINTS]; 3],
    squared: [f64; POINTS],
    number: [f64; POINTS],
    /// Bounds on squared distances to boxes that may hold a nearer face.
    limit: [f32; POINTS],
    found: Vec<Found>,
}

impl Default for Tile {
    /// A tile without points.
    fn default() -> Self {
        Self {
            count: 0,
            scaled: [[0.0; POINTS]; 3],
            local: [[0.0; POINTS]; 3],
            squared: [f64::INFINITY; POINTS],
            number: [f64::INFINITY; POINTS],
            limit: [f32::MAX; POINTS],
            found: Vec::new(),
        }
    }
}

impl Tile {
    /// Number of the face nearest to a point.
    #[inline(always)]
    #[must_use]
    pub fn face(&self, point: usize) -> usize {
        self.number[point] as usize
    }

    /// Finds the faces nearest to `places`: at least one, at most [`POINTS`].
    #[inline(always)]
    pub fn search(&mut self, faces: &Faces, places: &[Place], search: &mut Search) {
        let (lo, hi) = self.fill(places);
        let middle = faces.at_local(0.5 * (lo + hi));
        // Only the leaf is of interest: it is the first guess for every point.
        let _ = faces.nearest(middle, search);
        let seed = search.leaf;
        for chunk in 0..self.count.div_ceil(CHUNK) {
            self.improve(faces, seed, chunk);
        }
        let bound = self.limit[..self.count].iter().copied().fold(0.0, f32::max);
        self.found.clear();
        let lo = lo.to_array().map(|x| (x as f32).next_down());
        let hi = hi.to_array().map(|x| (x as f32).next_up());
        faces.tree.within(lo, hi, bound, &mut search.stack, &mut self.found);
        for next in 0..self.found.len() {
            let leaf = self.found[next];
            if leaf.leaf != seed {
                for chunk in 0..self.count.div_ceil(CHUNK) {
                    if self.may_improve(&leaf, chunk) {
                        self.improve(faces, leaf.leaf, chunk);
                    }
                }
            }
        }
    }

    /// Takes over `places`, fills up the last chunk, and returns the corners of their box.
    #[inline(always)]
    fn fill(&mut self, places: &[Place]) -> (DVec3, DVec3) {
        self.count = places.len();
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for slot in 0..self.count.next_multiple_of(CHUNK) {
            let place = places[slot.min(places.len() - 1)];
            lo = lo.min(place.local);
            hi = hi.max(place.local);
            for axis in 0..3 {
                self.scaled[axis][slot] = place.scaled[axis];
                self.local[axis][slot] = place.local[axis] as f32;
            }
            self.squared[slot] = f64::INFINITY;
            self.number[slot] = f64::INFINITY;
        }
        (lo, hi)
    }

    /// Whether a leaf is within the limits of a chunk's points.
    #[inline(always)]
    fn may_improve(&self, leaf: &Found, chunk: usize) -> bool {
        let points = chunk * CHUNK..(chunk + 1) * CHUNK;
        let mut sum = [0.0_f32; CHUNK];
        for axis in 0..3 {
            let (lo, hi) = (leaf.lo[axis], leaf.hi[axis]);
            for (sum, x) in sum.iter_mut().zip(&self.local[axis][points.clone()]) {
                let (below, above) = (lo - x, x - hi);
                let gap = if below > above { below } else { above };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                *sum += gap * gap;
            }
        }
        let limits = &self.limit[points];
        sum.iter().zip(limits).fold(false, |any, (sum, limit)| any | (sum <= limit))
    }

    /// Tries the faces of a leaf on the points of a chunk.
    #[inline(always)]
    fn improve(&mut self, faces: &Faces, leaf: usize, chunk: usize) {
        let points = chunk * CHUNK..(chunk + 1) * CHUNK;
        let lanes = |row: &[f64; POINTS]| -> [f64; CHUNK] {
            std::array::from_fn(|i| row[chunk * CHUNK + i])
        };
        let at = [0, 1, 2].map(|axis| lanes(&self.scaled[axis]));
        let mut best = (lanes(&self.squared), lanes(&self.number));
        let packet = &faces.packets[leaf];
        for lane in packet.lanes() {
            best = packet.improve_all(lane, &at, best);
        }
        let (squared, number) = best;
        self.squared[points.clone()].copy_from_slice(&squared);
        self.number[points.clone()].copy_from_slice(&number);
        for (limit, squared) in self.limit[points].iter_mut().zip(squared) {
            *limit = reach(squared);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_a_tile_has_one_slot() {
        for grid in [[16, 16, 16], [16, 1, 1], [1, 5, 300], [2, 3, 1], [1, 1, 1], [3, 3, 3]] {
            let shape = Shape::of(grid);
            let (slots, count) = shape.slots();
            let mut seen: Vec<[usize; 3]> = slots[..count].to_vec();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), count);
            assert!(seen.iter().all(|s| (0..3).all(|a| s[a] < shape.sides[a])));
            assert!(count == POINTS || (0..3).all(|a| shape.sides[a] >= grid[a]));
        }
        assert_eq!(Shape::of([16; 3]).sides, [4; 3]);
        // The first chunk of a cubic tile is a cube.
        assert!(Shape::of([16; 3]).slots().0[..8].iter().flatten().all(|x| *x < 2));
    }
}
