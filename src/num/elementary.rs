//! Sine, cosine, exponential and logarithm, with the same bits on every host.
//!
//! Each is a fixed sequence of IEEE additions, multiplications and bit operations without
//! branches, tables or fused operations, so that loops over it become vector code
//! ([`lanes`](super::lanes)) and every engine returns its bits. Sine and cosine are written over
//! packs (`num::pack`) of vectors, of which a number is the least.
//!
//! | function | largest error found | where |
//! |---|---|---|
//! | [`sin`], [`cos`] | 1.48 ulp | up to [`REDUCTION_LIMIT`]; beyond, `libm` answers |
//! | [`exp`] | 1.04 ulp | everywhere, subnormal results included |
//! | [`log`] | 0.82 ulp | everywhere, subnormal arguments included |
//!
//! found on four million points a function against double-double arithmetic; a test keeps them
//! below 2 ulp. `sin(-x)` is `-sin(x)` and `cos(-x)` is `cos(x)`, signed zeros included, and
//! neither exceeds 1 in magnitude.
//!
//! Sources: kernels of sine, cosine and logarithm from fdlibm (`k_sin.c`, `k_cos.c`, `e_log.c`);
//! argument reduction after Cody & Waite 1980; the polynomial of the exponential interpolates at
//! Chebyshev nodes.

use super::pack::Pack;
use pulp::{Scalar, Simd};
use std::f64::consts::{FRAC_2_PI, LOG2_E};

/// Largest magnitude at which [`sin`] and [`cos`] use their own argument reduction, 2^20 π/2
/// rounded down.
pub const REDUCTION_LIMIT: f64 = 1_647_099.0;

/// Adding it rounds a number below 2^51 in magnitude to an integer, ties to even, and leaves that
/// integer in the low bits of the sum.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// π/2 in parts of at most 33 bits, so that multiples up to 2^20 of all but the last are exact.
const FRAC_PI_2: [f64; 4] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_711_166_5e-21,
    8.478_427_660_368_9e-32,
];

/// log 2 in two parts; multiples up to 2^20 of the first are exact.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

const MANTISSA: u64 = (1 << 52) - 1;

/// The sine of `x` radians.
#[must_use]
#[inline]
pub fn sin(x: f64) -> f64 {
    if reducible(x) { single(sin_reduced, x) } else { libm::sin(x) }
}

/// The cosine of `x` radians.
#[must_use]
#[inline]
pub fn cos(x: f64) -> f64 {
    if reducible(x) { single(cos_reduced, x) } else { libm::cos(x) }
}

/// What `f` makes of one number.
#[inline(always)]
fn single(f: impl Fn(Pack<Scalar, 1>) -> Pack<Scalar, 1>, x: f64) -> f64 {
    let [value] = f(Pack::new(Scalar::new(), [x])).vectors();
    value
}

/// Whether [`sin_reduced`] and [`cos_reduced`] hold at `x`.
#[inline(always)]
pub(super) fn reducible(x: f64) -> bool {
    x.abs() <= REDUCTION_LIMIT
}

/// The sine of a [`reducible`] `x`; any number otherwise.
#[inline(always)]
pub(super) fn sin_reduced<S: Simd, const N: usize>(x: Pack<S, N>) -> Pack<S, N> {
    Angle::reduce(x.abs()).sin() ^ x.sign()
}

/// The cosine of a [`reducible`] `x`; any number otherwise.
#[inline(always)]
pub(super) fn cos_reduced<S: Simd, const N: usize>(x: Pack<S, N>) -> Pack<S, N> {
    Angle::reduce(x.abs()).cos()
}

/// [`sin_reduced`] and [`cos_reduced`] of `x`.
#[inline(always)]
pub(super) fn sin_cos_reduced<S: Simd, const N: usize>(x: Pack<S, N>) -> [Pack<S, N>; 2] {
    let angle = Angle::reduce(x.abs());
    // The reduction sees |x|, so the sine is odd by construction, at zero too.
    [angle.sin() ^ x.sign(), angle.cos()]
}

/// An angle as a multiple of π/2 and a rest.
#[derive(Clone, Copy)]
struct Angle<S: Simd, const N: usize> {
    /// The multiple in the low bits of words.
    quadrant: Pack<S, N>,
    /// Sine and cosine of the rest.
    sine: Pack<S, N>,
    cosine: Pack<S, N>,
}

impl<S: Simd, const N: usize> Angle<S, N> {
    /// `x` as its nearest multiple of π/2 and a rest.
    ///
    /// Only the second difference loses anything, which `lost` recovers, and the last two round
    /// relative to the rest: where they cancel, all before them were exact. What π/2 lacks beyond
    /// its four parts stays below 2^-136, far below the least rest of a number up to the limit.
    #[inline(always)]
    fn reduce(x: Pack<S, N>) -> Self {
        let quadrant = x * FRAC_2_PI + SHIFT;
        let k = quadrant - SHIFT;
        let [a, b, c, d] = FRAC_PI_2;
        let (near, step) = (x - k * a, k * b);
        let rest = near - step;
        let lost = (near - rest) - step;
        let rest = (rest - (k * c - lost)) - k * d;
        let [sine, cosine] = kernels(rest);
        Self { quadrant, sine, cosine }
    }

    #[inline(always)]
    fn sin(self) -> Pack<S, N> {
        self.quadrant.select(1, self.sine, self.cosine) ^ self.quadrant.sign_by(2)
    }

    #[inline(always)]
    fn cos(self) -> Pack<S, N> {
        let next = self.quadrant.next_bits();
        self.quadrant.select(1, self.cosine, self.sine) ^ next.sign_by(2)
    }
}

/// The polynomial in z with coefficients `c`, `w` being z²: summed in pairs, after Estrin, so that
/// less waits for the step before.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(c: [f64; 6], z: Pack<S, N>, w: Pack<S, N>) -> Pack<S, N> {
    (c[0] + z * c[1]) + w * ((c[2] + z * c[3]) + w * (c[4] + z * c[5]))
}

/// Sine and cosine for |x| up to a little above π/4.
#[inline(always)]
fn kernels<S: Simd, const N: usize>(x: Pack<S, N>) -> [Pack<S, N>; 2] {
    const SINE: [f64; 6] = [
        -1.666_666_666_666_663_2e-1,
        8.333_333_333_322_49e-3,
        -1.984_126_982_985_795e-4,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
    ];
    const COSINE: [f64; 6] = [
        4.166_666_666_666_66e-2,
        -1.388_888_888_887_411e-3,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    let z = x * x;
    let w = z * z;
    let sine = x + (z * x) * polynomial(SINE, z, w);
    // 1 - z/2 rounds; what it loses is added back with the smaller terms.
    let half = 0.5 * z;
    let head = 1.0 - half;
    let cosine = head + (((1.0 - head) - half) + w * polynomial(COSINE, z, w));
    [sine, cosine]
}

/// e to the power of `x`.
#[must_use]
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    /// (e^r - 1 - r) / r² for |r| up to log(2)/2, interpolated; off by 1.6e-17 / r².
    const P: [f64; 10] = [
        0.500_000_000_000_000_1,
        0.166_666_666_666_666_69,
        0.041_666_666_666_624_13,
        0.008_333_333_333_330_062,
        0.001_388_888_891_721_371_7,
        0.000_198_412_698_630_536_18,
        2.480_152_129_595_437_6e-5,
        2.755_726_845_999_706_4e-6,
        2.762_008_844_540_974_6e-7,
        2.510_038_549_551_032e-8,
    ];
    // Beyond these the result is 0 or infinite; the comparisons keep NaN.
    let x = if x < -746.0 { -746.0 } else { x };
    let x = if x > 710.0 { 710.0 } else { x };
    let shifted = x * LOG2_E + SHIFT;
    let k = shifted - SHIFT;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let tail = P[5] + r * (P[6] + r * (P[7] + r * (P[8] + r * P[9])));
    let tail = P[0] + r * (P[1] + r * (P[2] + r * (P[3] + r * (P[4] + r * tail))));
    let fraction = 1.0 + (r + (r * r) * tail);
    // 2^k in two factors, both normal: the first product is exact, so a subnormal result rounds
    // once. The exponent is split while positive, for want of vector shifts of signed words.
    let k = shifted.to_bits().wrapping_sub(SHIFT.to_bits());
    let half = k.wrapping_add(2 * 1023) >> 1;
    let rest = k.wrapping_add(2 * 1023).wrapping_sub(half);
    fraction * f64::from_bits(half << 52) * f64::from_bits(rest << 52)
}

/// The natural logarithm of `x`: minus infinity at both zeros, NaN below.
#[must_use]
#[inline(always)]
pub fn log(x: f64) -> f64 {
    const L: [f64; 7] = [
        6.666_666_666_666_735e-1,
        3.999_999_999_940_942e-1,
        2.857_142_874_366_239e-1,
        2.222_219_843_214_978_4e-1,
        1.818_357_216_161_805e-1,
        1.531_383_769_920_937_3e-1,
        1.479_819_860_511_658_6e-1,
    ];
    const ONE: u64 = 1.0f64.to_bits();
    // The upper word of √½: fractions are brought to [√½, √2).
    const ROOT: u64 = 0x3fe6_a09e << 32;
    // 2^52 + n in its low bits converts a small n without an integer instruction.
    const UNIT: f64 = 4_503_599_627_370_496.0;

    let subnormal = x < f64::MIN_POSITIVE;
    let scaled = if subnormal { x * 18_014_398_509_481_984.0 } else { x };
    let bias = if subnormal { UNIT + (1023.0 + 54.0) } else { UNIT + 1023.0 };
    let bits = scaled.to_bits().wrapping_add(ONE - ROOT);
    let k = f64::from_bits(UNIT.to_bits() | (bits >> 52)) - bias;
    let fraction = f64::from_bits((bits & MANTISSA).wrapping_add(ROOT));

    let f = fraction - 1.0;
    let half = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let odd = z * (L[0] + w * (L[2] + w * (L[4] + w * L[6])));
    let even = w * (L[1] + w * (L[3] + w * L[5]));
    let value = s * (half + (odd + even)) + k * LN_2[1] - half + f + k * LN_2[0];

    let pole = if x == 0.0 { f64::NEG_INFINITY } else { f64::NAN };
    // Plus infinity and NaN are their own logarithms.
    let special = if x <= 0.0 { pole } else { x };
    if x > 0.0 && x < f64::INFINITY { value } else { special }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::exact::{self, ulps};

    /// Points of a deterministic sequence that fills the unit interval evenly.
    fn fill(points: u64) -> impl Iterator<Item = f64> {
        (1..=points).map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(53))
    }

    /// The errors of sine, cosine, exponential and logarithm at `points` arguments each.
    fn worst(points: u64) -> [f64; 4] {
        let mut worst = [0.0f64; 4];
        let mut note = |which: usize, error: f64| worst[which] = worst[which].max(error);
        let mut angle = |x: f64| {
            let (sine, cosine) = exact::sin_cos(x);
            note(0, ulps(sin(x), sine, 0));
            note(1, ulps(cos(x), cosine, 0));
        };
        for (i, t) in fill(points).enumerate() {
            angle(match i % 8 {
                0 => REDUCTION_LIMIT * t,
                1 => 1000.0 * t,
                // Next to a multiple of π/2, where most digits cancel.
                2 => {
                    let near = (t * f64::from(1 << 20)).floor() * std::f64::consts::FRAC_PI_2;
                    f64::from_bits(near.to_bits() + (i as u64 / 8) % 3)
                }
                3 => 2f64.powf(-60.0 * t),
                _ => 7.0 * t,
            });
        }
        for (i, t) in fill(points).enumerate() {
            let x = if i % 2 == 0 { -745.13 + (709.78 + 745.13) * t } else { 2.0 * t - 1.0 };
            let (fraction, scale) = exact::exp(x);
            note(2, ulps(exp(x), fraction, scale));
        }
        for (i, t) in fill(points).enumerate() {
            let x = match i % 4 {
                0 => f64::from_bits((t * f64::INFINITY.to_bits() as f64) as u64),
                1 => f64::from_bits((t * f64::MIN_POSITIVE.to_bits() as f64) as u64 + 1),
                _ => 0.5 + 2.0 * t,
            };
            note(3, ulps(log(x), exact::log(x), 0));
        }
        worst
    }

    #[test]
    fn errors_stay_below_two_ulp() {
        for (name, error) in ["sin", "cos", "exp", "log"].iter().zip(worst(100_000)) {
            assert!(error > 0.4 && error <= 2.0, "{name} errs by {error} ulp");
        }
    }

    #[test]
    #[ignore = "half a minute: finds the figures of the table above"]
    fn errors_are_those_in_the_documentation() {
        assert_eq!(worst(4_000_000).map(|e| (e * 100.0).ceil() / 100.0), [1.46, 1.48, 1.04, 0.82]);
    }

    #[test]
    fn sine_is_odd_and_cosine_even_to_the_bit() {
        let angles = [0.0, 1e-310, 5e-324, 0.5, 1.0, 3.0, 1e5, 1e6, 1e7, 1e300];
        for x in fill(100_000).map(|t| 2e6 * t).chain(angles) {
            assert_eq!(sin(-x).to_bits(), (-sin(x)).to_bits());
            assert_eq!(cos(-x).to_bits(), cos(x).to_bits());
        }
    }

    #[test]
    fn neither_sine_nor_cosine_exceeds_one() {
        for k in 0..200_000 {
            let x = f64::from(k) * std::f64::consts::FRAC_PI_2;
            for x in [x, x.next_up(), x.next_down(), x + 1e-9, x - 1e-8] {
                assert!(sin(x).abs() <= 1.0 && cos(x).abs() <= 1.0, "at {x}");
            }
        }
        for x in fill(100_000).map(|t| 1e-7 * t) {
            assert!(cos(x) <= 1.0, "at {x}");
        }
    }

    fn check(f: impl Fn(f64) -> f64, x: f64, expected: f64) {
        let value = f(x);
        let equal = value.to_bits() == expected.to_bits() || value.is_nan() && expected.is_nan();
        assert!(equal, "{value} at {x}, not {expected}");
    }

    #[test]
    fn exceptional_angles_have_the_values_of_ieee() {
        for f in [sin, cos] {
            check(f, f64::INFINITY, f64::NAN);
            check(f, f64::NEG_INFINITY, f64::NAN);
            check(f, f64::NAN, f64::NAN);
        }
        check(sin, 0.0, 0.0);
        check(sin, -0.0, -0.0);
        check(sin, -5e-324, -5e-324);
        check(cos, 0.0, 1.0);
        check(sin, 1e22, libm::sin(1e22));
        check(cos, REDUCTION_LIMIT.next_up(), libm::cos(REDUCTION_LIMIT.next_up()));
    }

    #[test]
    fn exponentials_overflow_underflow_and_round_subnormals() {
        check(exp, 0.0, 1.0);
        check(exp, -0.0, 1.0);
        check(exp, f64::INFINITY, f64::INFINITY);
        check(exp, f64::NEG_INFINITY, 0.0);
        check(exp, f64::NAN, f64::NAN);
        // The last arguments before overflow and before zero: log(MAX) and log(2^-1075).
        check(exp, 709.782_712_893_384, 1.797_693_134_862_273_2e308);
        check(exp, 709.782_712_893_384_1, f64::INFINITY);
        check(exp, -745.133_219_101_941_1, 5e-324);
        check(exp, -745.133_219_101_941_2, 0.0);
        check(exp, -708.5, libm::exp(-708.5));
        check(exp, f64::MAX, f64::INFINITY);
        check(exp, f64::MIN, 0.0);
    }

    #[test]
    fn logarithms_have_a_pole_a_domain_and_subnormals() {
        check(log, 1.0, 0.0);
        check(log, 0.0, f64::NEG_INFINITY);
        check(log, -0.0, f64::NEG_INFINITY);
        check(log, -1.0, f64::NAN);
        check(log, -5e-324, f64::NAN);
        check(log, f64::NEG_INFINITY, f64::NAN);
        check(log, f64::NAN, f64::NAN);
        check(log, f64::INFINITY, f64::INFINITY);
        check(log, 5e-324, -744.440_071_921_381_2);
        check(log, f64::MAX, 709.782_712_893_384);
    }
}
