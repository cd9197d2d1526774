//! The face nearest to a point.
//!
//! The nearest face is the least by (squared distance, number), an order without ties: whatever is
//! tried first, whatever is skipped, the answer at a point has the same bits.

use super::surface::Surface;
use super::triangle::{Nearest, Packet};
use crate::geom::bvh::{REMOTE, Stack, Visitor, reach};
use crate::geom::{Aabb, Bvh};
use glam::DVec3;
use rayon::prelude::*;

/// The faces of a surface, ready for searching.
#[derive(Clone, Debug)]
pub struct Faces {
    /// The surface times the scale of the tree's frame: its size is about 1, its bits are the same.
    pub surface: Surface,
    /// A tree over the faces.
    pub tree: Bvh,
    /// The faces of the tree's leaves.
    pub packets: Vec<Packet>,
    /// The tree's middle, scaled.
    middle: DVec3,
}

/// A point in the coordinates of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Times the scale.
    pub scaled: DVec3,
    /// Relative to the middle of the faces, times the scale.
    pub local: DVec3,
}

/// Scratch memory of a run of searches. Never changes an answer.
#[derive(Debug, Default)]
pub struct Search {
    /// Pending nodes.
    pub stack: Stack,
    /// The leaf with the last answer: a good first guess.
    pub leaf: usize,
}

impl Faces {
    /// Prepares `surface`, which has faces.
    #[must_use]
    pub fn new(mut surface: Surface) -> Self {
        let boxes: Vec<Aabb> = (0..surface.triangles.len())
            .into_par_iter()
            .map(|face| Aabb::around(surface.corners(face)))
            .collect();
        let tree = Bvh::build(&boxes);
        let scale = tree.frame().scale;
        surface.positions.par_iter_mut().for_each(|position| *position *= scale);
        let corners = |face: u32| surface.corners(face as usize);
        let packets = tree.leaves().par_iter().map(|faces| Packet::new(faces, corners)).collect();
        let middle = tree.frame().middle * scale;
        Self { surface, tree, packets, middle }
    }

    /// The place of a point of the model; none if it is so far away that the surface is a point.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, point: DVec3) -> Option<Place> {
        let frame = self.tree.frame();
        let local = frame.local(point);
        // False for NaN.
        let near = local.abs().cmplt(DVec3::splat(REMOTE)).all();
        near.then(|| Place { scaled: point * frame.scale, local })
    }

    /// The place at `local`, up to rounding.
    #[inline(always)]
    #[must_use]
    pub fn at_local(&self, local: DVec3) -> Place {
        Place { scaled: local + self.middle, local }
    }

    /// The face nearest to `place`.
    #[inline(always)]
    #[must_use]
    pub fn nearest(&self, place: Place, search: &mut Search) -> Nearest {
        let at = place.local.to_array().map(|x| x as f32);
        let mut attempt = Attempt {
            packets: &self.packets,
            point: place.scaled.to_array(),
            nearest: Nearest::NONE,
            first: search.leaf,
            leaf: search.leaf,
        };
        self.packets[search.leaf].improve(attempt.point, &mut attempt.nearest);
        let bound = reach(attempt.nearest.squared);
        self.tree.nearest(at, &mut search.stack, bound, &mut attempt);
        search.leaf = attempt.leaf;
        attempt.nearest
    }
}

/// A search under way.
struct Attempt<'a> {
    packets: &'a [Packet],
    point: [f64; 3],
    nearest: Nearest,
    /// The leaf that was tried before the search.
    first: usize,
    /// The leaf that holds the nearest face.
    leaf: usize,
}

impl Visitor for Attempt<'_> {
    #[inline(always)]
    fn visit(&mut self, leaf: usize) -> f32 {
        if leaf != self.first {
            let before = self.nearest;
            self.packets[leaf].improve(self.point, &mut self.nearest);
            if self.nearest != before {
                self.leaf = leaf;
            }
        }
        reach(self.nearest.squared)
    }
}
