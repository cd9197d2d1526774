//! `alveole check`: whether a mesh file bounds a solid, and its numbers.

use super::args::CheckArguments;
use super::report::{self, Trouble};
use super::stats;
use super::table::Table;
use crate::mesh::check::{Check, check};
use crate::mesh::io::{self, ReadReport};
use crate::mesh::measure::{Measures, measure};
use crate::num::Progress;

#[derive(serde::Serialize)]
struct Findings<'a> {
    sound: bool,
    closed: bool,
    oriented: bool,
    manifold: bool,
    reading: &'a ReadReport,
    #[serde(flatten)]
    measures: &'a Measures,
    check: &'a Check,
}

/// Prints what a mesh file holds; fails with code 1 if it does not bound a solid.
pub(super) fn run(arguments: &CheckArguments) -> Result<(), Trouble> {
    let CheckArguments { mesh: path, json } = arguments;
    let (mesh, reading) = io::read_with(path, &Progress::new())?;
    let (check, measures) = (check(&mesh), measure(&mesh));
    let sound = check.is_sound();
    let text = if *json {
        let (closed, oriented, manifold) =
            (check.is_closed(), check.is_oriented(), check.is_manifold());
        stats::json(&Findings {
            sound,
            closed,
            oriented,
            manifold,
            reading: &reading,
            measures: &measures,
            check: &check,
        })
    } else {
        let mut table = Table::default();
        table.text("bounds a solid", if sound { "yes" } else { "no" });
        table.text("format", reading.format.name());
        table.text("faces in the file", &reading.faces.to_string());
        if reading.dropped > 0 {
            table.text("faces dropped", &reading.dropped.to_string());
        }
        if reading.welded > 0 {
            table.text("vertices welded", &reading.welded.to_string());
        }
        table.number("volume", measures.volume);
        table.measures(&measures);
        table.check(&check);
        table.render()
    };
    report::print(&text);
    if sound { Ok(()) } else { Err(Trouble::Defects) }
}
