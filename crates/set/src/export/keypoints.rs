//! The keypoints of a set, as the pipelines that are exported to read them. Blind side only.

use crate::npz::Npz;
use crate::{BenchmarkSet, SetError};

const PATH: &str = "observations/keypoints.npz";
/// The keypoint layouts, by their number of points, as Pose2Sim calls them.
const MODELS: [(usize, &str); 3] = [(17, "COCO_17"), (25, "BODY_25"), (26, "HALPE_26")];

/// The keypoints of every frame and camera.
pub(super) struct SetKeypoints {
    pub(super) names: Vec<String>,
    /// Pose2Sim's name of the layout.
    pub(super) model: &'static str,
    cameras: usize,
    /// x, y by frame, camera and keypoint; pixels, (0, 0) is the centre of the top-left pixel; NaN if missing.
    pub(super) places: Vec<f64>,
    pub(super) confidence: Vec<f64>,
}

impl SetKeypoints {
    /// Reads the keypoints of a set for an export to `format`.
    pub(super) fn read(set: &BenchmarkSet, format: &str) -> Result<Self, SetError> {
        let files = set.blind.files();
        if !files.has(PATH) {
            let detail = "needs keypoints, which this set lacks: render it with a table [observation.keypoints]";
            return Err(SetError::malformed(format, detail));
        }
        let npz = Npz::from_bytes(PATH, &files.read(PATH).map_err(|e| files.locate(e))?)?;
        let names = npz.names(PATH, "keypoint_names")?.unwrap_or_default().to_vec();
        let model = MODELS.iter().find(|(count, _)| *count == names.len()).map(|(_, model)| *model);
        let model = model.ok_or_else(|| {
            let detail = format!("keypoint_names: expected 17, 25 or 26 names, found {}", names.len());
            SetError::malformed(PATH, detail)
        })?;
        let (frames, cameras) = (set.blind.frame_count, set.blind.rig.cameras.len());
        let shape = [Some(frames), Some(cameras), Some(names.len())];
        let confidence = npz.numbers(PATH, "confidence", &shape)?;
        let places = npz.numbers(PATH, "keypoints", &[shape.as_slice(), &[Some(2)]].concat())?;
        Ok(Self { names, model, cameras, places, confidence })
    }

    /// x, y and confidence of every keypoint of an image; `None` if it is missing.
    pub(super) fn in_image(&self, frame: usize, camera: usize) -> impl Iterator<Item = Option<[f32; 3]>> {
        let count = self.names.len();
        let first = (frame * self.cameras + camera) * count;
        let places = self.places.as_chunks::<2>().0.iter().skip(first).take(count);
        let confidence = self.confidence.iter().skip(first);
        places.zip(confidence).map(|([x, y], confidence)| {
            let all = [*x, *y, *confidence].map(|number| number as f32);
            all.iter().all(|number| number.is_finite()).then_some(all)
        })
    }
}
