//! `start/`: what a tracker is told before the first frame. `body.json` is its body, `start.json` the rest.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::rigid::RigidRecord;
use super::{SetError, body_file};
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
    /// How far training motion moves from one frame to the next: standard deviations in the order of
    /// [`crate::body::Motion::inter_frame_std`] (3 root translations in m, 3 root rotations in rad, one per degree of freedom).
    pub inter_frame_std: Vec<f64>,
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
    inter_frame_std: Vec<f64>,
}

impl Start {
    pub(super) fn to_json(&self) -> Result<Vec<u8>, SetError> {
        let record = StartRecord {
            schema: SCHEMA.to_string(),
            frame: 0,
            root: RigidRecord::new(&self.pose.world_from_root),
            angle_names: self.body.degrees_of_freedom.iter().map(|d| d.name.clone()).collect(),
            angles: self.pose.joint_angles.iter().copied().collect(),
            inter_frame_std: self.inter_frame_std.clone(),
        };
        super::json::to_bytes(PATH, &record)
    }

    pub(super) fn from_json(start: &[u8], body: &[u8]) -> Result<Self, SetError> {
        let body = body_file::from_json(BODY_PATH, body)?;
        let record: StartRecord = super::json::from_bytes(PATH, SCHEMA, start)?;
        let degrees = body.degrees_of_freedom.len();
        let names = body.degrees_of_freedom.iter().map(|d| &d.name);
        if record.angles.len() != degrees || !record.angle_names.iter().eq(names) {
            let detail =
                format!("angles and angle_names must be those of the {degrees} degrees of freedom of {BODY_PATH}");
            return Err(SetError::malformed(PATH, detail));
        }
        let std_is_sound = record.inter_frame_std.iter().all(|s| s.is_finite() && *s >= 0.0);
        if record.inter_frame_std.len() != 6 + degrees || !std_is_sound {
            let detail = format!("inter_frame_std must be {} numbers, none below zero", 6 + degrees);
            return Err(SetError::malformed(PATH, detail));
        }
        let world_from_root = record.root.transform().map_err(|e| SetError::malformed(PATH, e))?;
        let pose = Pose { world_from_root, joint_angles: DVector::from_vec(record.angles) };
        Ok(Self { body, pose, inter_frame_std: record.inter_frame_std })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};

    #[test]
    fn a_start_is_read_back_to_the_bit_and_must_fit_its_body() {
        let pose = walk(9).poses[8].clone();
        let start = Start { body: person(), pose, inter_frame_std: (0..12).map(|i| 0.1 / f64::from(i + 1)).collect() };
        let body = body_file::to_json(BODY_PATH, &start.body).unwrap();
        assert_eq!(Start::from_json(&start.to_json().unwrap(), &body).unwrap(), start);
        let short = Start { inter_frame_std: vec![0.1; 11], ..start.clone() };
        let error = Start::from_json(&short.to_json().unwrap(), &body).unwrap_err().to_string();
        assert_eq!(error, "start/start.json: inter_frame_std must be 12 numbers, none below zero");
        let mut renamed = start;
        renamed.body.degrees_of_freedom[0].name = "other".to_string();
        assert!(Start::from_json(&renamed.to_json().unwrap(), &body).unwrap_err().to_string().contains("angle_names"));
    }
}
