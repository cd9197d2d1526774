//! Eight enclosures at a time, structure of arrays.
//!
//! The operators that fields are made of are written out over eight lanes for operands that are
//! finite; everything else goes lane by lane through [`enclosure`]. The results are the same.

use crate::expr::enclosure;
use crate::expr::{Binary, Extremum, Unary};
use crate::num::{Interval, lanes};

/// Lanes of an octet.
pub(in crate::eval) const LANES: usize = 8;

/// Eight enclosures.
#[derive(Clone, Copy, Debug)]
pub(in crate::eval) struct Octet {
    lo: [f64; LANES],
    hi: [f64; LANES],
    /// Bit `i` is set where lane `i` may be NaN.
    nan: u8,
}

impl Octet {
    pub(in crate::eval) const ZERO: Self = Self { lo: [0.0; LANES], hi: [0.0; LANES], nan: 0 };

    pub(in crate::eval) fn splat(value: Interval) -> Self {
        Self {
            lo: [value.lo; LANES],
            hi: [value.hi; LANES],
            nan: if value.nan { u8::MAX } else { 0 },
        }
    }

    #[inline(always)]
    pub(in crate::eval) fn lane(&self, i: usize) -> Interval {
        Interval { lo: self.lo[i], hi: self.hi[i], nan: self.nan >> i & 1 == 1 }
    }

    #[inline(always)]
    pub(in crate::eval) fn set_lane(&mut self, i: usize, value: Interval) {
        self.lo[i] = value.lo;
        self.hi[i] = value.hi;
        self.nan = self.nan & !(1 << i) | u8::from(value.nan) << i;
    }

    #[inline(always)]
    pub(in crate::eval) fn from_lanes(lane: impl Fn(usize) -> Interval) -> Self {
        let mut octet = Self::ZERO;
        for i in 0..LANES {
            let value = lane(i);
            octet.lo[i] = value.lo;
            octet.hi[i] = value.hi;
            octet.nan |= u8::from(value.nan) << i;
        }
        octet
    }

    /// The lower ends.
    pub(in crate::eval) const fn lower(&self) -> &[f64; LANES] {
        &self.lo
    }

    /// The upper ends.
    pub(in crate::eval) const fn upper(&self) -> &[f64; LANES] {
        &self.hi
    }

    /// The lanes that may be NaN, as bits.
    pub(in crate::eval) const fn nan(&self) -> u8 {
        self.nan
    }

    /// The largest magnitude in each lane.
    #[inline(always)]
    pub(in crate::eval) fn magnitude(&self) -> [f64; LANES] {
        std::array::from_fn(|i| greater(self.lo[i].abs(), self.hi[i].abs()))
    }

    #[inline(always)]
    fn is_finite(&self) -> bool {
        let mut finite = true;
        for i in 0..LANES {
            finite &= self.lo[i] > f64::NEG_INFINITY && self.hi[i] < f64::INFINITY;
        }
        finite
    }

    #[inline(always)]
    fn ends(&self, f: impl Fn(f64, f64) -> (f64, f64)) -> Self {
        let mut out = *self;
        for i in 0..LANES {
            (out.lo[i], out.hi[i]) = f(self.lo[i], self.hi[i]);
        }
        out
    }

    #[inline(always)]
    fn zip(&self, other: &Self, f: impl Fn(f64, f64, f64, f64) -> (f64, f64)) -> Self {
        let mut out = Self { nan: self.nan | other.nan, ..*self };
        for i in 0..LANES {
            (out.lo[i], out.hi[i]) = f(self.lo[i], self.hi[i], other.lo[i], other.hi[i]);
        }
        out
    }
}

/// Buffers of eight enclosures each.
///
/// Ends lie together, without the bits, so that compiled code finds them.
#[derive(Clone, Debug, Default)]
pub(in crate::eval) struct Octets {
    ends: Vec<[[f64; LANES]; 2]>,
    nans: Vec<u8>,
}

/// Numbers of a buffer of [`Octets`]: the lower ends, then the upper ones.
pub(in crate::eval) const NUMBERS: usize = 2 * LANES;

impl Octets {
    /// So many buffers.
    pub(super) fn new(count: usize) -> Self {
        Self { ends: vec![[[0.0; LANES]; 2]; count], nans: vec![0; count] }
    }

    #[inline(always)]
    pub(super) fn get(&self, buffer: u32) -> Octet {
        let [lo, hi] = self.ends[buffer as usize];
        Octet { lo, hi, nan: self.nans[buffer as usize] }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, buffer: u32, value: &Octet) {
        self.ends[buffer as usize] = [value.lo, value.hi];
        self.nans[buffer as usize] = value.nan;
    }

    /// Whether a lane of the buffer may be NaN.
    #[inline]
    pub(in crate::eval) fn may_be_nan(&self, buffer: u32) -> bool {
        self.nans[buffer as usize] != 0
    }

    /// Sets the ends of all lanes of a buffer, none of them NaN.
    #[inline]
    pub(in crate::eval) fn set_numbers(&mut self, buffer: u32, numbers: &[f64]) {
        let ends = self.ends[buffer as usize].as_flattened_mut();
        ends.copy_from_slice(numbers);
        self.nans[buffer as usize] = 0;
    }

    /// The ends in all buffers, [`NUMBERS`] a buffer.
    #[inline]
    pub(in crate::eval) fn numbers_mut(&mut self) -> &mut [f64] {
        self.ends.as_flattened_mut().as_flattened_mut()
    }
}

#[inline(always)]
fn both_finite(a: &Octet, b: &Octet) -> bool {
    a.is_finite() && b.is_finite()
}

#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Encloses an operator of one operand.
#[inline(always)]
pub(in crate::eval) fn unary(op: Unary, a: &Octet) -> Octet {
    match op {
        Unary::Neg => a.ends(|lo, hi| (-hi, -lo)),
        Unary::Abs => a.ends(|lo, hi| (greater(greater(lo, -hi), 0.0), greater(hi, -lo))),
        Unary::Sqrt if a.lo.iter().all(|lo| *lo >= 0.0) => a.ends(|lo, hi| (lo.sqrt(), hi.sqrt())),
        Unary::Sin => wave(a, lanes::sin, Interval::sin_between),
        Unary::Cos => wave(a, lanes::cos, Interval::cos_between),
        Unary::Sign
        | Unary::Sqrt
        | Unary::Cbrt
        | Unary::Floor
        | Unary::Ceil
        | Unary::Round
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos
        | Unary::Atan
        | Unary::Sinh
        | Unary::Cosh
        | Unary::Tanh
        | Unary::Exp
        | Unary::Log
        | Unary::Log10 => each_unary(op, a),
    }
}

#[inline(never)]
fn each_unary(op: Unary, a: &Octet) -> Octet {
    Octet::from_lanes(|i| enclosure::unary(op, a.lane(i)))
}

/// Encloses a sine or cosine, both ends of all lanes being computed by one call of `function`.
#[inline(always)]
fn wave(
    a: &Octet,
    function: impl Fn(&[f64], &mut [f64]),
    between: impl Fn(Interval, f64, f64) -> Interval,
) -> Octet {
    let (mut ends, mut values) = ([0.0; 2 * LANES], [0.0; 2 * LANES]);
    ends[..LANES].copy_from_slice(&a.lo);
    ends[LANES..].copy_from_slice(&a.hi);
    function(&ends, &mut values);
    Octet::from_lanes(|i| between(a.lane(i), values[i], values[LANES + i]))
}

/// Encloses the product of a value with itself.
#[inline(always)]
pub(in crate::eval) fn square(a: &Octet) -> Octet {
    unary(Unary::Abs, a).ends(|lo, hi| (lo * lo, hi * hi))
}

/// Encloses an operator of two operands.
#[inline(always)]
pub(in crate::eval) fn binary(op: Binary, a: &Octet, b: &Octet) -> Octet {
    match op {
        Binary::Add if both_finite(a, b) => a.zip(b, |al, ah, bl, bh| (al + bl, ah + bh)),
        Binary::Sub if both_finite(a, b) => a.zip(b, |al, ah, bl, bh| (al - bh, ah - bl)),
        Binary::Mul if both_finite(a, b) => a.zip(b, |al, ah, bl, bh| {
            let (p, q, r, s) = (al * bl, al * bh, ah * bl, ah * bh);
            (lesser(lesser(p, q), lesser(r, s)), greater(greater(p, q), greater(r, s)))
        }),
        Binary::Min if a.nan == 0 => {
            Octet { nan: b.nan, ..a.zip(b, |al, ah, bl, bh| (lesser(al, bl), lesser(ah, bh))) }
        }
        Binary::Max if a.nan == 0 => {
            Octet { nan: b.nan, ..a.zip(b, |al, ah, bl, bh| (greater(al, bl), greater(ah, bh))) }
        }
        Binary::Add
        | Binary::Sub
        | Binary::Mul
        | Binary::Div
        | Binary::Min
        | Binary::Max
        | Binary::Mod
        | Binary::Pow
        | Binary::Atan2
        | Binary::Hypot => each_binary(op, a, b),
    }
}

#[inline(never)]
fn each_binary(op: Binary, a: &Octet, b: &Octet) -> Octet {
    Octet::from_lanes(|i| enclosure::binary(op, a.lane(i), b.lane(i)))
}

/// Encloses a pick.
#[inline(never)]
pub(in crate::eval) fn pick(extremum: Extremum, operands: [&Octet; 4]) -> Octet {
    Octet::from_lanes(|i| enclosure::pick(extremum, operands.map(|o| o.lane(i))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::probe::Source;

    fn spicy(source: &mut Source) -> Octet {
        let lanes: Vec<Interval> = (0..LANES)
            .map(|_| {
                let (a, b) = (source.spicy(), source.spicy());
                let near = if source.below(3) == 0 { a } else { b };
                Interval { nan: source.below(4) == 0, ..Interval::new(a.min(near), a.max(near)) }
            })
            .collect();
        Octet::from_lanes(|i| lanes[i])
    }

    #[test]
    fn octets_agree_with_single_enclosures() {
        let mut source = Source(3);
        let finite = |i: Interval| Interval::new(i.lo.max(-1e300), i.hi.min(1e300));
        for round in 0..20_000 {
            let [mut a, mut b] = [(); 2].map(|()| spicy(&mut source));
            if round % 2 == 0 {
                let (c, d) = (a, b);
                a = Octet::from_lanes(|i| finite(c.lane(i)));
                b = Octet::from_lanes(|i| finite(d.lane(i)));
            }
            for op in Binary::ALL {
                let out = binary(op, &a, &b);
                for i in 0..LANES {
                    assert_eq!(out.lane(i), enclosure::binary(op, a.lane(i), b.lane(i)), "{op:?}");
                }
            }
            let (op, squares) = (source.of(&Unary::ALL), square(&a));
            let out = unary(op, &a);
            for i in 0..LANES {
                assert_eq!(out.lane(i), enclosure::unary(op, a.lane(i)), "{op:?}");
                assert_eq!(squares.lane(i), a.lane(i).square());
            }
        }
    }
}
