//! Axes of plots, and the head above them.

use super::shapes::{PlotDrawing, TextSide};
use super::{Colour, Stroke};
use crate::round_ticks::{log_ticks, power_of_ten, round_ticks, whole_ticks};

/// Width on the left of a plot for labels of up to five letters, CSS pixels.
pub(super) const LABEL_WIDTH: f64 = 46.0;
/// Width of a wide digit of these labels.
const TICK_LETTER: f64 = 7.2;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    /// The values at its ends.
    values: [f64; 2],
    /// Positions of the ends, CSS pixels.
    pixels: [f64; 2],
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A linear axis with at most about `most` ticks at round numbers.
    pub(super) fn round(values: [f64; 2], pixels: [f64; 2], most: u32) -> Self {
        Self { values, pixels, ticks: round_ticks(values, most) }
    }

    /// Like [`Self::round`], with ticks at whole numbers if all values are whole, such as numbers of cameras.
    pub(super) fn along(mut values: impl Iterator<Item = f64>, range: [f64; 2], pixels: [f64; 2], most: u32) -> Self {
        if values.all(|value| value.fract() == 0.0) {
            return Self { values: range, pixels, ticks: whole_ticks(range, most) };
        }
        Self::round(range, pixels, most)
    }

    /// A logarithmic axis over exponents of ten, with at most `most` ticks at round values.
    pub(super) fn logarithmic(exponents: [f64; 2], pixels: [f64; 2], most: u32) -> Self {
        let exponent = log_ticks(exponents, most as usize).into_iter().map(libm::log10);
        let ticks = exponent.map(|exponent| (exponent, power_of_ten(exponent))).collect();
        Self { values: exponents, pixels, ticks }
    }

    /// An axis in pixels, without ticks.
    pub(super) fn of_pixels(pixels: [f64; 2]) -> Self {
        Self { values: pixels, pixels, ticks: Vec::new() }
    }

    /// The extent of a plot beside this vertical axis, which begins further right if its labels are long.
    pub(super) fn beside(&self, [left, right]: [f64; 2]) -> [f64; 2] {
        let letters = self.ticks.iter().map(|(_, words)| words.chars().count()).max().unwrap_or(0);
        let more = (TICK_LETTER * letters as f64 + 10.0 - LABEL_WIDTH).max(0.0);
        [left + more.min(0.4 * (right - left)), right]
    }

    pub(super) fn place(&self, value: f64) -> f64 {
        let [[from, to], [start, end]] = [self.values, self.pixels];
        start + (end - start) * (value - from) / (to - from)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlotAxes {
    pub(super) x: Axis,
    /// From bottom to top.
    pub(super) y: Axis,
}

impl PlotAxes {
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.place(x), self.y.place(y)]
    }

    /// Draws the vertical axis, with lines across the plot at its ticks.
    pub(super) fn draw_y(&self, drawing: &mut PlotDrawing) {
        let ([left, right], [bottom, top]) = (self.x.pixels, self.y.pixels);
        for (value, words) in &self.y.ticks {
            let y = self.y.place(*value);
            drawing.line(vec![[left, y], [right, y]], Stroke::solid(Colour::Grid), 1.0);
            drawing.line(vec![[left - 4.0, y], [left, y]], Stroke::solid(Colour::Faint), 1.0);
            drawing.text(words, [left - 8.0, y], 12.0, Colour::Faint, TextSide::End);
        }
        drawing.line(vec![[left, top], [left, bottom]], Stroke::solid(Colour::Faint), 1.0);
    }

    /// Draws the horizontal axis with its label, and if `lines` is set, lines across the plot at its ticks.
    pub(super) fn draw_x(&self, drawing: &mut PlotDrawing, label: &str, lines: bool) {
        let ([left, right], [bottom, top]) = (self.x.pixels, self.y.pixels);
        for (value, words) in &self.x.ticks {
            let x = self.x.place(*value);
            if lines {
                drawing.line(vec![[x, top], [x, bottom]], Stroke::solid(Colour::Grid), 1.0);
            }
            drawing.line(vec![[x, bottom], [x, bottom + 4.0]], Stroke::solid(Colour::Faint), 1.0);
            drawing.text(words, [x, bottom + 12.0], 12.0, Colour::Faint, TextSide::Middle);
        }
        drawing.line(vec![[left, bottom], [right, bottom]], Stroke::solid(Colour::Faint), 1.0);
        drawing.text(label, [0.5 * (left + right), bottom + 29.0], 12.0, Colour::Faint, TextSide::Middle);
    }

    /// Data for the page's script to mark a value of the horizontal axis: left, right, top and bottom of the plot, and
    /// the values at the ends of the axis.
    pub(super) fn for_script(&self) -> [f64; 6] {
        let ([left, right], [bottom, top]) = (self.x.pixels, self.y.pixels);
        [left, right, top, bottom, self.x.values[0], self.x.values[1]]
    }
}

/// The head of a plot: its title, if any, and a legend that wraps.
pub(super) struct PlotHead<'a> {
    title: Option<&'a str>,
    entries: Vec<(&'a str, Stroke)>,
    places: Vec<[f64; 2]>,
    pub(super) height: f64,
}

const TITLE_HEIGHT: f64 = 28.0;
const LEGEND_ROW: f64 = 20.0;

impl<'a> PlotHead<'a> {
    /// The head of a plot `width` CSS pixels wide.
    pub(super) fn new(title: Option<&'a str>, entries: Vec<(&'a str, Stroke)>, width: u32) -> Self {
        let mut at = [0.0, if title.is_some() { TITLE_HEIGHT } else { 0.0 }];
        let mut places = Vec::new();
        for (name, _) in &entries {
            let needed = 34.0 + 6.6 * name.chars().count() as f64;
            if at[0] > 0.0 && at[0] + needed > f64::from(width) {
                at = [0.0, at[1] + LEGEND_ROW];
            }
            places.push(at);
            at[0] += needed + 10.0;
        }
        let height = at[1] + if entries.is_empty() { 0.0 } else { LEGEND_ROW };
        Self { title, entries, places, height }
    }

    pub(super) fn draw(&self, drawing: &mut PlotDrawing) {
        if let Some(title) = self.title {
            drawing.text(title, [0.0, 12.0], 16.0, Colour::Ink, TextSide::Start);
        }
        for ((name, stroke), [x, y]) in self.entries.iter().zip(&self.places) {
            let y = y + 0.5 * LEGEND_ROW;
            drawing.line(vec![[*x, y], [x + 24.0, y]], *stroke, 3.0);
            drawing.text(name, [x + 30.0, y], 12.5, Colour::Ink, TextSide::Start);
        }
    }

    /// Draws the head and the label of the vertical axis below it.
    pub(super) fn draw_with_label(&self, drawing: &mut PlotDrawing, y_label: &str) {
        self.draw(drawing);
        drawing.text(y_label, [0.0, self.height + 11.0], 12.0, Colour::Faint, TextSide::Start);
    }

    /// Left, right, bottom and top of the plot below the head and the label of the vertical axis.
    pub(super) fn plot_below(&self, width: u32, height: u32) -> [[f64; 2]; 2] {
        [[LABEL_WIDTH, f64::from(width) - 14.0], [f64::from(height) - 40.0, self.height + 26.0]]
    }
}

/// Minimum and maximum of the finite values; `None` without one.
pub(super) fn ends(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values
        .filter(|value| value.is_finite())
        .fold(None, |ends: Option<[f64; 2]>, v| Some(ends.map_or([v, v], |[low, high]| [low.min(v), high.max(v)])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_that_is_too_long_wraps() {
        let entry = |name| (name, Stroke::solid(Colour::Blue));
        let head = PlotHead::new(None, ["one", "two", "a rather long name"].map(entry).into(), 150);
        assert_eq!(head.places[0], [0.0, 0.0]);
        assert!(head.places[2][0] == 0.0 && head.places[2][1] > 0.0);
        assert_eq!(head.height, head.places[2][1] + LEGEND_ROW);
        assert_eq!(PlotHead::new(Some("title"), vec![], 150).height, TITLE_HEIGHT);
    }

    #[test]
    fn long_labels_have_more_room_and_short_ones_the_usual() {
        let beside = |most: f64| Axis::round([0.0, most], [100.0, 0.0], 5).beside([LABEL_WIDTH, 400.0])[0];
        assert_eq!([beside(400.0), beside(40_000.0)], [LABEL_WIDTH; 2]);
        assert!(beside(400_000.0) >= 8.0 + 6.0 * TICK_LETTER && beside(4e12) < 200.0);
    }

    #[test]
    fn an_axis_of_whole_numbers_has_whole_ticks() {
        let ticks = |values: [f64; 2]| -> Vec<f64> {
            let axis = Axis::along(values.into_iter(), values, [0.0, 1.0], 8);
            axis.ticks.into_iter().map(|(value, _)| value).collect()
        };
        assert_eq!(ticks([1.0, 4.0]), [1.0, 2.0, 3.0, 4.0], "no half cameras");
        assert_eq!(ticks([2.0, 3.0]), [2.0, 3.0]);
        assert_eq!(ticks([0.0, 240.0]), [0.0, 50.0, 100.0, 150.0, 200.0]);
        assert!(ticks([0.5, 4.0]).iter().any(|tick| tick.fract() != 0.0));
    }
}
