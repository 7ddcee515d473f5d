//! Letters for pictures: strokes on a grid, capitals and figures only.

use tiny_skia::{Color, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// Grid units from one letter to the next; letters are 4 wide and 6 high.
const ADVANCE: f32 = 5.6;

/// Strokes of a letter: points `xy` on the grid (x to the right, y down), a space between points, a bar between
/// strokes.
fn strokes(letter: char) -> &'static str {
    match letter.to_ascii_uppercase() {
        'A' => "06 20 46|14 34",
        'B' => "00 06 36 45 44 33 03|33 42 41 30 00",
        'C' => "41 30 10 01 05 16 36 45",
        'D' => "00 06 26 44 42 20 00",
        'E' => "40 00 06 46|03 33",
        'F' => "40 00 06|03 33",
        'G' => "41 30 10 01 05 16 36 45 43 23",
        'H' => "00 06|40 46|03 43",
        'I' => "10 30|20 26|16 36",
        'J' => "40 45 36 16 05",
        'K' => "00 06|40 03 46",
        'L' => "00 06 46",
        'M' => "06 00 23 40 46",
        'N' => "06 00 46 40",
        'O' => "10 30 41 45 36 16 05 01 10",
        'P' => "06 00 30 41 42 33 03",
        'Q' => "10 30 41 45 36 16 05 01 10|24 46",
        'R' => "06 00 30 41 42 33 03|23 46",
        'S' => "41 30 10 01 02 13 33 44 45 36 16 05",
        'T' => "00 40|20 26",
        'U' => "00 05 16 36 45 40",
        'V' => "00 26 40",
        'W' => "00 16 23 36 40",
        'X' => "00 46|40 06",
        'Y' => "00 23 40|23 26",
        'Z' => "00 40 06 46",
        '0' => "10 30 41 45 36 16 05 01 10|33 13",
        '1' => "01 20 26|06 46",
        '2' => "01 10 30 41 42 06 46",
        '3' => "01 10 30 41 42 33 44 45 36 16 05|33 23",
        '4' => "36 30 04 44",
        '5' => "40 00 02 32 43 45 36 06",
        '6' => "40 20 02 05 16 36 45 44 33 03",
        '7' => "00 40 16",
        '8' => "13 02 01 10 30 41 42 33 13 04 05 16 36 45 44 33",
        '9' => "43 13 02 01 10 30 41 44 26 06",
        '.' => "25 26",
        '-' => "13 33",
        '_' => "06 46",
        ':' => "21 22|25 26",
        '/' => "06 40",
        ',' => "25 17",
        '(' => "30 11 15 36",
        ')' => "10 31 35 16",
        '+' => "13 33|22 24",
        '=' => "12 32|14 34",
        '<' => "31 13 35",
        '>' => "11 33 15",
        '"' => "10 12|30 32",
        '\'' => "20 22",
        ';' => "21 22|25 17",
        '&' => "46 11 20 31 04 05 16 26 43",
        '±' => "12 32|21 23|15 35",
        '²' => "10 20 21 13 33",
        '³' => "10 30 21 32 13",
        '°' => "10 20 21 11 10",
        '%' => "06 40|00 10 11 01 00|35 45 46 36 35",
        _ => "",
    }
}

/// Width of a line of text whose letters are `height` pixels high.
pub(super) fn text_width(text: &str, height: f32) -> f32 {
    let count = text.chars().count() as f32;
    (count * ADVANCE - (ADVANCE - 4.0)).max(0.0) * height / 6.0
}

/// Writes a line of text with its top left corner at `at`, letters `height` pixels high; unknown letters stay blank.
pub(super) fn draw_text(picture: &mut Pixmap, text: &str, at: [f32; 2], height: f32, [red, green, blue]: [u8; 3]) {
    let unit = height / 6.0;
    let mut path = PathBuilder::new();
    for (place, letter) in text.chars().enumerate() {
        let left = at[0] + place as f32 * ADVANCE * unit;
        for stroke in strokes(letter).split('|') {
            for (index, point) in stroke.split(' ').filter_map(grid_point).enumerate() {
                let (x, y) = (left + point[0] * unit, at[1] + point[1] * unit);
                if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
        }
    }
    let Some(path) = path.finish() else { return };
    stroke_with(picture, &path, Color::from_rgba8(0, 0, 0, 200), 0.42 * height);
    stroke_with(picture, &path, Color::from_rgba8(red, green, blue, 255), 0.13 * height);
}

fn stroke_with(picture: &mut Pixmap, path: &Path, colour: Color, width: f32) {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(colour);
    let stroke = Stroke { width, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
    picture.stroke_path(path, &paint, &stroke, Transform::identity(), None);
}

fn grid_point(point: &str) -> Option<[f32; 2]> {
    let mut digits = point.chars().filter_map(|c| c.to_digit(10));
    Some([digits.next()? as f32, digits.next()? as f32])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_capital_and_figure_has_strokes_inside_its_grid() {
        for letter in ('A'..='Z').chain('0'..='9').chain(".-_:/%=<>".chars()) {
            let points: Vec<_> = strokes(letter).split('|').flat_map(|s| s.split(' ')).map(grid_point).collect();
            assert!(points.len() > 1, "{letter} has no stroke");
            assert!(points.iter().all(|p| p.is_some_and(|[x, y]| x <= 4.0 && y <= 6.0)), "{letter} leaves its grid");
        }
    }

    #[test]
    fn text_stays_within_its_width() {
        let mut picture = Pixmap::new(200, 40).unwrap();
        let width = text_width("MM 8", 18.0);
        draw_text(&mut picture, "MM 8", [10.0, 10.0], 18.0, [255, 255, 255]);
        let inked = picture.pixels().iter().enumerate().filter(|(_, p)| p.red() > 128).map(|(i, _)| (i % 200) as f32);
        let (left, right) = inked.fold((f32::MAX, 0.0_f32), |(l, r), x| (l.min(x), r.max(x)));
        assert!((left - 10.0).abs() < 3.0 && (right - 10.0 - width).abs() < 3.0, "{left} {right} {width}");
    }
}
