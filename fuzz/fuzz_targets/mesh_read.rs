//! Mesh files: whatever the bytes, either a fault that says where, or a mesh that all else can use.
//!
//! The bytes are read under every extension and none. A mesh that comes out is checked, measured,
//! welded, written in every format and read back, and asked for its distance.
#![no_main]

use alveole::expr::{Oracle, Queries};
use alveole::field::mesh_distance;
use alveole::mesh::io::{self, Format, Precision};
use alveole::mesh::{Mesh, check, measure, weld};
use libfuzzer_sys::fuzz_target;
use std::hint::black_box;

/// Most triangles of a mesh whose distance is asked for.
const MOST_TRIANGLES: usize = 500;

fuzz_target!(|bytes: &[u8]| {
    let mut last: Option<Mesh> = None;
    for declared in Format::ALL.map(Some).into_iter().chain([None]) {
        match io::read_bytes("fuzz", bytes, declared) {
            Ok((mesh, report)) => {
                assert!(report.faces > 0, "{report:?}");
                // Most bytes are one format whatever they are called: one look is enough.
                if last.as_ref().is_none_or(|last| bits(last) != bits(&mesh)) {
                    examine(&mesh);
                    last = Some(mesh);
                }
            }
            Err(error) => assert!(error.to_string().starts_with("fuzz")),
        }
    }
});

/// A mesh's numbers, comparable.
fn bits(mesh: &Mesh) -> (Vec<[u64; 3]>, &[[u32; 3]]) {
    (mesh.positions.iter().map(|p| p.map(f64::to_bits)).collect(), &mesh.triangles)
}

fn examine(mesh: &Mesh) {
    let found = check(mesh);
    assert_eq!(found.triangles, mesh.triangles.len() as u64);
    let defects = &found.defects;
    assert_eq!(defects.bad_index.count + defects.repeated_corner.count, 0, "{found:?}");
    assert_eq!(defects.not_finite.count, 0, "{found:?}");
    black_box(measure(mesh));
    black_box(weld(&mut mesh.clone()));
    for precision in [Precision::Double, Precision::Single] {
        for format in Format::ALL {
            write_and_read_back(mesh, format, precision);
        }
    }
    if mesh.triangles.len() <= MOST_TRIANGLES
        && let Ok(distance) = mesh_distance(mesh, "fuzz")
    {
        let (mut value, at) = ([0.0; 3], [0.0, 0.5, -1e3]);
        let queries = Queries { at: [&at, &at, &at], value: &mut value, gradient: None };
        distance.points(queries).expect("the distance to a mesh has an answer everywhere");
        assert!(value.iter().all(|value| !value.is_nan()), "{value:?}");
    }
}

/// Writes `mesh` and reads it again: in double precision it comes back as it was.
fn write_and_read_back(mesh: &Mesh, format: Format, precision: Precision) {
    let mut file = Vec::new();
    if io::write(mesh, format, precision, &mut file).is_err() {
        return;
    }
    let again = io::read_bytes("again", &file, Some(format));
    match precision {
        Precision::Double if !mesh.triangles.is_empty() => {
            let (again, _) = again.unwrap_or_else(|error| panic!("{format:?}: {error}"));
            assert_eq!(bits(&again), bits(mesh), "{format:?}");
        }
        Precision::Double | Precision::Single => drop(black_box(again)),
    }
}
