//! ASLI's polynomials: from volume fraction, size of walls and size of pores to the level of a surface.
//!
//! ASLI does not solve for the level; it evaluates fits to its own cells. They are repeated here, so
//! that the same configuration makes the same solid, however far that is from what was asked for:
//! `density` and `thickness` are the exact ways to say it. The fits changed once, with other cells'
//! ranges and the sign of the level of I-WP; both sets are kept.
//!
//! Source: ASLI, `src/Infill.cpp` (functions `unnormalizeLevel`, `vFraction2level`, `wallSize2level`,
//! `poreSize2level`), the states of 2022 and 2023 for [`Release::Old`] and of 2024 for [`Release::New`].

use super::formula::Number;

/// Which ASLI a configuration is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Release {
    /// Those of 2019 to 2023.
    Old,
    /// Those since 2024.
    New,
}

/// A unit cell of ASLI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cell {
    /// What is on one side of a surface.
    Network(Surface),
    /// What is near a surface.
    Sheet(Surface),
    /// Struts along the edges of cubes.
    Cubic,
}

/// A surface of ASLI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Surface {
    /// Schoen's gyroid.
    Gyroid,
    /// Schwarz's D.
    Diamond,
    /// Schwarz's P, with the sign changed.
    Primitive,
    /// Schoen's I-WP, with the sign changed.
    Iwp,
}

/// What the value of a configuration means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    /// The level, its range mapped to that from 0 to 1.
    Isovalue,
    /// The share of solid.
    VolumeFraction,
    /// The size of walls, in cells.
    WallSize,
    /// The size of pores, in cells.
    PoreSize,
}

/// A polynomial of the value within limits; coefficients of rising powers.
struct Fit {
    limits: [f64; 2],
    coefficients: &'static [f64],
}

impl Cell {
    /// The cells by their names in ASLI, in the order of its help.
    pub(super) const ALL: [(&'static str, Self); 9] = [
        ("gyroid", Self::Network(Surface::Gyroid)),
        ("sheet_gyroid", Self::Sheet(Surface::Gyroid)),
        ("diamond", Self::Network(Surface::Diamond)),
        ("sheet_diamond", Self::Sheet(Surface::Diamond)),
        ("primitive", Self::Network(Surface::Primitive)),
        ("sheet_primitive", Self::Sheet(Surface::Primitive)),
        ("IWP", Self::Network(Surface::Iwp)),
        ("sheet_IWP", Self::Sheet(Surface::Iwp)),
        ("cubic", Self::Cubic),
    ];

    /// The cell called `name`.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, cell)| *cell)
    }

    /// The level t of the cell where `feature` has the value `value`.
    pub(super) fn level(self, release: Release, feature: Feature, value: &Number) -> Number {
        let Fit { limits: [least, most], coefficients } = self.fit(release, feature);
        value.clamped(least, most).polynomial(coefficients)
    }

    fn fit(self, release: Release, feature: Feature) -> Fit {
        const ALL: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
        let (limits, coefficients) = match feature {
            Feature::Isovalue => (ALL, self.isovalue(release)),
            Feature::VolumeFraction => {
                // The old sheet of gyroid stops short of 1, where its fit fails.
                let is_short = (self, release) == (Self::Sheet(Surface::Gyroid), Release::Old);
                ([0.0, if is_short { 0.999 } else { 1.0 }], self.fraction(release))
            }
            Feature::WallSize => {
                let (most, coefficients) = self.wall(release);
                ([0.0, most], coefficients)
            }
            Feature::PoreSize => {
                let (most, coefficients) = self.pore(release);
                ([0.0, most], coefficients)
            }
        };
        Fit { limits, coefficients }
    }

    /// The least level, and the greatest less the least.
    fn isovalue(self, release: Release) -> &'static [f64] {
        use Cell::{Cubic, Network, Sheet};
        use Release::{New, Old};
        use Surface::{Diamond, Gyroid, Iwp, Primitive};
        match (self, release) {
            (Network(Gyroid), Old | New) => &[-1.5, 3.0],
            (Sheet(Gyroid), Old) => &[0.0, 1.55],
            (Sheet(Gyroid), New) => &[0.0, 1.5],
            (Network(Diamond), Old) => &[-1.425, 2.85],
            (Network(Diamond), New) => &[-1.42, 2.84],
            (Sheet(Diamond), Old) => &[0.0, 1.45],
            (Sheet(Diamond), New) => &[0.0, 1.42],
            (Network(Primitive), Old) => &[-3.0, 6.0],
            (Network(Primitive), New) => &[-3.0, 6.01],
            (Sheet(Primitive), Old) => &[0.0, 3.05],
            (Sheet(Primitive), New) => &[0.0, 3.01],
            (Network(Iwp), Old) => &[-5.025, 8.05],
            (Network(Iwp), New) => &[-3.0, 8.0],
            (Sheet(Iwp), Old) => &[0.0, 5.05],
            (Sheet(Iwp), New) => &[0.0, 5.0],
            (Cubic, Old | New) => &[0.0, 0.71],
        }
    }

    fn fraction(self, release: Release) -> &'static [f64] {
        use Cell::{Cubic, Network, Sheet};
        use Release::{New, Old};
        use Surface::{Diamond, Gyroid, Iwp, Primitive};
        match (self, release) {
            (Network(Gyroid), Old | New) => &[-1.5, 3.0],
            (Sheet(Gyroid), Old) => &[-0.00224e-3, 1.59, -0.117],
            (Sheet(Gyroid), New) => &[0.0, 1.5486, -0.0486],
            (Network(Diamond), Old) => &[-1.36, 5.61, -19.59, 49.46, -54.60, 21.84],
            (Network(Diamond), New) => {
                &[-1.42, 9.5121, -74.9721, 364.3329, -930.7729, 1291.0637, -919.0071, 262.6834]
            }
            (Sheet(Diamond), Old) => &[-0.0108, 1.82, -5.48, 17.74, -23.55, 10.88],
            (Sheet(Diamond), New) => &[0.0, 0.7912, 6.5983, -33.7214, 75.7986, -77.7199, 29.6732],
            (Network(Primitive), Old) => &[-2.86, 18.57, -74.78, 170.67, -181.17, 72.43],
            (Network(Primitive), New) => &[-3.0, 21.9305, -96.7125, 227.6736, -244.8562, 97.9746],
            (Sheet(Primitive), Old) => &[-0.0250, 2.83, -8.89, 26.90, -34.93, 17.03],
            (Sheet(Primitive), New) => {
                &[0.0, 3.2223, -29.3794, 200.6042, -633.4513, 1009.5031, -788.9678, 241.4790]
            }
            (Network(Iwp), Old) => {
                &[3.08, -6.61, 54.92, -393.14, 1219.46, -1936.45, 1529.72, -475.82]
            }
            (Network(Iwp), New) => {
                &[-3.0, 5.8392, -59.4099, 462.7837, -1495.7952, 2430.5479, -1945.4597, 609.4940]
            }
            (Sheet(Iwp), Old) => {
                &[-0.0343, 6.70, -48.91, 325.14, -1049.81, 1749.51, -1448.85, 471.14]
            }
            (Sheet(Iwp), New) => {
                &[0.0, 6.3703, -53.5909, 383.7502, -1279.0549, 2160.0684, -1795.0308, 582.4877]
            }
            (Cubic, Old) => &[0.005943, 2.332, -21.46, 117.2, -332.8, 501.8, -380.7, 114.3],
            (Cubic, New) => {
                &[0.0, 2.8402, -30.1344, 173.9104, -509.3130, 782.2430, -600.4298, 181.5936]
            }
        }
    }

    /// The greatest size of walls, and the fit.
    fn wall(self, release: Release) -> (f64, &'static [f64]) {
        use Cell::{Cubic, Network, Sheet};
        use Release::{New, Old};
        use Surface::{Diamond, Gyroid, Iwp, Primitive};
        match (self, release) {
            (Network(Gyroid), Old) => (0.848, &[-1.43, 1.05, 2.80, 19.83, -37.50, 16.70]),
            (Network(Gyroid), New) => {
                (0.7761, &[-1.4292, 1.1123, 2.0586, 22.7985, -42.2134, 19.2938])
            }
            (Sheet(Gyroid), Old) => (0.425, &[-0.0350, 6.55, -6.99]),
            (Sheet(Gyroid), New) => {
                (0.4769, &[-0.0018, 5.7957, -7.9287, 47.1949, -172.5956, 175.2846])
            }
            (Network(Diamond), Old) => (0.71, &[-0.984, 0.904, 10.63, -10.19]),
            (Network(Diamond), New) => (0.6864, &[-1.0143, 1.2004, 9.8086, -9.5197]),
            (Sheet(Diamond), Old) => (0.48, &[-0.0396, 7.07, -13.42, 10.71]),
            (Sheet(Diamond), New) => (0.4365, &[0.0, 5.8008, -6.0142]),
            (Network(Primitive), Old) => (1.285, &[-0.999, 0.604, 3.55, 2.18, -4.21, 1.19]),
            (Network(Primitive), New) => (1.2202, &[-0.9970, 0.1082, 6.3135, -3.1200]),
            (Sheet(Primitive), Old) => (0.86, &[7.80e-05, 5.44, 0.0212, -3.07, 0.170, 0.355]),
            (Sheet(Primitive), New) => (0.7541, &[-0.0007, 5.5064, -0.4280, -2.2617]),
            (Network(Iwp), Old) => (0.79, &[3.00, -0.156, -29.07, -3.51, 50.44, -24.81]),
            (Network(Iwp), New) => (0.7346, &[-3.0, -0.9792, 40.0955, -33.0667]),
            (Sheet(Iwp), Old) => {
                (0.67, &[-0.0134, 17.61, -77.60, 943.10, -5727.87, 15460.84, -18974.65, 8707.20])
            }
            (Sheet(Iwp), New) => (0.6415, &[0.0, 12.9334, 58.1260, -454.0008, 947.9448, -626.0384]),
            (Cubic, Old) => (1.356476, &[0.01988, 0.4993]),
            (Cubic, New) => {
                (1.3565, &[0.0, 0.9585, -3.1702, 10.1052, -16.9656, 15.5225, -7.3270, 1.3964])
            }
        }
    }

    /// The greatest size of pores, and the fit.
    #[allow(clippy::approx_constant, reason = "a fit's 6.28 is no multiple of pi")]
    fn pore(self, release: Release) -> (f64, &'static [f64]) {
        use Cell::{Cubic, Network, Sheet};
        use Release::{New, Old};
        use Surface::{Diamond, Gyroid, Iwp, Primitive};
        match (self, release) {
            (Network(Gyroid), Old) => (0.848, &[1.52, -0.486, -7.57, -6.28, 21.03, -9.61]),
            (Network(Gyroid), New) => {
                (0.7761, &[1.4961, -0.1128, -9.7480, -0.6083, 14.2529, -6.5775])
            }
            (Sheet(Gyroid), Old) => (0.425, &[1.47, -0.314, -6.84, -15.23, 50.37, -40.61]),
            (Sheet(Gyroid), New) => (0.4212, &[1.4886, 0.1637, -12.3632, 8.9919]),
            (Network(Diamond), Old) => (0.78, &[1.40, -0.497, -11.42, 9.63]),
            (Network(Diamond), New) => (0.7601, &[1.3822, -0.3794, -11.5654, 9.6452]),
            (Sheet(Diamond), Old) => (0.41, &[1.41, -1.09, 3.81, -65.70, 153.92, -119.84]),
            (Sheet(Diamond), New) => {
                (0.4097, &[1.3939, -0.4082, -5.9832, -9.7175, 15.3286, 4.1403])
            }
            (Network(Primitive), Old) => (1.61, &[3.00, -0.504, -3.83, -1.56, 2.68, -0.619]),
            (Network(Primitive), New) => (1.5391, &[2.9258, 0.3522, -6.7912, 2.6777]),
            (Sheet(Primitive), Old) => (0.84, &[3.05, -1.42, 1.23, -13.67, 15.75, -5.86]),
            (Sheet(Primitive), New) => (0.8309, &[2.9750, -0.0967, -5.7828, 2.0385]),
            (Network(Iwp), Old) => (0.77, &[-4.94, -0.408, 44.62, -19.91, -64.79, 50.55]),
            (Network(Iwp), New) => (0.7098, &[5.0085, -1.1781, -40.9767, 38.2058]),
            (Sheet(Iwp), Old) => (0.42, &[4.96, -0.511, -33.51, -32.62, 173.24, -133.09]),
            (Sheet(Iwp), New) => (0.4164, &[4.9112, 1.1684, -51.6997, 51.0962]),
            (Cubic, Old) => (1.709269, &[0.6783, -0.4743]),
            (Cubic, New) => (1.7093, &[0.6945, -0.4706, -0.2586, 0.6325, -0.5959, 0.1914]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(cell: &str, release: Release, feature: Feature, value: f64, expected: f64) {
        let level = Cell::named(cell).unwrap().level(release, feature, &Number::Fixed(value));
        let Number::Fixed(level) = level else { panic!("{level:?} is no number") };
        assert!((level - expected).abs() < 5e-4, "{cell} {value}: {level} is not {expected}");
    }

    #[test]
    fn levels_are_those_of_a_field_study() {
        // Levels at a share of 0.30 by the fits of 2022, to the digits of an independent evaluation.
        check("sheet_gyroid", Release::Old, Feature::VolumeFraction, 0.3, 0.4665);
        check("gyroid", Release::Old, Feature::VolumeFraction, 0.3, -0.6);
        check("sheet_diamond", Release::Old, Feature::VolumeFraction, 0.3, 0.357);
        check("primitive", Release::Old, Feature::VolumeFraction, 0.3, -0.703);
    }

    #[test]
    fn values_beyond_the_limits_count_as_the_limits() {
        check("gyroid", Release::New, Feature::VolumeFraction, 7.0, 1.5);
        check("gyroid", Release::New, Feature::Isovalue, 2.0, 4.5);
        let at = |value| Cell::Cubic.level(Release::Old, Feature::WallSize, &Number::Fixed(value));
        assert_eq!(at(1.4), at(1.356476));
        assert_eq!(at(-1.0), at(0.0));
    }

    #[test]
    fn fits_are_near_each_other_and_rise_with_the_solid() {
        use Feature::{PoreSize, VolumeFraction, WallSize};
        // A slip of a digit in a table would stand out: in the middle of their ranges, both sets give
        // nearly the same level, but for the sign that I-WP changed.
        for (name, cell) in Cell::ALL {
            let sign = if cell == Cell::Network(Surface::Iwp) { -1.0 } else { 1.0 };
            for (feature, values) in [
                (VolumeFraction, [0.35, 0.45, 0.55]),
                (WallSize, [0.2, 0.25, 0.3]),
                (PoreSize, [0.2, 0.3, 0.35]),
            ] {
                for value in values {
                    let at = |release| match cell.level(release, feature, &Number::Fixed(value)) {
                        Number::Fixed(level) => level,
                        Number::Varying(text) => panic!("{text}"),
                    };
                    let (old, new) = (sign * at(Release::Old), at(Release::New));
                    let scale = cell.isovalue(Release::New)[1];
                    let is_rough = (cell, feature) == (Cell::Sheet(Surface::Iwp), WallSize);
                    let allowed = if is_rough { 0.2 } else { 0.06 };
                    let is_near = (old - new).abs() < allowed * scale;
                    assert!(is_near, "{name} {feature:?} {value}: {old} and {new}");
                }
            }
        }
    }
}
