//! The compiled engine against the interpreter.

use super::Compiled;
use crate::eval::{BRICK, Bound, End, Engine, NodeBox, Program, Sampler};
use crate::expr::Graph;
use crate::expr::probe::{self, Raw, Simplified, Source};
use crate::geom::Axis;
use crate::num::Interval;
use rayon::prelude::*;

crate::eval::suite::conformance!(Engine::Compiled);

/// Everything that a bound program answers about the first brick, as bits without NaN payloads: with
/// all regions active, and with those that the brick's range leaves, where samples are the same and
/// lie in the range.
fn answers(name: &str, bound: &Bound, nodes: &[u16], at: &[f64]) -> Vec<u64> {
    let mut memory = bound.workspace();
    let words = bound.activity_words();
    let mut activity = vec![u64::MAX; words];
    let mut answers = Vec::new();
    let bits = |v: f64| if v.is_nan() { u64::MAX } else { v.to_bits() };
    let mut add = |values: &[f64]| answers.extend(values.iter().map(|v| bits(*v)));
    let mut samples = Vec::new();
    for is_pruned in [false, true] {
        let mut signs = [0; BRICK * BRICK];
        let mut values = [0.0; BRICK * BRICK * BRICK];
        bound.signs(&mut memory, [0; 3], &activity, &mut signs).unwrap();
        bound.values(&mut memory, [0; 3], &activity, &mut values).unwrap();
        add(&signs.map(f64::from));
        add(&values);
        if is_pruned {
            assert!(samples == values.map(bits), "{name}: samples of what is left of it");
        }
        samples = values.map(bits).to_vec();
        for axis in Axis::ALL {
            let mut values = vec![0.0; nodes.len()];
            let mut slopes = values.clone();
            bound.line_begin(&mut memory, axis, [0; 3], nodes, &activity).unwrap();
            for end in [End::Upper, End::Lower] {
                bound.line_ends(&mut memory, end, &mut values, &mut slopes).unwrap();
                add(&values);
                add(&slopes);
            }
            bound.line(&mut memory, at, &mut values, &mut slopes).unwrap();
            add(&values);
            add(&slopes);
        }
        // Once more with what the whole grid needs.
        let everything = [NodeBox { level: 0, index: [0; 3] }];
        let mut range = [Interval::ANYTHING];
        bound.ranges(&mut memory, &everything, &mut activity, &mut range).unwrap();
        let outside = values.iter().find(|value| !range[0].contains(**value));
        assert!(outside.is_none(), "{name}: {outside:?} is not in {range:?}");
        add(&[range[0].lo, range[0].hi, f64::from(u8::from(range[0].nan))]);
    }
    answers
}

fn compare_random_expressions(count: usize, seed: u64) {
    let mut source = Source(seed);
    for i in 0..count {
        let name = format!("expression {i} of seed {seed}");
        let mut graph = Graph::new();
        let size = 1 + source.below(if i % 10 == 0 { 120 } else { 40 });
        let tame = [0.5, 2.0, 0.0, -1.5, std::f64::consts::TAU];
        let constants = if i % 3 == 0 { &probe::SPECIAL[..] } else { &tame };
        let root = if i % 2 == 0 {
            probe::random::<Raw>(&mut graph, &mut source, size, constants)
        } else {
            probe::random::<Simplified>(&mut graph, &mut source, size, constants)
        };
        let (lo, side) = (source.within(-3.0, 2.0), source.within(0.0, 2.0).powi(3));
        let table: Vec<f64> = (0..=BRICK).map(|i| lo + side * (i as f64 / BRICK as f64)).collect();
        let nodes: Vec<u16> =
            (0..1 + source.below(256)).map(|_| source.below(4096) as u16).collect();
        let at: Vec<f64> = nodes.iter().map(|_| lo + side * source.within(0.0, 1.0)).collect();
        let parameters: Vec<f64> = graph.parameters().iter().map(|p| p.1).collect();
        let [interpreted, compiled] = [Engine::Interpreter, Engine::Compiled].map(|engine| {
            let program = Program::new(&graph, root, engine).unwrap();
            let bound = program.bind([table.clone(), table.clone(), table.clone()], &parameters);
            answers(&name, &bound, &nodes, &at)
        });
        assert!(interpreted == compiled, "{name}");
    }
}

#[test]
fn random_expressions_are_compiled_to_the_interpreters_bits() {
    compare_random_expressions(150, 21);
}

#[test]
#[ignore = "a minute"]
fn thousands_of_random_expressions_are_compiled_to_the_interpreters_bits() {
    compare_random_expressions(5000, 22);
}

#[test]
#[ignore = "an hour"]
fn a_million_random_expressions_are_compiled_to_the_interpreters_bits() {
    (100..300_u64).into_par_iter().for_each(|seed| compare_random_expressions(5000, seed));
}

#[test]
fn compiled_programs_go_between_threads() {
    fn check<T: Send + Sync>() {}
    check::<Compiled>();
}
