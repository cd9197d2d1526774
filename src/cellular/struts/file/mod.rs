//! Files that hold a unit cell: plain text, JSON, and the `.ltcx` form in which other tools exchange
//! lattices.
//!
//! All three say the same: nodes with a name and a place, edges between two nodes, faces around
//! three or more, and factors of the radius or thickness. A reader makes a draft of what a file says
//! and where; what it means is checked in one place. No text makes a reader panic, and none takes
//! more than the time and memory that [`MOST`] elements need.

mod draft;
mod json;
mod ltcx;
mod plain;

use super::cell::Cell;
use crate::text::Place;

/// The longest file that is read, in bytes.
pub const LONGEST: usize = 4 << 20;
/// The most nodes, and the most edges and corners of faces together.
pub const MOST: usize = 4096;
/// The most corners of a face.
pub const MOST_CORNERS: usize = 64;
/// The range of coordinates, in cells from a corner of the cube.
pub const RANGE: [f64; 2] = [-1.0, 2.0];
/// The largest factor of a radius or thickness.
pub const LARGEST_FACTOR: f64 = 100.0;

/// How a file is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Lines such as `node a 0 0 0`, `edge a b` and `face a b c`; `#` begins a comment.
    Plain,
    /// An object of lists `nodes`, `edges` and `faces`.
    Json,
    /// XML: `<graph>` with a `<nodegroup>` and a `<beamgroup>`, about the middle of the cell.
    Ltcx,
}

impl Format {
    /// The format of files named `name`, whatever the case of its letters.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        [(".cell", Self::Plain), (".cell.json", Self::Json), (".ltcx", Self::Ltcx)]
            .into_iter()
            .find(|(ending, _)| name.len() > ending.len() && name.ends_with(ending))
            .map(|(_, format)| format)
    }
}

/// The cell that `text` describes.
///
/// # Errors
/// [`Fault`], with its place, for text that is not of the format or describes no cell.
pub fn read(text: &str, format: Format) -> Result<Cell, Fault> {
    if text.len() > LONGEST {
        return Err(Fault { place: Place::Whole, cause: Cause::TooLong });
    }
    let draft = match format {
        Format::Plain => plain::read(text),
        Format::Json => json::read(text),
        Format::Ltcx => ltcx::read(text),
    }?;
    draft.cell()
}

/// What is wrong with a file, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}{cause}")]
pub struct Fault {
    /// Where.
    pub place: Place,
    /// What.
    pub cause: Cause,
}

/// Why a file is no cell.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Cause {
    /// It is too long.
    #[error("it is longer than {LONGEST} bytes")]
    TooLong,
    /// It has too many nodes, or edges and faces.
    #[error("it has more than {MOST} {what}; simplify the cell")]
    TooMany {
        /// Nodes, or edges and corners.
        what: &'static str,
    },
    /// It has no edge and no face.
    #[error("it has no edge and no face; an edge makes a strut, a face a plate")]
    Empty,
    /// A line begins with none of the words.
    #[error("`{word}` begins no line; lines begin with `node`, `edge` or `face`")]
    UnknownLine {
        /// How the line begins.
        word: String,
    },
    /// A line ends too early or too late.
    #[error("write `{usage}`")]
    Usage {
        /// How to write the line.
        usage: &'static str,
    },
    /// A word is no finite number.
    #[error("`{word}` is not a finite number")]
    NotANumber {
        /// The word.
        word: String,
    },
    /// A coordinate is out of range.
    #[error("the coordinate {value} is not from {} to {} cells", RANGE[0], RANGE[1])]
    OutOfRange {
        /// The coordinate.
        value: f64,
    },
    /// A factor is out of range.
    #[error("the factor {value} is not above 0 and at most {LARGEST_FACTOR}")]
    Factor {
        /// The factor.
        value: f64,
    },
    /// Two nodes have one name.
    #[error("the node `{id}` is given twice")]
    Repeated {
        /// The name.
        id: String,
    },
    /// An edge or a face names a node that is not there.
    #[error("there is no node `{id}`; nodes come before what they join")]
    UnknownNode {
        /// The name.
        id: String,
    },
    /// An edge has no length.
    #[error("the edge has no length")]
    NoLength,
    /// A face has too few or too many corners.
    #[error("a face has from 3 to {MOST_CORNERS} corners, not {count}")]
    Corners {
        /// How many it has.
        count: usize,
    },
    /// The corners of a face do not lie in a plane.
    #[error("the corners of the face do not lie in a plane; split it into triangles")]
    NotFlat,
    /// A face is not convex, or has no area.
    #[error("the face is not convex or has no area; give corners in order, or split it")]
    NotConvex,
    /// It is not JSON of the right form.
    #[error("{message}")]
    Json {
        /// What the reader of JSON says.
        message: String,
    },
    /// It is not XML of the right form.
    #[error("{message}")]
    Xml {
        /// What is wrong.
        message: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One strut along the cell's edge and one to its middle, half as thick.
    const SAME: [(Format, &str); 3] = [
        (
            Format::Plain,
            "# a cell\nnode a 0 0 0\nnode b 1 0 0\nnode c 0.5 0.5 0.5\nedge a b\nedge a c 0.5\n",
        ),
        (
            Format::Json,
            r#"{"nodes": [{"id": 1, "at": [0,0,0]}, {"id": "b", "at": [1,0,0]},
                {"id": "c", "at": [0.5,0.5,0.5]}],
                "edges": [{"between": [1, "b"]}, {"between": [1, "c"], "radius": 0.5}]}"#,
        ),
        (
            Format::Ltcx,
            r#"<?xml version="1.0"?>
            <graph units="mm"><nodegroup>
              <node id="0" x="-0.5" y="-0.5" z="-0.5"/><node id="1" x="0.5" y="-0.5" z="-0.5"/>
              <node id="2" x="0" y="0" z="0"/>
            </nodegroup><beamgroup>
              <beam id="0" n1="0" n2="1"/><beam id="1" n1="0" n2="2" r="0.5"/>
            </beamgroup></graph>"#,
        ),
    ];

    #[test]
    fn formats_say_the_same() {
        let [plain, json, ltcx] = SAME.map(|(format, text)| read(text, format).unwrap());
        assert_eq!(plain.struts().len(), 2);
        assert_eq!(plain.struts()[1].factors, [0.5; 2]);
        assert_eq!(plain, json);
        assert_eq!(plain, ltcx);
    }

    #[test]
    fn names_tell_the_format() {
        for (name, format) in [
            ("a.cell", Some(Format::Plain)),
            ("b/A.CELL", Some(Format::Plain)),
            ("a.cell.json", Some(Format::Json)),
            ("a.ltcx", Some(Format::Ltcx)),
            ("a.json", None),
            (".cell", None),
            ("cell", None),
        ] {
            assert_eq!(Format::of(name), format, "{name}");
        }
    }

    #[test]
    fn radii_of_nodes_taper_struts() {
        let text = "node a 0 0 0 2\nnode b 1 0 0.5\nedge a b\nedge b a 3";
        let cell = read(text, Format::Plain).unwrap();
        assert_eq!(cell.struts()[0].factors, [2.0, 1.0]);
        assert_eq!(cell.struts().len(), 1);
    }

    #[track_caller]
    fn check(format: Format, text: &str, expected: &str) {
        assert_eq!(read(text, format).unwrap_err().to_string(), expected);
    }

    #[test]
    fn faults_have_their_place_and_cure() {
        let check = |text: &str, expected: &str| check(Format::Plain, text, expected);
        let nodes = "node a 0 0 0\nnode b 1 0 0\nnode c 1 1 0\nnode d 0 1 0.1\nnode e 0.9 0.1 0\n";
        let with = |line: &str| format!("{nodes}{line}");
        check("", "it has no edge and no face; an edge makes a strut, a face a plate");
        check(
            "knot a",
            "line 1, column 1: `knot` begins no line; lines begin with `node`, `edge` or `face`",
        );
        check("node a 0 0", "line 1, column 1: write `node ID x y z [radius]`");
        check("\n node a 0 x 0", "line 2, column 11: `x` is not a finite number");
        check("node a 0 3 0", "line 1, column 10: the coordinate 3 is not from -1 to 2 cells");
        check("node a 0 0 0\nnode a 0 0 1", "line 2, column 6: the node `a` is given twice");
        check(
            &with("edge a f"),
            "line 6, column 8: there is no node `f`; nodes come before what they join",
        );
        check(&with("edge a a"), "line 6, column 1: the edge has no length");
        check(
            &with("edge a b 0"),
            "line 6, column 10: the factor 0 is not above 0 and at most 100",
        );
        check(&with("face a b"), "line 6, column 1: a face has from 3 to 64 corners, not 2");
        check(
            &with("face a b c d"),
            "line 6, column 1: the corners of the face do not lie in a plane; split it into triangles",
        );
        check(
            &with("face a b c e"),
            "line 6, column 1: the face is not convex or has no area; give corners in order, or split it",
        );
    }

    #[test]
    fn faults_of_json_and_xml_have_their_place() {
        let found = read("{\"nodes\": [}", Format::Json).unwrap_err();
        assert_eq!(found.place, Place::At { line: 1, column: 12 });
        check(
            Format::Json,
            r#"{"nodes": [], "edges": [{"between": ["a", "b"]}]}"#,
            "edge 1: there is no node `a`; nodes come before what they join",
        );
        let json = |text: &str, expected: &str| check(Format::Json, text, expected);
        json(
            r#"{"nodes":[[0,0,0],[1,1,1]],"edges":[[0,1]]}"#,
            "line 1, column 10: invalid type: sequence, \
             expected a node such as {\"id\": \"a\", \"at\": [0, 0, 0]}",
        );
        json(
            r#"{"nodes":[{"id":0,"at":[0,0,0]},{"id":1,"at":[1,1,1]}],"edges":[[0,1]]}"#,
            "line 1, column 64: invalid type: sequence, \
             expected an edge such as {\"between\": [\"a\", \"b\"]}",
        );
        json(
            r#"{"nodes":[],"faces":{}}"#,
            "line 1, column 20: invalid type: map, expected a list whose entries are each \
             a face such as {\"corners\": [\"a\", \"b\", \"c\"]}",
        );
        json(
            "[]",
            "line 1, column 0: invalid type: sequence, \
             expected an object such as {\"nodes\": [...], \"edges\": [...]}",
        );
        let xml = "<graph><nodegroup>\n<node id='1' x='0' y='0'/></nodegroup></graph>";
        check(
            Format::Ltcx,
            xml,
            "line 2, column 1: write `<node id=\"1\" x=\"0\" y=\"0\" z=\"0\"/>`",
        );
        assert!(matches!(
            read("<graph><nodegroup", Format::Ltcx).unwrap_err().cause,
            Cause::Xml { .. }
        ));
    }

    #[test]
    fn no_bytes_make_a_reader_panic() {
        // Pieces of files that make sense, cut and joined at random places.
        let mut state = 7_u64;
        let mut below = |n: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as usize % n
        };
        for round in 0..3000 {
            let mut bytes = Vec::new();
            for _ in 0..=below(4) {
                let text = SAME[(round + below(2)) % 3].1.as_bytes();
                let start = below(text.len());
                let end = start + below(text.len() - start);
                bytes.extend_from_slice(&text[start..end]);
                if below(3) == 0 {
                    bytes.push(below(256) as u8);
                }
            }
            let text = String::from_utf8_lossy(&bytes);
            for format in [Format::Plain, Format::Json, Format::Ltcx] {
                let _ = read(&text, format);
            }
        }
    }
}
