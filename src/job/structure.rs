//! How thick walls are, how wide pores, what hangs together and what overhangs: a solid's structure.
//!
//! **Local thickness.** The ball that touches the surface from inside at a point p and is as large as fits
//! is the point's inscribed ball; its diameter is the thickness of the wall there. From outside it is the
//! width of the pore. The centre is p - r n, n being the outward normal; from a large r, the closest
//! point q of the surface to the centre gives the ball through p and q,
//!
//! > r' = |p - q|² / (2 n · (p - q)),
//!
//! until no point is closer than p. The distance to the mesh is exact, but its facets are not the solid: a
//! q within [`NEAR`] grid spacings of p is p's own neighbourhood, and the ball stays as it is. That also
//! keeps balls at creases from shrinking to nothing. Points are vertices of the mesh, evenly
//! numbered, weighted by the area around them. Those on the box that was contoured are left out, and balls that
//! reach a plane of it in which the solid is cut: there a lattice goes on.
//!
//! **What is no pore.** From the outer skin of a body balls would grow without end. Those from outside whose
//! centre is out of the body's convex hull (`Hull`) are no pores. A ball has none, a torus its hole, and a plate
//! the holes through it, also those that are wider than the plate is thick: a ball need not be in the hull as a whole.
//! Balls between the rims of pores that open to the outside may be larger than those within: for a gyroid's
//! walls 0.05 thick, whose pores are 0.17 wide, in a ball of radius 1 the mean is 0.6 % above that in a box, the maximum
//! a fifth. By centres in the box that was contoured, in place of the hull, it would be five times as large.
//!
//! **Error.** That of the mesh, of second order in the spacing, for walls of more than two spacings; but at a
//! crease that opens, as in the corners of a box, balls within [`NEAR`] spacings of it are not
//! told from smaller ones, so that least values there are of the order of the spacing.
//! Means, minima and maxima are those of the sample, of [`SAMPLES`] points at most. The mean has the
//! standard error that is told with it, by the formula for points drawn at random; evenly
//! numbered ones do no worse. Of n points, a value that less than 1 / n of the area is below or above may be missed
//! by the minimum or the maximum.
//!
//! What hangs together is told by [`phases`](mod@crate::measure::phases), what overhangs by
//! [`overhang`](mod@crate::measure::overhang).
//!
//! Source: Hildebrand & Rüegsegger 1997, doi:10.1046/j.1365-2818.1997.1340694.x, for local thickness; Ma,
//! Bae & Choi 2012, doi:10.1007/s00371-011-0594-7, for shrinking balls.

use super::{Error, Job, Measures, Report, Settings};
use crate::contour;
use crate::eval::interpret;
use crate::expr::{Failure, Oracle, Queries, derive};
use crate::field::mesh_distance::{MeshDistance, mesh_distance};
use crate::measure::overhang::Overhanging;
use crate::measure::{Overhang, Phase, Phases};
use crate::mesh::Mesh;
use crate::num::Progress;
use glam::DVec3;
use rayon::prelude::*;

/// Most points at which balls are inscribed.
pub const SAMPLES: usize = 20_000;

/// Grid spacings within which surface belongs to the point that a ball touches. Facets reach that
/// far, and the other side of a wall that the grid resolves is farther.
pub const NEAR: f64 = 1.75;

/// Radii within which a ball touches the box.
const BEYOND: f64 = 1.01;

/// Cosine of the angle by which the field's gradient and the mesh's normal may differ.
const LEAST_AGREEMENT: f64 = 0.7;

/// Rounds of shrinking; each takes at least a millionth, most a half.
const MOST_ROUNDS: usize = 60;

/// Facets with sides up to √3 h on a surface of radius r lie within 3 h² / 8r of it: balls that reach no
/// farther beyond the mesh touch it; a little more leaves room for uneven surfaces.
const SAGITTA: f64 = 0.5;

/// How a quantity spreads over the surface, by area.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// The least.
    pub minimum: f64,
    /// What a twentieth of the surface is below.
    pub fifth_percentile: f64,
    /// The mean.
    pub mean: f64,
    /// The standard error of the mean, as if the points had been drawn at random.
    pub mean_error: f64,
    /// The greatest.
    pub maximum: f64,
}

/// The structure of a solid, lengths in model units.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Structure {
    /// Diameters of the balls inscribed in the solid, off the box; `None` if there are none.
    pub wall_thickness: Option<Spread>,
    /// Diameters of the balls inscribed in the void, off the box, with their centres in the solid's convex
    /// hull; `None` if there are none.
    pub pore_size: Option<Spread>,
    /// Points at which balls were inscribed.
    pub samples: usize,
    /// Area over volume.
    pub specific_surface: f64,
    /// Area of faces that overhang, in squared model units.
    pub overhang_area: f64,
    /// The angle from straight down within which a face overhangs, in degrees.
    pub overhang_angle_deg: f64,
    /// The direction in which the part is built.
    pub up: [f64; 3],
    /// Handles of the solid: holes through it that a thread could be passed through.
    pub handles: i64,
    /// What hangs together in the solid.
    pub solid: Phase,
    /// What hangs together in the rest of the box.
    pub void: Phase,
}

impl Job {
    /// The numbers of the solid's mesh, as [`measure`](Self::measure) has them, and its structure;
    /// `overhang` says which faces overhang.
    ///
    /// # Errors
    /// Any [`Error`] but [`Error::Program`].
    pub fn structure(
        &self,
        settings: &Settings,
        overhang: &Overhang,
        progress: &Progress,
    ) -> Result<(Measures, Structure), Error> {
        let (mesh, measures) = self.measured(settings, progress)?;
        let grid = self.grid(settings)?;
        let (values, _) = self.solved(&grid, settings, progress)?;
        let phases = self.phases(&grid, values.clone(), settings, progress)?;
        let mut points = points(&mesh, measures.report.bounds);
        let failed = |failure| Error::Contour(contour::Error::Failure(failure));
        self.turn(&mut points, &values).map_err(failed)?;
        let [wall_thickness, pore_size] = sizes(&mesh, &points, &measures).map_err(failed)?;
        let Phases { solid, void } = phases;
        let structure = Structure {
            wall_thickness,
            pore_size,
            samples: points.len(),
            specific_surface: measures.mesh.area / measures.mesh.volume,
            overhang_area: overhanging(&mesh, overhang, grid.extent()),
            overhang_angle_deg: overhang.angle_deg,
            up: overhang.up.to_array(),
            handles: phases.handles(measures.check.euler),
            solid,
            void,
        };
        Ok((measures, structure))
    }

    /// Gives `points` the directions of the field's gradient, where it has one: those of a mesh are
    /// off by a part of the spacing over the radius of curvature, and balls with them.
    fn turn(&self, points: &mut [Point], values: &[f64]) -> Result<(), Failure> {
        let mut graph = self.graph.clone();
        let gradient = derive::gradient(&mut graph, self.solid.field);
        let at: [Vec<f64>; 3] =
            [0, 1, 2].map(|axis| points.iter().map(|point| point.position[axis]).collect());
        let mut slopes = [(); 3].map(|()| vec![0.0; points.len()]);
        let mut out = slopes.each_mut().map(Vec::as_mut_slice);
        let at = at.each_ref().map(Vec::as_slice);
        interpret::points(&graph, &gradient, at, values, &mut out)?;
        for (i, point) in points.iter_mut().enumerate() {
            let direction =
                DVec3::new(slopes[0][i], slopes[1][i], slopes[2][i]).normalize_or_zero();
            // At a crease the gradient is that of one side, which the mesh's normal is not far from.
            if direction.dot(point.normal) > LEAST_AGREEMENT {
                point.normal = direction;
            }
        }
        Ok(())
    }
}

/// Thickness of walls and size of pores at `points`.
fn sizes(
    mesh: &Mesh,
    points: &[Point],
    measures: &Measures,
) -> Result<[Option<Spread>; 2], Failure> {
    let oracle = "the distance to the mesh";
    let distance = mesh_distance(mesh, oracle)
        .map_err(|cause| Failure { oracle: oracle.to_owned(), cause: cause.to_string() })?;
    let lo = DVec3::from_array(measures.mesh.lo);
    let size = (DVec3::from_array(measures.mesh.hi) - lo).length();
    let Report { cells, bounds: [from, to], .. } = &measures.report;
    let spacing = (0..3).map(|a| (to[a] - from[a]) / cells[a] as f64).fold(0.0, f64::max);
    let cut = cuts(mesh, [*from, *to], spacing);
    let hull = Hull::of(mesh);
    let balls = |side: f64| -> Result<Option<Spread>, Failure> {
        let limits = Limits { largest: size, spacing };
        let inscribed = |point: &Point| inscribed(&distance, point, side, limits);
        let radii = points.par_iter().map(inscribed).collect::<Result<Vec<_>, _>>()?;
        let is_within = |radius: f64, point: &Point| {
            let (centre, reach) = (point.position + radius * side * point.normal, radius * BEYOND);
            let is_in_the_open = side > 0.0 && !hull.has(centre);
            let is_cut = (0..3).any(|a| {
                let [lower, upper] = cut[a];
                lower && centre[a] - reach <= from[a] || upper && centre[a] + reach >= to[a]
            });
            !(is_in_the_open || is_cut)
        };
        let balls = radii.into_iter().zip(points).filter(|(r, point)| is_within(*r, point));
        Ok(spread(balls.map(|(r, point)| (2.0 * r, point.area)).collect()))
    };
    Ok([balls(-1.0)?, balls(1.0)?])
}

/// A vertex, the unit normal there and the area around it.
struct Point {
    position: DVec3,
    normal: DVec3,
    area: f64,
}

/// Evenly numbered vertices off the planes of the box.
fn points(mesh: &Mesh, [lo, hi]: [[f64; 3]; 2]) -> Vec<Point> {
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    let mut areas = vec![0.0; mesh.positions.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|v| DVec3::from_array(mesh.positions[v as usize]));
        let double = (b - a).cross(c - a);
        for corner in corners {
            normals[*corner as usize] += double;
            areas[*corner as usize] += double.length() / 6.0;
        }
    }
    let is_off = |p: &[f64; 3]| (0..3).all(|axis| p[axis] > lo[axis] && p[axis] < hi[axis]);
    let off: Vec<usize> =
        (0..mesh.positions.len()).filter(|&v| is_off(&mesh.positions[v])).collect();
    let stride = off.len().div_ceil(SAMPLES).max(1);
    off.into_iter()
        .step_by(stride)
        .map(|v| Point {
            position: DVec3::from_array(mesh.positions[v]),
            normal: normals[v].normalize_or_zero(),
            area: areas[v],
        })
        .filter(|point| point.normal != DVec3::ZERO)
        .collect()
}

/// In which planes of the box, the lower and the upper of each axis, the solid ends flat: in more than
/// a few cells of size `spacing`, which a body has that only touches the plane.
fn cuts(mesh: &Mesh, ends: [[f64; 3]; 2], spacing: f64) -> [[bool; 2]; 3] {
    let mut areas = [[0.0; 2]; 3];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        for (axis, planes) in areas.iter_mut().enumerate() {
            for (area, end) in planes.iter_mut().zip(ends) {
                if [a, b, c].iter().all(|corner| corner[axis] == end[axis]) {
                    let [a, b, c] = [a, b, c].map(DVec3::from_array);
                    *area += 0.5 * (b - a).cross(c - a).length();
                }
            }
        }
    }
    areas.map(|planes| planes.map(|area| area > 8.0 * spacing * spacing))
}

/// What the planes around a mesh enclose, each touching it, across [`Hull::directions`]: its convex hull, and up to
/// a thirtieth of a ball's radius more.
struct Hull {
    /// Directions, and how far the mesh reaches along them in units of their length.
    planes: Vec<(DVec3, f64)>,
}

impl Hull {
    /// From the middle of a cube of 6³ cells to the corners of cells on its sides: 218, those along axes and
    /// diagonals among them, less than 27 degrees apart.
    fn directions() -> impl Iterator<Item = DVec3> {
        const HALF: i32 = 3;
        let along = || -HALF..=HALF;
        let all = along().flat_map(move |x| along().map(move |y| (x, y)));
        let all = all.flat_map(move |(x, y)| along().map(move |z| [x, y, z]));
        let on_side = all.filter(|at| at.iter().any(|c| c.abs() == HALF));
        on_side.map(|at| DVec3::from_array(at.map(f64::from)))
    }

    fn of(mesh: &Mesh) -> Self {
        let reach = |direction: DVec3| {
            let along = mesh.positions.iter().map(|at| direction.dot(DVec3::from_array(*at)));
            (direction, along.fold(f64::NEG_INFINITY, f64::max))
        };
        let directions: Vec<_> = Self::directions().collect();
        Self { planes: directions.into_par_iter().map(reach).collect() }
    }

    fn has(&self, at: DVec3) -> bool {
        self.planes.iter().all(|(direction, reach)| direction.dot(at) <= *reach)
    }
}

/// Lengths that bound a ball.
#[derive(Clone, Copy)]
struct Limits {
    /// The largest radius.
    largest: f64,
    /// The grid's spacing.
    spacing: f64,
}

/// The radius of the ball that touches at `point` from the side to which `side` times the normal
/// points.
fn inscribed(
    distance: &MeshDistance,
    point: &Point,
    side: f64,
    limits: Limits,
) -> Result<f64, Failure> {
    let normal = side * point.normal;
    let mut radius = limits.largest;
    for _ in 0..MOST_ROUNDS {
        let centre = point.position + radius * normal;
        let (gap, closest) = closest(distance, centre)?;
        if radius - gap <= SAGITTA * limits.spacing * limits.spacing / radius {
            break;
        }
        let chord = closest - point.position;
        if chord.length() < NEAR * limits.spacing {
            break;
        }
        let smaller = chord.length_squared() / (2.0 * normal.dot(chord));
        if !(smaller > 0.0 && smaller < radius) {
            break;
        }
        radius = smaller;
    }
    Ok(radius)
}

/// The distance from `at` to the mesh, and the closest point.
fn closest(distance: &MeshDistance, at: DVec3) -> Result<(f64, DVec3), Failure> {
    let coordinates = at.to_array().map(|value| [value]);
    let (mut value, mut gradient) = ([0.0], [[0.0]; 3]);
    let [x, y, z] = &mut gradient;
    distance.points(Queries {
        at: coordinates.each_ref().map(|c| &c[..]),
        value: &mut value,
        gradient: Some([x, y, z]),
    })?;
    let away = DVec3::new(gradient[0][0], gradient[1][0], gradient[2][0]);
    Ok((value[0].abs(), at - value[0] * away))
}

/// The spread of values with their weights; `None` if there are none.
fn spread(mut values: Vec<(f64, f64)>) -> Option<Spread> {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (minimum, maximum) = (values.first()?.0, values.last()?.0);
    let whole: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mean = values.iter().map(|(value, weight)| value * weight).sum::<f64>() / whole;
    let parts = values.iter().map(|(value, weight)| weight * (value - mean));
    let squares = parts.map(|part| part * part);
    let mean_error = squares.sum::<f64>().sqrt() / whole;
    let mut below = 0.0;
    let twentieth = values.iter().find(|(_, weight)| {
        below += weight;
        below >= 0.05 * whole
    });
    let fifth_percentile = twentieth.map_or(maximum, |(value, _)| *value);
    Some(Spread { minimum, fifth_percentile, mean, mean_error, maximum })
}

/// The area of what overhangs, of a mesh whose coordinates are `extent` in magnitude at most.
fn overhanging(mesh: &Mesh, overhang: &Overhang, extent: f64) -> f64 {
    let mut sum = Overhanging::new(overhang, extent);
    for corners in &mesh.triangles {
        sum.include(corners.map(|v| DVec3::from_array(mesh.positions[v as usize])));
    }
    sum.area()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn check(program: &str, spacing: f64) -> Structure {
        let job = Job::parse(program).unwrap();
        let settings = Settings::with_spacing(spacing);
        job.structure(&settings, &Overhang::default(), &Progress::new()).unwrap().1
    }

    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!((found / expected - 1.0).abs() < tolerance, "{found}, not {expected}");
    }

    #[test]
    fn a_ball_is_as_thick_as_its_diameter() {
        let found = check("sphere box scale 1.5", 0.05);
        let wall = found.wall_thickness.unwrap();
        near(wall.mean, 2.0, 0.01);
        near(wall.minimum, 2.0, 0.03);
        near(found.specific_surface, 3.0, 0.01);
        // The cap within 45 degrees of straight down: 2 pi (1 - cos 45°).
        near(found.overhang_area, TAU * (1.0 - 0.5_f64.sqrt()), 0.02);
    }

    #[test]
    fn a_hollow_ball_has_its_wall_and_its_hollow() {
        let found = check("sphere shell 0.2 box scale 1.5", 0.04);
        let wall = found.wall_thickness.unwrap();
        near(wall.mean, 0.2, 0.01);
        near(wall.maximum, 0.2, 0.05);
        // From the inner surface the void is the hollow of radius 0.9; from the outer one there is none.
        let pore = found.pore_size.unwrap();
        near(pore.minimum, 1.8, 0.02);
        near(pore.maximum, 1.8, 0.02);
    }

    #[test]
    fn parallel_walls_have_one_thickness_and_one_gap() {
        // Two slabs, 0.3 thick and 0.5 apart, in a box that they reach through on four sides.
        let program = "'abs(abs(z)-0.4)-0.15' box scale 2,2,0.8";
        let found = check(program, 0.04);
        let (wall, gap) = (found.wall_thickness.unwrap(), found.pore_size.unwrap());
        for value in [wall.minimum, wall.mean, wall.maximum] {
            near(value, 0.3, 1e-9);
        }
        // Balls between the slabs; there are none above and below them.
        near(gap.minimum, 0.5, 1e-9);
        near(gap.maximum, 0.5, 1e-9);
        assert!(wall.mean_error < 1e-9, "{wall:?}");
        assert_eq!((found.solid.components, found.void.components), (2, 3));
        assert_eq!(found.solid.percolates, [true, true, false]);
        assert_eq!((found.handles, found.void.enclosed), (0, 0));
    }

    #[test]
    fn what_is_around_a_body_is_no_pore() {
        assert_eq!(check("sphere", 0.1).pore_size, None);
        assert_eq!(check("'abs(x)+abs(y)+abs(z)-1' box", 0.1).pore_size, None);
        // Nor with room around it, however much.
        let job = Job::parse("sphere").unwrap();
        let bounds = Some(crate::geom::Aabb::new(DVec3::splat(-9.0), DVec3::splat(9.0)));
        let settings = Settings { bounds, ..Settings::with_spacing(0.25) };
        let structure = job.structure(&settings, &Overhang::default(), &Progress::new());
        assert_eq!(structure.unwrap().1.pore_size, None);
    }

    #[test]
    fn a_hole_is_a_pore_also_where_it_is_wider_than_the_body_is_thick() {
        // The ball that touches the torus at an angle a from its inmost circle has its centre on the axis at
        // height R tan a, and the radius R / cos a - r; the centre is in the hull for R tan a < r.
        let pore = check("torus", 0.04).pore_size.unwrap();
        let (ring, tube) = (0.75_f64, 0.25_f64);
        near(pore.minimum, 2.0 * (ring - tube), 0.01);
        near(pore.maximum, 2.0 * (ring.hypot(tube) - tube), 0.01);
        // A hole in a plate, with room above and below so that it is not cut.
        let job = Job::parse("box scale 1,1,0.1 'x^2+y^2-0.25' difference").unwrap();
        let bounds = Some(crate::geom::Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1)));
        let settings = Settings { bounds, ..Settings::with_spacing(0.04) };
        let structure = job.structure(&settings, &Overhang::default(), &Progress::new());
        let pore = structure.unwrap().1.pore_size.unwrap();
        near(pore.mean, 1.0, 0.02);
    }

    #[test]
    fn a_lattice_in_a_ball_has_about_the_pores_of_one_in_a_box() {
        let of = |part: &str| {
            check(&format!("gyroid scale 0.5 thickness 0.05 {part}"), 0.04).pore_size.unwrap()
        };
        let (ball, cube) = (of("sphere"), of("box"));
        near(ball.mean, cube.mean, 0.01);
        near(ball.fifth_percentile, cube.fifth_percentile, 0.02);
        assert!(ball.maximum < 1.3 * cube.maximum, "{ball:?} {cube:?}");
    }

    #[test]
    fn a_cubic_pore_has_the_mean_of_its_touching_balls() {
        // A ball that touches a side of the cube [-1, 1]^3 at (u, v) has radius 1 - max(|u|, |v|):
        // the mean diameter is 2/3, the greatest 2.
        let found = check("box scale 1.3 box difference", 0.04);
        let pore = found.pore_size.unwrap();
        // Balls near the edges of the cube are wrong by the spacing.
        near(pore.mean, 2.0 / 3.0, 0.03);
        near(pore.maximum, 2.0, 0.02);
        assert!(pore.minimum < 2.0 * NEAR * 0.04, "{pore:?}");
        assert!(pore.mean_error < 0.01 * pore.mean, "{pore:?}");
        assert_eq!((found.solid.components, found.void.enclosed, found.handles), (1, 1, 0));
        assert_eq!(found.void.percolates, [false; 3]);
    }

    #[test]
    fn overhangs_have_the_areas_of_closed_forms() {
        let of = |program: &str, spacing: f64, angle_deg: f64, up: DVec3| {
            let job = Job::parse(program).unwrap();
            let (settings, progress) = (Settings::with_spacing(spacing), Progress::new());
            let overhang = Overhang { angle_deg, up };
            job.survey(&settings, &overhang, &progress).unwrap().overhang_area
        };
        let up = DVec3::Z;
        for angle in [30.0_f64, 45.0, 60.0] {
            let (sine, cosine) = angle.to_radians().sin_cos();
            for spacing in [0.08, 0.04, 0.02] {
                // Triangles along the rim of the cap count or not.
                let error = of("sphere", spacing, angle, up) - TAU * (1.0 - cosine);
                assert!(error.abs() < 0.4 * spacing * TAU * sine, "{angle} {spacing}: {error}");
            }
            // By the normal's angle a to straight down, the lower half of a tube of radius r about a
            // circle of radius R has the area of a circle's arc times its way: 2 pi R 2 r a.
            let torus = TAU * 0.75 * 2.0 * 0.25 * angle.to_radians();
            near(of("torus", 0.02, angle, up), torus, 0.03);
        }
        // The floor of a box rests on the plate; that of a shelf on a foot does not.
        assert_eq!(of("box", 0.25, 45.0, up), 0.0);
        let shelf = "box scale 0.5,0.5,1 translate 0,0,-1 box scale 1,1,0.25 union";
        // Creases are chamfered by the spacing: the one between them looks down more steeply, those along
        // the foot do not look against x.
        let h = 0.0625;
        near(of(shelf, h, 45.0, up), 4.0 - 1.0, 0.02);
        near(of(shelf, h, 45.0, DVec3::X), 1.75 * (1.0 - 2.0 * h), 1e-3);
        assert_eq!(of(shelf, 0.125, 45.0, -up), 0.0);
        // A cube on its edge, sides leaning by 45 degrees: below that only the chamfer of the edge, of length
        // 2; above, two of its sides.
        let edge = "box rotate pi/4 1,0,0";
        let chamfer = of(edge, 0.06, 40.0, up);
        assert!(chamfer < 2.0 * 1.5 * 0.06, "{chamfer}");
        near(of(edge, 0.06, 50.0, up), 8.0, 0.05);
    }

    #[test]
    fn true_walls_of_a_gyroid_have_one_thickness() {
        let found = check("gyroid thickness 0.1 box", 0.02);
        let wall = found.wall_thickness.unwrap();
        near(wall.mean, 0.1, 0.02);
        near(wall.fifth_percentile, 0.1, 0.06);
        // Levels give walls that are thicker where the field is flatter.
        let level = check("gyroid shell 0.94 box", 0.02).wall_thickness.unwrap();
        let uneven = |spread: &Spread| spread.maximum / spread.minimum;
        assert!(uneven(&level) > 1.2 && uneven(&wall) < 1.1, "{level:?} {wall:?}");
    }
}
