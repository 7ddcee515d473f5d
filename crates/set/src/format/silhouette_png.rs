//! Silhouettes as 8-bit grey PNG files: 255 where the body is, 0 elsewhere.

use super::grey_png;
use crate::SetError;
use skiagraph_core::input::foreign;
use skiagraph_core::raster::Mask;

/// The greys of eight pixels of a mask, the lowest bit first.
const GREYS: [[u8; 8]; 256] = {
    let mut greys = [[0; 8]; 256];
    let mut index = 0;
    while index < 256 * 8 {
        if ((index / 8) >> (index % 8)) & 1 == 1 {
            greys[index / 8][index % 8] = 255;
        }
        index += 1;
    }
    greys
};

/// The PNG of a mask in the format of sets; `file` is named in errors.
///
/// # Errors
/// [`SetError::Malformed`] if the image cannot be encoded.
pub fn encode(file: &str, mask: &Mask) -> Result<Vec<u8>, SetError> {
    let mut pixels = vec![0; mask.width() as usize * mask.height() as usize];
    for (y, row) in (0..mask.height()).zip(pixels.chunks_mut(mask.width().max(1) as usize)) {
        for (word, pixels) in mask.row(y).iter().zip(row.chunks_mut(64)).filter(|(word, _)| **word != 0) {
            for (byte, pixels) in word.to_le_bytes().into_iter().zip(pixels.chunks_mut(8)) {
                pixels.copy_from_slice(&GREYS[usize::from(byte)][..pixels.len()]);
            }
        }
    }
    grey_png::encode(file, [mask.width(), mask.height()], png::BitDepth::Eight, &pixels)
}

/// The mask of a PNG, which must have the camera's size and only the values 0 and 255.
pub(crate) fn decode(file: &str, bytes: &[u8], width: u32, height: u32) -> Result<Mask, SetError> {
    let malformed = |e: png::DecodingError| SetError::malformed(file, foreign(e));
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(malformed)?;
    let info = reader.info();
    let found = (info.width, info.height, info.color_type, info.bit_depth);
    if found != (width, height, png::ColorType::Grayscale, png::BitDepth::Eight) {
        let detail = format!(
            "{} x {} pixels, {:?}, {:?} bits; expected {width} x {height}, 8-bit grey",
            found.0, found.1, found.2, found.3
        );
        return Err(SetError::malformed(file, detail));
    }
    let mut pixels = vec![0; width as usize * height as usize];
    reader.next_frame(&mut pixels).map_err(malformed)?;
    let mut mask = Mask::new(width, height);
    // most words are background
    let is_empty = |values: &[u8]| values.iter().fold(0, |all, value| all | value) == 0;
    for (y, row) in (0..height).zip(pixels.chunks_exact(width.max(1) as usize)) {
        for (word, values) in mask.row_mut(y).iter_mut().zip(row.chunks(64)).filter(|(_, values)| !is_empty(values)) {
            for (place, eight) in values.chunks(8).enumerate() {
                let refused = |grey| SetError::malformed(file, format!("a pixel is {grey}; expected 0 or 255"));
                *word |= bits_of(eight).map_err(refused)? << (8 * place);
            }
        }
    }
    Ok(mask)
}

/// A bit for each of up to eight pixels, the first at the bottom; or the grey of one that is neither 0 nor 255.
fn bits_of(eight: &[u8]) -> Result<u64, u8> {
    let greys = eight.first_chunk().copied().unwrap_or_else(|| {
        let mut greys = [0; 8];
        greys[..eight.len()].copy_from_slice(eight);
        greys
    });
    let all = u64::from_le_bytes(greys);
    let lowest = all & 0x0101_0101_0101_0101;
    if all != lowest * 255 {
        return Err(greys.into_iter().find(|grey| !matches!(grey, 0 | 255)).unwrap_or_default());
    }
    // the product gathers the lowest bits of all bytes in the highest byte
    Ok(lowest.wrapping_mul(0x0102_0408_1020_4080) >> 56)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn any_mask_of_any_size_is_read_back(width in 1_u32..150, height in 1_u32..40, seed: u64) {
            let mut mask = Mask::new(width, height);
            for (i, (x, y)) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).enumerate() {
                mask.set(x, y, seed.rotate_left(i as u32).wrapping_mul(i as u64 | 1) % 3 == 0);
            }
            let bytes = encode("m", &mask).unwrap();
            prop_assert_eq!(decode("m", &bytes, width, height).unwrap(), mask);
        }
    }

    #[test]
    fn other_sizes_greys_and_truncated_files_are_refused_by_name() {
        let bytes = encode("cam00/000000.png", &Mask::new(20, 10)).unwrap();
        let message = |bytes: &[u8], width| decode("cam00/000000.png", bytes, width, 10).unwrap_err().to_string();
        assert!(message(&bytes, 30).contains("20 x 10 pixels") && message(&bytes, 30).contains("expected 30 x 10"));
        assert!(message(&bytes[..bytes.len() / 2], 20).starts_with("cam00/000000.png: "));
        let mut grey = Vec::new();
        let mut writer = png::Encoder::new(&mut grey, 1, 10);
        writer.set_color(png::ColorType::Grayscale);
        writer.write_header().unwrap().write_image_data(&[0, 255, 0, 0, 7, 0, 0, 0, 0, 0]).unwrap();
        assert!(message(&grey, 1).contains("a pixel is 7"));
    }
}
