//! Where in the program text something was said.

/// A range of bytes of one source of program text.
///
/// Solids made without text carry [`Span::NOWHERE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// Number of the source: 0 is the command line, later ones are its files.
    pub source: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The span of what no text says.
    pub const NOWHERE: Self = Self { source: u32::MAX, start: 0, end: 0 };

    /// The least span that holds both; `other` alone if they are in different sources.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        if self.source == other.source {
            let (start, end) = (self.start.min(other.start), self.end.max(other.end));
            Self { start, end, ..other }
        } else if other == Self::NOWHERE {
            self
        } else {
            other
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joining_covers_both_and_ignores_nowhere() {
        let a = Span { source: 0, start: 3, end: 5 };
        let b = Span { source: 0, start: 9, end: 12 };
        assert_eq!(a.to(b), Span { source: 0, start: 3, end: 12 });
        assert_eq!(a.to(Span::NOWHERE), a);
        assert_eq!(Span::NOWHERE.to(a), a);
        let file = Span { source: 1, ..a };
        assert_eq!(a.to(file), file);
    }
}
