//! The short table after a mesh is written, and rows that it shares with `alveole measure`.

use super::table::{Table, significant};
use crate::job::{Report, Survey};
use crate::measure::Phase;

/// What was made, and what a survey found of it.
pub(super) fn summary(report: &Report, survey: Option<&Survey>, seconds: f64) -> String {
    let Report { cells, bounds: [lo, hi], contour, .. } = report;
    let mut table = Table::default();
    let point = |p: &[f64; 3]| p.map(significant).join(", ");
    table.text("box", &format!("{} to {}", point(lo), point(hi)));
    table.text("grid cells", &cells.map(|n| n.to_string()).join(" x "));
    table.text("vertices", &contour.vertices.to_string());
    table.text("triangles", &contour.triangles.to_string());
    table.text("Euler characteristic", &contour.euler().to_string());
    table.densities(&report.densities);
    if let Some(survey) = survey {
        table.survey(survey);
    }
    table.text("seconds", &format!("{seconds:.2}"));
    table.render()
}

impl Table {
    /// Adds what a survey found, the Euler characteristic apart.
    fn survey(&mut self, survey: &Survey) {
        let Survey {
            volume,
            relative_density,
            area,
            specific_surface,
            euler: _,
            handles,
            overhang_area,
            overhang_angle_deg,
            up: _,
            solid,
            void,
            report: _,
        } = survey;
        self.number("volume", *volume);
        self.number("relative density (of the box)", *relative_density);
        self.number("area", *area);
        self.number("area over volume", *specific_surface);
        self.overhang(*overhang_area, *overhang_angle_deg);
        self.phases(solid, void, *handles);
    }

    /// Adds the area that overhangs.
    pub(super) fn overhang(&mut self, area: f64, angle_deg: f64) {
        self.number(&format!("area overhanging by {}°", significant(angle_deg)), area);
    }

    /// Adds what hangs together.
    pub(super) fn phases(&mut self, solid: &Phase, void: &Phase, handles: i64) {
        self.text("solid", &phase(solid));
        self.text("void", &phase(void));
        self.text("handles", &handles.to_string());
    }
}

/// A phase in a line.
fn phase(phase: &Phase) -> String {
    let Phase {
        components,
        largest_share,
        enclosed,
        enclosed_share,
        percolates,
        percolating_share: _,
        nodes: _,
    } = phase;
    let mut line = match components {
        0 => return "none".to_owned(),
        1 => "1 component".to_owned(),
        more => {
            format!("{more} components, {} of it not in the largest", percent(1.0 - largest_share))
        }
    };
    let named = ["x", "y", "z"].into_iter().zip(percolates);
    let axes: Vec<_> = named.filter(|(_, is)| **is).map(|(axis, _)| axis).collect();
    line += &match axes.as_slice() {
        [] => ", percolating along no axis".to_owned(),
        axes => format!(", percolating along {}", axes.join(", ")),
    };
    // All of a part that stands in its box is enclosed.
    if (1..*components).contains(enclosed) {
        line += &format!("; {enclosed} enclosed, {} of it", percent(*enclosed_share));
    }
    line
}

/// A share in percent, however small.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent >= 0.1 || percent == 0.0 {
        format!("{percent:.1} %")
    } else {
        format!("{percent:.0e} %")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phase_is_told_in_a_line() {
        let of = |components, enclosed, percolates| {
            phase(&Phase {
                components,
                largest_share: 0.5,
                enclosed,
                enclosed_share: 1e-4,
                percolates,
                ..Phase::default()
            })
        };
        assert_eq!(of(0, 0, [false; 3]), "none");
        assert_eq!(of(1, 0, [true; 3]), "1 component, percolating along x, y, z");
        assert_eq!(
            of(3, 1, [false, true, false]),
            "3 components, 50.0 % of it not in the largest, percolating along y; 1 enclosed, 1e-2 % of it"
        );
        assert_eq!(of(1, 1, [false; 3]), "1 component, percolating along no axis");
    }
}
