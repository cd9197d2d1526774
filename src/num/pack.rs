//! Several vectors of numbers that go through a formula side by side.
//!
//! A formula over a [`Pack`] reads like one over numbers and is compiled for the vectors of the
//! host ([`lanes`](super::lanes)), or for plain numbers, with the same bits: it has the operations
//! and nothing else, and none is fused. The vectors of a pack are independent, so that the steps of
//! one fill the pauses that the steps of another, each waiting for the last, leave.

use pulp::Simd;
use std::ops::{Add, BitXor, Mul, Sub};

/// `N` vectors of the instruction set `S`.
#[derive(Clone, Copy)]
pub(super) struct Pack<S: Simd, const N: usize> {
    simd: S,
    vectors: [S::f64s; N],
}

impl<S: Simd, const N: usize> Pack<S, N> {
    /// The given vectors.
    #[inline(always)]
    pub(super) fn new(simd: S, vectors: [S::f64s; N]) -> Self {
        Self { simd, vectors }
    }

    /// The vectors.
    #[inline(always)]
    pub(super) fn vectors(self) -> [S::f64s; N] {
        self.vectors
    }

    /// `value` in every lane.
    #[inline(always)]
    fn splat(simd: S, value: f64) -> Self {
        Self { simd, vectors: [simd.splat_f64s(value); N] }
    }

    /// The magnitudes.
    #[inline(always)]
    pub(super) fn abs(mut self) -> Self {
        for a in &mut self.vectors {
            *a = self.simd.abs_f64s(*a);
        }
        self
    }

    /// Minus zero where the sign is set, else zero.
    #[inline(always)]
    pub(super) fn sign(mut self) -> Self {
        let sign = self.simd.splat_f64s(-0.0);
        for a in &mut self.vectors {
            *a = self.simd.and_f64s(*a, sign);
        }
        self
    }

    /// In each lane the one of the two that `bit` of this lane's bits selects: the first if it is
    /// clear, the second if it is set.
    #[inline(always)]
    pub(super) fn select(self, bit: u64, clear: Self, set: Self) -> Self {
        let simd = self.simd;
        let (bit, none) = (simd.splat_u64s(bit), simd.splat_u64s(0));
        let mut chosen = clear;
        for i in 0..N {
            let bits = simd.and_u64s(simd.transmute_u64s_f64s(self.vectors[i]), bit);
            let is_clear = simd.equal_u64s(bits, none);
            chosen.vectors[i] = simd.select_f64s(is_clear, clear.vectors[i], set.vectors[i]);
        }
        chosen
    }

    /// Minus zero where `bit` of a lane's bits is set, else zero.
    #[inline(always)]
    pub(super) fn sign_by(self, bit: u64) -> Self {
        let [plus, minus] = [0.0, -0.0].map(
            #[inline(always)]
            |zero| Self::splat(self.simd, zero),
        );
        self.select(bit, plus, minus)
    }

    /// The number one unit in the last place further on in the order of bits.
    #[inline(always)]
    pub(super) fn next_bits(mut self) -> Self {
        let simd = self.simd;
        let one = simd.splat_u64s(1);
        for a in &mut self.vectors {
            *a = simd.transmute_f64s_u64s(simd.add_u64s(simd.transmute_u64s_f64s(*a), one));
        }
        self
    }
}

/// An operator of packs, and of packs and numbers.
macro_rules! operator {
    ($operator:ident, $name:ident, $function:ident) => {
        impl<S: Simd, const N: usize> $operator for Pack<S, N> {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, b: Self) -> Self {
                for (a, b) in self.vectors.iter_mut().zip(b.vectors) {
                    *a = self.simd.$function(*a, b);
                }
                self
            }
        }

        impl<S: Simd, const N: usize> $operator<f64> for Pack<S, N> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, b: f64) -> Self {
                self.$name(Self::splat(self.simd, b))
            }
        }

        impl<S: Simd, const N: usize> $operator<Pack<S, N>> for f64 {
            type Output = Pack<S, N>;

            #[inline(always)]
            fn $name(self, b: Pack<S, N>) -> Pack<S, N> {
                Pack::splat(b.simd, self).$name(b)
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(BitXor, bitxor, xor_f64s);
