//! Reads infix equations.
//!
//! Precedence climbing over the table of [`Infix`]: sums, products, negation, powers, from loose to
//! tight; powers group from the right, the others from the left; there is no implicit product.
//! Nesting beyond a limit is a fault, not a stack overflow; a chain of sums or products
//! is a loop and may be as long as it likes.
//!
//! Source: the Cesogen paper attests `+ - * /`, calls, `pi` and `abs`; the rest is ours.

use super::lexer::{Lexeme, lexemes};
use super::names::{self, CONSTANTS, Function};
use super::syntax::{Equation, Infix, Term};
use super::{Diagnostic, Span};

/// Parentheses, calls, signs and powers within each other, at most.
const DEPTH_LIMIT: usize = 256;
/// Faults reported of one equation, at most.
const FAULT_LIMIT: usize = 8;

/// Names that an equation may use besides constants and functions.
#[derive(Clone, Copy)]
pub struct Scope<'a> {
    /// Whether the coordinates are known; if not, who forbids them.
    pub coordinates: Coordinates<'a>,
    /// Names of parameters.
    pub parameters: &'a [(String, f64)],
}

/// Whether an equation may depend on the point.
#[derive(Clone, Copy)]
pub enum Coordinates<'a> {
    /// It may.
    Known,
    /// It is a number: the value of this.
    Forbidden(&'a str),
}

/// Reads `text`, which stands at `span`, as an equation.
///
/// # Errors
/// At least one diagnostic, in the order of the text.
pub fn equation(text: &str, span: Span, scope: Scope<'_>) -> Result<Equation, Vec<Diagnostic>> {
    let mut equations = list(text, span, scope)?;
    match (equations.pop(), equations.is_empty()) {
        (Some(equation), true) => Ok(equation),
        _ => Err(vec![Diagnostic::new("a list is not an equation").at(span, "has commas")]),
    }
}

/// Reads `text`, which stands at `span`, as equations with commas between them; at least one.
///
/// # Errors
/// At least one diagnostic, in the order of the text.
pub fn list(text: &str, span: Span, scope: Scope<'_>) -> Result<Vec<Equation>, Vec<Diagnostic>> {
    let lexemes = lexemes(text, span).map_err(|fault| vec![fault])?;
    let mut reader =
        Reader { lexemes, next: 0, depth: 0, terms: Vec::new(), faults: Vec::new(), scope, span };
    let mut equations = Vec::new();
    let outcome = loop {
        if let Err(fault) = reader.operand_and_operators(0) {
            break Err(fault);
        }
        equations.push(Equation(std::mem::take(&mut reader.terms)));
        match reader.advance() {
            (Lexeme::Sign(','), _) => {}
            (Lexeme::End, _) => break Ok(()),
            (lexeme, at) => break Err(unexpected(lexeme, at)),
        }
    };
    reader.faults.extend(outcome.err());
    if reader.faults.is_empty() {
        Ok(equations)
    } else {
        reader.faults.truncate(FAULT_LIMIT);
        Err(reader.faults)
    }
}

/// The state of reading one list of equations.
struct Reader<'a> {
    lexemes: Vec<(Lexeme<'a>, Span)>,
    next: usize,
    depth: usize,
    terms: Vec<Term>,
    faults: Vec<Diagnostic>,
    scope: Scope<'a>,
    span: Span,
}

impl<'a> Reader<'a> {
    fn peek(&self) -> (Lexeme<'a>, Span) {
        self.lexemes.get(self.next).copied().unwrap_or((Lexeme::End, self.span))
    }

    fn advance(&mut self) -> (Lexeme<'a>, Span) {
        let found = self.peek();
        self.next += 1;
        found
    }

    /// Reads an operand and the operators after it that bind at least as tightly as `least`.
    fn operand_and_operators(&mut self, least: u8) -> Result<(), Diagnostic> {
        self.depth += 1;
        if self.depth > DEPTH_LIMIT {
            let message = format!("the equation is nested more than {DEPTH_LIMIT} deep");
            let fault = Diagnostic::new(message).at(self.peek().1, "goes too deep here");
            return Err(fault.cure("simplify the equation, or split it into several shapes"));
        }
        self.operand()?;
        while let (Lexeme::Sign(sign), _) = self.peek() {
            let Some(infix) = Infix::written(sign) else { break };
            let precedence = infix.precedence();
            if precedence < least {
                break;
            }
            self.advance();
            self.operand_and_operators(precedence + u8::from(!infix.is_right_associative()))?;
            self.terms.push(Term::Infix(infix));
        }
        self.depth -= 1;
        Ok(())
    }

    /// Reads a number, a name, a call, a negation or something in parentheses.
    fn operand(&mut self) -> Result<(), Diagnostic> {
        let (lexeme, at) = self.advance();
        match lexeme {
            Lexeme::Number(value) => self.terms.push(Term::Number(value)),
            Lexeme::Sign('-') => {
                self.operand_and_operators(Infix::NEGATION)?;
                self.terms.push(Term::Negate);
            }
            Lexeme::Sign('(') => {
                self.operand_and_operators(0)?;
                self.closing(at)?;
            }
            Lexeme::Name(name) if self.peek().0 == Lexeme::Sign('(') => self.call(name, at)?,
            Lexeme::Name(name) => self.name(name, at),
            Lexeme::Points(text) => self.points(text, at),
            Lexeme::Sign(_) | Lexeme::End => return Err(missing_operand(lexeme, at)),
        }
        // Two operands side by side: products are never implied.
        let (next, next_at) = self.peek();
        match next {
            // What follows so many faults says nothing new.
            _ if self.faults.len() > FAULT_LIMIT => Err(Diagnostic::new("there are more faults")),
            Lexeme::Number(_) | Lexeme::Name(_) | Lexeme::Points(_) | Lexeme::Sign('(') => {
                let fault = Diagnostic::new("an operator is missing")
                    .at(next_at, "follows an operand directly");
                Err(fault.cure("write products with `*`, as in `2*x`"))
            }
            Lexeme::Sign(_) | Lexeme::End => Ok(()),
        }
    }

    /// Reads the `)` that closes the `(` at `opening`.
    fn closing(&mut self, opening: Span) -> Result<(), Diagnostic> {
        match self.advance() {
            (Lexeme::Sign(')'), _) => Ok(()),
            (Lexeme::End, at) => Err(Diagnostic::new("a parenthesis is not closed")
                .at(opening, "opens here")
                .at(at, "`)` is missing")),
            (lexeme, at) => Err(unexpected(lexeme, at)),
        }
    }

    /// Reads the arguments of the function `name`.
    fn call(&mut self, name: &str, at: Span) -> Result<(), Diagnostic> {
        let (_, opening) = self.advance();
        let mut count = 0;
        if self.peek().0 == Lexeme::Sign(')') {
            self.advance();
        } else {
            loop {
                self.operand_and_operators(0)?;
                count += 1;
                if self.peek().0 != Lexeme::Sign(',') {
                    break;
                }
                self.advance();
            }
            self.closing(opening)?;
        }
        let Some(function) = Function::named(name) else {
            self.faults.push(self.unknown_function(name, at));
            self.stand_in(count);
            return Ok(());
        };
        let (least, most) = function.arity();
        if (least..=most).contains(&count) {
            self.terms.push(Term::Call(function, count));
        } else {
            let (word, plural) = if most > least {
                ("at least ", "s")
            } else {
                ("", if least == 1 { "" } else { "s" })
            };
            let message = format!("`{name}` takes {word}{least} argument{plural}");
            self.faults.push(Diagnostic::new(message).at(at, format!("has {count}")));
            self.stand_in(count);
        }
        Ok(())
    }

    /// Puts one operand in the place of the last `count`, to go on after a fault.
    ///
    /// The terms are then no equation; the faults keep them from being used.
    fn stand_in(&mut self, count: usize) {
        self.terms.truncate(self.terms.len().saturating_sub(count));
        self.terms.push(Term::Number(0.0));
    }

    /// Reads the name of a value.
    fn name(&mut self, name: &str, at: Span) {
        let term = match (names::coordinate(name), self.scope.coordinates) {
            (Some(axis), Coordinates::Known) => Term::Coordinate(axis),
            (Some(_), Coordinates::Forbidden(what)) => {
                let fault = Diagnostic::new(format!("{what} can't depend on `{name}`"))
                    .at(at, "is a coordinate of the point");
                self.faults.push(fault.cure("give a number, or an equation of numbers"));
                Term::Number(0.0)
            }
            (None, _) => {
                if let Some(index) = CONSTANTS.iter().position(|(known, _)| *known == name) {
                    Term::Constant(index)
                } else if self.scope.parameters.iter().any(|(known, _)| known == name) {
                    Term::Parameter(name.to_owned())
                } else {
                    self.faults.push(self.unknown_name(name, at));
                    Term::Number(0.0)
                }
            }
        };
        self.terms.push(term);
    }

    /// Reads numbers at points of a file.
    fn points(&mut self, text: &str, at: Span) {
        if let Coordinates::Forbidden(what) = self.scope.coordinates {
            let fault = Diagnostic::new(format!("{what} can't depend on `[{text}]`"))
                .at(at, "varies in space");
            self.faults.push(fault.cure("give a number, or an equation of numbers"));
        }
        self.terms.push(Term::Points(text.to_owned()));
    }

    fn unknown_name(&self, name: &str, at: Span) -> Diagnostic {
        if Function::named(name).is_some() {
            return Diagnostic::new(format!("the function `{name}` lacks its arguments"))
                .at(at, "is a function")
                .cure(format!("write `{name}(...)`"));
        }
        let fault = Diagnostic::new(format!("unknown name `{name}`")).at(at, "");
        let parameters = self.scope.parameters.iter().map(|(known, _)| known.as_str());
        let near = names::nearest(name, names::reserved().chain(parameters));
        let parameter = format!("or give a parameter its value: `--param {name}=...`");
        match names::suggestion(&near) {
            Some(cure) => fault.cure(format!("{cure} {parameter}")),
            None if name.len() <= 3 && name.chars().all(|c| "xyz".contains(c)) => {
                let product: Vec<_> = name.chars().map(String::from).collect();
                fault.cure(format!("write products with `*`: `{}`", product.join("*")))
            }
            None => {
                fault.cure(format!("equations know x, y, z, pi, tau, e and functions; {parameter}"))
            }
        }
    }

    fn unknown_function(&self, name: &str, at: Span) -> Diagnostic {
        let is_value = names::reserved().any(|known| known == name)
            || self.scope.parameters.iter().any(|(known, _)| known == name);
        if is_value {
            return Diagnostic::new(format!("`{name}` is not a function"))
                .at(at, "")
                .cure(format!("write products with `*`, as in `{name}*(...)`"));
        }
        let fault = Diagnostic::new(format!("unknown function `{name}`")).at(at, "");
        let near = names::nearest(name, Function::all().map(Function::name));
        match names::suggestion(&near) {
            Some(cure) => fault.cure(cure),
            None => {
                let all: Vec<_> = Function::all().map(Function::name).collect();
                fault.cure(format!("the functions are {}", all.join(", ")))
            }
        }
    }
}

/// The fault of an operand that is not there.
fn missing_operand(lexeme: Lexeme<'_>, at: Span) -> Diagnostic {
    let fault = Diagnostic::new("a number, name or `(` is missing");
    match lexeme {
        Lexeme::End => fault.at(at, "the equation ends here"),
        Lexeme::Sign('+') => fault.at(at, "has no left side").cure("leave out the `+`"),
        Lexeme::Number(_) | Lexeme::Name(_) | Lexeme::Points(_) | Lexeme::Sign(_) => {
            fault.at(at, "has nothing to work on")
        }
    }
}

/// The fault of a sign that nothing here calls for.
fn unexpected(lexeme: Lexeme<'_>, at: Span) -> Diagnostic {
    match lexeme {
        Lexeme::Sign(')') => {
            Diagnostic::new("a parenthesis is closed but not opened").at(at, "closes nothing")
        }
        Lexeme::Sign(',') => Diagnostic::new("a comma stands outside a call").at(at, ""),
        Lexeme::Number(_) | Lexeme::Name(_) | Lexeme::Points(_) | Lexeme::Sign(_) | Lexeme::End => {
            Diagnostic::new("an operator is missing").at(at, "is not expected here")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::Graph;

    const SCOPE: Scope<'_> = Scope { coordinates: Coordinates::Known, parameters: &[] };

    fn read(text: &str) -> Result<Equation, Vec<Diagnostic>> {
        let end = u32::try_from(text.len()).unwrap();
        equation(text, Span { source: 0, start: 0, end }, SCOPE)
    }

    /// The equation of numbers `text` has the value `expected`, exactly.
    fn check(text: &str, expected: f64) {
        let mut graph = Graph::new();
        let equation = read(text).unwrap_or_else(|faults| panic!("{text}: {faults:?}"));
        let node = equation.expression(&mut graph, &mut |_, leaf| panic!("{leaf:?}"));
        assert_eq!(graph.as_constant(node), Some(expected), "{text}");
    }

    #[test]
    fn operators_bind_as_in_mathematics() {
        check("1+2*3", 7.0);
        check("(1+2)*3", 9.0);
        check("8-4-2", 2.0);
        check("8-(4-2)", 6.0);
        check("16/4/2", 2.0);
        check("16/(4/2)", 8.0);
        check("2*3^2", 18.0);
        check("2^3^2", 512.0);
        check("(2^3)^2", 64.0);
        check("2**3**2", 512.0);
        check("-2^2", -4.0);
        check("(-2)^2", 4.0);
        check("2^-1", 0.5);
        check("2^-1^2", 0.5);
        check("2^-2*3", 0.75);
        check("--3", 3.0);
        check("3--2", 5.0);
        check("3*-2", -6.0);
        check("-3*-2", 6.0);
        check("6/-2+1", -2.0);
        check("1e3+1E-1", 1000.1);
    }

    #[test]
    fn every_function_is_called_by_its_name() {
        check("sin(0)+cos(0)+tan(0)", 1.0);
        check("asin(0)+acos(1)+atan(0)+atan2(0,1)", 0.0);
        check("sinh(0)+cosh(0)+tanh(0)", 1.0);
        check("exp(0)+log(1)+log10(1)", 1.0);
        check("sqrt(9)+cbrt(8)", 5.0);
        check("abs(-3)+sign(-2)", 2.0);
        check("floor(1.5)+ceil(1.5)+round(2.5)", 5.0);
        check("mod(-1,3)", 2.0);
        check("pow(2,10)", 1024.0);
        check("hypot(3,4)", 5.0);
        check("min(3,2)+max(3,2)", 5.0);
        check("min(3,2,1,4)", 1.0);
        check("max(1,4,2)", 4.0);
        check("clamp(5,0,1)+clamp(-5,0,1)+clamp(0.5,0,1)", 1.5);
        check("tau/pi", 2.0);
        check("e", std::f64::consts::E);
        for function in Function::all() {
            let arguments = vec!["1"; function.arity().0].join(",");
            assert!(read(&format!("{}({arguments})", function.name())).is_ok());
        }
    }

    #[test]
    fn nesting_beyond_the_limit_is_a_fault() {
        let many = 100_000;
        let check = |text: String| {
            let faults = read(&text).unwrap_err();
            assert_eq!(faults[0].message, "the equation is nested more than 256 deep");
        };
        check(format!("{}x{}", "(".repeat(many), ")".repeat(many)));
        check(format!("{}x", "-".repeat(many)));
        check(format!("{}x", "2^".repeat(many)));
        check(format!("{}x{}", "sin(".repeat(many), ")".repeat(many)));
        check("(".repeat(many));
    }

    #[test]
    fn chains_may_be_long() {
        let text = format!("0{}", "+1".repeat(100_000));
        check(&text, 100_000.0);
        assert_eq!(read(&text).unwrap().to_string(), text);
    }

    #[test]
    fn faults_go_on_after_unknown_names_and_are_few() {
        assert_eq!(read("a+b*c(1)").unwrap_err().len(), 3);
        assert_eq!(read(&format!("a{}", "+a".repeat(1000))).unwrap_err().len(), FAULT_LIMIT);
    }

    #[test]
    fn coordinates_can_be_forbidden() {
        let scope = Scope { coordinates: Coordinates::Forbidden("the size"), parameters: &[] };
        let faults = list("1,x", Span::NOWHERE, scope).unwrap_err();
        assert_eq!(faults[0].message, "the size can't depend on `x`");
        assert_eq!(list("1,2*pi", Span::NOWHERE, scope).unwrap().len(), 2);
    }
}
