//! `start/`: what a tracker is told before the first frame. `body.json` is its body, `start.json` where that begins, and
//! `training.npz` how it has been seen to move.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::rigid::RigidRecord;
use super::{SetError, Training, body_file};
use crate::body::{Humanoid, Pose};

pub(super) const PATH: &str = "start/start.json";
pub(super) const BODY_PATH: &str = "start/body.json";
const SCHEMA: &str = "skiagraph.start/1";

/// What a tracker is told before the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The tracker's own body.
    pub body: Humanoid,
    /// Its pose at frame 0.
    pub pose: Pose,
    /// How the body has been seen to move, at the rate of the observations: what proposals and motion models learn from.
    pub training: Training,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StartRecord {
    schema: String,
    frame: usize,
    /// `world_from_root`.
    root: RigidRecord,
    angle_names: Vec<String>,
    angles: Vec<f64>,
}

impl Start {
    pub(super) fn to_json(&self) -> Result<Vec<u8>, SetError> {
        let record = StartRecord {
            schema: SCHEMA.to_string(),
            frame: 0,
            root: RigidRecord::new(&self.pose.world_from_root),
            angle_names: self.body.degrees_of_freedom.iter().map(|d| d.name.clone()).collect(),
            angles: self.pose.joint_angles.iter().copied().collect(),
        };
        super::json::to_bytes(PATH, &record)
    }

    pub(super) fn training_to_npz(&self) -> Result<Vec<u8>, SetError> {
        self.training.to_npz(&self.body)
    }

    pub(super) fn from_files(start: &[u8], body: &[u8], training: &[u8]) -> Result<Self, SetError> {
        let body = body_file::from_json(BODY_PATH, body)?;
        let record: StartRecord = super::json::from_bytes(PATH, SCHEMA, start)?;
        let degrees = body.degrees_of_freedom.len();
        let names = body.degrees_of_freedom.iter().map(|d| &d.name);
        if record.angles.len() != degrees || !record.angle_names.iter().eq(names) {
            let detail =
                format!("angles and angle_names must be those of the {degrees} degrees of freedom of {BODY_PATH}");
            return Err(SetError::malformed(PATH, detail));
        }
        let world_from_root = record.root.transform().map_err(|e| SetError::malformed(PATH, e))?;
        let pose = Pose { world_from_root, joint_angles: DVector::from_vec(record.angles) };
        Ok(Self { body, pose, training: Training::from_npz(training, degrees)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};

    #[test]
    fn a_start_is_read_back_to_the_bit_and_must_fit_its_body() {
        let training = Training::new(vec![walk(9)]);
        let start = Start { body: person(), pose: walk(9).poses[8].clone(), training };
        let body = body_file::to_json(BODY_PATH, &start.body).unwrap();
        let read = |start: &Start| {
            Start::from_files(&start.to_json().unwrap(), &body, &start.training_to_npz().unwrap())
                .map_err(|e| e.to_string())
        };
        assert_eq!(read(&start).unwrap(), start);
        let mut renamed = start;
        renamed.body.degrees_of_freedom[0].name = "other".to_string();
        assert!(read(&renamed).unwrap_err().contains("angle_names"));
    }
}
