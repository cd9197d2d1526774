//! What the acceptance tests share: a program's mesh, held to the promises of every mesh.

#![allow(dead_code, reason = "each test crate uses a part")]

use alveole::job::{Job, Settings};
use alveole::mesh::Mesh;
use alveole::mesh::check::check;
use alveole::mesh::measure::volume;

/// The job of a program text.
#[track_caller]
pub fn job(text: &str) -> Job {
    Job::parse(text).unwrap_or_else(|fault| panic!("{text}: {fault}"))
}

/// The mesh of a program text at one spacing: closed, oriented, manifold, without zero areas.
#[track_caller]
pub fn sound_mesh(text: &str, spacing: f64) -> Mesh {
    let made = job(text).mesh(&Settings::with_spacing(spacing));
    let mesh = made.unwrap_or_else(|fault| panic!("{text}: {fault}"));
    assert_sound(text, &mesh);
    mesh
}

/// Holds a mesh to the promises of every mesh.
#[track_caller]
pub fn assert_sound(name: &str, mesh: &Mesh) {
    let found = check(mesh);
    assert!(found.is_sound(), "{name}: {:?}", found.defects);
}

/// The volume of the sound mesh of a program text.
#[track_caller]
pub fn sound_volume(text: &str, spacing: f64) -> f64 {
    volume(&sound_mesh(text, spacing))
}
