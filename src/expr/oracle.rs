//! Fields without a formula.
//!
//! An oracle answers for the value and the gradient of a field at points, in bulk, and bounds the
//! field over boxes. It takes part in expressions as [`Node::Oracle`](super::Node::Oracle), so
//! pruning, derivatives and set operations work on it as on formulas.

use crate::num::Interval;
use std::fmt;

/// Why an oracle could not answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{oracle}` could not be evaluated: {cause}")]
pub struct Failure {
    /// [`Oracle::name`] of the oracle at fault.
    pub oracle: String,
    /// What went wrong, in lower case.
    pub cause: String,
}

/// Points to answer for, and room for the answers.
///
/// All slices have one length. The gradient is asked for or not as a whole.
#[derive(Debug)]
pub struct Queries<'a> {
    /// Coordinates of the points, one slice an axis.
    pub at: [&'a [f64]; 3],
    /// Receives the values.
    pub value: &'a mut [f64],
    /// Receives the partial derivatives, one slice an axis, if they are wanted.
    pub gradient: Option<[&'a mut [f64]; 3]>,
}

/// What who asks makes of the values, where that is less than to use them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interest<'a> {
    /// They are compared with these numbers and nothing else: a stand-in is below, equal to or above
    /// each of them as the value is.
    Beside(&'a [f64]),
    /// They are passed over where they are less than a number, one a point: a stand-in for such a
    /// value is less, too.
    From(&'a [f64]),
    /// They are passed over where they are greater than a number, one a point: a stand-in for such a
    /// value is greater, too.
    UpTo(&'a [f64]),
}

/// A field that is evaluated by code of its own, negative inside.
///
/// Contract:
/// * A point has one answer: [`points`](Self::points), [`brick`](Self::brick), whatever the batch,
///   the order and the thread, give the same bits for the same coordinates. Stand-ins
///   ([`points_for`](Self::points_for), [`brick_beside`](Self::brick_beside)) may differ from one
///   time to the next; what is made of them may not.
/// * [`range`](Self::range) encloses every value that the point queries return for points in the
///   box, rounding included, and sets `nan` if one of them may be NaN.
/// * The gradient steers root finding only: it may be wrong where the field has a kink.
pub trait Oracle: fmt::Debug + Send + Sync {
    /// A name for messages, such as the file it was read from.
    fn name(&self) -> &str;

    /// Answers for points in any order.
    ///
    /// # Errors
    /// [`Failure`] when no answer can be given; the answers are then unspecified.
    fn points(&self, queries: Queries<'_>) -> Result<(), Failure>;

    /// Values at the nodes of a small grid: `value[(k * y.len() + j) * x.len() + i]` answers
    /// `(x[i], y[j], z[k])`. The coordinates of an axis are monotone; spacing may vary.
    ///
    /// # Errors
    /// [`Failure`] when no answer can be given; the answers are then unspecified.
    fn brick(&self, at: [&[f64]; 3], value: &mut [f64]) -> Result<(), Failure> {
        let [x, y, z] = at;
        let mut rows = value.chunks_exact_mut(x.len().max(1));
        let (mut ys, mut zs) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        for &zk in z {
            zs.fill(zk);
            for &yj in y {
                ys.fill(yj);
                if let Some(row) = rows.next() {
                    self.points(Queries { at: [x, &ys, &zs], value: row, gradient: None })?;
                }
            }
        }
        Ok(())
    }

    /// What [`points`](Self::points) answers, or stand-ins for values: any numbers that `interest`
    /// can't tell from them. NaN stands for itself alone. The gradient is that of the point where
    /// the value counts, and anything where a stand-in is passed over.
    ///
    /// # Errors
    /// [`Failure`] when no answer can be given; the answers are then unspecified.
    fn points_for(&self, queries: Queries<'_>, interest: Interest<'_>) -> Result<(), Failure> {
        let (Interest::Beside(_) | Interest::From(_) | Interest::UpTo(_)) = interest;
        self.points(queries)
    }

    /// What [`brick`](Self::brick) answers, or stand-ins that compare as the values do with each of
    /// `levels`. NaN stands for itself alone.
    ///
    /// # Errors
    /// [`Failure`] when no answer can be given; the answers are then unspecified.
    fn brick_beside(
        &self,
        at: [&[f64]; 3],
        levels: &[f64],
        value: &mut [f64],
    ) -> Result<(), Failure> {
        let _ = levels;
        self.brick(at, value)
    }

    /// An enclosure of the values over the box with the given sides.
    fn range(&self, at: [Interval; 3]) -> Interval;

    /// Whether the values are linear in pieces, as the distance to flat faces is near them: then slopes at
    /// two points say nothing of a curvature between.
    fn is_faceted(&self) -> bool {
        false
    }

    /// An upper bound of the gradient's length; infinite if none is known.
    fn lipschitz(&self) -> f64 {
        f64::INFINITY
    }
}
