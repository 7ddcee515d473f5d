//! The first part of a BVH file: nested joints with their offsets and channels.

use nalgebra::Vector3;

use super::recording::MAX_JOINTS;
use super::rotation::CoordinateAxis;
use super::text_cursor::TextCursor;
use super::{MocapError, Skeleton, SkeletonJoint};

/// The meaning of one number of a row.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Channel {
    Position(CoordinateAxis),
    Rotation(CoordinateAxis),
}

impl Channel {
    fn from_name(name: &str) -> Option<Self> {
        let mut letters = name.chars();
        let axis = CoordinateAxis::from_letter(letters.next()?)?;
        match letters.as_str().to_ascii_lowercase().as_str() {
            "position" => Some(Self::Position(axis)),
            "rotation" => Some(Self::Rotation(axis)),
            _ => None,
        }
    }
}

/// The tree of joints of a BVH file.
#[derive(Default)]
pub(super) struct Hierarchy {
    pub(super) skeleton: Skeleton,
    /// Per joint, offset from its parent, file units.
    pub(super) offsets: Vec<Vector3<f64>>,
    /// Per joint, in file order.
    pub(super) channels: Vec<Vec<Channel>>,
}

/// An open brace.
enum Open {
    Joint { index: usize, has_offset: bool },
    EndSite { parent: usize },
}

/// Parses up to the closing brace of the root.
pub(super) fn parse_hierarchy(cursor: &mut TextCursor<'_>) -> Result<Hierarchy, MocapError> {
    cursor.keyword("HIERARCHY")?;
    cursor.set_recognised();
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
        return Err(cursor.error("a joint with CHANNELS", "none"));
    }
    Ok(hierarchy)
}

/// Parses a joint's name and opening brace, and adds the joint.
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
    if index == MAX_JOINTS {
        return Err(cursor.error(format!("at most {MAX_JOINTS} joints"), "more"));
    }
    hierarchy.skeleton.joints.push(SkeletonJoint { name, parent, tip: None });
    hierarchy.offsets.push(Vector3::zeros());
    hierarchy.channels.push(Vec::new());
    Ok(Open::Joint { index, has_offset: false })
}

/// The words up to the opening brace, which may be on this line or the next.
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
        return Err(cursor.unexpected(&format!("{count} channels, as declared"), Some(extra)));
    }
    Ok(channels)
}
