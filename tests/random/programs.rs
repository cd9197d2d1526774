//! Random program texts.

#![allow(dead_code, reason = "each test crate uses a part")]

use crate::common::sound_mesh;
use alveole::cellular::tpms::CATALOGUE;
use alveole::lang::names::Function;
use alveole::mesh::io::{self, Format, Precision};
use glam::DVec3;
use tempfile::TempDir;

/// Mesh files for programs: a closed one and an open one.
pub struct Folder {
    _folder: TempDir,
    paths: [String; 2],
}

impl Folder {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = sound_mesh("torus rotate 0.3 1,0,0", 0.2);
        let paths = ["closed.ply", "open.ply"].map(|name| {
            let path = folder.path().join(name);
            let mut bytes = Vec::new();
            io::write(&mesh, Format::Ply, Precision::Double, &mut bytes).unwrap();
            std::fs::write(&path, bytes).unwrap();
            mesh.triangles.drain(..9);
            path.to_str().unwrap().to_owned()
        });
        Self { _folder: folder, paths }
    }
}

/// A small generator of random numbers and programs.
pub struct Random {
    state: u64,
    /// Operations that programs are made of.
    operations: Operations,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Operations {
    /// Those of the Cesogen paper, with constant numbers.
    Classic,
    All,
}

impl Random {
    /// The generator that `seed` begins.
    pub fn new(seed: u64) -> Self {
        Self { state: seed, operations: Operations::All }
    }

    /// The generator whose programs have the operations of the Cesogen paper only.
    ///
    /// What a seed means must not change for those that once failed.
    pub fn classic(seed: u64) -> Self {
        Self { state: seed, operations: Operations::Classic }
    }

    /// A number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        // splitmix64: Steele, Lea & Flood 2014, doi:10.1145/2660193.2660195.
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ self.state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % limit as u64) as usize
    }

    /// A number from `lo` to `hi`.
    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.below(1 << 30) as f64 / f64::from(1 << 30)
    }

    /// A point of the cube of half width `half`.
    pub fn point(&mut self, half: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.between(-half, half)))
    }

    fn of<'a>(&mut self, list: &[&'a str]) -> &'a str {
        list[self.below(list.len())]
    }

    /// A positive number of order one, often a simple one.
    fn positive(&mut self) -> String {
        match self.below(4) {
            0 => self.of(&["1", "0.5", "2", "0.25", "1/3", "sqrt(2)", "1e-3", "7"]).to_owned(),
            _ => format!("{:.3}", self.between(0.05, 1.6)),
        }
    }

    /// A number of either sign, often a simple one.
    fn number(&mut self) -> String {
        match self.below(4) {
            0 => self.of(&["0", "-1", "0.5", "-0.25", "pi/2", "1e-9", "-1/3", "1"]).to_owned(),
            _ => format!("{:.3}", self.between(-1.5, 1.5)),
        }
    }

    fn vector(&mut self, component: fn(&mut Self) -> String) -> String {
        format!("{},{},{}", component(self), component(self), component(self))
    }

    /// An equation in x, y and z of about `size` operators and functions.
    fn equation(&mut self, size: usize) -> String {
        if size == 0 {
            let leaf = self.below(9);
            return match leaf {
                0..6 => ["x", "y", "z"][leaf % 3].to_owned(),
                6 => format!("{:.2}", self.between(0.0, 3.0)),
                _ => self
                    .of(&["0", "1", "2", "3", "0.5", "pi", "tau", "e", "1e-3", "10", "1e300"])
                    .to_owned(),
            };
        }
        let left = self.below(size);
        let a = self.equation(left);
        let b = self.equation(size - 1 - left);
        match self.below(12) {
            0..2 => format!("({a}+{b})"),
            2..4 => format!("({a}-{b})"),
            4..6 => format!("({a}*{b})"),
            6 => format!("({a}/{b})"),
            7 => format!("({a}^{b})"),
            8 => format!("(-{a})"),
            _ => {
                let functions: Vec<_> = Function::all().collect();
                let function = functions[self.below(functions.len())];
                let arguments = [a, b, self.equation(size / 4)];
                let (least, most) = function.arity();
                let count = least.max(self.below(3) + 1).min(most);
                format!("{}({})", function.name(), arguments[..count].join(","))
            }
        }
    }

    fn shape(&mut self, folder: &Folder) -> String {
        match self.below(10) {
            0..3 => {
                let size = 1 + self.below(12);
                // A coordinate first: an equation without one is a number.
                format!("{}+{}", ["x", "y", "z"][self.below(3)], self.equation(size))
            }
            3..5 => {
                let surface = CATALOGUE[self.below(CATALOGUE.len())].name;
                format!("{surface} scale {}", self.positive())
            }
            5 if self.below(4) == 0 => folder.paths[self.below(2)].clone(),
            _ => match self.below(if self.operations == Operations::Classic { 10 } else { 12 }) {
                0 => "sphere".to_owned(),
                1 => "cylinder".to_owned(),
                2 => "box".to_owned(),
                3 => format!("rounded-box radius {:.2}", self.between(0.0, 1.0)),
                4 => format!("torus major {} minor {}", self.positive(), self.positive()),
                5 => format!("cone radius {} height {}", self.positive(), self.positive()),
                6 => format!("capsule radius {} length {}", self.positive(), self.positive()),
                7 => {
                    let (normal, offset) = (self.vector(Self::positive), self.number());
                    format!("plane normal {normal} offset {offset}")
                }
                8 => format!("ellipsoid radii {}", self.vector(Self::positive)),
                10 | 11 => {
                    let cell = self.of(&["octet", "kelvin", "bcc", "simple-cubic", "fcc"]);
                    let (radius, fillet) = (self.between(0.01, 0.3), self.between(-0.2, 0.2));
                    format!("{cell} radius {radius:.3} fillet {:.3}", fillet.max(0.0))
                }
                _ => format!("octahedron radius {}", self.positive()),
            },
        }
    }

    /// `number`, or an equation about it.
    fn varying(&mut self, number: String) -> String {
        if self.operations == Operations::Classic {
            return number;
        }
        let axis = ["x", "y", "z"][self.below(3)];
        match self.below(12) {
            0 => format!("{number}+{:.2}*{axis}", self.between(-0.4, 0.4)),
            1 => format!("{number}+{:.2}*sin({axis})", self.between(-0.4, 0.4)),
            2 => format!("{number}*(1.2+sin({axis}))"),
            3 => {
                let size = 1 + self.below(4);
                format!("{number}+{axis}*{}", self.equation(size))
            }
            _ => number,
        }
    }

    fn varying_number(&mut self) -> String {
        let number = self.number();
        self.varying(number)
    }

    fn varying_size(&mut self) -> String {
        let number = self.positive();
        self.varying(number)
    }

    fn operation(&mut self) -> String {
        let kinds = if self.operations == Operations::Classic { 8 } else { 14 };
        match self.below(kinds) {
            0 => "complement".to_owned(),
            1 => format!("dilate {}", self.varying_number()),
            2 => format!("erode {}", self.varying_number()),
            3 => format!("shell {}", self.varying_size()),
            4 => format!("translate {}", self.vector(Self::varying_number)),
            5 => format!("scale {}", self.vector(Self::varying_size)),
            6 => {
                let [a, b, c] = [(); 3].map(|()| self.positive());
                format!("scale {a},-{b},{c}")
            }
            8 => format!("thickness {}", self.varying_size()),
            9 => format!("thickness {} method gradient", self.varying_size()),
            10 => {
                let axis = ["x", "y", "z"][self.below(3)];
                format!("stretch {axis} {}", self.varying_size())
            }
            11 => format!("cylindrical {} radius {}", 1 + self.below(9), self.positive()),
            12 => {
                let (around, along) = (1 + self.below(9), 1 + self.below(5));
                format!("spherical {around} {along} radius {}", self.positive())
            }
            13 => {
                let [u, v, w] = [(); 3].map(|()| 1 + self.below(3)).map(|size| self.equation(size));
                format!("conform x+{u},y+{v},z+{w}")
            }
            _ => format!("rotate {} {}", self.varying_number(), self.vector(Self::positive)),
        }
    }

    fn combination(&mut self) -> String {
        let sets = ["union", "intersection", "difference"];
        if self.operations == Operations::Classic {
            return self.of(&sets).to_owned();
        }
        match self.below(9) {
            0..4 => self.of(&sets).to_owned(),
            8 => {
                let (size, wall) = (self.positive(), self.positive());
                let skin = ["", " skin 0.1"][self.below(2)];
                let trim = ["", " trim cells"][self.below(2)];
                format!("fill size {size} thickness {wall}{skin}{trim}")
            }
            4 => format!("rounded-union {}", self.varying_size()),
            5 => format!("rounded-intersection {}", self.varying_size()),
            6 => format!("rounded-difference {}", self.varying_size()),
            _ => {
                let ramp = ["weight", "linear", "sigmoid"][self.below(3)];
                let (weight, width) = (self.varying_number(), self.varying_size());
                format!("blend {weight} ramp {ramp} width {width} correction {}", self.number())
            }
        }
    }

    /// Words of a program.
    pub fn program(&mut self, folder: &Folder) -> Vec<String> {
        let mut words = Vec::new();
        let mut depth = 0;
        let mut say = |text: &str| words.extend(text.split(' ').map(str::to_owned));
        for _ in 0..1 + self.below(9) {
            match self.below(5) {
                0 if depth >= 2 => {
                    say(&self.combination());
                    depth -= 1;
                }
                1 | 2 if depth >= 1 => say(&self.operation()),
                _ => {
                    say(&self.shape(folder));
                    depth += 1;
                }
            }
        }
        // Most programs end as bounded solids.
        if self.below(8) > 0 {
            say(&format!("box scale {}", self.vector(Self::positive)));
            if self.below(2) == 0 {
                say(&format!("translate {}", self.vector(Self::number)));
            }
        }
        words
    }
}
