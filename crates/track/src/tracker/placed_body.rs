//! A body in a pose, in memory that its owner keeps from pose to pose.

use nalgebra::Point3;

use crate::body::{Humanoid, LinkFrames, Pose};
use crate::raster::{MeshVertices, TaperedCapsule};

/// A body in a pose.
#[derive(Default)]
pub(super) struct PlacedBody {
    pub(super) frames: LinkFrames,
    /// Its solids in the frame of the camera that it was compared in last, where it was compared by its capsules.
    pub(super) capsules: Vec<TaperedCapsule>,
    /// The vertices of its skin, where it was compared by that; world.
    pub(super) skin: MeshVertices,
    vertices: Vec<Point3<f64>>,
}

impl PlacedBody {
    /// Puts `body` into `pose`: where its links then are; `None` for a pose that is not finite.
    pub(super) fn place(&mut self, body: &Humanoid, pose: &Pose) -> Option<&LinkFrames> {
        let root = pose.world_from_root.translation.vector;
        if !root.iter().chain(&pose.joint_angles).all(|number| number.is_finite()) {
            return None;
        }
        body.link_frames_into(pose, &mut self.frames);
        Some(&self.frames)
    }

    /// Deforms the skin to where the links are; without a skin nothing happens.
    pub(super) fn deform(&mut self, body: &Humanoid) {
        if let Some(skin) = &body.skin {
            skin.deform_into(&self.frames, &mut self.vertices);
            self.skin.replace(&self.vertices);
        }
    }
}
