//! Where the root on an edge is thought to be, and whether a step ends there.
//!
//! A [`Guess`] is made of values and slopes at both ends of a bracket; a [`Landing`] is the step from
//! a point near the root, which may be the last if what the guess said of that point was right.
//! Both are written without branches, so that loops over them become vector code.

/// Step, in edge lengths, below which a root is settled once the step is taken.
const TOLERANCE: f64 = 1e-13;

/// Step, in edge lengths, that may be the last: its cube is below rounding.
const LAST_STEP: f64 = 2e-5;

/// Half of the change of the second derivative that goes with a change of the slope, both over the
/// slope and in edge lengths, at most: the cubic that misses the field's slope by some part of it is
/// believed to miss the curvature by no more than so many such parts.
const MISSED: f64 = 16.0;

/// Part of the curvature that is not believed in any case, of a field that is smooth between kinks.
pub(super) const DOUBTED: f64 = 0.01;

/// The same of a field that may be linear there, as the distance to a mesh is: slopes at the ends of an edge are
/// those of other faces. None of it is believed, and what it may bend the last step by is a small part of the tolerance,
/// because a step that is bent for nothing misses by as much each time that a mesh is read back and contoured again.
pub(super) const DOUBTED_ON_FACES: f64 = 16.0;

/// An edge is bent where the slope at an end differs from the average slope by more than this part
/// of that.
const BENT: f64 = 0.5;

/// Where a tangent led beyond a bend, the next guess keeps this part of the bracket away from there.
const ASTRAY: f64 = 0.125;

/// Where a root is thought to be on a bracket, inside at 0 and outside at 1.
#[derive(Clone, Copy)]
pub(super) struct Guess {
    /// The place; anything if it is not between 0 and 1.
    pub(super) at: f64,
    /// The slope there, by the length of the bracket.
    pub(super) slope: f64,
    /// Half the second derivative over the slope there.
    pub(super) curvature: f64,
    /// Whether the root is thought to be elsewhere, but should be looked for from here.
    pub(super) is_detour: bool,
}

/// An end of a bracket that has just been moved to where it is.
#[derive(Clone, Copy)]
pub(super) struct Moved {
    /// Whether it is the end inside.
    pub(super) is_inner: bool,
    /// Half the second derivative over the slope, by the length of the bracket.
    pub(super) curvature: f64,
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
    pub(super) fn new(f: [f64; 2], m: [f64; 2], moved: Option<Moved>) -> Self {
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
pub(super) struct Landing {
    pub(super) root: f64,
    pub(super) is_good: bool,
}

impl Landing {
    /// The step from a point `at` with that value and slope between the ends of a bracket of which
    /// a guess has been made.
    ///
    /// A step u, in brackets, taken where the curvature is c, ends at u - c u², which c's error
    /// times u² separates from the root, the part `doubted` of c at least. Terms of third order are below rounding where u is at most
    /// [`LAST_STEP`].
    #[inline(always)]
    pub(super) fn new(
        at: [f64; 3],
        value: f64,
        slope: f64,
        guess: [f64; 2],
        doubted: f64,
        rounding: f64,
    ) -> Self {
        let ([at, inner, outer], [expected, curvature]) = (at, guess);
        let span = outer - inner;
        let steep = slope * span;
        let u = -value / steep;
        let root = at + span * (u - curvature * (u * u));
        let between = (root - inner) * (root - outer) <= 0.0;
        let finite = slope.abs() < f64::INFINITY;
        let tolerance = tolerance(span.abs(), rounding);
        let doubt = MISSED * (steep - expected).abs() + doubted * (curvature * steep).abs();
        let is_small = u.abs() <= LAST_STEP;
        let ends_there = is_small & (doubt * (u * u) * span.abs() <= tolerance * steep.abs());
        let is_nothing = (u * span).abs() <= tolerance;
        Self { root, is_good: between & finite & (is_nothing | ends_there) }
    }
}

/// Step that settles a root on an edge of that length.
#[inline(always)]
pub(super) fn tolerance(length: f64, rounding: f64) -> f64 {
    if TOLERANCE * length > rounding { TOLERANCE * length } else { rounding }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The guess on the unit bracket for a field and its derivative.
    fn guess(f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> Guess {
        Guess::new([f(0.0), f(1.0)], [slope(0.0), slope(1.0)], None)
    }

    #[test]
    fn a_cubic_has_its_root_slope_and_curvature_guessed() {
        for root in [0.02, 0.3, 0.5, 0.91] {
            let f = |t: f64| (t - root) * (1.0 + 0.1 * (t - root) + 0.02 * (t - root).powi(2));
            let slope = |t: f64| 1.0 + 0.2 * (t - root) + 0.06 * (t - root).powi(2);
            let guess = guess(f, slope);
            assert!((guess.at - root).abs() < 1e-5, "{root}: {}", guess.at);
            assert!((guess.slope - slope(guess.at)).abs() < 1e-5);
            let curvature = (0.1 + 0.06 * (guess.at - root)) / slope(guess.at);
            assert!((guess.curvature - curvature).abs() < 1e-3);
        }
    }

    #[test]
    fn a_kink_of_two_planes_is_guessed_exactly() {
        let (a, b) = (|t: f64| 0.25 * (t - 0.75), |t: f64| 2.0 * (t - 0.6));
        let greater = guess(|t| a(t).max(b(t)), |t| if a(t) > b(t) { 0.25 } else { 2.0 });
        assert!((greater.at - 0.6).abs() < 1e-15);
        let (a, b) = (|t: f64| 2.0 * (t - 0.2), |t: f64| 0.25 * (t - 0.4));
        let lesser = guess(|t| a(t).min(b(t)), |t| if a(t) < b(t) { 2.0 } else { 0.25 });
        assert!((lesser.at - 0.4).abs() < 1e-15);
    }

    #[test]
    fn an_end_that_was_led_to_is_kept_off() {
        // Flat inside, and the tangent from outside leads to the very end.
        let moved = Moved { is_inner: true, curvature: 0.0 };
        let guess = Guess::new([-1e-9, 1.0], [0.0, 1.0], Some(moved));
        assert!(guess.is_detour && guess.at == ASTRAY);
        let moved = Moved { is_inner: false, curvature: 0.0 };
        let guess = Guess::new([-1e-9, 1.0], [0.0, 2.0], Some(moved));
        assert!(!guess.is_detour && guess.at == 0.5);
    }

    #[test]
    fn a_landing_is_good_to_rounding_or_refused() {
        let f = |t: f64| (6.0 * (t - 0.4)).sin() / 6.0;
        for off in [1e-12_f64, 1e-9, 1e-6, 1e-5, 1e-4, 1e-2] {
            let at = 0.4 + off;
            let slope = (6.0 * (at - 0.4)).cos();
            let curvature = -18.0 * f(at) / slope;
            let landing = Landing::new(
                [at, 0.0, 1.0],
                f(at),
                slope,
                [slope, curvature],
                DOUBTED,
                f64::EPSILON,
            );
            assert!(!landing.is_good || (landing.root - 0.4).abs() < 2e-13, "{off}");
            assert_eq!(landing.is_good, off < LAST_STEP, "{off}");
            // A slope that was not foretold is that of another branch.
            let foretold = [0.5 * slope, curvature];
            let landing =
                Landing::new([at, 0.0, 1.0], f(at), slope, foretold, DOUBTED, f64::EPSILON);
            assert_eq!(landing.is_good, off < 1e-7, "{off}");
        }
    }

    #[test]
    fn a_landing_on_a_face_is_not_bent() {
        // The slope is that of the guess by chance, whose cubic is bent.
        let land = |off: f64, doubted| {
            let (at, guess) = ([0.4 + off, 0.0, 1.0], [0.5, 2.0]);
            Landing::new(at, 0.5 * off, 0.5, guess, doubted, f64::EPSILON)
        };
        for off in [1e-12_f64, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5] {
            let landing = land(off, DOUBTED_ON_FACES);
            assert_eq!(landing.is_good, off < 5e-8, "{off}");
            assert!(!landing.is_good || (landing.root - 0.4).abs() < 4e-16, "{off}");
        }
        let bent = land(1e-6, DOUBTED);
        assert!(bent.is_good && (bent.root - 0.4).abs() > 1e-12, "{}", bent.root);
    }

    #[test]
    fn nothing_lands_on_a_plateau_or_a_jump() {
        for (value, slope) in [(0.0, 0.0), (0.0, f64::NAN), (-1.0, 0.0), (1.0, f64::INFINITY)] {
            let landing =
                Landing::new([0.5, 0.0, 1.0], value, slope, [1.0, 0.0], DOUBTED, f64::EPSILON);
            assert!(!landing.is_good, "{value} {slope}");
        }
    }
}
