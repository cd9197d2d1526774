//! One operator over rows of sixteen lanes.
//!
//! The values of a plane of a brick, of a batch of edges or of a run of points lie in rows of
//! sixteen. An operand may be the same in every row, or the same in every lane of a row, without
//! being written out: its [`View`] says how to step through it. Everything here is inlined into
//! the caller, so that it compiles to the instructions that the caller has chosen.

use crate::expr::{Binary, Extremum, Unary};
use crate::num::lanes as wide;

/// Lanes of a row.
pub(super) const ROW: usize = 16;

/// A row or rows of values.
#[derive(Clone, Copy, Debug)]
pub(super) enum View<'a> {
    /// Row `y` is `values[y * stride..][..16]`.
    Rows { values: &'a [f64], stride: usize },
    /// Row `y` is sixteen times `values[y * stride]`.
    Splat { values: &'a [f64], stride: usize },
}

impl<'a> View<'a> {
    /// One value everywhere.
    pub(super) fn scalar(value: &'a f64) -> Self {
        Self::Splat { values: std::slice::from_ref(value), stride: 0 }
    }

    /// Writes the first values, in order, to `out`.
    #[inline(always)]
    pub(super) fn copy_to(self, out: &mut [f64]) {
        match self {
            Self::Rows { values, stride: ROW } => out.copy_from_slice(&values[..out.len()]),
            Self::Rows { values, stride } => {
                for (y, out) in out.chunks_mut(ROW).enumerate() {
                    out.copy_from_slice(&values[y * stride..][..out.len()]);
                }
            }
            Self::Splat { values, stride } => {
                for (y, out) in out.chunks_mut(ROW).enumerate() {
                    out.fill(values[y * stride]);
                }
            }
        }
    }
}

#[inline(always)]
fn row(values: &[f64], start: usize) -> &[f64; ROW] {
    values[start..].first_chunk().expect("a view covers the rows that are asked for")
}

/// `out = f(a)` lane by lane; the length of `out` is a multiple of sixteen.
#[inline(always)]
fn map(a: View<'_>, out: &mut [f64], f: impl Fn(f64) -> f64) {
    let (rows, _) = out.as_chunks_mut::<ROW>();
    match a {
        View::Rows { values, stride } => {
            for (y, out) in rows.iter_mut().enumerate() {
                let a = row(values, y * stride);
                for i in 0..ROW {
                    out[i] = f(a[i]);
                }
            }
        }
        View::Splat { values, stride } => {
            for (y, out) in rows.iter_mut().enumerate() {
                *out = [f(values[y * stride]); ROW];
            }
        }
    }
}

/// `out = f(a, b)` lane by lane; the length of `out` is a multiple of sixteen.
#[inline(always)]
fn zip(a: View<'_>, b: View<'_>, out: &mut [f64], f: impl Fn(f64, f64) -> f64) {
    let (rows, _) = out.as_chunks_mut::<ROW>();
    match (a, b) {
        (View::Rows { values: a, stride: s }, View::Rows { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                let (a, b) = (row(a, y * s), row(b, y * t));
                for i in 0..ROW {
                    out[i] = f(a[i], b[i]);
                }
            }
        }
        (View::Rows { values: a, stride: s }, View::Splat { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                let (a, b) = (row(a, y * s), b[y * t]);
                for i in 0..ROW {
                    out[i] = f(a[i], b);
                }
            }
        }
        (View::Splat { values: a, stride: s }, View::Rows { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                let (a, b) = (a[y * s], row(b, y * t));
                for i in 0..ROW {
                    out[i] = f(a, b[i]);
                }
            }
        }
        (View::Splat { values: a, stride: s }, View::Splat { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                *out = [f(a[y * s], b[y * t]); ROW];
            }
        }
    }
}

/// An operator applied to every lane.
#[inline(always)]
pub(super) fn unary(op: Unary, a: View<'_>, out: &mut [f64]) {
    match op {
        Unary::Neg => map(a, out, |a| -a),
        Unary::Abs => map(a, out, f64::abs),
        Unary::Sign => map(a, out, |a| Unary::Sign.apply(a)),
        Unary::Sqrt => map(a, out, f64::sqrt),
        Unary::Floor => map(a, out, f64::floor),
        Unary::Ceil => map(a, out, f64::ceil),
        Unary::Round => map(a, out, f64::round_ties_even),
        Unary::Sin
        | Unary::Cos
        | Unary::Exp
        | Unary::Log
        | Unary::Cbrt
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos
        | Unary::Atan
        | Unary::Sinh
        | Unary::Cosh
        | Unary::Tanh
        | Unary::Log10 => function(op, a, out),
    }
}

/// A function of code of its own.
#[inline(never)]
fn function(op: Unary, a: View<'_>, out: &mut [f64]) {
    let mut copy = [0.0; 256];
    let x = match a {
        View::Rows { values, stride } if stride == ROW || out.len() <= ROW => &values[..out.len()],
        View::Rows { .. } | View::Splat { .. } => {
            a.copy_to(&mut copy[..out.len()]);
            &copy[..out.len()]
        }
    };
    match op {
        Unary::Sin => wide::sin(x, out),
        Unary::Cos => wide::cos(x, out),
        Unary::Exp => wide::exp(x, out),
        Unary::Log => wide::log(x, out),
        Unary::Neg
        | Unary::Abs
        | Unary::Sign
        | Unary::Sqrt
        | Unary::Floor
        | Unary::Ceil
        | Unary::Round
        | Unary::Cbrt
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos
        | Unary::Atan
        | Unary::Sinh
        | Unary::Cosh
        | Unary::Tanh
        | Unary::Log10 => wide::map(|x| op.apply(x), x, out),
    }
}

/// An operator applied to every pair of lanes.
#[inline(always)]
pub(super) fn binary(op: Binary, a: View<'_>, b: View<'_>, out: &mut [f64]) {
    match op {
        Binary::Add => zip(a, b, out, |a, b| a + b),
        Binary::Sub => zip(a, b, out, |a, b| a - b),
        Binary::Mul => zip(a, b, out, |a, b| a * b),
        Binary::Div => zip(a, b, out, |a, b| a / b),
        Binary::Min => zip(a, b, out, |a, b| if a < b { a } else { b }),
        Binary::Max => zip(a, b, out, |a, b| if b < a { a } else { b }),
        Binary::Mod => zip(a, b, out, |a, b| Binary::Mod.apply(a, b)),
        Binary::Pow | Binary::Atan2 | Binary::Hypot => {
            zip(a, b, out, |a, b| pair_function(op, a, b));
        }
    }
}

#[inline(never)]
fn pair_function(op: Binary, a: f64, b: f64) -> f64 {
    op.apply(a, b)
}

/// `c` where the extremum of `a` and `b` takes `a`, else `d`.
#[inline(always)]
pub(super) fn pick(extremum: Extremum, [a, b, c, d]: [View<'_>; 4], out: &mut [f64]) {
    let mut rows = [[0.0; ROW]; 3];
    for (y, out) in out.as_chunks_mut::<ROW>().0.iter_mut().enumerate() {
        for (row, view) in rows.iter_mut().zip([a, b, c]) {
            load(view, y, row);
        }
        load(d, y, out);
        let [a, b, c] = &rows;
        match extremum {
            Extremum::Min => {
                for i in 0..ROW {
                    out[i] = if a[i] < b[i] { c[i] } else { out[i] };
                }
            }
            Extremum::Max => {
                for i in 0..ROW {
                    out[i] = if b[i] < a[i] { c[i] } else { out[i] };
                }
            }
        }
    }
}

#[inline(always)]
fn load(view: View<'_>, y: usize, out: &mut [f64; ROW]) {
    match view {
        View::Rows { values, stride } => *out = *row(values, y * stride),
        View::Splat { values, stride } => *out = [values[y * stride]; ROW],
    }
}
