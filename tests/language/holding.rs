//! The box of a solid holds the solid, and grown by g*t it holds {f <= t}.

use crate::support::{Field, Random, parse, value};
use alveole::solid::Values;
use glam::DVec3;

/// Programs of exact and moved shapes: their fields are below `t` nowhere outside the grown box.
#[test]
fn no_point_of_a_random_solid_lies_outside_its_box() {
    for seed in 0..300 {
        let mut random = Random::new(1000 + seed);
        let words = random.bounded_program();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let program =
            parse(&words, &[]).unwrap_or_else(|e| panic!("{words:?} {:?}", e.diagnostics));
        let extent = program.solid.extent(&program.graph, &program.values());
        for t in [0.0, 0.3] {
            let held = extent.bounds.grown(extent.growth * t);
            for _ in 0..200 {
                let point = random.point(8.0);
                // A margin for the rounding of field and box, both of order 10.
                let margin = DVec3::splat(1e-12);
                if !held.grown(margin).contains(point) {
                    let found = value(&program.graph, program.solid.field, point.to_array());
                    assert!(
                        found >= t - 1e-12,
                        "seed {seed}: {words:?} is {found} at {point} with t = {t}"
                    );
                }
            }
        }
    }
}

/// The box as expressions is the box as numbers, but for the rounding of turned boxes.
#[test]
fn corners_of_random_solids_are_those_of_the_box() {
    let mut known = 0;
    for seed in 0..300 {
        let words = Random::new(3000 + seed).bounded_program();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let mut program = parse(&words, &[]).unwrap();
        let bounds = program.solid.extent(&program.graph, &program.values()).bounds;
        let Some(corners) = program.solid.corners(&mut program.graph) else { continue };
        known += 1;
        let parameters = program.values();
        let mut values = Values::new(&program.graph, &parameters);
        for (corner, expected) in corners.into_iter().zip([bounds.lo, bounds.hi]) {
            let found = DVec3::from_array(values.triple(corner));
            let error = (found - expected).abs().max_element();
            assert!(error <= 1e-12 * (1.0 + expected.length()), "seed {seed}: {words:?} {found}");
        }
    }
    assert!(known > 200, "{known}");
}

#[test]
fn no_field_is_steeper_than_its_bound() {
    for seed in 0..300 {
        let mut random = Random::new(2000 + seed);
        let words = random.bounded_program();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let program = parse(&words, &[]).unwrap();
        let lipschitz = program.solid.extent(&program.graph, &program.values()).lipschitz;
        for _ in 0..100 {
            let a = random.point(4.0);
            let b = a + random.point(0.1);
            let [fa, fb] = [a, b].map(|p| program.at(p.to_array()));
            let allowed = lipschitz * (a - b).length() + 1e-12;
            assert!((fa - fb).abs() <= allowed, "seed {seed}: {words:?} between {a} and {b}");
        }
    }
}

#[test]
fn periodic_fields_repeat_with_their_period() {
    for line in [
        "gyroid scale 2,3,4",
        "c-d",
        "q* scale 0.5 gyroid union",
        "lidinoid rotate pi/2 0,0,1 scale 1,2,1 shell 0.1",
    ] {
        let program = crate::support::program(line);
        let extent = program.solid.extent(&program.graph, &[]);
        let Some(period) = extent.period else { continue };
        let mut random = Random::new(7);
        for _ in 0..50 {
            let point = random.point(2.0);
            for shift in [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * period) {
                let [a, b] = [point, point + shift].map(|p| program.at(p.to_array()));
                assert!((a - b).abs() < 1e-10, "{line}: {a} and {b}");
            }
        }
    }
}
