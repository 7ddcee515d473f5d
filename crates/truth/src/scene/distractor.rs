//! Other people who pass through the scene.

use crate::body::{Humanoid, LinkFrames, Motion, Pose};

/// Somebody besides the actor: cameras see them and they hide the actor, but nothing of them is to be estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct Distractor {
    /// For people.
    pub name: String,
    /// Their body.
    pub body: Humanoid,
    /// Their poses, one a frame, each with an angle for every degree of freedom; after the last they stand still.
    pub poses: Vec<Pose>,
}

impl Distractor {
    /// Where their links are in a frame; `None` without any pose.
    pub fn link_frames(&self, frame: usize) -> Option<LinkFrames> {
        let pose = self.poses.get(frame).or(self.poses.last())?;
        Some(self.body.link_frames(pose))
    }

    /// Their motion over so many frames.
    #[cfg(test)]
    pub(crate) fn motion_of(&self, frames: usize) -> Motion {
        let pose = |frame: usize| self.poses.get(frame).or(self.poses.last()).unwrap().clone();
        Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() }
    }

    /// Their motion without jumps of its coordinates, to be seen between frames.
    pub(crate) fn continuous_motion(&self, frames_per_second: f64) -> Motion {
        Motion { frames_per_second, poses: self.poses.clone() }.made_continuous(&self.body)
    }
}
