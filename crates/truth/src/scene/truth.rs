//! Ground truth: the exact state of the scene.

use nalgebra::Point3;

use skiagraph_core::body::{Humanoid, LANDMARKS, LinkFrames, Markers, Motion, Pose, Prop};
use skiagraph_core::contact::{ContactError, link_frames};
use skiagraph_core::input::excerpt;

/// The ground truth: the actor's body and its exact state in every frame.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTruth {
    /// The actor's body.
    pub actor: Humanoid,
    /// The props; they are part of the background and hide what is behind them.
    pub props: Vec<Prop>,
    /// Other people: they hide the actor and appear in silhouettes, but are not estimated.
    pub distractors: Vec<Distractor>,
    /// Frames per second.
    pub frames_per_second: f64,
    /// One entry per frame.
    pub frames: Vec<TruthFrame>,
}

/// A person other than the actor: visible to cameras and hiding the actor, but not estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Distractor {
    /// Display name.
    pub name: String,
    /// The body.
    pub body: Humanoid,
    /// One pose per frame, with an angle for every degree of freedom; the last pose is held.
    pub poses: Vec<Pose>,
}

/// The truth of one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthFrame {
    /// Seconds from the first frame.
    pub time_s: f64,
    /// The actor's pose.
    pub pose: Pose,
    /// `world_from_link` of every link of the actor.
    pub link_frames: LinkFrames,
    /// World position of each joint of the actor (the origin of its child link), metres.
    pub joint_positions: Vec<Point3<f64>>,
    /// HumanEva's markers on the actor.
    pub markers: Markers,
    /// `[camera][marker]`: whether the marker is inside the camera's image and beyond the near plane.
    pub in_view: Vec<[bool; LANDMARKS.len()]>,
    /// `[camera][marker]`: whether the marker is in view and not hidden by the body's surface (its skin if it has one),
    /// a prop or a distractor. Markers lie inside the body, so geometry of a marker's own link and solids that contain
    /// the marker do not hide it; all other geometry that the line to the camera enters does ([`super::Occluders`]).
    pub visible: Vec<[bool; LANDMARKS.len()]>,
}

/// Errors of scenes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The motion is empty, belongs to another body or is not finite.
    #[error(transparent)]
    Motion(#[from] ContactError),
    /// A distractor without poses or with poses of another body, or a subject that no camera sees.
    #[error("{0}")]
    Figure(String),
}

impl GroundTruth {
    /// The truth without cameras: `in_view` and `visible` are empty.
    pub(super) fn without_cameras(
        actor: Humanoid,
        motion: &Motion,
        props: Vec<Prop>,
        distractors: Vec<Distractor>,
    ) -> Result<Self, SceneError> {
        for Distractor { name, body, poses } in &distractors {
            let degrees = body.degrees_of_freedom.len();
            if poses.is_empty() || poses.iter().any(|pose| pose.joint_angles.len() != degrees) {
                return Err(SceneError::Figure(format!(
                    "distractor {:?}: expected at least one pose, each with {degrees} joint angles",
                    excerpt(name)
                )));
            }
        }
        let links = link_frames(&actor, motion)?;
        let frames_per_second = motion.frames_per_second;
        let seconds = (0..links.len()).map(|frame| frame as f64 / frames_per_second);
        let of_frame = |((time_s, link_frames), pose): ((f64, LinkFrames), &Pose)| TruthFrame {
            time_s,
            pose: pose.clone(),
            joint_positions: link_frames.0.iter().skip(1).map(|f| f.translation.vector.into()).collect(),
            markers: actor.markers(&link_frames),
            link_frames,
            in_view: Vec::new(),
            visible: Vec::new(),
        };
        let frames = seconds.zip(links).zip(&motion.poses).map(of_frame).collect();
        Ok(Self { actor, props, distractors, frames_per_second, frames })
    }

    /// The actor's poses.
    pub fn motion(&self) -> Motion {
        let poses = self.frames.iter().map(|frame| frame.pose.clone()).collect();
        Motion { frames_per_second: self.frames_per_second, poses }
    }
}

impl Distractor {
    /// Link frames in a frame; `None` without any pose.
    pub fn link_frames(&self, frame: usize) -> Option<LinkFrames> {
        let pose = self.poses.get(frame).or(self.poses.last())?;
        Some(self.body.link_frames(pose))
    }
}

impl TruthFrame {
    pub(super) fn points(&self) -> impl Iterator<Item = &Point3<f64>> {
        self.joint_positions.iter().chain(self.markers.iter().flatten())
    }
}
