//! Line charts as SVG: a linear axis to the right, a logarithmic one upwards.
//!
//! Values that are zero, negative or no numbers have no place on a logarithmic axis and are left out.

use std::fmt::Write;

/// Size of the picture, in pixels.
const SIZE: [f64; 2] = [900.0, 520.0];
/// Where the axes are: left, top, right, bottom.
const FRAME: [f64; 4] = [90.0, 64.0, 690.0, 450.0];
/// About how many ticks the axis to the right has.
const TICKS: f64 = 8.0;
/// Most decades that all have their line.
const MOST_DECADES: i32 = 10;
/// Part of a decade by which a value that ends one may be rounded.
const SLACK: f64 = 1e-9;
/// Marks on a line, at most.
const MARKS: usize = 12;

/// A line of a chart.
#[derive(Debug)]
pub(super) struct Series {
    /// What it shows.
    pub(super) name: String,
    /// Its colour, as SVG names them.
    pub(super) colour: &'static str,
    pub(super) mark: Mark,
    /// Its points, from left to right.
    pub(super) points: Vec<[f64; 2]>,
}

/// What marks some of the points of a line.
#[derive(Clone, Copy, Debug)]
pub(super) enum Mark {
    Circle(Fill),
    Triangle(Fill),
}

/// Whether a mark is filled; the line of hollow ones is broken.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fill {
    Filled,
    Hollow,
}

/// What is written about a chart.
#[derive(Debug)]
pub(super) struct Labels {
    pub(super) title: String,
    /// A line below the title.
    pub(super) subtitle: String,
    pub(super) right: &'static str,
    pub(super) up: &'static str,
}

/// The chart as an SVG document.
pub(super) fn svg(labels: &Labels, lines: &[Series]) -> String {
    let [width, height] = SIZE;
    let [left, top, right, bottom] = FRAME;
    let scale = Scale::new(lines);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let mut write = |line: &str| {
        text.push_str(line);
        text.push('\n');
    };
    let Labels { title, subtitle, right: across, up } = labels;
    let (title, subtitle) = (escaped(title), escaped(subtitle));
    write(&format!("<text x=\"{left}\" y=\"28\" font-size=\"17\">{title}</text>"));
    write(&format!("<text x=\"{left}\" y=\"48\" fill=\"#555\">{subtitle}</text>"));
    for decade in scale.decades() {
        let y = scale.y(libm::pow(10.0, f64::from(decade)));
        write(&format!("<path d=\"M{left} {y:.1}H{right}\" stroke=\"#ddd\"/>"));
        let x = left - 8.0;
        write(&format!(
            "<text x=\"{x}\" y=\"{:.1}\" text-anchor=\"end\">1e{decade}</text>",
            y + 4.5
        ));
    }
    for tick in scale.ticks() {
        let x = scale.x(tick);
        write(&format!("<path d=\"M{x:.1} {bottom}v6\" stroke=\"#222\"/>"));
        let y = bottom + 22.0;
        write(&format!("<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{tick}</text>"));
    }
    write(&format!("<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"#222\"/>"));
    let (x, y) = (0.5 * (left + right), bottom + 46.0);
    write(&format!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{}</text>", escaped(across)));
    let y = 0.5 * (top + bottom);
    write(&format!(
        "<text transform=\"translate(24 {y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        escaped(up)
    ));
    for (number, line) in lines.iter().enumerate() {
        write(&drawn(line, &scale));
        let y = top + 14.0 + 26.0 * number as f64;
        let (start, end) = (right + 20.0, right + 60.0);
        write(&stroke(line, &format!("M{start} {y}H{end}")));
        write(&mark(line, [0.5 * (start + end), y]));
        let (x, y) = (end + 10.0, y + 4.5);
        write(&format!("<text x=\"{x}\" y=\"{y}\">{}</text>", escaped(&line.name)));
    }
    text.push_str("</svg>\n");
    text
}

/// From values to places.
struct Scale {
    /// The greatest value on the axis to the right, above zero.
    most: f64,
    /// The first and the last decade upwards.
    decades: [i32; 2],
}

impl Scale {
    fn new(lines: &[Series]) -> Self {
        let points = || lines.iter().flat_map(|line| &line.points).filter(|[_, y]| has_place(*y));
        let most = points().map(|[x, _]| *x).fold(0.0, f64::max);
        let low = points().map(|[_, y]| *y).fold(f64::INFINITY, f64::min);
        let high = points().map(|[_, y]| *y).fold(0.0, f64::max);
        let decades = if high > 0.0 {
            let first = (libm::log10(low) + SLACK).floor() as i32;
            [first, ((libm::log10(high) - SLACK).ceil() as i32).max(first + 1)]
        } else {
            [-1, 0]
        };
        Self { most: if most > 0.0 { most } else { 1.0 }, decades }
    }

    fn x(&self, value: f64) -> f64 {
        let [left, _, right, _] = FRAME;
        left + (right - left) * value / self.most
    }

    fn y(&self, value: f64) -> f64 {
        let [_, top, _, bottom] = FRAME;
        let [first, last] = self.decades.map(f64::from);
        bottom - (bottom - top) * (libm::log10(value) - first) / (last - first)
    }

    /// The decades that have a line.
    fn decades(&self) -> impl Iterator<Item = i32> {
        let [first, last] = self.decades;
        let step = (last - first) / MOST_DECADES + 1;
        (first..=last).filter(move |decade| decade.rem_euclid(step) == 0)
    }

    /// Round numbers on the axis to the right.
    fn ticks(&self) -> impl Iterator<Item = f64> {
        let rough = self.most / TICKS;
        let power = libm::pow(10.0, libm::log10(rough).floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
        let step = steps.into_iter().find(|step| *step >= rough).unwrap_or(rough);
        // Trips are whole.
        let step = step.max(1.0);
        let count = (self.most / step).floor() as u32;
        (0..=count).map(move |number| f64::from(number) * step)
    }
}

fn has_place(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

/// A line with its marks.
fn drawn(line: &Series, scale: &Scale) -> String {
    let mut path = String::new();
    let mut command = 'M';
    for [x, y] in &line.points {
        if has_place(*y) {
            // Writing to a string can't fail.
            let _ = write!(path, "{command}{:.1} {:.1}", scale.x(*x), scale.y(*y));
            command = 'L';
        } else {
            command = 'M';
        }
    }
    let mut text = stroke(line, &path);
    let every = line.points.len().div_ceil(MARKS).max(1);
    for [x, y] in line.points.iter().step_by(every).filter(|[_, y]| has_place(*y)) {
        text += &mark(line, [scale.x(*x), scale.y(*y)]);
    }
    text
}

fn stroke(line: &Series, path: &str) -> String {
    let dashes = match line.mark {
        Mark::Circle(Fill::Filled) | Mark::Triangle(Fill::Filled) => "",
        Mark::Circle(Fill::Hollow) | Mark::Triangle(Fill::Hollow) => " stroke-dasharray=\"6 4\"",
    };
    let colour = line.colour;
    format!("<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{dashes}/>")
}

fn mark(line: &Series, [x, y]: [f64; 2]) -> String {
    let colour = line.colour;
    let (Mark::Circle(fill) | Mark::Triangle(fill)) = line.mark;
    let inside = match fill {
        Fill::Filled => colour,
        Fill::Hollow => "white",
    };
    let style = format!("fill=\"{inside}\" stroke=\"{colour}\" stroke-width=\"1.6\"");
    match line.mark {
        Mark::Circle(_) => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" {style}/>"),
        Mark::Triangle(_) => {
            let (tip, foot) = (y - 5.0, y + 4.0);
            let (left, right) = (x - 5.0, x + 5.0);
            let path = format!("M{x:.1} {tip:.1}L{right:.1} {foot:.1}L{left:.1} {foot:.1}Z");
            format!("<path d=\"{path}\" {style}/>")
        }
    }
}

/// `text` as SVG has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: &[[f64; 2]]) -> String {
        let labels = Labels {
            title: "a < b & c".to_owned(),
            subtitle: String::new(),
            right: "trips",
            up: "errors",
        };
        let (name, mark) = ("line".to_owned(), Mark::Circle(Fill::Filled));
        svg(&labels, &[Series { name, colour: "#06c", mark, points: points.to_vec() }])
    }

    #[test]
    fn points_are_where_their_values_are() {
        // Four decades up 386 pixels, ten trips across 600.
        let text = chart(&[[0.0, 1e-6], [5.0, 1e-4], [10.0, 1e-2]]);
        assert!(text.contains("d=\"M90.0 450.0L390.0 257.0L690.0 64.0\""), "{text}");
        for part in
            ["a &lt; b &amp; c", ">1e-6<", ">1e-2<", ">10<", ">trips<", ">errors<", ">line<"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
    }

    #[test]
    fn values_without_a_place_interrupt_the_line() {
        let text = chart(&[[0.0, 0.0], [1.0, 1e-3], [2.0, f64::NAN], [3.0, 1e-2], [4.0, 1e-3]]);
        assert!(text.contains("d=\"M240.0 450.0M540.0 64.0L690.0 450.0\""), "{text}");
        let nothing = chart(&[[0.0, 0.0], [1.0, f64::INFINITY]]);
        assert!(!nothing.contains("NaN") && !nothing.contains("inf"), "{nothing}");
    }

    #[test]
    fn axes_have_few_ticks_whatever_the_values() {
        let scale = |most: f64, decades| Scale { most, decades };
        for (most, step) in [(1.0, 1.0), (7.0, 1.0), (10.0, 2.0), (100.0, 20.0), (1000.0, 200.0)] {
            let ticks: Vec<f64> = scale(most, [0, 1]).ticks().collect();
            assert_eq!(ticks[1], step, "{most}");
            assert!(ticks.len() <= 9 && ticks.last() <= Some(&most), "{ticks:?}");
        }
        let decades = |ends| scale(1.0, ends).decades().collect::<Vec<_>>();
        assert_eq!(decades([-3, 0]), [-3, -2, -1, 0]);
        assert_eq!(decades([-17, -2]), [-16, -14, -12, -10, -8, -6, -4, -2]);
    }
}
