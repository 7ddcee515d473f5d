//! The truth: an actor, a motion, a rig and the ground give exact [`GroundTruth`] for every frame.

use nalgebra::Point3;

use crate::body::{Humanoid, LinkFrames, Markers, Pose};

/// What really happened: the actor's body and, for every frame, everything that is known about it exactly.
#[derive(Clone, Debug)]
pub struct GroundTruth {
    /// The actor's body.
    pub actor: Humanoid,
    /// Frames a second.
    pub frames_per_second: f64,
    /// One entry a frame.
    pub frames: Vec<TruthFrame>,
}

/// The truth of one instant.
#[derive(Clone, Debug)]
pub struct TruthFrame {
    /// Seconds from the first frame.
    pub time_s: f64,
    /// The actor's pose.
    pub pose: Pose,
    /// `world_from_link` of every link of the actor.
    pub link_frames: LinkFrames,
    /// Where each joint of the actor is in the world (origin of the link that it moves), metres.
    pub joint_positions: Vec<Point3<f64>>,
    /// HumanEva's markers on the actor.
    pub markers: Markers,
    /// `[camera][marker]`: whether the camera sees the marker inside its image and before the near plane.
    pub in_view: Vec<[bool; 15]>,
}
