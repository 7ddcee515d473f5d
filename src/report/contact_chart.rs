//! Stances, ground gaps and slip of the feet over time, as a plot and as a page.

use super::ReportError;
use super::chart_page::ChartPage;
use super::plots::{Colour, Line, LinePlot, Size, SpanPlot, SpanRow, Stroke, Svg};

const WIDTH: u32 = 1000;
const LINES_HEIGHT: u32 = 240;

/// Ground contact of a motion over time.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactChart {
    /// Name of the motion.
    pub title: String,
    /// Frames per second.
    pub frames_per_second: f64,
    /// The left and the right foot.
    pub feet: [FootCourse; 2],
    /// Further quantities over time, one plot each: name with unit, and one value per frame.
    pub others: Vec<(String, Vec<Option<f64>>)>,
    /// Sentences above the plots.
    pub summary: Vec<String>,
    /// Table below the plots: headings, then rows.
    pub table: (Vec<String>, Vec<Vec<String>>),
}

/// One foot over time.
#[derive(Clone, Debug, PartialEq)]
pub struct FootCourse {
    /// Its name.
    pub name: String,
    /// First frame and the frame after the last of every stance.
    pub stances: Vec<[usize; 2]>,
    /// Height of its lowest point, one value per frame.
    pub gap_mm: Vec<f64>,
    /// Speed of that point along the ground, one value per frame.
    pub slip_mm_per_s: Vec<f64>,
}

const COLOURS: [Colour; 2] = [Colour::Blue, Colour::Orange];
/// Gaps above this are cut off: a foot that high is in swing.
const GAP_SHOWN_MM: f64 = 120.0;

impl ContactChart {
    /// All plots, stacked in one picture.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn svg(&self) -> Result<String, ReportError> {
        let (mut inside, mut top) = (String::new(), 0);
        for (Svg(plot), height) in self.plots()? {
            inside += &plot.replacen("<svg ", &format!("<svg y=\"{top}\" "), 1);
            top += height + 8;
        }
        let whole = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{top}\" viewBox=\"0 0 {WIDTH} {top}\">{inside}</svg>\n"
        );
        Ok(Svg(whole).standalone())
    }

    /// A self-contained page with the plots and the table.
    ///
    /// # Errors
    /// [`ReportError`] if a plot or the page cannot be rendered.
    pub fn page(&self) -> Result<String, ReportError> {
        let page = ChartPage {
            kicker: "contact with the ground",
            title: &self.title,
            summary: &self.summary,
            plots: self.plots()?.into_iter().map(|(Svg(plot), _)| plot).collect(),
            heads: &self.table.0,
            rows: &self.table.1,
        };
        page.render()
    }

    /// Every plot and its height.
    fn plots(&self) -> Result<Vec<(Svg, u32)>, ReportError> {
        let frames = self.feet[0].gap_mm.len();
        let last = frames.max(1) as f64 / self.frames_per_second;
        let rows = self.feet.iter().zip(COLOURS).map(|(foot, colour)| SpanRow {
            name: foot.name.clone(),
            colour,
            spans: seconds(&foot.stances, self.frames_per_second),
        });
        let spans = SpanPlot {
            x_label: "time, s; bars: the foot stands".to_owned(),
            x_range: [0.0, last],
            rows: rows.collect(),
            finding: String::new(),
        };
        let mut made = vec![(spans.svg(WIDTH)?, spans.height())];
        let of_feet = |value: fn(&FootCourse) -> &[f64]| {
            let line = |(foot, colour): (&FootCourse, Colour)| {
                let points = value(foot).iter().enumerate().map(|(frame, v)| (self.time(frame), Some(*v))).collect();
                Line::new(&foot.name, Stroke::solid(colour), points)
            };
            self.feet.iter().zip(COLOURS).map(line).collect::<Vec<_>>()
        };
        let slip = self.feet.iter().zip(COLOURS).map(|(foot, colour)| {
            let stands = |frame: usize| foot.stances.iter().any(|[first, end]| (*first..*end).contains(&frame));
            let speeds = foot.slip_mm_per_s.iter().enumerate();
            let points = speeds.map(|(frame, v)| (self.time(frame), stands(frame).then_some(*v))).collect();
            Line::new(&foot.name, Stroke::solid(colour), points)
        });
        let (slip, gap) = (slip.collect(), of_feet(|foot| &foot.gap_mm));
        made.push((self.over_time("gap to the ground, mm", gap, Some(GAP_SHOWN_MM))?, LINES_HEIGHT));
        made.push((self.over_time("slip while standing, mm/s", slip, None)?, LINES_HEIGHT));
        for (label, values) in &self.others {
            let points = values.iter().enumerate().map(|(frame, value)| (self.time(frame), *value)).collect();
            let line = Line::new("", Stroke::solid(Colour::Purple), points);
            made.push((self.over_time(label, vec![line], None)?, LINES_HEIGHT));
        }
        Ok(made)
    }

    fn over_time(&self, label: &str, lines: Vec<Line>, y_to: Option<f64>) -> Result<Svg, ReportError> {
        let plot =
            LinePlot { x_label: "time, s".to_owned(), y_label: label.to_owned(), lines, y_to, ..LinePlot::default() };
        plot.svg(Size { width: WIDTH, height: LINES_HEIGHT })
    }

    fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.frames_per_second
    }
}

/// Converts ranges of frames to seconds; a frame lasts until the next one.
pub(super) fn seconds(stances: &[[usize; 2]], frames_per_second: f64) -> Vec<[f64; 2]> {
    stances.iter().map(|stance| stance.map(|frame| frame as f64 / frames_per_second)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> ContactChart {
        let foot = |name: &str, first: usize| FootCourse {
            name: name.to_owned(),
            stances: vec![[first, first + 10]],
            gap_mm: (0..40).map(|f| 10.0 * f64::from(f % 7)).collect(),
            slip_mm_per_s: vec![12.0; 40],
        };
        ContactChart {
            title: "walk <1>".to_owned(),
            frames_per_second: 20.0,
            feet: [foot("left foot", 0), foot("right foot", 15)],
            others: vec![("margin, mm".to_owned(), vec![Some(1.0); 40])],
            summary: vec!["standing feet skate".to_owned()],
            table: (vec!["foot".to_owned()], vec![vec!["left".to_owned()]]),
        }
    }

    #[test]
    fn the_picture_stacks_all_plots() {
        let svg = chart().svg().unwrap();
        assert_eq!(svg.matches("<svg ").count(), 5, "the whole, stances, gap, slip and the margin");
        assert!(svg.contains("left foot") && svg.contains("slip while standing") && svg.contains("margin, mm"));
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn the_page_needs_no_network() {
        let page = chart().page().unwrap();
        assert!(page.contains("walk &lt;1&gt;") && page.contains("<table"));
        assert!(!page.replace("http://www.w3.org/2000/svg", "").contains("http"));
    }
}
