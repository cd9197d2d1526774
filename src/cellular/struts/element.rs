//! What a lattice consists of: segments, lines, polygons and planes, and the distance to each.
//!
//! Struts in a row are one element: a chain that comes back to its beginning in another cell is a
//! line, which takes less to evaluate than its pieces, and is without joints where a fillet would
//! see two ends. The union of the struts is the same.

use super::cell::{Cell, Strut, Surface, place};
use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

/// Directions whose cosines differ by less are one direction.
const PARALLEL: f64 = 1e-10;

/// The length, in cells, that a chain of struts does not exceed: it comes back by then, or never.
const LONGEST_CHAIN: f64 = 6.0;

/// The middle of a strut or plate, or of several.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// The line through a point along a vector of unit length.
    Line { point: DVec3, direction: DVec3 },
    /// The segment between two points.
    Segment([DVec3; 2]),
    /// The plane with normal . x = offset; the normal has unit length.
    Plane { normal: DVec3, offset: f64 },
    /// A convex polygon.
    Polygon(Vec<DVec3>),
}

/// A shape with the factors of its radius or thickness.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) shape: Shape,
    /// At the ends of a segment; else the same twice.
    pub(super) factors: [f64; 2],
}

/// An element of a cell with the translations that repeat it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Family {
    pub(super) element: Element,
    /// The whole vector after which a line comes back; the normal of a plane before it had unit
    /// length; of no meaning else.
    period: DVec3,
}

impl Element {
    /// The distance from `p` to the shape, without radius.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        match &self.shape {
            Shape::Line { point, direction } => (p - point).cross(*direction).length(),
            Shape::Segment(ends) => to_segment(p, *ends),
            Shape::Plane { normal, offset } => (normal.dot(p) - offset).abs(),
            Shape::Polygon(corners) => to_polygon(p, corners),
        }
    }

    /// A point of the shape that is near `middle`.
    pub(super) fn place_near(&self, middle: DVec3) -> DVec3 {
        match &self.shape {
            Shape::Line { point, direction } => {
                *point + *direction * direction.dot(middle - *point)
            }
            Shape::Segment([a, b]) => 0.5 * (*a + *b),
            Shape::Plane { normal, offset } => middle - *normal * (normal.dot(middle) - offset),
            Shape::Polygon(corners) => corners.iter().sum::<DVec3>() / corners.len() as f64,
        }
    }
}

/// The distance from `p` to the segment between `a` and `b`.
fn to_segment(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let along = b - a;
    let share = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    p.distance(a + share * along)
}

/// The distance from `p` to a convex polygon.
fn to_polygon(p: DVec3, corners: &[DVec3]) -> f64 {
    let normal = normal(corners);
    let edges = || (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]);
    let is_above = edges().all(|[a, b]| (b - a).cross(normal).dot(p - a) <= 0.0);
    if is_above {
        normal.dot(p - corners[0]).abs()
    } else {
        edges().map(|edge| to_segment(p, edge)).fold(f64::INFINITY, f64::min)
    }
}

/// The normal of a polygon, about which its corners turn to the left.
pub(super) fn normal(corners: &[DVec3]) -> DVec3 {
    let pairs = (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]));
    let first = corners[0];
    pairs.map(|(a, b)| (a - first).cross(b - first)).sum::<DVec3>().normalize()
}

/// The struts of `cell`, those in a row as one.
pub(super) fn of_struts(cell: &Cell) -> Vec<Family> {
    let struts = cell.struts();
    let mut at: FxHashMap<[i64; 3], Vec<usize>> = FxHashMap::default();
    for (number, strut) in struts.iter().enumerate() {
        for end in strut.ends {
            at.entry(place(end)).or_default().push(number);
        }
    }
    let mut used = vec![false; struts.len()];
    let mut families = Vec::new();
    for (number, strut) in struts.iter().enumerate() {
        if std::mem::replace(&mut used[number], true) {
            continue;
        }
        let mut chain = *strut;
        let mut closed = false;
        if strut.factors[0] == strut.factors[1] {
            for _ in 0..2 {
                while let Some((next, step)) = continuation(&chain, struts, &at, &used) {
                    used[next] = true;
                    chain.ends[1] += step;
                }
                chain.ends.reverse();
            }
            closed = place(chain.ends[0]) == place(chain.ends[1]);
        }
        let along = chain.ends[1] - chain.ends[0];
        let shape = if closed {
            Shape::Line { point: chain.ends[0], direction: along.normalize() }
        } else {
            Shape::Segment(chain.ends)
        };
        families.push(Family {
            element: Element { shape, factors: chain.factors },
            period: along.round(),
        });
    }
    families
}

/// An unused strut that goes on straight from the end of `chain`, and the vector along it.
fn continuation(
    chain: &Strut,
    struts: &[Strut],
    at: &FxHashMap<[i64; 3], Vec<usize>>,
    used: &[bool],
) -> Option<(usize, DVec3)> {
    let [start, end] = chain.ends;
    let direction = (end - start).normalize();
    let here = place(end);
    at.get(&here)?.iter().filter(|&&next| !used[next]).find_map(|&next| {
        let Strut { ends: [a, b], factors } = struts[next];
        let steps = [(a, b - a), (b, a - b)];
        let step = steps.into_iter().find(|(from, step)| {
            place(*from) == here && step.normalize().dot(direction) > 1.0 - PARALLEL
        });
        let is_short = |step: DVec3| (end + step).distance(start) <= LONGEST_CHAIN;
        let goes_on = |step: &DVec3| factors == chain.factors && is_short(*step);
        step.map(|(_, step)| step).filter(goes_on).map(|step| (next, step))
    })
}

/// The plates of `cell`.
pub(super) fn of_plates(cell: &Cell) -> Vec<Family> {
    let family = |plate: &super::cell::Plate| {
        let (shape, period) = match &plate.surface {
            Surface::Plane { normal, offset } => {
                let length = normal.length();
                (Shape::Plane { normal: *normal / length, offset: offset / length }, *normal)
            }
            Surface::Polygon(corners) => (Shape::Polygon(corners.clone()), DVec3::ZERO),
        };
        Family { element: Element { shape, factors: [plate.factor; 2] }, period }
    };
    cell.plates().iter().map(family).collect()
}

impl Family {
    /// The elements that are nearer than `reach` to the box from the origin to `size`, and some more.
    pub(super) fn images(&self, size: DVec3, reach: f64) -> Vec<Element> {
        let Element { shape, factors } = &self.element;
        let moved = |shape: Shape| Element { shape, factors: *factors };
        let middle = 0.5 * size;
        let farthest = middle.length() + reach;
        let is_near = |element: &Element| element.distance(middle) <= farthest;
        match shape {
            Shape::Segment(ends) => translations(ends, size, reach)
                .map(|by| moved(Shape::Segment(ends.map(|end| end + by))))
                .filter(is_near)
                .collect(),
            Shape::Polygon(corners) => translations(corners, size, reach)
                .map(|by| {
                    moved(Shape::Polygon(corners.iter().map(|corner| *corner + by).collect()))
                })
                .filter(is_near)
                .collect(),
            Shape::Plane { normal, offset } => {
                let spacing = self.period.length().recip();
                let ends = [normal.min(DVec3::ZERO), normal.max(DVec3::ZERO)];
                let [lo, hi] = ends.map(|n| n.dot(size));
                let first = ((lo - reach - offset) / spacing).ceil() as i64;
                let last = ((hi + reach - offset) / spacing).floor() as i64;
                let at = |k: i64| offset + spacing * k as f64;
                (first..=last)
                    .map(|k| moved(Shape::Plane { normal: *normal, offset: at(k) }))
                    .collect()
            }
            Shape::Line { point, direction } => {
                let ends = [*point, *point + self.period];
                let mut known = FxHashSet::default();
                translations(&ends, size, reach)
                    .map(|by| {
                        let through = *point + by;
                        through + *direction * direction.dot(middle - through)
                    })
                    .filter(|near| near.distance(middle) <= farthest)
                    .filter(|near| known.insert((*near * (1 << 24) as f64).round().as_i64vec3()))
                    .map(|point| moved(Shape::Line { point, direction: *direction }))
                    .collect()
            }
        }
    }
}

/// The translations by whole cells after which the box around `points` comes nearer than `reach` to
/// the box from the origin to `size`.
fn translations(points: &[DVec3], size: DVec3, reach: f64) -> impl Iterator<Item = DVec3> {
    let lo = points.iter().copied().reduce(DVec3::min).unwrap_or(DVec3::ZERO);
    let hi = points.iter().copied().reduce(DVec3::max).unwrap_or(DVec3::ZERO);
    // What only touches is of no use, but rounding must not lose what is needed.
    let reach = reach + 1e-9;
    let first = (-reach - hi).ceil();
    let last = (size + reach - lo).floor();
    let along = move |axis: usize| (first[axis] as i64..=last[axis] as i64).map(|k| k as f64);
    along(0)
        .flat_map(move |x| along(1).flat_map(move |y| along(2).map(move |z| DVec3::new(x, y, z))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(p: [f64; 3]) -> DVec3 {
        DVec3::from_array(p)
    }

    #[test]
    fn chains_that_come_back_are_lines() {
        let half = Strut::between(DVec3::ZERO, DVec3::splat(0.5));
        let rest = Strut::between(DVec3::ONE, DVec3::splat(0.5));
        let found = of_struts(&Cell::new(vec![half, rest], Vec::new()));
        let [Family { element, period }] = &found[..] else { panic!("one line: {found:?}") };
        assert!(matches!(element.shape, Shape::Line { .. }));
        assert_eq!(period.abs(), DVec3::ONE);
        let alone = of_struts(&Cell::new(vec![half], Vec::new()));
        assert!(matches!(alone[0].element.shape, Shape::Segment(_)));
    }

    #[test]
    fn images_of_a_line_are_as_many_as_meet_the_box() {
        let cell = Cell::new(vec![Strut::between(DVec3::ZERO, DVec3::X)], Vec::new());
        let [line] = &of_struts(&cell)[..] else { panic!("one line") };
        assert_eq!(line.images(DVec3::ONE, 0.1).len(), 4);
        assert_eq!(line.images(DVec3::splat(0.5), 0.1).len(), 1);
    }

    #[test]
    fn distances_to_polygons_are_those_of_elementary_geometry() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(point);
        let square = Element { shape: Shape::Polygon(corners.to_vec()), factors: [1.0; 2] };
        let check = |p: [f64; 3], expected: f64| {
            assert!((square.distance(point(p)) - expected).abs() < 1e-15, "{p:?}");
        };
        check([0.5, 0.5, 0.3], 0.3);
        check([0.5, 1.3, 0.4], 0.5);
        check([1.3, 1.4, 0.0], 0.5);
    }
}
