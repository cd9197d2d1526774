//! Test support: elementary functions in double-double arithmetic, to about 100 bits.
//!
//! Inverse functions correct the answer of `libm` by one step of Newton's method, which doubles its
//! digits.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// An unevaluated sum of two numbers, the second below half an ulp of the first.
#[derive(Clone, Copy, Debug)]
pub struct Double {
    pub hi: f64,
    pub lo: f64,
}

const FRAC_PI_2: [f64; 3] =
    [std::f64::consts::FRAC_PI_2, 6.123233995736766e-17, -1.4973849048591698e-33];
const LN_2: [f64; 3] = [std::f64::consts::LN_2, 2.3190468138462996e-17, 5.707708438416212e-34];

fn two_sum(a: f64, b: f64) -> Double {
    let hi = a + b;
    let part = hi - a;
    Double { hi, lo: (a - (hi - part)) + (b - part) }
}

fn two_product(a: f64, b: f64) -> Double {
    let split = |a: f64| {
        let shifted = 134_217_729.0 * a;
        let high = shifted - (shifted - a);
        (high, a - high)
    };
    let hi = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    Double { hi, lo: ((ah * bh - hi) + ah * bl + al * bh) + al * bl }
}

impl From<f64> for Double {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Neg for Double {
    type Output = Self;
    fn neg(self) -> Self {
        Self { hi: -self.hi, lo: -self.lo }
    }
}

impl Add for Double {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (s, t) = (two_sum(self.hi, other.hi), two_sum(self.lo, other.lo));
        let s = two_sum(s.hi, s.lo + t.hi);
        two_sum(s.hi, s.lo + t.lo)
    }
}

impl Sub for Double {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let p = two_product(self.hi, other.hi);
        two_sum(p.hi, p.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Div for Double {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let a = self.hi / other.hi;
        let rest = self - other * a.into();
        let b = rest.hi / other.hi;
        let rest = rest - other * b.into();
        two_sum(a, b) + (rest.hi / other.hi).into()
    }
}

/// `x - k * (parts)`, the parts falling.
fn less_multiple(x: f64, k: f64, parts: [f64; 3]) -> Double {
    parts.into_iter().fold(x.into(), |rest, part| rest - two_product(k, part))
}

/// Sine and cosine of a moderate `x`.
pub fn sin_cos(x: f64) -> (Double, Double) {
    let k = (x / FRAC_PI_2[0]).round_ties_even();
    let r = less_multiple(x, k, FRAC_PI_2);
    let (mut sine, mut cosine) = (Double::from(0.0), Double::from(0.0));
    // Horner from the term of degree 29 down: 0.79^31 / 31! < 2^-120.
    for n in (0..15).rev() {
        let n = f64::from(n);
        let z = r * r;
        sine = Double::from(1.0) - z * sine / ((2.0 * n + 2.0) * (2.0 * n + 3.0)).into();
        cosine = Double::from(1.0) - z * cosine / ((2.0 * n + 1.0) * (2.0 * n + 2.0)).into();
    }
    sine = r * sine;
    match k.rem_euclid(4.0) as u8 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// The exponential of `x` as a number near one and a power of two.
pub fn exp(x: f64) -> (Double, i32) {
    let k = (x / LN_2[0]).round_ties_even();
    let r = less_multiple(x, k, LN_2);
    let mut sum = Double::from(0.0);
    for n in (1..28).rev() {
        sum = Double::from(1.0) + r * sum / f64::from(n).into();
    }
    (sum, k as i32)
}

/// The logarithm of a positive finite `x`.
pub fn log(x: f64) -> Double {
    let (x, shift) = if x < f64::MIN_POSITIVE { (x * 2f64.powi(54), -54) } else { (x, 0) };
    let mut k = ((x.to_bits() >> 52) as i32) - 1023;
    let mut m = f64::from_bits((x.to_bits() & ((1 << 52) - 1)) | 1.0f64.to_bits());
    if m > 1.5 {
        m *= 0.5;
        k += 1;
    }
    let k = f64::from(k + shift);
    let s = Double::from(m - 1.0) / two_sum(m, 1.0);
    let z = s * s;
    let mut sum = Double::from(0.0);
    for n in (0..26).rev() {
        sum = Double::from(1.0) / f64::from(2 * n + 1).into() + z * sum;
    }
    let fraction = s * sum * 2.0.into();
    LN_2.into_iter().rev().fold(fraction, |sum, part| two_product(k, part) + sum)
}

fn sqrt(a: Double) -> Double {
    let root = Double::from(a.hi.sqrt());
    root + (a - root * root) / (root + root)
}

/// `a` and `b` times `c` less `d`: the sine of a difference of angles.
fn cross(a: Double, b: Double, c: Double, d: Double) -> Double {
    a * b - c * d
}

pub fn tan(x: f64) -> Double {
    let (sine, cosine) = sin_cos(x);
    sine / cosine
}

pub fn asin(x: f64) -> Double {
    let near = libm::asin(x);
    let (sine, cosine) = sin_cos(near);
    cross(x.into(), cosine, leg(x), sine) + near.into()
}

pub fn acos(x: f64) -> Double {
    let near = libm::acos(x);
    let (sine, cosine) = sin_cos(near);
    cross(leg(x), cosine, x.into(), sine) + near.into()
}

/// The square root of `1 - x * x`.
fn leg(x: f64) -> Double {
    sqrt(two_sum(1.0, x) * two_sum(1.0, -x))
}

pub fn atan2(y: f64, x: f64) -> Double {
    let near = libm::atan2(y, x);
    let (sine, cosine) = sin_cos(near);
    cross(y.into(), cosine, x.into(), sine) / hypot(x, y) + near.into()
}

pub fn hypot(x: f64, y: f64) -> Double {
    sqrt(two_product(x, x) + two_product(y, y))
}

pub fn cbrt(x: f64) -> Double {
    let near = Double::from(libm::cbrt(x));
    let square = near * near;
    near + (Double::from(x) - square * near) / (square * 3.0.into())
}

pub fn log10(x: f64) -> Double {
    log(x) / log(10.0)
}

/// The power of a positive base, as a number near one and a power of two.
pub fn pow(x: f64, y: f64) -> (Double, i32) {
    let exponent = log(x) * y.into();
    let (fraction, scale) = exp(exponent.hi);
    (fraction + fraction * exponent.lo.into(), scale)
}

/// Hyperbolic sine and cosine of a moderate `x`.
pub fn sinh_cosh(x: f64) -> (Double, Double) {
    let plain = |x: f64| {
        let (fraction, scale) = exp(x);
        fraction * 2f64.powi(scale).into()
    };
    let (rising, falling, half) = (plain(x), plain(-x), Double::from(0.5));
    let mut sinh = (rising - falling) * half;
    if x.abs() < 0.5 {
        // The difference cancels: x + x³/3! + …, of which the 15th term is below 2^-120.
        let square = two_product(x, x);
        sinh = Double::from(0.0);
        for n in (0..15).rev() {
            let n = f64::from(n);
            sinh = Double::from(1.0) + square * sinh / ((2.0 * n + 2.0) * (2.0 * n + 3.0)).into();
        }
        sinh = sinh * x.into();
    }
    (sinh, (rising + falling) * half)
}

/// The distance of `computed` from `exact * 2^scale` in units of the last place of the latter.
pub fn ulps(computed: f64, exact: Double, scale: i32) -> f64 {
    let exponent = ((exact.hi.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    let ulp = (exponent + scale).max(-1022) - 52 - scale;
    let unscaled = computed * 2f64.powi(-(scale / 2)) * 2f64.powi(-(scale - scale / 2));
    (((unscaled - exact.hi) - exact.lo) / 2f64.powi(ulp)).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest error of `computed` at evenly spread arguments in `[lo, hi]`.
    fn worst(lo: f64, hi: f64, error: impl Fn(f64) -> f64) -> f64 {
        (1..=5_000u64)
            .map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(53))
            .map(|t| error(lo + (hi - lo) * t))
            .fold(0.0, f64::max)
    }

    #[track_caller]
    fn check(lo: f64, hi: f64, computed: fn(f64) -> f64, exact: fn(f64) -> Double) {
        let error = worst(lo, hi, |x| ulps(computed(x), exact(x), 0));
        assert!(error > 0.4 && error < 2.5, "an error of {error} ulp");
    }

    /// Intervals of these functions widen by twice 4 ulp.
    #[test]
    fn functions_of_libm_err_by_less_than_three_ulp() {
        check(-1.0, 1.0, libm::asin, asin);
        check(-1.0, 1.0, libm::acos, acos);
        check(-3.0, 3.0, libm::atan, |x| atan2(x, 1.0));
        check(-1e4, 1e4, libm::atan, |x| atan2(x, 1.0));
        check(-2.0, 2.0, libm::tan, tan);
        check(-1e6, 1e6, libm::tan, tan);
        check(-20.0, 20.0, libm::cbrt, cbrt);
        check(0.0, 3.0, libm::log10, log10);
        check(0.0, 1e9, libm::log10, log10);
        check(-3.0, 3.0, libm::sinh, |x| sinh_cosh(x).0);
        check(-300.0, 300.0, libm::sinh, |x| sinh_cosh(x).0);
        check(-3.0, 3.0, libm::cosh, |x| sinh_cosh(x).1);
        check(-300.0, 300.0, libm::cosh, |x| sinh_cosh(x).1);
        check(-3.0, 3.0, libm::tanh, |x| sinh_cosh(x).0 / sinh_cosh(x).1);
        check(-20.0, 20.0, libm::tanh, |x| sinh_cosh(x).0 / sinh_cosh(x).1);
        for other in [1e-3, 0.3, 2.0, 40.0] {
            let error = worst(-3.0, 3.0, |x| ulps(libm::hypot(x, other), hypot(x, other), 0));
            assert!(error < 2.5, "hypot errs by {error} ulp");
            for x in [other, -other] {
                let error = worst(-3.0, 3.0, |y| ulps(libm::atan2(y, x), atan2(y, x), 0));
                assert!(error < 2.5, "atan2 errs by {error} ulp");
            }
            let error = worst(-90.0, 90.0, |y| {
                let (fraction, scale) = pow(other, y);
                ulps(libm::pow(other, y), fraction, scale)
            });
            assert!(error < 2.5, "pow errs by {error} ulp");
        }
    }
}
