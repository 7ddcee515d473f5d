//! The summary of a robot.

use std::path::Path;

use serde::Serialize;

use super::INSPECT_SCHEMA;
use crate::prepare::robot_doubts::doubts;
use crate::scenario::SolidsSource;
use skiagraph_core::body::{DegreeOfFreedom, DrawnShares, Humanoid, JointKind, LANDMARKS, UrdfError, shipped};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `robot`.
    pub what: &'static str,
    pub name: String,
    /// Its file or built-in name.
    pub from: String,
    /// Number of links with solids, and of all links.
    pub links: [usize; 2],
    /// Shares of the body that its solids draw.
    pub drawn: DrawnShares,
    /// Number of movable joints, and of all joints.
    pub joints: [usize; 2],
    /// The joint coordinates of a pose.
    pub degrees_of_freedom: Vec<DegreeOfFreedom>,
    pub mass_kg: f64,
    /// Height of the bounding box of all links' origins in the standing pose, without solids.
    pub height_m: f64,
    pub missing_markers: Vec<&'static str>,
    /// Notes, such as assumed limits and locked joints.
    pub notes: Vec<String>,
}

pub(super) fn read(name: &str, path: &Path, solids: SolidsSource) -> Result<Humanoid, UrdfError> {
    let is_file = path.exists() || name.contains(['/', '.']);
    match (is_file, solids) {
        (true, SolidsSource::Urdf) => Humanoid::load(path),
        (true, SolidsSource::FromJoints) => Humanoid::load_skeleton(path),
        (false, SolidsSource::Urdf) => shipped(name),
        (false, SolidsSource::FromJoints) => shipped(name).map(|body| body.with_solids_from_joints()),
    }
}

impl RobotSummary {
    pub(super) fn new(from: &str, body: &Humanoid) -> Self {
        let heights = || body.link_frames(&body.standing_pose()).0.into_iter().map(|f| f.translation.vector.z);
        let markers = LANDMARKS.iter().zip(&body.markers).filter(|(_, place)| place.is_none());
        Self {
            schema: INSPECT_SCHEMA,
            what: "robot",
            name: body.name.clone(),
            from: from.to_owned(),
            links: [body.links.iter().filter(|link| !link.solids.is_empty()).count(), body.links.len()],
            drawn: DrawnShares::new(body),
            joints: [body.joints.iter().filter(|j| j.kind != JointKind::Fixed).count(), body.joints.len()],
            degrees_of_freedom: body.degrees_of_freedom.clone(),
            mass_kg: body.total_mass(),
            height_m: heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min),
            missing_markers: markers.map(|(landmark, _)| landmark.name()).collect(),
            notes: body.notes.iter().cloned().chain(doubts(body)).chain(too_little(body)).collect(),
        }
    }
}

/// A note if scenarios would refuse the body because too little of it is drawn.
fn too_little(body: &Humanoid) -> Option<String> {
    DrawnShares::new(body).is_too_little().then(|| {
        "too little is drawn for cameras to see a body: scenarios refuse it without a skin or solids = \"from_joints\" \
         (inspect: --solids from_joints)"
            .to_owned()
    })
}
