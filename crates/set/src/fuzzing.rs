//! Readers of single files of a set, for `fuzz/`: inside a set, checksums would reject every random change.

use super::format::manifest::BlindManifest;
use super::format::{cameras_file, manifest, props_file};
use super::{SetError, StepSpread, TrainingMotions};
use skiagraph_core::body::{Humanoid, Prop};
use skiagraph_core::camera::CameraRig;

/// Reads a `set.toml`, and the same bytes as a `truth/facts.toml`.
pub fn manifest(bytes: &[u8]) -> Result<(), SetError> {
    BlindManifest::from_toml(bytes)?;
    manifest::facts_from_toml(manifest::FACTS_PATH, bytes).map(drop)
}

/// Reads a `cameras.json`.
pub fn cameras(bytes: &[u8]) -> Result<CameraRig, SetError> {
    cameras_file::from_json(cameras_file::PATH, bytes)
}

/// Reads a `truth/props.json`.
pub fn props(bytes: &[u8]) -> Result<Vec<Prop>, SetError> {
    props_file::from_json(bytes)
}

/// Reads a `start/training.npz` for a body of `degrees` degrees of freedom.
pub fn training(bytes: &[u8], degrees: usize) -> Result<TrainingMotions, SetError> {
    TrainingMotions::from_npz(bytes, degrees)
}

/// Reads a `start/spread.npz` for this body.
pub fn spread(bytes: &[u8], body: &Humanoid) -> Result<StepSpread, SetError> {
    StepSpread::from_npz(bytes, body)
}
