//! The energy of a pose from the keypoints of a 2D detector.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::calibration::CameraCorrection;
use super::descent::{Accumulator, ImageResidual, length_px, robust_weight, slide};
use super::placed_body::PlacedBody;
use super::settings::check_range;
use super::silhouette_likelihood::prior_weight_of_views;
use super::{Likelihood, TrackError};
use crate::motion_model::{NormalEquations, SettingError};
use skiagraph_core::body::{Humanoid, KeypointLayout, LinkFrames, LinkPoint, Pose};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::observation::{FrameKeypoints, Observation};

/// Width of the robust energy of a keypoint, in its deviations: wide enough to lead particles that are a limb's girth
/// away, narrow enough that an exchanged leg costs no more than a missing one.
const ENERGY_WIDTH: f64 = 4.0;
/// Least width of the robust weight in a descent, in deviations.
const DESCENT_WIDTH: f64 = 2.0;
/// Deviation of a sample of an outline, lengths: a keypoint with this deviation weighs as much as a sample.
const OUTLINE_DEVIATION: f64 = 1.0;

/// Frames without an offset that a learned one starts from.
const PRIOR_FRAMES: f64 = 30.0;
/// A greater offset in one frame is an error of the detector or of the estimate, metres.
const MOST_OFFSET_M: f64 = 0.15;
/// Least information about an offset along any axis, square pixels a square metre, for it to be learned: two views.
const LEAST_INFORMATION: f64 = 100.0;

/// How keypoints count as evidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct KeypointEvidenceSettings {
    /// Standard deviation of a keypoint with full confidence in each image coordinate, pixels: the detector's noise
    /// together with the difference between its definition of a point and the body's.
    pub deviation_px: f64,
    /// Keypoints with less confidence are ignored.
    pub least_confidence: f64,
    /// Weight of the keypoints' energy relative to that of the silhouettes.
    pub weight: f64,
}

impl Default for KeypointEvidenceSettings {
    fn default() -> Self {
        Self { deviation_px: 6.0, least_confidence: 0.1, weight: 1.0 }
    }
}

impl KeypointEvidenceSettings {
    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// [`SettingError`] for the first setting out of range.
    pub fn validate(&self) -> Result<(), SettingError> {
        check_range("keypoints.deviation_px", self.deviation_px, 1e-3..=1e4)?;
        check_range("keypoints.least_confidence", self.least_confidence, 0.0..=1.0)?;
        check_range("keypoints.weight", self.weight, 1e-6..=1e6)
    }
}

/// `E = sum c rho(r) / sum c` over the keypoints found in all views, with c the confidence, r the distance in the image
/// between the keypoint and the body's point, and rho Geman and McClure's robust error (`[Geman 1987]`), from 0 to 1.
/// Without any keypoint the energy is 0, because nothing was seen and nothing is missed.
#[derive(Debug)]
pub struct KeypointLikelihood {
    body: Humanoid,
    /// With lenses, placed where they were when the images were taken.
    cameras: Vec<Camera>,
    /// Motion of the scene as each camera sees it, which corrects its given pose.
    corrections: Vec<Isometry3<f64>>,
    layout: KeypointLayout,
    /// The points on the body, moved by what was learned.
    points: Vec<Option<LinkPoint>>,
    /// By point, the number of frames that its offset was learned from.
    learned: Vec<f64>,
    settings: KeypointEvidenceSettings,
    seen: Vec<SeenKeypoint>,
}

/// Scratch buffers of one thread.
#[derive(Default)]
pub struct KeypointScratch {
    placed: PlacedBody,
}

#[derive(Clone, Copy, Debug)]
struct SeenKeypoint {
    view: usize,
    /// Index in the layout.
    index: usize,
    on: LinkPoint,
    /// Without lens distortion.
    pixel: [f64; 2],
    confidence: f64,
}

impl KeypointLikelihood {
    /// The likelihood of poses of `body` for keypoints in this layout, seen by the cameras of `rig`.
    ///
    /// # Errors
    /// [`SettingError`] if a setting is out of its range.
    pub fn new(
        body: Humanoid,
        rig: &CameraRig,
        layout: KeypointLayout,
        settings: KeypointEvidenceSettings,
    ) -> Result<Self, SettingError> {
        settings.validate()?;
        let points: Vec<_> = body.keypoint_places(layout).into_iter().map(|place| Some(place?.point)).collect();
        let (corrections, learned) = (vec![Isometry3::identity(); rig.cameras.len()], vec![0.0; points.len()]);
        let (cameras, seen) = (rig.cameras.clone(), Vec::new());
        Ok(Self { body, cameras, corrections, layout, points, learned, settings, seen })
    }

    /// Corrects the given poses of the cameras: each camera sees the scene moved by its correction.
    pub fn with_corrected_cameras(mut self, corrections: &[CameraCorrection]) -> Self {
        let own = self.cameras.iter_mut().zip(&mut self.corrections);
        for ((camera, motion), correction) in own.zip(corrections) {
            *motion = correction.motion();
            camera.camera_from_world *= *motion;
        }
        self
    }

    /// Weight of the energy relative to that of silhouettes.
    pub(super) fn weight(&self) -> f64 {
        self.settings.weight
    }

    fn counted(&self, observation: &Observation, found: &FrameKeypoints) -> Vec<SeenKeypoint> {
        let views = self.cameras.iter().zip(&found.views).enumerate();
        let of_view = |(view, (camera, points)): (usize, (&Camera, &Vec<_>))| {
            let known = self.points.iter().zip(points).enumerate();
            let counted = |(index, (on, found)): (usize, (&Option<LinkPoint>, &Option<_>))| {
                let found: &skiagraph_core::observation::FoundKeypoint = found.as_ref()?;
                let (x, y) = camera.pinhole.normalised(&found.pixel.into());
                let (x, y) = camera.distortion.undistort(x, y)?;
                let (pixel, confidence) = (camera.pinhole.pixel(x, y).into(), found.confidence);
                let counts = confidence > 0.0 && confidence >= self.settings.least_confidence;
                counts.then_some(SeenKeypoint { view, index, on: (*on)?, pixel, confidence })
            };
            known.filter_map(counted).collect::<Vec<_>>()
        };
        views.filter(|(view, _)| observation.has_image(*view)).flat_map(of_view).collect()
    }

    /// The keypoint's point in its camera's frame, and the offset of its image from the keypoint, pixels; `None` behind
    /// the camera.
    fn offset(&self, frames: &LinkFrames, seen: &SeenKeypoint) -> Option<(Point3<f64>, [f64; 2])> {
        let camera = self.cameras.get(seen.view)?;
        let point = camera.camera_from_world * (frames.0.get(seen.on.link)? * seen.on.point_in_link);
        if point.z < camera.pinhole.near {
            return None;
        }
        let pixel = camera.pinhole.pixel(point.x / point.z, point.y / point.z);
        Some((point, [pixel.x - seen.pixel[0], pixel.y - seen.pixel[1]]))
    }

    fn add_rows(&self, frames: &LinkFrames, width: f64, sums: &mut Accumulator) {
        for seen in &self.seen {
            let (Some((point, offset)), Some(camera)) = (self.offset(frames, seen), self.cameras.get(seen.view)) else {
                continue;
            };
            let length = length_px(camera);
            let deviation = self.settings.deviation_px / length;
            let importance = seen.confidence * (OUTLINE_DEVIATION / deviation).powi(2);
            let distance = offset[0].hypot(offset[1]) / length;
            let weight = importance * robust_weight(distance, width.max(DESCENT_WIDTH * deviation));
            for (value, gradient) in offset.into_iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
                let row = ImageResidual { link: seen.on.link, point, value: value / length, gradient, length, weight };
                sums.add_row(camera, &row);
            }
        }
    }

    /// Learns where the detector places its points on the body: a detector's hip is not the body's. The offset is the
    /// mean over frames, on the link, between the body's point at the estimate and the place that the views agree on.
    pub(super) fn learn_offsets(&mut self, estimate: &Pose) {
        let mut placed = PlacedBody::default();
        let Some(frames) = placed.place(&self.body, estimate) else { return };
        let found: Vec<Option<Vector3<f64>>> =
            (0..self.points.len()).map(|index| self.offset_in_world(frames, index)).collect();
        for ((point, learned), found) in self.points.iter_mut().zip(&mut self.learned).zip(found) {
            let (Some(point), Some(found)) = (point, found) else { continue };
            let Some(frame) = frames.0.get(point.link) else { continue };
            *learned += 1.0;
            point.point_in_link += frame.inverse_transform_vector(&found) / (*learned + PRIOR_FRAMES);
        }
    }

    /// The displacement of a point that explains its keypoints best; `None` if fewer than two views determine it, or it
    /// is too long.
    fn offset_in_world(&self, frames: &LinkFrames, index: usize) -> Option<Vector3<f64>> {
        let (mut matrix, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
        for seen in self.seen.iter().filter(|seen| seen.index == index) {
            let (point, offset) = self.offset(frames, seen)?;
            let camera = self.cameras.get(seen.view)?;
            let distance = offset[0].hypot(offset[1]);
            let weight = seen.confidence * robust_weight(distance, ENERGY_WIDTH * self.settings.deviation_px);
            for (value, gradient_px) in offset.into_iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
                let row = slide(camera, &point, gradient_px, 1.0);
                matrix += weight * row * row.transpose();
                gradient += weight * value * row;
            }
        }
        let is_known = matrix.symmetric_eigenvalues().min() > LEAST_INFORMATION;
        let step = -matrix.try_inverse().filter(|_| is_known)? * gradient;
        (step.norm() <= MOST_OFFSET_M).then_some(step)
    }
}

impl Likelihood for KeypointLikelihood {
    type Scratch = KeypointScratch;

    fn scratch(&self) -> KeypointScratch {
        KeypointScratch::default()
    }

    fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError> {
        let found = fitting(observation, self.layout, self.cameras.len())?;
        if let Some(moment) = &observation.moment {
            let places = moment.camera_from_world.iter().zip(&self.corrections);
            for (camera, (given, correction)) in self.cameras.iter_mut().zip(places) {
                camera.camera_from_world = given * correction;
            }
        }
        self.seen = self.counted(observation, found);
        Ok(())
    }

    fn energy(&self, pose: &Pose, scratch: &mut KeypointScratch) -> f64 {
        let Some(frames) = scratch.placed.place(&self.body, pose) else { return f64::NAN };
        let width = ENERGY_WIDTH * self.settings.deviation_px;
        let (mut sum, mut confidence) = (0.0, 0.0);
        for seen in &self.seen {
            let ratio = self.offset(frames, seen).map(|(_, [u, v])| (u * u + v * v) / (width * width));
            sum += seen.confidence * ratio.map_or(1.0, |square| square / (1.0 + square));
            confidence += seen.confidence;
        }
        if confidence > 0.0 { sum / confidence } else { 0.0 }
    }

    fn descends(&self) -> bool {
        true
    }

    fn linearise(&self, pose: &Pose, width: f64, scratch: &mut KeypointScratch) -> Option<NormalEquations> {
        let frames = scratch.placed.place(&self.body, pose)?;
        let mut sums = Accumulator::new(self.body.links.len(), pose.world_from_root.translation.vector.into());
        self.add_rows(frames, width, &mut sums);
        let sees = |view: &usize| self.seen.iter().any(|seen| seen.view == *view);
        let prior_weight = prior_weight_of_views((0..self.cameras.len()).filter(sees).count());
        Some(NormalEquations { prior_weight, ..sums.finish(&self.body, frames) })
    }
}

/// The keypoints of an observation, which must be of this layout, one list per camera.
pub(super) fn fitting(
    observation: &Observation,
    layout: KeypointLayout,
    cameras: usize,
) -> Result<&FrameKeypoints, TrackError> {
    let mismatch = |detail| TrackError::ObservationMismatch { frame: observation.frame, detail };
    let found = observation.keypoints.as_ref().ok_or_else(|| mismatch("it has no keypoints".to_owned()))?;
    let (given, own, views) = (found.layout.name(), layout.name(), found.views.len());
    if found.layout != layout || views != cameras {
        return Err(mismatch(format!("{given} in {views} views, expected {own} in {cameras}")));
    }
    Ok(found)
}

#[cfg(test)]
mod tests;
