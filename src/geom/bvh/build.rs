//! Building the tree: items are split by a heuristic, and boxes fitted to what comes together.
//!
//! Source: binned surface-area heuristic after Wald 2007, doi:10.1109/RT.2007.4342588; wide nodes
//! by splitting the child of largest area first, after Wald, Benthin, Boulos 2008,
//! doi:10.1109/RT.2008.4634620.

use super::{Frame, HALVING_DEPTH, LEAF, NO_ITEM, Node, Packed, WIDTH};
use crate::geom::Aabb;
use glam::DVec3;
use rayon::prelude::*;

/// Growth of the boxes in units of the size: what single precision makes of coordinates in a box's
/// frame, for points up to five sizes away: seven roundings (2^-24) of each of them.
const MARGIN: f64 = 1.0 / (1 << 19) as f64;
/// Bins an axis for the surface-area heuristic.
const BINS: usize = 16;
/// Most items that are halved by count: what is worth a node makes full leaves.
const HALVED: usize = WIDTH * LEAF;
/// Items in a range that is worth a thread.
const PARALLEL: usize = 4096;
/// Most items to which a turned box is fitted: more are seldom flat, and take longer.
const FITTED: usize = 4096;
/// Length of the sum of normals over the sum of their lengths from which items count as flat.
const FLATNESS: f64 = 0.5;

/// An item while the tree is built: its number and its box in the frame.
#[derive(Clone, Copy)]
struct Item {
    lo: [f32; 3],
    number: u32,
    hi: [f32; 3],
}

impl Item {
    fn new(number: u32, points: &[DVec3], frame: Frame) -> Self {
        let mut hull = Hull::EMPTY;
        for point in points {
            let local = frame.local(*point).to_array();
            // One step outward undoes the rounding to single precision.
            hull.add(local.map(|v| (v as f32).next_down()), local.map(|v| (v as f32).next_up()));
        }
        Self { lo: hull.lo, number, hi: hull.hi }
    }

    /// Twice the middle along an axis.
    #[inline(always)]
    fn middle(&self, axis: usize) -> f32 {
        self.lo[axis] + self.hi[axis]
    }
}

/// The upright hull of some items.
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

    /// The axis of the longest side.
    fn longest(&self) -> usize {
        let side = |axis: &usize| self.hi[*axis] - self.lo[*axis];
        (0..3).max_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(0)
    }
}

/// A range of items that becomes a child.
struct Range<'a> {
    items: &'a mut [Item],
    hull: Hull,
    depth: u32,
}

/// A tree, or a part of it in the making.
#[derive(Default)]
pub(super) struct Part {
    /// Each before its children.
    pub(super) nodes: Vec<Node>,
    /// Items of the leaves.
    pub(super) leaves: Vec<[u32; LEAF]>,
}

/// What a part is built from.
struct Plan<'p, P> {
    points: &'p P,
    frame: Frame,
}

/// The tree over `count` items that are hulls of `points`, and its coordinates.
pub(super) fn tree<const N: usize>(
    count: usize,
    points: &(impl Fn(usize) -> [DVec3; N] + Sync),
) -> (Frame, Part) {
    if count == 0 {
        let frame = Frame { middle: DVec3::ZERO, scale: 1.0 };
        return (frame, Part { nodes: vec![Node::EMPTY], leaves: Vec::new() });
    }
    let hull = (0..count)
        .into_par_iter()
        .map(|item| Aabb::around(points(item)))
        .reduce(|| Aabb::EMPTY, Aabb::hull);
    let frame = Frame::of(hull);
    let mut items: Vec<Item> = (0..count)
        .into_par_iter()
        .map(|item| Item::new(item as u32, &points(item), frame))
        .collect();
    let mut part = Part::default();
    part.grow(&Plan { points, frame }, &mut items, 0);
    (frame, part)
}

impl Part {
    /// Appends the tree over `items`, whose root lies at `depth` binary splits. The depth is
    /// bounded by [`HALVING_DEPTH`] plus the logarithm of the count, and so is the recursion.
    fn grow<const N: usize, P: Fn(usize) -> [DVec3; N] + Sync>(
        &mut self,
        plan: &Plan<'_, P>,
        items: &mut [Item],
        depth: u32,
    ) {
        let parallel = items.len() > PARALLEL;
        let mut ranges = divided(items, depth);
        let root = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        if parallel {
            let parts: Vec<Self> = ranges
                .par_iter_mut()
                .map(|range| {
                    let mut part = Self::default();
                    if range.items.len() > LEAF {
                        part.grow(plan, range.items, range.depth);
                    }
                    part
                })
                .collect();
            let nodes = parts.iter().map(|part| part.nodes.len()).sum();
            self.nodes.reserve(nodes);
            for (lane, (range, part)) in ranges.iter().zip(parts).enumerate() {
                let child = self.child(range);
                self.adopt(part);
                self.set(root, lane, child, plan.fit(range));
            }
        } else {
            for (lane, range) in ranges.iter_mut().enumerate() {
                let child = self.child(range);
                if range.items.len() > LEAF {
                    self.grow(plan, range.items, range.depth);
                }
                self.set(root, lane, child, plan.fit(range));
            }
        }
    }

    /// A reference to what comes next: a leaf, which is appended, or a node.
    fn child(&mut self, range: &Range<'_>) -> Packed {
        if range.items.len() > LEAF {
            return Packed(self.nodes.len() as u32);
        }
        self.leaves
            .push(std::array::from_fn(|i| range.items.get(i).map_or(NO_ITEM, |item| item.number)));
        Packed((self.leaves.len() - 1) as u32 | Packed::LEAF_BIT)
    }

    /// Appends another part.
    fn adopt(&mut self, part: Self) {
        let (node, leaf) = (self.nodes.len(), self.leaves.len());
        self.nodes.extend(part.nodes.into_iter().map(|mut n| {
            n.child = n.child.map(|c| c.shifted(node, leaf));
            n
        }));
        self.leaves.extend(part.leaves);
    }

    fn set(&mut self, node: usize, lane: usize, child: Packed, shape: Turned) {
        let node = &mut self.nodes[node];
        node.child[lane] = child;
        for axis in 0..3 {
            node.center[axis][lane] = shape.center[axis];
            node.half[axis][lane] = shape.half[axis];
            for coordinate in 0..3 {
                node.axes[axis][coordinate][lane] = shape.axes[axis][coordinate];
            }
        }
    }
}

/// A box of any direction.
struct Turned {
    center: [f32; 3],
    axes: [[f32; 3]; 3],
    half: [f32; 3],
}

impl<const N: usize, P: Fn(usize) -> [DVec3; N] + Sync> Plan<'_, P> {
    /// A box around the items of a range.
    fn fit(&self, range: &Range<'_>) -> Turned {
        let hull = &range.hull;
        if range.items.len() > FITTED {
            return Turned::upright(hull);
        }
        let points = || range.items.iter().map(|item| (self.points)(item.number as usize));
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for corners in points() {
            if let [a, b, c, ..] = corners[..] {
                // Scaled first: squares of lengths in the frame stay in range.
                let [u, v] = [b - a, c - a].map(|edge| edge * self.frame.scale);
                let normal = u.cross(v);
                sum += normal;
                total += normal.length();
            }
        }
        let length = sum.length();
        // False for sums that are not numbers.
        if !(length > FLATNESS * total && length > f64::MIN_POSITIVE) {
            return Turned::upright(hull);
        }
        let up = sum / length;
        // Along the cut that made the range, as far as it goes.
        let mut along = hull.longest();
        if up[along].abs() > 0.9 {
            along = (along + 1) % 3;
        }
        let first = (DVec3::AXES[along] - up[along] * up).normalize();
        let axes = [first, up.cross(first), up].map(|axis| axis.to_array().map(|x| x as f32));
        let exact = axes.map(|axis| DVec3::from_array(axis.map(f64::from)));
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points().flatten() {
            let local = self.frame.local(point);
            let place = DVec3::from_array(exact.map(|axis| axis.dot(local)));
            lo = lo.min(place);
            hi = hi.max(place);
        }
        let middle = 0.5 * (lo + hi);
        let center = exact[0] * middle.x + exact[1] * middle.y + exact[2] * middle.z;
        let center = center.to_array().map(|x| x as f32);
        let rounded = DVec3::from_array(center.map(f64::from));
        let half = [0, 1, 2].map(|a| {
            let at = exact[a].dot(rounded);
            ((hi[a] - at).max(at - lo[a]) + MARGIN) as f32
        });
        Turned { center, axes, half: half.map(f32::next_up) }
    }
}

impl Turned {
    /// The box along the axes of the frame.
    fn upright(hull: &Hull) -> Self {
        let center: [f32; 3] = std::array::from_fn(|a| 0.5 * (hull.lo[a] + hull.hi[a]));
        let half = std::array::from_fn(|a| {
            let half = (hull.hi[a] - center[a]).max(center[a] - hull.lo[a]);
            half.next_up() + MARGIN as f32
        });
        Self { center, axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], half }
    }
}

/// `items` cut into up to [`WIDTH`] ranges, none of them empty.
fn divided(items: &mut [Item], depth: u32) -> Vec<Range<'_>> {
    let hull = Hull::around(items);
    let mut ranges = Vec::with_capacity(WIDTH);
    ranges.push(Range { items, hull, depth });
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
    ranges
}

/// One side of a candidate split.
#[derive(Clone, Copy)]
struct Bin {
    hull: Hull,
    count: usize,
}

/// Reorders `items` into two sides, neither empty, and returns the length of the first.
fn split(items: &mut [Item], hull: Hull, depth: u32) -> usize {
    if items.len() <= HALVED || depth >= HALVING_DEPTH {
        // Full leaves on the left.
        let half = (items.len() / 2).next_multiple_of(LEAF).min(items.len() - 1);
        let axis = hull.longest();
        items.select_nth_unstable_by(half, |a, b| {
            a.middle(axis).total_cmp(&b.middle(axis)).then(a.number.cmp(&b.number))
        });
        return half;
    }
    let half = items.len() / 2;
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
    let mut bins = [[Bin { hull: Hull::EMPTY, count: 0 }; BINS]; 3];
    for item in items.iter() {
        for (axis, bins) in bins.iter_mut().enumerate() {
            let bin = &mut bins[place(item, axis)];
            bin.hull.add(item.lo, item.hi);
            bin.count += 1;
        }
    }
    let best = (0..3)
        .filter(|axis| middles.hi[*axis] > middles.lo[*axis])
        .filter_map(|axis| cheapest(&bins[axis]).map(|(cost, cut)| (cost, cut, axis)))
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
