//! `skiagraph import`: makes the set.

use std::path::Path;

use nalgebra::Vector3;

use super::keypoints::{self, KeypointSource};
use super::masks::{self, MaskFacts, fitted, images_of, read_mask, reduced, size_of};
use super::start::{FirstFrame, LEAST_CONFIDENCE};
use super::triangulation::triangulated;
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, Progress, Stage, advance, key_error};
use crate::prepare::rig::cameras_of_recording;
use crate::prepare::robots::{RobotChoice, robot};
use crate::prepare::skins::{WornSkin, attach_skin};
use crate::scenario::{RecordingFile, SolidsSource};
use skiagraph_core::body::{Blending, BodyShape, Humanoid, Keypoint, KeypointLayout, LinkShape, ProposalScales};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;
use skiagraph_set::{BlindSet, FootageParts, Start, StepSpread, Training, is_set};

/// Distance at which keypoints of different cameras disagree so much that their calibration is doubted, as a share of
/// the image's height.
const DOUBTFUL: f64 = 0.008;

/// Number of frames from which lengths and agreement are taken.
const MOST_SAMPLES: usize = 100;

/// Ankle, knee, hip and shoulder of each side.
const SIDES: [[Keypoint; 4]; 2] = [
    [Keypoint::LeftAnkle, Keypoint::LeftKnee, Keypoint::LeftHip, Keypoint::LeftShoulder],
    [Keypoint::RightAnkle, Keypoint::RightKnee, Keypoint::RightHip, Keypoint::RightShoulder],
];

/// A set that was made.
#[derive(Debug)]
pub struct Imported {
    /// The set.
    pub set: BlindSet,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// Found keypoints by frame, camera and point.
type Views = Vec<Vec<Vec<Option<FoundKeypoint>>>>;

/// Makes the set of a recording.
///
/// # Errors
/// [`ExperimentError`] that names the file or the key; nothing is written then.
pub fn import(file: &RecordingFile, to: Destination<'_>, progress: &dyn Progress) -> Result<Imported, ExperimentError> {
    if is_set(to.path) && !to.force {
        return Err(ExperimentError::SetThere { path: to.path.to_owned() });
    }
    Inputs::new(file.paths().into_values()).keep_from(to.path)?;
    let made = Making { file, progress }.make(to);
    made.map_err(|error| match error {
        ExperimentError::Key(error) => file.located(&error).into(),
        other => other,
    })
}

struct Making<'a> {
    file: &'a RecordingFile,
    progress: &'a dyn Progress,
}

impl Making<'_> {
    fn make(&self, to: Destination<'_>) -> Result<Imported, ExperimentError> {
        let recording = &self.file.recording;
        let settings = serde_json::to_value(recording).unwrap_or_default();
        let made_by = MadeBy::new("skiagraph import", settings);
        let difference = if is_set(to.path) { made_by.difference_at(to.path) } else { None };
        let artefact = Artefact::begin_unless(to, ArtefactKind::Set, difference)?;
        let calibrated = self.cameras()?;
        let mut notes = Vec::new();
        let (images, note) = images_of(&self.path(&recording.masks.path), &calibrated)?;
        notes.extend(note);
        let all = images[0].len();
        let last = recording.last_frame.unwrap_or(all - 1);
        if last >= all {
            let message = format!("expected at most {}, the last of {all} images, found {last}", all - 1);
            return Err(key_error("last_frame", message));
        }
        let (first, frames) = (recording.first_frame, (last + 1).saturating_sub(recording.first_frame));
        if frames == 0 {
            return Err(key_error("first_frame", format!("expected at most {last}, the last image, found {first}")));
        }
        let (mut sizes, mut cameras) = (Vec::new(), Vec::new());
        for (camera, images) in calibrated.cameras.iter().zip(&images) {
            let size = size_of(&images[first])?;
            if size.iter().any(|side| *side < 16 * recording.reduce) {
                let message = format!(
                    "expected at least 16 pixels in each direction, but images of `{}` have {} x {}",
                    camera.name, size[0], size[1]
                );
                return Err(key_error("reduce", message));
            }
            cameras.push(reduced(fitted(camera, size, recording.masks.fit, &images[first])?, recording.reduce));
            sizes.push(size);
        }
        let rig = CameraRig { cameras };
        let masks_of = |frame: usize| -> Result<Vec<Mask>, ExperimentError> {
            let of_camera = |(images, size): (&Vec<std::path::PathBuf>, &[u32; 2])| {
                read_mask(&images[first + frame], *size, &recording.masks, recording.reduce)
            };
            images.iter().zip(&sizes).map(of_camera).collect()
        };
        self.progress.begin(Stage::Segment, frames);
        let keypoints = match &recording.keypoints {
            None => None,
            Some(settings) => {
                let (source, note) = KeypointSource::find(&self.path(&settings.path), &rig, all)?;
                notes.extend(note);
                // all masks at once, one bit a pixel, because they say which of several people is meant
                let masks = parallel::map(frames, masks_of).into_iter().collect::<Result<Vec<_>, _>>()?;
                Some(keypoints::read(&source, settings, &masks, (first, recording.reduce))?)
            }
        };
        if let Some((_, views)) = &keypoints {
            notes.extend(agreement(&rig, views));
        }
        let start = self.start(&rig, &masks_of(0)?, keypoints.as_ref(), &mut notes)?;
        let record = made_by.text()?;
        let parts = FootageParts {
            name: &recording.name,
            rig: &rig,
            frames,
            frames_per_second: recording.frames_per_second,
            start: &start,
            keypoints: keypoints.as_ref().map(|(layout, views)| (*layout, views.as_slice())),
            made_by: &record,
        };
        let observe = |frame: usize| -> Result<(Vec<Mask>, Vec<MaskFacts>), ExperimentError> {
            let masks = masks_of(frame)?;
            advance(self.progress)?;
            let facts = masks.iter().map(MaskFacts::new).collect();
            Ok((masks, facts))
        };
        let found = parts.write(artefact.folder(), &|| self.progress.interrupted(), observe)?;
        notes.extend(masks::check(&rig, &found)?);
        artefact.finish()?;
        Ok(Imported { set: BlindSet::read(to.path)?, notes })
    }

    fn path(&self, path: &str) -> std::path::PathBuf {
        self.file.folder.join(path)
    }

    /// The cameras as they are calibrated.
    fn cameras(&self) -> Result<CameraRig, ExperimentError> {
        let rig = &self.file.recording.rig;
        let cameras = cameras_of_recording(&rig.file, &rig.leave_out, &self.file.folder)?;
        if cameras.cameras.len() < 2 {
            let message = "expected at least two cameras, found one, which cannot tell how far away the person is";
            return Err(key_error("rig", message));
        }
        Ok(cameras)
    }

    /// The body, its pose in the first frame and its spread.
    fn start(
        &self,
        rig: &CameraRig,
        masks: &[Mask],
        keypoints: Option<&(KeypointLayout, Views)>,
        notes: &mut Vec<String>,
    ) -> Result<Start, ExperimentError> {
        let recording = &self.file.recording;
        if let Some(set) = &recording.start.set {
            return Ok(BlindSet::read(&self.path(set))?.start);
        }
        let in_frame = |frame: usize| keypoints.map(|(layout, views)| (*layout, views[frame].as_slice()));
        let first = FirstFrame { rig, masks, keypoints: in_frame(0) };
        if first.cameras() < 2 {
            let message = format!(
                "expected somebody in the masks of two cameras in the first frame, found {}: begin with a later frame",
                first.cameras()
            );
            return Err(key_error("first_frame", message));
        }
        let frames = keypoints.map_or(0, |(_, views)| views.len());
        let sampled = (0..frames).step_by(frames.div_ceil(MOST_SAMPLES).max(1));
        let sides = sampled.flat_map(|frame| SIDES.map(|side| (in_frame(frame), side)));
        let lengths = sides.filter_map(|(keypoints, side)| FirstFrame { rig, masks: &[], keypoints }.length(side));
        let (stature, note) = first.stature_or_usual(recording.tracker_body.stature_m, lengths.collect());
        notes.extend(note);
        let body = self.body(stature)?;
        let heading = recording.start.heading_deg.map(f64::to_radians);
        let Some((pose, note)) = first.pose(&body, heading) else {
            let message = "the cameras do not agree about where the person is in the first frame; check the calibration, \
                           and whether masks belong to their cameras";
            return Err(key_error("rig", message));
        };
        notes.push(note);
        let usual = ProposalScales::for_human(&body, recording.frames_per_second).in_step_order();
        let spread = StepSpread { change: usual.clone(), change_of_change: usual };
        let calibrate = recording.tracker_body.calibrate;
        Ok(Start { body, pose, training: Training::Spread(spread), calibrate })
    }

    /// The tracker's body with this stature, metres.
    fn body(&self, stature: f64) -> Result<Humanoid, ExperimentError> {
        let (settings, folder): (_, &Path) = (&self.file.recording.tracker_body, &self.file.folder);
        let choice = RobotChoice {
            table: "tracker_body",
            robot: &settings.robot,
            solids: SolidsSource::default(),
            has_skin: settings.skin.is_some(),
        };
        let joint_map = std::collections::BTreeMap::new();
        let worn = WornSkin { name: settings.skin.as_ref(), joint_map: &joint_map, blending: Blending::Linear };
        let (body, _) = attach_skin(folder, "tracker_body", robot(folder, &choice)?, worn)?;
        let Some(own) = body.stature().filter(|own| *own > 0.0) else {
            return Err(key_error("tracker_body.robot", "expected a body with a head and solids, found no stature"));
        };
        let scale = stature / own;
        let link = LinkShape { length: Vector3::repeat(scale), girth: scale };
        let scaled = body.reshaped(&BodyShape { links: vec![link; body.links.len()] });
        Ok(scaled.with_masses_of_skin())
    }
}

/// How well keypoints of different cameras agree: a note on the calibration, before anything is tracked.
fn agreement(rig: &CameraRig, views: &Views) -> Option<String> {
    let mut off: Vec<Vec<f64>> = vec![Vec::new(); rig.cameras.len()];
    let points = views.first()?.first()?.len();
    for frame in views.iter().step_by(views.len().div_ceil(MOST_SAMPLES)) {
        #[expect(clippy::needless_range_loop, reason = "a point is one column of every camera")]
        for point in 0..points {
            let seen: Vec<(usize, [f64; 2])> = (0..rig.cameras.len())
                .filter_map(|camera| {
                    Some((camera, frame[camera][point].filter(|p| p.confidence >= LEAST_CONFIDENCE)?.pixel))
                })
                .collect();
            let Some(place) = triangulated(seen.iter().map(|(camera, pixel)| (&rig.cameras[*camera], *pixel))) else {
                continue;
            };
            for (camera, [x, y]) in seen {
                let projected = rig.cameras[camera].project(&place);
                off[camera].extend(projected.map(|pixel| (pixel.x - x).hypot(pixel.y - y)));
            }
        }
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let each: Vec<(String, f64, f64)> = rig
        .cameras
        .iter()
        .zip(&mut off)
        .filter_map(|(camera, off)| Some((camera.name.clone(), median(off)?, f64::from(camera.pinhole.height))))
        .collect();
    let words: Vec<String> = each.iter().map(|(name, px, _)| format!("{name} {px:.1} px")).collect();
    let is_doubtful = each.iter().any(|(_, px, height)| *px > DOUBTFUL * height);
    let advice = "; more than a detector's noise: check the calibration, the size of the images and whether cameras are \
                  synchronous, and let the tracker calibrate";
    (!each.is_empty()).then(|| {
        format!(
            "keypoints triangulated from all cameras are off by (median): {}{}",
            words.join(", "),
            if is_doubtful { advice } else { "" }
        )
    })
}
