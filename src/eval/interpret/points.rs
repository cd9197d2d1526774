//! Any nodes of a graph at any points: the reference that all programs agree with.

use super::buffers::allocate;
use super::code::{self, Frame, Layout, PLANE, Shape, Source};
use crate::eval::leaves::LeafValues;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position, Tape};
use crate::expr::{Failure, Graph, NodeId};

/// Values of `outputs` at the points `at`, one slice of `out` an output.
///
/// `parameters` holds the values of the graph's parameters by slot. All slices of coordinates and
/// values have one length.
///
/// # Errors
/// [`Failure`] of an oracle.
///
/// # Panics
/// If lengths differ, or there are fewer parameter values than parameters.
pub fn points(
    graph: &Graph,
    outputs: &[NodeId],
    at: [&[f64]; 3],
    parameters: &[f64],
    out: &mut [&mut [f64]],
) -> Result<(), Failure> {
    assert_eq!(outputs.len(), out.len(), "one slice an output");
    let tape = Tape::new(graph, outputs);
    // Every operation is computed, in depth-first order, without regions.
    let schedule = Schedule::plain(&tape);
    let tape = schedule.tape();
    let keep = tape.output_flags();
    let constant = |p: Position| matches!(tape.op(p), Op::Constant(_) | Op::Parameter(_));
    let allocation = allocate(tape, |p| (!constant(p)).then_some(0), |p| keep[p.index()]);
    let mut leaves = LeafValues::default();
    let sources = (tape.positions())
        .map(|p| {
            let value = match tape.op(p) {
                Op::Constant(bits) => f64::from_bits(bits),
                Op::Parameter(parameter) => parameters[parameter.index()],
                Op::Coordinate(_)
                | Op::Unary(..)
                | Op::Binary(..)
                | Op::Pick(..)
                | Op::Oracle(..) => {
                    return Source::Buffer(
                        allocation.of[p.index()].unwrap_or_default(),
                        Shape::Plane,
                    );
                }
            };
            leaves.uniforms.push(value);
            Source::Uniform(leaves.uniforms.len() as u32 - 1)
        })
        .collect();
    let layout = Layout { schedule: &schedule, sources };
    let mut calls = Vec::new();
    let instructions: Vec<_> =
        (tape.positions()).map(|p| layout.instruction(p, graph.oracles(), &mut calls)).collect();
    let count = allocation.counts.first().copied().unwrap_or(0);
    let mut buffers = vec![Vec::new(); count as usize];
    // A coordinate may share its buffer with what is done before it, so it is filled in its turn.
    let mut parts = vec![(None, 0..0)];
    for p in tape.positions() {
        if let (Op::Coordinate(axis), Source::Buffer(buffer, _)) =
            (tape.op(p), layout.sources[p.index()])
        {
            parts.push((Some((axis, buffer)), p.index()..p.index()));
        }
        if let Some((_, run)) = parts.last_mut() {
            run.end = p.index() + 1;
        }
    }
    let total = out.first().map_or(0, |values| values.len());
    for start in (0..total).step_by(PLANE) {
        let lanes = PLANE.min(total - start);
        let frame = Frame {
            leaves: &leaves,
            origin: [0; 3],
            plane: 0,
            volumes: &[],
            nodes: [&[]; 3],
            activity: &[],
            lanes,
        };
        for (coordinate, run) in &parts {
            if let Some((axis, buffer)) = *coordinate {
                let buffer = &mut buffers[buffer as usize];
                buffer.resize(PLANE, 0.0);
                buffer[..lanes].copy_from_slice(&at[axis.index()][start..start + lanes]);
            }
            code::run(&instructions, std::slice::from_ref(run), &calls, &frame, &mut buffers)?;
        }
        for (&p, out) in tape.outputs().iter().zip(out.iter_mut()) {
            let view = frame.view(layout.sources[p.index()], Shape::Plane, &buffers);
            view.copy_to(&mut out[start..start + lanes]);
        }
    }
    Ok(())
}
