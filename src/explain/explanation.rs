//! The error of a run and its causes: `explain.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::errors::ErrorProfile;
use super::player::Player;
use skiagraph_core::body::LANDMARKS;
use skiagraph_eval::Interval;

pub(super) const SCHEMA: &str = "skiagraph.explain/1";

/// The error of a run and its causes; `explain.json`. Errors are `humaneva_mm`, means over seeds.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// `skiagraph.explain/1`.
    pub schema: &'static str,
    /// The run's folder, as given.
    pub run: String,
    /// Name of the run's set.
    pub scenario: String,
    /// Hash of the run's set.
    pub set_hash: String,
    pub tracker: String,
    pub seeds: Vec<u64>,
    pub version: &'static str,
    /// Whether only single inputs and all together were replaced.
    pub quick: bool,
    /// The repetition with nothing replaced.
    pub repetition: Repetition,
    pub sentence: String,
    pub error_mm: f64,
    /// Its causes, which add up to the error with `interaction_mm` and `rest_mm`.
    pub causes: Vec<Cause>,
    /// What the effects of single inputs lack of that of all together, mm; only with `quick` and several inputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interaction_mm: Option<f64>,
    /// The interaction by joint and over time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interaction: Option<CauseParts>,
    /// What remains with everything true, mm.
    pub rest_mm: f64,
    /// What remains, in the same parts as a cause.
    pub rest: CauseParts,
    /// Number of frames in which no camera took an image, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames_without_image: Option<usize>,
    /// What cannot be or need not be replaced.
    pub left_out: Vec<NotReplaced>,
    /// The error with each set of inputs true.
    pub cells: Vec<ExplainedCell>,
    pub frames_per_second: f64,
    /// The worst seconds, as sets in this folder.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub worst: Vec<WorstSecond>,
}

impl Explanation {
    /// The parts in one sentence of fixed form: `Error 41.2 mm: cameras 33.0 mm, what remains 8.2 mm.`
    pub(super) fn describe(&self) -> String {
        let mut parts: Vec<String> =
            self.causes.iter().map(|cause| format!("{} {:.1} mm", cause.name, cause.error_mm)).collect();
        parts.extend(self.interaction_mm.map(|interaction| format!("interaction {interaction:.1} mm")));
        parts.push(format!("what remains {:.1} mm", self.rest_mm));
        format!("Error {:.1} mm: {}.", self.error_mm, parts.join(", "))
    }
}

/// One of the worst seconds of the run, as a set of its own.
#[derive(Clone, Debug, Serialize)]
pub struct WorstSecond {
    /// The set's folder, beside `explain.json`.
    pub folder: String,
    pub seed: u64,
    /// First frame of the second, in the run's set, from 0.
    pub first_frame: usize,
    pub last_frame: usize,
    /// The frame with which the set begins; its start pose is the run's estimate of this frame, in frame 0 the run's.
    pub set_begins_at: usize,
    /// Mean error of the second in the run, mm.
    pub error_mm: f64,
    /// Mean error when the tracker is run on the new set with the same seed, mm.
    pub again_mm: f64,
    /// Whether that gives the run's estimates to the bit.
    pub is_identical: bool,
    /// The energy around the truth in the frame of greatest error; absent for trackers that do not compare silhouettes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub landscape: Option<Landscape>,
}

/// The energy on the plane through the truth of the two directions that the images tell least about. A direction has
/// the length that moves the markers by 1 mm, root mean square.
#[derive(Clone, Debug, Serialize)]
pub struct Landscape {
    pub frame: usize,
    /// What moves most in each direction.
    pub directions: [String; 2],
    /// Distance of the plane's edges from the truth, mm.
    pub reach_mm: f64,
    pub points: usize,
    /// Energies, row by row along the second direction.
    pub energies: Vec<f64>,
    pub minimum_mm: [f64; 2],
    /// Its distance from the truth.
    pub bias_mm: f64,
    /// Diameter of a disc with the area below the middle between minimum and border.
    pub width_mm: f64,
    /// Other minima below that level, lowest first, at most three.
    pub rivals_mm: Vec<[f64; 2]>,
    /// The estimate, projected onto the plane.
    pub estimate_mm: [f64; 2],
    /// Distance of the estimate from the truth in all directions.
    pub estimate_away_mm: f64,
    pub energy_of_truth: f64,
    pub energy_of_estimate: f64,
}

/// The repetition of the first seed with nothing replaced.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Repetition {
    pub seed: u64,
    /// Whether it gave the run's estimates to the bit.
    pub is_identical: bool,
    pub error_mm: f64,
    pub error_in_run_mm: f64,
}

#[derive(Clone, Debug, Serialize)]
pub struct Cause {
    /// The input, or the search.
    pub player: Player,
    pub name: &'static str,
    /// What is wrong; may be empty.
    pub fault: String,
    /// Its part of the error, mm; below 0 if its truth makes the error larger.
    pub error_mm: f64,
    /// The 95 % interval over seeds; absent for fewer than three.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<Interval>,
    /// By how much the error falls if only this is true, mm; for the search as `error_mm`.
    pub alone_mm: f64,
    /// Its part by joint and over time.
    pub parts: CauseParts,
}

/// A part of the error by joint and over time, mm; null where nothing is measured.
#[derive(Clone, Debug, Serialize)]
pub struct CauseParts {
    /// By marker.
    pub joints: BTreeMap<&'static str, f64>,
    /// By frame.
    pub frames: Vec<f64>,
}

impl CauseParts {
    pub(super) fn new(errors: &ErrorProfile) -> Self {
        let names = LANDMARKS.iter().map(|landmark| landmark.name());
        Self { joints: names.zip(errors.joints.iter().copied()).collect(), frames: errors.frames.clone() }
    }
}

#[derive(Clone, Debug, Serialize)]
pub struct NotReplaced {
    /// The input, or the search.
    pub player: Player,
    pub name: &'static str,
    pub reason: &'static str,
}

/// The error with some inputs true.
#[derive(Clone, Debug, Serialize)]
pub struct ExplainedCell {
    /// What is true.
    pub replaced: Vec<Player>,
    pub error_mm: Vec<f64>,
}
