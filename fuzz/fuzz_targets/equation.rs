//! Equations: whatever the text, either located faults or an expression that prints and evaluates.
#![no_main]

use alveole::eval::interpret;
use alveole::expr::{Graph, NodeId, derive, text};
use alveole::geom::Axis;
use alveole::lang::infix::{self, Coordinates, Scope};
use alveole::lang::{self, Equation, Leaf, Span};
use libfuzzer_sys::fuzz_target;
use std::hint::black_box;

/// Largest expression that is differentiated.
const MOST_NODES: usize = 2000;

fuzz_target!(|bytes: &[u8]| {
    let Ok(equation_text) = std::str::from_utf8(bytes) else { return };
    let parameters = [("t".to_owned(), 0.5), ("radius_2".to_owned(), 1.25)];
    let _ = black_box(lang::numbers(equation_text, "the spacing", &parameters));
    let scope = Scope { coordinates: Coordinates::Known, parameters: &parameters };
    let whole = |text: &str| Span { source: 0, start: 0, end: text.len() as u32 };
    let equation = match infix::equation(equation_text, whole(equation_text), scope) {
        Ok(equation) => equation,
        Err(faults) => {
            assert!(!faults.is_empty());
            for label in faults.iter().flat_map(|fault| &fault.labels) {
                let range = label.span.start as usize..label.span.end as usize;
                assert!(equation_text.get(range).is_some(), "{label:?}");
            }
            return;
        }
    };
    let printed = equation.to_string();
    let again = infix::equation(&printed, whole(&printed), scope)
        .unwrap_or_else(|faults| panic!("{printed}: {faults:?}"));
    assert_eq!(equation, again, "{printed}");
    let (mut graph, root) = expression(&equation);
    let (other, other_root) = expression(&again);
    assert_eq!(text::text(&graph, root), text::text(&other, other_root));
    evaluate(&graph, &[root]);
    if graph.len() <= MOST_NODES {
        let slopes = Axis::ALL.map(|axis| derive::partial(&mut graph, root, axis));
        evaluate(&graph, &slopes);
    }
});

fn expression(equation: &Equation) -> (Graph, NodeId) {
    let mut graph = Graph::new();
    let root = equation.expression(&mut graph, &mut |graph, leaf| match leaf {
        Leaf::Parameter(name) | Leaf::Points(name) => graph.parameter(name, 0.5),
    });
    (graph, root)
}

/// Evaluates at points of every kind.
fn evaluate(graph: &Graph, roots: &[NodeId]) {
    let at = [0.0, -0.0, 0.3, -7.5, 1e3, 1e300, -1e-300, f64::INFINITY, f64::NAN];
    let [mut x, mut y, mut z] = [(); 3].map(|()| Vec::new());
    for i in 0..at.len() * at.len() {
        x.push(at[i % at.len()]);
        y.push(at[i / at.len()]);
        z.push(at[(i + i / at.len()) % at.len()]);
    }
    let parameters: Vec<f64> = graph.parameters().iter().map(|(_, value)| *value).collect();
    let mut values = vec![vec![0.0; x.len()]; roots.len()];
    let mut out: Vec<&mut [f64]> = values.iter_mut().map(Vec::as_mut_slice).collect();
    interpret::points(graph, roots, [&x, &y, &z], &parameters, &mut out)
        .expect("an equation has no oracle");
    black_box(values);
}
