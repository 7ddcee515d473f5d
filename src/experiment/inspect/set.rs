//! What a benchmark set holds, and whether it is whole.

use std::path::Path;

use serde::Serialize;

use super::super::ExperimentError;
use super::INSPECT_SCHEMA;
use crate::benchmark_set::{
    BenchmarkSet, BlindSet, ContactFacts, RetargetFacts, TruthSet, is_public, layer_channels, verify_hashes,
};

/// A set in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `set`.
    pub what: &'static str,
    /// Its name.
    pub name: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames a second.
    pub frames_per_second: f64,
    /// Its cameras.
    pub cameras: Vec<CameraSummary>,
    /// Channels of the truth images, where there are any.
    pub layers: Vec<String>,
    /// The actor's robot; absent where the truth is kept apart, as are the next facts of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actor: Option<String>,
    /// What stands about besides the actor.
    pub props: Vec<String>,
    /// The tracker's robot.
    pub tracker_body: String,
    /// Whether they are one body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matched: Option<bool>,
    /// How they differ, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mismatch: Option<String>,
    /// Where the motion came from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<String>,
    /// How the recording fits the actor; absent in sets of older versions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retargeting: Option<RetargetFacts>,
    /// How it came to stand on the ground; absent where contact was neither measured nor changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<Box<ContactFacts>>,
    /// How the observations were made, in words.
    pub observation: String,
    /// Frames of training motion on the blind side.
    pub training_frames: usize,
    /// What a tracker may learn from, in words.
    pub learned_from: Vec<String>,
    /// The way the body faces in frame 0, a unit vector on the ground.
    pub forward: Option<[f64; 3]>,
    /// SHA-256 of what is tested, without layers and shards, which names the set.
    pub set_hash: String,
    /// SHA-256 of `files.sha256`: of every file, layers and shards included.
    pub full_hash: String,
    /// Whether every file is there, unchanged, and none is there that is not listed.
    pub hashes_ok: bool,
    /// The first file that is not, and what is wrong with it.
    pub fault: Option<String>,
}

/// One camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraSummary {
    /// Its name.
    pub name: String,
    /// Width and height of its images.
    pub size_px: [u32; 2],
    /// Whether its lens distorts.
    pub distorts: bool,
    /// How it moves and takes its images, in words; absent for one that stands still and takes an image of every frame
    /// at its time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filming: Option<String>,
}

/// Both sides of a set, or the one that is there.
pub(super) struct SetSides {
    pub(super) blind: BlindSet,
    pub(super) truth: Option<TruthSet>,
}

impl SetSides {
    /// # Errors
    /// [`ExperimentError`] where the set cannot be read so far as to say what it is.
    pub(super) fn read(directory: &Path) -> Result<Self, ExperimentError> {
        if is_public(directory) {
            return Ok(Self { blind: BlindSet::read(directory)?, truth: None });
        }
        let BenchmarkSet { blind, truth } = BenchmarkSet::read(directory)?;
        Ok(Self { blind, truth: Some(truth) })
    }
}

impl SetSummary {
    /// Of a set in `directory`; checks every file's hash.
    ///
    /// # Errors
    /// [`ExperimentError`] where the first of its layers cannot be read.
    pub(super) fn new(directory: &Path, sides: &SetSides) -> Result<Self, ExperimentError> {
        let SetSides { blind, truth } = sides;
        let facts = truth.as_ref().map(|truth| &truth.facts);
        let scene = truth.as_ref().map(|truth| &truth.ground_truth);
        let fault = verify_hashes(directory).err().map(|error| error.to_string());
        let rate = blind.frames_per_second;
        let camera = |(index, camera): (usize, &crate::camera::Camera)| CameraSummary {
            name: camera.name.clone(),
            size_px: [camera.pinhole.width, camera.pinhole.height],
            distorts: camera.distortion.coefficients() != [0.0; 5],
            filming: blind.moments.as_ref().and_then(|moments| moments.describe(index, rate)),
        };
        Ok(Self {
            schema: INSPECT_SCHEMA,
            what: "set",
            name: blind.name.clone(),
            frames: blind.frame_count,
            frames_per_second: blind.frames_per_second,
            cameras: blind.rig.cameras.iter().enumerate().map(camera).collect(),
            layers: if truth.is_some() { layer_channels(directory)? } else { Vec::new() },
            actor: scene.map(|scene| scene.actor.name.clone()),
            props: scene.iter().flat_map(|scene| &scene.props).map(|prop| prop.name.clone()).collect(),
            tracker_body: blind.start.body.name.clone(),
            matched: facts.map(|facts| facts.matched),
            mismatch: facts.map(|facts| facts.mismatch.clone()),
            motion: facts.map(|facts| facts.motion.clone()),
            observation: blind.observation.as_ref().map_or("exact".to_owned(), |facts| facts.in_words()),
            retargeting: facts.and_then(|facts| facts.retargeting.clone()),
            contact: facts.and_then(|facts| facts.contact.clone()).map(Box::new),
            training_frames: blind.start.training.frames(),
            learned_from: blind.start.training.describe(),
            forward: blind.forward,
            set_hash: blind.set_hash.clone(),
            full_hash: blind.full_hash.clone(),
            hashes_ok: fault.is_none(),
            fault,
        })
    }
}
