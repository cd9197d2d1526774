//! Parameters of programs: a value given later is as good as a number in the text.
#![allow(clippy::unwrap_used, reason = "tests may")]

use alveole::geom::Aabb;
use alveole::job::{Error, Job, Settings};
use alveole::lang::Diagnostic;
use alveole::mesh::Mesh;
use alveole::num::Progress;
use glam::DVec3;

/// The spacing of every mesh here.
const SPACING: f64 = 0.11;

fn mesh(job: &Job) -> Mesh {
    job.mesh(&Settings::with_spacing(SPACING)).unwrap()
}

/// The faults of a refused change.
fn faults(result: Result<(), Error>) -> Vec<Diagnostic> {
    match result {
        Err(Error::Program(rejected)) => rejected.diagnostics,
        other => panic!("{other:?}"),
    }
}

/// `text` with values given one after the other has the mesh of the text with the number.
#[track_caller]
fn check(text: &str, values: &[&str]) {
    let mut job: Option<Job> = None;
    for value in values {
        let number = alveole::lang::numbers(value, "a value", &[]).unwrap()[0];
        let job = match &mut job {
            Some(job) => {
                job.set_parameter("p", number).unwrap();
                job
            }
            None => job.insert(Job::parse_with(text, &[("p", number)]).unwrap()),
        };
        let written: Vec<_> =
            alveole::lang::words::of(text).unwrap().iter().map(|w| with(w, value)).collect();
        let plain = Job::new(&written).unwrap();
        assert_eq!(job.bounds().unwrap(), plain.bounds().unwrap(), "{text} at {value}");
        assert_eq!(mesh(job), mesh(&plain), "{text} at {value}");
        assert_eq!(job.parameters(), [("p".to_owned(), number)]);
    }
}

/// `word` with `value` in the place of the name `p`.
fn with(word: &str, value: &str) -> String {
    // The name stands alone where no other letter touches it.
    let letters: Vec<char> = word.chars().collect();
    let is_letter = |i: Option<usize>| {
        i.and_then(|i| letters.get(i)).is_some_and(|c| c.is_ascii_alphanumeric())
    };
    let piece = |(i, c): (usize, &char)| match c {
        'p' if !is_letter(i.checked_sub(1)) && !is_letter(Some(i + 1)) => format!("({value})"),
        _ => c.to_string(),
    };
    letters.iter().enumerate().map(piece).collect()
}

#[test]
fn offsets_walls_and_motions_follow_their_parameter() {
    check("gyroid dilate p cube", &["0.35", "-0.2", "0"]);
    check("gyroid erode p/2 cube", &["0.35", "0.1"]);
    check("gyroid shell 2*p cube", &["0.2", "0.45"]);
    check("cube scale p,1,2*p", &["0.5", "-1.25", "2"]);
    check("cube move p,0,-p", &["3", "-0.25"]);
    check("cube rotate p 1,2,3", &["0.3", "2"]);
    check("cube rotate 0.4 p,0,1", &["0.5", "-2"]);
}

#[test]
fn shapes_and_equations_follow_their_parameter() {
    check("torus minor p/4 major 0.8", &["1", "0.5"]);
    check("cone height p radius 0.5", &["1", "2"]);
    check("octahedron radius p", &["1", "0.75"]);
    check("'sin(3*x)+p*y*z-p/3' cube", &["0.5", "-1"]);
    check("'max(x+p,-y,z*p)' cube", &["0.25", "-1"]);
}

#[test]
fn bounds_and_default_spacing_follow_the_parameter() {
    let mut job = Job::parse_with("box scale s", &[("s", 1.0)]).unwrap();
    for size in [1.0, 3.0, 0.25] {
        job.set_parameter("s", size).unwrap();
        let half = DVec3::splat(size);
        assert_eq!(job.bounds().unwrap(), Aabb::new(-half, half));
        let grid = job.grid(&Settings::default()).unwrap();
        assert_eq!(grid.cells(), [100; 3]);
    }
}

#[test]
fn warnings_of_thin_walls_follow_the_parameter() {
    let mut job = Job::parse_with("'x' shell t box", &[("t", 0.5)]).unwrap();
    for thickness in [0.5, 0.15] {
        job.set_parameter("t", thickness).unwrap();
        let settings = Settings::with_spacing(SPACING);
        let report = job.measure(&settings, &Progress::new()).unwrap().report;
        let walls = report.walls.unwrap();
        assert!((walls.minimum - thickness).abs() < 1e-9, "{walls:?}");
        assert_eq!(walls.thin_fraction > 0.0, thickness < 2.0 * SPACING);
    }
}

#[test]
fn envelopes_follow_the_parameter() {
    let mut job = Job::parse_with("gyroid box scale s", &[("s", 1.0)]).unwrap();
    job.set_parameter("s", 0.5).unwrap();
    let measures = job.measure(&Settings::with_spacing(SPACING), &Progress::new()).unwrap();
    assert!((measures.envelope_volume.unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn values_without_sense_are_refused_and_change_nothing() {
    let text = "gyroid scale s shell t box";
    let mut job = Job::parse_with(text, &[("s", 1.0), ("t", 0.5)]).unwrap();
    let before = mesh(&job);
    let refused = |job: &mut Job, name: &str, value: f64, words: &[&str]| {
        let faults = faults(job.set_parameter(name, value));
        let said = format!("{} {:?} {:?}", faults[0].message, faults[0].labels, faults[0].cure);
        for word in words {
            assert!(said.contains(word), "`{word}` is not in: {said}");
        }
    };
    refused(&mut job, "s", 0.0, &["`factor` of `scale` must not be zero", "`s` is 0"]);
    refused(&mut job, "t", -1.0, &["`thickness` of `shell` must not be negative", "`t` is -1"]);
    refused(&mut job, "s", f64::NAN, &["`s` must be a finite number"]);
    refused(&mut job, "t", f64::INFINITY, &["`t` must be a finite number"]);
    refused(&mut job, "r", 1.0, &["no parameter `r`", "`s`", "`t`"]);
    assert_eq!(faults(job.set_parameters(&[("s", 2.0), ("t", -2.0)])).len(), 1);
    assert_eq!(job.parameters(), [("s".to_owned(), 1.0), ("t".to_owned(), 0.5)]);
    assert_eq!(mesh(&job), before);
}

#[test]
fn values_are_changed_together() {
    // Neither change alone is allowed.
    let mut job = Job::parse_with("box scale a-b", &[("a", 2.0), ("b", 1.0)]).unwrap();
    assert!(job.set_parameter("a", 1.0).is_err());
    job.set_parameters(&[("a", 1.0), ("b", 0.5)]).unwrap();
    assert_eq!(job.bounds().unwrap().hi, DVec3::splat(0.5));
}

#[test]
fn unused_parameters_are_known() {
    let job = Job::parse_with("gyroid dilate t box", &[("a", 1.0), ("t", 0.0), ("b", 2.0)]);
    assert_eq!(job.unwrap().unused_parameters(), ["a", "b"]);
}
