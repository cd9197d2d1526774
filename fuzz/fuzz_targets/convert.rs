//! Inputs of other tools: whatever the bytes, either a fault that says where, or a program that reads.
//!
//! The text is read as a configuration of ASLI, as a line of Scaffolder and as a file of points. Of few
//! points the field is made; its ranges hold its numbers.
#![no_main]

use alveole::expr::Oracle;
use alveole::field::scattered::file::{Sign, numbers, types};
use alveole::field::scattered::types::weights;
use alveole::field::scattered::{Data, Scale, Scattered, scattered};
use alveole::geom::Aabb;
use alveole::job::convert::{Converted, asli, scaffolder, yaml};
use alveole::lang::{self, Loaded, Loader, Refusal};
use alveole::num::Interval;
use alveole::vocabulary::Words;
use glam::DVec3;
use libfuzzer_sys::fuzz_target;
use std::sync::Arc;

/// Most points of which a field is made.
const MOST_POINTS: usize = 60;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    if let Err(fault) = yaml::entries(&text) {
        assert!(!fault.to_string().is_empty());
    }
    match asli::convert(&text, &mut Files) {
        Ok(converted) => check_program(&converted, true),
        Err(fault) => assert!(!fault.to_string().is_empty()),
    }
    let line = text.lines().next().unwrap_or_default();
    match scaffolder::convert(line) {
        Ok(converted) => check_program(&converted, false),
        Err(fault) => assert!(line.get(fault.place).is_some() && !fault.cure.is_empty()),
    }
    match numbers(&text, Sign::Any) {
        Ok(data) if data.at.len() <= MOST_POINTS => {
            for scale in [Scale::Plain, Scale::Reciprocal] {
                if let Ok(field) = scattered(&data, scale, "points") {
                    check_field(&data, &field);
                }
            }
        }
        Ok(_) => {}
        Err(fault) => assert!(!fault.to_string().is_empty()),
    }
    if let Ok(data) = types(&text)
        && data.at.len() <= MOST_POINTS
    {
        let radii = vec![0.5; data.at.len()];
        if let Ok(fields) = weights(&data, &radii, "points") {
            assert_eq!(fields.len(), data.names.len());
        }
    }
});

/// The program has words that the language knows; a whole one makes a bounded solid.
fn check_program(converted: &Converted, is_whole: bool) {
    let words = lang::words::of(&converted.text).expect("quotes are closed");
    match lang::parse(&words, &Words, &mut Files, &[]) {
        Ok(program) => {
            let printed = lang::format(&program.items, &Words);
            let again = lang::parse(&printed, &Words, &mut Files, &[]).expect("it reads again");
            assert_eq!(program.items, again.items, "{printed:?}");
            let is_bounded = program.solid.finite_bounds(&program.graph, &[]).is_ok();
            assert!(is_bounded || !is_whole || has_extremes(&converted.text), "{}", converted.text);
        }
        // Numbers may be too large or too small for what they are to be.
        Err(rejected) => assert!(has_extremes(&converted.text), "{}: {rejected}", converted.text),
    }
}

/// Whether a number has digits enough to be lost in, or overflow, what it is used for.
fn has_extremes(text: &str) -> bool {
    let is_long = |digits: &str| digits.len() > 12;
    text.split(|c: char| !c.is_ascii_digit()).any(is_long) || text.contains("inf")
}

/// The field's ranges hold its numbers, at the points and about them.
fn check_field(data: &Data, field: &Scattered) {
    for point in data.at.iter().take(8) {
        for size in [0.0, 1e-3, 10.0] {
            let at = point.map(|c| Interval::new(c - size, c + size));
            let range = field.range(at);
            assert!(range.contains(field.value(*point)), "{range:?}");
            let corner = point.map(|c| c + size);
            assert!(range.contains(field.value(corner)), "{range:?}");
        }
    }
}

/// Files that exist in memory only: every mesh is a cube, every file of points has two types.
struct Files;

impl asli::Answers for Files {
    fn bounds(&mut self, _: &str) -> Result<Aabb, Refusal> {
        Ok(Aabb::new(DVec3::ZERO, DVec3::ONE))
    }

    fn types(&mut self, _: &str) -> Result<Vec<String>, Refusal> {
        Ok(["gyroid", "sheet_IWP", "cubic"].map(str::to_owned).to_vec())
    }
}

impl Loader for Files {
    fn text(&mut self, _: &str) -> Result<String, Refusal> {
        Err(Refusal { cause: "no such file".to_owned() })
    }

    fn is_mesh(&self, word: &str) -> bool {
        alveole::mesh::io::is_mesh_path(std::path::Path::new(word))
    }

    fn mesh(&mut self, _: &str) -> Result<Loaded, Refusal> {
        let distance = self.points("a.fap")?;
        Ok(Loaded { distance, bounds: Aabb::new(DVec3::ZERO, DVec3::ONE) })
    }

    fn points(&mut self, _: &str) -> Result<Arc<dyn Oracle>, Refusal> {
        let at = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let data = Data { at, values: vec![0.25, 0.5, 0.75, 0.5] };
        let field = scattered(&data, Scale::Plain, "points").expect("the points are apart");
        Ok(Arc::new(field))
    }
}
