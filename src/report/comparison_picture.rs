//! A comparison of methods in one picture, for messages and slides: verdict, errors with intervals, errors over time.

use tiny_skia::Pixmap;

use super::ReportError;
use super::comparison::{COLOURS, ComparedMethod, ComparisonInput, by_rank, error_plot, error_with_ends, verdict};
use super::drawing::{
    CARD, FAINT, FLOOR, INK, MARGIN, WIDTH, dot, draw_head, draw_text_to, encoded, fill, fitting, new_sheet, stroke,
    wrapped,
};
use super::input::describe_bodies;
use super::lettering::draw_text;
use super::plots::Size;
use super::summary_picture::PLOT_SCALE;

/// Maximum number of methods with a row and a line.
const MOST: usize = 30;
const ROW: f32 = 34.0;
const PLOT_HEIGHT: f32 = 340.0;

/// The picture as PNG, 1200 pixels wide; methods sorted by error.
///
/// # Errors
/// [`ReportError`] without a method, or if drawing fails.
pub fn comparison_picture(input: &ComparisonInput<'_>) -> Result<Vec<u8>, ReportError> {
    let mut methods: Vec<ComparedMethod> = input.methods.to_vec();
    methods.sort_by(by_rank);
    if methods.is_empty() {
        return Err(ReportError::NoRun);
    }
    let room = WIDTH as f32 - 2.0 * MARGIN;
    let words = wrapped(&verdict(&methods.iter().collect::<Vec<_>>()), 16.0, room);
    methods.truncate(MOST);
    let list_top = 104.0 + 28.0 * words.len() as f32;
    let plot_top = list_top + 60.0 + ROW * methods.len() as f32;
    let mut picture = new_sheet(WIDTH, (plot_top + PLOT_HEIGHT + MARGIN).ceil() as u32)?;
    let (seeds, plural) = (input.seeds, if input.seeds == 1 { "" } else { "s" });
    let bodies = describe_bodies(input.matched);
    let about = format!("{} methods, {} frames, {seeds} seed{plural}, {bodies}", input.methods.len(), input.frames);
    draw_head(&mut picture, input.title, &about, &words, 16.0);
    rows(&mut picture, &methods, [MARGIN, list_top, room]);
    fill(&mut picture, [MARGIN, plot_top, room, PLOT_HEIGHT], CARD, 255);
    let size = Size { width: ((room - 28.0) / PLOT_SCALE) as u32, height: ((PLOT_HEIGHT - 20.0) / PLOT_SCALE) as u32 };
    error_plot(&methods).drawing(size).draw_on(&mut picture, [MARGIN + 14.0, plot_top + 10.0], PLOT_SCALE);
    encoded(&picture)
}

fn rows(picture: &mut Pixmap, methods: &[ComparedMethod], [left, top, room]: [f32; 3]) {
    fill(picture, [left, top, room, 40.0 + ROW * methods.len() as f32], CARD, 255);
    let title = "mean marker error and its 95 % interval, mm; vertical line: a tracker that never moves";
    draw_text(picture, title, [left + 14.0, top + 14.0], 11.0, FAINT);
    // a very wide interval must not squeeze all others
    let ends = methods.iter().filter_map(error_with_ends).map(|(mean, [_, high])| high.min(2.0 * mean));
    let greatest = ends.fold(1e-9, f64::max);
    let (from, width) = (left + 0.34 * room, 0.5 * room);
    let x = |value: f64| from + width * (value / greatest).clamp(0.0, 1.0) as f32;
    let colours = COLOURS.iter().map(|colour| colour.on_dark()).cycle();
    for ((method, colour), row) in methods.iter().zip(colours).zip(0_u8..) {
        let above = top + 38.0 + f32::from(row) * ROW;
        let name = method.name.replace('_', " ");
        draw_text(picture, &name, [left + 14.0, above + 8.0], fitting(&name, 13.0, 0.31 * room), INK);
        let Some((mean, ends)) = error_with_ends(method) else {
            draw_text(picture, "no error measured", [from, above + 8.0], 12.0, FAINT);
            continue;
        };
        if let Some(floor) = method.frozen.get("humaneva_mm").filter(|floor| **floor <= greatest) {
            stroke(picture, &[[x(*floor), above + 2.0], [x(*floor), above + ROW - 6.0]], FLOOR, 1.6, false);
        }
        stroke(picture, &ends.map(|end| [x(end), above + 14.0]), colour, 5.0, false);
        dot(picture, [x(mean), above + 14.0], 6.0, colour);
        draw_text_to(picture, &format!("{mean:.1} mm"), [left + room - 14.0, above + 8.0], 13.0, INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, with_input};

    #[test]
    fn the_picture_of_a_comparison_has_a_bar_and_a_line_for_every_method() {
        let summary = with_input(&Story { seeds: 3, ..Story::default() }, |input| input.summary.clone());
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
        for colour in COLOURS[..2].iter().map(|colour| colour.on_dark()) {
            let drawn = picture.pixels().iter().filter(|p| [p.red(), p.green(), p.blue()] == colour).count();
            assert!(drawn > 500, "bar, dot and line are drawn: {drawn}");
        }
        let medians = [(0.0, None), (1.0, Some(10.0)), (2.0, Some(15.0)), (3.0, Some(10.0))];
        assert_eq!(error_plot(&methods).lines[0].points, medians);
        let nothing = ComparisonInput { methods: &[], ..input };
        assert!(matches!(comparison_picture(&nothing), Err(ReportError::NoRun)));
    }
}
