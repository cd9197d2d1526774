//! Numbers as program text: fixed ones as such, varying ones as equations.

/// A number of a program.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Number {
    /// The same everywhere.
    Fixed(f64),
    /// What an equation says; it needs no parentheses as an operand.
    Varying(String),
}

impl Number {
    /// The number as an operand in an equation.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Fixed(value) if *value < 0.0 || is_negative_zero(*value) => {
                format!("({value})")
            }
            Self::Fixed(value) => value.to_string(),
            Self::Varying(text) => text.clone(),
        }
    }

    /// The number within limits.
    pub(super) fn clamped(&self, least: f64, most: f64) -> Self {
        match self {
            Self::Fixed(value) => Self::Fixed(value.max(least).min(most)),
            Self::Varying(text) => match (least.is_finite(), most.is_finite()) {
                (true, true) => Self::Varying(format!("clamp({text},{least},{most})")),
                _ => self.clone(),
            },
        }
    }

    /// The polynomial with these coefficients of rising powers, at least one.
    pub(super) fn polynomial(&self, coefficients: &[f64]) -> Self {
        match self {
            Self::Fixed(value) => {
                Self::Fixed(coefficients.iter().rev().fold(0.0, |sum, c| sum * value + c))
            }
            Self::Varying(text) => {
                let mut rest = coefficients.iter().rev();
                let last = rest.next().map_or_else(String::new, |c| Self::Fixed(*c).text());
                Self::Varying(rest.fold(last, |sum, c| match c {
                    0.0 => format!("({text}*{sum})"),
                    c => format!("({c}+{text}*{sum})"),
                }))
            }
        }
    }

    /// This by `other`.
    pub(super) fn over(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Fixed(a), Self::Fixed(b)) => Self::Fixed(a / b),
            _ => Self::Varying(format!("({}/{})", self.text(), other.text())),
        }
    }

    /// This times `other`.
    pub(super) fn times(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Fixed(a), Self::Fixed(b)) => Self::Fixed(a * b),
            _ => Self::Varying(format!("({}*{})", self.text(), other.text())),
        }
    }

    /// This less `other`.
    pub(super) fn less(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::Fixed(a), Self::Fixed(b)) => Self::Fixed(a - b),
            _ => Self::Varying(format!("({}-{})", self.text(), other.text())),
        }
    }

    /// Its size.
    pub(super) fn size(&self) -> Self {
        match self {
            Self::Fixed(value) => Self::Fixed(value.abs()),
            Self::Varying(text) => Self::Varying(format!("abs({text})")),
        }
    }

    /// The number as a word of a program: an equation in quotes if it varies.
    ///
    /// `None` if no quotes go around it.
    pub(super) fn word(&self) -> Option<String> {
        match self {
            Self::Fixed(value) => Some(value.to_string()),
            Self::Varying(text) => {
                let quote = ['\'', '"'].into_iter().find(|quote| !text.contains(*quote));
                quote.map(|quote| format!("{quote}{text}{quote}"))
            }
        }
    }
}

fn is_negative_zero(value: f64) -> bool {
    value == 0.0 && value.is_sign_negative()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang;

    #[test]
    fn equations_say_what_numbers_are() {
        // The parameter takes the place of what varies.
        let steps = |number: &Number| {
            let part = number.clamped(-0.5, 0.75).polynomial(&[-1.25, 2.0, 0.0, -3.5]);
            let other = Number::Fixed(-0.5);
            part.over(&other).less(&part.times(&other)).size().less(number)
        };
        for value in [-2.0, -0.1, 0.3, 5.0] {
            let Number::Fixed(expected) = steps(&Number::Fixed(value)) else { panic!() };
            let Number::Varying(text) = steps(&Number::Varying("t".to_owned())) else { panic!() };
            let found = lang::numbers(&text, "it", &[("t".to_owned(), value)]).unwrap()[0];
            assert!((found - expected).abs() < 1e-12, "{text}: {found} is not {expected}");
        }
        assert_eq!(Number::Fixed(-0.5).text(), "(-0.5)");
        assert_eq!(Number::Varying("[it's.fap]".into()).word().unwrap(), "\"[it's.fap]\"");
    }
}
