//! The truth: exact [`GroundTruth`] for every frame, from an actor, a motion and a rig.

mod clock;
mod seen;
mod shot;
mod sight;
mod truth;

pub use truth::{GroundTruth, SceneError, TruthFrame};

// Times between frames and sight lines, for the other crates and tests.
#[doc(hidden)]
pub use self::{
    clock::{SceneClock, SceneFigure},
    shot::{Shot, ShotPoint},
    sight::{Occluders, Sight, SightLines},
    truth::Distractor,
};
