//! A field bound to a grid of sample coordinates.
//!
//! The grid is the product of three tables of coordinates and is cut into bricks of [`BRICK`]
//! samples a side. Numbers of boxes, bricks and nodes below are positions in those tables.
//!
//! **Activity.** The sides of every extremum of the expression are *regions* that matter in a box
//! or not. A box carries [`Sampler::activity_words`] words: the first have one bit per region, set
//! where the region may matter, the others what the sampler wants to know besides; all ones say
//! that everything may matter. [`Sampler::ranges`] clears bits; every other query may skip a region
//! whose bit is clear and returns the same bits as with all of them set, anywhere in that box: at
//! the nodes and between them.

pub use crate::expr::Failure;
use crate::geom::Axis;
use crate::num::Interval;

/// Samples along a side of a brick.
pub const BRICK: usize = 16;

/// Signs of a brick's samples: bit `x` of word `z * BRICK + y` is set where the value is below
/// zero (zero, NaN and positive values are outside).
pub type BrickSigns = [u16; BRICK * BRICK];

/// A cube of `2^level` bricks a side, in units of its own size.
///
/// It covers the coordinates from node `BRICK * (index << level)` to node
/// `BRICK * ((index + 1) << level)`, both included, along each axis; where the table ends earlier,
/// to its last node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeBox {
    /// Logarithm to base two of the side in bricks.
    pub level: u8,
    /// Position along each axis in units of the side.
    pub index: [u32; 3],
}

/// The number of the node at a place of a brick, 0 to [`BRICK`] along each axis.
///
/// It is `x + 16 y + 256 z` inside the brick. A place of sixteen, on a far face of the brick's
/// cells, counts as zero there and sets bit 12, 13 or 14.
#[must_use]
#[inline(always)]
pub const fn node_at([x, y, z]: [usize; 3]) -> u16 {
    let near = x % BRICK + y % BRICK * BRICK + z % BRICK * BRICK * BRICK;
    (near + ((x / BRICK) << 12) + ((y / BRICK) << 13) + ((z / BRICK) << 14)) as u16
}

/// The place of the node of that number: the inverse of [`node_at`].
#[must_use]
#[inline(always)]
pub const fn place_of(node: u16) -> [usize; 3] {
    let node = node as usize;
    [
        node % BRICK + (node >> 12 & 1) * BRICK,
        node / BRICK % BRICK + (node >> 13 & 1) * BRICK,
        node / (BRICK * BRICK) % BRICK + (node >> 14 & 1) * BRICK,
    ]
}

/// An end of a grid edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The node of lesser coordinate.
    Lower,
    /// The node of greater coordinate.
    Upper,
}

/// A field bound to a grid.
///
/// Every query on one point returns the same bits, whichever method, batch, thread or engine
/// answers: the value at a node from [`signs`](Self::signs), [`values`](Self::values),
/// [`line_ends`](Self::line_ends) and [`line`](Self::line) at the node's coordinate are one number.
pub trait Sampler: Sync {
    /// Scratch memory of one thread.
    type Workspace: Send;

    /// A fresh workspace.
    fn workspace(&self) -> Self::Workspace;

    /// Length of each axis' table of coordinates: a multiple of [`BRICK`], plus one.
    fn nodes(&self) -> [usize; 3];

    /// Words of activity that a box carries.
    fn activity_words(&self) -> usize;

    /// Encloses the field over up to eight boxes of one level.
    ///
    /// `activity` holds [`activity_words`](Self::activity_words) words a box: on entry those of a
    /// box that contains it (all ones to begin with), on return its own. `ranges` receives one
    /// enclosure a box.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn ranges(
        &self,
        workspace: &mut Self::Workspace,
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure>;

    /// Signs of the samples of the brick at `brick` (in bricks).
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn signs(
        &self,
        workspace: &mut Self::Workspace,
        brick: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure>;

    /// Values of the samples of the brick at `brick`, x fastest, then y, then z.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn values(
        &self,
        workspace: &mut Self::Workspace,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure>;

    /// Whether the field may be [linear in pieces](crate::expr::Oracle::is_faceted).
    fn is_faceted(&self) -> bool {
        false
    }

    /// Sets up a batch of grid edges along `axis` of the cells of one brick.
    ///
    /// An edge is given by the number of its lower node ([`node_at`]), which is on no far face
    /// across `axis`. At most 256 edges.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn line_begin(
        &self,
        workspace: &mut Self::Workspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure>;

    /// Values at one end of each edge of the batch, and derivatives along its axis there.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn line_ends(
        &self,
        workspace: &mut Self::Workspace,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure>;

    /// Values and derivatives along the axis of the batch, at coordinate `at[m]` on edge `m`.
    ///
    /// The derivative is that of the active branch; it steers and is not a bound.
    ///
    /// # Errors
    /// [`Failure`] of an oracle.
    fn line(
        &self,
        workspace: &mut Self::Workspace,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure>;
}
