//! Real dirty meshes of the folder that `ALVEOLE_DATA` names, and what the commands report.

use super::damage;
use alveole::job::{Job, Settings};
use alveole::mesh::check;
use alveole::mesh::io::{self, Format, Precision};
use alveole::num::Random;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

#[test]
fn what_is_made_of_any_mesh_is_closed() {
    let Some(folder) = crate::common::real_meshes() else { return };
    let mut made = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.display().to_string();
        // Those that are no meshes are another test's.
        if io::read(&path).is_err() {
            continue;
        }
        // A sheet has no volume, but an offset of it has.
        let words = [name.clone(), "dilate".to_owned(), "1e-9".to_owned()];
        let job = Job::new(&words).unwrap();
        let Ok(bounds) = job.bounds() else { continue };
        let spacing = bounds.size().max_element() / 30.0;
        match job.mesh(&Settings::with_spacing(spacing)) {
            Ok(mesh) => {
                let found = check(&mesh);
                assert!(found.is_sound(), "{name}: {:?}", found.defects);
                made += 1;
            }
            Err(alveole::job::Error::Empty { .. }) => {}
            Err(error) => panic!("{name}: {error}"),
        }
    }
    assert!(made > 35, "{made} meshes");
}

fn alveole(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_alveole"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_report_says_what_was_found_and_assumed_on_stderr_and_in_json() {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = damage::clean("torus", 0.1);
    let turned = damage::flips(&mut mesh, 0.2, Random::new(1, 0));
    let repeated = damage::duplicates(&mut mesh, 0.2, Random::new(1, 1));
    let mut file = Vec::new();
    io::write(&mesh, Format::Ply, Precision::Double, &mut file).unwrap();
    std::fs::write(folder.path().join("dirty.ply"), file).unwrap();

    let checked = alveole(folder.path(), &["check", "--json", "dirty.ply"]);
    assert_eq!(checked.status.code(), Some(1));
    let found = json(&checked);
    assert_eq!((&found["sound"], &found["oriented"]), (&false.into(), &false.into()));
    assert_eq!(found["check"]["defects"]["duplicate"]["count"], repeated);
    let part = &found["as_part"];
    assert_eq!(part["method"], "pseudonormals");
    assert_eq!(part["reason"]["is"], "clean");
    assert_eq!(part["repairs"]["repeated_faces"], repeated);
    assert_eq!(part["repairs"]["turned_faces"], turned);
    let text = alveole(folder.path(), &["check", "dirty.ply"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    let sentence = format!("{repeated} repeated faces left out, {turned} faces turned over");
    assert!(text.contains(&sentence), "{text}");

    let program = ["-s", "0.1", "dirty.ply"];
    let meshed = alveole(folder.path(), &[&["mesh", "--stats", "s.json"][..], &program].concat());
    assert!(meshed.status.success());
    assert!(String::from_utf8_lossy(&meshed.stderr).contains(&sentence));
    let stats: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["meshes"][0]["file"], "dirty.ply");
    assert_eq!(&stats["meshes"][0]["distance"], part);
    assert_eq!(stats["meshes"][0]["reading"]["faces"], mesh.triangles.len());
    let measured = json(&alveole(folder.path(), &[&["measure", "--json"][..], &program].concat()));
    assert_eq!(&measured["report"]["meshes"][0]["distance"], part);
}
