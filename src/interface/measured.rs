//! Estimates measured against the truth.

use std::path::Path;

use super::begin_saved;
use crate::artefacts::Destination;
use crate::common::{ExperimentError, NoProgress};
use crate::measure::measuring::check_fit;
use crate::measure::{Measures, RunResults, Tracked};
use crate::prepare::scene_hash::scene_hash;
use crate::runs::run::check_sources;
use skiagraph_eval::{Evaluation, MeasuredClip, MeasuredRuns, Summary};
use skiagraph_set::{BenchmarkSet, EstimatedSequence};

/// What [`measure`] found.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Measured {
    /// Every metric over all seeds, with its unit, protocol and, from three seeds on, 95 % interval.
    pub summary: Summary,
    /// Every seed's metrics, frame by frame, in the order of the estimates' seeds.
    pub seeds: Vec<Evaluation>,
    /// The metrics of a tracker that never moves.
    pub frozen: Evaluation,
    /// What would remove most of the error if the estimates were read otherwise, such as in other units; `None` if
    /// nothing would.
    pub hint: Option<String>,
    measures: Measures,
    run: MeasuredClip,
}

/// Measures estimates against the truth of a set. [`Tracked`] is what [`track`](fn@crate::track) returns; estimates
/// from elsewhere are converted by `Tracked::from`.
///
/// ```
/// use skiagraph_set::{EstimatedSequence, Estimates};
/// use skiagraph_track::tracker::Tracker;
/// use skiagraph::{ScenarioFile, Tracked, measure, render};
///
/// let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &["last_frame=4".to_owned()])?;
/// let (set, _notes) = render(&scenario, None)?;
/// // the true poses, which are of the tracker's body in this set
/// let poses = set.truth.ground_truth.motion().poses;
/// let sequences = vec![EstimatedSequence::from_poses(&set.blind.start.body, poses)];
/// let frames_per_second = set.blind.frames_per_second;
/// let exact = Estimates { frames_per_second, seeds: vec![0], sequences, bodies: Vec::new(), notes: Vec::new() };
/// let measured = measure(&set, &Tracked::from(exact.clone()))?;
/// assert!(measured.summary.metrics["humaneva_mm"].mean < 1e-6);
///
/// let other_rate = Estimates { frames_per_second: 24.0, ..exact };
/// let refused = measure(&set, &Tracked::from(other_rate)).unwrap_err().to_string();
/// assert!(refused.contains("the run has 24 frames a second"), "{refused}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ExperimentError::Unfit`] if the estimates do not fit the set: made on another set, with another frame rate, number
/// of frames or joint angles, without any estimate. [`ExperimentError::LearnedFromTest`] if the tracker's model file
/// learned from frames of the set.
pub fn measure(set: &BenchmarkSet, tracked: &Tracked) -> Result<Measured, ExperimentError> {
    let fit = check_shape(set, tracked).and_then(|()| check_fit(&set.blind, tracked));
    fit.map_err(|detail| ExperimentError::Unfit { set: set.blind.name.clone(), detail })?;
    check_sources(set, tracked, Path::new("estimates"), &NoProgress)?;
    let measures = Measures::new(set, tracked, &NoProgress)?;
    Ok(Measured {
        summary: measures.summary.clone(),
        seeds: measures.seeds.iter().map(|seed| seed.evaluation.clone()).collect(),
        frozen: measures.frozen.clone(),
        hint: measures.hint.as_ref().map(|hint| hint.text.clone()),
        run: comparable(set, tracked).with_values(&measures.summary),
        measures,
    })
}

impl Measured {
    /// Writes the measured run to a folder, with its report, as `skiagraph track` and `skiagraph evaluate` together do.
    /// `set` and `tracked` are those that were measured.
    ///
    /// # Errors
    /// As [`Tracked::save`], and if the report cannot be drawn.
    pub fn save(&self, set: &BenchmarkSet, tracked: &Tracked, to: Destination<'_>) -> Result<(), ExperimentError> {
        let directory = begin_saved(to)?;
        directory.write_all(&tracked.files(&set.blind)?)?;
        directory.write_all(&RunResults::new(set, tracked, &self.measures)?.files)?;
        Ok(directory.finish()?)
    }

    pub(super) fn runs(&self) -> MeasuredRuns {
        MeasuredRuns { clips: [(self.measures.clip.clone(), self.run.clone())].into(), ..MeasuredRuns::default() }
    }
}

/// Refuses estimates whose lists do not agree in length, or whose poses are of another body.
fn check_shape(set: &BenchmarkSet, tracked: &Tracked) -> Result<(), String> {
    let estimates = &tracked.estimates;
    let (seeds, sequences) = (estimates.seeds.len(), estimates.sequences.len());
    if seeds != sequences || seeds == 0 {
        return Err(format!("expected one sequence per seed, found {seeds} seeds and {sequences} sequences"));
    }
    if !estimates.bodies.is_empty() && estimates.bodies.len() != seeds {
        return Err(format!("expected one body per seed or none, found {}", estimates.bodies.len()));
    }
    let frames = set.blind.frame_count;
    for (index, (seed, sequence)) in estimates.seeds.iter().zip(&estimates.sequences).enumerate() {
        let body = estimates.body(index, &set.blind.start.body);
        check_sequence(sequence, frames, body.degrees_of_freedom.len())
            .map_err(|what| format!("seed {seed}: {what}"))?;
    }
    Ok(())
}

fn check_sequence(sequence: &EstimatedSequence, frames: usize, angles: usize) -> Result<(), String> {
    let articulated = sequence.roots().map_or(frames, |roots| roots.len());
    if let Some(found) = [sequence.frames(), articulated].into_iter().find(|found| *found != frames) {
        return Err(format!("it has {found} frames, the set {frames}"));
    }
    let mut lengths = sequence.poses().unwrap_or_default().iter().flatten().map(|pose| pose.joint_angles.len());
    match lengths.find(|found| *found != angles) {
        Some(found) => Err(format!("a pose has {found} joint angles, the tracker's body {angles}")),
        None => Ok(()),
    }
}

/// What a comparison must know of the run, without its values.
fn comparable(set: &BenchmarkSet, tracked: &Tracked) -> MeasuredClip {
    let settings = tracked.record.as_ref().map(|record| &record.tracker);
    MeasuredClip {
        set_hash: set.blind.set_hash.clone(),
        scene_hash: Some(scene_hash(set)),
        frames: set.blind.frame_count,
        frames_per_second: set.blind.frames_per_second,
        tracker: settings.map_or("external", |settings| settings.name()).to_owned(),
        settings: settings.and_then(|settings| serde_json::to_value(settings).ok()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        ..MeasuredClip::default()
    }
}
