//! What a bound is computed of: a motion in front of cameras, of a scenario or a set.

use std::path::Path;

use crate::common::ExperimentError;
use crate::prepare::PreparedScene;
use crate::scenario::ScenarioFile;
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::camera::TimedRig;
use skiagraph_set::{SetError, SetPlace, StepSpread};
use skiagraph_truth::observing::ObservationFacts;
use skiagraph_truth::scene::GroundTruth;

/// A motion of the tracker's body in front of cameras.
#[derive(Clone, Debug)]
pub struct BoundScene {
    pub name: String,
    pub body: Humanoid,
    /// Its motion nearest to the truth.
    pub motion: Motion,
    /// The true cameras.
    pub rig: TimedRig,
    /// How the observations are made.
    pub observation: ObservationFacts,
    /// Number of props and other people, which may hide the body.
    pub occluders: usize,
    /// The hash of the set; `None` for a scenario.
    pub set_hash: Option<String>,
}

impl BoundScene {
    /// The scene of a set.
    ///
    /// # Errors
    /// [`ExperimentError`] if a file cannot be read, or the set has no truth: a bound needs the pose of every frame.
    pub fn of_set(place: SetPlace<'_>) -> Result<Self, ExperimentError> {
        let set = match place.read() {
            Err(SetError::NoTruth { .. }) => return Err(without(place, "no truth")),
            found => found?,
        };
        Ok(Self {
            name: set.blind.name,
            body: set.blind.start.body,
            motion: set.truth.refitted.ok_or_else(|| without(place, "no motion of the tracker's body"))?,
            rig: set.truth.rig,
            occluders: occluders(&set.truth.ground_truth),
            observation: set.blind.observation.unwrap_or_default(),
            set_hash: Some(set.blind.set_hash),
        })
    }

    /// The scene of a scenario; clips are also searched below `mocap_directory`.
    pub fn of_scenario(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Result<Self, ExperimentError> {
        let scene = PreparedScene::new(file, mocap_directory)?;
        Ok(Self {
            name: file.scenario.name.clone(),
            body: scene.start.body,
            motion: scene.refitted,
            rig: scene.rig,
            occluders: occluders(&scene.ground_truth),
            observation: file.scenario.observation.facts(),
            set_hash: None,
        })
    }

    /// Root mean square of the motion's change from frame to frame, in the order of a step. What never changes has
    /// [`LEAST_CHANGE`], which keeps matrices regular.
    pub(super) fn scales(&self) -> Result<Vec<f64>, ExperimentError> {
        let spread = StepSpread::of_motion(&self.body, &self.motion)?;
        Ok(spread.change.iter().map(|change| change.max(LEAST_CHANGE)).collect())
    }

    pub(super) fn occlusion_note(&self) -> Option<String> {
        let note = || {
            format!(
                "left out: {} props or other people, which may hide the body and so make errors larger",
                self.occluders
            )
        };
        (self.occluders > 0).then(note)
    }
}

fn without(place: SetPlace<'_>, what: &str) -> ExperimentError {
    let folder = place.folder.display();
    let detail = format!(
        "{folder} has {what}, and a bound needs the pose of every frame; give the folder with --truth DIR, or the \
         scenario"
    );
    ExperimentError::Argument { argument: "SET", detail }
}

/// Least change from frame to frame that a filter expects, metres and radians.
const LEAST_CHANGE: f64 = 1e-5;

fn occluders(truth: &GroundTruth) -> usize {
    truth.props.len() + truth.distractors.len()
}
