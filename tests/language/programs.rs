//! Programs that are right: what they mean at points, and the boxes that hold them.

use crate::support::{Field, parse, program};
use alveole::geom::Aabb;
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
    let slot = program.graph.iter().find_map(|(_, node)| match node {
        alveole::expr::Node::Parameter(slot) if slot.index() == 0 => Some(slot),
        _ => None,
    });
    program.graph.set_parameter(slot.unwrap(), 2.0);
    assert_eq!((before, program.at([4.0, 0.0, 0.0])), (2.0, 0.0));
}
