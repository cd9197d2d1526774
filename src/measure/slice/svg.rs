//! Slices as SVG: one filled path in model units, taken as millimetres.

use super::{Slice, Window};
use std::fmt::Write;

impl Slice {
    /// The slice as an SVG document that shows `window`, a model unit a millimetre.
    ///
    /// Outlines are one path, filled black by the even-odd rule; numbers are written so that they read
    /// back to the same bits. The path is drawn with the second axis up. Points between two
    /// others on a line along an axis are left out.
    #[must_use]
    pub fn svg(&self, window: Window) -> String {
        let [[left, bottom], [right, top]] = window;
        let (width, height) = (right - left, top - bottom);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
             viewBox=\"{left} {} {width} {height}\">\n",
            -top
        );
        if !self.outlines.is_empty() {
            text.push_str("<path transform=\"scale(1,-1)\" fill-rule=\"evenodd\" d=\"");
            for ring in &self.outlines {
                let mut command = 'M';
                for [x, y] in corners(ring) {
                    // Writing to a string can't fail.
                    let _ = write!(text, "{command}{x} {y}");
                    command = 'L';
                }
                text.push_str("Z\n");
            }
            text.push_str("\"/>\n");
        }
        text.push_str("</svg>\n");
        text
    }
}

/// The points of a ring without those that continue a line along an axis.
fn corners(ring: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    let n = ring.len();
    (0..n).map(move |i| [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]]).filter_map(
        |[before, here, after]| {
            let continues = (0..2).any(|a| before[a] == here[a] && here[a] == after[a]);
            (!continues).then_some(here)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Axis;

    #[test]
    fn a_square_with_a_hole_is_one_path() {
        let square = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.5]];
        let hole = vec![[0.5, 0.5], [0.5, 1.5], [1.5, 0.1 + 0.2]];
        let slice = Slice { axis: Axis::Z, at: 0.0, outlines: vec![square, hole] };
        let text = slice.svg([[-1.0, -2.0], [3.0, 4.0]]);
        assert_eq!(
            text,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"4mm\" height=\"6mm\" \
             viewBox=\"-1 -4 4 6\">\n\
             <path transform=\"scale(1,-1)\" fill-rule=\"evenodd\" d=\"M0 0L2 0L2 2L0 2Z\n\
             M0.5 0.5L0.5 1.5L1.5 0.30000000000000004Z\n\"/>\n</svg>\n"
        );
        let empty = Slice { outlines: Vec::new(), ..slice };
        assert!(!empty.svg([[0.0; 2], [1.0; 2]]).contains("path"));
    }
}
