//! `[[rig.motion]]` and `[[rig.timing]]`: how cameras move, and when they take images.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scenario;
use super::range_checks::{RangeCheck, at_most, require, within};
use skiagraph_core::input::excerpt;
use skiagraph_set::TruthImage;
use skiagraph_truth::observing::SilhouetteSource;

const MOST_KEYFRAMES: usize = 10_000;
/// Greatest number of entries of each table: as many as a rig may have cameras.
const MOST_ENTRIES: usize = 999;
/// Greatest coordinate, metres, and time, seconds.
const FARTHEST: f64 = 1e4;
const LATEST_S: f64 = 3600.0;
/// Relative tolerance for whole numbers of frames from one image to the next.
const WHOLE: f64 = 1e-6;

/// A camera that moves through keyframes (`scenarios/README.md#moving-cameras-and-camera-timing`). Trackers are given
/// its pose in every frame. Its lens and image size are those of the rig. An entry for a camera that is left out is
/// ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraMotionSettings {
    /// The camera's name; a ring's cameras are named `cam00`, `cam01` and so on.
    pub camera: String,
    /// The keyframes in order of time, 1 to 10,000: `{ time_s = 0.0, position_m = [3.0, 3.0, 1.6], look_at_m = [0.0,
    /// 0.0, 0.95] }`.
    pub keyframes: Vec<KeyframeSettings>,
}

/// The pose of a moving camera at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeSettings {
    /// Seconds from the first frame.
    pub time_s: f64,
    /// The camera's centre in the world, metres, above the ground.
    pub position_m: [f64; 3],
    /// The point at the centre of its view in the world, metres. A camera never looks straight up or down.
    pub look_at_m: [f64; 3],
    /// Rotation about the viewing direction, clockwise as seen from behind the camera, degrees. Default: 0, the world's
    /// Z axis points up in the image.
    #[serde(default)]
    pub roll_deg: f64,
}

/// When a camera takes its images, which trackers are told (`scenarios/README.md#moving-cameras-and-camera-timing`).
/// Row r of a frame's image is exposed at the frame's time + `offset_ms` + r x `line_delay_us`. `desynchronisation_ms`
/// and `line_delay_us` of `[observation.corruption]` are further errors, which trackers are not told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraTimingSettings {
    /// The camera's name; a ring's cameras are named `cam00`, `cam01` and so on.
    pub camera: String,
    /// Images per second; the scenario's frame rate must be a whole multiple of it. The first image is that of frame 0;
    /// the camera has no image for frames between its images. Default: an image of every frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames_per_second: Option<f64>,
    /// Delay of images after their frames, milliseconds; negative for earlier images. Before the first frame and after
    /// the last, all people stand still.
    #[serde(default)]
    pub offset_ms: f64,
    /// Delay of every row after the row above it, microseconds, for a rolling shutter.
    #[serde(default)]
    pub line_delay_us: f64,
}

impl CameraTimingSettings {
    /// Frames from one image to the next at the scenario's rate; `None` if this is not a whole number.
    pub(crate) fn every(&self, frames_per_second: f64) -> Option<usize> {
        let frames = frames_per_second / self.frames_per_second.unwrap_or(frames_per_second);
        let whole = frames.round();
        ((frames - whole).abs() <= WHOLE * whole && whole >= 1.0).then_some(whole as usize)
    }

    /// Whether images are exposed at other times than their frames.
    fn leaves_frames(&self) -> bool {
        self.offset_ms != 0.0 || self.line_delay_us != 0.0
    }
}

pub(super) fn check(scenario: &Scenario) -> RangeCheck {
    let (motion, timing) = (&scenario.rig.motion, &scenario.rig.timing);
    at_most("rig.motion", motion.len(), MOST_ENTRIES, "moving cameras")?;
    for (index, entry) in motion.iter().enumerate() {
        let key = format!("rig.motion[{index}]");
        once(&key, &entry.camera, motion[..index].iter().map(|other| &other.camera))?;
        self::motion(&key, entry)?;
    }
    at_most("rig.timing", timing.len(), MOST_ENTRIES, "cameras")?;
    for (index, entry) in timing.iter().enumerate() {
        let key = format!("rig.timing[{index}]");
        once(&key, &entry.camera, timing[..index].iter().map(|other| &other.camera))?;
        self::timing(&key, entry, scenario.motion.frames_per_second)?;
    }
    check_drawable(scenario)
}

fn once<'a>(key: &str, camera: &str, mut before: impl Iterator<Item = &'a String>) -> RangeCheck {
    require(&format!("{key}.camera"), !camera.is_empty(), "the name of a camera", "nothing")?;
    let again = before.any(|other| other == camera);
    require(&format!("{key}.camera"), !again, "every camera at most once", format!("{:?} twice", excerpt(camera)))
}

fn motion(key: &str, entry: &CameraMotionSettings) -> RangeCheck {
    let key = format!("{key}.keyframes");
    require(&key, !entry.keyframes.is_empty(), "at least one keyframe", "none")?;
    at_most(&key, entry.keyframes.len(), MOST_KEYFRAMES, "keyframes")?;
    for (index, keyframe) in entry.keyframes.iter().enumerate() {
        let key = format!("{key}[{index}]");
        within(&format!("{key}.time_s"), keyframe.time_s, -LATEST_S..=LATEST_S)?;
        for (name, place) in [("position_m", keyframe.position_m), ("look_at_m", keyframe.look_at_m)] {
            for coordinate in place {
                within(&format!("{key}.{name}"), coordinate, -FARTHEST..=FARTHEST)?;
            }
        }
        let height = keyframe.position_m[2];
        let found = format_args!("one at z = {height:.3} m").to_string();
        require(&format!("{key}.position_m"), height > 0.0, "a camera above the ground (z = 0)", found)?;
        within(&format!("{key}.roll_deg"), keyframe.roll_deg, -360.0..=360.0)?;
        if let Some(before) = index.checked_sub(1).map(|before| entry.keyframes[before].time_s) {
            let expected = format!("a time after that of the previous keyframe, {before} s");
            require(&format!("{key}.time_s"), keyframe.time_s > before, expected, format!("{} s", keyframe.time_s))?;
        }
    }
    Ok(())
}

fn timing(key: &str, entry: &CameraTimingSettings, frames_per_second: f64) -> RangeCheck {
    within(&format!("{key}.offset_ms"), entry.offset_ms, -10_000.0..=10_000.0)?;
    within(&format!("{key}.line_delay_us"), entry.line_delay_us, 0.0..=1000.0)?;
    let Some(own) = entry.frames_per_second else { return Ok(()) };
    let key = format!("{key}.frames_per_second");
    within(&key, own, 0.01..=1000.0)?;
    let expected = format_args!(
        "motion.frames_per_second, {frames_per_second}, divided by a whole number (such as {}, {} or {})",
        frames_per_second,
        frames_per_second / 2.0,
        frames_per_second / 3.0
    )
    .to_string();
    require(&key, entry.every(frames_per_second).is_some(), expected, own)
}

/// Refuses images that cannot be made with moving cameras or cameras with their own timing.
fn check_drawable(scenario: &Scenario) -> RangeCheck {
    let (motion, timing) = (&scenario.rig.motion, &scenario.rig.timing);
    let is_still = motion.is_empty() && timing.is_empty();
    let segmented = scenario.observation.silhouette == SilhouetteSource::Segmented && !is_still;
    let expected = "\"exact\" or \"corrupted\" with [[rig.motion]] or [[rig.timing]]: a background model needs a static camera \
                    with every image at its frame's time";
    require("observation.silhouette", !segmented, expected, "\"segmented\"")?;
    let images = scenario.observation.colour_images.is_some() && !motion.is_empty();
    require(
        "observation.colour_images",
        !images,
        "no [[rig.motion]]: images are taken by cameras that do not move",
        "some",
    )?;
    let rolling = timing.iter().any(|entry| entry.line_delay_us != 0.0);
    let moved = !motion.is_empty() || timing.iter().any(CameraTimingSettings::leaves_frames);
    let refused = scenario.truth_images.iter().find(|image| match image {
        TruthImage::Depth | TruthImage::Parts | TruthImage::Normals => false,
        TruthImage::Flow | TruthImage::Coverage => rolling,
        TruthImage::Colour => moved,
    });
    let Some(image) = refused else { return Ok(()) };
    let expected = match image {
        TruthImage::Colour => "no image \"colour\" with cameras that move or have their own timing",
        _ => "only the images \"depth\", \"parts\" and \"normals\" with a rolling shutter (rig.timing.line_delay_us)",
    };
    require("truth_images", false, expected, format!("{image:?}").to_lowercase())
}
