//! PNG files of a set: grey ones of silhouettes and depth, and images of the scene.

use crate::SetError;
use skiagraph_truth::observing::Image;

/// A PNG of grey pixels of this bit depth, big-endian, row by row. It uses the fastest compression, which suffices for
/// these images. `file` is named in errors.
pub(crate) fn encode(file: &str, size: [u32; 2], depth: png::BitDepth, pixels: &[u8]) -> Result<Vec<u8>, SetError> {
    encode_as(file, size, (png::ColorType::Grayscale, depth), pixels)
}

/// A PNG of an image, grey or RGB, compressed in the same way.
pub(crate) fn encode_image(file: &str, image: &Image) -> Result<Vec<u8>, SetError> {
    let (width, height, channels) = image.shape();
    let colours = if channels == 1 { png::ColorType::Grayscale } else { png::ColorType::Rgb };
    encode_as(file, [width, height], (colours, png::BitDepth::Eight), &image.interleaved())
}

fn encode_as(
    file: &str,
    [width, height]: [u32; 2],
    (colours, depth): (png::ColorType, png::BitDepth),
    pixels: &[u8],
) -> Result<Vec<u8>, SetError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colours);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fastest);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(pixels)?;
        writer.finish()
    });
    written.map_err(|e| SetError::malformed(file, e.to_string()))?;
    Ok(bytes)
}
