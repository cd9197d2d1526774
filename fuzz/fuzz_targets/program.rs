//! Program text: whatever the bytes, either located faults or a solid whose text and mesh hold.
//!
//! Text is split, expanded and parsed with files that exist in memory only. A program that is right
//! is printed and read again, and its solid contoured on a tiny grid, sparse and dense.
#![no_main]

use alveole::contour::{self, Grid, contour};
use alveole::eval::{Engine, Program, interpret};
use alveole::expr::{Failure, Oracle};
use alveole::field::scattered::{Data, Scale, Scattered, scattered};
use alveole::field::{MeshDistance, mesh_distance};
use alveole::geom::{Aabb, Axis};
use alveole::job::convert::{Converted, scaffolder};
use alveole::lang::{self, Diagnostic, Loaded, Loader, Refusal, Rejected, Span, Translation};
use alveole::mesh::sink::Collect;
use alveole::mesh::{Mesh, check};
use alveole::num::Progress;
use alveole::octree::Pruning;
use alveole::vocabulary::Words;
use glam::DVec3;
use libfuzzer_sys::fuzz_target;
use std::sync::{Arc, LazyLock};

/// Largest graph that is contoured.
const MOST_NODES: usize = 1000;
/// Cells along the longest side of the box.
const CELLS: f64 = 18.0;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    let words = match lang::words::of(&text) {
        Ok(words) => words,
        Err(rejected) => return check_faults(&rejected),
    };
    match read(&words) {
        Ok(program) => {
            check_text(&program);
            if program.graph.len() <= MOST_NODES {
                check_mesh(&program);
            }
        }
        Err(rejected) => check_faults(&rejected),
    }
});

fn read(words: &[String]) -> Result<lang::Program, Rejected> {
    lang::parse(words, &Words, &mut Files, &[("t".to_owned(), 0.5)])
}

/// There are faults, and every one points into the text.
fn check_faults(rejected: &Rejected) {
    assert!(!rejected.diagnostics.is_empty());
    for label in rejected.diagnostics.iter().flat_map(|fault| &fault.labels) {
        let source = rejected.sources.source(label.span).expect("a label is in a text");
        assert!(source.text.get(label.span.start as usize..label.span.end as usize).is_some());
        assert!(rejected.sources.place(label.span).is_some());
    }
}

/// The program means the same when it is printed and read again.
fn check_text(program: &lang::Program) {
    let printed = lang::format(&program.items, &Words);
    let again = read(&printed).unwrap_or_else(|fault| panic!("{printed:?}: {fault}"));
    assert_eq!(program.items, again.items, "{printed:?}");
    assert_eq!(values(program).map(same_nan), values(&again).map(same_nan), "{printed:?}");
    let bounds = |p: &lang::Program| p.solid.bounds(&p.graph, &parameters(p));
    assert_eq!(bounds(program), bounds(&again), "{printed:?}");
}

/// The field's values at a few points.
fn values(program: &lang::Program) -> Result<[f64; 3], Failure> {
    let at: [&[f64]; 3] = [&[0.0, 0.3, -7.5], &[0.0, -0.7, 1e3], &[0.0, 0.2, -1e-3]];
    let mut values = [0.0; 3];
    let field = [program.solid.field];
    interpret::points(&program.graph, &field, at, &parameters(program), &mut [&mut values])?;
    Ok(values)
}

/// The values of the parameters: that of `t`, and the first ones of levels that densities want found.
fn parameters(program: &lang::Program) -> Vec<f64> {
    program.graph.parameters().iter().map(|(_, value)| *value).collect()
}

/// The bits of values, one pattern for every NaN.
fn same_nan(values: [f64; 3]) -> [u64; 3] {
    values.map(|value| if value.is_nan() { f64::NAN } else { value }.to_bits())
}

/// The solid's mesh is closed, oriented, manifold, in its box, and the same sparse and dense.
fn check_mesh(program: &lang::Program) {
    let whole = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    let parameters = parameters(program);
    let bounds = program.solid.finite_bounds(&program.graph, &parameters).unwrap_or(whole);
    let spacing = DVec3::splat(bounds.size().max_element() / CELLS);
    let Ok(grid) = Grid::new(bounds, spacing) else { return };
    let field = Program::new(&program.graph, program.solid.field, Engine::Interpreter)
        .expect("the interpreter runs everything");
    let tables = Axis::ALL.map(|axis| grid.sampled(axis).to_vec());
    let bound = field.bind(tables, &parameters);
    let mesh = |pruning: Pruning| -> Option<Mesh> {
        let mut sink = Collect::default();
        let settings = contour::Settings { pruning, memory: None };
        match contour(&bound, &grid, &settings, &Progress::new(), &mut sink) {
            Ok(_) => Some(sink.into_mesh()),
            Err(contour::Error::Failure(_)) => None,
            Err(error) => panic!("{error}"),
        }
    };
    let (Some(sparse), Some(dense)) = (mesh(Pruning::Intervals), mesh(Pruning::None)) else {
        return;
    };
    assert_eq!(sparse, dense);
    if sparse.triangles.is_empty() {
        return;
    }
    let found = check(&sparse);
    assert!(found.is_closed() && found.is_oriented() && found.is_manifold(), "{found:?}");
    let defects = &found.defects;
    assert_eq!(defects.bad_index.count + defects.repeated_corner.count, 0, "{found:?}");
    assert_eq!(defects.not_finite.count + defects.isolated_vertex.count, 0, "{found:?}");
    // Cells much flatter than wide make triangles that are thin beyond the measure of the check.
    if spacing.max_element() < 1e6 * grid.shortest_edge() {
        assert_eq!(defects.zero_area.count, 0, "{found:?}");
    }
    for position in &sparse.positions {
        let point = DVec3::from_array(*position);
        assert!(point.cmpge(bounds.lo).all() && point.cmple(bounds.hi).all(), "{point}");
    }
}

/// Files that exist in memory only.
struct Files;

impl Loader for Files {
    fn text(&mut self, path: &str) -> Result<String, Refusal> {
        let text = match path {
            "a" => "gyroid scale 0.5\n  dilate 0.1 # a comment\n",
            "b" => "'x + y' \"z - t\" g' intersection @a",
            "c" => "box @c",
            "d" => "box 'x + y",
            _ => return Err(Refusal { cause: "no such file".to_owned() }),
        };
        Ok(text.to_owned())
    }

    fn is_mesh(&self, word: &str) -> bool {
        word.ends_with(".ply")
    }

    fn mesh(&mut self, path: &str) -> Result<Loaded, Refusal> {
        if path != "m.ply" {
            return Err(Refusal { cause: "no such file".to_owned() });
        }
        Ok(Loaded { distance: Arc::clone(&*WEDGE) as _, bounds: WEDGE.bounds() })
    }

    fn points(&mut self, text: &str) -> Result<Arc<dyn Oracle>, Refusal> {
        if text != "a.fap" {
            return Err(Refusal { cause: "no such file".to_owned() });
        }
        Ok(Arc::clone(&*POINTS) as _)
    }

    fn translation(
        &mut self,
        word: &str,
        span: Span,
    ) -> Option<Result<Translation, Box<Diagnostic>>> {
        let line = word.strip_prefix(scaffolder::PREFIX)?;
        let converted = scaffolder::convert(line);
        Some(match converted {
            Ok(Converted { text, .. }) => Ok(Translation { name: word.to_owned(), text }),
            Err(fault) => Err(Box::new(Diagnostic::new(fault.message).at(span, ""))),
        })
    }
}

/// Numbers at a few points.
static POINTS: LazyLock<Arc<Scattered>> = LazyLock::new(|| {
    let at = vec![[0.0; 3], [1.0, 0.0, 0.5], [-0.5, 1.0, 0.0], [0.0, -1.0, 1.0], [0.5, 0.5, -1.0]];
    let data = Data { at, values: vec![0.25, -0.5, 0.75, 0.5, 1.0] };
    Arc::new(scattered(&data, Scale::Plain, "a.fap").expect("the points are apart"))
});

/// The distance to a tetrahedron.
static WEDGE: LazyLock<Arc<MeshDistance>> = LazyLock::new(|| {
    let mesh = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.25, 0.0], [0.25, 0.0, 0.75]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    };
    Arc::new(mesh_distance(&mesh, "m.ply").expect("the tetrahedron is closed"))
});
