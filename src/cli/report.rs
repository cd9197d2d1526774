//! What is said to the user, and where: the only printing of the program.
//!
//! Results go to standard output, everything else to standard error. A result that can't be written is
//! trouble; but a reader that closed the pipe early ends the printing, not the work. What is said on standard error
//! can be said nowhere else, and is lost without it.

use super::output::OutputError;
use crate::contour;
use crate::geom::Axis;
use crate::job::{self, ConversionNote, MeshNote, study};
use crate::lang::{self, Diagnostic, Place, Rejected, Sources};
use crate::measure::slice::RasterError;
use crate::measure::thickness::Thickness;
use crate::mesh::io::{ReadError, WriteError};
use crate::solid::Span;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::io::{self, IsTerminal, Write, stderr, stdout};
use std::ops::Range;
use std::process::ExitCode;

/// Longest piece of a line that a message shows, in bytes.
const SHOWN: usize = 1 << 10;

/// Longest message about arguments that is shown whole, in bytes.
const LONGEST: usize = 6000;

/// Why a command ended without its result.
#[derive(Debug, thiserror::Error)]
pub(super) enum Trouble {
    /// The arguments are wrong, or help was asked for.
    #[error(transparent)]
    Usage(clap::Error),
    /// The value of an option is wrong.
    #[error("`{option} {text}`: {fault}")]
    Value {
        /// The option.
        option: &'static str,
        /// Its value.
        text: String,
        /// What is wrong with it.
        fault: ValueFault,
    },
    /// A number in the value of an option can't be read.
    #[error("`{option}`: {rejected}")]
    Number {
        /// The option.
        option: &'static str,
        /// What is wrong with its value.
        rejected: Rejected,
    },
    /// Files of options name each other without end.
    #[error("`{file}`: files of options name each other too often; do they name themselves?")]
    Options {
        /// The file at which reading stopped.
        file: String,
    },
    /// The output's name does not say its format.
    #[error(
        "`{name}`: the extension names no mesh format that can be written; use .ply, .stl, .obj, .off or .3mf"
    )]
    Format {
        /// The output as the user named it.
        name: String,
    },
    /// The output's name does not say what picture it is.
    #[error("`{name}`: the extension names no picture that can be written; use .svg or .png")]
    Picture {
        /// The output as the user named it.
        name: String,
    },
    /// One name is given for several files.
    #[error(
        "`{name}` is one name for {count} slices; put their number in it, as in `slice-%04d.svg`"
    )]
    Names {
        /// The output as the user named it.
        name: String,
        /// How many files there would be.
        count: usize,
    },
    /// There can be no picture of that size.
    #[error("cannot draw the slices: {0}")]
    Raster(#[from] RasterError),
    /// A word that is asked for does not exist.
    #[error("there is no word `{word}`{}", hint(near))]
    Word {
        /// The word.
        word: String,
        /// Words of similar spelling.
        near: Vec<String>,
    },
    /// The job failed.
    #[error(transparent)]
    Job(#[from] job::Error),
    /// The output could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The output's format can't hold the mesh.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A mesh file could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The system refused to start threads.
    #[error("cannot start threads: {0}; try `--threads 1`")]
    Threads(rayon::ThreadPoolBuildError),
    /// There is no folder for files that pass.
    #[error("cannot make a folder for temporary files: {0}; name another one in TMPDIR")]
    Scratch(io::Error),
    /// A file of an experiment could not be written.
    #[error(transparent)]
    Study(study::Error),
    /// A result could not be printed.
    #[error("cannot write standard output: {0}")]
    Print(io::Error),
    /// Requests could not be read.
    #[error("cannot read standard input: {0}")]
    Requests(io::Error),
    /// A mesh file was read and is not sound.
    #[error("the mesh has defects")]
    Defects,
}

/// What is wrong with the value of an option.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum ValueFault {
    /// The spacing has a wrong number of components.
    #[error("takes one number, or three with commas between")]
    SpacingCount,
    /// The spacing is zero, negative or not finite.
    #[error("must be positive, as in `-s 0.05` or `-s 2/60`")]
    SpacingSign,
    /// The length is not one positive number.
    #[error("takes one positive number")]
    Length,
    /// A range is none or is empty.
    #[error(
        "takes heights with commas between, as in `--at 0.1,0.2`, or a range, as in `--at 0:1:0.1`"
    )]
    Range,
    /// A range has too many steps.
    #[error("is {steps:.0} slices; give a longer step")]
    Slices {
        /// How many there would be.
        steps: f64,
    },
    /// Standard output is wanted for two things.
    #[error("is where `--json` prints; name a file")]
    Taken,
    /// The statistics would take the place of a file that is read or written.
    #[error("is a file that the command reads or writes otherwise; name another")]
    InUse,
    /// A height is not in the box.
    #[error("has {height}, but the box reaches from {lo} to {hi} along this axis")]
    Height {
        /// The height.
        height: f64,
        /// The least one.
        lo: f64,
        /// The greatest one.
        hi: f64,
    },
    /// The output has no pixels.
    #[error("is of no use for an SVG, which has no pixels; write a .png")]
    NoPixels,
    /// The name of a plot does not say that it is an SVG.
    #[error("names no picture that can be drawn; use .svg")]
    Plot,
    /// The format has no such precision.
    #[error("is more than STL holds; use single, or another format")]
    SingleOnly,
    /// The angle is not one number, or not between 0 and 90.
    #[error("takes degrees from straight down, above 0 and at most 90, as in `--overhang 45`")]
    Angle,
    /// The direction has a wrong number of components, or no length.
    #[error("takes a direction, three numbers that are not all zero, as in `--up 0,0,1`")]
    Direction,
    /// Nothing depends on the option.
    #[error("is of no use without `{needed}`; add it")]
    Needless {
        /// The option that would use it.
        needed: &'static str,
    },
    /// The bounds have a wrong number of components.
    #[error("takes six numbers, as in `--bounds -1,-1,-1,1,1,1`")]
    BoundsCount,
    /// The bounds are empty or not finite along an axis.
    #[error("runs from {lo:?} to {hi:?} along {axis:?}; give finite corners, the least first")]
    BoundsOrder {
        /// The axis.
        axis: Axis,
        /// Its first bound.
        lo: f64,
        /// Its second bound.
        hi: f64,
    },
}

impl From<study::Error> for Trouble {
    fn from(error: study::Error) -> Self {
        match error {
            study::Error::Job(error) => error.into(),
            error @ study::Error::Write { .. } => Self::Study(error),
        }
    }
}

fn hint(near: &[String]) -> String {
    match near {
        [] => "; `alveole list` shows them all".to_owned(),
        near => format!("; did you mean `{}`?", near.join("`, `")),
    }
}

/// Says what went wrong and returns the exit code for it.
pub(super) fn trouble(name: &str, trouble: &Trouble) -> ExitCode {
    match trouble {
        Trouble::Usage(error) => {
            let text = error.render().to_string();
            if error.use_stderr() && text.len() > LONGEST {
                // An argument without end would be repeated.
                say(&lang::shortened(text));
            } else {
                let printed = error.print().and_then(|()| stdout().flush());
                // Help and version are asked for and go to standard output, with code 0.
                if !error.use_stderr()
                    && let Err(cause) = heard(printed)
                {
                    return self::trouble(name, &Trouble::Print(cause));
                }
            }
            return ExitCode::from(u8::from(error.use_stderr()) * 2);
        }
        Trouble::Job(job::Error::Program(rejected)) => {
            for diagnostic in &rejected.diagnostics {
                explain(
                    name,
                    &numbered(diagnostic, &rejected.sources),
                    diagnostic,
                    &rejected.sources,
                );
            }
        }
        Trouble::Number { option, rejected } => {
            for diagnostic in &rejected.diagnostics {
                let title = format!("{} (in the value of `{option}`)", diagnostic.message);
                explain(name, &title, diagnostic, &rejected.sources);
            }
        }
        Trouble::Job(
            job::Error::Bounds { diagnostic, sources }
            | job::Error::Density { diagnostic, sources },
        ) => {
            explain(name, &numbered(diagnostic, sources), diagnostic, sources);
        }
        Trouble::Value { .. }
        | Trouble::Options { .. }
        | Trouble::Format { .. }
        | Trouble::Picture { .. }
        | Trouble::Names { .. }
        | Trouble::Raster(_)
        | Trouble::Word { .. }
        | Trouble::Job(_)
        | Trouble::Output(_)
        | Trouble::Write(_)
        | Trouble::Read(_)
        | Trouble::Threads(_)
        | Trouble::Scratch(_)
        | Trouble::Study(_)
        | Trouble::Print(_)
        | Trouble::Requests(_) => {
            say(&format!("{name}: {}", lang::shortened(trouble.to_string())));
        }
        Trouble::Defects => {}
    }
    ExitCode::from(code(trouble))
}

/// 2 where the command line or the program text is wrong, 1 where the work failed.
fn code(trouble: &Trouble) -> u8 {
    match trouble {
        Trouble::Usage(_)
        | Trouble::Value { .. }
        | Trouble::Number { .. }
        | Trouble::Options { .. }
        | Trouble::Format { .. }
        | Trouble::Picture { .. }
        | Trouble::Names { .. }
        | Trouble::Raster(_)
        | Trouble::Word { .. } => 2,
        Trouble::Job(error) => match error {
            job::Error::Program(rejected) => {
                // A file that can't be read is no fault of the text that names it.
                if rejected.diagnostics.iter().all(|d| d.is_of_a_file) { 1 } else { 2 }
            }
            job::Error::Grid(_) => 2,
            job::Error::Bounds { .. }
            | job::Error::Density { .. }
            | job::Error::Compile(_)
            | job::Error::Contour(_)
            | job::Error::Empty { .. } => 1,
        },
        Trouble::Output(_)
        | Trouble::Write(_)
        | Trouble::Read(_)
        | Trouble::Threads(_)
        | Trouble::Scratch(_)
        | Trouble::Study(_)
        | Trouble::Print(_)
        | Trouble::Requests(_)
        | Trouble::Defects => 1,
    }
}

/// Says a line on standard error.
pub(super) fn say(line: &str) {
    let _ = writeln!(stderr().lock(), "{line}");
}

/// Prints a result on standard output.
///
/// # Errors
/// [`Trouble::Print`], as for a full disk; not for a reader that has gone.
pub(super) fn print(text: &str) -> Result<(), Trouble> {
    let mut out = stdout().lock();
    let printed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    heard(printed).map_err(Trouble::Print)
}

/// What became of something printed, if it matters to anyone: a reader that has gone wants no more.
pub(super) fn heard(printed: io::Result<()>) -> io::Result<()> {
    printed.or_else(
        |error| {
            if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error) }
        },
    )
}

/// Says what became of inputs of other tools.
pub(super) fn conversions(name: &str, notes: &[ConversionNote]) {
    for ConversionNote { word, remarks } in notes {
        for remark in remarks {
            say(&format!("{name}: `{word}`: {remark}"));
        }
    }
}

/// Says how a mesh file was understood, where there is something to say.
pub(super) fn mesh_note(name: &str, note: &MeshNote) {
    for remark in note.remarks() {
        say(&format!("{name}: `{}`: {remark}", note.path));
    }
}

/// What the user should know of a contouring: not-a-numbers, thin walls, and walls that are not as thick as asked.
pub(super) fn remarks(report: &job::Report) -> Vec<String> {
    let contour::Report { nans, .. } = report.contour;
    let mut remarks = Vec::new();
    if nans > 0 {
        remarks.push(format!(
            "the field is not a number at {nans} grid nodes, which count as outside"
        ));
    }
    if let Some(walls) = report.walls.filter(|walls| walls.thin_fraction > 0.0) {
        remarks.push(format!(
            "walls or struts are as thin as {:.4}, and {:.1} % of their area is thinner than two grid \
             spacings ({:.4}): they may come out light or with holes; give a smaller spacing",
            walls.minimum,
            100.0 * walls.thin_fraction,
            walls.limit
        ));
    }
    if let Some(Thickness { missing, excess }) = report.thickness {
        if missing > 0.0 {
            remarks.push(format!(
                "about {:.0} % of a wall made by `thickness` is missing: points as far from the surface as \
                 half of it are not all reached; give a smaller thickness, or make thick walls by `shell` \
                 or `sheet dilate`",
                100.0 * missing
            ));
        }
        if excess > 0.0 {
            remarks.push(format!(
                "about {:.0} % too much is solid in a wall made by `thickness`: the slope of the field \
                 vanishes at the surface, or jumps near it; give a field that is steeper there",
                100.0 * excess
            ));
        }
    }
    remarks
}

/// Says what the user should know of a contouring.
pub(super) fn warn(name: &str, report: &job::Report) {
    for remark in remarks(report) {
        say(&format!("{name}: warning: {remark}"));
    }
}

/// The message of a fault in a program, with the number of the argument that is at fault.
fn numbered(diagnostic: &Diagnostic, sources: &Sources) -> String {
    let Diagnostic { message, labels, .. } = diagnostic;
    match labels.first().and_then(|label| sources.place(label.span)) {
        Some(Place::Argument(number)) => format!("{message} (argument {number} of the program)"),
        Some(Place::File { .. }) | None => message.clone(),
    }
}

/// Says a diagnostic under `title`, with its place in the text.
fn explain(name: &str, title: &str, diagnostic: &Diagnostic, sources: &Sources) {
    let renderer = if stderr().is_terminal() { Renderer::styled() } else { Renderer::plain() };
    say(&format!("{name}: {}", picture(title, diagnostic, sources, &renderer)));
}

/// The diagnostic as text: the title, the lines concerned with carets below, the cure.
pub(super) fn picture(
    title: &str,
    diagnostic: &Diagnostic,
    sources: &Sources,
    renderer: &Renderer,
) -> String {
    let Diagnostic { message: _, labels, cure, .. } = diagnostic;
    let mut group = Level::ERROR
        .primary_title(title)
        .elements(Vec::<Snippet<'_, annotate_snippets::Annotation<'_>>>::new());
    let mut shown = Vec::new();
    for label in labels {
        let Some(source) = sources.source(label.span) else { continue };
        if shown.contains(&label.span.source) {
            continue;
        }
        shown.push(label.span.source);
        let here = |span: Span| {
            (span.start as usize).min(source.text.len())..(span.end as usize).min(source.text.len())
        };
        let window = window(&source.text, &here(label.span));
        let line = source.text[..window.start].matches('\n').count() + 1;
        let mut snippet = Snippet::source(&source.text[window.clone()])
            .line_start(line)
            .path(source.file.as_deref());
        for other in labels.iter().filter(|other| other.span.source == label.span.source) {
            let range = here(other.span);
            if range.start < window.start || range.end > window.end {
                continue;
            }
            let kind =
                if other == &labels[0] { AnnotationKind::Primary } else { AnnotationKind::Context };
            let text = Some(other.text.as_str()).filter(|text| !text.is_empty());
            let span = range.start - window.start..range.end - window.start;
            snippet = snippet.annotation(kind.span(span).label(text));
        }
        group = group.element(snippet);
    }
    if let Some(cure) = cure {
        group = group.element(Level::HELP.message(cure.as_str()));
    }
    renderer.render(&[group])
}

/// The part of `text` to show around `place`: all of it, or a piece of a text that is too long.
fn window(text: &str, place: &Range<usize>) -> Range<usize> {
    if text.len() <= SHOWN {
        return 0..text.len();
    }
    let near = |at: usize| {
        (0..=at.min(text.len())).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0)
    };
    let start = near(place.start.saturating_sub(SHOWN / 4));
    let end = near((place.start + SHOWN / 2).max(place.end.min(start + SHOWN)));
    start..end
}
