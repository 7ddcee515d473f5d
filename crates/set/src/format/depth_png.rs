//! Depth as 16-bit grey PNG, for readers without OpenEXR: millimetres along the camera's z axis, 0 without geometry,
//! 65535 for 65.535 m and farther.

use super::grey_png;
use super::listing::LAYERS;
use super::shown_rows::{ShownRow, shown_rows};
use crate::SetError;
use skiagraph_core::body::DepthImage;

pub(crate) fn path(camera: usize, frame: usize) -> String {
    format!("{LAYERS}cam{camera:02}/{frame:06}-depth.png")
}

pub(crate) fn encode(file: &str, image: &DepthImage) -> Result<Vec<u8>, SetError> {
    let mut pixels = vec![0; 2 * image.depth.len()];
    let all = pixels.as_chunks_mut::<2>().0;
    for ShownRow { y, first, end } in shown_rows(image) {
        let shown = y * image.width as usize + first..y * image.width as usize + end;
        let each = all[shown.clone()].iter_mut().zip(&image.depth[shown]);
        each.for_each(|(pixel, depth)| *pixel = millimetres(*depth).to_be_bytes());
    }
    grey_png::encode(file, [image.width, image.height], png::BitDepth::Sixteen, &pixels)
}

/// The pixel value of a depth in metres: millimetres, halves rounded up; 0 without geometry.
pub(crate) fn millimetres(depth: f32) -> u16 {
    if depth.is_finite() {
        // in double precision product and sum are exact; the cast drops the fraction
        (f64::from(depth) * 1000.0 + 0.5).clamp(1.0, 65_535.0) as u16
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn millimetres_are_the_nearest_and_halves_are_rounded_up() {
        let rounded = |depth: f32| (f64::from(depth) * 1000.0).round().clamp(1.0, 65_535.0) as u16;
        let depths =
            (1..200_000).map(|i| i as f32 * 0.000_372_1).chain((0..4096).map(|i| i as f32 / 64.0 + 0.007_812_5));
        depths.for_each(|depth| assert_eq!(millimetres(depth), rounded(depth), "{depth}"));
        assert_eq!([0.0, f32::MIN_POSITIVE, 1e30, f32::INFINITY, f32::NAN].map(millimetres), [1, 1, 65_535, 0, 0]);
    }

    #[test]
    fn depths_are_read_back_in_millimetres_and_pixels_without_geometry_are_zero() {
        let depth = vec![f32::INFINITY, 1.5, 2.0004, 0.0001, 65.6, 1000.0];
        let image = DepthImage { width: 3, height: 2, depth, part: vec![0, 1, 1, 1, 1, 1] };
        let bytes = encode("x", &image).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; 12];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height, info.bit_depth), (3, 2, png::BitDepth::Sixteen));
        let values: Vec<u16> = pixels.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
        assert_eq!(values, [0, 1500, 2000, 1, 65_535, 65_535]);
    }
}
