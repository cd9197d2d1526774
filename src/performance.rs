//! Where the time goes, what sets the floor, and what was tried and did not pay.
//!
//! A page for whoever makes this faster; there is no code here. Dated figures with machine and
//! commit are in `benches/record`; the ones below explain choices and are ratios wherever ratios
//! will do. Two habits keep such figures honest on a shared machine: compare two builds in turn and
//! take the least user time of each, or count instructions (`valgrind --tool=callgrind`, which
//! repeats to the last digit).
//!
//! # The headline job and its roofline
//!
//! `cesogen -s 2/800 -o out.ply gyroid box`: 801³ nodes, 16.3 million triangles, 309 MB. A program
//! with the gyroid written in by hand, without flat cuts, without the rule that keeps vertices off
//! nodes, with fused multiplications and roots good to single precision, needs 0.46 s of CPU time
//! on a quiet 2.1 GHz Xeon. Run side by side on a quiet machine, the least of five, this crate takes
//! 0.71 s where that program takes 0.62 s, 0.57 against 0.46 s in user mode. Stage by stage, one thread: a profile of both in turn on a busy machine, and on
//! another one the least of five runs, in turn, of the program of that profile and of the present
//! one (read both as ratios):
//!
//! | stage | unit | by hand, ns | then, ns | then, elsewhere | now, elsewhere | what the difference is |
//! |---|---|---|---|---|---|---|
//! | sample | sample | 0.36 | 0.91 | 0.65 | 0.25 | regions left out near the surface |
//! | count | vertex | 10.9 | 9.3 | 6.6 | 4.8 | |
//! | number | vertex | 6.2 | 7.4 | 4.8 | 4.5 | 17³ rows a brick are filled, whatever is crossed |
//! | place | vertex | 24 | 64 | 33 | 28 | roots to rounding in double precision; below |
//! | faces | triangle | 10.4 | 11.7 | 5.2 | 5.5 | |
//! | encode | triangle | 0 | 3 | 1.2 | 1.2 | a [`Sink`](crate::mesh::Sink) takes typed arrays, not bytes |
//! | kernel | byte | 0.61 | 0.65 | | | 0.15 of it to free the pages of a file that is replaced |
//!
//! Subdivision is 3 % of the job. The cost of a vertex, everything included, is flat within 11 %
//! from 401³ to 1601³, and a field with surface in every brick costs 1.2 times that.
//!
//! Placing a vertex takes 350 instructions at 401³ (by one evaluation a root; 460 by two): values
//! and slopes at both ends of an edge 99, one evaluation in between 75 (sine and cosine 22), what
//! depends on the other axes 44, guesses and steps 50, putting vertices in their places 57 (those
//! in outer planes are moved), listing edges 23. By the clock the gain is less; what the loops wait
//! for has not been measured.
//!
//! Re-evaluating volume, area and density of a gyroid at 101³ in `serve` takes 138 million
//! instructions (147 when the mesh was kept, 188 by two evaluations a root) and 8 % less CPU time
//! than when the mesh was kept: 12 ms on a busy machine where that took 13. Placing is 55 % of the
//! instructions, a quarter of which goes into edges that take more than one evaluation; triangles
//! are 16 %, measuring them 9 %, numbering 8 %, sampling 4 %. A fifth of the edges lie in outer
//! planes, and their roots are found twice, from ends that are flat on one side; 73,000 triangles
//! are flat caps. Crossings on the far faces of bricks, found twice, add 9 % to placing.
//!
//! # What pays
//!
//! * **Hoisting** what depends on one or two axes is worth 20 to 50 times on periodic surfaces,
//!   more than any instruction set. Sines of sums are split by the addition theorem
//!   ([`crate::eval::lower`]), with three multiplications: a gyroid about any vector has 20
//!   operations a sample where the straight one has 4, and costs 4.1 to 4.4 times as much.
//! * **Signs, not values**: the compiled sign program sees through monotone operations with constants
//!   and through roots to a threshold on the argument. Twenty balls cost a third of what they did.
//! * **One table entry a pair of axes and brick**: values on x and z or on y and z are computed 256
//!   at a time. `sin(tau*x*(1+0.2*z))` costs little more than a hoisted wave.
//! * **One evaluation a root**: values and slopes at both ends give a cubic, which gives the guess
//!   and the curvature there; the step from the evaluation is accepted only where the cubic
//!   foretold the slope so well that the step's error is below rounding. From five evaluations to
//!   two it was a fifth of all instructions of the job, from two to one a twentieth: slopes at the
//!   ends cost half of what the second one did.
//! * **Knowing why edges stay open**: nearly all of them were in outer planes, flat at their inner
//!   ends. Newton's method from outside overshoots into the flat part half of the time, and
//!   bisection took over for ten rounds. They take one or two now. On the faces of a turned box,
//!   whose distance has no slope at its zero, bisection went on to the end: a gyroid in such a box
//!   took 2.2 times as many instructions at 101³.
//! * **Regions left out near the surface, found with the ranges**: a part that a lattice fills
//!   drops out of the bricks well inside of it. Sampling the gyroid in a box fell from 284 to 105
//!   million instructions at 401³, everything by an eighth.
//! * **Numbers picked from tables inside the compiled loops**, not gathered to buffers by calls: 2
//!   %, and less code.
//! * **Sine and cosine over two vectors side by side**, polynomials in pairs: a quarter off.
//! * **Writing past the page cache** beyond 2 GiB: kernel time of a 2.3 GB file fell from 2.7 s to
//!   0.3 s. Room is set aside first: a direct write into a hole takes the file for itself until the
//!   disk is done, and two writers work as one.
//! * **Exchanging names with the file that is replaced**, and removing it after: ext4 hands a file that is
//!   renamed over another to the disk first. The headline job over an older file takes 0.44 to 0.56 s
//!   of wall time on two threads instead of 0.50 to 0.69, five runs in turn on a quiet machine.
//! * **Mesh distance in single precision first**: leaves of eight faces are tried in `f32` and only
//!   faces in doubt are measured in `f64`; boxes turned to the mean normal of their faces; bricks
//!   along a serpentine. Four to nine times on scattered points. What is in doubt is measured by the
//!   longest edge, not by the mesh: a tenth.
//! * **Asking an oracle for what shows and no more**: where only signs are wanted a distance at one
//!   point settles all points nearer than it is far from the level ([`crate::eval::compared`]): two
//!   exact values for every cell of the surface where a brick has sixteen. On lines, the values
//!   that lose against the lattice are passed over. A bunny of 60 k triangles filled with 8 gyroid
//!   cells takes 0.23 s of CPU time instead of 0.97 s at 100 samples (Scaffolder, in turn: 14.8 s),
//!   1.05 s instead of 13.2 s at 400. Of the former, two fifths are distances on edges, a tenth
//!   those of samples, a third reading the mesh and preparing its tree.
//!   With a skin, whose inner face takes the distance once more, values lose at both places or count:
//!   a bunny of 20 blended cells and a skin at 500 samples takes 5.6 s of CPU time instead of 17.0.
//!   The engine of huge expressions asks in the same way, and for value and slopes at once: a bunny of
//!   three cells of a foam with a skin, 11.0 s instead of 18.2 at 500 samples.
//! * **Nothing arranged for the whole of a huge expression** ([`Engine::Pruned`](crate::eval::Engine)). A box
//!   asks for what is alive in it, and a walk down the sides of extrema costs what it finds. Before,
//!   ten thousand balls took 1.7 s to put in order and 190 MB of tables at 801³; a thousand took 2 s to compile.
//! * **Blocks of 8³ inside a brick** of a huge expression, each enclosed once more and cut down for
//!   itself. At 100³ a brick near the surface of ten thousand balls needs 160 of them, its blocks 20.
//! * **What is near the surface is found once**, when the brick is enclosed: what matters anywhere in it,
//!   as far from the surface as its diagonal, is some 900 balls.
//! * **Boxes cut where space is folded into a cell**: there x - floor(x) takes all values of the cell, and
//!   all of a foam seems near. In two pieces that meet at neighbouring numbers little of it does:
//!   half of the CPU time of `voronoi-struts box` at 101³. Choices are decided for all pieces of a box
//!   together; decided one by one and joined, a part was computed in pieces that had not decided
//!   its own choices, and the mesh was wrong.
//! * **Short loops**: the code generator's time grows faster than a function. Five hundred waves took 4.7 s
//!   to compile as one loop of 2,500 operations; in loops of at most 50, at most 150 operations a
//!   function, 0.48 s.
//! * **Motions of a part made at once**, and a table of nodes that holds their numbers only: ten
//!   thousand turned parts are read in 0.24 s instead of 0.45 s.
//! * **Densities in meshes from cells, not points**: the distance is asked for in cells that the part's faces
//!   may pass through only, with the slopes in their eighths, and without the lattice. A gyroid in
//!   a bunny of 60 k triangles is solved for in 0.8 s of CPU time with three cells across, in 2.1 s with
//!   twenty, where a million points took 1.3 to 1.4 s and left ten times the error.
//! * **Volumes without their errors** where a density is solved for, and no evaluation to check the
//!   last step of Newton's method: a change of the density of a gyroid takes two fifths of the time.
//! * **What lies beyond flat pieces**, for measures straight from the field: gradients at the corners give it
//!   to fourth order, so 41³ nodes do what 101³ of a mesh do not. Sixteen pieces side by side: as long as what
//!   was found was an array of structures the loop stayed scalar, and a third of all time was in it; with an
//!   array a number it is a seventh.
//! * **Rows of sixteen edges through all steps**, not one step after the other through all edges, where
//!   edges are few: values stay in the nearest cache. Wide rows where there are many.
//!
//! CPU seconds of whole jobs on a busy machine, before and after, and of the best engine of fidget 0.5.1 (its
//! virtual machine; its meshes are of 128³ and 256³ cells):
//!
//! | job | before | after | fidget |
//! |---|---|---|---|
//! | 1,000 balls, 101³ | 2.34 | 0.18 | |
//! | 250 things of four turned parts, 101³ | 1.04 | 0.38 | |
//! | 10,000 balls, 100³ | 6.6 | 1.9 | |
//! | the same in a box, 128³ | | 2.1 | 14.2 |
//! | the same in a box, 256³ | | 3.2 | 30.1 |
//! | 2,500 things of four turned parts, 102³ | 31 | 5.7 | |
//! | the same in a box, 256³ | | 10.8 | 92 |
//!
//! # What did not pay
//!
//! | idea | outcome |
//! |---|---|
//! | bricks of 8³ | half the samples, but numbering and unpacking cost more: even |
//! | memory-mapped output; through the page cache: `fallocate`, other block sizes | even or worse |
//! | faces of 13 bytes by two overlapping stores | 14 instructions a triangle against 7.7 |
//! | gathers of edges indexed lane by lane over several tables | 171 million instructions against 119 for blocks of eight lanes |
//! | batches of the edges of several bricks of one activity | 1604 million instructions at 401³ either way: filling them costs what fewer calls save |
//! | triangles measured in vectors | most of it is fetching corners: 22 million instructions of a re-evaluation become 13 |
//! | product-to-sum for products of waves | 23 operations and 12 constants: more than the registers hold |
//! | recurrences along a row | a sample's bits would depend on where its row begins |
//! | four vectors of sines side by side instead of two | no clear gain |
//! | polynomials in pairs alone, without a second vector | 8 % |
//! | loops left to the compiler to vectorise | scalar, up to four times slower; typed lanes it must be |
//! | four closest points side by side without branches | half as many instructions again |
//! | leaves of the bounding-volume tree filled by median splits | queries even |
//! | entering the tree at nodes that a block of samples shares | ten nodes a sample instead of fourteen, but as many leaves, and finding them: a third slower on 64³ points around 60 k triangles, even in signs of fills |
//! | eight neighbouring points side by side, box by box and face by face | 4 % at 60 k triangles, a fifth slower at 950 k, where neighbours are ten faces apart |
//! | 32 balls that stand in for values, or 8, instead of 16 | 11 % and 68 % slower at 400 samples |
//! | calls of functions gathered by eight, whatever lies between them | a twentieth of the time of compiling, nothing else |
//! | batches of 16 to 256 edges for five hundred waves | no difference: 30 us a vertex are their sines |
//! | a foam's cell cut into parts with eight struts each, picked by coordinates | the same bytes in twice the time: a block sees forty parts, and no chain of minima is left that drops what is far |
//! | a sum of five hundred waves cut down for each box | nothing to leave out; compiled, its edges take a third |
//!
//! # Walls ahead
//!
//! Cranelift has vectors of 128 bits only. A gyroid about any vector is bound by multiplications
//! there; twice the width needs an assembler of our own for the inner loop. A phase that depends on
//! all three axes (`gyroid-graded`) costs three sines and cosines a sample, 7 ns at 256 bits:
//! nothing can be hoisted. A distance at a point of a grid takes 14 nodes, 7 leaves and 4 or 5
//! exact faces around 60 k triangles, whatever its neighbours: a grid that coarse shares little.
//! Four tenths of the time are boxes, three tenths leaves, the rest exact faces and signs; twice as
//! fast would need a better tree.
