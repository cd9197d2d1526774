//! The interval program of an expression: interpreted, and compiled where that pays.
//!
//! Compiling takes as long as some thousands of boxes, so a program is compiled once it has
//! enclosed so many ([`MANY`]), by the thread whose call that is; the others go on interpreting.
//! Jobs too small to pay never compile, nor do programs of more than [`LARGE`] instructions: a box
//! needs little of them, and what is left of a box's time is not arithmetic. The bits are the same.
//!
//! It also tells which regions a brick needs *near the surface*: in a large union of distances most
//! of the parts that matter somewhere in a brick matter far from any surface only.

use super::focused::{Focused, NEAR, Nearness};
use super::interpret::{BoxProgram, BoxWorkspace, Lanes, UniformRanges};
use super::jit::{RangeLeaves, Ranges};
use super::levels::Levels;
use super::program::Engine;
use super::sampler::NodeBox;
use crate::num::Interval;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Boxes after which a program is compiled.
const MANY: usize = 4096;
/// Instructions up to which a program is compiled.
const LARGE: usize = 2000;

/// The interval program of an expression.
#[derive(Debug)]
pub(super) struct Enclosing {
    program: BoxProgram,
    engine: Engine,
    /// Words of bits that the regions have.
    words: usize,
    /// Bits of them that no region has.
    spare: u32,
    /// Boxes enclosed so far, while they are counted.
    boxes: AtomicUsize,
    compiled: OnceLock<Option<Ranges>>,
}

/// Memory of a thread that encloses boxes.
#[derive(Debug)]
pub(super) struct EnclosingWorkspace {
    boxes: BoxWorkspace,
    staging: Vec<f64>,
    focus: Focus,
}

/// The activity of a brick near the surface.
#[derive(Debug, Default)]
struct Focus {
    /// What it was found for.
    key: Option<([u32; 3], Nearness)>,
    from: Vec<u64>,
    row: Vec<u64>,
    limit: f64,
}

/// Regions that make it worth the while to look for fewer: to enclose a brick costs about a
/// hundredth of sampling it.
const WORTHWHILE: u32 = 48;

impl Enclosing {
    /// Readies `program` for `engine`: the compiler's is compiled at once when it is first asked.
    ///
    /// Its regions have `bits` bits.
    pub(super) fn new(program: BoxProgram, engine: Engine, bits: usize) -> Self {
        let compiled = OnceLock::new();
        let is_interpreted = match engine {
            Engine::Interpreter | Engine::Pruned => true,
            Engine::Compiled => false,
            Engine::Automatic => program.instructions().len() > LARGE,
        };
        if is_interpreted {
            compiled.get_or_init(|| None);
        }
        let words = bits.div_ceil(64);
        let spare = (64 * words - bits) as u32;
        Self { program, engine, words, spare, boxes: AtomicUsize::new(0), compiled }
    }

    /// Words of activity that a box carries.
    pub(super) fn activity_words(&self) -> usize {
        if Focused::holds(self.words) { Focused::WORDS } else { self.words }
    }

    /// Fresh memory for one thread.
    pub(super) fn workspace(&self) -> EnclosingWorkspace {
        EnclosingWorkspace {
            boxes: self.program.workspace(),
            staging: Vec::new(),
            focus: Focus::default(),
        }
    }

    /// The compiled program, if there is one by now; `boxes` more are about to be enclosed.
    fn compiled(&self, boxes: usize) -> Option<&Ranges> {
        if let Some(compiled) = self.compiled.get() {
            return compiled.as_ref();
        }
        let before = self.boxes.fetch_add(boxes, Ordering::Relaxed);
        let is_due = match self.engine {
            Engine::Interpreter | Engine::Pruned | Engine::Automatic => {
                before < MANY && before + boxes >= MANY
            }
            Engine::Compiled => true,
        };
        // A program that can't be compiled is interpreted.
        let compile = || Ranges::compile(&self.program).ok();
        is_due.then(|| self.compiled.get_or_init(compile).as_ref()).flatten()
    }

    /// See [`Sampler::ranges`](super::Sampler::ranges).
    pub(super) fn ranges(
        &self,
        workspace: &mut EnclosingWorkspace,
        (uniforms, levels): (&UniformRanges, &Levels),
        boxes: &[NodeBox],
        activity: &mut [u64],
        ranges: &mut [Interval],
    ) {
        let EnclosingWorkspace { boxes: own, staging, .. } = workspace;
        let lanes = Lanes::new(boxes);
        let leaves = || {
            let halves = lanes.halves(levels).filter(|halves| halves.iter().all(|h| h.plain))?;
            let tables = halves.map(|halves| halves.ends);
            uniforms.is_finite().then_some(RangeLeaves { tables, uniforms: uniforms.values() })
        };
        let inputs = (uniforms, levels);
        let mut bits = [0; 8];
        let rows = if Focused::holds(self.words) {
            let bits = &mut bits[..boxes.len()];
            for (bits, row) in bits.iter_mut().zip(activity.chunks_exact(Focused::WORDS)) {
                *bits = row[0];
            }
            bits
        } else {
            &mut *activity
        };
        match self.compiled(boxes.len()).zip(leaves()) {
            Some((compiled, leaves)) => {
                staging.resize(compiled.staging(), 0.0);
                self.program.ranges(own, inputs, &lanes, rows, ranges, |at, octets| {
                    compiled.run(at, leaves, octets, staging)
                });
            }
            None => self.program.ranges(own, inputs, &lanes, rows, ranges, |_, _| None),
        }
        if Focused::holds(self.words) {
            let rows = activity.chunks_exact_mut(Focused::WORDS).zip(bits.into_iter().zip(ranges));
            for (i, (row, (bits, range))) in rows.enumerate() {
                let around = Focused::read(row);
                // Larger boxes are cut, and others hold no surface.
                let is_brick = boxes[i].level == 0 && !(range.lo >= 0.0 || range.hi < 0.0);
                let own = if is_brick {
                    around.within(bits, *range, |bits, limit| {
                        let mut row = [bits];
                        self.program.focus(own, (&lanes, i), &mut row, limit);
                        row[0]
                    })
                } else {
                    around.unfocused(bits)
                };
                own.write(row);
            }
        }
    }

    /// The activity that brick `brick` needs as near to zero as `nearness` says, given its activity
    /// `activity`, and how near that is: the row gives the right signs, and the right bits of all
    /// values and slopes where the value it gives is within the limit of zero.
    ///
    /// `None` if that would be no better than `activity` itself, or if that says that every region
    /// is wanted.
    pub(super) fn focus<'w>(
        &self,
        workspace: &'w mut EnclosingWorkspace,
        inputs: (&UniformRanges, &Levels),
        brick: [u32; 3],
        activity: &'w [u64],
        nearness: Nearness,
    ) -> Option<(&'w [u64], f64)> {
        if Focused::holds(self.words) {
            return Focused::near(activity, nearness);
        }
        let live: u32 = activity.iter().map(|word| word.count_ones()).sum();
        if live < WORTHWHILE + self.spare || activity.iter().all(|word| *word == u64::MAX) {
            return None;
        }
        let key = Some((brick, nearness));
        if workspace.focus.key != key || workspace.focus.from != activity {
            let mut focus = std::mem::take(&mut workspace.focus);
            focus.key = key;
            focus.from.clear();
            focus.from.extend_from_slice(activity);
            focus.row.clone_from(&focus.from);
            let boxes = [NodeBox { level: 0, index: brick }];
            let mut range = [Interval::ANYTHING];
            self.ranges(workspace, inputs, &boxes, &mut focus.row, &mut range);
            let [Interval { lo, hi, .. }] = range;
            focus.limit = match nearness {
                Nearness::Sign => f64::MIN_POSITIVE,
                Nearness::Surface => (hi - lo) * NEAR,
            };
            if focus.limit > 0.0 && focus.limit.is_finite() {
                let (lanes, limit) = (Lanes::new(&boxes), focus.limit);
                self.program.focus(&workspace.boxes, (&lanes, 0), &mut focus.row, limit);
            }
            workspace.focus = focus;
        }
        let Focus { row, limit, .. } = &workspace.focus;
        (*limit > 0.0 && limit.is_finite()).then_some((row, *limit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::leaves::Leaves;
    use crate::eval::lower::lower;
    use crate::eval::regions::Bits;
    use crate::eval::sampler::BRICK;
    use crate::eval::schedule::Schedule;
    use crate::eval::tape::Tape;
    use crate::expr::probe::Source;
    use crate::expr::{Graph, NodeId};

    /// The interval program of `root` on a grid of four bricks a side from -`reach` to `reach`.
    fn program(
        graph: &Graph,
        root: NodeId,
        reach: f64,
    ) -> (BoxProgram, UniformRanges, Levels, usize) {
        let tape = Tape::new(graph, &[root]);
        let bits = Bits::number(&tape);
        let lowered = lower(graph, root);
        let schedule = Schedule::boxes(&tape, &bits);
        let leaves = Leaves::of_boxes(&schedule);
        let program = BoxProgram::new(&schedule, &leaves, (graph, &lowered), bits.words());
        let uniforms = leaves.uniform_values(&lowered.graph, &[]).unwrap();
        let table: Vec<f64> = (0..=4 * BRICK).map(|i| reach * (i as f64 / 32.0 - 1.0)).collect();
        let tables = [table.clone(), table.clone(), table];
        let levels = Levels::new(&leaves, &lowered.graph, &tables, &[]).unwrap();
        (program, UniformRanges::new(&uniforms), levels, bits.words())
    }

    /// The product of x y and y z, less x, whose arithmetic makes one stretch.
    fn polynomial(graph: &mut Graph) -> NodeId {
        let [x, y, z] = graph.point();
        let (xy, yz) = (graph.mul(x, y), graph.mul(y, z));
        let product = graph.mul(xy, yz);
        let zx = graph.mul(z, x);
        let sum = graph.add(product, zx);
        graph.sub(sum, x)
    }

    /// How many stretches count, and fail to, in all boxes of the finest level.
    fn stretches(reach: f64) -> [usize; 2] {
        let mut graph = Graph::new();
        let root = polynomial(&mut graph);
        let (program, uniforms, levels, _) = program(&graph, root, reach);
        let compiled = Ranges::compile(&program).unwrap();
        let mut staging = vec![0.0; compiled.staging()];
        let mut workspace = program.workspace();
        let mut counts = [0; 2];
        for index in (0..64).map(|i| [i % 4, i / 4 % 4, i / 16]) {
            let boxes = [NodeBox { level: 0, index }];
            let lanes = Lanes::new(&boxes);
            let halves = lanes.halves(&levels).unwrap();
            assert!(halves.iter().all(|halves| halves.plain));
            let (tables, values) = (halves.map(|halves| halves.ends), uniforms.values());
            let leaves = RangeLeaves { tables, uniforms: values };
            let mut range = [[Interval::ANYTHING]; 2];
            let inputs = (&uniforms, &levels);
            program.ranges(&mut workspace, inputs, &lanes, &mut [], &mut range[0], |at, octets| {
                let next = compiled.run(at, leaves, octets, &mut staging);
                let started = at == program.runs().next().map_or(0, |run| run.start);
                counts[0] += usize::from(next.is_some());
                counts[1] += usize::from(next.is_none() && started);
                next
            });
            program.ranges(&mut workspace, inputs, &lanes, &mut [], &mut range[1], |_, _| None);
            assert_eq!(range[0], range[1]);
        }
        counts
    }

    #[test]
    fn arithmetic_on_finite_ranges_is_compiled() {
        assert_eq!(stretches(1.0), [64, 0]);
    }

    #[test]
    fn what_overflows_is_left_to_the_interpreter() {
        let [valid, refused] = stretches(1e120);
        assert!(valid == 0 && refused == 64, "{valid} stretches count, {refused} don't");
    }

    #[test]
    fn near_the_surface_fewer_parts_matter() {
        let mut source = Source(31);
        let mut graph = Graph::new();
        let at = graph.point();
        let mut ball = |_| {
            let squares = at.map(|u| {
                let c = graph.constant(source.within(-1.0, 1.0));
                let d = graph.sub(u, c);
                graph.mul(d, d)
            });
            let sum = graph.add(squares[0], squares[1]);
            let sum = graph.add(sum, squares[2]);
            let (root, r) = (graph.unary(crate::expr::Unary::Sqrt, sum), graph.constant(0.05));
            graph.sub(root, r)
        };
        let parts: Vec<NodeId> = (0..300).map(&mut ball).collect();
        let root = parts.into_iter().reduce(|a, b| graph.min(a, b)).unwrap();
        let (graph, root) = crate::eval::balance::balance(&graph, root);
        let (program, uniforms, levels, words) = program(&graph, root, 1.0);
        let own = Enclosing::new(program, Engine::Interpreter, 64 * words);
        let mut workspace = own.workspace();
        let live = |row: &[u64]| row.iter().map(|word| word.count_ones()).sum::<u32>();
        let (brick, inputs) = ([1, 2, 1], (&uniforms, &levels));
        let mut row = vec![u64::MAX; words];
        let unlimited = own.focus(&mut workspace, inputs, brick, &row, Nearness::Sign);
        assert!(unlimited.is_none(), "all regions are wanted");
        let boxes = [NodeBox { level: 0, index: brick }];
        let mut range = [Interval::ANYTHING];
        own.ranges(&mut workspace, inputs, &boxes, &mut row, &mut range);
        let [sign, surface] = [Nearness::Sign, Nearness::Surface].map(|nearness| {
            let focus = own.focus(&mut workspace, inputs, brick, &row, nearness);
            live(focus.unwrap().0)
        });
        let all = live(&row);
        assert!(2 * surface < all && sign < surface, "{sign}, {surface} of {all} regions are left");
    }
}
