//! The gallery of the README, and its cell of one's own: every command runs as written and makes what it promises.
#![allow(clippy::unwrap_used)]

use alveole::mesh::check::check;
use alveole::mesh::io;
use alveole::num::Progress;
use std::path::Path;
use std::process::Command;

/// The lines between the markers of the README that are commands of a shell.
fn commands() -> Vec<&'static str> {
    let readme = include_str!("../README.md");
    let (_, rest) = readme.split_once("<!-- gallery:").unwrap();
    let (gallery, _) = rest.split_once("<!-- end of gallery -->").unwrap();
    let (_, block) = gallery.split_once("```sh\n").unwrap();
    let (block, _) = block.split_once("```").unwrap();
    block.lines().filter(|line| !line.starts_with('#')).collect()
}

/// Runs `command` in `folder` as a shell does that has the program on its path.
#[cfg(unix)]
#[track_caller]
fn run(folder: &Path, command: &str) {
    let program = Path::new(env!("CARGO_BIN_EXE_alveole"));
    let found = std::env::var_os("PATH").unwrap_or_default();
    let folders = [program.parent().unwrap().to_owned()].into_iter();
    let path = std::env::join_paths(folders.chain(std::env::split_paths(&found))).unwrap();
    let mut shell = Command::new("sh");
    let output = shell.arg("-c").arg(command).current_dir(folder).env("PATH", &path).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
}

#[cfg(unix)]
#[test]
fn the_cell_of_ones_own_works_as_written() {
    let readme = include_str!("../README.md");
    let (_, rest) = readme.split_once("<!-- cell:").unwrap();
    let (example, _) = rest.split_once("<!-- end of cell -->").unwrap();
    let (_, block) = example.split_once("```sh\n").unwrap();
    let (block, _) = block.split_once("```").unwrap();
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), block);
    let (mesh, _) = io::read_with(&folder.path().join("mine.ply"), &Progress::new()).unwrap();
    let found = check(&mesh);
    assert!(found.is_sound(), "{:?}", found.defects);
    assert!(mesh.triangles.len() > 1000);
}

#[cfg(unix)]
#[test]
fn every_command_of_the_gallery_runs_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut made = 0;
    for command in commands() {
        run(folder.path(), command);
        let name = command.split_once("-o ").and_then(|(_, rest)| rest.split_once(' '));
        let Some((name, _)) = name else { continue };
        assert!(folder.path().join(name).is_file(), "{command}");
        if !io::is_mesh_path(Path::new(name)) {
            continue;
        }
        let (mesh, _) = io::read_with(&folder.path().join(name), &Progress::new()).unwrap();
        let found = check(&mesh);
        assert!(found.is_sound(), "{command}: {:?}", found.defects);
        made += 1;
    }
    assert_eq!(made, 16);
}
