//! How solved levels move with the parameters.
//!
//! Level t_h makes C_h = V - V₀ - r_h (V₁ - V₀) vanish, V₀ and V₁ being the volumes where it is far below
//! and far above. By the implicit function theorem
//!
//! > dt/dp = -(∂C/∂t)⁻¹ ∂C/∂p,
//!
//! with the derivatives of the volumes from the quadrature of the field. A quantity Q of the solid then
//! changes by ∂Q/∂p + ∂Q/∂t dt/dp. That is exact for the levels of the solid itself; those of a grid
//! differ by its error.

use super::gradient::Field;
use super::{Error, Settings};
use crate::expr::{ParameterId, derive};
use crate::measure::GridMotion;
use crate::num::Progress;
use crate::solid::Values;

/// A level far beyond all values; see [`levels`](super::levels).
const FAR: f64 = super::levels::FAR;

/// Derivatives of the solved levels by the named parameters.
#[derive(Clone, Debug, Default)]
pub(super) struct LevelRates {
    named: usize,
    /// One row a level, one entry a named parameter.
    rows: Vec<Vec<f64>>,
}

impl LevelRates {
    /// The derivatives of the levels at the end of `slots` by those before them, which have `motions`.
    ///
    /// # Errors
    /// [`Error::Density`] for densities that vary in space, whose curves have no derivatives here.
    pub(super) fn new(
        field: &Field<'_>,
        slots: &[ParameterId],
        motions: &[GridMotion],
        settings: &Settings,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let job = field.job;
        let fractions = &job.solid.fractions;
        let named = slots.len() - fractions.len();
        if fractions.is_empty() || named == 0 {
            return Ok(Self { named, rows: vec![Vec::new(); fractions.len()] });
        }
        if let Some(varying) = fractions.iter().find(|fraction| fraction.curve.is_some()) {
            let message = "derivatives by parameters are not known where a density varies in space";
            return Err(Error::density(message.to_owned(), varying.span, &job.sources));
        }
        let volumes = |values: Vec<f64>| -> Result<(f64, Vec<f64>), Error> {
            let at = Field { values, ..field.clone() };
            match at.quadrature(slots, motions, settings, progress) {
                Ok((found, _)) => {
                    let by = found.volume_by.iter().map(|rate| rate.value).collect();
                    Ok((found.volume.value, by))
                }
                Err(Error::Empty { .. }) => Ok((0.0, vec![0.0; slots.len()])),
                Err(fault) => Err(fault),
            }
        };
        let (_, present) = volumes(field.values.clone())?;
        let mut matrix = Vec::new();
        for fraction in fractions {
            let with = |level: f64| {
                let mut values = field.values.clone();
                values[fraction.level.index()] = level;
                values
            };
            let (empty, empty_by) = volumes(with(-FAR))?;
            let (full, full_by) = volumes(with(FAR))?;
            let mut graph = job.graph.clone();
            let share = Values::new(&graph, &field.values).of(fraction.target);
            let share = share.unwrap_or(f64::NAN);
            let row: Vec<f64> = (0..slots.len())
                .map(|s| {
                    let slope = derive::by_parameter(&mut graph, fraction.target, slots[s]);
                    let slope = Values::new(&graph, &field.values).of(slope).unwrap_or(0.0);
                    let part = present[s] - empty_by[s] - share * (full_by[s] - empty_by[s]);
                    part - slope * (full - empty)
                })
                .collect();
            matrix.push(row);
        }
        Ok(Self { named, rows: solve(matrix, named) })
    }

    /// Adds to the first of `rates`, which are by the named parameters, what the levels bring with
    /// them; the rates by the levels are at the end, and go. `add` adds a multiple of a rate.
    pub(super) fn carry<R>(&self, rates: &mut Vec<R>, add: impl Fn(&mut R, &R, f64)) {
        let levels = rates.split_off(self.named);
        for (level, row) in levels.iter().zip(&self.rows) {
            for (rate, factor) in rates.iter_mut().zip(row) {
                add(rate, level, *factor);
            }
        }
    }
}

/// The solution X of B X = -A for `matrix` = (A B), A having `named` columns, by elimination with
/// row exchanges.
fn solve(mut matrix: Vec<Vec<f64>>, named: usize) -> Vec<Vec<f64>> {
    let count = matrix.len();
    for column in 0..count {
        let size = |row: &usize| matrix[*row][named + column].abs();
        let pivot = (column..count).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(column);
        matrix.swap(column, pivot);
        let chosen = matrix[column].clone();
        for (row, entries) in matrix.iter_mut().enumerate() {
            if row != column {
                let factor = entries[named + column] / chosen[named + column];
                entries.iter_mut().zip(&chosen).for_each(|(e, c)| *e -= factor * c);
            }
        }
    }
    let scaled = |(row, entries): (usize, &Vec<f64>)| {
        entries[..named].iter().map(|e| -e / entries[named + row]).collect()
    };
    matrix.iter().enumerate().map(scaled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elimination_solves_with_exchanged_rows() {
        // B = (0 2; 4 1), A = (2; 6): X = -(1.25; 1).
        let found = solve(vec![vec![2.0, 0.0, 2.0], vec![6.0, 4.0, 1.0]], 1);
        assert_eq!(found, [[-1.25], [-1.0]]);
    }

    #[test]
    fn what_levels_bring_is_added() {
        let rates = LevelRates { named: 2, rows: vec![vec![3.0, 5.0]] };
        let mut by = vec![1.0, 1.0, 2.0];
        rates.carry(&mut by, |rate, level, factor| *rate += level * factor);
        assert_eq!(by, [7.0, 11.0]);
    }
}
