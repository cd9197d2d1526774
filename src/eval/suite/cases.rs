//! The expressions of the suite, in groups.

use super::{Case, check};
use crate::eval::{BRICK, End, Engine, Program, Sampler};
use crate::expr::probe::{self, Raw, Simplified, Source};
use crate::expr::{
    Binary, Extremum, Failure, Graph, Interest, Node, NodeId, Oracle, Output, Queries, Unary,
};
use crate::geom::Axis;
use crate::num::Interval;
use std::sync::Arc;

/// A table of `bricks` bricks between `lo` and `hi`.
pub(super) fn table(bricks: usize, lo: f64, hi: f64) -> Vec<f64> {
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
pub(super) fn gyroid(graph: &mut Graph, at: [NodeId; 3]) -> NodeId {
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
pub(super) fn turned(graph: &mut Graph, at: [NodeId; 3], about: usize, angle: f64) -> [NodeId; 3] {
    let (u, v) = ((about + 1) % 3, (about + 2) % 3);
    let [c, s] = [angle.cos(), angle.sin()].map(|c| graph.constant(c));
    let mut out = at;
    let (cu, sv) = (graph.mul(c, at[u]), graph.mul(s, at[v]));
    out[u] = graph.add(cu, sv);
    let (su, cv) = (graph.mul(s, at[u]), graph.mul(c, at[v]));
    out[v] = graph.sub(cv, su);
    out
}

pub(super) fn cube(graph: &mut Graph, radius: f64) -> NodeId {
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

/// Exact distance to a ball, as an oracle, whose stand-ins are as far from the values as they may
/// be.
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

    /// The stand-in for the `i`-th value: the least or the greatest one.
    fn stand_in(value: f64, interest: Interest<'_>, i: usize) -> f64 {
        let (mut least, mut most) = (value, value);
        match interest {
            Interest::Beside(levels) => {
                if levels.iter().all(|level| value != *level) {
                    let of = |keep: &dyn Fn(f64) -> bool| {
                        levels.iter().copied().filter(|level| keep(*level)).collect::<Vec<f64>>()
                    };
                    let below = of(&|level| level < value).into_iter().reduce(f64::max);
                    let above = of(&|level| level > value).into_iter().reduce(f64::min);
                    least = below.map_or(f64::NEG_INFINITY, f64::next_up);
                    most = above.map_or(f64::INFINITY, f64::next_down);
                }
            }
            Interest::From(bounds) if value < bounds[i] => {
                (least, most) = (f64::NEG_INFINITY, bounds[i].next_down());
            }
            Interest::UpTo(bounds) if value > bounds[i] => {
                (least, most) = (bounds[i].next_up(), f64::INFINITY);
            }
            Interest::From(_) | Interest::UpTo(_) => {}
        }
        if i.is_multiple_of(3) { least } else { most }
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

    fn points_for(&self, queries: Queries<'_>, interest: Interest<'_>) -> Result<(), Failure> {
        let Queries { at, value, mut gradient } = queries;
        let gradients = gradient.as_mut().map(|rows| rows.each_mut().map(|row| &mut **row));
        self.points(Queries { at, value, gradient: gradients })?;
        for (i, value) in value.iter_mut().enumerate() {
            let stand_in = Self::stand_in(*value, interest, i);
            if let Some(rows) = gradient.as_mut().filter(|_| stand_in != *value) {
                rows.iter_mut().for_each(|row| row[i] = f64::NAN);
            }
            *value = stand_in;
        }
        Ok(())
    }

    fn brick_beside(
        &self,
        at: [&[f64]; 3],
        levels: &[f64],
        value: &mut [f64],
    ) -> Result<(), Failure> {
        self.brick(at, value)?;
        for (i, value) in value.iter_mut().enumerate() {
            *value = Self::stand_in(*value, Interest::Beside(levels), i);
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

/// An output of an oracle for a ball.
fn oracle(graph: &mut Graph, center: [f64; 3], output: Output, at: [NodeId; 3]) -> NodeId {
    let ball: Arc<dyn Oracle> = Arc::new(Ball { center, radius: 0.6, fails: false });
    let id = graph.add_oracle(&ball);
    graph.oracle(id, output, at)
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
    run("arithmetic on oracles on few axes", &|graph, [x, y, z]| {
        let half = graph.constant(0.5);
        let values = [[x, y, half], [x, half, z], [half, y, z], [half, half, z]].map(|at| {
            let value = oracle(graph, [0.1, 0.2, 0.3], Output::Value, at);
            let square = graph.mul(value, value);
            graph.sub(square, value)
        });
        values.into_iter().reduce(|a, b| graph.add(a, b)).unwrap()
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
    // Moved, grown, shrunk, turned inside out and hollowed, on either side of the lattice.
    for turn in 0..48 {
        run(&format!("oracle beside a lattice, way {turn}"), &|graph, at| {
            let at = if turn % 2 == 0 { at } else { turned(graph, at, 2, 0.4) };
            let mut field = oracle(graph, [0.1, 0.2, 0.3], Output::Value, at);
            let (third, offset) = (graph.constant(0.3), graph.parameter("offset", 0.15));
            for step in [turn / 2 % 4, turn / 8 % 3] {
                field = match step {
                    0 => graph.sub(field, offset),
                    1 => graph.mul(field, third),
                    2 => graph.neg(field),
                    _ => {
                        let distance = graph.unary(Unary::Abs, field);
                        graph.sub(distance, offset)
                    }
                };
            }
            let lattice = gyroid(graph, at);
            match turn / 3 % 4 {
                0 => graph.max(field, lattice),
                1 => graph.min(lattice, field),
                2 => graph.max(lattice, field),
                _ => {
                    let cut = graph.max(lattice, field);
                    let other = oracle(graph, [-0.6, 0.2, 0.3], Output::Value, at);
                    graph.min(cut, other)
                }
            }
        });
    }
}

/// An oracle on several sides of extrema, which it loses together or not at all.
pub(crate) fn shared_oracles(engine: Engine) {
    let mut source = Source(19);
    for turn in 0..192 {
        let mut graph = Graph::new();
        let at = graph.point();
        let part = oracle(&mut graph, [0.1, 0.2, 0.3], Output::Value, at);
        let skin = graph.parameter("skin", 0.1);
        // In some bricks one side or the other is dead, and worth the while to skip.
        let level = graph.constant([-1.2, 0.0, 1.2][turn % 3]);
        let [x, y, z] = at;
        let product = graph.mul(x, y);
        let product = graph.mul(product, z);
        let slow = graph.unary(Unary::Sin, product);
        let lattice = gyroid(&mut graph, at);
        let lattice = graph.add(lattice, slow);
        let lattice = graph.add(lattice, level);
        let core = graph.add(part, skin);
        let shell = graph.neg(core);
        let inner = match turn % 4 {
            0 => graph.min(lattice, shell),
            1 => graph.min(shell, lattice),
            2 => graph.max(lattice, core),
            _ => graph.max(shell, lattice),
        };
        let root = match turn / 4 % 4 {
            0 => graph.max(part, inner),
            1 => graph.max(inner, part),
            2 => graph.min(inner, part),
            _ => {
                let cut = graph.max(part, lattice);
                graph.min(cut, inner)
            }
        };
        let root = match turn / 16 % 4 {
            0 => root,
            1 => graph.max(root, x),
            2 => {
                let double = graph.add(x, x);
                let other = graph.min(double, lattice);
                graph.min(other, root)
            }
            _ => graph.add(root, x),
        };
        let name = format!("an oracle on several sides, way {turn}");
        let coordinates = grid([1.5, 0.3, 0.08][turn / 64]);
        check(engine, &Case { name, graph, root, coordinates }, &mut source);
    }
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
        let ends = begun.and_then(|()| {
            bound.line_ends(&mut workspace, End::Lower, &mut [0.0; 2], &mut [0.0; 2])
        });
        assert!(ends.is_err());
    }
}
