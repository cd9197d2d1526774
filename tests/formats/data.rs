//! What other programs' files contain: triangles after division of polygons, and whether each is
//! closed, edge-manifold and consistently oriented.

/// What reading a file should give.
pub enum Expected {
    /// A mesh.
    Mesh { triangles: usize, closed: bool },
    /// An error whose message contains the text.
    Refusal(&'static str),
}

/// A file.
pub struct Row {
    pub name: &'static str,
    pub expected: Expected,
}

const fn mesh(name: &'static str, triangles: usize, closed: bool) -> Row {
    Row { name, expected: Expected::Mesh { triangles, closed } }
}

const fn refusal(name: &'static str, part: &'static str) -> Row {
    Row { name, expected: Expected::Refusal(part) }
}

/// The files, in the order of their table.
pub const FILES: &[Row] = &[
    mesh("bunny_open.stl", 69_451, false),
    mesh("bunny_closed.obj", 59_664, true),
    mesh("wingnut.obj", 6_090, true),
    mesh("spot_low.obj", 1_654, true),
    mesh("spot_quads.obj", 372, true),
    mesh("featuretype.stl", 3_476, false),
    mesh("cycloidal.ply", 43_368, false),
    mesh("angle_block.stl", 704, false),
    mesh("octagonal_pocket.ply", 3_262, false),
    mesh("busted.stl", 3_878, true),
    mesh("soup.stl", 100, false),
    mesh("multibody.stl", 32, false),
    mesh("two_solids_ascii.stl", 24, true),
    mesh("negative_indices.obj", 12, true),
    mesh("polygonfaces.obj", 3, false),
    mesh("cube_compressed.obj", 12, true),
    mesh("cubevt.obj", 12, false),
    mesh("singlevn.obj", 2, false),
    mesh("groups.obj", 2_308, true),
    refusal("face_in_group_name.obj", "no faces"),
    mesh("jacked.obj", 12, true),
    mesh("comments.off", 12, true),
    mesh("whitespace.off", 12, true),
    mesh("metadata.ply", 2, false),
    refusal("points_emptyface.ply", "no faces"),
    mesh("fixed_top.ply", 4_772, true),
    mesh("cube_blender_uv.ply", 12, false),
    refusal("points_ascii_with_lists.ply", "no faces"),
    mesh("ballA.off", 3_796, true),
    mesh("not_convex.obj", 96, false),
    mesh("seven_eighths_cube.stl", 24, true),
    mesh("counterXP.3mf", 83_750, true),
    mesh("featuretype.3mf", 2_208, false),
    refusal("BoxInterleaved.glb", "GLB files are not read"),
    mesh("cube_and_sphere.3mf", 5_132, true),
    mesh("gearwheel_ascii.stl", 2_444, true),
    mesh("box_3x3x3_offset.stl", 12, true),
    refusal("plyrs_exponent_values_ok_ascii.ply", "no faces"),
    refusal("plyrs_leading_spaces_ok_ascii.ply", "no faces"),
    refusal("plyrs_all_atomic_types_ok_ascii.ply", "no faces"),
    mesh("plyrs_house_2_ok_little_endian.ply", 3, false),
    mesh("plyrs_greg_turk_example2_ok_ascii.ply", 12, true),
    mesh("bunny_be.ply", 69_451, false),
    mesh("wingnut_mm_far.stl", 6_090, true),
    mesh("wingnut_1e7_far_f64.ply", 6_090, true),
    mesh("cube_huge.stl", 24, true),
    mesh("cube_tiny_crlf.stl", 48, true),
    mesh("spot_quads_be_extra.ply", 372, true),
    mesh("spot_quads.ply", 372, true),
    mesh("spot_crlf_mixed.obj", 372, true),
    mesh("spot_COFF.off", 1_654, true),
    mesh("spot_NOFF.off", 1_654, true),
    mesh("featuretype_clean.ply", 3_476, true),
    mesh("dirty_duplicates.ply", 4_289, false),
    mesh("dirty_flipped.ply", 3_476, false),
    mesh("dirty_inverted.ply", 3_476, true),
    mesh("dirty_holes.ply", 3_303, false),
    mesh("dirty_selfintersecting.ply", 6_952, true),
    mesh("dirty_nonmanifold.ply", 3_477, false),
    mesh("dirty_needles.ply", 5_794, true),
    // 1,083 faces of the file repeat a corner.
    mesh("dirty_degenerate.ply", 3_476, true),
    refusal("empty_0_faces.stl", "no faces"),
    refusal("spot_low.vtu", "VTU files are not read"),
    refusal("spot_low.glb", "GLB files are not read"),
];

/// Files of one shape, and how much larger the volumes of the later ones are; relative tolerance.
pub const SAME: &[(&str, &str, f64, f64)] = &[
    // Decimal text of the same numbers.
    ("spot_quads.obj", "spot_crlf_mixed.obj", 1.0, 1e-15),
    ("spot_quads.obj", "spot_quads.ply", 1.0, 1e-15),
    ("spot_quads.obj", "spot_quads_be_extra.ply", 1.0, 1e-15),
    ("spot_low.obj", "spot_COFF.off", 1.0, 1e-5),
    ("spot_low.obj", "spot_NOFF.off", 1.0, 1e-5),
    ("bunny_open.stl", "bunny_be.ply", 1.0, 1e-6),
    ("featuretype_clean.ply", "dirty_inverted.ply", -1.0, 1e-6),
    ("featuretype_clean.ply", "dirty_degenerate.ply", 1.0, 1e-6),
    ("featuretype_clean.ply", "dirty_needles.ply", 1.0, 1e-6),
    // Its box is the cube [-1, 1]^3.
    ("cube_compressed.obj", "negative_indices.obj", 1.0, 1e-5),
];

/// Components and defects, in the order of the contract of `mesh::check`.
pub const DEFECTS: &[(&str, usize, [u64; 10])] = &[
    ("angle_block.stl", 1, [0, 0, 0, 0, 0, 166, 0, 0, 33, 0]),
    ("featuretype.stl", 1, [0, 0, 0, 0, 0, 576, 0, 0, 0, 0]),
    ("octagonal_pocket.ply", 2, [0, 0, 0, 0, 0, 54, 0, 0, 3, 0]),
    ("multibody.stl", 2, [0, 0, 0, 0, 0, 0, 0, 12, 0, 0]),
    ("soup.stl", 100, [0, 0, 0, 0, 0, 300, 0, 0, 0, 0]),
    ("cycloidal.ply", 100, [0, 0, 0, 0, 0, 0, 242, 0, 26, 0]),
    // Every seventh and every eleventh face again: 497 + 316.
    ("dirty_duplicates.ply", 1, [0, 0, 0, 0, 813, 0, 2129, 131, 0, 0]),
    ("dirty_nonmanifold.ply", 1, [0, 0, 0, 0, 0, 2, 1, 0, 0, 0]),
    ("dirty_inverted.ply", 1, [0; 10]),
    ("featuretype_clean.ply", 1, [0; 10]),
];
