//! Cropping a clip, changing its speed and its frame rate.

use std::ops::Range;

use super::options::MAX_RATE;
use super::recording::{MAX_JOINT_FRAMES, pose_between};
use super::rotation::make_signs_continuous;
use super::{Clip, MocapError};

impl Clip {
    /// Keeps frames `frames.start .. frames.end`, counted from 0: at least two, all within the clip. A part of a cycle
    /// is not cyclic.
    pub fn crop(mut self, frames: Range<usize>) -> Result<Self, MocapError> {
        let total = self.frames.len();
        if frames.end > total || frames.len() < 2 {
            let expected = format!("at least 2 of the frames 0..{total} of clip `{}`", self.name);
            return Err(MocapError::of_setting("crop", expected, format!("{}..{}", frames.start, frames.end)));
        }
        self.cyclic &= frames.len() == total;
        self.frames.truncate(frames.end);
        self.frames.drain(..frames.start);
        Ok(self)
    }

    /// The same motion `factor` times as fast: the frames are kept at a higher rate.
    #[must_use]
    pub fn at_speed(mut self, factor: f64) -> Self {
        self.frames_per_second *= factor;
        self
    }

    /// The same motion at another frame rate: rotations by slerp, positions linearly. Frames at times common to both
    /// rates are kept bit for bit.
    ///
    /// Frame 0 is kept; the last frame is the last time of the new rate within the clip, so up to one new frame time is
    /// lost at the end. A cycle stays cyclic only if it lasts a whole number of new frames: repeat it first
    /// ([`Clip::looped`]), then resample.
    pub fn resampled(&self, frames_per_second: f64) -> Result<Self, MocapError> {
        // a rounding error of the rate must not lose the last frame
        let last = self.duration() * frames_per_second + 1e-6;
        let max_frames = (MAX_JOINT_FRAMES / self.skeleton.joints.len().max(1)) as f64;
        if !(frames_per_second > 0.0 && frames_per_second <= MAX_RATE && (1.0..max_frames).contains(&last)) {
            let (name, duration) = (&self.name, self.duration());
            let expected = format!("a rate that gives clip `{name}` ({duration} s) 2 to {max_frames} frames");
            return Err(MocapError::of_setting("frames_per_second", expected, frames_per_second));
        }
        let old_frames_per_new = self.frames_per_second / frames_per_second;
        let mut frames: Vec<_> =
            (0..=last.floor() as usize).map(|index| self.pose_at(index as f64 * old_frames_per_new)).collect();
        make_signs_continuous(&mut frames);
        let cyclic = self.cyclic && (last.floor() * old_frames_per_new - (self.frames.len() - 1) as f64).abs() < 1e-6;
        Ok(Self {
            name: self.name.clone(),
            skeleton: self.skeleton.clone(),
            frames_per_second,
            frames,
            notes: self.notes.clone(),
            cyclic,
            up: self.up,
        })
    }

    /// The pose at an instant, in frames from the first; the last pose after the last frame.
    fn pose_at(&self, instant: f64) -> Vec<nalgebra::Isometry3<f64>> {
        let nearest = instant.round();
        let instant = if (instant - nearest).abs() < 1e-6 { nearest } else { instant };
        let index = (instant.floor() as usize).min(self.frames.len() - 1);
        match self.frames.get(index + 1) {
            Some(next) => pose_between(&self.frames[index], next, instant - instant.floor()),
            None => self.frames[index].clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::mocap::{Skeleton, SkeletonJoint};

    /// A root that moves 0.1 m along x per frame, and an arm that rotates 0.05 rad per frame.
    fn clip(frames: usize) -> Clip {
        let joint = |name: &str, parent| SkeletonJoint { name: name.to_owned(), parent, tip: None };
        let frame = |index: usize| {
            let index = index as f64;
            vec![
                Isometry3::translation(0.1 * index, 0.0, 1.0),
                Isometry3::new(Vector3::y() * 0.3, Vector3::x() * (0.05 * index)),
            ]
        };
        Clip {
            name: "made".to_owned(),
            skeleton: Skeleton { joints: vec![joint("root", None), joint("arm", Some(0))] },
            frames_per_second: 20.0,
            frames: (0..frames).map(frame).collect(),
            ..Clip::default()
        }
    }

    #[test]
    fn a_crop_keeps_the_given_frames_and_refuses_invalid_ranges() {
        let whole = clip(10);
        assert_eq!(whole.clone().crop(2..5).unwrap().frames, whole.frames[2..5]);
        assert_eq!(whole.clone().crop(0..10).unwrap(), whole);
        let error = whole.clone().crop(5..11).unwrap_err().to_string();
        assert_eq!(error, "crop: expected at least 2 of the frames 0..10 of clip `made`, found 5..11");
        #[expect(clippy::reversed_empty_ranges, reason = "callers may pass one")]
        for range in [3..4, 5..2, 9..usize::MAX] {
            assert!(whole.clone().crop(range).is_err());
        }
    }

    #[test]
    fn a_crop_of_a_cycle_is_not_cyclic() {
        let cycle = Clip { cyclic: true, ..clip(10) };
        assert!(cycle.clone().crop(0..10).unwrap().cyclic);
        assert!(!cycle.crop(0..9).unwrap().cyclic);
    }

    #[test]
    fn frames_common_to_both_rates_are_kept_bit_for_bit() {
        let clip = clip(11);
        assert_eq!(clip.resampled(20.0).unwrap(), clip);
        let double = clip.resampled(40.0).unwrap();
        assert_eq!(double.frames.len(), 21);
        for (index, frame) in clip.frames.iter().enumerate() {
            assert_eq!(&double.frames[2 * index], frame);
        }
        assert_eq!(double.resampled(20.0).unwrap(), clip, "and back");
    }

    #[test]
    fn uniform_motion_stays_uniform_at_any_rate_and_ends_within_the_clip() {
        let clip = clip(11); // 0.5 s at 20 Hz
        for rate in [7.0, 29.97, 60.0, 119.88] {
            let resampled = clip.resampled(rate).unwrap();
            assert_eq!(resampled.frames.len(), (0.5 * rate).floor() as usize + 1);
            for (index, frame) in resampled.frames.iter().enumerate() {
                let seconds = index as f64 / rate;
                assert_relative_eq!(frame[0].translation.x, 2.0 * seconds, epsilon = 1e-12);
                assert_relative_eq!(frame[1].rotation.angle(), seconds, epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn rates_that_give_too_few_or_too_many_frames_are_refused() {
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 1.9, 1e9] {
            assert!(clip(11).resampled(rate).is_err(), "{rate}");
        }
    }

    #[test]
    fn twice_the_speed_takes_half_the_time_through_the_same_poses() {
        let clip = clip(11);
        let fast = clip.clone().at_speed(2.0);
        assert_eq!((fast.duration(), clip.duration()), (0.25, 0.5));
        let resampled = fast.resampled(20.0).unwrap();
        assert_eq!(resampled.frames[..], clip.frames.iter().step_by(2).cloned().collect::<Vec<_>>()[..]);
    }

    #[test]
    fn a_cycle_stays_cyclic_only_if_it_is_a_whole_number_of_frames() {
        let cycle = Clip { cyclic: true, ..clip(11) };
        assert!(cycle.resampled(60.0).unwrap().cyclic);
        assert!(!cycle.resampled(59.0).unwrap().cyclic);
    }
}
