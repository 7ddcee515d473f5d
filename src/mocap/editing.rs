//! Cutting a clip and changing its rate.

use std::ops::Range;

use super::recording::{GREATEST_RATE, MOST_JOINT_FRAMES, pose_between};
use super::rotation::make_signs_continuous;
use super::{Clip, MocapError};

impl Clip {
    /// Frames `frames.start .. frames.end`, counted from 0. At least two, and within the clip. A part of a cycle is no cycle.
    pub fn crop(mut self, frames: Range<usize>) -> Result<Self, MocapError> {
        let total = self.frames.len();
        if frames.end > total || frames.len() < 2 {
            return Err(MocapError::Setting {
                setting: "crop",
                expected: format!("at least 2 of the frames 0..{total} of clip `{}`", self.name),
                found: format!("{}..{}", frames.start, frames.end),
            });
        }
        self.cyclic &= frames.len() == total;
        self.frames.truncate(frames.end);
        self.frames.drain(..frames.start);
        Ok(self)
    }

    /// The same motion at another rate: rotations by slerp, positions on straight lines; where an instant of the new rate is
    /// one of the old, that frame is kept bit for bit.
    ///
    /// Frame 0 stays; the last frame is the last instant of the new rate within the clip, so up to one new frame time is
    /// lost at the end. A cycle stays one only if it is a whole number of new frames long: repeat it first
    /// ([`Clip::looped`]), then resample.
    pub fn resampled(&self, frames_per_second: f64) -> Result<Self, MocapError> {
        // A rate that is off by rounding must not lose the last frame.
        let last = self.duration() * frames_per_second + 1e-6;
        let most = (MOST_JOINT_FRAMES / self.skeleton.joints.len().max(1)) as f64;
        if !(frames_per_second > 0.0 && frames_per_second <= GREATEST_RATE && (1.0..most).contains(&last)) {
            return Err(MocapError::Setting {
                setting: "frames_per_second",
                expected: format!("a rate that gives clip `{}` ({} s) 2 to {most} frames", self.name, self.duration()),
                found: frames_per_second.to_string(),
            });
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
        })
    }

    /// The pose at an instant, in frames from the first; after the last frame, the last.
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
