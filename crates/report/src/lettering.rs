//! Text in pictures, in Open Sans (`font/README.md`).

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, OutlineCurve, Point};
use tiny_skia::{Color, FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// `None` if the file were not a font, which a test excludes.
static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("font/OpenSans-Regular.ttf")).ok());

/// Height of a capital letter in font units.
const CAPITAL: f32 = 1462.0;

/// Width of a line of text whose capitals are `height` pixels high.
pub(crate) fn text_width(text: &str, height: f32) -> f32 {
    let Some(font) = FONT.as_ref() else { return 0.0 };
    placed(font, text).last().map_or(0.0, |(left, glyph)| left + font.h_advance_unscaled(glyph)) * height / CAPITAL
}

/// Draws a line of text with capitals of `height` pixels and its top left at `at`, with a dark rim so that it is
/// readable on any background. A letter that the font lacks is drawn as a box.
pub(crate) fn draw_text(picture: &mut Pixmap, text: &str, at: [f32; 2], height: f32, [red, green, blue]: [u8; 3]) {
    let Some(path) = FONT.as_ref().and_then(|font| outline(font, text, at, height)) else { return };
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(Color::from_rgba8(0, 0, 0, 200));
    let rim = Stroke { width: 0.3 * height, line_join: LineJoin::Round, ..Stroke::default() };
    picture.stroke_path(&path, &paint, &rim, Transform::identity(), None);
    paint.set_color(Color::from_rgba8(red, green, blue, 255));
    picture.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
}

/// The left edge of every letter, in font units, and its glyph.
fn placed<'t>(font: &'t FontRef<'static>, text: &'t str) -> impl Iterator<Item = (f32, ab_glyph::GlyphId)> + 't {
    let mut end = 0.0;
    let mut before = None;
    text.chars().filter(|letter| !letter.is_control()).map(move |letter| {
        let glyph = font.glyph_id(letter);
        let left = end + before.map_or(0.0, |before| font.kern_unscaled(before, glyph));
        before = Some(glyph);
        end = left + font.h_advance_unscaled(glyph);
        (left, glyph)
    })
}

fn outline(font: &FontRef<'static>, text: &str, [x, y]: [f32; 2], height: f32) -> Option<Path> {
    let scale = height / CAPITAL;
    let mut path = PathBuilder::new();
    for (left, glyph) in placed(font, text) {
        // the font's y axis points up from the baseline
        let place = |point: Point| (x + scale * (left + point.x), y + height - scale * point.y);
        let mut pen: Option<Point> = None;
        for curve in font.outline(glyph).into_iter().flat_map(|outline| outline.curves) {
            let (from, to) = match curve {
                OutlineCurve::Line(from, to) | OutlineCurve::Quad(from, _, to) | OutlineCurve::Cubic(from, .., to) => {
                    (from, to)
                }
            };
            if pen != Some(from) {
                if pen.is_some() {
                    path.close();
                }
                let (x, y) = place(from);
                path.move_to(x, y);
            }
            pen = Some(to);
            let (x, y) = place(to);
            match curve {
                OutlineCurve::Line(..) => path.line_to(x, y),
                OutlineCurve::Quad(_, control, _) => {
                    let (x1, y1) = place(control);
                    path.quad_to(x1, y1, x, y);
                }
                OutlineCurve::Cubic(_, first, second, _) => {
                    let ((x1, y1), (x2, y2)) = (place(first), place(second));
                    path.cubic_to(x1, y1, x2, y2, x, y);
                }
            }
        }
        if pen.is_some() {
            path.close();
        }
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Left, top, right and bottom of what is bright.
    fn inked(text: &str) -> [f32; 4] {
        let mut picture = Pixmap::new(200, 60).unwrap();
        draw_text(&mut picture, text, [10.0, 20.0], 18.0, [255, 255, 255]);
        let bright = picture.pixels().iter().enumerate().filter(|(_, pixel)| pixel.red() > 128);
        let places = bright.map(|(index, _)| [(index % 200) as f32, (index / 200) as f32]);
        places.fold([f32::MAX, f32::MAX, 0.0, 0.0], |[l, t, r, b], [x, y]| [l.min(x), t.min(y), r.max(x), b.max(y)])
    }

    #[test]
    fn capitals_have_the_requested_height_and_text_stays_within_its_width() {
        let [left, top, right, bottom] = inked("MM H");
        // 18 rows from 20 on, to the pixel
        assert_eq!([top, bottom], [20.0, 37.0]);
        // letters begin and end at the font's outlines, which have a little space on either side
        let font = FONT.as_ref().unwrap();
        let scale = 18.0 / CAPITAL;
        let drawn = |letter: char| font.outline(font.glyph_id(letter)).unwrap().bounds;
        let (begin, last) = (10.0 + scale * drawn('M').min.x, placed(font, "MM H").last().unwrap().0);
        let end = 10.0 + scale * (last + drawn('H').max.x);
        // a pixel is bright if half of it is covered, in steps of a quarter
        assert!((left - begin).abs() <= 0.75 && (right + 1.0 - end).abs() <= 0.75, "{left} {begin}, {right} {end}");
        assert!(begin > 10.0 && end < 10.0 + text_width("MM H", 18.0), "within its width");
    }

    #[test]
    fn small_letters_are_small_and_reach_below_the_line() {
        let ([_, x, ..], [.., g]) = (inked("x"), inked("g"));
        assert!(x > 23.0 && g > 40.0, "{x} {g}");
        assert_ne!(inked("e"), inked("E"), "lower case differs from upper case");
    }

    #[test]
    fn the_font_has_all_letters_that_pages_use() {
        let font = FONT.as_ref().unwrap();
        for letter in ('a'..='z').chain('A'..='Z').chain('0'..='9').chain(".,:;-–/%=<>()±²³°·µλ×éüßñ'\"&+_".chars())
        {
            assert_ne!(font.glyph_id(letter).0, 0, "{letter}");
        }
        assert_eq!(font.glyph_id('\u{4e2d}').0, 0);
        assert!(text_width("\u{4e2d}", 10.0) > 0.0, "a box");
        assert_eq!([text_width("", 10.0), text_width("\n", 10.0)], [0.0; 2]);
    }

    #[test]
    fn the_hole_of_a_letter_stays_open() {
        let mut picture = Pixmap::new(60, 60).unwrap();
        draw_text(&mut picture, "O", [10.0, 10.0], 40.0, [255, 255, 255]);
        assert!(picture.pixel(10 + (text_width("O", 40.0) / 2.0) as u32, 30).unwrap().red() < 60);
    }
}
