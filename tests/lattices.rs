//! Lattices as engineers ask for them: walls of a true thickness, numbers that vary in space.
#![allow(clippy::unwrap_used)]

use alveole::job::{Job, Settings};
use alveole::num::Progress;
use std::f64::consts::PI;

/// The volume of the solid of `program` itself, from its field, on a grid of that spacing.
fn volume(program: &str, spacing: f64) -> f64 {
    let job = Job::parse(program).unwrap_or_else(|fault| panic!("{program}: {fault}"));
    let settings = Settings::with_spacing(spacing);
    let found = job.field_measures(&settings, &Progress::new());
    found.unwrap_or_else(|fault| panic!("{program}: {fault}")).volume.value
}

#[test]
fn walls_of_true_thickness_follow_the_tube_formula() {
    // Area and Euler characteristic of a cell, computed apart from this crate on periodic grids.
    for (surface, area, characteristic) in
        [("gyroid", 3.0917, -8.0), ("p-surface", 2.3525, -4.0), ("d-surface", 3.838, -16.0)]
    {
        for thickness in [0.05_f64, 0.1, 0.15] {
            let program = format!("{surface} thickness {thickness} box scale 0.5");
            let found = volume(&program, 1.0 / 60.0);
            let expected = area * thickness + PI / 6.0 * characteristic * thickness.powi(3);
            // The areas are those of the nodal surfaces to four digits; these are not quite
            // minimal, as the formula assumes.
            let error = found / expected - 1.0;
            assert!(error.abs() < 2e-3, "{program}: {found}, not {expected} ({error:+.1e})");
        }
    }
}

#[test]
fn walls_by_the_gradient_are_thin() {
    // Published for f / |grad f| of the gyroid at a thickness of a tenth: 0.2944 of the volume.
    let found = volume("gyroid thickness 0.1 method gradient box scale 0.5", 1.0 / 80.0);
    assert!((found - 0.2944).abs() < 5e-4, "{found}");
}

#[test]
fn a_wall_may_vary_in_thickness() {
    let found = volume("gyroid thickness '0.1+0.1*z' box scale 0.5", 1.0 / 60.0);
    // The mean of the tube formula over thicknesses from 0.05 to 0.15 by Simpson's rule, exact for
    // cubics. The sheet's area is spread evenly along z to a part in a hundred.
    let tube = |t: f64| 3.0917 * t - 8.0 * PI / 6.0 * t.powi(3);
    let expected = (tube(0.05) + 4.0 * tube(0.1) + tube(0.15)) / 6.0;
    assert!((found / expected - 1.0).abs() < 1e-2, "{found}, not {expected}");
}

#[test]
fn motions_that_vary_along_another_axis_keep_the_volume() {
    for motion in ["translate '0.3*z,0.2*sin(3*z),0'", "rotate 'z/2+z^2/5' 0,0,1"] {
        let found = volume(&format!("box {motion} sphere scale 3"), 0.05);
        assert!((found - 8.0).abs() < 0.02, "{motion}: {found}");
    }
}

#[test]
fn scaling_that_varies_along_its_own_axis_moves_the_faces() {
    // x / (1 + x/4) = ±1 at x = 4/3 and -4/5.
    let found = volume("box scale '1+x/4,1,1' box scale 2,2,2", 0.05);
    // The far face lies between nodes, where its edges are cut off.
    assert!((found - 4.0 * (4.0 / 3.0 + 0.8)).abs() < 1e-4, "{found}");
}

#[test]
fn a_level_may_vary() {
    // The volume fraction of the gyroid is 1/2 + 0.3225 t to 1e-3.
    let found = volume("gyroid dilate '0.2+0.1*z' box", 0.05) / 8.0;
    assert!((found - 0.5645).abs() < 1e-3, "{found}");
}

#[test]
fn stretched_cells_have_the_lengths_asked_for() {
    // Slabs of the lattice cos(tau z) < 0 stand at half-integral phases, here z = (e^(phi/5)-1)/0.4.
    let found = volume("cos(tau*z) stretch z '0.5+0.2*z' box translate 0,0,1", 0.01);
    let place = |phase: f64| 2.5 * ((phase / 5.0).exp() - 1.0);
    let slabs = [(0.25, 0.75), (1.25, 1.75), (2.25, 2.75)];
    let expected: f64 = slabs.map(|(a, b)| 4.0 * (place(b) - place(a))).iter().sum();
    assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
}

#[test]
fn fillets_add_what_their_section_says() {
    // Two unit-wide beams that cross at right angles: four fillets of radius r, each a square less
    // a quarter of a disc, along the beams' height of 2.
    let program = "'max(abs(x)-2,abs(y)-0.5)' 'max(abs(x)-0.5,abs(y)-2)' rounded-union 0.4 \
                   box scale 2,2,1";
    let found = volume(program, 0.02);
    let expected = 14.0 + 4.0 * 2.0 * 0.16 * (1.0 - PI / 4.0);
    assert!((found - expected).abs() < 2e-4, "{found}, not {expected}");
}
