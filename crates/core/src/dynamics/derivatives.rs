//! Rates and accelerations of a recorded motion.

use nalgebra::{Matrix3, Vector3};

use crate::body::{Humanoid, Motion};

/// First and second derivatives of a pose, per second, in the order of [`Humanoid::difference`].
pub struct Derivatives {
    /// First derivatives.
    pub rates: Vec<f64>,
    /// Second derivatives.
    pub accelerations: Vec<f64>,
}

/// Derivatives at one frame: those of the least-squares parabola through the frames within `reach_s` seconds before
/// and after (`[Savitzky 1964]`); at least one frame on each side, fewer at the ends. Zero in motions of fewer than
/// three frames.
pub fn derivatives(body: &Humanoid, motion: &Motion, frame: usize, reach_s: f64) -> Derivatives {
    let reach = (libm::round(reach_s * motion.frames_per_second) as usize).max(1);
    let last = motion.poses.len() - 1;
    let (from, to) = (frame.saturating_sub(reach), (frame + reach).min(last));
    let mut found = Derivatives { rates: vec![0.0; body.step_len()], accelerations: vec![0.0; body.step_len()] };
    let time = |other: usize| (other as f64 - frame as f64) / motion.frames_per_second;
    let powers = |other: usize| Vector3::new(1.0, time(other), time(other) * time(other));
    let normal: Matrix3<f64> = (from..=to).map(|other| powers(other) * powers(other).transpose()).sum();
    let Some(inverse) = normal.try_inverse().filter(|_| to - from >= 2) else { return found };
    let mut step = vec![0.0; body.step_len()];
    for other in from..=to {
        body.difference(&motion.poses[frame], &motion.poses[other], &mut step);
        let weights = inverse * powers(other);
        for (i, change) in step.iter().enumerate() {
            found.rates[i] += weights[1] * change;
            found.accelerations[i] += 2.0 * weights[2] * change;
        }
    }
    found
}
