//! Numbers of vertices from signs alone.
//!
//! The vertices of a brick are numbered together: its crossed edges along x, then along y, then
//! along z, each by rows; then its inside nodes on outer planes. Bricks follow one another in the
//! order of their numbers. A vertex is found by the first number of its row and the count of set
//! bits below it. So the numbering reads signs only and does not know which bricks were sampled.

use super::bits::{Corners, Crossings, ROW, Rows, SIDE, Spans, gather, layer};
use super::tables::{Tables, corners_of};
use crate::eval::{BRICK, BrickSigns};
use pulp::NullaryFnOnce;

/// What neighbours need to know of a brick's numbers; all but `first` count from `first`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BrickNumbers {
    /// Number of the brick's first vertex.
    pub first: u32,
    /// The first edge along x of each layer.
    pub x_layers: [u16; BRICK],
    /// The first edge along y.
    pub y: u16,
    /// The first edge along z of each layer.
    pub z_layers: [u16; BRICK],
    /// The first node of an outer plane.
    pub planes: u16,
}

/// Vertices and triangles of a brick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Vertices that the brick owns.
    pub vertices: u32,
    /// Triangles of its cells.
    pub triangles: u32,
}

/// Signs of a brick's nodes and numbers of the vertices of its cells.
#[derive(Clone, Debug)]
pub struct Block {
    /// Signs.
    pub rows: Rows,
    /// Crossed edges.
    pub crossings: Crossings,
    /// The first vertex on an edge along x of each row.
    pub x: Rows,
    /// The first vertex on an edge along y of each row, `y < 16`.
    pub y: Rows,
    /// The first vertex on an edge along z of each row, `z < 16`.
    pub z: Rows,
    /// The first node of an outer plane of each row.
    pub planes: Rows,
}

impl Default for Block {
    fn default() -> Self {
        let rows = [[0; SIDE]; SIDE];
        Self { rows, crossings: Crossings::default(), x: rows, y: rows, z: rows, planes: rows }
    }
}

/// Counts what a brick owns; a task for [`pulp::Arch::dispatch`].
///
/// The numbers returned count from zero. (A closure would not do: only `inline(always)` bodies are
/// sure to be compiled for the dispatched instructions, and counting bits depends on them.)
pub struct Counting<'a> {
    /// Signs of the brick and of the seven above it.
    pub signs: [&'a BrickSigns; 8],
    /// Spans of the brick.
    pub spans: &'a Spans,
    /// The cases.
    pub tables: &'a Tables,
}

impl NullaryFnOnce for Counting<'_> {
    type Output = (BrickNumbers, Count);

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { signs, spans, tables } = self;
        let mut numbers = BrickNumbers::default();
        let [x, y, z] = Crossings::new(signs, spans).0;
        let crossed = |layer: &[u64; 4]| layer.iter().map(|w| w.count_ones() as u16).sum::<u16>();
        let mut at = 0;
        for (first, layer) in numbers.x_layers.iter_mut().zip(&x) {
            *first = at;
            at += crossed(layer);
        }
        numbers.y = at;
        at += y.iter().map(crossed).sum::<u16>();
        for (first, layer) in numbers.z_layers.iter_mut().zip(&z) {
            *first = at;
            at += crossed(layer);
        }
        numbers.planes = at;
        if !spans.is_plain() {
            for (n, word) in signs[0].iter().enumerate() {
                let outer = spans.outer(n / BRICK, n % BRICK);
                at += (u32::from(*word) & outer).count_ones() as u16;
            }
        }
        (numbers, Count { vertices: u32::from(at), triangles: triangles(signs, spans, tables) })
    }
}

/// Number of triangles in a brick's cells.
///
/// A loop of k crossings takes k - 2 triangles, so a cell has its crossings less two a loop: counts
/// of bits, 64 cells at a time. Only cells that may have several loops are looked up: those with an
/// ambiguous face, and those with two opposite corners cut off, as [`Cells::doubtful`] tells.
#[inline(always)]
fn triangles(signs: [&BrickSigns; 8], spans: &Spans, tables: &Tables) -> u32 {
    let plain = spans.is_plain();
    let (lower, upper) = ([0, 1, 2, 3].map(|n| signs[n]), [4, 5, 6, 7].map(|n| signs[n]));
    let mut here = layer(lower, 0);
    let mut count = 0i32;
    for z in 0..BRICK {
        let above = if z + 1 < BRICK { layer(lower, z + 1) } else { layer(upper, 0) };
        for q in 0..BRICK / 4 {
            let cells = Cells::new(here[q], above[q]);
            let mut active = cells.active();
            if active == 0 {
                continue;
            }
            if !plain {
                let caps = active & spans.cap_words(z, q);
                active &= !caps;
                for bit in Bits(caps) {
                    let cell = [bit % BRICK, 4 * q + bit / BRICK, z];
                    count += i32::from(tables.cap(spans.position(cell))[cells.case(bit)].count);
                }
            }
            let edges = cells.edges();
            count += edges.iter().map(|e| (e & active).count_ones() as i32).sum::<i32>();
            count -= 2 * active.count_ones() as i32;
            for bit in Bits(Cells::doubtful(&edges) & active) {
                count -= 2 * i32::from(tables.more_loops[cells.case(bit)]);
            }
        }
        here = above;
    }
    count as u32
}

/// The corners of 64 cells, four rows of sixteen.
struct Cells([u64; 8]);

impl Cells {
    /// The cells between two layers.
    #[inline(always)]
    fn new(below: Corners, above: Corners) -> Self {
        let corners = |c: Corners| [c.own, c.x, c.y, c.xy];
        let ([a, b, c, d], [e, f, g, h]) = (corners(below), corners(above));
        Self([a, b, c, d, e, f, g, h])
    }

    /// Cells whose corners have different signs.
    #[inline(always)]
    fn active(&self) -> u64 {
        let any = self.0.iter().fold(0, |any, corner| any | corner);
        let all = self.0.iter().fold(u64::MAX, |all, corner| all & corner);
        any & !all
    }

    /// The case of the cell at `bit`: its inside corners.
    #[inline(always)]
    fn case(&self, bit: usize) -> usize {
        (0..8).fold(0, |case, corner| case | (self.0[corner] >> bit & 1) << corner) as usize
    }

    /// Crossed edges, numbered as in [`super::tables`].
    #[inline(always)]
    fn edges(&self) -> [u64; 12] {
        std::array::from_fn(|edge| {
            let [low, high] = corners_of(edge);
            self.0[low] ^ self.0[high]
        })
    }

    /// Cells that may have several loops.
    ///
    /// A face is ambiguous where its four edges are crossed; three of them suffice, because their
    /// number is even. Without such a face two loops are those around two opposite corners.
    #[inline(always)]
    fn doubtful(edges: &[u64; 12]) -> u64 {
        let [x0, x1, x2, x3, y0, v0, y1, v1, z0, u0, z1, u1] = *edges;
        let faces =
            [y0 & y1 & z0, v0 & v1 & u0, x0 & x2 & z0, x1 & x3 & z1, x0 & x1 & y0, x2 & x3 & y1];
        let corners = [
            x0 & y0 & z0 & x3 & v1 & u1,
            x0 & v0 & u0 & x3 & y1 & z1,
            x1 & y0 & z1 & x2 & v1 & u0,
            x1 & v0 & u1 & x2 & y1 & z0,
        ];
        faces.iter().chain(&corners).fold(0, |cells, some| cells | some)
    }
}

/// Numbers of a brick and of its neighbours `dx + 2 dy + 4 dz`, where they own a vertex.
pub type Neighbours<'a> = [Option<&'a BrickNumbers>; 8];

/// Gathers the signs of a brick and numbers the vertices of its cells, apart from those at the far
/// end along x, which are in the block of the next brick; a task for [`pulp::Arch::dispatch`].
pub struct Filling<'a> {
    /// Receives signs and numbers.
    pub block: &'a mut Block,
    /// Signs of the brick and of the seven above it.
    pub signs: [&'a BrickSigns; 8],
    /// Numbers of the same bricks.
    pub neighbours: &'a Neighbours<'a>,
    /// Spans of the brick.
    pub spans: &'a Spans,
    /// Spans of the next brick along y.
    pub beyond: &'a Spans,
}

impl NullaryFnOnce for Filling<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { block, signs, neighbours, spans, beyond } = self;
        gather(signs, &mut block.rows);
        let rows = &block.rows;
        let plain = spans.is_plain();
        if let Some(own) = neighbours[0] {
            block.crossings = Crossings::new(signs, spans);
            let mut at = own.first;
            let firsts = [&mut block.x, &mut block.y, &mut block.z];
            for (firsts, layers) in firsts.into_iter().zip(&block.crossings.0) {
                for (firsts, layer) in firsts.iter_mut().zip(layers) {
                    for (firsts, word) in firsts.as_chunks_mut::<4>().0.iter_mut().zip(layer) {
                        for (k, first) in firsts.iter_mut().enumerate() {
                            *first = at + below(*word, k);
                        }
                        at += word.count_ones();
                    }
                }
            }
            if !plain {
                for z in 0..BRICK {
                    for y in 0..BRICK {
                        block.planes[z][y] = at;
                        at += spans.planes(rows, z, y).count_ones();
                    }
                }
            }
        }
        if let Some(next) = neighbours[2] {
            let mut plane = next.first + u32::from(next.planes);
            for z in 0..BRICK {
                block.x[z][BRICK] = next.first + u32::from(next.x_layers[z]);
                block.z[z][BRICK] = next.first + u32::from(next.z_layers[z]);
                if !plain {
                    block.planes[z][BRICK] = plane;
                    for y in 0..BRICK {
                        let word = u32::from(signs[2][z * BRICK + y]);
                        plane += (word & beyond.outer(z, y)).count_ones();
                    }
                }
            }
        }
        if let Some(next) = neighbours[4] {
            let mut x = next.first;
            let mut y_edge = next.first + u32::from(next.y);
            let mut plane = next.first + u32::from(next.planes);
            for y in 0..BRICK {
                block.x[BRICK][y] = x;
                block.y[BRICK][y] = y_edge;
                block.planes[BRICK][y] = plane;
                x += spans.along_x(rows, BRICK, y).count_ones();
                y_edge += spans.along_y(rows, BRICK, y).count_ones();
                plane += spans.planes(rows, BRICK, y).count_ones();
            }
        }
        if let Some(next) = neighbours[6] {
            block.x[BRICK][BRICK] = next.first;
            block.planes[BRICK][BRICK] = next.first + u32::from(next.planes);
        }
    }
}

/// The four rows around a row of cells.
#[derive(Clone, Copy, Debug)]
pub struct Quad {
    /// Rows at `[z][y]`, `[z][y + 1]`, `[z + 1][y]` and `[z + 1][y + 1]`.
    pub rows: [u32; 4],
    /// Cells whose corners have different signs.
    pub active: u32,
}

impl Quad {
    /// The rows around the cells `[z][y]`.
    #[inline(always)]
    #[must_use]
    pub fn new(rows: &Rows, z: usize, y: usize) -> Self {
        let rows = [rows[z][y], rows[z][y + 1], rows[z + 1][y], rows[z + 1][y + 1]];
        let any = rows[0] | rows[1] | rows[2] | rows[3];
        let all = rows[0] & rows[1] & rows[2] & rows[3];
        Self { rows, active: (any | any >> 1) & !(all & all >> 1) & ROW }
    }

    /// The case of cell `x`: its inside corners.
    #[inline(always)]
    #[must_use]
    pub fn case(&self, x: usize) -> usize {
        let [a, b, c, d] = self.rows;
        (a >> x & 3 | (b >> x & 3) << 2 | (c >> x & 3) << 4 | (d >> x & 3) << 6) as usize
    }
}

/// Number of set bits in the first `k` of four rows, `k < 4`.
#[inline(always)]
const fn below(word: u64, k: usize) -> u32 {
    (word & ((1 << (BRICK * k)) - 1)).count_ones()
}

/// The positions of the set bits of a word, from the lowest on.
#[derive(Clone, Copy, Debug)]
pub struct Bits(pub u64);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let bit = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(bit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::tables::TABLES;

    #[test]
    fn triangles_are_crossings_less_two_a_loop() {
        for case in 0..256usize {
            let cells = Cells(std::array::from_fn(|corner| (case >> corner & 1) as u64));
            let edges = cells.edges();
            let crossings: u32 = edges.iter().map(|e| e.count_ones()).sum();
            let more = u32::from(TABLES.more_loops[case]);
            assert!(more == 0 || Cells::doubtful(&edges) == 1, "case {case}");
            let loops = cells.active() as u32 + more;
            assert_eq!(u32::from(TABLES.cell[case].count), crossings - 2 * loops);
            assert_eq!(cells.case(0), case);
        }
    }
}
