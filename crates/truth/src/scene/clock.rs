//! Where everybody is at any time, between frames too.

use super::{Distractor, GroundTruth};
use crate::body::{LinkFrames, Motion};
use crate::camera::TimedRig;

/// Who is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneFigure {
    /// The actor.
    Actor,
    /// A distractor, by its index.
    Distractor(usize),
}

/// The links of the actor and of distractors at any time. At a frame's own time they are where the truth has them;
/// between frames translations and angles go linearly and rotations along the shorter arc; before the first frame and
/// after the last everybody stands still.
pub struct SceneClock<'a> {
    truth: &'a GroundTruth,
    /// The actor's motion and then every distractor's; empty where only frames are asked for.
    motions: Vec<Motion>,
}

impl<'a> SceneClock<'a> {
    /// Of a truth that `filming` sees.
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

    /// Whose time it is.
    pub fn truth(&self) -> &'a GroundTruth {
        self.truth
    }

    /// Where the links of a figure are at `time_s`, seen from a frame that the truth must have.
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
