//! The conformance suite: what every engine must pass.
//!
//! [`conformance`] makes one test of each group of cases for an engine. Each case is an expression
//! on a grid; [`check`] holds a program for it to every promise of [`Sampler`] and compares values
//! with plain evaluation node by node.

use super::{BRICK, Bound, End, Engine, NodeBox, Program, Sampler, Workspace, interpret};
use crate::expr::probe::{self, Raw, Simplified, Source};
use crate::expr::{
    Binary, Extremum, Failure, Graph, Node, NodeId, Oracle, Output, Queries, Unary, derive,
};
use crate::geom::Axis;
use crate::num::Interval;
use std::sync::Arc;

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

/// A table of `bricks` bricks between `lo` and `hi`.
fn table(bricks: usize, lo: f64, hi: f64) -> Vec<f64> {
    let last = (bricks * BRICK) as f64;
    (0..=bricks * BRICK).map(|i| lo + (hi - lo) * (i as f64 / last)).collect()
}

/// A grid of 32 x 32 x 16 cells around the origin, with shifted ends and repeated coordinates as
/// contouring makes them.
fn grid(radius: f64) -> [Vec<f64>; 3] {
    let mut tables = [table(2, -radius, radius), table(2, -radius, radius), table(1, 0.0, radius)];
    for table in &mut tables {
        let n = table.len();
        table[0] = table[1];
        table[n - 1] = table[n - 2];
    }
    tables
}

/// One brick with every kind of finite coordinate.
fn spicy_grid(source: &mut Source) -> [Vec<f64>; 3] {
    std::array::from_fn(|_| {
        let mut table: Vec<f64> = (0..=BRICK)
            .map(|_| {
                let value = source.spicy();
                if value.is_finite() { value } else { source.within(-3.0, 3.0) }
            })
            .collect();
        table.sort_unstable_by(f64::total_cmp);
        table
    })
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
#[allow(clippy::too_many_arguments)]
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
    let nodes: Vec<u16> = (0..count).map(|_| source.below(BRICK.pow(3)) as u16).collect();
    let place = |node: u16, b: usize| {
        brick[b] as usize * BRICK + usize::from(node) / BRICK.pow(b as u32) % BRICK
    };
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
    let at_lower: Vec<f64> = nodes.iter().map(|&n| plain[usize::from(n)]).collect();
    let at_upper = value_at(&upper);
    let (in_between, slopes_between) = (value_at(&between), slope_at(&between));
    let slopes_lower = slope_at(&lower);
    let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
    let name = format!("{} along {axis:?}", case.name);
    for activity in activities {
        bound.line_begin(workspace, axis, brick, &nodes, activity).unwrap();
        bound.line_ends(workspace, End::Upper, &mut values).unwrap();
        assert_same(&name, "upper end", &values, &at_upper);
        bound.line(workspace, &between[a], &mut values, &mut slopes).unwrap();
        assert_same(&name, "value", &values, &in_between);
        assert_same(&name, "slope", &slopes, &slopes_between);
        bound.line_ends(workspace, End::Lower, &mut values).unwrap();
        assert_same(&name, "lower end", &values, &at_lower);
        bound.line(workspace, &lower[a], &mut values, &mut slopes).unwrap();
        assert_same(&name, "value at node", &values, &at_lower);
        assert_same(&name, "slope at node", &slopes, &slopes_lower);
    }
}

/// Every operator on one to three axes, at every kind of value.
pub(crate) fn operators(engine: Engine) {
    let mut source = Source(11);
    let mut run = |name: String, graph: Graph, root: NodeId| {
        let coordinates = spicy_grid(&mut source);
        check(engine, &Case { name, graph, root, coordinates }, &mut source);
    };
    for op in Unary::ALL {
        let mut graph = Graph::new();
        let [x, y, z] = graph.point();
        let xz = graph.mul(x, z);
        let sum = graph.add(xz, y);
        let root = graph.unary(op, sum);
        run(op.name().to_owned(), graph, root);
    }
    for op in Binary::ALL {
        for constant in [None, Some(0.0), Some(-0.0), Some(2.0), Some(f64::NAN)] {
            let mut graph = Graph::new();
            let [x, y, z] = graph.point();
            let a = graph.mul(x, y);
            let b = constant.map_or(z, |c| graph.constant(c));
            let (ab, ba) = (graph.binary(op, a, b), graph.binary(op, b, a));
            let root = graph.min(ab, ba);
            run(format!("{} {constant:?}", op.name()), graph, root);
        }
    }
    for extremum in [Extremum::Min, Extremum::Max] {
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 3, 1]] {
            let mut graph = Graph::new();
            let [x, y, z] = graph.point();
            let nodes = [x, graph.mul(x, y), graph.add(y, z), graph.sub(z, x)];
            let root = graph.intern(Node::Pick(extremum, order.map(|i: usize| nodes[i])));
            run(format!("pick {extremum:?} {order:?}"), graph, root);
        }
    }
}

/// Random expressions, as written and as simplified.
pub(crate) fn random(engine: Engine) {
    let mut source = Source(12);
    for i in 0..240 {
        let mut graph = Graph::new();
        let size = 1 + source.below(40);
        let tame = [0.5, 2.0, 0.0, -1.5, std::f64::consts::TAU];
        let constants = if i % 3 == 0 { &probe::SPECIAL[..] } else { &tame };
        let root = if i % 2 == 0 {
            probe::random::<Raw>(&mut graph, &mut source, size, constants)
        } else {
            probe::random::<Simplified>(&mut graph, &mut source, size, constants)
        };
        let coordinates = match i % 3 {
            0 => spicy_grid(&mut source),
            _ => [(); 3].map(|()| {
                let lo = source.within(-3.0, 2.0);
                table(1, lo, lo + source.within(0.0, 2.0).powi(3))
            }),
        };
        let name = format!("random {i}");
        check(engine, &Case { name, graph, root, coordinates }, &mut source);
    }
}

/// sin u cos v + sin v cos w + sin w cos u.
fn gyroid(graph: &mut Graph, at: [NodeId; 3]) -> NodeId {
    let tau = graph.constant(std::f64::consts::TAU);
    let at = at.map(|u| graph.mul(tau, u));
    let products: Vec<NodeId> = (0..3)
        .map(|i| {
            let (s, c) = (graph.unary(Unary::Sin, at[i]), graph.unary(Unary::Cos, at[(i + 1) % 3]));
            graph.mul(s, c)
        })
        .collect();
    let sum = graph.add(products[0], products[1]);
    graph.add(sum, products[2])
}

/// The point turned by a quarter of a radian or so about an axis.
fn turned(graph: &mut Graph, at: [NodeId; 3], about: usize, angle: f64) -> [NodeId; 3] {
    let (u, v) = ((about + 1) % 3, (about + 2) % 3);
    let [c, s] = [angle.cos(), angle.sin()].map(|c| graph.constant(c));
    let mut out = at;
    let (cu, sv) = (graph.mul(c, at[u]), graph.mul(s, at[v]));
    out[u] = graph.add(cu, sv);
    let (su, cv) = (graph.mul(s, at[u]), graph.mul(c, at[v]));
    out[v] = graph.sub(cv, su);
    out
}

fn cube(graph: &mut Graph, radius: f64) -> NodeId {
    let r = graph.constant(radius);
    let sides = graph.point().map(|u| {
        let u = graph.unary(Unary::Abs, u);
        graph.sub(u, r)
    });
    let xy = graph.max(sides[0], sides[1]);
    graph.max(xy, sides[2])
}

/// Periodic surfaces: straight, turned, scaled by a parameter, far away, graded.
pub(crate) fn periodic(engine: Engine) {
    let mut source = Source(13);
    let mut run = |name: &str, radius: f64, make: &dyn Fn(&mut Graph) -> NodeId| {
        let mut graph = Graph::new();
        let field = make(&mut graph);
        let cube = cube(&mut graph, 0.8 * radius);
        let root = graph.max(field, cube);
        let name = name.to_owned();
        let coordinates = grid(radius);
        check(engine, &Case { name, graph, root, coordinates }, &mut source);
    };
    run("gyroid", 1.0, &|graph| {
        let at = graph.point();
        gyroid(graph, at)
    });
    run("gyroid turned about z", 1.0, &|graph| {
        let at = graph.point();
        let at = turned(graph, at, 2, 0.3);
        gyroid(graph, at)
    });
    run("gyroid turned about two axes, scaled by a parameter", 1.0, &|graph| {
        let scale = graph.parameter("scale", 1.7);
        let at = graph.point().map(|u| graph.div(u, scale));
        let at = turned(graph, at, 2, 0.3);
        let at = turned(graph, at, 0, 1.1);
        gyroid(graph, at)
    });
    run("gyroid far away", 1.0, &|graph| {
        let far = graph.constant(1e7);
        let at = graph.point().map(|u| graph.add(u, far));
        let at = turned(graph, at, 1, 0.7);
        gyroid(graph, at)
    });
    run("huge gyroid", 1e280, &|graph| {
        let at = graph.point();
        let at = turned(graph, at, 1, 0.7);
        gyroid(graph, at)
    });
    run("graded gyroid", 1.0, &|graph| {
        let at = graph.point();
        let field = gyroid(graph, at);
        let xy = graph.mul(at[0], at[1]);
        graph.sub(field, xy)
    });
}

/// Waves over boxes so small and so far away that their ranges show the distance between the
/// source form and the lowered one.
pub(crate) fn far_waves(engine: Engine) {
    let mut source = Source(17);
    for i in 0..60 {
        let mut graph = Graph::new();
        let mut sum = graph.constant(source.within(-9.0, 9.0));
        for coordinate in graph.point() {
            let shift = graph.constant(source.within(-9.0, 9.0));
            let frequency = graph.constant(source.within(-7.0, 7.0));
            let term = graph.add(coordinate, shift);
            let term = graph.mul(frequency, term);
            sum = graph.sub(term, sum);
        }
        let scale = graph.parameter("scale", source.within(0.1, 9.0));
        let sum = source.of(&[graph.mul(scale, sum), graph.div(sum, scale)]);
        let root = graph.unary(source.of(&[Unary::Sin, Unary::Cos]), sum);
        let far = 10f64.powi(source.below(6) as i32);
        let coordinates = [(); 3].map(|()| {
            let lo = far * source.within(-1.0, 1.0);
            table(1, lo, lo + far * 1e-15)
        });
        let name = format!("far wave {i}");
        check(engine, &Case { name, graph, root, coordinates }, &mut source);
    }
}

/// Distance to a ball, by formula.
fn ball(graph: &mut Graph, center: [f64; 3], radius: f64) -> NodeId {
    let at = graph.point();
    let squares: Vec<NodeId> = (0..3)
        .map(|i| {
            let c = graph.constant(center[i]);
            let d = graph.sub(at[i], c);
            graph.mul(d, d)
        })
        .collect();
    let sum = graph.add(squares[0], squares[1]);
    let sum = graph.add(sum, squares[2]);
    let (root, r) = (graph.unary(Unary::Sqrt, sum), graph.constant(radius));
    graph.sub(root, r)
}

/// Unions, intersections and differences: random trees, long chains, NaN among the operands.
pub(crate) fn set_operations(engine: Engine) {
    let mut source = Source(14);
    for i in 0..24 {
        let mut graph = Graph::new();
        let mut parts: Vec<NodeId> = (0..2 + source.below(12))
            .map(|_| {
                let center = [(); 3].map(|()| source.within(-1.0, 1.0));
                ball(&mut graph, center, source.within(0.1, 0.5))
            })
            .collect();
        if i % 4 == 0 {
            let [x, y, _] = graph.point();
            let xy = graph.mul(x, y);
            parts.push(graph.unary(Unary::Sqrt, xy));
            parts.push(graph.unary(Unary::Log, xy));
        }
        while parts.len() > 1 {
            let a = parts.swap_remove(source.below(parts.len()));
            let b = source.below(parts.len());
            let op = source.of(&[Binary::Min, Binary::Min, Binary::Max]);
            let other = if source.below(4) == 0 { graph.neg(parts[b]) } else { parts[b] };
            parts[b] = graph.binary(op, a, other);
        }
        let (name, coordinates) = (format!("set operations {i}"), grid(1.2));
        check(engine, &Case { name, root: parts[0], graph, coordinates }, &mut source);
    }
    let mut graph = Graph::new();
    let mut root = ball(&mut graph, [0.0; 3], 0.1);
    for i in 1..400 {
        let center = [(); 3].map(|()| source.within(-1.0, 1.0));
        let next = ball(&mut graph, center, 0.1);
        root = if i % 7 == 0 { graph.min(next, root) } else { graph.min(root, next) };
    }
    let coordinates = [table(1, -1.0, 1.0), table(1, -1.0, 0.0), table(2, -1.0, 1.0)];
    check(engine, &Case { name: "long union".to_owned(), graph, root, coordinates }, &mut source);
}

/// Exact distance to a ball, as an oracle.
#[derive(Debug)]
struct Ball {
    center: [f64; 3],
    radius: f64,
    fails: bool,
}

impl Ball {
    fn offsets(&self, at: [f64; 3]) -> ([f64; 3], f64) {
        let d: [f64; 3] = std::array::from_fn(|a| at[a] - self.center[a]);
        (d, (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt())
    }
}

impl Oracle for Ball {
    fn name(&self) -> &str {
        "ball"
    }

    fn points(&self, queries: Queries<'_>) -> Result<(), Failure> {
        if self.fails {
            return Err(Failure { oracle: "ball".to_owned(), cause: "it is told to".to_owned() });
        }
        let Queries { at, value, mut gradient } = queries;
        for i in 0..value.len() {
            let (offsets, length) = self.offsets(at.map(|c| c[i]));
            value[i] = length - self.radius;
            if let Some(gradient) = &mut gradient {
                for (slice, offset) in gradient.iter_mut().zip(offsets) {
                    slice[i] = offset / length;
                }
            }
        }
        Ok(())
    }

    fn range(&self, at: [Interval; 3]) -> Interval {
        if at.iter().any(|i| i.nan || !i.lo.is_finite() || !i.hi.is_finite()) {
            return Interval::ANYTHING;
        }
        let (mut near, mut far) = (0.0, 0.0);
        for (a, c) in at.iter().zip(self.center) {
            let (lo, hi) = (a.lo - c, a.hi - c);
            let closest = if lo <= 0.0 && hi >= 0.0 { 0.0 } else { lo.abs().min(hi.abs()) };
            let farthest = lo.abs().max(hi.abs());
            near += closest * closest;
            far += farthest * farthest;
        }
        Interval::new(near.sqrt() - self.radius, far.sqrt() - self.radius)
    }

    fn lipschitz(&self) -> f64 {
        1.0
    }
}

/// Oracles on grids, on moved grids, on mixed coordinates, with all outputs, in set operations.
pub(crate) fn oracles(engine: Engine) {
    let mut source = Source(15);
    let mut run = |name: &str, make: &dyn Fn(&mut Graph, [NodeId; 3]) -> NodeId| {
        let mut graph = Graph::new();
        let at = graph.point();
        let root = make(&mut graph, at);
        let (name, coordinates) = (name.to_owned(), grid(1.0));
        check(engine, &Case { name, graph, root, coordinates }, &mut source);
    };
    let oracle = |graph: &mut Graph, center, output, at| {
        let ball: Arc<dyn Oracle> = Arc::new(Ball { center, radius: 0.6, fails: false });
        let id = graph.add_oracle(&ball);
        graph.oracle(id, output, at)
    };
    run("oracle", &|graph, at| oracle(graph, [0.1, 0.2, 0.3], Output::Value, at));
    run("mirrored oracle", &|graph, at| {
        let at = at.map(|u| graph.unary(Unary::Abs, u));
        oracle(graph, [0.1, 0.2, 0.3], Output::Value, at)
    });
    run("turned oracle", &|graph, at| {
        let at = turned(graph, at, 2, 0.4);
        oracle(graph, [0.1, 0.2, 0.3], Output::Value, at)
    });
    run("oracle with axes exchanged", &|graph, [x, y, z]| {
        oracle(graph, [0.1, 0.2, 0.3], Output::Value, [y, z, x])
    });
    run("oracles on few axes", &|graph, [x, y, z]| {
        let half = graph.constant(0.5);
        let values = [[x, y, half], [x, half, z], [half, y, z], [half, half, z], [half; 3]];
        let values = values.map(|at| oracle(graph, [0.1, 0.2, 0.3], Output::Value, at));
        values.into_iter().reduce(|a, b| graph.min(a, b)).unwrap()
    });
    run("value and gradient of an oracle", &|graph, at| {
        let ball: Arc<dyn Oracle> =
            Arc::new(Ball { center: [0.1, 0.2, 0.3], radius: 0.6, fails: false });
        let id = graph.add_oracle(&ball);
        let outputs = Axis::ALL.map(|axis| graph.oracle(id, Output::Partial(axis), at));
        let value = graph.oracle(id, Output::Value, at);
        let xy = graph.binary(Binary::Hypot, outputs[0], outputs[1]);
        let xyz = graph.binary(Binary::Hypot, xy, outputs[2]);
        graph.mul(value, xyz)
    });
    run("union of oracles", &|graph, at| {
        let mut root = oracle(graph, [0.9, 0.9, 0.9], Output::Value, at);
        for center in [[-0.9, -0.9, 0.1], [0.9, -0.9, 0.9], [-0.9, 0.9, 0.5]] {
            let next = oracle(graph, center, Output::Value, at);
            root = graph.min(root, next);
        }
        let field = gyroid(graph, at);
        graph.max(root, field)
    });
}

/// Expressions on no axis, one or two, whole or as parts of choices.
pub(crate) fn few_axes(engine: Engine) {
    let mut source = Source(16);
    for constant in [1.0, -1.0, 0.0, f64::NAN] {
        for axes in 0..8 {
            let mut graph = Graph::new();
            let point = graph.point();
            let p = graph.parameter("p", constant);
            let mut root = graph.mul(p, p);
            for (a, coordinate) in point.into_iter().enumerate() {
                if axes >> a & 1 == 1 {
                    let sine = graph.unary(Unary::Sin, coordinate);
                    root = graph.add(root, sine);
                    root = graph.binary(Binary::Max, root, coordinate);
                }
            }
            root = graph.sub(root, p);
            let (name, coordinates) = (format!("{constant} on {axes:03b}"), grid(2.0));
            check(engine, &Case { name, graph, root, coordinates }, &mut source);
        }
    }
}

/// An oracle's failure comes out of every query that meets it.
pub(crate) fn failures(engine: Engine) {
    let mut graph = Graph::new();
    let [x, y, z] = graph.point();
    let half = graph.constant(0.5);
    let ball: Arc<dyn Oracle> = Arc::new(Ball { center: [0.0; 3], radius: 0.5, fails: true });
    let id = graph.add_oracle(&ball);
    for at in [[x, y, z], [z, x, y], [x, half, half], [half; 3], [y, half, z]] {
        let root = graph.oracle(id, Output::Value, at);
        let bound = Program::new(&graph, root, engine).unwrap().bind(grid(1.0), &[]);
        let mut workspace = bound.workspace();
        let mut values = [0.0; BRICK * BRICK * BRICK];
        let failure = bound.values(&mut workspace, [0; 3], &[], &mut values);
        assert_eq!(failure.unwrap_err().oracle, "ball");
        assert!(bound.signs(&mut workspace, [0; 3], &[], &mut [0; 256]).is_err());
        let begun = bound.line_begin(&mut workspace, Axis::X, [0; 3], &[0, 1], &[]);
        let ends = begun.and_then(|()| bound.line_ends(&mut workspace, End::Lower, &mut [0.0; 2]));
        assert!(ends.is_err());
    }
}

#[test]
#[ignore = "prints timings, 3 seconds"]
fn timings_of_the_interpreter() {
    let seconds = |work: &mut dyn FnMut()| {
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let start = std::time::Instant::now();
            work();
            best = best.min(start.elapsed().as_secs_f64());
        }
        best
    };
    let angles: [&[(usize, f64)]; 3] = [&[], &[(2, 0.3)], &[(2, 0.3), (0, 1.1)]];
    for turns in angles {
        let mut graph = Graph::new();
        let mut at = graph.point();
        for &(about, angle) in turns {
            at = turned(&mut graph, at, about, angle);
        }
        let field = gyroid(&mut graph, at);
        let cube = cube(&mut graph, 1.0);
        let root = graph.max(field, cube);
        let program = Program::new(&graph, root, Engine::Interpreter).unwrap();
        let made = seconds(&mut || {
            Program::new(&graph, root, Engine::Interpreter).unwrap();
        });
        let tables = [(); 3].map(|()| table(8, -1.0, 1.0));
        let bound = program.bind(tables.clone(), &[]);
        let bind = seconds(&mut || {
            let _ = program.bind(tables.clone(), &[]);
        });
        let mut workspace = bound.workspace();
        let everything = vec![u64::MAX; bound.activity_words()];
        let mut signs = [0; 256];
        let mut bricks = |activity: &[u64]| {
            seconds(&mut || {
                for i in 0..512u32 {
                    let brick = [i % 8, i / 8 % 8, i / 64];
                    bound.signs(&mut workspace, brick, activity, &mut signs).unwrap();
                }
            }) / 512.0
                / 4096.0
        };
        let samples = bricks(&everything);
        let interior = bricks(&[!2]);
        let mut workspace = bound.workspace();
        let mut ranges = [Interval::ANYTHING; 8];
        let boxes = seconds(&mut || {
            for i in 0..64u32 {
                let mut activity = vec![u64::MAX; 8 * bound.activity_words()];
                let own: Vec<NodeBox> =
                    (0..8).map(|x| NodeBox { level: 0, index: [x, i % 8, i / 8] }).collect();
                bound.ranges(&mut workspace, &own, &mut activity, &mut ranges).unwrap();
            }
        }) / 512.0;
        let nodes: Vec<u16> = (0..256).collect();
        let (mut values, mut slopes) = ([0.0; 256], [0.0; 256]);
        let at = [0.01; 256];
        let lines = Axis::ALL.map(|axis| {
            bound.line_begin(&mut workspace, axis, [3; 3], &nodes, &everything).unwrap();
            seconds(&mut || {
                bound.line(&mut workspace, &at, &mut values, &mut slopes).unwrap();
            }) / 256.0
        });
        let begin = seconds(&mut || {
            bound.line_begin(&mut workspace, Axis::X, [3; 3], &nodes, &everything).unwrap();
            bound.line_ends(&mut workspace, End::Lower, &mut values).unwrap();
            bound.line_ends(&mut workspace, End::Upper, &mut values).unwrap();
        }) / 256.0;
        eprintln!(
            "gyroid in a box, {} turns: {:.2} ns/sample ({:.2} gyroid alone), {:.1} ns/box, \
             line {:.1} {:.1} {:.1} ns, begin and ends {:.1} ns, program {:.2} ms, bind {:.2} ms",
            turns.len(),
            1e9 * samples,
            1e9 * interior,
            1e9 * boxes,
            1e9 * lines[0],
            1e9 * lines[1],
            1e9 * lines[2],
            1e9 * begin,
            1e3 * made,
            1e3 * bind,
        );
    }
}
