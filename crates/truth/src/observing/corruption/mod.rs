//! Corruption of observations: calibrated axes of difficulty, one number each.
//!
//! [`Corruption`] has one strength per axis; zero changes nothing. [`AXES`] lists the axes with their units, formulas
//! and levels. Axes of masks are applied by [`CorruptedObserver`], those of the tracker's input (cameras, body, start)
//! by [`tracker_rig`] and [`tracker_start`]. Every random number comes from a stream keyed by secret, seed, frame, axis
//! and camera ([`crate::rng::Purpose::Corruption`]), so that each camera's image of each frame is independent of other
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

use crate::rng::{KeyedSeed, Purpose};

/// Strength of the corruption by axis; zero changes nothing. For the formulas, see `scenarios/README.md` and `AXES`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Corruption {
    /// Standard deviation by which the outline is displaced, pixels. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub boundary_px: f64,
    /// Time over which the displacement of the outline changes, seconds; 0 draws it anew in every frame. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub boundary_s: f64,
    /// Share of the silhouette's area removed by discs. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub holes: f64,
    /// Area of false discs anywhere in the image, as a share of the silhouette's. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub blobs: f64,
    /// Share of half-second intervals of a camera in which one arm or leg is missing from the elbow or knee on.
    /// Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub missing_limb: f64,
    /// Length of the cast shadow on the ground included in the silhouette, metres. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub shadow_m: f64,
    /// Share of all pixels that are flipped. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub salt_and_pepper: f64,
    /// Share of a camera's frames that are lost; the camera's last image is shown instead. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub dropped_frames: f64,
    /// Standard deviation of the cameras' time offsets, milliseconds. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub desynchronisation_ms: f64,
    /// Standard deviation of the drift of the cameras' clocks, milliseconds per minute. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub clock_drift_ms_per_min: f64,
    /// Delay of each image row after the row above it, microseconds: a rolling shutter. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub line_delay_us: f64,
    /// Standard deviation of the error of each coordinate of the cameras' positions, millimetres. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub calibration_mm: f64,
    /// Standard deviation of the error of the cameras' orientation about each of their axes, degrees. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub calibration_deg: f64,
    /// Standard deviation of the error of the cameras' focal lengths, pixels. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub calibration_px: f64,
    /// Share of the lens distortion withheld from the tracker. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub lens_ignored: f64,
    /// Maximum error of lengths and girths of the tracker's body, in addition to its mismatch, %. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub wrong_body_percent: f64,
    /// Standard deviation of the error of each coordinate of the start pose's root, millimetres. Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub start_mm: f64,
    /// Standard deviation of the error of the start pose's joint angles and of its root about each axis, degrees.
    /// Default: 0.
    #[serde(skip_serializing_if = "is_zero")]
    pub start_deg: f64,
}

fn is_zero(strength: &f64) -> bool {
    *strength == 0.0
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
