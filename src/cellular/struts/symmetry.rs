//! Symmetries of unit cells: the operations that make a whole cell of a few generators.
//!
//! An operation permutes and reflects the coordinates and then moves by a fraction of the cell. All
//! is meant modulo translations by whole cells, so that a symmetry about the cell's corner is one
//! about its middle, too.
//!
//! Source: International Tables for Crystallography, volume A; the numbers of the space groups stand
//! at the variants.

use glam::DVec3;

/// The operations that make a cell of its generators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// All of the cube, 48: Pm-3m, 221.
    Cubic,
    /// Those of the tetrahedron, 24: P-43m, 215.
    Tetrahedral,
    /// Those of the square prism about the z axis, 16: P4/mmm, 123.
    Tetragonal,
    /// Those of the clathrates and of the A15 structure, 48: Pm-3n, 223.
    Clathrate,
    /// Cyclic exchanges of the axes, 3: P3 about the diagonal.
    Cyclic,
}

/// Translations by fractions of a cell that are symmetries, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centring {
    /// None.
    Primitive,
    /// By half a cell along all axes.
    Body,
    /// By half a cell along two axes.
    Face,
}

/// A permutation with signs, and a translation after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Operation {
    axes: [usize; 3],
    signs: DVec3,
    shift: DVec3,
}

impl Operation {
    /// The image of a point.
    #[must_use]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.direction(p) + self.shift
    }

    /// The image of a direction.
    #[must_use]
    pub fn direction(&self, d: DVec3) -> DVec3 {
        self.signs * DVec3::from_array(self.axes.map(|axis| d[axis]))
    }

    /// How far points are moved in the end.
    #[must_use]
    pub const fn shift(&self) -> DVec3 {
        self.shift
    }
}

/// The permutations of the axes, even ones first.
const PERMUTATIONS: [[usize; 3]; 6] =
    [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];

/// The operations of `symmetry`, with those that `centring` adds; the first is the identity.
#[must_use]
pub fn operations(symmetry: Symmetry, centring: Centring) -> Vec<Operation> {
    let signs = (0..8).map(|bits: u32| {
        DVec3::from_array([0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { -1.0 } else { 1.0 }))
    });
    let mut found = Vec::new();
    for (number, axes) in PERMUTATIONS.into_iter().enumerate() {
        let is_odd = number >= 3;
        for signs in signs.clone() {
            let is_even_in_sign = signs.element_product() > 0.0;
            let (belongs, half) = match symmetry {
                Symmetry::Cubic => (true, 0.0),
                Symmetry::Tetrahedral => (is_even_in_sign, 0.0),
                Symmetry::Tetragonal => (axes[2] == 2, 0.0),
                Symmetry::Clathrate => (true, if is_odd { 0.5 } else { 0.0 }),
                Symmetry::Cyclic => (!is_odd && signs == DVec3::ONE, 0.0),
            };
            if belongs {
                found.push(Operation { axes, signs, shift: DVec3::splat(half) });
            }
        }
    }
    let more: &[[f64; 3]] = match centring {
        Centring::Primitive => &[[0.0; 3]],
        Centring::Body => &[[0.0; 3], [0.5; 3]],
        Centring::Face => &[[0.0; 3], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0]],
    };
    let centred = |shift: &[f64; 3]| {
        let by = DVec3::from_array(*shift);
        found.iter().map(move |o| Operation { shift: o.shift + by, ..*o }).collect::<Vec<_>>()
    };
    more.iter().flat_map(centred).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_have_their_orders() {
        let check = |symmetry, centring, order| {
            let found = operations(symmetry, centring);
            assert_eq!(found.len(), order, "{symmetry:?} {centring:?}");
            let p = DVec3::new(0.1, 0.23, 0.37);
            assert_eq!(found[0].point(p), p);
        };
        check(Symmetry::Cubic, Centring::Primitive, 48);
        check(Symmetry::Tetrahedral, Centring::Face, 96);
        check(Symmetry::Tetragonal, Centring::Body, 32);
        check(Symmetry::Clathrate, Centring::Primitive, 48);
        check(Symmetry::Cyclic, Centring::Body, 6);
    }

    #[test]
    fn products_of_operations_are_operations() {
        for (symmetry, centring) in [
            (Symmetry::Tetrahedral, Centring::Face),
            (Symmetry::Clathrate, Centring::Primitive),
            (Symmetry::Cyclic, Centring::Body),
        ] {
            let all = operations(symmetry, centring);
            let p = DVec3::new(0.11, 0.23, 0.37);
            let wrapped = |p: DVec3| p - p.floor();
            for a in &all {
                for b in &all {
                    let image = wrapped(a.point(b.point(p)));
                    let near = |c: &Operation| (wrapped(c.point(p)) - image).length() < 1e-12;
                    assert!(all.iter().any(near), "{symmetry:?}: {a:?} {b:?}");
                }
            }
        }
    }
}
