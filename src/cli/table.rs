//! Tables of named quantities for people.

use crate::job::Density;
use crate::measure::Estimate;
use crate::mesh::check::Check;
use crate::mesh::measure::Measures;
use std::fmt::Write;

/// Rows of a name and a value.
#[derive(Debug, Default)]
pub(super) struct Table {
    rows: Vec<(String, String)>,
}

impl Table {
    /// Adds a text.
    pub(super) fn text(&mut self, name: &str, value: &str) {
        self.rows.push((name.to_owned(), value.to_owned()));
    }

    /// Adds a number, with ten significant digits.
    pub(super) fn number(&mut self, name: &str, value: f64) {
        self.text(name, &significant(value));
    }

    /// Adds a number with its likely error.
    pub(super) fn estimate(&mut self, name: &str, Estimate { value, error }: Estimate) {
        self.text(name, &format!("{} +- {error:.1e}", significant(value)));
    }

    /// Adds area, bounds and quality.
    pub(super) fn measures(&mut self, measures: &Measures) {
        let Measures { volume: _, area, lo, hi, centroid, quality, sides } = measures;
        let point = |p: &[f64; 3]| p.map(significant).join(", ");
        self.number("area", *area);
        self.text("bounds", &format!("{} to {}", point(lo), point(hi)));
        if let Some(centroid) = centroid {
            self.text("centroid", &point(centroid));
        }
        self.text(
            "triangle angles",
            &format!(
                "least {:.4}, mean of the least {:.2} degrees",
                quality.least_angle_deg, quality.mean_least_angle_deg
            ),
        );
        self.text(
            "triangle sides",
            &format!(
                "{} to {}, mean {}",
                significant(sides.least),
                significant(sides.greatest),
                significant(sides.mean)
            ),
        );
    }

    /// Adds counts, topology and defects.
    pub(super) fn check(&mut self, check: &Check) {
        self.text("vertices", &check.vertices.to_string());
        self.text("triangles", &check.triangles.to_string());
        self.text("components", &check.components.len().to_string());
        self.text("Euler characteristic", &check.euler.to_string());
        if let Some(genus) = check.genus {
            self.text("genus", &genus.to_string());
        }
        if check.inside_out {
            self.text("defect", "the mesh is inside out");
        }
        for (name, defect) in check.defects.by_name() {
            let Some(example) = defect.examples.first() else { continue };
            let [x, y, z] = example.position;
            self.text("defect", &format!("{} {name}, the first at ({x}, {y}, {z})", defect.count));
        }
    }

    /// Adds the densities that levels were solved for.
    pub(super) fn densities(&mut self, densities: &[Density]) {
        for Density { asked, found, error, level } in densities {
            self.text(
                &format!("density {}", significant(*asked)),
                &format!("{found:.5} ± {error:.0e} at level {}", significant(*level)),
            );
        }
    }

    /// The table as lines of text, values aligned.
    pub(super) fn render(&self) -> String {
        let width = self.rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        let mut text = String::new();
        for (name, value) in &self.rows {
            // Writing to a string can't fail.
            let _ = writeln!(text, "{name:width$}  {value}");
        }
        text
    }
}

/// Lines of cells as text, the cells of a column aligned at their left; all lines have as many cells.
pub(super) fn columns<L: AsRef<[String]>>(lines: &[L]) -> String {
    let mut widths = Vec::new();
    for line in lines {
        let line = line.as_ref();
        widths.resize(line.len(), 0);
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = cell.chars().count().max(*width);
        }
    }
    let mut text = String::new();
    for line in lines {
        let cells = line.as_ref().iter().zip(&widths);
        let cells: Vec<_> = cells.map(|(cell, &width)| format!("{cell:width$}")).collect();
        text += cells.join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// The number with ten significant digits, without trailing zeros.
pub(super) fn significant(value: f64) -> String {
    const DIGITS: i32 = 10;
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let magnitude = libm::log10(value.abs()).floor() as i32;
    if !(-5..15).contains(&magnitude) {
        return format!("{value:.9e}");
    }
    let text = format!("{value:.*}", (DIGITS - 1 - magnitude).max(0) as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_ten_digits_and_no_trailing_zeros() {
        let check = |value, expected: &str| assert_eq!(significant(value), expected);
        check(8.0, "8");
        check(0.1, "0.1");
        check(4.903_312_345_678, "4.903312346");
        check(-1234.5, "-1234.5");
        check(1e-9, "1.000000000e-9");
        check(f64::INFINITY, "inf");
    }

    #[test]
    fn values_are_aligned() {
        let mut table = Table::default();
        table.number("volume", 8.0);
        table.text("x", "y");
        assert_eq!(table.render(), "volume  8\nx       y\n");
        let lines = [["a", "bcd", ""], ["ef", "g", "h"]].map(|line| line.map(str::to_owned));
        assert_eq!(columns(&lines), "a   bcd\nef  g    h\n");
    }
}
