//! Ranges of any nodes of a graph over any boxes.

use super::buffers::allocate;
use super::octet::{LANES, Octet, Octets};
use super::octets::{Code, Frame, Slabs, Source, UniformRanges};
use super::points;
use crate::eval::schedule::Schedule;
use crate::eval::tape::{Op, Position, Tape};
use crate::expr::{Failure, Graph, NodeId};
use crate::num::Interval;

/// The lanes in order.
const ALL_LANES: [u8; LANES] = [0, 1, 2, 3, 4, 5, 6, 7];

/// Encloses `outputs`, none of them split, over boxes with the sides `at`, `out` having the ranges
/// of each output one after the other.
///
/// # Errors
/// [`Failure`] of an oracle on no axis.
pub fn enclose(
    graph: &Graph,
    outputs: &[NodeId],
    at: [&[Interval]; 3],
    parameters: &[f64],
    out: &mut [Interval],
) -> Result<(), Failure> {
    let schedule = Schedule::plain(&Tape::new(graph, outputs));
    let tape = schedule.tape();
    let keep = tape.output_flags();
    let varies = |p: Position| !tape.axes(p).is_empty();
    let allocation = allocate(tape, |p| varies(p).then_some(0), |p| keep[p.index()]);
    let uniform: Vec<Position> = tape.positions().filter(|&p| !varies(p)).collect();
    let nodes: Vec<NodeId> = uniform.iter().map(|&p| tape.node(p)).collect();
    let mut values = vec![0.0; nodes.len()];
    let mut slices: Vec<&mut [f64]> = values.chunks_mut(1).collect();
    points(graph, &nodes, [&[0.0]; 3], parameters, &mut slices)?;
    let uniforms = UniformRanges::new(&values);
    let mut sources: Vec<Source> =
        (allocation.of.iter()).map(|buffer| Source::Buffer(buffer.unwrap_or_default())).collect();
    for (number, p) in uniform.iter().enumerate() {
        sources[p.index()] = Source::Uniform(number as u32);
    }
    let mut code = Code::new(graph);
    tape.positions().for_each(|p| code.push_op(&schedule, p, &sources));
    let count = allocation.counts.first().copied().unwrap_or(0) as usize;
    let mut buffers = Octets::new(count);
    let total = at[0].len();
    for start in (0..total).step_by(LANES) {
        let boxes = LANES.min(total - start);
        let lanes = &ALL_LANES[..boxes];
        let frame = Frame { uniforms: &uniforms, slabs: Slabs::None, words: 0, lanes };
        for p in tape.positions() {
            if let (Op::Coordinate(axis), Source::Buffer(buffer)) = (tape.op(p), sources[p.index()])
            {
                let side = &at[axis.index()][start..start + boxes];
                buffers.set(buffer, &Octet::from_lanes(|i| side[i.min(boxes - 1)]));
            } else {
                let run = p.index()..p.index() + 1;
                code.run(&[run], &frame, &mut [], &mut buffers, &mut [], |_, _| None);
            }
        }
        for (k, &p) in tape.outputs().iter().enumerate() {
            let range = frame.read(sources[p.index()], &buffers);
            for i in 0..boxes {
                out[k * total + start + i] = range.lane(i);
            }
        }
    }
    Ok(())
}
