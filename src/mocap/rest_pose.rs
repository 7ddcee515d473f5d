//! The rest pose that converters put before a motion: cgspeed's BVH versions of CMU's recordings start with a T-pose.

use nalgebra::Isometry3;

use super::Clip;

/// Share of the moving joints that a rest pose leaves exactly unrotated.
const RESTING_SHARE: f64 = 0.75;

/// How much greater the step out of an inserted pose is than any step soon after it.
const JUMP: f64 = 5.0;

/// Steps after the first to compare with.
const STEPS: usize = 60;

/// What a clip with such a frame notes.
pub(super) const REST_POSE_NOTE: &str = "the first frame is a rest pose that was put before the motion";

impl Clip {
    /// Whether frame 0 is a rest pose that does not belong to the motion: nearly all joints that move are exactly
    /// unrotated in it, and from it to frame 1 the body jumps.
    pub fn has_inserted_rest_pose(&self) -> bool {
        let [rest, next, after, ..] = self.frames.as_slice() else { return false };
        let is_resting = |transform: &Isometry3<f64>| transform.rotation.angle() < 1e-9;
        let moving: Vec<usize> =
            (1..rest.len()).filter(|&j| !(is_resting(&next[j]) && is_resting(&after[j]))).collect();
        let resting = moving.iter().filter(|&&j| is_resting(&rest[j])).count();
        let greatest_later =
            self.frames[1..].windows(2).take(STEPS).map(|w| mean_turn(&w[0], &w[1])).fold(0.0, f64::max);
        !moving.is_empty()
            && resting as f64 >= RESTING_SHARE * moving.len() as f64
            && mean_turn(rest, next) > JUMP * greatest_later
    }

    /// Without that frame, where there is one; said in `notes`.
    pub fn without_inserted_rest_pose(mut self) -> Self {
        if self.has_inserted_rest_pose() {
            self.frames.remove(0);
            self.notes.retain(|note| note != REST_POSE_NOTE);
            self.notes.push("left out: a rest pose that was put before the motion".to_owned());
        }
        self
    }
}

/// Mean angle by which joints turn from one frame to another, radians.
fn mean_turn(a: &[Isometry3<f64>], b: &[Isometry3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.rotation.angle_to(&b.rotation)).sum::<f64>() / a.len().max(1) as f64
}
