//! The static baseline.

use super::{Estimate, TrackError, Tracker};
use skiagraph_core::body::Pose;
use skiagraph_core::observation::Observation;

/// Returns the start pose for every frame.
#[derive(Clone, Debug, Default)]
pub struct Frozen {
    start: Option<Pose>,
}

impl Tracker for Frozen {
    fn name(&self) -> &str {
        "frozen"
    }

    fn start(&mut self, start: &Pose) {
        self.start = Some(start.clone());
    }

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let frame = observation.frame;
        let pose = self.start.clone().ok_or(TrackError::NotStarted { frame })?;
        Ok(Estimate::without_search(frame, pose))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DVector, Isometry3};

    use super::*;

    #[test]
    fn it_returns_the_start_pose_and_an_error_before_the_start() {
        let mut tracker = Frozen::default();
        let observation = Observation { frame: 7, time_s: 0.1, silhouettes: Vec::new(), moment: None, keypoints: None };
        assert!(matches!(tracker.track(&observation), Err(TrackError::NotStarted { frame: 7 })));
        let start = Pose { world_from_root: Isometry3::translation(1.0, 2.0, 3.0), joint_angles: DVector::zeros(3) };
        tracker.start(&start);
        assert_eq!(tracker.track(&observation).unwrap().pose, start);
    }
}
