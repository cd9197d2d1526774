//! The table of unit cells: names, generators, symmetries, sources.
//!
//! A row holds a few struts, planes and polygons, of which the row's symmetry makes all others. Places are in
//! cells, from a corner of the cube. Where nothing else is said, all struts have the radius that a
//! program gives, and all plates the thickness.
//!
//! Sources, besides those in the rows: Ashby 2006, doi:10.1098/rsta.2005.1678; Zok, Latture &
//! Begley 2016, doi:10.1016/j.jmps.2016.07.007, for the cubic families; O'Keeffe & Hyde 1996,
//! *Crystal Structures*, for the nets; the cells of foams are Voronoi's of the named lattices.

use super::bubbles;
use super::cell::{Cell, Plate, Strut, Surface};
use super::field::Sizes;
use super::symmetry::Centring::{self, Body, Face, Primitive};
use super::symmetry::Symmetry::{self, Clathrate, Cubic, Cyclic, Tetragonal, Tetrahedral};
use crate::expr::Graph;
use crate::solid::Solid;
use glam::DVec3;

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The word of the language.
    pub name: &'static str,
    /// Other spellings.
    pub aliases: &'static [&'static str],
    /// What it is, in one line.
    pub help: &'static str,
    /// Where it is described.
    pub source: &'static str,
    symmetry: Symmetry,
    centring: Centring,
    struts: &'static [Generator],
    planes: &'static [[f64; 3]],
    polygons: &'static [&'static [[f64; 3]]],
    /// The points whose Voronoi cells the plates divide, if they do.
    sites: &'static [[f64; 3]],
}

/// A strut: its ends and the factor of its radius.
type Generator = ([f64; 3], [f64; 3], f64);

impl Row {
    /// The cell.
    #[must_use]
    pub fn cell(&self) -> Cell {
        let Self { symmetry, centring, struts, planes, polygons, .. } = *self;
        let point = DVec3::from_array;
        let struts: Vec<Strut> = (struts.iter())
            .map(|(a, b, factor)| Strut { ends: [point(*a), point(*b)], factors: [*factor; 2] })
            .collect();
        let planes = planes.iter().map(|n| Surface::Plane { normal: point(*n), offset: 0.0 });
        let polygons = (polygons.iter())
            .map(|corners| Surface::Polygon(corners.iter().copied().map(point).collect()));
        let plates: Vec<Plate> = planes.chain(polygons).map(Plate::of).collect();
        Cell::generated(symmetry, centring, &struts, &plates)
    }

    /// The lattice: of period 1, and unbounded.
    ///
    /// The walls of a whole foam without fillets have a [simpler field](bubbles) than its plates.
    #[must_use]
    pub fn solid(&self, graph: &mut Graph, sizes: Sizes) -> Solid {
        let cell = self.cell();
        if self.sites.is_empty() || graph.as_constant(sizes.fillet) != Some(0.0) {
            return cell.solid(graph, sizes);
        }
        let sites: Vec<DVec3> = self.sites.iter().copied().map(DVec3::from_array).collect();
        let mirrored = [0, 1, 2].map(|axis| cell.is_mirrored(axis));
        bubbles::walls(graph, &sites, mirrored, sizes.thickness)
    }

    /// Whether it consists of plates, not of struts.
    #[must_use]
    pub const fn is_of_plates(&self) -> bool {
        self.struts.is_empty()
    }
}

const CORNER: [f64; 3] = [0.0; 3];
const ALONG_X: [f64; 3] = [1.0, 0.0, 0.0];
const ALONG_Z: [f64; 3] = [0.0, 0.0, 1.0];
const MIDDLE: [f64; 3] = [0.5; 3];
const FLOOR: [f64; 3] = [0.5, 0.5, 0.0];
const SIDE: [f64; 3] = [0.5, 0.0, 0.5];
const QUARTER: [f64; 3] = [0.25; 3];

const EDGE: Generator = (CORNER, ALONG_X, 1.0);
const UPRIGHT: Generator = (CORNER, ALONG_Z, 1.0);
const DIAGONAL: Generator = (CORNER, MIDDLE, 1.0);
const FACE_DIAGONAL: Generator = (CORNER, FLOOR, 1.0);
const SIDE_DIAGONAL: Generator = (CORNER, SIDE, 1.0);
const BETWEEN_FACES: Generator = (FLOOR, SIDE, 1.0);

/// Where the truncated cube cuts the cube's edges: (2 - √2) / 2.
const CUT: f64 = 0.292_893_218_813_452_5;
/// Half an edge of the rhombicuboctahedron in the unit cube: (√2 - 1) / 2, and so from a corner.
const SHORT: f64 = 0.207_106_781_186_547_52;
/// The lesser coordinates of the truncated cuboctahedron in the unit cube, from the middle:
/// 1 and 1 + √2 over 2 (1 + 2 √2).
const LEAST: f64 = 0.130_601_937_481_870_7;
const MEDIUM: f64 = 0.315_300_968_740_935_4;
/// Half the upright struts of the re-entrant cell; at 1/4 its slanted struts would be level.
const DEPTH: f64 = 0.35;
/// The radius of diagonals over that of edges, (3 √3 / 8)^(1/2), at which the cell is isotropic.
const ISOTROPIC: f64 = 0.805_927_448_867_656_4;

/// The points of the A15 structure.
const A15: [[f64; 3]; 8] = [
    CORNER,
    MIDDLE,
    [0.25, 0.0, 0.5],
    [0.75, 0.0, 0.5],
    [0.5, 0.25, 0.0],
    [0.5, 0.75, 0.0],
    [0.0, 0.5, 0.25],
    [0.0, 0.5, 0.75],
];

/// The row of a cubic cell of struts.
const fn cubic(
    name: &'static str,
    struts: &'static [Generator],
    help: &'static str,
    source: &'static str,
) -> Row {
    Row {
        name,
        aliases: &[],
        help,
        source,
        symmetry: Cubic,
        centring: Primitive,
        struts,
        planes: &[],
        polygons: &[],
        sites: &[],
    }
}

/// The row of a cubic cell of plates.
const fn plates(
    name: &'static str,
    planes: &'static [[f64; 3]],
    help: &'static str,
    source: &'static str,
) -> Row {
    Row { planes, ..cubic(name, &[], help, source) }
}

const CRYSTAL: &str = "Zok, Latture & Begley 2016";
const NET: &str = "O'Keeffe & Hyde 1996";
const TILING: &str = "uniform tilings of space, Andreini 1905";
const PLATES: &str = "Tancogne-Dejean et al. 2018, doi:10.1002/adma.201803334";

/// The cells, those of struts first.
pub const CELLS: [Row; 36] = [
    Row {
        aliases: &["sc", "cubic"],
        ..cubic("simple-cubic", &[EDGE], "struts along the edges of cubes", CRYSTAL)
    },
    Row {
        aliases: &["body-centred-cubic", "body-centered-cubic"],
        ..cubic("bcc", &[DIAGONAL], "struts from the middle of cubes to their corners", CRYSTAL)
    },
    Row {
        aliases: &["face-centred-cubic", "face-centered-cubic"],
        ..cubic("fcc", &[FACE_DIAGONAL], "both diagonals of the faces of cubes", CRYSTAL)
    },
    Row {
        symmetry: Tetragonal,
        ..cubic("bccz", &[DIAGONAL, UPRIGHT], "bcc with the upright edges", "Leary et al. 2016")
    },
    Row {
        symmetry: Tetragonal,
        ..cubic(
            "fccz",
            &[SIDE_DIAGONAL, UPRIGHT],
            "the diagonals of the upright faces and the upright edges",
            "Leary et al. 2016",
        )
    },
    Row {
        symmetry: Tetragonal,
        ..cubic(
            "fbccz",
            &[SIDE_DIAGONAL, DIAGONAL, UPRIGHT],
            "fccz and bcc together",
            "Leary et al. 2016",
        )
    },
    cubic("bcc-cubic", &[DIAGONAL, EDGE], "bcc and the edges of the cubes", CRYSTAL),
    cubic("fcc-cubic", &[FACE_DIAGONAL, EDGE], "fcc and the edges of the cubes", CRYSTAL),
    Row {
        aliases: &["fcc-bcc"],
        ..cubic("fbcc", &[FACE_DIAGONAL, DIAGONAL], "fcc and bcc together", CRYSTAL)
    },
    cubic(
        "fbcc-cubic",
        &[FACE_DIAGONAL, DIAGONAL, EDGE],
        "fcc, bcc and the edges of the cubes",
        CRYSTAL,
    ),
    Row {
        aliases: &["octet-truss"],
        ..cubic(
            "octet",
            &[FACE_DIAGONAL, BETWEEN_FACES],
            "the octet truss: octahedra and tetrahedra, twelve struts at a node",
            "Deshpande, Fleck & Ashby 2001",
        )
    },
    cubic(
        "octahedral",
        &[BETWEEN_FACES],
        "octahedra that share their corners, in the middles of the cubes' faces",
        CRYSTAL,
    ),
    cubic(
        "octahedral-cross",
        &[BETWEEN_FACES, (MIDDLE, FLOOR, 1.0)],
        "the octahedral cell with the axes of its octahedra",
        CRYSTAL,
    ),
    cubic(
        "cuboctahedron",
        &[([0.5, 0.0, 0.0], [0.0, 0.5, 0.0], 1.0)],
        "a cuboctahedron in each cube: the octahedral cell from another corner",
        TILING,
    ),
    cubic(
        "truncated-cube",
        &[([CUT, 0.0, 0.0], [1.0 - CUT, 0.0, 0.0], 1.0), ([CUT, 0.0, 0.0], [0.0, CUT, 0.0], 1.0)],
        "a cube with cut corners in each cube",
        TILING,
    ),
    cubic(
        "rhombicuboctahedron",
        &[
            ([0.0, 0.5 - SHORT, 0.5 - SHORT], [0.0, 0.5 + SHORT, 0.5 - SHORT], 1.0),
            ([0.0, 0.5 - SHORT, 0.5 - SHORT], [0.5 - SHORT, 0.0, 0.5 - SHORT], 1.0),
        ],
        "a rhombicuboctahedron in each cube",
        TILING,
    ),
    cubic(
        "truncated-cuboctahedron",
        &[
            ([0.5 - LEAST, 0.5 - MEDIUM, 0.0], [0.5 + LEAST, 0.5 - MEDIUM, 0.0], 1.0),
            ([0.5 - LEAST, 0.5 - MEDIUM, 0.0], [0.5 - MEDIUM, 0.5 - LEAST, 0.0], 1.0),
            ([0.5 - LEAST, 0.5 - MEDIUM, 0.0], [0.5 - LEAST, 0.0, 0.5 - MEDIUM], 1.0),
        ],
        "a truncated cuboctahedron in each cube",
        TILING,
    ),
    Row {
        aliases: &["tetrakaidecahedron", "truncated-octahedron", "sodalite"],
        ..cubic(
            "kelvin",
            &[([0.5, 0.25, 0.0], [0.5, 0.0, 0.25], 1.0), ([0.0, 0.25, 0.5], [0.0, 0.5, 0.25], 1.0)],
            "the edges of Kelvin's foam, truncated octahedra about two points a cell",
            "Thomson 1887, doi:10.1080/14786448708628135",
        )
    },
    Row {
        centring: Face,
        ..cubic(
            "rhombic-dodecahedron",
            &[([0.5, 0.0, 0.0], QUARTER, 1.0)],
            "the edges of rhombic dodecahedra about four points a cell",
            "Voronoi cells of the fcc lattice",
        )
    },
    Row {
        symmetry: Clathrate,
        ..cubic(
            "weaire-phelan",
            &[
                ([0.0, -5.0 / 32.0, 5.0 / 16.0], [0.0, 5.0 / 32.0, 5.0 / 16.0], 1.0),
                ([0.0, 5.0 / 32.0, 5.0 / 16.0], [0.0, 0.25, 0.5], 1.0),
                ([0.0, 5.0 / 32.0, 5.0 / 16.0], [5.0 / 24.0; 3], 1.0),
                ([5.0 / 24.0; 3], [7.0 / 24.0; 3], 1.0),
            ],
            "the edges of Weaire and Phelan's foam, with flat faces, eight bubbles a cell",
            "Weaire & Phelan 1994, doi:10.1080/09500839408241577; Voronoi cells of A15",
        )
    },
    Row {
        symmetry: Tetrahedral,
        centring: Face,
        ..cubic("diamond-struts", &[(CORNER, QUARTER, 1.0)], "the bonds of diamond", NET)
    },
    Row {
        centring: Face,
        ..cubic(
            "fluorite",
            &[(CORNER, QUARTER, 1.0)],
            "the bonds of fluorite: the rhombic dodecahedra from another corner",
            NET,
        )
    },
    Row {
        aliases: &["kagome-3d"],
        symmetry: Tetrahedral,
        centring: Face,
        ..cubic(
            "pyrochlore",
            &[
                ([0.125, 0.125, 0.125], [0.125, -0.125, -0.125], 1.0),
                ([0.375, 0.375, 0.125], [0.375, 0.125, 0.375], 1.0),
            ],
            "tetrahedra that share their corners, six struts at a node",
            NET,
        )
    },
    Row {
        aliases: &["laves-graph", "gyroid-graph"],
        symmetry: Cyclic,
        centring: Body,
        ..cubic(
            "srs",
            &[
                ([0.125, 0.125, 0.125], [0.375, 0.125, -0.125], 1.0),
                ([0.375, 0.875, 0.625], [0.125, 0.875, 0.375], 1.0),
            ],
            "the graph inside of the gyroid, three struts at a node",
            "Sunada 2008, Notices of the AMS 55",
        )
    },
    Row {
        aliases: &["isotropic"],
        ..cubic(
            "iso-truss",
            &[EDGE, (CORNER, MIDDLE, ISOTROPIC)],
            "bcc-cubic with diagonals 0.806 times as thick: as stiff in all directions",
            "Gurtner & Durand 2014, doi:10.1098/rspa.2013.0611",
        )
    },
    Row {
        aliases: &["auxetic"],
        symmetry: Tetragonal,
        centring: Body,
        ..cubic(
            "re-entrant",
            &[
                ([0.0, 0.0, -DEPTH], [0.0, 0.0, DEPTH], 1.0),
                ([0.0, 0.0, DEPTH], [0.5, 0.5, 0.5 - DEPTH], 1.0),
            ],
            "upright struts and slanted ones that fold back: auxetic along z",
            "Yang et al. 2012, doi:10.1016/j.msea.2012.08.053; upright and across both diagonals",
        )
    },
    cubic(
        "tesseract",
        &[EDGE, (QUARTER, [0.75, 0.25, 0.25], 1.0), (CORNER, QUARTER, 1.0)],
        "a cube of half the size in each cube, joined to its corners",
        "projection of the four-dimensional cube",
    ),
    Row {
        aliases: &["sc-plates", "simple-cubic-plates"],
        ..plates("cubic-plates", &[[1.0, 0.0, 0.0]], "the faces of cubes", PLATES)
    },
    plates("bcc-plates", &[[1.0, 1.0, 0.0]], "planes across the face diagonals of cubes", PLATES),
    Row {
        aliases: &["octet-plates"],
        ..plates("fcc-plates", &[[1.0; 3]], "the faces of octahedra and tetrahedra", PLATES)
    },
    plates(
        "cubic-bcc-plates",
        &[[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]],
        "cubic-plates and bcc-plates together",
        PLATES,
    ),
    Row {
        aliases: &["cubic-octet-plates"],
        ..plates(
            "cubic-fcc-plates",
            &[[1.0, 0.0, 0.0], [1.0; 3]],
            "the cubic and octet foam",
            "Berger, Wadley & McMeeking 2017, doi:10.1038/nature21075",
        )
    },
    plates(
        "bcc-fcc-plates",
        &[[1.0, 1.0, 0.0], [1.0; 3]],
        "bcc-plates and fcc-plates together",
        PLATES,
    ),
    Row {
        aliases: &["kelvin-foam"],
        centring: Body,
        sites: &[CORNER, MIDDLE],
        polygons: &[
            &[[0.5, 0.25, 0.0], [0.5, 0.0, 0.25], [0.5, -0.25, 0.0], [0.5, 0.0, -0.25]],
            &[
                [0.0, 0.25, 0.5],
                [0.0, 0.5, 0.25],
                [0.25, 0.5, 0.0],
                [0.5, 0.25, 0.0],
                [0.5, 0.0, 0.25],
                [0.25, 0.0, 0.5],
            ],
        ],
        ..plates(
            "kelvin-plates",
            &[],
            "the faces of Kelvin's foam",
            "Thomson 1887, doi:10.1080/14786448708628135",
        )
    },
    Row {
        centring: Face,
        sites: &[CORNER, FLOOR, SIDE, [0.0, 0.5, 0.5]],
        polygons: &[&[[0.5, 0.0, 0.0], [0.25, 0.25, 0.25], [0.0, 0.5, 0.0], [0.25, 0.25, -0.25]]],
        ..plates(
            "rhombic-dodecahedron-plates",
            &[],
            "the faces of rhombic dodecahedra",
            "Voronoi cells of the fcc lattice",
        )
    },
    Row {
        aliases: &["weaire-phelan-foam"],
        sites: &A15,
        symmetry: Clathrate,
        polygons: &[
            &[
                [0.0, -5.0 / 32.0, 11.0 / 16.0],
                [0.0, -0.25, 0.5],
                [0.0, -5.0 / 32.0, 5.0 / 16.0],
                [0.0, 5.0 / 32.0, 5.0 / 16.0],
                [0.0, 0.25, 0.5],
                [0.0, 5.0 / 32.0, 11.0 / 16.0],
            ],
            &[
                [5.0 / 32.0, 5.0 / 16.0, 0.0],
                [5.0 / 24.0; 3],
                [0.0, 5.0 / 32.0, 5.0 / 16.0],
                [-5.0 / 24.0, 5.0 / 24.0, 5.0 / 24.0],
                [-5.0 / 32.0, 5.0 / 16.0, 0.0],
            ],
            &[
                [3.0 / 16.0, 11.0 / 32.0, 0.5],
                [0.0, 0.25, 0.5],
                [0.0, 5.0 / 32.0, 5.0 / 16.0],
                [5.0 / 24.0; 3],
                [7.0 / 24.0; 3],
            ],
        ],
        ..plates(
            "weaire-phelan-plates",
            &[],
            "the faces of Weaire and Phelan's foam, flat",
            "Weaire & Phelan 1994, doi:10.1080/09500839408241577; Voronoi cells of A15",
        )
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::SQRT_2;

    fn row(name: &str) -> &'static Row {
        CELLS.iter().find(|row| row.name == name).unwrap()
    }

    /// Struts, their whole length, and the nodes' valences, each with the number of its nodes.
    fn check(name: &str, struts: usize, length: f64, valences: &[(usize, usize)]) {
        let cell = row(name).cell();
        assert_eq!(cell.struts().len(), struts, "{name}");
        assert!((cell.length() - length).abs() < 1e-12, "{name}: {}", cell.length());
        let nodes = cell.nodes();
        let mut found: Vec<(usize, usize)> = Vec::new();
        for node in &nodes {
            match found.iter_mut().find(|(valence, _)| *valence == node.valence) {
                Some((_, count)) => *count += 1,
                None => found.push((node.valence, 1)),
            }
        }
        found.sort_unstable();
        assert_eq!(found, valences, "{name}");
        let ends: usize = nodes.iter().map(|node| node.valence).sum();
        assert_eq!(ends, 2 * struts, "{name}");
    }

    #[test]
    fn struts_lengths_and_valences_are_those_of_geometry() {
        let root3 = 3.0_f64.sqrt();
        check("simple-cubic", 3, 3.0, &[(6, 1)]);
        check("bcc", 8, 4.0 * root3, &[(8, 2)]);
        check("fcc", 12, 6.0 * SQRT_2, &[(4, 3), (12, 1)]);
        check("bccz", 9, 4.0 * root3 + 1.0, &[(8, 1), (10, 1)]);
        check("fccz", 9, 4.0 * SQRT_2 + 1.0, &[(4, 2), (10, 1)]);
        check("fbccz", 17, 4.0 * SQRT_2 + 4.0 * root3 + 1.0, &[(4, 2), (8, 1), (18, 1)]);
        check("bcc-cubic", 11, 4.0 * root3 + 3.0, &[(8, 1), (14, 1)]);
        check("fcc-cubic", 15, 6.0 * SQRT_2 + 3.0, &[(4, 3), (18, 1)]);
        check("fbcc", 20, 6.0 * SQRT_2 + 4.0 * root3, &[(4, 3), (8, 1), (20, 1)]);
        check("fbcc-cubic", 23, 6.0 * SQRT_2 + 4.0 * root3 + 3.0, &[(4, 3), (8, 1), (26, 1)]);
        check("octet", 24, 12.0 * SQRT_2, &[(12, 4)]);
        check("octahedral", 12, 6.0 * SQRT_2, &[(8, 3)]);
        check("octahedral-cross", 18, 6.0 * SQRT_2 + 3.0, &[(6, 1), (10, 3)]);
        check("cuboctahedron", 12, 6.0 * SQRT_2, &[(8, 3)]);
        check("truncated-cube", 15, 15.0 * (SQRT_2 - 1.0), &[(5, 6)]);
        check("rhombicuboctahedron", 36, 36.0 * (SQRT_2 - 1.0), &[(6, 12)]);
        let edge = 1.0 / (1.0 + 2.0 * SQRT_2);
        check("truncated-cuboctahedron", 48, 48.0 * edge, &[(4, 24)]);
        check("kelvin", 24, 6.0 * SQRT_2, &[(4, 12)]);
        check("rhombic-dodecahedron", 32, 8.0 * root3, &[(4, 8), (8, 4)]);
        // By circumcentres of the A15 sites in rational numbers, apart from this crate.
        check("weaire-phelan", 92, 21.392_292_725_143_367, &[(4, 46)]);
        check("diamond-struts", 16, 4.0 * root3, &[(4, 8)]);
        check("fluorite", 32, 8.0 * root3, &[(4, 8), (8, 4)]);
        check("pyrochlore", 48, 12.0 * SQRT_2, &[(6, 16)]);
        check("srs", 12, 3.0 * SQRT_2, &[(3, 8)]);
        check("iso-truss", 11, 4.0 * root3 + 3.0, &[(8, 1), (14, 1)]);
        let slanted = (0.5_f64 + 0.04).sqrt();
        check("re-entrant", 10, 1.4 + 8.0 * slanted, &[(5, 4)]);
        check("tesseract", 23, 9.0 + 2.0 * root3, &[(4, 8), (14, 1)]);
    }

    #[test]
    fn plates_have_the_areas_of_geometry() {
        let area = |corners: &[DVec3]| {
            let twice = (1..corners.len() - 1)
                .map(|i| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]))
                .sum::<DVec3>();
            0.5 * twice.length()
        };
        let check = |name: &str, count: usize, expected: f64| {
            let cell = row(name).cell();
            assert_eq!(cell.plates().len(), count, "{name}");
            // Planes with a normal n of whole numbers are |n| to a unit of length.
            let found: f64 = (cell.plates().iter())
                .map(|plate| match &plate.surface {
                    Surface::Plane { normal, .. } => normal.length(),
                    Surface::Polygon(corners) => area(corners),
                })
                .sum();
            assert!((found - expected).abs() < 1e-12, "{name}: {found}");
        };
        let root3 = 3.0_f64.sqrt();
        check("cubic-plates", 3, 3.0);
        check("bcc-plates", 6, 6.0 * SQRT_2);
        check("fcc-plates", 4, 4.0 * root3);
        check("cubic-bcc-plates", 9, 3.0 + 6.0 * SQRT_2);
        check("cubic-fcc-plates", 7, 3.0 + 4.0 * root3);
        check("bcc-fcc-plates", 10, 6.0 * SQRT_2 + 4.0 * root3);
        check("kelvin-plates", 14, 0.75 + 1.5 * root3);
        check("rhombic-dodecahedron-plates", 24, 3.0 * SQRT_2);
        check("weaire-phelan-plates", 54, 5.295_025_413_757_976);
    }

    #[test]
    fn cells_are_mirrored_as_their_symmetry_says() {
        for row in &CELLS {
            let cell = row.cell();
            for axis in 0..3 {
                let expected = match row.symmetry {
                    Cubic | Tetragonal | Clathrate => true,
                    Tetrahedral | Cyclic => false,
                };
                assert_eq!(cell.is_mirrored(axis), expected, "{} along {axis}", row.name);
            }
        }
    }

    #[test]
    fn the_isotropic_truss_is_isotropic_in_the_slender_limit() {
        // C11 - C12 = 2 C44 with C_ijkl the sum of section times length times n_i n_j n_k n_l.
        let cell = row("iso-truss").cell();
        let sum = |power: [i32; 3]| -> f64 {
            let term = |strut: &Strut| {
                let n = (strut.ends[1] - strut.ends[0]).normalize();
                let product = n.x.powi(power[0]) * n.y.powi(power[1]) * n.z.powi(power[2]);
                strut.factors[0].powi(2) * strut.length() * product
            };
            cell.struts().iter().map(term).sum()
        };
        let (c11, c12, c44) = (sum([4, 0, 0]), sum([2, 2, 0]), sum([0, 2, 2]));
        assert!((c11 - c12 - 2.0 * c44).abs() < 1e-12, "{c11} {c12} {c44}");
    }
}
