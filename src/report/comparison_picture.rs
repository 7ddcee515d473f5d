//! Methods side by side in one picture: verdict, errors with their intervals, errors over the frames. For messages and
//! slides.

use tiny_skia::Pixmap;

use super::ReportError;
use super::cell::{colour, new_picture};
use super::comparison::{ComparedMethod, ComparisonInput, error_of, verdict};
use super::drawing::{
    CARD, FAINT, FLOOR, GRID, INK, LINE, MARGIN, PAPER, WIDTH, dot, draw_text_about, draw_text_to, encoded, fill,
    fitting, stroke, wrapped,
};
use super::lettering::draw_text;
use super::round_ticks::round_ticks;
use crate::evaluation::quantile;

/// Methods that have a row and a line.
const MOST: usize = 30;
const ROW: f32 = 34.0;
const PLOT_HEIGHT: f32 = 320.0;
const COLOURS: [[u8; 3]; 7] = [
    LINE,
    [0xf0, 0x9a, 0x4a],
    [0x5f, 0xc9, 0x8f],
    [0xee, 0x6a, 0x6a],
    [0xb9, 0x93, 0xf0],
    [0xe6, 0xc8, 0x4d],
    [0xd5, 0xdd, 0xe5],
];

/// The picture as PNG, 1200 pixels wide; methods sorted by error.
///
/// # Errors
/// [`ReportError`] without a method, or where nothing can be drawn.
pub fn comparison_picture(input: &ComparisonInput<'_>) -> Result<Vec<u8>, ReportError> {
    let mut methods: Vec<&ComparedMethod> = input.methods.iter().collect();
    methods.sort_by(|a, b| error_of(a).total_cmp(&error_of(b)));
    if methods.is_empty() {
        return Err(ReportError::NoRun);
    }
    let room = WIDTH as f32 - 2.0 * MARGIN;
    let words = wrapped(&verdict(&methods), 16.0, room);
    methods.truncate(MOST);
    let list_top = 104.0 + 28.0 * words.len() as f32;
    let plot_top = list_top + 60.0 + ROW * methods.len() as f32;
    let mut picture = new_picture(WIDTH, (plot_top + PLOT_HEIGHT + MARGIN).ceil() as u32)?;
    picture.fill(colour(PAPER));
    draw_text(&mut picture, input.title, [MARGIN, 26.0], fitting(input.title, 30.0, room), INK);
    let (seeds, plural) = (input.seeds, if input.seeds == 1 { "" } else { "s" });
    let model = if input.matched { "matched model" } else { "mismatched model" };
    let about = format!("{} methods, {} frames, {seeds} seed{plural}, {model}", input.methods.len(), input.frames);
    draw_text(&mut picture, &about, [MARGIN, 70.0], fitting(&about, 14.0, room), FAINT);
    for (line, index) in words.iter().zip(0_u8..) {
        draw_text(&mut picture, line, [MARGIN, 100.0 + 28.0 * f32::from(index)], 16.0, INK);
    }
    rows(&mut picture, &methods, [MARGIN, list_top, room]);
    lines(&mut picture, &methods, [MARGIN, plot_top, room, PLOT_HEIGHT]);
    encoded(&picture)
}

fn rows(picture: &mut Pixmap, methods: &[&ComparedMethod], [left, top, room]: [f32; 3]) {
    fill(picture, [left, top, room, 40.0 + ROW * methods.len() as f32], CARD, 255);
    let title = "mean marker error and its 95 % interval, mm; upright line: a tracker that never moves";
    draw_text(picture, title, [left + 14.0, top + 14.0], 11.0, FAINT);
    let error = |method: &ComparedMethod| {
        let error = method.summary.metrics.get("humaneva_mm")?;
        Some((error.mean, error.ci95.map_or([error.mean; 2], |ends| [ends.low, ends.high])))
    };
    // an interval of three wild seeds must not squeeze all others
    let ends = methods.iter().filter_map(|method| error(method)).map(|(mean, [_, high])| high.min(2.0 * mean));
    let greatest = ends.fold(1e-9, f64::max);
    let (from, width) = (left + 0.34 * room, 0.5 * room);
    let x = |value: f64| from + width * (value / greatest).clamp(0.0, 1.0) as f32;
    for ((method, colour), row) in methods.iter().zip(COLOURS.iter().cycle()).zip(0_u8..) {
        let above = top + 38.0 + f32::from(row) * ROW;
        let name = method.name.replace('_', " ");
        draw_text(picture, &name, [left + 14.0, above + 8.0], fitting(&name, 13.0, 0.31 * room), INK);
        let Some((mean, ends)) = error(method) else {
            draw_text(picture, "no error measured", [from, above + 8.0], 12.0, FAINT);
            continue;
        };
        if let Some(floor) = method.frozen.get("humaneva_mm").filter(|floor| **floor <= greatest) {
            stroke(picture, &[[x(*floor), above + 2.0], [x(*floor), above + ROW - 6.0]], FLOOR, 1.6, false);
        }
        stroke(picture, &ends.map(|end| [x(end), above + 14.0]), *colour, 5.0, false);
        dot(picture, [x(mean), above + 14.0], 6.0, *colour);
        draw_text_to(picture, &format!("{mean:.1} mm"), [left + room - 14.0, above + 8.0], 13.0, INK);
    }
}

/// Median of the seeds' errors over the frames.
fn lines(picture: &mut Pixmap, methods: &[&ComparedMethod], [left, top, width, height]: [f32; 4]) {
    fill(picture, [left, top, width, height], CARD, 255);
    draw_text(
        picture,
        "mean marker error over the frames, median of the seeds, mm",
        [left + 14.0, top + 12.0],
        11.0,
        FAINT,
    );
    let frames = methods.iter().flat_map(|method| &method.errors).map(Vec::len).max().unwrap_or(0);
    let courses: Vec<Vec<(usize, f64)>> = methods.iter().map(|method| median(method, frames)).collect();
    let greatest = courses.iter().flatten().map(|(_, error)| *error).fold(10.0, f64::max);
    let area = [left + 56.0, top + 40.0, width - 76.0, height - 80.0];
    let x = |frame: usize| area[0] + area[2] * frame as f32 / frames.saturating_sub(1).max(1) as f32;
    let y = |value: f64| area[1] + area[3] * (1.0 - (value / greatest) as f32);
    for (value, words) in round_ticks([0.0, greatest]) {
        stroke(picture, &[[area[0], y(value)], [area[0] + area[2], y(value)]], GRID, 1.0, false);
        draw_text_to(picture, &words, [area[0] - 8.0, y(value) - 5.0], 10.0, FAINT);
    }
    for tick in 0_u8..=4 {
        let frame = usize::from(tick) * frames.saturating_sub(1) / 4;
        let place = [x(frame).min(left + width - 48.0), area[1] + area[3] + 10.0];
        draw_text_about(picture, &format!("frame {frame}"), place, 10.0, FAINT);
    }
    for (course, colour) in courses.iter().zip(COLOURS.iter().cycle()) {
        let points: Vec<[f32; 2]> = course.iter().map(|(frame, error)| [x(*frame), y(*error)]).collect();
        stroke(picture, &points, *colour, 2.2, false);
    }
}

fn median(method: &ComparedMethod, frames: usize) -> Vec<(usize, f64)> {
    let at = |frame: usize| {
        let mut present: Vec<f64> =
            method.errors.iter().filter_map(|seed| seed.get(frame).copied().flatten()).collect();
        present.sort_by(f64::total_cmp);
        Some((frame, quantile(&present, 0.5)?))
    };
    (0..frames).filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, told};

    #[test]
    fn the_picture_of_a_comparison_has_a_bar_and_a_line_for_every_method() {
        let summary = told(&Story { seeds: 3, ..Story::default() }, |input| input.summary.clone());
        let method = |name: &str, error: f64| ComparedMethod {
            name: name.to_owned(),
            tracker: "a tracker".to_owned(),
            summary: summary.clone(),
            knows_truth: false,
            frozen: [("humaneva_mm".to_owned(), 1.0)].into(),
            errors: vec![vec![None, Some(error), Some(error + 5.0), Some(error)]; 3],
        };
        let methods = [method("first_one", 10.0), method("second_one", 30.0)];
        let input = ComparisonInput { title: "Walk", frames: 4, seeds: 3, matched: false, methods: &methods };
        let bytes = comparison_picture(&input).unwrap();
        if let Some(path) = std::env::var_os("SKIAGRAPH_COMPARISON_PICTURE") {
            std::fs::write(path, &bytes).unwrap();
        }
        assert!(String::from_utf8_lossy(&bytes[..200]).contains("Software\0skiagraph "));
        let picture = Pixmap::decode_png(&bytes).unwrap();
        assert_eq!(picture.width(), WIDTH);
        for colour in &COLOURS[..2] {
            let drawn = picture.pixels().iter().filter(|p| [p.red(), p.green(), p.blue()] == *colour).count();
            assert!(drawn > 500, "bar, dot and line are drawn: {drawn}");
        }
        assert_eq!(median(&methods[0], 4), [(1, 10.0), (2, 15.0), (3, 10.0)]);
        let nothing = ComparisonInput { methods: &[], ..input };
        assert!(matches!(comparison_picture(&nothing), Err(ReportError::NoRun)));
    }
}
