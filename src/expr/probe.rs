//! Test support: plain evaluation of a graph at a point, and random expressions.

use super::{Binary, Extremum, Graph, Node, NodeId, Output, Unary};
use crate::geom::Axis;

/// A seeded source of numbers for tests (splitmix64).
pub struct Source(pub u64);

impl Source {
    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `bound`.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound as u64) as usize
    }

    /// A number in `[lo, hi)`, evenly.
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// One of `list`.
    pub fn of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }

    /// Any number: special, of any magnitude, or moderate.
    pub fn spicy(&mut self) -> f64 {
        match self.below(3) {
            0 => self.of(&SPECIAL),
            1 => f64::from_bits(self.bits()),
            _ => self.within(-4.0, 4.0),
        }
    }
}

/// Numbers at which operators have corners.
pub const SPECIAL: [f64; 20] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    2.0,
    -2.0,
    0.5,
    -0.5,
    3.0,
    1.5,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    -5e-324,
    1e308,
    -1e-200,
];

/// The value of every node at a point, oracles being asked one by one.
pub fn evaluate(graph: &Graph, point: [f64; 3], parameters: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(graph.len());
    for (_, node) in graph.iter() {
        let v = |id: NodeId| values[id.index()];
        let value = match node {
            Node::Coordinate(axis) => point[axis.index()],
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Parameter(slot) => parameters[slot.index()],
            Node::Unary(op, a) => op.apply(v(a)),
            Node::Binary(op, a, b) => op.apply(v(a), v(b)),
            Node::Pick(e, [a, b, c, d]) => v(if e.picks_first(v(a), v(b)) { c } else { d }),
            Node::Oracle(oracle, output, at) => {
                let [x, y, z] = at.map(|id| [v(id)]);
                let (mut value, mut partials) = ([0.0], [[0.0]; 3]);
                let queries = super::Queries {
                    at: [&x, &y, &z],
                    value: &mut value,
                    gradient: Some(partials.each_mut().map(|p| p.as_mut_slice())),
                };
                graph.oracles()[oracle.index()].points(queries).unwrap();
                match output {
                    Output::Value => value[0],
                    Output::Partial(axis) => partials[axis.index()][0],
                }
            }
        };
        values.push(value);
    }
    values
}

/// A constructor of nodes: the simplifying ones, or `intern` as it stands.
pub trait Make {
    fn unary(graph: &mut Graph, op: Unary, a: NodeId) -> NodeId;
    fn binary(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> NodeId;
    fn pick(graph: &mut Graph, extremum: Extremum, operands: [NodeId; 4]) -> NodeId;
}

/// Through the graph's constructors.
pub struct Simplified;

impl Make for Simplified {
    fn unary(graph: &mut Graph, op: Unary, a: NodeId) -> NodeId {
        graph.unary(op, a)
    }

    fn binary(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> NodeId {
        graph.binary(op, a, b)
    }

    fn pick(graph: &mut Graph, extremum: Extremum, operands: [NodeId; 4]) -> NodeId {
        graph.pick(extremum, operands)
    }
}

/// Past the graph's constructors, but for powers that are products by definition.
pub struct Raw;

impl Make for Raw {
    fn unary(graph: &mut Graph, op: Unary, a: NodeId) -> NodeId {
        graph.intern(Node::Unary(op, a))
    }

    fn binary(graph: &mut Graph, op: Binary, a: NodeId, b: NodeId) -> NodeId {
        let n = graph.as_constant(b).filter(|n| n.fract() == 0.0 && n.abs() <= 16.0);
        let (Binary::Pow, Some(n)) = (op, n) else {
            return graph.intern(Node::Binary(op, a, b));
        };
        let one = graph.constant(1.0);
        let mut product = one;
        for digit in format!("{:b}", n.abs() as u8).chars().skip_while(|digit| *digit == '0') {
            product = graph.intern(Node::Binary(Binary::Mul, product, product));
            if digit == '1' {
                product = graph.intern(Node::Binary(Binary::Mul, product, a));
            }
        }
        if n < 0.0 { graph.intern(Node::Binary(Binary::Div, one, product)) } else { product }
    }

    fn pick(graph: &mut Graph, extremum: Extremum, operands: [NodeId; 4]) -> NodeId {
        graph.intern(Node::Pick(extremum, operands))
    }
}

/// A random expression of about `size` operators over the coordinates, two parameters and
/// constants from `constants`.
pub fn random<M: Make>(
    graph: &mut Graph,
    source: &mut Source,
    size: usize,
    constants: &[f64],
) -> NodeId {
    let mut pool: Vec<NodeId> = Axis::ALL.map(|axis| graph.coordinate(axis)).to_vec();
    pool.push(graph.parameter("p", 0.7));
    pool.push(graph.parameter("q", -1.3));
    for _ in 0..size {
        // The latest node is an operand half of the time: expressions come out deep, not broad.
        let operand = |source: &mut Source, graph: &mut Graph| match source.below(4) {
            0 => graph.constant(source.of(constants)),
            1 => source.of(&pool),
            _ => pool[pool.len() - 1 - source.below(3)],
        };
        let (a, b) = (operand(source, graph), operand(source, graph));
        let node = match source.below(8) {
            0..3 => M::unary(graph, source.of(&Unary::ALL), a),
            3..7 => {
                let op = source.of(&Binary::ALL);
                // An exponent that folds to a whole number makes a product: leaves are as they are.
                let b = match (op, source.below(2)) {
                    (Binary::Pow, 0) => graph.constant(source.of(constants)),
                    (Binary::Pow, _) => pool[source.below(5)],
                    _ => b,
                };
                M::binary(graph, op, a, b)
            }
            _ => {
                let (c, d) = (operand(source, graph), operand(source, graph));
                M::pick(graph, source.of(&[Extremum::Min, Extremum::Max]), [a, b, c, d])
            }
        };
        pool.push(node);
    }
    pool[pool.len() - 1]
}
