//! Programs: expressions ready to be evaluated, and bound to coordinates.
//!
//! A [`Program`] is made once for an expression and serves every grid and all values of its
//! parameters. Binding it makes what a grid needs; the [`Bound`] program answers the queries of
//! [`Sampler`], from as many threads as ask, each with a workspace of its own.
//!
//! Small expressions are made ready as a whole, for the compiler or the interpreter; huge ones are cut
//! down to what each box needs.

use super::jit::CompileError;
use super::lower::Lowered;
use super::pruned::{BoundPruned, Pruned, PrunedWorkspace};
use super::regions::Bits;
use super::sampler::{BRICK, BrickSigns, End, NodeBox, Sampler};
use super::whole::{BoundWhole, Whole, WholeWorkspace};
use crate::expr::{Binary, Failure, Graph, Node, NodeId, depends};
use crate::geom::Axis;
use crate::num::Interval;
use std::sync::Arc;

/// What runs a program; the results are the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Engine {
    /// The interpreter: nothing to compile, runs on every host.
    Interpreter,
    /// The compiler.
    Compiled,
    /// The interpreter of what each box needs: the least to do beforehand.
    Pruned,
    /// The compiler where the host has one, else the interpreter; for huge expressions of which a box
    /// needs little, the interpreter of what each box needs.
    #[default]
    Automatic,
}

/// Why a program could not be made.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ProgramError {
    /// The compiler can't run here.
    #[error("the compiled engine can't run this; use the interpreter")]
    NoCompiler(#[from] CompileError),
    /// The expression has too many operations that every box needs.
    #[error(
        "the field has {operations} operations, more than the {MOST_OPERATIONS} that are taken where \
         boxes can't do with a part of them; nest fewer operations that repeat what they act on, \
         such as `thickness`, motions and maps"
    )]
    TooLarge {
        /// How many it has.
        operations: usize,
    },
}

/// The most nodes of an expression that is not cut down for each box: to arrange, derive and compile
/// so many takes some ten seconds and a gigabyte.
const MOST_OPERATIONS: usize = 1 << 18;

/// Expressions of more nodes are huge: a node costs some 150 microseconds to compile.
const HUGE: usize = 1500;
/// Nodes for each extremum up to which something can be left out of a huge expression.
const MOST_PER_EXTREMUM: usize = 64;

/// An expression ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Program(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Whole(Arc<Whole>),
    Pruned(Arc<Pruned>),
}

impl Program {
    /// The program of the expression `root`.
    ///
    /// # Errors
    /// [`ProgramError::NoCompiler`] if the compiler is asked for and can't run, and
    /// [`ProgramError::TooLarge`].
    pub fn new(graph: &Graph, root: NodeId, engine: Engine) -> Result<Self, ProgramError> {
        let is_pruned = match engine {
            Engine::Interpreter | Engine::Compiled => false,
            Engine::Pruned => true,
            Engine::Automatic => Self::is_huge(graph, root),
        };
        if is_pruned {
            return Ok(Self(Kind::Pruned(Arc::new(Pruned::new(graph, root)))));
        }
        if graph.len() > MOST_OPERATIONS {
            let operations = depends::reachable(graph, &[root]).len();
            if operations > MOST_OPERATIONS {
                return Err(ProgramError::TooLarge { operations });
            }
        }
        Ok(Self(Kind::Whole(Arc::new(Whole::new(graph, root, engine)?))))
    }

    /// Whether [`Engine::Automatic`] cuts the expression `root` down for each box: whether it is huge,
    /// and has so many extrema that boxes can do with a part of it.
    #[must_use]
    pub fn is_huge(graph: &Graph, root: NodeId) -> bool {
        if graph.len() <= HUGE {
            return false;
        }
        let nodes = depends::reachable(graph, &[root]);
        let is_extremum =
            |id: &&NodeId| matches!(graph.node(**id), Node::Binary(Binary::Min | Binary::Max, ..));
        nodes.len() > HUGE
            && nodes.iter().filter(is_extremum).count() * MOST_PER_EXTREMUM > nodes.len()
    }

    fn lowered(&self) -> &Lowered {
        match &self.0 {
            Kind::Whole(whole) => whole.lowered(),
            Kind::Pruned(pruned) => pruned.lowered(),
        }
    }

    /// The expression that is sampled, in its graph: the lowered form of the program's own.
    #[must_use]
    pub fn sampled(&self) -> (&Graph, NodeId) {
        let lowered = self.lowered();
        (&lowered.graph, lowered.root)
    }

    /// The lowered form and the bits of its regions.
    pub(super) fn parts(&self) -> (&Lowered, Bits) {
        let bits = match &self.0 {
            Kind::Whole(whole) => whole.bits(),
            Kind::Pruned(pruned) => pruned.bits(),
        };
        (self.lowered(), bits)
    }

    /// Binds the program to a grid and to values of the parameters, by slot.
    ///
    /// `coordinates` holds the coordinate table of each axis: finite, non-decreasing numbers, a
    /// multiple of [`BRICK`] of them plus one. If an oracle fails while tables are made, every
    /// query returns its [`Failure`].
    ///
    /// # Panics
    /// If a table has another length, or there are fewer values than the expression's parameters.
    #[must_use]
    pub fn bind(&self, coordinates: [Vec<f64>; 3], parameters: &[f64]) -> Bound {
        for table in &coordinates {
            assert!(table.len() % BRICK == 1, "a table has a multiple of sixteen nodes plus one");
        }
        let kind = match &self.0 {
            Kind::Whole(whole) => BoundKind::Whole(Box::new(whole.bind(&coordinates, parameters))),
            Kind::Pruned(pruned) => {
                BoundKind::Pruned(Box::new(pruned.bind(coordinates, parameters)))
            }
        };
        let is_faceted = self.lowered().graph.oracles().iter().any(|oracle| oracle.is_faceted());
        Bound { kind, is_faceted }
    }
}

/// A program bound to a grid and to values of its parameters.
#[derive(Debug)]
pub struct Bound {
    kind: BoundKind,
    /// Whether an oracle of the program is.
    is_faceted: bool,
}

#[derive(Debug)]
enum BoundKind {
    Whole(Box<BoundWhole>),
    Pruned(Box<BoundPruned>),
}

/// Memory of one thread that queries a [`Bound`] program.
#[derive(Debug)]
pub struct Workspace(Memory);

#[derive(Debug)]
enum Memory {
    Whole(Box<WholeWorkspace>),
    Pruned(Box<PrunedWorkspace>),
}

/// Does the same with either kind of program and its memory.
macro_rules! either {
    ($own:expr, $workspace:expr, |$bound:ident, $memory:ident| $answer:expr) => {
        match (&$own.kind, &mut $workspace.0) {
            (BoundKind::Whole($bound), Memory::Whole($memory)) => $answer,
            (BoundKind::Pruned($bound), Memory::Pruned($memory)) => $answer,
            (BoundKind::Whole(_), Memory::Pruned(_)) | (BoundKind::Pruned(_), Memory::Whole(_)) => {
                panic!("a workspace is used with the sampler that made it")
            }
        }
    };
}

impl Sampler for Bound {
    type Workspace = Workspace;

    fn workspace(&self) -> Workspace {
        Workspace(match &self.kind {
            BoundKind::Whole(bound) => Memory::Whole(Box::new(bound.workspace())),
            BoundKind::Pruned(bound) => Memory::Pruned(Box::new(bound.workspace())),
        })
    }

    fn nodes(&self) -> [usize; 3] {
        match &self.kind {
            BoundKind::Whole(bound) => bound.nodes(),
            BoundKind::Pruned(bound) => bound.nodes(),
        }
    }

    fn activity_words(&self) -> usize {
        match &self.kind {
            BoundKind::Whole(bound) => bound.activity_words(),
            BoundKind::Pruned(bound) => bound.activity_words(),
        }
    }

    fn is_faceted(&self) -> bool {
        self.is_faceted
    }

    fn ranges(
        &self,
        workspace: &mut Workspace,
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) -> Result<(), Failure> {
        either!(self, workspace, |own, memory| own.ranges(memory, boxes, activity, ranges))
    }

    fn signs(
        &self,
        workspace: &mut Workspace,
        brick: [u32; 3],
        activity: &[u64],
        signs: &mut BrickSigns,
    ) -> Result<(), Failure> {
        either!(self, workspace, |own, memory| own.signs(memory, brick, activity, signs))
    }

    fn values(
        &self,
        workspace: &mut Workspace,
        brick: [u32; 3],
        activity: &[u64],
        values: &mut [f64; BRICK * BRICK * BRICK],
    ) -> Result<(), Failure> {
        either!(self, workspace, |own, memory| own.values(memory, brick, activity, values))
    }

    fn line_begin(
        &self,
        workspace: &mut Workspace,
        axis: Axis,
        brick: [u32; 3],
        nodes: &[u16],
        activity: &[u64],
    ) -> Result<(), Failure> {
        either!(self, workspace, |own, memory| {
            own.line_begin(memory, axis, brick, nodes, activity)
        })
    }

    fn line_ends(
        &self,
        workspace: &mut Workspace,
        end: End,
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        either!(self, workspace, |own, memory| own.line_ends(memory, end, values, slopes))
    }

    fn line(
        &self,
        workspace: &mut Workspace,
        at: &[f64],
        values: &mut [f64],
        slopes: &mut [f64],
    ) -> Result<(), Failure> {
        either!(self, workspace, |own, memory| own.line(memory, at, values, slopes))
    }
}
