//! Stances, seams between takes, ground gaps and slip of a motion over time, as SVG.

use std::ops::Range;

use skiagraph_core::contact::{GroundContact, GroundContacts};
use skiagraph_report::ReportError;
use skiagraph_report::plots::{Colour, Line, LinePlot, Size, SpanPlot, SpanRow, Stroke, Svg};

const WIDTH: u32 = 1000;
const LINES_HEIGHT: u32 = 240;
const COLOURS: [Colour; 2] = [Colour::Blue, Colour::Orange];
/// Gaps above this are cut off: a foot that high is in swing.
const GAP_SHOWN_MM: f64 = 120.0;

pub(super) struct ContactChart<'a> {
    pub(super) frames: usize,
    pub(super) frames_per_second: f64,
    /// `None` for a body without feet.
    pub(super) contacts: Option<&'a GroundContacts>,
    /// Blended frames between takes.
    pub(super) seams: Vec<Range<usize>>,
}

impl ContactChart<'_> {
    pub(super) fn svg(&self) -> Result<String, ReportError> {
        let spans = self.spans();
        let mut plots = vec![(spans.svg(WIDTH)?, spans.height())];
        let gap = |frame: &GroundContact| Some(1000.0 * frame.gap_m);
        let slip = |frame: &GroundContact| frame.in_contact.then(|| 1000.0 * frame.slip_m_per_s());
        if let Some(contacts) = self.contacts {
            plots.push((self.over_time(contacts, "gap to the ground, mm", gap, Some(GAP_SHOWN_MM))?, LINES_HEIGHT));
            plots.push((self.over_time(contacts, "slip while standing, mm/s", slip, None)?, LINES_HEIGHT));
        }
        let (mut inside, mut top) = (String::new(), 0);
        for (Svg(plot), height) in plots {
            inside += &plot.replacen("<svg ", &format!("<svg y=\"{top}\" "), 1);
            top += height + 8;
        }
        let whole = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{top}\" viewBox=\"0 0 {WIDTH} {top}\">{inside}</svg>\n"
        );
        Ok(Svg(whole).standalone())
    }

    /// Bars of the stances and seams; a frame lasts until the next one.
    fn spans(&self) -> SpanPlot {
        let mut rows = Vec::new();
        for (foot, colour) in self.contacts.iter().flat_map(|contacts| &contacts.feet).zip(COLOURS) {
            rows.push(SpanRow { name: foot.name.clone(), colour, spans: self.seconds(&foot.stances()) });
        }
        if !self.seams.is_empty() {
            rows.push(SpanRow { name: "seams".to_owned(), colour: Colour::Red, spans: self.seconds(&self.seams) });
        }
        let x_label = "time, s; bars: the foot stands, takes are blended".to_owned();
        SpanPlot { x_label, x_range: [0.0, self.time(self.frames.max(1))], rows }
    }

    fn over_time(
        &self,
        contacts: &GroundContacts,
        label: &str,
        value: fn(&GroundContact) -> Option<f64>,
        y_to: Option<f64>,
    ) -> Result<Svg, ReportError> {
        let mut lines = Vec::new();
        for (foot, colour) in contacts.feet.iter().zip(COLOURS) {
            let points = foot.frames.iter().enumerate().map(|(frame, contact)| (self.time(frame), value(contact)));
            lines.push(Line::new(&foot.name, Stroke::solid(colour), points.collect()));
        }
        let plot =
            LinePlot { x_label: "time, s".to_owned(), y_label: label.to_owned(), lines, y_to, ..LinePlot::default() };
        plot.svg(Size { width: WIDTH, height: LINES_HEIGHT })
    }

    fn seconds(&self, spans: &[Range<usize>]) -> Vec<[f64; 2]> {
        spans.iter().map(|span| [self.time(span.start), self.time(span.end)]).collect()
    }

    fn time(&self, frame: usize) -> f64 {
        frame as f64 / self.frames_per_second
    }
}
