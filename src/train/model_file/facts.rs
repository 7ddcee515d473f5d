//! The facts of a model: its robot, training motions and settings.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{MODEL_SCHEMA, malformed};
use crate::common::ExperimentError;
use skiagraph_core::body::{Humanoid, JointKind};
use skiagraph_core::input::hex_sha256;
use skiagraph_track::motion_model::gpdm_graph::GraphSettings;

/// The facts of a model: its robot, training motions and settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelFacts {
    /// `skiagraph.model/1`.
    pub schema: String,
    /// The program that learned it, and its version.
    pub program: String,
    /// Whether all of the motion is learned; false for the state of an interrupted training.
    pub whole: bool,
    pub robot: RobotFacts,
    pub frames_per_second: f64,
    /// The training motions, in the order of the segments' indices.
    pub learned_from: Vec<LearnedFrom>,
    pub settings: GraphSettings,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotFacts {
    pub name: String,
    /// SHA-256 of its joints (tree, axes, limits), which does not depend on the size of its links.
    pub joints_sha256: String,
}

/// One training motion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LearnedFrom {
    /// The recording's name.
    pub clip: String,
    /// SHA-256 of its file, if it is a single file.
    pub sha256: Option<String>,
    /// First frame used, numbered as in the file, from 1; `None` for the recording's first.
    pub first_frame: Option<usize>,
    /// Last frame used; `None` for the recording's last.
    pub last_frame: Option<usize>,
    /// Frames at the model's rate.
    pub frames: usize,
    /// SHA-256 of the poses that the model learned.
    pub poses_sha256: String,
}

impl RobotFacts {
    pub fn from_body(body: &Humanoid) -> Self {
        let mut text = String::new();
        let numbers = |values: &[f64]| values.iter().map(|x| format!(" {:.9}", x + 0.0)).collect::<String>();
        for joint in &body.joints {
            let q = joint.parent_from_joint.rotation;
            let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
            let turned = numbers(&[sign * q.w, sign * q.i, sign * q.j, sign * q.k]);
            let kind = match &joint.kind {
                JointKind::Fixed => "fixed".to_owned(),
                JointKind::Revolute { axis, drive } => format!("revolute{} {drive:?}", numbers(axis.as_slice())),
                JointKind::Prismatic { axis, drive } => format!("prismatic{} {drive:?}", numbers(axis.as_slice())),
                JointKind::Spherical { first } => format!("spherical {first}"),
                JointKind::Floating { first } => format!("floating {first}"),
            };
            text.push_str(&format!("{} {}{turned} {kind}\n", joint.name, joint.parent));
        }
        for dof in &body.degrees_of_freedom {
            text.push_str(&format!("{}{}\n", dof.name, numbers(&[dof.lower, dof.upper])));
        }
        Self { name: body.name.clone(), joints_sha256: hex_sha256(text.as_bytes()) }
    }
}

impl ModelFacts {
    /// The facts of a complete model of this program.
    pub fn new(
        body: &Humanoid,
        frames_per_second: f64,
        learned_from: Vec<LearnedFrom>,
        settings: GraphSettings,
    ) -> Self {
        Self {
            schema: MODEL_SCHEMA.to_owned(),
            program: concat!("skiagraph ", env!("CARGO_PKG_VERSION")).to_owned(),
            whole: true,
            robot: RobotFacts::from_body(body),
            frames_per_second,
            learned_from,
            settings,
        }
    }

    /// `gpdm` or `gpdm-graph`.
    pub fn kind(&self) -> &'static str {
        self.settings.kind().name()
    }

    /// Checks that the model was learned for this robot, of any size, and this rate. `path` is its file.
    pub fn check_fits(&self, path: &Path, body: &Humanoid, frames_per_second: f64) -> Result<(), ExperimentError> {
        let (known, found) = (&self.robot, RobotFacts::from_body(body));
        if known.joints_sha256 != found.joints_sha256 {
            let detail = format!(
                "learned for the robot `{}`, whose joints differ from those of `{}`; train a model with that robot",
                known.name, found.name
            );
            return Err(malformed(path, detail));
        }
        let own = self.frames_per_second;
        if own != frames_per_second {
            let detail = format!(
                "learned at {own} frames a second, needed at {frames_per_second}; train a model at that rate (--fps)"
            );
            return Err(malformed(path, detail));
        }
        Ok(())
    }
}
