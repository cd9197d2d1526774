//! Which elements matter: those that are nearest somewhere in the box that space is folded into.
//!
//! The box is halved again and again. In a part with middle c and half diagonal h, an element is
//! nearest somewhere only if its distance from c is at most 2 h more than that of the nearest.
//! So what is kept is all that is ever nearest, and little more.
//!
//! Elements of different factors change places as the radius grows. An element is dropped only if
//! it is farther at radius 0 and where the thickest are of the radius [`LARGEST`], and so at all radii
//! between.

use super::element::{Element, Family};
use glam::DVec3;

/// The radius or half thickness of the thickest elements, in cells, up to which nothing is missing
/// where factors differ.
pub const LARGEST: f64 = 0.5;

/// The farthest that a point can be from the images of any point, in cells.
const FARTHEST: f64 = 0.866_025_403_784_438_7;

/// Halvings of the unit cell.
const HALVINGS: u32 = 5;

/// Classes of factors, from zero to the largest: elements are compared by the least of their class.
const CLASSES: f64 = 16.0;

/// More than rounding errors of distances.
const MARGIN: f64 = 1e-9;

/// A part of the box and the elements that are nearest in it.
struct Part {
    middle: DVec3,
    half: DVec3,
    candidates: Vec<u32>,
    halvings: u32,
}

/// The elements of `families` that are nearest somewhere in the box from the origin to `size`.
pub(super) fn nearest(families: &[Family], size: DVec3) -> Vec<Element> {
    let all = around(families, size, 0.0);
    let kept = are_nearest(&all, size);
    all.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(element, _)| element).collect()
}

/// Those, and all that come nearer than `reach` to the box.
pub(super) fn nearest_or_within(families: &[Family], size: DVec3, reach: f64) -> Vec<Element> {
    let all = around(families, size, reach);
    let kept = are_nearest(&all, size);
    let chosen = all.into_iter().zip(kept);
    let chosen = chosen.filter(|(element, kept)| *kept || comes_near(element, size, reach));
    chosen.map(|(element, _)| element).collect()
}

/// The elements that may be nearest somewhere in the box, and those nearer to it than `reach`.
fn around(families: &[Family], size: DVec3, reach: f64) -> Vec<Element> {
    // The thickest are ahead of the thinnest by no more than their radius.
    let first = families.first().map(|family| family.element.factors[0]);
    let is_uniform = |family: &Family| family.element.factors.map(Some) == [first; 2];
    let lead = if families.iter().all(is_uniform) { 0.0 } else { LARGEST };
    let farthest = FARTHEST + lead;
    families.iter().flat_map(|f| f.images(size, farthest.max(reach))).collect()
}

/// Whether each of `all` is nearest somewhere in the box.
fn are_nearest(all: &[Element], size: DVec3) -> Vec<bool> {
    let mut kept = vec![false; all.len()];
    let thickest = all.iter().flat_map(|element| element.factors).fold(0.0, f64::max);
    let whole = Part {
        middle: 0.5 * size,
        half: 0.5 * size,
        candidates: (0..all.len() as u32).collect(),
        halvings: HALVINGS,
    };
    let mut pending = vec![whole];
    while let Some(part) = pending.pop() {
        let candidates = rivals(all, &part, thickest);
        let is_known = candidates.iter().all(|c| kept[*c as usize]);
        if is_known {
            continue;
        }
        if part.halvings == 0 {
            candidates.iter().for_each(|c| kept[*c as usize] = true);
            continue;
        }
        let half = 0.5 * part.half;
        pending.extend((0..8_u32).map(|corner| {
            let sign = [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 });
            Part {
                middle: part.middle + half * DVec3::from_array(sign),
                half,
                candidates: candidates.clone(),
                halvings: part.halvings - 1,
            }
        }));
    }
    kept
}

/// Those of the candidates of `part` that may be nearest in it, for some radius.
fn rivals(all: &[Element], part: &Part, thickest: f64) -> Vec<u32> {
    let slack = 2.0 * part.half.length() + MARGIN;
    let far: Vec<f64> =
        part.candidates.iter().map(|c| all[*c as usize].distance(part.middle)).collect();
    // For each class of factors, the least distance.
    let mut least: Vec<(f64, f64)> = Vec::new();
    for (candidate, far) in part.candidates.iter().zip(&far) {
        let [a, b] = all[*candidate as usize].factors.map(|factor| factor / thickest);
        let thinnest = a.min(b);
        // The thickest are their own class, so that uniform elements are compared as they are.
        let factor = if thinnest < 1.0 { (thinnest * CLASSES).floor() / CLASSES } else { thinnest };
        match least.iter_mut().find(|(known, _)| *known == factor) {
            Some((_, nearest)) => *nearest = nearest.min(*far),
            None => least.push((factor, *far)),
        }
    }
    let is_rival = |(candidate, far): (&u32, &f64)| {
        let [a, b] = all[*candidate as usize].factors.map(|factor| factor / thickest);
        let own = a.max(b);
        let is_beaten = least.iter().any(|(factor, nearest)| {
            let lead = far - nearest - slack;
            lead > 0.0 && lead > (own - factor) * LARGEST
        });
        (!is_beaten).then_some(*candidate)
    };
    part.candidates.iter().zip(&far).filter_map(is_rival).collect()
}

/// Whether `element` comes nearer than `reach` to the box, or nearly so.
fn comes_near(element: &Element, size: DVec3, reach: f64) -> bool {
    let mut pending = vec![(0.5 * size, 0.5 * size, HALVINGS)];
    while let Some((middle, half, halvings)) = pending.pop() {
        let far = element.distance(middle);
        if far <= reach {
            return true;
        }
        if far - half.length() > reach + MARGIN {
            continue;
        }
        if halvings == 0 {
            return true;
        }
        let half = 0.5 * half;
        pending.extend((0..8_u32).map(|corner| {
            let sign = [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 });
            (middle + half * DVec3::from_array(sign), half, halvings - 1)
        }));
    }
    false
}
