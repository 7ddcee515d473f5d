//! A reference tracker that answers with the truth plus a known error. Only this room can build one, because trackers
//! never see the truth.

use nalgebra::{Translation3, Vector3};

use crate::scenario::OracleSettings;
use skiagraph_core::body::Pose;
use skiagraph_core::observation::Observation;
use skiagraph_core::rng::{Purpose, normal, stream};
use skiagraph_track::tracker::{Estimate, TrackError, Tracker};

/// Answers every frame with the truth, fitted to the tracker's body, plus an error of known size.
pub(super) struct Oracle {
    truth: Vec<Pose>,
    settings: OracleSettings,
    seed: u64,
}

impl Oracle {
    /// `truth` has one pose of the tracker's body per frame.
    pub(super) fn new(truth: Vec<Pose>, settings: OracleSettings, seed: u64) -> Self {
        Self { truth, settings, seed }
    }
}

impl Tracker for Oracle {
    fn name(&self) -> &str {
        "oracle"
    }

    fn start(&mut self, _: &Pose) {}

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let frame = observation.frame;
        let mut pose = self.truth.get(frame).cloned().ok_or_else(|| TrackError::ObservationMismatch {
            frame,
            detail: format!("the truth has {} frames", self.truth.len()),
        })?;
        let mut rng = stream(self.seed, Purpose::Oracle, frame as u64, 0, 0);
        let mut noise = |deviation: f64| {
            let unit = normal(&mut rng);
            deviation * unit
        };
        let root_noise = self.settings.root_noise_m;
        let shake = Vector3::new(noise(root_noise), noise(root_noise), noise(root_noise));
        let offset = Vector3::from(self.settings.root_offset_m) + shake;
        pose.world_from_root = Translation3::from(offset) * pose.world_from_root;
        let angle_noise = self.settings.angle_noise_deg.to_radians();
        pose.joint_angles.iter_mut().for_each(|angle| *angle += noise(angle_noise));
        Ok(Estimate::without_search(frame, pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DVector, Isometry3};

    fn answer(settings: OracleSettings, seed: u64, frame: usize) -> Pose {
        let pose = Pose { world_from_root: Isometry3::identity(), joint_angles: DVector::zeros(2) };
        let mut oracle = Oracle::new(vec![pose; 400], settings, seed);
        oracle
            .track(&Observation { frame, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints: None })
            .unwrap()
            .pose
    }

    #[test]
    fn a_constant_offset_is_the_only_error() {
        let settings = OracleSettings { root_offset_m: [0.03, 0.04, 0.0], ..OracleSettings::default() };
        let pose = answer(settings, 1, 3);
        assert_eq!(pose.world_from_root.translation.vector, Vector3::new(0.03, 0.04, 0.0));
        assert_eq!(pose.joint_angles, DVector::zeros(2));
    }

    #[test]
    fn noise_has_the_planted_deviation_and_differs_by_seed_and_frame() {
        let settings = OracleSettings { angle_noise_deg: 2.0, ..OracleSettings::default() };
        let angles: Vec<f64> = (0..400).map(|f| answer(settings.clone(), 1, f).joint_angles[0].to_degrees()).collect();
        let deviation = (angles.iter().map(|a| a * a).sum::<f64>() / angles.len() as f64).sqrt();
        assert!((deviation - 2.0).abs() < 0.2, "{deviation}");
        assert_ne!(answer(settings.clone(), 1, 0), answer(settings.clone(), 2, 0));
        assert_eq!(answer(settings.clone(), 1, 0), answer(settings, 1, 0));
    }

    #[test]
    fn a_frame_beyond_the_truth_is_an_error() {
        let mut oracle = Oracle::new(Vec::new(), OracleSettings::default(), 0);
        assert!(
            oracle
                .track(&Observation { frame: 0, time_s: 0.0, silhouettes: Vec::new(), moment: None, keypoints: None })
                .is_err()
        );
    }
}
