//! Inputs of other tools against what the tools compute: ASLI's interpolation, filter and formulas
//! written anew by brute force, volume fractions by quadrature, Scaffolder's documented runs.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::eval::interpret;
use alveole::job::convert::scaffolder;
use alveole::job::{Job, Settings};
use alveole::mesh::measure::volume;
use alveole::num::Progress;
use alveole::octree::Pruning;
use common::{Uniform, assert_ranges_hold, assert_sound, job};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A function of the point.
type Field = Box<dyn Fn([f64; 3]) -> f64>;

/// Numbers at points.
type Points = Vec<([f64; 3], f64)>;

/// ASLI's interpolator: distances to all points and a linear function, from the whole system of
/// equations by elimination with pivots.
fn interpolated(data: &[([f64; 3], f64)]) -> Field {
    let distance =
        |p: [f64; 3], q: [f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
    let n = data.len();
    let mut system = vec![vec![0.0; n + 5]; n + 4];
    for i in 0..n {
        for j in 0..n {
            system[i][j] = distance(data[i].0, data[j].0);
        }
        let [x, y, z] = data[i].0;
        for (k, entry) in [1.0, x, y, z].into_iter().enumerate() {
            system[i][n + k] = entry;
            system[n + k][i] = entry;
        }
        system[i][n + 4] = data[i].1;
    }
    for column in 0..n + 4 {
        let size = |row: &usize| system[*row][column].abs();
        let pivot = (column..n + 4).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap();
        system.swap(column, pivot);
        let top = system[column].clone();
        for row in system.iter_mut().skip(column + 1) {
            let factor = row[column] / top[column];
            for (entry, top) in row[column..].iter_mut().zip(&top[column..]) {
                *entry -= factor * top;
            }
        }
    }
    let mut found = vec![0.0; n + 4];
    for row in (0..n + 4).rev() {
        let known: f64 = (row + 1..n + 4).map(|k| system[row][k] * found[k]).sum();
        found[row] = (system[row][n + 4] - known) / system[row][row];
    }
    let data = data.to_vec();
    Box::new(move |p| {
        let near: f64 = data.iter().zip(&found).map(|((q, _), w)| w * distance(p, *q)).sum();
        near + found[n] + (0..3).map(|k| found[n + 1 + k] * p[k]).sum::<f64>()
    })
}

/// Sizes at points, interpolated by their reciprocals.
fn sizes(data: &Points) -> Field {
    let frequencies: Points = data.iter().map(|(p, size)| (*p, 1.0 / size)).collect();
    let frequency = interpolated(&frequencies);
    Box::new(move |p| 1.0 / frequency(p))
}

/// The weights of types at points, averaged within a factor of the size and interpolated.
fn weights(data: &[([f64; 3], usize)], factor: f64, size: &Field) -> Vec<Field> {
    let count = data.iter().map(|(_, kind)| kind + 1).max().unwrap();
    let filtered = |kind: usize, p: [f64; 3]| {
        let radius = factor * size(p);
        let (mut sum, mut total) = (0.0, 0.0);
        for (q, other) in data {
            let d = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
            if d <= radius {
                let weight = (-(2.0 * d / radius).powi(2)).exp();
                sum += if *other == kind { weight } else { 0.0 };
                total += weight;
            }
        }
        sum / total
    };
    (0..count)
        .map(|kind| {
            let at: Points = data.iter().map(|(p, _)| (*p, filtered(kind, *p))).collect();
            interpolated(&at)
        })
        .collect()
}

/// ASLI's field of a cell at p where the size is s and the level t; `is_old` says of which ASLI.
fn cell(name: &str, p: [f64; 3], s: f64, t: f64, is_old: bool) -> f64 {
    let [(sx, cx), (sy, cy), (sz, cz)] = p.map(|c| (TAU * c / s).sin_cos());
    let [c2x, c2y, c2z] = p.map(|c| (2.0 * TAU * c / s).cos());
    let g = sx * cy + sy * cz + sz * cx;
    let d = sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz;
    let w = c2x + c2y + c2z - 2.0 * (cx * cy + cy * cz + cz * cx);
    match name {
        "gyroid" => g - t,
        "sheet_gyroid" => g * g - t * t,
        "diamond" => d - t,
        "sheet_diamond" => d * d - t * t,
        "primitive" => -(cx + cy + cz) - t,
        "sheet_primitive" => (cx + cy + cz).powi(2) - t * t,
        "IWP" if is_old => w + t,
        "IWP" => w - t,
        "sheet_IWP" => w * w - t * t,
        "cubic" => {
            let [x, y, z] = p.map(|c| c - s * (c / s).round());
            x.hypot(y).min(y.hypot(z)).min(z.hypot(x)) / t / s - 1.0
        }
        _ => panic!("{name}"),
    }
}

/// The level of a normalised isovalue: the least and the greatest of each cell, and so the value.
fn level(name: &str, value: f64, is_old: bool) -> f64 {
    let [least, most] = match (name, is_old) {
        ("gyroid", _) => [-1.5, 1.5],
        ("sheet_gyroid", true) => [0.0, 1.55],
        ("sheet_gyroid", false) => [0.0, 1.5],
        ("diamond", true) => [-1.425, 1.425],
        ("diamond", false) => [-1.42, 1.42],
        ("sheet_diamond", true) => [0.0, 1.45],
        ("sheet_diamond", false) => [0.0, 1.42],
        ("primitive", true) => [-3.0, 3.0],
        ("primitive", false) => [-3.0, 3.01],
        ("sheet_primitive", true) => [0.0, 3.05],
        ("sheet_primitive", false) => [0.0, 3.01],
        ("IWP", true) => [-5.025, 3.025],
        ("IWP", false) => [-3.0, 5.0],
        ("sheet_IWP", true) => [0.0, 5.05],
        ("sheet_IWP", false) => [0.0, 5.0],
        ("cubic", _) => [0.0, 0.71],
        _ => panic!("{name}"),
    };
    least + value * (most - least)
}

/// The middles of n by n by n cells of the cube of side 1 about the origin.
fn middles(n: usize) -> impl Iterator<Item = [f64; 3]> {
    let at = move |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    (0..n * n * n).map(move |i| [at(i % n), at(i / n % n), at(i / n / n)])
}

/// The share of that cube where `field` is negative.
fn share(field: &dyn Fn([f64; 3]) -> f64) -> f64 {
    const N: usize = 61;
    let inside = middles(N).filter(|p| field(*p) < 0.0).count();
    inside as f64 / (N * N * N) as f64
}

/// A folder with a configuration and its files of points.
struct Project {
    folder: TempDir,
}

impl Project {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn numbers(&self, name: &str, data: &Points) {
        let lines: String = data.iter().fold(String::new(), |mut text, ([x, y, z], value)| {
            writeln!(text, "{x},{y},{z},{value}").unwrap();
            text
        });
        fs::write(self.path(name), lines).unwrap();
    }

    /// The job of a configuration of the cube of side 1 with these lines.
    fn job(&self, lines: &str, is_old: bool) -> Job {
        let [tap, sap, fap] = ["a.tap", "a.sap", "a.fap"].map(|name| self.path(name));
        let mark = if is_old { "me_side: scaffold" } else { "me_elementSize: 0.5" };
        let part = self.path("cube.stl");
        if !Path::new(&part).exists() {
            let mesh = job("box scale 0.5").mesh(&Settings::with_spacing(0.5)).unwrap();
            let mut file = fs::File::create(&part).unwrap();
            let (format, precision) =
                (alveole::mesh::io::Format::Stl, alveole::mesh::io::Precision::Single);
            alveole::mesh::io::write(&mesh, format, precision, &mut file).unwrap();
        }
        let text = format!(
            "files:\n  stl: {part}\n  tap: {tap}\n  sap: {sap}\n  fap: {fap}\n{lines}\n{mark}\n"
        );
        fs::write(self.path("config.yml"), text).unwrap();
        job(&self.path("config.yml"))
    }
}

/// The values of a job's field at points.
fn values(job: &Job, at: &[[f64; 3]]) -> Vec<f64> {
    let (graph, field) = job.field();
    let lines: [Vec<f64>; 3] = std::array::from_fn(|k| at.iter().map(|p| p[k]).collect());
    let mut out = vec![0.0; at.len()];
    let lines = lines.each_ref().map(Vec::as_slice);
    interpret::points(graph, &[field], lines, &[], &mut [out.as_mut_slice()]).unwrap();
    out
}

/// The job's solid is where `field` is negative, and has its share of the cube by mesh and by
/// quadrature, within 1 %.
fn check(name: &str, job: &Job, field: &dyn Fn([f64; 3]) -> f64) {
    let at: Vec<_> = middles(31).collect();
    for (point, found) in at.iter().zip(values(job, &at)) {
        let expected = field(*point);
        // Signs of numbers that are rounding errors of zero mean nothing.
        if expected.abs() > 1e-9 {
            assert_eq!(found < 0.0, expected < 0.0, "{name} at {point:?}: {found}, {expected}");
        }
    }
    let expected = share(field);
    let mesh = job.mesh(&Settings::with_spacing(1.0 / 80.0)).unwrap();
    assert_sound(name, &mesh);
    let found = volume(&mesh);
    assert!((found - expected).abs() < 0.01, "{name}: {found} is not {expected}");
    let dense = Settings { pruning: Pruning::None, ..Settings::with_spacing(1.0 / 24.0) };
    let sparse = Settings { pruning: Pruning::Intervals, ..dense.clone() };
    assert_eq!(job.mesh(&dense).unwrap(), job.mesh(&sparse).unwrap(), "{name}");
}

/// ASLI's demonstration has cells of 0.25 at the top of a cube, of 0.5 at its foot, and isovalues
/// of 0.35 and 1 there; here it is with fewer points.
fn demonstration() -> (Points, Points, Vec<([f64; 3], usize)>) {
    let places = [-0.5, 0.0, 0.5];
    let grid = |heights: &[f64], per_row: usize| {
        let mut found = Vec::new();
        for z in heights {
            for i in 0..per_row * per_row {
                let at = |k: usize| k as f64 / (per_row - 1) as f64 - 0.5;
                found.push([at(i % per_row), at(i / per_row), *z]);
            }
        }
        found
    };
    let below = |p: &[f64; 3], level: f64| p[2] < level;
    let sizes = grid(&[-0.5, -0.4, -0.35, 0.0, 0.5], places.len());
    let sizes = sizes.iter().map(|p| (*p, if below(p, -0.38) { 0.5 } else { 0.25 }));
    let features = grid(&[-0.5, -0.45, -0.35, -0.1, 0.2, 0.5], 4);
    let features = features.iter().map(|p| (*p, if below(p, -0.4) { 0.9 } else { 0.35 }));
    let types = grid(&[-0.5, -0.25, 0.0, 0.21, 0.4, 0.5], 5);
    let types = types.iter().map(|p| (*p, usize::from(!below(p, 0.3))));
    (sizes.collect(), features.collect(), types.collect())
}

#[test]
fn the_examples_of_asli_s_manual_make_asli_s_solids() {
    let (size_data, feature_data, type_data) = demonstration();
    let project = Project::new();
    project.numbers("a.sap", &size_data);
    project.numbers("a.fap", &feature_data);
    let names = ["gyroid", "sheet_gyroid"];
    let lines: String = type_data.iter().fold(String::new(), |mut text, ([x, y, z], kind)| {
        writeln!(text, "{x},{y},{z},{}", names[*kind]).unwrap();
        text
    });
    fs::write(project.path("a.tap"), lines).unwrap();
    let (size, feature) = (sizes(&size_data), interpolated(&feature_data));
    let quarter: Field = Box::new(|_| 0.25);
    let half: Field = Box::new(|_| 0.5);
    // The sum over types that ASLI computes; its factor of the feature goes on from type to type.
    let hybrid = |p: [f64; 3], weights: &[Field], size: &Field, feature: &Field, is_old: bool| {
        let weights: Vec<f64> = weights.iter().map(|weight| weight(p)).collect();
        let norm = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        let (mut sum, mut value) = (0.0, feature(p));
        for (name, weight) in names.iter().zip(&weights) {
            value *= 1.0 + 0.25 * (1.0 - (2.0 * weight / norm - 1.0).powi(2));
            let t = level(name, value, is_old);
            sum += weight / norm * cell(name, p, size(p), t, is_old);
        }
        sum
    };
    for is_old in [true, false] {
        let constant = "lt_type: gyroid\nlt_size: 0.25\nlt_feature: isovalue\nlt_feature_val: 0.5";
        let found = project.job(constant, is_old);
        check("constant", &found, &|p| cell("gyroid", p, 0.25, 0.0, is_old));

        let lines = constant.replace("0.25", "0");
        check("sizes", &project.job(&lines, is_old), &|p| cell("gyroid", p, size(p), 0.0, is_old));

        let lines = constant.replace("val: 0.5", "val: 0");
        check("features", &project.job(&lines, is_old), &|p| {
            cell("gyroid", p, 0.25, level("gyroid", feature(p), is_old), is_old)
        });

        let lines = constant.replace("type: gyroid", "type: hybrid");
        let mixed = weights(&type_data, 1.0, &quarter);
        check("types", &project.job(&lines, is_old), &|p| {
            hybrid(p, &mixed, &quarter, &half, is_old)
        });

        let lines = lines.replace("0.25", "0").replace("val: 0.5", "val: 0");
        let mixed = weights(&type_data, 1.0, &size);
        check("all three", &project.job(&lines, is_old), &|p| {
            hybrid(p, &mixed, &size, &feature, is_old)
        });
    }
}

#[test]
fn every_cell_of_asli_is_its_formula() {
    let names = [
        "gyroid",
        "sheet_gyroid",
        "diamond",
        "sheet_diamond",
        "primitive",
        "sheet_primitive",
        "IWP",
        "sheet_IWP",
        "cubic",
    ];
    let project = Project::new();
    let data: Points = demonstration().1;
    let data: Points = data.into_iter().map(|(p, value)| (p, 0.3 + 0.2 * value * p[0])).collect();
    project.numbers("a.fap", &data);
    let feature = interpolated(&data);
    for name in names {
        for is_old in [true, false] {
            let value = 0.3;
            let lines = format!(
                "lt_type: {name}\nlt_size: 0.5\nlt_feature: isovalue\nlt_feature_val: {value}"
            );
            let t = level(name, value, is_old);
            check(name, &project.job(&lines, is_old), &|p| cell(name, p, 0.5, t, is_old));
            let lines = lines.replace("val: 0.3", "val: 0");
            let at: Vec<_> = middles(23).collect();
            let found = values(&project.job(&lines, is_old), &at);
            for (point, found) in at.iter().zip(found) {
                let t = level(name, feature(*point), is_old);
                let expected = cell(name, *point, 0.5, t, is_old);
                assert!(expected.abs() < 1e-9 || (found < 0.0) == (expected < 0.0), "{name}");
            }
        }
    }
}

#[test]
fn volume_fractions_are_those_of_the_fits() {
    // Of the level by the fits of 2024, worked out by hand, and of the share that such a level has by
    // the catalogue: a gyroid sheet of |f| <= 0.4638 fills 0.30, a network of f <= -0.6165 too.
    let project = Project::new();
    let fraction = |lines: &str| {
        let job = project.job(lines, false);
        let totals = job.totals(&Settings::with_spacing(1.0 / 128.0), &Progress::new()).unwrap();
        totals.volume
    };
    let sheet = "lt_type: sheet_gyroid\nlt_size: 0.5\nlt_feature: volumeFraction\nlt_feature_val: ";
    // 1.5486 v - 0.0486 v^2 = 0.4638 at v = 0.30241.
    assert!((fraction(&format!("{sheet}0.30241")) - 0.3).abs() < 3e-3);
    let network = sheet.replace("sheet_", "");
    // 3 v - 1.5 = -0.6165 at v = 0.2945.
    assert!((fraction(&format!("{network}0.2945")) - 0.3).abs() < 3e-3);
    let void = format!("{network}0.2945\nlt_type_side: void");
    assert!((fraction(&void) - 0.7).abs() < 3e-3);
}

#[test]
fn scaffolder_s_documented_runs_have_their_porosities() {
    // Its documentation fills a cube of 20 by `gyroid,0.6283,0.61`: the level set holds 0.302.
    let cube = job("box scale 10 scaffolder:gyroid,0.6283,0.61");
    let totals = cube.totals(&Settings::with_spacing(0.2), &Progress::new()).unwrap();
    assert!((totals.relative_density - 0.302).abs() < 1e-3, "{}", totals.relative_density);
    // Its tutorial fills a ball of radius 0.9995 at angular frequency 12 and reports porosities, of
    // meshes that were smoothed five times.
    let ball = 4.0 / 3.0 * PI * 0.9995_f64.powi(3);
    for (level, porosity) in
        [(0.0, 0.508), (0.265, 0.597), (0.3125, 0.613), (0.375, 0.634), (0.5, 0.67), (1.0, 0.85)]
    {
        let text = format!("sphere scale 0.9995 scaffolder:gyroid,12,{level},100");
        let mesh = job(&text).mesh(&Settings::with_spacing(0.02)).unwrap();
        assert_sound(&text, &mesh);
        let found = 1.0 - volume(&mesh) / ball;
        assert!((found - porosity).abs() < 0.02, "{level}: {found} is not {porosity}");
    }
}

#[test]
fn every_surface_of_scaffolder_makes_a_sound_mesh() {
    for name in [
        "rectlinear",
        "schwarzp",
        "double-p",
        "schwarzd",
        "double-d",
        "gyroid",
        "double-gyroid",
        "lidinoid",
        "neovius",
        "schoen_iwp",
        "bcc",
        "tubular_g_ab",
        "tubular_g_c",
    ] {
        assert!(scaffolder::convert(name).is_ok());
        let text = format!("box scaffolder:{name},6.2831853,0.1");
        let mesh = job(&text).mesh(&Settings::with_spacing(0.05)).unwrap();
        assert_sound(name, &mesh);
        assert!(volume(&mesh) > 0.1, "{name}");
    }
}

fn alveole(folder: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_alveole");
    Command::new(program).current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const CONFIG: &str = "files:\n  stl: the part.stl\n  fap: values.fap\n\
                      lt_type: sheet_diamond\nlt_size: 0.5\n\
                      lt_feature: volumeFraction\nlt_feature_val: 0\nme_mesher: CGAL\n";

#[test]
fn a_configuration_is_an_operand_and_converts_to_a_program_that_makes_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let run = |arguments: &[&str]| {
        let output = alveole(folder.path(), arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        output
    };
    run(&["mesh", "-q", "-s", "0.25", "-o", "the part.stl", "box", "scale", "0.5"]);
    fs::write(at("values.fap"), "-0.5,0,0,0.2\n0.5,0,0,0.4\n").unwrap();
    fs::write(at("config.yml"), CONFIG).unwrap();
    let output = run(&["mesh", "-s", "0.05", "-o", "a.ply", "config.yml"]);
    let said = text(&output.stderr);
    assert!(said.contains("`config.yml`: read as a configuration of ASLI of 2024"), "{said}");
    assert!(said.contains("the grid and -o the file: me_mesher\n"), "{said}");
    let output = run(&["convert", "config.yml"]);
    let expected = "'the part.stl'\n\
                    d-surface scale 0.5 shell '((abs((clamp([values.fap],0,1)*(0.7912+";
    assert!(text(&output.stdout).starts_with(expected), "{}", text(&output.stdout));
    fs::write(at("program"), output.stdout).unwrap();
    run(&["mesh", "-s", "0.05", "-o", "b.ply", "@program"]);
    assert!(fs::read(at("a.ply")).unwrap() == fs::read(at("b.ply")).unwrap());
    run(&["mesh", "-q", "-s", "0.05", "-o", "c.ply", "config.yml", "sphere", "scale", "0.4"]);
    let quiet = run(&["convert", "-q", "scaffolder:schwarzd,3.14,0.2", "box"]);
    assert_eq!(text(&quiet.stdout), "d-surface erode 0.2 scale tau/3.14\nbox\n");
    assert!(quiet.stderr.is_empty());
}

#[test]
fn faults_of_inputs_have_codes_and_cures() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let check = |arguments: &[&str], code: i32, expected: &str| {
        let output = alveole(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        let said = text(&output.stderr);
        assert!(said.contains(expected), "{said}");
    };
    check(&["convert", "config.yml"], 1, "can't read the configuration `config.yml`: No such file");
    fs::write(at("config.yml"), format!("{CONFIG}lt_sise: 2\n")).unwrap();
    check(
        &["mesh", "config.yml"],
        1,
        "can't read the configuration `config.yml`: line 9, column 1: ASLI has no key `lt_sise`; \
         did you mean `lt_size`?",
    );
    fs::write(at("config.yml"), CONFIG.replace("the part.stl", "p.stl")).unwrap();
    check(&["mesh", "config.yml"], 1, "can't read the mesh `p.stl`");
    check(&["mesh", "config.yml"], 1, "--> config.yml as a program:1:1");
    fs::write(at("values.fap"), "0,0,0,1\n0,0,1\n").unwrap();
    check(
        &["mesh", "box", "dilate", "[values.fap]"],
        1,
        "can't read the points `[values.fap]`: line 2, column 1: the line has 3 parts",
    );
    check(&["mesh", "box", "scaffolder:gyriod,1"], 2, "help: did you mean `gyroid`?");
    check(&["mesh", "box", "dilate", "[x+1]"], 2, "help: write `[FILE.fap]`");
    check(&["mesh", "-s", "[values.fap]", "box"], 2, "can't depend on `[values.fap]`");
}

#[test]
fn a_server_reads_no_files_through_inputs_that_it_may_not_read_itself() {
    use alveole::job::{Access, Files};
    let project = Project::new();
    project.numbers("a.fap", &vec![([0.0; 3], 0.5), ([0.0, 0.0, 1.0], 0.5)]);
    let lines = "lt_type: gyroid\nlt_size: 0.5\nlt_feature: isovalue\nlt_feature_val: 0";
    drop(project.job(lines, false));
    let words = |word: &str| vec![word.to_owned()];
    let read = |word: &str, access: Access| Job::read(&words(word), &[], Files::with(access));
    let config = project.path("config.yml");
    let job = read(&config, Access::Regular).unwrap();
    let files = ["config.yml", "cube.stl", "a.fap"].map(|name| project.path(name));
    assert_eq!(job.files(), files);
    assert!(read(&config, Access::Nothing).is_err());
    let points = format!("[{}]", project.path("a.fap"));
    assert!(read(&points, Access::Regular).is_ok() && read(&points, Access::Nothing).is_err());
}

/// Numbers from `least` to `most` at random points about the cube.
fn random_points(random: &mut Uniform, least: f64, most: f64) -> Points {
    let count = 1 + (random.next() * 30.0) as usize;
    let mut at = || std::array::from_fn(|_| 1.2 * random.next() - 0.6);
    let at: Vec<[f64; 3]> = (0..count).map(|_| at()).collect();
    at.into_iter().map(|p| (p, least + (most - least) * random.next())).collect()
}

#[test]
fn random_configurations_keep_the_promises_of_every_program() {
    const TYPES: [&str; 10] = [
        "gyroid",
        "sheet_gyroid",
        "diamond",
        "sheet_diamond",
        "primitive",
        "sheet_primitive",
        "IWP",
        "sheet_IWP",
        "cubic",
        "hybrid",
    ];
    let mut meshes = 0;
    for seed in 0..40 {
        let mut random = Uniform(seed);
        let project = Project::new();
        let kind = if random.next() < 0.4 { "hybrid" } else { random.pick(&TYPES) };
        let feature = random.pick(&["isovalue", "volumeFraction", "wallSize", "poreSize"]);
        let size = random.pick(&["0", "0.5", "-2.5"]);
        let value = random.pick(&["0", "0.3"]);
        let mode = random.pick(&["absolute", "relative"]);
        let radius = random.pick(&["0", "0.5", "1"]);
        project.numbers("a.sap", &random_points(&mut random, 0.4, 0.8));
        project.numbers("a.fap", &random_points(&mut random, 0.1, 0.6));
        let points = random_points(&mut random, 0.0, 1.0);
        let lines: String = points.iter().fold(String::new(), |mut text, ([x, y, z], _)| {
            let kind = random.pick(&TYPES[..9]);
            writeln!(text, "{x},{y},{z},{kind}").unwrap();
            text
        });
        fs::write(project.path("a.tap"), lines).unwrap();
        let lines = format!(
            "lt_type: {kind}\nlt_type_filterRadius: {radius}\nlt_size: {size}\n\
             lt_feature: {feature}\nlt_feature_val: {value}\nlt_feature_mode: {mode}"
        );
        let name = format!("seed {seed}: {lines}");
        let job = project.job(&lines, random.next() < 0.5);
        let settings = |pruning| Settings { pruning, ..Settings::with_spacing(1.0 / 18.0) };
        match (job.mesh(&settings(Pruning::Intervals)), job.mesh(&settings(Pruning::None))) {
            (Ok(sparse), Ok(dense)) => {
                assert_sound(&name, &sparse);
                assert_eq!(sparse, dense, "{name}");
                meshes += 1;
            }
            (Err(_), Err(_)) => {}
            (sparse, dense) => panic!("{name}: {:?}, {:?}", sparse.is_ok(), dense.is_ok()),
        }
        for step in [0.003, 0.02] {
            let start = std::array::from_fn(|_| random.next() - 0.5);
            assert_ranges_hold(&name, &job, start, step);
        }
    }
    assert!(meshes >= 30, "{meshes} solids are not empty");
}
