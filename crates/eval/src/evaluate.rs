//! All metrics of one sequence.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use skiagraph_core::body::LANDMARKS;

use super::breakdown::{self, BreakdownGroup};
use super::over_time::over_time;
use super::pck::{self, CurvePoint};
use super::registry::WITHOUT_TRUTH;
use super::reprojection::{self, PerCameraError};
use super::{EvaluationError, FrameSpread, LostStretch, METRICS, Measurement, Metric, Sequence, Unit};
use super::{coverage, lost_limb, protocol};

/// Everything measured on one sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Evaluation {
    /// Frames per second.
    pub frames_per_second: f64,
    /// All frames of the sequence, including those left out.
    pub frames: usize,
    /// The first scored frame.
    pub first_scored: usize,
    /// Share of the truth's markers, over all scored frames, that the estimate has.
    pub coverage: f64,
    /// By [`Metric::name`]; a metric without its input is absent.
    pub metrics: BTreeMap<String, MetricValue>,
    /// The inputs that each absent metric needs, by metric name.
    #[serde(default)]
    pub absent: BTreeMap<String, String>,
    /// Error of every compared marker, in the order of [`LANDMARKS`].
    pub per_joint: Vec<JointError>,
    /// The truth's markers that an estimate with some markers has in no scored frame, by
    /// [`skiagraph_core::body::Landmark::name`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub never_estimated: Vec<String>,
    /// Errors by group of markers: gait phase, speed, number of cameras that see them.
    #[serde(default)]
    pub breakdown: Vec<BreakdownGroup>,
    /// Errors by camera; empty if the cameras are unknown.
    #[serde(default)]
    pub per_camera: Vec<PerCameraError>,
    /// The longest run of frames in which a marker is lost throughout; absent if none is long enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_lost: Option<LostStretch>,
    /// Share of markers within 0, 5, ... 150 mm.
    pub pck_curve: Vec<CurvePoint>,
}

/// One metric of one sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MetricValue {
    /// Unit of all values.
    pub unit: Unit,
    /// The measurement: for most metrics, the mean over frames.
    pub mean: f64,
    /// Spread over frames; `None` for a metric with one value for the whole sequence.
    #[serde(flatten)]
    pub spread: Option<FrameSpread>,
    /// Number of frames that have a value; 0 for a metric of the whole sequence.
    pub frames: usize,
    /// Joint set, alignment, mask rule, frames and rate.
    pub protocol: String,
    /// One value per frame, `None` if left out or not measurable; empty for a metric of the whole sequence.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub per_frame: Vec<Option<f64>>,
}

/// Error of one marker over the scored frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointError {
    /// [`skiagraph_core::body::Landmark::name`].
    pub joint: String,
    /// Mean distance from the truth, millimetres.
    pub mean: f64,
    /// Spread of that distance over frames.
    #[serde(flatten)]
    pub spread: FrameSpread,
    /// Number of frames in which it was compared.
    pub frames: usize,
    /// Mean distance in each of 48 equal parts of the sequence (fewer if it has fewer frames), mm; not in files.
    #[serde(skip)]
    pub over_time: Vec<Option<f64>>,
}

/// Measures a sequence with every metric that its input allows.
///
/// # Errors
/// [`EvaluationError`] if lists differ in length, a number is not finite or nothing can be compared.
pub fn evaluate(sequence: &Sequence<'_>) -> Result<Evaluation, EvaluationError> {
    sequence.check()?;
    let span = span(sequence);
    let (mut metrics, mut absent) = (BTreeMap::new(), BTreeMap::new());
    // what needs a truth is no lack of a recording
    for metric in METRICS.iter().filter(|metric| sequence.has_truth || WITHOUT_TRUTH.contains(&metric.name)) {
        let value = (metric.measure)(sequence).and_then(|found| value_of(metric, found, sequence, &span));
        match value {
            Some(value) => drop(metrics.insert(metric.name.to_owned(), value)),
            None => drop(absent.insert(metric.name.to_owned(), format!("needs {}", metric.needs))),
        }
    }
    let per_joint = per_joint(sequence);
    Ok(Evaluation {
        frames_per_second: sequence.frames_per_second,
        frames: sequence.frames(),
        first_scored: sequence.first_scored,
        coverage: coverage::share(sequence),
        metrics,
        absent,
        never_estimated: never_estimated(sequence, &per_joint),
        per_joint,
        breakdown: breakdown::breakdown(sequence),
        per_camera: reprojection::per_camera(sequence),
        longest_lost: lost_limb::longest_stretch(sequence),
        pck_curve: pck::curve(sequence),
    })
}

fn value_of(metric: &Metric, measurement: Measurement, sequence: &Sequence<'_>, span: &str) -> Option<MetricValue> {
    let (per_frame, whole) = match measurement {
        Measurement::PerFrame(per_frame) => (per_frame, None),
        Measurement::Pooled { per_frame, mean } => (per_frame, Some(mean)),
        Measurement::Whole(value) => (vec![], Some(value)),
    };
    // written values must be finite or absent, and a projection next to a camera's plane may be infinite
    let per_frame: Vec<Option<f64>> = per_frame.into_iter().map(|value| value.filter(|v| v.is_finite())).collect();
    let values: Vec<f64> = per_frame.iter().flatten().copied().collect();
    let mean = whole.or_else(|| super::mean(&values)).filter(|mean| mean.is_finite())?;
    let protocol = format!("{}; {span}", protocol::describe(metric, sequence));
    let spread = FrameSpread::from_values(&values);
    Some(MetricValue { unit: metric.unit, mean, spread, frames: values.len(), protocol, per_frame })
}

/// Describes which frames are scored.
fn span(sequence: &Sequence<'_>) -> String {
    let (frames, fps) = (sequence.frames(), sequence.frames_per_second);
    let last = frames - 1;
    match sequence.first_scored {
        0 => format!("frames 0 to {last} at {fps} fps"),
        1 => format!("frames 1 to {last} at {fps} fps, frame 0 (the start pose) left out"),
        first => format!("frames {first} to {last} at {fps} fps, the first {first} left out"),
    }
}

fn per_joint(sequence: &Sequence<'_>) -> Vec<JointError> {
    let (truth, estimate) = (sequence.truth_markers, sequence.estimate_markers);
    let of_joint = |(index, landmark): (usize, skiagraph_core::body::Landmark)| {
        let distance = |frame| Some(1000.0 * (estimate.get(frame, index)? - truth.get(frame, index)?).norm());
        // joint by joint: all errors of a long sequence at once would need too much memory
        let errors: Vec<f64> = sequence.scored().filter_map(distance).collect();
        let (mean, spread) = (super::mean(&errors)?, FrameSpread::from_values(&errors)?);
        let over_time = over_time(sequence, |frame| distance(frame).into_iter().collect());
        Some(JointError { joint: landmark.name().to_owned(), mean, spread, frames: errors.len(), over_time })
    };
    LANDMARKS.into_iter().enumerate().filter_map(of_joint).collect()
}

/// Names of the truth's markers without an error; none if no marker has one.
fn never_estimated(sequence: &Sequence<'_>, compared: &[JointError]) -> Vec<String> {
    let known = |index: usize| sequence.scored().any(|frame| sequence.truth_markers.get(frame, index).is_some());
    let of_truth = LANDMARKS.iter().enumerate().filter(|(index, _)| known(*index)).map(|(_, landmark)| landmark.name());
    let absent = of_truth.filter(|name| !compared.is_empty() && !compared.iter().any(|joint| joint.joint == *name));
    absent.map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    #[test]
    fn frame_zero_is_left_out_of_everything() {
        let truth = vec![standing(); 3];
        let mut estimate = truth.clone();
        estimate[0] = translated(&standing(), Vector3::new(9.0, 0.0, 0.0));
        let evaluation = evaluate_markers(&truth, &estimate);
        assert_eq!(evaluation.metrics["humaneva_mm"].spread.unwrap().max, 0.0);
        assert_eq!(evaluation.metrics["humaneva_mm"].per_frame[0], None);
        assert!(evaluation.per_joint.iter().all(|joint| joint.spread.max == 0.0 && joint.frames == 2));
        assert_eq!(evaluation.metrics["pck150"].mean, 1.0);
    }

    #[test]
    fn every_value_carries_rate_and_frames_in_its_protocol() {
        let truth = vec![standing(); 100];
        for (name, value) in evaluate_markers(&truth, &truth).metrics {
            let span = "frames 1 to 99 at 60 fps, frame 0 (the start pose) left out";
            assert!(value.protocol.ends_with(span), "{name}: {}", value.protocol);
        }
    }

    #[test]
    fn a_metric_of_the_sequence_has_no_spread_and_a_metric_per_frame_has() {
        let truth = vec![standing(); 80];
        let metrics = evaluate_markers(&truth, &truth).metrics;
        assert_eq!((metrics["lag_ms"].spread, metrics["lag_ms"].frames), (None, 0));
        assert!(metrics["humaneva_mm"].spread.is_some());
        let text = serde_json::to_string(&metrics["lag_ms"]).unwrap();
        assert!(["std", "median", "p90", "max"].iter().all(|word| !text.contains(&format!("\"{word}\""))), "{text}");
    }

    #[test]
    fn an_evaluation_can_be_read_back_from_json() {
        let truth = vec![standing(); 80];
        let moved: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.1, 0.2, 0.3))).collect();
        let mut evaluation = evaluate_markers(&truth, &moved);
        let text = serde_json::to_string(&evaluation).unwrap();
        evaluation.per_joint.iter_mut().for_each(|joint| joint.over_time.clear());
        assert_eq!(serde_json::from_str::<Evaluation>(&text).unwrap(), evaluation);
    }
}
