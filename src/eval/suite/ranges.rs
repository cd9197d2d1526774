//! Ranges: those of an engine against those of the interpreter.

use super::Case;
use crate::eval::{BRICK, Bound, Engine, NodeBox, Program, Sampler};
use crate::expr::probe::Source;
use crate::expr::{Binary, Node, Unary};
use crate::num::Interval;

/// The same enclosure to the bit, whatever the ends of what is NaN for certain.
fn same(a: Interval, b: Interval) -> bool {
    let bits = |i: Interval| (i.lo.to_bits(), i.hi.to_bits(), i.nan);
    bits(a) == bits(b)
}

/// Whether what `a` says is no less than what `b` says.
fn is_within(a: Interval, b: Interval) -> bool {
    a.lo >= b.lo && a.hi <= b.hi && (b.nan || !a.nan)
}

/// Whether `node` jumps where something is rounded.
fn rounds(node: Node) -> bool {
    matches!(
        node,
        Node::Unary(Unary::Floor | Unary::Ceil | Unary::Round, _) | Node::Binary(Binary::Mod, ..)
    )
}

/// Holds the ranges and the activity of a program to the interpreter's, from the whole grid down.
///
/// Every box is cut in its eighths, as the octree does; some of them are left out now and then. The
/// bits of a pruned program's activity are others, and where something is rounded its ranges may be
/// narrower.
pub(super) fn check(engine: Engine, bound: &Bound, case: &Case, source: &mut Source) {
    let Case { name, graph, root, coordinates } = case;
    let reference = Program::new(graph, *root, Engine::Interpreter).unwrap();
    let reference = reference.bind(coordinates.clone(), &super::parameters(graph));
    let bricks = bound.nodes().map(|n| ((n - 1) / BRICK) as u32);
    let top = bricks.iter().map(|b| b.next_power_of_two().ilog2()).max().unwrap() as u8;
    let may_be_narrower = engine == Engine::Pruned && graph.iter().any(|(_, node)| rounds(node));
    let words = bound.activity_words();
    let other_words = reference.activity_words();
    let mut open = vec![([0; 3], vec![u64::MAX; words], vec![u64::MAX; other_words])];
    let mut workspaces = [bound.workspace(), reference.workspace()];
    for level in (0..=top).rev() {
        let mut next = Vec::new();
        for (parent, activity, other_activity) in open {
            let mut boxes: Vec<NodeBox> = (0..8u32)
                .map(|octant| [0, 1, 2].map(|a| 2 * parent[a] + (octant >> a & 1)))
                .filter(|index: &[u32; 3]| (0..3).all(|a| index[a] << level < bricks[a]))
                .map(|index| NodeBox { level, index })
                .collect();
            if boxes.len() > 1 && source.below(4) == 0 {
                boxes.remove(source.below(boxes.len()));
            }
            let answer = |bound: &Bound, workspace: &mut _, activity: &[u64]| {
                let mut activity = activity.repeat(boxes.len());
                let mut ranges = vec![Interval::point(0.0); boxes.len()];
                bound.ranges(workspace, &boxes, &mut activity, &mut ranges).unwrap();
                (ranges, activity)
            };
            let [own, other] = &mut workspaces;
            let got = answer(bound, own, &activity);
            let expected = answer(&reference, other, &other_activity);
            for ((got, expected), b) in got.0.iter().zip(&expected.0).zip(&boxes) {
                let agree = same(*got, *expected) || may_be_narrower && is_within(*got, *expected);
                assert!(agree, "{name}: {got:?}, not {expected:?} over {b:?}");
            }
            if engine != Engine::Pruned {
                assert_eq!(got.1, expected.1, "{name}: activity of {boxes:?}");
            }
            for (i, b) in boxes.iter().enumerate() {
                let row = |rows: &[u64], words: usize| rows[i * words..(i + 1) * words].to_vec();
                next.push((b.index, row(&got.1, words), row(&expected.1, other_words)));
            }
        }
        open = next;
    }
}
