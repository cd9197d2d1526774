//! Spinodoids: solids like those that spinodal decomposition leaves, as sums of random waves.
//!
//! > f(x) = √(2/N) Σ cos(tau nᵢ . x + φᵢ), solid where f < level,
//!
//! with N unit vectors nᵢ and phases φᵢ from a seed. The wavelength is 1 and the variance of f is 1, so that at
//! level 0 half of space is solid, and a level of √2 erf⁻¹(2 ρ - 1) leaves about the share ρ.
//! Directions are spread evenly over cones about the axes: cones as wide as a right angle are all
//! directions, narrow ones about one axis make layers, about two columns. f is no distance.
//!
//! Source: Kumar et al. 2020, doi:10.1038/s41524-020-0341-6, equations 1 to 4. They have the cones' angles in degrees.

use crate::expr::{Graph, NodeId, Unary};
use crate::geom::Aabb;
use crate::num::{Random, elementary};
use crate::solid::Solid;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// The most waves.
pub const MOST_WAVES: usize = 1000;

/// How many random directions are tried before a cone is drawn from directly.
const TRIES: u64 = 1 << 12;

/// What a spinodoid is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spinodoid {
    /// Chooses directions and phases.
    pub seed: u64,
    /// The number of waves.
    pub waves: usize,
    /// Half the opening angles of the cones about x, y and z, in radians up to a right angle; zero
    /// for no cone.
    pub cones: [f64; 3],
}

impl Spinodoid {
    /// The solid where the sum of waves is negative: unbounded, without a period.
    #[must_use]
    pub fn solid(&self, graph: &mut Graph) -> Solid {
        let point = graph.point();
        let mut sum: Option<NodeId> = None;
        for number in 0..self.waves as u64 {
            let (direction, phase) = self.wave(number);
            let mut angle = graph.constant(phase);
            for (coordinate, component) in point.into_iter().zip(direction.to_array()) {
                let factor = graph.constant(TAU * component);
                let term = graph.mul(coordinate, factor);
                angle = graph.add(angle, term);
            }
            let wave = graph.unary(Unary::Cos, angle);
            sum = Some(sum.map_or(wave, |sum| graph.add(sum, wave)));
        }
        let sum = sum.unwrap_or_else(|| graph.constant(0.0));
        let count = self.waves.max(1) as f64;
        let scale = graph.constant((2.0 / count).sqrt());
        let field = graph.mul(sum, scale);
        Solid::within(graph, field, Aabb::WHOLE, TAU * (2.0 * count).sqrt())
    }

    /// The direction and the phase of a wave.
    fn wave(&self, number: u64) -> (DVec3, f64) {
        let [phase, choice] = Random::new(self.seed, 2).uniform(number);
        let directions = Random::new(self.seed, 3);
        let cosines = self.cones.map(elementary::cos);
        for attempt in 0..TRIES {
            let [u, v] = directions.uniform(number * TRIES + attempt);
            let d = on_sphere(2.0 * u - 1.0, v);
            let lies_in = |axis: usize| self.cones[axis] > 0.0 && d[axis].abs() >= cosines[axis];
            if (0..3).any(lies_in) || self.cones == [0.0; 3] {
                return (d, TAU * phase);
            }
        }
        // The cones are narrow and do not overlap: one of them, then a direction in it.
        let shares = cosines.map(|cosine| 1.0 - cosine);
        let mut place = choice * shares.iter().sum::<f64>();
        let mut axis = 0;
        while axis < 2 && place >= shares[axis] {
            place -= shares[axis];
            axis += 1;
        }
        let [u, v] = directions.uniform(number * TRIES);
        let d = on_sphere(1.0 - u * shares[axis], v);
        let mut turned = [0.0; 3];
        (turned[axis], turned[(axis + 1) % 3], turned[(axis + 2) % 3]) = (d.z, d.x, d.y);
        (DVec3::from_array(turned), TAU * phase)
    }
}

/// The widest cone: all directions.
pub const ALL_DIRECTIONS: f64 = FRAC_PI_2;

/// The unit vector of height z at the share `turn` of a turn.
fn on_sphere(z: f64, turn: f64) -> DVec3 {
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let angle = TAU * turn;
    DVec3::new(radius * elementary::cos(angle), radius * elementary::sin(angle), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spinodoid(cones: [f64; 3]) -> Spinodoid {
        Spinodoid { seed: 3, waves: 500, cones }
    }

    #[test]
    fn directions_lie_in_their_cones() {
        for cones in [[0.4, 0.0, 0.0], [0.0, 0.3, 0.2], [0.01, 0.0, 0.02], [FRAC_PI_2; 3]] {
            let solid = spinodoid(cones);
            for number in 0..200 {
                let (d, phase) = solid.wave(number);
                assert!((d.length() - 1.0).abs() < 1e-14 && (0.0..TAU).contains(&phase));
                let lies_in = |axis: usize| {
                    cones[axis] > 0.0 && d[axis].abs() >= elementary::cos(cones[axis]) - 1e-12
                };
                assert!((0..3).any(lies_in), "{d} in {cones:?}");
            }
        }
    }

    #[test]
    fn all_directions_are_as_likely() {
        let solid = spinodoid([FRAC_PI_2; 3]);
        let mut square = DVec3::ZERO;
        for number in 0..500 {
            let (d, _) = solid.wave(number);
            square += d * d / 500.0;
        }
        // The mean square of a component is 1/3, with a standard deviation of 0.013.
        assert!((square - 1.0 / 3.0).abs().max_element() < 0.05, "{square}");
    }

    #[test]
    fn the_variance_is_one() {
        use crate::num::EVEN_STEPS;
        use crate::solid::walk::value;
        let mut graph = Graph::new();
        let solid = Spinodoid { seed: 1, waves: 60, cones: [FRAC_PI_2; 3] }.solid(&mut graph);
        let at = |i: i32| EVEN_STEPS.map(|s| 40.0 * (s * f64::from(i)).fract());
        let squares: f64 =
            (1..4000).map(|i| value(&graph, solid.field, at(i)).powi(2)).sum::<f64>() / 3999.0;
        assert!((squares - 1.0).abs() < 0.1, "{squares}");
    }
}
