//! Tests that every operation encloses what its scalar counterpart computes.

use super::Interval;
use crate::num::elementary;

/// A seeded source of numbers (splitmix64).
struct Source(u64);

impl Source {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound as u64) as usize
    }

    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / 2f64.powi(53)
    }

    /// A number of the kinds that ends of intervals have in practice and in nightmares.
    fn number(&mut self) -> f64 {
        const SPECIAL: [f64; 24] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            -0.5,
            2.0,
            -2.0,
            3.0,
            -3.0,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            -f64::MIN_POSITIVE,
            5e-324,
            -5e-324,
            1e300,
            -1e300,
            1e-300,
            709.782_712_893_384,
            -745.133_219_101_941_1,
            1_048_576.0,
        ];
        match self.below(8) {
            0 => SPECIAL[self.below(SPECIAL.len())],
            1 => (self.unit() * 16.0 - 8.0).round() * 0.25,
            2 => (self.unit() * 40.0 - 20.0).round() * std::f64::consts::FRAC_PI_2,
            3 => 10f64.powf(self.unit() * 40.0 - 20.0) * (self.unit() - 0.5),
            4 => f64::from_bits(self.bits()),
            _ => self.unit() * 8.0 - 4.0,
        }
    }

    /// An interval: narrow, wide, a point, or with ends of any kind.
    fn interval(&mut self) -> Interval {
        loop {
            let a = self.number();
            let b = match self.below(5) {
                0 => a,
                1 => a.next_up().next_up(),
                2 => a + a.abs() * 1e-6 * self.unit(),
                3 => a + self.unit() * 3.0,
                _ => self.number(),
            };
            if !(a.is_nan() || b.is_nan()) {
                return Interval::new(a.min(b), a.max(b));
            }
        }
    }

    /// Numbers in `interval`: its ends, their neighbours, corners of functions, and some between.
    fn inside(&mut self, interval: Interval) -> Vec<f64> {
        let Interval { lo, hi, .. } = interval;
        let mut list = vec![lo, hi, lo.next_up(), hi.next_down(), 0.0, -0.0, 1.0, -1.0];
        for _ in 0..4 {
            let t = self.unit();
            let (near, far) = (lo.max(-1e308), hi.min(1e308));
            let between = near * (1.0 - t) + far * t;
            let quarter = (between / std::f64::consts::FRAC_PI_2).round();
            list.extend([between, between.floor(), quarter * std::f64::consts::FRAC_PI_2]);
            list.push(self.number());
        }
        list.retain(|&a| interval.contains(a));
        list
    }
}

/// Checks `range` against `compute` on random intervals and numbers in them.
fn unary(name: &str, range: fn(Interval) -> Interval, compute: fn(f64) -> f64) {
    let mut source = Source(name.len() as u64);
    for _ in 0..20_000 {
        let a = source.interval();
        let enclosure = range(a);
        assert!(enclosure.lo <= enclosure.hi, "{name} {a:?} is {enclosure:?}");
        for x in source.inside(a) {
            let value = compute(x);
            assert!(enclosure.contains(value), "{name}({x}) = {value}: {a:?} gave {enclosure:?}");
        }
        assert!(range(a.or_nan(true)).contains(compute(f64::NAN)), "{name} loses NaN of {a:?}");
    }
}

/// Checks `range` against `compute` on random pairs of intervals and numbers in them.
fn binary(name: &str, range: fn(Interval, Interval) -> Interval, compute: fn(f64, f64) -> f64) {
    let mut source = Source(name.len() as u64);
    for _ in 0..10_000 {
        let (a, b) = (source.interval(), source.interval());
        let enclosure = range(a, b);
        assert!(enclosure.lo <= enclosure.hi, "{name} {a:?} {b:?} is {enclosure:?}");
        let (xs, ys) = (source.inside(a), source.inside(b));
        for (&x, &y) in xs.iter().flat_map(|x| ys.iter().map(move |y| (x, y))) {
            let value = compute(x, y);
            assert!(
                enclosure.contains(value),
                "{name}({x}, {y}) = {value}: {a:?} {b:?} gave {enclosure:?}"
            );
        }
        let (x, y) = (xs[0], ys[0]);
        let (left, right) = (range(a.or_nan(true), b), range(a, b.or_nan(true)));
        assert!(left.contains(compute(f64::NAN, y)), "{name}(NaN, {y}): {left:?}");
        assert!(right.contains(compute(x, f64::NAN)), "{name}({x}, NaN): {right:?}");
        assert!(left.contains(compute(x, y)) && right.contains(compute(x, y)));
    }
}

#[test]
fn arithmetic_encloses_what_is_computed() {
    unary("neg", |a| -a, |a| -a);
    unary("abs", Interval::abs, f64::abs);
    unary("square", Interval::square, |a| a * a);
    unary("sqrt", Interval::sqrt, f64::sqrt);
    unary("floor", Interval::floor, f64::floor);
    unary("ceil", Interval::ceil, f64::ceil);
    unary("round", Interval::round, f64::round_ties_even);
    unary("sign", Interval::sign, |a| if a == 0.0 { 0.0 } else { a.signum() });
    binary("add", |a, b| a + b, |a, b| a + b);
    binary("sub", |a, b| a - b, |a, b| a - b);
    binary("mul", |a, b| a * b, |a, b| a * b);
    binary("div", |a, b| a / b, |a, b| a / b);
    binary("min", Interval::min, |a, b| if a < b { a } else { b });
    binary("max", Interval::max, |a, b| if b < a { a } else { b });
    binary("mod", Interval::modulo, |a, b| a - b * (a / b).floor());
}

#[test]
fn waves_enclose_what_is_computed() {
    unary("sin", Interval::sin, elementary::sin);
    unary("cos", Interval::cos, elementary::cos);
    unary("tan", Interval::tan, libm::tan);
}

#[test]
fn exponentials_and_logarithms_enclose_what_is_computed() {
    unary("exp", Interval::exp, elementary::exp);
    unary("log", Interval::log, elementary::log);
    unary("log10", Interval::log10, libm::log10);
    unary("sinh", Interval::sinh, libm::sinh);
    unary("cosh", Interval::cosh, libm::cosh);
    unary("tanh", Interval::tanh, libm::tanh);
}

#[test]
fn roots_and_angles_enclose_what_is_computed() {
    unary("cbrt", Interval::cbrt, libm::cbrt);
    unary("asin", Interval::asin, libm::asin);
    unary("acos", Interval::acos, libm::acos);
    unary("atan", Interval::atan, libm::atan);
    binary("atan2", Interval::atan2, libm::atan2);
    binary("hypot", Interval::hypot, libm::hypot);
}

#[test]
fn powers_enclose_what_is_computed() {
    binary("pow", Interval::pow, libm::pow);
    unary("cube", |a| a.pow(Interval::point(3.0)), |a| libm::pow(a, 3.0));
    unary("fourth power", |a| a.pow(Interval::point(4.0)), |a| libm::pow(a, 4.0));
    unary("inverse", |a| a.pow(Interval::point(-1.0)), |a| libm::pow(a, -1.0));
    unary("inverse square", |a| a.pow(Interval::point(-2.0)), |a| libm::pow(a, -2.0));
    unary("broken power", |a| a.pow(Interval::point(1.5)), |a| libm::pow(a, 1.5));
    unary("root of inverse", |a| a.pow(Interval::point(-0.5)), |a| libm::pow(a, -0.5));
}

#[test]
fn powers_of_either_zero_are_enclosed() {
    for lo in [0.0, -0.0] {
        let range = Interval { lo, hi: 0.75, nan: false }.pow(Interval::new(-1.0, 0.5));
        for base in [0.0, -0.0] {
            assert!([-1.0, -0.9, 0.5].iter().all(|&n| range.contains(libm::pow(base, n))));
        }
    }
}

#[test]
fn a_choice_encloses_what_is_chosen() {
    let mut source = Source(5);
    for _ in 0..20_000 {
        let [a, b, c, d] = [(); 4].map(|()| source.interval());
        let [a, b] = [a, b].map(|i| i.or_nan(source.below(8) == 0));
        let enclosure = a.pick_below(b, c, d);
        let (mut xs, mut ys) = (source.inside(a), source.inside(b));
        xs.extend(a.nan.then_some(f64::NAN));
        ys.extend(b.nan.then_some(f64::NAN));
        for (x, y) in xs.iter().flat_map(|x| ys.iter().map(move |y| (x, y))) {
            let first = x < y;
            let side = if first { c } else { d };
            assert!(enclosure.lo <= side.lo && side.hi <= enclosure.hi);
            assert!(first || !a.always_below(b), "{x} is not below {y}");
            assert!(!first || !a.never_below(b), "{x} is below {y}");
        }
    }
}

#[track_caller]
fn check(range: Interval, lo: f64, hi: f64, nan: bool) {
    // A few units in the last place are the price of elementary functions.
    let near = |a: f64, b: f64| a == b || (a - b).abs() <= 4e-15 * b.abs();
    let close = near(range.lo, lo) && near(range.hi, hi) && range.nan == nan;
    assert!(close, "{range:?} is not [{lo}, {hi}], nan: {nan}");
}

#[test]
fn ranges_are_no_wider_than_they_must_be() {
    let of = Interval::new;
    let inf = f64::INFINITY;
    check(of(-2.0, 1.0).square(), 0.0, 4.0, false);
    check(of(-2.0, 1.0).abs(), 0.0, 2.0, false);
    check(of(-2.0, 3.0) * of(-1.0, 4.0), -8.0, 12.0, false);
    check(of(1.0, 2.0) / of(4.0, 8.0), 0.125, 0.5, false);
    check(of(1.0, 2.0) / of(0.0, 8.0), -inf, inf, false);
    check(of(-4.0, 9.0).sqrt(), 0.0, 3.0, true);
    check(of(0.0, 1.0).sin(), 0.0, 1f64.sin(), false);
    check(of(0.5, 2.0).sin(), 0.5f64.sin(), 1.0, false);
    check(of(2.0, 4.0).cos(), -1.0, 2f64.cos(), false);
    check(of(3.5, 4.0).sin(), 4f64.sin(), 3.5f64.sin(), false);
    check(of(1000.0, 1000.25).cos(), 1000.25f64.cos(), 1000f64.cos(), false);
    check(of(-0.5, 1.0).tan(), (-0.5f64).tan(), 1f64.tan(), false);
    check(of(1.0, 2.0).tan(), -inf, inf, false);
    check(of(0.0, 1.0).exp(), 1.0, std::f64::consts::E, false);
    check(of(-1.0, 1.0).log(), -inf, 0.0, true);
    check(of(-3.0, 2.0).pow(Interval::point(2.0)), 0.0, 9.0, false);
    check(of(-3.0, 2.0).pow(Interval::point(3.0)), -27.0, 8.0, false);
    check(of(-3.0, 4.0).pow(Interval::point(0.5)), 0.0, 2.0, true);
    check(of(2.0, 3.0).pow(of(-1.0, 2.0)), 1.0 / 3.0, 9.0, false);
    check(of(1.25, 1.5).modulo(Interval::point(1.0)), 0.25, 0.5, false);
    check(of(-1.25, -1.125).modulo(Interval::point(0.5)), 0.25, 0.375, false);
    check(of(1.0, 2.0).atan2(of(-1.0, 1.0)), 1f64.atan2(1.0), 1f64.atan2(-1.0), false);
    check(of(-3.0, 1.0).hypot(of(4.0, 4.0)), 4.0, 5.0, false);
    check(of(1.0, 2.0).min(of(3.0, 4.0).or_nan(true)), 1.0, 2.0, true);
    check(of(1.0, 2.0).or_nan(true).min(of(3.0, 4.0)), 1.0, 4.0, false);
    let periods = of(-10.0, 10.0).modulo(Interval::point(3.0));
    assert!(periods.lo > -1e-13 && periods.hi < 3.0 + 1e-13, "{periods:?}");
}

#[test]
fn a_function_that_is_nowhere_defined_is_outside() {
    for range in [
        Interval::new(-2.0, -1.0).sqrt(),
        Interval::new(-2.0, -1.0).log(),
        Interval::new(2.0, 3.0).asin(),
    ] {
        assert!(range.is_outside() && !range.is_inside() && range.nan);
    }
}
