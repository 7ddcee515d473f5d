//! BVH: a tree of joints with channels, then one row of channel values per frame.
//!
//! As in Biovision's files, `parent_from_joint` consists of the position channels (each replaces a component of
//! `OFFSET`) and the product of the rotation channels in the listed order, degrees. Keywords are case-insensitive;
//! every joint may list any channels in any order.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::bvh_hierarchy::{Channel, Hierarchy, parse_hierarchy};
use super::clip::clip_name;
use super::options::ReadOptions;
use super::recording::{FRAME_TIMES, MAX_JOINT_FRAMES, ParsedRecording, rate_from_frame_time};
use super::text_cursor::{TextCursor, finite_number};
use super::{Clip, MocapError};

/// Parses the text of a BVH file; `file` is its name, used for messages and the clip's name.
///
/// If the header's frame count and the number of rows differ by one or two, all rows are used, with a note; a larger
/// difference is an error: the file is truncated or its header is wrong.
pub fn parse_bvh(text: &str, file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    // braces may touch words; this keeps the line numbers
    let text = text.replace('{', " { ").replace('}', " } ");
    let mut cursor = TextCursor::new(&text, file);
    let hierarchy = parse_hierarchy(&mut cursor)?;
    parse_motion(&mut cursor, hierarchy, file, options)?.into_clip(file, options)
}

fn parse_motion(
    cursor: &mut TextCursor<'_>,
    hierarchy: Hierarchy,
    file: &str,
    options: &ReadOptions,
) -> Result<ParsedRecording, MocapError> {
    let mut notes = Vec::new();
    cursor.keyword("MOTION")?;
    cursor.label("Frames")?;
    let word = cursor.word_in_line();
    let Some(declared) = word.and_then(|w| w.parse::<u64>().ok()) else {
        return Err(cursor.unexpected("the number of frames", word));
    };
    cursor.keyword("Frame")?;
    cursor.label("Time")?;
    let word = cursor.word_in_line();
    let frames_per_second = match (options.frames_per_second, word.and_then(finite_number)) {
        (Some(rate), Some(_)) => rate,
        (None, Some(seconds)) if FRAME_TIMES.contains(&seconds) => rate_from_frame_time(seconds, &mut notes),
        (_, number) => return Err(cursor.unexpected(&frame_time_expected(number), word)),
    };
    let frames = parse_rows(cursor, &hierarchy, declared, &mut notes)?;
    let found = frames.all.len();
    if found as u64 != declared {
        // a file cut short is no single pose
        if found == 1 || found.abs_diff(usize::try_from(declared).unwrap_or(usize::MAX)) > ROW_COUNT_TOLERANCE {
            let expected = format!("{declared} rows, as declared by `Frames: {declared}`");
            return Err(cursor.error(expected, format!("the end of the file after {found} rows")));
        }
        notes.push(format!("the header declares {declared} frames, the file has {found} rows: all rows are used"));
    }
    let Hierarchy { skeleton, offsets, .. } = hierarchy;
    let clip =
        Clip { name: clip_name(file), skeleton, frames_per_second, frames: frames.all, notes, ..Clip::default() };
    Ok(ParsedRecording { clip, rest_offsets: offsets, empty_frames: frames.empty, metres_per_unit: None, up: None })
}

/// Positions of joints below the root are near 0 if all together are less than this share of their offsets.
const MOST_OF_OFFSETS: f64 = 0.01;
/// Tolerated difference between header and row count: programs differ in counting the rest pose or the last frame.
const ROW_COUNT_TOLERANCE: usize = 2;

/// Rows as poses.
#[derive(Default)]
struct Frames {
    all: Vec<Vec<Isometry3<f64>>>,
    /// Indices of all-zero rows.
    empty: Vec<usize>,
}

fn parse_rows(
    cursor: &mut TextCursor<'_>,
    hierarchy: &Hierarchy,
    declared: u64,
    notes: &mut Vec<String>,
) -> Result<Frames, MocapError> {
    let width: usize = hierarchy.channels.iter().map(Vec::len).sum();
    let joints = hierarchy.channels.len();
    let mut frames = Frames::default();
    let mut row = Vec::new();
    while let Some(line) = cursor.next_line() {
        if (frames.all.len() + 1) * joints > MAX_JOINT_FRAMES {
            return Err(cursor.error(format!("at most {MAX_JOINT_FRAMES} joints times frames"), "more"));
        }
        let first = cursor.line();
        if let Err(error) = parse_row(cursor, width, &mut row) {
            let is_row = |line: &str| line.split_whitespace().count() == width;
            // some programs append lines of their own, such as QAvimator's key frames
            let mut are_behind = (1..=frames.all.len() as u64).contains(&declared) && !is_row(line);
            let mut count = 1;
            while are_behind && let Some(line) = cursor.next_line() {
                are_behind = !is_row(line);
                count += 1;
            }
            if !are_behind {
                return Err(error);
            }
            notes.push(format!(
                "the {count} lines after the declared frames, from line {first}, are no frames: not used"
            ));
            break;
        }
        if row.iter().all(|&value| value == 0.0) {
            frames.empty.push(frames.all.len());
        }
        frames.all.push(pose(hierarchy, &row));
    }
    if let Some(joints) = joints_moved_from_offsets(hierarchy, &frames.all) {
        for frame in &mut frames.all {
            for &joint in &joints {
                frame[joint].translation.vector += hierarchy.offsets[joint];
            }
        }
        notes.push(
            "positions of joints below the root are near 0: taken from their OFFSET, as MakeHuman does".to_owned(),
        );
    }
    Ok(frames)
}

/// The joints below the root with positions, if these are near 0 where bones have a length: the positions of others
/// replace the offset, and would put the whole body in one point.
fn joints_moved_from_offsets(hierarchy: &Hierarchy, frames: &[Vec<Isometry3<f64>>]) -> Option<Vec<usize>> {
    let is_position = |channel: &Channel| matches!(channel, Channel::Position(_));
    let moved = |joint: &usize| hierarchy.channels[*joint].iter().filter(|channel| is_position(channel)).count() == 3;
    let joints: Vec<usize> = (1..hierarchy.channels.len()).filter(moved).collect();
    let bones: f64 = joints.iter().map(|joint| hierarchy.offsets[*joint].norm()).sum();
    let farthest =
        |frame: &Vec<Isometry3<f64>>| joints.iter().map(|j| frame[*j].translation.vector.norm()).sum::<f64>();
    let read = frames.iter().map(farthest).fold(0.0, f64::max);
    (bones > 0.0 && read < MOST_OF_OFFSETS * bones).then_some(joints)
}

fn parse_row(cursor: &mut TextCursor<'_>, width: usize, row: &mut Vec<f64>) -> Result<(), MocapError> {
    let expected = format!("{width} values, one for each channel");
    row.clear();
    for _ in 0..width {
        row.push(cursor.number_in_line(&expected)?);
    }
    match cursor.word_in_line() {
        Some(extra) => Err(cursor.unexpected(&expected, Some(extra))),
        None => Ok(()),
    }
}

/// What is expected of a frame time; `found` is the number in its place.
fn frame_time_expected(found: Option<f64>) -> String {
    let expected = "the time between frames in seconds, > 0 and at most 1";
    match found.filter(|found| *found > *FRAME_TIMES.end()) {
        Some(milliseconds) => {
            let rate = rate_from_frame_time(milliseconds / 1000.0, &mut Vec::new());
            format!(
                "{expected} (if these are milliseconds, set `source_hz = {rate:.3}`, else to the frames per second)"
            )
        }
        None => format!("{expected}; if it is unknown, set `source_hz` to the frames per second"),
    }
}

/// Every joint's `parent_from_joint` for one row, which has one value per channel.
fn pose(hierarchy: &Hierarchy, row: &[f64]) -> Vec<Isometry3<f64>> {
    let mut values = row.iter();
    let mut frame = Vec::with_capacity(hierarchy.channels.len());
    for (offset, channels) in hierarchy.offsets.iter().zip(&hierarchy.channels) {
        let mut translation = *offset;
        let mut rotation = UnitQuaternion::identity();
        for (channel, &value) in channels.iter().zip(&mut values) {
            match channel {
                Channel::Position(axis) => translation[axis.index()] = value,
                Channel::Rotation(axis) => rotation *= axis.turn(value.to_radians()),
            }
        }
        frame.push(Isometry3::from_parts(Translation3::from(translation), rotation));
    }
    frame
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use approx::assert_relative_eq;
    use nalgebra::Vector3;

    use super::*;
    use crate::mocap::UpAxis;
    use crate::mocap::rotation::CoordinateAxis;

    /// Two joints in metres, Z up; the second has different channels in a different order.
    const TINY: &str = "HIERARCHY
ROOT hips
{
  OFFSET 0 0 1
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT knee
  {
    OFFSET 0 0 0.7
    CHANNELS 4 Yrotation Xrotation Zrotation Zposition
    End Site
    {
      OFFSET 0 0.1 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.02
1 2 3 10 20 30 40 50 60 0.5
1 2 3 10 20 30 40 50 60 0.5
";

    fn metres_z_up() -> ReadOptions {
        ReadOptions { metres_per_unit: Some(1.0), up: Some(UpAxis::Z), ..ReadOptions::default() }
    }

    fn parse(text: &str) -> Result<Clip, MocapError> {
        parse_bvh(text, "tiny.bvh", &metres_z_up())
    }

    fn message(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    #[test]
    fn each_joint_rotates_in_the_order_of_its_channels() {
        let clip = parse(TINY).unwrap();
        let turn = |axis: CoordinateAxis, degrees: f64| axis.turn(degrees.to_radians());
        let hips = turn(CoordinateAxis::Z, 10.0) * turn(CoordinateAxis::X, 20.0) * turn(CoordinateAxis::Y, 30.0);
        let knee = turn(CoordinateAxis::Y, 40.0) * turn(CoordinateAxis::X, 50.0) * turn(CoordinateAxis::Z, 60.0);
        assert_relative_eq!(clip.frames[0][0].rotation, hips, epsilon = 1e-15);
        assert_relative_eq!(clip.frames[0][1].rotation, knee, epsilon = 1e-15);
        assert_eq!(clip.frames[0][0].translation.vector, Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(clip.frames[0][1].translation.vector, Vector3::new(0.0, 0.0, 0.5));
        assert_eq!(clip.skeleton.joints[1].tip, Some(Vector3::new(0.0, 0.1, 0.0)));
        assert_eq!((clip.name.as_str(), clip.frames_per_second), ("tiny", 50.0));
    }

    #[test]
    fn spelling_and_line_ends_do_not_matter() {
        let plain = parse(TINY).unwrap();
        let lower = TINY.to_lowercase().replace("hips\n{", "hips{");
        let odd = format!("\u{feff}{}\r\n\r\n", lower.replace('\n', "\r\n").replace("  ", "\t"));
        assert_eq!(parse(&odd).unwrap(), plain);
        assert_eq!(parse(TINY.trim_end()).unwrap(), plain, "no line end at the end of the file");
    }

    // MakeHuman's poses: all joints were in one point
    #[test]
    fn positions_near_zero_are_taken_from_the_offset() {
        let channels = "CHANNELS 6 Xposition Yposition Zposition Yrotation Xrotation Zrotation";
        let text = TINY.replace("CHANNELS 4 Yrotation Xrotation Zrotation Zposition", channels);
        let clip = parse(&text.replace("40 50 60 0.5", "0 0 1e-6 40 50 60")).unwrap();
        assert_relative_eq!(clip.frames[1][1].translation.vector, Vector3::new(0.0, 0.0, 0.7 + 1e-6));
        let clip = parse(&text.replace("40 50 60 0.5", "0 0 0.5 40 50 60")).unwrap();
        assert_relative_eq!(clip.frames[1][1].translation.vector, Vector3::new(0.0, 0.0, 0.5));
        // rows without any joint's place before the motion had landmarks that are no numbers
        let row = "1 2 3 10 20 30 0 0 0.5 40 50 60";
        let lost = text.replacen("40 50 60 0.5", "0 0 0 40 50 60", 1).replace("40 50 60 0.5", "0 0 0.5 40 50 60");
        assert_eq!(parse(&format!("{lost}{row}\n")).unwrap().frames, clip.frames);
    }

    #[test]
    fn a_joint_may_have_a_name_of_two_words() {
        let clip = parse(&TINY.replace("knee", "left  knee")).unwrap();
        assert_eq!(clip.skeleton.find("left knee"), Some(1));
    }

    #[test]
    fn a_broken_file_is_refused_with_its_line() {
        crate::mocap::check_broken("tiny.bvh:", TINY, message);
        assert_eq!(message(""), "tiny.bvh:1: expected `HIERARCHY`, found the end of the file");
    }

    #[test]
    fn a_file_of_too_deep_or_too_many_joints_is_refused() {
        for joint in ["{\nOFFSET 0 0 0\nCHANNELS 0\nJOINT b\n", "JOINT b\n{\nOFFSET 0 0 0\n}\n"] {
            let open = if joint.starts_with('{') { "" } else { "{\nOFFSET 0 0 0\n" };
            let error = message(&format!("HIERARCHY\nROOT a\n{open}{}", joint.repeat(50_000)));
            assert!(error.contains("expected at most 1000 joints"), "{error}");
        }
    }

    #[test]
    fn a_file_cut_short_anywhere_is_refused() {
        // The last value may lose its fractional digits and its line end without a visible error.
        for length in 0..TINY.len() - 3 {
            assert!(parse(&TINY[..length]).is_err(), "{length}");
        }
    }

    const ROW: &str = "1 2 3 10 20 30 40 50 60 0.5\n";

    // Frame times in milliseconds were refused above 10, and below taken for seconds.
    #[test]
    fn frame_times_in_milliseconds_are_refused() {
        for (milliseconds, rate) in [("16.66667", "60.000"), ("8.3333", "120.000"), ("33.367", "29.970")] {
            let text = TINY.replace("0.02", milliseconds);
            let error = message(&text);
            assert!(error.contains(&format!("milliseconds, set `source_hz = {rate}`")), "{error}");
            let options = ReadOptions { frames_per_second: Some(60.0), ..metres_z_up() };
            assert_eq!(parse_bvh(&text, "t", &options).unwrap().frames_per_second, 60.0);
        }
    }

    // QAvimator's lines of key frames after the declared rows were taken for rows.
    #[test]
    fn lines_after_the_last_frame_are_ignored_with_a_note() {
        let clip = parse(&format!("{TINY}2 1 8\n1 0\n\n\u{1a}")).unwrap();
        assert_eq!(clip.frames, parse(TINY).unwrap().frames);
        assert!(clip.notes.iter().any(|note| note.starts_with("the 3 lines after the declared frames, from line 21")));
        let error = message(&format!("{TINY}2 1 8\n{ROW}"));
        assert!(error.starts_with("tiny.bvh:21: expected 10 values"), "a row follows: {error}");
    }

    #[test]
    fn one_frame_is_held_and_none_is_refused() {
        let held = parse(&TINY.replace("Frames: 2", "Frames: 1").replacen(ROW, "", 1)).unwrap();
        assert_eq!((held.frames.len(), held.duration()), (52, 1.02));
        assert!(held.frames.iter().all(|frame| *frame == held.frames[0]));
        assert!(held.notes.iter().any(|note| note.contains("one pose only")), "{:?}", held.notes);
        let none = TINY.replace("Frames: 2", "Frames: 0").replace(ROW, "");
        assert_eq!(message(&none), "tiny.bvh: expected frames with a pose, found 0");
    }

    #[test]
    fn y_up_files_are_rotated_at_the_root_only() {
        let options = ReadOptions { up: Some(UpAxis::Y), ..metres_z_up() };
        let (y_up, z_up) = (parse_bvh(TINY, "t", &options).unwrap(), parse(TINY).unwrap());
        let turn = CoordinateAxis::X.turn(FRAC_PI_2);
        assert_eq!(y_up.frames[0][1], z_up.frames[0][1]);
        assert_eq!(y_up.frames[0][0].translation.vector, Vector3::new(1.0, -3.0, 2.0));
        assert_relative_eq!(y_up.frames[0][0].rotation, turn * z_up.frames[0][0].rotation, epsilon = 1e-15);
    }

    #[test]
    fn options_take_precedence_over_the_file() {
        let options = ReadOptions { metres_per_unit: Some(0.01), frames_per_second: Some(25.0), ..metres_z_up() };
        let clip = parse_bvh(TINY, "t", &options).unwrap();
        assert_eq!(clip.frames_per_second, 25.0);
        assert_relative_eq!(clip.frames[0][1].translation.vector, Vector3::new(0.0, 0.0, 0.005));
        assert_relative_eq!(clip.skeleton.joints[1].tip.unwrap(), Vector3::new(0.0, 0.001, 0.0));
        let wrong = ReadOptions { frames_per_second: Some(0.0), ..metres_z_up() };
        let error = parse_bvh(TINY, "t", &wrong).unwrap_err().to_string();
        assert_eq!(error, "frames_per_second: expected a number from 0.001 to 100000, found 0");
    }
}
