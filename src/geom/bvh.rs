//! A wide bounding-volume tree over boxes.
//!
//! A node holds the boxes of up to [`WIDTH`] children as a structure of arrays in single
//! precision, in coordinates relative to the middle of everything and divided by its size. Boxes
//! are grown so that the distance to a box, computed in single precision, never exceeds the
//! distance to what is in it by more than a fixed slack: traversals with [`reach`] miss nothing.
//!
//! The tree depends on the boxes only, not on threads. Any boxes will do, equal ones included.
//!
//! Source: binned surface-area heuristic after Wald 2007, doi:10.1109/RT.2007.4342588; wide nodes
//! by splitting the child of largest area first, after Wald, Benthin, Boulos 2008,
//! doi:10.1109/RT.2008.4634620.

use crate::geom::Aabb;
use glam::DVec3;
use rayon::prelude::*;

/// Children of a node.
pub const WIDTH: usize = 8;
/// Items of a leaf.
pub const LEAF: usize = 8;
/// Fills up the items of a leaf.
pub const NO_ITEM: u32 = u32::MAX;
/// Points at least this far from the middle, in units of the size, are *remote*: single precision
/// would overflow for them, and all items are equally far to less than a rounding error.
pub const REMOTE: f64 = (1_u64 << 60) as f64;

/// Relative excess allowed to squared distances to boxes: some roundings of single precision.
const SLACK: f64 = 1.0 / (1 << 19) as f64;
/// Growth of the boxes in units of the size: the rounding of points near the boxes to single
/// precision (2^-24) four times over.
const MARGIN: f64 = 1.0 / (1 << 22) as f64;
/// Bins an axis for the surface-area heuristic.
const BINS: usize = 16;
/// Depth from which ranges are halved by count: bounds the depth for any input.
const HALVING_DEPTH: u32 = 48;
/// Room for pending children. Every split of a range adds to its depth, so that nodes lie at most
/// [`HALVING_DEPTH`] and the 32 halvings of 2^32 items deep, with [`WIDTH`] - 1 pending each.
const STACK: usize = (HALVING_DEPTH as usize + 32) * (WIDTH - 1) + WIDTH;
/// Comparisons that sort eight numbers, after Batcher 1968, doi:10.1145/1468075.1468121.
const NETWORK: [(usize, usize); 19] = [
    (0, 1),
    (2, 3),
    (4, 5),
    (6, 7),
    (0, 2),
    (1, 3),
    (4, 6),
    (5, 7),
    (1, 2),
    (5, 6),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
    (2, 4),
    (3, 5),
    (1, 2),
    (3, 4),
    (5, 6),
];
/// Items in a range that is worth a thread.
const PARALLEL: usize = 4096;

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
    lo: [[f32; WIDTH]; 3],
    hi: [[f32; WIDTH]; 3],
    child: [Packed; WIDTH],
}

impl Node {
    /// The children in order; nothing follows the first [`Child::Nothing`].
    pub fn children(&self) -> impl Iterator<Item = Child> {
        self.child.iter().map(|c| c.unpack())
    }

    /// Squared distances from a box to the children; infinite for nothing.
    #[inline(always)]
    fn distances(&self, lo: [f32; 3], hi: [f32; 3]) -> [f32; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for axis in 0..3 {
            let sides = self.lo[axis].iter().zip(&self.hi[axis]);
            for (sum, (child_lo, child_hi)) in sum.iter_mut().zip(sides) {
                let (below, above) = (child_lo - hi[axis], lo[axis] - child_hi);
                let gap = if below > above { below } else { above };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                *sum += gap * gap;
            }
        }
        sum
    }
}

/// A leaf found by [`Bvh::within`], with its box in the tree's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Number of the leaf.
    pub leaf: usize,
    /// Corner of least coordinates.
    pub lo: [f32; 3],
    /// Corner of greatest coordinates.
    pub hi: [f32; 3],
}

/// Pending children of a traversal, reused between traversals.
///
/// A child is kept with its squared distance in front: distances are not negative, so that their
/// bits are in their order.
#[derive(Debug)]
pub struct Stack {
    pending: Vec<u64>,
    len: usize,
}

impl Default for Stack {
    fn default() -> Self {
        Self { pending: vec![0; STACK], len: 0 }
    }
}

impl Stack {
    /// Puts the children of `node` within `bound` on the stack, the nearest on top.
    #[inline(always)]
    fn push(&mut self, node: &Node, distances: &[f32; WIDTH], bound: f32) {
        let mut keys = [0; WIDTH];
        let mut count = 0;
        for lane in 0..WIDTH {
            let near = distances[lane] <= bound;
            let key = u64::from(distances[lane].to_bits()) << 32 | u64::from(node.child[lane].0);
            keys[lane] = if near { key } else { 0 };
            count += usize::from(near);
        }
        // A sorting network: no branches to mispredict. No child has the key 0, since the root is
        // no child.
        for (i, j) in NETWORK {
            let (a, b) = (keys[i], keys[j]);
            keys[i] = if a > b { a } else { b };
            keys[j] = if a > b { b } else { a };
        }
        self.pending[self.len..self.len + WIDTH].copy_from_slice(&keys);
        self.len += count;
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
    /// A tree over `boxes`, which are finite and not empty. Items are known by their positions.
    #[must_use]
    pub fn build(boxes: &[Aabb]) -> Self {
        let hull = boxes.iter().fold(Aabb::EMPTY, |hull, b| hull.hull(*b));
        let frame = if boxes.is_empty() {
            Frame { middle: DVec3::ZERO, scale: 1.0 }
        } else {
            Frame::of(hull)
        };
        let mut items: Vec<Item> = boxes
            .par_iter()
            .enumerate()
            .map(|(number, b)| Item::new(number as u32, *b, frame))
            .collect();
        let Part { nodes, leaves } = Part::build(&mut items, 0);
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
                    stack.push(node, &node.distances(at, at), bound);
                }
                Child::Nothing => {}
            }
            current = stack.pop(bound);
        }
    }

    /// Collects the leaves within `bound` of the box with corners `lo` and `hi` (in the tree's
    /// frame, not remote, rounded outward), in the order of the tree.
    #[inline(always)]
    pub fn within(
        &self,
        lo: [f32; 3],
        hi: [f32; 3],
        bound: f32,
        stack: &mut Stack,
        found: &mut Vec<Found>,
    ) {
        stack.len = 0;
        let mut current = Some(Packed(0));
        while let Some(child) = current {
            if let Child::Node(number) = child.unpack() {
                let node = &self.nodes[number];
                let distances = node.distances(lo, hi);
                for (lane, (distance, child)) in distances.into_iter().zip(node.child).enumerate() {
                    if distance <= bound {
                        match child.unpack() {
                            Child::Leaf(leaf) => found.push(Found {
                                leaf,
                                lo: [node.lo[0][lane], node.lo[1][lane], node.lo[2][lane]],
                                hi: [node.hi[0][lane], node.hi[1][lane], node.hi[2][lane]],
                            }),
                            Child::Node(_) => {
                                stack.pending[stack.len] = u64::from(child.0);
                                stack.len += 1;
                            }
                            Child::Nothing => {}
                        }
                    }
                }
            }
            current = stack.pop(bound);
        }
    }
}

/// An item while the tree is built: its number and its grown box in the frame.
#[derive(Clone, Copy)]
struct Item {
    lo: [f32; 3],
    number: u32,
    hi: [f32; 3],
}

impl Item {
    fn new(number: u32, b: Aabb, frame: Frame) -> Self {
        let lo = (frame.local(b.lo) - DVec3::splat(MARGIN)).to_array();
        let hi = (frame.local(b.hi) + DVec3::splat(MARGIN)).to_array();
        // One step outward undoes the rounding to single precision.
        Self {
            lo: lo.map(|v| (v as f32).next_down()),
            number,
            hi: hi.map(|v| (v as f32).next_up()),
        }
    }

    /// Twice the middle along an axis.
    #[inline(always)]
    fn middle(&self, axis: usize) -> f32 {
        self.lo[axis] + self.hi[axis]
    }
}

/// The hull of some items.
#[derive(Clone, Copy)]
struct Hull {
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Hull {
    const EMPTY: Self = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    #[inline(always)]
    fn add(&mut self, lo: [f32; 3], hi: [f32; 3]) {
        for axis in 0..3 {
            self.lo[axis] = if lo[axis] < self.lo[axis] { lo[axis] } else { self.lo[axis] };
            self.hi[axis] = if hi[axis] > self.hi[axis] { hi[axis] } else { self.hi[axis] };
        }
    }

    fn around(items: &[Item]) -> Self {
        items.iter().fold(Self::EMPTY, |mut hull, item| {
            hull.add(item.lo, item.hi);
            hull
        })
    }

    /// Half the surface area; zero for the empty hull.
    fn area(&self) -> f32 {
        let [x, y, z]: [f32; 3] = std::array::from_fn(|a| (self.hi[a] - self.lo[a]).max(0.0));
        x * y + y * z + z * x
    }
}

/// A tree in the making.
struct Part {
    nodes: Vec<Node>,
    leaves: Vec<[u32; LEAF]>,
}

/// A range of items that becomes a child.
struct Range<'a> {
    items: &'a mut [Item],
    hull: Hull,
    depth: u32,
}

impl Part {
    /// The tree over `items`, whose root lies at `depth` binary splits. The depth is bounded by
    /// [`HALVING_DEPTH`] plus the logarithm of the count, and so is the recursion.
    fn build(items: &mut [Item], depth: u32) -> Self {
        let parallel = items.len() > PARALLEL;
        let hull = Hull::around(items);
        let mut ranges = vec![Range { items, hull, depth }];
        while ranges.len() < WIDTH {
            let largest = ranges
                .iter()
                .enumerate()
                .filter(|(_, r)| r.items.len() > LEAF)
                .max_by(|(_, a), (_, b)| a.hull.area().total_cmp(&b.hull.area()))
                .map(|(slot, _)| slot);
            let Some(slot) = largest else { break };
            let Range { items, hull, depth } = ranges.swap_remove(slot);
            let middle = split(items, hull, depth);
            let (left, right) = items.split_at_mut(middle);
            for items in [left, right] {
                let hull = Hull::around(items);
                ranges.push(Range { items, hull, depth: depth + 1 });
            }
        }
        let below = |range: &mut Range<'_>| {
            (range.items.len() > LEAF).then(|| Self::build(range.items, range.depth))
        };
        let below: Vec<Option<Self>> = if parallel {
            ranges.par_iter_mut().map(below).collect()
        } else {
            ranges.iter_mut().map(below).collect()
        };
        Self::join(&ranges, below)
    }

    /// A root over `ranges`: leaves, and nodes for those that have a tree `below`.
    fn join(ranges: &[Range<'_>], below: Vec<Option<Self>>) -> Self {
        let mut root = Node {
            lo: [[f32::INFINITY; WIDTH]; 3],
            hi: [[f32::NEG_INFINITY; WIDTH]; 3],
            child: [Packed::NOTHING; WIDTH],
        };
        let mut nodes = vec![root.clone()];
        let mut leaves = Vec::new();
        for (lane, (range, below)) in ranges.iter().zip(below).enumerate() {
            if range.items.is_empty() {
                continue;
            }
            for axis in 0..3 {
                root.lo[axis][lane] = range.hull.lo[axis];
                root.hi[axis][lane] = range.hull.hi[axis];
            }
            match below {
                None => {
                    root.child[lane] = Packed(leaves.len() as u32 | Packed::LEAF_BIT);
                    leaves.push(std::array::from_fn(|i| {
                        range.items.get(i).map_or(NO_ITEM, |item| item.number)
                    }));
                }
                Some(part) => {
                    let (node, leaf) = (nodes.len(), leaves.len());
                    root.child[lane] = Packed(node as u32);
                    nodes.extend(part.nodes.into_iter().map(|mut n| {
                        n.child = n.child.map(|c| c.shifted(node, leaf));
                        n
                    }));
                    leaves.extend(part.leaves);
                }
            }
        }
        nodes[0] = root;
        Self { nodes, leaves }
    }
}

/// One side of a candidate split.
#[derive(Clone, Copy)]
struct Bin {
    hull: Hull,
    count: usize,
}

/// Reorders `items` into two sides, neither empty, and returns the length of the first.
fn split(items: &mut [Item], hull: Hull, depth: u32) -> usize {
    let half = items.len() / 2;
    if depth >= HALVING_DEPTH {
        let axis = (0..3)
            .max_by(|a, b| (hull.hi[*a] - hull.lo[*a]).total_cmp(&(hull.hi[*b] - hull.lo[*b])))
            .unwrap_or(0);
        items.sort_unstable_by(|a, b| {
            a.middle(axis).total_cmp(&b.middle(axis)).then(a.number.cmp(&b.number))
        });
        return half;
    }
    let mut middles = Hull::EMPTY;
    for item in items.iter() {
        let middle = std::array::from_fn(|axis| item.middle(axis));
        middles.add(middle, middle);
    }
    let place = |item: &Item, axis: usize| {
        let width = middles.hi[axis] - middles.lo[axis];
        let bin = (item.middle(axis) - middles.lo[axis]) * (BINS as f32 / width);
        (bin as usize).min(BINS - 1)
    };
    let axes = (0..3).filter(|axis| middles.hi[*axis] > middles.lo[*axis]);
    let best = axes
        .filter_map(|axis| {
            let mut bins = [Bin { hull: Hull::EMPTY, count: 0 }; BINS];
            for item in items.iter() {
                let bin = &mut bins[place(item, axis)];
                bin.hull.add(item.lo, item.hi);
                bin.count += 1;
            }
            cheapest(&bins).map(|(cost, cut)| (cost, cut, axis))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, cut, axis)) = best else { return half };
    let (mut left, mut right) = (0, items.len());
    while left < right {
        if place(&items[left], axis) < cut {
            left += 1;
        } else {
            right -= 1;
            items.swap(left, right);
        }
    }
    left
}

/// The cost and the first bin of the right side of the cheapest cut with no side empty.
fn cheapest(bins: &[Bin; BINS]) -> Option<(f32, usize)> {
    // A leaf costs the same however full it is.
    let cost = |side: &Bin| side.hull.area() * side.count.div_ceil(LEAF) as f32;
    let add = |side: &mut Bin, bin: &Bin| {
        side.hull.add(bin.hull.lo, bin.hull.hi);
        side.count += bin.count;
    };
    let mut side = Bin { hull: Hull::EMPTY, count: 0 };
    let mut right = [Bin { hull: Hull::EMPTY, count: 0 }; BINS];
    for cut in (1..BINS).rev() {
        add(&mut side, &bins[cut]);
        right[cut] = side;
    }
    let mut left = Bin { hull: Hull::EMPTY, count: 0 };
    let mut best: Option<(f32, usize)> = None;
    for cut in 1..BINS {
        add(&mut left, &bins[cut - 1]);
        if left.count > 0 && right[cut].count > 0 {
            let total = cost(&left) + cost(&right[cut]);
            if best.is_none_or(|(least, _)| total < least) {
                best = Some((total, cut));
            }
        }
    }
    best
}

#[cfg(test)]
mod tests;
