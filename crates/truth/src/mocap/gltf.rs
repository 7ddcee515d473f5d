//! Animations of glTF files, VRM's among them.

use super::clip::clip_name;
use super::options::{ReadOptions, UpAxis};
use super::points::malformed;
use super::recording::{MAX_JOINT_FRAMES, MAX_JOINTS, ParsedRecording};
use super::{Clip, MocapError, Skeleton, SkeletonJoint};
use skiagraph_core::body::{MotionChoice, SkinError, gltf_motion};

/// Heights of bodies in metres, standing.
const HEIGHTS: std::ops::RangeInclusive<f64> = 0.5..=3.0;

/// Parses the bytes of a glTF file with an animation, whose name is `subject` if there are several; `file` is its name,
/// `read` returns the contents of referenced files.
pub fn parse_gltf(
    bytes: &[u8],
    file: &str,
    options: &ReadOptions,
    read: &dyn Fn(&str) -> Result<Vec<u8>, SkinError>,
) -> Result<Clip, MocapError> {
    options.check()?;
    let choice = MotionChoice {
        name: options.subject.as_deref(),
        rate: options.frames_per_second,
        most_joint_frames: MAX_JOINT_FRAMES,
    };
    let motion = gltf_motion(file, bytes, &choice, read).map_err(|error| match error {
        SkinError::Malformed { detail, .. } => malformed(file, detail),
        other => malformed(file, other.to_string()),
    })?;
    if motion.names.len() > MAX_JOINTS {
        return Err(malformed(file, format!("{} joints; expected at most {MAX_JOINTS}", motion.names.len())));
    }
    let joints = motion.names.into_iter().zip(motion.parents);
    let clip = Clip {
        name: clip_name(file),
        skeleton: Skeleton { joints: joints.map(|(name, parent)| SkeletonJoint { name, parent, tip: None }).collect() },
        frames_per_second: motion.frames_per_second,
        frames: motion.frames,
        notes: motion.notes,
        ..Clip::default()
    };
    // glTF has metres, but many files have centimetres: then the unit is guessed
    let mut heights: Vec<f64> = Vec::new();
    for (joint, offset) in clip.skeleton.joints.iter().zip(&motion.rest_offsets) {
        heights.push(offset.y + joint.parent.map_or(0.0, |parent| heights[parent]));
    }
    let height = heights.iter().fold(f64::MIN, |a, b| a.max(*b)) - heights.iter().fold(f64::MAX, |a, b| a.min(*b));
    let parsed = ParsedRecording {
        clip,
        rest_offsets: motion.rest_offsets,
        empty_frames: Vec::new(),
        metres_per_unit: HEIGHTS.contains(&height).then_some(1.0),
        up: Some(UpAxis::Y),
    };
    parsed.into_clip(file, options)
}
