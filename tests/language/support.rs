//! A loader without files, and a plain evaluator.

use alveole::expr::{Failure, Graph, Node, NodeId, Oracle, Queries};
use alveole::geom::Aabb;
use alveole::lang::{self, Loaded, Loader, Program, Refusal, Rejected};
use alveole::num::Interval;
use alveole::vocabulary::Words;
use glam::DVec3;
use std::sync::Arc;

/// The ball of radius 3/4, as a mesh's distance.
#[derive(Debug)]
struct Ball;

impl Oracle for Ball {
    fn name(&self) -> &str {
        "ball"
    }

    fn points(&self, queries: Queries<'_>) -> Result<(), Failure> {
        let Queries { at: [x, y, z], value, .. } = queries;
        for (i, value) in value.iter_mut().enumerate() {
            *value = DVec3::new(x[i], y[i], z[i]).length() - 0.75;
        }
        Ok(())
    }

    fn range(&self, _: [Interval; 3]) -> Interval {
        Interval::ANYTHING
    }

    fn lipschitz(&self) -> f64 {
        1.0
    }
}

/// Knows a few texts, and meshes whose names begin with `mesh`.
pub struct Files;

/// The texts of the program files.
pub const TEXTS: &[(&str, &str)] = &[
    ("plain", "gyroid scale 0.5\n  dilate 0.1\n"),
    ("quoted", "# a comment\n'x + y' \"z - 1\" g' # another\nintersection #last"),
    ("nested", "box @plain"),
    ("self", "box @self"),
    ("ring", "@gnir"),
    ("gnir", "sphere @ring"),
    ("open", "box 'x + y"),
    ("typo", "box\n  shpere\nscale 2 2 2"),
    ("empty", " # nothing\n"),
];

impl Loader for Files {
    fn text(&mut self, path: &str) -> Result<String, Refusal> {
        if let Some(depth) = path.strip_prefix("deep").and_then(|n| n.parse::<u32>().ok()) {
            return Ok(format!("@deep{}", depth + 1));
        }
        let found = TEXTS.iter().find(|(name, _)| *name == path);
        let refusal = || Refusal { cause: "no such file".to_owned() };
        found.map(|(_, text)| (*text).to_owned()).ok_or_else(refusal)
    }

    fn is_mesh(&self, word: &str) -> bool {
        [".ply", ".stl", ".obj", ".off"].iter().any(|end| word.to_lowercase().ends_with(end))
    }

    fn mesh(&mut self, path: &str) -> Result<Loaded, Refusal> {
        if !path.starts_with("mesh") {
            return Err(Refusal { cause: "no such file".to_owned() });
        }
        let bounds = Aabb::new(DVec3::splat(-0.75), DVec3::splat(0.75));
        Ok(Loaded { distance: Arc::new(Ball), bounds })
    }
}

/// The program with these words.
pub fn parse(words: &[&str], parameters: &[(&str, f64)]) -> Result<Program, Rejected> {
    let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
    let parameters: Vec<_> =
        parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    lang::parse(&words, &Words, &mut Files, &parameters)
}

/// The words of `line`, split as a shell does: blanks, and single quotes around blanks.
pub fn shell(line: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let (mut inside, mut quoted) = (false, false);
    for letter in line.chars() {
        match letter {
            '\'' => {
                if !inside {
                    words.push(String::new());
                    inside = true;
                }
                quoted = !quoted;
            }
            ' ' if !quoted => inside = false,
            _ => {
                if !inside {
                    words.push(String::new());
                    inside = true;
                }
                words.last_mut().unwrap().push(letter);
            }
        }
    }
    words
}

/// The program of a line.
pub fn program(line: &str) -> Program {
    let words = shell(line);
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    parse(&words, &[]).unwrap_or_else(|fault| panic!("{line}: {:?}", fault.diagnostics))
}

impl Field for Program {
    fn at(&self, point: [f64; 3]) -> f64 {
        value(&self.graph, self.solid.field, point)
    }

    fn bounds(&self) -> Aabb {
        self.solid.bounds(&self.graph, &self.values())
    }

    fn values(&self) -> Vec<f64> {
        self.graph.parameters().iter().map(|(_, value)| *value).collect()
    }
}

/// What tests ask of a program.
pub trait Field {
    /// Its field's value at `point`.
    fn at(&self, point: [f64; 3]) -> f64;
    /// Its box.
    fn bounds(&self) -> Aabb;
    /// The present values of its parameters.
    fn values(&self) -> Vec<f64>;
}

/// The value of `root` at `point`, parameters taking their present values.
pub fn value(graph: &Graph, root: NodeId, point: [f64; 3]) -> f64 {
    let mut values: Vec<f64> = Vec::with_capacity(root.index() + 1);
    for (_, node) in graph.iter().take(root.index() + 1) {
        let at = |id: NodeId| values[id.index()];
        let value = match node {
            Node::Coordinate(axis) => point[axis.index()],
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Parameter(slot) => graph.parameters()[slot.index()].1,
            Node::Unary(op, a) => op.apply(at(a)),
            Node::Binary(op, a, b) => op.apply(at(a), at(b)),
            Node::Pick(extremum, [a, b, c, d]) => {
                if extremum.picks_first(at(a), at(b)) {
                    at(c)
                } else {
                    at(d)
                }
            }
            Node::Oracle(oracle, _, p) => {
                let [x, y, z] = p.map(|o| [at(o)]);
                let mut value = [0.0];
                let queries = Queries { at: [&x, &y, &z], value: &mut value, gradient: None };
                graph.oracles()[oracle.index()].points(queries).unwrap();
                value[0]
            }
        };
        values.push(value);
    }
    values[root.index()]
}
