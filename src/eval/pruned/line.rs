//! Edges in a pruned program: batches, cut down to what matters near the ends of their edges.
//!
//! Edges are grouped by the blocks that their lower nodes lie in. A value that comes out farther
//! from zero than its cut holds for is not trusted: the group is cut again, with everything.

use super::block::SIDE;
use super::code::Form;
use super::cut::Row;
use super::edges::{self, Group, Wanted};
use super::focus::{Nearness, Whose};
use super::{BoundPruned, PrunedWorkspace, Shared};
use crate::eval::interpret::LANES;
use crate::eval::sampler::{BRICK, End, NodeBox, place_of};
use crate::expr::Failure;
use crate::geom::Axis;
use crate::num::Interval;

/// The present batch of edges.
#[derive(Debug)]
pub(super) struct Batch {
    axis: Axis,
    brick: [u32; 3],
    nodes: Vec<u16>,
    row: Vec<u64>,
    /// The edges in each block of the brick, or all in the first.
    groups: [Group; LANES],
    /// What each group has taken: for an axis, in a brick or wherever a row is the same.
    taken: [Option<Taken>; LANES],
}

/// What the cut of a group was made for.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Taken {
    axis: Axis,
    /// Where it holds; none if wherever the row is the same.
    brick: Option<[u32; 3]>,
    row: Vec<u64>,
    is_whole: bool,
}

impl Batch {
    /// Of no edges.
    pub(super) fn empty() -> Self {
        Self {
            axis: Axis::X,
            brick: [0; 3],
            nodes: Vec::new(),
            row: Vec::new(),
            groups: Default::default(),
            taken: Default::default(),
        }
    }
}

impl BoundPruned {
    /// The row that intervals leave `brick`, found from the whole grid down.
    fn descend(
        &self,
        workspace: &mut PrunedWorkspace,
        brick: [u32; 3],
    ) -> Result<Vec<u64>, Failure> {
        let bricks = self.nodes().map(|nodes| (nodes - 1) / BRICK);
        let top = bricks.iter().map(|n| n.next_power_of_two().ilog2()).max().unwrap_or(0);
        let mut row = vec![u64::MAX; self.activity_words()];
        workspace.path.resize(top as usize + 1, None);
        for level in (0..=top as u8).rev() {
            let index = brick.map(|b| b >> level);
            match &workspace.path[usize::from(level)] {
                Some((known, own)) if *known == index => row.clone_from(own),
                _ => {
                    let boxes = [NodeBox { level, index }];
                    let mut range = [Interval::ANYTHING];
                    self.ranges(workspace, &boxes, &mut row, &mut range)?;
                    workspace.path[usize::from(level)] = Some((index, row.clone()));
                    workspace.path[..usize::from(level)].fill(None);
                }
            }
        }
        Ok(row)
    }

    /// See [`Sampler::line_begin`](crate::eval::Sampler::line_begin).
    pub(in crate::eval) fn line_begin(
        &self,
        workspace: &mut PrunedWorkspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        row: &[u64],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let everything = !row.is_empty() && row.iter().all(|word| *word == u64::MAX);
        let found;
        let row = if everything {
            // Edges of outer planes come without a row: see `contour::place`.
            found = self.descend(workspace, brick)?;
            &found[..]
        } else {
            row
        };
        self.focus(workspace, shared, brick, row, Nearness::Surface);
        let is_apart = workspace.focus.cut == Whose::Block;
        let Batch { groups, nodes: own, row: own_row, axis: own_axis, brick: own_brick, .. } =
            &mut workspace.batch;
        (*own_axis, *own_brick) = (axis, brick);
        own.clear();
        own.extend_from_slice(nodes);
        own_row.clear();
        own_row.extend_from_slice(row);
        groups.iter_mut().for_each(|group| group.edges.clear());
        for (edge, &node) in (0..).zip(nodes) {
            let [x, y, z] = place_of(node).map(|place| usize::from(place >= SIDE));
            let block = if is_apart { x | y << 1 | z << 2 } else { 0 };
            groups[block].edges.push(edge);
        }
        for block in 0..LANES {
            if !workspace.batch.groups[block].edges.is_empty() {
                self.ready(workspace, shared, block, false)?;
            }
        }
        Ok(())
    }

    /// Readies the group of block `block`, with what matters near the surface or with the `whole`.
    fn ready(
        &self,
        workspace: &mut PrunedWorkspace,
        shared: Shared<'_>,
        block: usize,
        is_whole: bool,
    ) -> Result<(), Failure> {
        let PrunedWorkspace { cutter, other, near, focus, whole, batch, .. } = workspace;
        let focus = if is_whole { whole } else { focus };
        let Batch { axis, brick, nodes, row, groups, taken } = batch;
        let (group, taken) = (&mut groups[block], &mut taken[block]);
        let brick_of = (focus.cut != Whose::Row).then_some(*brick);
        let is_taken = matches!(taken, Some(own) if own.axis == *axis
            && own.brick == brick_of && own.row == *row && own.is_whole == is_whole);
        if !is_taken {
            let outputs = [shared.code.lowered.root, shared.code.slopes[axis.index()]];
            let (code, form) = (shared.code, Form::Sampled);
            match focus.cut {
                Whose::Row => cutter.cut(code, form, &outputs, &Row(row), other),
                Whose::Brick => cutter.cut(code, form, &outputs, &near.within(0), other),
                Whose::Block => {
                    cutter.cut(code, form, &outputs, &focus.choices.within(block), other);
                }
            }
            group.take(shared, other, *axis);
            group.limit = focus.limit;
            *taken = Some(Taken { axis: *axis, brick: brick_of, row: row.clone(), is_whole });
        }
        let places = group.edges.iter().map(|edge| place_of(nodes[usize::from(*edge)]));
        // The grid's last node begins a brick of its own, which ghosts may lie in.
        let along: [[f64; edges::NODES]; 3] = std::array::from_fn(|a| {
            let (table, first) = (&self.coordinates[a], brick[a] as usize * BRICK);
            std::array::from_fn(|node| table[(first + node).min(table.len() - 1)])
        });
        // Collected, because the group is changed by what is made from its own edges.
        let places: Vec<[usize; 3]> = places.collect();
        for other in Axis::ALL.into_iter().filter(|other| other != axis) {
            let a = other.index();
            group.locate(other, places.iter().map(|place| along[a][place[a]]));
        }
        group.place(shared.oracles(), *brick, &along, places.iter().copied())?;
        group.begin(shared.oracles())
    }

    /// Asks the groups for values and slopes where they are `wanted`, at the coordinates `at`.
    fn evaluate(
        &self,
        workspace: &mut PrunedWorkspace,
        at: &[f64],
        wanted: Wanted,
        mut out: [&mut [f64]; 2],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        for block in 0..LANES {
            loop {
                let Batch { axis, groups, .. } = &mut workspace.batch;
                let group = &mut groups[block];
                if group.edges.is_empty() {
                    break;
                }
                group.locate_along(*axis, at);
                group.evaluate(shared.oracles(), wanted)?;
                let mut is_trusted = true;
                for (number, out) in out.iter_mut().enumerate() {
                    let is_within = group.deliver(number, out);
                    is_trusted &= is_within || number > 0;
                }
                if is_trusted {
                    break;
                }
                // Once more with what matters far from the surface too.
                let (brick, row) = (workspace.batch.brick, workspace.batch.row.clone());
                self.focus(workspace, shared, brick, &row, Nearness::Nowhere);
                self.ready(workspace, shared, block, true)?;
            }
        }
        Ok(())
    }

    /// See [`Sampler::line_ends`](crate::eval::Sampler::line_ends).
    pub(in crate::eval) fn line_ends(
        &self,
        workspace: &mut PrunedWorkspace,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        let ahead = usize::from(end == End::Upper);
        // Where the value is a coordinate, that is read at the nodes.
        let Batch { axis, brick, nodes, .. } = &workspace.batch;
        let (a, first) = (axis.index(), brick[axis.index()] as usize * BRICK);
        let table = &self.coordinates[a];
        let at: Vec<f64> =
            nodes.iter().map(|node| table[first + place_of(*node)[a] + ahead]).collect();
        self.evaluate(workspace, &at, Wanted::End(ahead), [&mut *values, slopes])?;
        let far = values.iter().map(|value| value.abs()).filter(|value| value.is_finite());
        workspace.reach = far.fold(workspace.reach, f64::max);
        Ok(())
    }

    /// See [`Sampler::line`](crate::eval::Sampler::line).
    pub(in crate::eval) fn line(
        &self,
        workspace: &mut PrunedWorkspace,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        self.evaluate(workspace, at, Wanted::Between, [values, slopes])
    }
}
