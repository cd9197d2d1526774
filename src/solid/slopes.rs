//! How the box of a solid moves with a parameter: the derivative of its [`Extent`].
//!
//! The rules that yield the box are run a second time for derivatives, beside the values. Where the
//! box has a kink (two operands reach equally far, an entry of a rotation is zero) the derivative is
//! the one to the right, for a growing parameter. The margin for rounding that a turned box carries
//! is left out: it is 1e-15 of the box. Where numbers of the solid vary in space, the box comes of
//! their ranges, and its derivatives are central differences, right to 1e-8 or so.

use super::extent::{Extent, Join, Order, Rule, Step, pop};
use super::{Solid, Values};
use crate::expr::graph::operands;
use crate::expr::{Graph, Node, NodeId, ParameterId, derive};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Derivatives of a box and of its growth.
#[derive(Clone, Copy, Debug, Default)]
struct Slopes {
    lo: DVec3,
    hi: DVec3,
    growth: DVec3,
}

impl Solid {
    /// The derivatives of the box's ends, least corner then greatest, by `parameter`, where the
    /// parameter in slot `i` of `graph` is `parameters[i]`; zero for infinite ends.
    #[must_use]
    pub fn bounds_slope(
        &self,
        graph: &Graph,
        parameters: &[f64],
        parameter: ParameterId,
    ) -> [[f64; 3]; 2] {
        let numbers: Vec<NodeId> = self.steps.iter().flat_map(|step| numbers(&step.rule)).collect();
        if !depend(graph, &numbers, parameter) {
            return [[0.0; 3]; 2];
        }
        if self.steps.iter().any(|step| matches!(step.rule, Rule::Warp(_))) {
            return self.bounds_difference(graph, parameters, parameter);
        }
        let mut derived = graph.clone();
        let slopes: FxHashMap<NodeId, NodeId> = numbers
            .into_iter()
            .map(|id| (id, derive::by_parameter(&mut derived, id, parameter)))
            .collect();
        let mut values = Values::new(&derived, parameters);
        let mut stack: Vec<Extent> = Vec::new();
        let mut moving: Vec<Slopes> = Vec::new();
        for step in &self.steps {
            let taken = match step.rule {
                Rule::Leaf(_) => 0,
                Rule::Join(..) => 2,
                Rule::Grow(_)
                | Rule::Everywhere
                | Rule::Map
                | Rule::Quotient(_)
                | Rule::Translate(_)
                | Rule::Scale(_)
                | Rule::Rotate(_)
                | Rule::Warp(_) => 1,
            };
            let operands = stack[stack.len() - taken..].to_vec();
            let own = moving.split_off(moving.len() - taken);
            let mut rate = |values: &mut Values<'_>, id: NodeId| {
                slopes.get(&id).and_then(|slope| values.of(*slope)).unwrap_or(0.0)
            };
            moving.push(slope(step, &operands, &own, &mut values, &mut rate));
            step.run(&mut stack, &mut values);
        }
        let bounds = pop(&mut stack).bounds;
        let Slopes { lo, hi, .. } = moving.pop().unwrap_or_default();
        let finite = |end: DVec3, slope: DVec3| {
            [0, 1, 2].map(|a| if end[a].is_finite() { slope[a] } else { 0.0 })
        };
        [finite(bounds.lo, lo), finite(bounds.hi, hi)]
    }

    /// The derivatives of the box's ends by `parameter`, from its boxes on both sides.
    fn bounds_difference(
        &self,
        graph: &Graph,
        parameters: &[f64],
        parameter: ParameterId,
    ) -> [[f64; 3]; 2] {
        let at = |value: f64| {
            let mut moved = parameters.to_vec();
            moved[parameter.index()] = value;
            self.bounds(graph, &moved)
        };
        let present = parameters[parameter.index()];
        let step = DIFFERENCE * present.abs().max(1.0);
        let (before, after) = (at(present - step), at(present + step));
        let slope = |a: f64, b: f64| {
            if a.is_finite() && b.is_finite() { (b - a) / (2.0 * step) } else { 0.0 }
        };
        [[before.lo, after.lo], [before.hi, after.hi]]
            .map(|[a, b]| [0, 1, 2].map(|axis| slope(a[axis], b[axis])))
    }
}

/// The step of differences of boxes, relative to the parameter or to 1: it balances their third
/// derivative and rounding.
const DIFFERENCE: f64 = 1e-6;

/// The expressions that a rule reads.
fn numbers(rule: &Rule) -> Vec<NodeId> {
    match rule {
        Rule::Leaf(leaf) => leaf.bounds.as_flattened().to_vec(),
        Rule::Grow(by) => vec![*by],
        Rule::Everywhere | Rule::Map | Rule::Quotient(_) | Rule::Join(..) => Vec::new(),
        Rule::Translate(by) | Rule::Scale(by) => by.to_vec(),
        Rule::Rotate(rows) => rows.as_flattened().to_vec(),
        Rule::Warp(warp) => warp.numbers(),
    }
}

/// Whether one of `roots` depends on `parameter`.
fn depend(graph: &Graph, roots: &[NodeId], parameter: ParameterId) -> bool {
    let mut seen = rustc_hash::FxHashSet::default();
    let mut pending = roots.to_vec();
    while let Some(id) = pending.pop() {
        let node = graph.node(id);
        if node == Node::Parameter(parameter) {
            return true;
        }
        if seen.insert(id) {
            pending.extend(operands(&node).iter());
        }
    }
    false
}

/// The derivative of what `step` makes of `operands`, which move with `own`.
fn slope(
    step: &Step,
    operands: &[Extent],
    own: &[Slopes],
    values: &mut Values<'_>,
    rate: &mut impl FnMut(&mut Values<'_>, NodeId) -> f64,
) -> Slopes {
    let mut rates = |values: &mut Values<'_>, ids: [NodeId; 3]| {
        DVec3::from_array(ids.map(|id| rate(values, id)))
    };
    match &step.rule {
        Rule::Leaf(leaf) => {
            let [lo, hi] = leaf.bounds.map(|ends| rates(values, ends));
            Slopes { lo, hi, growth: DVec3::ZERO }
        }
        Rule::Grow(by) => {
            let (length, longer) = (values.of(*by).unwrap_or(f64::NAN), rates(values, [*by; 3]).x);
            let Slopes { lo, hi, growth } = own[0];
            if length > 0.0 || (length == 0.0 && longer > 0.0) {
                let more = growth * length + operands[0].growth * longer;
                Slopes { lo: lo - more, hi: hi + more, growth }
            } else {
                own[0]
            }
        }
        Rule::Everywhere | Rule::Map => Slopes::default(),
        Rule::Quotient(by) => Slopes { growth: own[0].growth * *by, ..own[0] },
        Rule::Translate(by) => {
            let by = rates(values, *by);
            Slopes { lo: own[0].lo + by, hi: own[0].hi + by, growth: own[0].growth }
        }
        Rule::Scale(by) => {
            let (factor, faster) = (DVec3::from_array(values.triple(*by)), rates(values, *by));
            scaled(&operands[0], own[0], factor, faster)
        }
        Rule::Rotate(rows) => {
            let entries = rows.map(|row| values.triple(row));
            let faster = rows.map(|row| rates(values, row).to_array());
            rotated(&operands[0], own[0], entries, faster)
        }
        // Boxes of these are derived by differences, and don't come here.
        Rule::Warp(_) => Slopes::default(),
        Rule::Join(join, order) => {
            let (first, second) = match order {
                Order::AsWritten => (0, 1),
                Order::Exchanged => (1, 0),
            };
            let parts = [first, second].map(|i| (&operands[i], own[i]));
            joined(*join, parts)
        }
    }
}

fn scaled(operand: &Extent, own: Slopes, factor: DVec3, faster: DVec3) -> Slopes {
    // An infinite end times a rate of zero is no number; it is not looked at.
    let end = |end: DVec3, slope: DVec3| slope * factor + end * faster;
    let (a, b) = (end(operand.bounds.lo, own.lo), end(operand.bounds.hi, own.hi));
    let mirrored = factor.cmplt(DVec3::ZERO);
    let (size, larger) = (factor.abs(), faster * factor.signum());
    let least = size.min_element();
    let smaller = (0..3).filter(|&i| size[i] == least).map(|i| larger[i]);
    let smaller = smaller.fold(f64::INFINITY, f64::min);
    Slopes {
        lo: DVec3::select(mirrored, b, a),
        hi: DVec3::select(mirrored, a, b),
        growth: own.growth * (size / least)
            + operand.growth * (larger - size * (smaller / least)) / least,
    }
}

fn rotated(operand: &Extent, own: Slopes, rows: [[f64; 3]; 3], faster: [[f64; 3]; 3]) -> Slopes {
    let mut turned = Slopes::default();
    for axis in 0..3 {
        for j in 0..3 {
            let (entry, rate) = (rows[j][axis], faster[j][axis]);
            let side = if entry == 0.0 { rate } else { entry };
            if side == 0.0 {
                continue;
            }
            let end = |end: f64, slope: f64| {
                // A zero entry takes nothing from an infinite end.
                if entry == 0.0 { rate * end } else { rate * end + entry * slope }
            };
            let a = end(operand.bounds.lo[j], own.lo[j]);
            let b = end(operand.bounds.hi[j], own.hi[j]);
            let (a, b) = if side < 0.0 { (b, a) } else { (a, b) };
            turned.lo[axis] += a;
            turned.hi[axis] += b;
            turned.growth[axis] +=
                rate * side.signum() * operand.growth[j] + entry.abs() * own.growth[j];
        }
    }
    turned
}

fn joined(join: Join, [(first, a), (second, b)]: [(&Extent, Slopes); 2]) -> Slopes {
    // The derivative of the lesser, or of the greater, of two; on ties the one to the right.
    let least = |u: f64, v: f64, du: f64, dv: f64| {
        if u < v || (u == v && du < dv) { du } else { dv }
    };
    let most = |u: f64, v: f64, du: f64, dv: f64| {
        if u > v || (u == v && du > dv) { du } else { dv }
    };
    let each = |pick: &dyn Fn(usize) -> f64| DVec3::from_array([0, 1, 2].map(pick));
    let (one, two) = (&first.bounds, &second.bounds);
    let greater_growth =
        |i: usize| most(first.growth[i], second.growth[i], a.growth[i], b.growth[i]);
    match join {
        Join::Difference => a,
        Join::Union => Slopes {
            lo: each(&|i| least(one.lo[i], two.lo[i], a.lo[i], b.lo[i])),
            hi: each(&|i| most(one.hi[i], two.hi[i], a.hi[i], b.hi[i])),
            growth: each(&greater_growth),
        },
        Join::Intersection => Slopes {
            lo: each(&|i| most(one.lo[i], two.lo[i], a.lo[i], b.lo[i])),
            hi: each(&|i| least(one.hi[i], two.hi[i], a.hi[i], b.hi[i])),
            growth: each(&|i| match (first.has_end(i), second.has_end(i)) {
                (true, false) => a.growth[i],
                (false, true) => b.growth[i],
                _ => greater_growth(i),
            }),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::Unary;
    use crate::solid::primitives::{cube, cylinder, sphere};

    /// Compares the slopes of the box of `build`'s solid with differences of the box.
    fn check(value: f64, build: impl Fn(&mut Graph, NodeId) -> Solid) {
        let mut graph = Graph::new();
        let t = graph.parameter("t", value);
        let Node::Parameter(parameter) = graph.node(t) else { panic!("a parameter") };
        let solid = build(&mut graph, t);
        let found = solid.bounds_slope(&graph, &[value], parameter);
        let step = 1e-6;
        let [above, below] = [value + step, value - step].map(|v| solid.bounds(&graph, &[v]));
        for axis in 0..3 {
            for (end, (above, below)) in
                [(above.lo, below.lo), (above.hi, below.hi)].into_iter().enumerate()
            {
                let (slope, difference) =
                    (found[end][axis], (above[axis] - below[axis]) / (2.0 * step));
                let close = (slope - difference).abs() < 1e-8 * (1.0 + slope.abs());
                let endless = !above[axis].is_finite() && slope == 0.0;
                assert!(close || endless, "{slope} is not {difference} along {axis}");
            }
        }
    }

    #[test]
    fn boxes_move_as_their_differences_say() {
        let one = |graph: &mut Graph| graph.constant(1.0);
        check(0.3, |graph, t| sphere(graph).dilate(graph, t));
        check(0.3, |graph, t| sphere(graph).erode(graph, t));
        check(-0.3, |graph, t| sphere(graph).erode(graph, t));
        check(0.3, |graph, t| cylinder(graph).shell(graph, t));
        check(0.3, |graph, t| {
            let (one, two) = (one(graph), graph.constant(-2.0));
            let by = [t, one, two];
            cube(graph).scale(graph, by).dilate(graph, t).scale(graph, [two, t, one])
        });
        check(0.3, |graph, t| cube(graph).translate(graph, [t, t, t]).scale(graph, [t; 3]));
        check(0.3, |graph, t| {
            let (one, square) = (one(graph), graph.mul(t, t));
            let turned = cube(graph).rotate(graph, t, [one, square, t]);
            turned.dilate(graph, t).rotate(graph, square, [t, one, one]).dilate(graph, t)
        });
        check(0.3, |graph, t| {
            let root = graph.unary(Unary::Sqrt, t);
            let small = sphere(graph).scale(graph, [root, t, root]);
            let zero = graph.constant(0.0);
            let aside = cube(graph).translate(graph, [t, zero, root]);
            let long = cylinder(graph).translate(graph, [root, t, t]);
            let either = small.union(graph, aside).dilate(graph, t);
            long.intersection(graph, either).dilate(graph, t)
        });
    }

    #[test]
    fn at_a_kink_the_slope_is_that_to_the_right() {
        let mut graph = Graph::new();
        let t = graph.parameter("t", 0.0);
        let Node::Parameter(parameter) = graph.node(t) else { panic!("a parameter") };
        let [zero, one] = [0.0, 1.0].map(|v| graph.constant(v));
        let turned = cube(&mut graph).rotate(&mut graph, t, [zero, zero, one]);
        let [lo, hi] = turned.bounds_slope(&graph, &[0.0], parameter);
        assert_eq!((lo, hi), ([-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]));
        let moved = cube(&mut graph).translate(&mut graph, [t, zero, zero]);
        let both = cube(&mut graph).union(&mut graph, moved);
        let [lo, hi] = both.bounds_slope(&graph, &[0.0], parameter);
        assert_eq!((lo, hi), ([0.0; 3], [1.0, 0.0, 0.0]));
    }
}
