//! A run in one picture, for messages and slides: verdict, main metrics, error over time, selected frames.

use tiny_skia::{FilterQuality, Pixmap, PixmapPaint, Transform};

use super::ReportError;
use super::comparison::median_line;
use super::displayed::{describe_interval, number, symbol};
use super::drawing::{CARD, FAINT, INK, MARGIN, WIDTH, draw_head, encoded, fill, fitting, new_sheet, wrapped};
use super::lettering::draw_text;
use super::plots::{Colour, Line, LinePlot, Size, Stroke};
use crate::evaluation::{MetricSummary, Summary};

const TILE_HEIGHT: f32 = 96.0;
const PLOT_HEIGHT: f32 = 270.0;

/// Picture pixels per CSS pixel of a plot.
pub(super) const PLOT_SCALE: f32 = 1.2;

/// Metrics on the picture with their names.
const TILES: [(&str, &str); 6] = [
    ("humaneva_mm", "marker error"),
    ("lost_limb", "frames, limb over 150 mm off"),
    ("pa_mpjpe_mm", "after alignment"),
    ("body_orientation_deg", "trunk orientation"),
    ("silhouette_iou", "silhouette overlap"),
    ("track_loss", "frames in stretches > 150 mm"),
];

/// The content of the picture.
#[derive(Clone, Copy, Debug)]
pub struct SummaryPicture<'a> {
    /// The scenario's name.
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
    /// A PNG of selected frames.
    pub sheet: Option<&'a [u8]>,
}

/// The picture as PNG, 1200 pixels wide.
///
/// # Errors
/// [`ReportError`] if the sheet is not a PNG or drawing fails.
pub fn summary_picture(input: &SummaryPicture<'_>) -> Result<Vec<u8>, ReportError> {
    let room = WIDTH as f32 - 2.0 * MARGIN;
    let verdict = wrapped(input.verdict, 17.0, room);
    let sheet = input.sheet.map(Pixmap::decode_png).transpose().map_err(|e| ReportError::Png(e.to_string()))?;
    let scale = sheet.as_ref().map_or(0.0, |sheet| (room / sheet.width() as f32).min(1.0));
    let head = 104.0 + 28.0 * verdict.len() as f32;
    let below_tiles = head + TILE_HEIGHT + 24.0;
    let below_plot = below_tiles + PLOT_HEIGHT + 20.0;
    let height = below_plot + sheet.as_ref().map_or(0.0, |sheet| scale * sheet.height() as f32 + 24.0) + 12.0;
    let mut picture = new_sheet(WIDTH, height.ceil() as u32)?;
    draw_head(&mut picture, input.title, input.about, &verdict, 17.0);
    tiles(&mut picture, input.summary, head, room);
    fill(&mut picture, [MARGIN, below_tiles, room, PLOT_HEIGHT], CARD, 255);
    let size = Size { width: ((room - 28.0) / PLOT_SCALE) as u32, height: ((PLOT_HEIGHT - 20.0) / PLOT_SCALE) as u32 };
    plot(input).drawing(size).draw_on(&mut picture, [MARGIN + 14.0, below_tiles + 10.0], PLOT_SCALE);
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
        let interval = describe_interval(metric);
        draw_text(picture, &interval, [left + 14.0, top + 50.0], fitting(&interval, 11.0, width - 28.0), FAINT);
        draw_text(picture, title, [left + 14.0, top + 72.0], fitting(title, 12.0, width - 28.0), FAINT);
    }
}

/// Median and range over seeds of the error over time, and the error of a tracker that never moves.
fn plot(input: &SummaryPicture<'_>) -> LinePlot {
    let tracker = median_line("tracker", Stroke::solid(Colour::Blue), input.errors, |frame| frame as f64);
    let greatest = input.errors.iter().flatten().flatten().fold(10.0_f64, |a, b| a.max(*b));
    let floor = input.frozen_mm.filter(|floor| *floor < 1.6 * greatest);
    let level = |floor: f64| tracker.points.iter().map(|(frame, _)| (*frame, Some(floor))).collect();
    let never_moves =
        floor.map(|floor| Line::new("a tracker that never moves", Stroke::dashed(Colour::Grey), level(floor)));
    LinePlot {
        x_label: "set frame, from 0".to_owned(),
        y_label: "mean marker error, mm".to_owned(),
        y_from: Some(0.0),
        y_to: Some(1.08 * greatest.max(floor.unwrap_or(0.0))),
        lines: never_moves.into_iter().chain([tracker]).collect(),
        ..LinePlot::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, walking_sheet, with_input};
    use crate::report::{contact_sheet, verdict};

    #[test]
    fn the_picture_has_verdict_metrics_error_and_frames_and_names_its_software() {
        let rig = crate::report::fixture::rig(2);
        let sheet = contact_sheet(&walking_sheet(&rig, &[1, 20, 40])).unwrap();
        let bytes = with_input(&Story { seeds: 3, ..Story::default() }, |input| {
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
        let blue = picture.pixels().iter().filter(|p| [p.red(), p.green(), p.blue()] == Colour::Blue.on_dark()).count();
        assert!(blue > 500, "the line is drawn: {blue}");
        let refused = with_input(&Story::default(), |input| {
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
}
