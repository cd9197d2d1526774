//! The catalogue of triply periodic surfaces: names, formulas, sources.
//!
//! Each is a sum of products of waves of period 1: sin and cos of tau times an integer combination
//! of x, y and z. The solid is where the sum is negative. The sums are levels, not distances: an
//! offset by dilation, erosion or shell is a difference of level, and the same offset makes walls of
//! very different thickness on different surfaces.
//!
//! Waves are hash-consed, and each is a function of one product `(k*tau)*x`, so a sum that uses
//! `sin(2*tau*x)` thrice evaluates it once a plane of samples.
//!
//! Source: the Cesogen paper, Table 1 and equations 16 and 17, after Fisher et al., reference 11
//! there. `F`, `W` and `Q*` have zero sets that cross themselves: dilate or erode them a little.

use crate::expr::{Binary, Graph, NodeId, Unary};
use crate::geom::Axis::{self, X, Y, Z};
use crate::solid::Solid;
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::ops::{Add, Mul, Sub};

/// A row of the catalogue.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The word of the language.
    pub name: &'static str,
    /// Other spellings.
    pub aliases: &'static [&'static str],
    /// The name in Table 1.
    pub title: &'static str,
    /// What it is, in one line.
    pub help: &'static str,
    /// The formula as an equation of the language, where `cx` is `cos(tau*x)`, `s2y` is
    /// `sin(2*tau*y)`, and so on; combinations of coordinates are written out.
    pub formula: &'static str,
    /// An upper bound of the gradient's length.
    ///
    /// The greatest on 64^3 points of a period, times cos(2 pi d / 64)^(-3/2) for d the highest
    /// harmonic along an axis: |grad f|^2 is a trigonometric polynomial of degree 2d, which exceeds
    /// its greatest sample by no more than that factor squared (Ehlich & Zeller 1964, axis by axis).
    pub slope: f64,
    sum: for<'g> fn(Waves<'g>) -> Term<'g>,
}

impl Surface {
    /// Its field in `graph`.
    #[must_use]
    pub fn field(&self, graph: &mut Graph) -> NodeId {
        let graph = RefCell::new(graph);
        (self.sum)(Waves(&graph)).node
    }

    /// Its solid, of period 1 and without bounds.
    #[must_use]
    pub fn solid(&self, graph: &mut Graph) -> Solid {
        let field = self.field(graph);
        Solid::periodic(graph, field, 1.0, self.slope)
    }
}

/// The surfaces, in the order of Table 1.
pub const CATALOGUE: [Surface; 27] = [
    Surface {
        name: "gyroid",
        aliases: &["schoen-gyroid", "g-surface"],
        title: "Gyroid",
        help: "Schoen's gyroid",
        formula: "cx*sy + cy*sz + cz*sx",
        slope: 11.0,
        sum: |w| w.cyclic(|x, y, _| w.c(x) * w.s(y)),
    },
    Surface {
        name: "d-surface",
        aliases: &["diamond", "schwarz-d"],
        title: "D",
        help: "Schwarz's D, diamond",
        formula: "sx*sy*sz + cx*sy*cz + cy*sz*cx + cz*sx*cy",
        slope: 11.0,
        sum: |w| w.sines() + w.cyclic(|x, y, z| w.c(x) * w.s(y) * w.c(z)),
    },
    Surface {
        name: "p-surface",
        aliases: &["primitive", "schwarz-p"],
        title: "P",
        help: "Schwarz's P, primitive",
        formula: "cx + cy + cz",
        slope: 11.0,
        sum: |w| w.cyclic(|x, _, _| w.c(x)),
    },
    Surface {
        name: "iwp",
        aliases: &["i-wp", "iwp-surface", "schoen-iwp"],
        title: "IWP",
        help: "Schoen's I-WP",
        formula: "2*(cx*cy + cy*cz + cz*cx) - (c2x + c2y + c2z)",
        slope: 33.6,
        sum: |w| 2.0 * w.pairs(1) - w.cyclic(|x, _, _| w.c2(x)),
    },
    Surface {
        name: "neovius",
        aliases: &["neovius-surface"],
        title: "Neovius",
        help: "Neovius's surface, C(P)",
        formula: "4*cx*cy*cz + 3*(cx + cy + cz)",
        slope: 44.4,
        sum: |w| 4.0 * w.cosines(1) + 3.0 * w.cyclic(|x, _, _| w.c(x)),
    },
    Surface {
        name: "c-y",
        aliases: &["c(y)", "cy-surface"],
        title: "C(Y)",
        help: "complement of Y",
        formula: "-sx*sy*sz + s2x*sy + s2y*sz + s2z*sx - cx*cy*cz + cx*s2y + cy*s2z + cz*s2x",
        slope: 34.0,
        sum: |w| {
            w.cyclic(|x, y, _| w.s2(x) * w.s(y)) - w.sines() - w.cosines(1)
                + w.cyclic(|x, y, _| w.c(x) * w.s2(y))
        },
    },
    Surface {
        name: "lidinoid",
        aliases: &["lidinoid-surface"],
        title: "Lidinoid",
        help: "Lidin's lidinoid",
        formula: "s2x*cy*sz + s2y*cz*sx + s2z*cx*sy - (c2x*c2y + c2y*c2z + c2z*c2x) + 0.3",
        slope: 33.7,
        sum: |w| w.twist() - w.pairs(2) + 0.3,
    },
    Surface {
        name: "octo",
        aliases: &["octo-surface"],
        title: "OCTO",
        help: "the OCTO surface",
        formula: "0.6*(cx*cy + cy*cz + cz*cx) - 0.4*(cx + cy + cz) + 0.25",
        slope: 10.2,
        sum: |w| 0.6 * w.pairs(1) - 0.4 * w.cyclic(|x, _, _| w.c(x)) + 0.25,
    },
    Surface {
        name: "frd",
        aliases: &["f-rd", "schoen-frd"],
        title: "FRD",
        help: "Schoen's F-RD",
        formula: "8*cx*cy*cz + c2x*c2y*c2z - (c2x*c2y + c2y*c2z + c2z*c2x)",
        slope: 57.0,
        sum: |w| 8.0 * w.cosines(1) + w.cosines(2) - w.pairs(2),
    },
    Surface {
        name: "s-surface",
        aliases: &["fischer-koch-s"],
        title: "S",
        help: "Fischer and Koch's S",
        formula: "c2x*sy*cz + c2y*sz*cx + c2z*sx*cy",
        slope: 15.9,
        sum: |w| w.cyclic(|x, y, z| w.c2(x) * w.s(y) * w.c(z)),
    },
    Surface {
        name: "p-c-p",
        aliases: &["p+c(p)"],
        title: "P+C(P)",
        help: "P together with its complement",
        formula: "0.3*cx*cy*cz + 0.1*c2x*c2y*c2z + 0.2*(cx + cy + cz) + 0.1*(c2x + c2y + c2z) + 0.05*(c3x + c3y + c3z) + 0.1*(cx*cy + cy*cz + cz*cx)",
        slope: 7.9,
        sum: |w| {
            0.3 * w.cosines(1)
                + 0.1 * w.cosines(2)
                + 0.2 * w.cyclic(|x, _, _| w.c(x))
                + 0.1 * w.cyclic(|x, _, _| w.c2(x))
                + 0.05 * w.cyclic(|x, _, _| w.c3(x))
                + 0.1 * w.pairs(1)
        },
    },
    Surface {
        name: "split-p",
        aliases: &["split-p-surface"],
        title: "Split P",
        help: "P split into two layers",
        formula: "1.1*(s2x*cy*sz + s2y*cz*sx + s2z*cx*sy) - 0.2*(c2x*c2y + c2y*c2z + c2z*c2x) - 0.4*(c2x + c2y + c2z)",
        slope: 23.4,
        sum: |w| 1.1 * w.twist() - 0.2 * w.pairs(2) - 0.4 * w.cyclic(|x, _, _| w.c2(x)),
    },
    Surface {
        name: "f-surface",
        aliases: &[],
        title: "F",
        help: "the F surface; crosses itself at level 0, so dilate or erode it",
        formula: "cx*cy*cz",
        slope: 6.4,
        sum: |w| w.cosines(1),
    },
    Surface {
        name: "c-d",
        aliases: &["c(d)"],
        title: "C(D)",
        help: "complement of D",
        formula: "cos(tau*(3*x+y))*cz - sin(tau*(3*x-y))*sz + cos(tau*(x+3*y))*cz + sin(tau*(x-3*y))*sz + cos(tau*(x-y))*c3z - sin(tau*(x+y))*s3z",
        slope: 56.9,
        sum: |w| {
            w.cos([3.0, 1.0]) * w.c(Z) - w.sin([3.0, -1.0]) * w.s(Z)
                + w.cos([1.0, 3.0]) * w.c(Z)
                + w.sin([1.0, -3.0]) * w.s(Z)
                + w.cos([1.0, -1.0]) * w.c3(Z)
                - w.sin([1.0, 1.0]) * w.s3(Z)
        },
    },
    Surface {
        name: "g-prime",
        aliases: &["g'"],
        title: "G'",
        help: "the variant G' of the gyroid",
        formula: "s2x*cy*sz + s2y*cz*sx + s2z*cx*sy + 0.32",
        slope: 14.0,
        sum: |w| w.twist() + 0.32,
    },
    Surface {
        name: "g-prime-2",
        aliases: &["g'2"],
        title: "G'2",
        help: "the variant G'2 of the gyroid",
        formula: "5*(s2x*cy*sz + s2y*cz*sx + s2z*cx*sy) + c2x*c2y + c2y*c2z + c2z*c2x",
        slope: 74.7,
        sum: |w| 5.0 * w.twist() + w.pairs(2),
    },
    Surface {
        name: "d-prime",
        aliases: &["d'"],
        title: "D'",
        help: "the variant D' of D",
        formula: "0.5*(cx*cy*cz + sx*cy*sz + sy*cz*sx + sz*cx*sy) - 0.5*(s2x*s2y + s2y*s2z + s2z*s2x) - 0.2",
        slope: 16.3,
        sum: |w| {
            0.5 * (w.cosines(1) + w.cyclic(|x, y, z| w.s(x) * w.c(y) * w.s(z)))
                - 0.5 * w.cyclic(|x, y, _| w.s2(x) * w.s2(y))
                - 0.2
        },
    },
    Surface {
        name: "k-surface",
        aliases: &[],
        title: "K",
        help: "the K surface",
        formula: "0.3*(cx + cy + cz + cx*cy + cy*cz + cz*cx) - 0.4*(c2x + c2y + c2z) + 0.2",
        slope: 11.1,
        sum: |w| {
            0.3 * (w.cyclic(|x, _, _| w.c(x)) + w.pairs(1)) - 0.4 * w.cyclic(|x, _, _| w.c2(x))
                + 0.2
        },
    },
    Surface {
        name: "c-s",
        aliases: &["c(s)"],
        title: "C(S)",
        help: "complement of S",
        formula: "c2x + c2y + c2z + 2*(s2x*cy*s3z + s2y*cz*s3x + s2z*cx*s3y) + 2*(s2x*c3y*sz + s2y*c3z*sx + s2z*c3x*sy)",
        slope: 116.3,
        sum: |w| {
            w.cyclic(|x, _, _| w.c2(x))
                + 2.0 * w.cyclic(|x, y, z| w.s2(x) * w.c(y) * w.s3(z))
                + 2.0 * w.cyclic(|x, y, z| w.s2(x) * w.c3(y) * w.s(z))
        },
    },
    Surface {
        name: "y-surface",
        aliases: &["fischer-koch-y"],
        title: "Y",
        help: "Fischer and Koch's Y",
        formula: "sx*sy*sz + cx*s2y + cy*s2z + cz*s2x + cx*cy*cz + s2x*sy + s2y*sz + s2z*sx",
        slope: 46.9,
        sum: |w| {
            w.sines()
                + w.cyclic(|x, y, _| w.c(x) * w.s2(y))
                + w.cosines(1)
                + w.cyclic(|x, y, _| w.s2(x) * w.s(y))
        },
    },
    Surface {
        name: "pm-y",
        aliases: &["pmy", "+-y"],
        title: "±Y",
        help: "Fischer and Koch's +-Y",
        formula: "2*cx*cy*cz + s2x*sy + s2y*sz + s2z*sx",
        slope: 26.7,
        sum: |w| 2.0 * w.cosines(1) + w.cyclic(|x, y, _| w.s2(x) * w.s(y)),
    },
    Surface {
        name: "c-pm-y",
        aliases: &["c(+-y)"],
        title: "C(±Y)",
        help: "complement of +-Y",
        formula: "-2*cx*cy*cz + s2x*sy + s2y*sz + s2z*sx",
        slope: 22.5,
        sum: |w| w.cyclic(|x, y, _| w.s2(x) * w.s(y)) - 2.0 * w.cosines(1),
    },
    Surface {
        name: "c-i2-y",
        aliases: &["c(i2-y**)"],
        title: "C(I2-Y**)",
        help: "complement of I2-Y**",
        formula: "2*(s2x*cy*sz + s2y*cz*sx + s2z*cx*sy) + c2x*c2y + c2y*c2z + c2z*c2x",
        slope: 37.5,
        sum: |w| 2.0 * w.twist() + w.pairs(2),
    },
    Surface {
        name: "w-surface",
        aliases: &[],
        title: "W",
        help: "the W surface; crosses itself at level 0, so dilate or erode it",
        formula: "c2x*cy + c2y*cz + c2z*cx - (cx*c2y + cy*c2z + cz*c2x)",
        slope: 37.8,
        sum: |w| w.cyclic(|x, y, _| w.c2(x) * w.c(y)) - w.cyclic(|x, y, _| w.c(x) * w.c2(y)),
    },
    Surface {
        name: "q-star",
        aliases: &["q*"],
        title: "Q*",
        help: "the Q* surface, not of cubic symmetry",
        formula: "(cx - 2*cy)*cz - sqrt(3)*sz*(cos(tau*(x-y)) - cx) + cos(tau*(x-y))*cz",
        slope: 28.1,
        sum: |w| {
            (w.c(X) - 2.0 * w.c(Y)) * w.c(Z)
                - 3.0_f64.sqrt() * w.s(Z) * (w.cos([1.0, -1.0]) - w.c(X))
                + w.cos([1.0, -1.0]) * w.c(Z)
        },
    },
    Surface {
        name: "c-g",
        aliases: &["c(g)"],
        title: "C(G)",
        help: "complement of the gyroid",
        formula: "3*(sx*cy + sy*cz + sz*cx) + 2*(s3x*cy + s3y*cz + s3z*cx) - 2*(sx*c3y + sy*c3z + sz*c3x)",
        slope: 95.6,
        sum: |w| {
            3.0 * w.cyclic(|x, y, _| w.s(x) * w.c(y)) + 2.0 * w.cyclic(|x, y, _| w.s3(x) * w.c(y))
                - 2.0 * w.cyclic(|x, y, _| w.s(x) * w.c3(y))
        },
    },
    Surface {
        name: "slotted-p",
        aliases: &["slotted-p-surface"],
        title: "Slotted P",
        help: "P with slots",
        formula: "-2*(cx*cy + cy*cz + cz*cx) - 2*(c2x + c2y + c2z) + c2x*cy + c2y*cz + c2z*cx - (cx*c2y + cy*c2z + cz*c2x)",
        slope: 67.3,
        sum: |w| {
            w.cyclic(|x, y, _| w.c2(x) * w.c(y))
                - w.cyclic(|x, y, _| w.c(x) * w.c2(y))
                - 2.0 * w.pairs(1)
                - 2.0 * w.cyclic(|x, _, _| w.c2(x))
        },
    },
];

/// Sines and cosines of tau times the coordinates.
#[derive(Clone, Copy)]
struct Waves<'g>(&'g RefCell<&'g mut Graph>);

/// Methods are named as Table 1 names the waves: `s2(x)` is sin(tau * 2x).
impl<'g> Waves<'g> {
    fn s(self, axis: Axis) -> Term<'g> {
        self.wave(Unary::Sin, 1, axis)
    }

    fn s2(self, axis: Axis) -> Term<'g> {
        self.wave(Unary::Sin, 2, axis)
    }

    fn s3(self, axis: Axis) -> Term<'g> {
        self.wave(Unary::Sin, 3, axis)
    }

    fn c(self, axis: Axis) -> Term<'g> {
        self.wave(Unary::Cos, 1, axis)
    }

    fn c2(self, axis: Axis) -> Term<'g> {
        self.wave(Unary::Cos, 2, axis)
    }

    fn c3(self, axis: Axis) -> Term<'g> {
        self.wave(Unary::Cos, 3, axis)
    }

    /// The sum of `summand` over the cyclic permutations of the axes.
    fn cyclic(self, summand: impl Fn(Axis, Axis, Axis) -> Term<'g>) -> Term<'g> {
        summand(X, Y, Z) + summand(Y, Z, X) + summand(Z, X, Y)
    }

    /// SxSySz.
    fn sines(self) -> Term<'g> {
        self.s(X) * self.s(Y) * self.s(Z)
    }

    /// CxCyCz of `harmonic` times the coordinates.
    fn cosines(self, harmonic: u8) -> Term<'g> {
        let [x, y, z] = Axis::ALL.map(|axis| self.wave(Unary::Cos, harmonic, axis));
        x * y * z
    }

    /// CxCy + CyCz + CzCx of `harmonic` times the coordinates.
    fn pairs(self, harmonic: u8) -> Term<'g> {
        let wave = |axis| self.wave(Unary::Cos, harmonic, axis);
        self.cyclic(|x, y, _| wave(x) * wave(y))
    }

    /// S2xCySz + S2yCzSx + S2zCxSy, which five surfaces share.
    fn twist(self) -> Term<'g> {
        self.cyclic(|x, y, z| self.s2(x) * self.c(y) * self.s(z))
    }

    /// sin(tau (a x + b y)).
    fn sin(self, [a, b]: [f64; 2]) -> Term<'g> {
        self.slanted(a, b).map(|graph, sum| graph.unary(Unary::Sin, sum))
    }

    /// cos(tau (a x + b y)).
    fn cos(self, [a, b]: [f64; 2]) -> Term<'g> {
        self.slanted(a, b).map(|graph, sum| graph.unary(Unary::Cos, sum))
    }

    /// tau (a x + b y).
    fn slanted(self, a: f64, b: f64) -> Term<'g> {
        TAU * (a * self.coordinate(X) + b * self.coordinate(Y))
    }

    fn wave(self, op: Unary, harmonic: u8, axis: Axis) -> Term<'g> {
        let angle = f64::from(harmonic) * TAU * self.coordinate(axis);
        angle.map(|graph, angle| graph.unary(op, angle))
    }

    fn coordinate(self, axis: Axis) -> Term<'g> {
        let node = self.0.borrow_mut().coordinate(axis);
        Term { graph: self.0, node }
    }
}

/// An expression of a graph that takes part in sums and products.
#[derive(Clone, Copy)]
struct Term<'g> {
    graph: &'g RefCell<&'g mut Graph>,
    node: NodeId,
}

impl<'g> Term<'g> {
    fn map(self, change: impl FnOnce(&mut Graph, NodeId) -> NodeId) -> Self {
        let node = change(&mut self.graph.borrow_mut(), self.node);
        Self { node, ..self }
    }

    fn constant(self, value: f64) -> Self {
        self.map(|graph, _| graph.constant(value))
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        self.map(|graph, node| graph.binary(op, node, other.node))
    }
}

impl<'g> Add for Term<'g> {
    type Output = Term<'g>;

    fn add(self, other: Self) -> Self {
        self.binary(Binary::Add, other)
    }
}

impl<'g> Sub for Term<'g> {
    type Output = Term<'g>;

    fn sub(self, other: Self) -> Self {
        self.binary(Binary::Sub, other)
    }
}

impl<'g> Mul for Term<'g> {
    type Output = Term<'g>;

    fn mul(self, other: Self) -> Self {
        self.binary(Binary::Mul, other)
    }
}

impl<'g> Mul<Term<'g>> for f64 {
    type Output = Term<'g>;

    fn mul(self, term: Term<'g>) -> Term<'g> {
        term.constant(self).binary(Binary::Mul, term)
    }
}

impl<'g> Add<f64> for Term<'g> {
    type Output = Term<'g>;

    fn add(self, value: f64) -> Self {
        self.binary(Binary::Add, self.constant(value))
    }
}

impl<'g> Sub<f64> for Term<'g> {
    type Output = Term<'g>;

    fn sub(self, value: f64) -> Self {
        self.binary(Binary::Sub, self.constant(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::Node;
    use crate::solid::walk::value;

    /// Title; least and greatest value; volume fractions of f <= 0, f <= 0.35 and |f| <= 0.35.
    ///
    /// Source: field notes of this project, section 6.2: extrema from a grid, fractions from 180^3
    /// samples, computed by other code from the equations of Table 1.
    const REFERENCE: [(&str, [f64; 2], [f64; 3]); 27] = [
        ("Gyroid", [-1.500, 1.500], [0.5000, 0.6129, 0.2257]),
        ("D", [-1.414, 1.414], [0.5000, 0.6435, 0.2869]),
        ("P", [-2.999, 2.999], [0.5000, 0.5998, 0.1997]),
        ("IWP", [-4.998, 3.000], [0.4693, 0.5159, 0.0920]),
        ("Neovius", [-12.997, 12.997], [0.5000, 0.5761, 0.1521]),
        ("C(Y)", [-3.533, 3.533], [0.5000, 0.5770, 0.1541]),
        ("Lidinoid", [-2.697, 2.299], [0.3845, 0.5237, 0.2706]),
        ("OCTO", [-0.750, 3.249], [0.4706, 0.7060, 0.5803]),
        ("FRD", [-9.994, 5.998], [0.4652, 0.5113, 0.0912]),
        ("S", [-1.413, 1.413], [0.5000, 0.6729, 0.3458]),
        ("P+C(P)", [-0.416, 1.749], [0.5842, 0.8966, 0.8626]),
        ("Split P", [-1.800, 1.809], [0.5103, 0.6358, 0.2541]),
        ("F", [-1.000, 1.000], [0.5000, 0.8517, 0.7034]),
        ("C(D)", [-4.236, 4.236], [0.5000, 0.6695, 0.3390]),
        ("G'", [-0.679, 1.819], [0.3693, 0.5658, 0.4103]),
        ("G'2", [-5.995, 7.494], [0.5112, 0.5443, 0.0663]),
        ("D'", [-2.405, 0.425], [0.5322, 0.9045, 0.6009]),
        ("K", [-1.599, 1.535], [0.4102, 0.5930, 0.3657]),
        ("C(S)", [-6.451, 6.451], [0.5000, 0.5677, 0.1354]),
        ("Y", [-4.947, 4.947], [0.5000, 0.6830, 0.3660]),
        ("±Y", [-2.827, 2.827], [0.5000, 0.6457, 0.2914]),
        ("C(±Y)", [-2.000, 2.000], [0.5000, 0.5873, 0.1745]),
        ("C(I2-Y**)", [-2.997, 2.999], [0.5063, 0.5801, 0.1464]),
        ("W", [-3.997, 3.997], [0.5000, 0.7278, 0.4556]),
        ("Q*", [-3.999, 3.999], [0.5000, 0.5790, 0.1580]),
        ("C(G)", [-10.492, 10.492], [0.5000, 0.5345, 0.0690]),
        ("Slotted P", [-11.994, 5.997], [0.4746, 0.5097, 0.0702]),
    ];

    /// Values at `n`^3 points of one period, shifted off the planes of symmetry.
    fn samples(surface: &Surface, n: u32) -> Vec<f64> {
        let mut graph = Graph::new();
        let field = surface.field(&mut graph);
        let at = |i: u32, shift: f64| (f64::from(i) + shift) / f64::from(n);
        let mut found = Vec::new();
        for (i, j, k) in (0..n.pow(3)).map(|m| (m % n, m / n % n, m / n / n)) {
            found.push(value(&graph, field, [at(i, 0.17), at(j, 0.41), at(k, 0.73)]));
        }
        found
    }

    #[test]
    fn extrema_and_volume_fractions_are_those_of_table_1() {
        for (surface, (title, [least, greatest], fractions)) in CATALOGUE.iter().zip(REFERENCE) {
            assert_eq!(surface.title, title);
            let found = samples(surface, 24);
            let lo = found.iter().copied().fold(f64::INFINITY, f64::min);
            let hi = found.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            // An extremum lies up to 0.036 from a sample; the worst found is 1.6 % of the range.
            let missed = ((lo - least).abs()).max((hi - greatest).abs()) / (greatest - least);
            assert!(missed < 0.02, "{title}: from {lo} to {hi}");
            let share = |holds: &dyn Fn(f64) -> bool| {
                found.iter().filter(|f| holds(**f)).count() as f64 / found.len() as f64
            };
            let shares = [share(&|f| f <= 0.0), share(&|f| f <= 0.35), share(&|f| f.abs() <= 0.35)];
            for (share, fraction) in shares.into_iter().zip(fractions) {
                // 13824 samples of a set with about 4 % of its volume next to the surface per
                // half grid spacing; the worst found is 0.0055.
                assert!((share - fraction).abs() < 0.008, "{title}: {share} is not {fraction}");
            }
        }
    }

    #[test]
    fn values_at_symmetric_points_are_exact_sums() {
        let check = |name: &str, point: [f64; 3], expected: f64| {
            let surface = CATALOGUE.iter().find(|surface| surface.name == name).unwrap();
            let mut graph = Graph::new();
            let field = surface.field(&mut graph);
            let found = value(&graph, field, point);
            assert!((found - expected).abs() < 1e-14, "{name} at {point:?}: {found}");
        };
        let (origin, quarter, half) = ([0.0; 3], [0.25; 3], [0.5; 3]);
        check("gyroid", origin, 0.0);
        check("d-surface", quarter, 1.0);
        check("p-surface", origin, 3.0);
        check("p-surface", half, -3.0);
        check("iwp", origin, 3.0);
        check("iwp", quarter, 3.0);
        check("neovius", origin, 13.0);
        check("c-y", origin, -1.0 + 0.0);
        check("lidinoid", origin, -2.7);
        check("octo", origin, 0.85);
        check("frd", origin, 6.0);
        check("p-c-p", origin, 1.75);
        check("split-p", origin, -1.8);
        check("c-d", origin, 3.0);
        check("g-prime", origin, 0.32);
        check("d-prime", quarter, -0.2);
        check("k-surface", origin, 0.8);
        check("c-s", origin, 3.0);
        check("q-star", origin, 0.0);
        check("slotted-p", half, -12.0);
    }

    #[test]
    fn slopes_bound_the_gradient_and_are_nearly_reached() {
        for surface in CATALOGUE {
            let mut graph = Graph::new();
            let field = surface.field(&mut graph);
            let f = |p: [f64; 3]| value(&graph, field, p);
            let h = 1e-5;
            let mut steepest = 0.0_f64;
            for m in 0..16_u32.pow(3) {
                let p = [m % 16, m / 16 % 16, m / 256].map(|i| f64::from(i) / 16.0);
                let partials = [0, 1, 2].map(|axis| {
                    let [mut ahead, mut behind] = [p, p];
                    ahead[axis] += h;
                    behind[axis] -= h;
                    (f(ahead) - f(behind)) / (2.0 * h)
                });
                steepest = steepest.max(partials.iter().map(|d| d * d).sum::<f64>().sqrt());
            }
            // Differences have errors below 1e-6; 16 points a period miss the steepest by up to a
            // tenth where the third harmonic occurs.
            let Surface { name, slope, .. } = surface;
            assert!(steepest < slope && slope < 1.2 * steepest, "{name}: {steepest} of {slope}");
        }
    }

    #[test]
    fn every_wave_is_a_function_of_one_product() {
        let check = |name: &str, expected: usize| {
            let surface = CATALOGUE.iter().find(|surface| surface.name == name).unwrap();
            let mut graph = Graph::new();
            let _ = surface.field(&mut graph);
            let is_wave = |node| matches!(node, Node::Unary(Unary::Sin | Unary::Cos, _));
            let waves = graph.iter().filter(|(_, node)| is_wave(*node)).count();
            assert_eq!(waves, expected, "{name}");
        };
        check("gyroid", 6);
        check("p-surface", 3);
        check("lidinoid", 12);
        check("c-s", 18);
        check("q-star", 5);
    }
}
