//! Configurations of ASLI, "A Simple Lattice Infiller", as programs.
//!
//! A configuration says a part (an STL file or a simple body), a unit cell or a file of cells at
//! points, a size and a feature or files of them, and how to mesh. All but the last becomes a
//! program: words where the cell is the same everywhere, an equation where cells pass into each
//! other. Conventions that are converted:
//!
//! * ASLI's isovalue runs from 0 to 1 over the range of each cell's levels; its volume fractions,
//!   wall and pore sizes are polynomial fits of the level (`fits.rs`), not what the solid then has.
//! * Its gyroid sin x cos y + ... is the mirror image of our `gyroid`: x and y are exchanged. Its primitive
//!   and I-WP are our `p-surface` and `iwp` with the sign changed; sheets are F² - t².
//! * Phases are 2π x / size at the point, sizes varying by their reciprocals; wall and pore sizes are in
//!   cells unless the mode is absolute.
//! * Hybrids add up wᵢ Fᵢ with weights from the file of types. The factor 1 + c (1 - (2 wᵢ/|w| - 1)²)
//!   of the feature against thin spots grows from type to type, as in ASLI's code: the factor of a
//!   type also holds those of the types before.
//! * `me_side: void` is the part without the lattice.
//! * File names are taken from the working directory, as ASLI does.
//!
//! What is not the same: ASLI meshes adaptively, from a smoothed part, and keeps the largest piece
//! only; here it is the exact part, and every piece.
//!
//! Source: ASLI at the states of 2022, 2023 and 2024 (`src/ASLI.cpp`, `src/Infill.cpp`, `config.yml`,
//! the manual's appendix A); Perez-Boerema et al. 2022, doi:10.1080/17452759.2022.2048956.

mod keys;
mod program;

use super::Converted;
use super::fits::{Cell, Feature, Release};
use super::yaml::{self, Entry, Place};
use crate::geom::Aabb;
use crate::lang::{Refusal, names};
use crate::text::shortened;
use keys::Role;
use std::fmt;

/// What a configuration needs to know of the files it names.
pub trait Answers {
    /// The box around the mesh in the file `path`.
    ///
    /// # Errors
    /// [`Refusal`] if it can't be read.
    fn bounds(&mut self, path: &str) -> Result<Aabb, Refusal>;

    /// The types in the file of types `path`, in their order.
    ///
    /// # Errors
    /// [`Refusal`] if it can't be read.
    fn types(&mut self, path: &str) -> Result<Vec<String>, Refusal>;
}

/// What is wrong with a configuration, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct Fault {
    /// Where; nowhere for what is missing.
    pub place: Option<Place>,
    /// What.
    pub cause: Cause,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, cause } = self;
        match place {
            Some(place) => write!(f, "{place}: {cause}"),
            None => write!(f, "{cause}"),
        }
    }
}

/// Why a configuration is not translated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Cause {
    /// It is not of the form.
    #[error(transparent)]
    Form(yaml::Cause),
    /// ASLI has no such key.
    #[error("ASLI has no key `{key}`; {cure}")]
    Key {
        /// The key, with the one above it.
        key: String,
        /// What to do about it.
        cure: String,
    },
    /// A key is missing.
    #[error("the key `{key}` is missing; {cure}")]
    Missing {
        /// The key, with the one above it.
        key: &'static str,
        /// What to write.
        cure: &'static str,
    },
    /// A value is no finite number.
    #[error("`{value}` is not a finite number, as `{key}` needs")]
    NotANumber {
        /// The key.
        key: String,
        /// The value.
        value: String,
    },
    /// A number is out of range.
    #[error("`{key}` must {must}, not {value}")]
    Range {
        /// The key.
        key: String,
        /// What it must.
        must: &'static str,
        /// The number.
        value: f64,
    },
    /// A value is none of those known.
    #[error("`{key}` is {known}, not `{value}`")]
    Value {
        /// The key.
        key: String,
        /// What there is.
        known: String,
        /// The value.
        value: String,
    },
    /// A value that ASLI knows and this does not.
    #[error("`{key}: {value}` is not translated; {cure}")]
    Untranslated {
        /// The key.
        key: &'static str,
        /// The value.
        value: String,
        /// What to do about it.
        cure: &'static str,
    },
    /// A file that the configuration names can't be used.
    #[error("can't use `{path}`: {refusal}")]
    File {
        /// The file.
        path: String,
        /// Why.
        refusal: Refusal,
    },
    /// The name of a file can't be written in a program.
    #[error("`{path}` can't be named in a program; {cure}")]
    Name {
        /// The file.
        path: String,
        /// What to do about it.
        cure: &'static str,
    },
}

/// The program of the configuration `text`.
///
/// # Errors
/// [`Fault`], with its place and cure.
pub fn convert(text: &str, answers: &mut dyn Answers) -> Result<Converted, Fault> {
    let entries = yaml::entries(text)
        .map_err(|fault| Fault { place: Some(fault.place), cause: Cause::Form(fault.cause) })?;
    let config = Config::of(&entries)?;
    let text = program::text(&config, answers)?;
    Ok(Converted { text, remarks: config.remarks })
}

/// What a configuration says.
#[derive(Debug)]
struct Config {
    release: Release,
    part: Part,
    kind: Kind,
    is_void: bool,
    /// A positive size, zero for a file of sizes, or minus the number of cells across.
    size: f64,
    sizes: Option<Named>,
    feature: Feature,
    is_absolute: bool,
    /// The value of the feature; zero for a file of values.
    value: f64,
    values: Option<Named>,
    remarks: Vec<String>,
}

/// The body that is filled.
#[derive(Debug)]
enum Part {
    Mesh(Named),
    Cuboid([f64; 3]),
    Cylinder { height: f64, radii: [f64; 2] },
    Spheroid([f64; 3]),
}

/// Which cells fill it.
#[derive(Debug)]
enum Kind {
    One(Cell),
    Hybrid { types: Named, radius: f64, correction: f64 },
}

/// A file, and where it is named.
#[derive(Clone, Debug)]
struct Named {
    path: String,
    place: Place,
}

/// The entries of a configuration, looked up by key.
struct Lookup<'a>(&'a [Entry]);

impl<'a> Lookup<'a> {
    /// The entry of `key` below `above`, unless it has no value.
    fn entry(&self, above: Option<&str>, key: &str) -> Option<&'a Entry> {
        let is_it = |entry: &&Entry| entry.above.as_deref() == above && entry.key == key;
        self.0.iter().find(is_it).filter(|entry| !entry.value.is_empty())
    }

    fn file(&self, key: &str) -> Option<Named> {
        let entry = self.entry(Some("files"), key)?;
        Some(Named { path: entry.value.clone(), place: entry.value_at })
    }

    fn number(&self, key: &str) -> Result<Option<(f64, Place)>, Fault> {
        let Some(Entry { value, value_at, .. }) = self.entry(None, key) else { return Ok(None) };
        let number = value.parse().ok().filter(|number: &f64| number.is_finite());
        let number = number.ok_or_else(|| {
            let cause = Cause::NotANumber { key: key.to_owned(), value: shortened(value) };
            Fault { place: Some(*value_at), cause }
        })?;
        Ok(Some((number, *value_at)))
    }

    /// The number of `key`, not negative; `default` where there is none.
    fn not_negative(&self, key: &str, default: f64) -> Result<f64, Fault> {
        let Some((value, place)) = self.number(key)? else { return Ok(default) };
        if value < 0.0 {
            let cause = Cause::Range { key: key.to_owned(), must: "not be negative", value };
            return Err(Fault { place: Some(place), cause });
        }
        Ok(value)
    }

    /// The place of the value of `key` in `known`; `None` where there is none.
    fn choice(&self, key: &str, known: &[&str]) -> Result<Option<usize>, Fault> {
        let Some(Entry { value, value_at, .. }) = self.entry(None, key) else { return Ok(None) };
        match known.iter().position(|name| name == value) {
            Some(place) => Ok(Some(place)),
            None => Err(Fault { place: Some(*value_at), cause: unknown(key, value, known) }),
        }
    }
}

fn unknown(key: &str, value: &str, known: &[&str]) -> Cause {
    let [all @ .., last] = known else {
        return Cause::NotANumber { key: key.to_owned(), value: shortened(value) };
    };
    let known = format!("{} or {last}", all.join(", "));
    Cause::Value { key: key.to_owned(), known, value: shortened(value) }
}

fn missing(key: &'static str, cure: &'static str) -> Fault {
    Fault { place: None, cause: Cause::Missing { key, cure } }
}

impl Config {
    fn of(entries: &[Entry]) -> Result<Self, Fault> {
        let lookup = Lookup(entries);
        let (release, mut unused) = roles(entries)?;
        let (kind, feature) = (kind(&lookup)?, feature(&lookup)?);
        let side = lookup.choice("me_side", &["scaffold", "void"])?.unwrap_or(0);
        let sides = ["scaffold", "void", "all"];
        let side = lookup.choice("lt_type_side", &sides)?.unwrap_or(side);
        if side == 2 {
            let place = lookup.entry(None, "lt_type_side").map(|entry| entry.value_at);
            let cure = "make two meshes, one with `scaffold` and one with `void`";
            let (key, value) = ("lt_type_side", "all".to_owned());
            return Err(Fault { place, cause: Cause::Untranslated { key, value, cure } });
        }
        let mode = lookup.choice("lt_feature_mode", &["relative", "absolute"])?;
        let (size, _) = lookup.number("lt_size")?.ok_or_else(|| {
            missing("lt_size", "give the length of a cell, or 0 for a `sap` file")
        })?;
        let cure = "give the value of the feature, or 0 for a `fap` file";
        if lookup.entry(None, "lt_feature_val").is_none() {
            return Err(missing("lt_feature_val", cure));
        }
        let value = lookup.not_negative("lt_feature_val", 0.0)?;
        let sizes = match size {
            0.0 => Some(lookup.file("sap").ok_or_else(|| {
                missing("files -> sap", "`lt_size: 0` needs a file of sizes, or give a size")
            })?),
            _ => None,
        };
        let values = match value {
            0.0 => Some(lookup.file("fap").ok_or_else(|| {
                missing(
                    "files -> fap",
                    "`lt_feature_val: 0` needs a file of values, or give a value",
                )
            })?),
            _ => None,
        };
        let part = part(&lookup)?;
        if lookup.file("output").is_some() {
            unused.push("files -> output".to_owned());
        }
        let years = match release {
            Release::Old => "2019 to 2023",
            Release::New => "2024",
        };
        let mut remarks =
            vec![format!("read as a configuration of ASLI of {years}, whose fits give the level")];
        if !unused.is_empty() {
            remarks.push(format!(
                "without effect here, where -s chooses the grid and -o the file: {}",
                unused.join(", ")
            ));
        }
        Ok(Self {
            release,
            part,
            kind,
            is_void: side == 1,
            size,
            sizes,
            feature,
            is_absolute: mode == Some(1),
            value,
            values,
            remarks,
        })
    }
}

/// Which ASLI the entries are for, and those that only say how to mesh.
fn roles(entries: &[Entry]) -> Result<(Release, Vec<String>), Fault> {
    let (mut old, mut new, mut unused) = (false, false, Vec::new());
    for entry in entries {
        let full = match &entry.above {
            Some(above) => format!("{above} -> {}", entry.key),
            None => entry.key.clone(),
        };
        let Some(known) = keys::of(entry) else {
            let near = names::nearest(&entry.key, keys::all());
            let cure = names::suggestion(&near)
                .unwrap_or_else(|| "leave it out, or put a `#` before it".to_owned());
            let cause = Cause::Key { key: shortened(&full), cure };
            return Err(Fault { place: Some(entry.key_at), cause });
        };
        old |= known.release == Some(Release::Old);
        new |= known.release == Some(Release::New);
        if known.role == Role::Meshing {
            unused.push(full);
        }
    }
    let release = if old && !new { Release::Old } else { Release::New };
    Ok((release, unused))
}

fn kind(lookup: &Lookup<'_>) -> Result<Kind, Fault> {
    let known: Vec<&str> = Cell::ALL.iter().map(|(name, _)| *name).chain(["hybrid"]).collect();
    let place = lookup.choice("lt_type", &known)?;
    let place = place.ok_or_else(|| missing("lt_type", "write `lt_type: gyroid`, for example"))?;
    if let Some((_, cell)) = Cell::ALL.get(place) {
        return Ok(Kind::One(*cell));
    }
    let types = lookup.file("tap").ok_or_else(|| {
        missing("files -> tap", "`lt_type: hybrid` needs a file of types, or give a type")
    })?;
    let radius = lookup.not_negative("lt_type_filterRadius", 1.0)?;
    let correction = lookup.not_negative("lt_type_correctionFactor", 0.25)?;
    Ok(Kind::Hybrid { types, radius, correction })
}

fn feature(lookup: &Lookup<'_>) -> Result<Feature, Fault> {
    const KNOWN: [(&str, Feature); 4] = [
        ("volumeFraction", Feature::VolumeFraction),
        ("isovalue", Feature::Isovalue),
        ("wallSize", Feature::WallSize),
        ("poreSize", Feature::PoreSize),
    ];
    let cure = "write `lt_feature: volumeFraction`, for example";
    let entry = lookup.entry(None, "lt_feature").ok_or_else(|| missing("lt_feature", cure))?;
    let place = Some(entry.value_at);
    if ["userDefined", "elasticModulus"].contains(&entry.value.as_str()) {
        let cure = "give the volume fraction that it stands for as `volumeFraction`";
        let (key, value) = ("lt_feature", entry.value.clone());
        return Err(Fault { place, cause: Cause::Untranslated { key, value, cure } });
    }
    let names = KNOWN.map(|(name, _)| name);
    let found = lookup.choice("lt_feature", &names)?.and_then(|place| KNOWN.get(place));
    found.map(|(_, feature)| *feature).ok_or_else(|| missing("lt_feature", cure))
}

fn part(lookup: &Lookup<'_>) -> Result<Part, Fault> {
    if let Some(mesh) = lookup.file("stl") {
        return Ok(Part::Mesh(mesh));
    }
    let Some(entry) = lookup.entry(Some("files"), "internalGeometry") else {
        let cure = "name the mesh to fill, or a body: `internalGeometry: cuboid 1`";
        return Err(missing("files -> stl", cure));
    };
    let place = Some(entry.value_at);
    let known = "`cuboid` with 1 or 3 lengths, `cylinder` with a height and 1 or 2 radii, or \
                 `spheroid` with 1 or 3 radii";
    let fault = || {
        let (key, value) = ("internalGeometry".to_owned(), shortened(&entry.value));
        Fault { place, cause: Cause::Value { key, known: known.to_owned(), value } }
    };
    let mut words = entry.value.split_whitespace();
    let body = words.next().unwrap_or_default();
    let lengths: Option<Vec<f64>> =
        words.map(|word| word.parse().ok().filter(|l: &f64| l.is_finite() && *l > 0.0)).collect();
    match (body, lengths.ok_or_else(fault)?.as_slice()) {
        ("cuboid", &[a]) => Ok(Part::Cuboid([a; 3])),
        ("cuboid", &[a, b, c]) => Ok(Part::Cuboid([a, b, c])),
        ("cylinder", &[height, a]) => Ok(Part::Cylinder { height, radii: [a; 2] }),
        ("cylinder", &[height, a, b]) => Ok(Part::Cylinder { height, radii: [a, b] }),
        ("spheroid", &[a]) => Ok(Part::Spheroid([a; 3])),
        ("spheroid", &[a, b, c]) => Ok(Part::Spheroid([a, b, c])),
        _ => Err(fault()),
    }
}

#[cfg(test)]
mod tests;
