//! Test support: elementary functions in double-double arithmetic, to about 100 bits.

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

/// The distance of `computed` from `exact * 2^scale` in units of the last place of the latter.
pub fn ulps(computed: f64, exact: Double, scale: i32) -> f64 {
    let exponent = ((exact.hi.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    let ulp = (exponent + scale).max(-1022) - 52 - scale;
    let unscaled = computed * 2f64.powi(-(scale / 2)) * 2f64.powi(-(scale - scale / 2));
    (((unscaled - exact.hi) - exact.lo) / 2f64.powi(ulp)).abs()
}
