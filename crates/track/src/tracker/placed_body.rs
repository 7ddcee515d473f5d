//! A body in a pose, with buffers that are reused from pose to pose.

use nalgebra::Point3;

use skiagraph_core::body::{Humanoid, LinkFrames, Pose};
use skiagraph_core::raster::{MeshVertices, TaperedCapsule};

#[derive(Default)]
pub(super) struct PlacedBody {
    pub(super) frames: LinkFrames,
    /// The solids in the frame of the last camera compared, if the body is compared by its capsules.
    pub(super) capsules: Vec<TaperedCapsule>,
    /// The skin's vertices in world coordinates, if the body is compared by its skin.
    pub(super) skin: MeshVertices,
    vertices: Vec<Point3<f64>>,
}

impl PlacedBody {
    /// Puts `body` into `pose` and returns its link frames; `None` for a pose that is not finite.
    pub(super) fn place(&mut self, body: &Humanoid, pose: &Pose) -> Option<&LinkFrames> {
        let root = pose.world_from_root.translation.vector;
        if !root.iter().chain(&pose.joint_angles).all(|number| number.is_finite()) {
            return None;
        }
        body.link_frames_into(pose, &mut self.frames);
        Some(&self.frames)
    }

    /// Deforms the skin to the current link frames; does nothing without a skin.
    pub(super) fn deform(&mut self, body: &Humanoid) {
        if let Some(skin) = &body.skin {
            skin.deform_into(&self.frames, &mut self.vertices);
            self.skin.replace(&self.vertices);
        }
    }
}
