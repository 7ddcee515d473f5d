//! `skiagraph import`: makes the set.

use nalgebra::Vector3;

use super::agreement::{MOST_SAMPLES, Views, Witness};
use super::keypoints;
use super::masks::{self, MaskFacts, fitted, images_of, in_step, read_mask, reduced, size_of};
use super::start::FirstFrame;
use super::video;
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, Progress, Stage, advance, key_error};
use crate::prepare::rig::{camera_named, cameras_of_recording};
use crate::prepare::rig_doubts::doubts;
use crate::prepare::skins::recorded_body;
use crate::scenario::{RecordingFile, RigSettings};
use skiagraph_core::body::{BodyShape, Humanoid, Keypoint, KeypointLayout, LinkShape, Motion, ProposalScales};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::raster::Mask;
use skiagraph_set::{BlindSet, FootageParts, Start, StepSpread, Training, is_set};

/// Greatest distance between cameras that are believed, metres.
const FARTHEST_APART: f64 = 200.0;

/// Ankle, knee, hip and shoulder of each side.
const SIDES: [[Keypoint; 4]; 2] = [
    [Keypoint::LeftAnkle, Keypoint::LeftKnee, Keypoint::LeftHip, Keypoint::LeftShoulder],
    [Keypoint::RightAnkle, Keypoint::RightKnee, Keypoint::RightHip, Keypoint::RightShoulder],
];

/// A set that was made.
#[derive(Debug)]
pub struct Imported {
    pub set: BlindSet,
    pub notes: Vec<String>,
}

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
        let scratch = artefact.folder().join("frames");
        let rate = recording.frames_per_second;
        let (mut images, mut notes) = images_of(&self.path(&recording.masks.path), &calibrated, rate, &scratch)?;
        let mut skip = vec![0; images.len()];
        for (name, count) in &recording.skip {
            skip[camera_named(&format!("skip.{name}"), name, &calibrated.cameras)?] = *count;
        }
        let mut people = None;
        if let Some(settings) = &recording.keypoints {
            let (found, note) = keypoints::find(&self.path(&settings.path), &calibrated, &images)?;
            notes.extend(note);
            people = Some((settings, found));
        }
        let is_cut = recording.last_frame.is_some() || !recording.skip.is_empty();
        let all = in_step(&mut images, &calibrated, &skip, is_cut)?;
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
                    "expected images of at least 16 pixels in each direction, but those of `{}` would have {} x {}",
                    camera.name,
                    size[0] / recording.reduce,
                    size[1] / recording.reduce
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
        let mut keypoints = None;
        if let Some((settings, mut people)) = people {
            for (people, skip) in people.iter_mut().zip(&skip) {
                people.drain(..skip + first);
            }
            let (layout, views) = keypoints::read(people, settings, &rig, (frames, &masks_of), recording.reduce)?;
            let witness = Witness { rig: &rig, layout, views: &views };
            witness.check()?;
            notes.extend(witness.notes());
            notes.extend(witness.outside_of(masks_of)?);
            keypoints = Some((layout, views));
        }
        let first_masks = masks_of(0)?;
        if first_masks.iter().filter(|mask| !mask.is_empty()).count() < 2 && recording.start.set.is_none() {
            let brightest: Vec<f64> =
                images.iter().map(|images| masks::brightest(&images[first])).collect::<Result<_, _>>()?;
            let least = brightest.iter().copied().filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
            let is_dim = least < recording.masks.threshold;
            let (key, advice) = if is_dim {
                ("masks.threshold", format!("no pixel there is as bright; give masks.threshold = {:.4}", 0.5 * least))
            } else {
                ("first_frame", "begin with a later frame".to_owned())
            };
            let found = first_masks.iter().filter(|mask| !mask.is_empty()).count();
            let message =
                format!("expected somebody in the masks of two cameras in the first frame, found {found}: {advice}");
            return Err(key_error(key, message));
        }
        let start = self.start(&rig, &first_masks, keypoints.as_ref(), &mut notes)?;
        let motion = Motion { frames_per_second: rate, poses: vec![start.pose.clone()] };
        let (file, leave_out) = (recording.rig.file.clone(), recording.rig.leave_out.clone());
        let files = RigSettings { file, leave_out, ..RigSettings::default() };
        notes.extend(doubts(&files, &self.file.folder, &motion)?);
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
        notes.extend(masks::check(&rig, &found, recording.masks.inverted)?);
        video::forget(&scratch)?;
        artefact.finish()?;
        Ok(Imported { set: BlindSet::read(to.path)?, notes })
    }

    fn path(&self, path: &str) -> std::path::PathBuf {
        self.file.folder.join(path)
    }

    fn cameras(&self) -> Result<CameraRig, ExperimentError> {
        let rig = &self.file.recording.rig;
        let cameras = cameras_of_recording(&rig.file, &rig.leave_out, &self.file.folder)?;
        if cameras.cameras.len() < 2 {
            let message = "expected at least two cameras, found one, which cannot tell how far away the person is";
            return Err(key_error("rig", message));
        }
        let all = &cameras.cameras;
        let apart = all.iter().map(|own| (own.centre() - all[0].centre()).norm()).fold(0.0, f64::max);
        if apart > FARTHEST_APART {
            let message = format!(
                "expected cameras at most {FARTHEST_APART} m apart, found {apart:.0} m: the calibration is probably in \
                 millimetres (metres_per_unit = 0.001 in [[rig.file]]: {:.1} m apart) or in centimetres (0.01: {:.1} m)",
                0.001 * apart,
                0.01 * apart
            );
            return Err(key_error("rig.file", message));
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
        let (calibrate, has_known_stature) =
            (recording.tracker_body.calibrate, recording.tracker_body.stature_m.is_some());
        Ok(Start { body, pose, training: Training::Spread(spread), calibrate, has_known_stature })
    }

    fn body(&self, stature: f64) -> Result<Humanoid, ExperimentError> {
        let body = recorded_body(&self.file.recording.tracker_body, &self.file.folder)?;
        let Some(own) = body.stature().filter(|own| *own > 0.0) else {
            return Err(key_error("tracker_body.robot", "expected a body with a head and solids, found no stature"));
        };
        let scale = stature / own;
        let link = LinkShape { length: Vector3::repeat(scale), girth: scale };
        let scaled = body.reshaped(&BodyShape { links: vec![link; body.links.len()] });
        Ok(scaled.with_masses_of_skin())
    }
}
