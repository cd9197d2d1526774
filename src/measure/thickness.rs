//! Whether walls of a true thickness are as thick as was asked, told by samples.
//!
//! Such a wall is {d < t/2}, d the distance to a surface {f = 0} as some iteration finds it. Where that
//! fails, solid is missing or in excess. Samples spread evenly over a box tell how much:
//!
//! * A sample outside of the wall is **missing** from it if the surface is nearer than half the thickness
//!   less a margin: a point of it is reached by more steps of Newton's method than the wall takes, or f
//!   changes its sign on the way to one of the points about the sample.
//! * A sample inside is in **excess** if neither finds a point of the surface within half the thickness and
//!   a margin, along lines in 28 directions.
//!
//! Where f jumps or has a pole, it changes its sign without a zero; such a place counts as a point of the
//! surface. What is missing is told too small rather than too large: a surface that is hardly nearer than
//! half the thickness may lie between the directions.

use crate::eval::interpret;
use crate::expr::{Graph, NodeId, derive};
use crate::geom::Aabb;
use crate::num::EVEN_STEPS;
use glam::DVec3;

/// Samples in the box: shares are right to a percent or so.
const SAMPLES: usize = 2048;

/// Steps of Newton's method, the first of them towards the surface, the others along it.
const STEPS: usize = 9;
const DESCENTS: usize = 3;

/// The longest step of a descent, in halves of the thickness.
const LONGEST: f64 = 0.5;

/// A point counts as one of the surface if it is off by less than this, in halves of the thickness.
const OFF: f64 = 1e-3;

/// Surfaces nearer than this are near, and those farther than that far, in halves of the thickness:
/// what lies between is accuracy, not failure.
const NEAR: f64 = 0.97;
const FAR: f64 = 1.1;

/// Shares below this, or fewer samples than that, are not worth a word.
const LEAST_SHARE: f64 = 0.01;
const LEAST_SAMPLES: usize = 8;

/// A wall of a true thickness.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// The field f of the surface, in the wall's own space.
    pub surface: NodeId,
    /// The wall's field, in its own space.
    pub field: NodeId,
    /// Half the thickness, in its own space.
    pub half_thickness: NodeId,
    /// An upper bound of the length of f's gradient; infinite if none is known.
    pub lipschitz: f64,
    /// Where a point of the box is in the wall's own space.
    pub place: [NodeId; 3],
}

/// How much of a wall is wrong, in volumes of the wall that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Thickness {
    /// What should be solid and is not, 0 to 1.
    pub missing: f64,
    /// What is solid and should not be.
    pub excess: f64,
}

impl Thickness {
    /// The worse of two walls.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        Self { missing: self.missing.max(other.missing), excess: self.excess.max(other.excess) }
    }
}

/// A sample, in the wall's own space.
struct Sample {
    at: DVec3,
    value: f64,
    slope: DVec3,
    half: f64,
    inside: bool,
    /// The distance to the nearest point of the surface that was found.
    distance: f64,
}

/// How much of the wall `asked` is wrong in `bounds`, for these values of the parameters.
///
/// `None` if too little is wrong to speak of, or values can't be had.
#[must_use]
pub fn thickness(
    graph: &mut Graph,
    asked: &Asked,
    parameters: &[f64],
    bounds: &Aabb,
) -> Option<Thickness> {
    let Asked { surface, field, half_thickness, lipschitz, place } = *asked;
    let [gx, gy, gz] = derive::gradient(graph, surface);
    let graph = &*graph;
    let step = DVec3::from_array(EVEN_STEPS);
    let anywhere: Vec<DVec3> =
        (0..SAMPLES).map(|i| bounds.lo + bounds.size() * (0.5 + step * i as f64).fract()).collect();
    let places = values(graph, place, parameters, &anywhere)?;
    let places: Vec<DVec3> = places.into_iter().map(DVec3::from_array).collect();
    let found = values(graph, [surface, gx, gy, gz, field, half_thickness], parameters, &places)?;
    let mut solid = 0_usize;
    let mut samples = Vec::new();
    for (&at, [value, x, y, z, wall, half]) in places.iter().zip(found) {
        if !(at.is_finite() && value.is_finite() && half > 0.0 && half.is_finite()) {
            continue;
        }
        let inside = wall < 0.0;
        solid += usize::from(inside);
        // The surface is too far away for the wall in any case.
        if inside || value.abs() <= lipschitz * half {
            let distance = if value == 0.0 { 0.0 } else { f64::INFINITY };
            let slope = DVec3::new(x, y, z);
            samples.push(Sample { at, value, slope, half, inside, distance });
        }
    }
    descend(graph, [surface, gx, gy, gz], parameters, &mut samples)?;
    let (inside, outside): (Vec<Sample>, Vec<Sample>) = samples.into_iter().partition(|s| s.inside);
    let doubtful: Vec<Sample> = inside.into_iter().filter(|s| s.distance > FAR * s.half).collect();
    let near = look_around(
        graph,
        surface,
        parameters,
        &doubtful,
        &[0.25, 0.5, 0.75, 1.0].map(|r| r * FAR),
    )?;
    let excess = near.iter().filter(|near| !**near).count();
    let (surely, doubtful): (Vec<Sample>, Vec<Sample>) =
        outside.into_iter().partition(|s| s.distance < NEAR * s.half);
    let near = look_around(graph, surface, parameters, &doubtful, &[0.5 * NEAR, NEAR])?;
    let missing = surely.len() + near.iter().filter(|near| **near).count();
    let whole = (solid + missing - excess).max(1) as f64;
    let share = |count: usize| {
        let share = count as f64 / whole;
        if count >= LEAST_SAMPLES && share >= LEAST_SHARE { share } else { 0.0 }
    };
    let found = Thickness { missing: share(missing), excess: share(excess) };
    (found.missing > 0.0 || found.excess > 0.0).then_some(found)
}

/// Points of the surface near `samples` by Newton's method, first down the gradient in short steps,
/// then towards the point that lies under the sample.
fn descend(
    graph: &Graph,
    outputs: [NodeId; 4],
    parameters: &[f64],
    samples: &mut [Sample],
) -> Option<()> {
    let mut points: Vec<DVec3> = samples.iter().map(|sample| sample.at).collect();
    let mut found: Vec<(f64, DVec3)> = samples.iter().map(|s| (s.value, s.slope)).collect();
    for step in 0..STEPS {
        for ((point, &(value, slope)), sample) in points.iter_mut().zip(&found).zip(&*samples) {
            if step < DESCENTS {
                let way = slope * (value / slope.length_squared());
                *point -= way.clamp_length_max(LONGEST * sample.half);
            } else {
                let ahead = value + slope.dot(sample.at - *point);
                *point = sample.at - slope * (ahead / slope.length_squared());
            }
        }
        found = values(graph, outputs, parameters, &points)?
            .into_iter()
            .map(|[value, x, y, z]| (value, DVec3::new(x, y, z)))
            .collect();
        for ((&point, (value, slope)), sample) in points.iter().zip(&found).zip(&mut *samples) {
            // False where any of them is NaN.
            if value.abs() <= OFF * sample.half * slope.length() {
                sample.distance = sample.distance.min(point.distance(sample.at));
            }
        }
    }
    Some(())
}

/// Whether the surface's field has another sign at one of the points about each of `samples`, at these
/// `radii` in halves of the thickness.
fn look_around(
    graph: &Graph,
    surface: NodeId,
    parameters: &[f64],
    samples: &[Sample],
    radii: &[f64],
) -> Option<Vec<bool>> {
    let cube = || [-1.0, 0.0, 1.0];
    let cube = cube()
        .into_iter()
        .flat_map(|x| cube().into_iter().flat_map(move |y| cube().map(|z| DVec3::new(x, y, z))));
    let around: Vec<DVec3> = cube.filter_map(DVec3::try_normalize).collect();
    let mut points = Vec::new();
    for sample in samples {
        let along = sample.slope.normalize_or_zero();
        for direction in around.iter().copied().chain([along, -along]) {
            points.extend(radii.iter().map(|r| sample.at + direction * (r * sample.half)));
        }
    }
    let found = values(graph, [surface], parameters, &points)?;
    let each = radii.len() * (around.len() + 2);
    let changes = |(sample, around): (&Sample, &[[f64; 1]])| {
        sample.value == 0.0 || around.iter().any(|[value]| value * sample.value.signum() <= 0.0)
    };
    Some(samples.iter().zip(found.chunks(each)).map(changes).collect())
}

/// The values of `outputs` at each of `points`.
fn values<const N: usize>(
    graph: &Graph,
    outputs: [NodeId; N],
    parameters: &[f64],
    points: &[DVec3],
) -> Option<Vec<[f64; N]>> {
    if points.is_empty() {
        return Some(Vec::new());
    }
    let at: [Vec<f64>; 3] = std::array::from_fn(|a| points.iter().map(|p| p[a]).collect());
    let mut values = vec![0.0; N * points.len()];
    let mut out: Vec<&mut [f64]> = values.chunks_exact_mut(points.len()).collect();
    interpret::points(graph, &outputs, [&at[0], &at[1], &at[2]], parameters, &mut out).ok()?;
    Some((0..points.len()).map(|i| std::array::from_fn(|k| out[k][i])).collect())
}
