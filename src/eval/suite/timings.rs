//! How long the interpreter takes, on the shapes that the notes have figures for.

use super::cases::{cube, gyroid, table, turned};
use crate::eval::{End, Engine, NodeBox, Program, Sampler};
use crate::expr::Graph;
use crate::geom::Axis;
use crate::num::Interval;

#[test]
#[ignore = "prints timings, a second"]
#[allow(clippy::print_stderr)]
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
