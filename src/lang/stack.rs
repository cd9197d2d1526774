//! Reads words as items: which word is what, and which arguments it takes.
//!
//! A word is looked for in the vocabulary, then taken for a mesh or lattice file if it is named like
//! one, then read as an equation. A word of the vocabulary thus hides a file of its name, and a missing mesh
//! file is never mistaken for an equation.
//!
//! Operations are followed by the values of their arguments: those that they require with or without
//! their names before them, the others by name. Shapes are followed by named values only. A name binds
//! to the word before it, even if it is a word of the vocabulary too, as `density` is after `fill`.
//! Reading goes on after a fault, to report several at once.
//!
//! Source: the Cesogen paper, section 3.2, which speaks of pairs of names and values but prints
//! values alone; we take both.

use super::infix::{self, Coordinates, Scope};
use super::names;
use super::syntax::{Content, Equation, Item, Located, Operation, Term, Value};
use super::word::{Shape, normalized};
use super::words::Token;
use super::{Action, Argument, Diagnostic, Label, Loader, Span, Vocabulary, Word};

/// Faults that are told at once, about; reading ends there.
const FAULT_LIMIT: usize = 20;

/// The items of a program.
///
/// # Errors
/// At least one diagnostic, in the order of the text.
pub fn read(
    words: &[Token],
    vocabulary: &dyn Vocabulary,
    loader: &dyn Loader,
    parameters: &[(String, f64)],
) -> Result<Vec<Item>, Vec<Diagnostic>> {
    let mut reader = Reader {
        words,
        next: 0,
        vocabulary,
        loader,
        parameters,
        last: None,
        takers: Vec::new(),
        faults: Vec::new(),
    };
    let mut items = Vec::new();
    let mut sound = true;
    while let Some(word) = reader.advance() {
        let item = reader.item(word, sound);
        sound = item.is_some();
        items.extend(item);
        if reader.faults.len() >= FAULT_LIMIT {
            break;
        }
    }
    if reader.faults.is_empty() { Ok(items) } else { Err(reader.faults) }
}

/// The state of reading one program.
struct Reader<'a> {
    words: &'a [Token],
    next: usize,
    vocabulary: &'a dyn Vocabulary,
    loader: &'a dyn Loader,
    parameters: &'a [(String, f64)],
    /// The word of the vocabulary before, for advice on what follows it.
    last: Option<Word<'a>>,
    /// The words before that take arguments.
    takers: Vec<Taker<'a>>,
    faults: Vec<Diagnostic>,
}

/// A word that takes arguments, and where they ended.
struct Taker<'a> {
    word: Word<'a>,
    span: Span,
    /// The number of the first word after them.
    end: usize,
}

impl<'a> Reader<'a> {
    fn peek(&self) -> Option<&'a Token> {
        self.words.get(self.next)
    }

    fn advance(&mut self) -> Option<&'a Token> {
        let word = self.peek()?;
        self.next += 1;
        Some(word)
    }

    /// The item that begins with `token`, or a fault; `sound` says that the item before had none.
    fn item(&mut self, token: &'a Token, sound: bool) -> Option<Item> {
        if let Some(word) = self.known(token) {
            let (values, end) = self.taken(word, token)?;
            let operation = Operation::Word { name: word.name.to_owned(), values };
            return Some(Item { operation, span: token.span.to(end) });
        }
        if self.loader.is_mesh(&token.text) {
            self.last = None;
            return Some(Item { operation: Operation::Mesh(token.text.clone()), span: token.span });
        }
        if self.loader.is_lattice(&token.text) {
            let word = Word::of_file(&token.text, self.vocabulary.lattice_arguments());
            let (values, end) = self.taken(word, token)?;
            let operation = Operation::Lattice { path: token.text.clone(), values };
            return Some(Item { operation, span: token.span.to(end) });
        }
        let equation = self.equation(token, sound)?;
        self.last = None;
        Some(Item { operation: Operation::Equation(equation), span: token.span })
    }

    fn known(&self, token: &Token) -> Option<Word<'a>> {
        self.vocabulary.word(&normalized(&token.text))
    }

    /// The values after `word`, as [`values`](Self::values) reads them; notes where they end.
    fn taken(&mut self, word: Word<'a>, token: &Token) -> Option<(Vec<Option<Value>>, Span)> {
        self.last = Some(word);
        let values = self.values(word, token);
        self.takers.push(Taker { word, span: token.span, end: self.next });
        values
    }

    /// The values after `word`, which stands at `token`, and the place of the last.
    fn values(&mut self, word: Word<'a>, token: &Token) -> Option<(Vec<Option<Value>>, Span)> {
        let mut values: Vec<Option<Value>> = word.arguments.iter().map(|_| None).collect();
        let (mut end, mut sound) = (token.span, true);
        while let Some(next) = self.peek() {
            let spelling = normalized(&next.text);
            let named = word.arguments.iter().position(|argument| argument.name == spelling);
            // A name given before may be meant as the word that it also is.
            let is_word = || self.vocabulary.word(&spelling).is_some();
            let named = named.filter(|index| values[*index].is_none() || !is_word());
            let positional = match word.action {
                Action::Motion(_) | Action::Unary(_) | Action::Binary(_) => word
                    .arguments
                    .iter()
                    .zip(&values)
                    .position(|(argument, value)| argument.is_required() && value.is_none()),
                Action::Shape(_) => None,
            };
            let index = match (named, positional) {
                (Some(index), _) => {
                    self.advance();
                    if values[index].is_some() {
                        let message = format!("the `{spelling}` of `{}` is given twice", word.name);
                        self.faults.push(Diagnostic::new(message).at(next.span, "again"));
                        sound = false;
                    }
                    index
                }
                (None, Some(index)) => index,
                (None, None) => break,
            };
            let argument = &word.arguments[index];
            let Some(value) = self.peek().filter(|value| self.what_is(value).is_none()) else {
                self.lacks(word, argument, token);
                return None;
            };
            self.advance();
            end = value.span;
            let value = self.value(word, argument, value);
            sound &= value.is_some();
            // A faulty value holds its place, so that the next is not taken for it.
            values[index] = Some(value.unwrap_or_else(|| Value {
                content: Content::Numbers(Vec::new()),
                span: Located(end),
            }));
        }
        for (argument, value) in word.arguments.iter().zip(&values) {
            if value.is_none() && argument.is_required() {
                self.lacks(word, argument, token);
                return None;
            }
        }
        sound.then_some((values, end))
    }

    /// What `token` is, if it is no number: for the fault of a missing argument.
    fn what_is(&self, token: &Token) -> Option<&'static str> {
        match self.known(token).map(|word| word.action) {
            Some(Action::Shape(_)) => Some("is a shape"),
            Some(Action::Motion(_) | Action::Unary(_) | Action::Binary(_)) => {
                Some("is an operation")
            }
            None if self.loader.is_mesh(&token.text) => Some("is a mesh file"),
            None if self.loader.is_lattice(&token.text) => Some("is a lattice file"),
            None => None,
        }
    }

    /// Reports that `word`, at `token`, lacks `argument`.
    fn lacks(&mut self, word: Word<'_>, argument: &Argument, token: &Token) {
        let message = format!("`{}` lacks its `{}`", word.name, argument.name);
        let mut fault = Diagnostic::new(message).at(token.span, "");
        if let Some(next) = self.peek() {
            fault.labels.extend(
                self.what_is(next).map(|what| Label { span: next.span, text: what.to_owned() }),
            );
        }
        let example = match argument.shape {
            Shape::Number if matches!(word.action, Action::Shape(_)) => {
                "a number or an equation of numbers".to_owned()
            }
            Shape::Number => "a number, or an equation in x, y and z".to_owned(),
            Shape::Vector => "three numbers in one word, such as `0,0,1`".to_owned(),
            Shape::Factor => "one number, or three in one word, such as `1,1,2`".to_owned(),
            Shape::Choice(words) => words.join(" or "),
        };
        self.faults.push(fault.cure(format!("give the {}: {example}", argument.meaning)));
    }

    /// The value of `argument` of `word` that `token` says, or faults.
    fn value(&mut self, word: Word<'_>, argument: &Argument, token: &Token) -> Option<Value> {
        let what = format!("the `{}` of `{}`", argument.name, word.name);
        if let Shape::Choice(words) = argument.shape {
            return self.choice(&what, words, token);
        }
        let coordinates = match word.action {
            Action::Shape(_) => Coordinates::Forbidden(&what),
            Action::Motion(_) | Action::Unary(_) | Action::Binary(_) => Coordinates::Known,
        };
        let scope = Scope { coordinates, parameters: self.parameters };
        let components = match infix::list(&token.text, token.span, scope) {
            Ok(components) => components,
            Err(mut faults) => {
                if token.text.ends_with(',') || token.text.starts_with(',') {
                    for fault in &mut faults {
                        fault.cure = Some("write a vector as one word, without blanks".to_owned());
                    }
                }
                self.faults.append(&mut faults);
                return None;
            }
        };
        let has_parameter = components.iter().flat_map(Equation::terms);
        let has_parameter =
            has_parameter.into_iter().any(|term| matches!(term, Term::Parameter(_)));
        if has_parameter && !argument.domain.takes_parameters() {
            let fault = Diagnostic::new(format!("{what} can't depend on a parameter"));
            self.faults.push(fault.at(token.span, "does").cure("write a number"));
            return None;
        }
        let (fits, needed, cure) = match argument.shape {
            Shape::Number => (components.len() == 1, "one number", None),
            Shape::Vector => (components.len() == 3, "three components", Some("0,0,1")),
            Shape::Factor => (matches!(components.len(), 1 | 3), "one or three numbers", None),
            Shape::Choice(_) => (false, "a word", None),
        };
        if !fits {
            let fault = Diagnostic::new(format!("{what} needs {needed}"))
                .at(token.span, format!("has {}", components.len()));
            self.faults.push(match cure {
                Some(example) => {
                    fault.cure(format!("write them in one word with commas, as in `{example}`"))
                }
                None => fault,
            });
            return None;
        }
        Some(Value { content: Content::Numbers(components), span: Located(token.span) })
    }

    /// Which of `words` `token` says, or a fault; `what` names the argument.
    fn choice(&mut self, what: &str, words: &[&'static str], token: &Token) -> Option<Value> {
        let spelling = normalized(&token.text);
        let Some(place) = words.iter().position(|word| *word == spelling) else {
            let list: Vec<_> = words.iter().map(|word| format!("`{word}`")).collect();
            let fault = Diagnostic::new(format!("{what} is one of {}", list.join(", ")));
            self.faults.push(fault.at(token.span, "is none of them"));
            return None;
        };
        Some(Value { content: Content::Choice(words[place], place), span: Located(token.span) })
    }

    /// The equation in x, y and z that `token` says, or faults.
    ///
    /// Where the item before was faulty, stray numbers are taken for its consequence: no faults.
    fn equation(&mut self, token: &Token, sound: bool) -> Option<Equation> {
        let scope = Scope { coordinates: Coordinates::Known, parameters: self.parameters };
        let fault = |message: String| Diagnostic::new(message).at(token.span, "");
        match infix::list(&token.text, token.span, scope) {
            Ok(mut list) if list.len() == 1 => {
                let equation = list.pop()?;
                if equation.has_coordinate() {
                    return Some(equation);
                }
                let message = format!("`{}` is a number where a shape is expected", token.text);
                self.faults.extend(sound.then(|| fault(message).cure(self.advice_on_numbers())));
            }
            Ok(_) => {
                let message = format!("`{}` is a list where a shape is expected", token.text);
                self.faults.extend(sound.then(|| fault(message).cure(self.advice_on_numbers())));
            }
            Err(_) if !sound && is_numeric(&token.text) => {}
            Err(faults) => {
                if let Some(fault) = self.late_argument(token) {
                    self.faults.push(fault);
                    // Its value is no shape either.
                    if self.peek().is_some_and(|value| self.what_is(value).is_none()) {
                        self.advance();
                    }
                } else if let Some(fault) = self.unknown_word(token) {
                    self.faults.push(fault);
                } else {
                    self.faults.extend(faults);
                }
            }
        }
        None
    }

    /// What to do about a number that follows the word before.
    fn advice_on_numbers(&self) -> String {
        match self.last {
            Some(Word { name, arguments, action: Action::Shape(_) }) if !arguments.is_empty() => {
                let names: Vec<_> = arguments.iter().map(|a| format!("`{}`", a.name)).collect();
                format!("name the argument: `{name}` takes {}", names.join(", "))
            }
            Some(Word { name, action: Action::Shape(_), .. }) => {
                format!("`{name}` takes no numbers: follow it by `scale` or `translate`")
            }
            Some(Word { name, arguments: [.., last], .. }) if last.shape != Shape::Number => {
                format!("write a vector as one word with commas, as in `{name} 1,1,2`")
            }
            _ => "the equation of a shape depends on x, y or z".to_owned(),
        }
    }

    /// The fault of `token`, the name of an argument of a word before; `None` if it is none.
    fn late_argument(&self, token: &Token) -> Option<Diagnostic> {
        let name = normalized(&token.text);
        let takes = |taker: &&Taker<'_>| taker.word.arguments.iter().any(|a| a.name == name);
        let Taker { word, span, end } = self.takers.iter().rev().find(takes)?;
        let message =
            format!("`{name}` is an argument of `{}`, which it has to follow directly", word.name);
        let mut fault = Diagnostic::new(message).at(token.span, "comes too late");
        if let Some(breaking) = self.words.get(*end).filter(|other| other.span != token.span) {
            let text = format!("ends the arguments of `{}`", word.name);
            fault.labels.push(Label { span: breaking.span, text });
        }
        fault.labels.push(Label { span: *span, text: "takes it".to_owned() });
        let cure = format!("write `{name}` and its value among the arguments of `{}`", word.name);
        Some(fault.cure(cure))
    }

    /// The fault of a word that was meant as a word, not as an equation; `None` if it was not.
    fn unknown_word(&self, token: &Token) -> Option<Diagnostic> {
        let text = token.text.as_str();
        let fault = |message: String| Diagnostic::new(message).at(token.span, "");
        if let Some(option) = text.strip_prefix('-') {
            let letters = option.strip_prefix('-').unwrap_or(option);
            let is_option = (text.starts_with("--") || letters.len() == 1)
                && letters.starts_with(|c: char| c.is_ascii_alphabetic());
            return is_option.then(|| {
                fault(format!("`{text}` is read as an equation, not as an option"))
                    .cure("write options before the first shape")
            });
        }
        if names::reserved().any(|name| name == text) {
            return None;
        }
        let is_identifier = text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let is_word = text.starts_with(|c: char| c.is_ascii_alphabetic())
            && text.chars().all(|c| c.is_ascii_alphanumeric() || "_-'".contains(c));
        if is_word {
            let near = names::nearest(text, self.names(is_identifier));
            if let Some(cure) = names::suggestion(&near) {
                return Some(fault(format!("unknown word `{text}`")).cure(cure));
            }
        }
        if let Some((_, extension)) = text.rsplit_once('.').filter(|_| !text.contains('[')) {
            let is_extension = extension.starts_with(|c: char| c.is_ascii_alphabetic())
                && extension.chars().all(|c| c.is_ascii_alphanumeric());
            if is_extension {
                let message = format!("`{text}` is not a shape, an equation or a mesh file");
                return Some(fault(message).cure(format!("no mesh format ends in `.{extension}`")));
            }
        }
        let is_equation = text.split('-').any(|part| names::reserved().any(|name| name == part))
            || text.chars().all(|c| "xyz".contains(c));
        (is_word && !is_equation).then(|| {
            fault(format!("unknown word `{text}`")).cure(
                "it is not a shape, an operation, a mesh file or an equation; \
                 `alveole list` shows every word",
            )
        })
    }

    /// What a word could have been meant for; `all` includes the names that equations know.
    fn names(&self, all: bool) -> Vec<&str> {
        let mut known = self.vocabulary.spellings();
        if let Some(last) = self.last {
            known.extend(last.arguments.iter().map(|argument| argument.name));
        }
        if all {
            known.extend(names::reserved());
            known.extend(self.parameters.iter().map(|(name, _)| name.as_str()));
        }
        known
    }
}

/// Whether `text` begins like a number or a list of numbers.
fn is_numeric(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c))
}
