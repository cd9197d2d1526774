//! Configurations and their programs. The files they name are answered from here.

use super::*;

/// A mesh of 2 by 4 by 6, and a file of two types.
struct Fixed;

impl Answers for Fixed {
    fn bounds(&mut self, path: &str) -> Result<Aabb, Refusal> {
        if path != "part.stl" {
            return Err(Refusal { cause: "no such file".to_owned() });
        }
        Ok(Aabb::new(glam::DVec3::ZERO, glam::DVec3::new(2.0, 4.0, 6.0)))
    }

    fn types(&mut self, path: &str) -> Result<Vec<String>, Refusal> {
        let names: &[&str] = match path {
            "two.tap" => &["gyroid", "sheet_diamond"],
            "one.tap" => &["cubic"],
            "odd.tap" => &["gyroid", "hybrid"],
            _ => return Err(Refusal { cause: "no such file".to_owned() }),
        };
        Ok(names.iter().map(|name| (*name).to_owned()).collect())
    }
}

/// A configuration with these lines in place of those of the same keys.
fn config(lines: &str) -> String {
    let plain = "lt_type: gyroid\nlt_size: 0.5\nlt_feature: volumeFraction\nlt_feature_val: 0.5\n";
    let key = |line: &str| line.split_once(':').map(|(key, _)| key.trim().to_owned());
    let given: Vec<_> = lines.lines().filter_map(key).collect();
    let kept = plain.lines().filter(|line| !given.contains(&key(line).unwrap()));
    let files = if given.contains(&"files".to_owned()) { "" } else { "files:\n  stl: part.stl\n" };
    format!("{files}{}\n{lines}\n", kept.collect::<Vec<_>>().join("\n"))
}

#[track_caller]
fn check(lines: &str, expected: &str) {
    let found = convert(&config(lines), &mut Fixed).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(found.text, format!("part.stl\n{expected}\nintersection\n"), "{lines}");
}

#[test]
fn one_cell_is_said_in_words() {
    check("", "gyroid conform y,x,z scale 0.5");
    check("lt_feature_val: 0.6", "gyroid conform y,x,z dilate 0.2999999999999998 scale 0.5");
    check("lt_feature: isovalue", "gyroid conform y,x,z scale 0.5");
    check(
        "lt_type: sheet_gyroid\nlt_feature: isovalue",
        "gyroid conform y,x,z shell 1.5 scale 0.5",
    );
    check(
        "lt_type: sheet_gyroid\nlt_feature: isovalue\nme_hvol: 0",
        "gyroid conform y,x,z shell 1.55 scale 0.5",
    );
    check(
        "lt_type: primitive\nlt_feature: isovalue\nlt_feature_val: 1",
        "p-surface complement dilate 3.01 scale 0.5",
    );
    check(
        "lt_type: IWP\nlt_feature: isovalue\nlt_feature_val: 0.25",
        "iwp complement dilate -1 scale 0.5",
    );
    // The sign of the old level of I-WP is the other one.
    check(
        "lt_type: IWP\nlt_feature: isovalue\nlt_feature_val: 0.25\nme_side: void",
        "iwp complement dilate 3.0125 scale 0.5 complement",
    );
    check(
        "lt_type: cubic\nlt_feature: isovalue\nlt_feature_val: 0.1",
        "simple-cubic radius 0.071 scale 0.5",
    );
    check(
        "lt_type: sheet_diamond\nlt_feature: wallSize\nlt_feature_val: 0.1\n\
           lt_feature_mode: absolute\nlt_type_side: void",
        "d-surface shell 1.839184 scale 0.5 complement",
    );
    check("lt_size: -4", "gyroid conform y,x,z scale 0.5");
}

#[test]
fn what_varies_is_an_equation_of_the_part_s_space() {
    let files = "files:\n  stl: part.stl\n  sap: a b.sap\n  fap: f.fap\n";
    check(
        &format!("{files}lt_feature: isovalue\nlt_feature_val: 0"),
        "gyroid conform y,x,z scale 0.5 dilate '((-1.5+[f.fap]*3)*0.5)'",
    );
    check(
        &format!(
            "{files}lt_type: sheet_gyroid\nlt_feature: isovalue\nlt_feature_val: 0\nlt_size: 0"
        ),
        "gyroid conform 'y/[a b.sap],x/[a b.sap],z/[a b.sap]' shell '(abs(([f.fap]*1.5))*2)'",
    );
    check(
        &format!(
            "{files}lt_feature: poreSize\nlt_feature_val: 0\nlt_feature_mode: absolute\nlt_type: cubic\nme_hvol: 1"
        ),
        "simple-cubic radius 0.1 scale 0.5 dilate \
         '(((0.6783+clamp(([f.fap]/0.5),0,1.709269)*(-0.4743))-0.1)*0.5)'",
    );
    check(
        &format!("{files}lt_size: 0\nlt_feature: isovalue"),
        "gyroid conform 'y/[a b.sap],x/[a b.sap],z/[a b.sap]'",
    );
}

#[test]
fn several_cells_are_an_equation() {
    let files = "files:\n  stl: part.stl\n  tap: two.tap\n";
    let found = convert(
        &config(&format!(
            "{files}lt_type: hybrid\nlt_type_correctionFactor: 0\n\
                          lt_feature: isovalue\nlt_size: 0.25"
        )),
        &mut Fixed,
    );
    let w = "[two.tap gyroid 0.25]";
    let d = "(sin(tau*x/0.25)*sin(tau*y/0.25)*sin(tau*z/0.25)\
             +sin(tau*x/0.25)*cos(tau*y/0.25)*cos(tau*z/0.25)\
             +sin(tau*y/0.25)*cos(tau*z/0.25)*cos(tau*x/0.25)\
             +sin(tau*z/0.25)*cos(tau*x/0.25)*cos(tau*y/0.25))";
    let expected = format!(
        "part.stl\n'{w}*(sin(tau*x/0.25)*cos(tau*y/0.25)+sin(tau*y/0.25)*cos(tau*z/0.25)\
         +sin(tau*z/0.25)*cos(tau*x/0.25)-0)+(1-{w})*({d}^2-0.71^2)'\nintersection\n"
    );
    assert_eq!(found.unwrap().text, expected);
    // One type is one cell, whatever the radius.
    let one = format!("{}lt_type: hybrid\nlt_feature: isovalue", files.replace("two", "one"));
    check(&one, "simple-cubic radius 0.355 scale 0.5");
    let sizes =
        format!("{files}  sap: s.sap\nlt_type: hybrid\nlt_size: 0\nlt_type_filterRadius: 2");
    let text = convert(&config(&sizes), &mut Fixed).unwrap().text;
    assert!(text.contains("[two.tap gyroid 2 s.sap]*(sin(tau*x/[s.sap])"), "{text}");
    assert!(text.contains("(1+0.25*(1-(2*[two.tap gyroid 2 s.sap]/sqrt("), "{text}");
}

#[test]
fn bodies_have_their_size() {
    let body = |text: &str| {
        let lines = format!("files:\n  internalGeometry: {text}\nlt_size: -2");
        convert(&config(&lines), &mut Fixed).unwrap().text
    };
    assert_eq!(
        body("cuboid 1"),
        "box scale 0.5,0.5,0.5\ngyroid conform y,x,z scale 0.5\nintersection\n"
    );
    assert_eq!(
        body("cylinder 4 1 3"),
        "cylinder scale 1,3,1 box scale 1,3,2 intersection\ngyroid conform y,x,z scale 1\nintersection\n"
    );
    assert_eq!(
        body("spheroid 1 2 3"),
        "sphere scale 1,2,3\ngyroid conform y,x,z scale 1\nintersection\n"
    );
}

#[test]
fn what_has_no_counterpart_is_said() {
    let remarks = |lines: &str| convert(&config(lines), &mut Fixed).unwrap().remarks;
    let new = "read as a configuration of ASLI of 2024, whose fits give the level";
    let old = "read as a configuration of ASLI of 2019 to 2023, whose fits give the level";
    assert_eq!(remarks(""), [new]);
    assert_eq!(
        remarks("me_mesher: CGAL\nme_hausd: 1\nme_side: scaffold"),
        [
            old,
            "without effect here, where -s chooses the grid and -o the file: me_mesher, me_hausd"
        ]
    );
    assert_eq!(
        remarks("me_elementSize: 1\nfiles:\n  stl: part.stl\n  output: out/"),
        [
            new,
            "without effect here, where -s chooses the grid and -o the file: me_elementSize, \
             files -> output"
        ]
    );
}

#[track_caller]
fn refused(lines: &str, expected: &str) {
    let fault = convert(&config(lines), &mut Fixed).unwrap_err();
    assert_eq!(fault.to_string(), expected, "{lines}");
}

#[test]
fn faults_have_their_place_and_cure() {
    refused(
        "lt_typ: gyroid",
        "line 7, column 1: ASLI has no key `lt_typ`; did you mean `lt_type`?",
    );
    refused(
        "elsewhere: 1",
        "line 7, column 1: ASLI has no key `elsewhere`; leave it out, or put a `#` before it",
    );
    refused(
        "files:\n  sql: part.stl",
        "line 6, column 3: ASLI has no key `files -> sql`; did you mean `stl`?",
    );
    refused(
        "lt_type: gyroyd",
        "line 6, column 10: `lt_type` is gyroid, sheet_gyroid, diamond, sheet_diamond, primitive, \
         sheet_primitive, IWP, sheet_IWP, cubic or hybrid, not `gyroyd`",
    );
    refused("lt_size: big", "line 6, column 10: `big` is not a finite number, as `lt_size` needs");
    refused(
        "lt_feature_val: -1",
        "line 6, column 17: `lt_feature_val` must not be negative, not -1",
    );
    refused(
        "lt_size:",
        "the key `lt_size` is missing; give the length of a cell, or 0 for a `sap` file",
    );
    refused(
        "lt_size: 0",
        "the key `files -> sap` is missing; `lt_size: 0` needs a file of sizes, or give a size",
    );
    refused(
        "lt_type: hybrid",
        "the key `files -> tap` is missing; `lt_type: hybrid` needs a file of types, or give a type",
    );
    refused(
        "files:\n  output: out",
        "the key `files -> stl` is missing; name the mesh to fill, or a body: `internalGeometry: \
         cuboid 1`",
    );
    refused(
        "files:\n  internalGeometry: cuboid 1 2",
        "line 6, column 21: `internalGeometry` is `cuboid` with 1 or 3 lengths, `cylinder` with a \
         height and 1 or 2 radii, or `spheroid` with 1 or 3 radii, not `cuboid 1 2`",
    );
    refused(
        "lt_type_side: all",
        "line 7, column 15: `lt_type_side: all` is not translated; make two meshes, one with \
         `scaffold` and one with `void`",
    );
    refused(
        "lt_feature: userDefined",
        "line 6, column 13: `lt_feature: userDefined` is not translated; give the volume fraction \
         that it stands for as `volumeFraction`",
    );
    refused(
        "files:\n  stl: other.stl\nlt_size: -3",
        "line 5, column 8: can't use `other.stl`: no such file",
    );
    refused(
        "files:\n  stl: part.stl\n  tap: odd.tap\nlt_type: hybrid",
        "line 6, column 8: can't use `odd.tap`: `a type` is gyroid, sheet_gyroid, diamond, \
         sheet_diamond, primitive, sheet_primitive, IWP, sheet_IWP or cubic, not `hybrid`",
    );
    refused(
        "files:\n  stl: part.xyz",
        "line 6, column 8: `part.xyz` can't be named in a program; rename it to end as meshes do, \
         in `.stl`, and not to begin with `@`",
    );
    refused(
        "files:\n  stl: part.stl\n  fap: a].fap\nlt_feature_val: 0",
        "line 6, column 8: `a].fap` can't be named in a program; rename it to end in `.fap`, \
         without `]` or both kinds of quotes",
    );
    refused(
        "lt_size: [1]",
        "line 6, column 10: lists and maps in brackets are not read here; write \
         `key: value` lines",
    );
}
