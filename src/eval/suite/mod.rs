//! The conformance suite: what every engine must pass.
//!
//! [`conformance`] makes one test of each group of cases for an engine. Each case is an expression
//! on a grid; [`check`] holds a program for it to every promise of [`Sampler`] and compares values
//! with plain evaluation node by node.

mod cases;
mod ranges;

use super::sampler::{node_at, place_of};
use super::{BRICK, Bound, End, Engine, NodeBox, Program, Sampler, Workspace, interpret};
use crate::expr::probe::{self, Source};
use crate::expr::{Graph, NodeId, derive};
use crate::geom::Axis;
use crate::num::Interval;
pub(crate) use cases::{
    failures, far_waves, few_axes, operators, oracles, periodic, random, set_operations,
    shared_oracles,
};

/// Makes the suite's tests for an engine.
macro_rules! conformance {
    ($engine:expr) => {
        #[test]
        fn every_operator_conforms_at_spicy_values() {
            $crate::eval::suite::operators($engine);
        }
        #[test]
        fn random_expressions_conform() {
            $crate::eval::suite::random($engine);
        }
        #[test]
        fn periodic_surfaces_in_any_position_conform() {
            $crate::eval::suite::periodic($engine);
        }
        #[test]
        fn waves_far_away_conform() {
            $crate::eval::suite::far_waves($engine);
        }
        #[test]
        fn set_operations_conform() {
            $crate::eval::suite::set_operations($engine);
        }
        #[test]
        fn oracles_conform() {
            $crate::eval::suite::oracles($engine);
        }
        #[test]
        fn oracles_on_several_sides_conform() {
            $crate::eval::suite::shared_oracles($engine);
        }
        #[test]
        fn expressions_on_few_axes_conform() {
            $crate::eval::suite::few_axes($engine);
        }
        #[test]
        fn failures_of_oracles_are_reported() {
            $crate::eval::suite::failures($engine);
        }
    };
}
pub(crate) use conformance;

mod interpreter {
    super::conformance!(super::Engine::Interpreter);
}

mod pruned {
    super::conformance!(super::Engine::Pruned);
}

/// An expression on a grid.
struct Case {
    name: String,
    graph: Graph,
    root: NodeId,
    coordinates: [Vec<f64>; 3],
}

/// Same bits, NaN payloads aside.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

#[track_caller]
fn assert_same(name: &str, what: &str, got: &[f64], expected: &[f64]) {
    assert_eq!(got.len(), expected.len());
    for (i, (got, expected)) in got.iter().zip(expected).enumerate() {
        assert!(same(*got, *expected), "{name}: {what} [{i}] is {got:e}, not {expected:e}");
    }
}

/// Parameter values of `graph`, as they stand.
fn parameters(graph: &Graph) -> Vec<f64> {
    graph.parameters().iter().map(|(_, value)| *value).collect()
}

/// Values of `node` of `graph` at points, by the interpreter's plain evaluation.
fn reference(graph: &Graph, node: NodeId, at: [&[f64]; 3]) -> Vec<f64> {
    let mut values = vec![0.0; at[0].len()];
    interpret::points(graph, &[node], at, &parameters(graph), &mut [&mut values]).unwrap();
    values
}

/// Holds an engine's program for a case to every promise.
fn check(engine: Engine, case: &Case, source: &mut Source) {
    let Case { name, graph, root, coordinates } = case;
    let program = Program::new(graph, *root, engine).unwrap();
    let bound = program.bind(coordinates.clone(), &parameters(graph));
    let mut workspace = bound.workspace();
    let bricks: [u32; 3] = bound.nodes().map(|n| ((n - 1) / BRICK) as u32);
    let everything = vec![u64::MAX; bound.activity_words()];
    let top = bricks.iter().map(|b| b.next_power_of_two().ilog2()).max().unwrap() as u8;
    let (sampled, sampled_root) = program.sampled();
    ranges::check(engine, &bound, case, source);
    for z in 0..bricks[2] {
        for y in 0..bricks[1] {
            for x in 0..bricks[0] {
                let brick = [x, y, z];
                let plain = check_values(&bound, &mut workspace, case, brick, &everything);
                let nodes = node_coordinates(coordinates, brick);
                let at = nodes.each_ref().map(|c| &c[..]);
                assert_same(name, "value", &plain, &reference(sampled, sampled_root, at));
                check_point(sampled, sampled_root, &nodes, &plain, source, name);
                let activity = descend(&bound, &mut workspace, brick, top, case, source, &program);
                let pruned = check_values(&bound, &mut workspace, case, brick, &activity);
                assert_same(name, "pruned value", &pruned, &plain);
                for axis in Axis::ALL {
                    let case = (case, &program);
                    check_lines(
                        &bound,
                        &mut workspace,
                        case,
                        axis,
                        brick,
                        &plain,
                        source,
                        &[&everything, &activity],
                    );
                }
            }
        }
    }
}

/// The coordinates of a brick's samples.
fn node_coordinates(coordinates: &[Vec<f64>; 3], brick: [u32; 3]) -> [Vec<f64>; 3] {
    std::array::from_fn(|a| {
        let first = brick[a] as usize * BRICK;
        (0..BRICK.pow(3)).map(|i| coordinates[a][first + i / BRICK.pow(a as u32) % BRICK]).collect()
    })
}

/// A brick's values, after checking that its signs agree.
fn check_values(
    bound: &Bound,
    workspace: &mut Workspace,
    case: &Case,
    brick: [u32; 3],
    activity: &[u64],
) -> Vec<f64> {
    let mut values = [0.0; BRICK * BRICK * BRICK];
    bound.values(workspace, brick, activity, &mut values).unwrap();
    let mut signs = [0; BRICK * BRICK];
    bound.signs(workspace, brick, activity, &mut signs).unwrap();
    for (i, value) in values.iter().enumerate() {
        let sign = signs[i / BRICK] >> (i % BRICK) & 1 == 1;
        assert_eq!(sign, *value < 0.0, "{}: sign of {value:e} at {i} of {brick:?}", case.name);
    }
    values.to_vec()
}

/// Compares a sample with the specification, node by node.
fn check_point(
    graph: &Graph,
    root: NodeId,
    at: &[Vec<f64>; 3],
    values: &[f64],
    source: &mut Source,
    name: &str,
) {
    let i = source.below(values.len());
    let point = [at[0][i], at[1][i], at[2][i]];
    let expected = probe::evaluate(graph, point, &parameters(graph))[root.index()];
    assert!(same(values[i], expected), "{name}: {:e}, not {expected:e} at {point:?}", values[i]);
}

/// The activity of a brick inherited from the whole grid, each box's range being checked.
fn descend(
    bound: &Bound,
    workspace: &mut Workspace,
    brick: [u32; 3],
    top: u8,
    case: &Case,
    source: &mut Source,
    program: &Program,
) -> Vec<u64> {
    let words = bound.activity_words();
    let mut activity = vec![u64::MAX; words];
    for level in (0..=top).rev() {
        let own = NodeBox { level, index: brick.map(|b| b >> level) };
        let before = activity.clone();
        let mut range = [Interval::point(0.0)];
        bound.ranges(workspace, &[own], &mut activity, &mut range).unwrap();
        assert!(activity.iter().zip(&before).all(|(after, before)| after & !before == 0));
        check_range(case, program, own, range[0], source);
        // Boxes of a call have nothing to do with each other.
        let bricks = bound.nodes().map(|n| ((n - 1) / BRICK).div_ceil(1 << level) as u32);
        let count = 1 + source.below(8);
        let mut boxes: Vec<NodeBox> = (0..count)
            .map(|_| NodeBox { level, index: bricks.map(|n| source.below(n as usize) as u32) })
            .collect();
        let place = source.below(count);
        boxes[place] = own;
        let mut together: Vec<u64> = vec![u64::MAX; count * words];
        together[place * words..][..words].copy_from_slice(&before);
        let mut ranges = vec![Interval::point(0.0); count];
        bound.ranges(workspace, &boxes, &mut together, &mut ranges).unwrap();
        assert_eq!(ranges[place], range[0], "{}: range of {own:?} among others", case.name);
        assert_eq!(together[place * words..][..words], activity, "{}: activity", case.name);
    }
    activity
}

/// Checks that a range holds the values at nodes and between them.
fn check_range(case: &Case, program: &Program, own: NodeBox, range: Interval, source: &mut Source) {
    let mut at = [const { Vec::new() }; 3];
    for _ in 0..96 {
        let between = source.below(2) == 0;
        for (a, list) in at.iter_mut().enumerate() {
            let table = &case.coordinates[a];
            let first = (own.index[a] as usize) << own.level;
            let last = (first + (1 << own.level)) * BRICK;
            let (first, last) = (first * BRICK, last.min(table.len() - 1));
            let node = first + source.below(last - first + 1);
            let next = table[(node + 1).min(last)];
            let along = source.within(0.0, 1.0);
            list.push(if between && along * next + (1.0 - along) * table[node] <= next {
                (along * next + (1.0 - along) * table[node]).max(table[node])
            } else {
                table[node]
            });
        }
    }
    let (graph, root) = program.sampled();
    let values = reference(graph, root, at.each_ref().map(|c| &c[..]));
    for (i, value) in values.iter().enumerate() {
        let point = [at[0][i], at[1][i], at[2][i]];
        let name = &case.name;
        assert!(range.contains(*value), "{name}: {value:e} not in {range:?} at {point:?}, {own:?}");
    }
}

/// Checks batches of edges along `axis` under each activity.
#[allow(clippy::too_many_arguments, reason = "a check names everything that it compares")]
fn check_lines(
    bound: &Bound,
    workspace: &mut Workspace,
    (case, program): (&Case, &Program),
    axis: Axis,
    brick: [u32; 3],
    plain: &[f64],
    source: &mut Source,
    activities: &[&[u64]],
) {
    let a = axis.index();
    let count = [1, 15, 16, 17, 200, 256][source.below(6)];
    let across = |b: usize| if a == b { BRICK } else { BRICK + 1 };
    let mut nodes: Vec<u16> =
        (0..count).map(|_| node_at([0, 1, 2].map(|b| source.below(across(b))))).collect();
    let step = BRICK.pow(a as u32);
    let crosses = |n: &u16| {
        let n = usize::from(*n);
        n / step % BRICK < BRICK - 1 && (plain[n] < 0.0) != (plain[n + step] < 0.0)
    };
    let crossed: Vec<u16> = (0..BRICK.pow(3) as u16).filter(crosses).collect();
    // Edges through the surface are what callers ask for.
    if !crossed.is_empty() && source.below(2) == 0 {
        nodes.fill_with(|| source.of(&crossed));
    }
    let place = |node: u16, b: usize| brick[b] as usize * BRICK + place_of(node)[b];
    let corner = |end: usize| -> [Vec<f64>; 3] {
        std::array::from_fn(|b| {
            let ahead = if a == b { end } else { 0 };
            nodes.iter().map(|&n| case.coordinates[b][place(n, b) + ahead]).collect()
        })
    };
    let (lower, upper) = (corner(0), corner(1));
    let mut between = lower.clone();
    for (at, (lo, hi)) in between[a].iter_mut().zip(lower[a].iter().zip(&upper[a])) {
        let along = source.within(0.0, 1.0);
        *at = ((1.0 - along) * lo + along * hi).clamp(*lo, *hi);
    }
    let mut graph = program.sampled().0.clone();
    let slope = derive::partial(&mut graph, program.sampled().1, axis);
    let value_at =
        |at: &[Vec<f64>; 3]| reference(&graph, program.sampled().1, at.each_ref().map(|c| &c[..]));
    let slope_at = |at: &[Vec<f64>; 3]| reference(&graph, slope, at.each_ref().map(|c| &c[..]));
    let at_lower = value_at(&lower);
    for (&node, value) in nodes.iter().zip(&at_lower).filter(|(node, _)| **node < 1 << 12) {
        assert!(same(plain[usize::from(node)], *value), "{} at node {node}", case.name);
    }
    let at_upper = value_at(&upper);
    let (in_between, slopes_between) = (value_at(&between), slope_at(&between));
    let (slopes_lower, slopes_upper) = (slope_at(&lower), slope_at(&upper));
    let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
    let name = format!("{} along {axis:?}", case.name);
    for activity in activities {
        bound.line_begin(workspace, axis, brick, &nodes, activity).unwrap();
        bound.line_ends(workspace, End::Upper, &mut values, &mut slopes).unwrap();
        assert_same(&name, "upper end", &values, &at_upper);
        assert_same(&name, "slope at the upper end", &slopes, &slopes_upper);
        bound.line(workspace, &between[a], &mut values, &mut slopes).unwrap();
        assert_same(&name, "value", &values, &in_between);
        assert_same(&name, "slope", &slopes, &slopes_between);
        bound.line_ends(workspace, End::Lower, &mut values, &mut slopes).unwrap();
        assert_same(&name, "lower end", &values, &at_lower);
        assert_same(&name, "slope at the lower end", &slopes, &slopes_lower);
        bound.line(workspace, &lower[a], &mut values, &mut slopes).unwrap();
        assert_same(&name, "value at node", &values, &at_lower);
        assert_same(&name, "slope at node", &slopes, &slopes_lower);
    }
}
