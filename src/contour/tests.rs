//! What contouring promises, checked on meshes.

use super::testing::{
    Random, Sampled, Span, at_nodes, check, cube, mesh_of, smallest_in_single, unknown,
};
use super::*;
use crate::geom::Aabb;
use crate::mesh::Mesh;
use crate::num::Interval;
use glam::DVec3;
use std::io;
use std::sync::Mutex;

/// The mesh of a function on a cubic grid, without pruning.
fn dense(grid: &Grid, field: impl Fn([f64; 3]) -> f64 + Sync) -> Mesh {
    mesh_of(&Sampled::new(grid, field, unknown), grid, Pruning::None).0
}

fn cuboid(half: f64) -> impl Fn([f64; 3]) -> f64 + Sync {
    move |[x, y, z]| (x.abs() - half).max(y.abs() - half).max(z.abs() - half)
}

fn gyroid([x, y, z]: [f64; 3]) -> f64 {
    use std::f64::consts::TAU;
    let (u, v, w) = (TAU * x, TAU * y, TAU * z);
    u.sin() * v.cos() + v.sin() * w.cos() + w.sin() * u.cos()
}

/// Grid of `n` nodes along each axis with unit spacing.
fn nodes(n: [usize; 3]) -> Grid {
    let hi = DVec3::from_array(n.map(|n| (n - 1) as f64));
    Grid::new(Aabb::new(DVec3::ZERO, hi), DVec3::ONE).unwrap()
}

/// Checks a mesh made from values at nodes, and that no area vanishes.
fn check_values(n: [usize; 3], values: Vec<f64>) {
    let grid = nodes(n);
    let any = values.iter().any(|v| *v < 0.0);
    let mesh = dense(&grid, at_nodes(&grid, values));
    assert_eq!(any, !mesh.triangles.is_empty());
    if any {
        let measures = check(&mesh);
        let least = 0.49 * grid::TAU * grid::TAU;
        assert!(measures.smallest > least, "{}", measures.smallest);
        assert!(smallest_in_single(&mesh) > 0.0);
        assert!(measures.volume > 0.0);
    }
}

/// Random values at nodes; spicy ones put crossings on nodes and next to them.
fn random_values(random: &mut Random, n: [usize; 3], density: f64, spicy: bool) -> Vec<f64> {
    let value = |_| {
        let inside = random.unit() < density;
        let size = match random.below(if spicy { 8 } else { 1 }) {
            1 if !inside => 0.0,
            2 => 1e-300,
            3 => 1e-12,
            4 => 0.5 * grid::TAU,
            5 if !inside => f64::NAN,
            6 => f64::INFINITY,
            _ => random.unit().max(1e-9),
        };
        if inside { -size } else { size }
    };
    (0..n.iter().product()).map(value).collect()
}

#[test]
fn all_cases_close_in_every_position() {
    for case in 0..256usize {
        for place in 0..27 {
            // The cell lies at the lower end, inside, or at the upper end of each axis.
            let at = [place % 3, place / 3 % 3, place / 9];
            let values = (0..64).map(|n| {
                let node: [usize; 3] = [n % 4, n / 4 % 4, n / 16];
                let corner = [0, 1, 2].map(|a| node[a].wrapping_sub(at[a]));
                let is_corner = corner.iter().all(|c| *c < 2);
                let bit = corner[0] + 2 * corner[1] + 4 * corner[2];
                if is_corner && case >> bit & 1 == 1 { -1.0 } else { 1.0 }
            });
            check_values([4; 3], values.collect());
        }
        let alone = (0..8).map(|c| if case >> c & 1 == 1 { -1.0 } else { 1.0 });
        check_values([2; 3], alone.collect());
    }
}

#[test]
fn random_signs_close_with_crossings_anywhere() {
    let mut random = Random::new(7);
    for round in 0..600 {
        let thin = round % 3 == 0;
        let n = [0; 3].map(|_| if thin { 2 + random.below(2) } else { 2 + random.below(8) });
        let spicy = round % 2 == 0;
        let density = random.unit();
        let values = random_values(&mut random, n, density, spicy);
        check_values(n, values);
    }
}

#[test]
fn random_signs_close_across_bricks() {
    let mut random = Random::new(8);
    for n in [[17, 18, 19], [15, 33, 16], [14, 30, 31], [34, 3, 20]] {
        for density in [0.1, 0.5, 0.9] {
            let values = random_values(&mut random, n, density, density != 0.9);
            check_values(n, values);
        }
    }
}

#[test]
fn a_box_that_fills_the_grid_keeps_its_volume() {
    for spacing in [2.0 / 49.0, 0.02, 0.3, 0.07, 1.0, 2.0] {
        let grid = cube(-1.0, 1.0, spacing);
        let mesh = dense(&grid, cuboid(1.0));
        let measures = check(&mesh);
        assert!((measures.volume - 8.0).abs() < 1e-12 * 8.0, "{spacing}: {}", measures.volume);
        assert_eq!(measures.euler, 2);
        let n = grid.cells()[0];
        assert_eq!(mesh.triangles.len(), 12 * n * n);
    }
}

#[test]
fn random_boxes_keep_faces_edges_and_corners() {
    let mut random = Random::new(3);
    for _ in 0..60 {
        let scale = 10f64.powf(4.0 * random.unit() - 2.0);
        let lo = DVec3::from_array([0; 3].map(|_| scale * (random.unit() - 0.5)));
        let size = DVec3::from_array([0; 3].map(|_| scale * (0.1 + random.unit())));
        let hi = lo + size;
        let grid = Grid::new(Aabb::new(lo, hi), size / (3.0 + 9.0 * random.unit())).unwrap();
        let (center, half) = (0.5 * (lo + hi), 0.5 * size);
        let mesh = dense(&grid, move |p| {
            let q = (DVec3::from_array(p) - center).abs() - half;
            q.x.max(q.y).max(q.z)
        });
        let measures = check(&mesh);
        let volume = size.x * size.y * size.z;
        assert!((measures.volume - volume).abs() < 1e-12 * volume * 10.0);
        let extreme = |a: usize, end: f64| mesh.positions.iter().filter(|p| p[a] == end).count();
        let n = grid.cells();
        for a in 0..3 {
            let face = (n[(a + 1) % 3] + 1) * (n[(a + 2) % 3] + 1);
            assert_eq!((extreme(a, lo[a]), extreme(a, hi[a])), (face, face));
        }
        for corner in Aabb::new(lo, hi).corners() {
            assert!(mesh.positions.contains(&corner.to_array()));
        }
    }
}

#[test]
fn a_box_on_nodes_inside_the_grid_is_exact() {
    let mesh = dense(&cube(-1.0, 1.0, 0.125), cuboid(0.5));
    check(&mesh);
    for p in &mesh.positions {
        let far = p.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        assert_eq!(far, 0.5);
    }
}

#[test]
fn planes_through_nodes_have_no_zero_area() {
    let grid = cube(-1.0, 1.0, 0.05);
    let slanted = |[x, y, z]: [f64; 3]| (x + y + z - 1.0).max(cuboid(1.0)([x, y, z]));
    let mesh = dense(&grid, slanted);
    let measures = check(&mesh);
    let least = 0.49 * (grid::TAU * 0.05).powi(2);
    assert!(measures.smallest > least);
    assert!(smallest_in_single(&mesh) > 0.0);
    // 8 minus the corner that the plane cuts off, up to the rule for crowded nodes.
    assert!((measures.volume - (8.0 - 8.0 / 6.0)).abs() < 2e-4, "{}", measures.volume);
}

#[test]
fn zeros_of_the_gyroid_at_nodes_make_no_zero_area() {
    for spacing in [2.0 / 48.0, 2.0 / 60.0] {
        let grid = cube(-1.0, 1.0, spacing);
        let mesh = dense(&grid, |p| gyroid(p).max(cuboid(1.0)(p)));
        let measures = check(&mesh);
        assert_eq!(measures.euler, -52);
        assert!(measures.smallest > 0.49 * (grid::TAU * spacing).powi(2));
        assert!(smallest_in_single(&mesh) > 0.0);
    }
}

#[test]
fn a_sphere_converges_with_second_order() {
    let error = |n: f64| {
        let mesh =
            dense(&cube(-1.0, 1.0, 2.0 / n), |[x, y, z]| (x * x + y * y + z * z).sqrt() - 0.7);
        let measures = check(&mesh);
        assert_eq!(measures.euler, 2);
        for p in &mesh.positions {
            let r = DVec3::from_array(*p).length();
            assert!((r - 0.7).abs() < 2.0 / n * grid::TAU, "{r}");
        }
        (measures.volume / (4.0 / 3.0 * std::f64::consts::PI * 0.343) - 1.0).abs()
    };
    let (coarse, fine) = (error(20.0), error(40.0));
    assert!(coarse < 0.02 && (3.4..4.6).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn roots_are_good_to_rounding_at_smooth_places_and_kinks() {
    // The surface of a ball and a box: every vertex lies on one of them to rounding.
    let grid = cube(-1.0, 1.0, 2.0 / 29.0);
    let ball = |[x, y, z]: [f64; 3]| x * x + y * y + z * z - 0.61;
    let slab = |[x, _, z]: [f64; 3]| (x + 0.37 * z).abs() - 0.4123;
    let notch = |[_, y, z]: [f64; 3]| (y - 0.11 * z).abs() - 0.0777;
    let field = |p: [f64; 3]| ball(p).max(slab(p)).max(-notch(p));
    let mesh = dense(&grid, field);
    check(&mesh);
    let mut moved = 0;
    for p in &mesh.positions {
        if field(*p).abs() > 2e-14 {
            moved += 1;
        }
    }
    // Crossings within tau of a crowded node are moved; one in five hundred edges is so close.
    assert!(moved * 100 < mesh.positions.len(), "{moved} of {}", mesh.positions.len());
}

#[test]
fn steps_plateaus_and_poles_have_their_root_where_the_sign_changes() {
    let grid = cube(0.0, 8.0, 1.0);
    let slice = |field: fn(f64) -> f64, root: f64| {
        let mesh = dense(&grid, move |[x, _, _]| field(x));
        let measures = check(&mesh);
        let far = mesh.positions.iter().map(|p| p[0]).fold(0.0f64, f64::max);
        assert!((far - root).abs() < 1e-14 * 8.0 * 4.0, "{far} is not {root}");
        assert!((measures.volume - 64.0 * root).abs() < 1e-10);
    };
    slice(|x| if x < 3.3 { -1.0 } else { 1.0 }, 3.3);
    slice(|x| (x - 3.3).min(0.0), 3.3);
    slice(|x| (x - 3.3).clamp(-1e-3, 1e-9), 3.3);
    slice(|x| if x < 3.3 { -f64::INFINITY } else { f64::NAN }, 3.3);
    slice(|x| if x < 3.3 { -1.0 } else { 0.0 }, 3.3);
    slice(|x| (x - 3.3).cbrt(), 3.3);
    slice(|x| -1.0 / (3.3 - x), 3.3);
    slice(|x| x - 3.0, 3.0);
    slice(|x| if x < 3.0 { -1.0 } else { 0.0 }, 3.0);
}

#[test]
fn vertices_on_outer_planes_have_the_roots_of_the_plane_itself() {
    let grid = cube(-1.0, 1.0, 2.0 / 23.0);
    let field = |[x, y, z]: [f64; 3]| x * y - z * z + 0.1 * x - 0.03;
    let mesh = dense(&grid, field);
    check(&mesh);
    // Roots at one inset and at half of it lie on a line with the plane's but for the square of
    // the inset, 7e-15.
    let exact = |p: &&[f64; 3]| field(**p).abs() < 1e-13;
    let on_plane = |p: &&[f64; 3]| p.iter().filter(|u| u.abs() == 1.0).count() == 1;
    let crossings = mesh.positions.iter().filter(on_plane).filter(exact).count();
    assert!(crossings > 50, "{crossings}");
}

/// Encloses the largest of the box's three distances and the gyroid by natural extension.
fn gyroid_box_range(span: Span) -> Interval {
    use std::f64::consts::TAU;
    // A sine over [a, b]: ends, and extremes in between, widened for rounding.
    let wave = |[a, b]: [f64; 2], phase: f64| {
        let (a, b) = (TAU * a + phase, TAU * b + phase);
        let reaches = |top: f64| ((b - top) / TAU).floor() >= ((a - top) / TAU).ceil();
        let hi = if reaches(0.25 * TAU) { 1.0 } else { a.sin().max(b.sin()) };
        let lo = if reaches(0.75 * TAU) { -1.0 } else { a.sin().min(b.sin()) };
        [lo - 1e-12, hi + 1e-12]
    };
    let times = |a: [f64; 2], b: [f64; 2]| {
        let p = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
        [p.iter().copied().fold(f64::INFINITY, f64::min), p.iter().copied().fold(-1e9, f64::max)]
    };
    let s = span.map(|i| wave(i, 0.0));
    let c = span.map(|i| wave(i, 0.25 * TAU));
    let terms = [times(s[0], c[1]), times(s[1], c[2]), times(s[2], c[0])];
    let mut range = [0, 1].map(|e| terms.iter().map(|t| t[e]).sum::<f64>());
    range = [range[0] - 1e-12, range[1] + 1e-12];
    for [a, b] in span {
        let hi = a.abs().max(b.abs());
        let lo = if a <= 0.0 && b >= 0.0 { 0.0 } else { a.abs().min(b.abs()) };
        range = [range[0].max(lo - 1.0), range[1].max(hi - 1.0)];
    }
    Interval::new(range[0], range[1])
}

fn gyroid_box(p: [f64; 3]) -> f64 {
    gyroid(p).max(cuboid(1.0)(p))
}

#[test]
fn sparse_equals_dense_to_the_byte() {
    for (lo, hi, spacing) in [(-1.0, 1.0, 0.02), (-1.7, 1.5, 0.03), (-1.0, 1.0, 2.0 / 61.0)] {
        let grid = cube(lo, hi, spacing);
        let sampler = Sampled::new(&grid, gyroid_box, gyroid_box_range);
        let (dense, all) = mesh_of(&sampler, &grid, Pruning::None);
        let (sparse, some) = mesh_of(&sampler, &grid, Pruning::Intervals);
        check(&sparse);
        assert!(dense == sparse);
        assert!(lo == -1.0 || some.active_bricks < all.active_bricks);
        assert_eq!((some.vertices, some.triangles), (all.vertices, all.triangles));
    }
    // A solid that fills the grid is all settled: only its caps are made, from unsampled bricks.
    let grid = cube(-1.0, 1.0, 0.03);
    let sampler = Sampled::new(&grid, |_| -1.0, |_| Interval::point(-1.0));
    let (dense, _) = mesh_of(&sampler, &grid, Pruning::None);
    let (sparse, report) = mesh_of(&sampler, &grid, Pruning::Intervals);
    assert!(dense == sparse);
    assert_eq!(report.samples, 0);
    assert!((check(&sparse).volume - 8.0).abs() < 1e-12);
}

#[test]
fn one_thread_equals_four() {
    let grid = cube(-1.0, 1.0, 0.025);
    let sampler = Sampled::new(&grid, gyroid_box, gyroid_box_range);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| mesh_of(&sampler, &grid, Pruning::Intervals).0)
    };
    assert!(run(1) == run(4));
}

#[test]
fn nan_is_outside_and_counted_where_it_may_be() {
    let grid = cube(-1.0, 1.0, 0.04);
    let field = |[x, y, z]: [f64; 3]| {
        if x < -0.5 { f64::NAN } else { x * x + y * y + z * z - 0.8 }
    };
    let range = |[x, _, _]: Span| match x {
        [lo, hi] if lo < -0.5 => Interval { lo: -1.0, hi: hi.max(3.0), nan: true },
        _ => unknown([[0.0; 2]; 3]),
    };
    let sampler = Sampled::new(&grid, field, range);
    let (mesh, report) = mesh_of(&sampler, &grid, Pruning::Intervals);
    let measures = check(&mesh);
    let least = mesh.positions.iter().map(|p| p[0]).fold(1.0, f64::min);
    assert!(least >= -0.5 - 1e-13 * 0.04, "{least}");
    assert!(measures.volume > 0.0);
    // Nodes at -1 + 0.04 i below -0.5: 13 layers of 51 by 51.
    assert_eq!(report.nans, 13 * 51 * 51);
    let (dense, all) = mesh_of(&sampler, &grid, Pruning::None);
    assert!(dense == mesh);
    assert_eq!(all.nans, report.nans);
}

#[test]
fn an_empty_solid_is_reported() {
    let grid = cube(-1.0, 1.0, 0.1);
    let sampler = Sampled::new(&grid, |_| 0.0, unknown);
    let (mesh, report) = mesh_of(&sampler, &grid, Pruning::Intervals);
    assert_eq!((report.vertices, report.triangles), (0, 0));
    assert!(mesh.triangles.is_empty());
}

#[test]
fn a_sampler_of_another_grid_is_refused() {
    let sampler = Sampled::new(&cube(0.0, 1.0, 0.1), |_| 0.0, unknown);
    let mut sink = crate::mesh::sink::Collect::default();
    let grid = cube(0.0, 1.0, 0.01);
    let result = contour(&sampler, &grid, &Settings::default(), &Progress::new(), &mut sink);
    assert!(matches!(result, Err(Error::OtherGrid { .. })));
}

#[test]
fn cancelled_work_stops() {
    let grid = cube(-1.0, 1.0, 0.05);
    let sampler = Sampled::new(&grid, gyroid_box, unknown);
    let progress = Progress::new();
    progress.cancel();
    let mut sink = crate::mesh::sink::Collect::default();
    let result = contour(&sampler, &grid, &Settings::default(), &progress, &mut sink);
    assert!(matches!(result, Err(Error::Cancelled(Cancelled))));
}

/// Notes the pieces it receives, and fails after some.
struct Pieces {
    size: [u64; 2],
    runs: [Mutex<Vec<(u64, usize)>>; 2],
    most: usize,
}

impl Pieces {
    fn new(most: usize) -> Self {
        Self { size: [0; 2], runs: Default::default(), most }
    }

    fn take(&self, kind: usize, first: u64, count: usize) -> io::Result<()> {
        let mut runs = self.runs[kind].lock().unwrap();
        runs.push((first, count));
        if runs.len() > self.most { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) }
    }
}

impl Sink for Pieces {
    fn begin(&mut self, vertices: u64, triangles: u64) -> io::Result<()> {
        self.size = [vertices, triangles];
        Ok(())
    }
    fn vertices(&self, first: u64, positions: &[[f64; 3]]) -> io::Result<()> {
        self.take(0, first, positions.len())
    }
    fn triangles(&self, first: u64, corners: &[[u32; 3]]) -> io::Result<()> {
        self.take(1, first, corners.len())
    }
}

#[test]
fn pieces_cover_the_mesh_once_and_stay_small() {
    let grid = nodes([60, 61, 62]);
    let values = random_values(&mut Random::new(5), [60, 61, 62], 0.5, false);
    let sampler = Sampled::new(&grid, at_nodes(&grid, values), unknown);
    let (mut sink, progress) = (Pieces::new(usize::MAX), Progress::new());
    let report = contour(&sampler, &grid, &Settings::default(), &progress, &mut sink).unwrap();
    assert_eq!(sink.size, [report.vertices, report.triangles]);
    for (runs, size) in sink.runs.into_iter().zip(sink.size) {
        let mut runs = runs.into_inner().unwrap();
        runs.sort_unstable();
        let end = runs.iter().fold(0, |end, &(first, count)| {
            assert_eq!(first, end);
            assert!(count < 1 << 16, "a piece of {count}");
            end + count as u64
        });
        assert_eq!(end, size);
        assert!(runs.len() > 4);
    }
    let (done, expected) = progress.steps();
    assert_eq!(done, expected);
}

#[test]
fn a_failing_sink_stops_the_work() {
    let grid = cube(-1.0, 1.0, 0.05);
    let sampler = Sampled::new(&grid, gyroid_box, unknown);
    let mut sink = Pieces::new(1);
    let result = contour(&sampler, &grid, &Settings::default(), &Progress::new(), &mut sink);
    assert!(matches!(result, Err(Error::Sink(e)) if e.kind() == io::ErrorKind::StorageFull));
}
