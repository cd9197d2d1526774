//! Which triangles meet where: the star of every vertex, and the connected components.
//!
//! Only *proper* triangles count: three different vertices, all of which exist. Works from indices
//! alone; positions are never looked at. Linear in the size of the mesh but for the sorting of each
//! star, whose size is about six.

use super::Mesh;

/// Whether the corners are three different vertices of a mesh with `vertices` vertices.
#[must_use]
pub fn is_proper([a, b, c]: [u32; 3], vertices: usize) -> bool {
    a != b && b != c && c != a && [a, b, c].iter().all(|&corner| (corner as usize) < vertices)
}

/// The proper triangles about every vertex.
#[derive(Clone, Debug)]
pub struct Stars {
    /// Where each vertex's triangles start in `triangles`; one more than there are vertices.
    starts: Vec<usize>,
    triangles: Vec<u32>,
}

impl Stars {
    /// The stars of `mesh`.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let vertices = mesh.positions.len();
        let proper = || {
            mesh.triangles.iter().zip(0_u32..).filter(|(corners, _)| is_proper(**corners, vertices))
        };
        let mut starts = vec![0; vertices + 1];
        for (corners, _) in proper() {
            for &corner in corners {
                starts[corner as usize + 1] += 1;
            }
        }
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; starts[vertices]];
        for (corners, number) in proper() {
            for &corner in corners {
                triangles[next[corner as usize]] = number;
                next[corner as usize] += 1;
            }
        }
        Self { starts, triangles }
    }

    /// The triangles about `vertex`, ascending.
    #[must_use]
    pub fn about(&self, vertex: u32) -> &[u32] {
        &self.triangles[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }
}

/// A triangle at an edge of a star.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Side {
    /// The vertex at the edge's other end.
    pub neighbour: u32,
    /// The corner of the triangle that is not on the edge.
    pub opposite: u32,
    /// The triangle.
    pub triangle: u32,
    /// Whether the triangle runs from the star's vertex to the neighbour.
    pub outgoing: bool,
    /// Position of the triangle in the star.
    place: u32,
}

/// The star of one vertex, taken apart; scratch memory to be used again for the next.
#[derive(Debug, Default)]
pub struct Star {
    sides: Vec<Side>,
    parents: Vec<u32>,
}

impl Star {
    /// Takes the star of `vertex` apart.
    pub fn open(&mut self, mesh: &Mesh, stars: &Stars, vertex: u32) {
        self.sides.clear();
        for (&triangle, place) in stars.about(vertex).iter().zip(0..) {
            let [a, b, c] = mesh.triangles[triangle as usize];
            let (next, previous) = if a == vertex {
                (b, c)
            } else if b == vertex {
                (c, a)
            } else {
                (a, b)
            };
            self.sides.push(Side {
                neighbour: next,
                opposite: previous,
                triangle,
                outgoing: true,
                place,
            });
            self.sides.push(Side {
                neighbour: previous,
                opposite: next,
                triangle,
                outgoing: false,
                place,
            });
        }
        self.sides.sort_unstable();
    }

    /// The edges at the vertex by ascending neighbour, each as its sides by ascending opposite
    /// corner and triangle.
    pub fn edges(&self) -> impl Iterator<Item = &[Side]> {
        self.sides.chunk_by(|a, b| a.neighbour == b.neighbour)
    }

    /// Into how many fans the triangles fall when only those that share an edge hold together.
    pub fn fans(&mut self) -> usize {
        self.parents.clear();
        self.parents.extend(0..(self.sides.len() / 2) as u32);
        let mut fans = self.parents.len();
        for edge in self.sides.chunk_by(|a, b| a.neighbour == b.neighbour) {
            for pair in edge.windows(2) {
                fans -= usize::from(join(&mut self.parents, pair[0].place, pair[1].place));
            }
        }
        fans
    }
}

/// The number of the component of every vertex, in order of their least vertices.
///
/// Vertices hold together that share a triangle. A vertex without triangles has
/// [`NO_COMPONENT`].
#[must_use]
pub fn components(mesh: &Mesh) -> Vec<u32> {
    let vertices = mesh.positions.len();
    let mut parents: Vec<u32> = (0..vertices as u32).collect();
    let mut used = vec![false; vertices];
    for &corners in mesh.triangles.iter().filter(|corners| is_proper(**corners, vertices)) {
        join(&mut parents, corners[0], corners[1]);
        join(&mut parents, corners[1], corners[2]);
        for corner in corners {
            used[corner as usize] = true;
        }
    }
    // A root is the least vertex of its set, so its number is known before its members need it.
    let mut numbers = vec![NO_COMPONENT; vertices];
    let mut count = 0;
    for vertex in 0..vertices {
        if used[vertex] {
            let root = root(&mut parents, vertex as u32) as usize;
            if root == vertex {
                numbers[vertex] = count;
                count += 1;
            } else {
                numbers[vertex] = numbers[root];
            }
        }
    }
    numbers
}

/// The number that [`components`] gives to a vertex without triangles.
pub const NO_COMPONENT: u32 = u32::MAX;

/// The least member of the set of `item`; halves the path to it.
fn root(parents: &mut [u32], mut item: u32) -> u32 {
    while parents[item as usize] != item {
        let above = parents[parents[item as usize] as usize];
        parents[item as usize] = above;
        item = above;
    }
    item
}

/// Joins the sets of `a` and `b`; whether they were two.
fn join(parents: &mut [u32], a: u32, b: u32) -> bool {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
    a != b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(vertices: usize, triangles: &[[u32; 3]]) -> Mesh {
        Mesh { positions: vec![[0.0; 3]; vertices], triangles: triangles.to_vec() }
    }

    fn fans(mesh: &Mesh, vertex: u32) -> usize {
        let mut star = Star::default();
        star.open(mesh, &Stars::new(mesh), vertex);
        star.fans()
    }

    #[test]
    fn triangles_that_share_only_a_vertex_are_two_fans() {
        assert_eq!(fans(&mesh(5, &[[0, 1, 2], [0, 3, 4]]), 0), 2);
        assert_eq!(fans(&mesh(5, &[[0, 1, 2], [0, 3, 4], [2, 3, 0]]), 0), 1);
        assert_eq!(fans(&mesh(4, &[[0, 1, 2]]), 3), 0);
    }

    #[test]
    fn edges_list_their_sides_with_direction() {
        let mesh = mesh(4, &[[0, 1, 2], [1, 0, 3], [0, 1, 1]]);
        let mut star = Star::default();
        star.open(&mesh, &Stars::new(&mesh), 0);
        let edges: Vec<_> = star
            .edges()
            .map(|e| e.iter().map(|s| (s.neighbour, s.opposite, s.outgoing)).collect::<Vec<_>>())
            .collect();
        assert_eq!(
            edges,
            [vec![(1, 2, true), (1, 3, false)], vec![(2, 1, false)], vec![(3, 1, true)]]
        );
    }

    #[test]
    fn components_are_numbered_by_their_least_vertices() {
        let mesh = mesh(9, &[[8, 4, 5], [1, 2, 3], [3, 6, 1], [7, 7, 0], [0, 4, 99]]);
        let none = NO_COMPONENT;
        assert_eq!(components(&mesh), [none, 0, 0, 0, 1, 1, 0, none, 1]);
    }
}
