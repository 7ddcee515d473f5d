//! A parsed recording before conversion to a [`Clip`]: in the file's units and axes, with dropouts.

use std::ops::{Range, RangeInclusive};

use nalgebra::{Isometry3, Vector3};

use super::options::{MAX_RATE, ReadOptions, SidesInFile, UpAxis, UpSource};
use super::rest_pose::REST_POSE_NOTE;
use super::rotation::{between, make_signs_continuous};
use super::stature::Stature;
use super::{Clip, MocapError};

/// Limit on joints times frames of a clip (an hour and a half of 31 joints at 120 Hz); larger files are broken or
/// hostile.
pub(super) const MAX_JOINT_FRAMES: usize = 20_000_000;

/// Limit on the joints of a skeleton; a hand has about twenty.
pub(super) const MAX_JOINTS: usize = 1_000;

/// Accepted frame times, seconds: longer ones are milliseconds, or let a small file claim hours.
pub(super) const FRAME_TIMES: RangeInclusive<f64> = 1.0 / MAX_RATE..=1.0;

/// How long a single pose is held, seconds.
const HOLD: f64 = 1.0;

/// A parsed file. `clip` is in file units and file axes.
pub(super) struct ParsedRecording {
    /// The file's content.
    pub(super) clip: Clip,
    /// Each joint's offset from its parent in the rest pose, file units.
    pub(super) rest_offsets: Vec<Vector3<f64>>,
    /// Frames in which every channel was exactly zero, ascending: the recording system lost the subject.
    pub(super) empty_frames: Vec<usize>,
    /// Unit, if the format defines it.
    pub(super) metres_per_unit: Option<f64>,
    /// Up axis, if the format defines it.
    pub(super) up: Option<UpAxis>,
}

impl ParsedRecording {
    /// Fills dropouts, then converts to metres, Z up. Options take precedence over the format's definition, which takes
    /// precedence over a guess.
    pub(super) fn into_clip(mut self, file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
        if self.clip.frames.len() == 1 {
            self.clip.frames = held(&self.clip.frames, self.clip.frames_per_second, &mut self.clip.notes);
        }
        self.fill_empty_frames();
        if self.clip.frames.len() < 2 {
            return Err(MocapError::too_few_frames(file, self.clip.frames.len()));
        }
        let mut stature = Stature::measure(&self.clip, &self.rest_offsets);
        self.clip.up = match (options.up, self.up) {
            (Some(up), _) => (up, UpSource::User),
            (None, Some(up)) => (up, UpSource::File),
            (None, None) => (stature.guess_up(&mut self.clip.notes), UpSource::Guess),
        };
        turn_upright(&mut self.clip);
        stature.length = self.clip.stature();
        let notes = &mut self.clip.notes;
        let metres_per_unit = match options.metres_per_unit.or(self.metres_per_unit) {
            Some(unit) => stature.accept_unit(unit, notes),
            None => stature.guess_unit(file, notes)?,
        };
        scale(&mut self.clip, metres_per_unit);
        match options.sides {
            SidesInFile::Right => {}
            SidesInFile::Mirrored => self.clip.reflect(),
            SidesInFile::Exchanged => self.clip.exchange_names()?,
        }
        make_signs_continuous(&mut self.clip.frames);
        if self.clip.has_inserted_rest_pose() {
            self.clip.notes.push(REST_POSE_NOTE.to_owned());
        }
        Ok(self.clip)
    }

    /// Removes empty frames, and those with all joints in one point, at both ends and interpolates the others. A single
    /// empty first frame is kept: it is the rest pose that some converters insert. Returns the range that remains.
    pub(super) fn fill_empty_frames(&mut self) -> Range<usize> {
        let clip = &mut self.clip;
        let total = clip.frames.len();
        let empty = std::mem::take(&mut self.empty_frames);
        let is_away = |joint: &Isometry3<f64>| joint.translation.vector.amax() > 0.0;
        let is_body = |pose: &Vec<Isometry3<f64>>| pose.len() < 2 || pose[1..].iter().any(is_away);
        let mut is_seen: Vec<bool> = clip.frames.iter().map(is_body).collect();
        empty.iter().for_each(|&index| is_seen[index] = false);
        if is_seen.get(1) == Some(&true) && is_body(&clip.frames[0]) {
            is_seen[0] = true;
        }
        let seen: Vec<usize> = (0..total).filter(|&index| is_seen[index]).collect();
        let (Some(&first), Some(&last)) = (seen.first(), seen.last()) else {
            clip.notes.push("all channels are zero in every frame of the file: the body does not move".to_owned());
            return 0..total;
        };
        let mut runs = Vec::new();
        for pair in seen.windows(2) {
            let (before, after) = (pair[0], pair[1]);
            for index in before + 1..after {
                let share = (index - before) as f64 / (after - before) as f64;
                clip.frames[index] = pose_between(&clip.frames[before], &clip.frames[after], share);
            }
            if after > before + 1 {
                runs.push(frame_range(before + 1, after - 1));
            }
        }
        if !runs.is_empty() {
            let runs = runs.join(", ");
            clip.notes
                .push(format!("the pose is all zeros in {runs} of the file (frames counted from 1): interpolated"));
        }
        if first > 0 || last + 1 < total {
            clip.notes.push(format!(
                "the pose is all zeros in the first {first} and the last {} frames of the file: removed",
                total - 1 - last
            ));
            clip.frames = clip.frames.drain(first..=last).collect();
        }
        first..last + 1
    }
}

fn frame_range(first: usize, last: usize) -> String {
    if first == last { format!("frame {}", first + 1) } else { format!("frames {}-{}", first + 1, last + 1) }
}

/// Interpolates every joint between two frames, see [`between`].
pub(super) fn pose_between(a: &[Isometry3<f64>], b: &[Isometry3<f64>], share: f64) -> Vec<Isometry3<f64>> {
    a.iter().zip(b).map(|(a, b)| between(a, b, share)).collect()
}

/// The only frame of a file, held, with a note.
pub(super) fn held<T: Clone>(frames: &[T], rate: f64, notes: &mut Vec<String>) -> Vec<T> {
    notes.push(format!("the file has one pose only: held still for {HOLD} s"));
    // no file makes more copies than this
    let copies = (HOLD * rate).min(240.0) as usize;
    frames.iter().cycle().take(2 + copies).cloned().collect()
}

fn scale(clip: &mut Clip, metres_per_unit: f64) {
    for tip in clip.skeleton.joints.iter_mut().filter_map(|joint| joint.tip.as_mut()) {
        *tip *= metres_per_unit;
    }
    for transform in clip.frames.iter_mut().flatten() {
        transform.translation.vector *= metres_per_unit;
    }
}

/// Rotates the root, and with it the world, so that the file's up axis is Z.
fn turn_upright(clip: &mut Clip) {
    let axis = clip.up.0;
    if axis == UpAxis::Z {
        return;
    }
    let turn = axis.turn();
    for root in clip.frames.iter_mut().filter_map(|frame| frame.first_mut()) {
        root.translation.vector = axis.upright(&root.translation.vector);
        root.rotation = turn * root.rotation;
    }
}

/// The frame rate for a frame time in seconds: a whole number within 0.05 %, since files contain rounded frame times
/// (0.0083333 for 1/120), else the exact quotient. 29.97 and 30 stay distinct.
pub(super) fn rate_from_frame_time(seconds: f64, notes: &mut Vec<String>) -> f64 {
    let rate = 1.0 / seconds;
    let whole = rate.round();
    if whole != rate && (rate / whole - 1.0).abs() < 5e-4 {
        notes.push(format!("frame time {seconds} s taken as {whole} frames a second"));
        return whole;
    }
    rate
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::mocap::{Skeleton, SkeletonJoint};

    /// One joint that moves 1 unit and turns 0.1 rad a frame; zero where lost.
    fn recording(frames: usize, lost: &[usize]) -> ParsedRecording {
        let frame = |index: usize| {
            let index = if lost.contains(&index) { 0.0 } else { 1.0 + index as f64 };
            vec![Isometry3::new(Vector3::x() * index, Vector3::z() * (0.1 * index))]
        };
        let joints = vec![SkeletonJoint { name: "root".to_owned(), parent: None, tip: Some(Vector3::z()) }];
        let clip = Clip {
            name: "made".to_owned(),
            skeleton: Skeleton { joints },
            frames_per_second: 50.0,
            frames: (0..frames).map(frame).collect(),
            ..Clip::default()
        };
        let (metres_per_unit, up) = (Some(1.7), Some(UpAxis::Z));
        ParsedRecording { clip, rest_offsets: vec![Vector3::zeros()], empty_frames: lost.to_vec(), metres_per_unit, up }
    }

    #[test]
    fn lost_frames_are_interpolated_between_their_neighbours_and_listed() {
        let clip = recording(12, &[3, 6, 7, 8]).into_clip("f", &ReadOptions::default()).unwrap();
        for (index, frame) in clip.frames.iter().enumerate() {
            assert_relative_eq!(frame[0].translation.x, 1.7 * (1.0 + index as f64), epsilon = 1e-12);
            assert_relative_eq!(frame[0].rotation.angle(), 0.1 * (1.0 + index as f64), epsilon = 1e-12);
        }
        let note = "the pose is all zeros in frame 4, frames 7-9 of the file (frames counted from 1): interpolated";
        assert_eq!(clip.notes, [note]);
    }

    #[test]
    fn lost_frames_at_the_ends_are_removed_with_a_note() {
        let clip = recording(10, &[0, 1, 8, 9]).into_clip("f", &ReadOptions::default()).unwrap();
        assert_eq!((clip.frames.len(), clip.frames[0][0].translation.x), (6, 1.7 * 3.0));
        assert_eq!(clip.notes, ["the pose is all zeros in the first 2 and the last 2 frames of the file: removed"]);
    }

    #[test]
    fn a_skeleton_that_never_moves_keeps_all_frames() {
        let clip = recording(4, &[0, 1, 2, 3]).into_clip("f", &ReadOptions::default()).unwrap();
        assert_eq!(clip.frames.len(), 4);
        assert_eq!(clip.notes, ["all channels are zero in every frame of the file: the body does not move"]);
    }

    #[test]
    fn a_recording_with_a_single_valid_frame_is_refused() {
        let error = recording(4, &[0, 1, 3]).into_clip("f", &ReadOptions::default()).unwrap_err();
        assert_eq!(error.to_string(), "f: expected frames with a pose, found 1");
    }

    #[test]
    fn rounded_frame_times_become_whole_rates_and_others_stay() {
        let rate = |seconds: f64| rate_from_frame_time(seconds, &mut Vec::new());
        assert_eq!(rate(0.0083333), 120.0);
        assert_eq!(rate(0.03333), 30.0);
        assert_eq!(rate(0.033332), 30.0);
        assert_relative_eq!(rate(1001.0 / 30000.0), 29.97, epsilon = 1e-3);
        assert_relative_eq!(rate(0.008342), 119.875, epsilon = 1e-3);
    }
}
