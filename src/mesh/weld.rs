//! Merging of vertices at the same position.

use super::Mesh;
use rustc_hash::FxHashMap;

/// Numbers positions by first appearance.
///
/// Positions are the same where all coordinates are equal numbers: 0 and −0 are, NaN is itself by
/// its bits.
#[derive(Debug, Default)]
pub struct Welder {
    numbers: FxHashMap<[u64; 3], u32>,
}

impl Welder {
    /// The number of `position`, and whether it is new.
    pub fn number(&mut self, position: [f64; 3]) -> (u32, bool) {
        // Adding zero turns −0 into 0 and changes nothing else. The halves change places because
        // the hash is blind to where short fractions have their bits.
        let key = position.map(|value| (value + 0.0).to_bits().rotate_left(32));
        let next = self.numbers.len() as u32;
        let number = *self.numbers.entry(key).or_insert(next);
        (number, number == next)
    }
}

/// What [`weld`] changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Welded {
    /// Vertices merged into another.
    pub merged: usize,
    /// Triangles dropped because two of their corners became one.
    pub dropped: usize,
}

/// Merges the vertices of `mesh` that are at the same position; each keeps its first number's
/// place in the order. Triangles with a corner that is no vertex are dropped too.
pub fn weld(mesh: &mut Mesh) -> Welded {
    let mut welder = Welder::default();
    let numbers: Vec<u32> = mesh.positions.iter().map(|&p| welder.number(p).0).collect();
    let vertices = mesh.positions.len();
    let mut kept = 0;
    for (vertex, &number) in numbers.iter().enumerate() {
        if number as usize == kept {
            mesh.positions[kept] = mesh.positions[vertex];
            kept += 1;
        }
    }
    mesh.positions.truncate(kept);
    let triangles = mesh.triangles.len();
    mesh.triangles.retain_mut(|corners| {
        for corner in corners.iter_mut() {
            *corner = numbers.get(*corner as usize).copied().unwrap_or(u32::MAX);
        }
        super::topology::is_proper(*corners, kept)
    });
    Welded { merged: vertices - kept, dropped: triangles - mesh.triangles.len() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::check;
    use crate::mesh::shapes::cube;

    #[test]
    fn a_soup_becomes_the_surface_it_was() {
        let whole = cube();
        let mut soup = Mesh::default();
        for corners in &whole.triangles {
            let first = soup.positions.len() as u32;
            soup.positions.extend(corners.map(|v| whole.positions[v as usize]));
            soup.triangles.push([first, first + 1, first + 2]);
        }
        assert_eq!(weld(&mut soup), Welded { merged: 28, dropped: 0 });
        assert!(check(&soup).is_sound());
        assert_eq!(weld(&mut soup), Welded::default());
    }

    #[test]
    fn zeros_of_either_sign_are_one_and_collapsed_triangles_go() {
        let mut mesh = Mesh {
            positions: vec![[0.0, 1.0, 2.0], [-0.0, 1.0, 2.0], [1.0; 3], [2.0, 1.0, 1.0]],
            triangles: vec![[0, 1, 2], [1, 2, 3], [0, 2, 7]],
        };
        assert_eq!(weld(&mut mesh), Welded { merged: 1, dropped: 2 });
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.positions[1], [1.0; 3]);
    }
}
