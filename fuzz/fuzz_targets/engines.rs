//! Engines: the bytes choose an expression and a grid; both engines must return the same bits for
//! every query, those of plain evaluation, and ranges must enclose them.
#![no_main]

use alveole::eval::{BRICK, Bound, End, Engine, NodeBox, Program, Sampler, Workspace, interpret};
use alveole::expr::{Binary, Extremum, Graph, Node, NodeId, Unary, derive, text};
use alveole::geom::Axis;
use alveole::num::Interval;
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;

/// Most operators of an expression.
const MOST_OPERATORS: usize = 40;
/// Samples of a brick.
const SAMPLES: usize = BRICK * BRICK * BRICK;
/// The value of the parameter.
const PARAMETERS: [f64; 1] = [0.7];
/// Constants that are easily got wrong, among ordinary ones.
const CONSTANTS: [f64; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    2.0,
    -3.0,
    1.0 / 3.0,
    std::f64::consts::TAU,
    16.0,
    1e-3,
    1e9,
    1e300,
    5e-324,
    f64::INFINITY,
    f64::NAN,
];

fuzz_target!(|bytes: &[u8]| {
    let mut source = Unstructured::new(bytes);
    if let Ok(case) = Case::from_bytes(&mut source) {
        case.check(&mut source);
    }
});

/// An expression on a grid of two bricks.
struct Case {
    graph: Graph,
    root: NodeId,
    coordinates: [Vec<f64>; 3],
}

impl Case {
    fn from_bytes(source: &mut Unstructured<'_>) -> Result<Self> {
        let coordinates = [table(source, 2)?, table(source, 1)?, table(source, 1)?];
        let mut graph = Graph::new();
        let root = expression(&mut graph, source)?;
        Ok(Self { graph, root, coordinates })
    }

    fn check(&self, source: &mut Unstructured<'_>) {
        let [plain, compiled] = [Engine::Interpreter, Engine::Compiled].map(|engine| {
            let program = Program::new(&self.graph, self.root, engine);
            program.unwrap_or_else(|error| panic!("{}: {error}", self.text()))
        });
        let (graph, root) = plain.sampled();
        let runs = [&plain, &compiled].map(|p| p.bind(self.coordinates.clone(), &PARAMETERS));
        let mut workspaces = [runs[0].workspace(), runs[1].workspace()];
        let everything = vec![u64::MAX; runs[0].activity_words()];
        for brick in [[0, 0, 0], [1, 0, 0]] {
            let nodes = self.nodes(brick);
            let expected = self.evaluate(graph, root, &nodes);
            let mut activity = everything.clone();
            for level in [1, 0] {
                let own = NodeBox { level, index: brick.map(|b| b >> level) };
                self.check_range(&runs, &mut workspaces, own, &mut activity, &expected);
            }
            for activity in [&everything, &activity] {
                for (bound, workspace) in runs.iter().zip(&mut workspaces) {
                    self.check_samples(bound, workspace, brick, activity, &expected);
                }
            }
            let edges = edges(source);
            for axis in Axis::ALL {
                let mut slopes = graph.clone();
                let slope = derive::partial(&mut slopes, root, axis);
                let ends = self.points_on(axis, brick, &edges, 1.0);
                let end_slopes = self.evaluate(&slopes, slope, &ends);
                let ends = self.evaluate(&slopes, root, &ends);
                let at = self.points_on(axis, brick, &edges, 0.5);
                let values = self.evaluate(&slopes, root, &at);
                let slopes = self.evaluate(&slopes, slope, &at);
                for activity in [&everything, &activity] {
                    for (bound, workspace) in runs.iter().zip(&mut workspaces) {
                        let found = line(bound, workspace, (axis, brick, &edges), activity, &at);
                        self.assert_same("value at an end", &found[0], &ends);
                        self.assert_same("slope at an end", &found[1], &end_slopes);
                        self.assert_same("value on an edge", &found[2], &values);
                        self.assert_same("slope on an edge", &found[3], &slopes);
                    }
                }
            }
        }
    }

    /// The coordinates of a brick's samples.
    fn nodes(&self, brick: [u32; 3]) -> [Vec<f64>; 3] {
        let node = |a: usize, i: usize| brick[a] as usize * BRICK + i / BRICK.pow(a as u32) % BRICK;
        [0, 1, 2].map(|a| (0..SAMPLES).map(|i| self.coordinates[a][node(a, i)]).collect())
    }

    /// Points on edges along `axis` from the given nodes of a brick; `along` is 1 at their ends.
    fn points_on(&self, axis: Axis, brick: [u32; 3], edges: &[u16], along: f64) -> [Vec<f64>; 3] {
        let nodes = self.nodes(brick);
        [0, 1, 2].map(|a| {
            let position = |node: u16| usize::from(node) / BRICK.pow(a as u32) % BRICK;
            let at = |&node: &u16| {
                let lower = nodes[a][usize::from(node)];
                let next = brick[a] as usize * BRICK + position(node) + 1;
                let upper = self.coordinates[a][next];
                if a == axis.index() { (1.0 - along) * lower + along * upper } else { lower }
            };
            edges.iter().map(at).collect()
        })
    }

    /// Values of `node` by plain evaluation.
    fn evaluate(&self, graph: &Graph, node: NodeId, at: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut values = vec![0.0; at[0].len()];
        let at = at.each_ref().map(|list| &list[..]);
        interpret::points(graph, &[node], at, &PARAMETERS, &mut [&mut values])
            .expect("there is no oracle");
        values
    }

    /// The engines agree on range and activity of a box, and the range holds the `values` in it.
    fn check_range(
        &self,
        runs: &[Bound; 2],
        workspaces: &mut [Workspace; 2],
        own: NodeBox,
        activity: &mut Vec<u64>,
        values: &[f64],
    ) {
        let [first, second] = [0, 1].map(|i| {
            let (mut activity, mut range) = (activity.clone(), [Interval::point(0.0)]);
            runs[i]
                .ranges(&mut workspaces[i], &[own], &mut activity, &mut range)
                .expect("there is no oracle");
            (activity, range[0])
        });
        assert_eq!(first, second, "{}", self.text());
        for &value in values {
            assert!(first.1.contains(value), "{value:e} not in {:?}: {}", first.1, self.text());
        }
        *activity = first.0;
    }

    /// Values and signs of a brick are those `expected`.
    fn check_samples(
        &self,
        bound: &Bound,
        workspace: &mut Workspace,
        brick: [u32; 3],
        activity: &[u64],
        expected: &[f64],
    ) {
        let mut values = [0.0; SAMPLES];
        bound.values(workspace, brick, activity, &mut values).expect("there is no oracle");
        self.assert_same("value", &values, expected);
        let mut signs = [0; BRICK * BRICK];
        bound.signs(workspace, brick, activity, &mut signs).expect("there is no oracle");
        for (row, sign) in values.chunks(BRICK).zip(signs) {
            let wanted =
                row.iter().rev().fold(0, |word, value| word << 1 | u16::from(*value < 0.0));
            assert_eq!(sign, wanted, "signs: {}", self.text());
        }
    }

    fn assert_same(&self, what: &str, found: &[f64], expected: &[f64]) {
        for (found, expected) in found.iter().zip(expected) {
            let same = found.to_bits() == expected.to_bits();
            assert!(
                same || found.is_nan() && expected.is_nan(),
                "{what} {found:e}, not {expected:e}: {}",
                self.text()
            );
        }
    }

    fn text(&self) -> String {
        text::text(&self.graph, self.root)
    }
}

/// A table of coordinates, mostly ordinary, sometimes far away, tiny or repeated.
fn table(source: &mut Unstructured<'_>, bricks: usize) -> Result<Vec<f64>> {
    let size = *source.choose(&[1.0, 1.0, 1.0, 1e-9, 1e6, 1e300, 0.0])?;
    let lo = size * f64::from(source.arbitrary::<i8>()?) / 64.0;
    let step = size * f64::from(source.arbitrary::<u8>()?) / 2048.0;
    Ok((0..=bricks * BRICK).map(|i| lo + step * i as f64).collect())
}

/// Some nodes of a brick.
fn edges(source: &mut Unstructured<'_>) -> Vec<u16> {
    let start = source.arbitrary::<u16>().unwrap_or_default();
    let count = 1 + start % 256;
    (0..count).map(|i| start.wrapping_add(i.wrapping_mul(2503)) % SAMPLES as u16).collect()
}

/// Values and slopes at the upper ends of edges and at the points `at` on them.
fn line(
    bound: &Bound,
    workspace: &mut Workspace,
    (axis, brick, edges): (Axis, [u32; 3], &[u16]),
    activity: &[u64],
    at: &[Vec<f64>; 3],
) -> [Vec<f64>; 4] {
    let [mut ends, mut end_slopes, mut values, mut slopes] =
        [(); 4].map(|()| vec![0.0; edges.len()]);
    bound
        .line_begin(workspace, axis, brick, edges, activity)
        .and_then(|()| bound.line_ends(workspace, End::Upper, &mut ends, &mut end_slopes))
        .and_then(|()| bound.line(workspace, &at[axis.index()], &mut values, &mut slopes))
        .expect("there is no oracle");
    [ends, end_slopes, values, slopes]
}

/// An expression whose every operator and operand a byte or two choose.
fn expression(graph: &mut Graph, source: &mut Unstructured<'_>) -> Result<NodeId> {
    let mut pool = graph.point().to_vec();
    pool.push(graph.parameter("p", PARAMETERS[0]));
    for _ in 0..MOST_OPERATORS {
        if source.is_empty() {
            break;
        }
        let operand = |graph: &mut Graph, source: &mut Unstructured<'_>| -> Result<NodeId> {
            let byte = usize::from(source.arbitrary::<u8>()?);
            Ok(if byte < CONSTANTS.len() {
                graph.constant(CONSTANTS[byte])
            } else {
                // Counted from the latest, so that expressions come out deep rather than broad.
                pool[pool.len() - 1 - byte % pool.len()]
            })
        };
        let choice = usize::from(source.arbitrary::<u8>()?) % 48;
        let a = operand(graph, source)?;
        let node = if let Some(&op) = Unary::ALL.get(choice) {
            graph.unary(op, a)
        } else {
            let b = operand(graph, source)?;
            let choice = choice - Unary::ALL.len();
            if let Some(&op) = Binary::ALL.get(choice % 14) {
                graph.binary(op, a, b)
            } else {
                let extremum = [Extremum::Min, Extremum::Max][choice % 2];
                match choice % 14 {
                    10 | 11 => graph.binary(extremum.operator(), a, b),
                    _ => {
                        let (c, d) = (operand(graph, source)?, operand(graph, source)?);
                        graph.intern(Node::Pick(extremum, [a, b, c, d]))
                    }
                }
            }
        };
        pool.push(node);
    }
    Ok(pool[pool.len() - 1])
}
