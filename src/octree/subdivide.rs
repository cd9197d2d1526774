//! From one box around the grid down to bricks, level by level.
//!
//! A box that an interval proves inside or outside is settled with all its bricks; any other is
//! cut in eight, which are enclosed by one call and inherit its activity. A box that may hold NaN
//! is never settled, so that NaNs can be counted where they are.

use super::activity::{Activities, ActivityId};
use super::pool::Pool;
use super::ranked::RankedBits;
use crate::eval::sampler::Failure;
use crate::eval::{BRICK, NodeBox, Sampler};
use crate::num::{Cancelled, Interval, Progress};
use rayon::prelude::*;

/// Boxes that one task cuts at most: enough to share a table of activities, few enough to balance.
const CHUNK: usize = 64;
/// Tasks that the boxes of a level are shared among, if there are as many: the first levels of a huge
/// union have few boxes, each of which takes long.
const TASKS: usize = 16;

/// Whether intervals may settle boxes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pruning {
    /// Boxes are settled by intervals.
    #[default]
    Intervals,
    /// Every brick is sampled with every region active: the reference that pruning must equal.
    None,
}

/// Why subdivision stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Interrupted {
    /// A field without a formula could not be evaluated.
    #[error(transparent)]
    Failure(#[from] Failure),
    /// The caller cancelled the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// More bricks would be left to sample than the caller allows.
    #[error("about {bricks} bricks would have to be sampled")]
    TooMany {
        /// How many, about.
        bricks: u64,
    },
}

/// What is known of the bricks of a grid.
///
/// Bricks are numbered `x + nx (y + ny z)`.
#[derive(Clone, Debug)]
pub struct Bricks {
    /// Number of bricks along each axis.
    pub counts: [u32; 3],
    /// Bricks that intervals do not settle.
    pub active: RankedBits,
    /// Bricks proved inside, closed box and all.
    pub inside: Vec<u64>,
    /// Activity rows.
    pub activities: Activities,
    /// Number of boxes that were enclosed.
    pub boxes: u64,
    /// Activity of the active bricks in order; the top bit is set where NaN is possible.
    marks: Vec<u32>,
}

impl Bricks {
    /// Number of bricks.
    #[must_use]
    pub fn total(&self) -> usize {
        self.counts.iter().map(|&n| n as usize).product()
    }

    /// Activity of the active brick of rank `rank`.
    #[must_use]
    pub fn activity(&self, rank: usize) -> ActivityId {
        ActivityId::new(self.marks[rank] & !NAN)
    }

    /// Whether samples of the active brick of rank `rank` may be NaN.
    #[must_use]
    pub fn may_be_nan(&self, rank: usize) -> bool {
        self.marks[rank] & NAN != 0
    }

    /// Position of the brick of that number along each axis.
    #[must_use]
    pub fn position(&self, number: usize) -> [u32; 3] {
        let [nx, ny, _] = self.counts.map(|n| n as usize);
        [(number % nx) as u32, (number / nx % ny) as u32, (number / nx / ny) as u32]
    }
}

/// The bit of a mark that says NaN is possible.
const NAN: u32 = 1 << 31;

/// A box that is not settled.
#[derive(Clone, Copy, Debug)]
struct Open {
    index: [u32; 3],
    activity: ActivityId,
    nan: bool,
}

/// What a task found out about the children of its boxes.
struct Found {
    open: Vec<Open>,
    inside: Vec<[u32; 3]>,
    activities: Activities,
    boxes: u64,
}

/// Scratch memory of a task.
struct Scratch<W> {
    workspace: W,
    activity: Vec<u64>,
    boxes: Vec<NodeBox>,
    ranges: [Interval; 8],
}

impl<W> Scratch<W> {
    fn new<S: Sampler<Workspace = W>>(sampler: &S) -> Self {
        Self {
            workspace: sampler.workspace(),
            activity: vec![0; 8 * sampler.activity_words()],
            boxes: Vec::with_capacity(8),
            ranges: [Interval::ANYTHING; 8],
        }
    }
}

/// By how much a number of bricks may be foreseen too high: loose intervals keep twice or three
/// times the boxes of a surface open in coarse levels.
const DOUBT: u64 = 4;

/// Classifies the bricks of the sampler's grid, of which no more than `most` may be left to sample.
///
/// # Errors
/// [`Interrupted`] by the failure of an oracle, by the caller, or by the number of bricks. That is
/// foreseen from coarser levels, by what a plane across a box takes of it.
pub fn subdivide<S: Sampler>(
    sampler: &S,
    pruning: Pruning,
    most: u64,
    progress: &Progress,
) -> Result<Bricks, Interrupted> {
    let counts = sampler.nodes().map(|n| ((n - 1) / BRICK) as u32);
    let total: usize = counts.iter().map(|&n| n as usize).product();
    if pruning == Pruning::None && total as u64 > most {
        return Err(Interrupted::TooMany { bricks: total as u64 });
    }
    let mut activities = Activities::new(sampler.activity_words());
    let mut inside = vec![0; total.div_ceil(64)];
    if pruning == Pruning::None {
        let words = (0..total.div_ceil(64)).map(|w| match total - 64 * w {
            rest @ 0..64 => (1 << rest) - 1,
            _ => u64::MAX,
        });
        let active = RankedBits::new(words.collect());
        let marks = vec![NAN | ActivityId::ALL.index() as u32; total];
        return Ok(Bricks { counts, active, inside, activities, boxes: 0, marks });
    }

    let top = counts.iter().map(|n| n.next_power_of_two().trailing_zeros()).max().unwrap_or(0);
    let pool = Pool::default();
    let mut boxes = 0;
    // A box above the top: its only child in the grid is the box around everything.
    let mut open = vec![Open { index: [0; 3], activity: ActivityId::ALL, nan: false }];
    for level in (0..=top as u8).rev() {
        let chunk = (open.len() / TASKS).clamp(1, CHUNK);
        progress.expect(open.len().div_ceil(chunk) as u64);
        let found = open
            .par_chunks(chunk)
            .map(|parents| {
                let make = || Scratch::new(sampler);
                let task =
                    |scratch: &mut _| cut(sampler, scratch, parents, level, counts, &activities);
                let found = pool.lend(make, task)?;
                progress.advance(1)?;
                Ok::<_, Interrupted>(found)
            })
            .collect::<Result<Vec<_>, _>>()?;
        open = Vec::with_capacity(found.iter().map(|f| f.open.len()).sum());
        for part in found {
            let renamed = activities.absorb(part.activities);
            open.extend(
                part.open.iter().map(|o| Open { activity: renamed[o.activity.index()], ..*o }),
            );
            for index in part.inside {
                fill(&mut inside, counts, level, index);
            }
            boxes += part.boxes;
        }
        let foreseen = (open.len() as u64).saturating_mul(bricks_across(level, counts));
        let certain = if level == 0 { foreseen } else { foreseen / DOUBT };
        if certain > most {
            return Err(Interrupted::TooMany { bricks: foreseen.min(total as u64) });
        }
    }

    let number = |index: [u32; 3]| {
        let [x, y, z] = index.map(|i| i as usize);
        x + counts[0] as usize * (y + counts[1] as usize * z)
    };
    let mut words = vec![0u64; total.div_ceil(64)];
    for o in &open {
        let n = number(o.index);
        words[n / 64] |= 1 << (n % 64);
    }
    let active = RankedBits::new(words);
    let mut marks = vec![0; active.len()];
    for o in &open {
        if let Some(rank) = active.rank(number(o.index)) {
            marks[rank] = o.activity.index() as u32 | if o.nan { NAN } else { 0 };
        }
    }
    Ok(Bricks { counts, active, inside, activities, boxes, marks })
}

/// Bricks of a box of `level` that a plane meets which crosses it the shortest way.
fn bricks_across(level: u8, counts: [u32; 3]) -> u64 {
    let mut sides = counts.map(|n| u64::from(n).min(1 << level.min(32)));
    sides.sort_unstable();
    sides[0] * sides[1]
}

/// Encloses the children of `parents`, which are boxes of `level`.
fn cut<S: Sampler>(
    sampler: &S,
    scratch: &mut Scratch<S::Workspace>,
    parents: &[Open],
    level: u8,
    counts: [u32; 3],
    activities: &Activities,
) -> Result<Found, Failure> {
    let words = activities.words();
    let Scratch { workspace, activity, boxes, ranges } = scratch;
    let mut found = Found {
        open: Vec::new(),
        inside: Vec::new(),
        activities: Activities::new(words),
        boxes: 0,
    };
    for parent in parents {
        boxes.clear();
        boxes.extend((0..8u32).filter_map(|octant| {
            let index = [0, 1, 2].map(|a| 2 * parent.index[a] + (octant >> a & 1));
            let starts_in_grid = (0..3).all(|a| index[a] << level < counts[a]);
            starts_in_grid.then_some(NodeBox { level, index })
        }));
        let n = boxes.len();
        for b in 0..n {
            activities.expand(parent.activity, &mut activity[b * words..(b + 1) * words]);
        }
        sampler.ranges(workspace, boxes, &mut activity[..n * words], &mut ranges[..n])?;
        found.boxes += n as u64;
        for (b, (node, range)) in boxes.iter().zip(&*ranges).enumerate() {
            if range.is_inside() {
                found.inside.push(node.index);
            } else if range.nan || !range.is_outside() {
                let activity = found.activities.insert(&activity[b * words..(b + 1) * words]);
                found.open.push(Open { index: node.index, activity, nan: range.nan });
            }
        }
    }
    Ok(found)
}

/// Sets the bits of all bricks of a box.
fn fill(bits: &mut [u64], counts: [u32; 3], level: u8, index: [u32; 3]) {
    let span = |a: usize| {
        let from = (index[a] as usize) << level;
        from..(from + (1 << level)).min(counts[a] as usize)
    };
    for z in span(2) {
        for y in span(1) {
            let row = counts[0] as usize * (y + counts[1] as usize * z);
            for n in span(0).start + row..span(0).end + row {
                bits[n / 64] |= 1 << (n % 64);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::{BrickSigns, End};
    use crate::geom::Axis;

    /// A ball, enclosed exactly; boxes to the left of `nan` may be NaN.
    struct Ball {
        bricks: [usize; 3],
        radius: f64,
        nan: f64,
    }

    impl Ball {
        /// The box of a node box, in units of bricks from the middle of the grid.
        fn span(&self, node: &NodeBox) -> [[f64; 2]; 3] {
            [0, 1, 2].map(|a| {
                let end = |i: u32| ((i as usize) << node.level).min(self.bricks[a]) as f64;
                let middle = 0.5 * self.bricks[a] as f64;
                [end(node.index[a]) - middle, end(node.index[a] + 1) - middle]
            })
        }

        fn range(&self, node: &NodeBox) -> Interval {
            let squares = self.span(node).map(|[a, b]| {
                let least = if a <= 0.0 && b >= 0.0 { 0.0 } else { (a * a).min(b * b) };
                [least, (a * a).max(b * b)]
            });
            let end = |e: usize| squares.iter().map(|s| s[e]).sum::<f64>() - self.radius.powi(2);
            let nan = self.span(node)[0][0] < self.nan;
            Interval { nan, ..Interval::new(end(0), end(1)) }
        }
    }

    impl Sampler for Ball {
        type Workspace = ();
        fn workspace(&self) {}
        fn nodes(&self) -> [usize; 3] {
            self.bricks.map(|n| n * BRICK + 1)
        }
        fn activity_words(&self) -> usize {
            1
        }
        fn ranges(
            &self,
            _: &mut (),
            boxes: &[NodeBox],
            activity: &mut [u64],
            ranges: &mut [Interval],
        ) -> Result<(), Failure> {
            assert!(boxes.len() <= 8);
            for ((node, activity), range) in boxes.iter().zip(activity).zip(ranges) {
                *range = self.range(node);
                // Each level clears its bit, and one for the octant.
                *activity &= !(1 << node.level | 1 << (32 + node.index[0] % 2));
            }
            Ok(())
        }
        fn signs(
            &self,
            _: &mut (),
            _: [u32; 3],
            _: &[u64],
            _: &mut BrickSigns,
        ) -> Result<(), Failure> {
            Ok(())
        }
        fn values(
            &self,
            _: &mut (),
            _: [u32; 3],
            _: &[u64],
            _: &mut [f64; BRICK * BRICK * BRICK],
        ) -> Result<(), Failure> {
            Ok(())
        }
        fn line_begin(
            &self,
            _: &mut (),
            _: Axis,
            _: [u32; 3],
            _: &[u16],
            _: &[u64],
        ) -> Result<(), Failure> {
            Ok(())
        }
        fn line_ends(
            &self,
            _: &mut (),
            _: End,
            _: &mut [f64],
            _: &mut [f64],
        ) -> Result<(), Failure> {
            Ok(())
        }
        fn line(&self, _: &mut (), _: &[f64], _: &mut [f64], _: &mut [f64]) -> Result<(), Failure> {
            Ok(())
        }
    }

    fn bricks(ball: &Ball) -> Bricks {
        subdivide(ball, Pruning::Intervals, u64::MAX, &Progress::new()).unwrap()
    }

    #[test]
    fn every_brick_has_the_class_of_its_own_enclosure() {
        for shape in [[1, 1, 1], [5, 5, 5], [13, 7, 22]] {
            let ball = Ball { bricks: shape, radius: 3.3, nan: f64::NEG_INFINITY };
            let found = bricks(&ball);
            assert_eq!(found.total(), shape.iter().product::<usize>());
            for number in 0..found.total() {
                let node = NodeBox { level: 0, index: found.position(number) };
                let range = ball.range(&node);
                let inside = found.inside[number / 64] >> (number % 64) & 1 == 1;
                assert_eq!(inside, range.is_inside(), "{node:?}");
                assert_eq!(found.active.contains(number), !inside && !range.is_outside());
            }
            let mut row = [0];
            let top = shape.iter().map(|n| n.next_power_of_two().ilog2()).max().unwrap();
            for rank in 0..found.active.len() {
                found.activities.expand(found.activity(rank), &mut row);
                assert_eq!(row[0] & ((2 << top) - 1), 0, "activity is inherited");
                assert!(!found.may_be_nan(rank));
            }
        }
    }

    #[test]
    fn a_box_that_may_be_nan_is_never_settled() {
        let ball = Ball { bricks: [9, 9, 9], radius: 2.0, nan: -3.0 };
        let found = bricks(&ball);
        for number in 0..found.total() {
            let index = found.position(number);
            let nan = f64::from(index[0]) - 4.5 < -3.0;
            match found.active.rank(number) {
                Some(rank) => assert_eq!(found.may_be_nan(rank), nan),
                None => assert!(!nan),
            }
        }
    }

    #[test]
    fn without_pruning_every_brick_is_sampled() {
        let ball = Ball { bricks: [3, 5, 7], radius: 1.0, nan: 0.0 };
        let all = subdivide(&ball, Pruning::None, u64::MAX, &Progress::new()).unwrap();
        assert_eq!((all.active.len(), all.boxes), (105, 0));
        assert!(all.inside.iter().all(|word| *word == 0));
        assert!((0..105).all(|rank| all.may_be_nan(rank)));
    }

    #[test]
    fn more_bricks_than_allowed_are_refused_and_no_fewer() {
        let progress = Progress::new();
        let flat = Ball { bricks: [300, 200, 1], radius: 60.0, nan: f64::NEG_INFINITY };
        let round = Ball { bricks: [90; 3], radius: 40.0, nan: f64::NEG_INFINITY };
        let long = Ball { bricks: [500, 2, 3], radius: 2.0, nan: f64::NEG_INFINITY };
        for ball in [flat, round, long] {
            let needed = bricks(&ball).active.len() as u64;
            let limited = |most| subdivide(&ball, Pruning::Intervals, most, &progress);
            assert_eq!(limited(needed).unwrap().active.len() as u64, needed);
            let bricks = needed;
            assert_eq!(limited(needed - 1).unwrap_err(), Interrupted::TooMany { bricks });
            let total = ball.bricks.iter().product::<usize>() as u64;
            let all = |most| subdivide(&ball, Pruning::None, most, &progress);
            assert!(all(total).is_ok());
            assert_eq!(all(total - 1).unwrap_err(), Interrupted::TooMany { bricks: total });
        }
    }

    #[test]
    fn far_too_many_bricks_are_foreseen_early() {
        // A surface of some 10^7 bricks, of which 10^4 are allowed.
        let ball = Ball { bricks: [1500; 3], radius: 700.0, nan: f64::NEG_INFINITY };
        let result = subdivide(&ball, Pruning::Intervals, 10_000, &Progress::new());
        let Err(Interrupted::TooMany { bricks }) = result else { panic!("{result:?}") };
        let area = 4.0 * std::f64::consts::PI * 700.0_f64.powi(2);
        let ratio = bricks as f64 / area;
        assert!((1.0 / DOUBT as f64..DOUBT as f64).contains(&ratio), "{bricks}");
    }

    #[test]
    fn cancelled_subdivision_stops() {
        let progress = Progress::new();
        progress.cancel();
        let ball = Ball { bricks: [3; 3], radius: 1.0, nan: 0.0 };
        let result = subdivide(&ball, Pruning::Intervals, u64::MAX, &progress);
        assert_eq!(result.unwrap_err(), Interrupted::Cancelled(Cancelled));
    }
}
