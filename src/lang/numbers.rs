//! Numbers outside of programs: the values of options.

use super::infix::{self, Coordinates, Scope};
use super::syntax::Equation;
use super::{Diagnostic, Sources};
use crate::expr::{Graph, constant};
use crate::solid::Span;

/// The numbers that `text` gives: equations without coordinates, with commas between.
///
/// `meaning` names the value in messages, as in "the value of `-s`".
///
/// # Errors
/// The first fault of the text, and the text for showing it.
pub fn read(meaning: &str, text: &str) -> Result<Vec<f64>, (Diagnostic, Sources)> {
    let sources = Sources::new(&[text.to_owned()]);
    let word = sources.all()[0].words[0].clone();
    let offset = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
    let span = Span { source: 0, start: offset(word.start), end: offset(word.end) };
    let scope = Scope { coordinates: Coordinates::Forbidden(meaning), parameters: &[] };
    match infix::list(text, span, scope) {
        Ok(equations) => Ok(equations.iter().map(value).collect()),
        Err(faults) => {
            let first = faults.into_iter().next();
            Err((first.unwrap_or_else(|| Diagnostic::new("not a number").at(span, "")), sources))
        }
    }
}

/// The value of an equation without coordinates and parameters; NaN where it has one.
fn value(equation: &Equation) -> f64 {
    let mut graph = Graph::new();
    let node = equation.expression(&mut graph, &mut |graph, _| graph.constant(f64::NAN));
    constant::value(&graph, node, &[]).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_equations_are_numbers() {
        assert_eq!(read("the spacing", "2/60").unwrap(), [2.0 / 60.0]);
        assert_eq!(read("the spacing", "1, 2*3,-sqrt(4)").unwrap(), [1.0, 6.0, -2.0]);
    }

    #[test]
    fn faults_point_into_the_text() {
        let (fault, sources) = read("the spacing", "2/").unwrap_err();
        assert!(!fault.labels.is_empty());
        assert_eq!(sources.all()[0].text, "2/");
        assert!(read("the spacing", "x").is_err());
        assert!(read("the spacing", "").is_err());
    }
}
