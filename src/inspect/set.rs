//! The summary of a benchmark set, and whether it is complete and unchanged.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::INSPECT_SCHEMA;
use crate::common::ExperimentError;
use skiagraph_core::body::{LANDMARKS, LinkPoint};
use skiagraph_set::{
    BenchmarkSet, BlindSet, ContactFacts, RetargetFacts, TruthSet, is_footage, is_public, layer_channels, verify_hashes,
};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `set`.
    pub what: &'static str,
    pub name: String,
    pub frames: usize,
    pub frames_per_second: f64,
    pub cameras: Vec<CameraSummary>,
    /// Channels of the truth images, if there are any.
    pub layers: Vec<String>,
    /// The actor's robot; absent if the set has no truth, like the other facts of the truth below.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actor: Option<String>,
    pub props: Vec<String>,
    pub tracker_body: String,
    /// Whether actor and tracker have the same body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matched: Option<bool>,
    /// A description of the bodies' differences.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mismatch: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<String>,
    /// The fit of the recording to the actor; absent in sets of older versions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retargeting: Option<RetargetFacts>,
    /// Ground-contact processing; absent if contact was neither measured nor changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<Box<ContactFacts>>,
    pub observation: String,
    /// Whether they are of a recording of a person.
    #[serde(skip)]
    pub is_footage: bool,
    /// Frames of training motion on the blind side.
    pub training_frames: usize,
    /// Descriptions of the training recordings.
    pub learned_from: Vec<String>,
    /// Heading of the body in frame 0, a unit vector on the ground.
    pub forward: Option<[f64; 3]>,
    /// SHA-256 of the tested content, without truth images, which identifies the set.
    pub set_hash: String,
    /// SHA-256 of `files.sha256`, which covers every file, also truth images.
    pub full_hash: String,
    /// Whether every listed file exists unchanged, and no other file exists.
    pub hashes_ok: bool,
    /// The first violation.
    pub fault: Option<String>,
    pub points: SetPoints,
}

/// Points of the tracker's body in frame 0, which trackers are told, and places of joints on the actor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetPoints {
    /// Markers of the tracker's body at the start pose in the order of arrays, metres; null for one that it lacks.
    pub start_markers: Vec<NamedPoint>,
    /// Its joints, likewise.
    pub start_joints: Vec<NamedPoint>,
    /// The joints of data sets on the actor, each fixed to a link; absent without truth.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub layouts: BTreeMap<&'static str, Vec<JointPlace>>,
}

/// A point by name, metres.
type NamedPoint = (String, Option<[f64; 3]>);

/// The name of a joint, and its link with the place in the axes of that link, metres; null where the body has none.
type JointPlace = (&'static str, Option<(usize, [f64; 3])>);

/// Data sets whose joints are placed on the actor.
const LAYOUTS: [&str; 5] = ["body25", "coco17", "h36m17", "halpe26", "smpl24"];

impl SetPoints {
    fn new(sides: &SetSides) -> Self {
        let (body, pose) = (&sides.blind.start.body, &sides.blind.start.pose);
        let frames = body.link_frames(pose);
        let markers = LANDMARKS.iter().zip(body.markers(&frames));
        let joints = body.joints.iter().zip(frames.0.iter().skip(1));
        let actor = sides.truth.as_ref().map(|truth| &truth.ground_truth.actor);
        let placed = |point: LinkPoint| (point.link, point.point_in_link.coords.into());
        let named = |layout: &'static str| {
            let places = actor?.joints_as(layout)?;
            Some((layout, places.into_iter().map(|(name, place)| (name, place.map(placed))).collect()))
        };
        Self {
            start_markers: markers.map(|(known, at)| (known.name().into(), at.map(|p| p.coords.into()))).collect(),
            start_joints: joints.map(|(joint, at)| (joint.name.clone(), Some(at.translation.vector.into()))).collect(),
            layouts: LAYOUTS.into_iter().filter_map(named).collect(),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraSummary {
    pub name: String,
    /// Width and height of its images.
    pub size_px: [u32; 2],
    pub distorts: bool,
    /// A description of its motion and timing; absent for a static camera with an image at every frame's time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filming: Option<String>,
}

pub(super) struct SetSides {
    pub(super) blind: BlindSet,
    pub(super) truth: Option<TruthSet>,
}

impl SetSides {
    pub(super) fn read(directory: &Path) -> Result<Self, ExperimentError> {
        if is_public(directory) || is_footage(directory) {
            return Ok(Self { blind: BlindSet::read(directory)?, truth: None });
        }
        let BenchmarkSet { blind, truth } = BenchmarkSet::read(directory)?;
        Ok(Self { blind, truth: Some(truth) })
    }
}

impl SetSummary {
    /// The summary of a set in `directory`; checks every file's hash.
    pub(super) fn new(directory: &Path, sides: &SetSides) -> Result<Self, ExperimentError> {
        let SetSides { blind, truth } = sides;
        let facts = truth.as_ref().map(|truth| &truth.facts);
        let scene = truth.as_ref().map(|truth| &truth.ground_truth);
        let fault = verify_hashes(directory).err().map(|error| error.to_string());
        let rate = blind.frames_per_second;
        let camera = |(index, camera): (usize, &skiagraph_core::camera::Camera)| CameraSummary {
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
            observation: blind.observation.as_ref().map_or("exact".to_owned(), |facts| facts.describe()),
            is_footage: blind.observation.as_ref().is_some_and(|facts| facts.is_footage()),
            retargeting: facts.and_then(|facts| facts.retargeting.clone()),
            contact: facts.and_then(|facts| facts.contact.clone()).map(Box::new),
            training_frames: blind.start.training.frames(),
            learned_from: blind.describe_training(),
            forward: blind.forward,
            set_hash: blind.set_hash.clone(),
            full_hash: blind.full_hash.clone(),
            hashes_ok: fault.is_none(),
            fault,
            points: SetPoints::new(sides),
        })
    }
}
