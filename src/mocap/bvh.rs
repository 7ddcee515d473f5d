//! BVH: a tree of joints with channels, then one row of channel values a frame.
//!
//! Grammar and meaning as Biovision's files have them: `parent_from_joint` is the position channels (or `OFFSET` where a
//! joint has none) and the product of the rotation channels in the order in which they are listed, degrees. Keywords
//! may be in any case; every joint may list any channels in any order. A joint's position channels replace its `OFFSET`.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::read::{ReadOptions, clip_name};
use super::recording::{GREATEST_RATE, MOST_JOINT_FRAMES, Recording, rate_from_frame_time};
use super::rotation::Axis;
use super::text_cursor::{TextCursor, finite_number};
use super::{Clip, MocapError, Skeleton, SkeletonJoint};

/// Reads a BVH file's text; `file` is its name, for messages and the clip's name.
///
/// The number of rows must be the one that the header promises: fewer is a file cut short, more a header that lies.
pub fn parse_bvh(text: &str, file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    // A brace may touch its neighbours; lines keep their numbers.
    let text = text.replace('{', " { ").replace('}', " } ");
    let mut cursor = TextCursor::new(&text, file);
    let hierarchy = parse_hierarchy(&mut cursor)?;
    parse_motion(&mut cursor, hierarchy, file, options)?.into_clip(file, options)
}

#[derive(Clone, Copy, PartialEq)]
enum Channel {
    Position(Axis),
    Rotation(Axis),
}

impl Channel {
    fn from_name(name: &str) -> Option<Self> {
        let mut letters = name.chars();
        let axis = Axis::from_letter(letters.next()?)?;
        match letters.as_str().to_ascii_lowercase().as_str() {
            "position" => Some(Self::Position(axis)),
            "rotation" => Some(Self::Rotation(axis)),
            _ => None,
        }
    }
}

#[derive(Default)]
struct Hierarchy {
    skeleton: Skeleton,
    offsets: Vec<Vector3<f64>>,
    channels: Vec<Vec<Channel>>,
}

/// A brace that was opened.
enum Open {
    Joint { index: usize, has_offset: bool },
    EndSite { parent: usize },
}

fn parse_hierarchy(cursor: &mut TextCursor<'_>) -> Result<Hierarchy, MocapError> {
    cursor.keyword("HIERARCHY")?;
    cursor.keyword("ROOT")?;
    let mut hierarchy = Hierarchy::default();
    let mut open = vec![open_joint(cursor, &mut hierarchy, None)?];
    while let Some(innermost) = open.last_mut() {
        match innermost {
            Open::Joint { index, has_offset } => {
                let expected = "OFFSET, CHANNELS, JOINT, End Site or `}`";
                let word = cursor.word(expected)?;
                let index = *index;
                match word.to_ascii_uppercase().as_str() {
                    "OFFSET" => {
                        hierarchy.offsets[index] = cursor.vector_in_line("an offset")?;
                        *has_offset = true;
                    }
                    "CHANNELS" => hierarchy.channels[index] = parse_channels(cursor)?,
                    "JOINT" => open.push(open_joint(cursor, &mut hierarchy, Some(index))?),
                    "END" => {
                        name_and_brace(cursor)?;
                        open.push(Open::EndSite { parent: index });
                    }
                    "}" if *has_offset => drop(open.pop()),
                    "}" => return Err(cursor.unexpected("the joint's OFFSET", Some(word))),
                    _ => return Err(cursor.unexpected(expected, Some(word))),
                }
            }
            Open::EndSite { parent } => {
                cursor.keyword("OFFSET")?;
                let tip = cursor.vector_in_line("an offset")?;
                hierarchy.skeleton.joints[*parent].tip.get_or_insert(tip);
                cursor.keyword("}")?;
                open.pop();
            }
        }
    }
    if hierarchy.channels.iter().all(Vec::is_empty) {
        return Err(cursor.error("a joint with CHANNELS", "a skeleton without any"));
    }
    Ok(hierarchy)
}

/// Reads a joint's name and opening brace, and adds the joint.
fn open_joint(
    cursor: &mut TextCursor<'_>,
    hierarchy: &mut Hierarchy,
    parent: Option<usize>,
) -> Result<Open, MocapError> {
    let name = name_and_brace(cursor)?;
    if name.is_empty() {
        return Err(cursor.error("a joint's name", "none"));
    }
    let index = hierarchy.skeleton.joints.len();
    hierarchy.skeleton.joints.push(SkeletonJoint { name, parent, tip: None });
    hierarchy.offsets.push(Vector3::zeros());
    hierarchy.channels.push(Vec::new());
    Ok(Open::Joint { index, has_offset: false })
}

/// The words up to the opening brace, which may stand on this line or the next.
fn name_and_brace(cursor: &mut TextCursor<'_>) -> Result<String, MocapError> {
    let mut words = Vec::new();
    while let Some(word) = cursor.word_in_line() {
        if word == "{" {
            return Ok(words.join(" "));
        }
        words.push(word);
    }
    cursor.keyword("{")?;
    Ok(words.join(" "))
}

fn parse_channels(cursor: &mut TextCursor<'_>) -> Result<Vec<Channel>, MocapError> {
    let expected = "a number of channels from 0 to 6";
    let word = cursor.word_in_line();
    let Some(count) = word.and_then(|w| w.parse::<usize>().ok()).filter(|&count| count <= 6) else {
        return Err(cursor.unexpected(expected, word));
    };
    let mut channels = Vec::with_capacity(count);
    for _ in 0..count {
        let expected = "a channel (Xposition … Zrotation) not listed yet";
        let word = cursor.word_in_line();
        match word.and_then(Channel::from_name).filter(|channel| !channels.contains(channel)) {
            Some(channel) => channels.push(channel),
            None => return Err(cursor.unexpected(expected, word)),
        }
    }
    if let Some(extra) = cursor.word_in_line() {
        return Err(cursor.unexpected(&format!("{count} channels as announced"), Some(extra)));
    }
    Ok(channels)
}

fn parse_motion(
    cursor: &mut TextCursor<'_>,
    hierarchy: Hierarchy,
    file: &str,
    options: &ReadOptions,
) -> Result<Recording, MocapError> {
    let mut notes = Vec::new();
    cursor.keyword("MOTION")?;
    cursor.keyword("Frames:")?;
    let word = cursor.word_in_line();
    let Some(announced) = word.and_then(|w| w.parse::<u64>().ok()) else {
        return Err(cursor.unexpected("the number of frames", word));
    };
    cursor.keyword("Frame")?;
    cursor.keyword("Time:")?;
    let word = cursor.word_in_line();
    let shortest = 1.0 / GREATEST_RATE;
    let Some(frame_time) = word.and_then(finite_number).filter(|seconds| (shortest..=1e3).contains(seconds)) else {
        return Err(cursor.unexpected("the seconds between two frames, > 0", word));
    };
    let frames_per_second = options.frames_per_second.unwrap_or_else(|| rate_from_frame_time(frame_time, &mut notes));
    let (frames, empty_frames) = parse_rows(cursor, &hierarchy, announced)?;
    let Hierarchy { skeleton, offsets, .. } = hierarchy;
    let clip = Clip { name: clip_name(file), skeleton, frames_per_second, frames, notes, cyclic: false };
    Ok(Recording { clip, rest_offsets: offsets, empty_frames, metres_per_unit: None, up: None })
}

type Frames = Vec<Vec<Isometry3<f64>>>;

/// The rows as frames, and the indices of those that are all zero.
fn parse_rows(
    cursor: &mut TextCursor<'_>,
    hierarchy: &Hierarchy,
    announced: u64,
) -> Result<(Frames, Vec<usize>), MocapError> {
    let width: usize = hierarchy.channels.iter().map(Vec::len).sum();
    let joints = hierarchy.channels.len();
    let mut frames = Frames::new();
    let mut empty_frames = Vec::new();
    let mut row = Vec::with_capacity(width);
    while cursor.next_line().is_some() {
        if frames.len() as u64 == announced {
            let expected = format!("the end of the file after the {announced} frames that the header announces");
            return Err(cursor.error(expected, "another row"));
        }
        if (frames.len() + 1) * joints > MOST_JOINT_FRAMES {
            return Err(cursor.error(format!("at most {MOST_JOINT_FRAMES} joints times frames"), "more"));
        }
        row.clear();
        for index in 0..width {
            row.push(cursor.number_in_line(&format!("value {} of {width}", index + 1))?);
        }
        if let Some(extra) = cursor.word_in_line() {
            return Err(cursor.unexpected(&format!("{width} values, one for each channel"), Some(extra)));
        }
        if row.iter().all(|&value| value == 0.0) {
            empty_frames.push(frames.len());
        }
        frames.push(pose(hierarchy, &row));
    }
    if frames.len() as u64 != announced {
        let expected = format!("{announced} frames as the header announces");
        return Err(cursor.error(expected, format!("the end of the file after {}", frames.len())));
    }
    Ok((frames, empty_frames))
}

/// Every joint's `parent_from_joint` for one row of as many values as there are channels.
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
