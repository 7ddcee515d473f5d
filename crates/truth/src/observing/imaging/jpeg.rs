//! JPEG compression of images; one of two uses of the crate `image`.

use std::io::Cursor;

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder};

use crate::observing::Image;

/// The image after encoding at a quality of 1 to 100, without chroma subsampling, and decoding.
pub(super) fn compressed(image: Image, quality: u8) -> Image {
    let size = [image.width(), image.height()];
    // encoding fails only for sides beyond 65,535 pixels, four times the largest camera image
    encoded(&image, quality).and_then(|bytes| decoded(&bytes, size)).unwrap_or(image)
}

/// The image as a JPEG file; `None` for sides beyond 65,535 pixels.
pub(super) fn encoded(image: &Image, quality: u8) -> Option<Vec<u8>> {
    let (width, height, channels) = image.shape();
    let kind = if channels == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    encoder.encode(&image.interleaved(), width, height, kind).ok()?;
    Some(bytes)
}

/// The image of a JPEG file; `None` if it cannot be read or has another size.
pub fn decoded(bytes: &[u8], [width, height]: [u32; 2]) -> Option<Image> {
    let decoder = JpegDecoder::new(Cursor::new(bytes)).ok()?;
    // checked first, because a file may claim any size
    let decoder = Some(decoder).filter(|decoder| decoder.dimensions() == (width, height))?;
    let decoded = DynamicImage::from_decoder(decoder).ok()?;
    let is_grey = decoded.color().channel_count() == 1;
    let values = if is_grey { decoded.into_luma8().into_raw() } else { decoded.into_rgb8().into_raw() };
    Image::from_interleaved(width, height, if is_grey { 1 } else { 3 }, &values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth gradient with an edge.
    fn picture(channels: usize) -> Image {
        let at = |x: usize, y: usize, c: usize| if x > 21 { 200 - c * 30 } else { 40 + x + y + 20 * c };
        let values = (0..30 * 40).flat_map(|i| (0..channels).map(move |c| at(i % 40, i / 40, c) as u8));
        Image::from_interleaved(40, 30, channels, &values.collect::<Vec<_>>()).unwrap()
    }

    fn mean_error(a: &Image, b: &Image) -> f64 {
        let (a, b) = (a.interleaved(), b.interleaved());
        a.iter().zip(&b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.len() as f64
    }

    #[test]
    fn images_keep_their_shape_and_lose_more_at_lower_quality() {
        for channels in [1, 3] {
            let image = picture(channels);
            let errors = [95, 60, 10].map(|quality| mean_error(&compressed(image.clone(), quality), &image));
            assert!(errors[0] < errors[1] && errors[1] < errors[2], "{errors:?}");
            assert!(errors[0] < 3.0 && errors[2] < 20.0, "{errors:?}");
            assert_eq!(compressed(image.clone(), 60).shape(), image.shape());
            assert_eq!(compressed(image.clone(), 60), compressed(image, 60));
        }
    }
}
