//! What a robot is.

use std::path::Path;

use serde::Serialize;

use super::INSPECT_SCHEMA;
use crate::body::{DegreeOfFreedom, DrawnShares, Humanoid, JointKind, LANDMARKS, UrdfError, shipped};
use crate::input::AllowedFolders;
use crate::scenario::SolidsSource;

/// A robot in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotSummary {
    /// `skiagraph.inspect/1`.
    pub schema: &'static str,
    /// `robot`.
    pub what: &'static str,
    /// The robot's name as its URDF says.
    pub name: String,
    /// Where it was read from.
    pub from: String,
    /// Links with solids over all links.
    pub links: [usize; 2],
    /// How much of it its solids draw.
    pub drawn: DrawnShares,
    /// Joints that move over all joints.
    pub joints: [usize; 2],
    /// The numbers that a pose holds beside the root.
    pub degrees_of_freedom: Vec<DegreeOfFreedom>,
    /// Mass of all links.
    pub mass_kg: f64,
    /// Height of the box around all links' origins in the zero pose, stood upright; solids are not counted.
    pub height_m: f64,
    /// Body markers that it has no place for.
    pub missing_markers: Vec<&'static str>,
    /// What a user should know: limits that were assumed, joints that are locked.
    pub notes: Vec<String>,
}

/// A robot that ships, or one from a file.
pub(super) fn read(
    name: &str,
    path: &Path,
    solids: SolidsSource,
    allowed: &AllowedFolders,
) -> Result<Humanoid, UrdfError> {
    match (path.exists(), solids) {
        (true, SolidsSource::Urdf) => Humanoid::load_allowing(path, allowed),
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
            notes: body.notes.iter().cloned().chain(too_little(body)).collect(),
        }
    }
}

/// What a scenario would say of a body that hardly is drawn.
fn too_little(body: &Humanoid) -> Option<String> {
    DrawnShares::new(body).is_too_little().then(|| {
        "too little is drawn for cameras to see a body: scenarios refuse it without a skin or solids = \"from_joints\" \
         (inspect: --solids from_joints)"
            .to_owned()
    })
}
