//! The order of convergence: volumes and areas have second-order errors.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::mesh::measure::{Measures, measure};
use common::sound_mesh;
use std::f64::consts::PI;

/// Cells along a length of two.
const CELLS: [f64; 5] = [32.0, 48.0, 64.0, 96.0, 128.0];

/// Checks that the errors of a quantity fall as the square of the spacing.
///
/// The order is the slope of the straight line through all errors, on logarithmic scales: an error
/// also depends on where nodes lie, so no two spacings alone would tell.
fn check(program: &str, quantity: fn(&Measures) -> f64, truth: f64) {
    let errors = CELLS.map(|n| quantity(&measure(&sound_mesh(program, 2.0 / n))) - truth);
    let [x, y] = [CELLS.map(|n| (2.0 / n).ln()), errors.map(|error| error.abs().ln())];
    let mean = |list: [f64; 5]| list.iter().sum::<f64>() / 5.0;
    let [mx, my] = [x, y].map(mean);
    let covariance: f64 = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum();
    let order = covariance / x.iter().map(|x| (x - mx) * (x - mx)).sum::<f64>();
    assert!((1.9..=2.1).contains(&order), "{program}: order {order}, errors {errors:?}");
}

#[test]
fn the_sphere_converges_with_second_order() {
    check("sphere", |found| found.volume, 4.0 / 3.0 * PI);
    check("sphere", |found| found.area, 4.0 * PI);
}

#[test]
fn the_torus_converges_with_second_order() {
    let (major, minor) = (0.75, 0.25);
    check("torus", |found| found.volume, 2.0 * PI * PI * major * minor * minor);
    check("torus", |found| found.area, 4.0 * PI * PI * major * minor);
}

/// Source: integrals over 317^2 lines of a period, roots by bisection. The fraction below 0.35 is
/// 0.612925 to 2e-6; the area at 0, the sum of a component of the normal over the crossings, is
/// 3.09164 to 3e-5. At level 0 inversion swaps the sides, so opposite caps make up a face.
#[test]
fn the_gyroid_converges_with_second_order() {
    check("gyroid dilate 0.35 box", |found| found.volume, 8.0 * 0.612_925);
    check("gyroid box", |found| found.area, 8.0 * 3.091_64 + 12.0);
}
