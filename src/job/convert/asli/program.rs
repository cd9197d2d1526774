//! The program of a configuration.
//!
//! One cell is said in words: `gyroid dilate 0.3 scale 2`. Offsets that vary come after the size, so
//! that their equation is one of the part's space; sizes that vary divide the coordinates. Several
//! cells are one equation, the sum of their fields by weights; its zeros do not depend on what the sum
//! is divided by, so weights are not divided by their norm there.

use super::super::fits::{Cell, Feature, Release, Surface};
use super::super::formula::Number;
use super::super::quoted;
use super::{Answers, Cause, Config, Fault, Kind, Named, Part, unknown};
use crate::lang::Refusal;
use crate::mesh::io::is_mesh_path;
use crate::text::shortened;
use std::path::Path;

/// The text of the program.
pub(super) fn text(config: &Config, answers: &mut dyn Answers) -> Result<String, Fault> {
    let size = size(config, answers)?;
    let value = match &config.values {
        None => Number::Fixed(config.value),
        Some(file) => Number::Varying(points(file, ".fap", "")?),
    };
    let value = match config.feature {
        Feature::WallSize | Feature::PoreSize if config.is_absolute => value.over(&size),
        Feature::Isovalue | Feature::VolumeFraction | Feature::WallSize | Feature::PoreSize => {
            value
        }
    };
    let lattice = match &config.kind {
        Kind::One(cell) => words(config, *cell, &size, &value),
        Kind::Hybrid { types, radius, correction } => {
            let hybrid = Hybrid { types, radius: *radius, correction: *correction };
            hybrid.words(config, &size, &value, answers)?
        }
    };
    // Only files' names bring quotes into equations.
    let lattice = lattice.ok_or_else(|| {
        let files = [&config.values, &config.sizes].into_iter().flatten();
        let path = files.map(|named| named.path.clone()).next().unwrap_or_default();
        let cure = "rename the files of points: their names hold both kinds of quotes";
        Fault { place: None, cause: Cause::Name { path, cure } }
    })?;
    let side = if config.is_void { " complement" } else { "" };
    Ok(format!("{}\n{lattice}{side}\nintersection\n", part(&config.part)?))
}

/// The part, as words.
fn part(part: &Part) -> Result<String, Fault> {
    Ok(match part {
        Part::Mesh(Named { path, place }) => {
            // A word that begins with `@` names a file of words, in quotes as without.
            let is_mesh = is_mesh_path(Path::new(path)) && !path.starts_with('@');
            quoted(path).filter(|_| is_mesh).ok_or_else(|| {
                let cure = "rename it to end as meshes do, in `.stl`, and not to begin with `@`";
                Fault { place: Some(*place), cause: Cause::Name { path: path.clone(), cure } }
            })?
        }
        Part::Cuboid([a, b, c]) => format!("box scale {},{},{}", a / 2.0, b / 2.0, c / 2.0),
        Part::Cylinder { height, radii: [a, b] } => {
            let half = height / 2.0;
            format!("cylinder scale {a},{b},1 box scale {a},{b},{half} intersection")
        }
        Part::Spheroid([a, b, c]) => format!("sphere scale {a},{b},{c}"),
    })
}

/// The size of a cell.
fn size(config: &Config, answers: &mut dyn Answers) -> Result<Number, Fault> {
    if let Some(file) = &config.sizes {
        return Ok(Number::Varying(points(file, ".sap", "")?));
    }
    if config.size > 0.0 {
        return Ok(Number::Fixed(config.size));
    }
    let sides = match &config.part {
        Part::Mesh(named) => {
            let bounds = answers.bounds(&named.path).map_err(|refusal| of_file(named, refusal))?;
            bounds.size().to_array()
        }
        Part::Cuboid(sides) => *sides,
        Part::Cylinder { height, radii: [a, b] } => [2.0 * a, 2.0 * b, *height],
        Part::Spheroid(radii) => radii.map(|r| 2.0 * r),
    };
    Ok(Number::Fixed(sides.into_iter().fold(f64::INFINITY, f64::min) / config.size.abs()))
}

fn of_file(Named { path, place }: &Named, refusal: Refusal) -> Fault {
    Fault { place: Some(*place), cause: Cause::File { path: path.clone(), refusal } }
}

/// The numbers at points of `file`, whose name must end in `ending`, as an operand.
fn points(file: &Named, ending: &'static str, meaning: &str) -> Result<String, Fault> {
    let Named { path, place } = file;
    let is_sayable = path.to_ascii_lowercase().ends_with(ending)
        && !path.contains([']', '\n'])
        && !(path.contains('\'') && path.contains('"'))
        && path.trim() == path;
    if !is_sayable {
        let cure = match ending {
            ".tap" => "rename it to end in `.tap`, without `]` or both kinds of quotes",
            ".sap" => "rename it to end in `.sap`, without `]` or both kinds of quotes",
            _ => "rename it to end in `.fap`, without `]` or both kinds of quotes",
        };
        return Err(Fault { place: Some(*place), cause: Cause::Name { path: path.clone(), cure } });
    }
    Ok(format!("[{path}{meaning}]"))
}

/// How a surface is had from the one of our catalogue.
struct Ours {
    word: &'static str,
    is_changed_in_sign: bool,
    /// Whether x and y are exchanged: there are two gyroids, mirror images of each other.
    is_mirrored: bool,
}

fn ours(surface: Surface) -> Ours {
    let plain = |word| Ours { word, is_changed_in_sign: false, is_mirrored: false };
    match surface {
        Surface::Gyroid => Ours { is_mirrored: true, ..plain("gyroid") },
        Surface::Diamond => plain("d-surface"),
        Surface::Primitive => Ours { is_changed_in_sign: true, ..plain("p-surface") },
        Surface::Iwp => Ours { is_changed_in_sign: true, ..plain("iwp") },
    }
}

/// The level ℓ for which a network is where its field is less than ℓ.
fn offset(config: &Config, surface: Surface, level: Number) -> Number {
    match (surface, config.release) {
        (Surface::Iwp, Release::Old) => level.times(&Number::Fixed(-1.0)),
        (Surface::Gyroid | Surface::Diamond | Surface::Primitive | Surface::Iwp, _) => level,
    }
}

/// One cell, as words; `None` where an equation takes no quotes.
fn words(config: &Config, cell: Cell, size: &Number, value: &Number) -> Option<String> {
    /// A radius of struts, in cells, from which others are told.
    const STRUT: f64 = 0.1;
    let level = cell.level(config.release, config.feature, value);
    let (base, is_mirrored, verb, offset) = match cell {
        Cell::Network(surface) => {
            let Ours { word, is_changed_in_sign, is_mirrored } = ours(surface);
            let base = format!("{word}{}", if is_changed_in_sign { " complement" } else { "" });
            (base, is_mirrored, "dilate", offset(config, surface, level))
        }
        Cell::Sheet(surface) => {
            let Ours { word, is_changed_in_sign: _, is_mirrored } = ours(surface);
            let twice = level.size().times(&Number::Fixed(2.0));
            (word.to_owned(), is_mirrored, "shell", twice)
        }
        Cell::Cubic => match level {
            Number::Fixed(radius) if radius > 0.0 => {
                let base = format!("simple-cubic radius {radius}");
                (base, false, "dilate", Number::Fixed(0.0))
            }
            level @ (Number::Fixed(_) | Number::Varying(_)) => {
                let base = format!("simple-cubic radius {STRUT}");
                (base, false, "dilate", level.less(&Number::Fixed(STRUT)))
            }
        },
    };
    let axes = if is_mirrored { ["y", "x", "z"] } else { ["x", "y", "z"] };
    let mirror = if is_mirrored { " conform y,x,z" } else { "" };
    let is_nothing = verb == "dilate" && offset == Number::Fixed(0.0);
    let change = |offset: &Number| -> Option<String> {
        if is_nothing { Some(String::new()) } else { Some(format!(" {verb} {}", offset.word()?)) }
    };
    Some(match (size, &offset) {
        (Number::Fixed(size), Number::Fixed(_)) => {
            format!("{base}{mirror}{} scale {size}", change(&offset)?)
        }
        (Number::Fixed(length), Number::Varying(_)) => {
            // Levels have been scaled before the offset comes.
            format!("{base}{mirror} scale {length}{}", change(&offset.times(size))?)
        }
        (Number::Varying(_), _) => {
            let place = axes.map(|axis| format!("{axis}/{}", size.text())).join(",");
            let place = Number::Varying(place).word()?;
            format!("{base} conform {place}{}", change(&offset)?)
        }
    })
}

/// Cells that pass into each other.
struct Hybrid<'a> {
    types: &'a Named,
    radius: f64,
    correction: f64,
}

impl Hybrid<'_> {
    fn words(
        &self,
        config: &Config,
        size: &Number,
        value: &Number,
        answers: &mut dyn Answers,
    ) -> Result<Option<String>, Fault> {
        let names =
            answers.types(&self.types.path).map_err(|refusal| of_file(self.types, refusal))?;
        let cells: Result<Vec<Cell>, Fault> = names.iter().map(|name| self.cell(name)).collect();
        let cells = cells?;
        if let [cell] = cells[..] {
            return Ok(words(config, cell, size, value));
        }
        let weights = self.weights(&names, config, size)?;
        let squares: Vec<String> = weights.iter().map(|weight| format!("{weight}^2")).collect();
        let norm = format!("sqrt({})", squares.join("+"));
        let (mut sum, mut value) = (Vec::new(), value.clone());
        for (cell, weight) in cells.iter().zip(&weights) {
            if self.correction != 0.0 {
                let bend = format!("(2*{weight}/{norm}-1)");
                let factor = format!("(1+{}*(1-{bend}^2))", self.correction);
                value = value.times(&Number::Varying(factor));
            }
            let level = cell.level(config.release, config.feature, &value);
            sum.push(format!("{weight}*({})", field(config, *cell, size, level)));
        }
        Ok(Number::Varying(sum.join("+")).word())
    }

    fn cell(&self, name: &str) -> Result<Cell, Fault> {
        Cell::named(name).ok_or_else(|| {
            let known = Cell::ALL.map(|(name, _)| name);
            let cause = unknown("a type", &shortened(name), &known);
            of_file(self.types, Refusal { cause: cause.to_string() })
        })
    }

    /// The weights of the types; the last is what the others leave of 1.
    fn weights(
        &self,
        names: &[String],
        config: &Config,
        size: &Number,
    ) -> Result<Vec<String>, Fault> {
        let radius = match (size, &config.sizes) {
            _ if self.radius == 0.0 => String::new(),
            (Number::Fixed(size), _) => format!(" {}", self.radius * size),
            (Number::Varying(_), sizes) => {
                let path = sizes.as_ref().map(|named| named.path.clone()).unwrap_or_default();
                format!(" {} {path}", self.radius)
            }
        };
        let mut weights = Vec::new();
        for name in names.iter().take(names.len().saturating_sub(1)) {
            weights.push(points(self.types, ".tap", &format!(" {name}{radius}"))?);
        }
        weights.push(format!("(1-{})", weights.join("-")));
        Ok(weights)
    }
}

/// The field of `cell` as an equation, less than zero in the solid.
fn field(config: &Config, cell: Cell, size: &Number, level: Number) -> String {
    let size = size.text();
    let wave = |function: &str, harmonic: &str, axis: &str| {
        format!("{function}({harmonic}tau*{axis}/{size})")
    };
    let (s, c) = (|axis: &str| wave("sin", "", axis), |axis: &str| wave("cos", "", axis));
    let cyclic = |term: &dyn Fn(&str, &str) -> String| {
        [("x", "y"), ("y", "z"), ("z", "x")].map(|(a, b)| term(a, b)).join("+")
    };
    let of = |surface: Surface| match surface {
        Surface::Gyroid => cyclic(&|a, b| format!("{}*{}", s(a), c(b))),
        Surface::Diamond => format!(
            "{}*{}*{}+{}",
            s("x"),
            s("y"),
            s("z"),
            [("x", "y", "z"), ("y", "z", "x"), ("z", "x", "y")]
                .map(|(a, b, d)| format!("{}*{}*{}", s(a), c(b), c(d)))
                .join("+")
        ),
        Surface::Primitive => format!("-({})", cyclic(&|a, _| c(a))),
        Surface::Iwp => format!(
            "{}-2*({})",
            cyclic(&|a, _| wave("cos", "2*", a)),
            cyclic(&|a, b| format!("{}*{}", c(a), c(b)))
        ),
    };
    match cell {
        Cell::Network(surface) => {
            format!("{}-{}", of(surface), offset(config, surface, level).text())
        }
        Cell::Sheet(surface) => format!("({})^2-{}^2", of(surface), level.text()),
        Cell::Cubic => {
            let u = |axis: &str| format!("({axis}/{size}-round({axis}/{size}))");
            let struts = [("x", "y"), ("y", "z"), ("z", "x")]
                .map(|(a, b)| format!("hypot({},{})", u(a), u(b)));
            format!("min({})/{}-1", struts.join(","), level.text())
        }
    }
}
