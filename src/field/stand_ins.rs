//! Distances for who can't tell them from others, at a fraction of their cost.
//!
//! Answers of [`points_for`](crate::expr::Oracle::points_for) and
//! [`brick_beside`](crate::expr::Oracle::brick_beside) of a [`MeshDistance`]: exact values at some
//! points stand in for those around them as far as [`Ball`]s reach. What is in doubt is asked for
//! exactly.
//!
//! This takes sides told by pseudonormals at their word, as [`range`](crate::expr::Oracle::range)
//! does: that they change at faces only, unless the surface has holes.

use super::balls::{Ball, ROUNDING};
use super::blocks::{Block, cut, is_smallest};
use super::mesh_distance::{Found, Memory, MeshDistance, remote};
use super::search::MARKS;
use super::sign::Side;
use crate::expr::{Interest, Queries};
use glam::DVec3;
use pulp::{Simd, WithSimd};

/// Most samples of a block that is not cut further, and the middle of it.
const NEIGHBOURS: usize = 9;
/// Most levels of an [`Interest::Beside`]; with more, every value is exact.
const LEVELS: usize = 8;

/// How far it is worth the while to look into where the side is certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Effort {
    /// No farther than the nearest face tells.
    Little,
    /// As far as a winding number tells.
    Winding,
}

impl MeshDistance {
    /// The ball around `point`, where `found` is known.
    #[inline(always)]
    fn ball(&self, point: DVec3, found: &Found, effort: Effort) -> Ball {
        let Found { place, nearest, distance, side } = found;
        let (at, value) = (place.local, side.sign() * distance);
        if self.sides.is_continuous() {
            return Ball { at, value, radius: f64::INFINITY };
        }
        let holds = self.sides.holds(&self.faces, *place, (nearest, *distance), *side)
            || effort == Effort::Winding && self.is_common(found);
        // Outside of the bounds all is outside, whatever the side would be.
        let reach = match side {
            _ if !holds => -1.0,
            Side::Outside => *distance,
            Side::Inside => {
                let gap = (point - self.bounds.lo).min(self.bounds.hi - point).min_element();
                distance.min(gap * self.faces.tree.frame().scale)
            }
        };
        Ball { at, value, radius: reach - ROUNDING * (reach.abs() + 2.0) }
    }

    /// Whether the winding number says that all points nearer than the nearest face are on the side
    /// of the point itself.
    #[inline(never)]
    fn is_common(&self, found: &Found) -> bool {
        self.sides.common(&self.faces, found.place, found.distance) == Some(found.side)
    }
}

/// Points whose values may have stand-ins.
pub struct For<'f, 'q> {
    pub field: &'f MeshDistance,
    pub queries: Queries<'q>,
    pub interest: Interest<'q>,
    pub memory: Memory<'q>,
}

impl WithSimd for For<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { field, queries, interest, mut memory } = self;
        let Queries { at: [x, y, z], value, mut gradient } = queries;
        let frame = field.faces.tree.frame();
        // In the coordinates of the search, where balls are.
        let scaled: Vec<f64> = match interest {
            Interest::Beside(list) | Interest::From(list) | Interest::UpTo(list) => {
                list.iter().map(|level| level * frame.scale).collect()
            }
        };
        let interest = match interest {
            Interest::Beside(_) => Interest::Beside(&scaled),
            Interest::From(_) => Interest::From(&scaled),
            Interest::UpTo(_) => Interest::UpTo(&scaled),
        };
        let roots = gradient.is_some() && value.len() <= MARKS;
        for i in 0..value.len() {
            let point = DVec3::new(x[i], y[i], z[i]);
            let (result, slope) =
                match memory.search.balls.stand_in(frame.local(point), interest, i) {
                    Some(value) => (value / frame.scale, DVec3::ZERO),
                    None => {
                        let answer = match field.find(point, roots.then_some(i), &mut memory) {
                            Some(found) => {
                                let ball = field.ball(point, &found, Effort::Little);
                                memory.search.balls.add(ball, interest, i);
                                field.answer_of(&found)
                            }
                            None => remote(point, frame.middle),
                        };
                        (answer.value, answer.gradient)
                    }
                };
            value[i] = result;
            if let Some(rows) = &mut gradient {
                for (row, partial) in rows.iter_mut().zip(slope.to_array()) {
                    row[i] = partial;
                }
            }
        }
    }
}

/// A brick to be filled with values or stand-ins.
pub struct Beside<'f, 'q> {
    pub field: &'f MeshDistance,
    pub at: [&'q [f64]; 3],
    pub levels: &'q [f64],
    pub value: &'q mut [f64],
    pub memory: Memory<'q>,
}

impl WithSimd for Beside<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { field, at, levels, value, mut memory } = self;
        let frame = field.faces.tree.frame();
        let mut numbers = [f64::NAN; LEVELS];
        for (number, level) in numbers.iter_mut().zip(levels) {
            *number = level * frame.scale;
        }
        // Nothing is beside NaN.
        let levels = if levels.len() > LEVELS { &[f64::NAN] } else { &numbers[..levels.len()] };
        let [x, y, z] = at;
        let row = |j: usize, k: usize| (k * y.len() + j) * x.len();
        let mut stack: Vec<Block> = Vec::with_capacity(64);
        if at.iter().all(|at| !at.is_empty()) {
            stack.push(at.map(|at| 0..at.len()));
        }
        while let Some(block) = stack.pop() {
            let ends = |end: fn(&std::ops::Range<usize>) -> usize| {
                let [i, j, k] = block.each_ref().map(end);
                DVec3::new(x[i], y[j], z[k])
            };
            let corners = [ends(|range| range.start), ends(|range| range.end - 1)];
            let middle = 0.5 * corners[0] + 0.5 * corners[1];
            let small = is_smallest(&block);
            let mut balls = [Ball { at: DVec3::ZERO, value: 0.0, radius: -1.0 }; NEIGHBOURS];
            let mut known = 0;
            if let Some(found) = field.find(middle, None, &mut memory) {
                let effort = if small { Effort::Little } else { Effort::Winding };
                let ball = field.ball(middle, &found, effort);
                let [lo, hi] = corners.map(|corner| (frame.local(corner) - ball.at).abs());
                if ball.settles(lo.max(hi).length(), levels) {
                    let stand_in = field.answer_of(&found).value;
                    for k in block[2].clone() {
                        for j in block[1].clone() {
                            let [from, to] = [block[0].start, block[0].end].map(|i| row(j, k) + i);
                            value[from..to].fill(stand_in);
                        }
                    }
                    continue;
                }
                balls[0] = ball;
                known = 1;
            }
            if !small {
                cut(&block, &mut stack);
                continue;
            }
            for k in block[2].clone() {
                for j in block[1].clone() {
                    for i in block[0].clone() {
                        let point = DVec3::new(x[i], y[j], z[k]);
                        let local = frame.local(point);
                        let settled = balls[..known]
                            .iter()
                            .find(|ball| ball.settles(ball.at.distance(local), levels));
                        let target = &mut value[row(j, k) + i];
                        if let Some(ball) = settled {
                            *target = ball.value / frame.scale;
                            continue;
                        }
                        match field.find(point, None, &mut memory) {
                            Some(found) => {
                                balls[known] = field.ball(point, &found, Effort::Little);
                                known += 1;
                                *target = field.answer_of(&found).value;
                            }
                            None => *target = remote(point, frame.middle).value,
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh_distance::mesh_distance;
    use super::super::samples::{Uniform, both, cube, kinds, mapped, sphere};
    use super::*;
    use crate::expr::Oracle;
    use crate::mesh::Mesh;

    /// Meshes of every kind, with larger holes and without, of any size, anywhere.
    fn meshes() -> Vec<Mesh> {
        let mut meshes = kinds();
        let mut torn = sphere(4);
        let mut random = Uniform(43);
        torn.triangles.retain(|_| random.next() < 0.9);
        meshes.push(torn);
        let mut punched = sphere(4);
        punched.triangles.swap_remove(100);
        meshes.push(punched);
        meshes.push(both(&sphere(2), &mapped(&cube(), |p| 0.3 * p)));
        meshes.push(mapped(&sphere(3), |p| 1e-6 * p + DVec3::splat(3.0)));
        meshes.push(mapped(&cube(), |p| 1e12 * p));
        meshes
    }

    /// On which sides of `levels` a value lies.
    fn place(value: f64, levels: &[f64]) -> Vec<Option<std::cmp::Ordering>> {
        levels.iter().map(|level| value.partial_cmp(level)).collect()
    }

    /// Sizes of a mesh and its middle.
    fn extent(field: &MeshDistance) -> (DVec3, f64) {
        let bounds = field.bounds();
        (bounds.center(), bounds.size().max_element())
    }

    #[test]
    fn values_of_bricks_lie_beside_levels_where_the_exact_ones_do() {
        let mut random = Uniform(41);
        for (number, mesh) in meshes().iter().enumerate() {
            let field = mesh_distance(mesh, "any").unwrap();
            let (middle, size) = extent(&field);
            let mut stood_in = 0;
            for turn in 0..30 {
                let counts = [[16, 16, 16], [16, 16, 16], [17, 3, 5], [1, 1, 40]][turn % 4];
                let step = size * [0.05, 0.01, 0.002][turn % 3];
                let origin = middle + size * random.point(-0.6, 0.4);
                let sense = if turn % 5 == 0 { -1.0 } else { 1.0 };
                let axis = |a: usize| -> Vec<f64> {
                    (0..counts[a]).map(|i| origin[a] + sense * step * i as f64).collect()
                };
                let at = [axis(0), axis(1), axis(2)];
                let at = at.each_ref().map(|at| &at[..]);
                let mut exact = vec![0.0; counts.iter().product()];
                field.brick(at, &mut exact).unwrap();
                // Levels that are hit exactly, too.
                let hit = exact[exact.len() / 3];
                let t = 0.1 * size * random.next();
                for levels in [&[0.0][..], &[t, -t], &[hit], &[0.0, t, hit, -t], &[f64::NAN]] {
                    let mut values = vec![f64::NAN; exact.len()];
                    field.brick_beside(at, levels, &mut values).unwrap();
                    for (value, exact) in values.iter().zip(&exact) {
                        let name = format!("mesh {number}: {value:e} for {exact:e}");
                        assert_eq!(place(*value, levels), place(*exact, levels), "{name}");
                        stood_in += usize::from(value != exact);
                    }
                }
            }
            // Among scattered faces and holes few signs are certain.
            assert!(stood_in > 20_000 || [3, 5].contains(&number), "mesh {number}: {stood_in}");
        }
    }

    #[test]
    fn a_brick_through_the_surface_takes_few_exact_values() {
        let field = mesh_distance(&sphere(4), "sphere").unwrap();
        let line =
            |from: f64| -> Vec<f64> { (0..16).map(|i| from + 0.01 * f64::from(i)).collect() };
        let (x, y, z) = (line(0.5), line(0.5), line(0.62));
        let (mut exact, mut values) = (vec![0.0; 4096], vec![0.0; 4096]);
        field.brick([&x, &y, &z], &mut exact).unwrap();
        field.brick_beside([&x, &y, &z], &[0.0], &mut values).unwrap();
        let asked = values.iter().zip(&exact).filter(|(value, exact)| value == exact).count();
        assert!(exact.iter().any(|v| *v < 0.0) && exact.iter().any(|v| *v > 0.0));
        // The surface passes through some four hundred cells.
        assert!(asked < 900, "{asked}");
    }

    #[test]
    fn points_on_lines_are_passed_over_or_exact() {
        let mut random = Uniform(47);
        for (number, mesh) in meshes().iter().enumerate() {
            let field = mesh_distance(mesh, "any").unwrap();
            let (middle, size) = extent(&field);
            for turn in 0..40 {
                let (mut at, along) =
                    (middle + size * random.point(-0.6, 0.6), random.point(-1.0, 1.0));
                let step = along * size * [0.02, 0.002, 0.2][turn % 3];
                let points: Vec<DVec3> = (0..200)
                    .map(|i| {
                        at = if i % 16 == 0 {
                            middle + size * random.point(-0.6, 0.6)
                        } else {
                            at + step
                        };
                        at
                    })
                    .collect();
                let [x, y, z] =
                    [0, 1, 2].map(|a| points.iter().map(|p| p[a]).collect::<Vec<f64>>());
                let at = [&x[..], &y, &z];
                let (mut exact, mut gradients) = (vec![0.0; 200], [const { Vec::new() }; 3]);
                gradients.fill(vec![0.0; 200]);
                let gradient = Some(gradients.each_mut().map(|row| &mut row[..]));
                field.points(Queries { at, value: &mut exact, gradient }).unwrap();
                let levels = [0.0, 0.1 * size * random.next()];
                // Some of them are the very value.
                let mut bounds: Vec<f64> = (0..200).map(|_| size * (random.next() - 0.5)).collect();
                (0..200).step_by(7).for_each(|i| bounds[i] = exact[i]);
                for interest in
                    [Interest::Beside(&levels), Interest::From(&bounds), Interest::UpTo(&bounds)]
                {
                    let (mut value, mut rows) = (vec![f64::NAN; 200], [const { Vec::new() }; 3]);
                    rows.fill(vec![f64::NAN; 200]);
                    let gradient = Some(rows.each_mut().map(|row| &mut row[..]));
                    field
                        .points_for(Queries { at, value: &mut value, gradient }, interest)
                        .unwrap();
                    for i in 0..200 {
                        let name = format!("mesh {number}: {:e} for {:e}, {i}", value[i], exact[i]);
                        match interest {
                            Interest::Beside(levels) => {
                                assert_eq!(
                                    place(value[i], levels),
                                    place(exact[i], levels),
                                    "{name}"
                                );
                            }
                            Interest::From(least) if exact[i] < least[i] => {
                                assert!(value[i] < least[i], "{name}");
                            }
                            Interest::UpTo(most) if exact[i] > most[i] => {
                                assert!(value[i] > most[i], "{name}");
                            }
                            Interest::From(_) | Interest::UpTo(_) => {
                                assert_eq!(value[i].to_bits(), exact[i].to_bits(), "{name}");
                                for (row, exact) in rows.iter().zip(&gradients) {
                                    assert_eq!(row[i].to_bits(), exact[i].to_bits(), "{name}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn points_far_away_and_nowhere_are_answered_as_ever() {
        let field = mesh_distance(&cube(), "cube").unwrap();
        let x = [0.5, 1e300, f64::INFINITY, f64::NAN, 1e18, 0.5];
        let at = [&x[..], &[0.5; 6], &[0.5; 6]];
        let (mut exact, mut value) = ([0.0; 6], [0.0; 6]);
        field.points(Queries { at, value: &mut exact, gradient: None }).unwrap();
        let queries = Queries { at, value: &mut value, gradient: None };
        field.points_for(queries, Interest::Beside(&[0.0])).unwrap();
        for (value, exact) in value.iter().zip(exact) {
            assert_eq!(place(*value, &[0.0]), place(exact, &[0.0]));
            assert_eq!(value.is_nan(), exact.is_nan());
        }
    }
}
