//! A heat map.

use super::shapes::{PlotDrawing, TextSide};
use super::{Colour, Size, Svg};
use crate::report::ReportError;

/// Values in rows and columns, with background colours that show how good they are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatPlot {
    /// Label of the rows' axis.
    pub down: String,
    /// Label of the columns' axis.
    pub across: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Names of the rows and their cells, one per column; `None` for no value.
    pub rows: Vec<(String, Vec<Option<HeatCell>>)>,
}

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatCell {
    /// The value as text.
    pub text: String,
    /// Its background, light enough for dark text.
    pub ground: [u8; 3],
}

/// Lengths in CSS pixels.
const COLUMN: f64 = 74.0;
const ROW: f64 = 32.0;
const ABOVE: f64 = 48.0;
const LETTER: f64 = 7.0;

impl HeatPlot {
    /// Draws the map at the size that its cells need.
    ///
    /// # Errors
    /// [`ReportError`] if it needs more than 10 000 pixels.
    pub fn svg(&self) -> Result<Svg, ReportError> {
        let names = self.rows.iter().map(|(name, _)| name).chain([&self.down]);
        let longest = names.map(|name| name.chars().count()).max().unwrap_or(0);
        let left = LETTER * longest as f64 + 16.0;
        let across_width = LETTER * self.across.chars().count() as f64;
        let width = left + (COLUMN * self.columns.len() as f64).max(across_width) + 4.0;
        let height = ABOVE + ROW * self.rows.len() as f64 + 4.0;
        let mut drawing = PlotDrawing::default();
        let mut text = |words: &str, at: [f64; 2], colour, side| drawing.text(words, at, 12.5, colour, side);
        text(&self.across, [left, 12.0], Colour::Faint, TextSide::Start);
        text(&self.down, [left - 10.0, 34.0], Colour::Faint, TextSide::End);
        let place = |column: usize| left + COLUMN * column as f64;
        for (column, name) in self.columns.iter().enumerate() {
            text(name, [place(column) + 0.5 * COLUMN, 34.0], Colour::Faint, TextSide::Middle);
        }
        for (row, (name, cells)) in self.rows.iter().enumerate() {
            let top = ABOVE + ROW * row as f64;
            drawing.text(name, [left - 10.0, top + 0.5 * ROW], 12.5, Colour::Ink, TextSide::End);
            for (column, cell) in cells.iter().enumerate() {
                let Some(HeatCell { text, ground }) = cell else { continue };
                let (from, to) = ([place(column), top], [place(column) + COLUMN - 2.0, top + ROW - 2.0]);
                drawing.rectangle([from, to], Colour::Fixed(*ground));
                let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
                drawing.text(text, middle, 12.5, Colour::Ink, TextSide::Middle);
            }
        }
        let size = Size { width: width.max(160.0) as u32, height: height.max(120.0) as u32 };
        drawing.svg(size, &format!("{} by {}", self.down, self.across))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_has_a_rectangle_for_every_value_and_none_for_a_missing_one() {
        let cell = |text: &str| Some(HeatCell { text: text.to_owned(), ground: [200, 230, 210] });
        let plot = HeatPlot {
            down: "particles".to_owned(),
            across: "layers".to_owned(),
            columns: vec!["1".to_owned(), "5".to_owned()],
            rows: vec![
                ("50".to_owned(), vec![cell("41.0"), None]),
                ("<100".to_owned(), vec![cell("38.5"), cell("33.1")]),
            ],
        };
        let Svg(svg) = plot.svg().unwrap();
        assert_eq!(svg.matches("<rect").count(), 3);
        for words in ["particles", "layers", "33.1", "&lt;100"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(HeatPlot::default().svg().is_ok());
    }
}
