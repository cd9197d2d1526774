//! The models that benches and records name, as program text.
#![allow(dead_code, reason = "each bench uses some of the models")]

use alveole::contour::Grid;
use alveole::eval::{Bound, Engine, Program};
use alveole::geom::Axis;
use alveole::job::{Job, Settings};
use alveole::mesh::Sink;
use std::hint::black_box;
use std::io;
use std::sync::LazyLock;

/// A program with a name.
#[derive(Clone, Copy)]
pub struct Model {
    /// What records call it.
    pub name: &'static str,
    /// The program.
    pub text: &'static str,
}

/// A level set that separates: every sine is of one axis.
pub const GYROID: Model = Model { name: "gyroid", text: "gyroid" };
/// The same turned about an axis of the grid: sines of two axes.
pub const GYROID_ABOUT_Z: Model = Model { name: "gyroid-about-z", text: "gyroid rotate 0.3 0,0,1" };
/// The same turned about any axis: sines of all three.
pub const GYROID_ABOUT_ANY: Model =
    Model { name: "gyroid-about-any", text: "gyroid rotate 0.7 1,2,3" };
/// Four products of cosines.
pub const NEOVIUS: Model = Model { name: "neovius", text: "neovius" };
/// The longest formula of the catalogue but a few.
pub const C_G: Model = Model { name: "c-g", text: "c-g" };
/// A union of twenty balls, of which a box touches few.
pub const SPHERES_20: Model = Model {
    name: "spheres-20",
    text: "sphere scale 0.3 translate -0.8,-0.7,-0.6 \
           sphere scale 0.2 translate 0.1,-0.7,-0.8 union \
           sphere scale 0.3 translate 0.8,-0.8,-0.5 union \
           sphere scale 0.2 translate -0.5,-0.1,-0.7 union \
           sphere scale 0.4 translate 0.4,0.1,-0.6 union \
           sphere scale 0.3 translate -0.8,0.7,-0.7 union \
           sphere scale 0.2 translate 0.2,0.8,-0.8 union \
           sphere scale 0.3 translate 0.8,0.7,-0.7 union \
           sphere scale 0.2 translate -0.7,-0.8,0.1 union \
           sphere scale 0.4 translate 0.1,-0.6,0.0 union \
           sphere scale 0.2 translate 0.8,-0.3,0.1 union \
           sphere scale 0.3 translate -0.7,0.1,0.0 union \
           sphere scale 0.2 translate 0.2,0.2,0.2 union \
           sphere scale 0.3 translate -0.3,0.8,0.1 union \
           sphere scale 0.3 translate 0.8,0.6,0.1 union \
           sphere scale 0.3 translate -0.6,-0.7,0.8 union \
           sphere scale 0.2 translate 0.5,-0.6,0.7 union \
           sphere scale 0.4 translate -0.5,0.2,0.8 union \
           sphere scale 0.3 translate 0.6,0.2,0.7 union \
           sphere scale 0.2 translate 0.1,0.8,0.8 union",
};
/// A gyroid whose cells shrink towards a corner: no sine separates.
pub const GYROID_GRADED: Model = Model {
    name: "gyroid-graded",
    text: "'sin(tau*x*(1+x*y*z/8))*cos(tau*y*(1+x*y*z/8)) \
          + sin(tau*y*(1+x*y*z/8))*cos(tau*z*(1+x*y*z/8)) \
          + sin(tau*z*(1+x*y*z/8))*cos(tau*x*(1+x*y*z/8))'",
};

/// A wave whose length changes along another axis.
pub const WAVE_GRADED_Z: Model = Model { name: "wave-graded-z", text: "'sin(2*pi*x*(1+0.2*z))'" };
/// A gyroid whose cells change along z: sines of two axes.
pub const GYROID_GRADED_Z: Model = Model {
    name: "gyroid-graded-z",
    text: "'sin(tau*x*(1+0.2*z))*cos(tau*y*(1+0.2*z)) \
          + sin(tau*y*(1+0.2*z))*cos(tau*z*(1+0.1*z)) \
          + sin(tau*z*(1+0.1*z))*cos(tau*x*(1+0.2*z))'",
};
/// The formula of the catalogue that costs most: six terms on all axes.
pub const P_C_P: Model = Model { name: "p-c-p", text: "p-c-p" };

/// Surfaces on three scales in a rounded box, as [`HIERARCHICAL`], in the cube [-1, 1]^3.
pub const HIERARCHICAL_UNIT: Model = Model {
    name: "hierarchical-unit",
    text: "'max(max(abs(x),abs(y)),abs(z)) - 4' sphere scale 5,5,5 p-surface scale 4,4,4 \
           d-surface scale 3.75,3.75,3.75 gyroid scale 1.25,1.25,1.25 intersection intersection intersection intersection \
           scale 0.25,0.25,0.25",
};

/// A union of ten thousand balls, some of which overlap.
pub fn spheres_10000() -> Model {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let balls = (0..10_000).map(|i| {
            let ([x, y, z], radius) = (scattered(i, 0.95), 0.015 + 0.03 * fraction(i, 3));
            let join = if i == 0 { "" } else { " union" };
            format!("sphere scale {radius} translate {x},{y},{z}{join}")
        });
        balls.collect::<Vec<_>>().join(" ")
    });
    Model { name: "spheres-10000", text: &TEXT }
}

/// A union of 2,500 things, each of four parts close to one another: (a or b) without c, or d.
pub fn csg_10000() -> Model {
    const KINDS: [&str; 4] = ["sphere", "torus", "capsule", "ellipsoid"];
    const JOINS: [&str; 4] = ["", "union ", "difference ", "union "];
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let mut text = String::new();
        for i in 0..10_000 {
            let (thing, part) = (i / 4, i % 4);
            let (kind, angle) = (KINDS[(i + thing) % 4], 6.0 * fraction(i, 4));
            let size = 0.02 + 0.03 * fraction(i, 3);
            let [x, y, z] = scattered(thing, 0.92);
            let [dx, dy, dz] = scattered(i, 0.03);
            let (x, y, z) = (x + dx, y + dy, z + dz);
            text += &format!("{kind} scale {size} rotate {angle} 1,2,3 translate {x},{y},{z} ");
            text += JOINS[part];
            text += if part == 3 && thing > 0 { "union " } else { "" };
        }
        text
    });
    Model { name: "csg-10000", text: &TEXT }
}

/// A sum of five hundred waves in all directions, as random spinodal foams are made.
pub fn terms_500() -> Model {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let waves = (0..500).map(|i| {
            let [x, y, z] = scattered(i, 12.0);
            let (size, phase) = (0.5 + fraction(i, 3), 6.0 * fraction(i, 4));
            format!("{size}*sin({x}*x + ({y})*y + ({z})*z + {phase})")
        });
        format!("'{}'", waves.collect::<Vec<_>>().join(" + "))
    });
    Model { name: "terms-500", text: &TEXT }
}

/// Point `i` of a sequence that fills the cube of half-side `half` evenly and in no order.
fn scattered(i: usize, half: f64) -> [f64; 3] {
    std::array::from_fn(|axis| ((2.0 * fraction(i, axis) - 1.0) * half * 1e6).round() / 1e6)
}

/// Number `i` of one of five such sequences in [0, 1), to six digits.
///
/// Additive recurrences of the powers of the root of x^6 = x + 1 (Roberts 2018, the R sequences).
fn fraction(i: usize, sequence: usize) -> f64 {
    const ROOT: f64 = 1.134_724_138_401_519_4;
    let ratio = ROOT.powi(-1 - sequence as i32);
    (((i + 1) as f64 * ratio).fract() * 1e6).floor() / 1e6
}

/// What is evaluated on the cube [-1, 1]^3.
pub const FIELDS: [Model; 10] = [
    GYROID,
    GYROID_ABOUT_Z,
    GYROID_ABOUT_ANY,
    NEOVIUS,
    C_G,
    P_C_P,
    SPHERES_20,
    WAVE_GRADED_Z,
    GYROID_GRADED_Z,
    GYROID_GRADED,
];

/// The main job: figure 1 of the Cesogen paper is one of these.
pub const GYROID_BOX: Model = Model { name: "gyroid-box", text: "gyroid box" };
/// A wall about the gyroid.
pub const GYROID_SHELL: Model = Model { name: "gyroid-shell", text: "gyroid shell 0.7 box" };
/// Surfaces on three scales in a rounded box: figure 5 of the Cesogen paper.
pub const HIERARCHICAL: Model = Model {
    name: "hierarchical",
    text: "box scale 4,4,4 sphere scale 5,5,5 p-surface scale 4,4,4 d-surface scale 3.75,3.75,3.75 \
           gyroid scale 1.25,1.25,1.25",
};

impl Model {
    /// Its job.
    pub fn job(self) -> Job {
        Job::parse(self.text).unwrap_or_else(|fault| panic!("{}: {fault}", self.name))
    }

    /// Its field, compiled.
    pub fn program(self, engine: Engine) -> Program {
        let job = self.job();
        let (graph, field) = job.field();
        Program::new(graph, field, engine).expect("the engine runs here")
    }

    /// Its field on the grid that `spacing` gives, with the grid.
    pub fn on_grid(self, spacing: f64) -> (Grid, Bound) {
        let grid = self.job().grid(&Settings::with_spacing(spacing)).expect("a grid of the model");
        let tables = Axis::ALL.map(|axis| grid.sampled(axis).to_vec());
        let bound = self.program(Engine::Automatic).bind(tables, &[]);
        (grid, bound)
    }
}

/// Takes every mesh and keeps nothing.
pub struct Nowhere;

impl Sink for Nowhere {
    fn begin(&mut self, _: u64, _: u64) -> io::Result<()> {
        Ok(())
    }

    fn vertices(&self, _: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        black_box(positions);
        Ok(())
    }

    fn triangles(&self, _: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        black_box(corners);
        Ok(())
    }
}

/// Runs `work` on one thread, which other work on the host disturbs least.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(work)
}
