//! What is promised and how it is tested.
//!
//! A page for whoever has to trust this program; there is no code here. Each row has a promise, the tests
//! that would fail if it were broken, and how much they look at. A test (`tests/policy.rs`) keeps the
//! table true: every test that it names exists. What runs only when asked for (`cargo test --release --
//! --ignored`) says so.
//!
//! # Meshes
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | every mesh is closed, oriented, edge- and vertex-manifold, without triangles of zero area | `src/contour/tests.rs`: `all_cases_close_in_every_position`, `random_signs_close_with_crossings_anywhere`, `random_signs_close_across_bricks` | all 256 sign patterns of a cell in 27 positions; 600 random fields and 12 across bricks |
//! | the same of programs without sense: NaN, infinities, jumps, shapes that are tiny or missing | `tests/random.rs`: `meshes_are_sound_and_depend_on_neither_engine_nor_pruning_nor_threads` | 400 random programs; 20,000 more when asked for |
//! | the file does not depend on threads, engine or pruning, to the byte | `tests/determinism.rs`: `meshes_do_not_depend_on_threads_engine_or_pruning`, `files_do_not_depend_on_the_number_of_threads` | a program each of formulas, of many parts and of meshes |
//! | volume and area converge with second order | `tests/convergence.rs`: `the_sphere_converges_with_second_order`, `the_torus_converges_with_second_order`, `the_gyroid_converges_with_second_order` | closed forms of sphere and torus, the gyroid against its own limit |
//! | `--snap` removes slivers and keeps the kind of the mesh, its flat cuts and its vertices on the surface | `tests/slivers.rs`: `surfaces_of_the_catalogue_have_no_angle_below_5_degrees`, `edges_of_the_box_that_the_surface_touches_leave_no_slivers`, `vertices_keep_to_their_side_of_walls_and_jumps`, `where_a_surface_crosses_itself_files_hold_no_vertex_twice`, `flat_cuts_stay_flat_and_corners_stay_corners`, `vertices_stay_on_the_surface_and_files_do_not_depend_on_threads`, `src/mesh/slivers/tests.rs`: `a_thread_widens_along_the_surface`, `a_neck_of_three_edges_gets_a_fourth_for_the_one_that_goes`, `a_block_gets_the_edge_back_that_a_narrow_strip_cuts_off` | 27 surfaces at 64³: sound, Euler characteristic, components, volume to 0.3 %, no angle below 5° |
//! | measures straight from the field are as far off as they say, and of fourth order where the solid is smooth | `tests/quadrature.rs`: `faces_just_beyond_nodes_are_where_they_are`, `errors_of_smooth_solids_are_enclosed`, `errors_at_creases_are_enclosed_nearly_always`, `the_order_is_the_fourth_on_smooth_surfaces_and_the_second_at_creases`, `a_gyroid_that_the_box_cuts_is_measured_as_by_the_limit_of_meshes` | five solids of closed form in 40 sizes and places each: all 120 smooth ones are enclosed; a gyroid against its meshes |
//! | densities are right, to 1e-4 or as far off as is said | `tests/lattices.rs`: `levels_of_densities_are_those_of_the_catalogue`, `densities_of_thin_walls_and_of_many_cells_are_right`, `densities_do_not_depend_on_those_solved_for_before_nor_on_units`, `a_density_is_measured_in_the_part_and_follows_parameters`, `densities_in_a_mesh_are_as_wrong_as_they_are_said_to_be`, `a_density_in_a_mesh_is_right_where_its_faces_cut_cells`, `the_density_of_a_field_that_jumps_in_a_mesh_is_the_one_reached`, `densities_do_not_depend_on_how_large_the_values_of_the_field_are` | the catalogue of levels; a ball; six lattices in the mesh of a cube against quadrature, less than 1.5e-4 off; an octahedron cut by a plane against its volume |
//! | walls of true thickness have their volume and are nowhere far from their surface; where they are not, a warning says so | `tests/lattices.rs`: `thick_walls_of_true_thickness_have_their_volume`, `walls_that_are_not_as_thick_as_asked_are_told`, `walls_of_true_thickness_follow_the_tube_formula`, `walls_of_true_thickness_are_nowhere_far_from_the_surface` | volumes of nine walls to 0.2 %, of nine thick ones to 1 %; twelve programs with and without failures; 3,600 points of four surfaces against the vertices of the middle |
//! | whole cells are all those that lie in a convex part | `tests/lattices.rs`: `whole_cells_are_all_those_that_lie_in_the_part` | boxes, moved and stretched; a ball against its corners; beside a hole |
//!
//! # Solids that pass through files
//!
//! Anyone can repeat these by `alveole study`, at any size and of any program.
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | a mesh that is read back and contoured on its grid is a fixed point, up to some rounding of its coordinates a trip | `tests/roundtrips.rs`: `round_trips_leave_a_mesh_as_it_is`, `the_command_for_round_trips_finds_the_fixed_point`, `a_hundred_round_trips_at_the_spacing_of_the_paper_leave_a_mesh_as_it_is` | Figure 10 of the Cesogen paper: 20 trips at a fifth of its resolution; 100 at its own when asked for; 1,000 once by the command at `-s 4/100`: the same triangles, volume and area to 15 digits, the four errors to 11, no vertex 3e-10 spacings off; at `-s 4/20` none 1e-11 |
//! | on shifted grids a trip moves a surface by what is of second order in the spacing, which adds up | `tests/roundtrips.rs`: `on_shifted_grids_a_trip_loses_what_is_of_second_order`, `src/job/study/round_trips.rs`: `on_other_grids_a_ball_shrinks_by_what_chords_cut_off` | Figure 10 at two spacings; a ball, against what chords cut off |
//! | a solid made by intersections in steps through files is as good as one made at once | `tests/roundtrips.rs`: `a_hierarchy_made_by_steps_is_as_good_as_at_once`, `the_command_for_hierarchies_finds_steps_as_good_as_all_at_once`, `a_hierarchy_at_the_spacing_of_the_paper_made_by_steps_is_as_good_as_at_once` | Figure 5, four steps, four errors within a factor of two; at the paper's resolution when asked for |
//! | errors are what they are said to be | `tests/roundtrips.rs`: `the_command_for_round_trips_finds_the_fixed_point`, `src/measure/deviation.rs`: `an_octahedron_is_off_the_ball_by_its_closed_form` | a closed form; the same computed apart |
//!
//! # Engines
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | every engine gives the interpreter's bits, and ranges hold what they enclose | `tests/random.rs`: `engines_agree_to_the_bit_and_intervals_enclose_their_values`, `src/eval/jit/tests.rs`: `random_expressions_are_compiled_to_the_interpreters_bits`, `a_million_random_expressions_are_compiled_to_the_interpreters_bits` | random programs with every operation but densities; a million random expressions, of the seeds 100 to 299, when asked for: run once, without a difference |
//! | derivatives are those of differences | `tests/random.rs`: `gradients_are_those_of_differences`, `tests/gradients.rs`: `a_thousand_random_solids_have_the_gradient_of_their_differences` | random programs; a thousand solids with parameters when asked for |
//! | a server stays sound and its memory steady | `tests/soak.rs`: `a_server_answers_a_thousand_random_requests_in_steady_memory`, `a_server_answers_a_hundred_thousand_random_requests_in_steady_memory` | 500 random requests twice, answered the same, in no more memory; 10,000 ten times when asked for |
//!
//! # Hosts
//!
//! Files and numbers are the same on x86-64 and on aarch64, with or without their optional instructions.
//! Each test runs on one host, so a table of digests stands for the others. To run the tests for aarch64 on
//! another machine takes a Rust toolchain with the standard library of aarch64, a C linker for it, and
//! QEMU's user-mode emulation:
//!
//! ```text
//! CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
//! CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER='qemu-aarch64 -L SYSROOT' \
//! cargo test --release --target aarch64-unknown-linux-gnu --test hosts --lib
//! ```
//!
//! SYSROOT being the folder of that architecture's C library. On x86-64 a runner `qemu-x86_64 -cpu Conroe` is a
//! processor without AVX and without SSE 4.1. Tests that start programs need a kernel that starts them in the
//! emulator. The library's tests were run once on aarch64 in that way: 491 passed, all but the one that
//! starts the test program again.
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | files and measures have the same bytes on every host | `tests/hosts.rs`: `files_and_measures_have_the_bytes_of_every_host`, `every_surface_and_every_cell_has_a_line` | 137 programs: every surface and cell, every kind of operation, meshes, every format, measures; the library's functions of `std`, whose last bits are the platform's, are refused by a lint (`clippy.toml`). All were the same on x86-64, and in QEMU on aarch64 and on x86-64 without AVX and SSE 4.1; of the lines that changed since, `snap 24 c-d shell 0.3 box`, `iwp density` and a density in `closed.ply` were looked at on x86-64 alone, the other programs that read `open.ply` or `closed.ply` on aarch64 too |
//! | programs compiled without optional instructions have the interpreter's bits | `src/eval/jit/host.rs`: `every_test_of_compiled_programs_holds_without_optional_instructions` | the whole suite of engines, and random expressions |
//!
//! # Bad input
//!
//! Each is refused with its exit code (2 where command line or program are wrong, 1 where a file is or the
//! work fails) and one message with place, cause and cure, within twenty seconds of processor time and two
//! gigabytes of addresses; nothing is left behind.
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | damaged mesh files are refused in words that do not change unnoticed | `tests/bad_input.rs`: `every_damaged_file_is_refused_in_these_words`, `every_message_names_the_file_and_a_cure_in_one_line` | some 130 files: words for numbers, indices and counts out of range, cut short, of another encoding, packed to exhaust memory |
//! | no bytes make a reader panic | `tests/formats.rs`: `no_bytes_make_a_reader_panic` | 3,000 mutations of 9 files a run; the fuzz target `mesh_read` |
//! | time and memory are bounded by the size of the file | `tests/bad_input.rs`: `one_line_or_word_of_megabytes_is_taken_in_a_second`, `a_polygon_that_crosses_itself_for_ever_is_refused`, `files_of_gigabytes_without_content_are_refused_by_their_first_bytes` | 8 MiB in one line or word in five formats; a polygon of 400,000 corners; 12 GiB of nothing under ten names |
//! | pipes and devices do not keep the program waiting or reading | `tests/bad_input.rs`: `a_pipe_that_nobody_writes_to_is_given_up`, `devices_that_never_end_are_refused_by_their_first_bytes`, `a_pipe_with_a_writer_is_read` | under ten names each, and as a file of words |
//! | folders, missing and forbidden files are refused, to read and to write | `tests/bad_input.rs`: `folders_and_links_to_nothing_are_refused`, `what_may_not_be_read_or_written_is_refused`, `outputs_that_are_no_files_are_refused` | ten names; outputs in every format |
//! | lattice files are refused with their place | `tests/bad_input.rs`: `damaged_lattices_are_refused_with_1_and_their_place` | some twenty files in three formats; the fuzz target `lattice` |
//! | program text is refused with its place | `tests/language.rs`: `faults_of_words`, `faults_of_arguments`, `faults_of_equations`, `faults_of_files`, `faults_of_bounds`, `faults_of_parameters` | exact pictures; the fuzz targets `program` and `equation` |
//! | no text makes the program grow, nest or talk without end | `tests/bad_input.rs`: `programs_that_grow_without_end_are_refused_with_2`, `equations_that_are_none_are_refused_with_2`, `words_without_end_are_told_in_short`, `an_expression_that_takes_too_long_to_arrange_is_refused_with_1` | 100,000 parentheses and motions, two million words, files within files to 4^15 words, words of megabytes |
//! | a server answers every line and the next | `tests/bad_input.rs`: `whatever_a_line_holds_it_gets_its_reply_and_the_next_is_served` | some thirty lines; the fuzz target `serve` |
//! | work that does not fit into memory is refused before it is done, with the numbers | `tests/bad_input.rs`: `work_beyond_memory_is_refused_before_it_is_done_with_the_numbers`, `src/octree/subdivide.rs`: `more_bricks_than_allowed_are_refused_and_no_fewer`, `far_too_many_bricks_are_foreseen_early` | grids under `ulimit -v`; some 10^7 bricks foreseen to a factor of four |
//! | under a limit of memory the work is done or ends with a message | `tests/bad_input.rs`: `whatever_the_limit_of_memory_the_work_is_done_or_ends_with_1_and_a_message` | three jobs at nineteen limits; below, memory that the system refuses in small pieces ends the process with code 1 and the standard library's message, and an unfinished output is left as after a kill |
//!
//! # Outputs
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | whenever a run is interrupted, the output is the old one or the new one, whole | `tests/interrupted.rs`: `an_output_is_the_old_one_or_the_new_one_whenever_it_is_interrupted`, `two_hundred_interruptions_leave_the_old_output_or_the_new_one` | 18 runs in two formats at random moments by three signals, some with a mesh beyond what stays in memory; 200 in four formats when asked for |
//! | only a kill leaves a file, which a later run removes, but never one of a live run | `tests/interrupted.rs`: `leftovers_of_a_killed_run_are_removed_and_those_of_a_live_one_are_not`, `runs_into_one_output_at_a_time_leave_a_whole_one`, `src/cli/output.rs`: `a_file_that_another_run_took_for_a_leftover_is_made_again` | runs side by side; the moment between making and locking, by hand |
//! | a signal that is ignored at the start stays ignored, and a file beyond the size limit is an error that leaves nothing | `tests/interrupted.rs`: `a_signal_that_is_ignored_at_the_start_stays_ignored`, `a_file_beyond_the_size_limit_is_an_error_and_leaves_nothing` | three signals; three formats |
//! | devices, links and pipes stay what they are | `tests/interrupted.rs`: `what_the_output_is_it_stays`, `an_interruption_behind_a_link_keeps_link_and_target` | `/dev/null`, a link, a pipe, standard output |
//! | a full disk or a reader that goes is an error, and nothing is left | `tests/bad_input.rs`: `a_disk_without_room_is_an_error_and_leaves_nothing`, `a_full_disk_on_standard_output_is_an_error_of_whatever_is_printed`, `a_reader_that_goes_ends_the_work_with_1_and_a_listing_with_0` | every format, small and large, by a limit of the size of files; every command that prints |
//! | memory for a file does not grow with the mesh, and large and small ones are written the same | `tests/bad_input.rs`: `large_meshes_are_written_in_every_format_in_little_memory`, `standard_output_takes_a_large_mesh_in_little_memory`, `src/mesh/io/output.rs`: `runs_in_any_order_give_the_file_written_at_once_from_memory_and_from_a_file`, `src/mesh/io/ply/spool.rs`: `a_mesh_comes_back_in_bounded_runs_whichever_vertices_its_triangles_have` | four million triangles under `ulimit -v`; every format and precision, from three threads |
//!
//! # Dirty meshes
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | the inside of a damaged mesh is that of the clean one, everywhere, but for a fiftieth of its size from the surface where there are holes or fins | `tests/dirty.rs`: `holes_are_told_and_closed`, `faces_turned_over_are_turned_back_to_the_last`, `a_mesh_inside_out_is_turned_over`, `repeated_and_degenerate_faces_are_counted_and_left_out`, `needles_and_cracks_do_no_harm`, `fins_are_told`, `all_damage_at_once_leaves_the_inside` | three solids, nine kinds of damage, 13,824 points each, no sign wrong |
//! | bodies that overlap are their union | `tests/dirty.rs`: `bodies_that_overlap_are_their_union` | three solids, 13,824 points each |
//! | size and place do not matter | `tests/dirty.rs`: `size_and_place_do_not_matter` | sizes of 1e-7 and 1e7, places of 1e7 and 1e9 |
//! | what is made of a dirty mesh is closed | `tests/dirty.rs`: `what_is_made_of_any_mesh_is_closed` | every kind of damage above, and more than 35 real files where `ALVEOLE_DATA` names their folder |
//! | what was found and assumed is said, on standard error and in JSON | `tests/dirty.rs`: `the_report_says_what_was_found_and_assumed_on_stderr_and_in_json` | counts of turned and repeated faces, to the last |
//!
//! # Security
//!
//! Files and requests are data. A mesh file can name others (materials of OBJ, parts of 3MF): none is
//! opened. A program can name files, and a file of words can name more: those are the user's words, and
//! a server reads regular files only. Compiled code is called in one place; its four unsafe blocks are the
//! call, the freeing of its memory, and the promises that finished code may be shared and sent.
//! Known vulnerabilities of dependencies are not looked up: their list is on the network.
//!
//! | promise | tests | size of the evidence |
//! |---|---|---|
//! | no path in a file is opened | `tests/bad_input.rs`: `paths_within_files_are_not_opened`, `tests/policy.rs`: `files_are_opened_in_few_places_by_names_that_the_user_gave` | system calls of two hostile files; every source file |
//! | nothing reaches for the network or runs other programs | `tests/policy.rs`: `no_code_reaches_for_the_network_or_other_programs` | every source file |
//! | unsafe code is in one file, and argued | `tests/policy.rs`: `unsafe_code_is_in_one_file_and_every_block_is_argued` | every source file |
//! | compiled code touches nothing but what it is given | `src/eval/jit/call.rs`: `a_call_with_too_little_memory_is_refused`, `a_call_for_too_many_steps_is_refused` | each call compares what the code can reach with what it is given; the tests of compiled programs, run once in Valgrind's memory checker, gave no error |
//! | dependencies come from the registry, under permissive licences | `tests/policy.rs`: `dependencies_come_from_the_registry_with_their_checksums`, `dependencies_have_permissive_licences` | every package of `Cargo.lock` |
