//! Roots of the field on grid edges, a batch at a time.
//!
//! The values and slopes at both ends of an edge give a cubic, and the cubic a guess; the field is
//! evaluated there, and the step from there to the root takes the curvature from the cubic
//! ([`super::guess`]). Where the field is smooth and the grid resolves it, that step ends at rounding
//! ([`Landing`]): one evaluation between the ends settles the edge. Where the slopes at the ends say
//! that the edge is bent, as at the kinks of sets and on the flat cuts, the guess is the root of
//! the tangents there instead.
//!
//! Edges that do not settle go on with a bracket whose ends have values and slopes again, so that
//! the same guess can be made of them; after [`EARLY`] rounds, Newton's method and bisection find
//! what there is. Each edge is one lane with a state of its own, so its root does not depend on the
//! edges that it is batched with.
//!
//! A value of zero counts as a root only where the slope is not zero: on a plateau of zeros the
//! root is where the solid ends. A root at a node is that node's coordinate exactly.
//!
//! Source of the safeguards: Press et al., Numerical Recipes, section 9.4 (`rtsafe`), with the ends
//! of the bracket kept by sign instead of by order.

use super::bits::SIDE;
use super::grid::TAU;
use super::guess::{DOUBTED, DOUBTED_ON_FACES, Guess, Landing, Moved, tolerance};
use crate::eval::sampler::Failure;
use crate::eval::{BRICK, End, Sampler};
use crate::geom::Axis;
use pulp::{Arch, NullaryFnOnce};

/// Most edges in a batch of a sampler.
pub(super) const BATCH: usize = 256;

/// Step, in edge lengths, below which a Newton step that does not shrink is taken as rounding of
/// the field, not as a failure to converge.
const STAGNATION: f64 = 1e-11;

/// Coordinates are known to this fraction of the largest of them.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A guess this close to an end of the edge, in edge lengths, may as well be at the end.
const AT_END: f64 = 1e-9;

/// Rounds in which guesses are made of both ends of a bracket.
const EARLY: usize = 5;

/// Most evaluations of an edge that has not settled after one: bisection alone needs 52 for any
/// edge, and no more than half of the steps of an edge that resists are those of Newton's method.
const MOST_ROUNDS: usize = 110;

/// Edges of one brick and axis, asked of a sampler.
pub(super) struct Query<'a, S: Sampler> {
    pub(super) sampler: &'a S,
    pub(super) workspace: &'a mut S::Workspace,
    pub(super) brick: [u32; 3],
    pub(super) activity: &'a [u64],
    pub(super) axis: Axis,
}

impl<S: Sampler> Query<'_, S> {
    fn begin(&mut self, nodes: &[u16]) -> Result<(), Failure> {
        let Self { sampler, workspace, brick, activity, axis } = self;
        sampler.line_begin(workspace, *axis, *brick, nodes, activity)
    }

    fn ends(&mut self, ends: &mut [Ends; 2], n: usize) -> Result<(), Failure> {
        for (end, Ends { value, slope, .. }) in [End::Lower, End::Upper].into_iter().zip(ends) {
            self.sampler.line_ends(self.workspace, end, &mut value[..n], &mut slope[..n])?;
        }
        Ok(())
    }

    fn evaluate(&mut self, points: &mut Points, n: usize) -> Result<(), Failure> {
        let Points { at, value, slope } = points;
        let (value, slope) = (&mut value[..n], &mut slope[..n]);
        self.sampler.line(self.workspace, &at[..n], value, slope)
    }
}

/// One number an edge. A line of the cache longer than a batch, because arrays a power of two
/// apart contend for the same few places in it.
type Numbers = [f64; BATCH + 8];

const ZERO: Numbers = [0.0; BATCH + 8];

/// Points on the edges of a batch, one an edge, with values and slopes of the field.
#[derive(Clone, Debug)]
struct Points {
    at: Numbers,
    value: Numbers,
    slope: Numbers,
}

/// Ends of the edges, or of the brackets on them.
type Ends = Points;

const NOWHERE: Points = Points { at: ZERO, value: ZERO, slope: ZERO };

/// The points where the field was asked for the roots, and what was expected of it there.
#[derive(Clone, Debug)]
struct Guesses {
    points: Points,
    /// The slope over the bracket, and half the second derivative over that slope and the bracket.
    expected: Numbers,
    curvature: Numbers,
}

const NO_GUESSES: Guesses = Guesses { points: NOWHERE, expected: ZERO, curvature: ZERO };

/// A batch of edges, one entry an edge.
#[derive(Debug)]
pub(super) struct Lanes {
    /// The lower and upper ends until a guess is made, then those inside and outside.
    ends: [Ends; 2],
    /// The guesses; their places are those of the roots in the end.
    guesses: Guesses,
    /// All ones where the root is not settled, then zero.
    open: [u64; BATCH + 8],
    /// All ones where the root may be near a node.
    near: [u64; BATCH + 8],
    resistant: Resistant,
}

/// Edges that have not settled, one entry an edge.
#[derive(Debug)]
struct Resistant {
    /// The edges, and their places in the batch.
    nodes: [u16; BATCH],
    place: [u16; BATCH],
    /// Ends of the brackets: inside, where the field is below zero, and outside.
    ends: [Ends; 2],
    guesses: Guesses,
    /// Length of the last step, and of the edge.
    step: Numbers,
    length: Numbers,
    /// All ones until the lane is settled, then zero.
    open: [u64; BATCH + 8],
}

impl Default for Lanes {
    fn default() -> Self {
        let open = [0; BATCH + 8];
        let resistant = Resistant {
            nodes: [0; BATCH],
            place: [0; BATCH],
            ends: [NOWHERE; 2],
            guesses: NO_GUESSES,
            step: ZERO,
            length: ZERO,
            open,
        };
        Self { ends: [NOWHERE; 2], guesses: NO_GUESSES, open, near: open, resistant }
    }
}

impl Lanes {
    /// Finds the roots on the edges from `nodes`, at most [`BATCH`], between the coordinates in
    /// `table`.
    pub(super) fn solve<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &[u16],
        table: &[f64; SIDE],
        extent: f64,
    ) -> Result<(), Failure> {
        ask.begin(nodes)?;
        ask.ends(&mut self.ends, nodes.len())?;
        self.settle(arch, ask, nodes, table, extent)
    }

    /// The roots on the first `n` edges of the last batch.
    pub(super) fn roots(&self, n: usize) -> &[f64] {
        &self.guesses.points.at[..n]
    }

    /// Those of the first `n` edges of the last batch whose roots may be within [`TAU`] of a node, and
    /// some more.
    pub(super) fn near(&self, n: usize) -> impl Iterator<Item = usize> {
        (0..n).filter(|lane| self.near[*lane] != 0)
    }

    /// As [`solve`](Self::solve), of edges that may have no root between their ends, or one in the
    /// other direction; `rising` tells in which the root is wanted. The nodes of those that do are
    /// moved to the front of `nodes`, and their places before to that of `kept`.
    #[expect(clippy::too_many_arguments, reason = "one call site")]
    pub(super) fn solve_some<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &mut [u16],
        rising: impl Fn(usize) -> bool,
        kept: &mut Vec<usize>,
        table: &[f64; SIDE],
        extent: f64,
    ) -> Result<(), Failure> {
        ask.begin(nodes)?;
        ask.ends(&mut self.ends, nodes.len())?;
        let [below, above] = self.ends.each_ref().map(|ends| &ends.value);
        kept.clear();
        kept.extend((0..nodes.len()).filter(|&lane| {
            (below[lane] < 0.0) == rising(lane) && (above[lane] < 0.0) != rising(lane)
        }));
        if kept.len() == nodes.len() {
            return self.settle(arch, ask, nodes, table, extent);
        }
        for (to, &from) in kept.iter().enumerate() {
            nodes[to] = nodes[from];
        }
        if kept.is_empty() {
            return Ok(());
        }
        self.solve(arch, ask, &nodes[..kept.len()], table, extent)
    }

    /// The roots on the edges of the present batch, whose ends have been evaluated.
    fn settle<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &[u16],
        table: &[f64; SIDE],
        extent: f64,
    ) -> Result<(), Failure> {
        let (n, rounding) = (nodes.len(), ROUNDING * extent);
        let shift = 4 * ask.axis.index();
        let [lower, upper] = &mut self.ends;
        for ((node, lower), upper) in nodes.iter().zip(&mut lower.at).zip(&mut upper.at) {
            let i = usize::from(node >> shift) % BRICK;
            (*lower, *upper) = (table[i], table[i + 1]);
        }
        arch.dispatch(Starting { lanes: self, n });
        ask.evaluate(&mut self.guesses.points, n)?;
        let doubted = if ask.sampler.is_faceted() { DOUBTED_ON_FACES } else { DOUBTED };
        if arch.dispatch(Settling { lanes: self, n, doubted, rounding }) > 0 {
            self.persist(arch, ask, nodes, doubted, rounding)?;
        }
        Ok(())
    }

    /// Settles the edges that are open.
    #[cold]
    fn persist<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &[u16],
        doubted: f64,
        rounding: f64,
    ) -> Result<(), Failure> {
        let Self { ends, guesses, open, resistant, .. } = self;
        let mut n = 0;
        for (lane, node) in nodes.iter().enumerate().filter(|(lane, _)| open[*lane] != 0) {
            (resistant.nodes[n], resistant.place[n]) = (*node, lane as u16);
            for (to, from) in resistant.ends.iter_mut().zip(&*ends) {
                to.take(n, from, lane);
            }
            resistant.guesses.take(n, guesses, lane);
            let length = (ends[0].at[lane] - ends[1].at[lane]).abs();
            (resistant.step[n], resistant.length[n]) = (length, length);
            resistant.open[n] = u64::MAX;
            n += 1;
        }
        let roots = &mut guesses.points.at;
        let mut begun = 0;
        for round in 0..MOST_ROUNDS {
            let open = arch.dispatch(Advancing { lanes: resistant, n, doubted, rounding, round });
            if open == 0 {
                break;
            }
            if begun == 0 || 2 * open < n {
                n = resistant.compact(n, roots);
                ask.begin(&resistant.nodes[..n])?;
                begun = n;
            }
            ask.evaluate(&mut resistant.guesses.points, n)?;
        }
        for lane in 0..n {
            roots[usize::from(resistant.place[lane])] = resistant.guesses.points.at[lane];
        }
        Ok(())
    }
}

impl Points {
    #[inline(always)]
    fn take(&mut self, to: usize, other: &Self, from: usize) {
        self.at[to] = other.at[from];
        self.value[to] = other.value[from];
        self.slope[to] = other.slope[from];
    }

    #[inline(always)]
    fn shift(&mut self, to: usize, from: usize) {
        self.at[to] = self.at[from];
        self.value[to] = self.value[from];
        self.slope[to] = self.slope[from];
    }
}

impl Guesses {
    fn take(&mut self, to: usize, other: &Self, from: usize) {
        self.points.take(to, &other.points, from);
        self.expected[to] = other.expected[from];
        self.curvature[to] = other.curvature[from];
    }
}

/// Sets the brackets and the first guesses; a task for [`Arch::dispatch`].
struct Starting<'a> {
    lanes: &'a mut Lanes,
    n: usize,
}

impl NullaryFnOnce for Starting<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { lanes: Lanes { ends: [inner, outer], guesses, .. }, n } = self;
        for lane in 0..n.min(BATCH) {
            let (lower, upper) = (inner.at[lane], outer.at[lane]);
            let (below, above) = (inner.value[lane], outer.value[lane]);
            let (steep, steeper) = (inner.slope[lane], outer.slope[lane]);
            let rising = below < 0.0;
            let (a, b) = if rising { (lower, upper) } else { (upper, lower) };
            let (least, most) = if rising { (below, above) } else { (above, below) };
            let (first, last) = if rising { (steep, steeper) } else { (steeper, steep) };
            let span = b - a;
            let guess = Guess::new([least, most], [first * span, last * span], None);
            let at = a + span * guess.at;
            let at = if at > lower { at } else { lower };
            let at = if at < upper { at } else { upper };
            let within = (guess.at - 0.5).abs() <= 0.5 + AT_END;
            let at = if within { at } else { 0.5 * (a + b) };
            (inner.at[lane], outer.at[lane]) = (a, b);
            (inner.value[lane], outer.value[lane]) = (least, most);
            (inner.slope[lane], outer.slope[lane]) = (first, last);
            guesses.points.at[lane] = if most == 0.0 { b } else { at };
            guesses.expected[lane] = guess.slope;
            guesses.curvature[lane] = guess.curvature;
        }
    }
}

/// Takes the steps that end at roots and returns how many lanes stay open; a task for
/// [`Arch::dispatch`].
struct Settling<'a> {
    lanes: &'a mut Lanes,
    n: usize,
    doubted: f64,
    rounding: f64,
}

impl NullaryFnOnce for Settling<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { lanes, n, doubted, rounding } = self;
        let Lanes { ends: [inner, outer], guesses, open, near, .. } = lanes;
        let Guesses { points, expected, curvature } = guesses;
        let mut still = 0;
        for lane in 0..n.min(BATCH) {
            let at = [points.at[lane], inner.at[lane], outer.at[lane]];
            let (value, slope) = (points.value[lane], points.slope[lane]);
            let guess = [expected[lane], curvature[lane]];
            let landing = Landing::new(at, value, slope, guess, doubted, rounding);
            let root = if landing.is_good { landing.root } else { at[0] };
            // Rather too near than not; where an open lane's root is, is not known yet.
            let margin = 2.0 * TAU * (at[2] - at[1]).abs();
            let is_far = ((root - at[1]).abs() >= margin) & ((root - at[2]).abs() >= margin);
            points.at[lane] = root;
            open[lane] = if landing.is_good { 0 } else { u64::MAX };
            near[lane] = if landing.is_good & is_far { 0 } else { u64::MAX };
            still += usize::from(!landing.is_good);
        }
        still
    }
}

/// Takes a step in each open lane and returns how many lanes stay open; a task for
/// [`Arch::dispatch`].
struct Advancing<'a> {
    lanes: &'a mut Resistant,
    n: usize,
    doubted: f64,
    rounding: f64,
    round: usize,
}

impl NullaryFnOnce for Advancing<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { lanes, n, doubted, rounding, round } = self;
        if round < EARLY {
            lanes.advance::<true>(n, doubted, rounding)
        } else {
            lanes.advance::<false>(n, doubted, rounding)
        }
    }
}

impl Resistant {
    /// Takes a step in each open lane and returns how many lanes stay open.
    ///
    /// Where Newton's step is no good the bracket is halved. In `EARLY` rounds the guess from both
    /// ends of the bracket comes first.
    #[inline(always)]
    fn advance<const EARLY: bool>(&mut self, n: usize, doubted: f64, rounding: f64) -> usize {
        let Self { ends: [inner, outer], guesses, step, length, open, .. } = self;
        let Guesses { points, expected, curvature } = guesses;
        let mut still = 0;
        for lane in 0..n.min(BATCH) {
            let (at, value, slope) = (points.at[lane], points.value[lane], points.slope[lane]);
            let bracket = [at, inner.at[lane], outer.at[lane]];
            let guess = [expected[lane], curvature[lane]];
            let landing = Landing::new(bracket, value, slope, guess, doubted, rounding);
            let lands = EARLY & landing.is_good;

            // The end of the bracket that moves here, and the change of the slope on the way.
            let inside = value < 0.0;
            let (a, b) = (inner.at[lane], outer.at[lane]);
            let (least, most) = (inner.value[lane], outer.value[lane]);
            let (first, last) = (inner.slope[lane], outer.slope[lane]);
            let is_first_zero = (value == 0.0) & (most != 0.0);
            let from = if inside { a } else { b };
            let steep = if inside { first } else { last };
            let bend = (slope - steep) / (2.0 * (at - from) * slope);
            let a = if inside { at } else { a };
            let b = if inside { b } else { at };
            let least = if inside { value } else { least };
            let most = if inside { most } else { value };
            let first = if inside { slope } else { first };
            let last = if inside { last } else { slope };
            let (middle, span) = (0.5 * (a + b), b - a);
            let tolerance = tolerance(length[lane], rounding);

            // An infinite slope makes a step of zero, which would be taken for a root.
            let is_finite = slope.abs() < f64::INFINITY;
            let size = if is_finite { value / slope } else { f64::NAN };
            let newton = at - size;
            let size = size.abs();
            let within = (newton - a) * (newton - b) <= 0.0;
            let shrinks = size <= 0.75 * step[lane];
            let stagnates = size <= STAGNATION * length[lane];
            let take = within & (shrinks | stagnates);
            let converged = take & ((size <= tolerance) | !shrinks);
            let narrow = span.abs() <= tolerance;

            let moved = Moved { is_inner: inside, curvature: bend * span };
            let guess = Guess::new([least, most], [first * span, last * span], Some(moved));
            let guessed = a + span * guess.at;
            let distance = (guessed - at).abs();
            let within = (guessed - a) * (guessed - b) < 0.0;
            let trusted = EARLY & within & (distance <= 0.75 * step[lane]);
            // A zero without a slope may be the edge of a plateau, or the root of a distance that has
            // no derivative there: just before it the field tells.
            let before = b - tolerance.copysign(span);
            let asks = EARLY & is_first_zero;

            let next = if take { newton } else { middle };
            let next = if trusted & !converged { guessed } else { next };
            let next = if asks & !converged { before } else { next };
            let next = if narrow & !converged { b } else { next };
            let next = if lands { landing.root } else { next };
            let size = if take { size } else { 0.5 * span.abs() };
            let size = if trusted { distance } else { size };
            let size = if asks | guess.is_detour { length[lane] } else { size };
            let was_open = open[lane] != 0;
            (inner.at[lane], outer.at[lane]) = (a, b);
            (inner.value[lane], outer.value[lane]) = (least, most);
            (inner.slope[lane], outer.slope[lane]) = (first, last);
            expected[lane] = guess.slope;
            curvature[lane] = guess.curvature;
            step[lane] = size;
            points.at[lane] = if was_open { next } else { at };
            let stays = was_open & !(lands | converged | narrow);
            open[lane] = if stays { u64::MAX } else { 0 };
            still += usize::from(stays);
        }
        still
    }

    /// Delivers the settled lanes to `roots` and moves the open ones together; returns how many
    /// are open.
    fn compact(&mut self, n: usize, roots: &mut Numbers) -> usize {
        let mut kept = 0;
        for lane in 0..n {
            if self.open[lane] == 0 {
                roots[usize::from(self.place[lane])] = self.guesses.points.at[lane];
                continue;
            }
            self.nodes[kept] = self.nodes[lane];
            self.place[kept] = self.place[lane];
            self.ends.iter_mut().for_each(|ends| ends.shift(kept, lane));
            self.guesses.points.shift(kept, lane);
            self.guesses.expected[kept] = self.guesses.expected[lane];
            self.guesses.curvature[kept] = self.guesses.curvature[lane];
            self.step[kept] = self.step[lane];
            self.length[kept] = self.length[lane];
            self.open[kept] = u64::MAX;
            kept += 1;
        }
        kept
    }
}
