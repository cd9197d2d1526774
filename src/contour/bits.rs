//! Signs of a brick and its neighbours as words, and which of their bits are real.
//!
//! A brick owns 16 nodes along each axis, the edges that start at them and the cells whose lower
//! corner they are. Its words therefore reach one node into the neighbours: 17 rows of 17 rows of
//! 17 bits. Bit `x` of row `[z][y]` is set where that node is inside.

use crate::eval::{BRICK, BrickSigns};

/// Nodes along a side of a brick's cells.
pub const SIDE: usize = BRICK + 1;

/// All sixteen bits of a brick's row.
pub const ROW: u32 = 0xffff;

/// One number for each row of a brick's nodes, by z and y.
pub type Rows = [[u32; SIDE]; SIDE];

/// A brick without any node inside.
pub static OUTSIDE: BrickSigns = [0; BRICK * BRICK];

/// A brick with all nodes inside.
pub static INSIDE: BrickSigns = [ROW as u16; BRICK * BRICK];

/// Which positions along one axis of a brick are what; bit `i` is the brick's position `i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// Nodes that are no ghosts (17 bits).
    pub real: u32,
    /// Edges between such nodes (17 bits).
    pub edge: u32,
    /// Nodes on the outer planes (17 bits).
    pub outer: u32,
    /// Cells whose lower corners are ghosts (16 bits).
    pub low: u32,
    /// Cells whose upper corners are ghosts (16 bits).
    pub high: u32,
}

impl Span {
    /// The spans of all bricks along an axis of `cells` cells.
    #[must_use]
    pub fn all(cells: usize, bricks: u32) -> Vec<Self> {
        let bits = |from: usize, wanted: &dyn Fn(usize) -> bool| {
            (0..SIDE).filter(|i| wanted(from + i)).fold(0, |word, i| word | 1 << i)
        };
        (0..bricks as usize)
            .map(|brick| {
                let from = brick * BRICK;
                Self {
                    real: bits(from, &|p| 0 < p && p <= cells + 1),
                    edge: bits(from, &|p| 0 < p && p <= cells),
                    outer: bits(from, &|p| p == 1 || p == cells + 1),
                    low: bits(from, &|p| p == 0) & ROW,
                    high: bits(from, &|p| p == cells + 1) & ROW,
                }
            })
            .collect()
    }

    /// Whether the brick owns no ghost, no node of an outer plane and no cell at a ghost.
    #[must_use]
    pub const fn is_plain(&self) -> bool {
        self.edge & ROW == ROW && self.outer & ROW == 0
    }
}

/// All ones where bit `i` of `bits` is set, else zero.
#[inline(always)]
const fn spread(bits: u32, i: usize) -> u32 {
    0u32.wrapping_sub(bits >> i & 1)
}

/// The spans of a brick along the three axes.
#[derive(Clone, Copy, Debug)]
pub struct Spans(pub [Span; 3]);

impl Spans {
    /// See [`Span::is_plain`].
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.0.iter().all(Span::is_plain)
    }

    /// Makes ghosts outside.
    pub fn clear_ghosts(&self, signs: &mut BrickSigns) {
        let [x, y, z] = self.0;
        for (n, word) in signs.iter_mut().enumerate() {
            *word &= (x.real & spread(y.real, n % BRICK) & spread(z.real, n / BRICK)) as u16;
        }
    }

    /// Crossed edges along x of row `[z][y]`.
    #[inline(always)]
    #[must_use]
    pub fn along_x(&self, rows: &Rows, z: usize, y: usize) -> u32 {
        (rows[z][y] ^ rows[z][y] >> 1) & self.0[0].edge & ROW
    }

    /// Crossed edges along y of row `[z][y]`, `y < 16`.
    #[inline(always)]
    #[must_use]
    pub fn along_y(&self, rows: &Rows, z: usize, y: usize) -> u32 {
        (rows[z][y] ^ rows[z][y + 1]) & spread(self.0[1].edge, y) & ROW
    }

    /// Crossed edges along z of row `[z][y]`, `z < 16`.
    #[inline(always)]
    #[must_use]
    pub fn along_z(&self, rows: &Rows, z: usize, y: usize) -> u32 {
        (rows[z][y] ^ rows[z + 1][y]) & spread(self.0[2].edge, z) & ROW
    }

    /// Inside nodes of the outer planes in row `[z][y]`.
    #[inline(always)]
    #[must_use]
    pub fn planes(&self, rows: &Rows, z: usize, y: usize) -> u32 {
        rows[z][y] & self.outer(z, y)
    }

    /// Nodes of the outer planes in row `[z][y]`.
    #[inline(always)]
    #[must_use]
    pub fn outer(&self, z: usize, y: usize) -> u32 {
        (self.0[0].outer | spread(self.0[1].outer, y) | spread(self.0[2].outer, z)) & ROW
    }

    /// Cells of row `[z][y]` that touch ghosts.
    #[inline(always)]
    #[must_use]
    pub fn caps(&self, z: usize, y: usize) -> u32 {
        let ghost = |a: usize| self.0[a].low | self.0[a].high;
        (ghost(0) | spread(ghost(1), y) | spread(ghost(2), z)) & ROW
    }

    /// Where cell `[x, y, z]` lies between ghosts; see [`super::tables::Tables::cap`].
    #[inline(always)]
    #[must_use]
    pub fn position(&self, cell: [usize; 3]) -> usize {
        let digit = |a: usize| {
            ((self.0[a].low >> cell[a] & 1) + 2 * (self.0[a].high >> cell[a] & 1)) as usize
        };
        digit(0) + 3 * digit(1) + 9 * digit(2)
    }
}

/// Gathers the rows of a brick from its signs and those of the seven bricks above it; brick
/// `dx + 2 dy + 4 dz` lies that many bricks further along the axes.
#[inline(always)]
pub fn gather(signs: [&BrickSigns; 8], rows: &mut Rows) {
    let join = |own: u16, next: u16| u32::from(own) | u32::from(next & 1) << BRICK;
    for (z, layer) in rows.iter_mut().enumerate().take(BRICK) {
        let at = z * BRICK;
        let (own, next) = (&signs[0][at..at + BRICK], &signs[1][at..at + BRICK]);
        for (row, (own, next)) in layer.iter_mut().zip(own.iter().zip(next)) {
            *row = join(*own, *next);
        }
        layer[BRICK] = join(signs[2][at], signs[3][at]);
    }
    for y in 0..BRICK {
        rows[BRICK][y] = join(signs[4][y], signs[5][y]);
    }
    rows[BRICK][BRICK] = join(signs[6][0], signs[7][0]);
}

/// Nodes of a brick's cells with more than one crossed edge.
///
/// `signs` holds the brick in the middle of its 26 neighbours, brick `dx + 3 dy + 9 dz` for
/// offsets 0 to 2. Edges to ghosts count, because ghosts are outside.
pub fn crowded(signs: [&BrickSigns; 27], nodes: &mut Rows) {
    // Positions -1 to 17 along each axis, bit 0 of a word being -1.
    const REACH: usize = BRICK + 3;
    let split = |i: usize| match i {
        0 => (0, BRICK - 1),
        i if i <= BRICK => (1, i - 1),
        i => (2, i - 1 - BRICK),
    };
    let mut wide = [[0u32; REACH]; REACH];
    for (k, layer) in wide.iter_mut().enumerate() {
        let (dz, z) = split(k);
        for (j, row) in layer.iter_mut().enumerate() {
            let (dy, y) = split(j);
            let word = |dx: usize| u32::from(signs[dx + 3 * dy + 9 * dz][z * BRICK + y]);
            *row = word(0) >> (BRICK - 1) | word(1) << 1 | (word(2) & 3) << SIDE;
        }
    }
    for z in 0..SIDE {
        for y in 0..SIDE {
            let here = wide[z + 1][y + 1];
            let around = [
                here << 1,
                here >> 1,
                wide[z + 1][y],
                wide[z + 1][y + 2],
                wide[z][y + 1],
                wide[z + 2][y + 1],
            ];
            let (mut one, mut two) = (0, 0);
            for other in around {
                two |= one & (here ^ other);
                one |= here ^ other;
            }
            nodes[z][y] = (two >> 1) & ((1 << SIDE) - 1);
        }
    }
}
