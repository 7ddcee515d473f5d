//! The scene of a scenario: recordings retargeted to the actor, both bodies, props, distractors and cameras.
//!
//! [`PreparedScene`] has all of it, before anything is rendered.

mod camera_files;
pub(crate) mod clip_file;
mod contact_facts;
mod distractors;
mod mismatch_seed;
mod people;
mod placement;
mod retargeted_motion;
pub(crate) mod retargeting;
pub(crate) mod rig;
pub(crate) mod rig_doubts;
pub(crate) mod robot_doubts;
pub(crate) mod robots;
pub(crate) mod scenario_copy;
pub(crate) mod scene_check;
pub(crate) mod scene_hash;
mod scene_preparation;
pub(crate) mod skins;
mod training;

pub use clip_file::EMBEDDED_CLIPS;
pub use scene_check::{ActorPath, CameraView};
pub use scene_preparation::PreparedScene;
