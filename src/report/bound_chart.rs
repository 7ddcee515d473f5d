//! The least possible error over time, and what the cameras cannot see, as a page.

use super::ReportError;
use super::chart_page::ChartPage;
use super::contact_chart::seconds;
use super::plots::{Colour, Line, LinePlot, Size, SpanPlot, SpanRow, Stroke, Svg};

const WIDTH: u32 = 1000;
const HEIGHT: u32 = 260;
/// Most rows of what is not seen.
const MOST_ROWS: usize = 20;

/// A bound over time.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundChart {
    /// Name of the scenario or set.
    pub title: String,
    /// Frames per second.
    pub frames_per_second: f64,
    /// Number of frames.
    pub frames: usize,
    /// One per kind of observation.
    pub sources: Vec<BoundCourse>,
    /// Sentences above the plots.
    pub summary: Vec<String>,
    /// Table below the plots: headings, then rows.
    pub table: (Vec<String>, Vec<Vec<String>>),
}

/// The bound of one kind of observation over time.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundCourse {
    /// The observations.
    pub name: String,
    /// Frame, mean bound of the frame alone, mean bound of a filter, and the greatest bound of a marker; mm.
    pub values: Vec<(usize, [f64; 3])>,
    /// Names of what is not seen, with first frame and the frame after the last of every stretch.
    pub unseen: Vec<(String, Vec<[usize; 2]>)>,
}

impl BoundChart {
    /// A self-contained page with the plots and the table.
    ///
    /// # Errors
    /// [`ReportError`] if a plot or the page cannot be rendered.
    pub fn page(&self) -> Result<String, ReportError> {
        let mut plots = Vec::new();
        for source in &self.sources {
            plots.push(self.over_time(source)?);
            if !source.unseen.is_empty() {
                plots.push(self.unseen(source)?);
            }
        }
        let page = ChartPage {
            kicker: "what the cameras can tell",
            title: &self.title,
            summary: &self.summary,
            plots: plots.into_iter().map(|Svg(plot)| plot).collect(),
            heads: &self.table.0,
            rows: &self.table.1,
        };
        page.render()
    }

    fn over_time(&self, source: &BoundCourse) -> Result<Svg, ReportError> {
        let line = |name: &str, colour, which: usize| {
            let time = |frame: usize| frame as f64 / self.frames_per_second;
            let points = source.values.iter().map(|(frame, values)| (time(*frame), Some(values[which]))).collect();
            Line::new(name, Stroke::solid(colour), points)
        };
        let plot = LinePlot {
            title: Some(format!("least error from {}", source.name)),
            x_label: "time, s".to_owned(),
            y_label: "mm".to_owned(),
            lines: vec![
                line("worst marker, frame alone", Colour::Orange, 2),
                line("mean, frame alone", Colour::Blue, 0),
                line("mean, filter", Colour::Purple, 1),
            ],
            logarithmic: true,
            ..LinePlot::default()
        };
        plot.svg(Size { width: WIDTH, height: HEIGHT })
    }

    fn unseen(&self, source: &BoundCourse) -> Result<Svg, ReportError> {
        let row = |(name, stretches): &(String, Vec<[usize; 2]>)| SpanRow {
            name: name.clone(),
            colour: Colour::Orange,
            spans: seconds(stretches, self.frames_per_second),
        };
        let plot = SpanPlot {
            x_label: format!("time, s; bars: not seen by {}", source.name),
            x_range: [0.0, self.frames.max(1) as f64 / self.frames_per_second],
            rows: source.unseen.iter().take(MOST_ROWS).map(row).collect(),
            finding: String::new(),
        };
        plot.svg(WIDTH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_shows_the_course_and_what_is_not_seen() {
        let course = BoundCourse {
            name: "silhouettes".to_owned(),
            values: (0..20).map(|frame| (frame, [3.0, 2.0, 9.0])).collect(),
            unseen: vec![("shoulder rotation, both".to_owned(), vec![[0, 20]])],
        };
        let chart = BoundChart {
            title: "walk <1>".to_owned(),
            frames_per_second: 20.0,
            frames: 20,
            sources: vec![course],
            summary: vec!["at least 3.0 mm".to_owned()],
            table: (vec!["marker".to_owned()], vec![vec!["head".to_owned()]]),
        };
        let page = chart.page().unwrap();
        assert!(page.contains("walk &lt;1&gt;") && page.contains("shoulder rotation, both"));
        assert!(!page.replace("http://www.w3.org/2000/svg", "").contains("http"));
    }
}
