//! Measures fidget on fields in its own text form, for the comparison kit.
//!
//! ```text
//! fidget-peer eval FIELD ENGINE              cost of a sample, and of what is known before
//! fidget-peer mesh FIELD ENGINE DEPTH STL    octree of 2^DEPTH cells a side, mesh, file
//! ```
//!
//! ENGINE is `jit` or `vm`; the region is [-1, 1]^3. Answers are one JSON object.

use fidget::context::Context;
use fidget::eval::{BulkEvaluator, Function, MathFunction};
use fidget::jit::JitFunction;
use fidget::mesh::{Octree, Settings};
use fidget::render::RenderHints;
use fidget::shape::{Shape, ShapeBulkEval, ShapeTracingEval};
use fidget::types::Interval;
use fidget::vm::VmFunction;
use std::error::Error;
use std::fs::File;
use std::hint::black_box;
use std::io::Write;

/// Samples along a side of a brick, and bricks along a side of the region: powers of two.
const BRICK: usize = 16;
const BRICKS: u32 = 8;
/// Rounds of passes, and the CPU seconds of each.
const ROUNDS: usize = 5;
const ROUND: f64 = 0.1;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let answer = match words[..] {
        ["eval", field, "jit"] => eval::<JitFunction>(field)?,
        ["eval", field, "vm"] => eval::<VmFunction>(field)?,
        ["mesh", field, "jit", depth, stl] => mesh::<JitFunction>(field, depth.parse()?, stl)?,
        ["mesh", field, "vm", depth, stl] => mesh::<VmFunction>(field, depth.parse()?, stl)?,
        _ => {
            return Err("usage: fidget-peer eval FIELD ENGINE | mesh FIELD ENGINE DEPTH STL".into());
        }
    };
    println!("{answer}");
    Ok(())
}

fn shape<F: MathFunction>(path: &str) -> Result<Shape<F>, Box<dyn Error>> {
    let (context, root) = Context::from_text(File::open(path)?)?;
    Ok(Shape::new(&context, root)?)
}

fn mesh<F: MathFunction + RenderHints>(
    path: &str,
    depth: u8,
    stl: &str,
) -> Result<String, Box<dyn Error>> {
    let bound = shape::<F>(path)?.try_into()?;
    let octree =
        Octree::build(&bound, &Settings { depth, ..Settings::default() }).ok_or("cancelled")?;
    let mesh = octree.walk_dual();
    let mut file = File::create(stl)?;
    mesh.write_stl(&mut file)?;
    file.flush()?;
    Ok(format!(r#"{{"triangles": {}, "peak": {}}}"#, mesh.triangles.len(), peak()?))
}

/// A brick with surface, by its least corner in bricks, and the tape simplified for it.
struct Leaf<F: Function> {
    at: [u32; 3],
    shape: Shape<F>,
    tape: FloatTape<F>,
}

type FloatTape<F> =
    fidget::shape::ShapeTape<<<F as Function>::FloatSliceEval as BulkEvaluator>::Tape>;
type FloatEval<F> = ShapeBulkEval<<F as Function>::FloatSliceEval>;
type IntervalEval<F> = ShapeTracingEval<<F as Function>::IntervalEval>;

/// Evaluators, and memory that is used again.
struct Descent<F: Function> {
    interval: IntervalEval<F>,
    tapes: Vec<F::TapeStorage>,
    shapes: Vec<F::Storage>,
    workspace: F::Workspace,
    leaves: Vec<Leaf<F>>,
    boxes: usize,
}

impl<F: Function + Clone> Descent<F> {
    /// Encloses the cube at `at`, `side` bricks wide, with the shape simplified for its parent,
    /// and goes on in its eighths until bricks are left.
    fn enter(&mut self, shape: &Shape<F>, at: [u32; 3], side: u32) -> Result<(), Box<dyn Error>> {
        let [x, y, z] = at.map(|a| {
            let end = |a: u32| 2.0 * a as f32 / BRICKS as f32 - 1.0;
            Interval::new(end(a), end(a + side))
        });
        self.boxes += 1;
        let tape = shape.interval_tape(self.tapes.pop().unwrap_or_default());
        let (range, trace) = self.interval.eval(&tape, x, y, z)?;
        if range.lower() > 0.0 || range.upper() < 0.0 {
            self.tapes.extend(tape.recycle());
            return Ok(());
        }
        let mut simplified = None;
        if let Some(trace) = trace {
            let storage = self.shapes.pop().unwrap_or_default();
            let shorter = shape.simplify(trace, storage, &mut self.workspace)?;
            if shorter.size() < shape.size() {
                simplified = Some(shorter);
            } else {
                self.shapes.extend(shorter.recycle());
            }
        }
        self.tapes.extend(tape.recycle());
        let inner = simplified.as_ref().unwrap_or(shape);
        if side == 1 {
            let tape = inner.float_slice_tape(self.tapes.pop().unwrap_or_default());
            self.leaves.push(Leaf { at, shape: inner.clone(), tape });
        } else {
            let half = side / 2;
            for child in 0..8 {
                let step = [child & 1, child >> 1 & 1, child >> 2];
                self.enter(inner, std::array::from_fn(|i| at[i] + half * step[i]), half)?;
            }
        }
        if let Some(shape) = simplified {
            self.shapes.extend(shape.recycle());
        }
        Ok(())
    }
}

/// Costs on the bricks that intervals do not settle: of finding them, and of a sample in them.
fn eval<F: MathFunction + Clone>(path: &str) -> Result<String, Box<dyn Error>> {
    let shape = shape::<F>(path)?;
    let mut descent = Descent::<F> {
        interval: Shape::<F>::new_interval_eval(),
        tapes: Vec::new(),
        shapes: Vec::new(),
        workspace: F::Workspace::default(),
        leaves: Vec::new(),
        boxes: 0,
    };
    let bounding = least(|| {
        for leaf in std::mem::take(&mut descent.leaves) {
            descent.tapes.extend(leaf.tape.recycle());
            descent.shapes.extend(leaf.shape.recycle());
        }
        descent.boxes = 0;
        descent.enter(&shape, [0; 3], BRICKS)
    })?;

    let mut evaluator: FloatEval<F> = Shape::<F>::new_float_slice_eval();
    let (mut inside, mut length) = (0, 0);
    let sampling = least(|| {
        (inside, length) = (0, 0);
        for leaf in &descent.leaves {
            let [x, y, z] = coordinates(leaf.at);
            let values = evaluator.eval(&leaf.tape, &x, &y, &z)?;
            inside += values.iter().filter(|v| **v < 0.0).count();
            length += leaf.shape.size();
            black_box(values);
        }
        Ok(())
    })?;
    // The same without the evaluation: what the coordinates and the count cost.
    let around = least(|| {
        for leaf in &descent.leaves {
            let [x, y, z] = coordinates(leaf.at);
            black_box((&y, &z));
            black_box(x.iter().filter(|v| **v < 0.0).count());
        }
        Ok(())
    })?;
    let bricks = descent.leaves.len();
    let samples = (bricks * BRICK.pow(3)) as f64;
    let sample = 1e9 * (sampling - around) / samples;
    let bounded = sample + 1e9 * bounding / samples;
    Ok(format!(
        r#"{{"nanoseconds": {sample}, "nanoseconds_bounded": {bounded}, "bound_seconds": {bounding}, "bricks": {bricks}, "boxes": {}, "inside": {inside}, "operations": {}, "mean_operations": {}, "peak": {}}}"#,
        descent.boxes,
        shape.size(),
        length / bricks.max(1),
        peak()?
    ))
}

/// The nodes of a brick, x fastest.
fn coordinates(at: [u32; 3]) -> [Vec<f32>; 3] {
    let node = |a: u32, i: usize| {
        2.0 * (a as usize * BRICK + i) as f32 / (BRICKS as usize * BRICK) as f32 - 1.0
    };
    let stride = [1, BRICK, BRICK * BRICK];
    std::array::from_fn(|axis| {
        (0..BRICK.pow(3)).map(|n| node(at[axis], n / stride[axis] % BRICK)).collect()
    })
}

/// The least CPU seconds of `work` over [`ROUNDS`], each the mean of as many passes as fill
/// [`ROUND`]: the clock moves by milliseconds. Fewer rounds where all would take much longer than
/// that.
fn least(mut work: impl FnMut() -> Result<(), Box<dyn Error>>) -> Result<f64, Box<dyn Error>> {
    let mut least = f64::INFINITY;
    let start = cpu()?;
    for round in 0..ROUNDS {
        let (begin, mut passes) = (cpu()?, 0);
        if round > 0 && begin - start > 2.0 * ROUND * ROUNDS as f64 {
            break;
        }
        while cpu()? - begin < ROUND {
            work()?;
            passes += 1;
        }
        least = least.min((cpu()? - begin) / f64::from(passes));
    }
    Ok(least)
}

/// CPU seconds of this thread so far, as Linux tells them.
fn cpu() -> Result<f64, Box<dyn Error>> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(text.split_whitespace().next().ok_or("no clock")?.parse::<f64>()? * 1e-9)
}

/// The largest resident set so far, in bytes, as Linux tells it.
fn peak() -> Result<u64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("no peak")?;
    Ok(1024 * line.trim().trim_end_matches("kB").trim().parse::<u64>()?)
}
