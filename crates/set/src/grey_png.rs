//! Grey PNG files, the format of all images of a set.

use super::SetError;

/// A PNG of grey pixels of this bit depth, big-endian, row by row. It uses the fastest compression, which suffices for
/// these images. `file` is named in errors.
pub(super) fn encode(
    file: &str,
    [width, height]: [u32; 2],
    depth: png::BitDepth,
    pixels: &[u8],
) -> Result<Vec<u8>, SetError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fastest);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(pixels)?;
        writer.finish()
    });
    written.map_err(|e| SetError::malformed(file, e.to_string()))?;
    Ok(bytes)
}
