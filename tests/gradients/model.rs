//! Solids with parameters, and what it takes to evaluate and to derive them.

#![allow(dead_code, reason = "each test crate uses a part")]

use alveole::cellular::tpms;
use alveole::contour::Grid;
use alveole::eval::Program;
use alveole::eval::rates::{BoundRates, Rates};
use alveole::expr::{Graph, Node, NodeId, ParameterId};
use alveole::geom::Aabb;
use alveole::measure::GridMotion;
use alveole::solid::Solid;
use glam::DVec3;

/// A solid with parameters, and how it is contoured.
pub struct Model {
    pub graph: Graph,
    pub solid: Solid,
    pub ids: Vec<ParameterId>,
    pub values: Vec<f64>,
    /// A box that does not move, or that of the solid.
    pub bounds: Option<Aabb>,
    pub spacing: f64,
}

impl Model {
    pub fn new(
        values: &[f64],
        bounds: Option<f64>,
        spacing: f64,
        build: impl FnOnce(&mut Graph, &[NodeId]) -> Solid,
    ) -> Self {
        let mut graph = Graph::new();
        let names = ["a", "b", "c", "d"];
        let nodes: Vec<NodeId> =
            names.iter().zip(values).map(|(name, v)| graph.parameter(name, *v)).collect();
        let ids = nodes.iter().map(|id| {
            let Node::Parameter(id) = graph.node(*id) else { panic!("no parameter") };
            id
        });
        let ids = ids.collect();
        let solid = build(&mut graph, &nodes);
        let bounds = bounds.map(|half| Aabb::new(DVec3::splat(-half), DVec3::splat(half)));
        Self { graph, solid, ids, values: values.to_vec(), bounds, spacing }
    }

    pub fn grid(&self, values: &[f64]) -> Grid {
        let bounds =
            self.bounds.unwrap_or_else(|| self.solid.finite_bounds(&self.graph, values).unwrap());
        Grid::new(bounds, DVec3::splat(self.spacing)).unwrap()
    }

    /// How the grid moves with each parameter.
    pub fn motions(&self) -> Vec<GridMotion> {
        let motion = |id: &ParameterId| match self.bounds {
            Some(_) => GridMotion::default(),
            None => {
                let [lo, hi] = self.solid.bounds_slope(&self.graph, &self.values, *id);
                GridMotion { lo, hi, spacing: [0.0; 3] }
            }
        };
        self.ids.iter().map(motion).collect()
    }

    /// The derivatives of `program`, bound.
    pub fn rates(&self, program: &Program) -> BoundRates {
        let rates = Rates::new(program, &self.ids, alveole::eval::Engine::Interpreter);
        rates.unwrap().bind(&self.grid(&self.values).tables(), &self.values)
    }
}

/// The periodic surface of that name.
pub fn surface(graph: &mut Graph, name: &str) -> Solid {
    tpms::CATALOGUE.iter().find(|known| known.name == name).unwrap().solid(graph)
}

/// A small deterministic generator: splitmix64.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// A number between `lo` and `hi`.
    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}
