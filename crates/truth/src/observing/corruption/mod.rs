//! Corruption of observations: calibrated axes of difficulty, one number each.
//!
//! [`Corruption`] has one strength per axis; zero changes nothing. [`AXES`] lists the axes with their units. Axes of
//! masks are applied by [`CorruptedObserver`], those of the tracker's input (cameras, body, start) by [`tracker_rig`]
//! and [`tracker_start`]. Every random number comes from a stream keyed by secret, seed, frame, axis and camera
//! ([`skiagraph_core::rng::Purpose::Corruption`]), so that each camera's image of each frame is independent of other
//! draws.

mod axes;
mod discs;
mod limbs;
mod noise;
mod observer;
mod outline;
pub(super) mod timing;
mod tracker_side;

pub use axes::{AXES, CorruptionAxis};
pub use observer::CorruptedObserver;
pub use outline::BOUNDARY_CORRELATION_PX;
pub use tracker_side::{tracker_rig, tracker_start};

use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::settings::is_default as is_zero;
use skiagraph_core::rng::{KeyedSeed, Purpose};

/// Strength *s* of each error; 0 changes nothing. Those of silhouettes need `silhouette = "corrupted"`. Times, lost
/// frames, limbs and shadows are applied first, then outlines, holes, blobs and pixels. Errors of cameras
/// (`calibration_...`, `lens_ignored`), body and start do not need it. With errors of cameras, the true ones are in
/// `truth/cameras.json`. `scenarios/sweeps/ladder.toml` measures trackers level by level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Corruption {
    /// A pixel at signed distance d from the outline (positive outside) is set if d < s n, pixels. n is a field of
    /// normal deviates on a grid of 8 px, new in every frame. It is interpolated bilinearly and scaled to variance 1
    /// everywhere. Mild to severe: 0.5, 1, 2, 4, 8. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub boundary_px: f64,
    /// The field of `boundary_px` is fixed in the image and drawn anew every s seconds. Between these moments it is
    /// interpolated linearly and scaled to variance 1. Mild to severe: 0.05, 0.1, 0.2, 0.5, 1. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub boundary_s: f64,
    /// Discs around uniformly drawn pixels of the silhouette are cleared until a share s of its pixels is cleared.
    /// Radii are uniform between 1/480 and 6/480 of the image height. Mild to severe: 0.02, 0.05, 0.1, 0.2, 0.4.
    /// Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub holes: f64,
    /// Discs around uniformly drawn pixels of the image are set until the added pixels number s times those of the
    /// silhouette. Radii are uniform between 1/480 and 12/480 of the image height. Mild to severe: 0.05, 0.1, 0.2, 0.5,
    /// 1. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub blobs: f64,
    /// In each half second of each camera, with probability s, one arm or leg is invisible from the elbow or knee to
    /// its end. It begins at the link of that marker and is drawn uniformly; the body behind it is visible. Mild to
    /// severe: 0.05, 0.1, 0.2, 0.4, 0.8. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub missing_limb: f64,
    /// A shadow on the ground, z = 0, s metres long: pixels whose ray to the sun first meets the body at a height of at
    /// most s metres are set. The sun is 45 degrees high; its azimuth is drawn once per sequence. Mild to severe: 0.1,
    /// 0.2, 0.4, 0.8, 1.6. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub shadow_m: f64,
    /// Each pixel is flipped with probability s. Mild to severe: 0.001, 0.003, 0.01, 0.03, 0.1. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub salt_and_pepper: f64,
    /// Each frame of each camera except the first is lost with probability s, and the camera's last image is shown
    /// again. Mild to severe: 0.05, 0.1, 0.2, 0.4, 0.8. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub dropped_frames: f64,
    /// Camera c shows the scene at t + o_c, milliseconds. o_c is drawn once per sequence from a normal distribution
    /// with standard deviation s. Between frames, angles are interpolated linearly and rotations by slerp. Before the
    /// first and after the last everything stands still. Mild to severe: 2, 5, 10, 20, 50. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub desynchronisation_ms: f64,
    /// o_c grows by r_c per minute, milliseconds. r_c is drawn once per sequence from a normal distribution with
    /// standard deviation s. Mild to severe: 1, 2, 5, 10, 50. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub clock_drift_ms_per_min: f64,
    /// A rolling shutter: row y of an image, from 0 at the top, shows the scene at t + s y (plus o_c), microseconds.
    /// Shadows are those of the first row. Mild to severe: 5, 10, 20, 50, 100. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub line_delay_us: f64,
    /// The camera centres given to the tracker are off by a normal deviate with standard deviation s in each
    /// coordinate, millimetres. Mild to severe: 5, 10, 20, 50, 100. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub calibration_mm: f64,
    /// The camera orientations given to the tracker are turned by a rotation vector in the camera's axes. Each
    /// coordinate is a normal deviate with standard deviation s, degrees. Mild to severe: 0.1, 0.2, 0.5, 1, 2. Default:
    /// 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub calibration_deg: f64,
    /// The focal lengths given to the tracker are off by a normal deviate with standard deviation s, pixels, the same
    /// along x and y. At least a tenth of the true one is left. Mild to severe: 2, 5, 10, 20, 50. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub calibration_px: f64,
    /// The lens coefficients given to the tracker are multiplied by 1 - s. Mild to severe: 0.1, 0.25, 0.5, 0.75, 1.
    /// Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub lens_ignored: f64,
    /// Length and girth of every segment of the tracker's body, after its mismatch, are multiplied by 1 + u. u is
    /// uniform between -s and s, %, and the same for left and right. Mild to severe: 2, 5, 10, 15, 20. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub wrong_body_percent: f64,
    /// The root of the start pose is off by a normal deviate with standard deviation s in each coordinate, millimetres.
    /// Mild to severe: 20, 50, 100, 200, 400. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub start_mm: f64,
    /// Every joint angle of the start pose is off by a normal deviate with standard deviation s, degrees, then clamped
    /// to its limits. The root is turned by a rotation vector with such coordinates. Mild to severe: 5, 10, 20, 30, 45.
    /// Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub start_deg: f64,
}

impl Corruption {
    /// Whether all strengths are zero.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether any axis draws random numbers; a rolling shutter and an ignored lens do not.
    pub fn is_drawn(&self) -> bool {
        !Self { line_delay_us: 0.0, lens_ignored: 0.0, boundary_s: 0.0, ..*self }.is_none()
    }

    /// Whether the tracker's cameras differ from the true ones.
    pub fn changes_cameras(&self) -> bool {
        [self.calibration_mm, self.calibration_deg, self.calibration_px, self.lens_ignored].iter().any(|s| *s != 0.0)
    }

    /// Description of the nonzero axes: `boundary_px 2 px, holes 0.1`.
    pub fn describe(&self) -> String {
        let nonzero = AXES.iter().filter(|axis| (axis.strength)(self) != 0.0);
        let words = nonzero.map(|axis| format!("{} {} {}", axis.name, (axis.strength)(self), axis.unit));
        words.map(|words| words.trim_end().to_owned()).collect::<Vec<_>>().join(", ")
    }
}

/// Use of a random stream; part of its key.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
enum Draw {
    Boundary = 1,
    Holes = 2,
    Blobs = 3,
    Limb = 4,
    Shadow = 5,
    Pixels = 6,
    Dropped = 7,
    Offset = 8,
    Camera = 9,
    Start = 10,
    Drift = 11,
    /// The displacement of the outline at one of the moments between which it changes.
    BoundaryMoment = 12,
}

fn draws(seed: KeyedSeed, frame: usize, draw: Draw, camera: usize) -> ChaCha8Rng {
    seed.stream(Purpose::Corruption, frame as u64, draw as u64, camera as u64)
}
