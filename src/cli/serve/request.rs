//! Requests: their fields, and what is wrong with them.

use super::reply::ErrorReply;
use crate::geom::Aabb;
use crate::job::{Settings, Slivers, Spacing};
use crate::lang;
use crate::measure::Overhang;
use crate::mesh::io::{Format, Precision};
use glam::DVec3;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// Measures that cost little more than the mesh.
const QUICK: [&str; 3] = ["volume", "area", "relative_density"];
/// All measures: the fields of [`Measures`](crate::job::Measures).
const MEASURES: [&str; 12] = [
    "volume",
    "area",
    "relative_density",
    "envelope_volume",
    "envelope_density",
    "lo",
    "hi",
    "centroid",
    "quality",
    "sides",
    "check",
    "report",
];

/// A request.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Request {
    /// Not used here: it is taken from the line before the rest is looked at.
    #[serde(default, rename = "id")]
    _id: Value,
    program: ProgramText,
    parameters: Option<Parameters>,
    spacing: Option<SpacingWanted>,
    bounds: Option<Bounds>,
    pub(super) measure: Option<Wanted>,
    gradient: Option<GradientWanted>,
    field: Option<FieldWanted>,
    structure: Option<StructureWanted>,
    pub(super) mesh: Option<MeshWanted>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`program` must be a text or a list of words")]
enum ProgramText {
    Text(String),
    Words(Vec<String>),
}

// Each has a type of its own, for the sake of the message.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`parameters` must be an object of names and numbers")]
enum Parameters {
    Values(BTreeMap<String, f64>),
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`bounds` must be a list of six numbers")]
enum Bounds {
    Corners([f64; 6]),
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`spacing` must be a number or a list of three")]
enum SpacingWanted {
    All(f64),
    Each([f64; 3]),
}

/// The measures asked for.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`measure` must be a list of names, or \"all\"")]
pub(super) enum Wanted {
    /// Must be "all".
    Word(String),
    /// Those of these names.
    Names(Vec<String>),
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`gradient` must be true or false")]
enum GradientWanted {
    Is(bool),
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "`field` must be true or false")]
enum FieldWanted {
    Is(bool),
}

/// The structure asked for.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "`structure` must be true or false, or an object with `overhang` (degrees) and `up` (three numbers)"
)]
enum StructureWanted {
    Is(bool),
    Of(StructureForm),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StructureForm {
    overhang: Option<f64>,
    up: Option<[f64; 3]>,
}

/// The mesh file asked for.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "`mesh` must be a file name or an object with `file`, `format`, `precision` and `snap`"
)]
pub(super) enum MeshWanted {
    /// A file.
    File(String),
    /// A file in a given form.
    Form(Form),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Form {
    file: String,
    format: Option<FormatName>,
    precision: Option<PrecisionName>,
    #[serde(default)]
    snap: bool,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FormatName {
    Ply,
    Stl,
    Obj,
    Off,
    #[serde(rename = "3mf")]
    ThreeMf,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum PrecisionName {
    Single,
    Double,
}

impl Request {
    /// The request that `value` is.
    pub(super) fn read(value: Value) -> Result<Self, ErrorReply> {
        if !value.is_object() {
            let message = "a request is an object".to_owned();
            let cure = "write a line such as {\"program\": \"gyroid box\", \"measure\": \"all\"}";
            return Err(ErrorReply::plain("request", message).cure(cure));
        }
        let request: Self = serde_json::from_value(value)
            .map_err(|error| ErrorReply::plain("request", error.to_string()))?;
        if let Some(fault) = request.fault() {
            return Err(ErrorReply::plain("request", fault));
        }
        Ok(request)
    }

    /// What is wrong with numbers and names that have the right type.
    fn fault(&self) -> Option<String> {
        let spacing = match self.spacing {
            Some(SpacingWanted::All(s)) => DVec3::splat(s),
            Some(SpacingWanted::Each(each)) => DVec3::from_array(each),
            None => DVec3::ONE,
        };
        if !spacing.cmpgt(DVec3::ZERO).all() {
            return Some("`spacing` must be positive".to_owned());
        }
        let corners = self.bounds.as_ref().map(|Bounds::Corners(corners)| corners);
        if corners.is_some_and(|b| (0..3).any(|a| b[a] >= b[a + 3])) {
            return Some("`bounds` must be the least corner, then the greatest".to_owned());
        }
        if let Some(overhang) = self.overhang() {
            let Overhang { angle_deg, up } = overhang;
            if !(angle_deg > 0.0 && angle_deg <= 90.0) {
                return Some("`overhang` must be degrees above 0 and at most 90".to_owned());
            }
            if !up.normalize_or_zero().is_normalized() {
                return Some("`up` must be a direction: not all zero".to_owned());
            }
        }
        self.measure.as_ref().and_then(Wanted::fault)
    }

    /// Whether derivatives of the mesh's measures are asked for.
    pub(super) fn wants_gradient(&self) -> bool {
        matches!(self.gradient, Some(GradientWanted::Is(true)))
    }

    /// Whether measures straight from the field are asked for.
    pub(super) fn wants_field(&self) -> bool {
        matches!(self.field, Some(FieldWanted::Is(true)))
    }

    /// What overhangs, if the structure is asked for.
    pub(super) fn overhang(&self) -> Option<Overhang> {
        let plain = Overhang::default();
        match self.structure.as_ref()? {
            StructureWanted::Is(wanted) => wanted.then_some(plain),
            StructureWanted::Of(StructureForm { overhang, up }) => Some(Overhang {
                angle_deg: overhang.unwrap_or(plain.angle_deg),
                up: up.map_or(plain.up, DVec3::from_array),
            }),
        }
    }

    /// The parameters, by name.
    pub(super) fn parameters(&self) -> BTreeMap<String, f64> {
        match &self.parameters {
            Some(Parameters::Values(values)) => values.clone(),
            None => BTreeMap::new(),
        }
    }

    /// The words of the program.
    pub(super) fn words(&self) -> Result<Vec<String>, ErrorReply> {
        match &self.program {
            ProgramText::Text(text) => {
                lang::words::of(text).map_err(|rejected| crate::job::Error::from(rejected).into())
            }
            ProgramText::Words(words) => Ok(words.clone()),
        }
    }

    /// The settings that the request asks for.
    pub(super) fn settings(&self) -> Settings {
        let spacing = match self.spacing {
            None => Spacing::Hundredth,
            Some(SpacingWanted::All(s)) => Spacing::Each(DVec3::splat(s)),
            Some(SpacingWanted::Each(each)) => Spacing::Each(DVec3::from_array(each)),
        };
        let bounds = self.bounds.as_ref().map(|Bounds::Corners([x0, y0, z0, x1, y1, z1])| {
            Aabb::new(DVec3::new(*x0, *y0, *z0), DVec3::new(*x1, *y1, *z1))
        });
        Settings { spacing, bounds, ..Settings::default() }
    }
}

impl Wanted {
    fn fault(&self) -> Option<String> {
        let known = || MEASURES.map(|name| format!("`{name}`")).join(", ");
        match self {
            Self::Word(word) => (word != "all").then(|| {
                format!("`measure` is `{word}`; it must be \"all\" or a list of {}", known())
            }),
            Self::Names(names) => {
                let unknown = names.iter().find(|name| !MEASURES.contains(&name.as_str()))?;
                Some(format!("there is no measure `{unknown}`; there are {}", known()))
            }
        }
    }

    /// Whether all of them are quick to have.
    pub(super) fn are_quick(&self) -> bool {
        MEASURES.iter().all(|name| QUICK.contains(name) || !self.includes(name))
    }

    /// Whether the measure `name` is among them.
    pub(super) fn includes(&self, name: &str) -> bool {
        match self {
            Self::Word(_) => true,
            Self::Names(names) => names.iter().any(|wanted| wanted == name),
        }
    }
}

impl MeshWanted {
    /// The file's name.
    pub(super) fn file(&self) -> &str {
        match self {
            Self::File(file) | Self::Form(Form { file, .. }) => file,
        }
    }

    /// Its format, if it does not follow from its name.
    pub(super) fn format(&self) -> Option<Format> {
        let Self::Form(Form { format, .. }) = self else { return None };
        format.map(|name| match name {
            FormatName::Ply => Format::Ply,
            FormatName::Stl => Format::Stl,
            FormatName::Obj => Format::Obj,
            FormatName::Off => Format::Off,
            FormatName::ThreeMf => Format::ThreeMf,
        })
    }

    /// Whether its slivers stay.
    pub(super) fn slivers(&self) -> Slivers {
        match self {
            Self::Form(Form { snap: true, .. }) => Slivers::Removed,
            Self::File(_) | Self::Form(_) => Slivers::Kept,
        }
    }

    /// The precision of its coordinates, if it is not to be chosen.
    pub(super) fn precision(&self) -> Option<Precision> {
        let Self::Form(Form { precision, .. }) = self else { return None };
        precision.map(|name| match name {
            PrecisionName::Single => Precision::Single,
            PrecisionName::Double => Precision::Double,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Job;
    use crate::num::Progress;

    #[test]
    fn measures_are_those_of_the_library() {
        let job = Job::parse("box").unwrap();
        let settings = Settings::with_spacing(1.0);
        let names = |value: Value| -> Vec<String> {
            let mut names: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
            names.sort();
            names
        };
        let sorted = |list: &[&str]| {
            let mut list: Vec<String> = list.iter().map(|name| (*name).to_owned()).collect();
            list.sort();
            list
        };
        let all = job.measure(&settings, &Progress::new()).unwrap();
        assert_eq!(names(serde_json::to_value(all).unwrap()), sorted(&MEASURES));
        let quick = job.totals(&settings, &Progress::new()).unwrap();
        let quick = names(serde_json::to_value(quick).unwrap());
        assert_eq!(quick, sorted(&[&QUICK[..], &["report"]].concat()));
    }
}
