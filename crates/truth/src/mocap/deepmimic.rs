//! DeepMimic clips: JSON rows with a duration, the root's position and rotation, and the humanoid's joint rotations.
//!
//! A row has 44 numbers: seconds to the next row; root position (metres, Y up, facing +X); root quaternion w x y z;
//! then chest, neck, and hip, knee, ankle, shoulder, elbow of the right side, then of the left: quaternions w x y z,
//! except for knees and elbows, which have one angle about the joint's z axis (radians; knees flex negative, elbows
//! positive) (`[Peng 2018]`). Segment lengths are those of DeepMimic's humanoid.

use core::f64::consts::TAU;
use std::fmt::Display;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::clip::clip_name;
use super::options::{ReadOptions, UpAxis};
use super::recording::{FRAME_TIMES, MAX_JOINT_FRAMES, ParsedRecording, pose_between, rate_from_frame_time};
use super::rotation::CoordinateAxis;
use super::text_cursor::is_plausible;
use super::{Clip, MocapError, Skeleton, SkeletonJoint};
use skiagraph_core::input::{foreign, unquoted};

/// Numbers in a row.
const COLUMNS: usize = 44;

/// A quaternion's norm may deviate from 1 by this much without a note.
const LENGTH_TOLERANCE: f64 = 0.02;

/// Accepted norms of quaternions, which are normalised.
const LENGTHS: std::ops::Range<f64> = 0.51..2.0;

/// First columns of the quaternions of joints that never turn far: chest, neck, hips, ankles.
const CALM_QUATERNIONS: [usize; 6] = [8, 12, 16, 21, 30, 35];

/// Columns of knees and elbows.
const HINGES: [usize; 4] = [20, 29, 34, 43];

#[derive(Clone, Copy)]
enum RowJoint {
    /// Position and quaternion.
    Root,
    /// Quaternion.
    Ball,
    /// Angle about z.
    Hinge,
    /// Nothing.
    Fixed,
}

/// Name, parent, offset from the parent (metres, Y up), kind of joint, and the tip of a leaf.
type JointRow = (&'static str, Option<usize>, [f64; 3], RowJoint, Option<[f64; 3]>);

/// Offsets of DeepMimic's humanoid; tips are the far ends of its head and hand spheres and foot boxes.
#[rustfmt::skip]
const JOINTS: [JointRow; 15] = [
    ("root",           None,     [0.0, 0.0, 0.0],             RowJoint::Root,  None),
    ("chest",          Some(0),  [0.0, 0.236151, 0.0],        RowJoint::Ball,  None),
    ("neck",           Some(1),  [0.0, 0.223894, 0.0],        RowJoint::Ball,  Some([0.0, 0.2775, 0.0])),
    ("right_hip",      Some(0),  [0.0, 0.0, 0.084887],        RowJoint::Ball,  None),
    ("right_knee",     Some(3),  [0.0, -0.421546, 0.0],       RowJoint::Hinge, None),
    ("right_ankle",    Some(4),  [0.0, -0.40987, 0.0],        RowJoint::Ball,  Some([0.1335, -0.0225, 0.0])),
    ("right_shoulder", Some(1),  [-0.02405, 0.2435, 0.18311], RowJoint::Ball,  None),
    ("right_elbow",    Some(6),  [0.0, -0.274788, 0.0],       RowJoint::Hinge, None),
    ("right_wrist",    Some(7),  [0.0, -0.258947, 0.0],       RowJoint::Fixed, Some([0.0, -0.04, 0.0])),
    ("left_hip",       Some(0),  [0.0, 0.0, -0.084887],       RowJoint::Ball,  None),
    ("left_knee",      Some(9),  [0.0, -0.421546, 0.0],       RowJoint::Hinge, None),
    ("left_ankle",     Some(10), [0.0, -0.40987, 0.0],        RowJoint::Ball,  Some([0.1335, -0.0225, 0.0])),
    ("left_shoulder",  Some(1),  [-0.02405, 0.2435, -0.18311], RowJoint::Ball, None),
    ("left_elbow",     Some(12), [0.0, -0.274788, 0.0],       RowJoint::Hinge, None),
    ("left_wrist",     Some(13), [0.0, -0.258947, 0.0],       RowJoint::Fixed, Some([0.0, -0.04, 0.0])),
];

#[derive(Deserialize)]
struct File {
    #[serde(rename = "Loop", default)]
    looping: String,
    #[serde(rename = "Frames")]
    frames: Vec<Vec<f64>>,
}

/// Parses the text of a DeepMimic clip; `file` is its name, used for messages and the clip's name.
///
/// The last row's duration is ignored. If the others differ, the clip is resampled to their median duration, with a
/// note.
pub fn parse_deepmimic(text: &str, file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let content: File = serde_json::from_str(text).map_err(|error| {
        // the file may be any JSON, which must not be quoted
        let found = if text.contains("\"Frames\"") { foreign(&error) } else { unquoted(&error) };
        let place = format!("{file}:{}", error.line().max(1));
        MocapError::at(place, "a DeepMimic clip (JSON with `Loop` and `Frames`)", found)
    })?;
    if content.frames.is_empty() {
        return Err(MocapError::too_few_frames(file, 0));
    }
    let mut durations = Vec::with_capacity(content.frames.len());
    let mut frames = Vec::with_capacity(content.frames.len());
    let mut empty_frames = Vec::new();
    let mut notes = Vec::new();
    let convention = Convention::of(&content.frames, &mut notes);
    for (index, numbers) in content.frames.iter().enumerate() {
        let row = NumberRow { numbers, file, frame: index + 1, convention };
        row.check()?;
        if index + 1 < content.frames.len() {
            durations.push(row.duration()?);
        }
        if row.is_empty() {
            empty_frames.push(index);
        }
        frames.push(row.pose()?);
    }
    let clip = Clip {
        name: clip_name(file),
        skeleton: skeleton(),
        frames_per_second: 1.0,
        frames,
        notes,
        cyclic: content.looping.eq_ignore_ascii_case("wrap"),
        up: Default::default(),
    };
    let rest_offsets = JOINTS.iter().map(|(_, _, offset, ..)| Vector3::from(*offset)).collect();
    let mut recording =
        ParsedRecording { clip, rest_offsets, empty_frames, metres_per_unit: Some(1.0), up: Some(UpAxis::Y) };
    let kept = recording.fill_empty_frames();
    if content.frames.len() == 1 {
        let row = NumberRow { numbers: &content.frames[0], file, frame: 1, convention };
        recording.clip.frames_per_second = 1.0 / row.duration().unwrap_or(1.0 / 30.0);
    }
    set_rate(&mut recording.clip, &durations[kept.start..kept.end.saturating_sub(1).max(kept.start)], file)?;
    if let Some(rate) = options.frames_per_second {
        recording.clip.frames_per_second = rate;
    }
    recording.into_clip(file, options)
}

fn skeleton() -> Skeleton {
    let joint = |(name, parent, _, _, tip): &JointRow| SkeletonJoint {
        name: (*name).to_owned(),
        parent: *parent,
        tip: tip.map(Vector3::from),
    };
    Skeleton { joints: JOINTS.iter().map(joint).collect() }
}

/// How a file writes rotations, where it differs from DeepMimic.
#[derive(Clone, Copy)]
struct Convention {
    /// Quaternions are x y z w.
    w_last: bool,
    /// Hinges are in degrees.
    degrees: bool,
}

impl Convention {
    /// Told from rotations that no body can have, with notes. Rows of a wrong length are left to others.
    fn of(rows: &[Vec<f64>], notes: &mut Vec<String>) -> Self {
        let number = |row: &Vec<f64>, column: usize| row.get(column).copied().unwrap_or(0.0).abs();
        let mean = |part: usize| {
            let numbers = rows.iter().flat_map(|row| CALM_QUATERNIONS.map(|first| number(row, first + part)));
            numbers.sum::<f64>() / (rows.len() * CALM_QUATERNIONS.len()) as f64
        };
        // read with w first, every joint would be turned by more than 120 degrees
        let w_last = mean(0) < 0.5 && mean(3) > 0.8;
        if w_last {
            notes.push("the quaternions have w last, x y z w, not w first as in DeepMimic's clips: read so".to_owned());
        }
        let most = rows.iter().flat_map(|row| HINGES.map(|column| number(row, column))).fold(0.0, f64::max);
        let degrees = most > TAU;
        if degrees {
            notes.push(format!("knees and elbows are in degrees, not radians, up to {most:.1}: read so"));
        }
        let lengths = || {
            let firsts = std::iter::once(4).chain(CALM_QUATERNIONS).chain([25, 39]);
            let all = rows.iter().flat_map(move |row| firsts.clone().filter_map(|first| row.get(first..first + 4)));
            all.map(|q| q.iter().map(|part| part * part).sum::<f64>().sqrt()).filter(|length| *length > 0.0)
        };
        let off = lengths().filter(|length| (length - 1.0).abs() > LENGTH_TOLERANCE).count();
        if off > 0 {
            let (least, most) = (lengths().fold(f64::INFINITY, f64::min), lengths().fold(0.0, f64::max));
            let found = format!("{off} of {} quaternions do not have length 1", lengths().count());
            notes.push(format!("{found}, but {least:.3} to {most:.3}: normalised"));
        }
        Self { w_last, degrees }
    }
}

struct NumberRow<'a> {
    numbers: &'a [f64],
    file: &'a str,
    /// Counted from 1.
    frame: usize,
    convention: Convention,
}

impl NumberRow<'_> {
    fn check(&self) -> Result<(), MocapError> {
        if self.numbers.len() != COLUMNS {
            return Err(self.error(format!("{COLUMNS} numbers"), self.numbers.len()));
        }
        match self.numbers.iter().position(|&number| !is_plausible(number)) {
            Some(column) => {
                let expected = format!("a length or angle in column {}", column + 1);
                Err(self.error(expected, format!("{:e}", self.numbers[column])))
            }
            None => Ok(()),
        }
    }

    fn duration(&self) -> Result<f64, MocapError> {
        let seconds = self.numbers[0];
        if FRAME_TIMES.contains(&seconds) {
            return Ok(seconds);
        }
        Err(self.error("a time to the next frame in seconds, > 0 and at most 1, in column 1", seconds))
    }

    /// Whether everything except the duration is zero.
    fn is_empty(&self) -> bool {
        self.numbers[1..].iter().all(|&number| number == 0.0)
    }

    fn pose(&self) -> Result<Vec<Isometry3<f64>>, MocapError> {
        let mut column = 1;
        let mut frame = Vec::with_capacity(JOINTS.len());
        for (_, _, offset, kind, _) in &JOINTS {
            let mut translation = Vector3::from(*offset);
            if let RowJoint::Root = kind {
                translation += Vector3::from_column_slice(&self.numbers[column..column + 3]);
                column += 3;
            }
            let rotation = match kind {
                RowJoint::Root | RowJoint::Ball => self.quaternion(column)?,
                RowJoint::Hinge => CoordinateAxis::Z.turn(self.hinge(column)?),
                RowJoint::Fixed => UnitQuaternion::identity(),
            };
            column += match kind {
                RowJoint::Root | RowJoint::Ball => 4,
                RowJoint::Hinge => 1,
                RowJoint::Fixed => 0,
            };
            frame.push(Isometry3::from_parts(Translation3::from(translation), rotation));
        }
        Ok(frame)
    }

    /// The angle in this column, radians.
    fn hinge(&self, column: usize) -> Result<f64, MocapError> {
        let angle = self.numbers[column];
        let radians = if self.convention.degrees { angle.to_radians() } else { angle };
        if radians.abs() <= TAU {
            return Ok(radians);
        }
        Err(self.error(format!("an angle of at most one turn, radians, in column {}", column + 1), angle))
    }

    /// The rotation that starts in this column; the identity in an empty row.
    fn quaternion(&self, column: usize) -> Result<UnitQuaternion<f64>, MocapError> {
        let [w, x, y, z] =
            std::array::from_fn(|i| self.numbers[column + (i + 3 * usize::from(self.convention.w_last)) % 4]);
        let quaternion = Quaternion::new(w, x, y, z);
        if LENGTHS.contains(&quaternion.norm()) {
            return Ok(UnitQuaternion::from_quaternion(quaternion));
        }
        if self.is_empty() {
            return Ok(UnitQuaternion::identity());
        }
        let expected = format!("a unit quaternion w x y z in columns {} to {}", column + 1, column + 4);
        Err(self.error(expected, format!("one of length {}", quaternion.norm())))
    }

    fn error(&self, expected: impl Display, found: impl Display) -> MocapError {
        MocapError::at(format!("{}: frame {} (from 1)", self.file, self.frame), expected, found)
    }
}

/// Sets the clip's frame rate from its durations (one fewer than frames), resampling if these differ. The last frame
/// stays the last, so a cycle stays a cycle.
fn set_rate(clip: &mut Clip, durations: &[f64], file: &str) -> Result<(), MocapError> {
    let mut sorted = durations.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (Some(&shortest), Some(&longest)) = (sorted.first(), sorted.last()) else { return Ok(()) };
    let median = sorted[sorted.len() / 2];
    if longest - shortest <= 1e-6 * median {
        clip.frames_per_second = rate_from_frame_time(median, &mut clip.notes);
        return Ok(());
    }
    let total: f64 = durations.iter().sum();
    let steps = (total / median).round().max(1.0);
    if steps * JOINTS.len() as f64 > MAX_JOINT_FRAMES as f64 {
        let (place, found) = (format!("{file}: frame 1 (from 1)"), format!("{shortest} s to {longest} s"));
        return Err(MocapError::at(place, "durations of the same order of magnitude", found));
    }
    let steps = steps as usize;
    let (mut index, mut start) = (0, 0.0);
    let mut frames = Vec::with_capacity(steps + 1);
    for step in 0..=steps {
        let time = total * step as f64 / steps as f64;
        while index + 1 < durations.len() && time >= start + durations[index] {
            start += durations[index];
            index += 1;
        }
        let share = (time - start) / durations[index];
        frames.push(pose_between(&clip.frames[index], &clip.frames[index + 1], share));
    }
    clip.frames = frames;
    let rate = steps as f64 / total;
    clip.frames_per_second = rate;
    let lasting = format!("frames last from {shortest} s to {longest} s");
    clip.notes.push(format!("{lasting}: resampled to {rate:.4} frames per second"));
    Ok(())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// Rows at rest with these durations, the root at a height of 1 m (along y in the file).
    fn rows(durations: &[f64]) -> Vec<Vec<f64>> {
        let row = |(index, &seconds): (usize, &f64)| {
            let mut row = vec![0.0; COLUMNS];
            row[0] = seconds;
            row[1] = index as f64;
            row[2] = 1.0;
            for quaternion in [4, 8, 12, 16, 21, 25, 30, 35, 39] {
                row[quaternion] = 1.0;
            }
            row
        };
        durations.iter().enumerate().map(row).collect()
    }

    fn text(rows: &[Vec<f64>]) -> String {
        format!("{{\"Loop\": \"wrap\", \"Frames\":\n{rows:?}\n}}")
    }

    fn parse(rows: &[Vec<f64>]) -> Result<Clip, MocapError> {
        parse_deepmimic(&text(rows), "clip.txt", &ReadOptions::default())
    }

    #[test]
    fn columns_belong_to_their_joints() {
        let mut rows = rows(&[0.05, 0.0]);
        rows[0][20] = -0.7; // right knee
        rows[0][29] = 0.3; // right elbow
        rows[0][34] = -0.2; // left knee
        rows[0][43] = 0.9; // left elbow
        (rows[0][35], rows[0][36]) = (0.8, 0.6); // left ankle, about x
        let clip = parse(&rows).unwrap();
        let rotation = |name: &str| clip.frames[0][clip.skeleton.find(name).unwrap()].rotation.scaled_axis();
        assert_relative_eq!(rotation("right_knee"), Vector3::z() * -0.7, epsilon = 1e-12);
        assert_relative_eq!(rotation("right_elbow"), Vector3::z() * 0.3, epsilon = 1e-12);
        assert_relative_eq!(rotation("left_knee"), Vector3::z() * -0.2, epsilon = 1e-12);
        assert_relative_eq!(rotation("left_elbow"), Vector3::z() * 0.9, epsilon = 1e-12);
        assert_relative_eq!(rotation("left_ankle"), Vector3::x() * 2.0 * libm::acos(0.8), epsilon = 1e-12);
        assert_eq!((clip.frames_per_second, clip.cyclic), (20.0, true));
    }

    // Quaternions of other lengths were refused; w last and degrees gave poses that no body can have.
    #[test]
    fn rotations_written_otherwise_are_read_with_a_note() {
        let mut usual = rows(&[0.05, 0.0]);
        usual[0][8..12].copy_from_slice(&[0.8, 0.0, 0.0, 0.6]);
        usual[0][20] = -0.7;
        let expected = parse(&usual).unwrap();
        let found = |change: &dyn Fn(&mut Vec<f64>), note: &str| {
            let mut rows = usual.clone();
            rows.iter_mut().for_each(change);
            let clip = parse(&rows).unwrap();
            assert!(clip.notes.iter().any(|own| own.contains(note)), "{note}: {:?}", clip.notes);
            for (own, expected) in clip.frames.iter().flatten().zip(expected.frames.iter().flatten()) {
                assert_relative_eq!(own, expected, epsilon = 1e-12);
            }
        };
        found(&|row| row[8..12].iter_mut().for_each(|part| *part *= 0.95), "do not have length 1, but 0.950 to 1.000");
        found(&|row| HINGES.iter().for_each(|hinge| row[*hinge] = row[*hinge].to_degrees()), "in degrees");
        found(&|row| [4, 8, 12, 16, 21, 25, 30, 35, 39].iter().for_each(|q| row[*q..q + 4].rotate_left(1)), "w last");
    }

    #[test]
    fn the_body_is_z_up_and_faces_x() {
        let clip = parse(&rows(&[0.05, 0.0])).unwrap();
        let positions = clip.joint_positions(1);
        let at = |name: &str| positions[clip.skeleton.find(name).unwrap()];
        assert_relative_eq!(at("root").coords, Vector3::new(1.0, 0.0, 1.0), epsilon = 1e-12);
        assert_relative_eq!(at("right_hip").coords, Vector3::new(1.0, -0.084887, 1.0), epsilon = 1e-12);
        assert_relative_eq!(at("left_ankle").coords, Vector3::new(1.0, 0.084887, 1.0 - 0.831416), epsilon = 1e-12);
    }

    #[test]
    fn unequal_durations_are_resampled_keeping_the_ends() {
        // The root moves 1 m a row: after 0.1 s, 0.3 s and 0.4 s it is at 1, 2 and 3 m.
        let clip = parse(&rows(&[0.1, 0.2, 0.1, 9.0])).unwrap();
        assert_relative_eq!(clip.frames_per_second, 10.0, epsilon = 1e-12);
        let x: Vec<f64> = clip.frames.iter().map(|frame| frame[0].translation.x).collect();
        assert_relative_eq!(x.as_slice(), [0.0, 1.0, 1.5, 2.0, 3.0].as_slice(), epsilon = 1e-12);
        assert!(clip.notes.iter().any(|note| note.contains("resampled")), "{:?}", clip.notes);
    }

    #[test]
    fn an_empty_row_is_interpolated_with_a_note() {
        let mut rows = rows(&[0.1; 5]);
        rows[2][1..].fill(0.0);
        let clip = parse(&rows).unwrap();
        assert_relative_eq!(clip.frames[2][0].translation.vector, Vector3::new(2.0, 0.0, 1.0), epsilon = 1e-12);
        assert!(clip.notes.iter().any(|note| note.contains("frame 3 of the file")), "{:?}", clip.notes);
    }

    #[test]
    fn a_broken_clip_is_refused_with_its_frame_or_line() {
        let broken = |change: fn(&mut Vec<Vec<f64>>)| {
            let mut rows = rows(&[0.1; 3]);
            change(&mut rows);
            parse(&rows).unwrap_err().to_string()
        };
        assert_eq!(broken(|r| r[1].truncate(43)), "clip.txt: frame 2 (from 1): expected 44 numbers, found 43");
        assert_eq!(
            broken(|r| r[1][0] = 0.0),
            "clip.txt: frame 2 (from 1): expected a time to the next frame in seconds, > 0 and at most 1, in column 1, found 0"
        );
        assert_eq!(
            broken(|r| r[2][6] = 1e300),
            "clip.txt: frame 3 (from 1): expected a length or angle in column 7, found 1e300"
        );
        assert_eq!(
            broken(|r| r[2][8] = 0.5),
            "clip.txt: frame 3 (from 1): expected a unit quaternion w x y z in columns 9 to 12, found one of length 0.5"
        );
        assert_eq!(broken(Vec::clear), "clip.txt: expected frames with a pose, found 0");
        assert!(broken(|r| r[0][3] = f64::NAN).starts_with("clip.txt:2: expected a DeepMimic clip"));
        let whole = text(&rows(&[0.1; 3]));
        for length in 0..whole.len() - 1 {
            assert!(parse_deepmimic(&whole[..length], "clip.txt", &ReadOptions::default()).is_err(), "{length}");
        }
    }
}
