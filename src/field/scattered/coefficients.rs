//! The coefficients of radial splines: functions c + b·x + Σ wᵢ |x - xᵢ| through given values.
//!
//! The sums of the wᵢ and of the wᵢ xᵢ are zero, which makes the function unique. The kernel -|x| is
//! positive definite on weights whose sum is zero, so reflections that take constants and
//! coordinates out of the matrix leave one that Cholesky's method factors without pivots: half
//! of the work of a general elimination, and always stable. Where the points lie in a plane or on a
//! line, the function has no slope across it.
//!
//! Results are the same bits whatever the number of threads.
//!
//! Source: Wendland 2004, Scattered Data Approximation, doi:10.1017/CBO9780511617539, chapter 8.

use crate::num::lanes;
use rayon::prelude::*;

/// Columns that are eliminated at a time.
const BLOCK: usize = 64;
/// How far points reach across a plane or a line, in units of their extent, that count as within.
const FLAT: f64 = 1e-9;

/// A function c + b·x + Σ wᵢ |x - xᵢ|.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coefficients {
    /// The wᵢ.
    pub weights: Vec<f64>,
    /// The slope b.
    pub slope: [f64; 3],
    /// The level c.
    pub level: f64,
}

/// The functions through `values`, a list for each function, at `points`, which differ.
///
/// Points should lie within a unit or so of the origin. `None` if some lie so close together that
/// rounding hides it.
pub(super) fn coefficients(points: &[[f64; 3]], values: &[Vec<f64>]) -> Option<Vec<Coefficients>> {
    let basis = Basis::of(points);
    let rank = basis.reflectors.len();
    let mut matrix: Vec<Vec<f64>> = (points.iter().enumerate())
        .map(|(i, p)| points[..=i].iter().map(|q| -distance(p, q)).collect())
        .collect();
    for reflector in &basis.reflectors {
        reflect_both(&mut matrix, reflector);
    }
    let mut factor = matrix.split_off(rank);
    let columns: Vec<Vec<f64>> =
        (0..rank).map(|i| factor.iter().map(|row| row[i]).collect()).collect();
    // In place: of thousands of points, the matrix is by far the largest thing there is.
    factor.iter_mut().for_each(|row| drop(row.drain(..rank)));
    factorize(&mut factor)?;
    let solve = |values: &Vec<f64>| {
        let mut rest = values.clone();
        for reflector in &basis.reflectors {
            reflect(&mut rest, reflector);
        }
        // The matrix is that of -|x|.
        let mut solution: Vec<f64> = rest[rank..].iter().map(|value| -value).collect();
        substitute(&factor, &mut solution);
        let polynomial: Vec<f64> = (0..rank)
            .map(|i| {
                let kernel: f64 = columns[i].iter().zip(&solution).map(|(a, w)| a * w).sum();
                rest[i] + kernel
            })
            .collect();
        let mut weights = vec![0.0; rank];
        weights.extend(&solution);
        for reflector in basis.reflectors.iter().rev() {
            reflect(&mut weights, reflector);
        }
        let [level, slope @ ..] = basis.polynomial(&polynomial);
        Coefficients { weights, slope, level }
    };
    Some(values.iter().map(solve).collect())
}

fn distance(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    let [x, y, z] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    (x * x + y * y + z * z).sqrt()
}

/// The columns 1, x, y and z at the points, as far as they are independent: reflections that make
/// them a triangle.
struct Basis {
    /// Which columns there are.
    columns: Vec<usize>,
    /// Unit vectors, one a column.
    reflectors: Vec<Vec<f64>>,
    /// The triangle, column by column.
    triangle: Vec<Vec<f64>>,
}

impl Basis {
    fn of(points: &[[f64; 3]]) -> Self {
        let mut basis = Self { columns: Vec::new(), reflectors: Vec::new(), triangle: Vec::new() };
        for column in 0..4 {
            let mut v: Vec<f64> =
                points.iter().map(|p| if column == 0 { 1.0 } else { p[column - 1] }).collect();
            for reflector in &basis.reflectors {
                reflect(&mut v, reflector);
            }
            let rank = basis.columns.len();
            if rank >= v.len() {
                break;
            }
            let length = norm(&v[rank..]);
            if length <= FLAT * (points.len() as f64).sqrt() {
                continue;
            }
            // The reflection that carries the rest of the column to its first entry, without
            // cancellation.
            let first = if v[rank] > 0.0 { -length } else { length };
            let mut reflector = vec![0.0; v.len()];
            reflector[rank..].copy_from_slice(&v[rank..]);
            reflector[rank] -= first;
            let size = norm(&reflector);
            reflector.iter_mut().for_each(|entry| *entry /= size);
            let mut entries = v[..rank].to_vec();
            entries.push(first);
            basis.columns.push(column);
            basis.reflectors.push(reflector);
            basis.triangle.push(entries);
        }
        basis
    }

    /// The factors of 1, x, y and z that make `sides` of the triangle.
    fn polynomial(&self, sides: &[f64]) -> [f64; 4] {
        let mut rest = sides.to_vec();
        let mut found = [0.0; 4];
        for i in (0..rest.len()).rev() {
            let factor = rest[i] / self.triangle[i][i];
            found[self.columns[i]] = factor;
            for (side, entry) in rest.iter_mut().zip(&self.triangle[i]) {
                *side -= factor * entry;
            }
        }
        found
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

/// `v` reflected at the plane across the unit vector `u`.
fn reflect(v: &mut [f64], u: &[f64]) {
    let twice = 2.0 * dot(v, u);
    for (v, u) in v.iter_mut().zip(u) {
        *v -= twice * u;
    }
}

/// The symmetric `matrix`, of which rows up to the diagonal are given, with rows and columns
/// reflected at the plane across the unit vector `u`.
fn reflect_both(matrix: &mut [Vec<f64>], u: &[f64]) {
    let mut image = vec![0.0; u.len()];
    for (i, row) in matrix.iter().enumerate() {
        image[i] += dot(row, &u[..=i]);
        for (j, entry) in row[..i].iter().enumerate() {
            image[j] += entry * u[i];
        }
    }
    let half = dot(&image, u);
    let v: Vec<f64> = image.iter().zip(u).map(|(image, u)| 2.0 * (image - half * u)).collect();
    matrix.par_iter_mut().enumerate().for_each(|(i, row)| {
        for ((entry, u_j), v_j) in row.iter_mut().zip(u).zip(&v) {
            *entry -= u[i] * v_j + v[i] * u_j;
        }
    });
}

/// Makes Cholesky's factor of the positive definite `matrix`, of which rows up to the diagonal are
/// given; `None` where it is not definite to rounding.
fn factorize(matrix: &mut [Vec<f64>]) -> Option<()> {
    // Points at a distance d leave a pivot of about d; below this it is mostly rounding of distances
    // of about 1.
    let least = 64.0 * f64::EPSILON * (matrix.len() + 16) as f64;
    let mut start = 0;
    while start < matrix.len() {
        let end = (start + BLOCK).min(matrix.len());
        let (above, below) = matrix.split_at_mut(end);
        let block = &mut above[start..];
        for i in 0..block.len() {
            let (before, from) = block.split_at_mut(i);
            let row = &mut from[0][start..];
            for (j, other) in before.iter().enumerate() {
                row[j] = (row[j] - dot(&row[..j], &other[start..start + j])) / other[start + j];
            }
            let pivot = row[i] - dot(&row[..i], &row[..i]);
            // NaN fails, too.
            let is_sound = pivot > least;
            row[i] = is_sound.then(|| pivot.sqrt())?;
        }
        let block = &above[start..];
        below.par_iter_mut().for_each(|row| {
            let row = &mut row[start..end];
            for (j, other) in block.iter().enumerate() {
                row[j] = (row[j] - dot(&row[..j], &other[start..start + j])) / other[start + j];
            }
        });
        let panel: Vec<f64> = below.iter().flat_map(|row| row[start..end].to_vec()).collect();
        let width = end - start;
        below.par_iter_mut().enumerate().for_each(|(i, row)| {
            lanes::dispatch(
                #[inline(always)]
                || {
                    let own = &panel[i * width..(i + 1) * width];
                    for (entry, other) in row[end..].iter_mut().zip(panel.chunks_exact(width)) {
                        *entry -= dot(own, other);
                    }
                },
            );
        });
        start = end;
    }
    Some(())
}

/// Solves for `sides` with Cholesky's factor.
fn substitute(factor: &[Vec<f64>], sides: &mut [f64]) {
    for (i, row) in factor.iter().enumerate() {
        sides[i] = (sides[i] - dot(&row[..i], &sides[..i])) / row[i];
    }
    for (i, row) in factor.iter().enumerate().rev() {
        let value = sides[i] / row[i];
        sides[i] = value;
        for (side, entry) in sides[..i].iter_mut().zip(row) {
            *side -= value * entry;
        }
    }
}

/// The inner product of the first entries of `a` and `b`, added up in lanes.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let length = a.len().min(b.len());
    let (a, b) = (&a[..length], &b[..length]);
    let mut sums = [0.0; LANES];
    let (a_parts, a_rest) = a.as_chunks::<LANES>();
    let (b_parts, b_rest) = b.as_chunks::<LANES>();
    for (a, b) in a_parts.iter().zip(b_parts) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::super::super::samples::Uniform;
    use super::*;

    fn value(points: &[[f64; 3]], function: &Coefficients, at: [f64; 3]) -> f64 {
        let Coefficients { weights, slope, level } = function;
        let affine: f64 = level + (0..3).map(|i| slope[i] * at[i]).sum::<f64>();
        let kernels = points.iter().zip(weights).map(|(p, w)| w * distance(p, &at));
        affine + kernels.sum::<f64>()
    }

    fn random(count: usize, seed: u64) -> (Vec<[f64; 3]>, Vec<f64>) {
        let mut uniform = Uniform(seed);
        let points = (0..count).map(|_| uniform.point(-1.0, 1.0).to_array()).collect();
        (points, (0..count).map(|_| uniform.next()).collect())
    }

    #[test]
    fn functions_pass_through_their_values_with_balanced_weights() {
        for count in [1, 2, 3, 4, 5, 17, 64, 200] {
            let (points, values) = random(count, count as u64);
            let [found] =
                coefficients(&points, std::slice::from_ref(&values)).unwrap().try_into().unwrap();
            for (point, expected) in points.iter().zip(&values) {
                let is = value(&points, &found, *point);
                assert!((is - expected).abs() < 1e-10, "{count}: {is} is not {expected}");
            }
            let sum: f64 = found.weights.iter().sum();
            let moment: f64 = found.weights.iter().zip(&points).map(|(w, p)| w * p[1]).sum();
            assert!(sum.abs() < 1e-10 && moment.abs() < 1e-10, "{count}: {sum}, {moment}");
        }
    }

    #[test]
    fn they_are_those_of_the_whole_system_by_elimination() {
        // The system of N + 4 equations, by Gauss's method with pivots: another way to the same.
        let (points, values) = random(40, 7);
        let n = points.len();
        let mut system = vec![vec![0.0; n + 5]; n + 4];
        for i in 0..n {
            for j in 0..n {
                system[i][j] = distance(&points[i], &points[j]);
            }
            let row = [1.0, points[i][0], points[i][1], points[i][2]];
            for (k, entry) in row.into_iter().enumerate() {
                system[i][n + k] = entry;
                system[n + k][i] = entry;
            }
            system[i][n + 4] = values[i];
        }
        for column in 0..n + 4 {
            let pivot = (column..n + 4)
                .max_by(|a, b| system[*a][column].abs().total_cmp(&system[*b][column].abs()));
            system.swap(column, pivot.unwrap());
            for row in 0..n + 4 {
                if row != column {
                    let factor = system[row][column] / system[column][column];
                    let top = system[column].clone();
                    for (entry, top) in system[row].iter_mut().zip(&top).skip(column) {
                        *entry -= factor * top;
                    }
                }
            }
        }
        let expected: Vec<f64> = (0..n + 4).map(|i| system[i][n + 4] / system[i][i]).collect();
        let [found] = coefficients(&points, &[values]).unwrap().try_into().unwrap();
        let found: Vec<f64> =
            found.weights.iter().chain([&found.level]).chain(&found.slope).copied().collect();
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-10, "{found} is not {expected}");
        }
    }

    #[test]
    fn flat_points_have_no_slope_across() {
        let (mut points, values) = random(30, 3);
        points.iter_mut().for_each(|p| p[2] = 0.25);
        let [found] =
            coefficients(&points, std::slice::from_ref(&values)).unwrap().try_into().unwrap();
        assert_eq!(found.slope[2], 0.0);
        assert!((value(&points, &found, points[11]) - values[11]).abs() < 1e-10);
        let line: Vec<[f64; 3]> = (0..6).map(|i| [0.0, f64::from(i) / 6.0, 0.0]).collect();
        let values: Vec<f64> = (0..6).map(f64::from).collect();
        let [found] = coefficients(&line, &[values]).unwrap().try_into().unwrap();
        assert!((value(&line, &found, [0.0, 0.5, 0.0]) - 3.0).abs() < 1e-12);
        assert_eq!([found.slope[0], found.slope[2]], [0.0; 2]);
    }

    #[test]
    fn points_that_rounding_joins_are_refused() {
        let points = [[0.0; 3], [1e-18, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]];
        assert_eq!(coefficients(&points, &[vec![0.0, 1.0, 2.0, 3.0]]), None);
    }
}
