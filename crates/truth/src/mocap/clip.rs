//! A recording: a skeleton, and one rigid transform per joint and frame.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};

use super::options::{UpAxis, UpSource};
use super::rotation::make_signs_continuous;

/// One joint of a recorded skeleton. The origin of its frame is the centre of rotation (an Acclaim bone's *start*, a
/// BVH joint).
#[derive(Clone, Debug, PartialEq)]
pub struct SkeletonJoint {
    /// Name, spelled as in the file.
    pub name: String,
    /// Index of the parent, always smaller than this joint's index; `None` for the root.
    pub parent: Option<usize>,
    /// The end of the bone in this joint's frame, for leaves (BVH `End Site`, end of an Acclaim bone); metres.
    pub tip: Option<Vector3<f64>>,
}

/// The joints of a recording, parents first; joint 0 is the root.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skeleton {
    /// All joints.
    pub joints: Vec<SkeletonJoint>,
}

/// A recording of at least one frame. Metres, world Z up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clip {
    /// Display name, usually the file's stem.
    pub name: String,
    /// The skeleton, the same in every frame.
    pub skeleton: Skeleton,
    /// Frames per second, > 0.
    pub frames_per_second: f64,
    /// Per frame and joint: `parent_from_joint` (`world_from_joint` for the root). If all rotations except the root's
    /// are the identity, the skeleton is in the file's rest pose, in every format.
    pub frames: Vec<Vec<Isometry3<f64>>>,
    /// Notes: guessed units, interpolated dropout frames, differences between header and rows.
    pub notes: Vec<String>,
    /// Whether the recording is one cycle of a repeating motion (DeepMimic's `Loop: wrap`). The last frame then equals
    /// the first frame one cycle later, up to a displacement on the ground and a small misfit.
    pub cyclic: bool,
    /// The file's axis that is Z here, and who says that it points up.
    pub up: (UpAxis, UpSource),
}

impl Skeleton {
    /// Index of the joint with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }

    /// `world_from_joint` of every joint for one frame's `parent_from_joint`.
    pub fn joint_frames(&self, frame: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(frame.len());
        for (joint, parent_from_joint) in self.joints.iter().zip(frame) {
            world.push(joint.parent.map_or(*parent_from_joint, |p| world[p] * parent_from_joint));
        }
        world
    }
}

impl Clip {
    /// The clip with another axis of the file as Z.
    #[must_use]
    pub fn with_up(mut self, axis: UpAxis, source: UpSource) -> Self {
        let turn = axis.turn() * self.up.0.turn().inverse();
        for root in self.frames.iter_mut().filter_map(|frame| frame.first_mut()) {
            *root = turn * *root;
        }
        make_signs_continuous(&mut self.frames);
        self.up = (axis, source);
        self
    }

    /// Time from the first frame to the last, seconds.
    pub fn duration(&self) -> f64 {
        self.frames.len().saturating_sub(1) as f64 / self.frames_per_second
    }

    /// `world_from_joint` of every joint at frame `frame`.
    pub fn joint_frames(&self, frame: usize) -> Vec<Isometry3<f64>> {
        self.skeleton.joint_frames(&self.frames[frame])
    }

    /// World position of every joint at frame `frame`, metres.
    pub fn joint_positions(&self, frame: usize) -> Vec<Point3<f64>> {
        self.joint_frames(frame).iter().map(|f| f.translation.vector.into()).collect()
    }
}

/// Display name: the file stem.
pub(super) fn clip_name(file: &str) -> String {
    Path::new(file).file_stem().map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned())
}
