//! The set of a run with some of the tracker's inputs replaced by the truth. Random streams are keyed by their purpose,
//! so what stays wrong is wrong in the same way.

use std::sync::{Mutex, PoisonError};

use super::player::{Player, Sees, facts, has_exact_start};
use crate::common::{ExperimentError, Progress, Stage};
use crate::prepare::retargeting::{markers, refit};
use skiagraph_core::body::{Calibrated, Humanoid, Motion, Pose};
use skiagraph_core::camera::{CameraPath, CameraTiming, TimedRig};
use skiagraph_core::observation::Observation;
use skiagraph_set::{BenchmarkSet, SetError, SetParts, Start, StepSpread, Training, TrainingMotions, TruthFacts};
use skiagraph_truth::observing::{KeypointSettings, ObservationFacts, SilhouetteObserver, SilhouetteSource};

/// The set with these inputs replaced by the truth.
///
/// # Errors
/// [`ExperimentError::Argument`] if an input that should stay changes, because the set was not made by this program
/// alone; [`ExperimentError`] if an observation cannot be read or made.
pub(super) fn swapped(
    set: &BenchmarkSet,
    players: &[Player],
    progress: &dyn Progress,
) -> Result<BenchmarkSet, ExperimentError> {
    let is_true = |player: Player| players.contains(&player);
    let truth = &set.truth;
    let facts = swapped_facts(facts(set), players);
    let rig = if is_true(Player::Time) { on_time(&truth.rig)? } else { truth.rig.clone() };
    // which markers a camera sees is not computed again: only positions are measured
    let mut ground_truth = truth.ground_truth.clone();
    if is_true(Player::Observations) {
        ground_truth.distractors.clear();
    }
    let truth_facts = if is_true(Player::Body) {
        TruthFacts { matched: true, mismatch: String::new(), ..truth.facts.clone() }
    } else {
        truth.facts.clone()
    };
    let own = if is_true(Player::Body) { Some(ground_truth.motion()) } else { truth.refitted.clone() };
    let start = swapped_start(set, own.as_ref(), players)?;
    let parts = SetParts {
        name: &set.blind.name,
        rig: &rig,
        start: &start,
        ground_truth: &ground_truth,
        refitted: own.as_ref(),
        facts: &truth_facts,
        recordings: &truth.recordings,
        observation: set.blind.observation.is_some().then_some(&facts),
        key: truth.key,
    };
    progress.begin(Stage::Render, set.blind.frame_count);
    let is_seen_again = is_true(Player::Time) || is_true(Player::Observations);
    let observer = is_seen_again
        .then(|| SilhouetteObserver::new(&ground_truth, &rig, &facts, truth.facts.keyed_seed(truth.key)))
        .transpose()
        .map_err(|e| unfit(set, e.to_string()))?;
    let mut made = assembled(&parts, progress, |frame| {
        progress.advance();
        match &observer {
            Some(observer) => Ok(observer.observe(frame)),
            None => set.blind.observation(frame),
        }
    })?;
    made.blind.start.calibrate = start.calibrate;
    check_rest(set, &made, players)?;
    Ok(made)
}

pub(super) fn assembled(
    parts: &SetParts<'_>,
    progress: &dyn Progress,
    observe: impl Fn(usize) -> Result<Observation, SetError> + Sync,
) -> Result<BenchmarkSet, ExperimentError> {
    let failure: Mutex<Option<SetError>> = Mutex::new(None);
    let made = BenchmarkSet::assemble_unless(parts, &|| progress.interrupted(), |frame| {
        observe(frame).unwrap_or_else(|error| {
            *failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            Observation { frame, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints: None }
        })
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error.into());
    }
    if progress.interrupted() {
        return Err(ExperimentError::Interrupted);
    }
    Ok(made?)
}

/// Refuses a set whose given cameras do not follow from its truth and its recorded errors.
fn check_rest(set: &BenchmarkSet, made: &BenchmarkSet, players: &[Player]) -> Result<(), ExperimentError> {
    let (before, after) = (&set.blind, &made.blind);
    let stays = |player: Player| !players.contains(&player);
    if stays(Player::Cameras) && stays(Player::Time) && (before.rig != after.rig || before.moments != after.moments) {
        return Err(unfit(set, "its given cameras are not the true ones with the errors that it records".to_owned()));
    }
    Ok(())
}

/// Refuses a set whose silhouettes cannot be made again, which is needed if they or their times are replaced.
pub(super) fn check_observations(set: &BenchmarkSet) -> Result<(), ExperimentError> {
    let truth = &set.truth;
    let seed = truth.facts.keyed_seed(truth.key);
    let observer = SilhouetteObserver::new(&truth.ground_truth, &truth.rig, &facts(set), seed)
        .map_err(|e| unfit(set, e.to_string()))?;
    let last = set.blind.frame_count - 1;
    for frame in [0, last / 2, last] {
        let (known, seen) = (set.blind.observation(frame)?, observer.observe(frame));
        let is_same = |camera: usize| known.silhouettes.get(camera) == seen.silhouettes.get(camera);
        if !(0..set.blind.rig.cameras.len()).all(|camera| !set.blind.has_image(camera, frame) || is_same(camera)) {
            let detail = format!(
                "the silhouettes of its frame {frame} are not those that its truth and the errors that it records give"
            );
            return Err(unfit(set, detail));
        }
    }
    Ok(())
}

fn unfit(set: &BenchmarkSet, detail: String) -> ExperimentError {
    let name = &set.blind.name;
    let detail =
        format!("set {name}: {detail}, so they cannot be replaced; explain a run on a set of skiagraph render");
    ExperimentError::Argument { argument: "RUN", detail }
}

fn swapped_facts(mut facts: ObservationFacts, players: &[Player]) -> ObservationFacts {
    facts.corruption = players.iter().fold(facts.corruption, |corruption, player| player.without(&corruption));
    if players.contains(&Player::Observations) {
        facts.distractors = 0;
        if facts.silhouette == SilhouetteSource::Segmented {
            (facts.silhouette, facts.images, facts.background) = (SilhouetteSource::Exact, None, None);
        }
        facts.keypoints = facts.keypoints.map(|keypoints| KeypointSettings::exact(keypoints.layout));
    }
    facts
}

fn on_time(rig: &TimedRig) -> Result<TimedRig, ExperimentError> {
    let cameras = 0..rig.cameras();
    let paths: Vec<Option<CameraPath>> = cameras.clone().map(|camera| rig.path(camera).cloned()).collect();
    let timing = |camera| CameraTiming { offset_s: 0.0, line_delay_s: 0.0, ..*rig.timing(camera) };
    TimedRig::new(rig.rig().clone(), paths, cameras.map(timing).collect())
        .map_err(|e| ExperimentError::Argument { argument: "rig.timing", detail: e.to_string() })
}

/// What the tracker is given before the first frame; `own` is the motion of its body nearest to the truth.
fn swapped_start(set: &BenchmarkSet, own: Option<&Motion>, players: &[Player]) -> Result<Start, ExperimentError> {
    let given = &set.blind.start;
    let has_true_body = players.contains(&Player::Body);
    let exact = players.contains(&Player::Start) || (has_true_body && has_exact_start(set));
    let exact = own.and_then(|motion| motion.poses.first()).filter(|_| exact).cloned();
    if !has_true_body {
        return Ok(Start { pose: exact.unwrap_or_else(|| given.pose.clone()), ..given.clone() });
    }
    let (actor, rate) = (&set.truth.ground_truth.actor, set.blind.frames_per_second);
    let training = match &given.training {
        Training::Spread(_) => Training::Spread(StepSpread::of_motion(actor, &set.truth.ground_truth.motion())?),
        Training::Motions(training) => Training::Motions(TrainingMotions {
            motions: training
                .motions
                .iter()
                .map(|motion| refit(actor, &markers(&given.body, motion), motion.frames_per_second))
                .collect(),
            sources: training.sources.clone(),
        }),
    };
    let pose = exact.unwrap_or_else(|| carried_over(&given.body, &given.pose, actor, rate));
    // the true body needs no calibration, which also corrects wrong cameras
    let has_true_cameras = players.contains(&Player::Cameras) || !Player::Cameras.differs(set, Sees::Both);
    let calibrate = if has_true_cameras { Calibrated::Nothing } else { given.calibrate };
    Ok(Start { body: actor.clone(), pose, training, calibrate, has_known_stature: false })
}

/// A pose of one body on another: the same angles if they have the same joints, else the pose with the nearest markers.
fn carried_over(from: &Humanoid, pose: &Pose, to: &Humanoid, frames_per_second: f64) -> Pose {
    let names = |body: &Humanoid| body.degrees_of_freedom.iter().map(|d| d.name.clone()).collect::<Vec<_>>();
    if names(from) == names(to) {
        return pose.clone();
    }
    let motion = Motion { frames_per_second, poses: vec![pose.clone()] };
    let refitted = refit(to, &markers(from, &motion), frames_per_second);
    refitted.poses.into_iter().next().unwrap_or_else(|| to.zero_pose())
}
