//! `skiagraph check`: everything that can be said of a scenario before any work.

use std::path::Path;

use serde::Serialize;

use super::{ExperimentError, ScenarioFile, Staged};
use crate::tracker::FilterSettings;

/// What a sound scenario amounts to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Soundness {
    /// `skiagraph.check/1`.
    pub schema: &'static str,
    /// The scenario's name.
    pub scenario: String,
    /// The recording's name.
    pub clip: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames a second.
    pub frames_per_second: f64,
    /// Seconds from the first frame to the end of the last.
    pub duration_s: f64,
    /// The body that is seen.
    pub actor: String,
    /// The body that the tracker believes in.
    pub tracker_body: String,
    /// Whether they are one.
    pub matched: bool,
    /// Mean distance of the actor's markers from the recorded ones, millimetres.
    pub retarget_residual_mm: f64,
    /// Names of the cameras.
    pub cameras: Vec<String>,
    /// The tracker's name; of several methods all, in the order of the methods' names.
    pub tracker: String,
    /// How many seeds.
    pub seeds: u32,
    /// Likelihood evaluations of all frames and seeds.
    pub likelihood_evaluations: u64,
    /// What a user should know: guesses, mended frames, doubtful views.
    pub notes: Vec<String>,
}

/// Reads everything that a scenario names and sets the scene, without drawing or tracking.
///
/// # Errors
/// [`ExperimentError`] that names the file, line or key.
pub fn check(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Result<Soundness, ExperimentError> {
    let staged = Staged::new(file, mocap_directory)?;
    let scenario = &file.scenario;
    let trackers = scenario.trackers();
    let evaluations = |f: FilterSettings| f.particles as u64 * f.layers as u64;
    let per_frame: u64 = trackers.iter().filter_map(|(_, t)| t.filter()).map(evaluations).sum();
    let names: Vec<&str> = trackers.iter().map(|(_, t)| t.name()).collect();
    let (frames, frames_per_second) = (staged.frames(), staged.ground_truth.frames_per_second);
    Ok(Soundness {
        schema: "skiagraph.check/1",
        scenario: scenario.name.clone(),
        frames,
        frames_per_second,
        duration_s: frames as f64 / frames_per_second,
        actor: staged.ground_truth.actor.name.clone(),
        tracker_body: staged.start.body.name.clone(),
        matched: staged.facts.matched,
        retarget_residual_mm: staged.report.mean_residual_mm,
        cameras: staged.rig.cameras.iter().map(|camera| camera.name.clone()).collect(),
        tracker: names.join(", "),
        seeds: scenario.seeds,
        likelihood_evaluations: per_frame * frames as u64 * u64::from(scenario.seeds),
        notes: staged.notes,
        clip: staged.clip,
    })
}
