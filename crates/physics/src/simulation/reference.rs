//! The target motion of the simulated body, interpolated between frames.

use skiagraph_core::body::{Humanoid, Motion, Pose};
use skiagraph_core::contact::GroundContacts;
use skiagraph_core::dynamics::REACH_S;
use skiagraph_core::dynamics::derivatives;

/// A motion sampled at every step.
pub(super) struct Reference<'a> {
    body: &'a Humanoid,
    /// One pose per step.
    steps: Motion,
    /// Rates of change at every recorded frame, in the order of [`Humanoid::difference`], per second.
    rates: Vec<Vec<f64>>,
    /// Second derivatives at every recorded frame.
    accelerations: Vec<Vec<f64>>,
    /// The links that touch the ground in every recorded frame.
    touching: Vec<Vec<usize>>,
    pub(super) steps_per_frame: usize,
}

impl<'a> Reference<'a> {
    /// At least `least_rate` steps a second, a whole number per frame; `None` for implausible rates. `contacts` define
    /// which links are on the ground.
    pub(super) fn new(body: &'a Humanoid, motion: &Motion, contacts: &GroundContacts, least_rate: f64) -> Option<Self> {
        let motion = motion.clone().made_continuous(body);
        let steps_per_frame = libm::ceil(least_rate / motion.frames_per_second - 1e-9).max(1.0) as usize;
        let steps = motion.resampled(body, motion.frames_per_second * steps_per_frame as f64)?;
        let last = motion.poses.len().checked_sub(1)?;
        // recordings often begin and end with jumps, so speeds there are means over a longer time
        let some = (libm::round(REACH_S * motion.frames_per_second) as usize).max(1);
        let rates = (0..=last).map(|frame| {
            let reach = if frame == 0 || frame == last { some } else { 1 };
            let (before, after) = (frame.saturating_sub(reach), (frame + reach).min(last));
            let mut rate = vec![0.0; body.step_len()];
            if before < after {
                body.difference(&motion.poses[before], &motion.poses[after], &mut rate);
                let per_second = motion.frames_per_second / (after - before) as f64;
                rate.iter_mut().for_each(|rate| *rate *= per_second);
            }
            rate
        });
        Some(Self {
            body,
            rates: rates.collect(),
            accelerations: (0..=last).map(|frame| derivatives(body, &motion, frame, REACH_S).accelerations).collect(),
            touching: (0..=last).map(|frame| contacts.touching(frame).map(|(link, _)| link).collect()).collect(),
            steps,
            steps_per_frame,
        })
    }

    pub(super) fn frames(&self) -> usize {
        self.rates.len()
    }

    pub(super) fn steps_per_second(&self) -> f64 {
        self.steps.frames_per_second
    }

    /// The pose at a step, counted from 0; the last one beyond the end.
    pub(super) fn pose(&self, step: usize) -> &Pose {
        &self.steps.poses[step.min(self.steps.poses.len() - 1)]
    }

    /// Rates of change at a step, linearly interpolated between frames.
    pub(super) fn rate(&self, step: usize) -> Vec<f64> {
        self.between(&self.rates, step)
    }

    /// Accelerations at a step, in the order of [`Humanoid::difference`], per second squared, linearly interpolated
    /// between frames.
    pub(super) fn acceleration(&self, step: usize) -> Vec<f64> {
        self.between(&self.accelerations, step)
    }

    /// The links that touch the ground at a step.
    pub(super) fn touching(&self, step: usize) -> &[usize] {
        &self.touching[(step / self.steps_per_frame).min(self.touching.len() - 1)]
    }

    fn between(&self, frames: &[Vec<f64>], step: usize) -> Vec<f64> {
        let last = frames.len() - 1;
        let frame = (step / self.steps_per_frame).min(last);
        let share = (step % self.steps_per_frame) as f64 / self.steps_per_frame as f64;
        let pairs = frames[frame].iter().zip(&frames[(frame + 1).min(last)]);
        pairs.map(|(from, to)| from + share * (to - from)).collect()
    }

    /// Height of the centre of mass at a step, metres.
    pub(super) fn height(&self, step: usize) -> f64 {
        self.body.centre_of_mass(&self.body.link_frames(self.pose(step))).map_or(0.0, |centre| centre.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::standing;
    use skiagraph_core::contact::ContactRule;

    /// A statue pushed over the ground, too fast to stand, whose first frame lags behind.
    #[test]
    fn the_initial_speed_is_a_mean_and_sliding_links_touch_the_ground() {
        let (body, mut motion) = standing(20);
        for (frame, pose) in motion.poses.iter_mut().enumerate() {
            pose.world_from_root.translation.x += 2.0 * frame as f64 / 60.0;
        }
        motion.poses[0].world_from_root.translation.x -= 0.02;
        let contacts = GroundContacts::from_motion(&body, &motion, &ContactRule::default()).unwrap();
        let reference = Reference::new(&body, &motion, &contacts, 480.0).unwrap();
        // 20 mm over 1/15 s are 0.3 m/s; over one frame they would be 1.2 m/s
        assert!((reference.rate(0)[0] - 2.3).abs() < 1e-9 && (reference.rate(80)[0] - 2.0).abs() < 1e-9);
        assert!(contacts.links.iter().all(|track| !track.frames[10].in_contact), "too fast to stand");
        assert!(body.foot_links().iter().all(|foot| foot.iter().any(|link| reference.touching(80).contains(link))));
    }
}
