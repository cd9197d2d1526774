//! Replies: what was made, or what went wrong.

use super::super::output::OutputError;
use super::super::report::{Trouble, picture};
use crate::contour::{self, Grid};
use crate::geom::Aabb;
use crate::job::{self, Report, Structure};
use crate::lang::{Diagnostic, Sources};
use crate::mesh::io::{Format, Precision};
use annotate_snippets::Renderer;
use serde::Serialize;
use serde_json::value::RawValue;
use serde_json::{Map, Value};

/// A reply.
#[derive(Debug)]
pub(super) struct Reply<'a> {
    /// The request's own, as it is written there.
    pub(super) id: Option<&'a RawValue>,
    /// What it led to.
    pub(super) outcome: Result<Made, ErrorReply>,
}

/// A reply as it is sent.
#[derive(Serialize)]
struct Sent<'a> {
    id: Option<&'a RawValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a ErrorReply>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    made: Option<&'a Made>,
}

impl Reply<'_> {
    /// The reply as a line of JSON, its end included.
    pub(super) fn line(&self) -> String {
        let (error, made) = match &self.outcome {
            Ok(made) => (None, Some(made)),
            Err(error) => (Some(error), None),
        };
        let sent = Sent { id: self.id, error, made };
        let mut line = serde_json::to_string(&sent).expect("our own structures have text keys");
        line.push('\n');
        line
    }
}

/// What a request led to.
#[derive(Debug, Serialize)]
pub(super) struct Made {
    bounds: [[f64; 3]; 2],
    cells: [usize; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) measures: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gradient: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) field: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) structure: Option<Structure>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) mesh: Option<Written>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) warnings: Vec<String>,
    pub(super) seconds: f64,
}

impl Made {
    /// Nothing yet, on `grid`.
    pub(super) fn on(grid: &Grid) -> Self {
        let Aabb { lo, hi } = grid.bounds();
        Self {
            bounds: [lo, hi].map(|end| end.to_array()),
            cells: grid.cells(),
            measures: None,
            gradient: None,
            field: None,
            structure: None,
            mesh: None,
            warnings: Vec::new(),
            seconds: 0.0,
        }
    }
}

/// A mesh file that was written.
#[derive(Debug, Serialize)]
pub(super) struct Written {
    file: String,
    format: String,
    precision: &'static str,
    vertices: u64,
    triangles: u64,
}

impl Written {
    pub(super) fn new(file: &str, format: Format, precision: Precision, report: &Report) -> Self {
        let contour::Report { vertices, triangles, .. } = report.contour;
        Self {
            file: file.to_owned(),
            format: format.name().to_lowercase(),
            precision: match precision {
                Precision::Single => "single",
                Precision::Double => "double",
            },
            vertices,
            triangles,
        }
    }
}

/// What went wrong.
#[derive(Debug, Serialize)]
pub(super) struct ErrorReply {
    kind: &'static str,
    message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    cure: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    faults: Vec<Fault>,
}

/// A fault of a text.
#[derive(Debug, Serialize)]
struct Fault {
    message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    cure: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    span: Option<Place>,
    picture: String,
}

/// Bytes of the program text, or of a file that it names.
#[derive(Debug, Serialize)]
struct Place {
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    start: u32,
    end: u32,
}

impl ErrorReply {
    /// An error without place.
    pub(super) fn plain(kind: &'static str, message: String) -> Self {
        Self { kind, message, cure: None, faults: Vec::new() }
    }

    /// Says what to do about it.
    pub(super) fn cure(mut self, cure: &str) -> Self {
        self.cure = Some(cure.to_owned());
        self
    }

    /// The error of `diagnostics` about `sources`; the first is the message.
    fn of_text(kind: &'static str, diagnostics: &[Diagnostic], sources: &Sources) -> Self {
        let faults: Vec<_> = diagnostics.iter().map(|fault| Fault::new(fault, sources)).collect();
        let first = faults.first();
        Self {
            kind,
            message: first.map(|fault| fault.message.clone()).unwrap_or_default(),
            cure: first.and_then(|fault| fault.cure.clone()),
            faults,
        }
    }
}

impl Fault {
    fn new(diagnostic: &Diagnostic, sources: &Sources) -> Self {
        let place = diagnostic.labels.first().and_then(|label| {
            let file = sources.source(label.span)?.file.clone();
            Some(Place { file, start: label.span.start, end: label.span.end })
        });
        let picture = picture(&diagnostic.message, diagnostic, sources, &Renderer::plain());
        Self {
            message: diagnostic.message.clone(),
            cure: diagnostic.cure.clone(),
            span: place,
            picture,
        }
    }
}

impl From<job::Error> for ErrorReply {
    fn from(error: job::Error) -> Self {
        let message = error.to_string();
        match error {
            job::Error::Program(rejected) => {
                let of_files = rejected.diagnostics.iter().all(|fault| fault.is_of_a_file);
                let kind = if of_files { "file" } else { "program" };
                Self::of_text(kind, &rejected.diagnostics, &rejected.sources)
            }
            job::Error::Bounds { diagnostic, sources } => {
                Self::of_text("bounds", std::slice::from_ref(&diagnostic), &sources)
            }
            job::Error::Density { diagnostic, sources } => {
                Self::of_text("density", std::slice::from_ref(&diagnostic), &sources)
            }
            job::Error::Grid(_) => Self::plain("grid", message),
            job::Error::Compile(_) => Self::plain("field", message),
            job::Error::Contour(contour::Error::Sink(_)) => Self::plain("output", message),
            job::Error::Contour(contour::Error::Memory(_)) => Self::plain("grid", message),
            job::Error::Contour(_) => Self::plain("field", message),
            job::Error::Empty { .. } => Self::plain("empty", message),
        }
    }
}

impl From<OutputError> for ErrorReply {
    fn from(error: OutputError) -> Self {
        Self::plain("output", error.to_string())
    }
}

impl From<Trouble> for ErrorReply {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Job(error) => error.into(),
            Trouble::Output(error) => error.into(),
            Trouble::Format { .. } | Trouble::Write(_) => {
                Self::plain("output", trouble.to_string())
            }
            Trouble::Usage(_)
            | Trouble::Value { .. }
            | Trouble::Number { .. }
            | Trouble::Options { .. }
            | Trouble::Picture { .. }
            | Trouble::Names { .. }
            | Trouble::Raster(_)
            | Trouble::Word { .. }
            | Trouble::Read(_)
            | Trouble::Threads(_)
            | Trouble::Print(_)
            | Trouble::Requests(_)
            | Trouble::Scratch(_)
            | Trouble::Study(_)
            | Trouble::Defects => Self::plain("request", trouble.to_string()),
        }
    }
}
