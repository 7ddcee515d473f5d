//! The robots of a scenario, with the solids of their settings, and a check that enough of each is drawn.

use std::path::Path;

use super::robot_doubts::doubts;
use crate::common::{ExperimentError, key_error};
use crate::scenario::{
    ActorSettings, DistractorSettings, SolidsSource, TrackerBodySettings, did_you_mean, similar_file,
};
use skiagraph_core::body::{
    DrawnShares, Humanoid, LEAST_DRAWN_HEIGHT, LEAST_DRAWN_LINKS, LEAST_DRAWN_REACH, SHIPPED_ROBOTS, UrdfError, shipped,
};
use skiagraph_core::input::excerpt;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RobotChoice<'a> {
    /// The table: `actor`, `tracker_body`, `distractor[0]`.
    pub(crate) table: &'a str,
    /// The name of a built-in robot, or a path.
    pub(crate) robot: &'a str,
    pub(crate) solids: SolidsSource,
    /// Whether cameras see a skin instead of solids.
    pub(crate) has_skin: bool,
}

impl<'a> RobotChoice<'a> {
    pub(crate) fn of_actor(settings: &'a ActorSettings) -> Self {
        let ActorSettings { robot, solids, skin, .. } = settings;
        Self { table: "actor", robot, solids: *solids, has_skin: skin.is_some() }
    }

    pub(crate) fn of_tracker(settings: &'a TrackerBodySettings) -> Self {
        let TrackerBodySettings { robot, solids, skin, .. } = settings;
        Self { table: "tracker_body", robot, solids: *solids, has_skin: skin.is_some() }
    }

    pub(crate) fn of_distractor(table: &'a str, settings: &'a DistractorSettings) -> Self {
        let DistractorSettings { robot, solids, skin, .. } = settings;
        Self { table, robot, solids: *solids, has_skin: skin.is_some() }
    }

    pub(crate) fn key(&self) -> String {
        format!("{}.robot", self.table)
    }

    pub(crate) fn is_same_robot(&self, other: &Self) -> bool {
        (self.robot, self.solids) == (other.robot, other.solids)
    }
}

/// The robot of a table; files are relative to `folder`.
///
/// # Errors
/// [`ExperimentError`] that names the key or the file; also if too little of the robot is drawn.
pub(crate) fn robot(folder: &Path, choice: &RobotChoice<'_>) -> Result<Humanoid, ExperimentError> {
    let refuse = |message: String| key_error(choice.key(), message);
    let path = Path::new(choice.robot);
    let mut body = robot_named(folder, path, choice.solids).map_err(|error| error.into_error(refuse))?;
    if choice.has_skin {
        return Ok(body);
    }
    let shares = DrawnShares::new(&body);
    if shares.is_too_little() {
        return Err(refuse(too_little(choice, &shares, &body)));
    }
    if let Some(missing) = shares.describe_missing() {
        body.notes.push(format!("drawn: {}; without solids: {missing}", shares.describe()));
    }
    Ok(body)
}

fn too_little(choice: &RobotChoice<'_>, shares: &DrawnShares, body: &Humanoid) -> String {
    let missing = shares.describe_missing().map_or(String::new(), |missing| format!("; without solids: {missing}"));
    // meshes that cannot be read, for example
    let notes: String = body.notes.iter().map(|note| format!("; {note}")).collect();
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let [links, height, reach] = [LEAST_DRAWN_LINKS, LEAST_DRAWN_HEIGHT, LEAST_DRAWN_REACH].map(percent);
    let remedy = match choice.solids {
        SolidsSource::Urdf => format!(
            "[{}] solids = \"from_joints\" draws capsules from joint to joint and keeps masses and inertias; or give its \
             links <collision> or <visual> elements, or a skin",
            choice.table
        ),
        SolidsSource::FromJoints => "place its landmarks with fixed, empty links marker_NAME, or use a skin".to_owned(),
    };
    let name = excerpt(&body.name);
    let lead = if body.links.iter().all(|link| link.solids.is_empty()) {
        format!("expected a body that cameras can see, found no link with geometry in `{name}`")
    } else {
        format!("too little of `{name}` is drawn for cameras to see a body")
    };
    format!(
        "{lead}: {}{missing}{notes} (expected at least {links} of the links that have mass or carry others, {height} of \
         the height from ankles to crown and {reach} of the reach from wrist to wrist); {remedy}",
        shares.describe()
    )
}

pub(crate) enum RobotLoadError {
    /// No built-in robot and no file has this name; a message.
    Unknown(String),
    Unusable(UrdfError),
}

impl RobotLoadError {
    /// As an error; `refuse` makes the one for an unknown name.
    pub(crate) fn into_error(self, refuse: impl FnOnce(String) -> ExperimentError) -> ExperimentError {
        match self {
            Self::Unknown(message) => refuse(message),
            Self::Unusable(error) => error.into(),
        }
    }
}

/// A built-in robot, or one from a file relative to `folder`.
pub(crate) fn robot_named(folder: &Path, name: &Path, solids: SolidsSource) -> Result<Humanoid, RobotLoadError> {
    if let Some((known, _)) = SHIPPED_ROBOTS.iter().find(|(known, _)| name == Path::new(known)) {
        let body = shipped(known).map_err(RobotLoadError::Unusable)?;
        return Ok(if solids == SolidsSource::FromJoints { body.with_solids_from_joints() } else { body });
    }
    let path = folder.join(name);
    if !path.exists() {
        let known = SHIPPED_ROBOTS.map(|(known, _)| known);
        let guess = did_you_mean(&name.to_string_lossy(), known).map(str::to_owned).or_else(|| similar_file(&path));
        let guess = guess.map(|guess| format!("; did you mean `{}`?", excerpt(&guess))).unwrap_or_default();
        let message = format!(
            "`{}` is neither a built-in robot ({}) nor the file {}{guess}",
            excerpt(&name.display().to_string()),
            known.join(", "),
            excerpt(&path.display().to_string())
        );
        return Err(RobotLoadError::Unknown(message));
    }
    let mut body = match solids {
        SolidsSource::Urdf => Humanoid::load(&path),
        SolidsSource::FromJoints => Humanoid::load_skeleton(&path),
    }
    .map_err(RobotLoadError::Unusable)?;
    body.notes.extend(doubts(&body));
    Ok(body)
}
