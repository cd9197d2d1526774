//! What programs cost, printed: `cargo test --release figures -- --ignored --nocapture`.

#![allow(clippy::print_stdout)] // It is what the figures are for.

use crate::eval::{BRICK, Bound, End, Engine, NodeBox, Program, Sampler};
use crate::expr::probe::Source;
use crate::expr::{Binary, Graph, NodeId, Unary};
use crate::geom::Axis;
use crate::num::Interval;
use std::time::Instant;

fn constant_times(graph: &mut Graph, factor: f64, a: NodeId) -> NodeId {
    let factor = graph.constant(factor);
    graph.mul(factor, a)
}

fn gyroid(graph: &mut Graph, at: [NodeId; 3]) -> NodeId {
    let at = at.map(|u| constant_times(graph, std::f64::consts::TAU, u));
    let products: [NodeId; 3] = std::array::from_fn(|i| {
        let sine = graph.unary(Unary::Sin, at[i]);
        let cosine = graph.unary(Unary::Cos, at[(i + 1) % 3]);
        graph.mul(sine, cosine)
    });
    let sum = graph.add(products[0], products[1]);
    graph.add(sum, products[2])
}

fn cube(graph: &mut Graph) -> NodeId {
    let one = graph.constant(1.0);
    let sides = graph.point().map(|u| {
        let u = graph.unary(Unary::Abs, u);
        graph.sub(u, one)
    });
    let xy = graph.max(sides[0], sides[1]);
    graph.max(xy, sides[2])
}

fn turned(graph: &mut Graph, at: [NodeId; 3], about: usize, angle: f64) -> [NodeId; 3] {
    let (u, v) = ((about + 1) % 3, (about + 2) % 3);
    let mut out = at;
    let (cu, sv) =
        (constant_times(graph, angle.cos(), at[u]), constant_times(graph, angle.sin(), at[v]));
    out[u] = graph.add(cu, sv);
    let (su, cv) =
        (constant_times(graph, angle.sin(), at[u]), constant_times(graph, angle.cos(), at[v]));
    out[v] = graph.sub(cv, su);
    out
}

fn ball(graph: &mut Graph, center: [f64; 3], radius: f64) -> NodeId {
    let at = graph.point();
    let squares: [NodeId; 3] = std::array::from_fn(|i| {
        let c = graph.constant(center[i]);
        let d = graph.sub(at[i], c);
        graph.mul(d, d)
    });
    let sum = graph.add(squares[0], squares[1]);
    let sum = graph.add(sum, squares[2]);
    let (root, r) = (graph.unary(Unary::Sqrt, sum), graph.constant(radius));
    graph.sub(root, r)
}

/// Seconds that this thread has run, where Linux tells; else seconds that have passed.
fn seconds(since: Instant) -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let own = stat.split(' ').next().and_then(|run| run.parse::<f64>().ok());
    own.map_or_else(|| since.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

/// Milliseconds of work; running time is counted in ticks, so the work is repeated for many.
fn milliseconds(mut work: impl FnMut()) -> f64 {
    let since = Instant::now();
    let (begin, mut times) = (seconds(since), 0);
    while since.elapsed().as_secs_f64() < 0.3 {
        work();
        times += 1;
    }
    (seconds(since) - begin) * 1e3 / f64::from(times)
}

/// Nanoseconds of the fastest of some short works, by their number of results.
fn nanoseconds(count: usize, mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..60).map(time).fold(f64::INFINITY, f64::min) * 1e9 / count as f64
}

fn bind(program: &Program, bricks: usize) -> Bound {
    let last = (bricks * BRICK) as f64;
    let table: Vec<f64> = (0..=bricks * BRICK).map(|i| -1.3 + 2.6 * (i as f64 / last)).collect();
    program.bind([table.clone(), table.clone(), table], &[])
}

/// The bricks that the surface may meet, with what they need.
fn active(bound: &Bound, bricks: u32) -> Vec<([u32; 3], Vec<u64>)> {
    let mut memory = bound.workspace();
    let mut active = Vec::new();
    for i in 0..bricks.pow(2) {
        let index = [i % bricks, i / bricks, i * 7 % bricks];
        let mut activity = vec![u64::MAX; bound.activity_words()];
        let mut range = [Interval::ANYTHING];
        let own = [NodeBox { level: 0, index }];
        bound.ranges(&mut memory, &own, &mut activity, &mut range).unwrap();
        if !range[0].is_inside() && !range[0].is_outside() {
            active.push((index, activity));
        }
    }
    active
}

fn figures(name: &str, bricks: usize, make: impl Fn(&mut Graph) -> NodeId) {
    let mut graph = Graph::new();
    let root = make(&mut graph);
    for engine in [Engine::Interpreter, Engine::Compiled] {
        let make = milliseconds(|| drop(Program::new(&graph, root, engine).unwrap()));
        let program = Program::new(&graph, root, engine).unwrap();
        let bound = bind(&program, bricks);
        let mut memory = bound.workspace();
        let words = bound.activity_words();
        println!("{name}, {engine:?}: made in {make:.2} ms");
        let mut activities = vec![vec![u64::MAX; words]];
        if words == 1 {
            activities.extend((0..2).map(|bit| vec![!(1 << bit)]));
        }
        for activity in activities {
            let mut signs = [0; 256];
            let per = nanoseconds(8 * 4096, || {
                for i in 0..8 {
                    let brick = [i & 1, 1 + (i >> 1 & 1), i >> 2];
                    bound.signs(&mut memory, brick, &activity, &mut signs).unwrap();
                }
            });
            println!(
                "    signs {per:.3} ns a sample, bits ..{:04b}",
                activity.first().unwrap_or(&0) & 15
            );
        }
        let active = active(&bound, bricks as u32);
        let mut signs = [0; 256];
        let per = nanoseconds(active.len().max(1) * 4096, || {
            for (brick, activity) in &active {
                bound.signs(&mut memory, *brick, activity, &mut signs).unwrap();
            }
        });
        let live: u32 =
            active.iter().flat_map(|(_, bits)| bits).map(|word| word.count_ones()).sum();
        let (count, live) = (active.len(), f64::from(live) / active.len() as f64);
        println!("    signs {per:.3} ns a sample in {count} active bricks with {live:.1} bits");
        let nodes: Vec<u16> = (0..256u16).map(|i| (i as u32 * 2503 % 4096) as u16).collect();
        let at: Vec<f64> = (0..256).map(|i| 0.1 + 1e-3 * f64::from(i)).collect();
        let activity = vec![u64::MAX; words];
        let (mut values, mut slopes) = (vec![0.0; 256], vec![0.0; 256]);
        let parts = Axis::ALL.map(|axis| {
            let begin = nanoseconds(256, || {
                bound.line_begin(&mut memory, axis, [1, 1, 2], &nodes, &activity).unwrap();
            });
            let ends = nanoseconds(256, || {
                bound.line_ends(&mut memory, End::Upper, &mut values).unwrap();
            });
            let between = nanoseconds(256, || {
                bound.line(&mut memory, &at, &mut values, &mut slopes).unwrap();
            });
            [begin, ends, between]
        });
        println!("    line begin, ends, between, ns an edge: {parts:.1?}");
    }
}

#[test]
#[ignore = "prints figures for five seconds"]
fn figures_of_named_expressions() {
    figures("gyroid", 4, |graph| {
        let at = graph.point();
        gyroid(graph, at)
    });
    let boxed = |graph: &mut Graph, field: NodeId| {
        let cube = cube(graph);
        graph.binary(Binary::Max, field, cube)
    };
    figures("gyroid in a box", 4, |graph| {
        let at = graph.point();
        let field = gyroid(graph, at);
        boxed(graph, field)
    });
    figures("gyroid turned about z in a box", 4, |graph| {
        let at = graph.point();
        let at = turned(graph, at, 2, 0.3);
        let field = gyroid(graph, at);
        boxed(graph, field)
    });
    figures("gyroid turned about two axes in a box", 4, |graph| {
        let at = graph.point();
        let at = turned(graph, at, 2, 0.3);
        let at = turned(graph, at, 0, 1.1);
        let field = gyroid(graph, at);
        boxed(graph, field)
    });
    for (count, bricks) in [(20, 4), (1000, 32)] {
        figures(&format!("{count} balls"), bricks, |graph| {
            let mut source = Source(1);
            let mut balls: Vec<NodeId> = (0..count)
                .map(|_| ball(graph, [(); 3].map(|()| source.within(-1.0, 1.0)), 0.1))
                .collect();
            while balls.len() > 1 {
                let pairs = balls.chunks(2).map(|pair| match pair {
                    [a, b] => graph.min(*a, *b),
                    _ => pair[0],
                });
                balls = pairs.collect();
            }
            balls[0]
        });
    }
}
