//! Faults of program text as plain data: message, places, cure.

use crate::solid::{BoundsFault, Span};

/// One fault of program text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// What is wrong, in lower case, one line.
    pub message: String,
    /// Where; the first is the place of the fault, the others explain it. Empty if it has no place.
    pub labels: Vec<Label>,
    /// What to do about it.
    pub cure: Option<String>,
    /// Whether the text is right and a file that it names is at fault.
    pub is_of_a_file: bool,
}

/// A place in the text and what is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What is there; may be empty.
    pub text: String,
}

impl Diagnostic {
    /// The fault `message`, with neither place nor cure.
    ///
    /// A message, label or cure that is longer than a screen, because of a word that is, loses its
    /// middle.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            message: shortened(message.into()),
            labels: Vec::new(),
            cure: None,
            is_of_a_file: false,
        }
    }

    /// Adds the place `span`, where `text` is.
    #[must_use]
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: shortened(text.into()) });
        self
    }

    /// Says that a file is at fault, not the text that names it.
    #[must_use]
    pub fn of_a_file(mut self) -> Self {
        self.is_of_a_file = true;
        self
    }

    /// Sets what to do about it.
    #[must_use]
    pub fn cure(mut self, cure: impl Into<String>) -> Self {
        self.cure = Some(shortened(cure.into()));
        self
    }
}

/// The most bytes of a message.
const LONGEST: usize = 1000;
/// Bytes that are left of each end of a longer one.
const LEFT: usize = 300;

/// `text` without its middle if it is longer than any message should be.
#[must_use]
pub fn shortened(text: String) -> String {
    if text.len() <= LONGEST {
        return text;
    }
    let boundary = |at: &usize| text.is_char_boundary(*at);
    let end = (0..=LEFT).rev().find(boundary).unwrap_or(0);
    let start = (text.len() - LEFT..text.len()).find(boundary).unwrap_or(text.len());
    let omitted = start - end;
    format!("{}... ({omitted} bytes) ...{}", &text[..end], &text[start..])
}

impl From<BoundsFault> for Diagnostic {
    fn from(fault: BoundsFault) -> Self {
        match fault {
            BoundsFault::Unbounded { axes } => unbounded(axes),
            BoundsFault::Empty { apart: Some([a, b]), .. } => {
                Self::new("the solid is empty: two operands do not overlap")
                    .at(b, "lies outside the other")
                    .at(a, "the other operand")
                    .cure("move or scale one of them, or join them by `union`")
            }
            BoundsFault::Empty { apart: None, span } => {
                Self::new("the solid is empty").at(span, "has no volume").cure(
                    "give it a size above zero, and less room to the origin if it is lost in the \
                     rounding of coordinates there",
                )
            }
            BoundsFault::Undefined { span } => {
                Self::new("the size of the solid is not a finite number")
                    .at(span, "has an infinite or undefined size")
            }
        }
    }
}

/// The fault of a solid that is unbounded along the axes with an operand to blame.
fn unbounded(axes: [Option<Span>; 3]) -> Diagnostic {
    let named = |wanted: &dyn Fn(Span) -> bool| {
        let names = ["x", "y", "z"].into_iter().zip(axes);
        let names: Vec<_> =
            names.filter(|(_, span)| span.is_some_and(wanted)).map(|(name, _)| name).collect();
        match names.as_slice() {
            [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
            names => names.concat(),
        }
    };
    let mut fault = Diagnostic::new(format!("the solid is unbounded along {}", named(&|_| true)));
    let mut blamed: Vec<Span> = axes.into_iter().flatten().collect();
    blamed.dedup();
    for span in blamed {
        if !fault.labels.iter().any(|label| label.span == span) {
            fault = fault.at(span, format!("reaches to infinity along {}", named(&|s| s == span)));
        }
    }
    fault.cure("add a bounded shape such as `box` or `sphere scale 5`, or give `--bounds`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endless_words_lose_their_middle() {
        let fault = Diagnostic::new(format!("unknown word `{}`", "\u{3c0}".repeat(50_000)));
        assert!(fault.message.len() < 700, "{}", fault.message.len());
        assert!(fault.message.starts_with("unknown word `\u{3c0}") && fault.message.ends_with('`'));
        let plain = "x".repeat(LONGEST);
        assert_eq!(Diagnostic::new(plain.clone()).message, plain);
    }
}
