//! The truth: an actor, a motion and a rig give exact [`GroundTruth`] for every frame.

#[cfg(test)]
pub(crate) mod fixture;
mod sight;
mod truth;
mod visibility;

pub use sight::Sight;
pub use truth::{GroundTruth, SceneError, TruthFrame};
