//! Repeating one cycle of a motion without a seam.
//!
//! Each cycle is the first one moved over the ground: by the horizontal shift, and the turn about the vertical if it is one,
//! that take the root of the first frame to that of the last. What misfit remains (height, tilt, every joint) is taken up
//! over the last frames of each cycle by a cubic that also removes the jump in velocity.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::recording::MOST_JOINT_FRAMES;
use super::rotation::{Axis, make_signs_continuous};
use super::{Clip, MocapError};

/// Time over which the misfit at the seam is spread, seconds.
const BLEND_TIME: f64 = 0.25;

/// ... and the greatest share of the cycle that this may be.
const BLEND_SHARE: f64 = 1.0 / 3.0;

/// A heading that changes by less over a cycle is no turn but part of the misfit: recorded strides never close exactly, and
/// a straight walk must stay straight. Radians.
const LEAST_TURN: f64 = 15.0 * core::f64::consts::PI / 180.0;

impl Clip {
    /// A cyclic clip repeated until it lasts `duration` seconds or, by less than a frame, more. The root's way over the ground
    /// and its heading add up from cycle to cycle; its height and tilt repeat. The result is no longer marked cyclic.
    pub fn looped(&self, duration: f64) -> Result<Self, MocapError> {
        let steps = (duration * self.frames_per_second - 1e-6).ceil();
        let most = (MOST_JOINT_FRAMES / self.skeleton.joints.len().max(1)) as f64;
        if !(1.0..most).contains(&steps) {
            return Err(MocapError::Setting {
                setting: "duration",
                expected: format!("seconds that give clip `{}` 2 to {most} frames", self.name),
                found: duration.to_string(),
            });
        }
        if !self.cyclic || self.frames.len() < 3 {
            return Err(MocapError::NotCyclic { clip: self.name.clone() });
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
        Ok(Self {
            name: self.name.clone(),
            skeleton: self.skeleton.clone(),
            frames_per_second: self.frames_per_second,
            frames,
            notes: self.notes.clone(),
            cyclic: false,
        })
    }

    /// What one cycle adds to the root's way: the turn about Z and the horizontal shift from frame 0 to the last.
    fn step_over_ground(&self) -> Isometry3<f64> {
        let (Some(&first), Some(&last)) = (self.frames[0].first(), self.frames[self.frames.len() - 1].first()) else {
            return Isometry3::identity();
        };
        let change = last.rotation * first.rotation.inverse();
        let heading = 2.0 * libm::atan2(change.k, change.w);
        let heading = libm::remainder(heading, core::f64::consts::TAU);
        let turn = if heading.abs() < LEAST_TURN { UnitQuaternion::identity() } else { Axis::Z.turn(heading) };
        let mut shift = last.translation.vector - turn * first.translation.vector;
        shift.z = 0.0;
        Isometry3::from_parts(Translation3::from(shift), turn)
    }

    /// The frames with the last ones bent so that the last frame is the first one moved by `step_over_ground`, at the first
    /// one's velocity.
    fn seamless_cycle(&self, step_over_ground: &Isometry3<f64>) -> Vec<Vec<Isometry3<f64>>> {
        let period = self.frames.len() - 1;
        let blend = (BLEND_TIME * self.frames_per_second).min(BLEND_SHARE * period as f64).round().max(1.0);
        let (last, before_last) = (&self.frames[period], &self.frames[period - 1]);
        let misfits: Vec<(Change, Change)> = (0..self.skeleton.joints.len())
            .map(|joint| {
                let moved = |frame: usize| {
                    let transform = self.frames[frame][joint];
                    if joint == 0 { step_over_ground * transform } else { transform }
                };
                let speed_after = Change::between(&moved(0), &moved(1));
                let speed_before = Change::between(&before_last[joint], &last[joint]);
                (Change::between(&last[joint], &moved(0)), speed_after.minus(&speed_before).times(blend))
            })
            .collect();
        let mut cycle = self.frames.clone();
        for back in 0..blend as usize {
            let u = 1.0 - back as f64 / blend;
            for (transform, (misfit, speed_misfit)) in cycle[period - back].iter_mut().zip(&misfits) {
                // Hermite's cubic: no change and no speed at u = 0, all of both misfits at u = 1.
                let change = misfit.times(u * u * (3.0 - 2.0 * u)).minus(&speed_misfit.times(u * u * (1.0 - u)));
                *transform = change.applied_to(transform);
            }
        }
        cycle
    }
}

/// A small change of a transform: of its position, and of its rotation as a vector in its own frame.
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
