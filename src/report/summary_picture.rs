//! A run in one picture: verdict, main figures, error over time, chosen frames. For messages and slides.

use tiny_skia::{FilterQuality, Pixmap, PixmapPaint, Transform};

use super::ReportError;
use super::cell::{colour, new_picture};
use super::displayed::{interval_in_words, number, symbol};
use super::drawing::{
    CARD, FAINT, FLOOR, GRID, INK, LINE, MARGIN, PAPER, WIDTH, encoded, fill, fill_outline, fitting, stroke, wrapped,
};
use super::lettering::{draw_text, text_width};
use super::round_ticks::round_ticks;
use crate::evaluation::{MetricSummary, Summary, quantile};

const TILE_HEIGHT: f32 = 96.0;
const PLOT_HEIGHT: f32 = 250.0;

/// Figures on the picture with their names.
const TILES: [(&str, &str); 6] = [
    ("humaneva_mm", "marker error"),
    ("lost_limb", "frames, limb over 150 mm off"),
    ("pa_mpjpe_mm", "after alignment"),
    ("body_orientation_deg", "trunk orientation"),
    ("silhouette_iou", "silhouette overlap"),
    ("track_loss", "frames far off (mean > 150 mm)"),
];

/// What the picture shows.
#[derive(Clone, Copy, Debug)]
pub struct SummaryPicture<'a> {
    /// Above all: the scenario's name.
    pub title: &'a str,
    /// Tracker, frames, seeds.
    pub about: &'a str,
    /// The verdict's line.
    pub verdict: &'a str,
    /// The metrics.
    pub summary: &'a Summary,
    /// Mean error of a tracker that never moves, mm.
    pub frozen_mm: Option<f64>,
    /// Error (HumanEva, mm) of every seed over the frames.
    pub errors: &'a [Vec<Option<f64>>],
    /// A PNG of chosen frames.
    pub sheet: Option<&'a [u8]>,
}

/// The picture as PNG, 1200 pixels wide.
///
/// # Errors
/// [`ReportError`] where the sheet is no PNG or nothing can be drawn.
pub fn summary_picture(input: &SummaryPicture<'_>) -> Result<Vec<u8>, ReportError> {
    let room = WIDTH as f32 - 2.0 * MARGIN;
    let verdict = wrapped(input.verdict, 17.0, room);
    let sheet = input.sheet.map(Pixmap::decode_png).transpose().map_err(|e| ReportError::Png(e.to_string()))?;
    let scale = sheet.as_ref().map_or(0.0, |sheet| (room / sheet.width() as f32).min(1.0));
    let head = 104.0 + 28.0 * verdict.len() as f32;
    let below_tiles = head + TILE_HEIGHT + 24.0;
    let below_plot = below_tiles + PLOT_HEIGHT + 20.0;
    let height = below_plot + sheet.as_ref().map_or(0.0, |sheet| scale * sheet.height() as f32 + 24.0) + 12.0;
    let mut picture = new_picture(WIDTH, height.ceil() as u32)?;
    picture.fill(colour(PAPER));
    draw_text(&mut picture, input.title, [MARGIN, 26.0], fitting(input.title, 30.0, room), INK);
    draw_text(&mut picture, input.about, [MARGIN, 70.0], fitting(input.about, 14.0, room), FAINT);
    for (line, top) in verdict.iter().zip(0_u8..) {
        draw_text(&mut picture, line, [MARGIN, 100.0 + 28.0 * f32::from(top)], 17.0, INK);
    }
    tiles(&mut picture, input.summary, head, room);
    plot(&mut picture, input, [MARGIN, below_tiles, room, PLOT_HEIGHT]);
    if let Some(sheet) = sheet {
        let paint = PixmapPaint { quality: FilterQuality::Bicubic, ..PixmapPaint::default() };
        let place = Transform::from_row(scale, 0.0, 0.0, scale, MARGIN, below_plot);
        picture.draw_pixmap(0, 0, sheet.as_ref(), &paint, place, None);
    }
    encoded(&picture)
}

fn tiles(picture: &mut Pixmap, summary: &Summary, top: f32, room: f32) {
    let present: Vec<(&MetricSummary, &str)> =
        TILES.iter().filter_map(|(name, title)| Some((summary.metrics.get(*name)?, *title))).collect();
    let width = (room - 12.0 * (TILES.len() - 1) as f32) / TILES.len() as f32;
    for ((metric, title), place) in present.iter().zip(0_u8..) {
        let left = MARGIN + f32::from(place) * (width + 12.0);
        fill(picture, [left, top, width, TILE_HEIGHT], CARD, 255);
        let value = format!("{} {}", number(metric.mean, metric.unit), symbol(metric.unit));
        draw_text(picture, &value, [left + 14.0, top + 16.0], 22.0, INK);
        let interval = interval_in_words(metric);
        draw_text(picture, &interval, [left + 14.0, top + 50.0], fitting(&interval, 11.0, width - 28.0), FAINT);
        draw_text(picture, title, [left + 14.0, top + 72.0], fitting(title, 12.0, width - 28.0), FAINT);
    }
}

/// Median and range of the seeds' errors over the frames, and the floor.
fn plot(picture: &mut Pixmap, input: &SummaryPicture<'_>, [left, top, width, height]: [f32; 4]) {
    fill(picture, [left, top, width, height], CARD, 255);
    draw_text(picture, "mean marker error, mm", [left + 14.0, top + 12.0], 12.0, FAINT);
    let frames = input.errors.iter().map(Vec::len).max().unwrap_or(0);
    let sorted = |frame: usize| {
        let mut present: Vec<f64> = input.errors.iter().filter_map(|seed| seed.get(frame).copied().flatten()).collect();
        present.sort_by(f64::total_cmp);
        present
    };
    let all: Vec<(usize, Vec<f64>)> = (0..frames).map(|f| (f, sorted(f))).filter(|(_, v)| !v.is_empty()).collect();
    let greatest = all.iter().filter_map(|(_, values)| values.last()).fold(10.0_f64, |a, b| a.max(*b));
    let floor = input.frozen_mm.filter(|floor| *floor < 1.6 * greatest);
    let above = 1.08 * greatest.max(floor.unwrap_or(0.0));
    let area = [left + 56.0, top + 38.0, width - 76.0, height - 76.0];
    let x = |frame: usize| area[0] + area[2] * frame as f32 / frames.saturating_sub(1).max(1) as f32;
    let y = |value: f64| area[1] + area[3] * (1.0 - (value / above) as f32);
    for (value, words) in round_ticks([0.0, above]) {
        stroke(picture, &[[area[0], y(value)], [area[0] + area[2], y(value)]], GRID, 1.0, false);
        let place = [area[0] - 8.0 - text_width(&words, 10.0), y(value) - 5.0];
        draw_text(picture, &words, place, 10.0, FAINT);
    }
    for tick in 0_u8..=4 {
        let frame = usize::from(tick) * frames.saturating_sub(1) / 4;
        let words = format!("frame {frame}");
        let place = [
            (x(frame) - 0.5 * text_width(&words, 10.0)).min(left + width - 8.0 - text_width(&words, 10.0)),
            top + height - 24.0,
        ];
        draw_text(picture, &words, place, 10.0, FAINT);
    }
    if input.errors.len() > 1 {
        let upper = all.iter().filter_map(|(frame, values)| Some([x(*frame), y(*values.last()?)]));
        let lower = all.iter().rev().filter_map(|(frame, values)| Some([x(*frame), y(*values.first()?)]));
        fill_outline(picture, &upper.chain(lower).collect::<Vec<_>>(), LINE, 70);
    }
    if let Some(floor) = floor {
        stroke(picture, &[[area[0], y(floor)], [area[0] + area[2], y(floor)]], FLOOR, 1.6, true);
        draw_text(picture, "never moves", [area[0] + 8.0, y(floor) - 16.0], 10.0, FLOOR);
    }
    let median: Vec<[f32; 2]> = all.iter().filter_map(|(f, v)| Some([x(*f), y(quantile(v, 0.5)?)])).collect();
    stroke(picture, &median, LINE, 2.4, false);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, told, walking_sheet};
    use crate::report::{contact_sheet, verdict};

    #[test]
    fn the_picture_holds_verdict_figures_error_and_frames_and_carries_our_mark() {
        let rig = crate::report::fixture::rig(2);
        let sheet = contact_sheet(&walking_sheet(&rig, &[1, 20, 40])).unwrap();
        let bytes = told(&Story { seeds: 3, ..Story::default() }, |input| {
            let per_frame =
                |run: &crate::report::ReportRun<'_>| run.run.evaluation.metrics["humaneva_mm"].per_frame.clone();
            let errors: Vec<_> = input.runs.iter().map(per_frame).collect();
            let verdict = verdict(input).line;
            let shown = SummaryPicture {
                title: "Walk",
                about: "annealed particle filter, 121 frames, 3 seeds",
                verdict: &verdict,
                summary: input.summary,
                frozen_mm: Some(400.0),
                errors: &errors,
                sheet: Some(&sheet),
            };
            summary_picture(&shown).unwrap()
        });
        if let Some(path) = std::env::var_os("SKIAGRAPH_REPORT_PICTURE") {
            std::fs::write(path, &bytes).unwrap();
        }
        assert!(String::from_utf8_lossy(&bytes[..200]).contains("Software\0skiagraph "));
        let picture = Pixmap::decode_png(&bytes).unwrap();
        assert!(picture.width() == WIDTH && picture.height() > 700, "{}", picture.height());
        let blue = picture.pixels().iter().filter(|p| [p.red(), p.green(), p.blue()] == LINE).count();
        assert!(blue > 500, "the line is drawn: {blue}");
        let refused = told(&Story::default(), |input| {
            let shown = SummaryPicture {
                title: "",
                about: "",
                verdict: "",
                summary: input.summary,
                frozen_mm: None,
                errors: &[],
                sheet: Some(b"no picture"),
            };
            summary_picture(&shown).map(drop)
        });
        assert!(refused.is_err());
    }

    #[test]
    fn long_text_is_wrapped_between_words() {
        let lines =
            wrapped("Good: the mean marker error is 12 mm. Limited by: nothing at all that can be told", 17.0, 400.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| text_width(line, 17.0) <= 400.0), "{lines:?}");
        assert_eq!(wrapped("", 17.0, 400.0), Vec::<String>::new());
    }
}
