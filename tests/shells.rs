//! Thickness of walls as reported, and the boxes that offsets grow.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::job::Settings;
use alveole::measure::walls::Walls;
use alveole::mesh::measure::measure;
use alveole::mesh::sink::Collect;
use alveole::num::Progress;
use common::{job, sound_mesh, sound_volume};
use std::f64::consts::PI;

/// The walls that contouring a program reports.
fn walls(program: &str, spacing: f64) -> Walls {
    let (job, settings) = (job(program), Settings::with_spacing(spacing));
    let grid = job.grid(&settings).unwrap();
    let mut sink = Collect::default();
    job.contour(&grid, &settings, &Progress::new(), &mut sink).unwrap().walls.unwrap()
}

#[test]
fn walls_of_a_distance_are_as_thick_as_they_were_asked_to_be() {
    for (spacing, thin) in [(0.05, 0.0), (0.15, 1.0)] {
        let found = walls("sphere shell 0.2", spacing);
        assert!((found.minimum - 0.2).abs() < 1e-12, "{found:?}");
        assert_eq!(found.thin_fraction, thin, "{found:?}");
    }
}

#[test]
fn walls_of_a_level_are_thin_where_the_field_is_steep() {
    // The gyroid's slope is sqrt(3) tau at most, which it reaches on its surface.
    let found = walls("gyroid shell 0.1 box", 2.0 / 160.0);
    let thinnest = 0.1 / (3.0_f64.sqrt() * 2.0 * PI);
    assert!((1.0..1.01).contains(&(found.minimum / thinnest)), "{found:?}");
    assert_eq!(found.thin_fraction, 1.0);
    // A wall is thinner than two spacings where the slope is above 10.5: on 0.0191 of the area by
    // integrals over 400^2 lines. The mesh's vertices are a sample of it.
    let found = walls("gyroid shell 0.7 box", 2.0 / 60.0);
    assert!((found.thin_fraction / 0.0191 - 1.0).abs() < 0.15, "{found:?}");
}

#[test]
fn walls_and_struts_of_a_length_are_as_thick_as_they_were_asked_to_be() {
    for (program, thickness) in [
        ("gyroid thickness 0.1 box", 0.1),
        ("gyroid scale 0.5 thickness 0.1 method gradient scale 2 box", 0.2),
        ("octet radius 0.05 box", 0.1),
        ("octet radius 0.05 fillet 0.05 scale 2 rotate 1 1,2,3 box", 0.2),
        ("iso-truss radius 0.1 box", 0.2 * 0.806),
        ("kelvin-plates thickness 0.1 box", 0.1),
        ("voronoi-walls thickness 0.2 box", 0.2),
        ("sphere kelvin fill size 0.5 skin 0.1", 0.05),
        ("box octet difference", 0.1),
    ] {
        // The last cell of a grid may be a quarter longer than the others.
        for (spacing, thin) in [(thickness / 3.0, 0.0), (thickness / 1.5, 1.0)] {
            let found = walls(program, spacing);
            assert!((found.minimum / thickness - 1.0).abs() < 1e-3, "{program}: {found:?}");
            assert_eq!(found.thin_fraction, thin, "{program}: {found:?}");
        }
    }
    // A quarter of the height is thinner than two spacings.
    let found = walls("plane thickness '0.3+0.2*x' box", 0.1);
    assert!((0.1 - 1e-12..0.11).contains(&found.minimum), "{found:?}");
    assert!((found.thin_fraction - 0.25).abs() < 0.03, "{found:?}");
    // What became thicker is on no wall of that length any more, and maps keep no lengths.
    for program in ["octet dilate 0.1 box", "octet stretch x 2 box", "octet density 0.3 box"] {
        let (job, settings) = (job(program), Settings::with_spacing(0.2));
        let grid = job.grid(&settings).unwrap();
        let found = job.contour(&grid, &settings, &Progress::new(), &mut Collect::default());
        assert_eq!(found.unwrap().walls, None, "{program}");
    }
}

#[test]
fn offsets_grow_the_box_by_as_much_as_the_solid() {
    let check = |program: &str, half: [f64; 3]| {
        let found = measure(&sound_mesh(program, 0.05));
        for (end, lo, hi) in [0, 1, 2].map(|a| (half[a], found.lo[a], found.hi[a])) {
            // Curved solids end between nodes, up to a few hundredths of a spacing within the box.
            assert!((hi - end).abs() < 2e-3 && (lo + end).abs() < 2e-3, "{program}: {lo} to {hi}");
        }
    };
    check("sphere dilate 0.5", [1.5; 3]);
    check("sphere shell 0.2", [1.1; 3]);
    check("box dilate 0.25", [1.25; 3]);
    check("box scale 2,1,1 translate 1,0,0 translate -1,0,0", [2.0, 1.0, 1.0]);
    check("sphere scale 2 dilate 0.5", [2.5; 3]);
}

/// The operation acts on the box alone: half of a box with round edges, since inversion swaps the
/// gyroid's sides.
#[test]
fn dilation_acts_on_the_last_shape_only() {
    let r: f64 = 0.35;
    let grown = 8.0 + 24.0 * r + 6.0 * PI * r * r + 4.0 / 3.0 * PI * r.powi(3);
    let volume = sound_volume("gyroid box dilate 0.35", 2.7 / 90.0);
    assert!((volume / (0.5 * grown) - 1.0).abs() < 2e-3, "{volume}, not half of {grown}");
}
