//! Damaged files of every format, by name: what goes wrong in the world, made to measure.

use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

/// A file: its name, whose ending says what it claims to be, and its content.
pub type Named = (String, Vec<u8>);

const CORNERS: [[&str; 3]; 4] =
    [["0", "0", "0"], ["1", "0", "0"], ["0", "1", "0"], ["0", "0", "1"]];
const FACES: [[&str; 3]; 4] = [["0", "2", "1"], ["0", "1", "3"], ["0", "3", "2"], ["1", "2", "3"]];

/// The text formats, and 3MF.
pub const TEXTS: [&str; 5] = ["ply", "off", "obj", "stl", "3mf"];
/// The binary formats, by the ends of their names.
pub const BINARIES: [&str; 3] = ["little.ply", "big.ply", "binary.stl"];

/// A tetrahedron with other words in the place of one coordinate and one index.
pub fn text(format: &str, coordinate: &str, index: &str) -> Vec<u8> {
    let (mut corners, mut faces) = (CORNERS, FACES);
    corners[1][0] = coordinate;
    faces[3][2] = index;
    match format {
        "ply" => ply("ascii", "4", "4", lines(&corners, "") + &lines(&faces, "3 ")),
        "off" => format!("OFF\n4 4 0\n{}{}", lines(&corners, ""), lines(&faces, "3 ")),
        "obj" => {
            let later = |word: &str| {
                word.parse::<i128>().map_or_else(|_| word.to_owned(), |n| (n + 1).to_string())
            };
            let faces: String =
                faces.iter().map(|f| format!("f {}\n", f.map(later).join(" "))).collect();
            lines(&corners, "v ") + &faces
        }
        "stl" => {
            let facet = |face: &[&str; 3]| {
                let at = |word: &&str| {
                    let number = word.parse::<usize>().ok().filter(|n| *n < 4).unwrap_or(0);
                    format!("vertex {}\n", corners[number].join(" "))
                };
                let corners: String = face.iter().map(at).collect();
                format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
            };
            format!("solid a\n{}endsolid a\n", faces.iter().map(facet).collect::<String>())
        }
        _ => return archive(model(&corners, &faces, "", "<item objectid=\"1\"/>").as_bytes()),
    }
    .into_bytes()
}

/// The tetrahedron as it should be.
pub fn sound(format: &str) -> Vec<u8> {
    text(format, "1", "3")
}

/// The tetrahedron in a binary format whose header announces other numbers, with one coordinate
/// and one index replaced.
pub fn binary(format: &str, counts: [&str; 2], coordinate: f32, index: i32) -> Vec<u8> {
    let number = |word: &str| word.parse::<f32>().expect("a number");
    let mut points = CORNERS.map(|corner| corner.map(number));
    points[1][0] = coordinate;
    let mut faces = FACES.map(|face| face.map(|word| word.parse::<i32>().expect("a number")));
    faces[3][2] = index;
    let mut bytes = Vec::new();
    if format == "binary.stl" {
        bytes.extend([b' '; 80]);
        bytes.extend(counts[1].parse::<u32>().expect("a count").to_le_bytes());
        for face in faces {
            bytes.extend([0; 12]);
            for corner in face {
                let point = points[usize::try_from(corner).unwrap_or(0).min(3)];
                bytes.extend(point.iter().flat_map(|value| value.to_le_bytes()));
            }
            bytes.extend([0; 2]);
        }
        return bytes;
    }
    let is_big = format == "big.ply";
    let order = if is_big { "binary_big_endian" } else { "binary_little_endian" };
    bytes.extend(ply(order, counts[0], counts[1], String::new()).into_bytes());
    let four = |little: [u8; 4]| {
        let mut four = little;
        if is_big {
            four.reverse();
        }
        four
    };
    bytes.extend(points.iter().flatten().flat_map(|value| four(value.to_le_bytes())));
    for face in faces {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|value| four(value.to_le_bytes())));
    }
    bytes
}

/// A PLY file with a header that announces `vertices` and `faces`.
pub fn ply(order: &str, vertices: &str, faces: &str, body: String) -> String {
    format!(
        "ply\nformat {order} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {faces}\nproperty list uchar int vertex_indices\n\
         end_header\n{body}"
    )
}

fn lines(rows: &[[&str; 3]], before: &str) -> String {
    rows.iter().map(|row| format!("{before}{}\n", row.join(" "))).collect()
}

/// A 3MF model; `more` are further objects.
pub fn model(corners: &[[&str; 3]], faces: &[[&str; 3]], more: &str, build: &str) -> String {
    let vertex = |[x, y, z]: &[&str; 3]| format!("<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>");
    let triangle = |[a, b, c]: &[&str; 3]| format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
    let vertices: String = corners.iter().map(vertex).collect();
    let triangles: String = faces.iter().map(triangle).collect();
    format!(
        "<model unit=\"millimeter\"><resources><object id=\"1\"><mesh><vertices>{vertices}\
         </vertices><triangles>{triangles}</triangles></mesh></object>{more}</resources>\
         <build>{build}</build></model>"
    )
}

/// A 3MF model of the tetrahedron with further objects and its own build.
pub fn built(more: &str, build: &str) -> Vec<u8> {
    archive(model(&CORNERS, &FACES, more, build).as_bytes())
}

/// An archive with this model.
pub fn archive(model: &[u8]) -> Vec<u8> {
    archive_of("3D/a.model", std::iter::once(model))
}

/// An archive with one part, in pieces.
pub fn archive_of<'a>(name: &str, pieces: impl Iterator<Item = &'a [u8]>) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_level(Some(9));
    zip.start_file(name, options).expect("memory takes a part");
    for piece in pieces {
        zip.write_all(piece).expect("memory takes a part");
    }
    zip.finish().expect("memory takes a part").into_inner()
}

/// An archive of a megabyte or so whose model is `times` times `piece` between a beginning and an end.
pub fn bomb(begin: &str, piece: &str, times: usize, end: &str) -> Vec<u8> {
    let pieces = std::iter::repeat_n(piece.as_bytes(), times);
    let (begin, end) = (std::iter::once(begin.as_bytes()), std::iter::once(end.as_bytes()));
    archive_of("3D/a.model", begin.chain(pieces).chain(end))
}

/// Text in UTF-16, the least significant byte first, with its mark.
pub fn wide(text: &[u8]) -> Vec<u8> {
    [0xFF, 0xFE].into_iter().chain(text.iter().flat_map(|byte| [*byte, 0])).collect()
}

/// Bytes without a pattern.
pub fn garbage(count: usize) -> Vec<u8> {
    let mut state = 0x9E37_79B9_u32;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 11) as u8
    };
    (0..count).map(|_| next()).collect()
}

/// Damaged mesh files with short names, for pictures of what is said about them.
pub fn damaged() -> Vec<Named> {
    let mut files: Vec<Named> = Vec::new();
    let mut add = |name: String, content: Vec<u8>| files.push((name, content));
    for format in TEXTS {
        for word in ["nan", "-inf", "1e999", "one", "1,5", "0x10"] {
            add(format!("coordinate {word}.{format}"), text(format, word, "3"));
        }
        if format != "stl" {
            for word in ["4", "-9", "4294967296", "last"] {
                add(format!("index {word}.{format}"), text(format, "1", word));
            }
        }
        let whole = sound(format);
        for part in [4, 2] {
            add(format!("cut to 1 of {part}.{format}"), whole[..whole.len() / part].to_vec());
        }
        if format != "3mf" {
            add(format!("UTF-16.{format}"), wide(&whole));
            add(format!("UTF-16 without mark.{format}"), wide(&whole)[2..].to_vec());
        }
        add(format!("empty.{format}"), Vec::new());
        add(format!("blank.{format}"), b" \n\t\r\n".repeat(30));
        add(format!("zeros.{format}"), vec![0; 1000]);
        add(format!("garbage.{format}"), garbage(5000));
        add(format!("prose.{format}"), b"It was a dark and stormy night.\n".repeat(40));
    }
    for format in BINARIES {
        let counts = ["4", "4"];
        add(format!("nan.{format}"), binary(format, counts, f32::NAN, 3));
        add(format!("infinite.{format}"), binary(format, counts, f32::INFINITY, 3));
        if format != "binary.stl" {
            add(format!("index 4.{format}"), binary(format, counts, 1.0, 4));
            add(format!("index -1.{format}"), binary(format, counts, 1.0, -1));
            add(format!("many vertices.{format}"), binary(format, ["4000000000", "4"], 1.0, 3));
        }
        add(format!("many faces.{format}"), binary(format, ["4", "4000000000"], 1.0, 3));
        let whole = binary(format, counts, 1.0, 3);
        add(format!("cut short.{format}"), whole[..whole.len() - 1].to_vec());
    }
    for count in ["4000000000", "18446744073709551616", "-1", "1.5", "many"] {
        let body = || lines(&CORNERS, "") + &lines(&FACES, "3 ");
        add(format!("{count} faces.ply"), ply("ascii", "4", count, body()).into_bytes());
        add(format!("{count} vertices.ply"), ply("ascii", count, "4", body()).into_bytes());
        add(format!("{count} faces.off"), format!("OFF\n4 {count} 0\n{}", body()).into_bytes());
    }
    let item = "<item objectid=\"1\"/>";
    let component = |id: u32| format!("<component objectid=\"{id}\"/>");
    let object = |id: u32, inside: &str| {
        format!("<object id=\"{id}\"><components>{inside}</components></object>")
    };
    let own = object(2, &component(2));
    add("component of itself.3mf".into(), built(&own, "<item objectid=\"2\"/>"));
    let doubling: String = (2..40).map(|id| object(id, &component(id - 1).repeat(2))).collect();
    add("doubled over and over.3mf".into(), built(&doubling, "<item objectid=\"30\"/>"));
    add("no such object.3mf".into(), built("", "<item objectid=\"77\"/>"));
    let moved = |t: &str| built("", &format!("<item objectid=\"1\" transform=\"{t}\"/>"));
    add("moved by three.3mf".into(), moved("1 0 0"));
    add("moved by no number.3mf".into(), moved("nan 0 0 0 1 0 0 0 1 0 0 0"));
    let unit = model(&CORNERS, &FACES, "", item).replace("millimeter", "furlong");
    add("furlongs.3mf".into(), archive(unit.as_bytes()));
    let model = model(&CORNERS, &FACES, "", item);
    let twice = model.replace("<resources>", "<resources><object id=\"1\"></object>");
    add("a number for two.3mf".into(), archive(twice.as_bytes()));
    let inside = model.replace("<object id=\"1\"", "<object id=\"9\"><object id=\"1\"");
    let inside = inside.replace("</object>", "</object></object>");
    add("an object in an object.3mf".into(), archive(inside.as_bytes()));
    let beams = "xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\"";
    let required = model.replace("<model", &format!("<model requiredextensions=\"b\" {beams}"));
    add("beams required.3mf".into(), archive(required.as_bytes()));
    let elsewhere = "<item objectid=\"1\" p:path=\"/3D/b.model\"/>";
    add("a part too few.3mf".into(), built("", elsewhere));
    add("UTF-16.3mf".into(), archive(&wide(model.as_bytes())));
    let list = |name: &str| {
        let text = ply("ascii", "4", "4", lines(&CORNERS, "") + &lines(&FACES, "3 "));
        text.replace("uchar int vertex_indices", name).into_bytes()
    };
    add("another list.ply".into(), list("uchar int corners"));
    add("a list of floats.ply".into(), list("uchar float vertex_indices"));
    let corners = |names: &str| {
        let text = String::from_utf8(sound("ply")).unwrap();
        let lines = names.split(' ').map(|name| format!("property float {name}\n"));
        let (begin, rest) = text.split_once("property float x\n").unwrap();
        let (_, rest) = rest.split_once("property float z\n").unwrap();
        (begin.to_owned() + &lines.collect::<String>() + rest).into_bytes()
    };
    add("vertices of a flat map.ply".into(), corners("x y s"));
    add("vertices in capitals.ply".into(), corners("X Y Z"));
    add("vertices with one axis.ply".into(), corners("s z t"));
    let bare = String::from_utf8(sound("ply")).unwrap().replace("property float", "comment");
    add("vertices without properties.ply".into(), bare.into_bytes());
    let one_line = String::from_utf8_lossy(&sound("stl")).replace('\n', " ");
    add("one line.stl".into(), one_line.into_bytes());
    add("no model.3mf".into(), archive_of("readme.txt", std::iter::once(&b"hello"[..])));
    let vertices = "<vertex x=\"0\" y=\"0\" z=\"0\"/>".repeat(20_000);
    let begin = "<model><resources><object id=\"1\"><mesh><vertices>";
    add("packed densely.3mf".into(), bomb(begin, &vertices, 100, "</vertices>"));
    add("one endless tag.3mf".into(), bomb("<model ", &"a".repeat(1 << 20), 40, "/>"));
    add("an endless comment.3mf".into(), bomb("<model><!-- ", &"a".repeat(1 << 20), 40, "-->"));
    let objects: String = (1..70_000).map(|id| format!("<object id=\"{id}\"/>")).collect();
    add("objects without end.3mf".into(), archive(format!("<model>{objects}</model>").as_bytes()));
    files
}
