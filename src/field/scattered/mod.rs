//! Numbers between points where they are given: fields that interpolate scattered data.
//!
//! The function through the numbers is the radial spline c + b·x + Σ wᵢ |x - xᵢ| over all points,
//! as ASLI uses it: it has the given numbers at the points, kinks there and is smooth elsewhere, and
//! goes straight on outside. A number at a point costs a square root for each point given.
//!
//! What this is not: a guarantee that numbers stay between the least and the greatest given. Between
//! points where they change at a stroke, splines overshoot.
//!
//! Source: ASLI (Perez-Boerema et al. 2022, doi:10.1080/17452759.2022.2048956), whose files of
//! types, sizes and features these are; its interpolator is called trilinear but is this spline.

mod coefficients;
pub mod file;
pub mod types;

use crate::expr::{Failure, Oracle, Queries};
use crate::num::{Interval, lanes};
use coefficients::{Coefficients, coefficients};

/// Points that are answered side by side.
const LANES: usize = 8;
/// Coordinates whose squares are far from overflowing.
const FARTHEST: f64 = 1e150;

/// Numbers at points.
#[derive(Clone, Debug, PartialEq)]
pub struct Data {
    /// The points, all different, finite.
    pub at: Vec<[f64; 3]>,
    /// A number for each.
    pub values: Vec<f64>,
}

/// What is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// The numbers.
    Plain,
    /// Their reciprocals: so phases, which are lengths by sizes, are what varies gently. ASLI's way with
    /// the sizes of cells.
    Reciprocal,
}

/// Why numbers at points can't be interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("some points are too close together to tell their numbers apart; thin them out")]
pub struct TooClose;

/// A field through scattered numbers.
#[derive(Clone, Debug)]
pub struct Scattered {
    name: String,
    scale: Scale,
    /// The middle of the points, from which coordinates are counted.
    middle: [f64; 3],
    /// Coordinates of the points, axis by axis.
    at: [Vec<f64>; 3],
    function: Coefficients,
    /// The sum of the sizes of the weights.
    total: f64,
}

/// The field through `data`, called `name` in messages.
///
/// # Errors
/// [`TooClose`].
pub fn scattered(data: &Data, scale: Scale, name: &str) -> Result<Scattered, TooClose> {
    let values = match scale {
        Scale::Plain => data.values.clone(),
        Scale::Reciprocal => data.values.iter().map(|value| 1.0 / value).collect(),
    };
    let [field] = all(&data.at, &[values], scale, name)?.try_into().map_err(|_| TooClose)?;
    Ok(field)
}

/// The fields through the lists `values` at the points `at`.
///
/// # Errors
/// [`TooClose`].
pub fn each(at: &[[f64; 3]], values: &[Vec<f64>], name: &str) -> Result<Vec<Scattered>, TooClose> {
    all(at, values, Scale::Plain, name)
}

fn all(
    points: &[[f64; 3]],
    values: &[Vec<f64>],
    scale: Scale,
    name: &str,
) -> Result<Vec<Scattered>, TooClose> {
    let side = |k: usize, pick: fn(f64, f64) -> f64, start: f64| {
        points.iter().map(|p| p[k]).fold(start, pick)
    };
    let lo: [f64; 3] = std::array::from_fn(|k| side(k, f64::min, f64::INFINITY));
    let hi: [f64; 3] = std::array::from_fn(|k| side(k, f64::max, f64::NEG_INFINITY));
    let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * lo[k] + 0.5 * hi[k]);
    let reach = (0..3).map(|k| hi[k] - middle[k]).fold(0.0, f64::max);
    let unit = if reach > 0.0 { reach } else { 1.0 };
    let near: Vec<[f64; 3]> =
        points.iter().map(|p| std::array::from_fn(|k| (p[k] - middle[k]) / unit)).collect();
    let functions = coefficients(&near, values).ok_or(TooClose)?;
    let at: [Vec<f64>; 3] =
        std::array::from_fn(|k| points.iter().map(|p| p[k] - middle[k]).collect());
    let fields = functions.into_iter().map(|function| {
        // The kernel is homogeneous: in model units weights and slope are those by the unit.
        let Coefficients { weights, slope, level } = function;
        let weights: Vec<f64> = weights.iter().map(|weight| weight / unit).collect();
        let total = weights.iter().map(|weight| weight.abs()).sum();
        let function = Coefficients { weights, slope: slope.map(|b| b / unit), level };
        Scattered { name: name.to_owned(), scale, middle, at: at.clone(), function, total }
    });
    Ok(fields.collect())
}

impl Scattered {
    /// The number at `point`.
    #[must_use]
    pub fn value(&self, point: [f64; 3]) -> f64 {
        let sums = self.sums::<1>(point.map(|c| [c]));
        self.scaled(sums[0])
    }

    #[inline(always)]
    fn scaled(&self, sum: f64) -> f64 {
        match self.scale {
            Scale::Plain => sum,
            Scale::Reciprocal => 1.0 / sum,
        }
    }

    /// The slope of what is interpolated by that of the spline, where this is `sum`.
    #[inline(always)]
    fn factor(&self, sum: f64) -> f64 {
        match self.scale {
            Scale::Plain => 1.0,
            Scale::Reciprocal => -1.0 / (sum * sum),
        }
    }

    /// The spline at `N` points, the sums of each in the same order.
    #[inline(always)]
    fn sums<const N: usize>(&self, point: [[f64; N]; 3]) -> [f64; N] {
        let Coefficients { weights, slope, level } = &self.function;
        let [x, y, z] = self.centred(point);
        let mut sums = [0.0; N];
        for lane in 0..N {
            sums[lane] = level + slope[0] * x[lane] + slope[1] * y[lane] + slope[2] * z[lane];
        }
        let [xs, ys, zs] = &self.at;
        for (((weight, xi), yi), zi) in weights.iter().zip(xs).zip(ys).zip(zs) {
            for lane in 0..N {
                let (dx, dy, dz) = (x[lane] - xi, y[lane] - yi, z[lane] - zi);
                sums[lane] += weight * (dx * dx + dy * dy + dz * dz).sqrt();
            }
        }
        sums
    }

    /// The spline at `N` points as [`sums`](Self::sums) has it, and its slopes; at the points given,
    /// those of the others.
    #[inline(always)]
    fn sums_and_slopes<const N: usize>(&self, point: [[f64; N]; 3]) -> ([f64; N], [[f64; N]; 3]) {
        let Coefficients { weights, slope, level } = &self.function;
        let [x, y, z] = self.centred(point);
        let (mut sums, mut slopes) = ([0.0; N], slope.map(|b| [b; N]));
        for lane in 0..N {
            sums[lane] = level + slope[0] * x[lane] + slope[1] * y[lane] + slope[2] * z[lane];
        }
        let [xs, ys, zs] = &self.at;
        for (((weight, xi), yi), zi) in weights.iter().zip(xs).zip(ys).zip(zs) {
            for lane in 0..N {
                let (dx, dy, dz) = (x[lane] - xi, y[lane] - yi, z[lane] - zi);
                let distance = (dx * dx + dy * dy + dz * dz).sqrt();
                sums[lane] += weight * distance;
                let steep = if distance > 0.0 { weight / distance } else { 0.0 };
                slopes[0][lane] += steep * dx;
                slopes[1][lane] += steep * dy;
                slopes[2][lane] += steep * dz;
            }
        }
        (sums, slopes)
    }

    #[inline(always)]
    fn centred<const N: usize>(&self, point: [[f64; N]; 3]) -> [[f64; N]; 3] {
        let mut moved = point;
        for (coordinates, middle) in moved.iter_mut().zip(self.middle) {
            coordinates.iter_mut().for_each(
                #[inline(always)]
                |c| *c -= middle,
            );
        }
        moved
    }

    /// An enclosure of the spline over the box with the given sides, rounding included.
    ///
    /// A point far from the box is taken with its value and slope at the middle of the box: the
    /// second derivative of a distance d is at most 1/d. Slopes add up before they are made
    /// wide, so that weights of both signs cancel. A point near the box is taken by itself.
    fn spline_range(&self, at: [Interval; 3]) -> Interval {
        let Coefficients { weights, slope, level } = &self.function;
        let lo = self.centred(at.map(|side| [side.lo])).map(|[c]| c);
        let hi = self.centred(at.map(|side| [side.hi])).map(|[c]| c);
        let farthest = lo.iter().chain(&hi).fold(0.0, |most: f64, c| most.max(c.abs()));
        // NaN is beyond, too.
        let is_near = farthest < FARTHEST;
        if at.iter().any(|side| side.nan) || !is_near {
            return Interval::ANYTHING;
        }
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * lo[k] + 0.5 * hi[k]);
        let half: [f64; 3] =
            std::array::from_fn(|k| (hi[k] - middle[k]).max(middle[k] - lo[k]).max(0.0));
        let radius = half.iter().map(|h| h * h).sum::<f64>().sqrt() * (1.0 + 4.0 * f64::EPSILON);
        let (mut value, mut steep) = (*level, *slope);
        let mut size = level.abs();
        for k in 0..3 {
            value += slope[k] * middle[k];
            size += slope[k].abs() * (middle[k].abs() + half[k]);
        }
        let (mut below, mut above, mut bent) = (0.0, 0.0, 0.0);
        for (i, weight) in weights.iter().enumerate() {
            let offset: [f64; 3] = std::array::from_fn(|k| middle[k] - self.at[k][i]);
            let distance = offset.iter().map(|d| d * d).sum::<f64>().sqrt();
            size += weight.abs() * (distance + radius);
            if distance > 2.0 * radius {
                value += weight * distance;
                for k in 0..3 {
                    steep[k] += weight * offset[k] / distance;
                }
                bent += weight.abs() * radius * radius / (2.0 * (distance - radius));
            } else {
                let [mut least, mut most] = [0.0; 2];
                for k in 0..3 {
                    let (gap, reach) = (offset[k].abs() - half[k], offset[k].abs() + half[k]);
                    least += gap.max(0.0) * gap.max(0.0);
                    most += reach * reach;
                }
                let [least, most] = [least.sqrt(), most.sqrt()];
                below += weight * if *weight > 0.0 { least } else { most };
                above += weight * if *weight > 0.0 { most } else { least };
            }
        }
        let spread: f64 = (0..3).map(|k| steep[k].abs() * half[k]).sum();
        // Each of the sums above and of the spline itself is off by at most as many roundings as it
        // has terms, each of a size that `size` bounds; squares that vanish are off by their roots.
        let terms = weights.len() as f64 + 32.0;
        let rounding = 8.0 * terms * f64::EPSILON * size + 1e-150 * self.total;
        let width = spread + bent + rounding;
        let (low, high) = (value + below - width, value + above + width);
        if low.is_finite() && high.is_finite() {
            Interval::new(low.next_down(), high.next_up())
        } else {
            Interval::ANYTHING
        }
    }
}

impl Oracle for Scattered {
    fn name(&self) -> &str {
        &self.name
    }

    fn points(&self, queries: Queries<'_>) -> Result<(), Failure> {
        let Queries { at, value, mut gradient } = queries;
        lanes::dispatch(
            #[inline(always)]
            || {
                for (block, out) in value.chunks_mut(LANES).enumerate() {
                    let start = block * LANES;
                    let here = start..start + out.len();
                    let mut point = [[0.0; LANES]; 3];
                    for (lanes, coordinates) in point.iter_mut().zip(at) {
                        lanes[..out.len()].copy_from_slice(&coordinates[here.clone()]);
                    }
                    let sums = match &mut gradient {
                        None => self.sums(point),
                        Some(gradient) => {
                            let (sums, slopes) = self.sums_and_slopes(point);
                            for (partial, slopes) in gradient.iter_mut().zip(slopes) {
                                for (lane, partial) in partial[here.clone()].iter_mut().enumerate()
                                {
                                    *partial = self.factor(sums[lane]) * slopes[lane];
                                }
                            }
                            sums
                        }
                    };
                    for (out, sum) in out.iter_mut().zip(sums) {
                        *out = self.scaled(sum);
                    }
                }
            },
        );
        Ok(())
    }

    fn range(&self, at: [Interval; 3]) -> Interval {
        let spline = self.spline_range(at);
        match self.scale {
            Scale::Plain => spline,
            Scale::Reciprocal => Interval::point(1.0) / spline,
        }
    }

    fn lipschitz(&self) -> f64 {
        match self.scale {
            Scale::Plain => {
                let slope = self.function.slope.iter().map(|b| b * b).sum::<f64>().sqrt();
                slope + self.total
            }
            Scale::Reciprocal => f64::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::Uniform;
    use super::*;

    /// Random numbers at random points about `center`.
    fn data(count: usize, center: f64, size: f64) -> Data {
        let mut uniform = Uniform(count as u64);
        let point = |uniform: &mut Uniform| {
            let p = uniform.point(-1.0, 1.0).to_array();
            p.map(|c| center + size * c)
        };
        let at = (0..count).map(|_| point(&mut uniform)).collect();
        Data { at, values: (0..count).map(|_| 0.5 + uniform.next()).collect() }
    }

    fn kinds() -> Vec<Scattered> {
        let mut kinds = Vec::new();
        for (count, center, size) in
            [(1, 0.0, 1.0), (3, 0.0, 1.0), (40, 0.0, 1.0), (200, 1e3, 2.0), (50, -7.0, 1e-4)]
        {
            for scale in [Scale::Plain, Scale::Reciprocal] {
                kinds.push(scattered(&data(count, center, size), scale, "data").unwrap());
            }
        }
        kinds
    }

    #[test]
    fn fields_pass_through_their_numbers() {
        for (count, center, size) in [(1, 0.0, 1.0), (40, 0.0, 1.0), (200, 1e3, 2.0)] {
            let data = data(count, center, size);
            for scale in [Scale::Plain, Scale::Reciprocal] {
                let field = scattered(&data, scale, "data").unwrap();
                for (point, value) in data.at.iter().zip(&data.values) {
                    assert!((field.value(*point) - value).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn fields_reproduce_what_is_linear() {
        let Data { at, .. } = data(30, 5.0, 3.0);
        let linear = |p: &[f64; 3]| 2.0 + 0.5 * p[0] - 3.0 * p[1] + 0.25 * p[2];
        let field =
            scattered(&Data { values: at.iter().map(linear).collect(), at }, Scale::Plain, "")
                .unwrap();
        for point in [[5.5, 4.0, 7.0], [100.0, -50.0, 3.0]] {
            assert!((field.value(point) - linear(&point)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_batch_answers_as_each_point_by_itself_does() {
        let mut uniform = Uniform(5);
        for field in kinds() {
            let points: Vec<[f64; 3]> = (0..19)
                .map(|_| {
                    let p = uniform.point(-2.0, 2.0).to_array();
                    std::array::from_fn(|k| field.middle[k] + p[k])
                })
                .collect();
            let at: [Vec<f64>; 3] = std::array::from_fn(|k| points.iter().map(|p| p[k]).collect());
            let at = [at[0].as_slice(), &at[1], &at[2]];
            let mut value = vec![0.0; points.len()];
            let mut slopes = [(); 3].map(|()| vec![0.0; points.len()]);
            let gradient = Some(slopes.each_mut().map(Vec::as_mut_slice));
            field.points(Queries { at, value: &mut value, gradient }).unwrap();
            for (i, point) in points.iter().enumerate() {
                assert_eq!(value[i].to_bits(), field.value(*point).to_bits());
                let step = 1e-6;
                for k in 0..3 {
                    let moved = |by: f64| {
                        let mut point = *point;
                        point[k] += by;
                        field.value(point)
                    };
                    let difference = (moved(step) - moved(-step)) / (2.0 * step);
                    let slope = slopes[k][i];
                    assert!((difference - slope).abs() < 1e-4 * (1.0 + slope.abs()));
                }
            }
        }
    }

    #[test]
    fn ranges_enclose_and_become_tight() {
        let mut uniform = Uniform(9);
        for field in kinds() {
            let reach = field.at.iter().flatten().fold(1e-6_f64, |most, c| most.max(c.abs()));
            for size in [0.0, 1e-9, 1e-4, 0.03, 0.5, 3.0] {
                for _ in 0..20 {
                    let p = uniform.point(-1.5, 1.5).to_array();
                    let corner: [f64; 3] = std::array::from_fn(|k| field.middle[k] + reach * p[k]);
                    let sides: [f64; 3] = std::array::from_fn(|_| reach * size * uniform.next());
                    let at =
                        std::array::from_fn(|k| Interval::new(corner[k], corner[k] + sides[k]));
                    let range = field.range(at);
                    for _ in 0..20 {
                        let inner: [f64; 3] = std::array::from_fn(|k| {
                            (corner[k] + sides[k] * uniform.next()).min(corner[k] + sides[k])
                        });
                        assert!(range.contains(field.value(inner)), "{range:?} {inner:?}");
                    }
                    // A thousandth of the extent spans a thousandth of the change across it, about.
                    if size == 1e-4 && field.scale == Scale::Plain {
                        assert!(range.hi - range.lo < 0.05, "{range:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn remote_boxes_are_enclosed_by_anything() {
        let field = scattered(&data(5, 0.0, 1.0), Scale::Plain, "").unwrap();
        let unit = Interval::new(0.0, 1.0);
        for side in [Interval::ANYTHING, Interval::new(0.0, 1e200), unit.or_nan(true)] {
            assert_eq!(field.range([unit, side, unit]), Interval::ANYTHING);
        }
    }
}
