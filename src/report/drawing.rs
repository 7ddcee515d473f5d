//! What pictures in one PNG are drawn with: colours, boxes, lines, wrapped text, and our mark.

use png::{BitDepth, ColorType, Encoder};
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform};

use super::lettering::{draw_text, text_width};
use super::{GENERATOR, ReportError};

pub(crate) const WIDTH: u32 = 1200;
pub(crate) const MARGIN: f32 = 28.0;
pub(crate) const PAPER: [u8; 3] = [0x0d, 0x13, 0x19];
pub(crate) const CARD: [u8; 3] = [0x17, 0x20, 0x29];
pub(crate) const INK: [u8; 3] = [0xe8, 0xed, 0xf2];
pub(crate) const FAINT: [u8; 3] = [0x9f, 0xad, 0xbb];
pub(crate) const LINE: [u8; 3] = [0x5a, 0xb4, 0xf0];
pub(crate) const FLOOR: [u8; 3] = [0x8d, 0x9b, 0xa9];
/// Lines of the grid.
pub(crate) const GRID: [u8; 3] = [0x2b, 0x36, 0x41];

/// Lines of at most `room` pixels.
pub(crate) fn wrapped(text: &str, height: f32, room: f32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut().filter(|line| text_width(&format!("{line} {word}"), height) <= room) {
            Some(line) => {
                line.push(' ');
                line.push_str(word);
            }
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The height at which a line is at most `room` wide, at most `height`.
pub(crate) fn fitting(text: &str, height: f32, room: f32) -> f32 {
    height * room / text_width(text, height).max(room)
}

fn paint([red, green, blue]: [u8; 3], alpha: u8) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(Color::from_rgba8(red, green, blue, alpha));
    paint
}

pub(crate) fn fill(picture: &mut Pixmap, [left, top, width, height]: [f32; 4], colour: [u8; 3], alpha: u8) {
    if let Some(rect) = Rect::from_xywh(left, top, width, height) {
        picture.fill_rect(rect, &paint(colour, alpha), Transform::identity(), None);
    }
}

fn path(points: &[[f32; 2]]) -> PathBuilder {
    let mut path = PathBuilder::new();
    for (index, [x, y]) in points.iter().enumerate() {
        if index == 0 { path.move_to(*x, *y) } else { path.line_to(*x, *y) }
    }
    path
}

pub(crate) fn stroke(picture: &mut Pixmap, points: &[[f32; 2]], colour: [u8; 3], width: f32, dashed: bool) {
    let dash = if dashed { StrokeDash::new(vec![6.0, 4.0], 0.0) } else { None };
    if let Some(path) = path(points).finish() {
        let stroke = Stroke { width, dash, ..Stroke::default() };
        picture.stroke_path(&path, &paint(colour, 255), &stroke, Transform::identity(), None);
    }
}

pub(super) fn fill_outline(picture: &mut Pixmap, points: &[[f32; 2]], colour: [u8; 3], alpha: u8) {
    let mut path = path(points);
    path.close();
    if let Some(path) = path.finish() {
        picture.fill_path(&path, &paint(colour, alpha), FillRule::Winding, Transform::identity(), None);
    }
}

/// With the mark by which this program recognises its own files.
pub(crate) fn encoded(picture: &Pixmap) -> Result<Vec<u8>, ReportError> {
    let failed = |e: png::EncodingError| ReportError::Png(e.to_string());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, picture.width(), picture.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.add_text_chunk("Software".to_owned(), GENERATOR.to_owned()).map_err(failed)?;
    let rgb: Vec<u8> = picture.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&rgb).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// A filled circle.
pub(crate) fn dot(picture: &mut Pixmap, [x, y]: [f32; 2], radius: f32, colour: [u8; 3]) {
    if let Some(path) = PathBuilder::from_circle(x, y, radius) {
        picture.fill_path(&path, &paint(colour, 255), FillRule::Winding, Transform::identity(), None);
    }
}

/// Text that ends at `right`.
pub(crate) fn draw_text_to(picture: &mut Pixmap, text: &str, [right, top]: [f32; 2], height: f32, colour: [u8; 3]) {
    draw_text(picture, text, [right - text_width(text, height), top], height, colour);
}

/// Text about a centre.
pub(crate) fn draw_text_about(picture: &mut Pixmap, text: &str, [x, top]: [f32; 2], height: f32, colour: [u8; 3]) {
    draw_text(picture, text, [x - 0.5 * text_width(text, height), top], height, colour);
}
