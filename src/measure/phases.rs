//! What hangs together: components of solid and void on the grid, and whether they percolate.
//!
//! The components are those of the mesh that contouring makes, exactly: they follow from the signs at
//! the nodes and from the rule for faces ([`tables`](crate::contour::tables)). Inside nodes are joined
//! along edges and, because ambiguous faces join the inside corners, across the diagonals of faces;
//! outside nodes are joined along edges only. Nothing else is joined within a cell: the surface in it
//! is one disk a loop, and disks cut a cell into as many parts as their rims cut its boundary. In the
//! words of digital topology this is (18, 6) connectivity.
//!
//! The void is that of the box: it ends at the outer planes, where the solid is cut. So a lattice's
//! pores count as components of their own although one could walk around the box. A component
//! *percolates* along an axis if it has nodes on both outer planes across it; it is *enclosed* if it
//! has none on any of the six. An enclosed component of the void is a cavity, of the solid a loose piece.
//!
//! **Error.** None for the grid. A feature thinner than the spacing may be seen or not. Shares are by count
//! of nodes, those on outer planes by half (and quarter and eighth where planes meet): with an error
//! of first order in the spacing at most.
//!
//! Rows of nodes are kept as runs of one sign. Planes of rows are joined pairwise, and of joined planes
//! only the first and the last stay: memory is that of a few planes, and the counts are whole numbers,
//! which do not depend on who joined what.
//!
//! Source: Kong & Rosenfeld 1989, doi:10.1016/0734-189X(89)90147-3, for pairs of connectivity; He, Chao &
//! Suzuki 2008, doi:10.1109/TIP.2008.919369, for runs.

use crate::contour::{Error, Signs};
use crate::num::Progress;
use rayon::prelude::*;

/// One of the two parts of the box: the solid or the void.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Phase {
    /// Components.
    pub components: u64,
    /// The part of the phase that its largest component is, 0 to 1.
    pub largest_share: f64,
    /// Components that touch no outer plane of the box.
    pub enclosed: u64,
    /// The part of the phase that these are, 0 to 1.
    pub enclosed_share: f64,
    /// Whether a component touches both outer planes across x, y and z.
    pub percolates: [bool; 3],
    /// The part of the phase in such components, 0 to 1.
    pub percolating_share: [f64; 3],
    /// Nodes of the grid.
    pub nodes: u64,
}

/// What hangs together in a box.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Phases {
    /// The solid.
    pub solid: Phase,
    /// The rest of the box.
    pub void: Phase,
}

impl Phases {
    /// Closed surfaces of the mesh: each cavity has one, and each component of the solid one on the
    /// outside.
    #[must_use]
    pub fn shells(&self) -> u64 {
        self.solid.components + self.void.enclosed
    }

    /// Handles of the solid: holes through it that a thread could be passed through. The mesh has
    /// Euler characteristic `euler`, which is twice the number of its shells without their handles.
    #[must_use]
    pub fn handles(&self, euler: i64) -> i64 {
        self.shells() as i64 - euler / 2
    }
}

/// The components of both phases.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn phases(signs: &Signs<'_>, progress: &Progress) -> Result<Phases, Error> {
    let layers = signs.nodes()[2];
    progress.expect(layers as u64);
    let slab = |z| {
        progress.advance(1)?;
        Ok::<_, Error>(Slab::new(signs, z))
    };
    let joined = (0..layers).into_par_iter().map(slab).try_reduce_with(|a, b| Ok(a.join(b)));
    let [solid, void] = joined.transpose()?.map(Slab::finish).unwrap_or_default();
    Ok(Phases { solid: solid.phase(), void: void.phase() })
}

/// A component, or the part of one that is known.
#[derive(Clone, Copy, Debug)]
struct Part {
    inside: bool,
    nodes: u64,
    /// Eighths of nodes, those outside of the outer planes left out.
    eighths: u64,
    /// The outer planes that it touches: the lower ones of x, y and z, then the upper ones.
    planes: u8,
}

impl Part {
    fn include(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.eighths += other.eighths;
        self.planes |= other.planes;
    }
}

/// What is known of the components that are complete.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    components: u64,
    nodes: u64,
    // Eighths of nodes from here on.
    all: u64,
    largest: u64,
    enclosed_part: u64,
    percolating: [u64; 3],
    enclosed: u64,
}

impl Tally {
    fn count(&mut self, part: Part) {
        self.components += 1;
        self.nodes += part.nodes;
        self.all += part.eighths;
        self.largest = self.largest.max(part.eighths);
        if part.planes == 0 {
            self.enclosed += 1;
            self.enclosed_part += part.eighths;
        }
        for (axis, eighths) in self.percolating.iter_mut().enumerate() {
            if part.planes >> axis & 1 == 1 && part.planes >> (3 + axis) & 1 == 1 {
                *eighths += part.eighths;
            }
        }
    }

    fn add(&mut self, other: Self) {
        self.components += other.components;
        self.nodes += other.nodes;
        self.all += other.all;
        self.largest = self.largest.max(other.largest);
        self.enclosed += other.enclosed;
        self.enclosed_part += other.enclosed_part;
        for (eighths, more) in self.percolating.iter_mut().zip(other.percolating) {
            *eighths += more;
        }
    }

    fn phase(self) -> Phase {
        let share = |part: u64| if part == 0 { 0.0 } else { part as f64 / self.all as f64 };
        Phase {
            components: self.components,
            largest_share: share(self.largest),
            enclosed: self.enclosed,
            enclosed_share: share(self.enclosed_part),
            percolates: self.percolating.map(|part| part > 0),
            percolating_share: self.percolating.map(share),
            nodes: self.nodes,
        }
    }
}

/// Nodes of one sign next to one another in a row.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// The node after the last one; the first follows the run before.
    end: u32,
    inside: bool,
    /// Which part it belongs to.
    part: usize,
}

/// The runs of a plane of rows.
#[derive(Clone, Debug, Default)]
struct Plane {
    runs: Vec<Run>,
    /// The first run of each row, and the number of all.
    rows: Vec<usize>,
}

impl Plane {
    fn row(&self, y: usize) -> &[Run] {
        &self.runs[self.rows[y]..self.rows[y + 1]]
    }

    fn height(&self) -> usize {
        self.rows.len() - 1
    }
}

/// How much of node `i` of `count` along an axis is within the outer planes, in halves.
fn halves(i: usize, count: usize) -> u64 {
    if i == 0 || i + 1 == count { 1 } else { 2 }
}

/// What two parallel rows of nodes have between them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Contact {
    /// Faces of cells: edges join nodes opposite each other, diagonals join inside nodes.
    Faces,
    /// Cells, the rows being opposite edges of theirs: nodes opposite each other are on the diagonal
    /// of a face, which joins them if they are inside.
    Diagonal,
}

/// Calls `join` with the parts of runs that touch.
fn touching(a: &[Run], b: &[Run], contact: Contact, mut join: impl FnMut(usize, usize)) {
    let (mut i, mut j) = (0, 0);
    while let (Some(p), Some(q)) = (a.get(i), b.get(j)) {
        if p.inside == q.inside && (p.inside || contact == Contact::Faces) {
            join(p.part, q.part);
        }
        // Runs alternate: where both end, the one that is inside meets the other row's next.
        if p.end == q.end && p.inside != q.inside && contact == Contact::Faces {
            let diagonal = if p.inside { (Some(p), b.get(j + 1)) } else { (a.get(i + 1), Some(q)) };
            if let (Some(p), Some(q)) = diagonal {
                join(p.part, q.part);
            }
        }
        i += usize::from(p.end <= q.end);
        j += usize::from(q.end <= p.end);
    }
}

/// Sets of parts that are one.
struct Sets(Vec<usize>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn of(&mut self, mut part: usize) -> usize {
        let parents = &mut self.0;
        while parents[part] != part {
            parents[part] = parents[parents[part]];
            part = parents[part];
        }
        part
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// Neighbouring planes, joined: what later planes need to know of them.
struct Slab {
    first: Plane,
    /// Where there are several planes.
    last: Option<Plane>,
    /// Parts that have runs in the first or the last plane.
    parts: Vec<Part>,
    /// Components that have none, of the solid and of the void.
    done: [Tally; 2],
}

impl Slab {
    /// One plane.
    fn new(signs: &Signs<'_>, z: usize) -> Self {
        let [_, ny, nz] = signs.nodes();
        let (mut runs, mut rows) = (Vec::new(), Vec::with_capacity(ny + 1));
        let (mut parts, mut ends) = (Vec::new(), Vec::new());
        for y in 0..ny {
            rows.push(runs.len());
            let mut inside = signs.runs(y, z, &mut ends);
            let across = [(y == 0, 1), (z == 0, 2), (y + 1 == ny, 4), (z + 1 == nz, 5)];
            let across = across.into_iter().fold(0, |all, (is, bit)| all | u8::from(is) << bit);
            let weight = halves(y, ny) * halves(z, nz);
            let mut start = 0;
            for (k, &end) in ends.iter().enumerate() {
                let ends_here = u8::from(k == 0) | u8::from(k + 1 == ends.len()) << 3;
                let part = parts.len();
                runs.push(Run { end, inside, part });
                let nodes = u64::from(end - start);
                let eighths = weight * (2 * nodes - u64::from(ends_here.count_ones()));
                parts.push(Part { inside, nodes, eighths, planes: across | ends_here });
                (start, inside) = (end, !inside);
            }
        }
        rows.push(runs.len());
        let plane = Plane { runs, rows };
        let mut sets = Sets::new(parts.len());
        for y in 1..ny {
            let join = |a, b| sets.join(a, b);
            touching(plane.row(y - 1), plane.row(y), Contact::Faces, join);
        }
        Self { first: plane, last: None, parts, done: Default::default() }.settled(sets)
    }

    /// The planes of both; those of `above` follow.
    fn join(self, above: Self) -> Self {
        let offset = self.parts.len();
        let Self { first, last, mut parts, mut done } = self;
        let Self { first: mut next, last: mut end, parts: more, done: other } = above;
        parts.extend(more);
        for (tally, other) in done.iter_mut().zip(other) {
            tally.add(other);
        }
        for plane in [Some(&mut next), end.as_mut()].into_iter().flatten() {
            plane.runs.iter_mut().for_each(|run| run.part += offset);
        }
        let mut sets = Sets::new(parts.len());
        let below = last.as_ref().unwrap_or(&first);
        let height = below.height();
        for y in 0..height {
            let mut meet = |other: usize, contact| {
                touching(below.row(y), next.row(other), contact, |a, b| sets.join(a, b));
            };
            meet(y, Contact::Faces);
            if y > 0 {
                meet(y - 1, Contact::Diagonal);
            }
            if y + 1 < height {
                meet(y + 1, Contact::Diagonal);
            }
        }
        Self { first, last: Some(end.unwrap_or(next)), parts, done }.settled(sets)
    }

    /// Makes one part of each of `sets` and counts those that no plane has any more.
    fn settled(mut self, mut sets: Sets) -> Self {
        const NONE: usize = usize::MAX;
        let mut numbers = vec![NONE; self.parts.len()];
        let mut kept = Vec::new();
        for plane in [Some(&mut self.first), self.last.as_mut()].into_iter().flatten() {
            for run in &mut plane.runs {
                let set = sets.of(run.part);
                if numbers[set] == NONE {
                    numbers[set] = kept.len();
                    kept.push(Part { inside: run.inside, nodes: 0, eighths: 0, planes: 0 });
                }
                run.part = numbers[set];
            }
        }
        let visible = kept.len();
        for (i, part) in self.parts.iter().enumerate() {
            let set = sets.of(i);
            if numbers[set] == NONE {
                numbers[set] = kept.len();
                kept.push(Part { inside: part.inside, nodes: 0, eighths: 0, planes: 0 });
            }
            kept[numbers[set]].include(*part);
        }
        for part in kept.drain(visible..) {
            self.done[usize::from(!part.inside)].count(part);
        }
        self.parts = kept;
        self
    }

    /// The components of the solid and of the void, when nothing follows.
    fn finish(self) -> [Tally; 2] {
        let Self { parts, mut done, .. } = self;
        for part in parts {
            done[usize::from(!part.inside)].count(part);
        }
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::testing::{Random, Sampled, at_nodes, check, mesh_of, unknown};
    use crate::contour::{Grid, Settings, signs};
    use crate::geom::Aabb;
    use crate::num::Interval;
    use crate::octree::Pruning;
    use glam::DVec3;

    fn grid(cells: [usize; 3]) -> Grid {
        let hi = DVec3::from_array(cells.map(|n| n as f64));
        Grid::new(Aabb::new(DVec3::ZERO, hi), DVec3::ONE).unwrap()
    }

    fn found<F: Fn([f64; 3]) -> f64 + Sync>(grid: &Grid, field: F) -> Phases {
        let sampler = Sampled::new(grid, field, unknown);
        let progress = Progress::new();
        let work = |signs: &Signs<'_>| phases(signs, &progress);
        signs::survey(&sampler, grid, &Settings::default(), &progress, work).unwrap().0
    }

    /// By flooding, node after node.
    fn flooded(nodes: [usize; 3], inside: &[bool]) -> Phases {
        let at = |[x, y, z]: [usize; 3]| x + nodes[0] * (y + nodes[1] * z);
        let mut tallies = [Tally::default(); 2];
        let mut seen = vec![false; inside.len()];
        for start in 0..inside.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            let phase = inside[start];
            let mut part = Part { inside: phase, nodes: 0, eighths: 0, planes: 0 };
            let mut open = vec![start];
            while let Some(node) = open.pop() {
                let place =
                    [node % nodes[0], node / nodes[0] % nodes[1], node / nodes[0] / nodes[1]];
                let planes = (0..3).fold(0, |planes, a| {
                    let (lower, upper) = (place[a] == 0, place[a] + 1 == nodes[a]);
                    planes | u8::from(lower) << a | u8::from(upper) << (3 + a)
                });
                let eighths = (0..3).map(|a| halves(place[a], nodes[a])).product();
                part.include(Part { inside: phase, nodes: 1, eighths, planes });
                for step in 0..27usize {
                    let step = [step % 3, step / 3 % 3, step / 9];
                    let far = step.iter().filter(|s| **s != 1).count();
                    let next = [0, 1, 2].map(|a| (place[a] + step[a]).wrapping_sub(1));
                    let is_near = far == 1 || far == 2 && phase;
                    let is_joined =
                        is_near && (0..3).all(|a| next[a] < nodes[a]) && inside[at(next)] == phase;
                    if is_joined && !std::mem::replace(&mut seen[at(next)], true) {
                        open.push(at(next));
                    }
                }
            }
            tallies[usize::from(!phase)].count(part);
        }
        Phases { solid: tallies[0].phase(), void: tallies[1].phase() }
    }

    #[test]
    fn random_signs_have_the_components_of_a_flood_and_of_the_mesh() {
        let mut random = Random::new(3);
        for round in 0..120 {
            // Some grids meet in one brick, some need two, some fill bricks to the last node.
            let cells = [0, 1, 2].map(|_| [1, 2, 5, 9, 13, 14, 15, 16, 17, 21][random.below(10)]);
            let grid = grid(cells);
            let nodes = cells.map(|n| n + 1);
            let share = [0.1, 0.25, 0.31, 0.5, 0.69, 0.9][round % 6];
            let values: Vec<f64> = (0..nodes.iter().product())
                .map(|_| if random.unit() < share { -1.0 } else { 1.0 })
                .collect();
            let inside: Vec<bool> = values.iter().map(|v| *v < 0.0).collect();
            let field = at_nodes(&grid, values);
            let phases = found(&grid, &field);
            assert_eq!(phases, flooded(nodes, &inside), "round {round}: {cells:?}");
            let sampler = Sampled::new(&grid, &field, unknown);
            let (mesh, _) = mesh_of(&sampler, &grid, Pruning::None);
            let components = crate::mesh::check::check(&mesh).components;
            assert_eq!(phases.shells(), components.len() as u64, "round {round}: {cells:?}");
            let euler = check(&mesh).euler;
            // Each shell is a sphere with handles.
            let genus = |c: &crate::mesh::check::Component| {
                1 - (c.vertices as i64 - c.edges as i64 + c.triangles as i64) / 2
            };
            let handles: i64 = components.iter().map(genus).sum();
            assert_eq!((euler % 2, phases.handles(euler)), (0, handles), "round {round}");
        }
    }

    #[test]
    fn settled_bricks_count_as_sampled_ones() {
        // A hollow ball in a box of several bricks, most of which intervals settle.
        let grid = grid([70, 75, 80]);
        let distance = |p: [f64; 3]| {
            let r = (p[0] - 35.0).hypot(p[1] - 37.0).hypot(p[2] - 40.0);
            (r - 33.0).max(12.0 - r)
        };
        let range = |span: [[f64; 2]; 3]| {
            let middle = [0, 1, 2].map(|a| 0.5 * (span[a][0] + span[a][1]));
            let reach = [0, 1, 2].map(|a| span[a][1] - middle[a]);
            let reach = reach[0].hypot(reach[1]).hypot(reach[2]);
            Interval::new(distance(middle) - reach, distance(middle) + reach)
        };
        let sampler = Sampled::new(&grid, distance, range);
        let progress = Progress::new();
        let of = |pruning| {
            let work = |signs: &Signs<'_>| phases(signs, &progress);
            signs::survey(&sampler, &grid, &Settings { pruning, memory: None }, &progress, work)
                .unwrap()
        };
        let (sparse, report) = of(Pruning::Intervals);
        let (dense, all) = of(Pruning::None);
        assert!(report.active_bricks < all.active_bricks);
        assert_eq!(sparse, dense);
        let counts = |phase: Phase| (phase.components, phase.enclosed, phase.percolates);
        assert_eq!(counts(sparse.solid), (1, 1, [false; 3]));
        assert_eq!(counts(sparse.void), (2, 1, [true; 3]));
        assert_eq!((sparse.shells(), sparse.handles(4)), (2, 0));
        let nodes: usize = [71, 76, 81].iter().product();
        assert_eq!(sparse.solid.nodes + sparse.void.nodes, nodes as u64);
        let solid = sparse.solid.nodes as f64;
        let share = sparse.void.enclosed_share * (70.0 * 75.0 * 80.0 - solid);
        let hollow = 4.0 / 3.0 * std::f64::consts::PI * 12.0_f64.powi(3);
        assert!((share / hollow - 1.0).abs() < 0.02, "{share} {hollow}");
    }

    #[test]
    fn diagonals_of_faces_join_the_solid_and_cut_the_void() {
        let inside = |nodes: [usize; 3], is: fn([usize; 3]) -> bool| {
            let grid = grid(nodes.map(|n| n - 1));
            let values = (0..nodes.iter().product::<usize>()).map(|n| {
                let place = [n % nodes[0], n / nodes[0] % nodes[1], n / nodes[0] / nodes[1]];
                if is(place) { -1.0 } else { 1.0 }
            });
            let Phases { solid, void } = found(&grid, at_nodes(&grid, values.collect()));
            (solid.components, solid.percolates, void.components, void.percolates)
        };
        // A plane of steps, joined by diagonals only: it cuts the box.
        let stairs = inside([20, 20, 3], |[x, y, _]| x == y);
        assert_eq!(stairs, (1, [true; 3], 2, [false, false, true]));
        // Opposite corners of a cell are not joined.
        let corners = inside([2, 2, 2], |p| p == [0; 3] || p == [1; 3]);
        assert_eq!(corners, (2, [false; 3], 1, [true; 3]));
        assert_eq!(inside([3, 4, 5], |_| true), (1, [true; 3], 0, [false; 3]));
    }

    #[test]
    fn counts_do_not_depend_on_threads() {
        let mut random = Random::new(11);
        let grid = grid([40, 33, 50]);
        let values = (0..41 * 34 * 51).map(|_| random.unit() - 0.3).collect();
        let field = at_nodes(&grid, values);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| found(&grid, &field))
        };
        let one = on(1);
        assert!(one.solid.components > 1 && one.void.components > 1);
        assert!(on(2) == one && on(5) == one);
    }
}
