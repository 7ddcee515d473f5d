//! The input of a tracker for one frame: an [`Observation`], one silhouette per camera, and keypoints if the set has any.

use std::borrow::Cow;

use crate::body::KeypointLayout;
use crate::camera::{CameraRig, RigMoment};
use crate::raster::Mask;

/// The images of all cameras of a rig at one time. A tracker receives only these, the cameras, a body and a start
/// pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Frame number, from 0.
    pub frame: usize,
    /// Seconds from frame 0.
    pub time_s: f64,
    /// One silhouette per camera in the rig's order, in the camera's own (distorted) pixels; empty for a camera
    /// without a new image.
    pub silhouettes: Vec<Mask>,
    /// Positions of the cameras and exposure times of their images; `None` if all cameras are static and took an image
    /// at this time.
    pub moment: Option<RigMoment>,
    /// What a 2D detector found in the images, if the set has keypoints.
    pub keypoints: Option<FrameKeypoints>,
}

/// The keypoints that a detector found in the images of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameKeypoints {
    /// Which points, in which order.
    pub layout: KeypointLayout,
    /// By camera in the rig's order, then by point of the layout; `None` for a point that was not found.
    pub views: Vec<Vec<Option<FoundKeypoint>>>,
}

/// A keypoint in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundKeypoint {
    /// Position in the camera's own (distorted) pixels, from the outer corner of the top-left pixel.
    pub pixel: [f64; 2],
    /// From 0 to 1.
    pub confidence: f64,
}

impl Observation {
    /// Whether a camera took an image for this frame.
    pub fn has_image(&self, camera: usize) -> bool {
        let exposed = self.moment.as_ref().and_then(|moment| moment.exposed_s.get(camera));
        exposed.is_none_or(Option::is_some)
    }

    /// The cameras of `rig` at this moment.
    pub fn rig<'r>(&self, rig: &'r CameraRig) -> Cow<'r, CameraRig> {
        match &self.moment {
            None => Cow::Borrowed(rig),
            Some(moment) => Cow::Owned(rig.at(moment)),
        }
    }
}
