//! Drawing primitives for pictures: colours, boxes, lines, wrapped text, plots, and PNG with this program's mark.

use png::{BitDepth, ColorType, Encoder};
use tiny_skia::{
    Color, FillRule, Paint, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Stroke, StrokeDash, Transform,
};

use super::lettering::{CAPITAL_OF_FONT_SIZE, draw_text, text_width};
use super::plots::{Colour, PlotDrawing, Shape, TextSide};
use super::{GENERATOR, ReportError};

pub(crate) const WIDTH: u32 = 1200;
pub(crate) const MARGIN: f32 = 28.0;
pub(crate) const PAPER: [u8; 3] = [0x0d, 0x13, 0x19];
pub(crate) const CARD: [u8; 3] = [0x17, 0x20, 0x29];
pub(crate) const INK: [u8; 3] = Colour::Ink.on_dark();
pub(crate) const FAINT: [u8; 3] = Colour::Faint.on_dark();
pub(crate) const LINE: [u8; 3] = Colour::Blue.on_dark();
pub(crate) const FLOOR: [u8; 3] = Colour::Grey.on_dark();
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

/// A pixel of an opaque colour.
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

/// Wraps text into lines of at most `room` pixels.
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

/// The largest letter height up to `height` at which a line is at most `room` wide.
pub(crate) fn fitting(text: &str, height: f32, room: f32) -> f32 {
    height * room / text_width(text, height).max(room)
}

/// Draws the head of a picture of width [`WIDTH`]: title, description, and lines with letters of this height.
pub(crate) fn draw_head(picture: &mut Pixmap, title: &str, about: &str, lines: &[String], height: f32) {
    let room = WIDTH as f32 - 2.0 * MARGIN;
    draw_text(picture, title, [MARGIN, 26.0], fitting(title, 30.0, room), INK);
    draw_text(picture, about, [MARGIN, 70.0], fitting(about, 14.0, room), FAINT);
    for (line, index) in lines.iter().zip(0_u8..) {
        draw_text(picture, line, [MARGIN, 100.0 + 28.0 * f32::from(index)], height, INK);
    }
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

fn fill_outline(picture: &mut Pixmap, points: &[[f32; 2]], colour: [u8; 3], alpha: u8) {
    let mut path = path(points);
    path.close();
    if let Some(path) = path.finish() {
        picture.fill_path(&path, &paint(colour, alpha), FillRule::Winding, Transform::identity(), None);
    }
}

/// A filled circle.
pub(crate) fn dot(picture: &mut Pixmap, [x, y]: [f32; 2], radius: f32, colour: [u8; 3]) {
    if let Some(path) = PathBuilder::from_circle(x, y, radius) {
        picture.fill_path(&path, &paint(colour, 255), FillRule::Winding, Transform::identity(), None);
    }
}

/// Draws text that ends at `right`.
pub(crate) fn draw_text_to(picture: &mut Pixmap, text: &str, [right, top]: [f32; 2], height: f32, colour: [u8; 3]) {
    draw_text(picture, text, [right - text_width(text, height), top], height, colour);
}

/// Draws text centred at `x`.
pub(crate) fn draw_text_about(picture: &mut Pixmap, text: &str, [x, top]: [f32; 2], height: f32, colour: [u8; 3]) {
    draw_text(picture, text, [x - 0.5 * text_width(text, height), top], height, colour);
}

impl PlotDrawing {
    /// Draws all shapes onto a part of a dark picture, with `scale` pixels per CSS pixel.
    pub(crate) fn draw_on(&self, picture: &mut Pixmap, [left, top]: [f32; 2], scale: f32) {
        let place = |[x, y]: [f64; 2]| [left + scale * x as f32, top + scale * y as f32];
        let all = |points: &[[f64; 2]]| points.iter().copied().map(place).collect::<Vec<_>>();
        for shape in &self.shapes {
            match shape {
                Shape::Line { points, stroke: how, width } => {
                    stroke(picture, &all(points), how.colour.on_dark(), scale * *width as f32, how.dashed);
                }
                Shape::Area { corners, colour, opacity } => {
                    fill_outline(picture, &all(corners), colour.on_dark(), (255.0 * opacity) as u8);
                }
                Shape::Rectangle { corner, size, colour } => {
                    let ([x, y], [width, height]) = (place(*corner), size.map(|length| scale * length as f32));
                    fill(picture, [x, y, width, height], colour.on_dark(), 255);
                }
                Shape::Dot { centre, radius, colour } => {
                    dot(picture, place(*centre), scale * *radius as f32, colour.on_dark());
                }
                Shape::Text { words, at, pixels, colour, side } => {
                    let height = CAPITAL_OF_FONT_SIZE * scale * *pixels as f32;
                    let [x, y] = place(*at);
                    let draw = match side {
                        TextSide::Start => draw_text,
                        TextSide::Middle => draw_text_about,
                        TextSide::End => draw_text_to,
                    };
                    draw(picture, words, [x, y - 0.5 * height], height, colour.on_dark());
                }
            }
        }
    }
}

/// Red, green and blue of every pixel.
pub(crate) fn rgb(picture: &Pixmap) -> Vec<u8> {
    picture.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Encodes a picture as PNG, with the mark by which this program recognises its own files.
pub(crate) fn encoded(picture: &Pixmap) -> Result<Vec<u8>, ReportError> {
    to_png([picture.width(), picture.height()], ColorType::Rgb, &rgb(picture))
}

/// Encodes pixels as PNG, with the same mark.
pub(crate) fn to_png([width, height]: [u32; 2], colours: ColorType, pixels: &[u8]) -> Result<Vec<u8>, ReportError> {
    let failed = |e: png::EncodingError| ReportError::Png(e.to_string());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(colours);
    encoder.set_depth(BitDepth::Eight);
    encoder.add_text_chunk("Software".to_owned(), GENERATOR.to_owned()).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_wrapped_between_words_and_a_long_line_is_made_smaller() {
        let lines = wrapped("Good: the mean marker error is 12 mm. Limited by: nothing in particular", 17.0, 400.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| text_width(line, 17.0) <= 400.0), "{lines:?}");
        assert_eq!(wrapped("", 17.0, 400.0), Vec::<String>::new());
        let head = "seed 12, set frame 123456, 2057.60 s, 1234 mm";
        assert!(text_width(head, fitting(head, 18.0, 352.0)) <= 352.1 && fitting("frame 7", 18.0, 352.0) == 18.0);
    }
}
