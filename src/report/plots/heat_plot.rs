//! A heat map.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::style::{FINE, draw_svg, failed, text_style};
use super::{Colour, Size, Svg};
use crate::report::ReportError;

/// Values in rows and columns, each on a ground that tells how good it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatPlot {
    /// What varies from row to row.
    pub down: String,
    /// What varies from column to column.
    pub across: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Names of the rows and their cells, one a column; `None` for no value.
    pub rows: Vec<(String, Vec<Option<HeatCell>>)>,
}

/// One value.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatCell {
    /// The value in words.
    pub text: String,
    /// Its ground, light enough for dark text.
    pub ground: [u8; 3],
}

/// Lengths in CSS pixels.
const COLUMN: i32 = 74;
const ROW: i32 = 32;
const ABOVE: i32 = 48;
const LETTER: f64 = 7.0;

impl HeatPlot {
    /// Draws the map as large as its cells need.
    ///
    /// # Errors
    /// [`ReportError`] for more cells than 10 000 pixels hold, or when plotters fails.
    pub fn svg(&self) -> Result<Svg, ReportError> {
        let names = self.rows.iter().map(|(name, _)| name).chain([&self.down]);
        let longest = names.map(|name| name.chars().count()).max().unwrap_or(0);
        let left = (LETTER * longest as f64) as i32 + 16;
        let across_width = (LETTER * self.across.chars().count() as f64) as i32;
        let width = left + (COLUMN * self.columns.len() as i32).max(across_width) + 4;
        let height = ABOVE + ROW * self.rows.len() as i32 + 4;
        let size = Size { width: width.max(160) as u32, height: height.max(120) as u32 };
        draw_svg(size, &format!("{} by {}", self.down, self.across), |canvas| {
            let text = |words: &str, [x, y]: [i32; 2], colour, side| {
                let style = text_style(12.5, colour, side, VPos::Center);
                canvas.draw_text(words, &style, (x * FINE, y * FINE)).map_err(failed)
            };
            text(&self.across, [left, 12], Colour::Faint, HPos::Left)?;
            text(&self.down, [left - 10, 34], Colour::Faint, HPos::Right)?;
            let place = |column: usize| left + COLUMN * column as i32;
            for (column, name) in self.columns.iter().enumerate() {
                text(name, [place(column) + COLUMN / 2, 34], Colour::Faint, HPos::Center)?;
            }
            for (row, (name, cells)) in self.rows.iter().enumerate() {
                let top = ABOVE + ROW * row as i32;
                text(name, [left - 10, top + ROW / 2], Colour::Ink, HPos::Right)?;
                for (column, cell) in cells.iter().enumerate() {
                    let Some(HeatCell { text: words, ground: [red, green, blue] }) = cell else { continue };
                    let from = (place(column) * FINE, top * FINE);
                    let to = ((place(column) + COLUMN - 2) * FINE, (top + ROW - 2) * FINE);
                    let ground = RGBColor(*red, *green, *blue).filled();
                    canvas.draw(&Rectangle::new([from, to], ground)).map_err(failed)?;
                    text(words, [place(column) + COLUMN / 2 - 1, top + ROW / 2], Colour::Ink, HPos::Center)?;
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_has_a_rectangle_for_every_value_and_none_where_there_is_none() {
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
