//! `start/`: the start of a tracker. `body.json` is its body, `start.json` its start pose; `training.npz` has motions
//! to learn from, or `spread.npz` has the spread of changes from frame to frame instead.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::rigid::RigidRecord;
use super::{body_file, spread_file, training_file};
use crate::files::SetFiles;
use crate::{SetError, StepSpread, Training, TrainingMotions};
use skiagraph_core::body::{Calibrated, Humanoid, Pose};

pub(crate) const PATH: &str = "start/start.json";
pub(crate) const BODY_PATH: &str = "start/body.json";
const SCHEMA: &str = "skiagraph.start/1";

/// Everything that a tracker is given before the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The tracker's own body.
    pub body: Humanoid,
    /// Its pose at frame 0.
    pub pose: Pose,
    /// Training data for proposals and motion models, at the rate of the observations; never the motion of the test.
    pub training: Training,
    /// What the tracker must calibrate on the observations before tracking.
    pub calibrate: Calibrated,
    /// Whether the body's stature is known, so that a calibrated body must keep it.
    pub has_known_stature: bool,
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
    /// Absent if nothing is calibrated, so that the bytes of such sets do not change.
    #[serde(default, skip_serializing_if = "Calibrated::is_nothing")]
    calibrate: Calibrated,
    /// Absent if false, for the same reason.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    has_known_stature: bool,
}

impl Start {
    pub(crate) fn to_json(&self) -> Result<Vec<u8>, SetError> {
        let record = StartRecord {
            schema: SCHEMA.to_string(),
            frame: 0,
            root: RigidRecord::new(&self.pose.world_from_root),
            angle_names: self.body.degrees_of_freedom.iter().map(|d| d.name.clone()).collect(),
            angles: self.pose.joint_angles.iter().copied().collect(),
            calibrate: self.calibrate,
            has_known_stature: self.has_known_stature,
        };
        super::json::to_bytes(PATH, &record)
    }

    pub(crate) fn training_file(&self) -> Result<(&'static str, Vec<u8>), SetError> {
        Ok(match &self.training {
            Training::Motions(training) => (training_file::PATH, training.to_npz(&self.body)?),
            Training::Spread(spread) => (spread_file::PATH, spread.to_npz(&self.body)?),
        })
    }

    pub(crate) fn from_files(files: &SetFiles) -> Result<Self, SetError> {
        let body = body_file::from_json(BODY_PATH, &files.read(BODY_PATH)?)?;
        let record: StartRecord = super::json::from_bytes(PATH, &[SCHEMA], &files.read(PATH)?)?;
        let degrees = body.degrees_of_freedom.len();
        let names = body.degrees_of_freedom.iter().map(|d| &d.name);
        if record.angles.len() != degrees || !record.angle_names.iter().eq(names) {
            let detail = format!("angles and angle_names must match the {degrees} degrees of freedom of {BODY_PATH}");
            return Err(SetError::malformed(PATH, detail));
        }
        let world_from_root = record.root.transform().map_err(|e| SetError::malformed(PATH, e))?;
        let pose = Pose { world_from_root, joint_angles: DVector::from_vec(record.angles) };
        let StartRecord { calibrate, has_known_stature, .. } = record;
        let training = if files.has(training_file::PATH) {
            Training::Motions(TrainingMotions::from_npz(&files.read(training_file::PATH)?, degrees)?)
        } else {
            Training::Spread(StepSpread::from_npz(&files.read(spread_file::PATH)?, &body)?)
        };
        Ok(Self { body, pose, training, calibrate, has_known_stature })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};

    fn files(start: &Start, body: &Humanoid) -> SetFiles {
        let (path, training) = start.training_file().unwrap();
        let body = body_file::to_json(BODY_PATH, body).unwrap();
        let files = [(PATH, start.to_json().unwrap()), (BODY_PATH, body), (path, training)];
        SetFiles::in_memory(files.map(|(path, bytes)| (path.to_owned(), bytes)).into(), &|| false).unwrap()
    }

    #[test]
    fn a_start_is_read_back_to_the_bit_and_must_fit_its_body() {
        let numbers = vec![0.1; person().step_len()];
        let spread = StepSpread { change: numbers.clone(), change_of_change: numbers };
        let [motions, spread] = [Training::new(vec![walk(9)]), Training::Spread(spread)];
        for (training, calibrate) in
            [(motions, Calibrated::Both), (spread.clone(), Calibrated::Nothing), (spread, Calibrated::Cameras)]
        {
            let has_known_stature = calibrate == Calibrated::Cameras;
            let start =
                Start { body: person(), pose: walk(9).poses[8].clone(), training, calibrate, has_known_stature };
            assert_eq!(Start::from_files(&files(&start, &person())).unwrap(), start);
            let mut renamed = start;
            renamed.body.degrees_of_freedom[0].name = "other".to_string();
            let error = Start::from_files(&files(&renamed, &person())).unwrap_err().to_string();
            assert!(error.contains("angle_names"), "{error}");
        }
    }
}
