//! How much of each type there is between points of known types.
//!
//! A type has the weight 1 at its own points and 0 at the others. Where a radius is given, the
//! weights at the points are first averaged over the points within the radius r, each counting by
//! exp(-(2d/r)²) of its distance d; then they are interpolated. They add up to 1 everywhere.
//!
//! Source: ASLI's hybrid lattices (Perez-Boerema et al. 2022, doi:10.1080/17452759.2022.2048956) and
//! the filter of its code.

use super::file::Types;
use super::{Scattered, TooClose, each};
use crate::num::elementary;
use rayon::prelude::*;

/// The weights of all types of `data`, one field a type, averaged within `radii`, one a point.
///
/// A radius that is not positive averages nothing; none may be NaN.
///
/// # Errors
/// [`TooClose`].
///
/// # Panics
/// If there are not as many radii as points.
pub fn weights(data: &Types, radii: &[f64], name: &str) -> Result<Vec<Scattered>, TooClose> {
    assert_eq!(radii.len(), data.at.len(), "a point has one radius");
    each(&data.at, &averaged(data, radii), name)
}

/// The weights at the points, a list a type.
fn averaged(data: &Types, radii: &[f64]) -> Vec<Vec<f64>> {
    let Types { at, types, names } = data;
    let shares: Vec<Vec<f64>> = (at.par_iter().zip(radii).zip(types))
        .map(|((point, radius), own)| {
            let mut shares = vec![0.0; names.len()];
            if *radius <= 0.0 {
                shares[*own] = 1.0;
                return shares;
            }
            let mut total = 0.0;
            for (other, kind) in at.iter().zip(types) {
                let square: f64 = (0..3).map(|k| point[k] - other[k]).map(|d| d * d).sum();
                let distance = square.sqrt();
                if distance <= *radius {
                    let ratio = distance / (radius / 2.0);
                    let weight = elementary::exp(-(ratio * ratio));
                    shares[*kind] += weight;
                    total += weight;
                }
            }
            shares.iter_mut().for_each(|share| *share /= total);
            shares
        })
        .collect();
    (0..names.len()).map(|kind| shares.iter().map(|share| share[kind]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::samples::Uniform;
    use super::*;

    fn data() -> Types {
        let mut uniform = Uniform(2);
        let at: Vec<[f64; 3]> = (0..60).map(|_| uniform.point(-1.0, 1.0).to_array()).collect();
        let types = at.iter().map(|p| usize::from(p[0] > 0.0) + usize::from(p[1] > 0.5)).collect();
        Types { at, types, names: ["a", "b", "c"].map(str::to_owned).to_vec() }
    }

    #[test]
    fn weights_add_up_to_one_everywhere() {
        let data = data();
        for radius in [0.0, 0.4] {
            let fields = weights(&data, &vec![radius; data.at.len()], "").unwrap();
            for point in [[0.0; 3], [0.3, -0.2, 0.9], [2.0, 1.0, -3.0]] {
                let sum: f64 = fields.iter().map(|field| field.value(point)).sum();
                assert!((sum - 1.0).abs() < 1e-9, "{sum}");
            }
        }
    }

    #[test]
    fn a_radius_averages_over_the_points_within() {
        let data = Types {
            at: vec![[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]],
            types: vec![0, 1, 1],
            names: vec!["a".into(), "b".into()],
        };
        let [a, b] = averaged(&data, &[2.0, 1.0, 0.0]).try_into().unwrap();
        // exp(-(2*1/2)^2) and exp(-(2*1/1)^2) by hand.
        let (one, two) = ((-1.0_f64).exp(), (-4.0_f64).exp());
        for (found, expected) in a.iter().zip([1.0 / (1.0 + one), two / (1.0 + two), 0.0]) {
            assert!((found - expected).abs() < 1e-15);
        }
        assert!(a.iter().zip(&b).all(|(a, b)| (a + b - 1.0).abs() < 1e-15));
    }
}
