//! `[observation.images]`: appearance of the scene, and the sensor.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Images of the scene: textured ground and walls, props, a dressed actor, ambient light and a sun at 45 degrees
/// elevation. Brightness is in grey values, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ImageSettings {
    /// Grey images instead of colour.
    pub grey: bool,
    /// Distance of the colours of clothing and skin from the mean background colour, grey values.
    pub clothing_contrast: f64,
    /// Whether the actor casts a shadow on the ground.
    pub shadow: bool,
    /// Standard deviation of the read noise, grey values.
    pub read_noise: f64,
    /// Variance of the shot noise per grey value of brightness, grey values.
    pub shot_noise: f64,
    /// Greatest drift of the gain between the three periods in which the background is recorded, as a share. Frames
    /// drift from the first through the second to the third.
    pub gain_drift: f64,
    /// Greatest drift of the offset between those periods, grey values.
    pub offset_drift: f64,
    /// Quality at which the camera stores its images as JPEG before they are segmented, 1 to 100. Colour is not
    /// subsampled. Default: not compressed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jpeg_quality: Option<u8>,
    /// Number of background images in each of the three periods.
    pub background_frames: u32,
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self {
            grey: false,
            clothing_contrast: 60.0,
            shadow: true,
            read_noise: 2.5,
            shot_noise: 0.02,
            gain_drift: 0.02,
            offset_drift: 3.0,
            jpeg_quality: None,
            background_frames: 20,
        }
    }
}

/// Number of periods in which the background is recorded: before, during and after the frames.
pub(super) const PERIODS: usize = 3;
