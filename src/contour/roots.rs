//! Roots of the field on grid edges, a batch at a time.
//!
//! The values and slopes at both ends of an edge give a cubic, and the cubic a guess; the field is
//! evaluated there, and the step from there to the root takes the curvature from the cubic
//! ([`Guess`]). Where the field is smooth and the grid resolves it, that step ends at rounding
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
use crate::eval::sampler::Failure;
use crate::eval::{BRICK, End, Sampler};
use crate::geom::Axis;
use pulp::{Arch, NullaryFnOnce};

/// Most edges in a batch of a sampler.
pub(super) const BATCH: usize = 256;

/// Step, in edge lengths, below which a root is settled once the step is taken.
const TOLERANCE: f64 = 1e-13;

/// Step, in edge lengths, below which a Newton step that does not shrink is taken as rounding of
/// the field, not as a failure to converge.
const STAGNATION: f64 = 1e-11;

/// Coordinates are known to this fraction of the largest of them.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Step, in edge lengths, that may be the last: its cube is below rounding.
const LAST_STEP: f64 = 2e-5;

/// Half of the change of the second derivative that goes with a change of the slope, both over the
/// slope and in edge lengths, at most: the cubic that misses the field's slope by some part of it is
/// believed to miss the curvature by no more than so many such parts.
const MISSED: f64 = 16.0;

/// Part of the curvature that is not believed in any case.
const DOUBTED: f64 = 0.01;

/// An edge is bent where the slope at an end differs from the average slope by more than this part
/// of that.
const BENT: f64 = 0.5;

/// Where a tangent led beyond a bend, the next guess keeps this part of the bracket away from there.
const ASTRAY: f64 = 0.125;

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
        Self { ends: [NOWHERE; 2], guesses: NO_GUESSES, open, resistant }
    }
}

impl Lanes {
    /// Roots on the edges from `nodes`, at most [`BATCH`], between the coordinates in `table`.
    pub(super) fn solve<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &[u16],
        table: &[f64; SIDE],
        extent: f64,
    ) -> Result<&[f64], Failure> {
        ask.begin(nodes)?;
        ask.ends(&mut self.ends, nodes.len())?;
        self.settle(arch, ask, nodes, table, extent)
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
    ) -> Result<&[f64], Failure> {
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
            return Ok(&[]);
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
    ) -> Result<&[f64], Failure> {
        let (n, rounding) = (nodes.len(), ROUNDING * extent);
        let shift = 4 * ask.axis.index();
        let [lower, upper] = &mut self.ends;
        for ((node, lower), upper) in nodes.iter().zip(&mut lower.at).zip(&mut upper.at) {
            let i = usize::from(node >> shift) % BRICK;
            (*lower, *upper) = (table[i], table[i + 1]);
        }
        arch.dispatch(Starting { lanes: self, n });
        ask.evaluate(&mut self.guesses.points, n)?;
        if arch.dispatch(Settling { lanes: self, n, rounding }) > 0 {
            self.persist(arch, ask, nodes, rounding)?;
        }
        Ok(&self.guesses.points.at[..n])
    }

    /// Settles the edges that are open.
    #[cold]
    fn persist<S: Sampler>(
        &mut self,
        arch: Arch,
        ask: &mut Query<'_, S>,
        nodes: &[u16],
        rounding: f64,
    ) -> Result<(), Failure> {
        let Self { ends, guesses, open, resistant } = self;
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
            let open = arch.dispatch(Advancing { lanes: resistant, n, rounding, round });
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

/// Where a root is thought to be on a bracket, inside at 0 and outside at 1.
#[derive(Clone, Copy)]
struct Guess {
    /// The place; anything if it is not between 0 and 1.
    at: f64,
    /// The slope there, by the length of the bracket.
    slope: f64,
    /// Half the second derivative over the slope there.
    curvature: f64,
    /// Whether the root is thought to be elsewhere, but should be looked for from here.
    is_detour: bool,
}

/// An end of a bracket that has just been moved to where it is.
#[derive(Clone, Copy)]
struct Moved {
    /// Whether it is the end inside.
    is_inner: bool,
    /// Half the second derivative over the slope, by the length of the bracket.
    curvature: f64,
}

impl Guess {
    /// The guess from values `f` and slopes `m` (by the length of the bracket) inside and outside.
    ///
    /// On a smooth edge it is the root of the cubic that has them, which is
    ///
    /// > f(t) = f_0 + t d + t (1 - t) [(1 - t) p - t q], d = f_1 - f_0, p = m_0 - d, q = m_1 - d:
    ///
    /// from where the straight line is zero, t_0 = -f_0 / d, by the step of third order
    /// u - c u² + (2 c² - e) u³, where u = -f / f_t, c = f_tt / 2 f_t and e = f_ttt / 6 f_t. The cubic
    /// misses the field by its fourth derivative times t² (1 - t)² / 24: of a wave of N edges the
    /// root is off by some N^-3 edges at most.
    ///
    /// On a bent edge it is the first root of the tangents at both ends where the slope grows towards
    /// the outside, as in a maximum of two fields, and the last one where it shrinks. If an end was
    /// `moved`, then its tangent is a parabola; the other end's led to the wrong side of the bend,
    /// and once more would: the guess keeps away from there.
    #[inline(always)]
    fn new(f: [f64; 2], m: [f64; 2], moved: Option<Moved>) -> Self {
        let rise = f[1] - f[0];
        let straight = -f[0] / rise;
        let (p, q) = (m[0] - rise, m[1] - rise);
        let smooth = (p.abs() <= BENT * rise) & (q.abs() <= BENT * rise);
        let (sum, lead, room) = (p + q, 1.0 - 2.0 * straight, straight * (1.0 - straight));
        let r = p - straight * sum;

        // Which of the roots -f_0 / m_0 and 1 - f_1 / m_1 is the lesser, without dividing.
        let first_is_less = -f[0] * m[1] < m[0] * (m[1] - f[1]);
        let by_first =
            if m[1] > 0.0 { (m[0] > 0.0) & (first_is_less == (m[1] > m[0])) } else { true };
        let value = if by_first { f[0] } else { f[1] };
        let slope = if by_first { m[0] } else { m[1] };
        let from = if by_first { 0.0 } else { 1.0 };
        let value = if smooth { room * r } else { value };
        let slope = if smooth { rise + lead * r - room * sum } else { slope };
        let from = if smooth { straight } else { from };

        let per = 1.0 / slope;
        let u = -(value * per);
        let (second, third) = (-(r + lead * sum) * per, sum * per);
        let (mut bend, mut astray) = (0.0, false);
        if let Some(Moved { is_inner, curvature }) = moved {
            let is_own = by_first == is_inner;
            let is_known = is_own & ((curvature * u).abs() <= 0.25);
            bend = if is_known { curvature } else { 0.0 };
            astray = !smooth & !is_own;
        }
        let second = if smooth { second } else { bend };
        let third = if smooth { third } else { 0.0 };
        let step = u - u * u * (second - (2.0 * second * second - third) * u);
        let (change, turn) = (2.0 * second * step, 3.0 * third * step);
        let at = from + step;
        let kept_off = if by_first { at.min(1.0 - ASTRAY) } else { at.max(ASTRAY) };
        Self {
            at: if astray { kept_off } else { at },
            slope: slope * (1.0 + change + turn * step),
            curvature: (second + turn) * (1.0 - change),
            is_detour: astray & (kept_off != at),
        }
    }
}

/// The step that ends at the root.
#[derive(Clone, Copy)]
struct Landing {
    root: f64,
    is_good: bool,
}

impl Landing {
    /// The step from a point `at` with that value and slope between the ends of a bracket of which
    /// a guess has been made.
    ///
    /// A step u, in brackets, taken where the curvature is c, ends at u - c u², which c's error
    /// times u² separates from the root. Terms of third order are below rounding where u is at most
    /// [`LAST_STEP`].
    #[inline(always)]
    fn new(at: [f64; 3], value: f64, slope: f64, guess: [f64; 2], rounding: f64) -> Self {
        let ([at, inner, outer], [expected, curvature]) = (at, guess);
        let span = outer - inner;
        let steep = slope * span;
        let u = -value / steep;
        let root = at + span * (u - curvature * (u * u));
        let between = (root - inner) * (root - outer) <= 0.0;
        let finite = slope.abs() < f64::INFINITY;
        let tolerance = tolerance(span.abs(), rounding);
        let doubt = MISSED * (steep - expected).abs() + DOUBTED * (curvature * steep).abs();
        let is_small = u.abs() <= LAST_STEP;
        let ends_there = is_small & (doubt * (u * u) * span.abs() <= tolerance * steep.abs());
        let is_nothing = (u * span).abs() <= tolerance;
        Self { root, is_good: between & finite & (is_nothing | ends_there) }
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
    rounding: f64,
}

impl NullaryFnOnce for Settling<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { lanes: Lanes { ends: [inner, outer], guesses, open, .. }, n, rounding } = self;
        let Guesses { points, expected, curvature } = guesses;
        let mut still = 0;
        for lane in 0..n.min(BATCH) {
            let at = [points.at[lane], inner.at[lane], outer.at[lane]];
            let (value, slope) = (points.value[lane], points.slope[lane]);
            let guess = [expected[lane], curvature[lane]];
            let landing = Landing::new(at, value, slope, guess, rounding);
            points.at[lane] = if landing.is_good { landing.root } else { at[0] };
            open[lane] = if landing.is_good { 0 } else { u64::MAX };
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
    rounding: f64,
    round: usize,
}

impl NullaryFnOnce for Advancing<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        let Self { lanes, n, rounding, round } = self;
        if round < EARLY {
            lanes.advance::<true>(n, rounding)
        } else {
            lanes.advance::<false>(n, rounding)
        }
    }
}

impl Resistant {
    /// Takes a step in each open lane and returns how many lanes stay open.
    ///
    /// Where Newton's step is no good the bracket is halved. In `EARLY` rounds the guess from both
    /// ends of the bracket comes first.
    #[inline(always)]
    fn advance<const EARLY: bool>(&mut self, n: usize, rounding: f64) -> usize {
        let Self { ends: [inner, outer], guesses, step, length, open, .. } = self;
        let Guesses { points, expected, curvature } = guesses;
        let mut still = 0;
        for lane in 0..n.min(BATCH) {
            let (at, value, slope) = (points.at[lane], points.value[lane], points.slope[lane]);
            let bracket = [at, inner.at[lane], outer.at[lane]];
            let guess = [expected[lane], curvature[lane]];
            let landing = Landing::new(bracket, value, slope, guess, rounding);
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

/// Step that settles a root on an edge of that length.
#[inline(always)]
fn tolerance(length: f64, rounding: f64) -> f64 {
    if TOLERANCE * length > rounding { TOLERANCE * length } else { rounding }
}
