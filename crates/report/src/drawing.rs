//! Drawing primitives for pictures: colours, boxes, lines, text, and PNG with this program's mark.

use png::{BitDepth, ColorType, Compression, Encoder};
use tiny_skia::{Color, Paint, Pixmap, PremultipliedColorU8, Rect, Transform};

use super::lettering::{draw_text, text_width};
use super::plots::Colour;
use super::{GENERATOR, ReportError};

pub(crate) const PAPER: [u8; 3] = [0x0d, 0x13, 0x19];
pub(crate) const INK: [u8; 3] = Colour::Ink.on_dark();
/// Grid lines, and the background of bars.
pub(crate) const GRID: [u8; 3] = Colour::Grid.on_dark();
/// Bars of the left side, joint limits, and pixels in the model's silhouette only.
pub(crate) const BLUE: [u8; 3] = [0x4f, 0x7f, 0xe0];
/// Bars of the right side, and the used part of joint limits.
pub(crate) const ORANGE: [u8; 3] = [0xe0, 0x8a, 0x3c];
/// Silhouettes.
pub(crate) const FIGURE: [u8; 3] = [0xa9, 0xb8, 0xc6];

pub(crate) fn colour([red, green, blue]: [u8; 3]) -> Color {
    Color::from_rgba8(red, green, blue, 255)
}

pub(crate) fn pixel(tone: [u8; 3]) -> PremultipliedColorU8 {
    colour(tone).premultiply().to_color_u8()
}

pub(crate) fn new_picture(width: u32, height: u32) -> Result<Pixmap, ReportError> {
    Pixmap::new(width, height).ok_or(ReportError::Size { width, height })
}

/// A new picture filled with [`PAPER`].
pub(crate) fn new_sheet(width: u32, height: u32) -> Result<Pixmap, ReportError> {
    let mut picture = new_picture(width, height)?;
    picture.fill(colour(PAPER));
    Ok(picture)
}

/// The largest letter height up to `height` at which a line is at most `room` wide.
pub(crate) fn fitting(text: &str, height: f32, room: f32) -> f32 {
    height * room / text_width(text, height).max(room)
}

pub(crate) fn paint([red, green, blue]: [u8; 3], alpha: u8) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(Color::from_rgba8(red, green, blue, alpha));
    paint
}

pub(crate) fn fill(picture: &mut Pixmap, [left, top, width, height]: [f32; 4], colour: [u8; 3], alpha: u8) {
    if let Some(rect) = Rect::from_xywh(left, top, width, height) {
        picture.fill_rect(rect, &paint(colour, alpha), Transform::identity(), None);
    }
}

pub(crate) fn draw_text_to(picture: &mut Pixmap, text: &str, [right, top]: [f32; 2], height: f32, colour: [u8; 3]) {
    draw_text(picture, text, [right - text_width(text, height), top], height, colour);
}

pub(crate) fn rgb(picture: &Pixmap) -> Vec<u8> {
    picture.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Encodes a picture as PNG, with the mark by which this program recognises its own files.
pub(crate) fn encoded(picture: &Pixmap) -> Result<Vec<u8>, ReportError> {
    to_png([picture.width(), picture.height()], ColorType::Rgb, &rgb(picture), Compression::Balanced)
}

/// As [`encoded`], for pictures with a camera's image: its noise took most of the time of a report to compress, and
/// saved a sixth.
pub(crate) fn encoded_fast(picture: &Pixmap) -> Result<Vec<u8>, ReportError> {
    to_png([picture.width(), picture.height()], ColorType::Rgb, &rgb(picture), Compression::Fast)
}

/// Encodes pixels as PNG, with the same mark.
pub(crate) fn to_png(
    [width, height]: [u32; 2],
    colours: ColorType,
    pixels: &[u8],
    compression: Compression,
) -> Result<Vec<u8>, ReportError> {
    let failed = |e: png::EncodingError| ReportError::Png(e.to_string());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(colours);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(compression);
    encoder.add_text_chunk("Software".to_owned(), GENERATOR.to_owned()).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    // evaluate of a set with images took 0.4 s a camera, most of it to compress their noise
    #[test]
    fn pictures_of_images_have_the_same_pixels_when_they_are_encoded_fast() {
        let mut picture = new_sheet(300, 200).unwrap();
        for (index, place) in (0_u32..).zip(picture.pixels_mut()) {
            *place = pixel(index.wrapping_mul(2_654_435_761).to_be_bytes()[..3].try_into().unwrap());
        }
        let pixels = |bytes: Vec<u8>| {
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            pixels
        };
        let (fast, small) = (encoded_fast(&picture).unwrap(), encoded(&picture).unwrap());
        assert!(fast != small && pixels(fast) == pixels(small));
    }

    #[test]
    fn a_long_line_is_made_smaller() {
        let head = "seed 12, set frame 123456, 2057.60 s, 1234 mm";
        assert!(text_width(head, fitting(head, 18.0, 352.0)) <= 352.1 && fitting("frame 7", 18.0, 352.0) == 18.0);
    }
}
