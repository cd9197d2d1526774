//! Bad command lines, programs and files that programs name.

use super::files;
use super::run::refused;

#[test]
fn numbers_of_options_are_refused_with_2() {
    for spacing in ["", "2/", "x", "1/0"] {
        refused(&[], &["-s", spacing, "box"], 2, &["in the value of `-s`"]);
    }
    for spacing in ["0", "-1", "-0", "1/0", "0/0", "1e-300", "1e-9", "", "1,", "1,2", "1,2,3,4"] {
        refused(&[], &["-s", spacing, "box"], 2, &[]);
    }
    for spacing in ["nan", "inf", "x", "(1", "sqrt(-1)", "0,0,0", "1,1,-1", "1e-5", "1e99999"] {
        refused(&[], &["-s", spacing, "box"], 2, &[]);
    }
    let endless = "9".repeat(5000);
    refused(&[], &["-s", &format!("1/{endless}"), "box"], 2, &[]);
    refused(&[], &["-s", "1e-300", "box"], 2, &["cells along X", "give a larger spacing"]);
    refused(&[], &["-s", "1e-5", "box"], 2, &["2^32", "give a larger spacing"]);
    for bounds in ["1,1,1,0,0,0", "0,0,0,0,0,0", "0,0,0,1,1", "", "a", "x,0,0,1,1,1"] {
        refused(&[], &["--bounds", bounds, "gyroid"], 2, &["--bounds"]);
    }
    for bounds in ["0/0,0,0,1,1,1", "-1/0,0,0,1,1,1", "-1e308,-1e308,-1e308,1e308,1e308,1e308"] {
        refused(&[], &["--bounds", bounds, "gyroid"], 2, &[]);
    }
    refused(&[], &["-s", "1e-3", "--bounds", "1e16,0,0,1e16+2,1,1", "gyroid"], 2, &["rounding"]);
    for threads in ["0", "many", "1000000", "100000000000000000000"] {
        refused(&[], &["--threads", threads, "box"], 2, &["--threads", "1024"]);
    }
}

#[test]
fn equations_that_are_none_are_refused_with_2() {
    for equation in [
        "",
        " ",
        "x,",
        ",",
        "(x",
        "x)",
        "x++",
        "..",
        "1.2.3*x",
        "1e",
        "x y",
        "x;y",
        "x=y",
        "x==y",
        "x<y",
        "$x",
        "`x`",
        "\\x",
        "\u{e9}",
        "\u{1f600}",
        "sin",
        "sin()",
        "sin(x,y)",
        "foo(x)",
        "2x",
        "x!",
        "x%2",
        "|x|",
        "[x]",
        "{x}",
        "\u{202e}x",
    ] {
        refused(&[], &["-s", "1", equation, "box"], 2, &[]);
    }
    for count in [300, 100_000] {
        let text =
            |open: &str, close: &str| format!("{}x{}", open.repeat(count), close.repeat(count));
        for equation in [text("(", ")"), text("sin(", ")"), text("-", ""), text("2^", "")] {
            let program = format!("box '{equation}'");
            refused(&[("p", program.as_bytes())], &["@p"], 2, &["nested more than 256 deep"]);
        }
        for equation in ["(".repeat(count), "|".repeat(count), ",".repeat(count)] {
            refused(&[("p", equation.as_bytes())], &["@p", "box"], 2, &[]);
        }
    }
}

#[test]
fn options_without_end_are_told_in_short() {
    let long = "-".repeat(100_000);
    refused(&[], &[&long, "box"], 2, &["unexpected argument"]);
    refused(&[], &["-s", &format!("1/{}", "9".repeat(100_000)), "box"], 2, &["`-s`"]);
    refused(&[], &["-o", &format!("{}.xyz", "n".repeat(100_000)), "box"], 2, &["extension"]);
}

#[test]
fn words_without_end_are_told_in_short() {
    let long = "x".repeat(8 << 20);
    refused(&[("p", long.as_bytes())], &["@p"], 2, &["unknown name `xxx", "bytes) ...xxx"]);
    let many = "shpere ".repeat(200_000);
    refused(&[("p", many.as_bytes())], &["@p"], 2, &["did you mean `sphere`"]);
    let sum = format!("a{}", "+a".repeat(100_000));
    refused(&[("p", sum.as_bytes())], &["@p"], 2, &["unknown name `a`"]);
}

#[test]
fn numbers_of_operations_are_refused() {
    for (program, code) in [
        ("box scale 0", 2),
        ("box scale 1/0", 2),
        ("box scale 0/0", 2),
        ("box translate 1,2", 2),
        ("box translate 1e308,0,0", 1),
        ("box translate 1e17,0,0", 1),
        ("box rotate 1 0,0,0", 2),
        ("box dilate 0/0", 2),
        ("box dilate 1/0", 2),
        ("box erode 2", 1),
        ("torus minor -1", 2),
        ("cone radius 0", 2),
        ("ellipsoid radii 0,0,0", 2),
        ("plane normal 0,0,0 box", 2),
        ("octet radius -1 box", 2),
        ("gyroid density 2 box", 2),
        ("gyroid density -1 box", 2),
        ("gyroid stretch q 1 box", 2),
        ("box gyroid fill size 0", 2),
        ("box gyroid fill size -1", 2),
        ("union", 2),
        ("box union", 2),
        ("gyroid", 1),
        ("box complement", 1),
        ("box sphere scale 0.001 translate 9,9,9", 1),
        ("box sphere translate 9,9,9 intersection", 1),
    ] {
        let words: Vec<&str> = ["-s", "0.2"].into_iter().chain(program.split(' ')).collect();
        refused(&[], &words, code, &[]);
    }
}

#[test]
fn programs_that_grow_without_end_are_refused_with_2() {
    // Each wall holds three of the one before it, with their slopes.
    let walls = format!("gyroid {} box", "thickness 0.3 ".repeat(30));
    refused(&[("p", walls.as_bytes())], &["@p"], 2, &["too large", "p:1:", "thickness"]);
    // Each motion makes the expression again, but those that follow one another are made at once.
    let motions = format!("box {}", "rotate 0.01 0,0,1 dilate 0.1 ".repeat(100_000));
    refused(&[("p", motions.as_bytes())], &["@p"], 2, &["too large", "p:1:"]);
    let motions = format!("box {}", "rotate 0.01 0,0,1 ".repeat(100_000));
    refused(&[("p", motions.as_bytes())], &["@p"], 1, &["unbounded"]);
    let words = "box ".repeat(2_000_000);
    refused(&[("p", words.as_bytes())], &["@p"], 2, &["more than 1048576 words"]);
    let names: Vec<String> = (0..15).map(|n| format!("f{n}")).collect();
    let texts: Vec<String> = (1..16).map(|n| format!("@f{n} ").repeat(4)).collect();
    let mut doubling: Vec<(&str, &[u8])> =
        names.iter().zip(&texts).map(|(n, t)| (n.as_str(), t.as_bytes())).collect();
    doubling.push(("f15", b"box box box box"));
    refused(&doubling, &["@f0"], 2, &["more than 1048576 words"]);
}

#[test]
fn an_expression_that_takes_too_long_to_arrange_is_refused_with_1() {
    let walls = ["-s", "0.5", "gyroid"].into_iter();
    let walls = walls.chain(["thickness", "0.3"].into_iter().cycle().take(8)).chain(["box"]);
    refused(&[], &walls.collect::<Vec<_>>(), 1, &["operations, more than the 262144"]);
}

#[test]
fn files_of_programs_are_refused_with_their_place() {
    refused(&[("a", b"@a")], &["@a"], 2, &["contains itself"]);
    refused(&[("a", b"@b"), ("b", b"sphere @a")], &["@a"], 2, &["contains itself"]);
    refused(&[("a", b"-q @a")], &["@a"], 2, &["a:1:4", "contains itself"]);
    refused(&[], &["@missing"], 1, &["missing"]);
    refused(&[], &["@."], 1, &["`.`", "folder"]);
    refused(&[("a", b"")], &["@a"], 2, &["no shape"]);
    refused(&[("a", b"box 'open")], &["@a"], 2, &["a:1:5", "not closed"]);
    refused(&[("a", b"box\0")], &["@a"], 2, &["a:1:4", "no meaning"]);
    refused(&[("a", b"box\n\xe9 box")], &["@a"], 1, &["line 2, byte 4", "UTF-8"]);
    refused(&[("a", &files::wide(b"box"))], &["@a"], 1, &["line 1, byte 0", "UTF-8"]);
    refused(&[("a", &files::garbage(100_000))], &["@a"], 1, &["UTF-8"]);
    refused(&[("a", &b"box ".repeat(5 << 20))], &["@a"], 1, &["longer than 16777216 bytes"]);
}

#[test]
fn damaged_meshes_are_refused_with_1_in_a_program() {
    for (name, content) in files::damaged().into_iter().step_by(7) {
        let name = name.replace(' ', "_");
        refused(&[(&name, &content)], &["-s", "0.5", &name], 1, &["can't read the mesh", &name]);
    }
    refused(&[("a.stl", b"")], &["a.stl", "box"], 1, &["the file is empty"]);
    for name in ["a.vtu", "a.glb"] {
        refused(&[(name, b"x")], &[name, "box"], 1, &["files are not read", "export it as PLY"]);
    }
    refused(&[("a.png", b"x")], &["a.png", "box"], 2, &["no mesh format ends in `.png`"]);
}

#[test]
fn damaged_lattices_are_refused_with_1_and_their_place() {
    let plain = |text: &str, words: &[&str]| {
        refused(&[("a.cell", text.as_bytes())], &["a.cell", "radius", "0.1", "box"], 1, words);
    };
    plain("", &["a.cell"]);
    plain("node a nan 0 0\n", &["line 1"]);
    plain("node a 0 0 0\nnode b 1e300 1 1\n", &["line 2"]);
    plain("node a 0 0 0\nedge a a\n", &["line 2"]);
    plain("edge a b\n", &["line 1", "a"]);
    plain("node a 0 0 0\nnode a 1 0 0\n", &["line 2"]);
    plain("node a 0 0 0 -1\nedge a a\n", &["line 1"]);
    plain(&"node n 0 0 0\n".repeat(100_000), &["line 2"]);
    plain(&format!("node {} 0 0 0\n", "x".repeat(3 << 20)), &["a.cell"]);
    plain(&"# comment\n".repeat(1_000_000), &["a.cell"]);
    let json = |text: &str, words: &[&str]| {
        let arguments = ["a.cell.json", "radius", "0.1", "box"];
        refused(&[("a.cell.json", text.as_bytes())], &arguments, 1, words);
    };
    json("", &["line 1"]);
    json(&"[".repeat(1_000_000), &["line 1"]);
    json(&"{\"nodes\":".repeat(100_000), &["line 1"]);
    json("{\"foo\": 1}", &["line 1", "foo"]);
    json("{\"nodes\": [{\"id\": 1, \"at\": [0, 0]}]}", &["line 1"]);
    json("{\"nodes\": [{\"id\": 1, \"at\": [1e999, 0, 0]}]}", &["line 1"]);
    let ltcx = |text: &str, words: &[&str]| {
        refused(&[("a.ltcx", text.as_bytes())], &["a.ltcx", "radius", "0.1", "box"], 1, words);
    };
    ltcx("", &["a.ltcx"]);
    ltcx(&"<a>".repeat(100_000), &["line 1, column 193", "64 deep"]);
    ltcx("<graph><nodegroup", &["line 1"]);
    ltcx("<graph>\n<node id=\"1\" x=\"q\" y=\"0\" z=\"0\"/></graph>", &["line 2", "q"]);
    let bomb = "<!DOCTYPE g [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\"><!ENTITY c SYSTEM \
                \"file:///etc/passwd\">]><graph><node id=\"&c;\" x=\"&b;\" y=\"0\" z=\"0\"/></graph>";
    ltcx(bomb, &["line 1"]);
}

#[cfg(unix)]
#[test]
fn paths_within_files_are_not_opened() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl a\n").unwrap();
    let inside = "<item objectid=\"1\"/><item objectid=\"2\" path=\"/../../secret.model\"/>";
    let relations = "<Relationships><Relationship Target=\"../../../../etc/passwd\" Id=\"r\" \
        Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let leading = files::archive_of("_rels/.rels", std::iter::once(relations.as_bytes()));
    refused(&[("a.3mf", &leading)], &["a.3mf"], 1, &["in the archive"]);
    let material = [&b"mtllib a.mtl /etc/passwd\n"[..], &files::sound("obj")].concat();
    let model = files::built("", inside);
    for (name, content, code) in [("a.obj", material, 0), ("b.3mf", model, 1)] {
        std::fs::write(folder.path().join(name), content).unwrap();
        let trace = folder.path().join("trace");
        let mut command = std::process::Command::new("strace");
        command.args(["-f", "-e", "trace=open,openat", "-o"]).arg(&trace);
        command.args([super::run::CESOGEN, "-q", "-s", "0.5", "-o", "out.ply", name]);
        let Ok(output) = command.current_dir(folder.path()).output() else {
            println!("skipped: there is no strace");
            return;
        };
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{said}");
        let trace = std::fs::read_to_string(&trace).unwrap();
        assert!(trace.contains(name), "{trace}");
        for forbidden in ["a.mtl", "passwd", "secret"] {
            assert!(!trace.contains(forbidden), "{forbidden}: {trace}");
        }
    }
}
