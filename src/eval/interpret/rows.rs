//! One operator over rows of lanes.
//!
//! The values of a plane of a brick, of a batch of edges or of a run of points lie in rows of
//! sixteen; a block's lie in rows of another length, `W` below. An operand may be the same in every
//! row, or the same in every lane of a row, without being written out: its [`View`] says how to step
//! through it. Everything here is inlined into the caller, so that it compiles to the instructions
//! that the caller has chosen.

use crate::expr::{Binary, Extremum, Unary};
use crate::num::lanes as wide;

/// Lanes of a row where nothing else is said.
pub(in crate::eval) const ROW: usize = 16;
/// Lanes that one call may have, at most.
const MOST: usize = 512;

/// A row or rows of values.
#[derive(Clone, Copy, Debug)]
pub(in crate::eval) enum View<'a> {
    /// Row `y` is `values[y * stride..][..W]`.
    Rows { values: &'a [f64], stride: usize },
    /// Row `y` is `W` times `values[y * stride]`.
    Splat { values: &'a [f64], stride: usize },
}

impl<'a> View<'a> {
    /// One value everywhere.
    pub(in crate::eval) fn scalar(value: &'a f64) -> Self {
        Self::Splat { values: std::slice::from_ref(value), stride: 0 }
    }

    /// Writes the first values, in order, to `out`.
    #[inline(always)]
    pub(in crate::eval) fn copy_to(self, out: &mut [f64]) {
        self.copy_rows_to::<ROW>(out);
    }

    /// Writes the first values, in order, to `out`, rows having `W` lanes.
    #[inline(always)]
    pub(in crate::eval) fn copy_rows_to<const W: usize>(self, out: &mut [f64]) {
        match self {
            Self::Rows { values, stride } if stride == W => {
                out.copy_from_slice(&values[..out.len()]);
            }
            Self::Rows { values, stride } => {
                for (y, out) in out.chunks_mut(W).enumerate() {
                    out.copy_from_slice(&values[y * stride..][..out.len()]);
                }
            }
            Self::Splat { values, stride } => {
                for (y, out) in out.chunks_mut(W).enumerate() {
                    out.fill(values[y * stride]);
                }
            }
        }
    }
}

#[inline(always)]
fn row<const W: usize>(values: &[f64], start: usize) -> &[f64; W] {
    values[start..].first_chunk().expect("a view covers the rows that are asked for")
}

/// `out = f(a)` lane by lane; the length of `out` is a multiple of `W`.
#[inline(always)]
fn map<const W: usize>(a: View<'_>, out: &mut [f64], f: impl Fn(f64) -> f64) {
    let (rows, _) = out.as_chunks_mut::<W>();
    match a {
        View::Rows { values, stride } => {
            for (y, out) in rows.iter_mut().enumerate() {
                let a = row::<W>(values, y * stride);
                for i in 0..W {
                    out[i] = f(a[i]);
                }
            }
        }
        View::Splat { values, stride } => {
            for (y, out) in rows.iter_mut().enumerate() {
                *out = [f(values[y * stride]); W];
            }
        }
    }
}

/// `out = f(a, b)` lane by lane; the length of `out` is a multiple of `W`.
#[inline(always)]
fn zip<const W: usize>(a: View<'_>, b: View<'_>, out: &mut [f64], f: impl Fn(f64, f64) -> f64) {
    let (rows, _) = out.as_chunks_mut::<W>();
    match (a, b) {
        (View::Rows { values: a, stride: s }, View::Rows { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                let (a, b) = (row::<W>(a, y * s), row::<W>(b, y * t));
                for i in 0..W {
                    out[i] = f(a[i], b[i]);
                }
            }
        }
        (View::Rows { values: a, stride: s }, View::Splat { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                let (a, b) = (row::<W>(a, y * s), b[y * t]);
                for i in 0..W {
                    out[i] = f(a[i], b);
                }
            }
        }
        (View::Splat { values: a, stride: s }, View::Rows { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                let (a, b) = (a[y * s], row::<W>(b, y * t));
                for i in 0..W {
                    out[i] = f(a, b[i]);
                }
            }
        }
        (View::Splat { values: a, stride: s }, View::Splat { values: b, stride: t }) => {
            for (y, out) in rows.iter_mut().enumerate() {
                *out = [f(a[y * s], b[y * t]); W];
            }
        }
    }
}

/// An operator applied to every lane.
#[inline(always)]
pub(in crate::eval) fn unary<const W: usize>(op: Unary, a: View<'_>, out: &mut [f64]) {
    match op {
        Unary::Neg => map::<W>(a, out, |a| -a),
        Unary::Abs => map::<W>(a, out, f64::abs),
        Unary::Sign => map::<W>(a, out, |a| Unary::Sign.apply(a)),
        Unary::Sqrt => map::<W>(a, out, f64::sqrt),
        Unary::Floor => map::<W>(a, out, f64::floor),
        Unary::Ceil => map::<W>(a, out, f64::ceil),
        Unary::Round => map::<W>(a, out, f64::round_ties_even),
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
        | Unary::Log10 => function::<W>(op, a, out),
    }
}

/// A function of code of its own.
#[inline(never)]
fn function<const W: usize>(op: Unary, a: View<'_>, out: &mut [f64]) {
    let mut copy = [0.0; MOST];
    let x = match a {
        View::Rows { values, stride } if stride == W || out.len() <= W => &values[..out.len()],
        View::Rows { .. } | View::Splat { .. } => {
            a.copy_rows_to::<W>(&mut copy[..out.len()]);
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
pub(in crate::eval) fn binary<const W: usize>(
    op: Binary,
    a: View<'_>,
    b: View<'_>,
    out: &mut [f64],
) {
    match op {
        Binary::Add => zip::<W>(a, b, out, |a, b| a + b),
        Binary::Sub => zip::<W>(a, b, out, |a, b| a - b),
        Binary::Mul => zip::<W>(a, b, out, |a, b| a * b),
        Binary::Div => zip::<W>(a, b, out, |a, b| a / b),
        Binary::Min => zip::<W>(a, b, out, |a, b| if a < b { a } else { b }),
        Binary::Max => zip::<W>(a, b, out, |a, b| if b < a { a } else { b }),
        Binary::Mod => zip::<W>(a, b, out, |a, b| Binary::Mod.apply(a, b)),
        Binary::Pow | Binary::Atan2 | Binary::Hypot => {
            zip::<W>(a, b, out, |a, b| pair_function(op, a, b));
        }
    }
}

#[inline(never)]
fn pair_function(op: Binary, a: f64, b: f64) -> f64 {
    op.apply(a, b)
}

/// `c` where the extremum of `a` and `b` takes `a`, else `d`.
#[inline(always)]
pub(in crate::eval) fn pick<const W: usize>(
    extremum: Extremum,
    [a, b, c, d]: [View<'_>; 4],
    out: &mut [f64],
) {
    let mut rows = [[0.0; W]; 3];
    for (y, out) in out.as_chunks_mut::<W>().0.iter_mut().enumerate() {
        for (row, view) in rows.iter_mut().zip([a, b, c]) {
            load(view, y, row);
        }
        load(d, y, out);
        let [a, b, c] = &rows;
        match extremum {
            Extremum::Min => {
                for i in 0..W {
                    out[i] = if a[i] < b[i] { c[i] } else { out[i] };
                }
            }
            Extremum::Max => {
                for i in 0..W {
                    out[i] = if b[i] < a[i] { c[i] } else { out[i] };
                }
            }
        }
    }
}

#[inline(always)]
fn load<const W: usize>(view: View<'_>, y: usize, out: &mut [f64; W]) {
    match view {
        View::Rows { values, stride } => *out = *row::<W>(values, y * stride),
        View::Splat { values, stride } => *out = [values[y * stride]; W],
    }
}
