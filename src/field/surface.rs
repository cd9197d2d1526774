//! A triangle soup made into a surface whose sides can be told apart.
//!
//! Vertices at one position are joined, faces that enclose nothing are left out, neighbours are
//! found, and faces turned against their neighbours are turned back. What was done is counted in
//! [`Repairs`]; what could not be mended is counted in [`Edges`].

use super::orientation::{turn_back, turn_outward, volume};
use crate::geom::Aabb;
use crate::mesh::Mesh;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// No half-edge.
pub const NONE: u32 = u32::MAX;

/// Why a mesh has no distance field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// No faces, or none with three different corners.
    #[error("the mesh has no faces with three different corners ({faces} faces in all)")]
    NoFaces {
        /// Faces of the mesh.
        faces: usize,
    },
    /// More faces than can be numbered.
    #[error("the mesh has {faces} faces, more than {limit}; simplify it first")]
    TooManyFaces {
        /// Faces of the mesh.
        faces: usize,
        /// Most faces allowed.
        limit: usize,
    },
    /// A corner is no vertex.
    #[error("face {face} names vertex {vertex}, but there are {vertices} vertices")]
    NoSuchVertex {
        /// The face, from 0.
        face: usize,
        /// The vertex it names, from 0.
        vertex: u32,
        /// Vertices of the mesh.
        vertices: usize,
    },
    /// A vertex in use is infinite or not a number.
    #[error("vertex {vertex} of face {face} is not finite")]
    NotFinite {
        /// The face, from 0.
        face: usize,
        /// The vertex, from 0.
        vertex: u32,
    },
}

/// What was mended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Repairs {
    /// Faces left out because two of their corners are one position.
    pub degenerate_faces: usize,
    /// Faces left out because another one has the same corners.
    pub repeated_faces: usize,
    /// Faces turned over to agree with their neighbours, or with those of a body inside out.
    pub turned_faces: usize,
    /// Whether the whole surface was inside out and was turned over.
    pub inverted: bool,
}

/// How faces meet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edges {
    /// By half-edge `3 * face + i` (from corner `i` of the face to the next): the other half-edge
    /// of an edge of two faces, [`NONE`] at other edges.
    pub twin: Vec<u32>,
    /// Edges of one face.
    pub open: usize,
    /// Edges of more than two faces.
    pub crowded: usize,
    /// Edges that two faces run along in the same sense.
    pub inconsistent: usize,
    /// The boundary of the surface as a chain: edges run along more often in one sense than in the
    /// other, from the lower to the higher vertex, with the excess of that sense.
    pub rim: Vec<(u32, u32, i32)>,
}

impl Edges {
    /// Whether every edge has two faces that run along it in opposite senses.
    #[must_use]
    pub fn is_closed_manifold(&self) -> bool {
        self.open == 0 && self.crowded == 0 && self.inconsistent == 0
    }

    /// The edges of `triangles`, whose corners are below `vertices`.
    #[must_use]
    pub fn of(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let halves = |visit: &mut dyn FnMut(u32, u32, u32)| {
            for (face, corners) in triangles.iter().enumerate() {
                for i in 0..3 {
                    visit(corners[i], corners[(i + 1) % 3], (3 * face + i) as u32);
                }
            }
        };
        // Half-edges by their lower vertex; a bucket is then sorted by the higher one.
        let mut start = vec![0_u32; vertices + 1];
        halves(&mut |a, b, _| start[a.min(b) as usize + 1] += 1);
        for v in 0..vertices {
            start[v + 1] += start[v];
        }
        let mut fill = start.clone();
        let mut sorted = vec![(0_u32, 0_u32); 3 * triangles.len()];
        halves(&mut |a, b, half| {
            let slot = &mut fill[a.min(b) as usize];
            sorted[*slot as usize] = (a.max(b), half);
            *slot += 1;
        });
        let mut edges = Self { twin: vec![NONE; 3 * triangles.len()], ..Self::default() };
        for low in 0..vertices {
            let bucket = &mut sorted[start[low] as usize..start[low + 1] as usize];
            bucket.sort_unstable();
            for edge in bucket.chunk_by(|a, b| a.0 == b.0) {
                edges.add(triangles, low as u32, edge);
            }
        }
        edges
    }

    /// Adds the edge from vertex `low` with these half-edges, given with their higher vertex.
    fn add(&mut self, triangles: &[[u32; 3]], low: u32, halves: &[(u32, u32)]) {
        let sense = |half: u32| {
            if triangles[half as usize / 3][half as usize % 3] == low { 1 } else { -1 }
        };
        let excess: i32 = halves.iter().map(|(_, half)| sense(*half)).sum();
        if excess != 0 {
            self.rim.push((low, halves[0].0, excess));
        }
        match *halves {
            [_] => self.open += 1,
            [(_, first), (_, second)] => {
                self.twin[first as usize] = second;
                self.twin[second as usize] = first;
                self.inconsistent += usize::from(excess != 0);
            }
            _ => self.crowded += 1,
        }
    }
}

/// A mended surface.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Positions, no two equal but for those that no face uses.
    pub positions: Vec<DVec3>,
    /// Corners of the faces, three different ones each.
    pub triangles: Vec<[u32; 3]>,
    /// How the faces meet.
    pub edges: Edges,
    /// What was mended.
    pub repairs: Repairs,
}

impl Surface {
    /// Most faces that can be numbered by half-edge.
    const MOST_FACES: usize = (u32::MAX / 3 - 1) as usize;

    /// Mends `mesh`.
    ///
    /// # Errors
    /// [`Unusable`] if it has no faces, or faces that make no sense.
    pub fn new(mesh: &Mesh) -> Result<Self, Unusable> {
        let faces = mesh.triangles.len();
        if faces > Self::MOST_FACES {
            return Err(Unusable::TooManyFaces { faces, limit: Self::MOST_FACES });
        }
        let mut triangles = joined(mesh)?;
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        if triangles.is_empty() {
            return Err(Unusable::NoFaces { faces });
        }
        let mut repairs =
            Repairs { degenerate_faces: faces - triangles.len(), ..Repairs::default() };
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| DVec3::from_array(*p)).collect();
        let mut edges = Edges::of(&triangles, positions.len());
        if edges.crowded > 0 {
            let kept = without_repeats(&triangles);
            if kept.len() < triangles.len() {
                repairs.repeated_faces = triangles.len() - kept.len();
                triangles = kept;
                edges = Edges::of(&triangles, positions.len());
            }
        }
        if edges.inconsistent > 0 {
            repairs.turned_faces = turn_back(&positions, &mut triangles, &edges);
            edges = Edges::of(&triangles, positions.len());
        }
        let mut surface = Self { positions, triangles, edges, repairs };
        if surface.volume() < 0.0 {
            for corners in &mut surface.triangles {
                corners.swap(1, 2);
            }
            surface.edges = Edges::of(&surface.triangles, surface.positions.len());
            surface.repairs.inverted = true;
        }
        let turned = turn_outward(&surface.positions, &mut surface.triangles, &surface.edges);
        if turned > 0 {
            surface.repairs.turned_faces += turned;
            surface.edges = Edges::of(&surface.triangles, surface.positions.len());
        }
        Ok(surface)
    }

    /// Positions of a face's corners.
    #[inline(always)]
    #[must_use]
    pub fn corners(&self, face: usize) -> [DVec3; 3] {
        self.triangles[face].map(|v| self.positions[v as usize])
    }

    /// Positions of all faces' corners.
    pub fn faces(&self) -> impl Iterator<Item = [DVec3; 3]> {
        (0..self.triangles.len()).map(|face| self.corners(face))
    }

    /// The least box around the faces.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.triangles.iter().flatten().map(|v| self.positions[*v as usize]))
    }

    /// The enclosed volume; of an open surface, that of the cone to the middle of its box.
    fn volume(&self) -> f64 {
        let bounds = self.bounds();
        let middle = 0.5 * bounds.lo + 0.5 * bounds.hi;
        volume(&self.positions, &self.triangles, middle)
    }
}

/// The corners of the faces, positions that are equal having one name: the lowest.
fn joined(mesh: &Mesh) -> Result<Vec<[u32; 3]>, Unusable> {
    let vertices = mesh.positions.len();
    let mut name = vec![NONE; vertices];
    let mut first: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    first.reserve(vertices);
    let mut triangles = mesh.triangles.clone();
    for (face, corners) in triangles.iter_mut().enumerate() {
        for vertex in corners {
            let Some(known) = name.get_mut(*vertex as usize) else {
                return Err(Unusable::NoSuchVertex { face, vertex: *vertex, vertices });
            };
            if *known == NONE {
                let position = mesh.positions[*vertex as usize];
                if !position.iter().all(|x| x.is_finite()) {
                    return Err(Unusable::NotFinite { face, vertex: *vertex });
                }
                // Adding zero makes both zeros one.
                let key = position.map(|x| (x + 0.0).to_bits());
                *known = *first.entry(key).or_insert(*vertex);
            }
            *vertex = *known;
        }
    }
    Ok(triangles)
}

/// The faces that are left when faces with the same corners are counted against each other by
/// sense: one of the prevailing sense, or none if there are as many of both. The latter are walls
/// between bodies that touch; but where an edge has an odd number of faces one of them is needed.
fn without_repeats(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let key = |corners: &[u32; 3]| {
        let mut sorted = *corners;
        sorted.sort_unstable();
        sorted
    };
    // Even permutations of the sorted corners run in the positive sense.
    let sense = |[a, b, c]: [u32; 3]| if (a < b) == ((b < c) == (a < c)) { 1 } else { -1 };
    let mut excess: FxHashMap<[u32; 3], i32> = FxHashMap::default();
    let mut uses: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    for corners in triangles {
        *excess.entry(key(corners)).or_default() += sense(*corners);
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let odd = |[a, b, c]: [u32; 3]| {
        [[a, b], [b, c], [a, c]].iter().any(|edge| uses.get(edge).is_some_and(|n| n % 2 == 1))
    };
    let keep = |all_walls: bool| {
        let mut excess = excess.clone();
        let mut kept = Vec::new();
        for corners in triangles {
            let key = key(corners);
            let Some(count) = excess.get(&key) else { continue };
            let wanted = match count.signum() {
                0 => all_walls || odd(key),
                prevailing => prevailing == sense(*corners),
            };
            if wanted {
                kept.push(*corners);
                excess.remove(&key);
            }
        }
        kept
    };
    let kept = keep(false);
    // A sheet covered on both sides is all walls: better kept than an empty surface.
    if kept.is_empty() { keep(true) } else { kept }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{both, cube, mapped, soup};
    use super::*;

    #[test]
    fn a_soup_of_faces_is_joined() {
        let surface = Surface::new(&soup(&cube())).unwrap();
        assert!(surface.edges.is_closed_manifold() && surface.edges.rim.is_empty());
        assert_eq!(surface.repairs, Repairs::default());
        assert_eq!(surface.volume(), 1.0);
    }

    #[test]
    fn a_surface_inside_out_is_turned_over() {
        let mut mesh = cube();
        for t in &mut mesh.triangles {
            t.swap(0, 1);
        }
        let surface = Surface::new(&mesh).unwrap();
        assert!(surface.repairs.inverted && surface.volume() == 1.0);
    }

    #[test]
    fn turned_faces_are_turned_back() {
        for turned in 1..7 {
            let mut mesh = cube();
            for t in mesh.triangles.iter_mut().take(turned) {
                t.swap(0, 1);
            }
            let surface = Surface::new(&mesh).unwrap();
            assert!(surface.edges.is_closed_manifold());
            assert_eq!((surface.repairs.turned_faces, surface.volume()), (turned, 1.0));
        }
    }

    #[test]
    fn a_body_inside_out_beside_others_is_turned_over_but_a_cavity_is_not() {
        let inverted = |side: f64, corner: f64| {
            let mut body = mapped(&cube(), |p| side * p + DVec3::splat(corner));
            body.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            body
        };
        for (side, corner, turned, volume) in
            [(0.5, 2.0, 12, 1.125), (2.0, 2.0, 12, 9.0), (0.5, 0.25, 0, 0.875)]
        {
            let surface = Surface::new(&both(&cube(), &inverted(side, corner))).unwrap();
            assert_eq!(surface.repairs.turned_faces, turned);
            // A sum of 24 terms of order one.
            assert!((surface.volume() - volume).abs() < 1e-14);
        }
    }

    #[test]
    fn repeated_and_degenerate_faces_are_left_out() {
        let mut mesh = cube();
        mesh.triangles.extend([[0, 4, 6], [4, 6, 0], [1, 1, 2]]);
        let surface = Surface::new(&mesh).unwrap();
        assert!(surface.edges.is_closed_manifold());
        assert_eq!((surface.repairs.repeated_faces, surface.repairs.degenerate_faces), (2, 1));
    }

    #[test]
    fn the_wall_between_touching_bodies_is_left_out() {
        // The upper cube's bottom must be cut along the lower one's diagonal.
        let mut upper = mapped(&cube(), |p| DVec3::new(p.x, p.y, 2.0 - p.z));
        for t in &mut upper.triangles {
            t.swap(0, 1);
        }
        let surface = Surface::new(&both(&cube(), &upper)).unwrap();
        assert!(surface.edges.is_closed_manifold());
        assert_eq!(surface.repairs.repeated_faces, 4);
        // A sum of twenty terms of order one tenth.
        assert!((surface.volume() - 2.0).abs() < 1e-15);
    }

    #[test]
    fn holes_and_fins_are_counted() {
        let mut mesh = cube();
        mesh.triangles.pop();
        let open = Surface::new(&mesh).unwrap();
        assert_eq!((open.edges.open, open.edges.crowded, open.edges.rim.len()), (3, 0, 3));
        let mut mesh = cube();
        mesh.positions.push([2.0, 2.0, 2.0]);
        mesh.triangles.push([1, 3, 8]);
        let fin = Surface::new(&mesh).unwrap();
        assert_eq!((fin.edges.open, fin.edges.crowded, fin.edges.rim.len()), (2, 1, 3));
    }

    #[test]
    fn unusable_meshes_are_refused() {
        let mut mesh = cube();
        mesh.positions[3][1] = f64::NAN;
        assert!(matches!(Surface::new(&mesh), Err(Unusable::NotFinite { vertex: 3, .. })));
        mesh.triangles[5][2] = 8;
        mesh.positions[3][1] = 1.0;
        assert!(matches!(
            Surface::new(&mesh),
            Err(Unusable::NoSuchVertex { face: 5, vertex: 8, vertices: 8 })
        ));
        mesh.triangles = vec![[1, 1, 2]];
        assert_eq!(Surface::new(&mesh).err(), Some(Unusable::NoFaces { faces: 1 }));
    }
}
