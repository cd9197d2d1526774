//! The arguments of both commands.
//!
//! Options come first; everything from the first operand on belongs to the program, whatever it
//! begins with, and `--` ends the options early. As getopt has it, the word after an option that takes a
//! value is that value, whatever it begins with, and of an option that is given twice the last counts.

use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint, value_parser};
use clap_complete::Shell;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Cellular solids from the command line: lattices, foams and filled parts as watertight meshes.
#[derive(Debug, Parser)]
#[command(name = "alveole", version, about, max_term_width = 100, args_override_self = true)]
pub(super) struct Alveole {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Mesh the solid that a program describes
    Mesh(MeshArguments),
    /// List the words that programs are made of
    List(ListArguments),
    /// Measure the solid that a program describes: volume, density, area, topology, quality
    Measure(MeasureArguments),
    /// Cut the solid that a program describes by planes: outlines as SVG, pixels as PNG
    Slice(SliceArguments),
    /// Check and measure a mesh file
    Check(CheckArguments),
    /// Find out what a solid loses on its way through files: round trips, and programs in steps
    Study {
        /// The experiment
        #[command(subcommand)]
        study: Study,
    },
    /// Print the program that the input of another tool stands for: ASLI's config.yml, Scaffolder's line
    Convert(ConvertArguments),
    /// Answer requests on standard input, a line of JSON each, keeping programs compiled
    Serve(ServeArguments),
    /// Print a completion script for a shell
    #[command(hide = true)]
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// Generate cellular solid meshes from signed distance functions.
#[derive(Debug, Parser)]
#[command(name = "cesogen", version, about, max_term_width = 100, args_override_self = true)]
pub(super) struct Cesogen {
    #[command(flatten)]
    pub(super) mesh: MeshArguments,
}

/// Arguments that may end in a program.
pub(super) trait Programmed {
    /// The words of the program; none if the command takes none.
    fn program(&self) -> &[String];
}

impl Programmed for Alveole {
    fn program(&self) -> &[String] {
        match &self.command {
            Command::Mesh(arguments) => &arguments.work.program,
            Command::Measure(arguments) => &arguments.work.program,
            Command::Slice(arguments) => &arguments.work.program,
            Command::Study { study: Study::Roundtrip(arguments) } => &arguments.work.program,
            // Its operands are texts, not words.
            Command::Study { study: Study::Hierarchy(_) }
            | Command::List(_)
            | Command::Check(_)
            | Command::Convert(_)
            | Command::Serve(_)
            | Command::Completions { .. } => &[],
        }
    }
}

impl Programmed for Cesogen {
    fn program(&self) -> &[String] {
        &self.mesh.work.program
    }
}

#[derive(Debug, Args)]
pub(super) struct MeshArguments {
    /// Mesh file to write, its format by extension (.ply .stl .3mf .obj .off); `-` for standard output
    #[arg(short, long, value_name = "FILE", default_value = "out.ply", allow_hyphen_values = true)]
    #[arg(value_hint = ValueHint::FilePath)]
    pub(super) output: PathBuf,

    /// Coordinates in the file as 32-bit or 64-bit numbers; by default single where it is exact enough
    #[arg(long, value_enum, value_name = "PRECISION", allow_hyphen_values = true)]
    pub(super) precision: Option<PrecisionArgument>,

    /// Add volume, density, area, overhangs, components and percolation to the table after the run, and
    /// to `--stats`; takes about as long again
    #[arg(long)]
    pub(super) report: bool,

    #[command(flatten)]
    pub(super) overhang: OverhangArguments,

    /// Remove slivers: vertices near one node of the grid become one, and others slide along the surface;
    /// keeps the whole mesh in memory
    #[arg(long)]
    pub(super) snap: bool,

    #[command(flatten)]
    pub(super) work: WorkArguments,
}

/// Which faces overhang.
#[derive(Debug, Args)]
pub(super) struct OverhangArguments {
    /// Angle from straight down within which a face overhangs, in degrees; equations allowed
    /// [default: 45]
    #[arg(long = "overhang", value_name = "DEGREES", allow_hyphen_values = true)]
    pub(super) angle: Option<String>,

    /// Direction in which the part is built [default: 0,0,1]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(super) up: Option<String>,
}

#[derive(Debug, Args)]
pub(super) struct MeasureArguments {
    /// Print JSON instead of a table
    #[arg(long)]
    pub(super) json: bool,

    /// Print volume, area and densities with their derivatives by each `--param`, those of the mesh
    /// for steps that move its surface by more than a thousandth of the spacing; a box or spacing that
    /// an option gives counts as fixed
    #[arg(long)]
    pub(super) gradient: bool,

    /// Measure the solid itself, with likely errors, of fourth order where it is smooth, instead of its
    /// mesh; with derivatives of its volume by each `--param`
    #[arg(long, conflicts_with = "gradient")]
    pub(super) field: bool,

    /// Add the structure: thickness of walls and size of pores by inscribed balls, overhangs, components
    /// of solid and void, percolation
    #[arg(long, conflicts_with_all = ["gradient", "field"])]
    pub(super) structure: bool,

    #[command(flatten)]
    pub(super) overhang: OverhangArguments,

    #[command(flatten)]
    pub(super) work: WorkArguments,
}

#[derive(Debug, Args)]
pub(super) struct SliceArguments {
    /// Picture to write, .svg or .png; of several, `%d` in the name is the number from 0 on, `%04d` with
    /// four digits
    #[arg(short, long, value_name = "FILE", allow_hyphen_values = true)]
    #[arg(value_hint = ValueHint::FilePath)]
    pub(super) output: PathBuf,

    /// Where to cut: heights with commas between, or FROM:TO:STEP; equations allowed
    #[arg(long, value_name = "Z,...|FROM:TO:STEP", allow_hyphen_values = true)]
    pub(super) at: String,

    /// Axis that the planes are across
    #[arg(long, value_enum, value_name = "AXIS", default_value = "z")]
    pub(super) axis: AxisArgument,

    /// Side of a pixel of a PNG, in model units; equations allowed [default: the grid spacing]
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true)]
    pub(super) pixel: Option<String>,

    /// Print file, height, area, perimeter, outlines and holes of each slice as JSON
    #[arg(long)]
    pub(super) json: bool,

    #[command(flatten)]
    pub(super) work: WorkArguments,
}

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum AxisArgument {
    /// Planes seen from the right: y to the right, z up
    X,
    /// Planes seen from the front: x to the right, z up
    Y,
    /// Planes seen from above: x to the right, y up
    Z,
}

/// An experiment on solids that pass through files.
#[derive(Debug, Subcommand)]
pub(super) enum Study {
    /// Mesh a solid, write the mesh, read it back and mesh it again, many times
    ///
    /// Prints, of the mesh after each trip, the four errors of the Cesogen paper, section 4.2: at vertices (points) and at
    /// the centres of triangles, the root mean square (L2) and the maximum of what the field of the
    /// program is there, over the diagonal of the grid. On one grid a mesh is a fixed point, up to rounding. The
    /// paper's figure 10 is `-s 4/100 box scale 4 sphere scale 4 gyroid scale 4`.
    Roundtrip(RoundtripArguments),
    /// Make a solid in steps, each on the file of the step before, and at once, and compare
    ///
    /// Each STEP is the text of a program that begins with what the steps before have made as its first shape: `gyroid`
    /// intersects it with a gyroid, `gyroid union` joins one, `shell 0.1` makes it a wall. Prints, of each step,
    /// the four errors of the Cesogen paper, section 4.2, of the mesh of all steps at once (direct) and of the mesh made from
    /// the file of the step before (sequential), both to the field of all steps at once, and their ratio.
    /// The paper's figure 5 is `-s 4/130 'box scale 4 sphere scale 5' 'p-surface scale 4'
    /// 'd-surface scale 3.75' 'gyroid scale 1.25'`.
    Hierarchy(HierarchyArguments),
}

#[derive(Debug, Args)]
pub(super) struct RoundtripArguments {
    /// How often to write, read and mesh
    #[arg(long, value_name = "N", default_value = "10", value_parser = value_parser!(u32).range(1..))]
    pub(super) times: u32,

    /// Move the grid of each trip by another part of a cell: the fractional parts of the trip's number times
    /// 0.8192, 0.6710 and 0.5497 along x, y and z; it is a cell larger than that of the first mesh. Each trip then
    /// cuts off what is convex and fills what is concave, by the spacing squared over the radius
    #[arg(long)]
    pub(super) shift: bool,

    /// Draw the errors over the trips, on a logarithmic scale
    #[arg(long, value_name = "FILE.svg", value_hint = ValueHint::FilePath)]
    pub(super) plot: Option<PathBuf>,

    #[command(flatten)]
    pub(super) passage: PassageArguments,

    #[command(flatten)]
    pub(super) work: WorkArguments,
}

#[derive(Debug, Args)]
#[command(mut_arg("program", |argument| argument
    .value_name("STEP")
    .help("The steps in order, each the text of a program in one argument")))]
pub(super) struct HierarchyArguments {
    #[command(flatten)]
    pub(super) passage: PassageArguments,

    #[command(flatten)]
    pub(super) work: WorkArguments,
}

/// What the files of an experiment are.
#[derive(Debug, Args)]
pub(super) struct PassageArguments {
    /// Format of the files, which are in a temporary folder
    #[arg(long, value_enum, value_name = "FORMAT", default_value = "ply")]
    pub(super) format: FormatArgument,

    /// Coordinates in the files as 32-bit or 64-bit numbers [default: double; STL holds single only]
    #[arg(long, value_enum, value_name = "PRECISION")]
    pub(super) precision: Option<PrecisionArgument>,

    /// Print JSON instead of a table: every trip or step, and the errors by |f| / |grad f|, too
    #[arg(long)]
    pub(super) json: bool,
}

/// A mesh format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FormatArgument {
    /// Stanford polygon format
    Ply,
    /// Stereolithography triangles
    Stl,
    /// 3D Manufacturing Format
    #[value(name = "3mf")]
    ThreeMf,
    /// Wavefront OBJ
    Obj,
    /// Object File Format of Geomview
    Off,
}

/// What every command takes that contours a solid.
#[derive(Debug, Args)]
pub(super) struct WorkArguments {
    /// Grid spacing, one length or one an axis; equations allowed [default: longest side / 100]
    #[arg(short, long, value_name = "S|SX,SY,SZ", allow_hyphen_values = true)]
    pub(super) spacing: Option<String>,

    /// Box to contour in place of the solid's own: least and greatest corner, equations allowed
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", allow_hyphen_values = true)]
    pub(super) bounds: Option<String>,

    /// Give the parameter NAME of the program a value, an equation of numbers and earlier parameters; repeatable
    #[arg(long = "param", value_name = "NAME=VALUE", allow_hyphen_values = true)]
    pub(super) parameters: Vec<String>,

    /// Threads to use [default: all processors]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true)]
    pub(super) threads: Option<NonZeroUsize>,

    /// Say nothing but errors: no table, no warnings
    #[arg(short, long)]
    pub(super) quiet: bool,

    /// Write timings, counts and peak memory to a JSON file
    #[arg(long, value_name = "FILE.json", allow_hyphen_values = true)]
    #[arg(value_hint = ValueHint::FilePath)]
    pub(super) stats: Option<PathBuf>,

    /// The program: shapes, mesh files, equations and operations in postfix order
    #[arg(required = true, trailing_var_arg = true, value_name = "PROGRAM", value_hint = ValueHint::AnyPath)]
    pub(super) program: Vec<String>,
}

#[derive(Debug, Args)]
pub(super) struct ListArguments {
    /// Words to explain in full; all, in short, by default
    #[arg(value_name = "WORD")]
    pub(super) words: Vec<String>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub(super) json: bool,

    /// Print the reference as Markdown
    #[arg(long, conflicts_with = "json")]
    pub(super) markdown: bool,
}

#[derive(Debug, Args)]
pub(super) struct CheckArguments {
    /// Mesh file to check
    #[arg(value_name = "MESH", value_hint = ValueHint::FilePath)]
    pub(super) mesh: PathBuf,

    /// Print JSON instead of a table
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Args)]
pub(super) struct ConvertArguments {
    /// Say nothing but errors
    #[arg(short, long)]
    pub(super) quiet: bool,

    /// The program: configurations of ASLI (`config.yml`), lines of Scaffolder after `scaffolder:`, words
    #[arg(required = true, trailing_var_arg = true, value_name = "PROGRAM", value_hint = ValueHint::AnyPath)]
    pub(super) program: Vec<String>,
}

#[derive(Debug, Args)]
pub(super) struct ServeArguments {
    /// Refuse requests whose grid has more cells [default: no limit]
    #[arg(long, value_name = "N")]
    pub(super) most_cells: Option<u64>,

    /// Threads to use [default: all processors]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    pub(super) threads: Option<NonZeroUsize>,
}

/// The most threads that may be asked for: more than any machine has processors for one program.
const MOST_THREADS: usize = 1024;

/// Reads a number of threads.
fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.parse::<NonZeroUsize>().ok().filter(|n| n.get() <= MOST_THREADS);
    number.ok_or_else(|| format!("give a whole number from 1 to {MOST_THREADS}"))
}

/// How coordinates are stored in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum PrecisionArgument {
    /// 32-bit floating point
    Single,
    /// 64-bit floating point
    Double,
}
