//! What the readers of meshes say of damaged files, as exact pictures in `readers.txt`.
//!
//! To write them anew, run with `ALVEOLE_BLESS=1` and read the difference.

use super::files;
use alveole::mesh::io::{self, Format};
use std::fmt::Write;
use std::fs;
use std::path::Path;

#[test]
fn every_damaged_file_is_refused_in_these_words() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_input/readers.txt");
    let mut found = String::new();
    for (name, content) in files::damaged() {
        let declared = Format::from_path(Path::new(&name));
        match io::read_bytes(&name, &content, declared) {
            Ok((mesh, _)) => panic!("{name} gave {} triangles", mesh.triangles.len()),
            Err(error) => writeln!(found, "{error}").unwrap(),
        }
    }
    if std::env::var_os("ALVEOLE_BLESS").is_some() {
        fs::write(&path, &found).unwrap();
    }
    let expected = fs::read_to_string(&path).unwrap();
    for (found, expected) in found.lines().zip(expected.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(found, expected);
}

#[test]
fn every_message_names_the_file_and_a_cure_in_one_line() {
    for (name, content) in files::damaged() {
        let error =
            io::read_bytes(&name, &content, Format::from_path(Path::new(&name))).unwrap_err();
        let message = error.to_string();
        assert!(message.starts_with(&name) && !message.contains('\n'), "{message}");
        assert!(message.len() < 300, "{message}");
        assert!(error.fault.cure().is_some(), "{message}");
    }
}

#[test]
fn the_files_are_refused_for_their_damage_only() {
    for format in files::TEXTS {
        let name = format!("sound.{format}");
        let declared = Format::from_path(Path::new(&name));
        let (mesh, _) = io::read_bytes(&name, &files::sound(format), declared).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 4), "{name}");
    }
    for format in files::BINARIES {
        let content = files::binary(format, ["4", "4"], 1.0, 3);
        let (mesh, _) = io::read_bytes(format, &content, None).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 4), "{format}");
    }
}

#[test]
fn one_line_or_word_of_megabytes_is_taken_in_a_second() {
    let (blanks, word) = (b"1 ".repeat(4 << 20), vec![b'x'; 8 << 20]);
    for format in files::TEXTS {
        for long in [&blanks, &word] {
            let name = format!("long.{format}");
            let declared = Format::from_path(Path::new(&name));
            assert!(io::read_bytes(&name, long, declared).is_err(), "{name}");
            let after = [files::sound(format), long.clone()].concat();
            // Whether it is taken for a part of the mesh or for data after it depends on the format.
            let _ = io::read_bytes(&name, &after, declared);
        }
    }
}

#[test]
fn a_polygon_that_crosses_itself_for_ever_is_refused() {
    let mut content = files::sound("obj");
    content.extend(b"f ");
    content.extend(b"1 2 3 4 ".repeat(100_000));
    let error = io::read_bytes("a.obj", &content, Some(Format::Obj)).unwrap_err().to_string();
    assert!(error.contains("too many corners"), "{error}");
}

#[test]
fn a_header_may_name_any_number_of_things_and_the_report_stays_short() {
    let elements: String = (0..50_000).map(|n| format!("element e{n} 0\n")).collect();
    let content = String::from_utf8(files::sound("ply")).unwrap();
    let content = content.replace("element vertex", &format!("{elements}element vertex"));
    let (_, report) = io::read_bytes("a.ply", content.as_bytes(), Some(Format::Ply)).unwrap();
    assert!(report.ignored.len() <= 32, "{}", report.ignored.len());
    assert_eq!(report.ignored.last().unwrap(), "and more");
}
