//! Orders in which points follow their neighbours, so that the answer at one is a good guess at the
//! next. They change the time that queries take, never the answers.

use glam::DVec3;

/// Points from which sorting pays.
const WORTH_SORTING: usize = 512;
/// Bits of a cell's coordinate, and cells a side, of the cube that points are sorted in.
const BITS: u32 = 10;

/// Numbers of `count` points along a curve that fills the cube [-2, 2]^3 (Morton 1966), from which
/// points outside are pulled in; nothing if the order given will do.
#[inline(always)]
#[must_use]
pub fn sorted(count: usize, point: impl Fn(usize) -> DVec3) -> Vec<u32> {
    if count < WORTH_SORTING || u32::try_from(count).is_err() {
        return Vec::new();
    }
    let cells = f64::from(1_u32 << BITS);
    let mut keys: Vec<u64> = (0..count)
        .map(|i| {
            // Casts saturate, and NaN becomes zero.
            let cell = (point(i) * (0.25 * cells) + 0.5 * cells).min(DVec3::splat(cells - 1.0));
            let [x, y, z] = cell.to_array().map(|c| spread(c as u32));
            u64::from(x | y << 1 | z << 2) << 32 | i as u64
        })
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// The low [`BITS`] bits of `cell`, each followed by two zeros.
const fn spread(cell: u32) -> u32 {
    let mut x = cell & ((1 << BITS) - 1);
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// The nodes of a grid with so many along each axis, every one beside the one before.
#[inline(always)]
pub fn serpentine([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let mut next = [0; 3];
    let mut upward = [true; 2];
    let lasts = [nx.saturating_sub(1), ny.saturating_sub(1)];
    (0..nx * ny * nz).map(
        #[inline(always)]
        move |_| {
            let node = next;
            for (axis, last) in lasts.into_iter().enumerate() {
                let at = &mut next[axis];
                if *at != if upward[axis] { last } else { 0 } {
                    *at = if upward[axis] { *at + 1 } else { *at - 1 };
                    return node;
                }
                upward[axis] = !upward[axis];
            }
            next[2] += 1;
            node
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_is_beside_the_one_before() {
        for grid in [[16, 16, 16], [1, 5, 3], [4, 1, 1], [3, 2, 5], [0, 3, 3]] {
            let nodes: Vec<[usize; 3]> = serpentine(grid).collect();
            let mut seen = nodes.clone();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), grid.iter().product::<usize>());
            for pair in nodes.windows(2) {
                let step = (0..3).map(|a| pair[0][a].abs_diff(pair[1][a])).sum::<usize>();
                assert_eq!(step, 1, "{pair:?} of {grid:?}");
            }
        }
    }

    #[test]
    fn sorted_points_are_all_there_and_close_together() {
        let mut random = super::super::samples::Uniform(5);
        let points: Vec<DVec3> = (0..4096).map(|_| random.point(-1.0, 1.0)).collect();
        let order = sorted(points.len(), |i| points[i]);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..4096));
        let way: f64 = order
            .windows(2)
            .map(|pair| points[pair[0] as usize].distance(points[pair[1] as usize]))
            .sum();
        // A cell a point is an eighth wide; in no order neighbours are 1.3 apart.
        assert!(way / 4096.0 < 0.3, "{}", way / 4096.0);
        assert!(sorted(100, |_| DVec3::NAN).is_empty());
        assert_eq!(sorted(1000, |_| DVec3::NAN).len(), 1000);
    }
}
