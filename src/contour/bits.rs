//! Signs of a brick and its neighbours as words, and which of their bits are real.
//!
//! A brick owns 16 nodes along each axis, the edges that start at them and the cells whose lower
//! corner they are. Its rows therefore reach one node into the neighbours: 17 rows of 17 rows of
//! 17 bits. Bit `x` of row `[z][y]` is set where that node is inside. What is counted or listed is
//! taken from words of four rows instead, a quarter of the work.

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
pub(super) const fn spread(bits: u32, i: usize) -> u32 {
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

    /// Whether the brick's cells have a corner in an outer plane, be it a node of the next brick.
    #[must_use]
    pub fn meet_outer(&self) -> bool {
        self.0.iter().any(|span| span.outer != 0)
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

    /// Cells of four rows that touch ghosts: those of word `q` of layer `z` of [`Words`].
    #[inline(always)]
    #[must_use]
    pub fn cap_words(&self, z: usize, q: usize) -> u64 {
        (0..4).fold(0, |word, k| word | u64::from(self.caps(z, 4 * q + k)) << (BRICK * k))
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

/// Bits of a brick's nodes, four rows a word: bit `16 k + x` of word `[z][q]` stands for the node
/// `x` of row `4 q + k`, so that bit `b` of word `w` of all is node `64 w + b` of the brick.
pub type Words = [[u64; BRICK / 4]; BRICK];

/// The lowest bit of each of four rows.
const FIRST: u64 = 0x0001_0001_0001_0001;

/// Signs of four rows of nodes and of their neighbours one further along x, along y, and both.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corners {
    /// The nodes themselves.
    pub own: u64,
    /// Those next along x.
    pub x: u64,
    /// Those next along y.
    pub y: u64,
    /// Those next along both.
    pub xy: u64,
}

/// The corners of layer `z` of a brick, four rows a word; `signs` are those of the brick, of the
/// next along x, along y, and along both.
#[inline(always)]
pub fn layer(signs: [&BrickSigns; 4], z: usize) -> [Corners; BRICK / 4] {
    let rows = |brick: usize| &signs[brick].as_chunks::<BRICK>().0[z];
    let word = |row: &[u16; BRICK], q: usize| {
        (0..4).fold(0, |word, k| word | u64::from(row[4 * q + k]) << (BRICK * k))
    };
    std::array::from_fn(|q| {
        let after = |row: &[u16; BRICK], beyond: usize| {
            u64::from(if q < 3 { row[(4 * q + 4) % BRICK] } else { rows(beyond)[0] })
        };
        let (own, next) = (word(rows(0), q), word(rows(1), q));
        let y = own >> BRICK | after(rows(0), 2) << (3 * BRICK);
        let next_y = next >> BRICK | after(rows(1), 3) << (3 * BRICK);
        let along_x =
            |own: u64, next: u64| own >> 1 & !(FIRST << 15) | (next & FIRST) << (BRICK - 1);
        Corners { own, x: along_x(own, next), y, xy: along_x(y, next_y) }
    })
}

/// Crossed edges that start at a brick's nodes, by axis.
#[derive(Clone, Debug, Default)]
pub struct Crossings(pub [Words; 3]);

impl Crossings {
    /// The crossed edges of a brick; `signs` are its own and those of the seven bricks above it, as
    /// in [`gather`].
    #[inline(always)]
    #[must_use]
    pub fn new(signs: [&BrickSigns; 8], spans: &Spans) -> Self {
        let mut crossings = Self::default();
        let (lower, upper) = ([0, 1, 2, 3].map(|n| signs[n]), [4, 5, 6, 7].map(|n| signs[n]));
        let mut here = layer(lower, 0);
        for z in 0..BRICK {
            let above = if z + 1 < BRICK { layer(lower, z + 1) } else { layer(upper, 0) };
            for q in 0..BRICK / 4 {
                let Corners { own, x, y, xy: _ } = here[q];
                crossings.0[0][z][q] = own ^ x;
                crossings.0[1][z][q] = own ^ y;
                crossings.0[2][z][q] = own ^ above[q].own;
            }
            here = above;
        }
        if !spans.is_plain() {
            crossings.mask(spans);
        }
        crossings
    }

    /// Removes edges to and between what is no node.
    fn mask(&mut self, spans: &Spans) {
        let [x, y, z] = spans.0.map(|span| span.edge);
        for layer in 0..BRICK {
            for q in 0..BRICK / 4 {
                let rows = (0..4)
                    .fold(0, |word, k| word | u64::from(spread(y, 4 * q + k) & ROW) << (BRICK * k));
                self.0[0][layer][q] &= u64::from(x & ROW) * FIRST;
                self.0[1][layer][q] &= rows;
                self.0[2][layer][q] &= 0u64.wrapping_sub(u64::from(z >> layer & 1));
            }
        }
    }
}
