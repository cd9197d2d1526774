//! Slices as PNG: white where the middle of a pixel is in the solid, black elsewhere.
//!
//! One bit a pixel, as printers that cure layers by light take it. The file says how large a pixel is,
//! a model unit being a millimetre.

use super::{Slice, Window, sides};
use std::io::{self, Write};

/// Most pixels of a picture.
pub const MOST_PIXELS: u64 = 1 << 30;

/// Why there is no picture.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RasterError {
    /// The size of a pixel is not a positive number.
    #[error("a pixel of size {pixel} is none; give a positive number")]
    Pixel {
        /// The size asked for.
        pixel: f64,
    },
    /// There would be too many pixels.
    #[error("{width:.0} x {height:.0} pixels are more than {MOST_PIXELS}; give larger ones")]
    TooMany {
        /// Pixels in a row.
        width: f64,
        /// Rows.
        height: f64,
    },
}

/// Pixels over a rectangle, the first at its lower left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picture {
    corner: [f64; 2],
    pixel: f64,
    width: u32,
    height: u32,
}

/// A rectangle that is longer than whole pixels by this part of one has no pixel for it.
const LEFT_OUT: f64 = 1e-6;

impl Picture {
    /// Pixels of side `pixel`, in model units, that cover `window`.
    ///
    /// # Errors
    /// [`RasterError`] for a size that is none, and for too many pixels.
    pub fn new(window: Window, pixel: f64) -> Result<Self, RasterError> {
        if !(pixel > 0.0 && pixel.is_finite()) {
            return Err(RasterError::Pixel { pixel });
        }
        let [corner, end] = window;
        let count = |a: usize| ((end[a] - corner[a]) / pixel - LEFT_OUT).ceil().max(1.0);
        let (width, height) = (count(0), count(1));
        if width * height > MOST_PIXELS as f64 || width.max(height) > f64::from(i32::MAX) {
            return Err(RasterError::TooMany { width, height });
        }
        Ok(Self { corner, pixel, width: width as u32, height: height as u32 })
    }

    /// Pixels along each axis.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// The pixels of `slice`, a bit each, set in the solid; rows from the top, of whole bytes, the
    /// leftmost pixel being the highest bit.
    fn bits(&self, slice: &Slice) -> Vec<u8> {
        let Self { corner: [left, bottom], pixel, width, height } = *self;
        // Where outlines cross the middle of each row.
        let mut crossings = vec![Vec::new(); height as usize];
        let row = |y: f64| ((y - bottom) / pixel - 0.5).ceil().clamp(0.0, f64::from(height));
        for [p, q] in slice.outlines.iter().flat_map(|ring| sides(ring)) {
            let [low, high] = if p[1] < q[1] { [p, q] } else { [q, p] };
            for (k, row) in (row(low[1]) as usize..row(high[1]) as usize).map(|k| (k, k as f64)) {
                let y = bottom + (row + 0.5) * pixel;
                crossings[k]
                    .push(low[0] + (high[0] - low[0]) * ((y - low[1]) / (high[1] - low[1])));
            }
        }
        let stride = (width as usize).div_ceil(8);
        let mut bits = vec![0u8; stride * height as usize];
        for (line, row) in bits.chunks_exact_mut(stride).rev().zip(&mut crossings) {
            row.sort_unstable_by(f64::total_cmp);
            let column = |x: f64| ((x - left) / pixel - 0.5).ceil().clamp(0.0, f64::from(width));
            for pair in row.chunks_exact(2) {
                for x in column(pair[0]) as usize..column(pair[1]) as usize {
                    line[x / 8] |= 0x80 >> (x % 8);
                }
            }
        }
        bits
    }

    /// Writes `slice` as a PNG file.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn write(&self, slice: &Slice, to: impl Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(to, self.width, self.height);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::One);
        let per_metre = (1000.0 / self.pixel).round();
        if (1.0..=f64::from(i32::MAX)).contains(&per_metre) {
            let (xppu, yppu) = (per_metre as u32, per_metre as u32);
            encoder.set_pixel_dims(Some(png::PixelDimensions {
                xppu,
                yppu,
                unit: png::Unit::Meter,
            }));
        }
        let failed = |error: png::EncodingError| {
            if let png::EncodingError::IoError(error) = error {
                error
            } else {
                io::Error::other(error)
            }
        };
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(&self.bits(slice)).map_err(failed)?;
        writer.finish().map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Axis;

    fn slice() -> Slice {
        let square = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]];
        let hole = vec![[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]];
        Slice { axis: Axis::Z, at: 0.0, outlines: vec![square, hole] }
    }

    #[test]
    fn pixels_are_white_where_their_middle_is_in_the_solid() {
        let picture = Picture::new([[-1.0, 0.0], [9.0, 4.0]], 1.0).unwrap();
        assert_eq!(picture.size(), [10, 4]);
        let rows = [[0b0000_0000, 0], [0b0111_0000, 0], [0b0101_0000, 0], [0b0111_0000, 0]];
        assert_eq!(picture.bits(&slice()), rows.concat());
    }

    #[test]
    fn pixels_tile_the_plane() {
        // Two triangles that share a side cover each pixel of the square once.
        let triangle =
            |corners: [[f64; 2]; 3]| Slice { outlines: vec![corners.to_vec()], ..slice() };
        let picture = Picture::new([[0.0; 2], [3.0; 2]], 0.07).unwrap();
        let [a, b, c, d] = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]];
        let (one, two) = (triangle([a, b, c]), triangle([a, c, d]));
        let whole = Slice { outlines: vec![vec![a, b, c, d]], ..slice() };
        let both = picture.bits(&one).into_iter().zip(picture.bits(&two));
        let both: Vec<u8> = both
            .map(|(p, q)| {
                assert_eq!(p & q, 0);
                p | q
            })
            .collect();
        assert_eq!(both, picture.bits(&whole));
    }

    #[test]
    fn a_file_holds_its_pixels_and_their_size() {
        let picture = Picture::new([[-1.0, 0.0], [9.0, 4.0]], 0.05).unwrap();
        let mut file = Vec::new();
        picture.write(&slice(), &mut file).unwrap();
        let decoder = png::Decoder::new(io::Cursor::new(file));
        let mut reader = decoder.read_info().unwrap();
        let dimensions = reader.info().pixel_dims.unwrap();
        assert_eq!((dimensions.xppu, dimensions.unit), (20_000, png::Unit::Meter));
        let mut bits = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bits).unwrap();
        assert_eq!((info.width, info.height), (200, 80));
        let white: u32 = bits.iter().map(|byte| byte.count_ones()).sum();
        assert_eq!(white, 8 * 400);
    }

    #[test]
    fn pictures_without_end_are_refused() {
        let window = [[0.0; 2], [1.0; 2]];
        assert_eq!(Picture::new(window, 0.0), Err(RasterError::Pixel { pixel: 0.0 }));
        assert!(matches!(Picture::new(window, f64::NAN), Err(RasterError::Pixel { .. })));
        assert!(matches!(Picture::new(window, 1e-6), Err(RasterError::TooMany { .. })));
        assert_eq!(Picture::new(window, 1e9).unwrap().size(), [1, 1]);
    }
}
