//! Varies a motion as between repetitions by the same person: tempo, amplitude and posture drift slowly. The defaults
//! follow a healthy adult's stride-to-stride variation, 2 to 3 % of the stride time (`[Hausdorff 1996]`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use core::f64::consts::TAU;

use rand::RngExt;

use skiagraph_core::body::{Humanoid, JointKind, Motion, Pose};
use skiagraph_core::rng::{Purpose, stream};

/// Slow random drifts, as between repetitions by the same person. Amounts are standard deviations over time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Variation {
    /// Seed of the drifts.
    pub seed: u32,
    /// Variation of the speed of the motion, %.
    pub tempo_percent: f64,
    /// Variation of the range of motion of joints and root about their mean, %.
    pub amplitude_percent: f64,
    /// Variation of every joint angle of trunk, head and arms, degrees.
    pub posture_deg: f64,
}

impl Default for Variation {
    fn default() -> Self {
        Self { seed: 1, tempo_percent: 2.5, amplitude_percent: 3.0, posture_deg: 1.5 }
    }
}

/// Lower bound of the varied tempo, relative to the original.
const MIN_TEMPO: f64 = 0.3;

/// A varied motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Varied {
    /// The continuous motion.
    pub motion: Motion,
    /// For each frame, the (fractional) frame of the original that it shows; ascending.
    pub shows: Vec<f64>,
}

impl Varied {
    /// The frames that show frames `first..end` of the original; the nearest one if none does.
    pub fn frames_of(&self, first: usize, end: usize) -> std::ops::Range<usize> {
        let begins = self.shows.partition_point(|shown| *shown < first as f64);
        let ends = self.shows.partition_point(|shown| *shown <= end as f64 - 1.0);
        begins..ends.max(begins + 1).min(self.shows.len())
    }
}

/// Varies a continuous `motion`, whose duration changes slightly. Angles stay within the joint limits, or as far beyond
/// as they were.
pub fn varied(body: &Humanoid, motion: &Motion, variation: &Variation) -> Varied {
    let (timed, shows) = with_tempo(body, motion, variation);
    let swung = with_amplitude(body, &timed, variation);
    Varied { motion: with_posture(body, swung, variation).made_continuous(body), shows }
}

/// Also returns the frame of the original that each frame shows.
fn with_tempo(body: &Humanoid, motion: &Motion, variation: &Variation) -> (Motion, Vec<f64>) {
    let drift = Drift::new(variation.seed.into(), 0);
    let tempo = variation.tempo_percent / 100.0;
    let last = motion.poses.len().saturating_sub(1) as f64;
    let mut poses = Vec::with_capacity(motion.poses.len());
    let (mut shows, mut position, mut seconds) = (Vec::new(), 0.0, 0.0);
    while position <= last {
        poses.extend(motion.at_frame(body, position));
        shows.push(position);
        position += (1.0 + tempo * drift.at(seconds)).max(MIN_TEMPO);
        seconds += 1.0 / motion.frames_per_second;
    }
    (Motion { frames_per_second: motion.frames_per_second, poses }, shows)
}

fn with_amplitude(body: &Humanoid, motion: &Motion, variation: &Variation) -> Motion {
    let drift = Drift::new(variation.seed.into(), 1);
    let amplitude = variation.amplitude_percent / 100.0;
    let growth = |frame: usize| 1.0 + amplitude * drift.at(frame as f64 / motion.frames_per_second);
    let count = motion.poses.len().max(1) as f64;
    let angles = body.degrees_of_freedom.len();
    let sum = motion.poses.iter().fold(nalgebra::DVector::zeros(angles), |sum, pose| sum + &pose.joint_angles);
    let mean = sum / count;
    let mut place = motion.poses.first().map_or(nalgebra::Vector3::zeros(), |p| p.world_from_root.translation.vector);
    let grown = |(frame, pose): (usize, &Pose)| {
        let before = &motion.poses[frame.saturating_sub(1)].world_from_root.translation.vector;
        let step = (pose.world_from_root.translation.vector - before) * growth(frame);
        place += nalgebra::Vector3::new(step.x, step.y, 0.0);
        place.z = pose.world_from_root.translation.z;
        let mut grown = pose.clone();
        grown.world_from_root.translation.vector = place;
        grown.joint_angles = &mean + (&pose.joint_angles - &mean) * growth(frame);
        clamp_to_limits(body, pose, &mut grown);
        grown
    };
    let poses = motion.poses.iter().enumerate().map(grown).collect();
    Motion { frames_per_second: motion.frames_per_second, poses }
}

fn with_posture(body: &Humanoid, mut motion: Motion, variation: &Variation) -> Motion {
    let drift = |index: usize| (index, Drift::new(variation.seed.into(), 2 + index as u64));
    let drifts: Vec<(usize, Drift)> = upper_body_freedoms(body).into_iter().map(drift).collect();
    let (rate, posture) = (motion.frames_per_second, variation.posture_deg.to_radians());
    for (frame, pose) in motion.poses.iter_mut().enumerate() {
        let was = pose.clone();
        for (index, drift) in &drifts {
            pose.joint_angles[*index] += posture * drift.at(frame as f64 / rate);
        }
        clamp_to_limits(body, &was, pose);
    }
    motion
}

/// Clamps angles to their limits, or to where they were if that is beyond.
fn clamp_to_limits(body: &Humanoid, was: &Pose, pose: &mut Pose) {
    for (index, limits) in body.degrees_of_freedom.iter().enumerate() {
        let old = was.joint_angles[index];
        pose.joint_angles[index] = pose.joint_angles[index].clamp(limits.lower.min(old), limits.upper.max(old));
    }
}

/// The degrees of freedom that do not move the legs.
fn upper_body_freedoms(body: &Humanoid) -> Vec<usize> {
    let mut of_legs = vec![false; body.degrees_of_freedom.len()];
    for foot in body.foot_links().into_iter().flatten() {
        let mut link = foot;
        while let Some(parent) = body.parent(link) {
            let driven = match &body.joints[link - 1].kind {
                JointKind::Fixed => 0..0,
                JointKind::Revolute { drive, .. } | JointKind::Prismatic { drive, .. } => {
                    drive.degree_of_freedom..drive.degree_of_freedom + 1
                }
                JointKind::Spherical { first } => *first..first + 3,
                JointKind::Floating { first } => *first..first + 6,
            };
            of_legs[driven].fill(true);
            link = parent;
        }
    }
    (0..of_legs.len()).filter(|&index| !of_legs[index]).collect()
}

/// Number of sine waves in a drift.
const WAVES: usize = 4;

/// Shortest and longest period, seconds.
const PERIOD_RANGE_S: [f64; 2] = [3.0, 12.0];

/// A smooth function of time with mean 0 and mean square 1: a sum of sines with random periods and phases.
struct Drift([(f64, f64); WAVES]);

impl Drift {
    /// Drift `index` of a seed.
    fn new(seed: u64, index: u64) -> Self {
        let mut rng = stream(seed, Purpose::MotionVariation, 0, 0, index);
        let [shortest, longest] = PERIOD_RANGE_S;
        let mut wave = 0.0;
        Self([(); WAVES].map(|()| {
            // separate parts of the range: waves with nearly equal periods would beat
            let share = (wave + 0.15 + 0.7 * rng.random::<f64>()) / WAVES as f64;
            wave += 1.0;
            let period = shortest * libm::pow(longest / shortest, share);
            (TAU / period, TAU * rng.random::<f64>())
        }))
    }

    /// The value at a time in seconds; at most `sqrt(8)`.
    fn at(&self, seconds: f64) -> f64 {
        let sum: f64 = self.0.iter().map(|(speed, phase)| libm::sin(speed * seconds + phase)).sum();
        sum * libm::sqrt(2.0 / WAVES as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use skiagraph_core::body::shipped;

    #[test]
    fn without_drift_nothing_changes() {
        let (body, motion) = (person(), walk(90).made_continuous(&person()));
        let none = Variation { seed: 1, tempo_percent: 0.0, amplitude_percent: 0.0, posture_deg: 0.0 };
        let same = varied(&body, &motion, &none).motion;
        assert_eq!(same.poses.len(), motion.poses.len());
        for (a, b) in same.poses.iter().zip(&motion.poses) {
            assert!((&a.joint_angles - &b.joint_angles).amax() < 1e-12);
            assert!((a.world_from_root.translation.vector - b.world_from_root.translation.vector).norm() < 1e-12);
        }
    }

    #[test]
    fn seeds_differ_are_reproducible_and_keep_the_limits() {
        let body = shipped("actor").unwrap();
        let knee = body.find_degree_of_freedom("left_knee_flexion").unwrap();
        let pose = |frame: usize| {
            let mut pose = body.zero_pose();
            pose.joint_angles[knee] = 0.6 - 0.6 * libm::cos(0.1 * frame as f64);
            pose
        };
        let motion = Motion { frames_per_second: 60.0, poses: (0..300).map(pose).collect() };
        let with = |seed| varied(&body, &motion, &Variation { seed, ..Variation::default() }).motion;
        assert_eq!(with(3), with(3));
        assert_ne!(with(3), with(4));
        for pose in &with(3).poses {
            for (angle, limits) in pose.joint_angles.iter().zip(&body.degrees_of_freedom) {
                assert!((limits.lower..=limits.upper).contains(angle), "{}: {angle}", limits.name);
            }
        }
    }

    /// Scaling frame numbers by the motion's duration would be wrong.
    #[test]
    fn frames_of_the_original_are_mapped_to_the_varied_motion() {
        let still = Motion { frames_per_second: 60.0, poses: vec![person().zero_pose(); 600] };
        let varied = varied(&person(), &still, &Variation { seed: 2, tempo_percent: 20.0, ..Variation::default() });
        assert_eq!(varied.shows.len(), varied.motion.poses.len());
        for (first, end) in [(0, 20), (150, 168), (300, 318), (580, 600)] {
            let frames = varied.frames_of(first, end);
            let inside = |shown: f64| (first as f64..=(end - 1) as f64).contains(&shown);
            let found: Vec<usize> = (0..varied.shows.len()).filter(|&frame| inside(varied.shows[frame])).collect();
            assert_eq!((found[0], found[found.len() - 1] + 1), (frames.start, frames.end));
        }
        let (scaled, found) = (300.0 * varied.shows.len() as f64 / 600.0, varied.frames_of(300, 318).start as f64);
        assert!((scaled - found).abs() > 5.0, "scaling would give another result: {scaled}");
        assert_eq!(varied.frames_of(0, 1), 0..1);
    }

    #[test]
    fn posture_varies_in_the_upper_body_only() {
        let body = shipped("actor").unwrap();
        let still = Motion { frames_per_second: 60.0, poses: vec![body.zero_pose(); 200] };
        let moved = varied(&body, &still, &Variation { seed: 5, ..Variation::default() }).motion;
        let arm = body.find_degree_of_freedom("left_elbow_flexion").unwrap();
        let knee = body.find_degree_of_freedom("left_knee_flexion").unwrap();
        assert!(moved.poses.iter().any(|pose| pose.joint_angles[arm] > 0.005));
        assert!(moved.poses.iter().all(|pose| pose.joint_angles[knee] == 0.0));
    }

    #[test]
    fn a_drift_is_slow_reproducible_and_has_mean_0_and_mean_square_1() {
        let drift = Drift::new(3, 1);
        let values: Vec<f64> = (0..400_000).map(|k| drift.at(0.01 * f64::from(k))).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.01 && (square - 1.0).abs() < 0.05, "{mean} {square}");
        assert!(values.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.01 * 2.83 * TAU / 3.0));
        assert_ne!(drift.at(1.0), Drift::new(3, 2).at(1.0));
        assert_eq!(drift.at(1.0), Drift::new(3, 1).at(1.0));
    }
}
