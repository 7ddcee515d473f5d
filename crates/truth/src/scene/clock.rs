//! Poses of all figures at any time, also between frames.

use super::{Distractor, GroundTruth};
use skiagraph_core::body::{LinkFrames, Motion};
use skiagraph_core::camera::TimedRig;

/// A figure of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneFigure {
    /// The actor.
    Actor,
    /// A distractor, by its index.
    Distractor(usize),
}

/// Link frames of the actor and distractors at any time: exactly the truth's at frame times. Between frames,
/// translations and angles are interpolated linearly and rotations along the shorter arc; before the first frame and
/// after the last all figures stand still.
pub struct SceneClock<'a> {
    truth: &'a GroundTruth,
    /// The actor's motion, then every distractor's; empty if only frame times are needed.
    motions: Vec<Motion>,
}

impl<'a> SceneClock<'a> {
    /// A clock of `truth` for the exposure times of `filming`.
    pub fn new(truth: &'a GroundTruth, filming: &TimedRig) -> Self {
        if !filming.leaves_frames() {
            return Self { truth, motions: Vec::new() };
        }
        let of_other = |other: &Distractor| {
            Motion { frames_per_second: truth.frames_per_second, poses: other.poses.clone() }
                .made_continuous(&other.body)
        };
        let actor = truth.motion().made_continuous(&truth.actor);
        Self { truth, motions: std::iter::once(actor).chain(truth.distractors.iter().map(of_other)).collect() }
    }

    /// The underlying truth.
    pub fn truth(&self) -> &'a GroundTruth {
        self.truth
    }

    /// Link frames of a figure at `time_s`. `frame` is the frame of the image, and must exist in the truth.
    pub fn links(&self, figure: SceneFigure, frame: usize, time_s: f64) -> LinkFrames {
        let (body, index) = match figure {
            SceneFigure::Actor => (&self.truth.actor, 0),
            SceneFigure::Distractor(other) => (&self.truth.distractors[other].body, other + 1),
        };
        let known = &self.truth.frames[frame];
        let between = self.motions.get(index).filter(|_| time_s != known.time_s).and_then(|motion| {
            motion.at_frame(body, time_s * motion.frames_per_second).map(|pose| body.link_frames(&pose))
        });
        between.unwrap_or_else(|| match figure {
            SceneFigure::Actor => known.link_frames.clone(),
            SceneFigure::Distractor(other) => self.truth.distractors[other].link_frames(frame).unwrap_or_default(),
        })
    }
}
