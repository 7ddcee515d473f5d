//! The summary of a recording.

use std::collections::BTreeMap;

use serde::Serialize;

use super::INSPECT_SCHEMA;
use crate::common::ExperimentError;
use skiagraph_core::body::shipped;
use skiagraph_truth::mocap::Clip;
use skiagraph_truth::retarget::plausibility::{self, JUDGED, Judgement};
use skiagraph_truth::retarget::{
    Ground, LimitHits, RetargetError, RetargetOptions, RetargetReport, Retargeted, retarget,
};

/// Frames that are fitted; of longer recordings, frames at equal intervals.
const MOST_FITTED: usize = 2000;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClipSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `clip`.
    pub what: &'static str,
    pub name: String,
    pub frames: usize,
    pub frames_per_second: f64,
    /// Time from the first frame to the last.
    pub duration_s: f64,
    /// Whether it is one cycle of a cyclic motion.
    pub cyclic: bool,
    /// Median over the frames of the height of the bounding box of all joints.
    pub height_m: f64,
    /// Length of the root's path over the ground, summed over the frames.
    pub path_m: f64,
    /// Joints of the skeleton with their parents, root first.
    pub joints: Vec<(String, Option<String>)>,
    /// Fit to the robot `actor`, scaled to its subject; `None` if it cannot be retargeted, with a note.
    pub fit: Option<FitSummary>,
    /// Landmarks and their joints, as `joint_map` of `[motion]` takes them; empty if no body was found.
    pub joint_map: BTreeMap<String, String>,
    /// Whether a human body can move so, in one line.
    pub judgement: String,
    /// Notes about guesses (unit, up axis, rate) and repairs.
    pub notes: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitSummary {
    /// Mean distance of the body's landmarks from the recorded ones.
    pub mean_mm: f64,
    /// The worst landmark and its mean distance.
    pub worst: Option<(String, f64)>,
    /// Joint angles that reach a limit, with the number of frames.
    pub limits_hit: Vec<(String, usize)>,
}

impl FitSummary {
    fn new(report: &RetargetReport) -> Self {
        let worst = report.landmarks.iter().max_by(|a, b| a.mean_mm.total_cmp(&b.mean_mm));
        let frames = |hits: &LimitHits| (hits.degree_of_freedom.clone(), hits.lower_frames + hits.upper_frames);
        Self {
            mean_mm: report.mean_residual_mm,
            worst: worst.map(|landmark| (landmark.landmark.to_owned(), landmark.mean_mm)),
            limits_hit: report.limit_hits.iter().map(frames).collect(),
        }
    }

    /// A list of the angles that reach a limit.
    pub fn describe_limits(&self) -> String {
        let mut hits = self.limits_hit.clone();
        hits.sort_by_key(|(_, frames)| std::cmp::Reverse(*frames));
        let named: Vec<String> =
            hits.iter().take(6).map(|(name, frames)| format!("{name} in {frames} frames")).collect();
        match (named.as_slice(), hits.len()) {
            ([], _) => "none is reached".to_owned(),
            (named, count) if count > named.len() => format!("{}, and {} more", named.join(", "), count - named.len()),
            (named, _) => named.join(", "),
        }
    }
}

impl ClipSummary {
    /// The summary of a recording, and its motion on the robot `actor`, if it can be retargeted.
    pub(super) fn with_motion(clip: &Clip) -> Result<(Self, Result<Retargeted, RetargetError>), ExperimentError> {
        let still = clip.clone().without_inserted_rest_pose();
        let mut judgement = plausibility::judge(&still, 0..still.frames.len(), &BTreeMap::new(), None);
        let ground = judgement.as_ref().map_or(Ground::Feet, |judgement| judgement.ground);
        let options = RetargetOptions { ground, ..RetargetOptions::default() };
        let every = still.frames.len().div_ceil(MOST_FITTED).max(1);
        // the last one too, which may be a pose of another kind
        let last = still.frames.last().filter(|_| still.frames.len() % every != 1 % every);
        let fitted = Clip {
            frames: still.frames.iter().step_by(every).chain(last).cloned().collect(),
            frames_per_second: still.frames_per_second / every as f64,
            ..still
        };
        let retargeted = retarget(&fitted, &shipped("actor")?, &options);
        if let (Ok(judgement), Ok(retargeted)) = (&mut judgement, &retargeted) {
            judgement.findings.extend(plausibility::judge_fit(&retargeted.report, ground, true));
        }
        let mut summary = Self::new(clip, retargeted.as_ref());
        if every > 1 && retargeted.is_ok() {
            summary.notes.push(format!("fit, limits and picture are of one frame in {every}"));
        }
        summary.judgement = match &judgement {
            Ok(judgement) => describe_judgement(judgement),
            Err(_) => "no, because no body was found".to_owned(),
        };
        summary.notes.extend(judgement.iter().flat_map(|judgement| judgement.findings.iter().map(|f| f.text.clone())));
        Ok((summary, retargeted))
    }

    fn new(clip: &Clip, retargeted: Result<&Retargeted, &RetargetError>) -> Self {
        let joints = &clip.skeleton.joints;
        let mut heights: Vec<f64> = (0..clip.frames.len()).map(|frame| height(clip, frame)).collect();
        heights.sort_by(f64::total_cmp);
        // some skeletons have a root that stays where it is, above the joint that walks
        let places: Vec<Vec<_>> = clip.frames.iter().map(|frame| clip.skeleton.joint_frames(frame)).collect();
        let moves =
            |joint: &usize| places.windows(2).any(|pair| pair[0][*joint].translation != pair[1][*joint].translation);
        let moving = (0..joints.len()).find(moves).unwrap_or(0);
        let roots: Vec<_> =
            places.iter().filter_map(|frame| Some(frame.get(moving)?.translation.vector.xy())).collect();
        Self {
            schema: INSPECT_SCHEMA,
            what: "clip",
            name: clip.name.clone(),
            frames: clip.frames.len(),
            frames_per_second: clip.frames_per_second,
            duration_s: clip.duration(),
            cyclic: clip.cyclic,
            height_m: heights.get(heights.len() / 2).copied().unwrap_or(0.0),
            path_m: roots.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum(),
            joints: joints.iter().map(|j| (j.name.clone(), j.parent.map(|p| joints[p].name.clone()))).collect(),
            fit: retargeted.ok().map(|retargeted| FitSummary::new(&retargeted.report)),
            joint_map: retargeted.map(|retargeted| retargeted.joint_map.clone()).unwrap_or_default(),
            judgement: String::new(),
            notes: match retargeted {
                Ok(retargeted) => retargeted.report.notes.clone(),
                Err(reason) => [clip.notes.clone(), vec![format!("it cannot be retargeted: {reason}")]].concat(),
            },
        }
    }
}

fn describe_judgement(judgement: &Judgement) -> String {
    if judgement.refusal().is_some() {
        return "implausible: `check` and `render` refuse it, see the notes".to_owned();
    }
    match judgement.findings.len() {
        0 => format!("plausible by {JUDGED}"),
        1 => format!("plausible by {JUDGED}, with one note"),
        count => format!("plausible by {JUDGED}, with {count} notes"),
    }
}

/// Height of the bounding box of all joints and tips in a frame, metres.
fn height(clip: &Clip, frame: usize) -> f64 {
    let frames = clip.joint_frames(frame);
    let heights = clip.skeleton.joints.iter().zip(&frames).flat_map(|(joint, world_from_joint)| {
        let at = world_from_joint.translation.vector;
        let tip = joint.tip.map_or(at.z, |tip| (at + world_from_joint.rotation * tip).z);
        [at.z, tip]
    });
    let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
    (high - low).max(0.0)
}
