//! Mesh files: what is written is read back, other programs' files are read rightly or refused,
//! other readers agree, and no bytes make a reader panic.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod common;

use alveole::mesh::io::{self, Fault, FileSink, Format, Place, Precision, ReadError, ReadReport};
use alveole::mesh::{Mesh, Sink, check, measure, weld};
use alveole::num::Progress;
use proptest::prelude::*;
use std::io::Cursor;
use std::path::Path;

#[path = "formats/data.rs"]
mod data;

/// A closed, irregular mesh whose coordinates need all bits of a double.
fn potato() -> Mesh {
    let n = 24_u32;
    let mut mesh = Mesh { positions: vec![[0.1, 0.2, 1.3e-7]], triangles: Vec::new() };
    for i in 1..n {
        for j in 0..n {
            let theta = std::f64::consts::PI * f64::from(i) / f64::from(n);
            let phi = std::f64::consts::TAU * f64::from(j) / f64::from(n);
            let r = 1.0 + 0.1 * (3.0 * phi).sin() * theta.sin();
            let [x, y] = [r * theta.sin() * phi.cos(), r * theta.sin() * phi.sin()];
            mesh.positions.push([x, y, 1.0 - r * theta.cos()]);
        }
    }
    mesh.positions.push([0.0, 0.0, 2.0]);
    let at = |i: u32, j: u32| 1 + (i - 1) * n + j % n;
    let last = 1 + (n - 1) * n;
    for j in 0..n {
        mesh.triangles.push([0, at(1, j + 1), at(1, j)]);
        for i in 1..n - 1 {
            mesh.triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
        mesh.triangles.push([at(n - 1, j), at(n - 1, j + 1), last]);
    }
    mesh
}

fn bytes(mesh: &Mesh, format: Format, precision: Precision) -> Vec<u8> {
    let mut bytes = Vec::new();
    io::write(mesh, format, precision, &mut bytes).unwrap();
    bytes
}

fn read(bytes: &[u8]) -> Result<(Mesh, ReadReport), ReadError> {
    io::read_bytes("mesh", bytes, None)
}

fn rounded(mesh: &Mesh) -> Mesh {
    let positions = mesh.positions.iter().map(|p| p.map(|v| f64::from(v as f32))).collect();
    Mesh { positions, triangles: mesh.triangles.clone() }
}

#[test]
fn the_sample_bounds_a_solid() {
    let found = check(&potato());
    assert!(found.is_sound(), "{found:?}");
    assert_eq!((found.genus, found.components.len()), (Some(0), 1));
}

#[test]
fn double_precision_survives_with_all_bits_and_in_order() {
    let mut mesh = potato();
    mesh.positions.push([-0.0, 5e-324, f64::MAX]);
    for format in [Format::Obj, Format::Off, Format::Ply] {
        let (back, report) = read(&bytes(&mesh, format, Precision::Double)).unwrap();
        let bits =
            |m: &Mesh| -> Vec<_> { m.positions.iter().flatten().map(|v| v.to_bits()).collect() };
        assert_eq!(bits(&back), bits(&mesh), "{format:?}");
        assert_eq!(back.triangles, mesh.triangles, "{format:?}");
        assert_eq!((report.format, report.dropped), (format, 0));
        assert_eq!(report.ignored, Vec::<String>::new());
    }
}

#[test]
fn single_precision_is_that_of_the_nearest_float() {
    let mesh = potato();
    let expected = rounded(&mesh);
    for format in [Format::Obj, Format::Off, Format::Ply] {
        let (back, _) = read(&bytes(&mesh, format, Precision::Single)).unwrap();
        assert_eq!(rounded(&back), expected, "{format:?}");
    }
    let (back, report) = read(&bytes(&mesh, Format::Stl, Precision::Single)).unwrap();
    assert_eq!(back.triangles.len(), mesh.triangles.len());
    assert_eq!(back.positions.len(), mesh.positions.len());
    assert_eq!(report.welded, 3 * mesh.triangles.len() as u64 - mesh.positions.len() as u64);
    let corners = |m: &Mesh| -> Vec<_> {
        m.triangles.iter().map(|t| t.map(|v| m.positions[v as usize])).collect()
    };
    assert_eq!(corners(&back), corners(&expected));
    assert!(check(&back).is_sound());
}

#[test]
fn a_sink_gives_the_bytes_of_the_writer() {
    let mesh = potato();
    for format in Format::ALL {
        let file = tempfile::NamedTempFile::new().unwrap();
        let folder = file.path().parent().unwrap();
        let mut sink =
            FileSink::new(file.reopen().unwrap(), format, Precision::Single, folder).unwrap();
        let half = mesh.triangles.len() / 2;
        sink.begin(mesh.positions.len() as u64, mesh.triangles.len() as u64).unwrap();
        sink.triangles(half as u64, &mesh.triangles[half..]).unwrap();
        sink.vertices(9, &mesh.positions[9..]).unwrap();
        sink.vertices(0, &mesh.positions[..9]).unwrap();
        sink.triangles(0, &mesh.triangles[..half]).unwrap();
        sink.finish().unwrap();
        let written = std::fs::read(file.path()).unwrap();
        assert!(written == bytes(&mesh, format, Precision::Single), "{format:?}");
    }
    let file = tempfile::tempfile().unwrap();
    let folder = std::env::temp_dir();
    let refused = FileSink::new(file, Format::Stl, Precision::Double, &folder).unwrap_err();
    assert!(refused.to_string().contains("PLY"));
}

#[test]
fn another_reader_of_ply_sees_the_same_mesh() {
    use ply_rs_bw::parser::Parser;
    use ply_rs_bw::ply::{DefaultElement, Property};
    let mesh = potato();
    for precision in [Precision::Single, Precision::Double] {
        let written = bytes(&mesh, Format::Ply, precision);
        let ply = Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(written)).unwrap();
        let expected = if precision == Precision::Single { rounded(&mesh) } else { mesh.clone() };
        let coordinate = |element: &DefaultElement, name: &str| {
            if let Property::Float(value) = element[name] {
                f64::from(value)
            } else if let Property::Double(value) = element[name] {
                value
            } else {
                panic!("{:?}", element[name])
            }
        };
        let positions: Vec<[f64; 3]> = ply.payload["vertex"]
            .iter()
            .map(|vertex| ["x", "y", "z"].map(|name| coordinate(vertex, name)))
            .collect();
        let triangles: Vec<[u32; 3]> = ply.payload["face"]
            .iter()
            .map(|face| {
                let Property::ListInt(list) = &face["vertex_indices"] else { panic!("{face:?}") };
                <[i32; 3]>::try_from(list.as_slice()).unwrap().map(|v| v as u32)
            })
            .collect();
        assert_eq!(Mesh { positions, triangles }, expected);
    }
}

#[test]
fn another_reader_of_stl_sees_the_same_mesh() {
    let mesh = potato();
    let written = bytes(&mesh, Format::Stl, Precision::Single);
    let theirs = stl_io::read_stl(&mut Cursor::new(&written)).unwrap();
    let expected = rounded(&mesh);
    for (face, corners) in theirs.faces.iter().zip(&expected.triangles) {
        let points = corners.map(|v| expected.positions[v as usize]);
        let seen = face.vertices.map(|v| {
            let p = theirs.vertices[v];
            [p[0], p[1], p[2]].map(f64::from)
        });
        assert_eq!(seen, points);
        let [a, b, c] = points.map(glam::DVec3::from_array);
        let normal = (b - a).cross(c - a).normalize();
        let stored = [face.normal[0], face.normal[1], face.normal[2]].map(f64::from);
        assert!((glam::DVec3::from_array(stored) - normal).length() < 1e-6);
    }
    assert_eq!(theirs.faces.len(), mesh.triangles.len());
    theirs.validate().unwrap();
}

#[test]
fn text_stl_of_another_reader_and_ours_agree() {
    let text = b"solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   \
        vertex 0 1 0\n  endloop\n endfacet\nendsolid a\n";
    let theirs = stl_io::read_stl(&mut Cursor::new(&text[..])).unwrap();
    let (ours, _) = read(text).unwrap();
    assert_eq!(theirs.faces[0].vertices.map(|v| v as u32), ours.triangles[0]);
    assert_eq!(theirs.vertices.len(), ours.positions.len());
}

/// A small file, the numbers of its vertices and triangles, and its area.
fn accept(name: &str, content: &[u8], vertices: usize, triangles: usize, area: f64) -> ReadReport {
    let (mesh, report) = match io::read_bytes(name, content, Format::from_path(Path::new(name))) {
        Ok(found) => found,
        Err(error) => panic!("{error}"),
    };
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{name}");
    let found = measure(&mesh).area;
    assert!((found - area).abs() < 1e-12, "{name} has area {found}");
    report
}

/// The text with other line ends.
fn ends(text: &[u8], end: &str) -> Vec<u8> {
    std::str::from_utf8(text).unwrap().replace('\n', end).into_bytes()
}

#[test]
fn odd_obj_files_are_read() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let file = |rest: &str| format!("{square}{rest}").into_bytes();
    accept("plain.obj", &file("f 1 2 3 4"), 4, 2, 1.0);
    accept("negative.obj", &file("f -4 -3 -2 -1\n"), 4, 2, 1.0);
    accept("styles.OBJ", &file("vt 0 0\nvn 0 0 1\nf 1/1 2/1/1 3//1\nf 1/ 3// 4\n"), 4, 2, 1.0);
    accept("forward.obj", b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", 3, 1, 0.5);
    accept("continued.obj", &file("f 1 2 \\\n 3 \\\r\n 4 # all\n"), 4, 2, 1.0);
    accept("returns.obj", &ends(&file("f 1 2 3 4\n"), "\r\n"), 4, 2, 1.0);
    accept("macintosh.obj", &ends(&file("f 1 2 3 4\n"), "\r"), 4, 2, 1.0);
    accept("weights.obj", b"v 0 0 0 2\nv 1 0 0 1 1 1\nv 0 1 0 0.5 # w\nf 1 2 3\n", 3, 1, 0.5);
    accept("missing.obj", &file("mtllib none.mtl\nusemtl\ng f 1 2 3\ng\nf 1 2 3\n"), 4, 1, 0.5);
    accept("unused.obj", b"v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n", 4, 1, 0.5);
    accept("concave.obj", b"v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 2 3 4 1\n", 4, 2, 4.0);
    let report = accept("records.obj", &file("l 1 2\nvt x\nfoo\nbar\nf 1 2 3\nf 1 2\n"), 4, 1, 0.5);
    assert_eq!(report.ignored, ["l", "vt", "other records"]);
    assert_eq!((report.faces, report.dropped), (2, 1));
    let report = accept("repeated.obj", &file("f 1 1 2\nf 1 2 3 3\nf 1 2 3 4 1\n"), 4, 3, 1.5);
    assert_eq!((report.faces, report.polygons, report.dropped), (3, 1, 1));
}

#[test]
fn odd_off_files_are_read() {
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for head in [
        "OFF\n3 1 0\n",
        "OFF 3 1 0\n",
        "OFF3 1 0\n",
        "# c\n\n OFF # c\n\n3 1\n",
        "3 1 0\n",
        "NOFF\n3 1 0\n",
        "STCNOFF 3 1 3\n",
        "\u{feff}OFF\r\n3 1 0\r\n",
    ] {
        accept("a.off", format!("{head}{body}").as_bytes(), 3, 1, 0.5);
    }
    let report = accept(
        "COFF.off",
        b"COFF\n3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1 # red\n0 1 0 1 0 0 1\n3 0 1 2 255 0 0\nx",
        3,
        1,
        0.5,
    );
    let ignored = ["attributes of vertices", "colours of faces", "data after the last face"];
    assert_eq!(report.ignored, ignored);
}

#[test]
fn odd_ply_files_are_read() {
    let head = "ply\nformat ascii 1.0\n";
    let vertices = "element vertex 3\nproperty double y\nproperty uchar q\nproperty float x\n\
        property list uchar int l\nproperty int z\n";
    let faces = "element face 1\nproperty list char short t\nproperty list int uint vertex_index\n";
    let vertex_rows = "0 1 0 0 0\n0 2 1 2 7 7 0\n1 3 0 1 4 0\n";
    let face_rows = " 2 8 9\t3 0 1 2 \n";
    let file = |parts: &[&str]| parts.concat().into_bytes();
    let after = file(&[head, vertices, faces, "end_header\n", vertex_rows, "\n", face_rows]);
    accept("after.ply", &after, 3, 1, 0.5);
    let before = file(&[head, faces, vertices, "end_header\n", face_rows, vertex_rows]);
    let report = accept("before.ply", &before, 3, 1, 0.5);
    assert_eq!(
        report.ignored,
        ["property q of vertex", "property l of vertex", "property t of face"]
    );
    accept("returns.ply", &ends(&after, "\r\n"), 3, 1, 0.5);
    accept("macintosh.ply", &ends(&after, "\r"), 3, 1, 0.5);
    let empty = "element nothing 4000000000\nelement edge 1\nproperty int a\n";
    accept(
        "empty.ply",
        &file(&[head, empty, vertices, faces, "end_header\n5\n", vertex_rows, face_rows]),
        3,
        1,
        0.5,
    );
}

#[test]
fn strips_of_triangles_are_turned_every_other_time() {
    let head = "ply\nformat ascii 1.0\n";
    let vertices = "element vertex 4\nproperty int x\nproperty int y\nproperty int z\n";
    let strips =
        |count: usize| format!("element tristrips {count}\nproperty list int int vertex_indices\n");
    let rows = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    for (count, strip) in [
        (1, "6 1 0 2 3 1 0\n"),
        (1, "15 1 0 2 -1 2 0 3 -1 2 3 1 -1 1 3 0\n"),
        (2, "6 1 0 2 3 -1 0\n4 2 3 1 0\n"),
        // A corner twice changes sides without a triangle.
        (1, "12 1 0 2 3 -1 -1 2 3 1 1 0 3\n"),
    ] {
        let after = [head, vertices, &strips(count), "end_header\n", rows, strip].concat();
        let before = [head, &strips(count), vertices, "end_header\n", strip, rows].concat();
        let (mesh, _) = read(after.as_bytes()).unwrap();
        assert!(check(&mesh).is_sound(), "{strip}: {:?}", mesh.triangles);
        assert!((measure::volume(&mesh) - 1.0 / 6.0).abs() < 1e-15, "{strip}");
        assert_eq!(read(before.as_bytes()).unwrap().0, mesh);
    }
}

#[test]
fn binary_ply_files_are_read_in_both_byte_orders_with_every_type() {
    let head = |order: &str| {
        format!(
            "ply\nformat binary_{order}_endian 1.0\nelement edge 1\nproperty int8 a\n\
             property uint8 b\nproperty int16 c\nproperty list uint16 float64 d\n\
             element vertex 4\nproperty int16 x\nproperty uint32 y\nproperty float z\n\
             element face 1\nproperty list ushort uint16 vertex_indices\nproperty int m\n\
             end_header\n"
        )
        .into_bytes()
    };
    let mut little = head("little");
    let mut big = head("big");
    let mut push = |bytes: &[u8]| {
        little.extend(bytes);
        big.extend(bytes.iter().rev());
    };
    push(&[1]);
    push(&[2]);
    push(&3_i16.to_le_bytes());
    push(&2_u16.to_le_bytes());
    push(&0.5_f64.to_le_bytes());
    push(&0.5_f64.to_le_bytes());
    for (x, y) in [(-1_i16, 0_u32), (1, 0), (1, 3), (-1, 3)] {
        push(&x.to_le_bytes());
        push(&y.to_le_bytes());
        push(&2.5_f32.to_le_bytes());
    }
    push(&4_u16.to_le_bytes());
    for index in [0_u16, 1, 2, 3] {
        push(&index.to_le_bytes());
    }
    push(&7_i32.to_le_bytes());
    accept("little.ply", &little, 4, 2, 6.0);
    accept("big.ply", &big, 4, 2, 6.0);
    assert_eq!(read(&little).unwrap().0, read(&big).unwrap().0);
    for length in 0..little.len() {
        assert!(read(&little[..length]).is_err(), "{length} bytes of {}", little.len());
    }
}

#[test]
fn odd_stl_files_are_read() {
    let facet = "facet normal nan 0 0\nouter loop\nvertex 0 0 0\nvertex 1E+00 0 -0\n\
        vertex 0 1.0e0 0\nendloop\nendfacet\n";
    let other = facet.replace("vertex 0 0 0", "vertex 1 1 0");
    accept("a.stl", format!("solid\n{facet}endsolid\n").as_bytes(), 3, 1, 0.5);
    let two = format!("solid a\n{facet}endsolid a\nSOLID\n{other}ENDSOLID\n");
    accept("two.stl", two.as_bytes(), 4, 2, 1.0);
    accept("upper.STL", two.to_uppercase().replace('\n', "\r\n").as_bytes(), 4, 2, 1.0);
    let mut binary = vec![b' '; 80];
    binary[..5].copy_from_slice(b"solid");
    binary.extend(1_u32.to_le_bytes());
    for value in [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0] {
        binary.extend(f32::to_le_bytes(value));
    }
    binary.extend([0, 0]);
    accept("solid.stl", &binary, 3, 1, 2.0);
    binary[..80].fill(0);
    binary.push(0);
    let report = accept("long.stl", &binary, 3, 1, 2.0);
    assert_eq!(report.ignored, ["data after the last triangle"]);
}

#[test]
fn content_is_believed_over_the_extension() {
    for format in Format::ALL {
        for declared in Format::ALL {
            let written = bytes(&potato(), format, Precision::Single);
            let (_, report) = io::read_bytes("x", &written, Some(declared)).unwrap();
            assert_eq!(report.format, format, "declared {declared:?}");
        }
    }
}

/// Refuses the content with a message that contains `part`, at `place`.
fn refuse(name: &str, content: &[u8], place: Option<Place>, part: &str) {
    let error = io::read_bytes(name, content, Format::from_path(Path::new(name))).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with(name) && message.contains(part), "{message}");
    assert_eq!(error.place, place, "{message}");
    assert!(error.fault.cure().is_some(), "{message}");
}

#[test]
fn faults_name_place_cause_and_cure() {
    let line = |number| Some(Place::Line(number));
    let word = |line, column| Some(Place::Word { line, column });
    refuse("a.obj", b"v 0 0 0\nv 1 0\nf 1 1 1", line(2), "three coordinates");
    refuse("b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4", line(4), "vertex 4, but there are 3");
    refuse("c.obj", b"v 0 0 0\nf 1 -2 1\nv 0 0 0", line(2), "vertex -2");
    refuse("d.obj", b"v 0 0 0\nf 1 0 1", line(2), "vertex 0");
    refuse("e.obj", b"v 0 0 0\n\nf 1 x 1", word(3, 5), "vertex numbers");
    refuse("f.obj", b"v 0 0 0\nv 0 1e999 0\nf 1 2 2", line(2), "not finite");
    refuse("g.obj", b"g An f\nv 0 0 0", None, "no faces, only 1 vert");
    refuse("h.obj", b"hello\n", None, "is not OBJ");
    refuse("i.obj", b"v 0 0 0\nv \xff 0 0\nf 1 2 3", word(2, 3), "plain text");
    refuse("a.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", line(6), "vertex 3");
    refuse("b.off", b"OFF\n3 1 0\n0 0 0\n1 0\n0 1 0 0 0\n3 0 1 2\n", line(4), "three coordinates");
    refuse("c.off", b"OFF\n9 9 9\n0 0 0\n", line(2), "18 vertices and faces are announced");
    refuse("d.off", b"OFF BINARY\n\0\0", None, "binary OFF files are not read");
    refuse("e.off", b"4OFF\n1 1 1\n", line(1), "4OFF");
    refuse("f.off", b"OFF\n1 0 0\n0 0 0\n", None, "no faces");
    refuse("g.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n", line(6), "number of corners");
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let ply = |rest: &str| format!("{head}{rest}").into_bytes();
    refuse("a.ply", &ply("0 0 0\n1 0 0\n0 1\n3 0 1 2\n"), line(12), "a number");
    refuse("b.ply", &ply("0 0 0\n1 0 0\n0 1 0 0\n3 0 1 2\n"), word(12, 7), "end of the line");
    refuse("c.ply", &ply("0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), line(13), "vertex -1");
    refuse("d.ply", &ply("0 0 0\n1 0 0\n0 inf 0\n3 0 1 2\n"), line(12), "not finite");
    refuse("e.ply", &ply("0 0 0\n1 0 0\n0 1 0\n"), line(12), "1 items of element `face`");
    refuse("f.ply", &ply("0 0 0\n1 0 0\n0 1 0\n300 0 1 2\n"), line(13), "ends before");
    refuse("g.ply", b"hello", None, "is not PLY");
    let other = |from: &str, to: &str| head.replace(from, to) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    refuse("i.ply", other("vertex_indices", "verts").as_bytes(), None, "found `verts`");
    refuse("j.ply", other("uchar int", "uchar float").as_bytes(), None, "a list of integers");
    let huge = head.replace("ascii", "binary_little_endian").replace("face 1", "face 4000000000");
    let place = Some(Place::Byte(huge.len() as u64 + 36));
    refuse("h.ply", &[huge.as_bytes(), &[0; 60]].concat(), place, "4000000000 items");
    refuse("a.stl", &[0; 84], None, "no faces");
    refuse("b.stl", &[7; 100], Some(Place::Byte(80)), "117901063 triangles are announced");
    refuse("c.stl", b"solid\nfacet\nvertex 0 0\n", line(3), "three coordinates");
    refuse("d.stl", b"solid\nfacet normal 0 0 0\nvertex 0 0 0\n", line(3), "endsolid");
    refuse("e.stl", b"solid\nfacet\nvertex 0 0 0\nendfacet\n", line(4), "three vertices");
    refuse("f.stl", b"short", None, "is not STL");
    let one_line = b"solid facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0";
    refuse("g.stl", one_line, line(1), "a line for the name of the solid");
    refuse("a.3mf", b"PK\x03\x04rest", None, "ZIP archive");
    refuse("b.3mf", b"hello", None, "is not 3MF");
    refuse("a.glb", b"glTFrest", None, "GLB files are not read");
    refuse(
        "a.vtu",
        b"<?xml version=\"1.0\"?>\n<VTKFile type=\"x\">",
        None,
        "VTU files are not read",
    );
    refuse("a.txt", b"hello", None, "not a mesh");
    refuse("empty", b"", None, "is empty");
}

#[test]
fn a_missing_file_and_a_folder_are_unreadable() {
    for path in [Path::new("/nonexistent/mesh.ply"), Path::new(env!("CARGO_MANIFEST_DIR"))] {
        let error = io::read(path).unwrap_err();
        assert!(matches!(error.fault, Fault::Unreadable(_)), "{error}");
    }
}

#[test]
fn reading_stops_when_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let path = folder.path().join("mesh");
        std::fs::write(&path, bytes(&potato(), format, Precision::Single)).unwrap();
        let progress = Progress::new();
        io::read_with(&path, &progress).unwrap();
        let (done, expected) = progress.steps();
        assert!(done == expected && done > 0, "{format:?}: {done} of {expected}");
        progress.cancel();
        let error = io::read_with(&path, &progress).unwrap_err();
        assert!(matches!(error.fault, Fault::Cancelled(_)), "{error}");
    }
}

#[test]
fn every_prefix_of_every_format_is_refused_or_whole() {
    let mesh = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    };
    for format in [Format::Off, Format::Ply, Format::Stl] {
        let whole = bytes(&mesh, format, Precision::Single);
        for length in 0..whole.len() {
            if let Ok((found, _)) = io::read_bytes("cut", &whole[..length], Some(format)) {
                // Only the last line end may be missed.
                assert_eq!(found.triangles.len(), 4, "{format:?} cut to {length}");
                assert_eq!(length, whole.len() - 1);
            }
        }
    }
}

/// Seeds for mutation: every format, text and binary, with polygons and extras.
fn seeds() -> Vec<Vec<u8>> {
    let mut mesh = potato();
    mesh.triangles.truncate(40);
    weld(&mut mesh);
    mesh.positions.truncate(500);
    let mut seeds: Vec<Vec<u8>> =
        Format::ALL.iter().map(|&f| bytes(&mesh, f, Precision::Single)).collect();
    seeds.push(
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty \
          float z\nelement face 1\nproperty list uchar int vertex_indices\nelement edge 1\n\
          property list char double w\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n1 0.5\n"
            .to_vec(),
    );
    seeds.push(
        b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char \
          y\nproperty char z\nelement face 1\nproperty list uchar uchar vertex_index\nend_header\n\
          \0\0\0\x01\0\0\0\x01\0\x03\0\x01\x02"
            .to_vec(),
    );
    seeds.push(
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\n\
          endloop\nendfacet\nendsolid\n"
            .to_vec(),
    );
    seeds.push(
        b"o a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.1 0.2 0\nvt 0 0\nf 1/1 2/1 \\\n3/1 -1/-1\nf -4 -3 -2"
            .to_vec(),
    );
    seeds.push(
        b"COFF\n# c\n4 2 0\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n4 0 1 2 3 1\n3 0 1 2".to_vec(),
    );
    seeds
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]
    #[test]
    fn no_bytes_make_a_reader_panic(
        seed in 0_usize..9,
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..6, any::<u8>()), 1..12),
        declared in prop::option::of(prop::sample::select(Format::ALL.to_vec())),
    ) {
        let mut content = seeds().swap_remove(seed);
        for (at, kind, byte) in edits {
            let at = at.index(content.len().max(1)).min(content.len().saturating_sub(1));
            match kind {
                _ if content.is_empty() => content.push(byte),
                0 => content[at] = byte,
                1 => content[at] ^= 1 << (byte % 8),
                2 => content.insert(at, b"0123456789-e./ \n"[usize::from(byte % 16)]),
                3 => drop(content.remove(at)),
                4 => content.truncate(at.max(content.len() / 2)),
                _ => {
                    let end = (at + usize::from(byte)).min(content.len());
                    let piece = content[at..end].to_vec();
                    content.splice(at..at, piece);
                }
            }
        }
        if let Ok((mesh, _)) = io::read_bytes("mutated", &content, declared) {
            prop_assert!(mesh.positions.iter().flatten().all(|v| v.is_finite()));
            let vertices = mesh.positions.len();
            prop_assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < vertices));
            let found = check(&mesh);
            prop_assert_eq!(found.defects.repeated_corner.count, 0);
        }
    }
}

#[test]
fn files_of_other_programs_are_read_or_refused_as_they_should() {
    let Some(folder) = common::real_meshes() else { return };
    let mut wrong = Vec::new();
    for row in data::FILES {
        let path = folder.join(row.name);
        if !path.exists() {
            eprintln!("skipped: no {}", row.name);
            continue;
        }
        let fault = match (&row.expected, io::read(&path)) {
            (data::Expected::Mesh { triangles, closed }, Ok(mesh)) => {
                let found = check(&mesh);
                let is_closed = found.is_closed()
                    && found.is_oriented()
                    && found.defects.nonmanifold_edge.count == 0;
                (mesh.triangles.len() != *triangles || is_closed != *closed)
                    .then(|| format!("{} triangles, closed {is_closed}", mesh.triangles.len()))
            }
            (data::Expected::Refusal(part), Err(error)) => {
                (!error.to_string().contains(part)).then(|| error.to_string())
            }
            (data::Expected::Mesh { .. }, Err(error)) => Some(error.to_string()),
            (data::Expected::Refusal(_), Ok(_)) => Some("was read".into()),
        };
        wrong.extend(fault.map(|fault| format!("{}: {fault}", row.name)));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_of_one_shape_have_one_volume() {
    let Some(folder) = common::real_meshes() else { return };
    let volume = |name: &str| measure(&io::read(&folder.join(name)).unwrap()).volume;
    for &(first, second, factor, tolerance) in data::SAME {
        let (first_volume, second_volume) = (volume(first), volume(second));
        let ratio = second_volume / first_volume;
        assert!((ratio - factor).abs() <= tolerance, "{first}, {second}: {ratio:e}");
    }
    assert!((volume("box_3x3x3_offset.stl") - 27.0).abs() < 1e-5);
}

#[test]
fn defects_of_dirty_files_are_counted() {
    let Some(folder) = common::real_meshes() else { return };
    for &(name, parts, expected) in data::DEFECTS {
        let found = check(&io::read(&folder.join(name)).unwrap());
        let counts = found.defects.by_name().map(|(_, defect)| defect.count);
        assert_eq!((found.components.len(), counts), (parts, expected), "{name}");
    }
    assert!(check(&io::read(&folder.join("dirty_inverted.ply")).unwrap()).inside_out);
}

/// A 3MF archive whose model consists of `inside`.
fn archive(inside: &str) -> Vec<u8> {
    archive_of(&[("3D/part.model", inside)])
}

/// A 3MF archive of parts, each a model that consists of what is inside.
fn archive_of(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, inside) in parts {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        let model = format!("<?xml version=\"1.0\"?>\n<model {inside}</model>");
        std::io::Write::write_all(&mut zip, model.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A tetrahedron at the origin as object `id`.
fn tetrahedron(id: u32) -> String {
    let vertices =
        ["0\" y=\"0\" z=\"0", "1\" y=\"0\" z=\"0", "0\" y=\"1\" z=\"0", "0\" y=\"0\" z=\"1"];
    let vertices: String = vertices.map(|v| format!("<vertex x=\"{v}\"/>")).concat();
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let triangles: String =
        triangles.map(|[a, b, c]| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")).concat();
    format!(
        "<object id=\"{id}\" type=\"model\"><mesh><vertices>{vertices}</vertices>\
         <triangles>{triangles}</triangles></mesh></object>"
    )
}

#[test]
fn items_of_3mf_are_moved_and_scaled_to_millimetres() {
    // In inches: one as it is, one mirrored and moved through a component, one support.
    let support = tetrahedron(3).replace("type=\"model\"", "type=\"support\"");
    let content = archive(&format!(
        "unit=\"inch\"><resources>{}{support}<object id=\"2\"><components>\
         <component objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/></components></object>\
         </resources><build><item objectid=\"1\"/>\
         <item objectid=\"2\" transform=\"2 0 0 0 2 0 0 0 2 10 0 0\"/><item objectid=\"3\"/></build>",
        tetrahedron(1)
    ));
    let (mesh, report) = read(&content).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (8, 8));
    assert_eq!(report.ignored, ["supports"]);
    let inch = 25.4_f64;
    let volume = measure::volume(&mesh);
    assert!((volume / (9.0 / 6.0 * inch.powi(3)) - 1.0).abs() < 1e-14, "{volume}");
    assert_eq!(mesh.positions[5], [8.0 * inch, 0.0, 0.0]);
    let found = check(&mesh);
    assert!(found.is_sound() && found.components.len() == 2);
}

#[test]
fn objects_in_other_parts_of_a_3mf_archive_are_read() {
    const PRODUCTION: &str = "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" \
                              requiredextensions=\"p\"";
    // Two parts with objects of the same number, one in centimetres with a component of its own; what
    // that wants built does not count.
    let twice = format!(
        "unit=\"centimeter\">{}<object id=\"2\"><components>\
         <component objectid=\"1\" transform=\"2 0 0 0 2 0 0 0 2 3 0 0\"/></components></object>\
         <build><item objectid=\"1\"/></build>",
        tetrahedron(1)
    );
    let once = format!("unit=\"millimeter\">{}", tetrahedron(1));
    let root = format!(
        "unit=\"millimeter\" {PRODUCTION}><resources><object id=\"1\"><components>\
         <component p:path=\"/3D/Objects/a.model\" objectid=\"1\"/>\
         <component p:path=\"/3D/Objects/b.model\" objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 5 0 0\"/>\
         </components></object></resources><build><item objectid=\"1\"/>\
         <item p:path=\"/3D/Objects/a.model\" objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 9 0\"/></build>"
    );
    let (a, b) = ("3D/Objects/a.model", "3D/Objects/b.model");
    let whole = |parts: &[(&str, &str)]| read(&archive_of(parts));
    let (mesh, report) = whole(&[("3D/x.model", &root), (a, &once), (b, &twice)]).unwrap();
    assert_eq!((mesh.positions.len(), report.faces, report.ignored), (12, 12, vec![]));
    assert_eq!(mesh.positions[1], [1.0, 0.0, 0.0]);
    // Scaled twice and moved by three centimetres, then moved by five millimetres.
    assert_eq!(mesh.positions[5], [20.0 + 30.0 + 5.0, 0.0, 0.0]);
    assert_eq!(mesh.positions[8], [0.0, 9.0, 0.0]);
    let volume = measure::volume(&mesh);
    assert!((volume - (2.0 + 8000.0) / 6.0).abs() < 1e-10, "{volume}");

    let refused = |parts: &[(&str, &str)], words: &[&str]| {
        let message = whole(parts).unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    refused(&[("3D/x.model", &root), (a, &once)], &["in the archive", "3D/Objects/b.model"]);
    let bad = once.replace("x=\"1\"", "x=\"one\"");
    refused(
        &[("3D/x.model", &root), (a, &bad), (b, &twice)],
        &["byte ", "a number", "one", "in the part `3D/Objects/a.model`", "export it again"],
    );
    let deeper = format!("{PRODUCTION}>{}", root.split_once('>').unwrap().1);
    refused(&[("3D/x.model", &root), (a, &deeper), (b, &twice)], &["no path", "a.model"]);
}

#[test]
fn a_3mf_model_that_requires_more_than_is_read_is_refused() {
    let model = |required: &str, namespace: &str| {
        archive(&format!(
            "xmlns:q=\"http://schemas.microsoft.com/3dmanufacturing/{namespace}\" \
             requiredextensions=\"{required}\">{}<build><item objectid=\"1\"/></build>",
            tetrahedron(1)
        ))
    };
    for (required, namespace) in [("q", "beamlattice/2017/02"), ("b", "material/2015/02")] {
        let error = read(&model(required, namespace)).unwrap_err();
        assert!(matches!(error.fault, Fault::Extension { .. }), "{error}");
    }
    for (required, namespace) in [("", "beamlattice/2017/02"), (" q ", "material/2015/02")] {
        assert_eq!(read(&model(required, namespace)).unwrap().0.triangles.len(), 4);
    }
}

#[test]
fn references_in_the_markup_of_3mf_are_resolved() {
    let item = "<build><item objectid=\"&#49;\"/></build>";
    let content = archive(&format!(">{}{item}", tetrahedron(1).replace("\"1\"", "\"&#x31;\"")));
    assert_eq!(read(&content).unwrap().0.positions[1], [1.0, 0.0, 0.0]);
}

#[test]
fn zeros_keep_their_sign_in_3mf() {
    let mut mesh = potato();
    mesh.positions[0] = [-0.0, 0.0, -0.0];
    let (again, _) = read(&bytes(&mesh, Format::ThreeMf, Precision::Double)).unwrap();
    let bits = |mesh: &Mesh| mesh.positions[0].map(f64::to_bits);
    assert_eq!(bits(&again), bits(&mesh));
}

#[test]
fn hostile_3mf_files_are_refused() {
    let refused = |inside: &str, part: &str| {
        let message = read(&archive(inside)).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    let item = "<build><item objectid=\"1\"/></build>";
    let object = |id: u32, inside: &str| format!("<object id=\"{id}\">{inside}</object>");
    let component = |id: u32| format!("<component objectid=\"{id}\"/>");
    refused(&format!("><resources></resources>{item}"), "number of an object");
    refused(&format!(">{}{item}", object(1, &component(1))), "contain each other");
    let doubling: String = (1..40).map(|id| object(id, &component(id + 1).repeat(2))).collect();
    refused(&format!(">{doubling}{}{item}", tetrahedron(40)), "contain each other");
    let forty: String = (1..5).map(|id| object(id, &component(id + 1).repeat(40))).collect();
    refused(&format!(">{forty}{}{item}", tetrahedron(5)), "too many copies");
    refused(&format!(" unit=\"ell\">{}{item}", tetrahedron(1)), "a unit of length");
    refused(&format!(">{}{item}", tetrahedron(1).replace("v1=\"0\"", "v1=\"9\"")), "vertex 9");
    refused(&format!(">{}{item}", tetrahedron(1).replace("x=\"1\"", "x=\"1e999\"")), "not finite");
    refused(&format!(">{}{item}", tetrahedron(1).replace("y=\"1\"", "y=\"one\"")), "a number");
    refused(&format!(">{}<build>", tetrahedron(1)), "XML");
    refused("><vertex x=\"0\" y=\"0\" z=\"0\"/>", "an object around");
    refused(&format!(">{}{}{item}", tetrahedron(1), tetrahedron(1)), "a number of its own");
    refused(&format!(">{}", tetrahedron(1).replace("\"1\"", "\"&one;\"")), "XML");
    // Blanks pack well, and would be kept in memory as one piece.
    refused(&format!(">{}", " ".repeat(1 << 24)), "over a megabyte");
}
