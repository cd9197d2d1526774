//! `alveole check`: whether a mesh file bounds a solid, its numbers, and what programs make of it.

use super::args::CheckArguments;
use super::report::{self, Trouble};
use super::stats;
use super::table::Table;
use crate::field;
use crate::mesh::check::{Check, check};
use crate::mesh::io::{self, ReadReport};
use crate::mesh::measure::{Measures, measure};
use crate::num::Progress;

#[derive(serde::Serialize)]
struct Findings<'a> {
    file: &'a str,
    sound: bool,
    closed: bool,
    oriented: bool,
    manifold: bool,
    reading: &'a ReadReport,
    /// What programs that name the file make of it; absent where they refuse it, and where it has
    /// more than [`MOST_JUDGED`] triangles.
    as_part: Option<&'a field::Report>,
    #[serde(flatten)]
    measures: &'a Measures,
    check: &'a Check,
}

/// Triangles up to which it is told what programs make of a mesh: preparing its distance takes six
/// times as long as reading and checking it.
const MOST_JUDGED: usize = 1 << 20;

/// Prints what a mesh file holds; fails with code 1 if it does not bound a solid.
pub(super) fn run(arguments: &CheckArguments) -> Result<(), Trouble> {
    let CheckArguments { mesh: path, json } = arguments;
    let (mesh, reading) = io::read_with(path, &Progress::new())?;
    let (check, measures) = (check(&mesh), measure(&mesh));
    let sound = check.is_sound();
    let name = path.display().to_string();
    let is_judged = mesh.triangles.len() <= MOST_JUDGED;
    let part = is_judged.then(|| field::mesh_distance(&mesh, &name));
    let text = if *json {
        let (closed, oriented, manifold) =
            (check.is_closed(), check.is_oriented(), check.is_manifold());
        stats::json(&Findings {
            file: &name,
            sound,
            closed,
            oriented,
            manifold,
            reading: &reading,
            as_part: part.as_ref().and_then(|part| part.as_ref().ok()).map(|part| part.report()),
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
        let judgement = match &part {
            Some(Ok(part)) => part.report().to_string(),
            Some(Err(error)) => format!("refused: {error}"),
            None => format!("not looked at: more than {MOST_JUDGED} triangles"),
        };
        table.text("as a part of a program", &judgement);
        for ignored in &reading.ignored {
            table.text("ignored", ignored);
        }
        table.number("volume", measures.volume);
        table.measures(&measures);
        table.check(&check);
        table.render()
    };
    report::print(&text)?;
    if sound { Ok(()) } else { Err(Trouble::Defects) }
}
