//! A sweep in one picture, for messages and slides: recommended settings, error against cost, heat maps, best settings.

use tiny_skia::Pixmap;

use super::analysis::{CostMeasure, pareto_front};
use super::figures::{Map, labelled, maps, scatter_plot};
use super::heat;
use super::html::{choice, interval_title};
use super::input::SweepPageInput;
use crate::evaluation::Direction;
use crate::report::ReportError;
use crate::report::displayed::{number, symbol};
use crate::report::drawing::{
    CARD, FAINT, INK, LINE, MARGIN, PAPER, WIDTH, colour, dot, draw_text_about, draw_text_to, encoded, fill, fitting,
    new_picture, stroke, wrapped,
};
use crate::report::lettering::draw_text;
use crate::report::plots::Size;
use crate::sweep::summary::SettingSummary;

/// Maximum number of settings with a row.
const BEST: usize = 10;
/// Maximum number of heat maps.
const MAPS: usize = 3;
/// Maximum number of rows and columns of a heat map.
const WIDEST: usize = 8;
const PLOT_HEIGHT: f32 = 340.0;
const ROW: f32 = 30.0;

/// The picture of a sweep as PNG, 1200 pixels wide.
///
/// # Errors
/// [`ReportError`] without a setting, or if drawing fails.
pub fn sweep_picture(input: &SweepPageInput) -> Result<Vec<u8>, ReportError> {
    if input.settings().is_empty() {
        return Err(ReportError::NoRun);
    }
    let room = WIDTH as f32 - 2.0 * MARGIN;
    let choices: Vec<String> = CostMeasure::ALL.iter().filter_map(|cost| choice(input, *cost)).collect();
    let words: Vec<String> = choices.iter().flat_map(|choice| wrapped(choice, 14.0, room)).collect();
    let (map_axes, mut shown, _) = maps(input);
    shown.retain(|map| map.rows.len() <= WIDEST && map.columns.len() <= WIDEST);
    shown.truncate(MAPS);
    let mut best = input.summary.ranked();
    best.truncate(BEST);
    let plots_top = 110.0 + 24.0 * words.len() as f32;
    let maps_top = plots_top + PLOT_HEIGHT + 20.0;
    let rows = shown.iter().map(|map| map.rows.len()).max().unwrap_or(0);
    let list_top = if rows == 0 { maps_top } else { maps_top + 92.0 + ROW * rows as f32 + 20.0 };
    let height = list_top + 54.0 + ROW * best.len() as f32 + MARGIN;
    let mut picture = new_picture(WIDTH, height.ceil() as u32)?;
    picture.fill(colour(PAPER));
    draw_text(&mut picture, &input.summary.name, [MARGIN, 26.0], fitting(&input.summary.name, 30.0, room), INK);
    let about = about(input);
    draw_text(&mut picture, &about, [MARGIN, 70.0], fitting(&about, 14.0, room), FAINT);
    for (line, index) in words.iter().zip(0_u8..) {
        draw_text(&mut picture, line, [MARGIN, 100.0 + 24.0 * f32::from(index)], 14.0, INK);
    }
    let width = 0.5 * (room - 20.0);
    for (cost, left) in CostMeasure::ALL.into_iter().zip([MARGIN, MARGIN + width + 20.0]) {
        let card = [left, plots_top, width, PLOT_HEIGHT];
        fill(&mut picture, card, CARD, 255);
        let [left, top, width, height] = card;
        let size = Size { width: width as u32 - 28, height: height as u32 - 24 };
        scatter_plot(input, cost).drawing(size).draw_on(&mut picture, [left + 14.0, top + 12.0], 1.0);
    }
    if let Some(axes) = map_axes.filter(|_| rows > 0) {
        let [down, across] = axes.map(|axis| input.axes[axis].as_str());
        fill(&mut picture, [MARGIN, maps_top, room, 92.0 + ROW * rows as f32], CARD, 255);
        let title = format!("{}: {down} (down) by {across} (across); orange is worse", labelled(input));
        draw_text(&mut picture, &title, [MARGIN + 14.0, maps_top + 14.0], fitting(&title, 12.0, room - 28.0), FAINT);
        let width = (room - 28.0) / shown.len() as f32;
        for (map, place) in shown.iter().zip(0_u8..) {
            heat_map(&mut picture, map, [MARGIN + 14.0 + f32::from(place) * width, maps_top + 40.0], width - 24.0);
        }
    }
    settings_list(&mut picture, input, &best, [MARGIN, list_top, room]);
    encoded(&picture)
}

fn about(input: &SweepPageInput) -> String {
    let cells: usize = input.settings().iter().map(|setting| setting.cells.len()).sum();
    let (settings, seeds) = (input.settings().len(), input.summary.seeds.len());
    let better = if input.objective.direction == Direction::HigherIsBetter { "higher" } else { "lower" };
    let plural = if seeds == 1 { "" } else { "s" };
    format!("{settings} settings, {seeds} seed{plural}, {cells} cells. {}: {better} is better", labelled(input))
}

fn short_cost(value: f64) -> String {
    match value {
        value if value >= 1e4 => format!("{:.0}k", value / 1e3),
        value if value >= 10.0 || value.fract() == 0.0 => format!("{value:.0}"),
        value => format!("{value:.2}"),
    }
}

fn heat_map(picture: &mut Pixmap, map: &Map, [left, top]: [f32; 2], width: f32) {
    draw_text(picture, &map.title, [left, top], fitting(&map.title, 10.0, width), FAINT);
    let label = 54.0;
    let cell = ((width - label) / map.columns.len().max(1) as f32).min(96.0);
    for (name, column) in map.columns.iter().zip(0_u8..) {
        let centre = left + label + (f32::from(column) + 0.5) * cell;
        draw_text_about(picture, name, [centre, top + 24.0], fitting(name, 10.0, cell - 4.0), FAINT);
    }
    for ((name, cells), row) in map.rows.iter().zip(0_u8..) {
        let above = top + 42.0 + f32::from(row) * ROW;
        draw_text_to(picture, name, [left + label - 8.0, above + 9.0], fitting(name, 10.0, label - 8.0), FAINT);
        for (value, column) in cells.iter().zip(0_u8..) {
            let beside = left + label + f32::from(column) * cell;
            let Some(place) = value.place else { continue };
            fill(picture, [beside + 1.0, above + 1.0, cell - 2.0, ROW - 2.0], heat::on_dark(place), 255);
            draw_text_about(picture, &value.text, [beside + 0.5 * cell, above + 9.0], 11.0, INK);
        }
    }
}

/// The best settings with mean and interval (or range over seeds); those on the Pareto front are marked.
fn settings_list(picture: &mut Pixmap, input: &SweepPageInput, best: &[&SettingSummary], [left, top, room]: [f32; 3]) {
    fill(picture, [left, top, room, 44.0 + ROW * best.len() as f32], CARD, 255);
    let title = format!(
        "best settings (square: on the Pareto front by evaluations), mean and {}, evaluations a frame",
        interval_title(input)
    );
    draw_text(picture, &title, [left + 14.0, top + 14.0], 11.0, FAINT);
    let front: Vec<&SettingSummary> = pareto_front(input.settings(), CostMeasure::Evaluations, input.objective)
        .into_iter()
        .filter_map(|at| input.settings().get(at))
        .collect();
    let ends = |point: &SettingSummary| {
        let mean = point.mean.unwrap_or_default();
        point.interval_or_range(input.summary.has_intervals()).unwrap_or([mean; 2])
    };
    let greatest = best.iter().map(|point| ends(point)[1]).fold(1e-9, f64::max);
    let bar = [left + 0.52 * room, 0.26 * room];
    let x = |value: f64| bar[0] + bar[1] * (value / greatest).clamp(0.0, 1.0) as f32;
    let unit = input.objective.unit;
    for (point, row) in best.iter().zip(0_u8..) {
        let (above, mean) = (top + 40.0 + f32::from(row) * ROW, point.mean.unwrap_or_default());
        let is_front = front.iter().any(|other| std::ptr::eq(*other, *point));
        if is_front {
            fill(picture, [left + 14.0, above + 8.0, 9.0, 9.0], LINE, 255);
        }
        let words = input.words(point);
        draw_text(picture, &words, [left + 34.0, above + 7.0], fitting(&words, 12.0, 0.5 * room - 40.0), INK);
        stroke(picture, &ends(point).map(|end| [x(end), above + 12.0]), FAINT, 2.0, false);
        dot(picture, [x(mean), above + 12.0], 4.5, LINE);
        let value = format!("{} {}", number(mean, unit), symbol(unit));
        draw_text_to(picture, &value, [left + 0.89 * room, above + 7.0], 12.0, INK);
        let cost = point.evaluations_per_frame.map_or_else(|| "-".to_owned(), short_cost);
        draw_text_to(picture, &cost, [left + room - 14.0, above + 7.0], 12.0, FAINT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::page::html::tests::grid;

    #[test]
    fn the_picture_of_a_sweep_has_a_dot_for_every_setting_and_names_its_software() {
        let input = grid();
        let bytes = sweep_picture(&input).unwrap();
        assert!(String::from_utf8_lossy(&bytes[..200]).contains("Software\0skiagraph "));
        let picture = Pixmap::decode_png(&bytes).unwrap();
        assert!(picture.width() == WIDTH && picture.height() > 500, "{}", picture.height());
        let blue = picture.pixels().iter().filter(|p| [p.red(), p.green(), p.blue()] == LINE).count();
        assert!(blue > 100, "dots are drawn: {blue}");
        let mut nothing = input;
        nothing.summary.settings.clear();
        assert!(matches!(sweep_picture(&nothing), Err(ReportError::NoRun)));
    }

    #[test]
    fn the_best_settings_come_first_and_costs_are_short() {
        let input = grid();
        let means: Vec<f64> = input.summary.ranked().iter().filter_map(|point| point.mean).collect();
        assert!(means.is_sorted() && !means.is_empty(), "{means:?}");
        assert_eq!([0.5, 12.3, 25_000.0].map(short_cost), ["0.50", "12", "25k"]);
    }
}
