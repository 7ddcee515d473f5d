//! The page of an explained run: a bar of its causes, by joint, over time, and the landscape of its worst frames.

use serde::Serialize;

use super::figures::ResponsiveSvg;
use super::html::render_page;
use super::plots::{Colour, Line, LinePlot, Stroke};
use super::{LandscapePlot, ReportError};

const TEMPLATE: &str = include_str!("explain_page.html");
/// Colours of the parts, in their order; the last one, what remains, is grey.
const COLOURS: [Colour; 6] = [Colour::Blue, Colour::Orange, Colour::Green, Colour::Purple, Colour::Amber, Colour::Red];

/// What the page of an explained run shows.
#[derive(Clone, Debug)]
pub struct ExplainPage {
    /// The set's name.
    pub title: String,
    /// The explanation in one sentence.
    pub sentence: String,
    /// Facts about the run, in a few words each.
    pub chips: Vec<String>,
    /// The error, mm.
    pub error_mm: f64,
    /// The parts that add up to the error; the last one is what remains.
    pub parts: Vec<ExplainedPart>,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Frames per second.
    pub frames_per_second: f64,
    /// The error with some inputs true: their names, and mm.
    pub cells: Vec<(String, f64)>,
    /// Notes below the bar.
    pub notes: Vec<String>,
    /// The worst seconds.
    pub worst: Vec<WorstOnPage>,
}

/// One of the worst seconds.
#[derive(Clone, Debug)]
pub struct WorstOnPage {
    /// Its set's folder.
    pub folder: String,
    /// Seed, frames and error.
    pub about: String,
    /// Whether it repeats.
    pub again: String,
    /// The landscape of its worst frame with a description, if it has one.
    pub landscape: Option<(LandscapePlot, String)>,
}

/// A part of the error.
#[derive(Clone, Debug)]
pub struct ExplainedPart {
    /// Its cause.
    pub name: String,
    /// What is wrong; may be empty.
    pub fault: String,
    /// mm.
    pub error_mm: f64,
    /// The 95 % interval over seeds, mm.
    pub interval: Option<[f64; 2]>,
    /// By how much the error falls if only this is true, mm.
    pub alone_mm: Option<f64>,
    /// mm by joint.
    pub joints: Vec<f64>,
    /// mm by frame; NaN where nothing is measured.
    pub frames: Vec<f64>,
}

#[derive(Serialize)]
struct PageContent<'a> {
    title: &'a str,
    sentence: &'a str,
    chips: &'a [String],
    error: String,
    bar: Vec<Piece<'a>>,
    /// What the bar leaves out.
    bar_note: Option<String>,
    rows: Vec<CauseRow<'a>>,
    joints: Vec<JointBar<'a>>,
    time: ResponsiveSvg,
    cells: Vec<(&'a str, String)>,
    notes: &'a [String],
    worst: Vec<WorstSecondRow<'a>>,
}

#[derive(Serialize)]
struct WorstSecondRow<'a> {
    folder: &'a str,
    about: &'a str,
    again: &'a str,
    landscape: Option<(String, &'a str)>,
}

/// A piece of a bar.
#[derive(Serialize)]
struct Piece<'a> {
    name: &'a str,
    value: String,
    /// Share of the bar's whole width, %.
    width: String,
    colour: String,
}

#[derive(Serialize)]
struct CauseRow<'a> {
    name: &'a str,
    fault: &'a str,
    colour: String,
    value: String,
    share: String,
    interval: String,
    alone: String,
}

#[derive(Serialize)]
struct JointBar<'a> {
    name: &'a str,
    error: String,
    bar: Vec<Piece<'a>>,
}

impl ExplainPage {
    /// The page: self-contained HTML.
    ///
    /// # Errors
    /// [`ReportError`] if a plot cannot be drawn.
    pub fn html(&self) -> Result<String, ReportError> {
        let sums: Vec<f64> = (0..self.joints.len()).map(|joint| self.values(joint).iter().sum()).collect();
        let longest = (0..self.joints.len()).map(|joint| length(&self.values(joint))).fold(0.0, f64::max);
        let joints = self.joints.iter().zip(&sums).enumerate().filter(|(_, (_, sum))| sum.is_finite());
        let joints = joints.map(|(joint, (name, sum))| JointBar {
            name,
            error: millimetres(*sum),
            bar: self.bar(&self.values(joint), longest),
        });
        let totals: Vec<f64> = self.parts.iter().map(|part| part.error_mm).collect();
        render_page(
            TEMPLATE,
            &PageContent {
                title: &self.title,
                sentence: &self.sentence,
                chips: &self.chips,
                error: millimetres(self.error_mm),
                bar: self.bar(&totals, length(&totals)),
                bar_note: self.bar_note(length(&totals)),
                rows: self.parts.iter().enumerate().map(|(index, part)| self.row(index, part)).collect(),
                joints: joints.collect(),
                time: self.over_time()?,
                cells: self.cells.iter().map(|(name, error)| (name.as_str(), millimetres(*error))).collect(),
                notes: &self.notes,
                worst: self.worst.iter().map(WorstOnPage::row).collect::<Result<_, _>>()?,
            },
        )
    }

    /// The parts of a joint's error.
    fn values(&self, joint: usize) -> Vec<f64> {
        self.parts.iter().map(|part| part.joints.get(joint).copied().unwrap_or(0.0)).collect()
    }

    /// The pieces of a bar whose whole width is `longest`. Parts below 0 have no piece.
    fn bar(&self, values: &[f64], longest: f64) -> Vec<Piece<'_>> {
        let shown = self.parts.iter().zip(values).enumerate().filter(|(_, (_, value))| **value > 0.0);
        let pieces = shown.map(|(index, (part, value))| Piece {
            name: &part.name,
            value: millimetres(*value),
            width: format!("{:.2}", 100.0 * value / longest.max(f64::MIN_POSITIVE)),
            colour: self.tone(index).variable(),
        });
        pieces.collect()
    }

    /// Names the parts below 0, which the bar of all parts above 0 leaves out; `None` without any.
    fn bar_note(&self, drawn_mm: f64) -> Option<String> {
        let below = self.parts.iter().filter(|part| part.error_mm <= -0.05);
        let named: Vec<String> =
            below.map(|part| format!("{} ({} mm)", part.name, millimetres(part.error_mm))).collect();
        (!named.is_empty()).then(|| {
            format!(
                "The bar has the parts above 0 alone, which are {} mm together. Not drawn, because below 0: {}.",
                millimetres(drawn_mm),
                named.join(", ")
            )
        })
    }

    fn row<'a>(&'a self, index: usize, part: &'a ExplainedPart) -> CauseRow<'a> {
        CauseRow {
            name: &part.name,
            fault: &part.fault,
            colour: self.tone(index).variable(),
            value: millimetres(part.error_mm),
            share: format!("{:.0}", 100.0 * part.error_mm / self.error_mm),
            interval: part.interval.map(|[low, high]| format!("{low:.1} to {high:.1}")).unwrap_or_default(),
            alone: part.alone_mm.map(millimetres).unwrap_or_default(),
        }
    }

    fn tone(&self, index: usize) -> Colour {
        if index + 1 == self.parts.len() { Colour::Grey } else { COLOURS[index % COLOURS.len()] }
    }

    fn over_time(&self) -> Result<ResponsiveSvg, ReportError> {
        let points = |frames: &[f64]| -> Vec<(f64, Option<f64>)> {
            let of_frame = |(frame, value): (usize, &f64)| {
                (frame as f64 / self.frames_per_second, Some(*value).filter(|value| value.is_finite()))
            };
            frames.iter().enumerate().map(of_frame).collect()
        };
        let frames = self.parts.first().map_or(0, |part| part.frames.len());
        let whole: Vec<f64> = (0..frames)
            .map(|frame| self.parts.iter().map(|part| part.frames.get(frame).copied().unwrap_or(f64::NAN)).sum())
            .collect();
        let mut lines = vec![Line::new("error", Stroke::solid(Colour::Ink), points(&whole))];
        lines.extend(
            self.parts
                .iter()
                .enumerate()
                .map(|(index, part)| Line::new(&part.name, Stroke::solid(self.tone(index)), points(&part.frames))),
        );
        let plot =
            LinePlot { x_label: "time, s".to_owned(), y_label: "error, mm".to_owned(), lines, ..LinePlot::default() };
        ResponsiveSvg::of_lines(&plot, true, [330, 300, 280])
    }
}

impl WorstOnPage {
    fn row(&self) -> Result<WorstSecondRow<'_>, ReportError> {
        let landscape = match &self.landscape {
            Some((plot, words)) => Some((plot.svg()?, words.as_str())),
            None => None,
        };
        Ok(WorstSecondRow { folder: &self.folder, about: &self.about, again: &self.again, landscape })
    }
}

/// The length of a bar: the sum of the parts above 0.
fn length(values: &[f64]) -> f64 {
    values.iter().filter(|value| **value > 0.0).sum()
}

fn millimetres(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_names_the_parts_that_its_bar_leaves_out() {
        let part = |name: &str, error_mm| ExplainedPart {
            name: name.to_owned(),
            fault: String::new(),
            error_mm,
            interval: None,
            alone_mm: None,
            joints: Vec::new(),
            frames: Vec::new(),
        };
        let page = |parts: Vec<ExplainedPart>| ExplainPage {
            title: "walk".to_owned(),
            sentence: String::new(),
            chips: Vec::new(),
            error_mm: 169.0,
            parts,
            joints: Vec::new(),
            frames_per_second: 60.0,
            cells: Vec::new(),
            notes: Vec::new(),
            worst: Vec::new(),
        };
        let told = page(vec![part("cameras", -663.0), part("what remains", 832.0)]).bar_note(832.0).unwrap();
        assert!(told.contains("832.0 mm together") && told.ends_with("below 0: cameras (-663.0 mm)."), "{told}");
        assert_eq!(page(vec![part("what remains", 832.0)]).bar_note(832.0), None);
    }
}
