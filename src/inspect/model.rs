//! The summary of a model file.

use std::path::Path;

use serde::Serialize;

use super::INSPECT_SCHEMA;
use crate::common::ExperimentError;
use crate::train::{LearnedModel, ModelFacts};
use skiagraph_report::plots::{Colour, Line, LinePlot, Size, Stroke};
use skiagraph_track::motion_model::gpdm_graph::{Candidate, GraphSegment, ModelKind};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `model`.
    pub what: &'static str,
    /// Its robot, training motions and settings.
    pub facts: ModelFacts,
    /// The models, in the order of the training frames.
    pub models: Vec<GraphModelFacts>,
    pub candidates: usize,
    /// Ordered pairs of candidates of different models: the possible inter-transitions.
    pub inter_transitions: usize,
    /// Distance between recording and simulation over all frames (`[GPDM graph]`, Eq. 9).
    pub reconstruction_error_rad2: MeanAndMost,
    /// The same for the compared model, and the ratio of the means.
    pub against: Option<Against>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GraphModelFacts {
    pub motion: usize,
    /// First frame at the model's rate, from 0.
    pub first: usize,
    pub frames: usize,
    /// Distance between recording and simulation.
    pub reconstruction_error_rad2: MeanAndMost,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeanAndMost {
    pub mean: f64,
    /// Greatest value of a frame.
    pub max: f64,
}

/// Another model of the same motions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Against {
    /// `gpdm` or `gpdm-graph`.
    pub kind: &'static str,
    pub reconstruction_error_rad2: MeanAndMost,
    /// This model's mean error over the other's.
    pub ratio: f64,
}

impl MeanAndMost {
    fn new(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count().max(1) as f64;
        Self { mean: values.clone().sum::<f64>() / count, max: values.fold(0.0, f64::max) }
    }
}

impl ModelSummary {
    /// The summary of a model, compared with another of the same motions if one is given.
    pub(super) fn new(model: &LearnedModel, other: Option<&LearnedModel>) -> Self {
        let error = all_errors(model);
        let graph = &model.graph;
        let of = |s: &GraphSegment| GraphModelFacts {
            motion: s.range.motion,
            first: s.range.first,
            frames: s.errors.len(),
            reconstruction_error_rad2: MeanAndMost::new(s.errors.iter().copied()),
        };
        let pairs = |c: &Candidate| graph.candidates.iter().filter(|other| other.segment != c.segment).count();
        let against = |other: &LearnedModel| {
            let of_other = all_errors(other);
            Against { kind: other.facts.kind(), reconstruction_error_rad2: of_other, ratio: error.mean / of_other.mean }
        };
        Self {
            schema: INSPECT_SCHEMA,
            what: "model",
            facts: model.facts.clone(),
            models: graph.segments.iter().map(of).collect(),
            candidates: graph.candidates.len(),
            inter_transitions: graph.candidates.iter().map(pairs).sum(),
            reconstruction_error_rad2: error,
            against: other.map(against),
        }
    }
}

pub(super) fn read_other(path: &Path, model: &LearnedModel) -> Result<LearnedModel, ExperimentError> {
    let other = LearnedModel::read(path)?;
    other.facts.check_fits(path, &model.body, model.facts.frames_per_second)?;
    if other.facts.learned_from != model.facts.learned_from {
        let detail = "learned from other motions; only models of the same motions can be compared";
        return Err(ExperimentError::Malformed { path: path.to_owned(), detail: detail.to_owned() });
    }
    Ok(other)
}

/// The picture of a model: the distance between recording and simulation in every training frame (`[GPDM graph]`,
/// Figs. 3 and 5b), beside that of another model, and the threshold of a graph.
pub(super) fn picture(model: &LearnedModel, other: Option<(&Path, &LearnedModel)>) -> Result<String, ExperimentError> {
    const COLOURS: [Colour; 6] =
        [Colour::Blue, Colour::Orange, Colour::Green, Colour::Purple, Colour::Amber, Colour::Ink];
    let mut lines = Vec::new();
    if let Some((path, other)) = other {
        let errors = other.graph.segments.iter().flat_map(|segment| &segment.errors);
        let points = errors.enumerate().map(|(frame, error)| (frame as f64, Some(*error))).collect();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        lines.push(Line::new(&name, Stroke::solid(Colour::Grey), points));
    }
    let mut start = 0;
    for (index, segment) in model.graph.segments.iter().enumerate() {
        let points = segment.errors.iter().enumerate().map(|(row, error)| ((start + row) as f64, Some(*error)));
        // more names than colours would only fill the legend
        let name = if index < COLOURS.len() { format!("model {index}") } else { String::new() };
        lines.push(Line::new(&name, Stroke::solid(COLOURS[index % COLOURS.len()]), points.collect()));
        start += segment.errors.len();
    }
    if model.facts.settings.kind() == ModelKind::GpdmGraph {
        let threshold = model.facts.settings.threshold_per_joint * model.graph.chart.groups().len() as f64;
        let level = vec![(0.0, Some(threshold)), (start.saturating_sub(1) as f64, Some(threshold))];
        lines.push(Line::new("threshold", Stroke::dashed(Colour::Faint), level));
    }
    let plot = LinePlot {
        x_label: "training frame".to_owned(),
        y_label: "distance between simulation and recording, rad\u{b2}".to_owned(),
        lines,
        y_from: Some(0.0),
        ..LinePlot::default()
    };
    Ok(plot.svg(Size { width: 1160, height: 380 })?.standalone())
}

fn all_errors(model: &LearnedModel) -> MeanAndMost {
    MeanAndMost::new(model.graph.segments.iter().flat_map(|s| s.errors.iter().copied()))
}
