//! A wide bounding-volume tree over hulls of points, such as triangles.
//!
//! A node holds a box around each of up to [`WIDTH`] children, as a structure of arrays in single
//! precision, in coordinates relative to the middle of everything and divided by its size. The box
//! of a child that is nearly flat is turned with it: seen from afar the parts of a tilted surface
//! are then told apart by their heights, where upright boxes would overlap in distance. Boxes
//! are grown so that the distance to a box, computed in single precision, never exceeds the
//! distance to what is in it by more than a fixed slack: traversals with [`reach`] miss nothing.
//!
//! The tree depends on the items only, not on threads. Any items will do, equal ones included.
//!
//! Source: oriented boxes after Gottschalk, Lin, Manocha 1996, doi:10.1145/237170.237244, their
//! axes from the mean normal in place of a covariance.

mod build;

use crate::geom::Aabb;
use glam::DVec3;

/// Children of a node.
pub const WIDTH: usize = 8;
/// Items of a leaf.
pub const LEAF: usize = 8;
/// Fills up the items of a leaf.
pub const NO_ITEM: u32 = u32::MAX;
/// Points at least this far from the middle, in units of the size, are *remote*: single precision
/// would overflow for them, and all items are equally far to less than a rounding error.
pub const REMOTE: f64 = (1_u64 << 60) as f64;

/// Relative excess allowed to squared distances to boxes. A coordinate of a point in a box's frame
/// is off by seven roundings of single precision in units of the distance from the box's center,
/// which is less than twice the distance from the box where the growth of boxes does not cover it.
const SLACK: f64 = 1.0 / (1 << 17) as f64;
/// Powers of two, a lane each.
const FLAGS: [f32; WIDTH] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0];
/// Depth from which ranges are halved by count: bounds the depth for any input.
const HALVING_DEPTH: u32 = 48;
/// Room for pending children. Every split of a range adds to its depth, so that nodes lie at most
/// [`HALVING_DEPTH`] and the 32 halvings of 2^32 items deep, with [`WIDTH`] - 1 pending each.
const STACK: usize = (HALVING_DEPTH as usize + 32) * (WIDTH - 1) + WIDTH;

/// The coordinates of a tree: `(p - middle) * scale`, in which all boxes lie in `[-1, 1]^3`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The middle of everything.
    pub middle: DVec3,
    /// A power of two, so that scaling is exact.
    pub scale: f64,
}

impl Frame {
    /// The frame of things that fill `hull`.
    #[must_use]
    pub fn of(hull: Aabb) -> Self {
        // Halves first: the sum of two large coordinates overflows.
        let middle = 0.5 * hull.lo + 0.5 * hull.hi;
        let half = (hull.hi - middle).max(middle - hull.lo).max_element();
        // Exponent of the power of two above `half`, kept where the power and its inverse are
        // normal numbers.
        let exponent = ((half.to_bits() >> 52) as i64 - 1022).clamp(-1020, 1020);
        let scale = f64::from_bits(((1023 - exponent) as u64) << 52);
        Self { middle, scale: if half > 0.0 { scale } else { 1.0 } }
    }

    /// `point` in the frame.
    #[inline(always)]
    #[must_use]
    pub fn local(self, point: DVec3) -> DVec3 {
        (point - self.middle) * self.scale
    }
}

/// What a child of a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// The node of this number.
    Node(usize),
    /// The leaf of this number.
    Leaf(usize),
    /// Nothing; its box is empty.
    Nothing,
}

/// A child in 32 bits: the highest bit marks leaves, all ones mean nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Packed(u32);

impl Packed {
    const NOTHING: Self = Self(u32::MAX);
    const LEAF_BIT: u32 = 1 << 31;

    #[inline(always)]
    const fn unpack(self) -> Child {
        if self.0 == u32::MAX {
            Child::Nothing
        } else if self.0 & Self::LEAF_BIT != 0 {
            Child::Leaf((self.0 & !Self::LEAF_BIT) as usize)
        } else {
            Child::Node(self.0 as usize)
        }
    }

    /// The same child after `nodes` and `leaves` were put before its own.
    fn shifted(self, nodes: usize, leaves: usize) -> Self {
        match self.unpack() {
            Child::Node(_) => Self(self.0 + nodes as u32),
            Child::Leaf(_) => Self(self.0 + leaves as u32),
            Child::Nothing => self,
        }
    }
}

/// The children of a node: boxes and references, one lane a child.
#[derive(Clone, Debug)]
pub struct Node {
    center: [[f32; WIDTH]; 3],
    /// Unit vectors along the sides of the boxes: axis, coordinate, lane.
    axes: [[[f32; WIDTH]; 3]; 3],
    /// Half of the sides; negative for nothing.
    half: [[f32; WIDTH]; 3],
    child: [Packed; WIDTH],
}

impl Node {
    /// A node without children.
    const EMPTY: Self = Self {
        center: [[0.0; WIDTH]; 3],
        axes: [[[0.0; WIDTH]; 3]; 3],
        half: [[f32::NEG_INFINITY; WIDTH]; 3],
        child: [Packed::NOTHING; WIDTH],
    };

    /// The children in order; nothing follows the first [`Child::Nothing`].
    pub fn children(&self) -> impl Iterator<Item = Child> {
        self.child.iter().map(|c| c.unpack())
    }

    /// Squared distances from a point to the children; infinite for nothing.
    #[inline(always)]
    fn distances(&self, at: [f32; 3]) -> [f32; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for lane in 0..WIDTH {
            let [x, y, z] = [0, 1, 2].map(|a| at[a] - self.center[a][lane]);
            for (axis, half) in self.axes.iter().zip(&self.half) {
                let along = axis[0][lane] * x + axis[1][lane] * y + axis[2][lane] * z;
                let gap = along.abs() - half[lane];
                let gap = if gap > 0.0 { gap } else { 0.0 };
                sum[lane] += gap * gap;
            }
        }
        sum
    }
}

/// Pending children of a traversal, reused between traversals.
///
/// A child is kept with its squared distance in front: distances are not negative, so that their
/// bits are in their order.
#[derive(Debug)]
pub struct Stack {
    pending: Box<[u64; STACK]>,
    len: usize,
}

impl Default for Stack {
    fn default() -> Self {
        Self { pending: Box::new([0; STACK]), len: 0 }
    }
}

impl Stack {
    /// Puts the children of `node` within `bound` on the stack, the nearest on top.
    #[inline(always)]
    fn push(&mut self, node: &Node, distances: &[f32; WIDTH], bound: f32) {
        // A bit a lane, summed up as floating-point numbers, which stay in vectors.
        let mut flags = [0.0; WIDTH];
        for (lane, flag) in flags.iter_mut().enumerate() {
            *flag = if distances[lane] <= bound { FLAGS[lane] } else { 0.0 };
        }
        let four: [f32; 4] = std::array::from_fn(|i| flags[i] + flags[i + 4]);
        let mut near = (four[0] + four[2] + (four[1] + four[3])) as i32;
        let first = self.len;
        while near != 0 {
            let lane = near.trailing_zeros() as usize & (WIDTH - 1);
            near &= near - 1;
            let key = u64::from(distances[lane].to_bits()) << 32 | u64::from(node.child[lane].0);
            // Few children are near: insertion is the fastest sort.
            let mut slot = self.len;
            while slot > first && self.pending[slot - 1] < key {
                self.pending[slot] = self.pending[slot - 1];
                slot -= 1;
            }
            self.pending[slot] = key;
            self.len += 1;
        }
    }

    /// Takes the topmost child within `bound`, dropping those above it.
    #[inline(always)]
    fn pop(&mut self, bound: f32) -> Option<Packed> {
        while self.len > 0 {
            self.len -= 1;
            let key = self.pending[self.len];
            if (key >> 32) as u32 <= bound.to_bits() {
                return Some(Packed(key as u32));
            }
        }
        None
    }
}

/// What is done at a leaf. A trait rather than a closure, so that it can be compiled into the
/// traversal and with its instruction set.
pub trait Visitor {
    /// Looks at the leaf of this number and returns the bound on what else matters: a [`reach`].
    fn visit(&mut self, leaf: usize) -> f32;
}

/// The tree.
#[derive(Clone, Debug)]
pub struct Bvh {
    frame: Frame,
    nodes: Vec<Node>,
    leaves: Vec<[u32; LEAF]>,
}

/// The bound on squared distances to boxes that keeps everything within squared distance
/// `squared` (in the tree's frame, finite or not).
#[inline(always)]
#[must_use]
pub fn reach(squared: f64) -> f32 {
    let bound = squared * (1.0 + SLACK);
    // Finite, so that the empty boxes at infinity stay out.
    if bound < f64::from(f32::MAX) { bound as f32 } else { f32::MAX }
}

impl Bvh {
    /// A tree over `count` items, item `i` being the hull of `points(i)`, which are finite. The
    /// first three points of an item, if there are as many, tell how it is turned.
    #[must_use]
    pub fn build<const N: usize>(
        count: usize,
        points: impl Fn(usize) -> [DVec3; N] + Sync,
    ) -> Self {
        let (frame, build::Part { nodes, leaves }) = build::tree(count, &points);
        Self { frame, nodes, leaves }
    }

    /// The tree's coordinates.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The nodes; each comes before its children, the root first.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The items of the leaves, filled up with [`NO_ITEM`].
    #[must_use]
    pub fn leaves(&self) -> &[[u32; LEAF]] {
        &self.leaves
    }

    /// Visits leaves from near to far from the point `at` (in the tree's frame, not remote) until
    /// no box is left within the bound, which is `bound` to begin with.
    #[inline(always)]
    pub fn nearest(
        &self,
        at: [f32; 3],
        stack: &mut Stack,
        mut bound: f32,
        visitor: &mut impl Visitor,
    ) {
        stack.len = 0;
        let mut current = Some(Packed(0));
        while let Some(child) = current {
            match child.unpack() {
                Child::Leaf(leaf) => bound = visitor.visit(leaf),
                Child::Node(number) => {
                    let node = &self.nodes[number];
                    stack.push(node, &node.distances(at), bound);
                }
                Child::Nothing => {}
            }
            current = stack.pop(bound);
        }
    }
}

#[cfg(test)]
mod tests;
