//! Printing a program and reading it again gives the same program.

use crate::support::{Files, Random, value};
use alveole::lang::{self, Item, Program};
use alveole::vocabulary::Words;

fn read(words: &[String]) -> Program {
    let parameters = [("t".to_owned(), 0.5), ("radius_2".to_owned(), 1.25)];
    lang::parse(words, &Words, &mut Files, &parameters)
        .unwrap_or_else(|fault| panic!("{words:?}: {:?}", fault.diagnostics))
}

/// The program prints as `expected`, and that reads as the same items.
fn check(words: &[&str], expected: &[&str]) {
    let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
    let items: Vec<Item> = read(&words).items;
    let printed = lang::format(&items, &Words);
    assert_eq!(printed, expected);
    assert_eq!(read(&printed).items, items);
}

#[test]
fn programs_print_in_their_plainest_form() {
    check(&["BOX", "Split_P", "g'"], &["box", "split-p", "g-prime"]);
    check(
        &["box", "rotate", "axis", "0, 0, 1", "angle", "pi / 2"],
        &["box", "rotate", "pi/2", "0,0,1"],
    );
    check(
        &["torus", "minor", "0.10", "mesh.PLY", "union"],
        &["torus", "minor", "0.1", "mesh.PLY", "union"],
    );
    check(
        &["lattice.cell", "fillet", "0.0", "radius", "t / 2", "box"],
        &["lattice.cell", "radius", "t/2", "fillet", "0", "box"],
    );
    check(&["@quoted"], &["x+y", "z-1", "g-prime", "intersection"]);
    check(&["sphere", "scale", "2.0"], &["sphere", "scale", "2"]);
}

#[test]
fn equations_print_with_the_parentheses_they_need() {
    let check = |text: &str, expected: &str| check(&[text], &[expected]);
    check("((x))", "x");
    check("(x+y)+z", "x+y+z");
    check("x+(y+z)", "x+(y+z)");
    check("x-(y-z)", "x-(y-z)");
    check("x*(y/z)", "x*(y/z)");
    check("(x*y)/z", "x*y/z");
    check("(x+y)*z", "(x+y)*z");
    check("x^(y^z)", "x^y^z");
    check("(x^y)^z", "(x^y)^z");
    check("-(x^2)", "-x^2");
    check("(-x)^2", "(-x)^2");
    check("2^(-x)", "2^-x");
    check("(2^-x)^y", "(2^-x)^y");
    check("2^-x*y", "2^-x*y");
    check("2^(-(x*y))", "2^-(x*y)");
    check("-(x*y)", "-(x*y)");
    check("(-x)*y", "-x*y");
    check("x*(-y)", "x*-y");
    check("x-(-y)", "x--y");
    check("-(-x)", "--x");
    check("x ** 2.50", "x^2.5");
    check("min( x,y , 1e-9*z )", "min(x,y,1e-9*z)");
    check("clamp(x,0,1)*tau*t", "clamp(x,0,1)*tau*t");
    check("x*1e300", "x*1e300");
    check("2 * [ points a,b (1.fap ] ^ 2", "2*[points a,b (1.fap]^2");
}

#[test]
fn random_programs_survive_printing() {
    for seed in 0..400 {
        let mut random = Random::new(seed);
        let words = random.program();
        let first = read(&words);
        let printed = lang::format(&first.items, &Words);
        let second = read(&printed);
        assert_eq!(first.items, second.items, "seed {seed}: {words:?} became {printed:?}");
        let at = |program: &Program| value(&program.graph, program.solid.field, [0.3, -0.7, 0.2]);
        assert_eq!(at(&first).to_bits(), at(&second).to_bits(), "seed {seed}");
    }
}

#[test]
fn random_words_never_panic() {
    const PIECES: &[&str] = &[
        "box", "sphere", "scale", "rotate", "union", "torus", "minor", "x", "y", "+", "-", "*",
        "(", ")", ",", "2", "1e", ".", "^", "sin", "'", "\"", "@plain", "@self", "@", "ξ", "\u{0}",
        "mesh.ply", "g'", "q*", " ", "\n", "=", "t", "%", "angle", "pi", "[", "]", "points",
        "other:", "typo",
    ];
    for seed in 0..4000 {
        let mut random = Random::new(seed);
        let words: Vec<String> = (0..random.below(6))
            .map(|_| (0..1 + random.below(4)).map(|_| PIECES[random.below(PIECES.len())]).collect())
            .collect();
        if let Err(rejected) = lang::parse(&words, &Words, &mut Files, &[]) {
            assert!(!rejected.diagnostics.is_empty(), "{words:?}");
            for label in rejected.diagnostics.iter().flat_map(|fault| &fault.labels) {
                let source = rejected.sources.source(label.span).unwrap();
                let range = label.span.start as usize..label.span.end as usize;
                assert!(source.text.get(range).is_some(), "{words:?}");
            }
        }
    }
}
