//! Lattices of struts and plates: their fields against explicit copies, their densities against
//! closed forms and independent integration, their meshes for every cell of the table.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::cellular::struts::table::CELLS;
use alveole::cellular::struts::{Cell, Plate, Sizes, Strut, Surface};
use alveole::eval::interpret;
use alveole::expr::{Graph, NodeId};
use alveole::job::{Job, Settings};
use alveole::num::Progress;
use alveole::octree::Pruning;
use common::{assert_ranges_hold, assert_sound, job};
use glam::DVec3;
use std::f64::consts::{PI, SQRT_2};

/// Points of `[-size, size]^3`, spread evenly.
fn points(count: i32, size: f64) -> impl Iterator<Item = DVec3> {
    // The plastic number's powers: Roberts, "The unreasonable effectiveness of quasirandom
    // sequences".
    let step =
        DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3);
    (1..=count).map(move |i| (f64::from(i) * step).fract() * 2.0 * size - size)
}

/// The values of `field` at `at`.
fn values(graph: &Graph, field: NodeId, at: &[DVec3]) -> Vec<f64> {
    let lines = [0, 1, 2].map(|axis| at.iter().map(|p| p[axis]).collect::<Vec<f64>>());
    let mut out = vec![0.0; at.len()];
    let parameters: Vec<f64> = graph.parameters().iter().map(|(_, value)| *value).collect();
    interpret::points(
        graph,
        &[field],
        lines.each_ref().map(Vec::as_slice),
        &parameters,
        &mut [out.as_mut_slice()],
    )
    .unwrap();
    out
}

/// The distance from `p` to the segment between `a` and `b`, apart from the crate's own.
fn to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.dot(along)).clamp(0.0, 1.0);
    (p - a - along * t).length()
}

/// The distance from `p` to a convex polygon: by its triangles, each by Ericson's regions.
fn to_polygon(p: DVec3, corners: &[DVec3]) -> f64 {
    (1..corners.len() - 1)
        .map(|i| {
            let [a, b, c] = [corners[0], corners[i], corners[i + 1]];
            let n = (b - a).cross(c - a);
            let inside = [(a, b), (b, c), (c, a)]
                .into_iter()
                .all(|(u, v)| (v - u).cross(p - u).dot(n) >= 0.0);
            if inside {
                (p - a).dot(n).abs() / n.length()
            } else {
                to_segment(p, a, b).min(to_segment(p, b, c)).min(to_segment(p, c, a))
            }
        })
        .fold(f64::INFINITY, f64::min)
}

/// The field of 5 x 5 x 5 explicit copies of `cell` about the origin.
fn copies(cell: &Cell, size: f64, p: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for number in 0..125_i32 {
        let by = DVec3::new(
            f64::from(number % 5 - 2),
            f64::from(number / 5 % 5 - 2),
            f64::from(number / 25 - 2),
        );
        for Strut { ends: [a, b], factors } in cell.struts() {
            assert_eq!(factors[0], factors[1]);
            least = least.min(to_segment(p, *a + by, *b + by) - size * factors[0]);
        }
        for Plate { surface, factor } in cell.plates() {
            let distance = match surface {
                Surface::Plane { normal, offset } => {
                    let level = normal.dot(p) - offset;
                    (level - level.round()).abs() / normal.length()
                }
                Surface::Polygon(corners) => {
                    let moved: Vec<DVec3> = corners.iter().map(|c| *c + by).collect();
                    to_polygon(p, &moved)
                }
            };
            least = least.min(distance - 0.5 * size * factor);
        }
    }
    least
}

#[test]
fn folded_fields_are_those_of_explicit_copies() {
    let mut checked = 0;
    for row in &CELLS {
        let cell = row.cell();
        let mut graph = Graph::new();
        let [size, zero] = [0.07, 0.0].map(|v| graph.constant(v));
        let sizes = Sizes { radius: size, thickness: size, fillet: zero };
        let solid = cell.solid(&mut graph, sizes);
        // The walls of whole foams are made in another way by their words.
        let word = row.solid(&mut graph, sizes);
        let at: Vec<DVec3> = points(300, 1.0).collect();
        let [cells, words] = [solid, word].map(|solid| values(&graph, solid.field, &at));
        for (i, p) in at.iter().enumerate() {
            let expected = copies(&cell, 0.07, *p);
            for found in [cells[i], words[i]] {
                let error = (found - expected).abs();
                assert!(error < 1e-12, "{}: {found} is not {expected} at {p}", row.name);
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 2 * 300 * CELLS.len());
}

#[test]
fn fields_do_not_jump_between_cells() {
    // Across faces of the cells and planes of the mirrors, and far from the origin.
    for row in &CELLS {
        for fillet in ["0", "0.1"] {
            let size = if row.is_of_plates() { "thickness" } else { "radius" };
            let job = job(&format!("{} {size} 0.06 fillet {fillet}", row.name));
            let mut pairs = Vec::new();
            for (i, p) in points(40, 3.0).enumerate() {
                let mut middle = p;
                middle[i % 3] = (2.0 * p[i % 3]).round() / 2.0;
                let mut step = DVec3::ZERO;
                step[i % 3] = 1e-9;
                pairs.extend([middle - step, middle + step]);
            }
            let (graph, field) = job.field();
            let found = values(graph, field, &pairs);
            for (pair, at) in found.chunks(2).zip(pairs.chunks(2)) {
                let jump = (pair[0] - pair[1]).abs();
                assert!(jump < 2e-8, "{} fillet {fillet} jumps by {jump} at {}", row.name, at[0]);
            }
        }
    }
}

#[test]
fn slopes_are_no_steeper_than_promised() {
    for row in &CELLS {
        let mut graph = Graph::new();
        let [size, zero] = [0.07, 0.0].map(|v| graph.constant(v));
        let sizes = Sizes { radius: size, thickness: size, fillet: zero };
        let solid = row.cell().solid(&mut graph, sizes);
        let extent = solid.extent(&graph, &[]);
        assert_eq!((extent.lipschitz, extent.period), (1.0, Some(DVec3::ONE)), "{}", row.name);
        let near: Vec<DVec3> = points(200, 1.5).collect();
        let far: Vec<DVec3> = points(400, 1.5).skip(200).collect();
        let [a, b] = [&near, &far].map(|at| values(&graph, solid.field, at));
        for i in 0..near.len() {
            let rise = (a[i] - b[i]).abs();
            assert!(rise <= near[i].distance(far[i]) + 1e-12, "{}", row.name);
        }
    }
}

/// The share of the unit cell that is nearer than `radius` to one of the segments between points
/// and their images in the cells around, by `count` points spread evenly.
fn share(segments: &[[[f64; 3]; 2]], radius: f64, count: i32) -> f64 {
    let mut near = Vec::new();
    for number in 0..125_i32 {
        let by = DVec3::new(
            f64::from(number % 5 - 2),
            f64::from(number / 5 % 5 - 2),
            f64::from(number / 25 - 2),
        );
        for ends in segments {
            let [a, b] = ends.map(|end| DVec3::from_array(end) + by);
            let (lo, hi) = (a.min(b) - radius, a.max(b) + radius);
            if lo.cmplt(DVec3::ONE).all() && hi.cmpgt(DVec3::ZERO).all() {
                near.push((a, b));
            }
        }
    }
    let inside = points(count, 0.5)
        .map(|p| p + 0.5)
        .filter(|p| near.iter().any(|(a, b)| to_segment(*p, *a, *b) < radius));
    inside.count() as f64 / f64::from(count)
}

/// The share of the cube [-1/2, 1/2]^3 that the lattice `program` fills, from its field on a grid of
/// `cells` along it.
fn density(program: &str, cells: f64) -> f64 {
    let settings = Settings::with_spacing(1.0 / cells);
    let job = job(&format!("{program} box scale 0.5"));
    job.field_measures(&settings, &Progress::new()).unwrap().volume.value
}

/// The edges of the octet truss in one cell, written out.
fn octet() -> Vec<[[f64; 3]; 2]> {
    let mut nodes = Vec::new();
    for number in 0..27_i32 {
        let p = [number % 3, number / 3 % 3, number / 9];
        if (p[0] + p[1] + p[2]) % 2 == 0 {
            nodes.push(p.map(|c| f64::from(c) / 2.0));
        }
    }
    let mut edges = Vec::new();
    for (i, a) in nodes.iter().enumerate() {
        for b in &nodes[i + 1..] {
            let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
            if (square - 0.5).abs() < 1e-9 {
                edges.push([*a, *b]);
            }
        }
    }
    edges
}

#[test]
fn densities_with_their_nodes_are_those_of_random_points() {
    let cube =
        vec![[[0.0; 3], [1.0, 0.0, 0.0]], [[0.0; 3], [0.0, 1.0, 0.0]], [[0.0; 3], [0.0, 0.0, 1.0]]];
    for (name, segments, radius) in [
        ("simple-cubic", &cube, 0.1),
        ("simple-cubic", &cube, 0.2),
        ("octet", &octet(), 0.05),
        ("octet", &octet(), 0.1),
    ] {
        // Evenly spread points err by much less than 1 / sqrt(n).
        let expected = share(segments, radius, 200_000);
        let found = density(&format!("{name} radius {radius}"), 120.0);
        assert!((found - expected).abs() < 1e-3, "{name} {radius}: {found}, not {expected}");
    }
    // Three cylinders less the double counts at their crossing, which is a tricylinder's: exact.
    for r in [0.1_f64, 0.2] {
        let expected = 3.0 * PI * r * r - 8.0 * SQRT_2 * r.powi(3);
        let found = density(&format!("simple-cubic radius {r}"), 100.0);
        assert!((found - expected).abs() < 5e-4, "{r}: {found}, not {expected}");
    }
}

#[test]
fn slender_struts_fill_their_length_times_their_section() {
    // What is counted twice at the nodes goes with the third power of the radius, so that the
    // slender limit follows from two radii.
    for (name, slender) in [("octet", 6.0 * SQRT_2 * PI * 2.0), ("simple-cubic", 3.0 * PI)] {
        let excess = |r: f64| density(&format!("{name} radius {r}"), 140.0) / (slender * r * r);
        let (wide, narrow) = (excess(0.12), excess(0.06));
        assert!(wide < narrow && narrow < 1.0, "{name}: {wide} {narrow}");
        let limit = 2.0 * narrow - wide;
        assert!((limit - 1.0).abs() < 1e-2, "{name}: {narrow} after {wide} leads to {limit}");
    }
}

#[test]
fn plates_fill_their_area_times_their_thickness() {
    let t = 0.1_f64;
    let found = density(&format!("cubic-plates thickness {t}"), 90.0);
    let expected = 1.0 - (1.0 - t).powi(3);
    assert!((found - expected).abs() < 5e-4, "{found}, not {expected}");
    // Faces of closed cells: what is left of each bubble is a smaller one, moved in by t / 2.
    let inner = (1.0 - t / 2.0 / 0.353_553_390_593_273_8).powi(3);
    let found = density(&format!("rhombic-dodecahedron-plates thickness {t}"), 90.0);
    assert!((found - (1.0 - inner)).abs() < 1e-3, "{found}, not {}", 1.0 - inner);
}

#[test]
fn every_cell_has_a_sound_mesh_that_no_pruning_changes() {
    for row in &CELLS {
        let size = if row.is_of_plates() { "thickness" } else { "radius" };
        let program = format!("{} {size} 0.1 box scale 0.6", row.name);
        let settings = Settings::with_spacing(0.05);
        let job = job(&program);
        let sparse = job.mesh(&settings).unwrap();
        assert_sound(&program, &sparse);
        assert!(sparse.triangles.len() > 500, "{program}: {}", sparse.triangles.len());
        let settings = Settings { pruning: Pruning::None, ..settings };
        let dense = job.mesh(&settings).unwrap();
        assert!(sparse.positions == dense.positions, "{program}");
        assert!(sparse.triangles == dense.triangles, "{program}");
    }
}

#[test]
fn fillets_add_material_and_keep_meshes_sound() {
    for name in ["octet", "bcc", "kelvin", "diamond-struts", "kelvin-plates"] {
        let size = if name.ends_with("plates") { "thickness" } else { "radius" };
        let program = |fillet: f64| format!("{name} {size} 0.08 fillet {fillet} box scale 0.6");
        let volume = |fillet: f64| {
            let job = job(&program(fillet));
            let mesh = job.mesh(&Settings::with_spacing(0.04)).unwrap();
            assert_sound(&program(fillet), &mesh);
            alveole::mesh::measure::volume(&mesh)
        };
        let (sharp, round, rounder) = (volume(0.0), volume(0.05), volume(0.1));
        assert!(sharp < round && round < rounder, "{name}: {sharp} {round} {rounder}");
    }
}

#[test]
fn a_fillet_between_two_struts_is_round() {
    // Struts along x and y that cross at the origin: in the plane of both, the fillet of radius R
    // beside struts of radius r is round about (r + R, r + R).
    let (r, fillet) = (0.1, 0.2);
    let job = job("simple-cubic radius 0.1 fillet 0.2");
    let at: Vec<DVec3> = [0.1_f64, 0.5, 0.9, 1.4]
        .map(|angle| {
            (r + fillet) * DVec3::new(1.0, 1.0, 0.0)
                - fillet * DVec3::new(angle.cos(), angle.sin(), 0.0)
        })
        .to_vec();
    // The third strut, along z, adds to it where it is nearer than the fillet.
    let expected = |p: &DVec3| {
        let depths = [p.y - r, p.x - r, p.x.hypot(p.y) - r].map(|a| (fillet - a).max(0.0));
        let least = (p.y - r).min(p.x - r).min(p.x.hypot(p.y) - r);
        fillet.max(least) - depths.iter().map(|d| d * d).sum::<f64>().sqrt()
    };
    let (graph, field) = job.field();
    for (p, found) in at.iter().zip(values(graph, field, &at)) {
        assert!((found - expected(p)).abs() < 1e-12 && found <= 1e-12, "{found} at {p}");
    }
}

#[test]
fn ranges_of_boxes_enclose_the_field() {
    for name in ["octet", "diamond-struts", "weaire-phelan", "kelvin-plates", "iso-truss"] {
        let job = job(name);
        // Boxes within a cell, and across its faces.
        for start in [[0.1, 0.2, 0.05], [-0.2, 0.9, 0.4]] {
            assert_ranges_hold(name, &job, start, 0.02);
        }
    }
}

#[test]
fn radii_are_parameters_and_densities_are_solved_for() {
    let settings = Settings::with_spacing(0.025);
    let mut job = Job::parse_with("octet radius r box scale 0.5", &[("r", 0.05)]).unwrap();
    for r in [0.05, 0.1] {
        job.set_parameter("r", r).unwrap();
        let found = job.field_measures(&settings, &Progress::new()).unwrap().volume.value;
        let fresh = density(&format!("octet radius {r}"), 40.0);
        assert!((found - fresh).abs() < 1e-12, "{r}: {found}, not {fresh}");
    }
    for program in ["octet density 0.3", "bcc-plates density 0.3"] {
        let found = density(program, 80.0);
        assert!((found - 0.3).abs() < 1e-3, "{program}: {found}");
    }
    let program = "sphere octet fill size 0.8 density 0.25 skin 0.1";
    let job = common::job(program);
    let settings = Settings::with_spacing(0.02);
    let found = job.field_measures(&settings, &Progress::new()).unwrap().volume.value;
    let ball = |radius: f64| 4.0 / 3.0 * PI * radius.powi(3);
    let expected = ball(1.0) - 0.75 * ball(0.9);
    assert!((found / expected - 1.0).abs() < 1e-3, "{found}, not {expected}");
}

#[test]
fn struts_taper_between_the_radii_of_their_ends() {
    // The distance to balls whose centres and radii go from one end to the other: by many balls.
    let [a, b] = [[0.2, 0.3, 0.25], [0.7, 0.6, 0.65]].map(DVec3::from_array);
    let cell = Cell::new(vec![Strut { ends: [a, b], factors: [2.0, 0.5] }], Vec::new());
    let mut graph = Graph::new();
    let [radius, zero] = [0.08, 0.0].map(|v| graph.constant(v));
    let sizes = Sizes { radius, thickness: radius, fillet: zero };
    let solid = cell.solid(&mut graph, sizes);
    let at: Vec<DVec3> = points(200, 0.5).map(|p| p + 0.5).collect();
    for (p, found) in at.iter().zip(values(&graph, solid.field, &at)) {
        let mut expected = f64::INFINITY;
        for number in 0..27_i32 {
            let by = DVec3::new(
                f64::from(number % 3 - 1),
                f64::from(number / 3 % 3 - 1),
                f64::from(number / 9 - 1),
            );
            for i in 0..=2000 {
                let t = f64::from(i) / 2000.0;
                let centre = a + t * (b - a) + by;
                expected = expected.min(p.distance(centre) - 0.08 * (2.0 - 1.5 * t));
            }
        }
        assert!(found <= expected + 1e-12 && expected - found < 1e-6, "{found}, not {expected}");
    }
}

/// A file of that name and text in a folder of its own, and the program of its name and `rest`.
fn file(name: &str, text: &str, rest: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let program = format!("'{}' {rest}", path.display());
    (folder, program)
}

#[test]
fn lattice_files_are_shapes_with_radii_of_their_own() {
    let cross = "node a 0 0 0\nnode x 1 0 0\nnode y 0 1 0\nnode z 0 0 1\n\
                 edge a x\nedge a y\nedge a z\n";
    let (_folder, program) = file("cross.cell", cross, "radius 0.1");
    let (found, own) = (density(&program, 40.0), density("simple-cubic radius 0.1", 40.0));
    assert!((found - own).abs() < 1e-12, "{found}, not {own}");
    // A plate and a strut half as thick, and sizes by parameters.
    let both = r#"{"nodes": [{"id": 1, "at": [0,0,0]}, {"id": 2, "at": [1,0,0]},
        {"id": 3, "at": [1,1,0]}, {"id": 4, "at": [0,1,0]}, {"id": 5, "at": [0,0,1]}],
        "edges": [{"between": [1, 5], "radius": 0.5}], "faces": [{"corners": [1, 2, 3, 4]}]}"#;
    let (_folder, program) = file("both.cell.json", both, "radius r thickness t box scale 0.5");
    let job = Job::parse_with(&program, &[("r", 0.2), ("t", 0.1)]).unwrap();
    let settings = Settings::with_spacing(1.0 / 90.0);
    let found = job.field_measures(&settings, &Progress::new()).unwrap().volume.value;
    let expected = 0.1 + 0.9 * PI * 0.01;
    assert!((found - expected).abs() < 3e-4, "{found}, not {expected}");
}

#[test]
fn lattice_files_that_are_wrong_say_where() {
    for (name, text, words) in [
        ("a.cell", "node a 0 0 0\nedge a b\n", &["a.cell", "line 2, column 8", "no node `b`"][..]),
        ("a.ltcx", "<graph><node", &["a.ltcx", "line 1"]),
        ("a.cell.json", "{}", &["a.cell.json", "no edge and no face"]),
    ] {
        let (_folder, program) = file(name, text, "box");
        let message = Job::parse(&program).unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "{message} does not say {word}");
        }
    }
    let missing = Job::parse("missing.cell box").unwrap_err().to_string();
    assert!(missing.contains("missing.cell"), "{missing}");
    assert!(Job::parse("missing.cell radius").unwrap_err().to_string().contains("lacks"));
}

#[test]
fn foams_of_a_seed_are_sound_and_always_the_same() {
    for (program, other) in [
        ("voronoi-struts bubbles 6 radius 0.05", "voronoi-struts bubbles 6 radius 0.05 seed 2"),
        ("voronoi-walls bubbles 4 thickness 0.08", "voronoi-walls bubbles 4 thickness 0.08 seed 2"),
        ("spinodoid waves 40", "spinodoid waves 40 seed 2"),
    ] {
        let settings = Settings::with_spacing(0.05);
        let mesh = |program: &str| job(&format!("{program} box")).mesh(&settings).unwrap();
        let found = mesh(program);
        assert_sound(program, &found);
        assert!(found == mesh(program) && found != mesh(other), "{program}");
        let dense = Settings { pruning: Pruning::None, ..settings.clone() };
        assert!(found == job(&format!("{program} box")).mesh(&dense).unwrap(), "{program}");
    }
}

#[test]
fn foams_are_the_places_with_several_nearest_points() {
    // Walls lie half way between the two nearest points: the distance to the bisecting plane.
    let sites = alveole::cellular::struts::voronoi::random_points(1, 5);
    let job = job("voronoi-walls bubbles 5 thickness 0.1");
    let (graph, field) = job.field();
    let at: Vec<DVec3> = points(300, 1.0).collect();
    for (p, found) in at.iter().zip(values(graph, field, &at)) {
        let mut images = Vec::new();
        for number in 0..125_i32 {
            let by = DVec3::new(
                f64::from(number % 5 - 2),
                f64::from(number / 5 % 5 - 2),
                f64::from(number / 25 - 2),
            );
            images.extend(sites.iter().map(|site| *site + by));
        }
        images.sort_by(|a, b| a.distance(*p).total_cmp(&b.distance(*p)));
        let own = images[0];
        let wall = images[1..]
            .iter()
            .map(|other| (*p - 0.5 * (own + *other)).dot((own - *other).normalize()))
            .fold(f64::INFINITY, f64::min);
        assert!((found - (wall - 0.05)).abs() < 1e-9, "{found}, not {} at {p}", wall - 0.05);
    }
}

#[test]
fn spinodoids_fill_the_share_that_their_level_says() {
    // Of a normal distribution of variance 1, the share below -0.5244 is 0.3.
    for cones in ["pi/2,pi/2,pi/2", "0.5,0,0"] {
        let job = job(&format!("spinodoid waves 100 cones {cones}"));
        let (graph, field) = job.field();
        let at: Vec<DVec3> = points(20_000, 30.0).collect();
        let found = values(graph, field, &at);
        let share = found.iter().filter(|value| **value < -0.5244).count() as f64 / 20_000.0;
        assert!((share - 0.3).abs() < 0.03, "{cones}: {share}");
    }
    let found = density("spinodoid waves 12 density 0.4", 50.0);
    assert!((found - 0.4).abs() < 1e-3, "{found}");
    let fault = Job::parse_with("spinodoid waves n box", &[("n", 10.0)]).unwrap_err();
    assert!(fault.to_string().contains("can't depend on a parameter"), "{fault}");
    assert!(Job::parse("spinodoid seed 1.5 box").unwrap_err().to_string().contains("whole"));
}
