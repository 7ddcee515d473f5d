//! `[observation.keypoints]`: layout of the keypoints and errors of their detector.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::KeypointLayout;

/// Layout of the keypoints and strength of the detector's errors by axis; zero changes nothing. For the formulas, see
/// `scenarios/README.md` and `KEYPOINT_AXES`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeypointSettings {
    /// Which points in which order: `"coco17"`, `"halpe26"` or `"body25"`.
    pub layout: KeypointLayout,
    /// Standard deviation of the slow error in each image coordinate, % of the person's height in the image.
    /// Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slow_percent: f64,
    /// Correlation time of the slow error, seconds.
    #[serde(default = "usual_slow_s", skip_serializing_if = "is_usual_slow_s")]
    pub slow_s: f64,
    /// Standard deviation of the error that is new in every frame, in each image coordinate, % of the person's height
    /// in the image. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub white_percent: f64,
    /// Share of time in which a point has a gross error. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub gross: f64,
    /// Scale of gross errors, % of the person's height in the image.
    #[serde(default = "usual_gross_percent", skip_serializing_if = "is_usual_gross_percent")]
    pub gross_percent: f64,
    /// Share of time in which a point is missed. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub missing: f64,
    /// Share of time in which left and right of the arms, of the legs, or of the face are exchanged. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub inversion: f64,
    /// Share of time in which all points of an image are those of another person, a distractor. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub other_person: f64,
    /// Mean length of stretches of gross errors, misses and exchanges, seconds; 0 draws every frame anew.
    #[serde(default = "usual_stretch_s", skip_serializing_if = "is_usual_stretch_s")]
    pub stretch_s: f64,
    /// Standard deviation of the offset between a detector's definition of a point and ours, in each axis of the body,
    /// millimetres. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub bias_mm: f64,
    /// Additional error of hidden points: slow, white and gross errors are multiplied by 1 plus this. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub occluded_error: f64,
    /// Additional rate of faults of hidden points: the shares of gross errors, misses and exchanges are multiplied by 1
    /// plus this. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub occluded_rate: f64,
    /// Noise of the confidence: its standard deviation as a share of the greatest possible. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub confidence_noise: f64,
}

fn is_zero(strength: &f64) -> bool {
    *strength == 0.0
}

fn usual_slow_s() -> f64 {
    0.5
}

fn usual_gross_percent() -> f64 {
    5.0
}

fn usual_stretch_s() -> f64 {
    0.2
}

fn is_usual_slow_s(value: &f64) -> bool {
    *value == usual_slow_s()
}

fn is_usual_gross_percent(value: &f64) -> bool {
    *value == usual_gross_percent()
}

fn is_usual_stretch_s(value: &f64) -> bool {
    *value == usual_stretch_s()
}

impl KeypointSettings {
    /// Exact keypoints of a layout.
    pub fn exact(layout: KeypointLayout) -> Self {
        Self {
            layout,
            slow_percent: 0.0,
            slow_s: usual_slow_s(),
            white_percent: 0.0,
            gross: 0.0,
            gross_percent: usual_gross_percent(),
            missing: 0.0,
            inversion: 0.0,
            other_person: 0.0,
            stretch_s: usual_stretch_s(),
            bias_mm: 0.0,
            occluded_error: 0.0,
            occluded_rate: 0.0,
            confidence_noise: 0.0,
        }
    }

    /// Whether any error is drawn.
    pub fn is_drawn(&self) -> bool {
        let offsets = [self.slow_percent, self.white_percent, self.gross, self.bias_mm];
        let mistakes = [self.missing, self.inversion, self.other_person];
        offsets.iter().chain(&mistakes).any(|strength| *strength != 0.0)
    }
}
