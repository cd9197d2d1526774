//! Names that equations know, and suggestions for those that they don't.

use super::word::normalized;
use crate::expr::{Binary, Unary};
use crate::geom::Axis;

/// Named constants.
pub const CONSTANTS: [(&str, f64); 3] =
    [("pi", std::f64::consts::PI), ("tau", std::f64::consts::TAU), ("e", std::f64::consts::E)];

/// A function of equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Of one argument.
    Unary(Unary),
    /// Of two arguments; `min` and `max` take more, two at a time from the left.
    Binary(Binary),
    /// `clamp(a, lo, hi)` is `min(max(a, lo), hi)`.
    Clamp,
}

impl Function {
    /// The function called `name`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|function| function.name() == name)
    }

    /// Every function.
    pub fn all() -> impl Iterator<Item = Self> {
        let unary = Unary::ALL.into_iter().filter(|op| *op != Unary::Neg).map(Self::Unary);
        let binary = Binary::ALL.into_iter().filter(|op| op.name().len() > 1).map(Self::Binary);
        unary.chain(binary).chain([Self::Clamp])
    }

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unary(op) => op.name(),
            Self::Binary(op) => op.name(),
            Self::Clamp => "clamp",
        }
    }

    /// Least and greatest number of arguments.
    #[must_use]
    pub const fn arity(self) -> (usize, usize) {
        match self {
            Self::Unary(_) => (1, 1),
            Self::Binary(Binary::Min | Binary::Max) => (2, usize::MAX),
            Self::Binary(_) => (2, 2),
            Self::Clamp => (3, 3),
        }
    }
}

/// The coordinate called `name`.
#[must_use]
pub fn coordinate(name: &str) -> Option<Axis> {
    match name {
        "x" => Some(Axis::X),
        "y" => Some(Axis::Y),
        "z" => Some(Axis::Z),
        _ => None,
    }
}

/// The value of the constant called `name`.
#[must_use]
pub fn constant(name: &str) -> Option<f64> {
    CONSTANTS.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
}

/// Every name that equations know without parameters.
pub fn reserved<'a>() -> impl Iterator<Item = &'a str> {
    let functions = Function::all().map(Function::name);
    let values = ["x", "y", "z"].into_iter().chain(CONSTANTS.iter().map(|(name, _)| *name));
    values.chain(functions).map(|name: &'static str| -> &'a str { name })
}

/// The names most like `name` among `known`, best first: at most three, none if all are too far, and
/// never `name` itself.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    // Nothing that is known is so long.
    if name.len() > 64 {
        return Vec::new();
    }
    let own = name;
    let name = normalized(name);
    let letters = name.chars().count();
    // One slip in a short word, two in a longer one; more would suggest the unrelated.
    let allowed = if letters <= 4 { 1 } else { 2 };
    let mut found: Vec<(usize, &str)> = known
        .into_iter()
        .filter(|other| *other != own && other.len().abs_diff(name.len()) <= allowed + 1)
        .map(|other| (distance(&name, other), other))
        .filter(|(distance, other)| *distance <= allowed && *distance < other.chars().count())
        .collect();
    found.sort_unstable();
    found.dedup();
    found.truncate(3);
    found.into_iter().map(|(_, other)| other).collect()
}

/// Least number of insertions, deletions, replacements and swaps of neighbours between two words.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = [vec![0; b.len() + 1], (0..=b.len()).collect::<Vec<_>>(), vec![0; b.len() + 1]];
    for i in 1..=a.len() {
        let [earlier, last, row] = &mut rows;
        row[0] = i;
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(earlier[j - 2] + 1);
            }
        }
        rows.rotate_left(1);
    }
    rows[1][b.len()]
}

/// "; did you mean `a` or `b`?" as a cure, if there is something to suggest.
#[must_use]
pub fn suggestion(names: &[&str]) -> Option<String> {
    let quoted: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.as_slice() {
        [] => None,
        [only] => Some(format!("did you mean {only}?")),
        [all @ .., last] => Some(format!("did you mean {} or {last}?", all.join(", "))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_single_slips() {
        let check = |a, b, expected| assert_eq!(distance(a, b), expected, "{a} {b}");
        check("gyroid", "gyroid", 0);
        check("gyriod", "gyroid", 1);
        check("gyrod", "gyroid", 1);
        check("gyrroid", "gyroid", 1);
        check("sqr", "sqrt", 1);
        check("", "abc", 3);
        check("kitten", "sitting", 3);
    }

    #[test]
    fn suggestions_are_near_and_few() {
        let known = ["sin", "sinh", "cos", "asin", "gyroid"];
        assert_eq!(nearest("sn", known), ["sin"]);
        assert_eq!(nearest("Gyriod", known), ["gyroid"]);
        assert!(nearest("banana", known).is_empty());
        assert_eq!(nearest("sin", known), ["asin", "sinh"]);
        assert_eq!(suggestion(&["a", "b"]).unwrap(), "did you mean `a` or `b`?");
    }

    #[test]
    fn no_name_means_two_things() {
        let mut names: Vec<_> = reserved().collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
