//! A reference tracker that answers with the training pose nearest to the truth: the result of a perfect choice among
//! training poses. Only this room can build one, because trackers never see the truth.

use skiagraph_core::body::{Humanoid, Motion, Pose};
use skiagraph_core::observation::Observation;
use skiagraph_track::motion_model::pose_chart::{PoseChart, distance};
use skiagraph_track::tracker::{Estimate, TrackError, Tracker};

/// Answers every frame with the nearest training pose (`[GPDM graph]`, Eq. 8) at the true root.
pub(super) struct NearestTrainingPose {
    answers: Vec<Pose>,
}

impl NearestTrainingPose {
    /// `truth` has one pose of `body`, the tracker's body, per frame.
    pub(super) fn new(body: &Humanoid, training: &[Motion], truth: &Motion) -> Self {
        let chart = PoseChart::learn(body, training);
        let known: Vec<_> = training.iter().flat_map(|m| &m.poses).map(|pose| (chart.rotations(pose), pose)).collect();
        let nearest = |truth: &Pose| {
            let rotations = chart.rotations(truth);
            let near = known.iter().map(|(r, pose)| (distance(&rotations, r), pose));
            let best = near.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(truth, |(_, pose)| pose);
            Pose { world_from_root: truth.world_from_root, joint_angles: best.joint_angles.clone() }
        };
        Self { answers: truth.poses.iter().map(nearest).collect() }
    }
}

impl Tracker for NearestTrainingPose {
    fn name(&self) -> &str {
        "nearest_training_pose"
    }

    fn start(&mut self, _: &Pose) {}

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let frame = observation.frame;
        let pose = self.answers.get(frame).cloned().ok_or_else(|| TrackError::ObservationMismatch {
            frame,
            detail: format!("the truth has {} frames", self.answers.len()),
        })?;
        Ok(Estimate::without_search(frame, pose))
    }
}
