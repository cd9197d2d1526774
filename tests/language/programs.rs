//! Programs that are right: what they mean at points, and the boxes that hold them.

use crate::support::{Field, parse, program};
use alveole::expr::Node;
use alveole::geom::Aabb;
use alveole::lang;
use glam::DVec3;

/// The field of the program `line` has the value `expected` at `point`, to rounding.
fn check(line: &str, point: [f64; 3], expected: f64) {
    let found = program(line).at(point);
    assert!((found - expected).abs() < 1e-12, "{line} at {point:?}: {found}, not {expected}");
}

/// The box of the program `line` is from `lo` to `hi`, exactly.
fn check_bounds(line: &str, lo: [f64; 3], hi: [f64; 3]) {
    let expected = Aabb::new(DVec3::from_array(lo), DVec3::from_array(hi));
    assert_eq!(program(line).bounds(), expected, "{line}");
}

#[test]
fn every_command_line_of_the_paper_works_as_printed() {
    check("sphere", [0.0, 3.0, 4.0], 4.0);
    check("sphere scale 2,2,2", [0.0, 3.0, 4.0], 3.0);
    check("cylinder box", [0.0, 0.0, 2.0], 1.0);
    check(
        "mesh1.ply gyroid intersection mesh2.ply p-surface intersection union",
        [2.0, 0.0, 0.0],
        1.25,
    );
    check("gyroid dilate 0.35 box", [0.0, 0.0, 0.0], -0.35);
    check("gyroid complement erode 0.35 box", [0.0, 0.0, 0.0], 0.35);
    check("gyroid dilate 0.1 shell '2*abs(0.35)' box", [0.0, 0.0, 0.0], -0.25);
    check("box gyroid dilate 0.35", [0.0, 0.0, 0.0], -0.35);
    check("box gyroid shell '2*0.35'", [0.0, 0.0, 0.0], -0.35);
    check(
        "box scale 4,4,4 sphere scale 5,5,5 p-surface scale 4,4,4 d-surface scale 3.75,3.75,3.75 \
         gyroid scale 1.25,1.25,1.25",
        [0.0; 3],
        12.0,
    );
    check("box scale 4,4,4 sphere scale 4,4,4 gyroid scale 4,4,4", [0.0; 3], 0.0);
    check("x+y+z-1", [1.0, 2.0, 3.0], 5.0);
}

#[test]
fn bounds_follow_the_operations() {
    check_bounds("sphere", [-1.0; 3], [1.0; 3]);
    check_bounds("sphere scale 2,3,4", [-2.0, -3.0, -4.0], [2.0, 3.0, 4.0]);
    check_bounds("cylinder box", [-1.0; 3], [1.0; 3]);
    check_bounds("gyroid box dilate 0.5", [-1.5; 3], [1.5; 3]);
    check_bounds("box translate 1,2,-3", [0.0, 1.0, -4.0], [2.0, 3.0, -2.0]);
    check_bounds("box translate 1,0,0 scale -2,1,1", [-4.0, -1.0, -1.0], [0.0, 1.0, 1.0]);
    check_bounds("box box translate 3,0,0 union", [-1.0; 3], [4.0, 1.0, 1.0]);
    check_bounds("box sphere translate 1,0,0 difference", [-1.0; 3], [1.0; 3]);
    check_bounds("box erode 0.25", [-1.0; 3], [1.0; 3]);
    check_bounds("box erode -0.25", [-1.25; 3], [1.25; 3]);
    check_bounds("box shell 0.5", [-1.25; 3], [1.25; 3]);
    check_bounds("sphere scale 1,1,2 dilate 0.25", [-1.25, -1.25, -2.5], [1.25, 1.25, 2.5]);
    check_bounds("box scale 1,2,3 rotate pi/2 0,0,1", [-2.0, -1.0, -3.0], [2.0, 1.0, 3.0]);
    check_bounds("plane box", [-1.0; 3], [1.0, 1.0, 0.0]);
    check_bounds("mesh1.ply", [-0.75; 3], [0.75; 3]);
}

#[test]
fn parameters_move_bounds_and_fields() {
    let mut program =
        parse(&["sphere", "scale", "2*t", "dilate", "u"], &[("t", 1.0), ("u", 0.0)]).unwrap();
    assert_eq!(program.bounds().hi, DVec3::splat(2.0));
    assert_eq!(program.solid.bounds(&program.graph, &[2.0, 0.5]).hi, DVec3::splat(4.5));
    let slots =
        [program.graph.parameters()[0].0.as_str(), program.graph.parameters()[1].0.as_str()];
    assert_eq!(slots, ["t", "u"]);
    let before = program.at([4.0, 0.0, 0.0]);
    let slot = program.graph.iter().find_map(|(_, node)| {
        if let Node::Parameter(slot) = node { (slot.index() == 0).then_some(slot) } else { None }
    });
    program.graph.set_parameter(slot.unwrap(), 2.0);
    assert_eq!((before, program.at([4.0, 0.0, 0.0])), (2.0, 0.0));
}

#[test]
fn arguments_are_named_or_not_in_any_order() {
    let plain = program("box rotate pi/2 1,2,3").solid.field;
    for line in [
        "box rotate angle pi/2 axis 1,2,3",
        "box rotate axis 1,2,3 angle pi/2",
        "box rotate pi/2 axis 1,2,3",
        "box rotate axis 1,2,3 pi/2",
        "BOX Rotate AXIS '1, 2, 3' Angle 'pi / 2'",
    ] {
        assert_eq!(program(line).solid.field, plain, "{line}");
    }
    check("sphere dilate offset 0.5", [0.0; 3], -1.5);
    check("sphere shell thickness 0.5", [0.0; 3], 0.75);
    check("sphere translate offset 1,0,0", [0.0; 3], 0.0);
    check("sphere scale factor 2", [0.0; 3], -2.0);
}

#[test]
fn shapes_take_named_arguments_and_leave_the_others_at_their_defaults() {
    check("torus", [1.0, 0.0, 0.0], 0.0);
    check("torus minor 0.5", [1.25, 0.0, 0.0], 0.0);
    check("torus minor 0.5 major 2", [2.5, 0.0, 0.0], 0.0);
    check("plane normal 0,2,0 offset 1", [0.0, 3.0, 0.0], 2.0);
    check("ellipsoid radii 1,2,4", [0.0, 0.0, 4.0], 0.0);
    check("capsule radius 0.25 length 2", [0.0, 0.0, 1.25], 0.0);
    check("cone radius 2", [2.0, 0.0, -1.0], 0.0);
    check("rounded-box radius 1", [1.0, 0.0, 0.0], 0.0);
    check("octahedron radius 2", [0.0, 2.0, 0.0], 0.0);
}

#[test]
fn words_are_told_apart_in_the_order_of_the_paper() {
    // A word, then a mesh, then an equation; a leading minus makes no option.
    assert_eq!(program("box -sin(x)").items.len(), 2);
    assert_eq!(program("box mesh.ply x").items.len(), 3);
    check("y-surface", [0.0; 3], 1.0);
    check("y-1", [0.0; 3], -1.0);
    check("sphere dilate -0.1", [0.0; 3], -0.9);
    check("sphere dilate '2^-1'", [0.0; 3], -1.5);
    check("sphere scale -2", [0.0; 3], -2.0);
}

#[test]
fn offsets_and_motions_apply_to_the_last_shape_only() {
    check("gyroid box dilate 0.35", [0.0; 3], 0.0);
    check("gyroid dilate 0.35 box", [0.0; 3], -0.35);
    check("sphere box translate 5,0,0 union", [5.0, 0.0, 0.0], -1.0);
    check("box sphere scale 0.5 difference", [0.0; 3], 0.5);
}

#[test]
fn the_final_intersection_keeps_the_order_of_its_operands() {
    let program = program("sphere x box y");
    let mut graph = program.graph.clone();
    let [x, y, _] = graph.point();
    let [sphere, cube] = [
        alveole::solid::primitives::sphere(&mut graph),
        alveole::solid::primitives::cube(&mut graph),
    ];
    let all = graph.max(sphere.field, x);
    let all = graph.max(all, cube.field);
    assert_eq!(graph.max(all, y), program.solid.field);
}

#[test]
fn points_of_files_are_numbers_that_vary_in_space() {
    // The loader's points are the distance to the ball of radius 3/4.
    check("sphere dilate '2*[points.fap]'", [0.0, 2.0, 0.0], 1.0 - 2.0 * 1.25);
    check("[points.fap]", [0.0, 0.0, 1.0], 0.25);
    // An equation is one of the space in which its operation stands.
    check("sphere dilate [points.fap] translate 3,0,0", [3.0, 0.0, 0.0], -1.0 + 0.75);
    let program = program("[points.fap] [points.fap]+x [points2.fap]");
    assert_eq!(program.graph.oracles().len(), 2);
}

#[test]
fn a_translation_takes_the_place_of_its_word() {
    let words = ["box".to_owned(), "other:typo".to_owned(), "x".to_owned()];
    let text = lang::expand(&words, &mut crate::support::Files).unwrap();
    let spelt: Vec<_> = text.words.iter().map(|word| word.text.as_str()).collect();
    assert_eq!(spelt, ["box", "shpere", "x"]);
}

#[test]
fn a_mesh_named_twice_is_one_oracle() {
    let program = program("mesh1.ply mesh1.ply translate 1,0,0 mesh2.ply union union");
    assert_eq!(program.graph.oracles().len(), 2);
}

#[test]
fn ten_thousand_parts_make_a_program() {
    let mut words = vec!["box".to_owned()];
    for i in 1..10_000 {
        words.extend(["sphere", "translate", &format!("{i},0,0"), "union"].map(str::to_owned));
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let program = parse(&words, &[]).unwrap();
    assert_eq!(program.bounds().hi.x, 10_000.0);
}

#[test]
fn values_of_options_are_lists_of_equations() {
    let numbers = |text: &str| lang::numbers(text, "the spacing", &[("m".to_owned(), 60.0)]);
    assert_eq!(numbers("2/60").unwrap(), [2.0 / 60.0]);
    assert_eq!(numbers("2/m").unwrap(), [2.0 / 60.0]);
    assert_eq!(numbers("1,2*pi,-3").unwrap(), [1.0, std::f64::consts::TAU, -3.0]);
    let message = |text: &str| numbers(text).unwrap_err().diagnostics[0].message.clone();
    assert_eq!(message("x"), "the spacing can't depend on `x`");
    assert_eq!(message("1,1/0"), "the spacing must be a finite number");
    assert_eq!(message("1,,2"), "a number, name or `(` is missing");
}

#[test]
fn options_can_be_taken_from_the_front_of_expanded_words() {
    let words = ["@nested".to_owned(), "x".to_owned()];
    let mut text = lang::expand(&words, &mut crate::support::Files).unwrap();
    let spelt: Vec<_> = text.words.iter().map(|word| word.text.as_str()).collect();
    assert_eq!(spelt, ["box", "gyroid", "scale", "0.5", "dilate", "0.1", "x"]);
    text.words.remove(0);
    let vocabulary = alveole::vocabulary::Words;
    let rest = lang::program(text, &vocabulary, &mut crate::support::Files, &[]).unwrap();
    assert_eq!(rest.items.len(), 4);
}
