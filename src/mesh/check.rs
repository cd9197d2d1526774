//! Whether a mesh bounds a solid, and where it does not.
//!
//! # Contract
//! [`check`] counts every one of the following and gives the first few examples of each, in order
//! of vertices or triangles; nothing else is looked at. Vertices are the same where their numbers
//! are; equal positions do not count.
//!
//! | defect | a mesh without it |
//! |---|---|
//! | `bad_index` | every corner of every triangle is a vertex |
//! | `not_finite` | every coordinate of every vertex is finite |
//! | `repeated_corner` | the corners of every triangle are three different vertices |
//! | `zero_area` | no triangle's corners lie on a line, to within [`ON_A_LINE`] |
//! | `duplicate` | no two triangles have the same three corners, in whatever order |
//! | `boundary_edge` | every edge has two triangles or more |
//! | `nonmanifold_edge` | every edge has two triangles or fewer |
//! | `misoriented_edge` | the triangles of an edge run through it equally often each way; an odd one among three or more is forgiven |
//! | `nonmanifold_vertex` | the triangles about every vertex are one fan, joined edge to edge |
//! | `isolated_vertex` | every vertex has a triangle |
//!
//! Triangles with a bad index or a repeated corner are left out of all later rows and of the counts
//! of edges and components. A mesh is *inside out* when it is closed and oriented and its signed
//! volume is negative. **Self-intersection is not examined.**

use super::topology::{NO_COMPONENT, Side, Star, Stars, components, is_proper};
use super::{Mesh, measure};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// A triangle has zero area when twice its area is at most this part of its longest side's square.
///
/// Four units in the last place: what rounding leaves of a cross product of parallel vectors.
pub const ON_A_LINE: f64 = 4.0 * f64::EPSILON;

/// Examples kept of each defect.
const EXAMPLES: usize = 4;

/// Vertices or triangles that one thread examines at a time.
const ITEMS_A_PIECE: usize = 1 << 14;

/// Where a defect is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Example {
    /// The numbers of the vertices concerned: one, an edge's two or a triangle's three.
    pub vertices: Vec<u32>,
    /// The position of the first of them; not finite where it has none.
    pub position: [f64; 3],
}

/// One kind of defect.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Defect {
    /// How many there are.
    pub count: u64,
    /// The first few.
    pub examples: Vec<Example>,
}

impl Defect {
    fn note(&mut self, mesh: &Mesh, vertices: &[u32]) {
        self.count += 1;
        if self.examples.len() < EXAMPLES {
            let position = vertices.first().and_then(|&v| mesh.positions.get(v as usize));
            self.examples.push(Example {
                vertices: vertices.to_vec(),
                position: position.copied().unwrap_or([f64::NAN; 3]),
            });
        }
    }

    fn append(&mut self, later: Self) {
        self.count += later.count;
        let room = EXAMPLES - self.examples.len();
        self.examples.extend(later.examples.into_iter().take(room));
    }
}

/// Every kind of defect, as the module's contract defines them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the module's contract has a row for each")]
pub struct Defects {
    pub bad_index: Defect,
    pub not_finite: Defect,
    pub repeated_corner: Defect,
    pub zero_area: Defect,
    pub duplicate: Defect,
    pub boundary_edge: Defect,
    pub nonmanifold_edge: Defect,
    pub misoriented_edge: Defect,
    pub nonmanifold_vertex: Defect,
    pub isolated_vertex: Defect,
}

impl Defects {
    /// The defects with their plural names, in the order of the contract.
    #[must_use]
    pub fn by_name(&self) -> [(&'static str, &Defect); 10] {
        [
            ("corners that are no vertex", &self.bad_index),
            ("vertices that are not finite", &self.not_finite),
            ("triangles that repeat a corner", &self.repeated_corner),
            ("triangles of zero area", &self.zero_area),
            ("duplicate triangles", &self.duplicate),
            ("boundary edges", &self.boundary_edge),
            ("non-manifold edges", &self.nonmanifold_edge),
            ("inconsistently oriented edges", &self.misoriented_edge),
            ("non-manifold vertices", &self.nonmanifold_vertex),
            ("isolated vertices", &self.isolated_vertex),
        ]
    }

    fn append(mut self, later: Self) -> Self {
        let Self {
            bad_index,
            not_finite,
            repeated_corner,
            zero_area,
            duplicate,
            boundary_edge,
            nonmanifold_edge,
            misoriented_edge,
            nonmanifold_vertex,
            isolated_vertex,
        } = later;
        self.bad_index.append(bad_index);
        self.not_finite.append(not_finite);
        self.repeated_corner.append(repeated_corner);
        self.zero_area.append(zero_area);
        self.duplicate.append(duplicate);
        self.boundary_edge.append(boundary_edge);
        self.nonmanifold_edge.append(nonmanifold_edge);
        self.misoriented_edge.append(misoriented_edge);
        self.nonmanifold_vertex.append(nonmanifold_vertex);
        self.isolated_vertex.append(isolated_vertex);
        self
    }
}

/// A connected piece of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Component {
    /// How many vertices it has.
    pub vertices: u64,
    /// How many edges it has.
    pub edges: u64,
    /// How many triangles it has.
    pub triangles: u64,
    /// Whether it has no boundary edge.
    pub closed: bool,
    /// Whether it has no non-manifold edge or vertex.
    pub manifold: bool,
    /// Whether its edges are oriented consistently.
    pub oriented: bool,
}

impl Component {
    const EMPTY: Self =
        Self { vertices: 0, edges: 0, triangles: 0, closed: true, manifold: true, oriented: true };

    /// The Euler characteristic V − E + F.
    #[must_use]
    pub const fn euler(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.triangles as i64
    }

    /// The number of handles, if the component is a closed, manifold and oriented surface.
    #[must_use]
    pub fn genus(&self) -> Option<u64> {
        let is_surface = self.closed && self.manifold && self.oriented;
        is_surface.then(|| ((2 - self.euler()) / 2).unsigned_abs())
    }
}

/// What [`check`] found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Vertices of the mesh, isolated ones included.
    pub vertices: u64,
    /// Triangles of the mesh, improper ones included.
    pub triangles: u64,
    /// Edges of proper triangles.
    pub edges: u64,
    /// The Euler characteristic V − E + F of proper triangles and their vertices.
    pub euler: i64,
    /// The sum of the components' genera, if each has one.
    pub genus: Option<u64>,
    /// Whether the mesh is closed and oriented and its signed volume is negative.
    pub inside_out: bool,
    /// What is wrong, and where.
    pub defects: Defects,
    /// The connected pieces, in order of their least vertices.
    #[serde(serialize_with = "serialize_count")]
    pub components: Vec<Component>,
}

/// Thousands of loose parts must not drown the report.
fn serialize_count<S: serde::Serializer>(
    components: &[Component],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(components.len() as u64)
}

impl Check {
    /// Whether the mesh has triangles and no boundary edge.
    #[must_use]
    pub const fn is_closed(&self) -> bool {
        self.triangles > 0 && self.defects.boundary_edge.count == 0
    }

    /// Whether neighbouring triangles agree which side is out.
    #[must_use]
    pub const fn is_oriented(&self) -> bool {
        self.defects.misoriented_edge.count == 0
    }

    /// Whether no edge has more than two triangles and no vertex more than one fan.
    #[must_use]
    pub const fn is_manifold(&self) -> bool {
        self.defects.nonmanifold_edge.count == 0 && self.defects.nonmanifold_vertex.count == 0
    }

    /// Whether the mesh is free of every defect and bounds a solid from outside.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.triangles > 0
            && !self.inside_out
            && self.defects.by_name().iter().all(|(_, defect)| defect.count == 0)
    }
}

/// Looks for every defect of the module's contract.
///
/// The result does not depend on the number of threads.
#[must_use]
pub fn check(mesh: &Mesh) -> Check {
    let numbers = components(mesh);
    let stars = Stars::new(mesh);
    let faults = examine_triangles(mesh);
    let (edges_from, star_faults) = examine_stars(mesh, &stars);
    let defects = faults.append(star_faults);

    let count = numbers.iter().filter(|&&n| n != NO_COMPONENT).max().map_or(0, |&n| n as usize + 1);
    let mut pieces = vec![Component::EMPTY; count];
    for (&number, star) in numbers.iter().zip(&edges_from) {
        if number != NO_COMPONENT {
            let piece = &mut pieces[number as usize];
            piece.vertices += 1;
            piece.edges += u64::from(star.edges);
            piece.closed &= star.closed;
            piece.manifold &= star.manifold;
            piece.oriented &= star.oriented;
        }
    }
    for &corners in mesh.triangles.iter().filter(|c| is_proper(**c, mesh.positions.len())) {
        pieces[numbers[corners[0] as usize] as usize].triangles += 1;
    }

    let mut found = Check {
        vertices: mesh.positions.len() as u64,
        triangles: mesh.triangles.len() as u64,
        edges: pieces.iter().map(|piece| piece.edges).sum(),
        euler: pieces.iter().map(Component::euler).sum(),
        genus: pieces.iter().map(Component::genus).sum(),
        inside_out: false,
        defects,
        components: pieces,
    };
    let has_volume = found.is_closed()
        && found.is_oriented()
        && found.defects.bad_index.count == 0
        && found.defects.not_finite.count == 0;
    found.inside_out = has_volume && measure::volume(mesh) < 0.0;
    found
}

/// Defects of single triangles.
fn examine_triangles(mesh: &Mesh) -> Defects {
    let vertices = mesh.positions.len();
    let examine = |piece: &[[u32; 3]]| {
        let mut defects = Defects::default();
        for corners in piece {
            if corners.iter().any(|&corner| corner as usize >= vertices) {
                defects.bad_index.note(mesh, corners);
            } else if !is_proper(*corners, vertices) {
                defects.repeated_corner.note(mesh, corners);
            } else if has_zero_area(corners.map(|v| mesh.positions[v as usize])) {
                defects.zero_area.note(mesh, corners);
            }
        }
        defects
    };
    let pieces: Vec<Defects> = mesh.triangles.par_chunks(ITEMS_A_PIECE).map(examine).collect();
    pieces.into_iter().fold(Defects::default(), Defects::append)
}

fn has_zero_area(corners: [[f64; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(DVec3::from_array);
    // Scaling by a power of two keeps the squares of tiny and huge sides in range.
    let reach = (b - a).abs().max((c - a).abs()).max_element();
    let scale = libm::ldexp(1.0, -(libm::ilogb(reach).clamp(-1000, 1000)));
    let [ab, bc, ca] = [(b - a) * scale, (c - b) * scale, (a - c) * scale];
    let longest = ab.length_squared().max(bc.length_squared()).max(ca.length_squared());
    ab.cross(ca).length() <= ON_A_LINE * longest
}

/// What a vertex contributes to its component.
#[derive(Clone, Copy, Debug)]
struct StarTally {
    /// Edges to neighbours of greater number.
    edges: u32,
    closed: bool,
    manifold: bool,
    oriented: bool,
}

/// Defects of vertices and of the edges between them.
fn examine_stars(mesh: &Mesh, stars: &Stars) -> (Vec<StarTally>, Defects) {
    let examine = |(piece, positions): (usize, &[[f64; 3]])| {
        let mut defects = Defects::default();
        let mut star = Star::default();
        let mut tallies = Vec::with_capacity(positions.len());
        for (position, vertex) in positions.iter().zip((piece * ITEMS_A_PIECE) as u32..) {
            if !position.iter().all(|value| value.is_finite()) {
                defects.not_finite.note(mesh, &[vertex]);
            }
            star.open(mesh, stars, vertex);
            tallies.push(examine_star(mesh, vertex, &mut star, &mut defects));
        }
        (tallies, defects)
    };
    let pieces: Vec<(Vec<StarTally>, Defects)> =
        mesh.positions.par_chunks(ITEMS_A_PIECE).enumerate().map(examine).collect();
    let mut tallies = Vec::with_capacity(mesh.positions.len());
    let mut defects = Defects::default();
    for (piece_tallies, piece_defects) in pieces {
        tallies.extend(piece_tallies);
        defects = defects.append(piece_defects);
    }
    (tallies, defects)
}

fn examine_star(mesh: &Mesh, vertex: u32, star: &mut Star, defects: &mut Defects) -> StarTally {
    let mut tally = StarTally { edges: 0, closed: true, manifold: true, oriented: true };
    // Each edge is examined once: from its end of lesser number.
    for sides in star.edges().filter(|sides| sides[0].neighbour > vertex) {
        let ends = [vertex, sides[0].neighbour];
        tally.edges += 1;
        if sides.len() == 1 {
            defects.boundary_edge.note(mesh, &ends);
            tally.closed = false;
        }
        if sides.len() > 2 {
            defects.nonmanifold_edge.note(mesh, &ends);
            tally.manifold = false;
        }
        if sides.len() > 1 && is_misoriented(sides) {
            defects.misoriented_edge.note(mesh, &ends);
            tally.oriented = false;
        }
        // Each set of three corners is examined once: from its edge of least numbers.
        for pair in sides.windows(2) {
            if pair[0].opposite == pair[1].opposite && pair[0].opposite > ends[1] {
                defects.duplicate.note(mesh, &mesh.triangles[pair[1].triangle as usize]);
            }
        }
    }
    match star.fans() {
        0 => defects.isolated_vertex.note(mesh, &[vertex]),
        1 => {}
        _ => {
            defects.nonmanifold_vertex.note(mesh, &[vertex]);
            tally.manifold = false;
        }
    }
    tally
}

fn is_misoriented(sides: &[Side]) -> bool {
    let outgoing = sides.iter().filter(|side| side.outgoing).count();
    outgoing.abs_diff(sides.len() - outgoing) > sides.len() % 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{both, cube, sphere, tetrahedron, torus};

    /// The counts of the defects in the order of the contract.
    fn counts(mesh: &Mesh) -> [u64; 10] {
        check(mesh).defects.by_name().map(|(_, defect)| defect.count)
    }

    #[test]
    fn closed_surfaces_are_sound_and_have_their_genus() {
        for (mesh, euler, genus) in [
            (cube(), 2, 0),
            (tetrahedron(), 2, 0),
            (sphere(4), 2, 0),
            (torus(12), 0, 1),
            (both(torus(9), &both(torus(7), &cube())), 2, 2),
        ] {
            let found = check(&mesh);
            assert!(found.is_sound() && found.is_closed(), "{found:?}");
            assert!(found.is_manifold() && found.is_oriented());
            assert_eq!((found.euler, found.genus), (euler, Some(genus)));
            assert_eq!(found.edges * 2, found.triangles * 3);
        }
        assert_eq!(check(&both(cube(), &torus(5))).components.len(), 2);
    }

    #[test]
    fn an_inverted_mesh_is_inside_out_and_nothing_else() {
        let mut mesh = torus(12);
        for corners in &mut mesh.triangles {
            corners.swap(0, 1);
        }
        let found = check(&mesh);
        assert!(found.inside_out && !found.is_sound() && found.is_oriented());
        assert_eq!(counts(&mesh), [0; 10]);
    }

    #[test]
    fn a_missing_triangle_leaves_three_boundary_edges() {
        let mut mesh = cube();
        mesh.triangles.pop();
        assert_eq!(counts(&mesh), [0, 0, 0, 0, 0, 3, 0, 0, 0, 0]);
        assert!(!check(&mesh).is_closed());
        assert_eq!(check(&mesh).genus, None);
        assert_eq!(check(&mesh).euler, 1);
    }

    #[test]
    fn a_flipped_triangle_has_three_misoriented_edges() {
        let mut mesh = cube();
        mesh.triangles[5].swap(1, 2);
        assert_eq!(counts(&mesh), [0, 0, 0, 0, 0, 0, 0, 3, 0, 0]);
        assert!(check(&mesh).is_closed() && !check(&mesh).is_oriented());
    }

    #[test]
    fn a_fin_makes_its_edge_nonmanifold() {
        let mut mesh = cube();
        mesh.positions.push([0.5, 0.5, 3.0]);
        mesh.triangles.push([4, 5, 8]);
        assert_eq!(counts(&mesh), [0, 0, 0, 0, 0, 2, 1, 0, 0, 0]);
    }

    #[test]
    fn cubes_that_touch_at_a_vertex_or_an_edge_are_not_manifold() {
        let touching = |shared: &[u32]| {
            // The second cube's vertex 0 is the first one's 7, its 1 the first one's 6.
            let mut mesh = both(cube(), &cube());
            for corner in mesh.triangles.iter_mut().flatten() {
                for &vertex in shared {
                    if *corner == vertex + 8 {
                        *corner = 7 - vertex;
                    }
                }
            }
            mesh
        };
        let vertex = touching(&[0]);
        assert_eq!(counts(&vertex), [0, 0, 0, 0, 0, 0, 0, 0, 1, 1]);
        assert!(check(&vertex).is_closed() && !check(&vertex).is_manifold());
        assert_eq!(counts(&touching(&[0, 1])), [0, 0, 0, 0, 0, 0, 1, 0, 0, 2]);
    }

    #[test]
    fn duplicates_are_found_whatever_the_order_of_their_corners() {
        let mut mesh = cube();
        let [a, b, c] = mesh.triangles[3];
        mesh.triangles.extend([[b, c, a], [b, a, c]]);
        let found = check(&mesh);
        assert_eq!(found.defects.duplicate.count, 2);
        assert_eq!(found.defects.nonmanifold_edge.count, 3);
    }

    #[test]
    fn degenerate_triangles_are_told_apart() {
        let mut mesh = cube();
        mesh.positions.extend([[0.1, 0.1, 5.0], [0.2, 0.2, 10.0], [f64::NAN; 3], [0.3, 0.3, 15.0]]);
        mesh.triangles.extend([[8, 9, 11], [1, 1, 2], [3, 99, 4]]);
        assert_eq!(counts(&mesh), [1, 1, 1, 1, 0, 3, 0, 0, 0, 1]);
        let found = check(&mesh);
        assert_eq!(found.defects.zero_area.examples[0].vertices, [8, 9, 11]);
        assert_eq!(found.defects.zero_area.examples[0].position, [0.1, 0.1, 5.0]);
    }

    #[test]
    fn zero_area_is_relative_to_the_triangle() {
        for scale in [1e-200, 1e-9, 1.0, 1e12, 1e200] {
            let corners =
                |height: f64| [[0.0; 3], [scale, 0.0, 0.0], [0.4 * scale, height * scale, 0.0]];
            assert!(has_zero_area(corners(0.0)) && has_zero_area(corners(1e-17)), "{scale}");
            assert!(!has_zero_area(corners(1e-14)), "{scale}");
        }
        assert!(has_zero_area([[2.5; 3]; 3]));
    }

    #[test]
    fn an_empty_mesh_is_not_closed() {
        let found = check(&Mesh::default());
        assert!(!found.is_closed() && !found.is_sound() && !found.inside_out);
        assert_eq!((found.euler, found.genus), (0, Some(0)));
    }

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let mut mesh = sphere(6);
        mesh.triangles.retain(|corners| corners[0] % 97 != 5);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| check(&mesh))
        };
        assert_eq!(on(1), on(3));
    }
}
