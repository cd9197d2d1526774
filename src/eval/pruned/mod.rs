//! The engine of huge expressions: what a box needs is cut out of the expression and interpreted.
//!
//! A union of ten thousand parts takes longer to compile, or to arrange for the interpreter, than to
//! evaluate: a block of it needs ten. Here nothing is arranged for the whole. A box comes with the
//! activity that intervals left it; a walk from the root meets the operations that are alive
//! ([`cut`]), which are enclosed ([`enclose`]) or laid out as steps ([`tape`]) and run over the
//! nodes of a block of eight a side ([`block`]) or over edges ([`edges`]), and oracles are [`asked`] for
//! what shows. The eight blocks of a brick are
//! enclosed once more before they are sampled, each for itself, near zero alone ([`focus`]): so the
//! cost of a brick is that of the parts near its surface.
//!
//! Results are those of the other engines to the bit: the same operators on the same operands, and
//! sides of extrema are left out by the same rules (`enclosing`, `interpret/chains`).
//!
//! It promises nothing about time where nothing can be left out; then it is an interpreter.

mod asked;
mod block;
mod brick;
mod choices;
mod code;
mod cut;
mod edges;
mod enclose;
mod focus;
mod jumps;
mod line;
mod pieces;
mod tape;

use super::interpret;
use super::lower::Lowered;
use super::regions::Bits;
use super::sampler::{BRICK, NodeBox};
use crate::expr::{Failure, Graph, Node, NodeId, Oracle};
use crate::geom::Axis;
use crate::num::Interval;
use block::Blocks;
use choices::{Choices, Memo};
use code::{Code, Form};
use cut::{Cut, Cutter, Row};
use enclose::{Enclosure, Rows, UNLIMITED};
use focus::Focus;
use jumps::Jumps;
use line::Batch;
use pieces::Pieces;
use std::sync::Arc;

/// A program that is cut down to what a box needs.
#[derive(Debug)]
pub(super) struct Pruned {
    code: Code,
}

/// A [`Pruned`] program bound to a grid and to values of the parameters.
#[derive(Debug)]
pub(super) struct BoundPruned {
    program: Arc<Pruned>,
    coordinates: [Vec<f64>; 3],
    /// By node: the value, if it is on no axis.
    uniforms: Result<Vec<f64>, Failure>,
    jumps: Result<Jumps, Failure>,
    memo: Memo,
}

/// What is the same in all queries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared<'a> {
    code: &'a Code,
    uniforms: &'a [f64],
    jumps: &'a Jumps,
}

impl Shared<'_> {
    fn oracles(&self) -> &[Arc<dyn Oracle>] {
        self.code.graph().oracles()
    }
}

/// Memory of one thread that queries a [`BoundPruned`] program.
#[derive(Debug)]
pub struct PrunedWorkspace {
    cutter: Cutter,
    /// The present cut of the source form, and of another.
    source: Cut,
    other: Cut,
    enclosure: Enclosure,
    /// What matters in the present brick near the surface, by what is known of it.
    near: Choices,
    focus: Focus,
    /// What matters in the blocks of the present brick, far from the surface too.
    whole: Focus,
    /// The farthest from zero that ends of edges were so far.
    reach: f64,
    blocks: Blocks,
    /// The form and the row that `blocks` has taken whole.
    taken: Option<(Form, Vec<u64>)>,
    rows: Vec<u64>,
    /// By level: the box that was enclosed last on the way down to a brick, and its row.
    path: Vec<Option<([u32; 3], Vec<u64>)>>,
    batch: Batch,
}

impl Pruned {
    /// The program of the expression `root`.
    pub(super) fn new(graph: &Graph, root: NodeId) -> Self {
        Self { code: Code::new(graph, root) }
    }

    /// The form that is sampled.
    pub(super) fn lowered(&self) -> &Lowered {
        &self.code.lowered
    }

    /// The activity bits of the form that is sampled.
    pub(super) fn bits(&self) -> Bits {
        self.code.bits()
    }

    /// Binds the program; see [`Program::bind`](super::Program::bind).
    pub(super) fn bind(
        self: &Arc<Self>,
        coordinates: [Vec<f64>; 3],
        parameters: &[f64],
    ) -> BoundPruned {
        let uniforms = self.uniforms(parameters);
        let jumps = Jumps::new(&self.code, &coordinates, parameters);
        let (program, memo) = (Arc::clone(self), Memo::default());
        BoundPruned { program, coordinates, uniforms, jumps, memo }
    }

    fn uniforms(&self, parameters: &[f64]) -> Result<Vec<f64>, Failure> {
        let graph = self.code.graph();
        let mut made = Vec::new();
        let mut values: Vec<f64> = (graph.iter().zip(&self.code.axes))
            .map(|((id, node), axes)| match node {
                Node::Constant(bits) => f64::from_bits(bits),
                _ if axes.is_empty() => {
                    made.push(id);
                    f64::NAN
                }
                Node::Coordinate(_)
                | Node::Parameter(_)
                | Node::Unary(..)
                | Node::Binary(..)
                | Node::Pick(..)
                | Node::Oracle(..) => f64::NAN,
            })
            .collect();
        let mut results = vec![0.0; made.len()];
        let mut out: Vec<&mut [f64]> = results.chunks_mut(1).collect();
        interpret::points(graph, &made, [&[0.0]; 3], parameters, &mut out)?;
        for (id, result) in made.iter().zip(results) {
            values[id.index()] = result;
        }
        Ok(values)
    }
}

impl BoundPruned {
    fn shared(&self) -> Result<Shared<'_>, Failure> {
        let uniforms = self.uniforms.as_ref().map_err(Clone::clone)?;
        let jumps = self.jumps.as_ref().map_err(Clone::clone)?;
        Ok(Shared { code: &self.program.code, uniforms, jumps })
    }

    pub(super) fn workspace(&self) -> PrunedWorkspace {
        let code = &self.program.code;
        PrunedWorkspace {
            cutter: Cutter::new(code),
            source: Cut::default(),
            other: Cut::default(),
            enclosure: Enclosure::default(),
            near: Choices::new(code.count),
            focus: Focus::new(code),
            whole: Focus::new(code),
            reach: 0.0,
            blocks: Blocks::default(),
            taken: None,
            rows: Vec::new(),
            path: Vec::new(),
            batch: Batch::empty(),
        }
    }

    pub(super) fn nodes(&self) -> [usize; 3] {
        self.coordinates.each_ref().map(Vec::len)
    }

    pub(super) fn activity_words(&self) -> usize {
        self.program.code.words()
    }

    /// The interval from node `first` along `axis` to the one so many further, or to the last.
    fn side(&self, axis: Axis, first: usize, nodes: usize) -> Interval {
        let table = &self.coordinates[axis.index()];
        let last = table.len() - 1;
        Interval::new(table[first.min(last)], table[(first + nodes).min(last)])
    }

    /// See [`Sampler::ranges`](super::Sampler::ranges).
    pub(super) fn ranges(
        &self,
        workspace: &mut PrunedWorkspace,
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure> {
        let shared = self.shared()?;
        let mut any = std::mem::take(&mut workspace.rows);
        let PrunedWorkspace { cutter, source, enclosure, .. } = workspace;
        let words = self.activity_words();
        let mut own = activity.chunks_exact(words.max(1));
        let first = own.next().unwrap_or_default();
        any.clear();
        any.extend_from_slice(first);
        let mut is_one = true;
        for row in own {
            is_one &= row == first;
            any.iter_mut().zip(row).for_each(|(any, own)| *any |= own);
        }
        cutter.cut(shared.code, Form::Source, &[shared.code.source], &Row(&any), source);
        let mut pieces = Pieces::default();
        for (number, node) in boxes.iter().enumerate() {
            let nodes = BRICK << node.level;
            let side =
                |axis: Axis| self.side(axis, node.index[axis.index()] as usize * nodes, nodes);
            pieces.add(shared.jumps, number, &Axis::ALL.map(side));
        }
        let rows = if is_one { Rows::One } else { Rows::Own(activity, words) };
        let found = enclosure.enclose(shared, (source, cutter), &pieces, rows);
        ranges[..boxes.len()].copy_from_slice(&found[..boxes.len()]);
        let count = boxes.len();
        any.clear();
        any.resize(words * count, 0);
        let mut set = |number: usize, bit: u32| {
            any[number * words + bit as usize / 64] |= 1 << (bit % 64);
        };
        enclosure.decide(shared, source, (&pieces, rows), &UNLIMITED, |choice, alive| {
            for (alive, side) in alive.into_iter().zip(0..) {
                let numbers = (0..count).filter(|number| alive >> number & 1 == 1);
                numbers.for_each(|number| set(number, 2 * choice + side));
            }
        });
        if is_one && source.open > 0 && boxes.iter().all(|node| node.level == 0) {
            self.remember(workspace, shared, &pieces, boxes, ranges);
        }
        activity[..words * count].copy_from_slice(&any);
        workspace.rows = any;
        Ok(())
    }
}
