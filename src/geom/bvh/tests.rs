//! The tree against brute force, on boxes of every kind.

use super::*;

/// A small generator of uniform numbers in [0, 1).
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

fn random_boxes(count: usize, offset: f64) -> Vec<Aabb> {
    let mut state = 7;
    (0..count)
        .map(|_| {
            let lo = DVec3::from_array(std::array::from_fn(|_| offset + uniform(&mut state)));
            let side = DVec3::from_array(std::array::from_fn(|_| 0.1 * uniform(&mut state)));
            Aabb::new(lo, lo + side)
        })
        .collect()
}

fn squared_distance(b: Aabb, p: DVec3) -> f64 {
    (p - p.clamp(b.lo, b.hi)).length_squared()
}

/// A tree over boxes, whose corners are the points.
fn tree_over(boxes: &[Aabb]) -> Bvh {
    Bvh::build(boxes.len(), |item| -> [DVec3; 8] {
        let Aabb { lo, hi } = boxes[item];
        std::array::from_fn(|corner| {
            DVec3::from_array([0, 1, 2].map(|a| if corner >> a & 1 == 0 { lo[a] } else { hi[a] }))
        })
    })
}

struct Nearest<'a> {
    tree: &'a Bvh,
    boxes: &'a [Aabb],
    p: DVec3,
    best: f64,
}

impl Visitor for Nearest<'_> {
    fn visit(&mut self, leaf: usize) -> f32 {
        for item in self.tree.leaves()[leaf] {
            if item != NO_ITEM {
                self.best = self.best.min(squared_distance(self.boxes[item as usize], self.p));
            }
        }
        let scale = self.tree.frame().scale;
        reach(self.best * scale * scale)
    }
}

/// Squared distance of the item nearest to `p`, by the tree.
fn nearest(tree: &Bvh, boxes: &[Aabb], p: DVec3) -> f64 {
    let at = tree.frame().local(p).to_array().map(|v| v as f32);
    let mut nearest = Nearest { tree, boxes, p, best: f64::INFINITY };
    tree.nearest(at, &mut Stack::default(), reach(f64::INFINITY), &mut nearest);
    nearest.best
}

#[test]
fn every_item_is_in_one_leaf() {
    for count in [0, 1, 8, 9, 100, 10_000] {
        let tree = tree_over(&random_boxes(count, 0.0));
        let mut items: Vec<u32> =
            tree.leaves().iter().flatten().copied().filter(|i| *i != NO_ITEM).collect();
        items.sort_unstable();
        assert!(items.into_iter().eq(0..count as u32));
    }
}

#[test]
fn the_nearest_item_is_found_also_far_from_the_origin() {
    for offset in [0.0, 1e7, -1e9] {
        let boxes = random_boxes(2000, offset);
        let tree = tree_over(&boxes);
        let mut state = 3;
        for spread in [1.0, 1.0, 10.0, 1e6] {
            for _ in 0..50 {
                let p = DVec3::from_array(std::array::from_fn(|_| {
                    offset + spread * (uniform(&mut state) - 0.3)
                }));
                let brute =
                    boxes.iter().map(|b| squared_distance(*b, p)).fold(f64::INFINITY, f64::min);
                assert_eq!(nearest(&tree, &boxes, p), brute);
            }
        }
    }
}

#[test]
fn equal_boxes_make_a_shallow_tree() {
    let boxes = vec![Aabb::new(DVec3::ONE, DVec3::ONE); 5000];
    let tree = tree_over(&boxes);
    assert!(tree.leaves().len() < 5000 / 3);
    assert_eq!(nearest(&tree, &boxes, DVec3::new(1.0, 1.0, 3.0)), 4.0);
}

#[test]
fn geometric_sizes_do_not_deepen_the_tree_without_bound() {
    let boxes: Vec<Aabb> =
        (0..900).map(|i| Aabb::new(DVec3::ZERO, DVec3::splat(0.5_f64.powi(i)))).collect();
    let tree = tree_over(&boxes);
    assert_eq!(nearest(&tree, &boxes, DVec3::splat(2.0)), 3.0);
}

#[test]
fn boxes_of_a_flat_part_are_turned_with_it() {
    // A plane of small triangles, tilted against all axes.
    let normal = DVec3::new(1.0, 2.0, 3.0).normalize();
    let (u, v) = normal.any_orthonormal_pair();
    let place = |i: usize, j: usize| 0.01 * (i as f64 * u + j as f64 * v);
    let triangle = |item: usize| {
        let (i, j) = (item % 64, item / 64);
        [place(i, j), place(i + 1, j), place(i, j + 1)]
    };
    let tree = Bvh::build(64 * 64, triangle);
    let above = tree.frame().local(place(32, 32) + 0.3 * normal);
    let bound = reach((0.3003 * tree.frame().scale).powi(2));
    let mut visited = Count { leaves: 0, bound };
    let at = above.to_array().map(|x| x as f32);
    tree.nearest(at, &mut Stack::default(), bound, &mut visited);
    // Within the bound lies a disk of radius 0.0134, of some six triangles; upright boxes of eight
    // triangles are 0.02 thick, and those within a disk of radius 0.1 would be visited.
    assert!((1..20).contains(&visited.leaves), "{}", visited.leaves);
}

/// Counts leaves within a bound.
struct Count {
    leaves: usize,
    bound: f32,
}

impl Visitor for Count {
    fn visit(&mut self, _: usize) -> f32 {
        self.leaves += 1;
        self.bound
    }
}

#[test]
fn the_frame_is_finite_for_tiny_and_huge_hulls() {
    for side in [1e-320, 1e-300, 1e-9, 1.0, 1e12, 1e307] {
        let frame = Frame::of(Aabb::new(DVec3::splat(-side), DVec3::splat(side)));
        let corner = frame.local(DVec3::splat(side));
        assert!(corner.max_element() <= 1.0 && frame.scale.is_normal(), "{side}");
    }
}
