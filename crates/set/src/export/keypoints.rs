//! The keypoints of a set, as the pipelines that are exported to read them. Blind side only.

use std::sync::Arc;

use nalgebra::Point2;

use crate::{BlindSet, SetError, SetKeypoints};
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::Camera;
use skiagraph_core::observation::FoundKeypoint;

pub(super) struct ExportedKeypoints {
    found: Arc<SetKeypoints>,
    /// The cameras whose lenses are taken out; none if the points stay where the images have them.
    undistorted: Vec<Camera>,
}

impl ExportedKeypoints {
    /// The keypoints of a set for an export to `format`.
    pub(super) fn of(set: &BlindSet, format: &str) -> Result<Self, SetError> {
        let detail = "needs keypoints, which this set lacks: render it with a table [observation.keypoints]";
        let found = set.keypoints.clone().ok_or_else(|| SetError::malformed(format, detail))?;
        Ok(Self { found, undistorted: Vec::new() })
    }

    /// The points where ideal cameras with the same intrinsics would have them.
    pub(super) fn undistorted(self, cameras: &[Camera]) -> Self {
        Self { undistorted: cameras.to_vec(), ..self }
    }

    /// Pose2Sim's name of the layout.
    pub(super) fn model(&self) -> &'static str {
        match self.found.layout {
            KeypointLayout::Coco17 => "COCO_17",
            KeypointLayout::Body25 => "BODY_25",
            KeypointLayout::Halpe26 => "HALPE_26",
        }
    }

    pub(super) fn names(&self) -> Vec<&'static str> {
        self.found.layout.keypoints().iter().map(|point| point.name()).collect()
    }

    /// x, y and confidence of every keypoint by camera; pixels, (0, 0) is the centre of the top-left pixel; `None` if a
    /// point is missing, or undistorted where the lens has no inverse.
    pub(super) fn in_images(&self, frame: usize) -> Vec<Vec<Option<[f32; 3]>>> {
        let mut images = Vec::new();
        for (camera, view) in self.found.frame(frame).views.into_iter().enumerate() {
            let lens = self.undistorted.get(camera).filter(|camera| !camera.distortion.is_none());
            images.push(view.into_iter().map(|found| point(found?, lens)).collect());
        }
        images
    }
}

/// x, y and confidence of a keypoint, without the lens of `undistorted`.
fn point(found: FoundKeypoint, undistorted: Option<&Camera>) -> Option<[f32; 3]> {
    let mut pixel = Point2::from(found.pixel);
    if let Some(Camera { pinhole, distortion, .. }) = undistorted {
        let (x, y) = pinhole.normalised(&pixel);
        let (x, y) = distortion.undistort(x, y)?;
        pixel = pinhole.pixel(x, y);
    }
    Some([pixel.x - 0.5, pixel.y - 0.5, found.confidence].map(|number| number as f32))
}
