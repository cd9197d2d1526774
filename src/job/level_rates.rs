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
//!
//! Where a density varies in space, r_h is its mean over the part, and its derivative the mean of
//! ∂r/∂p, both over the same points. The levels L(r) of uniform lattices stay as they are. So
//! derivatives are refused by what changes L, which are parameters of the lattice, and by what
//! moves the part's surface, where the mean would change with the place.

use super::gradient::Field;
use super::{Error, Job, Settings};
use crate::expr::{ParameterId, derive};
use crate::measure::GridMotion;
use crate::num::Progress;
use crate::solid::{Fraction, Values};

/// Why derivatives are refused where a level can move without a change of the volume.
const NO_SLOPE: &str = "the derivatives are not known: the volume does not change with the level of \
    this density. The field may jump there, or the part be all solid or all void on this grid; ask \
    for the values alone, or give another density or a smaller spacing";

/// Slopes of volumes by a level are none if elimination leaves less of them than this.
const FLAT: f64 = 1e-12;

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
    /// [`Error::Density`] where a density varies in space and a parameter changes its lattice or
    /// the part, and where a level has no slope: if the field jumps there, or if the solid ends there.
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
        for varying in fractions.iter().filter(|fraction| fraction.curve.is_some()) {
            let of_lattice = job.graph.parameters_of(&[varying.family]);
            if let Some(slot) = slots[..named].iter().find(|slot| of_lattice.contains(slot)) {
                return Err(unknown(job, varying, *slot, "the lattice"));
            }
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
        let far = job.far(field.grid.bounds(), &field.values)?;
        let mut matrix = Vec::new();
        for fraction in fractions {
            let with = |level: f64| {
                let mut values = field.values.clone();
                values[fraction.level.index()] = level;
                values
            };
            let (empty, empty_by) = volumes(with(-far))?;
            let (full, full_by) = volumes(with(far))?;
            let mut graph = job.graph.clone();
            let mut target = vec![fraction.target];
            let slope = |slot: &ParameterId| derive::by_parameter(&mut graph, target[0], *slot);
            let slopes: Vec<_> = slots.iter().map(slope).collect();
            target.extend(slopes);
            let means = match fraction.curve {
                None => {
                    let mut values = Values::new(&graph, &field.values);
                    target.iter().map(|node| values.of(*node).unwrap_or(f64::NAN)).collect()
                }
                Some(_) => {
                    let (of, work) = ((&graph, &target[..]), (settings, progress));
                    job.means_over_part(fraction, field.grid, &field.values, of, work)?
                }
            };
            let (share, slopes) = (means[0], &means[1..]);
            let row: Vec<f64> = (0..slots.len())
                .map(|s| {
                    let part_by = full_by[s] - empty_by[s];
                    if fraction.curve.is_some() && s < named && part_by != 0.0 {
                        return Err(unknown(job, fraction, slots[s], "the part"));
                    }
                    let part = present[s] - empty_by[s] - share * part_by;
                    Ok(part - slopes[s] * (full - empty))
                })
                .collect::<Result<_, _>>()?;
            matrix.push(row);
        }
        solve(matrix, named).map(|rows| Self { named, rows }).map_err(|level| {
            Error::density(NO_SLOPE.to_owned(), fractions[level].span, &job.sources)
        })
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

/// The error of a derivative by the parameter `slot`, which changes `what` of a varying density.
fn unknown(job: &Job, fraction: &Fraction, slot: ParameterId, what: &str) -> Error {
    let names = job.parameters().iter().map(|(name, _)| name);
    let name = names.clone().find(|name| job.graph.slot(name) == Some(slot));
    let name = name.map_or("a parameter", String::as_str);
    let message = format!(
        "the derivative by `{name}` is not known: it changes {what}, and a density varies in space"
    );
    Error::density(message, fraction.span, &job.sources)
}

/// The solution X of B X = -A for `matrix` = (A B), A having `named` columns, by elimination with
/// row exchanges.
///
/// # Errors
/// The column of B without a pivot.
fn solve(mut matrix: Vec<Vec<f64>>, named: usize) -> Result<Vec<Vec<f64>>, usize> {
    let count = matrix.len();
    let largest =
        |column: usize| matrix.iter().map(|row| row[named + column].abs()).fold(0.0, f64::max);
    let least: Vec<f64> = (0..count).map(|column| FLAT * largest(column)).collect();
    for column in 0..count {
        let size = |row: &usize| matrix[*row][named + column].abs();
        let pivot = (column..count).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(column);
        // False for what is not a number.
        if !(size(&pivot) > least[column] && size(&pivot).is_finite()) {
            return Err(column);
        }
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
    Ok(matrix.iter().enumerate().map(scaled).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elimination_solves_with_exchanged_rows() {
        // B = (0 2; 4 1), A = (2; 6): X = -(1.25; 1).
        let found = solve(vec![vec![2.0, 0.0, 2.0], vec![6.0, 4.0, 1.0]], 1);
        assert_eq!(found.unwrap(), [[-1.25], [-1.0]]);
    }

    #[test]
    fn a_level_without_a_slope_is_named() {
        assert_eq!(solve(vec![vec![2.0, 0.0]], 1), Err(0));
        assert_eq!(solve(vec![vec![2.0, f64::NAN]], 1), Err(0));
        // The second row is a multiple of the first.
        assert_eq!(solve(vec![vec![1.0, 1.0, 2.0], vec![5.0, 2.0, 4.0]], 1), Err(1));
    }

    #[test]
    fn what_levels_bring_is_added() {
        let rates = LevelRates { named: 2, rows: vec![vec![3.0, 5.0]] };
        let mut by = vec![1.0, 1.0, 2.0];
        rates.carry(&mut by, |rate, level, factor| *rate += level * factor);
        assert_eq!(by, [7.0, 11.0]);
    }
}
