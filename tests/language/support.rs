//! A loader without files, and a plain evaluator.

use alveole::cellular::struts::{Cell, Strut};
use alveole::expr::{Failure, Graph, Node, NodeId, Oracle, Queries};
use alveole::geom::Aabb;
use alveole::lang::{
    self, Diagnostic, Loaded, Loader, MakeShape, Program, Refusal, Rejected, Translation,
};
use alveole::num::Interval;
use alveole::solid::Span;
use alveole::vocabulary::{self, Words};
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

/// Knows a few texts, and meshes and lattices whose names begin with `mesh` and `lattice`.
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

    fn is_lattice(&self, word: &str) -> bool {
        word.ends_with(".cell")
    }

    fn lattice(&mut self, path: &str) -> Result<Arc<MakeShape>, Refusal> {
        if !path.starts_with("lattice") {
            return Err(Refusal { cause: "no such file".to_owned() });
        }
        let edge = Strut::between(DVec3::ZERO, DVec3::X);
        Ok(vocabulary::lattice(Cell::new(vec![edge], Vec::new())))
    }

    fn check_points(&self, text: &str) -> Result<(), Refusal> {
        let usage = || Refusal { cause: "write `[FILE.fap]`".to_owned() };
        if text.ends_with("fap") { Ok(()) } else { Err(usage()) }
    }

    fn points(&mut self, text: &str) -> Result<Arc<dyn Oracle>, Refusal> {
        if !text.starts_with("points") {
            return Err(Refusal { cause: "no such file".to_owned() });
        }
        Ok(Arc::new(Ball))
    }

    fn translation(
        &mut self,
        word: &str,
        span: Span,
    ) -> Option<Result<Translation, Box<Diagnostic>>> {
        let line = word.strip_prefix("other:")?;
        let fault = || Diagnostic::new("other tools know no such thing").at(span, "").cure("ask");
        Some(match line {
            "plain" => {
                Ok(Translation { name: "plain".to_owned(), text: "'x + 1'\nsphere @a".to_owned() })
            }
            "typo" => Ok(Translation { name: "typo".to_owned(), text: "shpere".to_owned() }),
            "open" => Ok(Translation { name: "open".to_owned(), text: "'x".to_owned() }),
            _ => Err(Box::new(fault())),
        })
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

/// A small generator of random numbers, programs and equations.
pub struct Random(u64);

impl Random {
    /// The generator that `seed` begins.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1)
    }

    /// A number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        // xorshift64*: Vigna, "An experimental exploration of Marsaglia's xorshift generators".
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % limit
    }

    /// A number from `lo` to `hi`.
    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.below(1 << 30) as f64 / f64::from(1 << 30)
    }

    /// A point of the cube of half width `half`.
    pub fn point(&mut self, half: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.between(-half, half)))
    }

    /// An equation with at most `size` operators, with or without coordinates.
    pub fn equation(&mut self, size: usize, coordinates: bool) -> String {
        if size == 0 {
            let known = ["x", "y", "z", "1", "0.25", "3e-2", "pi", "tau", "e", "t", "radius_2"];
            let from = if coordinates { 0 } else { 3 };
            return known[from + self.below(known.len() - from)].to_owned();
        }
        let left = self.below(size);
        let a = self.equation(left, coordinates);
        let b = self.equation(size - 1 - left, coordinates);
        match self.below(9) {
            0 => format!("({a})+({b})"),
            1 => format!("{a}-{b}"),
            2 => format!("({a})*{b}"),
            3 => format!("{a}/({b})"),
            4 => format!("({a})^({b})"),
            5 => format!("{a} ** -{b}"),
            6 => format!("-({a}+{b})"),
            7 => format!("sin({a})-cos(-{b})"),
            _ => format!("atan2({a}, hypot({b}, min(1, {a})))"),
        }
    }

    /// Words of a program.
    pub fn program(&mut self) -> Vec<String> {
        let shapes = ["box", "GYROID", "q*", "torus", "mesh1.ply", "split_p", "capsule"];
        let mut words = Vec::new();
        let mut depth = 0;
        for _ in 0..1 + self.below(8) {
            match self.below(4) {
                0 => {
                    let size = self.below(6);
                    words.push(format!("x+{}", self.equation(size, true)));
                    depth += 1;
                }
                1 => {
                    words.push(shapes[self.below(shapes.len())].to_owned());
                    if words.last().is_some_and(|word| word == "torus") && self.below(2) == 0 {
                        words.extend(["minor".to_owned(), "t / 2".to_owned()]);
                    }
                    depth += 1;
                }
                2 if depth >= 2 => {
                    let joins = ["union", "intersection", "Difference"];
                    words.push(joins[self.below(3)].to_owned());
                    depth -= 1;
                }
                3 if depth >= 1 => self.operation(&mut words),
                _ => {}
            }
        }
        words.push("box".to_owned());
        words
    }

    fn operation(&mut self, words: &mut Vec<String>) {
        // A square plus one is positive, whatever the equation's value, if it has one: keep to
        // operations that are defined for every finite number.
        let mut number = || format!("{:.3}", self.between(0.1, 2.0));
        let said = match (number(), number(), number()) {
            (a, b, c) if a < b => format!("translate {a},-{b},{c}*t"),
            (a, b, c) if b < c => format!("rotate axis {a},{b},-{c} angle {b}*pi"),
            (a, b, c) if a < c => format!("scale factor {a},{b},-{c}"),
            (a, ..) => format!("dilate -{a}"),
        };
        words.extend(said.split(' ').map(str::to_owned));
    }

    /// Words of a program whose solid is bounded and whose shapes are distances or bounds.
    pub fn bounded_program(&mut self) -> Vec<String> {
        let shapes =
            ["box", "sphere", "torus", "cone", "capsule", "ellipsoid", "octahedron", "rounded-box"];
        let mut words = vec![shapes[self.below(shapes.len())].to_owned()];
        for _ in 0..self.below(7) {
            let mut number = |lo: f64, hi: f64| format!("{:.3}", self.between(lo, hi));
            let (a, b, c) = (number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0));
            let (p, q, r) = (number(0.4, 1.4), number(0.4, 1.4), number(0.4, 1.4));
            let other = shapes[self.below(shapes.len())];
            let said = match self.below(9) {
                0 => format!("translate {a},{b},{c}"),
                1 => format!("scale {p},-{q},{r}"),
                2 => format!("rotate {a}*pi {p},{q},{c}"),
                3 => format!("dilate {p}/4"),
                4 => format!("erode {p}/8"),
                5 => format!("shell {p}/4"),
                6 => format!("{other} translate {a},{b},{c} union"),
                7 => format!("{other} translate {a},{b},{c} difference"),
                _ => format!(
                    "{other} scale 1.4 cylinder rotate {a}*pi {p},{b},{r} intersection intersection"
                ),
            };
            words.extend(said.split(' ').map(str::to_owned));
        }
        words
    }
}
