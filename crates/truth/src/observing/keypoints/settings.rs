//! `[observation.keypoints]`: layout of the keypoints and errors of their detector.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::observing::settings::is_default as is_zero;
use skiagraph_core::body::KeypointLayout;

/// Keypoints of a 2D detector in addition to the silhouettes, in `observations/keypoints.npz`. Their truth, and what
/// was drawn, is in `truth/keypoints.npz` (`docs/sets.md#keypoints`). Without further keys they are exact. Exposure
/// times and lost images are those of the silhouettes. In the formulas, *s* is the value of the key. *h* is the height
/// in the image, in pixels, of a person who stands upright where the point is: focal length x stature / depth. *w* is
/// the deviation of COCO's annotations of the point divided by its mean over COCO's 17 points. That deviation is 0.025
/// for an eye and 0.107 for a hip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeypointSettings {
    /// Which points, in which order.
    pub layout: KeypointLayout,
    /// Both image coordinates are off by a stationary normal process with standard deviation s w h / 100. Its
    /// correlation is exp(-dt / `slow_s`). Mild to severe: 0.25, 0.5, 1, 2, 4. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slow_percent: f64,
    /// Correlation time of the slow error, seconds. Mild to severe: 0.05, 0.15, 0.5, 1.5, 5. Default: 0.5.
    #[serde(default = "usual_slow_s", skip_serializing_if = "is_usual_slow_s")]
    pub slow_s: f64,
    /// Both image coordinates are off by a normal deviate with standard deviation s w h / 100, new in every frame. Mild
    /// to severe: 0.1, 0.2, 0.5, 1, 2. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub white_percent: f64,
    /// In a share s of the time, in stretches, the point is off by an offset drawn at the start of the stretch. It has
    /// a round Student t distribution with 3 degrees of freedom and the scale `gross_percent`. Mild to severe: 0.01,
    /// 0.02, 0.05, 0.1, 0.2. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub gross: f64,
    /// The scale of gross errors in each image coordinate is s h / 100. Mild to severe: 2, 5, 10, 15, 25. Default: 5.
    #[serde(default = "usual_gross_percent", skip_serializing_if = "is_usual_gross_percent")]
    pub gross_percent: f64,
    /// In a share s of the time, in stretches, the point is missed. Mild to severe: 0.02, 0.05, 0.1, 0.2, 0.4. Default:
    /// 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub missing: f64,
    /// In a share 2 s a^2 of the time, in stretches, left and right are exchanged: of the arms, of the legs, and of the
    /// face, independently. a is the cosine of the angle between the line of the hips and the line of sight: 0 from in
    /// front, 1 in profile. A turning body has a share s in the mean. Mild to severe: 0.005, 0.01, 0.02, 0.05, 0.1.
    /// Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub inversion: f64,
    /// In a share s of the time, in stretches, all points found in an image are those of the nearest distractor there.
    /// They are missing if none is in the image. Needs a `[[distractor]]`. Mild to severe: 0.01, 0.02, 0.05, 0.1, 0.2.
    /// Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub other_person: f64,
    /// Mean length of stretches of gross errors, misses, exchanges and points of another person, seconds. They begin
    /// and end at random: Markov chains in continuous time, seen at the frames. 0 draws every frame anew. Mild to
    /// severe: 0.05, 0.1, 0.2, 0.5, 1. Default: 0.2.
    #[serde(default = "usual_stretch_s", skip_serializing_if = "is_usual_stretch_s")]
    pub stretch_s: f64,
    /// Every point is moved on its link by a vector that is drawn once per set, the same for all cameras. Its
    /// coordinates forward, left and up at the standing pose are normal with standard deviation s w, millimetres. Left
    /// and right mirror each other, and points in the middle stay there. Mild to severe: 5, 10, 15, 20, 30. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub bias_mm: f64,
    /// Slow, white and gross errors of a hidden point are multiplied by 1 + s. Mild to severe: 0.25, 0.5, 1, 2, 4.
    /// Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub occluded_error: f64,
    /// `gross` and `missing` of a hidden point, and `inversion` of parts with a hidden point, are multiplied by 1 + s,
    /// up to 1. Mild to severe: 1, 2, 5, 10, 20. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub occluded_rate: f64,
    /// The confidence is drawn from a beta distribution with mean k and standard deviation s sqrt(k (1 - k)). k =
    /// exp(-e^2 / (2 (2 d)^2 0.2 h^2)) is COCO's similarity of the point. e is its slow, white and gross error, and d
    /// the deviation of COCO's annotations. Mild to severe: 0.1, 0.2, 0.3, 0.5, 0.8. Default: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub confidence_noise: f64,
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
