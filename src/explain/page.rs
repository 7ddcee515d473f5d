//! The page of an explanation.

use std::collections::BTreeMap;

use serde::Serialize;

use super::explanation::{Cause, CauseParts, Explanation, Repetition, WorstSecond};
use super::player::Player;
use crate::common::ExperimentError;
use skiagraph_core::body::LANDMARKS;
use skiagraph_report::html::render_page;
use skiagraph_report::plots::{Colour, Line, LinePlot, Stroke};
use skiagraph_report::{ReportError, ResponsiveSvg, heat_map};

const TEMPLATE: &str = include_str!("page.html");
/// Colours of the parts, in their order; the last one, what remains, is grey.
const COLOURS: [Colour; 6] = [Colour::Blue, Colour::Orange, Colour::Green, Colour::Purple, Colour::Amber, Colour::Red];

#[derive(Serialize)]
struct ExplainPage<'a> {
    title: &'a str,
    explanation: &'a Explanation,
    names: BTreeMap<Player, &'a str>,
    parts: &'a [Part<'a>],
    totals: Bar,
    joints: Vec<Bar>,
    /// Length of the longest bar of a joint, mm.
    longest_mm: f64,
    time: ResponsiveSvg,
    notes: Vec<String>,
    worst: Vec<WorstOnPage<'a>>,
}

/// A part of the error: a cause, the interaction, or what remains.
#[derive(Serialize)]
struct Part<'a> {
    name: &'a str,
    error_mm: f64,
    cause: Option<&'a Cause>,
    /// As in the page's style.
    colour: String,
    #[serde(skip)]
    tone: Colour,
    #[serde(skip)]
    parts: &'a CauseParts,
}

/// An error, divided in the order of the parts; mm.
#[derive(Serialize)]
struct Bar {
    name: String,
    error_mm: f64,
    values: Vec<f64>,
    /// Sum of the parts above 0, which the bar shows.
    length_mm: f64,
}

#[derive(Serialize)]
struct WorstOnPage<'a> {
    #[serde(flatten)]
    second: &'a WorstSecond,
    again: String,
    /// The energies of its landscape as PNG.
    energies: Option<String>,
}

impl Bar {
    fn new(name: &str, values: Vec<f64>) -> Self {
        let length_mm = values.iter().filter(|value| **value > 0.0).sum();
        Self { name: name.replace('_', " "), error_mm: values.iter().sum(), values, length_mm }
    }
}

pub(super) fn page(of: &Explanation) -> Result<String, ExperimentError> {
    let parts = parts(of);
    let mut joints = Vec::new();
    for landmark in LANDMARKS {
        let values = parts.iter().map(|part| part.parts.joints.get(landmark.name()).copied().unwrap_or(f64::NAN));
        joints.push(Bar::new(landmark.name(), values.collect()));
    }
    joints.retain(|joint| joint.error_mm.is_finite());
    let mut worst = Vec::new();
    for second in &of.worst {
        let energies = second.landscape.as_ref().map(|found| heat_map(&found.energies, found.points)).transpose()?;
        worst.push(WorstOnPage { second, again: again(second), energies });
    }
    let page = ExplainPage {
        title: &of.scenario,
        explanation: of,
        names: of.causes.iter().map(|cause| (cause.player, cause.name)).collect(),
        parts: &parts,
        totals: Bar::new("", parts.iter().map(|part| part.error_mm).collect()),
        longest_mm: joints.iter().map(|joint| joint.length_mm).fold(f64::MIN_POSITIVE, f64::max),
        joints,
        time: over_time(of, &parts)?,
        notes: notes(of),
        worst,
    };
    Ok(render_page(TEMPLATE, &page)?)
}

impl<'a> Part<'a> {
    fn new(name: &'a str, error_mm: f64, parts: &'a CauseParts) -> Self {
        Self { name, error_mm, cause: None, colour: Colour::Grey.variable(), tone: Colour::Grey, parts }
    }
}

/// The causes, the interaction if there is one, and what remains.
fn parts(of: &Explanation) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    for cause in &of.causes {
        parts.push(Part { cause: Some(cause), ..Part::new(cause.name, cause.error_mm, &cause.parts) });
    }
    if let (Some(error_mm), Some(interaction)) = (of.interaction_mm, &of.interaction) {
        parts.push(Part::new("interaction", error_mm, interaction));
    }
    for (part, tone) in parts.iter_mut().zip(COLOURS.into_iter().cycle()) {
        (part.tone, part.colour) = (tone, tone.variable());
    }
    parts.push(Part::new("what remains", of.rest_mm, &of.rest));
    parts
}

fn over_time(of: &Explanation, parts: &[Part<'_>]) -> Result<ResponsiveSvg, ReportError> {
    let mut whole = vec![0.0; of.rest.frames.len()];
    let mut lines = Vec::new();
    for part in parts {
        whole.iter_mut().zip(&part.parts.frames).for_each(|(sum, own)| *sum += own);
        lines.push(line(of, part.name, part.tone, &part.parts.frames));
    }
    lines.insert(0, line(of, "error", Colour::Ink, &whole));
    let plot =
        LinePlot { x_label: "time, s".to_owned(), y_label: "error, mm".to_owned(), lines, ..LinePlot::default() };
    ResponsiveSvg::of_lines(&plot, true, [330, 300, 280])
}

fn line(of: &Explanation, name: &str, tone: Colour, frames: &[f64]) -> Line {
    let mut points = Vec::new();
    for (frame, error) in frames.iter().enumerate() {
        points.push((frame as f64 / of.frames_per_second, Some(*error).filter(|error| error.is_finite())));
    }
    Line::new(name, Stroke::solid(tone), points)
}

/// How a worst second ends when it is tracked again.
pub(crate) fn again(of: &WorstSecond) -> String {
    let WorstSecond { again_mm, is_identical, set_begins_at, .. } = of;
    match (is_identical, set_begins_at) {
        (true, _) => "repeats to the bit".to_owned(),
        (false, 0) => format!("{again_mm:.1} mm, not to the bit"),
        (false, begin) => format!("{again_mm:.1} mm from the run's estimate of frame {begin}, not to the bit"),
    }
}

/// The repetition with nothing replaced, frames without an image, and what was left out.
pub(crate) fn notes(of: &Explanation) -> Vec<String> {
    let Repetition { seed, is_identical, error_mm, error_in_run_mm } = of.repetition;
    let mut notes = vec![format!(
        "Repeated with nothing replaced, seed {seed}: {error_mm:.2} mm, in the run {error_in_run_mm:.2} mm; equal bit for \
         bit: {}.",
        if is_identical { "yes" } else { "no" }
    )];
    notes.extend(
        of.frames_without_image
            .map(|frames| format!("Frames without an image, whose error counts as the search's: {frames}.")),
    );
    notes.extend(of.left_out.iter().map(|left| format!("Left out: {} ({}).", left.name, left.reason)));
    notes
}
