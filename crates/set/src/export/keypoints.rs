//! The keypoints of a set, as the pipelines that are exported to read them. Blind side only.

use std::sync::Arc;

use crate::body::KeypointLayout;
use crate::observation::FoundKeypoint;
use crate::{BlindSet, SetError, SetKeypoints};

/// The keypoints of every frame and camera.
pub(super) struct ExportedKeypoints(Arc<SetKeypoints>);

impl ExportedKeypoints {
    /// The keypoints of a set for an export to `format`.
    pub(super) fn of(set: &BlindSet, format: &str) -> Result<Self, SetError> {
        let detail = "needs keypoints, which this set lacks: render it with a table [observation.keypoints]";
        set.keypoints.clone().map(Self).ok_or_else(|| SetError::malformed(format, detail))
    }

    /// Pose2Sim's name of the layout.
    pub(super) fn model(&self) -> &'static str {
        match self.0.layout {
            KeypointLayout::Coco17 => "COCO_17",
            KeypointLayout::Body25 => "BODY_25",
            KeypointLayout::Halpe26 => "HALPE_26",
        }
    }

    /// The names of the points.
    pub(super) fn names(&self) -> Vec<&'static str> {
        self.0.layout.keypoints().iter().map(|point| point.name()).collect()
    }

    /// x, y and confidence of every keypoint by camera; pixels, (0, 0) is the centre of the top-left pixel; `None` if a
    /// point is missing.
    pub(super) fn in_images(&self, frame: usize) -> Vec<Vec<Option<[f32; 3]>>> {
        let point = |found: FoundKeypoint| {
            let [x, y] = found.pixel.map(|pixel| pixel - 0.5);
            [x, y, found.confidence].map(|number| number as f32)
        };
        let views = self.0.frame(frame).views.into_iter();
        views.map(|view| view.into_iter().map(|found| found.map(point)).collect()).collect()
    }
}
