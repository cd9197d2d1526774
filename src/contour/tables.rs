//! The 256 cases of a cell, generated from one rule for faces.
//!
//! A corner of a cell is numbered `dx + 2 dy + 4 dz`. Edges are numbered by axis: `dy + 2 dz`
//! along x, `4 + dx + 2 dz` along y, `8 + dx + 2 dy` along z. A *slot* is an edge (0 to 11) or
//! `12 +` a corner: what a triangle's corner may be.
//!
//! # Rule
//! On a cell face, walking its border counter-clockwise seen from outside the cell, each crossing
//! from inside to outside is joined to the next crossing from outside to inside. On an ambiguous
//! face (two opposite corners inside) this **joins the inside corners**: walls thinner than a cell
//! stay whole. The segments of a cell's faces make closed loops of 3 to 7 crossings; each is
//! triangulated without a diagonal between two crossings of one face.
//!
//! # What follows
//! *Closed, oriented, edge-manifold.* Pad the grid by outside nodes. Each crossed edge has one
//! vertex. Each segment of a face belongs to the two cells that share the face, which walk it in
//! opposite directions, because the rule reads the same signs and "counter-clockwise from outside"
//! is reversed. A diagonal lies in no face, hence in one cell, where its two triangles use it in
//! opposite directions. So each edge of the mesh has two triangles of opposite directions.
//!
//! *Vertex-manifold.* The four cells around a crossed grid edge each hold one loop through it, and
//! in it the triangles at that vertex are one fan between the segments of the two faces; over the
//! four cells the fans close to one ring.
//!
//! *The flat cut.* A crossing on an edge to a ghost is moved to its inside node. A node of an
//! outer plane has one such edge, a node of a box edge two, a corner three: the moved crossings of
//! one node are joined by segments (of ghost cells' faces), so contracting them removes triangles
//! with a repeated vertex only and leaves one ring around the node. This is [`Tables::cap`].
//!
//! *No zero area.* A line meets the boundary of a convex cell in two points unless it lies in a
//! face, and no triangle has its three vertices in one face other than a cap's (which has corners
//! at nodes and in the interior of edges, no three of them on a line). So three distinct collinear
//! vertices need a vertex on a node that another crossed edge touches. Placement keeps crossings
//! away from nodes with more than one crossed edge by [`tau`](super::grid::TAU), hence areas are
//! at least `tau^2 / 2` and angles `tau^2`, in units of the cell.
//!
//! *No piercing.* The triangles of a cell never pierce one another, wherever the crossings lie on
//! their edges. Among the triangulations without diagonals in faces a few of loops of seven do
//! pierce; `SECOND_CHOICE` avoids them. A test looks for piercing in all cases at random crossings.
//!
//! Source: Lorensen & Cline 1987 for the method. The tables are generated, not copied, so that the
//! properties above hold by construction.

use std::sync::LazyLock;

/// Most triangles in a cell.
pub const MAX_TRIANGLES: usize = 5;

/// Triangles of one case: corners as slots, three a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Case {
    /// Slots of the corners; entries past `3 * count` are zero.
    pub slots: [u8; 15],
    /// Number of triangles.
    pub count: u8,
}

/// Where a padded cell lies along each axis: between nodes, below the first or above the last.
pub const POSITIONS: usize = 27;

/// Triangles for all cases of interior cells and of cells that touch ghosts.
#[derive(Debug)]
pub struct Tables {
    /// Cases of cells between nodes, by inside corners.
    pub cell: [Case; 256],
    /// Loops of crossings of a case beyond the first.
    pub more_loops: [u8; 256],
    caps: Box<[[Case; 256]; POSITIONS]>,
}

impl Tables {
    /// Cases of cells at `position`: base-three digits for x, y, z; 1 where the cell's lower
    /// corners are ghosts, 2 where its upper ones are.
    #[must_use]
    #[inline(always)]
    pub fn cap(&self, position: usize) -> &[Case; 256] {
        &self.caps[position]
    }
}

/// The tables, generated at first use.
pub static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let cell = std::array::from_fn(|case| triangles(case as u8));
    let mut caps = Box::new([[Case::default(); 256]; POSITIONS]);
    for (position, table) in caps.iter_mut().enumerate() {
        for (case, entry) in table.iter_mut().enumerate() {
            *entry = capped(&cell[case], case, position);
        }
    }
    let more_loops = std::array::from_fn(|case| loops(case as u8).len().saturating_sub(1) as u8);
    Tables { cell, more_loops, caps }
});

/// Corners of the faces, counter-clockwise seen from outside the cell.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The edge between two adjacent corners.
const fn edge_between(a: usize, b: usize) -> usize {
    let low = a & b;
    match a ^ b {
        1 => low >> 1,
        2 => 4 + (low & 1) + 2 * (low >> 2),
        _ => 8 + (low & 3),
    }
}

/// The lower and the upper corner of an edge.
#[must_use]
pub const fn corners_of(edge: usize) -> [usize; 2] {
    let (q, r) = (edge / 4, edge % 4);
    let low = match q {
        0 => 2 * r,
        1 => (r & 1) + 4 * (r >> 1),
        _ => r,
    };
    [low, low + (1 << q)]
}

/// Whether two edges lie in one face of the cell.
const fn share_a_face(a: usize, b: usize) -> bool {
    FACES_OF[a] & FACES_OF[b] != 0
}

/// By edge: the faces that hold it, a bit each.
const FACES_OF: [u8; 12] = {
    let mut faces = [0; 12];
    let mut i = 0;
    while i < 24 {
        let face = FACES[i / 4];
        faces[edge_between(face[i % 4], face[(i + 1) % 4])] |= 1 << (i / 4);
        i += 1;
    }
    faces
};

/// The loops of crossings of a case, inside on the left seen from outside the solid.
fn loops(case: u8) -> Vec<Vec<usize>> {
    let inside = |corner: usize| case >> corner & 1 == 1;
    let mut next = [None; 12];
    for face in FACES {
        let crossing = |i: usize| edge_between(face[i % 4], face[(i + 1) % 4]);
        let leaves = |i: usize| inside(face[i % 4]) && !inside(face[(i + 1) % 4]);
        let enters = |i: usize| !inside(face[i % 4]) && inside(face[(i + 1) % 4]);
        for i in (0..4).filter(|&i| leaves(i)) {
            next[crossing(i)] = (i + 1..i + 4).find(|&j| enters(j)).map(crossing);
        }
    }
    let mut found = Vec::new();
    for start in 0..12 {
        let mut ring = Vec::new();
        let mut at = start;
        while let Some(following) = next[at].take() {
            ring.push(at);
            at = following;
        }
        if !ring.is_empty() {
            found.push(ring);
        }
    }
    found
}

/// The first triangulations, `most` at most, of `ring[first..=last]` without a diagonal in a face of
/// the cell.
fn triangulations(ring: &[usize], first: usize, last: usize, most: usize) -> Vec<Vec<[usize; 3]>> {
    if last - first < 2 {
        return vec![Vec::new()];
    }
    let allowed = |a: usize, b: usize| b - a == 1 || !share_a_face(ring[a], ring[b]);
    let mut found = Vec::new();
    for apex in first + 1..last {
        if !allowed(first, apex) || !allowed(apex, last) {
            continue;
        }
        let rights = triangulations(ring, apex, last, most);
        for left in triangulations(ring, first, apex, most) {
            for right in &rights {
                // Reversed: loops turn clockwise seen from outside the solid.
                let here = [ring[first], ring[last], ring[apex]];
                found.push(left.iter().chain([&here]).chain(right).copied().collect());
                if found.len() == most {
                    return found;
                }
            }
        }
    }
    found
}

/// Cases (each a single loop of seven) whose first allowed triangulation pierces itself for one in
/// seven random crossings; they take their second one.
const SECOND_CHOICE: [u8; 2] = [25, 26];

fn triangles(case: u8) -> Case {
    let choice = usize::from(SECOND_CHOICE.contains(&case));
    let mut entry = Case::default();
    for ring in loops(case) {
        for corners in &triangulations(&ring, 0, ring.len() - 1, choice + 1)[choice] {
            push(&mut entry, *corners);
        }
    }
    entry
}

fn push(entry: &mut Case, corners: [usize; 3]) {
    let at = 3 * usize::from(entry.count);
    for (slot, corner) in entry.slots[at..at + 3].iter_mut().zip(corners) {
        *slot = corner as u8;
    }
    entry.count += 1;
}

/// The case of a cell that touches ghosts: crossings of edges to ghosts become their inside node.
fn capped(cell: &Case, case: usize, position: usize) -> Case {
    let digits = [position % 3, position / 3 % 3, position / 9];
    let ghost = |corner: usize| {
        (0..3).any(|a| match digits[a] {
            0 => false,
            1 => corner >> a & 1 == 0,
            _ => corner >> a & 1 == 1,
        })
    };
    let slot = |edge: u8| {
        let [low, high] = corners_of(usize::from(edge));
        match (ghost(low), ghost(high)) {
            (false, false) => edge,
            _ if case >> low & 1 == 1 => 12 + low as u8,
            _ => 12 + high as u8,
        }
    };
    let mut entry = Case::default();
    for t in 0..usize::from(cell.count) {
        let corners = [0, 1, 2].map(|k| usize::from(slot(cell.slots[3 * t + k])));
        if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
            push(&mut entry, corners);
        }
    }
    entry
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::testing::Random;
    use glam::DVec3;

    fn corner(c: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|a| (c >> a & 1) as f64))
    }

    /// Crossings of the twelve edges: anywhere, often close to a corner.
    fn crossings(random: &mut Random) -> [DVec3; 12] {
        std::array::from_fn(|edge| {
            let t = match random.below(5) {
                0 => 0.01 * random.unit(),
                1 => 1.0 - 0.01 * random.unit(),
                _ => random.unit(),
            };
            let [low, high] = corners_of(edge).map(corner);
            low.lerp(high, t)
        })
    }

    fn corners_in(case: &Case) -> impl Iterator<Item = [usize; 3]> + '_ {
        case.slots[..3 * usize::from(case.count)]
            .chunks(3)
            .map(|t| [t[0], t[1], t[2]].map(usize::from))
    }

    /// Whether an edge of one triangle passes through the interior of another.
    fn pierces(case: &Case, points: &[DVec3; 12]) -> bool {
        corners_in(case).any(|face| {
            let [u, v, w] = face.map(|slot| points[slot]);
            let normal = (v - u).cross(w - u);
            corners_in(case).any(|other| {
                (0..3).any(|k| {
                    let ends = [other[k], other[(k + 1) % 3]];
                    if ends.iter().any(|slot| face.contains(slot)) {
                        return false;
                    }
                    let [p, q] = ends.map(|slot| points[slot]);
                    let (a, b) = (normal.dot(p - u), normal.dot(q - u));
                    let at = p + (q - p) * (a / (a - b));
                    let left = |s: DVec3, t: DVec3| normal.dot((t - s).cross(at - s)) > 1e-12;
                    a * b < 0.0 && left(u, v) && left(v, w) && left(w, u)
                })
            })
        })
    }

    #[test]
    fn no_case_pierces_itself_wherever_the_crossings_lie() {
        let mut random = Random::new(1);
        for case in &TABLES.cell {
            for _ in 0..1000 {
                assert!(!pierces(case, &crossings(&mut random)), "{case:?}");
            }
        }
    }

    #[test]
    fn no_diagonal_lies_in_a_face() {
        for (number, case) in TABLES.cell.iter().enumerate() {
            let rings = loops(number as u8);
            let adjacent = |a: usize, b: usize| {
                rings.iter().any(|ring| {
                    (0..ring.len()).any(|i| {
                        let pair = [ring[i], ring[(i + 1) % ring.len()]];
                        pair == [a, b] || pair == [b, a]
                    })
                })
            };
            let triangles: usize = rings.iter().map(|ring| ring.len() - 2).sum();
            assert_eq!(usize::from(case.count), triangles);
            assert!(triangles <= MAX_TRIANGLES);
            for [a, b, c] in corners_in(case) {
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    assert!(adjacent(p, q) || !share_a_face(p, q), "case {number}");
                }
            }
        }
    }

    #[test]
    fn ambiguous_faces_join_the_inside_corners() {
        // Corners 0 and 3 are opposite on the face z = 0: one loop of six around both.
        assert_eq!(loops(0b1001).iter().map(Vec::len).collect::<Vec<_>>(), [6]);
        // Their complement meets on that face as outside corners: again one loop.
        assert_eq!(loops(!0b1001).iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
    }

    #[test]
    fn triangles_face_the_outside() {
        let points: [DVec3; 12] = std::array::from_fn(|edge| {
            let [low, high] = corners_of(edge).map(corner);
            low.midpoint(high)
        });
        for inside in 0..8 {
            let case = &TABLES.cell[1 << inside];
            let [u, v, w] = corners_in(case).next().unwrap().map(|slot| points[slot]);
            assert!((v - u).cross(w - u).dot(u - corner(inside)) > 0.0);
        }
    }

    #[test]
    fn caps_are_filled_squares() {
        // Ghosts below in z, all four real corners inside: two triangles of nodes.
        let cap = &TABLES.cap(9)[0b1111_0000];
        assert_eq!(cap.count, 2);
        assert!(corners_in(cap).flatten().all(|slot| slot >= 12 + 4));
        // At a box corner one real corner is left, whose three crossings become one node.
        assert_eq!(TABLES.cap(13)[0b1000_0000].count, 0);
        // One inside corner of the plane: the triangle of its node and two crossings.
        assert_eq!(TABLES.cap(9)[0b0001_0000].count, 1);
    }
}
