//! Numbers of vertices from signs alone.
//!
//! The vertices of a brick are numbered together: its crossed edges along x, then along y, then
//! along z, each by rows; then its inside nodes on outer planes. Bricks follow one another in the
//! order of their numbers. A vertex is found by the first number of its row and the count of set
//! bits below it. So the numbering reads signs only and does not know which bricks were sampled.

use super::bits::{ROW, Rows, SIDE, Spans, gather};
use super::tables::Tables;
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
        Self { rows, x: rows, y: rows, z: rows, planes: rows }
    }
}

/// Gathers a brick's signs and counts what it owns; a task for [`pulp::Arch::dispatch`].
///
/// The numbers returned count from zero. (A closure would not do: only `inline(always)` bodies are
/// sure to be compiled for the dispatched instructions, and counting bits depends on them.)
pub struct Counting<'a> {
    /// Signs of the brick and of the seven above it.
    pub signs: [&'a BrickSigns; 8],
    /// Receives the rows.
    pub rows: &'a mut Rows,
    /// Spans of the brick.
    pub spans: &'a Spans,
    /// The cases.
    pub tables: &'a Tables,
}

impl NullaryFnOnce for Counting<'_> {
    type Output = (BrickNumbers, Count);

    #[inline(always)]
    fn call(self) -> Self::Output {
        gather(self.signs, self.rows);
        count(self.rows, self.spans, self.tables)
    }
}

#[inline(always)]
fn count(rows: &Rows, spans: &Spans, tables: &Tables) -> (BrickNumbers, Count) {
    let mut numbers = BrickNumbers::default();
    let mut at = 0;
    for z in 0..BRICK {
        numbers.x_layers[z] = at;
        for y in 0..BRICK {
            at += spans.along_x(rows, z, y).count_ones() as u16;
        }
    }
    numbers.y = at;
    for z in 0..BRICK {
        for y in 0..BRICK {
            at += spans.along_y(rows, z, y).count_ones() as u16;
        }
    }
    for z in 0..BRICK {
        numbers.z_layers[z] = at;
        for y in 0..BRICK {
            at += spans.along_z(rows, z, y).count_ones() as u16;
        }
    }
    numbers.planes = at;
    let plain = spans.is_plain();
    if !plain {
        for z in 0..BRICK {
            for y in 0..BRICK {
                at += spans.planes(rows, z, y).count_ones() as u16;
            }
        }
    }
    let mut triangles = 0;
    for z in 0..BRICK {
        for y in 0..BRICK {
            let quad = Quad::new(rows, z, y);
            let caps = if plain { 0 } else { quad.active & spans.caps(z, y) };
            for x in Bits(quad.active & !caps) {
                triangles += u32::from(tables.cell[quad.case(x)].count);
            }
            for x in Bits(caps) {
                let cap = tables.cap(spans.position([x, y, z]));
                triangles += u32::from(cap[quad.case(x)].count);
            }
        }
    }
    (numbers, Count { vertices: u32::from(at), triangles })
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
            let mut at = own.first;
            for z in 0..BRICK {
                for y in 0..BRICK {
                    block.x[z][y] = at;
                    at += spans.along_x(rows, z, y).count_ones();
                }
            }
            for z in 0..BRICK {
                for y in 0..BRICK {
                    block.y[z][y] = at;
                    at += spans.along_y(rows, z, y).count_ones();
                }
            }
            for z in 0..BRICK {
                for y in 0..BRICK {
                    block.z[z][y] = at;
                    at += spans.along_z(rows, z, y).count_ones();
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

/// The positions of the set bits of a word, from the lowest on.
#[derive(Clone, Copy, Debug)]
pub struct Bits(pub u32);

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
