//! What a recording holds.

use serde::Serialize;

use super::INSPECT_SCHEMA;
use crate::mocap::Clip;

/// A recording in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClipSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `clip`.
    pub what: &'static str,
    /// Its name.
    pub name: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames a second.
    pub frames_per_second: f64,
    /// From the first frame to the last.
    pub duration_s: f64,
    /// Whether it is one cycle of a motion meant to repeat.
    pub cyclic: bool,
    /// Median over the frames of how high the box around all joints is.
    pub height_m: f64,
    /// How far the root travels along the ground, summed over the frames.
    pub path_m: f64,
    /// Joints of the skeleton with their parents, root first.
    pub joints: Vec<(String, Option<String>)>,
    /// What was guessed (unit, up axis, rate) or mended.
    pub notes: Vec<String>,
}

impl ClipSummary {
    pub(super) fn new(clip: &Clip) -> Self {
        let joints = &clip.skeleton.joints;
        let mut heights: Vec<f64> = (0..clip.frames.len()).map(|frame| height(clip, frame)).collect();
        heights.sort_by(f64::total_cmp);
        let root = |frame: &Vec<nalgebra::Isometry3<f64>>| frame.first().map(|f| f.translation.vector.xy());
        let roots: Vec<_> = clip.frames.iter().filter_map(root).collect();
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
            notes: clip.notes.clone(),
        }
    }
}

/// How high the box around all joints and tips is in a frame, metres.
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
