//! The truth: an actor, a motion and a rig give exact [`GroundTruth`] for every frame.

#[cfg(test)]
pub(crate) mod fixture;
mod truth;
mod visibility;

pub use truth::{GroundTruth, SceneError, TruthFrame};
