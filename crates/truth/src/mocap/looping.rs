//! Seamless repetition of one cycle of a motion.
//!
//! Each cycle is the first one moved over the ground by the horizontal displacement, and the rotation about the
//! vertical if any, between the roots of the first and last frames. The remaining misfit (height, tilt, every joint) is
//! blended over the last frames of each cycle by a cubic that also removes the jump in velocity.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::recording::MAX_JOINT_FRAMES;
use super::rotation::{CoordinateAxis, make_signs_continuous};
use super::{Clip, MocapError};

/// Time over which the misfit at the seam is blended, seconds.
const BLEND_TIME: f64 = 0.25;

/// Largest share of the cycle used for blending.
const BLEND_SHARE: f64 = 1.0 / 3.0;

/// A smaller heading change over a cycle is treated as misfit: recorded strides never close exactly, and a straight
/// walk must stay straight. Radians.
const MIN_TURN: f64 = 15.0 * core::f64::consts::PI / 180.0;

impl Clip {
    /// Repeats a cyclic clip until it lasts at least `duration` seconds, rounded up to a frame. The root's displacement
    /// over the ground and its heading accumulate from cycle to cycle; its height and tilt repeat. The result is not
    /// marked cyclic.
    pub fn looped(&self, duration: f64) -> Result<Self, MocapError> {
        let steps = (duration * self.frames_per_second - 1e-6).ceil();
        let max_frames = (MAX_JOINT_FRAMES / self.skeleton.joints.len().max(1)) as f64;
        if !(1.0..max_frames).contains(&steps) {
            let expected = format!("a duration in seconds that gives clip `{}` 2 to {max_frames} frames", self.name);
            return Err(MocapError::of_setting("duration", expected, duration));
        }
        if !self.cyclic || self.frames.len() < 4 {
            let expected = "one cycle of a repeating motion (DeepMimic's `Loop: wrap`)";
            let clip = format!("clip `{}`", self.name);
            return Err(MocapError::of_setting(clip, expected, "a motion that does not repeat"));
        }
        let period = self.frames.len() - 1;
        let step_over_ground = self.step_over_ground();
        let cycle = self.seamless_cycle(&step_over_ground);
        let mut world_from_cycle = Isometry3::identity();
        let mut frames = Vec::new();
        for index in 0..=steps as usize {
            if index > 0 && index % period == 0 {
                world_from_cycle = step_over_ground * world_from_cycle;
            }
            let mut frame = cycle[index % period].clone();
            if let Some(root) = frame.first_mut() {
                *root = world_from_cycle * *root;
            }
            frames.push(frame);
        }
        make_signs_continuous(&mut frames);
        Ok(Self { frames, cyclic: false, ..self.clone() })
    }

    /// The root's displacement in one cycle: rotation about Z and horizontal shift from the first frame to the last.
    fn step_over_ground(&self) -> Isometry3<f64> {
        let (Some(&first), Some(&last)) = (self.frames[0].first(), self.frames[self.frames.len() - 1].first()) else {
            return Isometry3::identity();
        };
        let change = last.rotation * first.rotation.inverse();
        let heading = 2.0 * libm::atan2(change.k, change.w);
        let heading = libm::remainder(heading, core::f64::consts::TAU);
        let turn = if heading.abs() < MIN_TURN { UnitQuaternion::identity() } else { CoordinateAxis::Z.turn(heading) };
        let mut shift = last.translation.vector - turn * first.translation.vector;
        shift.z = 0.0;
        Isometry3::from_parts(Translation3::from(shift), turn)
    }

    /// The frames, blended at the end so that the last frame is the first one moved by `step_over_ground`, with equal
    /// velocity.
    fn seamless_cycle(&self, step_over_ground: &Isometry3<f64>) -> Vec<Vec<Isometry3<f64>>> {
        let period = self.frames.len() - 1;
        let blend = (BLEND_TIME * self.frames_per_second).min(BLEND_SHARE * period as f64).round().max(1.0);
        let misfits: Vec<(Change, Change)> = (0..self.skeleton.joints.len())
            .map(|joint| {
                let before = |back: usize| self.frames[period - back][joint];
                let after = |frame: usize| {
                    let transform = self.frames[frame][joint];
                    if joint == 0 { step_over_ground * transform } else { transform }
                };
                let speed_before = speed(&before(0), &before(1), &before(2)).times(-1.0);
                let speed_after = speed(&after(0), &after(1), &after(2));
                (Change::between(&before(0), &after(0)), speed_after.minus(&speed_before).times(blend))
            })
            .collect();
        let mut cycle = self.frames.clone();
        for back in 0..blend as usize {
            let u = 1.0 - back as f64 / blend;
            for (transform, (misfit, speed_misfit)) in cycle[period - back].iter_mut().zip(&misfits) {
                // cubic Hermite: zero value and slope at u = 0, both misfits in full at u = 1
                let change = misfit.times(u * u * (3.0 - 2.0 * u)).minus(&speed_misfit.times(u * u * (1.0 - u)));
                *transform = change.applied_to(transform);
            }
        }
        cycle
    }
}

/// Change per frame at `now`, from the next two frames on one side; exact for constant acceleration.
fn speed(now: &Isometry3<f64>, next: &Isometry3<f64>, next_but_one: &Isometry3<f64>) -> Change {
    Change::between(now, next).times(2.0).minus(&Change::between(now, next_but_one).times(0.5))
}

/// A small change of a transform: of its position, and of its rotation as a rotation vector in its own frame.
struct Change {
    shift: Vector3<f64>,
    turn: Vector3<f64>,
}

impl Change {
    fn between(a: &Isometry3<f64>, b: &Isometry3<f64>) -> Self {
        let shift = b.translation.vector - a.translation.vector;
        Self { shift, turn: (a.rotation.inverse() * b.rotation).scaled_axis() }
    }

    fn minus(&self, other: &Self) -> Self {
        Self { shift: self.shift - other.shift, turn: self.turn - other.turn }
    }

    fn times(&self, factor: f64) -> Self {
        Self { shift: self.shift * factor, turn: self.turn * factor }
    }

    fn applied_to(&self, transform: &Isometry3<f64>) -> Isometry3<f64> {
        let translation = transform.translation.vector + self.shift;
        Isometry3::from_parts(
            Translation3::from(translation),
            transform.rotation * UnitQuaternion::from_scaled_axis(self.turn),
        )
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, TAU};

    use approx::assert_relative_eq;

    use super::*;
    use crate::mocap::{Skeleton, SkeletonJoint};

    const PERIOD: usize = 24;

    /// One cycle of a walk on a circle about the origin, a quarter circle per cycle, with a swinging arm. `misfit`
    /// grows over the cycle: it lifts the root and rotates the arm.
    fn cycle(misfit: f64) -> Clip {
        let joint = |name: &str, parent| SkeletonJoint { name: name.to_owned(), parent, tip: None };
        let frame = |index: usize| {
            let phase = index as f64 / PERIOD as f64;
            let heading = CoordinateAxis::Z.turn(FRAC_PI_2 * phase);
            let height = 1.0 + 0.02 * libm::sin(TAU * phase) + misfit * phase;
            let position = heading * Vector3::new(3.0, 0.0, height);
            let arm = CoordinateAxis::Y.turn(0.4 * libm::sin(TAU * phase) + misfit * phase);
            vec![
                Isometry3::from_parts(position.into(), heading),
                Isometry3::from_parts(Vector3::new(0.0, 0.2, 0.4).into(), arm),
            ]
        };
        Clip {
            name: "circle".to_owned(),
            skeleton: Skeleton { joints: vec![joint("root", None), joint("arm", Some(0))] },
            frames_per_second: 24.0,
            frames: (0..=PERIOD).map(frame).collect(),
            cyclic: true,
            ..Clip::default()
        }
    }

    #[test]
    fn an_exactly_closed_cycle_is_repeated_unchanged_along_its_circle() {
        let looped = cycle(0.0).looped(6.0).unwrap();
        assert_eq!((looped.frames.len(), looped.duration()), (6 * PERIOD + 1, 6.0));
        for (index, frame) in looped.frames.iter().enumerate() {
            let turns = index as f64 / PERIOD as f64;
            let heading = CoordinateAxis::Z.turn(FRAC_PI_2 * turns);
            assert_relative_eq!(frame[0].rotation.angle_to(&heading), 0.0, epsilon = 1e-7);
            let expected = heading * Vector3::new(3.0, 0.0, 1.0 + 0.02 * libm::sin(TAU * turns));
            assert_relative_eq!(frame[0].translation.vector, expected, epsilon = 1e-3);
        }
        assert!(!looped.cyclic);
    }

    #[test]
    fn height_repeats_and_the_seam_has_no_jump_in_position_or_velocity() {
        let (misfit, single) = (0.05, cycle(0.05));
        let looped = single.looped(10.0).unwrap();
        let height = |index: usize| looped.frames[index][0].translation.z;
        for index in 0..PERIOD {
            assert_relative_eq!(height(index), height(index + 9 * PERIOD), epsilon = 1e-12);
        }
        type Value = fn(&[Isometry3<f64>]) -> f64;
        let values: [Value; 2] = [|f| f[0].translation.z, |f| f[1].rotation.j];
        let greatest = |clip: &Clip, value: Value| {
            let values: Vec<f64> = clip.frames.iter().map(|frame| value(frame)).collect();
            values.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f64::max)
        };
        for value in values {
            let (single, looped) = (greatest(&single, value), greatest(&looped, value));
            // without blending, the second difference at the seam equals the misfit
            assert!(looped < single + 0.5 * misfit, "{looped} against {single}");
        }
    }

    #[test]
    fn a_small_heading_change_is_misfit_and_the_path_stays_straight() {
        let mut clip = cycle(0.0);
        for (index, frame) in clip.frames.iter_mut().enumerate() {
            let phase = index as f64 / PERIOD as f64;
            frame[0] = Isometry3::from_parts(Vector3::new(phase, 0.0, 1.0).into(), CoordinateAxis::Z.turn(0.1 * phase));
        }
        let looped = clip.looped(5.0).unwrap();
        let last = looped.frames[5 * PERIOD][0];
        assert_relative_eq!(last.translation.vector, Vector3::new(5.0, 0.0, 1.0), epsilon = 1e-12);
        assert_relative_eq!(last.rotation.angle(), 0.0, epsilon = 1e-12);
    }

    #[test]
    fn less_than_a_cycle_is_its_first_part() {
        let single = cycle(0.0);
        assert_eq!(single.looped(0.4).unwrap().frames, single.frames[..=10]);
    }

    #[test]
    fn invalid_durations_and_clips_without_a_cycle_are_refused() {
        let single = cycle(0.0);
        for duration in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e12] {
            assert!(matches!(single.looped(duration), Err(MocapError::Setting(_))), "{duration}");
        }
        let single = Clip { cyclic: false, ..single };
        let error = single.looped(5.0).unwrap_err().to_string();
        assert!(error.ends_with("found a motion that does not repeat"), "{error}");
    }
}
