//! What a program reads instead of computing: uniform values and tables.
//!
//! All sampling programs of an expression share one numbering of the uniform values and of the
//! tables along each axis, made when the program is bound to coordinates and parameter values.

use super::interpret;
use super::schedule::{Schedule, line};
use super::tape::{Op, Position};
use crate::expr::{Failure, Graph, NodeId};
use crate::geom::Axis;
use rustc_hash::{FxHashMap, FxHashSet};

/// The nodes whose values are made beforehand, numbered.
#[derive(Clone, Debug, Default)]
pub struct Leaves {
    uniforms: Vec<NodeId>,
    tables: [Vec<NodeId>; 3],
    numbers: FxHashMap<NodeId, u32>,
}

impl Leaves {
    /// The leaves of brick programs and the three line programs.
    #[must_use]
    pub fn new(bricks: &[&Schedule], lines: &[Schedule; 3]) -> Self {
        let mut leaves = Self::default();
        for brick in bricks {
            leaves.collect(brick, |_| true);
        }
        for (schedule, axis) in lines.iter().zip(Axis::ALL) {
            // Values along the line's own axis are computed where no node is.
            leaves.collect(schedule, |p| !schedule.tape().axes(p).contains(axis));
        }
        leaves.add_coordinates(lines);
        leaves
    }

    /// The leaves of three line programs alone.
    #[must_use]
    pub fn of_lines(lines: &[Schedule; 3]) -> Self {
        let mut leaves = Self::default();
        lines.iter().for_each(|schedule| leaves.collect(schedule, |_| true));
        leaves.add_coordinates(lines);
        leaves
    }

    /// Adds the coordinates from which values along a line's axis are computed at nodes, where they
    /// have no tables.
    fn add_coordinates(&mut self, lines: &[Schedule; 3]) {
        for schedule in lines {
            let tape = schedule.tape();
            let needed = at_nodes(schedule, self);
            let is_coordinate = |p: &Position| matches!(tape.op(*p), Op::Coordinate(_));
            for p in tape.positions().filter(|p| is_coordinate(p) && needed[p.index()].is_some()) {
                self.add(schedule, p, |_| true);
            }
        }
    }

    /// The leaves of an interval program.
    #[must_use]
    pub fn of_boxes(boxes: &Schedule) -> Self {
        let mut leaves = Self::default();
        leaves.collect(boxes, |_| true);
        leaves
    }

    /// Adds the values on at most one axis that others, or the outputs, are made from.
    fn collect(&mut self, schedule: &Schedule, tabulated: impl Fn(Position) -> bool) {
        let tape = schedule.tape();
        for user in tape.positions() {
            let axes = tape.axes(user);
            for &p in tape.op(user).operands().iter().filter(|&&p| tape.axes(p) != axes) {
                self.add(schedule, p, &tabulated);
            }
        }
        for &p in tape.outputs() {
            self.add(schedule, p, &tabulated);
        }
    }

    fn add(&mut self, schedule: &Schedule, p: Position, tabulated: impl Fn(Position) -> bool) {
        let (axes, node) = (schedule.tape().axes(p), schedule.tape().node(p));
        let list = match (axes.iter().next(), axes.len()) {
            (None, _) => &mut self.uniforms,
            (Some(axis), 1) if tabulated(p) => &mut self.tables[axis.index()],
            (Some(_), _) => return,
        };
        self.numbers.entry(node).or_insert_with(|| {
            list.push(node);
            list.len() as u32 - 1
        });
    }

    /// Whether `node` is a leaf.
    #[must_use]
    pub fn has(&self, node: NodeId) -> bool {
        self.numbers.contains_key(&node)
    }

    /// Number of the uniform value or table of `node`.
    ///
    /// # Panics
    /// If `node` is not a leaf.
    #[must_use]
    pub fn number(&self, node: NodeId) -> u32 {
        self.numbers[&node]
    }

    /// Number of uniform values.
    #[must_use]
    pub fn uniform_count(&self) -> usize {
        self.uniforms.len()
    }

    /// The nodes that have a table along `axis`, by number.
    #[must_use]
    pub fn tables(&self, axis: Axis) -> &[NodeId] {
        &self.tables[axis.index()]
    }

    /// Number of tables along each axis.
    #[must_use]
    pub fn table_counts(&self) -> [usize; 3] {
        self.tables.each_ref().map(Vec::len)
    }

    /// The uniform values for the given parameters.
    ///
    /// # Errors
    /// [`Failure`] of an oracle on no axis.
    pub fn uniform_values(&self, graph: &Graph, parameters: &[f64]) -> Result<Vec<f64>, Failure> {
        let mut uniforms = vec![0.0; self.uniforms.len()];
        let mut out: Vec<&mut [f64]> = uniforms.chunks_mut(1).collect();
        interpret::points(graph, &self.uniforms, [&[0.0]; 3], parameters, &mut out)?;
        Ok(uniforms)
    }

    /// The values of the leaves for the given coordinates and parameters.
    ///
    /// # Errors
    /// [`Failure`] of an oracle on fewer than two axes.
    pub fn evaluate(
        &self,
        graph: &Graph,
        coordinates: &[Vec<f64>; 3],
        parameters: &[f64],
    ) -> Result<LeafValues, Failure> {
        let uniforms = self.uniform_values(graph, parameters)?;
        let mut tables = [const { Vec::new() }; 3];
        for axis in Axis::ALL {
            let along = &coordinates[axis.index()];
            let zeros = vec![0.0; along.len()];
            let at = Axis::ALL.map(|a| if a == axis { &along[..] } else { &zeros[..] });
            let nodes = &self.tables[axis.index()];
            let mut values = vec![0.0; nodes.len() * along.len()];
            let mut out: Vec<&mut [f64]> = values.chunks_mut(along.len().max(1)).collect();
            interpret::points(graph, nodes, at, parameters, &mut out)?;
            tables[axis.index()] = values;
        }
        let lengths = coordinates.each_ref().map(Vec::len);
        Ok(LeafValues { uniforms, tables, lengths })
    }
}

/// How a line program comes by a value at nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtNodes {
    /// It is read from a table.
    Read,
    /// It is computed.
    Computed,
}

/// By operation, what the value of a line program and its derivative along the axis need at nodes,
/// of what depends on the axis.
#[must_use]
pub fn at_nodes(schedule: &Schedule, leaves: &Leaves) -> Vec<Option<AtNodes>> {
    let tape = schedule.tape();
    let along: FxHashSet<Position> = schedule.stage(line::ALONG).collect();
    let core: FxHashSet<Position> = schedule.stage(line::CORE).collect();
    // One call answers all that is asked of an oracle at a point: all of it is read, or nothing.
    let call = |p: Position| match tape.op(p) {
        Op::Oracle(oracle, _, at) => Some((oracle.index(), at)),
        Op::Coordinate(_)
        | Op::Constant(_)
        | Op::Parameter(_)
        | Op::Unary(..)
        | Op::Binary(..)
        | Op::Pick(..) => None,
    };
    let has = |p: &Position| leaves.has(tape.node(*p));
    let made: FxHashSet<_> = along.iter().filter(|p| !has(p)).filter_map(|p| call(*p)).collect();
    let mut wanted = vec![false; tape.len()];
    for &p in tape.outputs().iter().take(2) {
        wanted[p.index()] = true;
    }
    let mut needed = vec![None; tape.len()];
    for p in tape.positions().rev().filter(|p| along.contains(p) || core.contains(p)) {
        if !wanted[p.index()] {
            continue;
        }
        let is_made = call(p).is_some_and(|call| made.contains(&call));
        if along.contains(&p) && has(&p) && !is_made {
            needed[p.index()] = Some(AtNodes::Read);
            continue;
        }
        needed[p.index()] = Some(AtNodes::Computed);
        for operand in tape.op(p).operands().iter() {
            wanted[operand.index()] = true;
        }
    }
    needed
}

/// The values of the leaves of a bound program.
#[derive(Clone, Debug, Default)]
pub struct LeafValues {
    /// The uniform values by number.
    pub uniforms: Vec<f64>,
    /// The tables along each axis, one after the other by number.
    pub tables: [Vec<f64>; 3],
    /// Length of each table of an axis: the number of coordinates.
    pub lengths: [usize; 3],
}

impl LeafValues {
    /// Table `number` along `axis`, from coordinate `first` on.
    #[must_use]
    #[inline]
    pub fn table(&self, axis: Axis, number: u32, first: usize) -> &[f64] {
        let a = axis.index();
        let start = number as usize * self.lengths[a];
        &self.tables[a][start + first..start + self.lengths[a]]
    }
}
