//! The solids of the paper's Figures 3 and 4, at its own settings and twice as fine.
//!
//! Volumes converge to those of the solids with second order. Source: the Cesogen paper, section
//! 4.1; the true volumes are extrapolated from an independent program's, to 1e-4.
#![allow(clippy::unwrap_used)]

mod common;

use common::sound_volume;

/// A panel of the figures.
struct Panel {
    surface: &'static str,
    /// The spacing is 2/m.
    m: f64,
    /// The offset of Figure 3, half the thickness of Figure 4.
    offset: f64,
    /// True volumes of `dilate` and of `shell` in the box.
    volumes: [f64; 2],
    /// Relative error allowed to the shell at m: its walls are few spacings thick, and what the
    /// chamfered edges and the joined corners of thin walls add is most where they are thinnest.
    shell_error: f64,
}

const fn panel(
    surface: &'static str,
    m: f64,
    offset: f64,
    volumes: [f64; 2],
    shell_error: f64,
) -> Panel {
    Panel { surface, m, offset, volumes, shell_error }
}

const PANELS: [Panel; 9] = [
    panel("gyroid", 60.0, 0.35, [4.9033, 1.8067], 6e-3),
    panel("d-surface", 60.0, 0.35, [5.1489, 2.2978], 6e-3),
    panel("p-surface", 60.0, 0.35, [4.7994, 1.5988], 6e-3),
    panel("iwp", 85.0, 0.35, [4.1273, 0.7367], 6e-3),
    panel("neovius", 60.0, 0.35, [4.6087, 1.2173], 1.2e-2),
    panel("c-y", 85.0, 0.35, [4.6166, 1.2333], 6e-3),
    panel("lidinoid", 85.0, 0.35, [4.1890, 2.1646], 1.6e-2),
    panel("octo", 60.0, 0.1, [4.5485, 1.6707], 1.2e-2),
    panel("frd", 95.0, 0.55, [4.3027, 1.1463], 6e-3),
];

/// Checks the errors of a program's volume at m and 2m, and that they fall as the square of the
/// spacing where they are larger than what is unknown of the true volume.
fn check(program: &str, m: f64, volume: f64, allowed: [f64; 2]) {
    let error = |m: f64| sound_volume(program, 2.0 / m) / volume - 1.0;
    let [coarse, fine] = [m, 2.0 * m].map(error);
    assert!(coarse.abs() <= allowed[0], "{program} at {m}: off by {coarse:.2e}");
    assert!(fine.abs() <= allowed[1], "{program} at twice {m}: off by {fine:.2e}");
    if coarse.abs() > 2e-3 {
        assert!((fine / coarse).abs() < 0.3, "{program}: off by {coarse:.2e}, then {fine:.2e}");
    }
}

#[test]
fn dilated_surfaces_have_their_volumes() {
    for Panel { surface, m, offset, volumes, .. } in PANELS {
        check(&format!("box {surface} dilate {offset}"), m, volumes[0], [3.5e-3, 1e-3]);
    }
}

#[test]
fn shells_of_surfaces_have_their_volumes() {
    for Panel { surface, m, offset, volumes, shell_error } in PANELS {
        let program = format!("box {surface} shell 2*{offset}");
        check(&program, m, volumes[1], [shell_error, 4e-3]);
    }
}

#[test]
fn a_box_is_exact_whether_or_not_the_spacing_divides_it() {
    for spacing in [2.0 / 49.0, 2.0 / 100.0, 0.07, 0.3, 1.0, 2.0, 5.0] {
        let volume = sound_volume("box", spacing);
        assert!((volume - 8.0).abs() < 1e-12, "{volume} at {spacing}");
    }
}
