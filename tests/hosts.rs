//! The same bytes on every host: digests of what programs make, written down on one and compared on
//! all.
//!
//! No other test can tell that x86-64 and aarch64 give the same files: each runs on one of them. So
//! `hosts/digests.txt` has a line of each program, `DIGEST KIND CELLS PROGRAM`, and whoever runs the
//! tests on another processor, or with another compiler, compares. A change of how meshes are made
//! changes digests: to write them anew, run with `ALVEOLE_BLESS=1` and see that no others changed than
//! should. A new line begins with a `?` for the digest.
#![allow(clippy::unwrap_used)]

mod common;

use alveole::cellular::struts::table::CELLS;
use alveole::cellular::tpms::CATALOGUE;
use alveole::eval::Engine;
use alveole::job::{Job, Settings, Slivers};
use alveole::mesh::Mesh;
use alveole::mesh::io::{self, Format, Precision};
use alveole::num::Progress;
use rayon::prelude::*;
use serde_json::json;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn digests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hosts/digests.txt")
}

/// The 64-bit FNV-1a hash: draft-eastlake-fnv, section 2.
fn digest(bytes: &[u8]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}

/// Meshes that programs name: `closed.ply`, and `open.ply` where faces are missing.
struct Meshes(TempDir);

impl Meshes {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = common::sound_mesh("torus rotate 1 1,2,3 gyroid shell 0.8 scale 0.6", 0.09);
        let write = |name: &str, mesh: &Mesh| {
            let mut bytes = Vec::new();
            io::write(mesh, Format::Ply, Precision::Double, &mut bytes).unwrap();
            fs::write(folder.path().join(name), bytes).unwrap();
        };
        write("closed.ply", &mesh);
        mesh.triangles.drain(..20);
        write("open.ply", &mesh);
        Self(folder)
    }

    fn job(&self, program: &str) -> Job {
        let words = program.split_whitespace().map(|word| match word {
            "closed.ply" | "open.ply" => self.0.path().join(word).to_str().unwrap().to_owned(),
            word => word.to_owned(),
        });
        Job::new(&words.collect::<Vec<_>>()).unwrap_or_else(|fault| panic!("{program}: {fault}"))
    }

    /// What a program makes on a grid of so many cells along the longest side, compiled.
    fn made(&self, kind: &str, cells: f64, program: &str) -> Vec<u8> {
        let job = self.job(program);
        let longest = job.bounds().unwrap().size().max_element();
        let mut settings = Settings::with_spacing(longest / cells);
        settings.engine = Engine::Compiled;
        let progress = Progress::new();
        let format = Format::ALL.into_iter().find(|f| f.name().eq_ignore_ascii_case(kind));
        let value = match kind {
            "measures" => {
                let found = job.measure(&settings, &progress).unwrap();
                json!([found.mesh, found.check, found.relative_density, found.envelope_density])
            }
            "structure" => {
                let overhang = alveole::measure::Overhang::default();
                json!(job.structure(&settings, &overhang, &progress).unwrap().1)
            }
            "field" => {
                let found = job.field_measures(&settings, &progress).unwrap();
                json!([found.volume, found.area, found.relative_density, found.envelope_density])
            }
            _ => {
                if kind == "snap" {
                    settings.slivers = Slivers::Removed;
                }
                let mesh = job.mesh(&settings).unwrap_or_else(|fault| panic!("{program}: {fault}"));
                common::assert_sound(program, &mesh);
                let precision = job.grid(&settings).unwrap().precision();
                let mut bytes = Vec::new();
                io::write(&mesh, format.unwrap_or(Format::Ply), precision, &mut bytes).unwrap();
                return bytes;
            }
        };
        value.to_string().into_bytes()
    }
}

/// A line without its digest.
fn case(line: &str) -> &str {
    line.split_once(' ').unwrap().1
}

#[test]
fn files_and_measures_have_the_bytes_of_every_host() {
    let expected = fs::read_to_string(digests()).unwrap();
    let meshes = Meshes::new();
    let lines: Vec<String> = (expected.par_lines())
        .map(|line| {
            let [kind, cells, program] = *case(line).splitn(3, ' ').collect::<Vec<_>>() else {
                panic!("{line}")
            };
            let made = meshes.made(kind, cells.parse().unwrap(), program);
            format!("{:016x} {}", digest(&made), case(line))
        })
        .collect();
    let mut found = String::new();
    lines.iter().for_each(|line| writeln!(found, "{line}").unwrap());
    if std::env::var_os("ALVEOLE_BLESS").is_some() {
        fs::write(digests(), &found).unwrap();
        return;
    }
    let others: Vec<_> =
        found.lines().zip(expected.lines()).filter(|(a, b)| a != b).map(|(a, _)| a).collect();
    assert!(others.is_empty(), "other bytes than written down:\n{}", others.join("\n"));
}

#[test]
fn every_surface_and_every_cell_has_a_line() {
    let text = fs::read_to_string(digests()).unwrap();
    let names = CATALOGUE.iter().map(|row| row.name).chain(CELLS.iter().map(|row| row.name));
    for name in names {
        let has = |line: &str| line.split(' ').any(|word| word == name);
        assert!(text.lines().any(has), "{name} has no line in {}", digests().display());
    }
}

#[test]
fn digests_are_those_of_the_definition() {
    // Test vectors of the draft, appendix C.
    assert_eq!(digest(b""), 0xcbf2_9ce4_8422_2325);
    assert_eq!(digest(b"a"), 0xaf63_dc4c_8601_ec8c);
    assert_eq!(digest(b"foobar"), 0x8594_4171_f739_67e8);
}
