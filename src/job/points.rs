//! Numbers at points of a file, as equations name them in brackets.
//!
//! * `[rho.fap]`: the numbers of a file of features.
//! * `[cells.sap]`: the sizes of a file of sizes, interpolated by their reciprocals.
//! * `[cells.tap gyroid]`: how much there is of a type, from 0 to 1; `[cells.tap gyroid 0.5]` averaged within
//!   that radius; `[cells.tap gyroid 1 cells.sap]` within so many of the sizes of a file.
//!
//! Source: ASLI's files of points; see [`scattered`](crate::field::scattered).

use crate::expr::Oracle;
use crate::field::scattered::file::{self, Sign};
use crate::field::scattered::{self, Scale, types};
use crate::lang::Refusal;
use std::collections::HashMap;
use std::sync::Arc;

/// What is to be written in brackets.
const USAGE: &str = "write `[FILE.fap]`, `[FILE.sap]` or `[FILE.tap TYPE RADIUS]`; `(...)` are \
                     parentheses";

/// What the text in brackets asks for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Wanted {
    /// Numbers.
    Features { file: String },
    /// Sizes.
    Sizes { file: String },
    /// The weight of a type, averaged within a radius: a length, or a factor of the sizes of a file.
    Type { file: String, name: String, radius: f64, sizes: Option<String> },
}

impl Wanted {
    /// What `text` asks for. A name of a file may hold blanks: it goes on to its ending.
    pub(super) fn of(text: &str) -> Result<Self, Refusal> {
        let usage = || Refusal { cause: USAGE.to_owned() };
        let (file, ending, rest) = split_file(text).ok_or_else(usage)?;
        let file = file.to_owned();
        match (ending, rest) {
            (".fap", "") => return Ok(Self::Features { file }),
            (".sap", "") => return Ok(Self::Sizes { file }),
            (".tap", _) => {}
            _ => return Err(usage()),
        }
        let (name, rest) = split_word(rest);
        let (radius, rest) = split_word(rest);
        if name.is_empty() {
            return Err(usage());
        }
        let name = name.to_owned();
        if radius.is_empty() {
            return Ok(Self::Type { file, name, radius: 0.0, sizes: None });
        }
        let length = radius.parse().ok().filter(|r: &f64| r.is_finite() && *r >= 0.0);
        let radius = length.ok_or_else(|| Refusal {
            cause: format!("the radius `{radius}` is no finite number from zero on; {USAGE}"),
        })?;
        let sizes = match split_file(rest) {
            None if rest.is_empty() => None,
            Some((sizes, ".sap", "")) => Some(sizes.to_owned()),
            _ => return Err(usage()),
        };
        Ok(Self::Type { file, name, radius, sizes })
    }

    /// The file, and the file of sizes.
    pub(super) fn files(&self) -> [Option<&str>; 2] {
        match self {
            Self::Features { file } | Self::Sizes { file } => [Some(file), None],
            Self::Type { file, sizes, .. } => [Some(file), sizes.as_deref()],
        }
    }
}

/// A name of a file to the first ending that is one, the ending in lower case, and what follows.
fn split_file(text: &str) -> Option<(&str, &'static str, &str)> {
    let lower = text.to_ascii_lowercase();
    let ends = [".fap", ".sap", ".tap"].into_iter().flat_map(|ending| {
        let found = lower.match_indices(ending).map(move |(at, _)| (at + ending.len(), ending));
        found.collect::<Vec<_>>()
    });
    let is_end = |at: usize| text[at..].chars().next().is_none_or(char::is_whitespace);
    let (end, ending) = ends.filter(|(at, ending)| *at > ending.len() && is_end(*at)).min()?;
    Some((&text[..end], ending, text[end..].trim()))
}

/// The first word of `text`, and the rest.
fn split_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

/// The fields of types by their names.
type ByName = Vec<(String, Arc<dyn Oracle>)>;

/// The fields that were made, by what asked for them.
#[derive(Debug, Default)]
pub(super) struct Points {
    fields: HashMap<String, Arc<dyn Oracle>>,
    /// All types of a file, by what asked for one of them, without its name.
    weights: HashMap<String, ByName>,
}

impl Points {
    /// What was made for `text` before.
    pub(super) fn known(&self, text: &str) -> Option<Arc<dyn Oracle>> {
        self.fields.get(text).cloned()
    }

    /// Makes what `wanted`, which `text` says, asks for, from the texts of its files.
    pub(super) fn read(
        &mut self,
        text: &str,
        wanted: &Wanted,
        main: &str,
        sizes: Option<&str>,
    ) -> Result<Arc<dyn Oracle>, Refusal> {
        let field = match wanted {
            Wanted::Features { file } => numbers(main, Sign::Any, Scale::Plain, file)?,
            Wanted::Sizes { file } => numbers(main, Sign::Positive, Scale::Reciprocal, file)?,
            Wanted::Type { file, name, radius, sizes: named } => {
                let key = format!("{file} {radius} {named:?}");
                let known = match self.weights.get(&key) {
                    Some(known) => known,
                    None => {
                        let made = weights(main, *radius, sizes, file)?;
                        self.weights.entry(key).or_insert(made)
                    }
                };
                let found = known.iter().find(|(known, _)| known == name);
                let (_, field) = found.ok_or_else(|| {
                    let names: Vec<_> = known.iter().map(|(name, _)| name.as_str()).collect();
                    let names = names.join(", ");
                    Refusal { cause: format!("it has no points of type `{name}`, but of {names}") }
                })?;
                Arc::clone(field)
            }
        };
        self.fields.insert(text.to_owned(), Arc::clone(&field));
        Ok(field)
    }
}

fn refused(error: impl std::error::Error) -> Refusal {
    Refusal { cause: error.to_string() }
}

fn numbers(text: &str, sign: Sign, scale: Scale, name: &str) -> Result<Arc<dyn Oracle>, Refusal> {
    let data = file::numbers(text, sign).map_err(refused)?;
    Ok(Arc::new(scattered::scattered(&data, scale, name).map_err(refused)?))
}

fn weights(text: &str, radius: f64, sizes: Option<&str>, name: &str) -> Result<ByName, Refusal> {
    let data = file::types(text).map_err(refused)?;
    let radii = match sizes.filter(|_| radius > 0.0) {
        None => vec![radius; data.at.len()],
        Some(sizes) => {
            let sizes = file::numbers(sizes, Sign::Positive)
                .map_err(|fault| Refusal { cause: format!("of its sizes, {fault}") })?;
            let sizes = scattered::scattered(&sizes, Scale::Reciprocal, name).map_err(refused)?;
            data.at.iter().map(|point| radius * sizes.value(*point)).collect()
        }
    };
    let fields = types::weights(&data, &radii, name).map_err(refused)?;
    let oracles = fields.into_iter().map(|field| Arc::new(field) as Arc<dyn Oracle>);
    Ok(data.names.into_iter().zip(oracles).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brackets_name_a_file_and_what_of_it_is_meant() {
        let check = |text: &str, expected: Wanted| assert_eq!(Wanted::of(text), Ok(expected));
        check("a.fap", Wanted::Features { file: "a.fap".into() });
        check("my dir/b.x.SAP", Wanted::Sizes { file: "my dir/b.x.SAP".into() });
        let typed = |radius: f64, sizes: Option<&str>| Wanted::Type {
            file: "c.tap".into(),
            name: "sheet_gyroid".into(),
            radius,
            sizes: sizes.map(str::to_owned),
        };
        check("c.tap sheet_gyroid", typed(0.0, None));
        check("c.tap  sheet_gyroid 0.25", typed(0.25, None));
        check("c.tap sheet_gyroid 1 d e.sap", typed(1.0, Some("d e.sap")));
    }

    #[test]
    fn other_texts_are_refused() {
        for text in ["x+1", ".fap", "a.fap b", "a.tap", "a.tap t 1 b.fap", "a.tap t 1 b", "é.fapp"]
        {
            assert_eq!(Wanted::of(text).unwrap_err().cause, USAGE, "{text}");
        }
        let cause = Wanted::of("a.tap t -1").unwrap_err().cause;
        assert!(cause.starts_with("the radius `-1` is no finite number"), "{cause}");
    }

    #[test]
    fn types_that_are_not_there_are_refused_with_those_that_are() {
        let text = "0,0,0,a\n1,0,0,b\n0,1,0,b\n0,0,1,a\n1,1,1,a";
        let mut points = Points::default();
        let mut read = |asked: &str| points.read(asked, &Wanted::of(asked).unwrap(), text, None);
        assert!(read("f.tap b 0.5").is_ok());
        let cause = read("f.tap c 0.5").unwrap_err().cause;
        assert_eq!(cause, "it has no points of type `c`, but of a, b");
    }
}
