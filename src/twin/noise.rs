//! The errors of a recording's masks and keypoints, measured against the body that was tracked in them.
//!
//! The tracker's own error is in all of them, so they are upper bounds.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::common::{ExperimentError, Progress, advance, median};
use crate::measure::measuring::Painters;
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::raster::{Mask, SignedDistance};
use skiagraph_set::BlindSet;

/// The standard deviation of a normal distribution as a multiple of the median of absolute values.
const NORMAL_OF_MEDIAN: f64 = 1.4826;
/// Outlines farther away than this many standard deviations are holes or blobs, not errors of an outline.
const FAR: f64 = 3.0;
/// Least distance of holes and blobs, pixels.
const LEAST_FAR_PX: f64 = 2.0;
/// Distance from the tracked outline up to which outlines are compared, pixels.
const MARGIN_PX: u32 = 40;
/// Side of the squares in which outlines' errors are followed over time, pixels: that of `boundary_px`.
const CELL_PX: f64 = 8.0;
/// Correlation of a field that is drawn anew every s seconds, and interpolated to constant variance between, with
/// itself after s seconds: the mean of `u (1 - u) / (u^2 + (1 - u)^2)` over u from 0 to 1.
const CORRELATION_AFTER_S: f64 = std::f64::consts::FRAC_PI_4 - 0.5;
/// Longest time over which outlines are followed, seconds.
const LONGEST_S: f64 = 1.0;
const MOST_FRAMES: usize = 600;
/// Keypoints that are farther off than this are gross errors, per cent of the person's height: twice the scale of
/// `gross_percent`, beyond which a round Student t distribution with 3 degrees of freedom has this share of its values.
const GROSS_PERCENT: f64 = 10.0;
const SHARE_OF_GROSS: f64 = 0.2806;

/// Errors as the keys of `[observation]` say them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeasuredNoise {
    pub(super) boundary_px: f64,
    pub(super) boundary_s: f64,
    pub(super) holes: f64,
    pub(super) blobs: f64,
    /// Those of `[observation.keypoints]`; `None` without keypoints.
    pub(super) keypoints: Option<KeypointNoise>,
}

/// Errors as the keys of `[observation.keypoints]` say them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KeypointNoise {
    pub(super) slow_percent: f64,
    pub(super) white_percent: f64,
    pub(super) gross: f64,
    pub(super) missing: f64,
    pub(super) bias_mm: f64,
}

pub(super) struct TrackedBody<'a> {
    pub(super) set: &'a BlindSet,
    pub(super) rig: &'a CameraRig,
    pub(super) body: &'a Humanoid,
    /// From the frame `first` on.
    pub(super) poses: &'a [Pose],
    pub(super) first: usize,
}

#[derive(Default)]
struct ImageErrors {
    /// Signed distance of the mask's outline from the tracked one, by cell: positive outside, pixels.
    outline: BTreeMap<(u32, u32), Vec<f64>>,
    /// Depths of pixels of the tracked silhouette that are not in the mask, pixels.
    lacking: Vec<f64>,
    /// Distances of pixels of the mask from the tracked silhouette, pixels.
    added: Vec<f64>,
    /// Depths of all pixels of the tracked silhouette, pixels.
    depths: Vec<f64>,
    /// The error of each keypoint; `None` if it was not found.
    keypoints: Vec<Option<KeypointError>>,
}

/// How far a keypoint is off.
#[derive(Clone, Copy)]
struct KeypointError {
    /// In both coordinates, per cent of the person's height.
    percent: [f64; 2],
    /// The point's deviation relative to that of others: `w` of `scenarios/keys.md`.
    relative_deviation: f64,
}

impl TrackedBody<'_> {
    pub(super) fn noise(&self, progress: &dyn Progress) -> Result<MeasuredNoise, ExperimentError> {
        let of_frame = |painters: &mut Painters, frame: usize| -> Result<Vec<ImageErrors>, ExperimentError> {
            let observed = self.set.observation(self.first + frame)?;
            let drawn = painters.silhouettes(self.body, &self.poses[frame]);
            let mut images: Vec<ImageErrors> =
                drawn.iter().zip(&observed.silhouettes).map(|(drawn, mask)| image_errors(drawn, mask)).collect();
            for (camera, views) in observed.keypoints.iter().flat_map(|found| found.views.iter().enumerate()) {
                images[camera].keypoints = self.keypoint_errors(frame, camera, views);
            }
            advance(progress)?;
            Ok(images)
        };
        let frames = (0..self.poses.len().min(MOST_FRAMES)).into_par_iter();
        let images: Vec<Vec<ImageErrors>> =
            frames.map_init(|| Painters::from_rig(self.rig), of_frame).collect::<Result<_, _>>()?;
        let all = || images.iter().flatten();
        let outline: Vec<f64> = all().flat_map(|image| image.outline.values().flatten().copied()).collect();
        let boundary_px = deviation_without_far(&outline);
        let far = (FAR * boundary_px).max(LEAST_FAR_PX);
        let count = |of: fn(&ImageErrors) -> &Vec<f64>, least: f64| {
            all().flat_map(of).filter(|distance| **distance > least).count() as f64
        };
        let (deep, pixels) = (count(|image| &image.depths, far), count(|image| &image.depths, 0.0));
        let layout = self.set.keypoints.as_ref().map(|found| found.layout);
        Ok(MeasuredNoise {
            boundary_px,
            boundary_s: correlation_time(&images, self.set.frames_per_second),
            // near outlines, pixels are lacking for the outlines' own errors
            holes: count(|image| &image.lacking, far) / deep.max(1.0),
            blobs: count(|image| &image.added, far) / pixels.max(1.0),
            keypoints: layout.map(|_| keypoint_noise(&images, self.body.stature_or_usual())),
        })
    }

    fn keypoint_errors(
        &self,
        frame: usize,
        camera: usize,
        found: &[Option<FoundKeypoint>],
    ) -> Vec<Option<KeypointError>> {
        let Some(layout) = self.set.keypoints.as_ref().map(|found| found.layout) else { return Vec::new() };
        let frames = self.body.link_frames(&self.poses[frame]);
        let camera = &self.rig.cameras[camera];
        let mut errors = Vec::new();
        for ((place, keypoint), found) in self.body.keypoint_places(layout).iter().zip(layout.keypoints()).zip(found) {
            let Some(place) = place else { continue };
            let point = frames.0[place.point.link] * place.point.point_in_link;
            let depth = (camera.camera_from_world * point).z;
            let height_px = camera.pinhole.focal[1] * self.body.stature_or_usual() / depth;
            let percent = |off: f64| 100.0 * off / height_px;
            let relative_deviation = keypoint.relative_deviation();
            errors.push(camera.project(&point).zip(*found).map(|(pixel, found)| {
                let percent = [percent(found.pixel[0] - pixel.x), percent(found.pixel[1] - pixel.y)];
                KeypointError { percent, relative_deviation }
            }));
        }
        errors
    }
}

fn image_errors(drawn: &Mask, mask: &Mask) -> ImageErrors {
    let mut errors = ImageErrors::default();
    let Some(distance) = SignedDistance::new(drawn, None, MARGIN_PX) else { return errors };
    let at = |x: f64, y: f64| distance.sample(x, y).map(|sample| sample.distance);
    let beyond = f64::from(MARGIN_PX);
    for (x, y) in drawn.pixels() {
        let depth = at(f64::from(x) + 0.5, f64::from(y) + 0.5).map(|distance| -distance);
        errors.depths.extend(depth);
        errors.lacking.extend(depth.filter(|_| !mask.get(x, y)));
    }
    for (x, y) in mask.pixels() {
        let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        if !drawn.get(x, y) {
            errors.added.push(at(u, v).unwrap_or(beyond));
        }
        // the outline crosses the middle between a pixel of the mask and a neighbour that is none
        let beside = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        for (dx, dy) in beside {
            let (left, top) = (u + dx, v + dy);
            let is_inside = left > 0.0 && top > 0.0 && left < f64::from(mask.width()) && top < f64::from(mask.height());
            if is_inside && !mask.get(left as u32, top as u32) {
                let cell = ((u / CELL_PX) as u32, (v / CELL_PX) as u32);
                errors.outline.entry(cell).or_default().extend(at(u + 0.5 * dx, v + 0.5 * dy));
            }
        }
    }
    errors
}

/// Time after which outlines' errors at one place of the image have lost so much of their correlation as the field of
/// `boundary_s` loses in that time, seconds; 0 if they lose it from one frame to the next.
fn correlation_time(images: &[Vec<ImageErrors>], frames_per_second: f64) -> f64 {
    let means: Vec<Vec<BTreeMap<(u32, u32), f64>>> = images
        .iter()
        .map(|frame| {
            let of_image = |image: &ImageErrors| {
                let cells = image.outline.iter().filter(|(_, all)| !all.is_empty());
                cells.map(|(cell, all)| (*cell, all.iter().sum::<f64>() / all.len() as f64)).collect()
            };
            frame.iter().map(of_image).collect()
        })
        .collect();
    let longest = ((LONGEST_S * frames_per_second) as usize).min(means.len().saturating_sub(1));
    for lag in 1..=longest {
        let (mut product, mut square) = (0.0, 0.0);
        for (early, late) in means.iter().zip(&means[lag..]) {
            for (early, late) in early.iter().zip(late) {
                for (cell, value) in early {
                    if let Some(later) = late.get(cell) {
                        product += value * later;
                        square += 0.5 * (value * value + later * later);
                    }
                }
            }
        }
        if product <= CORRELATION_AFTER_S * square {
            return if lag == 1 { 0.0 } else { lag as f64 / frames_per_second };
        }
    }
    longest as f64 / frames_per_second
}

fn keypoint_noise(images: &[Vec<ImageErrors>], stature_m: f64) -> KeypointNoise {
    let cameras = images.first().map_or(0, Vec::len);
    let (mut together, mut varying, mut steps) = (Vec::new(), Vec::new(), Vec::new());
    let (mut found, mut gross, mut all) = (0, 0, 0);
    for point in 0..images.first().and_then(|frame| frame.first()).map_or(0, |image| image.keypoints.len()) {
        if images.iter().flatten().all(|image| image.keypoints[point].is_none()) {
            continue; // the detector has no such point
        }
        let mut heights: Vec<f64> = Vec::new();
        for camera in 0..cameras {
            let over_time: Vec<Option<KeypointError>> =
                images.iter().map(|frame| frame[camera].keypoints[point]).collect();
            for axis in 0..2 {
                let of = |error: KeypointError| error.percent[axis] / error.relative_deviation;
                let values: Vec<f64> = over_time.iter().flatten().map(|error| of(*error)).collect();
                for (early, late) in over_time.iter().zip(over_time.iter().skip(1)) {
                    steps.extend(early.zip(*late).map(|(early, late)| (of(late) - of(early)).abs()));
                }
                if axis == 1 {
                    heights.extend(median(values.clone()));
                }
                varying.extend(values.iter().map(|value| value.abs()));
            }
            let far = |error: &&KeypointError| error.percent[0].hypot(error.percent[1]) > GROSS_PERCENT;
            all += over_time.len();
            found += over_time.iter().flatten().count();
            gross += over_time.iter().flatten().filter(far).count();
        }
        let (sum, squares) = (heights.iter().sum::<f64>(), heights.iter().map(|height| height * height).sum::<f64>());
        let pairs = (heights.len() * heights.len().saturating_sub(1)) as f64;
        // the mean product of the heights of two cameras
        together.extend((pairs > 0.0).then(|| ((sum * sum - squares) / pairs).max(0.0)));
    }
    let spread = |values: Vec<f64>| NORMAL_OF_MEDIAN * median(values).unwrap_or(0.0);
    let total = spread(varying);
    // a step from frame to frame has the white error twice; the slow one hardly moves
    let white = spread(steps) / 2.0_f64.sqrt();
    // of a point's error, what is the same in all cameras is its place on the body; height is common to their images
    let bias = NORMAL_OF_MEDIAN * median(together).unwrap_or(0.0).sqrt();
    KeypointNoise {
        slow_percent: (total * total - white * white - bias * bias).max(0.0).sqrt(),
        white_percent: white,
        gross: (gross as f64 / found.max(1) as f64 / SHARE_OF_GROSS).min(1.0),
        missing: 1.0 - found as f64 / all.max(1) as f64,
        // a hundredth of the person's height
        bias_mm: bias * 10.0 * stature_m,
    }
}

fn deviation_without_far(distances: &[f64]) -> f64 {
    let first = NORMAL_OF_MEDIAN * median(distances.iter().map(|d| d.abs()).collect()).unwrap_or(0.0);
    let far = (FAR * first).max(LEAST_FAR_PX);
    let near: Vec<f64> = distances.iter().filter(|d| d.abs() <= far).map(|d| d * d).collect();
    (near.iter().sum::<f64>() / near.len().max(1) as f64).sqrt()
}
