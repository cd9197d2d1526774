//! The face nearest to a point.
//!
//! The nearest face is the least by (squared distance, number), an order without ties, where the
//! distance is that of [`closest`]. Single precision finds the few faces that may be it, whatever
//! the order of the search, and [`closest`] decides among them: whatever is tried first, whatever
//! is skipped, the answer at a point has the same bits.
//!
//! Points that follow lines towards a root come back again and again, nearer each time. A search
//! may leave a mark: all faces that can be the nearest somewhere within a small radius. The next
//! search within it looks at these alone.

use super::balls::Balls;
use super::surface::Surface;
use super::triangle::{Closest, Doubt, Packet, closest, unit_normal};
use crate::geom::Bvh;
use crate::geom::bvh::{LEAF, REMOTE, Stack, Visitor};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// The faces of a surface, ready for searching.
#[derive(Clone, Debug)]
pub struct Faces {
    /// The surface times the scale of the tree's frame: its size is about 1, its bits are the same.
    pub surface: Surface,
    /// A tree over the faces.
    pub tree: Bvh,
    /// Unit normals; zero for faces without area.
    normals: Vec<DVec3>,
    /// The faces of the tree's leaves.
    packets: Vec<Packet>,
    /// The tree's middle, scaled.
    middle: DVec3,
    /// Size of a face.
    grain: f32,
    doubt: Doubt,
    /// The number of the surface, which no other one of the process has.
    pub identity: u64,
}

/// The faces that can be the nearest within a radius of a place, of one surface.
#[derive(Clone, Copy, Debug)]
struct Mark {
    surface: u64,
    at: DVec3,
    /// Squared.
    radius: f64,
    leaf: u32,
    count: usize,
    faces: [u32; MARKED],
}

impl Mark {
    const NONE: Self =
        Self { surface: 0, at: DVec3::ZERO, radius: 0.0, leaf: 0, count: 0, faces: [0; MARKED] };
}

/// A point in the coordinates of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Times the scale.
    pub scaled: DVec3,
    /// Relative to the middle of the faces, times the scale.
    pub local: DVec3,
}

/// Faces that may be the nearest, at most this many before they are looked into.
const CANDIDATES: usize = 128;
/// Most faces of a mark.
const MARKED: usize = 8;
/// Marks that are kept.
pub const MARKS: usize = 256;
/// Radius of a mark at most, in units of the distance from the surface: enough for Newton's method,
/// whose next step is about that.
const STRIDE: f32 = 1.25;
/// Radius of a mark at most, in sizes of a face. At a distance of d faces, one within r faces
/// takes in those within a distance of 2 sqrt(d r) of the foot; this keeps them few.
const NEAR: f32 = 0.125;

/// Numbers surfaces, so that marks are not taken for those of another one.
static SURFACES: AtomicU64 = AtomicU64::new(1);

/// Scratch memory of a run of searches. Never changes an answer but a stand-in.
#[derive(Debug)]
pub struct Search {
    stack: Stack,
    /// The leaf with the last answer: a good first guess, for any surface.
    leaf: usize,
    squared: [f32; CANDIDATES],
    face: [u32; CANDIDATES],
    leaf_of: [u32; CANDIDATES],
    marks: Box<[Mark; MARKS]>,
    /// Values that may stand in for others.
    pub balls: Balls,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            stack: Stack::default(),
            leaf: 0,
            squared: [0.0; CANDIDATES],
            face: [0; CANDIDATES],
            leaf_of: [0; CANDIDATES],
            marks: Box::new([Mark::NONE; MARKS]),
            balls: Balls::default(),
        }
    }
}

/// A face and its point closest to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Number of the face.
    pub face: usize,
    /// The closest point, in the coordinates of the search.
    pub closest: Closest,
}

impl Faces {
    /// Prepares `surface`, which has faces.
    #[must_use]
    pub fn new(mut surface: Surface) -> Self {
        let tree = Bvh::build(surface.triangles.len(), |face| surface.corners(face));
        let frame = tree.frame();
        let corners = |face: u32| surface.corners(face as usize).map(|corner| frame.local(corner));
        let packets = tree.leaves().par_iter().map(|faces| Packet::new(faces, corners)).collect();
        surface.positions.par_iter_mut().for_each(|position| *position *= frame.scale);
        let normals = (0..surface.triangles.len())
            .into_par_iter()
            .map(|face| unit_normal(surface.corners(face)).unwrap_or(DVec3::ZERO))
            .collect();
        let middle = frame.middle * frame.scale;
        let area: f64 = surface.faces().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum();
        let grain = (area / surface.triangles.len() as f64).sqrt() as f32;
        let longest = surface.faces().flat_map(|[a, b, c]| [b - a, c - b, a - c]);
        let longest = longest.map(|edge| edge.length_squared()).fold(0.0, f64::max).sqrt();
        let identity = SURFACES.fetch_add(1, Ordering::Relaxed);
        let doubt = Doubt::new(longest);
        Self { surface, tree, normals, packets, middle, grain, doubt, identity }
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

    /// The unit normal of a face, if it has area.
    #[inline(always)]
    #[must_use]
    pub fn normal(&self, face: usize) -> Option<DVec3> {
        let normal = self.normals[face];
        (normal != DVec3::ZERO).then_some(normal)
    }

    /// The face nearest to `place`.
    #[inline(always)]
    #[must_use]
    pub fn nearest(&self, place: Place, search: &mut Search) -> Nearest {
        self.look(place, search, None)
    }

    /// The face nearest to `place`, which is the next on a way towards a root: one of [`MARKS`].
    #[inline(always)]
    #[must_use]
    pub fn nearest_on(&self, way: usize, place: Place, search: &mut Search) -> Nearest {
        let mark = &search.marks[way % MARKS];
        if mark.surface == self.identity
            && mark.at.distance_squared(place.local) <= mark.radius
            && let Some(best) = self.best(place, &mark.faces[..mark.count], &[], None)
        {
            search.leaf = mark.leaf as usize;
            return best.nearest;
        }
        self.look(place, search, Some(way % MARKS))
    }

    #[inline(always)]
    fn look(&self, place: Place, search: &mut Search, way: Option<usize>) -> Nearest {
        let Search { stack, leaf, squared, face, leaf_of, marks, balls: _ } = search;
        let first = if *leaf < self.packets.len() { *leaf } else { 0 };
        let mut attempt = Attempt {
            faces: self,
            place,
            at: place.local.to_array().map(|x| x as f32),
            least: f32::MAX,
            bound: f32::MAX,
            marking: way.is_some(),
            count: 0,
            squared,
            face,
            leaf_of,
            first: usize::MAX,
            best: None,
        };
        let bound = attempt.visit(first);
        attempt.first = first;
        self.tree.nearest(attempt.at, stack, bound, &mut attempt);
        // No face has been dropped so far if none has been looked into.
        let whole = attempt.best.is_none();
        attempt.narrow();
        let count = attempt.count;
        if let Some(way) = way {
            let mark = &mut marks[way];
            mark.surface = 0;
            if whole && count <= MARKED {
                let radius = f64::from(attempt.radius());
                mark.surface = self.identity;
                mark.at = place.local;
                // A little less for what single precision makes of it.
                mark.radius = 0.999 * radius * radius;
                mark.leaf = attempt.leaf_of[0];
                mark.count = count;
                mark.faces[..count].copy_from_slice(&attempt.face[..count]);
            }
            attempt.bound = self.doubt.bound(attempt.least, 0.0);
        }
        attempt.settle();
        // There is a face, and every face is within the first bound.
        let best = match attempt.best {
            None => self.best(place, &[0], &[0], None),
            best => best,
        };
        let best = best.expect("a surface has faces, all of them within the first bound");
        *leaf = best.leaf as usize;
        best.nearest
    }

    /// The nearest of `faces`, from `leaves` if they are told, and of `best`.
    #[inline(always)]
    fn best(
        &self,
        place: Place,
        faces: &[u32],
        leaves: &[u32],
        mut best: Option<Best>,
    ) -> Option<Best> {
        for (slot, face) in faces.iter().enumerate() {
            let face = *face as usize;
            let closest = closest(place.scaled, &self.surface.corners(face), self.normal(face));
            let squared = closest.offset.length_squared();
            // Nearer, or as near and of lower number: an order without ties, so that the order of
            // the search does not show.
            let precedes = best.as_ref().is_none_or(|best| {
                squared < best.squared || (squared == best.squared && face < best.nearest.face)
            });
            if precedes {
                let leaf = leaves.get(slot).copied().unwrap_or_default();
                best = Some(Best { squared, nearest: Nearest { face, closest }, leaf });
            }
        }
        best
    }
}

/// The nearest face so far.
#[derive(Clone, Copy)]
struct Best {
    squared: f64,
    nearest: Nearest,
    leaf: u32,
}

/// A search under way.
struct Attempt<'a> {
    faces: &'a Faces,
    place: Place,
    at: [f32; 3],
    /// The least squared distance met, in single precision.
    least: f32,
    /// What it leaves in doubt.
    bound: f32,
    /// Whether faces are kept for a mark.
    marking: bool,
    /// Faces in doubt: their squared distances, numbers and leaves.
    count: usize,
    squared: &'a mut [f32; CANDIDATES],
    face: &'a mut [u32; CANDIDATES],
    leaf_of: &'a mut [u32; CANDIDATES],
    /// The leaf that was tried before the search.
    first: usize,
    best: Option<Best>,
}

impl Attempt<'_> {
    /// Radius of the mark to be left.
    #[inline(always)]
    fn radius(&self) -> f32 {
        if !self.marking {
            return 0.0;
        }
        let (distance, grain) = (self.least.sqrt(), self.faces.grain);
        let flat = if distance > grain { grain / distance } else { 1.0 };
        (STRIDE * distance).min(NEAR * grain * flat)
    }

    /// Drops faces that are no longer in doubt.
    #[inline(always)]
    fn narrow(&mut self) {
        let mut kept = 0;
        for i in 0..self.count {
            let near = self.squared[i] <= self.bound;
            self.squared[kept] = self.squared[i];
            self.face[kept] = self.face[i];
            self.leaf_of[kept] = self.leaf_of[i];
            kept += usize::from(near);
        }
        self.count = kept;
    }

    /// Looks into the faces in doubt.
    #[inline(always)]
    fn settle(&mut self) {
        self.narrow();
        let (faces, leaves) = (&self.face[..self.count], &self.leaf_of[..self.count]);
        self.best = self.faces.best(self.place, faces, leaves, self.best);
        self.count = 0;
    }
}

impl Visitor for Attempt<'_> {
    #[inline(always)]
    fn visit(&mut self, leaf: usize) -> f32 {
        if leaf == self.first {
            return self.bound;
        }
        let packet = &self.faces.packets[leaf];
        let squared = packet.squared_distances(self.at);
        let least = squared.iter().fold(f32::MAX, |least, s| if *s < least { *s } else { least });
        if least > self.bound {
            return self.bound;
        }
        if least < self.least {
            self.least = least;
            self.bound = self.faces.doubt.bound(least, self.radius());
        }
        if self.count > CANDIDATES - LEAF {
            self.narrow();
            if self.count > CANDIDATES - LEAF {
                self.settle();
            }
        }
        for (lane, squared) in squared.into_iter().enumerate() {
            // Written always and kept if in doubt: no branch to mispredict.
            let slot = self.count & (CANDIDATES - 1);
            self.squared[slot] = squared;
            self.face[slot] = packet.numbers()[lane];
            self.leaf_of[slot] = leaf as u32;
            self.count += usize::from(squared <= self.bound);
        }
        self.bound
    }
}
