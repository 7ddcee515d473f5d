//! What the keypoints of several cameras tell about the recording before anything is tracked: how well they agree,
//! whether a camera is late, turned or mirrored, and in which frames left and right are exchanged.

use super::start::LEAST_CONFIDENCE;
use super::triangulation::triangulated;
use crate::common::{ExperimentError, frame_ranges, key_error, median};
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;

/// Distance at which keypoints of different cameras disagree so much that their calibration is doubted, as a share of
/// the image's height.
const DOUBTFUL: f64 = 0.008;
/// Distance at which cameras, images and keypoints do not belong together, as a share of the image's height.
const IMPOSSIBLE: f64 = 0.08;
/// Least share of a camera's keypoints in its masks.
const LEAST_INSIDE: f64 = 0.6;
const MASKS: usize = 20;
/// Number of frames from which lengths and agreement are taken.
pub(super) const MOST_SAMPLES: usize = 100;
const MOST_LAG: usize = 10;
/// Least lag that is said, frames; both halves of the recording must show it, and not differ by more than
/// [`MOST_DIFFERENCE`]: noise alone has its best lag anywhere.
const LEAST_LAG: f64 = 0.5;
const MOST_DIFFERENCE: f64 = 2.0;
/// Least bend of the disagreement around the best lag, as a share of it: with less, nobody moves enough.
const LEAST_BEND: f64 = 0.02;
/// The share of the disagreement that remains when a camera is turned or mirrored, or when left and right are
/// exchanged: with more, nothing is said.
const MENDED: f64 = 0.7;

/// Found keypoints by frame, camera and point.
pub(super) type Views = Vec<Vec<Vec<Option<FoundKeypoint>>>>;

/// What may have happened to the images of a camera, or to what a detector found in them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    UpsideDown,
    Mirrored,
    SidesExchanged,
}

pub(super) struct Witness<'a> {
    pub(super) rig: &'a CameraRig,
    pub(super) layout: KeypointLayout,
    pub(super) views: &'a Views,
}

/// How far the pixels of a point are from the point triangulated from all of them, by camera.
pub(super) fn offsets(rig: &CameraRig, seen: &[Option<[f64; 2]>]) -> Option<Vec<Option<[f64; 2]>>> {
    let views = rig.cameras.iter().zip(seen);
    let place = triangulated(views.clone().filter_map(|(camera, pixel)| Some((camera, (*pixel)?))))?;
    let mut offsets = Vec::new();
    for (camera, pixel) in views {
        let projected = pixel.and_then(|pixel| Some((pixel, camera.project(&place)?)));
        offsets.push(projected.map(|([x, y], found)| [found.x - x, found.y - y]));
    }
    Some(offsets)
}

impl Witness<'_> {
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        notes.extend(self.agreement());
        let exchanged = self.exchanged();
        notes.extend(self.late(&exchanged));
        let mut words = Vec::new();
        for (index, camera) in self.rig.cameras.iter().enumerate() {
            let own: Vec<usize> = (0..exchanged.len()).filter(|frame| exchanged[*frame] == Some(index)).collect();
            if !own.is_empty() {
                words.push(format!("{} {}", camera.name, frame_ranges(&own)));
            }
        }
        let note = "left and right of keypoints are exchanged, by what the other cameras see: ";
        notes.extend((!words.is_empty()).then(|| note.to_owned() + &words.join("; ")));
        notes
    }

    /// The pixel of a point in a frame, in which a camera may be changed.
    fn pixel(&self, frame: usize, camera: usize, point: usize, changed: Option<(usize, Change)>) -> Option<[f64; 2]> {
        let change = changed.filter(|(changed, _)| *changed == camera).map(|(_, change)| change);
        let keypoints = self.layout.keypoints();
        let mirrored = || keypoints.iter().position(|own| *own == keypoints[point].mirrored());
        let own = match change {
            Some(Change::Mirrored | Change::SidesExchanged) => mirrored()?,
            _ => point,
        };
        let [x, y] = self.views[frame][camera][own].filter(|found| found.confidence >= LEAST_CONFIDENCE)?.pixel;
        let pinhole = &self.rig.cameras[camera].pinhole;
        let [width, height] = [pinhole.width, pinhole.height].map(f64::from);
        Some(match change {
            Some(Change::UpsideDown) => [width - x, height - y],
            Some(Change::Mirrored) => [width - x, y],
            _ => [x, y],
        })
    }

    /// Distances of keypoints from the triangulated points in some frames, by camera.
    fn distances(&self, frames: &[usize], paired: bool, changed: Option<(usize, Change)>) -> Vec<Vec<f64>> {
        let cameras = self.rig.cameras.len();
        let mut off = vec![Vec::new(); cameras];
        for frame in frames {
            for (point, keypoint) in self.layout.keypoints().iter().enumerate() {
                if paired && keypoint.mirrored() == *keypoint {
                    continue;
                }
                let seen: Vec<_> = (0..cameras).map(|camera| self.pixel(*frame, camera, point, changed)).collect();
                for (camera, offset) in offsets(self.rig, &seen).into_iter().flatten().enumerate() {
                    off[camera].extend(offset.map(|[x, y]| x.hypot(y)));
                }
            }
        }
        off
    }

    /// Refuses cameras and keypoints that have nothing to do with each other.
    pub(super) fn check(&self) -> Result<(), ExperimentError> {
        let sampled: Vec<usize> = (0..self.views.len()).step_by(self.views.len().div_ceil(MASKS).max(1)).collect();
        let (mut words, mut far) = (Vec::new(), 0);
        for (camera, off) in self.rig.cameras.iter().zip(self.distances(&sampled, false, None)) {
            let Some(px) = median(off) else { continue };
            words.push(format!("{} {px:.0} px", camera.name));
            far += usize::from(px > IMPOSSIBLE * f64::from(camera.pinhole.height));
        }
        // one camera that is turned spoils all; the notes name it
        let turned = [Change::UpsideDown, Change::Mirrored];
        if 2 * far <= words.len() || self.explained(&sampled, false, &turned).is_some() {
            return Ok(());
        }
        let message = format!(
            "keypoints triangulated from all cameras are off by (median): {}, so cameras, images and keypoints do not belong \
             together: keypoints must be in pixels of these images; in [[rig.file]], pose = \"camera_to_world\", up and \
             calibrated_at_px say how the calibration is meant",
            words.join(", ")
        );
        Err(key_error("keypoints", message))
    }

    /// A note about cameras whose keypoints are not in their masks.
    pub(super) fn outside_of(
        &self,
        masks_of: impl Fn(usize) -> Result<Vec<Mask>, ExperimentError>,
    ) -> Result<Option<String>, ExperimentError> {
        let mut counts = vec![[0_usize; 2]; self.rig.cameras.len()];
        for frame in (0..self.views.len()).step_by(self.views.len().div_ceil(MASKS).max(1)) {
            for (camera, mask) in masks_of(frame)?.iter().enumerate() {
                for found in self.views[frame][camera].iter().flatten() {
                    let [x, y] = found.pixel.map(|x| x.max(0.0) as u32);
                    counts[camera][0] += usize::from(mask.get(x, y));
                    counts[camera][1] += 1;
                }
            }
        }
        let mut words = Vec::new();
        for (camera, [inside, all]) in self.rig.cameras.iter().zip(counts) {
            let share = inside as f64 / all.max(1) as f64;
            if all > 0 && share < LEAST_INSIDE {
                words.push(format!("{} {:.0} %", camera.name, 100.0 * share));
            }
        }
        let note = "few keypoints are in the masks of their cameras: check whether masks belong to these cameras, are \
                    neither turned nor mirrored, and show the same person: ";
        Ok((!words.is_empty()).then(|| note.to_owned() + &words.join(", ")))
    }

    /// How well keypoints of different cameras agree, and which camera could be turned or mirrored if they do not.
    fn agreement(&self) -> Option<String> {
        let frames = self.views.len();
        let sampled: Vec<usize> = (0..frames).step_by(frames.div_ceil(MOST_SAMPLES).max(1)).collect();
        let (mut words, mut is_doubtful) = (Vec::new(), false);
        for (camera, off) in self.rig.cameras.iter().zip(self.distances(&sampled, false, None)) {
            let Some(px) = median(off) else { continue };
            words.push(format!("{} {px:.1} px", camera.name));
            is_doubtful |= px > DOUBTFUL * f64::from(camera.pinhole.height);
        }
        let mut note = format!("keypoints triangulated from all cameras are off by (median): {}", words.join(", "));
        if is_doubtful {
            note += "; more than a detector's noise: check the calibration, the size of the images and whether cameras are \
                     synchronous, and let the tracker calibrate";
            let few: Vec<usize> = sampled.iter().copied().step_by(4).collect();
            let changes = [Change::UpsideDown, Change::Mirrored];
            note += &match self.explained(&few, false, &changes) {
                None => String::new(),
                Some((camera, change)) => format!(
                    "; `{}` looks {}: keypoints agree better if its images are turned back",
                    self.rig.cameras[camera].name,
                    if change == Change::Mirrored { "mirrored" } else { "upside down" }
                ),
            };
        }
        (!words.is_empty()).then_some(note)
    }

    /// The change of one camera that explains most of the disagreement in some frames.
    fn explained(&self, frames: &[usize], paired: bool, changes: &[Change]) -> Option<(usize, Change)> {
        let disagreement = |changed| median(self.distances(frames, paired, changed).concat());
        let without = disagreement(None)?;
        let cameras = 0..self.rig.cameras.len();
        let all = cameras.flat_map(|camera| changes.iter().map(move |change| (camera, *change)));
        let tried = all.filter_map(|changed| Some((changed, disagreement(Some(changed))?)));
        let (changed, with) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
        (with < MENDED * without).then_some(changed)
    }

    /// The camera in which left and right are exchanged by what the others see, frame by frame.
    fn exchanged(&self) -> Vec<Option<usize>> {
        let of_frame = |frame: usize| {
            // of two cameras nobody can say which is right
            let seen = self.distances(&[frame], true, None).iter().filter(|off| !off.is_empty()).count();
            let found = (seen > 2).then(|| self.explained(&[frame], true, &[Change::SidesExchanged]));
            found.flatten().map(|(camera, _)| camera)
        };
        parallel::map(self.views.len(), of_frame)
    }

    /// Which cameras are late, and what to do.
    fn late(&self, exchanged: &[Option<usize>]) -> Option<String> {
        let frames = self.views.len();
        let most = MOST_LAG.min(frames / 4);
        // one more, for the neighbours of the best lags
        let inner = most + 1..frames.saturating_sub(most + 1);
        let sampled: Vec<usize> = inner.clone().step_by((inner.len() / (MOST_SAMPLES / 2)).max(1)).collect();
        let (first, second) = sampled.split_at(sampled.len() / 2);
        let (lags, first, second) = (
            self.lags(&sampled, most, exchanged)?,
            self.lags(first, most, exchanged)?,
            self.lags(second, most, exchanged)?,
        );
        let mut words = Vec::new();
        let mut said = vec![0.0; lags.len()];
        for (index, camera) in self.rig.cameras.iter().enumerate() {
            let all = [lags[index], first[index], second[index]];
            let agree = all.iter().all(|lag| (lag - lags[index]).abs() <= MOST_DIFFERENCE);
            if agree && (all.iter().all(|lag| *lag >= LEAST_LAG) || all.iter().all(|lag| *lag <= -LEAST_LAG)) {
                let [lag, first, second] = all;
                words.push(format!("{} {lag:+.1} ({first:+.1} and {second:+.1})", camera.name));
                said[index] = lag;
            }
        }
        let least = said.iter().copied().fold(0.0, f64::min);
        let mut skips = Vec::new();
        for (camera, lag) in self.rig.cameras.iter().zip(&said) {
            let skip = (lag - least).round();
            if skip >= 1.0 {
                skips.push(format!("{} = {skip:.0}", camera.name));
            }
        }
        let advice = match skips.is_empty() {
            true => "nothing mends less than a frame".to_owned(),
            false => format!("leave out that many images at the beginning: [skip] {}", skips.join(", ")),
        };
        (!words.is_empty()).then(|| {
            format!(
                "by the motion of keypoints, what others show in image n a camera shows in image n + lag; lag (in the first \
                 and second half), frames: {}; {advice}",
                words.join(", ")
            )
        })
    }

    /// Number of frames by which the images of each camera are behind those of most cameras, by some frames.
    fn lags(&self, sampled: &[usize], most: usize, exchanged: &[Option<usize>]) -> Option<Vec<f64>> {
        let cameras = self.rig.cameras.len();
        let disagreement = |lags: &[isize]| self.disagreement(sampled, lags, exchanged);
        // first whole frames, one camera at a time
        let mut lags = vec![0; cameras];
        let mut least = disagreement(&lags)?;
        for _ in 0..cameras {
            let tried = parallel::map(cameras * (2 * most + 1), |index| {
                let mut lags = lags.clone();
                lags[index % cameras] = (index / cameras) as isize - most as isize;
                Some((disagreement(&lags)?, lags))
            });
            let best = tried.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))?;
            if best.0 >= least {
                break;
            }
            (least, lags) = best;
        }
        // then the vertex of the parabola through the neighbours
        let mut found = Vec::new();
        for camera in 0..cameras {
            let mut moved = lags.clone();
            moved[camera] -= 1;
            let before = disagreement(&moved)?;
            moved[camera] += 2;
            let after = disagreement(&moved)?;
            let bend = before + after - 2.0 * least;
            if bend <= LEAST_BEND * least {
                return None;
            }
            let vertex = (0.5 * (before - after) / bend).clamp(-1.0, 1.0);
            // the place that all agree on moves with the camera
            found.push(lags[camera] as f64 + vertex * (cameras - 1) as f64 / cameras as f64);
        }
        let mut sorted = found.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[(cameras - 1) / 2];
        Some(found.into_iter().map(|lag| lag - usual).collect())
    }

    /// How much keypoints of different cameras disagree if the images of each are behind by its lag: the mean distance
    /// from the triangulated points along x and y, pixels.
    fn disagreement(&self, sampled: &[usize], lags: &[isize], exchanged: &[Option<usize>]) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for point in 0..self.layout.keypoints().len() {
            let mut off: Vec<[Vec<f64>; 2]> = vec![Default::default(); lags.len()];
            for frame in sampled {
                let of_camera = |(camera, lag): (usize, &isize)| {
                    let frame = frame.checked_add_signed(*lag)?;
                    let change = exchanged[frame].map(|camera| (camera, Change::SidesExchanged));
                    self.pixel(frame, camera, point, change)
                };
                let seen: Vec<_> = lags.iter().enumerate().map(of_camera).collect();
                for (camera, offset) in offsets(self.rig, &seen).into_iter().flatten().enumerate() {
                    for (values, own) in off[camera].iter_mut().zip(offset.into_iter().flatten()) {
                        values.push(own);
                    }
                }
            }
            // what is off all the time is the calibration or the detector, not the clock
            for values in off.iter().flatten() {
                let Some(middle) = median(values.clone()) else { continue };
                sum += values.iter().map(|value| (value - middle).abs()).sum::<f64>();
                count += values.len() as f64;
            }
        }
        (count > 0.0).then(|| sum / count)
    }
}
